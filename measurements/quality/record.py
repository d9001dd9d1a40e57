"""A log under examination, and what a check finds in it: a verdict, a number, what follows from it, and what to do.

Of a log there are its channels as repaired so far, its motions, and the part of a long log that is examined.

Delays, signs, sides and shares are hardly surer after ten hours than after two, so these checks look at pieces spread
evenly over the log. Gaps, stamps, spikes, stuck sensors and units are looked for in every row.
"""

from collections.abc import Callable, Collection, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from enum import Enum
from typing import Annotated, Any, Literal, TypedDict, TypeVar, Unpack

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, PlainSerializer

from ...physics import file_records
from ...physics.errors import LogError
from ...physics.file_records import Number
from ...physics.motion import Array, Motion
from ...physics.sampled_series import area_average
from ...physics.thrusters import Thruster
from ...physics.vehicle import Vehicle
from ..canonical import Channel, command_kind, is_canonical
from ..channels.channel_map import Entry
from ..log import Log
from ..preparation.prepare import Recipe, motions_within
from ..preparation.resampling import Span, samples

QUICK_ROW = 0.25
"""Longest row of a record that shows how a speed changes [s]: half a period at 2 Hz, where the band in which boats
answer ends (`response`). In longer ones a quick turn looks like a spike, and its end like a sensor that sleeps."""
WHOLE = 10_800.0
"""Usable log that is looked at whole [s]: a day's trials, which take some seconds."""
PART = 7_200.0
"""What is looked at of a longer log [s]: 720 stretches of 10 s, from which a jackknife tells its error to 3 %."""
_PIECE = 120.0
"""Length of a piece [s]: long beside the delays of 5 s that are tried in it, short beside two hours."""
_IDLE = 0.1
"""Share of the idle pieces that are taken, beside the others: nothing but the neutral of the commands is told there."""
AT_REST = 0.1
"""Share of its usual top speed, and of its top yaw rate, below which a boat lies at rest."""
_CALMEST, _CALM = 5, 0.05
"""Pieces taken because the boat is slowest in them, for this share of the time, 6 s: rest shows the neutral."""


@dataclass(frozen=True, slots=True)
class Portion:
    """A stretch that is looked at.

    Attributes
    ----------
    span : its ends [s]
    weight : seconds of the log that each of its seconds stands for; 0 where it is looked at for its rest alone
    cut : whether the log goes on after it, in what is not looked at
    """

    span: Span
    weight: float = 1.0
    cut: bool = False

    def of(self, seconds: float) -> "Portion":
        """The same where `seconds` of it make a motion: the last ones before its end, which no sample ends, count."""
        if not self.cut:
            return self
        return replace(self, weight=self.weight * (self.span[1] - self.span[0]) / seconds)


def looked_at(log: Log, spans: Sequence[Span]) -> list[Portion]:
    """Choose what is looked at of the usable stretches of a log [s]: all of up to three hours, else some two.

    The stretches are cut into pieces of two minutes, of which as many as make two hours are taken at even steps of the
    time in which the boat does something; idle time counts a tenth. The calmest pieces and the last one are always
    among them: commands that stand still to the end of the log are told from those that stand still in between.
    """
    if sum(high - low for low, high in spans) <= WHOLE:
        return [Portion(span) for span in spans]
    pieces = np.concatenate([_cut(*span) for span in spans])
    length = pieces[:, 1] - pieces[:, 0]
    mean, calm = _speeds(log, pieces)
    idle = _idle(log, pieces, mean)
    total = np.cumsum(length * np.where(idle, _IDLE, 1.0))
    count = max(1, round(PART / float(length.mean())))
    drawn = np.zeros(length.size, dtype=bool)
    drawn[np.searchsorted(total, (np.arange(count) + 0.5) / count * total[-1])] = True
    weight = np.zeros(length.size)
    for kind in (idle, ~idle):
        if (drawn & kind).any():
            weight[drawn & kind] = length[kind].sum() / length[drawn & kind].sum()
    drawn[[*np.argsort(calm, kind="stable")[:_CALMEST], -1]] = True
    return _joined(pieces[drawn], weight[drawn], {high for _, high in spans})


def longest(spans: Sequence[Span]) -> list[Span]:
    """The middle two hours of the longest stretch where all together are over three hours; else all."""
    if sum(high - low for low, high in spans) <= WHOLE:
        return list(spans)
    low, high = max(spans, key=lambda span: span[1] - span[0])
    spare = max(high - low - PART, 0.0)
    return [(low + 0.5 * spare, high - 0.5 * spare)]


def _cut(low: float, high: float) -> Array:
    edges = np.linspace(low, high, max(1, int((high - low) / _PIECE)) + 1)
    return np.column_stack([edges[:-1], edges[1:]])


