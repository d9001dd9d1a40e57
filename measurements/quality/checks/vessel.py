"""Check of the vehicle's kind: a surface vessel, as the autopilot says."""

from collections.abc import Sequence
from typing import ClassVar, final

from ..finding import Check, Finding, Reach
from ..record import Record


@final
class Vessel(Check):
    """Tells the kind of vehicle, where the log does."""

    name: ClassVar[str] = "vessel"

    def examine(self, records: Sequence[Record]) -> list[Finding]:
        """See `Check`: one finding for each kind; none where no log tells its vehicle."""
        told = {one.craft: one for record in records if (one := record.log.craft) is not None}
        return [
            Finding(check=self.name, verdict="ok", sentence=one.sentence)
            if craft.floats
            else Finding(
                check=self.name,
                verdict="warning",
                sentence=one.sentence,
                consequence="the three degrees of freedom of a boat on the water do not describe it",
                remedy="give the log of a boat",
                short=f"it is the log of {craft.value}",
                reach=Reach.LOG,
            )
            for craft, one in told.items()
        ]
