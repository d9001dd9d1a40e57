"""How often discovery names anything where nothing is hidden, and how often chance is as rare as it is told to be.

Logs of random hulls over every programme, with field, rough and no noise, one in ten in waves; one in ten goes through
a file. For one log in seven the best effect is rehearsed on the model that made the log: of nothing, it should be among
the best of 999 rehearsals as often as any of these is. Results are kept in a folder, so that a study which was stopped
goes on where it was; they count only for the source that made them.

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

from undertow.discovery.basis import Basis, choose
from undertow.discovery.discover import find_missing
from undertow.discovery.search.chance import REHEARSALS, Rehearsals
from undertow.discovery.search.floating import Search
from undertow.discovery.settings import DiscoverySettings
from undertow.measurements.statistics.single_threaded import single_threaded

FIRST = {"tuning": 200_000, "reporting": 210_000}
CALM = Part("nothing", 0, 0, 0, ALL, ("field", "rough", "clean"))
WAVES = Part("waves alone", 0, 0, 0, ALL, ("field", "rough"), waves=True)
IN_WAVES, REHEARSED = 10, 7
"""Every so many logs one is in waves; and of every so many one is rehearsed."""
MOST = 0.001
INTRODUCTION = """Logs of 300 s of random sisters of the shipped vehicles, driven by the very model that discovery gets:
whatever is called missing, an unnamed term included, is false."""
EXPLANATION = f"""Of {REHEARSALS} rehearsals of nothing about the right model, in how many does some effect earn as much
as the best one does on the log itself? Where rehearsals are as the log is, a share p of the logs is among the best p of
their rehearsals; in brackets, between what 95 of 100 such studies would find. Without noise the rest is what a
simulator's steps leave, which follows the columns and is told to be no chance: it is too small to matter, and is never
named for that. An effect is named only where no rehearsal did as well."""
LEVELS = (0.5, 0.2, 0.1, 0.05, 0.01, 0.001)


@single_threaded
def best_by_chance(basis: Basis) -> int:
    """In how many rehearsals of nothing some effect earns as much as the best one does on the log itself."""
    search = Search(basis.balance(), basis.nominal, basis.pool, basis.settings.search)
    state = search.evaluate(basis.nominal, ())
    linear, scores = search.linearise(state.vehicle, state.active, state.fit.in_sample)
    now = {key: linear.options[key][0] for key in state.active}
    return Rehearsals(search, linear, scores, now, basis.settings.seed).best().better


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
        "better": best_by_chance(basis) if number % REHEARSED == 0 else None,
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
        "## How rare chance is",
        EXPLANATION,
        in_a_table(("share p of rehearsals", *groups(records)), calibration(records)),
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


def groups(records: Sequence[Mapping[str, Any]]) -> dict[str, list[float]]:
    """Shares of rehearsals that did as well, by the noise of the logs."""
    found: dict[str, list[float]] = {}
    for r in records:
        if r["better"] is not None:
            found.setdefault(f"{r['noise']}{', waves' * (r['waves'] > 0.0)}", []).append(r["better"] / REHEARSALS)
    return {f"{noise} ({len(shares)} logs)": shares for noise, shares in sorted(found.items())}


def calibration(records: Sequence[Mapping[str, Any]]) -> list[tuple[str, ...]]:
    """Share of the logs within each share of their rehearsals, beside what chance would give."""
    from scipy.stats import binom

    rows = []
    for level in LEVELS:
        cells = []
        for shares in groups(records).values():
            low, high = (binom.ppf(q, len(shares), level) / len(shares) for q in (0.025, 0.975))
            # The log counts as one of the rehearsals: none better is a share of 1 in 1,000.
            share = np.mean([(s * REHEARSALS + 1.0) / (REHEARSALS + 1.0) <= level for s in shares])
            cells.append(f"{share:.1%} ({low:.1%} to {high:.1%})")
        rows.append((f"{level:g}", *cells))
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
