"""Small files that ask for much: clocks that jump, bytes that unpack without end, nesting without bottom."""

import gzip
import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from .running import undertow
from .trial import Attack, Ground, Job, Trial, contents, differences, raw

GIB = 1 << 30
UNPACKED = 10 * GIB
"""Bytes to which the gzip bomb unpacks."""
CLOCK = 1.7e9
"""Seconds by which a clock jumps that is set from 1970 to today."""


def attacks(ground: Ground, scratch: Path) -> Iterator[Attack]:
    """The rows: clocks, unpacking, YAML, JSON, and ESC bytes within files."""
    yield Attack("bombs", "a clock that jumps", [_clock(ground, jump) for jump in (CLOCK, -CLOCK, 1e15, 1e300)])
    bomb = scratch / "bomb.csv.gz"
    _gzip_bomb(bomb)
    yield Attack(
        "bombs", "a gzip file of 10 MB that unpacks to 10 GiB", [_asked(ground, bomb, words) for words in GZIP]
    )
    for name, texts in (("YAML", YAML), ("JSON", JSON)):
        yield Attack(
            "bombs", f"{name} that is deep, endless or absurd", [_text(ground, t, name) for t in texts.values()]
        )
    yield Attack("bombs", "ESC bytes in files", [_escaped(ground, place) for place in ("header", "name", "finding")])


def _clock(ground: Ground, jump: float) -> Job:
    def job(folder: Path) -> Trial:
        ground.laid(folder, ("a.csv", "boat.yaml"))
        lines = (folder / "a.csv").read_text().splitlines()
        for k in range(len(lines) // 2, len(lines)):
            stamp, rest = lines[k].split(",", 1)
            lines[k] = f"{float(stamp) + jump!r},{rest}"
        (folder / "jump.csv").write_text("\n".join(lines) + "\n")
        end = undertow("inspect", "jump.csv", "-v", "boat.yaml", cwd=folder)
        said = b"clock" in end.told or b"jump" in end.told or b"gap" in end.told or b"time" in end.told
        wrong = "" if end.code in (0, 1, 2) and said else f"not a word of the clock: {end}"
        return Trial(f"jump of {jump:g} s: {end}", (end,), wrong=wrong)

    return job


def _gzip_bomb(path: Path) -> None:
    """Blank lines after a sound header, in members of 64 MiB, all the same."""
    member = gzip.compress(b"\n" * (1 << 26), 9)
    with path.open("wb") as stream:
        stream.write(gzip.compress(b"time,topic,field,value\n0.0,/odom,twist.linear.x,0.0\n"))
        for _ in range(UNPACKED >> 26):
            stream.write(member)


GZIP: tuple[tuple[str, ...], ...] = (
    ("inspect", "BOMB"),
    ("discover", "BOMB", "-v", "boat.yaml", "--out", "out"),
    ("simulate", "-v", "boat.yaml", "--out", "BOMB"),
)


def _asked(ground: Ground, bomb: Path, words: tuple[str, ...]) -> Job:
    def job(folder: Path) -> Trial:
        ground.laid(folder, ("boat.yaml",))
        name = "bomb.csv.gz"
        (folder / name).symlink_to(bomb)
        end = undertow(*[name if word == "BOMB" else word for word in words], cwd=folder)
        wrong = "" if end.code == 2 else f"exit code {end.code}, not 2: {end}"
        return Trial(str(end), (end,), wrong=wrong)

    return job


def _laughs(levels: int) -> str:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, levels)]
    return "\n".join([*lines, f"mass: *a{levels - 1}\n"])


def _mass(value: str) -> Callable[[str], str]:
    def put(boat: str) -> str:
        lines = [f"mass: {value}" if line.startswith("mass:") else line for line in boat.splitlines()]
        return "\n".join(lines) + "\n"

    return put


