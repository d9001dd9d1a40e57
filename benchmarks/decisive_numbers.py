"""List the numbers that decide a verdict, or a refusal, and where each comes from.

A number is a constant of a module of discovery or of the checks of a log; those of the computation (caches, seeds,
rounding, steps, how many trials, in which band and over which pieces) decide nothing: their sentences have words of
`COMPUTATION`. A number is calibrated where its sentence names a script or a page of one, or where a script writes it
(the odds), derived where its sentence says from what (words of `DERIVED`), and else a judgement of ours, until somebody
says where it comes from. What `steady_numbers.py` has seen to change an answer decides, whatever its sentence says.

    python benchmarks/decisive_numbers.py [--every]
"""

import ast
import json
import re
import sys
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
MOST = 40
ROOMS = ("discovery", "measurements/quality")
ELSEWHERE = ("calibration", "experiment", "distillation", "factors", "lawful", "identifiability")
"""Rooms and files of discovery that decide no verdict: they fit, plan, and say what a log can show."""
COMPUTATION = re.compile(
    r"bytes?\b|\bseed|rounding|cache|at hand|are kept|kept at|Newton|Gauss|halv|steps of|Fits? after|times that|"
    r"columns? is taken|are tried|tried in full|at once|regulari|ridge|precision|how many draws|Resamples|numbers of|"
    r"differentiated|derivative is taken|the same noise is drawn|is rounded|a step is a thirtieth|bends no column|"
    r"costs time|stands for none|it does not matter any more|divided by|even time base|length of a piece|"
    r"band in which|no number that decides",
    re.IGNORECASE,
)
"""Words of the sentences of numbers that only say how something is computed."""
DERIVED = re.compile(
    r"degrees of freedom|by chance|standard errors|theor|sign test|Student|\bt\b of|quantile|per cent|95 %|"
    r"one in|exp\(|all of it|doi:|chapter|more resamples are for it",
    re.IGNORECASE,
)
"""Words by which a sentence derives its number."""


REFUSES = re.compile(r"size_of|Kind\.|OVERWHELMING =")
"""What the source of a check has whose faults may refuse a log, or that says how sure a refusal must be."""


class Number(NamedTuple):
    """A constant: where it stands, its name, its value as it is written, its sentence, and where it comes from."""

    path: str
    name: str
    value: str
    sentence: str
    origin: str


def constants(path: Path) -> Iterator[Number]:
    """The numeric constants of a module with their sentences."""
    body = ast.parse(path.read_text("utf-8")).body
    for node, after in zip(body, [*body[1:], None], strict=True):
        if not isinstance(node, ast.Assign) or not any(
            isinstance(c, ast.Constant) and isinstance(c.value, int | float) for c in ast.walk(node.value)
        ):
            continue
        value, name = ast.unparse(node.value), ast.unparse(node.targets[0])
        told = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
        sentence = " ".join(str(after.value.value).split()) if told else ""  # pyright: ignore[reportAttributeAccessIssue, reportOptionalMemberAccess]
        if re.match(r"^[-+\d(]|^1\.0 /|^float\(|^np\.radians", value) and len(value) < 80:
            yield Number(path.relative_to(ROOT).as_posix(), name, value, sentence, origin(sentence))


def decides(path: Path) -> bool:
    """Whether a module can decide a verdict, or refuse a log: a check whose findings only warn does neither."""
    return "quality" not in path.parts or bool(REFUSES.search(path.read_text("utf-8")))


def origin(sentence: str) -> str:
    """Where a number comes from, by its sentence."""
    if COMPUTATION.search(sentence):
        return "computation"
    if re.search(r"benchmarks/\w+\.py|docs/\w+\.md", sentence):
        return "calibrated"
    return "derived" if DERIVED.search(sentence) else "judgement"


def listed() -> list[Number]:
    """All numbers, those of the odds among them."""
    odds = json.loads((ROOT / "discovery" / "odds.json").read_text("utf-8"))
    found = [
        Number("discovery/odds.json", f"{judge}, {name}", f"{weight:g}", "benchmarks/odds.py", "calibrated")
        for judge in ("forces", "rollouts")
        for name, weight in {"intercept": odds[judge]["intercept"], **odds[judge]["weights"]}.items()
    ]
    found += [
        Number("discovery/odds.json", f"calibration, {name}", f"{value:g}", "benchmarks/odds.py", "calibrated")
        for name, value in zip(("shift", "low slope", "high slope"), odds["calibration"], strict=True)
    ]
    for room in ROOMS:
        for path in sorted((ROOT / room).rglob("*.py")):
            if not set(path.relative_to(ROOT).with_suffix("").parts) & set(ELSEWHERE) and decides(path):
                found += constants(path)
    return found


def decisive() -> list[Number]:
    """The numbers that decide: by their sentences, or as they were seen to at half or at twice."""
    seen = [
        number._replace(origin="judgement") if number.origin == "computation" and steady(number) is False else number
        for number in listed()
    ]
    return [number for number in seen if number.origin != "computation"]


def candidates() -> list[Number]:
    """The numbers of discovery that may decide a verdict, whatever their sentences say; see `steady_numbers.py`."""
    rooms = [
        path
        for path in sorted((ROOT / "discovery").rglob("*.py"))
        if not set(path.with_suffix("").parts) & set(ELSEWHERE)
    ]
    return [number for path in rooms for number in constants(path)]


def steady(number: Number) -> bool | None:
    """Whether half and twice a number changed nothing that is said of some logs; None where that was not tried."""
    tried = _tried().get(f"{number.path}: {number.name}", {})
    return not tried["decides"] if tried.get("value") == number.value else None


@cache
def _tried() -> dict[str, dict[str, object]]:
    """What `steady_numbers.py` kept."""
    kept = ROOT / "benchmarks" / "records" / "steady_numbers.json"
    return dict(json.loads(kept.read_text("utf-8"))) if kept.exists() else {}


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the numbers by room and origin; with `--every` each of them."""
    given = sys.argv[1:] if arguments is None else arguments
    numbers = decisive()
    if "--every" in given:
        for number in numbers:
            print(f"{number.path}: {number.name} = {number.value} ({number.origin}): {number.sentence[:100]}")
    for room in ROOMS:
        own = [number.origin for number in numbers if number.path.startswith(room)]
        counts = ", ".join(f"{own.count(word)} {word}" for word in ("calibrated", "derived", "judgement"))
        print(f"{room}: {len(own)} numbers, {counts}")
    ours = sum(number.origin == "judgement" for number in numbers)
    tried = [number for number in candidates() if steady(number) is not None]
    move = sum(not steady(number) for number in tried)
    print(
        f"discovery: of {len(tried)} numbers at half and at twice {move} change a name or its odds (steady_numbers.py)"
    )
    told = "yes" if len(numbers) <= MOST and not ours else "no"
    print(f"{len(numbers)} numbers decide, {ours} neither calibrated nor derived (at most {MOST} and none): {told}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
