"""Checks of the commands: that there are some, and of thrusters alone; their range; their neutral; two that are mixed.

On the curves of the vehicle's thrusters, beyond whose ends force stays the same, percent for a share, tenfold values,
or one side in another unit would go unnoticed. Where the vehicle explains the log surely better with commands scaled
back, they are so scaled. Neutral is the PWM at which the thrusters stand still: what the commands are while the boat
lies at rest.

Throttle and steering may be recorded as two sides: one command pushes alone, the other turns alone, and a thruster on
one side does both. The claim is weighed by the rule of `faults`: how much better throttle and steering explain the
changes of surge and yaw than two sides do; and with a vehicle, how much of what it leaves of the log they explain when
they are mixed into sides.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ....physics.motion import Motion
from ....physics.presentation import listing, percent
from ....physics.thrusters import TableCurve, Thruster, command_of, resting_commands
from ....physics.vehicle import Vehicle
from ...canonical import LIMITS, Channel, kind_of
from ...channels.channel_map import Entry, map_text, mixed
from ..faults import OVERWHELMING, Altered, Fault, Kind, Size, delayed, size_by_model
from ..quick_motion import neutral_of
from ..record import Channels, Check, Finding, Fix, Found, Reach, Record, channels_called, command_names
from ..response import SIDE, called, expected_of, trials


def _commands(records: Sequence[Record]) -> Found:
    """Look for thruster commands, and for rudders among what was not recognised."""
    names = tuple(command_names(records))
    text = f"commands of {len(names)} thruster{'s' if len(names) > 1 else ''}: {', '.join(names)}"
    known = Finding(check="commands", verdict="ok", sentence=text, value=float(len(names)), unit="1", channels=names)
    return list(_wrong_commands(records)) or [known]


def _wrong_commands(records: Sequence[Record]) -> Iterator[Finding]:
    """What is wrong with the commands of logs: what steers beside them, none at all, and one stream for several."""
    warning = partial(Finding, check="commands", verdict="warning", unit="1")
    if rudders := sorted({name for record in records for name in record.steered}):
        yield warning(
            sentence=f"the log has a rudder or its like ({', '.join(rudders)}); the vehicles and effects of "
            "undertow have none",
            value=float(len(rudders)),
            consequence="what it does would be laid at the door of hull, current or thrusters",
            remedy="if it turns a rudder or a nozzle, fit no vehicle to the log; if it is the difference of "
            "two sides, mix it into them ('mix: skid' in a channel map)",
            short=f"it is steered by {', '.join(rudders)}, which no vehicle file has",
        )
    if not command_names(records):
        yield warning(
            sentence="no command of a thruster is recognised",
            value=0.0,
            consequence="no vehicle can be judged; only the motion can be looked at",
            remedy="map the commands with a channel map (--map), for example 'pwm_port: COLUMN'",
            short="no thruster command is recognised",
        )
    for source, fed in sorted(_shared(records).items()):
        text = f"{source} is the command of {len(fed)} thrusters"
        yield warning(
            sentence=f"{text}: {', '.join(fed)}",
            value=float(len(fed)),
            channels=fed,
            consequence="the thrusters cannot be told apart, and a command that the boat had may be missing",
            remedy="if each thruster has its own, name each in the channel map (--map); keep it if one drives both",
            short=text,
        )


def _shared(records: Sequence[Record]) -> dict[str, tuple[str, ...]]:
    """Streams that a channel map takes for several commands, and these."""
    fed: dict[str, set[str]] = {}
    for record in records:
        for name in record.commands:
            fed.setdefault(record.log.channels[name].origin, set()).add(name)
    return {source: tuple(sorted(names)) for source, names in fed.items() if len(names) > 1}


COMMANDS = Check("commands", _commands)


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

    @property
    def sentence(self) -> str:
        """What the command does, without an end."""
        return (
            f"{self.thruster.channel} goes to {self.largest:.4g}, beyond the end of its curve at {self.end:.4g}, in "
            f"{percent(self.share)} of the rows"
        )


def _range(records: Sequence[Record]) -> Found:
    """Compare the values of the commands with the ends of the vehicle's curves.

    One finding for all thrusters; none without a vehicle.
    """
    vehicle = next((record.vehicle for record in records if record.vehicle is not None), None)
    if vehicle is None:
        return []
    having = [t for t in vehicle.thrusters if any(t.channel in record.log.channels for record in records)]
    beyond = [one for one in (_beyond(records, thruster) for thruster in having) if one is not None]
    if not having or not beyond:
        text = "no command goes beyond the end of its thruster's curve"
        names = tuple(t.channel for t in having)
        return [Finding(check="command range", verdict="ok", sentence=text, channels=names)] if having else []
    names = tuple(one.thruster.channel for one in beyond)
    told = "; ".join(one.sentence for one in beyond)
    factors, weighed = _best_factors(records, beyond)
    lines = listing([f"'{n}: {{from: ..., scale: {f:.4g}}}'" for n, f in factors.items()])
    # Beyond the curve the file has no force at all: of the motion they need not be much.
    sure = weighed is not None and weighed.share.low > OVERWHELMING
    scaled = listing([f"{value:.4g}" for value in dict.fromkeys(factors.values())])
    size = "" if weighed is None else f"; scaled by {scaled}, they explain {weighed.share} more of the motion"
    return Finding(
        check="command range",
        verdict="defect" if sure else "warning",
        sentence=f"{told}{size}",
        value=max(one.ratio for one in beyond),
        unit="1",
        channels=names,
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
    channels = [record.log.channels[thruster.channel] for record in records if thruster.channel in record.log.channels]
    values = np.concatenate([channel.value for channel in channels])
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


USUAL = 1500.0
"""The PWM at which the thruster curves of vehicle files have their zero, unless they say otherwise [us]."""
_OFF = 3.0
"""Distance from the usual neutral from which it matters [us]: one per cent of the thrust command is 4 to 5."""
_AT_END = 0.05
"""Share of the range of the commands within which a neutral is at its end: an ESC that drives one way only."""


def _neutral(records: Sequence[Record]) -> Found:
    """Find the value at which each PWM stays while nothing moves.

    One finding for all PWM channels.
    """
    names = [name for name in command_names(records) if kind_of(name) == "pwm"]
    if not names:
        return []
    found = {name: value for name in names if (value := neutral_of(records, name)) is not None}
    if not found:
        text = "the boat is never at rest with a steady command; the neutral PWM is not known"
        return Finding(check="neutral", verdict="cannot tell", sentence=text, channels=tuple(names))
    values = np.concatenate([channel.value for name in names for channel in channels_called(records, name)])
    lows, highs = float(values.min()), float(values.max())
    finding = partial(Finding, check="neutral", unit="us", parts={**found, "lowest": lows, "highest": highs})
    zeros = _zeros(records, found)
    if zeros:
        return _compared(finding, found, zeros, f"range {lows:.0f} to {highs:.0f}")
    off = {name: value for name, value in found.items() if abs(value - USUAL) >= _OFF}
    told = _listed(found)
    value = float(np.median(list((off or found).values())))
    finding = partial(finding, value=value, channels=tuple(off or found))
    if not off:
        return finding(verdict="ok", sentence=f"neutral PWM is {told}, range {lows:.0f} to {highs:.0f}")
    warning = partial(finding, verdict="warning", short=f"neutral PWM is {value:g} us")
    least = min(abs(end - value) for end in (lows, highs))
    curve = f"set the curve's zero in the vehicle file to {value:g}"
    if least <= _AT_END * (highs - lows):
        return warning(
            sentence=f"neutral PWM is {told}, at an end of the range {lows:.0f} to {highs:.0f}",
            consequence=f"a model with its zero at {USUAL:.0f} takes rest for full thrust",
            remedy=curve,
        )
    low, high = LIMITS["pwm"]
    mapped = f", or map each with 'offset: {USUAL - value:+g}'"
    fits = all(low <= lows + USUAL - one and highs + USUAL - one <= high for one in off.values())
    return warning(
        sentence=f"neutral PWM is {told}, not {USUAL:.0f}; range {lows:.0f} to {highs:.0f}",
        consequence=f"a model with its zero at {USUAL:.0f} pushes with "
        f"{100.0 * abs(value - USUAL) / least:.1f} % of the command at rest, and ahead and astern seem unlike",
        remedy=f"{curve}, as init does{mapped * fits}",
    )


@dataclass(frozen=True, slots=True)
class _Zero:
    """Where neutral should be: between two values of a channel, in which words, and whether the vehicle says so."""

    low: float
    high: float
    words: str
    by_vehicle: bool

    def off(self, value: float) -> float:
        """How far a neutral is beside it."""
        return max(self.low - value, value - self.high)

    @property
    def middle(self) -> float:
        """Its middle."""
        return 0.5 * (self.low + self.high)

    def __str__(self) -> str:
        return f"{self.low:.4g}" if self.low == self.high else f"{self.low:.4g} to {self.high:.4g}"


def _zeros(records: Sequence[Record], found: Mapping[str, float]) -> dict[str, _Zero]:
    """What says where neutral is, by channel: the vehicle's curve, or else the log's parameters."""
    zeros: dict[str, _Zero] = {}
    for record in records:
        own = {t.channel: resting_commands(t) for t in record.vehicle.thrusters} if record.vehicle else {}
        for name in found:
            stated = record.log.channels[name].output if name in record.log.channels else None
            ends = own.get(name)
            if ends is not None:
                zeros[name] = _Zero(*ends, "the vehicle's curve has its zero", True)
            elif stated is not None:
                zeros.setdefault(name, _Zero(stated.neutral, stated.neutral, "the log's parameters have it", False))
    return zeros


def _compared(
    about: Callable[..., Finding], found: Mapping[str, float], zeros: Mapping[str, _Zero], reach: str
) -> Finding:
    """The neutral beside what says where it must be. Nothing is shifted: which of the two is right, a person knows."""
    off = {n: value for n, value in found.items() if n in zeros and zeros[n].off(value) >= _OFF}
    name = next(iter(off or zeros))
    value, zero = found[name], zeros[name]
    finding = partial(about, value=value, channels=tuple(off or found))
    curve = f"set the curve's zero in the vehicle file to {value:g}"
    if off:
        moves = ", ".join(f"{n} by 'offset: {zeros[n].middle - v:+.4g}'" for n, v in off.items())
        return finding(
            verdict="warning",
            sentence=f"neutral PWM is {_listed(off)}, but {zero.words} at {zero}; {reach}",
            consequence="a model pushes at rest, and ahead and astern seem unlike",
            remedy=f"{curve}, or map {moves} if the log was not shifted already",
            short=f"neutral PWM is {value:g} us, not {zero}",
        )
    known = zero.by_vehicle or abs(value - USUAL) < _OFF
    return finding(
        verdict="ok" if known else "note",
        sentence=f"neutral PWM is {_listed(found)}, {reach}; {zero.words} there",
        remedy="" if known else f"{curve}; --vehicle V tells whether it is",
    )


def _listed(values: Mapping[str, float]) -> str:
    if len(set(values.values())) == 1 and len(values) > 1:
        return f"{next(iter(values.values())):g} us on all {len(values)} thrusters"
    return ", ".join(f"{value:g} us ({name})" for name, value in values.items())


NEUTRAL = Check("neutral", _neutral)


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
