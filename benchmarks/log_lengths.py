"""What a short log can tell: how often an effect is named in it that five minutes name, and how often a wrong one is.

Random hulls with one effect of the catalogue (each in turn) or none are driven for five minutes; then discovery gets a
piece of each log, from a random moment on. A short piece may show too little of an effect, and honest answers are then
"undecided" and "nothing"; a wrong name is never one. Results are kept in a folder, as those of `hidden_effects.py` are.

    python benchmarks/log_lengths.py [--logs 100] [--seeds tuning|reporting] [--jobs N] [--tell]
        [--table docs/log_lengths.md]

Exit code 1 where more than one piece in a hundred got a wrong name.
"""

import sys
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from study.judging import standing
from study.resumed import Kept, Study, bound, carried_out, in_a_table
from study.worlds import ALL, DURATION, STEP, Part, draw, label

from undertow.discovery.discover import find_missing
from undertow.physics.effects import EFFECTS
from undertow.physics.errors import RequestError

FIRST = {"tuning": 220_000, "reporting": 230_000}
LENGTHS = (20.0, 30.0, 45.0, 60.0, 90.0, 120.0, DURATION)
"""Lengths of the pieces [s]; the last is the whole log."""
SHORT = len(LENGTHS) - 1
"""Pieces of a log that are shorter than it."""
HIDDEN = Part("one effect, all programmes", 1, 0, 0, ALL, ("field",))
NOTHING = Part("nothing, all programmes", 0, 0, 0, ALL, ("field",))
NONE_IN = 5
"""Every so many logs one has nothing hidden."""
MOST = 0.01
"""Share of the short pieces that may get a wrong name."""
INTRODUCTION = """Random sisters of the shipped vehicles with one hidden effect (each of the catalogue in turn) or none,
field noise, rich, zigzag and gentle programmes. Each log is of five minutes; discovery gets a piece of it, from a
random moment on, and the whole. Wrong: what is called missing, an unnamed term included, is not hidden. Right where
the whole log is: the hidden effect is named in the piece, of those that it is named of in the whole log. Open: it is
named, or stands with those that the piece cannot tell from another, or is called possible."""


def judge(first: int, number: int) -> dict[str, Any]:
    """What is said of one log, whole and in pieces."""
    nothing = number % NONE_IN == NONE_IN - 1
    # One number further each time all effects had their turn, lest each meets one programme alone.
    turn = number + number // len(EFFECTS)
    case = draw(NOTHING if nothing else HIDDEN, turn, first + number)
    whole = case.log.motion(STEP)
    rng, answers = np.random.default_rng([first + number, 6]), {}
    for length in LENGTHS:
        rows = min(round(length / STEP) + 1, whole.time.size)
        begin = int(rng.integers(0, whole.time.size - rows + 1))
        try:
            findings = find_missing([whole.slice(begin, begin + rows)], case.nominal).findings
        except RequestError as error:
            answers[f"{length:g}"] = {"verdict": "refused", "why": str(error)[:200], "missing": [], "standing": {}}
            continue
        effects = {label(e.effect, [t.symbol for t in e.terms]): e for e in findings.candidates}
        answers[f"{length:g}"] = {
            "verdict": findings.verdict,
            "missing": [name for name, e in effects.items() if e.verdict == "missing"]
            + [term.symbol for term in findings.unnamed],
            "standing": {name: standing(effects, name) for name in case.hidden},
        }
    return {**case.setting, "hidden": list(case.hidden), "answers": answers}


def wrong(record: Mapping[str, Any], length: float) -> list[str]:
    """What is named of a piece and not hidden."""
    return [name for name in record["answers"][f"{length:g}"]["missing"] if name not in record["hidden"]]


def mistaken(records: Sequence[Mapping[str, Any]]) -> list[tuple[Mapping[str, Any], float]]:
    """Short pieces that got a wrong name: the log of each, and its length [s]."""
    return [(r, length) for r in records for length in LENGTHS[:SHORT] if wrong(r, length)]


def right(record: Mapping[str, Any], length: float) -> bool:
    """Whether exactly what is hidden is named of a piece."""
    return record["answers"][f"{length:g}"]["missing"] == record["hidden"]


def curve(records: Sequence[Mapping[str, Any]]) -> list[tuple[object, ...]]:
    """A row for each length."""
    rows: list[tuple[object, ...]] = []
    hiding = [r for r in records if r["hidden"] and right(r, DURATION)]
    for length in LENGTHS:
        told = [r["answers"][f"{length:g}"] for r in records]
        false = sum(bool(wrong(r, length)) for r in records)
        same = sum(right(r, length) for r in hiding)
        seen = sum(all(s != "no evidence" for s in r["answers"][f"{length:g}"]["standing"].values()) for r in hiding)
        open_ends = sum(answer["verdict"] == "undecided" for answer in told)
        refused = sum(answer["verdict"] == "refused" for answer in told)
        most = bound(false, len(records), 0.95)
        shares = [f"{hits / max(len(hiding), 1):.0%}" for hits in (same, seen)]
        rows.append((f"{length:g} s", len(records), false, f"{most:.1%}", *shares, open_ends, refused))
    return rows


def page(records: Sequence[Mapping[str, Any]], command: str) -> str:
    """The study as a page in Markdown."""
    false, pieces = mistaken(records), SHORT * len(records)
    share = len(false) / max(pieces, 1)
    head = (
        "length",
        "logs",
        "wrong",
        "95 % sure below",
        "right where the whole log is",
        "open",
        "undecided",
        "refused",
    )
    rows = [
        f"- {length:g} s of seed {r['seed']} ({r['vehicle']}, {r['programme']}): {', '.join(wrong(r, length))} for "
        f"{', '.join(r['hidden']) or 'nothing'}"
        for r, length in false
    ]
    parts = [
        "# Short logs: what they can tell",
        f"Written by `{command}`; do not edit. {INTRODUCTION}",
        f"**{len(false)} of {pieces} pieces of 20 to 120 s got a wrong name**: {share:.1%} (at most {MOST:.0%}); "
        f"with 95 % confidence it is below {bound(len(false), pieces, 0.95):.1%}.",
        in_a_table(head, curve(records)),
        "\n".join(rows),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study and print its page."""
    records = carried_out(Study("log_lengths", 100, FIRST, judge, _line, page), __doc__, arguments)
    return int(len(mistaken(records)) > MOST * SHORT * len(records))


def _line(records: Kept) -> str:
    """What was said of the last log."""
    last = records[-1]
    return f"{last['seed']} {last['hidden']}: { {n: answer['missing'] for n, answer in last['answers'].items()} }"


if __name__ == "__main__":
    sys.exit(main())
