"""Is chance as rare as it is told to be? Rehearsals of nothing, on logs in which nothing is hidden.

For each log the best effect is rehearsed about the model that made the log: of nothing, it should be among the best of
999 rehearsals as often as any of these is. Results are kept in a folder, so that a study which was stopped goes on
where it was; they count only for the source that made them.

    python benchmarks/how_rare_chance_is.py [--logs 800] [--seeds tuning|reporting] [--jobs N] [--tell]
        [--table docs/how_rare_chance_is.md]

Exit code 1 where, in logs with the noise of sensors alone, a share is outside of what 95 of 100 such studies find.
"""

import sys
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.stats import binom
from study.records import Kept, Script, in_a_table
from study.worlds import ALL, STEP, Part, draw

from undertow.discovery.basis import DiscoverySettings, choose_balance
from undertow.discovery.search.floating import Search
from undertow.discovery.search.surrogates import SURROGATES, SurrogateTest
from undertow.measurements.statistics.processors import single_threaded

PACKAGES = ("physics", "measurements", "discovery")
"""Packages whose source decides the results."""
FIRST = {"tuning": 200_000, "reporting": 220_000}
PARTS = (
    *(Part(noise, 0, 0, ALL, (noise,)) for noise in ("field", "rough") * 3),
    Part("waves", 0, 0, ALL, ("field", "rough"), waves=True),
    Part("clean", 0, 0, ALL, ("clean",)),
)
"""What logs are drawn of, in turn."""
SENSED = ("field", "rough")
"""Parts whose noise is that of sensors alone."""
LEVELS = (0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.001)
_TAIL = 0.025 / len(LEVELS) / len(SENSED)
"""On either side of each share, so that in 95 of 100 studies none of them is outside (Bonferroni)."""
INTRODUCTION = f"""Logs of 300 s of random sisters of the shipped vehicles over all programmes, driven by the very model
that discovery gets. Of {SURROGATES} rehearsals of nothing about it, in how many does some effect earn as much as the
best one does on the log itself? Where rehearsals are as the log is, a share p of the logs is among the best p of their
rehearsals; in brackets, the limits that all fourteen shares of the first two columns keep in 95 of 100 such studies."""
NO_CHANCE = """Two columns are no chance, and tell why an effect is not named for its rarity alone. Without noise the
rest is what a simulator's steps leave, which follows the columns. Waves push the boat, so that what a model leaves and
how the boat moves share a cause, and a drag that bends takes more of a boat that is shaken; rollouts judge such logs,
and draw no noise of sensors. Effects like these are there, and small: the last row says in how many logs one earns the
price of a name, before any other rule is asked."""


@single_threaded
def judge(first: int, number: int) -> dict[str, Any]:
    """How much the best effect earns in one log, and in how many rehearsals some effect earns as much."""
    part = PARTS[number % len(PARTS)]
    case = draw(part, number // len(PARTS), first + number)
    basis = choose_balance([case.log.motion(STEP)], case.nominal, DiscoverySettings())
    search = Search(basis.balance(), basis.nominal, basis.pool, basis.settings.search)
    state = search.evaluate(basis.nominal, ())
    linear, scores = search.linearise(state.vehicle, state.active, state.fit.in_sample)
    now = {key: linear.options[key][0] for key in state.active}
    gain, chance = SurrogateTest(search, linear, scores, now, basis.settings.seed).best()
    return {**case.setting, "part": part.title, "rolls": basis.uses_rollouts, "gain": gain, "better": chance.better}


def page(records: Sequence[Mapping[str, Any]], command: str) -> str:
    """The study as a page in Markdown."""
    of = grouped(records)
    head = ("share p of rehearsals", *(f"{name} ({len(some)} logs)" for name, some in of.items()))
    rows = [(f"{level:g}", *(_told(some, level) for some in of.values())) for level in LEVELS]
    paid = [f"{np.mean([r['gain'] > 0.0 for r in some]):.1%}" for some in of.values()]
    outside = sum(not low <= share <= high for share, low, high in compared(records))
    parts = [
        "# How rare chance is",
        INTRODUCTION,
        f"**{outside} of {2 * len(LEVELS)} shares of logs with the noise of sensors alone lie outside these bounds.**",
        in_a_table(head, [*rows, ("an effect earns its price", *paid)]),
        NO_CHANCE,
        f"Written by `{command}`; do not edit.",
    ]
    return "\n\n".join(parts) + "\n"


def grouped(records: Sequence[Mapping[str, Any]]) -> dict[str, list[Mapping[str, Any]]]:
    """Records of each part."""
    return {name: [r for r in records if r["part"] == name] for name in dict.fromkeys(r["part"] for r in records)}


def compared(records: Sequence[Mapping[str, Any]]) -> Iterator[tuple[float, float, float]]:
    """Share of logs within each share of rehearsals, and its bounds, where sensors alone make noise."""
    for name, some in grouped(records).items():
        if name in SENSED:
            yield from (within(some, level) for level in LEVELS)


def within(records: Sequence[Mapping[str, Any]], level: float) -> tuple[float, float, float]:
    """The share of logs within a share of their rehearsals, and the bounds that chance gives it."""
    low, high = (float(binom.ppf(q, len(records), level)) / len(records) for q in (_TAIL, 1.0 - _TAIL))
    # The log counts as one of the rehearsals: none better is a share of 1 in 1,000.
    share = np.mean([(r["better"] + 1.0) / (SURROGATES + 1.0) <= level for r in records])
    return float(share), low, high


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study and print its page."""
    study = Script("how_rare_chance_is", 800, FIRST, judge, _line, page, PACKAGES)
    records = study.carried_out(__doc__, arguments)
    return int(any(not low <= share <= high for share, low, high in compared(records)))


def _told(records: Sequence[Mapping[str, Any]], level: float) -> str:
    share, low, high = within(records, level)
    return f"{share:.1%} ({low:.1%} to {high:.1%})"


def _line(records: Kept) -> str:
    """Now and then, how far the study is."""
    return f"{records[-1]['seed']}" if len(records) % 50 == 0 else ""


if __name__ == "__main__":
    sys.exit(main())
