"""Whether the time stamps run forward: repeated ones, and ones that go back."""

from collections.abc import Sequence
from typing import ClassVar, final

from ..channels import Channel
from .finding import Channels, Check, Finding, Fix
from .record import Record

_MANY = 0.01


@final
class Stamps(Check):
    """Counts what reading had to drop or sort, see `cleaning.Cleaner`."""

    name: ClassVar[str] = "stamps"

    def examine(self, records: Sequence[Record]) -> list[Finding]:
        """See `Check`: a finding for repeated stamps, one for backward stamps, or one that says that all is well."""
        channels = [channel for record in records for channel in record.log.channels.values()]
        rows = sum(channel.time.size for channel in channels)
        repeated = sum(channel.lost.repeated for channel in channels)
        backward = sum(channel.lost.backward for channel in channels)
        cut = sum(channel.lost.cut for channel in channels)
        found = []
        if cut:
            names = _names([c.name for c in channels if c.lost.cut])
            share = cut / (rows + cut)
            found.append(
                Finding(
                    self.name,
                    "defect",
                    f"the clock is set back; {100.0 * share:.0f} % of the values lie beyond the longest piece",
                    share,
                    "1",
                    None,
                    names,
                    "only the longest piece between two such places is looked at here; other verbs refuse the log",
                    "cut the log where the clock was set, and give the pieces as logs of their own",
                )
            )
        if backward:
            names = _names([c.name for c in channels if c.lost.backward])
            share = backward / rows
            found.append(
                Finding(
                    self.name,
                    "defect",
                    f"time runs backwards: {backward} values stand after later ones ({100.0 * share:.2g} %)",
                    share,
                    "1",
                    None,
                    names,
                    "derivatives change sign there; other verbs refuse the log",
                    "sort the rows by time",
                    Fix(f"rows of {', '.join(names)} sorted by time ({backward} were out of order)", _as_read),
                )
            )
        if repeated:
            names = _names([c.name for c in channels if c.lost.repeated])
            share = repeated / (rows + repeated)
            found.append(
                Finding(
                    self.name,
                    "warning" if share > _MANY else "note",
                    f"{100.0 * share:.2g} % of the values repeat the stamp of another ({repeated} values)",
                    share,
                    "1",
                    None,
                    names,
                    "two values at one instant have no derivative; the last of them is taken",
                    "find out why the logger wrote them, or whether its stamps are rounded",
                    Fix(f"{repeated} values with a repeated stamp dropped, the last of each kept", _as_read),
                )
            )
        return found or [Finding(self.name, "ok", "every time stamp is later than the one before", 0.0, "1")]


def _names(every: Sequence[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(every))


def _as_read(channels: Channels) -> dict[str, Channel]:
    """Reading has done it already."""
    return dict(channels)
