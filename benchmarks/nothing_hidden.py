"""How often discovery names anything where nothing is hidden.

Logs of random hulls over every programme, with field, rough and no noise, one in ten in waves; one in ten goes through
a file. Results are kept in a folder, so that a study which was stopped goes on where it was; they count only for the
source that made them. Whether chance is as rare as it is told to be is another study, `how_rare_chance_is.py`.

    python benchmarks/nothing_hidden.py [--logs 3000] [--seeds tuning|reporting] [--jobs N] [--tell]
        [--table docs/nothing_hidden.md]

Exit code 1 where more than one log got a name.
"""

import sys
import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from study.resumed import Kept, Study, bound, carried_out, in_a_table
from study.worlds import ALL, BY_FILE, Part, divided, draw

from undertow.discovery.basis import choose
from undertow.discovery.discover import find_missing
from undertow.discovery.settings import DiscoverySettings

FIRST = {"tuning": 200_000, "reporting": 210_000}
CALM = Part("nothing", 0, 0, 0, ALL, ("field", "rough", "clean"))
WAVES = Part("waves alone", 0, 0, 0, ALL, ("field", "rough"), waves=True)
IN_WAVES = 10
"""Every so many logs one is in waves."""
MOST = 0.001
INTRODUCTION = """Logs of 300 s of random sisters of the shipped vehicles, driven by the very model that discovery gets:
whatever is called missing, an unnamed term included, is false."""


def judge(first: int, number: int) -> dict[str, Any]:
    """What is named in one log."""
    part = WAVES if number % IN_WAVES == IN_WAVES - 1 else CALM
    case = draw(part, number, first + number)
    pieces = divided(case, number % BY_FILE == BY_FILE - 2)
    motions = (*pieces.train.motions, *pieces.validation.motions)
    begun = time.perf_counter()
    basis = choose(motions, case.nominal, DiscoverySettings())
    findings = find_missing(motions, case.nominal, basis=basis).findings
    seconds = time.perf_counter() - begun
    return {
        **case.setting,
        "verdict": findings.verdict,
        "named": [*findings.missing, *(term.symbol for term in findings.unnamed)],
        "rolls": basis.rolls,
        "seconds": seconds,
    }


def page(records: Sequence[Mapping[str, Any]], command: str) -> str:
    """The study as a page in Markdown."""
    named = [r for r in records if r["named"]]
    share = len(named) / max(len(records), 1)
    parts = [
        "# Nothing hidden: how often anything is named",
        f"Written by `{command}`; do not edit. {INTRODUCTION}",
        f"**{len(named)} of {len(records)} logs got a name**: {share:.2%} (at most {MOST:.1%}); with 95 % confidence "
        f"it is below {bound(len(named), len(records), 0.95):.2%} (Clopper and Pearson).",
        in_a_table(("programme, noise", "logs", "named", "undecided", "time [s]"), by_kind(records)),
        "\n".join(f"- seed {r['seed']} ({r['vehicle']}, {kind(r)}): {', '.join(r['named'])}" for r in named),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def kind(record: Mapping[str, Any]) -> str:
    """How a log was driven, and what noise and waves are in it."""
    return f"{record['programme']}, {record['noise']}{', waves' * (record['waves'] > 0.0)}"


def by_kind(records: Sequence[Mapping[str, Any]]) -> list[tuple[object, ...]]:
    """A row for each kind of logs."""
    rows: list[tuple[object, ...]] = []
    for name in sorted({kind(r) for r in records}):
        some = [r for r in records if kind(r) == name]
        open_ends = sum(r["verdict"] == "undecided" for r in some)
        seconds = f"{np.median([r['seconds'] for r in some]):.1f}"
        rows.append((name, len(some), sum(bool(r["named"]) for r in some), open_ends, seconds))
    return rows


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study and print its page."""
    records = carried_out(Study("nothing_hidden", 3000, FIRST, judge, _line, page), __doc__, arguments)
    return int(sum(bool(r["named"]) for r in records) > 1)


def _line(records: Kept) -> str:
    """What was named in the last log, and now and then how far the study is."""
    last = records[-1]
    return f"{last['seed']} {last['named'] or ''}" if last["named"] or len(records) % 50 == 0 else ""


if __name__ == "__main__":
    sys.exit(main())