def _idle(log: Log, pieces: Array, speed: Array) -> NDArray[np.bool_]:
    """True when in each piece no command changes and the boat is slow."""
    still = [_range(channel, pieces) == 0.0 for name, channel in log.channels.items() if command_kind(name)]
    return np.logical_and.reduce([speed < AT_REST * np.quantile(speed, 0.95), *still])


def _speeds(log: Log, pieces: Array) -> tuple[Array, Array]:
    """Mean speed in each piece, and how slow it is for a while [m/s]; 1 where no record tells of it."""
    if "u" in log.channels:
        u = log.channels["u"]
        found = [np.abs(u.value[rows]) for rows in _rows(u, pieces)]
        return np.array([one.mean() for one in found]), np.array([np.quantile(one, _CALM) for one in found])
    if {"x", "y"} <= set(log.channels):
        speed = np.hypot(*(_range(log.channels[name], pieces) for name in ("x", "y"))) / (pieces[:, 1] - pieces[:, 0])
        return speed, speed
    return np.ones(pieces.shape[0]), np.ones(pieces.shape[0])


def _range(channel: Channel, pieces: Array) -> Array:
    return np.array([np.ptp(channel.value[rows]) for rows in _rows(channel, pieces)])


def _rows(channel: Channel, pieces: Array) -> list[slice]:
    """The rows of a channel in each piece, with the one before: a command that is logged on change holds until then."""
    first = np.maximum(np.searchsorted(channel.time, pieces[:, 0], "right") - 1, 0)
    last = np.maximum(np.searchsorted(channel.time, pieces[:, 1]), first + 1)
    return [slice(*rows) for rows in np.column_stack([first, last]).tolist()]


def _joined(pieces: Array, weight: Array, ends: set[float]) -> list[Portion]:
    """The same, as one stretch where one begins at which another of its weight ends; `ends` are those of stretches."""
    begins = np.concatenate(([True], (pieces[1:, 0] != pieces[:-1, 1]) | (weight[1:] != weight[:-1])))
    lows, highs = pieces[begins, 0].tolist(), pieces[np.append(begins[1:], True), 1].tolist()
    found = zip(lows, highs, weight[begins].tolist(), strict=True)
    return [Portion((low, high), each, high not in ends) for low, high, each in found]


_T = TypeVar("_T")

RATE = 20.0
"""Of the even time base on which channels are compared [Hz]; one for all logs, so that they can be pooled."""
STEP = 1.0 / RATE
"""Of the same time base [s]."""
_MOST = 0.5
"""Share of a stretch in which a record must have values to be compared at all."""
_EVEN = Recipe(rate=RATE, cutoff=None)


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """A motion and all commands on its time base.

    Attributes
    ----------
    motion : without commands
    commands : (n, commands) in the units of their channels, means over each step; NaN outside a channel's stamps
    portion : of a long log that it is
    """

    motion: Motion
    commands: Array
    portion: Portion


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """A log under examination.

    Attributes
    ----------
    log : with the channels as the checks before left them
    stretches : its motions at 20 Hz, of a long log only those that `looked_at` chooses; none where the log
        makes none
    commands : names of the command channels, the columns of `Stretch.commands`
    why_not : why the log makes no motion; empty where it does
    vehicle : the nominal model, which says what the commands should do; None where there is none
    known : what one check computed and others need too, see `shared`
    """

    log: Log
    stretches: tuple[Stretch, ...]
    commands: tuple[str, ...]
    why_not: str = ""
    vehicle: Vehicle | None = None
    known: dict[Hashable, Any] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, log: Log, vehicle: Vehicle | None = None) -> "Record":
        """Examine a log as it is."""
        names = tuple(name for name in log.channels if command_kind(name))
        portions: list[Portion] = []

        def choose(spans: list[Span]) -> list[Span]:
            portions.extend(looked_at(log, spans))
            return [portion.span for portion in portions]

        try:
            motions = motions_within(log, _EVEN, choose)
        except LogError as error:
            return cls(log, (), names, error.typed.removeprefix(f"{log.path}: "), vehicle)
        channels = [log.channels[name] for name in names]
        stretches = tuple(
            _stretch(motion, _commands(channels, motion), portion.of(motion.duration))
            for motion, portion in zip(motions, portions, strict=True)
        )
        return cls(log, stretches, names, "", vehicle)

    @property
    def steered(self) -> tuple[str, ...]:
        """What steers beside the thrusters, such as a rudder, which no vehicle file has."""
        found = self.log.auxiliary.items()
        return tuple(sorted(channel.origin for name, channel in found if name.startswith("steering")))

    def scaled(self, names: Iterable[str], factor: float) -> dict[str, Entry | None]:
        """The lines of a channel map that multiply some channels, as far as the log's own lines are known."""
        entries = {name: self.log.entries.get(name) for name in names}
        return {name: entry.times(factor) for name, entry in entries.items() if entry is not None}

    def repaired(self, channels: Mapping[str, Channel]) -> "Record":
        """The same log with other channels."""
        return Record.of(replace(self.log, channels=dict(channels)), self.vehicle)

    def driven(self, stretch: Stretch) -> Motion | None:
        """The motion of a stretch with the commands of the vehicle's thrusters; None where one is not known."""
        if self.vehicle is None or not {t.channel for t in self.vehicle.thrusters} <= set(self.commands):
            return None
        commands = stretch.commands[:, [self.commands.index(t.channel) for t in self.vehicle.thrusters]]
        if not np.isfinite(commands).all():
            return None
        names = tuple(t.name for t in self.vehicle.thrusters)
        return replace(stretch.motion, commands=commands, thrusters=names, run_up=None)

    @property
    def seconds(self) -> float:
        """Usable motion, looked at or not [s]."""
        return sum(stretch.portion.weight * stretch.motion.duration for stretch in self.stretches)


