"""Check of the commands' range: on the curves of the vehicle's thrusters, beyond whose ends force stays the same.

Percent for a share, tenfold values, or one side in another unit would go unnoticed. Where the vehicle explains the log
surely better with commands scaled back, they are so scaled.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ....physics.motion import Motion
from ....physics.presentation import listing, percent
from ....physics.thrusters import TableCurve, Thruster, command_of
from ....physics.vehicle import Vehicle
from ..faults import OVERWHELMING, Altered, Size, size_by_model
from ..record import About, Check, Found, Reach, Record, values_called

_OVER = 0.02
"""Share of the curve's reach up to which a command beyond its end is rounding."""
_SELDOM = 0.001
"""Share of the rows beyond the end up to which nothing is told: a spike in the record."""


@dataclass(frozen=True, slots=True)
class Beyond:
    """A thruster whose commands leave its curve.

    Attributes
    ----------
    thruster : whose curve it is
    largest, end : the command farthest off its neutral, and the end of the curve on that side [the command's unit]
    share : of the rows that are beyond
    ratio : the first over the second, both from neutral
    neutral : [the command's unit]
    """

    thruster: Thruster
    largest: float
    end: float
    share: float
    ratio: float
    neutral: float


def _range(records: Sequence[Record]) -> Found:
    """Compare the values of the commands with the ends of the vehicle's curves.

    One finding for all thrusters; none without a vehicle.
    """
    vehicle = next((record.vehicle for record in records if record.vehicle is not None), None)
    if vehicle is None:
        return []
    having = [t for t in vehicle.thrusters if any(t.channel in record.log.channels for record in records)]
    beyond = [one for one in (_beyond(records, thruster) for thruster in having) if one is not None]
    if not beyond:
        names = tuple(t.channel for t in having)
        text = "no command goes beyond the end of its thruster's curve"
        return About("command range", names).ok(text) if having else None
    names = tuple(one.thruster.channel for one in beyond)
    told = "; ".join(
        f"{one.thruster.channel} goes to {one.largest:.4g}, beyond the end of its curve at {one.end:.4g}, in "
        f"{percent(one.share)} of the rows"
        for one in beyond
    )
    factors, weighed = _best_factors(records, beyond)
    lines = listing([f"'{n}: {{from: ..., scale: {f:.4g}}}'" for n, f in factors.items()])
    # Beyond the curve the file has no force at all: of the motion they need not be much.
    sure = weighed is not None and weighed.share.low > OVERWHELMING
    scaled = listing([f"{value:.4g}" for value in dict.fromkeys(factors.values())])
    size = "" if weighed is None else f"; scaled by {scaled}, they explain {weighed.share} more of the motion"
    return About("command range", names, max(one.ratio for one in beyond), "1").finding(
        "defect" if sure else "warning",
        f"{told}{size}",
        consequence="the model gives the curve's last force there, so that thrust and drag come out wrong",
        remedy=f"if they are in another unit, such as percent, map {lines}; if the thrusters go so far, widen "
        "their curves in the vehicle file",
        short=f"{listing(list(names))} go{'es' * (len(names) == 1)} beyond the curve of the vehicle file",
        reach=Reach.LOG,
        mends={n: entry for name, f in factors.items() for n, entry in records[0].scaled([name], f).items()}
        if sure
        else {},
    )


def _beyond(records: Sequence[Record], thruster: Thruster) -> Beyond | None:
    """What a thruster's commands do beyond its curve; None where they do not leave it, or hardly ever."""
    values = values_called(records, thruster.channel)
    at = command_of(thruster, np.array([-1.0, 0.0, 1.0]))
    neutral = float(at[1])
    curve = thruster.curve
    low, high = (curve.command[0], curve.command[-1]) if isinstance(curve, TableCurve) else np.sort(at[[0, 2]]).tolist()
    slack = _OVER * max(high - neutral, neutral - low)
    out = (values < low - slack) | (values > high + slack)
    if np.mean(out) <= _SELDOM:
        return None
    largest = float(values[out][np.argmax(np.abs(values[out] - neutral))])
    end = high if largest > neutral else low
    reach = abs(end - neutral) or max(high - neutral, neutral - low)
    return Beyond(thruster, largest, end, float(np.mean(out)), abs(largest - neutral) / reach, neutral)


def _best_factors(records: Sequence[Record], beyond: Sequence[Beyond]) -> tuple[dict[str, float], Size | None]:
    """The scales of the commands that explain the log best, of those that people meet; and how much they explain."""
    reach = {one.thruster.channel: abs(one.largest - one.neutral) / one.ratio for one in beyond}
    tried = [
        {one.thruster.channel: float(f"{1.0 / one.ratio:.3g}") for one in beyond},
        {name: full / 100.0 for name, full in reach.items()},
        dict.fromkeys(reach, 0.01),
        dict.fromkeys(reach, 0.1),
    ]
    sizes = [(factors, size_by_model(records, _scaled(factors))) for factors in tried]
    known = [(factors, size) for factors, size in sizes if size is not None]
    return max(known, key=lambda pair: pair[1].share.low, default=(tried[0], None))


def _scaled(factors: Mapping[str, float]) -> Altered:
    def alter(vehicle: Vehicle, motion: Motion) -> tuple[Vehicle, Motion]:
        commands = motion.commands.copy()
        for column, thruster in enumerate(vehicle.thrusters):
            if thruster.channel in factors:
                commands[:, column] *= factors[thruster.channel]
        return vehicle, replace(motion, commands=commands)

    return alter


COMMAND_RANGE = Check("command range", _range)
