"""Check of the vehicle's kind: a surface vessel, as the autopilot says."""

from collections.abc import Sequence

from ..record import About, Check, Found, Reach, Record


def _examine(records: Sequence[Record]) -> Found:
    """Tell the kind of vehicle, where the log does.

    One finding for each kind; none where no log tells its vehicle.
    """
    told = {one.craft: one for record in records if (one := record.log.craft) is not None}
    return [
        About("vessel").ok(one.sentence)
        if craft.floats
        else About("vessel").warning(
            one.sentence,
            consequence="the three degrees of freedom of a boat on the water do not describe it",
            remedy="give the log of a boat",
            short=f"it is the log of {craft.value}",
            reach=Reach.LOG,
        )
        for craft, one in told.items()
    ]


VESSEL = Check("vessel", _examine)