def command_names(records: Sequence[Record]) -> list[str]:
    """All commands that some logs have, sorted."""
    return sorted({name for record in records for name in record.commands})


def thruster_of(records: Sequence[Record], name: str) -> Thruster | None:
    """The thruster that a command drives, by the first vehicle that has one; None for none."""
    vehicles = [record.vehicle for record in records if record.vehicle]
    return next((one for vehicle in vehicles for one in vehicle.thrusters if one.channel == name), None)


def channels_called(records: Sequence[Record], name: str) -> list[Channel]:
    """The channels of a name, of the logs that have one."""
    return [record.log.channels[name] for record in records if name in record.log.channels]


def values_called(records: Sequence[Record], name: str) -> Array:
    """All values of the channels of a name, of the logs that have one, in their order."""
    return np.concatenate([channel.value for channel in channels_called(records, name)])


def computed_once(records: Sequence[Record], name: Hashable, make: Callable[[], _T]) -> _T:
    """Compute something of some records once, whichever check asks for it first.

    Parameters
    ----------
    records : at least one, in the same order whenever they are asked
    name : of what is computed
    make : computes it
    """
    first, *others = records
    key = (name, *others)
    if key not in first.known:
        first.known[key] = make()
    return first.known[key]


def _stretch(motion: Motion, commands: Array, portion: Portion) -> Stretch:
    """A motion and its commands, cut to where these are known if that is most of it."""
    known = np.flatnonzero(np.isfinite(commands).all(axis=1))
    if known.size < _MOST * motion.time.size or known.size < 2:
        return Stretch(motion, commands, portion)
    first, last = int(known[0]), int(known[-1]) + 1
    return Stretch(motion.slice(first, last), commands[first:last], portion)


def _commands(channels: Sequence[Channel], motion: Motion) -> Array:
    """Commands in the rows of a motion; each is known up to two rows after its last stamp."""
    table, step = np.full((motion.time.size, len(channels)), np.nan), motion.time_step
    for column, channel in enumerate(channels):
        known = (motion.time >= channel.time[0]) & (motion.time <= channel.time[-1] + 2.0 * channel.period)
        if known.any():
            time = motion.time[known]
            near = samples(channel, (float(time[0]) - step, float(time[-1]) + step))
            table[known, column] = area_average(*near, time, step)
    return table


Verdict = Literal["ok", "note", "warning", "defect", "cannot tell"]
SEVERITY: tuple[Verdict, ...] = ("defect", "warning", "cannot tell", "note", "ok")
"""The verdicts, worst first. A defect makes results wrong; a warning makes them worse; a note is good to know."""

Channels = Mapping[str, Channel]


def altered(channels: Channels, names: Collection[str], change: Callable[[Channel], Channel]) -> dict[str, Channel]:
    """All channels of a log, those of some names changed; for `Fix`."""
    return {name: change(channel) if name in names else channel for name, channel in channels.items()}


class Reach(Enum):
    """How much of what is found in a log a defect makes wrong."""

    NUMBERS = "numbers come out worse; what is named stays right"
    SECONDS = "false motion in some seconds; the rest of the log is sound"
    LOG = "nothing found in the log is about the boat, so that it is refused"


@dataclass(frozen=True, slots=True)
class Fix:
    """A safe remedy: what it does, in words, and the function that does it to the channels of a log.

    Of a file, and of what another process found, only the words are known, and nothing is done.
    """

    sentence: str
    apply: Callable[[Channels], dict[str, Channel]] = dict

    def __reduce__(self) -> tuple[type, tuple[str]]:
        return Fix, (self.sentence,)


