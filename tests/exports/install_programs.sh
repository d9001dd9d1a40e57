#!/bin/sh
# Programs that run what is exported, for tests that are skipped without them. What cannot be installed is said, and fails nothing.
missing=
for program in gcc g++ clang octave; do
  command -v "$program" >/dev/null || missing="$missing $program"
done
ls /usr/lib/*/libsdformat12.so.12 >/dev/null 2>&1 || missing="$missing libsdformat12-12"
test -n "$missing" || exit 0
if test "$(id -u)" = 0 && command -v apt-get >/dev/null; then
  apt-get update -qq >/dev/null 2>&1
  DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing >/dev/null 2>&1 && exit 0
fi
echo "not installed:$missing (needs root and apt-get); tests of exports that need one are skipped" >&2
