"""Check of throttle and steering recorded as two sides: one command pushes alone, the other turns alone.

A thruster on one side does both. The claim is weighed by the rule of `faults`: how much better throttle and steering
explain the changes of surge and yaw than two sides do; and with a vehicle, how much of what it leaves of the log they
explain when they are mixed into sides.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ....physics.motion import Motion
from ....physics.vehicle import Vehicle
from ...canonical import Channel, kind_of
from ...channels.channel_map import Entry, map_text, mixed
from ..faults import Fault, Kind, Size, delayed, size_by_model
from ..record import Channels, Check, Finding, Fix, Found, Record, command_names
from ..response import SIDE, called, expected_of, trials

_HALVES = (1.0, 0.5)
"""Scales that are tried: throttle and steering are half the sum and half the difference of the sides, or all of it."""


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

    def entry(self, records: Sequence[Record], name: str) -> Entry:
        """The line of a channel map that does the same."""
        log = next(record.log for record in records if self.throttle in record.log.channels)
        zero = 1500.0 if name.startswith("pwm") else 0.0
        ahead, turn = (
            (log.entries.get(command) or Entry(log.channels[command].origin)).times(scale, zero)
            for command, scale in ((self.throttle, self.scale), (self.steering, self.sign * self.scale))
        )
        return replace(ahead, steering=turn)


def _mixed_commands(records: Sequence[Record]) -> Found:
    """Tell throttle and steering that bear the names of sides.

    A finding only where two commands look so.
    """
    names = _two_sides(records)
    if names is None:
        return []
    told = next((one.best for one in trials(records) if set(names) <= set(one.best.answers)), None)
    if told is None or told.fitted is None:
        return []
    orders = [(a, b) for a, b in (names, names[::-1]) if told.answers[a].ahead and told.answers[b].turn]
    weighed = [(told.fitted.size_of_mix(*order), order) for order in orders]
    alone, pair = max(weighed, key=lambda found: found[0].share.value, default=(None, names))
    if alone is None or not alone.likely:
        return []
    tried = [_Mix(pair[0], pair[1], scale, sign) for scale in _HALVES for sign in (1.0, -1.0)]
    sizes = [(mix, size_by_model(records, partial(_alter, mix, names), delayed(told.seconds))) for mix in tried]
    known = [(mix, size) for mix, size in sizes if size is not None]
    mix, size = max(known, key=lambda found: found[1].share.low, default=(tried[0], None))
    return [found] if (found := _found_mixed(records, names, mix, size, alone)) is not None else []


def _found_mixed(
    records: Sequence[Record], names: tuple[str, str], mix: _Mix, size: Size | None, alone: Size
) -> Finding | None:
    """The finding that two commands are mixed, by the vehicle, or by what they do alone where there is none."""
    entries: dict[str, Entry | None] = {name: mix.entry(records, name) for name in names}
    lines = " and ".join(f"'{line}'" for line in map_text(entries).splitlines())
    facts = {"told": f"{called(records, mix.throttle)} and {called(records, mix.steering)}", "cure": lines}
    facts["how"] = "read so" if size is None else "mixed into sides"
    fix = Fix("throttle and steering mixed into the commands of two sides", partial(_mixed, mix, names))
    if size is not None and size.likely and size.leaves > 1.0:  # weaker commands, mixed or not, explain as much
        return Fault(Kind.MIXED, names, size, facts).in_words("note")
    if size is None or not size.refuses or len(records) > 1:
        return Fault(Kind.MIXED, names, size or alone, facts).ruled()
    return Fault(Kind.MIXED, names, size, facts, fix=fix, mends=entries).ruled()


def _two_sides(records: Sequence[Record]) -> tuple[str, str] | None:
    """Two commands of one kind, port first, that should be of two sides; None where there are others, or not these."""
    expected = expected_of(records, command_names(records))
    sided = {one.side: name for name, one in expected.items()}
    if len(expected) != 2 or set(sided) != set(SIDE.values()):
        return None
    names = sided[SIDE["port"]], sided[SIDE["starboard"]]
    kinds = {kind_of(name) for name in names}
    return names if len(kinds) == 1 else None


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


MIXED_COMMANDS = Check("mixed commands", _mixed_commands)
