"""Check of the time stamps: repeated ones, and ones that go back."""

from collections.abc import Iterator, Sequence

from ....physics.presentation import number
from ...canonical import Channel
from ...channels.conversion import APART
from ..record import About, Check, Finding, Fix, Found, Record

_MANY = 0.01
"""Share of stamps that are wrong from which a derivative suffers; fewer are told, no more."""
_TOLD = 3
"""Settings of the clock that a sentence tells before it counts the rest."""


def _stamps(records: Sequence[Record]) -> Found:
    """Count what reading had to drop or sort, see `conversion.Cleaner`: a fix has nothing left to do.

    A finding for repeated stamps, one for backward stamps, or one that says that all is well.
    """
    found = list(_wrong_stamps([channel for record in records for channel in record.log.channels.values()]))
    text = "every time stamp is later than the one before"
    return found or [About("stamps", value=0.0, unit="1").ok(text)]


def _wrong_stamps(channels: Sequence[Channel]) -> Iterator[Finding]:
    """What is wrong with the stamps of channels: a clock that was set, and rows that were dropped or sorted."""

    def names(part: str) -> tuple[str, ...]:
        return tuple(dict.fromkeys(channel.name for channel in channels if getattr(channel.lost, part)))

    rows = sum(channel.time.size for channel in channels)
    astray, backward, repeated = (
        sum(getattr(channel.lost, part) for channel in channels) for part in ("astray", "backward", "repeated")
    )
    if sets := tuple(dict.fromkeys(each for channel in channels for each in channel.lost.sets)):
        back = any(by < 0.0 for _, by in sets)
        text = ", ".join(
            f"{'back' if by < 0.0 else 'forward'} by {abs(by):.6g} s at t = {at:.2f} s" for at, by in sets[:_TOLD]
        )
        more = f" and {len(sets) - _TOLD} times more" if len(sets) > _TOLD else ""
        yield About("stamps", names("sets"), sets[0][1], "s").finding(
            "defect" if back else "warning",
            f"the clock was set {text}{more}",
            consequence=f"the pieces are put {APART:g} s apart, each a stretch of its own"
            + ("; other verbs refuse the log until that is written" if back else ""),
            remedy="keep the clock as it is while logging, or stamp by a clock that is never set",
            fix=Fix(f"pieces between which the clock was set put {APART:g} s apart"),
            short="the clock was set back" if back else "the clock was set",
        )
    about = About("stamps", unit="1")
    if astray:
        share = astray / (rows + astray)
        yield about.finding(
            "warning" if share > _MANY else "note",
            f"{astray} values have a stamp that is astray, far from those around it ({number(100.0 * share, 2)} %)",
            value=share,
            channels=names("astray"),
            consequence="their rows are left out",
            remedy="find out what wrote these stamps",
            fix=Fix(f"{astray} values with a stamp that is astray dropped"),
        )
    if backward:
        share = backward / rows
        listed = ", ".join(names("backward"))
        yield about.finding(
            "defect",
            f"time runs backwards: {backward} values stand after later ones ({number(100.0 * share, 2)} %)",
            value=share,
            channels=names("backward"),
            consequence="derivatives change sign there; other verbs refuse the log",
            remedy="sort the rows by time",
            fix=Fix(f"rows of {listed} sorted by time ({backward} were out of order)"),
        )
    if repeated:
        share = repeated / (rows + repeated)
        yield about.finding(
            "warning" if share > _MANY else "note",
            f"{number(100.0 * share, 2)} % of the values repeat the stamp of another ({repeated} values)",
            value=share,
            channels=names("repeated"),
            consequence="two values at one instant have no derivative; the last of them is taken",
            remedy="find out why the logger wrote them, or whether its stamps are rounded",
            fix=Fix(f"{repeated} values with a repeated stamp dropped, the last of each kept"),
        )


STAMPS = Check("stamps", _stamps)