YAML: Mapping[str, Callable[[str], str]] = {
    **{
        f"mass: {value[:20]}": _mass(value)
        for value in (
            *(
                "[" * 200_000,
                "[" * 1_500,
                "{a: " * 5_000,
                "2001-99-99",
                '!!int ""',
                "!!float x",
                "9" * 5_000,
                "1.0e-308",
            ),
            *(
                "true",
                "!!python/object:os.system {}",
                "*nothing",
                "&a [*a]",
                "!!binary x",
                "!!timestamp x",
                "!!set {1}",
            ),
            *("1.0e+308", ".nan", ".inf", "-.inf", "0x" + "f" * 10_000, "1:2:3:4", "!!omap [1]", '"\\ud800"', "|", "'"),
        )
    },
    "laughs": lambda boat: _laughs(9) + boat,
    "sources": lambda boat: boat + "\nsources: &s {x: *s}\n",
    "anchors": lambda boat: "x: &x\n" + "".join(f"  k{k}: *x\n" for k in range(5)) + boat,
    "long key": lambda boat: f"{'k' * 100_000}: 1\n{boat}",
    "many keys": lambda boat: "".join(f"k{k}: 1\n" for k in range(20_000)) + boat,
    "merge": lambda boat: f"<<: [{', '.join(['{a: 1}'] * 1000)}]\n{boat}",
    "nothing": lambda _: "",
    "zeros": lambda _: "\0" * 1000,
    "documents": lambda boat: boat + "---\n" + boat,
    "tabs": lambda boat: boat.replace("  ", "\t"),
    "indented": lambda boat: boat + "".join(f"{' ' * k}k:\n" for k in range(3_000)),
}
"""Vehicle files, made of a sound one; the same text is given as a channel map."""
JSON: Mapping[str, Callable[[str], str]] = {
    "deep lists": lambda _: "[" * 100_000,
    "deep mappings": lambda _: '{"a":' * 100_000,
    "closed and deep": lambda _: "[" * 5_000 + "]" * 5_000,
    "deep within": lambda text: text.replace("{", '{"deep": ' + "[" * 3_000 + "]" * 3_000 + ",", 1),
    "long number": lambda text: text.replace("{", '{"long": ' + "9" * 6_000 + ",", 1),
    "large": lambda text: text.replace("{", '{"large": 1e999,', 1),
    "surrogate": lambda text: text.replace("{", '{"half": "\\ud800",', 1),
    "empty": lambda _: "{}",
    "null": lambda _: "null",
    "nothing": lambda _: "",
    "twice": lambda text: text + text,
    "long schema": lambda _: json.dumps({"schema": "x" * 1_000_000}),
}
"""`findings.json` of a run, made of a sound one."""


def _text(ground: Ground, spoilt: Callable[[str], str], name: str) -> Job:
    def job(folder: Path) -> Trial:
        ground.laid(folder)
        if name == "JSON":
            path = folder / "mon" / "findings.json"
            calls = [("report", "mon"), ("compare", "a.csv", "-v", "boat.yaml", "--model", "mon")]
        else:
            path = folder / "boat.yaml"
            calls = [("check", "boat.yaml"), ("inspect", "a.csv", "--map", "boat.yaml")]
        path.write_text(spoilt(path.read_text("utf-8")), "utf-8")
        before = contents(folder)
        ends = [undertow(*words, cwd=folder) for words in calls]
        wrong = [f"exit code {end.code}: {end}" for end in ends if end.code not in (0, 1, 2)]
        changed = differences(contents(folder), before) if ends[0].code == 2 else ""
        return Trial(str(ends[0]), tuple(ends), wrong="; ".join([*wrong, *map(raw, ends)]).strip("; ") or changed)

    return job


ESC = "\x1b[2J\x1b]0;gone\x07"


def _escaped(ground: Ground, place: str) -> Job:
    def job(folder: Path) -> Trial:
        ground.laid(folder)
        if place == "header":
            log = folder / "a.csv"
            log.write_text(log.read_text().replace("/", f"/{ESC}", 20))
            end = undertow("inspect", "a.csv", cwd=folder)
        elif place == "name":
            boat = folder / "boat.yaml"
            shown = json.dumps(f"boat {ESC}")
            boat.write_text(
                "\n".join(f"name: {shown}" if x.startswith("name:") else x for x in boat.read_text().splitlines())
            )
            end = undertow("check", "boat.yaml", cwd=folder)
        else:
            path = folder / "mon" / "findings.json"
            found = json.loads(path.read_text())
            found["headline"] = f"{ESC}{found['headline']}"
            path.write_text(json.dumps(found))
            end = undertow("report", "mon", cwd=folder)
            if "\x1b" in (folder / "mon" / "report.html").read_text("utf-8"):
                return Trial(str(end), (end,), wrong="an ESC byte is on the page")
        wrong = "" if end.code in (0, 1, 2) else f"exit code {end.code}: {end}"
        return Trial(f"{place}: {end}", (end,), wrong=wrong or raw(end))

    return job
