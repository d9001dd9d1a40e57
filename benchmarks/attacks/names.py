"""File names as disks allow them: spaces, quotes, newlines, dashes, control bytes, no text at all, and long ones."""

import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path

from .running import Ended, Word, undertow
from .trial import Attack, Ground, Job, Trial, contents, raw

NAMES: dict[str, bytes] = {
    "spaces": b"  two  words  ",
    "quotes": b'it\'s "mine" `$(true)`',
    "a newline": b"one\ntwo",
    "a leading dash": b"-v",
    "a leading tilde and star": b"~*?[a]",
    "brackets of markup": b"[bold red]x[/]",
    "braces, percent and backslash": b"{x}%s%d\\n\\",
    "control bytes": b"\x1b[2J\x1b]0;x\x07\r\x7f",
    "bytes that are no UTF-8": b"b\xff\xfe\x80t",
    "half a surrogate, right-to-left": "x\u202ey\u2028z".encode() + b"\xed\xa0\x80",
    "other scripts": "船の記録 Bootslöß 🚤".encode(),
    "YAML in it": b"a: &b [*b] #",
    "HTML in it": b"<script>alert(1)<",
    "a colon": b"boats.mine:drag",
}
"""Bytes of names; a suffix follows where the kind of the file is told by it."""
LONGEST = 255
"""Bytes that a name may have on most disks."""

Call = Callable[[Path, bytes], Sequence[Word]]


def attacks(ground: Ground) -> Iterator[Attack]:
    """A row for each place where a name may stand."""
    for what, call in CALLS.items():
        jobs = [_named(ground, call, name) for name in NAMES.values()]
        yield Attack("names", f"strange names: {what}", jobs)
    jobs = [_named(ground, call, b"x" * (LONGEST - 8)) for call in CALLS.values()]
    jobs += [_named(ground, call, b"\xc3\xa9" * 150) for call in CALLS.values()]
    yield Attack("names", "names of 255 bytes, and longer ones than disks allow", jobs)
    yield Attack("names", "paths of 4,000 bytes and more", [_deep(ground, call) for call in CALLS.values()])


def _put(folder: Path, source: str, name: bytes) -> bytes:
    """A sound file under a strange name, told so that a dash is no option."""
    given, target = folder / source, folder / os.fsdecode(name)
    with suppress(OSError):  # a name that the disk does not take: the verb is then asked for what is not there
        shutil.copytree(given, target) if given.is_dir() else shutil.copy(given, target)
    return b"./" + name


def _log(folder: Path, name: bytes) -> Sequence[Word]:
    return ("inspect", _put(folder, "a.csv", name + b".csv"))


def _as_it_is(folder: Path, name: bytes) -> Sequence[Word]:
    """Without `./`, so that a dash is taken for an option: any clear answer will do."""
    return ("inspect", _put(folder, "a.csv", name + b".csv")[2:], "--json")


def _vehicle(folder: Path, name: bytes) -> Sequence[Word]:
    return ("check", _put(folder, "boat.yaml", name + b".yaml"))


def _map(folder: Path, name: bytes) -> Sequence[Word]:
    return (
        "inspect",
        "a.csv",
        "--map",
        _put(folder, "map.yaml", name + b".yaml"),
        "--map-out",
        b"./o" + name + b".yaml",
    )


def _out(_: Path, name: bytes) -> Sequence[Word]:
    return ("simulate", "-v", "boat.yaml", "--duration", "20", "--out", b"./" + name + b".csv")


def _run(folder: Path, name: bytes) -> Sequence[Word]:
    return ("report", _put(folder, "mon", name), "--out", b"./" + name[:100] + b".html")


def _new_run(folder: Path, name: bytes) -> Sequence[Word]:
    return ("discover", _put(folder, "a.csv", name + b".csv"), "-v", "boat.yaml", "--out", b"./" + name, "--json")


def _network(folder: Path, name: bytes) -> Sequence[Word]:
    return (
        "compare",
        "a.csv",
        "-v",
        "boat.yaml",
        "--model",
        _put(folder, "net", name),
        "--out",
        b"./o" + name + b".json",
    )


def _text(_: Path, name: bytes) -> Sequence[Word]:
    return ("simulate", "-v", name, "--effect", name, "--programme", name, "--out", "x.csv")


CALLS: dict[str, Call] = {
    "a log": _log,
    "a log without ./": _as_it_is,
    "a vehicle": _vehicle,
    "a channel map, and --map-out": _map,
    "a log to write": _out,
    "a run folder, and its page": _run,
    "a log and a run folder to write": _new_run,
    "a network, and a comparison to write": _network,
    "in the place of words": _text,
}
"""Where a name may stand; each must do its work or say in one clear message why not."""


def _named(ground: Ground, call: Call, name: bytes) -> Job:
    def job(folder: Path) -> Trial:
        ground.laid(folder)
        words = call(folder, name)
        before = contents(folder)
        return _judged(undertow(*words, cwd=folder), folder, before)

    return job


def _judged(end: Ended, folder: Path, before: dict[str, str]) -> Trial:
    now = contents(folder)
    lost = [name for name in before if name not in now]
    left = [name for name in now if "undertow-" in name or name.endswith(".tmp") or ".undertow." in name]
    wrong = "" if end.code in (0, 1) or (end.code == 2 and end.err.strip()) else f"exit code {end.code}: {end}"
    wrong = wrong or raw(end) or (f"left over: {left}" if left else "")
    return Trial(str(end), (end,), ", ".join(lost), "", wrong)


def _deep(ground: Ground, call: Call) -> Job:
    """The same name, reached by a path that is longer than the system takes."""

    def job(folder: Path) -> Trial:
        ground.laid(folder)
        long = b"/".join([b"d" * 250] * 17)
        words = [word if not isinstance(word, bytes) else b"./" + long + b"/" + word for word in call(folder, b"x")]
        before = contents(folder)
        return _judged(undertow(*words, cwd=folder), folder, before)

    return job
