"""Check of throttle and steering recorded as two sides: one command pushes alone, the other turns alone.

A thruster on one side does both. With a vehicle the claim is measured: how much of what it leaves of the log the mixed
commands explain.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar, final

import numpy as np

from ....physics.motion import Motion
from ....physics.vehicle import Vehicle
from ...canonical import Channel, command_kind
from ...channels.mixing import mixed
from ..expected_answers import SIDE, called, expected_of
from ..faults import Size, delayed, size_by_model
from ..finding import Channels, Check, Finding, Fix, Reach
from ..record import Record
from ..response import Answer, trials

_HARDLY = 0.3
"""Share of what the other command does that one may surely do at most: thrusters on two sides do equally much."""
_CI = 2.0
"""Standard errors within which what a command does surely lies."""
_SCALES = (1.0, 0.5)
"""Of throttle and steering that are half the sum and half the difference of the sides, or sum and difference."""


@dataclass(frozen=True, slots=True)
class _Mix:
    """Throttle and steering, by the names that they bear, and what turns them into sides."""

    throttle: str
    steering: str
    scale: float = 1.0
    sign: float = 1.0

    def of(self, name: str, throttle: Channel, steering: Channel) -> Channel:
        """The command of the side that a name tells, at the stamps of the throttle."""
        zero = 1500.0 if name.startswith("pwm") else 0.0
        ahead = zero + self.scale * (throttle.value - zero)
        turn = zero + self.sign * self.scale * (steering.value - zero)
        value = mixed(name, (throttle.time, ahead), (steering.time, turn))
        keep = np.isfinite(value)
        return replace(throttle, name=name, time=throttle.time[keep], value=value[keep])

    def line(self, records: Sequence[Record], name: str) -> str:
        """The line of a channel map that does the same."""
        log = next(record.log for record in records if self.throttle in record.log.channels)
        zero = 1500.0 if name.startswith("pwm") else 0.0
        ahead, turn = (_scaled(scale, zero) for scale in (self.scale, self.sign * self.scale))
        sources = log.channels[self.throttle].origin, log.channels[self.steering].origin
        steering = f"{{from: {sources[1]}{turn}}}" if turn else sources[1]
        return f"'{name}: {{from: {sources[0]}{ahead}, mix: skid, steering: {steering}}}'"


def _scaled(scale: float, zero: float) -> str:
    if scale == 1.0:
        return ""
    return f", scale: {scale:g}" + (f", offset: {zero * (1.0 - scale):g}" if zero else "")


@final
class MixedCommands(Check):
    """Tells throttle and steering that bear the names of sides."""

    name: ClassVar[str] = "mixed commands"

    def examine(self, records: Sequence[Record]) -> list[Finding]:
        """See `Check`: a finding only where two commands look so."""
        names = _sides(records)
        if names is None:
            return []
        told = next((one.best for one in trials(records) if set(names) <= set(one.best.answers)), None)
        pair = None if told is None else _pair(names, told.answers)
        if told is None or pair is None:
            return []
        tried = [replace(pair, scale=scale, sign=sign) for scale in _SCALES for sign in (1.0, -1.0)]
        late = delayed(told.seconds)
        sizes = [(mix, size_by_model(records, partial(_alter, mix, names), late)) for mix in tried]
        known = [(mix, size) for mix, size in sizes if size is not None]
        mix, size = max(known, key=lambda found: found[1].share.low, default=(pair, None))
        return [_finding(records, names, mix, size)]


def _finding(records: Sequence[Record], names: tuple[str, str], mix: _Mix, size: Size | None) -> Finding:
    sure = size is None or size.refuses
    text = (
        f"{called(records, mix.throttle)} and {called(records, mix.steering)} look like throttle and steering, "
        "not like two sides: one pushes and hardly turns the boat, the other turns and hardly pushes it"
    )
    if size is not None:
        text += f"; mixed into sides, they explain {size.share} of what the vehicle leaves of surge and yaw"
    lines = " and ".join(mix.line(records, name) for name in names)
    alone = size is not None and size.refuses and len(records) == 1
    return Finding(
        check=MixedCommands.name,
        verdict="defect" if sure else "warning",
        sentence=text,
        value=None if size is None else size.share.value,
        unit="" if size is None else "1",
        channels=names,
        consequence="what the two sides did is lost, and a thruster is blamed for it",
        remedy=f"mix them in a channel map (--map): {lines}",
        fix=Fix("throttle and steering mixed into the commands of two sides", partial(_mixed, mix, names))
        if alone
        else None,
        short=f"{' and '.join(names)} look like throttle and steering",
        reach=Reach.LOG,
    )


def _sides(records: Sequence[Record]) -> tuple[str, str] | None:
    """Two commands of one kind, port first, that should be of two sides; None where there are others, or not these."""
    expected = expected_of(records, sorted({name for record in records for name in record.commands}))
    sided = {one.side: name for name, one in expected.items()}
    if len(expected) != 2 or set(sided) != set(SIDE.values()):
        return None
    names = sided[SIDE["port"]], sided[SIDE["starboard"]]
    kinds = {(command_kind(name) or ("",))[0] for name in names}
    return names if len(kinds) == 1 else None


def _pair(names: tuple[str, str], answers: Mapping[str, Answer]) -> _Mix | None:
    """Which is throttle and which steering; None where they are not."""
    for throttle, steering in (names, names[::-1]):
        one, two = answers[throttle], answers[steering]
        pushes, turns = one.ahead != 0, two.turn != 0
        hardly = _small(one.yaw, one.yaw_error, two.yaw) and _small(two.surge, two.surge_error, one.surge)
        if pushes and turns and hardly:
            return _Mix(throttle, steering)
    return None


def _small(value: float, error: float, other: float) -> bool:
    """True when what a command does is surely little; without an error, it is too little to be seen."""
    return not np.isfinite(error) or abs(value) + _CI * error < _HARDLY * abs(other)


def _alter(mix: _Mix, names: tuple[str, str], vehicle: Vehicle, motion: Motion) -> tuple[Vehicle, Motion]:
    places = {thruster.channel: column for column, thruster in enumerate(vehicle.thrusters)}
    given = {n: Channel(n, motion.time, motion.commands[:, places[n]], n) for n in (mix.throttle, mix.steering)}
    commands = motion.commands.copy()
    for name in names:
        commands[:, places[name]] = mix.of(name, given[mix.throttle], given[mix.steering]).value
    return vehicle, replace(motion, commands=commands)


def _mixed(mix: _Mix, names: tuple[str, str], channels: Channels) -> dict[str, Channel]:
    sides = {name: mix.of(name, channels[mix.throttle], channels[mix.steering]) for name in names}
    return {**channels, **sides}
