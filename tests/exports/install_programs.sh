#!/bin/sh
# Programs that run the exports in tests: without one, its tests are skipped and say so.
set -e
test "$(id -u)" = 0 && command -v apt-get >/dev/null || { echo "not root, or no apt-get: export tests that need gcc, clang, octave or libsdformat12 are skipped" >&2; exit 0; }
for word in gcc:gcc g++:g++ clang:clang octave:octave; do
  command -v "${word%%:*}" >/dev/null || missing="$missing ${word##*:}"
done
ls /usr/lib/*/libsdformat12.so.12 >/dev/null 2>&1 || missing="$missing libsdformat12-12"
test -z "$missing" || { apt-get update -qq; apt-get install -y -qq --no-install-recommends $missing; } >/dev/null
