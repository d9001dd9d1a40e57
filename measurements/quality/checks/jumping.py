"""Check of jumping positions, which stay or leave for a while: the log is cut there, and what comes after is sound."""

from collections.abc import Sequence
from functools import partial

from ...preparation.resampling import jumps_in_words, jumps_of, without_jumps
from ..record import About, Check, Fix, Found, Reach, Record


def _jumps(records: Sequence[Record]) -> Found:
    """Tell jumps of the position: what steps farther than the boat can go.

    One finding for all jumps, none without positions.
    """
    if not any({"x", "y"} <= set(record.log.channels) for record in records):
        return []
    found = [(record, jumps) for record in records if (jumps := jumps_of(record.log.channels))]
    if not found:
        return About("jumps", ("x", "y")).ok("the positions never jump")
    every = [jump for _, jumps in found for jump in jumps]
    fix = None
    if len(records) == 1:
        words = "no position is kept where they jump, so that the log is cut into stretches"
        fix = Fix(words, partial(without_jumps, jumps=every))
    return About("jumps", ("x", "y"), max(jump.size for jump in every), "m").warning(
        jumps_in_words(every),
        consequence="no boat does so: a receiver changed its solution, or an origin was set anew. The log is "
        "cut there into stretches, and no motion goes across",
        fix=fix,
        short=jumps_in_words(every[:1]),
        reach=Reach.SECONDS,
    )


JUMPS = Check("jumps", _jumps)