FixInWords = Annotated[
    Fix,
    BeforeValidator(lambda fix: Fix(fix) if isinstance(fix, str) else fix),
    PlainSerializer(lambda fix: fix.sentence, return_type=str),
]


class Finding(file_records.Record):
    """One result of one check.

    Attributes
    ----------
    check : name of the check
    verdict : see `SEVERITY`
    value, unit : the number; None where there is nothing to measure
    ci95 : its 95 % interval, None where none can be given
    channels : canonical channels concerned
    sentence : what was found, with its number
    consequence : what goes wrong if it stays
    remedy : what to do about it
    fix : what `--fix` does about it; None where only a person should
    parts : further numbers by name, such as the coefficients of a curve
    short : the sentence in a few words, for the verdict on the log; empty for the sentence itself; in no file
    reach : how much a defect makes wrong; in no file
    mends : lines of a channel map that put it right, None to leave a channel out; in no file, for `inspect --map-out`
        writes them into one
    """

    check: str
    verdict: Verdict
    value: Number | None = None
    unit: str = ""
    ci95: tuple[Number, Number] | None = None
    channels: tuple[str, ...] = ()
    sentence: str
    consequence: str = ""
    remedy: str = ""
    fix: FixInWords | None = None
    parts: Mapping[str, float | str] = {}
    short: str = Field(default="", exclude=True)
    reach: Reach = Field(default=Reach.NUMBERS, exclude=True)
    mends: Mapping[str, Entry | None] = Field(default_factory=dict, exclude=True)

    @property
    def refused(self) -> bool:
        """True when a log with this finding is refused by whoever computes with it."""
        return self.verdict == "defect" and self.reach is Reach.LOG

    @property
    def told(self) -> str:
        """What was found and what follows, as whole sentences."""
        return " ".join(f"{_capital(text)}." for text in (self.sentence, self.consequence) if text)

    @property
    def cure(self) -> str:
        """The remedy as a sentence without its end; empty where there is none."""
        return _capital(self.remedy)


class _More(TypedDict, total=False):
    """Further fields of a `Finding`."""

    channels: tuple[str, ...]
    value: float | None
    unit: str
    ci95: tuple[float, float] | None
    parts: Mapping[str, float | str]
    consequence: str
    remedy: str
    fix: Fix | None
    short: str
    reach: Reach
    mends: Mapping[str, Entry | None]


@dataclass(frozen=True, slots=True)
class About:
    """What a check looked at and measured, of which findings are made; see `Finding` for the attributes."""

    check: str
    channels: tuple[str, ...] = ()
    value: float | None = None
    unit: str = ""
    ci95: tuple[float, float] | None = None
    parts: Mapping[str, float | str] = field(default_factory=dict)

    def finding(self, verdict: Verdict, sentence: str, **more: Unpack[_More]) -> Finding:
        """A finding on it, of which further fields may be given, also in place of its own."""
        known = {part.name: getattr(self, part.name) for part in fields(self)}
        return Finding(verdict=verdict, sentence=sentence, **{**known, **more})

    def ok(self, sentence: str, **more: Unpack[_More]) -> Finding:
        """The finding that nothing is wrong."""
        return self.finding("ok", sentence, **more)

    def untold(self, sentence: str, **more: Unpack[_More]) -> Finding:
        """The finding that the log cannot tell."""
        return self.finding("cannot tell", sentence, **more)

    def note(self, sentence: str, **more: Unpack[_More]) -> Finding:
        """The finding of something that is good to know."""
        return self.finding("note", sentence, **more)

    def warning(self, sentence: str, **more: Unpack[_More]) -> Finding:
        """The finding of something that makes results worse."""
        return self.finding("warning", sentence, **more)


def _capital(text: str) -> str:
    """Text with a capital letter, but not where it opens with the name of a channel.

    Examples
    --------
    >>> _capital("the gyro is late"), _capital("r is in degrees"), _capital("RCOU.C1 is reversed")
    ('The gyro is late', 'r is in degrees', 'RCOU.C1 is reversed')
    """
    word = text.split(" ")[0]
    return text if is_canonical(word) or not word.islower() else text[:1].upper() + text[1:]


Found = Finding | Sequence[Finding] | None
"""What a check finds: one thing, several, or nothing to speak of."""


@dataclass(frozen=True, slots=True)
class Check:
    """One question about the quality of logs of one boat.

    Attributes
    ----------
    name : of the question
    find : answers it for one log, or for several logs together, as the checks before this one left them: at least one
        finding, "cannot tell" where the logs do not show it, none where the question makes no sense. A `Fix` is asked
        for only where there is one record
    """

    name: str
    find: Callable[[Sequence[Record]], Found]

    def examine(self, records: Sequence[Record]) -> list[Finding]:
        """All that is found in some records."""
        found = self.find(records)
        return [found] if isinstance(found, Finding) else list(found or ())
