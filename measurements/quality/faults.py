"""A fault that a check alleges, and the one rule by which a log is refused, warned of, or neither.

Something correlated is left of every sound log, so a fault is weighed by its size: `share` of the squared error that
putting it right removes, over the same rows, and `weight`, the same over the power of the accused record, each with a
jackknife error over blocks of time (Kuensch 1989, doi:10.1214/aos/1176347265). A log is refused where both are surely
beyond `OVERWHELMING`. Where they are more than half on the mean, and neither may be nothing, the finding warns, and
where both are likely overwhelming, it is a note. Of what another witness has shown, such as a delay or a sign, a share
that is likely overwhelming, and surely some, is enough for a warning.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from ...physics.forces import modelled_acceleration
from ...physics.motion import Array, Motion
from ...physics.vehicle import Vehicle
from ..channels.channel_map import Entry
from ..statistics.blocks import LEVEL, numbered_on, student
from .quick_motion import rates_in_band
from .record import RATE, About, Finding, Fix, Reach, Record, Verdict

OVERWHELMING = 0.25
"""Share of the squared error, and of the accused record's power, that a fault must surely take away. Calibrated:
`benchmarks/sound_logs.py` prints the largest sizes of sound logs, `benchmarks/spoiling.py` the least of spoilt ones."""
FEWEST = 4
"""Blocks below which nothing is sure: all of three agree by chance in one log of four, 2^(1 - n)."""
WIDE = (0.05, 1.0)
"""The band in which differentiated speeds are compared [Hz]: short waves and their noise lie above it."""
BLOCK = 10.0
"""Length of a block [s], as in `lags`; an even time base for the errors: longer than waves last."""

Altered = Callable[[Vehicle, Motion], tuple[Vehicle, Motion]]
"""Puts a fault into a vehicle or into the commands that drive it."""


@dataclass(frozen=True, slots=True)
class Share:
    """A share of a squared error or a power, and its 95 % interval by blocks.

    Attributes
    ----------
    value : 1 where the fault takes all of it away, 0 where it takes nothing, negative where it makes it worse
    error : half of the interval; infinite where the blocks are too few
    """

    value: float
    error: float

    @property
    def low(self) -> float:
        """What it surely is at least."""
        return self.value - self.error

    @property
    def high(self) -> float:
        """What it surely is at most."""
        return self.value + self.error

    @property
    def doubtful(self) -> bool:
        """True when it may be nothing; where the blocks are too few for an interval, none speaks against it."""
        return bool(np.isfinite(self.error)) and self.low <= 0.0

    @property
    def warns(self) -> bool:
        """True when what another witness shows is worth a warning: it likely explains much, and surely some."""
        return self.value > OVERWHELMING and self.low > 0.0

    @property
    def by_factors(self) -> "Share":
        """The same of a ratio that has no upper end, and is sure to a factor: its lower end is never below nothing."""
        if not self.value > 0.0 or not np.isfinite(self.error):
            return self
        return replace(self, error=self.value * -float(np.expm1(-self.error / self.value)))

    def __str__(self) -> str:
        """In percent, for a sentence."""
        if not np.isfinite(self.error):
            return f"perhaps {100.0 * self.value:.0f} %"
        return f"{100.0 * self.value:.0f} % +- {100.0 * self.error:.0f} %"


@dataclass(frozen=True, slots=True)
class Size:
    """How much a fault explains.

    Attributes
    ----------
    share : of the squared error of the log as it is recorded, what the fault takes away
    weight : the same over the power of the record that is accused
    """

    share: Share
    weight: Share

    @property
    def leaves(self) -> float:
        """What is left with the fault put right, over the power of the record; beyond 1, nothing explains it."""
        return self.weight.value * (1.0 / self.share.value - 1.0) if self.share.value else np.inf

    @property
    def refuses(self) -> bool:
        """True when a log may be refused for the fault: it surely explains much."""
        return min(self.share.low, self.weight.low) > OVERWHELMING

    @property
    def warns(self) -> bool:
        """True when it is worth a warning without another witness: on the (geometric) mean of both more than half.

        Neither may be nothing, nor little.
        """
        half = min(self.share.value, 1.0) * min(self.weight.value, 1.0) > 0.5**2
        return self.likely and half and not (self.share.doubtful or self.weight.doubtful)

    @property
    def likely(self) -> bool:
        """True when the fault is worth telling: it explains much, sure or not."""
        return min(self.share.value, self.weight.value) > OVERWHELMING


def size_of(without: Array, with_fault: Array, power: Array, block: NDArray[np.int64]) -> Size:
    """Weigh a fault by its errors.

    Parameters
    ----------
    without, with_fault : (n,) squared errors of the log as it is recorded, and with the fault put right, in the same
        rows; of both, what noise makes of them may be subtracted
    power : (n,) square of what is accused, in the same rows and the same unit
    block : (n,) number of the block of each row
    """
    gain = without - with_fault
    return Size(ratio_by_blocks(gain, without, block), ratio_by_blocks(gain, power, block).by_factors)


def size_of_unexplained(left: Array, power: Array, block: NDArray[np.int64]) -> Size:
    """Weigh what is left of records that should explain each other (n,), over their power (n,); see `size_of`."""
    weight = ratio_by_blocks(left, power, block).by_factors
    return Size(weight, weight)


def ratio_by_blocks(part: Array, whole: Array, block: NDArray[np.int64]) -> Share:
    """The sum of one series (n,) over that of another, with a jackknife over blocks.

    Parameters
    ----------
    part, whole : series (n,) of one unit
    block : number of the block of each row (n,)
    """
    number = np.unique(block, return_inverse=True)[1] if block.size else block
    parts, wholes = (np.bincount(number, rows) for rows in (part, whole))
    if not wholes.sum() > 0.0:
        return Share(0.0, np.inf)
    value, count = float(parts.sum() / wholes.sum()), wholes.size
    rest = wholes.sum() - wholes
    if count < FEWEST or not np.all(rest > 0.0):
        return Share(value, np.inf)
    each = (parts.sum() - parts) / rest
    error = float(np.sqrt((count - 1) / count * ((each - each.mean()) ** 2).sum()))
    return Share(value, student(count - 1, LEVEL) * error)


@dataclass(frozen=True, slots=True)
class Words:
    """What is told of a kind of fault, with places for its facts.

    Attributes
    ----------
    check : the name of its findings
    sentence, short, consequence, remedy : see `Finding`
    unit : of its number
    """

    check: str
    sentence: str
    short: str
    consequence: str
    remedy: str
    unit: str = "1"


_BEYOND = "what a thruster does beyond its record would be laid at the door of the hull"
_LOOK = "find out what became of the record, and leave those parts of the log out"
_FACTOR = "turns, yaw damping and every yaw moment come out wrong by this factor"
_POWERS = "drag and thrust come out wrong by powers of this factor"


class Kind(Enum):
    """The faults for which a log may be refused."""

    FROZEN = Words(
        "drive",
        "{names} stands still for {seconds:.0f} s, but the boat moves as if its thruster worked: a push of it of "
        "{push:.2g} N that comes and goes explains {share} of what the vehicle leaves of surge and yaw",
        "the record of {names} stands still while its thruster works",
        _BEYOND,
        _LOOK,
    )
    ALL_FROZEN = Words(
        "drive",
        "all commands stand still for {seconds:.0f} s, but the boat is driven and turned all the while",
        "the records of the commands stand still while the boat is driven",
        _BEYOND,
        _LOOK,
    )
    OTHER_RUN = Words(
        "drive",
        "the boat does not answer {names} at any delay within {reach:g} s: {share} of its motion, beyond noise and "
        "hull, has no cause in them; they are of another run, or of another boat",
        "the boat does not answer its commands",
        _BEYOND,
        _LOOK,
    )
    CUT = Words(
        "limited",
        "while the commands stand at their largest, for {seconds:.0f} s, the boat moves beyond what they say, and "
        "{cause} ({share} of that; of the slow motion, the vehicle leaves {weight} of what its thrust makes, in power)",
        "the record of the commands is cut at a limit",
        "what the thrusters do beyond their record would be laid at the door of thrust and hull",
        "log the commands as they reach the motor controllers, in their full range, and drive with middling ones too",
    )
    EXCHANGED = Words(
        "exchanged",
        "u and v look exchanged: under each other's names they explain {share} of what they leave as they are",
        "u and v look exchanged",
        "the boat seems to drive sideways; thrust, drag and sides all come out wrong",
        "exchange them in a channel map (--map)",
    )
    ANGLE_UNIT = Words("units", "{told}", "", _FACTOR, "{cure}")
    OPPOSED = Words("units", "{told}", "", "which side is port is lost", "{cure}")
    TIME_UNIT = Words(
        "time unit", "{told}: heading and track both say so", "{told}", "every rate and acceleration is wrong", "{cure}"
    )
    AXES = Words(
        "units",
        "{told} (so {follows:.1f} % of the track follows from {by})",
        "{told}",
        "forces act along other axes than the boat's; nothing can be learned",
        "{cure}",
    )
    SPEED_UNIT = Words("units", "{told}", "", _POWERS, "{cure}")
    UNRELATED = Words(
        "units",
        "{told} contradict each other: {weight} of what one says does not follow from the other",
        "",
        "one of them is of another motion, or was never measured",
        "find out which, and leave it out with {cure} in a channel map, or map the boat's own",
    )
    MIXED = Words(
        "mixed commands",
        "{told} look like throttle and steering, not like two sides: one pushes and hardly turns the boat, the other "
        "turns and hardly pushes it; {how}, they explain {share} of what is left of surge and yaw",
        "{names} look like throttle and steering",
        "what the two sides did is lost, and a thruster is blamed for it",
        "mix them in a channel map (--map): {cure}",
    )
    REVERSED = Words(
        "direction",
        "{told}",
        "{names} {are} reversed",
        "a model is pushed one way where the boat is pushed the other; no thrust can be fitted",
        "turn it round in a channel map: {cure}",
        "m/s^2",
    )
    SWAPPED = Words(
        "sides",
        "port and starboard look swapped: {told}",
        "port and starboard look swapped",
        "every turn is predicted to the wrong side",
        "{cure}",
        "rad/s^2",
    )
    APART = Words(
        "clocks",
        "{told}",
        "{late} is {seconds:.2f} s {order} {reference}",
        "{wrong}",
        "move {moved} by {shift:+.2f} s",
        "s",
    )
    LATE_COMMANDS = Words(
        "clocks",
        "the motion leads the command by {seconds:.2f} s: the boat cannot know, the stamps are late{size}",
        "the motion leads the command by {seconds:.2f} s",
        "a delay of the thrusters comes out too small or negative, and damping with it",
        "move the commands by {shift:+.2f} s or more",
        "s",
    )
    STUCK = Words(
        "stuck",
        "{names} {are} stuck in mid-motion {times}, for up to {seconds:.2g} s",
        "",
        "the boat seems to stop, and to jump when the sensor wakes up",
        "drop those rows, so that they are a gap; look at the sensor's own status",
        "s",
    )
    NEVER = Words(
        "stuck",
        "{names} never {change} ({value:g} {unit} in every row) although the boat {does}",
        "{names} never {change}",
        "a record that was never measured is taken for a measurement",
        "leave it out with '{first}: null' in a channel map, so that it is derived where that can be",
    )
    SPIKES = Words(
        "spikes",
        "{count} values of {names} stand far out of their record ({part:.2g} %)",
        "",
        "each is a force that never was",
        "leave these values out",
    )
    WRAPPED = Words(
        "spikes",
        "{names} jumps by {jump:.4g} {unit} {count} times, all of its range",
        "",
        "the boat seems to leap from one end of the range to the other",
        "unwrap it: its counter is too short for what it measures",
    )


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault that a check alleges.

    Attributes
    ----------
    kind : which, with its words
    channels : that it is of
    size : how much it explains
    facts : what the words have places for, by name; names of channels and both shares are known
    value, ci95, fix, parts : see `Finding`; the value is by default the share
    unit : of the value, where it is not that of its kind
    mends : see `Finding`
    """

    kind: Kind
    channels: tuple[str, ...]
    size: Size
    facts: Mapping[str, object] = field(default_factory=dict)
    value: float | None = None
    ci95: tuple[float, float] | None = None
    fix: Fix | None = None
    parts: Mapping[str, float | str] = field(default_factory=dict)
    unit: str = ""
    mends: Mapping[str, Entry | None] = field(default_factory=dict)

    def ruled(self) -> Finding | None:
        """The rule: a defect where the fault is overwhelming, less where it is likely, else nothing."""
        if not self.size.likely:
            return None
        return self.in_words("defect" if self.size.refuses else "warning" if self.size.warns else "note")

    def in_words(self, verdict: Verdict) -> Finding:
        """The fault in words."""
        words: Words = self.kind.value
        known = {"names": " and ".join(self.channels), "share": self.size.share, "weight": self.size.weight}
        known |= {"are": "are" if len(self.channels) > 1 else "is", **self.facts}
        value, unit = self.size.share.value if self.value is None else self.value, self.unit or words.unit
        return About(words.check, self.channels, value, unit, self.ci95, dict(self.parts)).finding(
            verdict,
            words.sentence.format(**known),
            consequence=words.consequence.format(**known),
            remedy=words.remedy.format(**known),
            fix=self.fix,
            short=words.short.format(**known),
            reach=Reach.LOG,
            mends=dict(self.mends),
        )


def squared_held_out(target: Array, columns: Array, block: NDArray[np.int64]) -> Array:
    """Squared error (n,) of a linear fit of columns (n, p) to a target (n,), of each block by a fit to the others.

    Parameters
    ----------
    block : (n,) number of the block of each row, in rising order
    """
    number = np.unique(block, return_inverse=True)[1]
    size = np.sqrt((columns**2).mean(axis=0))
    table = columns / np.where(size > 0.0, size, 1.0)
    pairs = table[:, :, None] * np.column_stack([table, target])[:, None, :]
    gram = np.add.reduceat(pairs, np.flatnonzero(np.diff(number, prepend=-1)))
    others = gram.sum(axis=0) - gram
    found = (np.linalg.pinv(others[:, :, :-1], rcond=1e-9, hermitian=True) @ others[:, :, -1:])[:, :, 0]
    return (target - (table * found[number]).sum(axis=1)) ** 2


def blocks_of(rows: Sequence[int]) -> NDArray[np.int64]:
    """Numbers of the blocks of stretches with so many rows at `RATE`, one after the other."""
    return numbered_on([np.arange(count, dtype=np.int64) // round(BLOCK * RATE) for count in rows])


def size_by_model(records: Sequence[Record], altered: Altered, meanwhile: Altered | None = None) -> Size | None:
    """How much of the error of the vehicle's accelerations of surge and yaw a fault takes away, when it is put into it.

    Parameters
    ----------
    records : of logs with a vehicle
    altered : the fault
    meanwhile : another fault that is taken for given, with and without the one in question

    Returns
    -------
    Size or None
        None without a vehicle whose commands are all known, or without motion. The weight is over the power of the
        accelerations.
    """
    before = meanwhile or (lambda vehicle, motion: (vehicle, motion))
    squared, rows = [], []
    for record in records:
        for stretch in record.stretches:
            motion = record.driven(stretch)
            if motion is None or record.vehicle is None or motion.time.size < round(BLOCK * RATE):
                continue
            given, velocity = before(record.vehicle, motion), motion.velocity[:, [0, 2]]
            said = [modelled_acceleration(*pair)[:, [0, 2]] for pair in (given, altered(*given))]
            compared = (np.zeros_like(velocity), *said)
            squared.append(np.column_stack([rates_in_band(velocity, one, WIDE) ** 2 for one in compared]))
            rows.append(motion.time.size)
    if not rows:
        return None
    table = np.concatenate(squared)
    size = table[:, :2].mean(axis=0)
    if not np.all(size > 0.0):
        return None
    power, without, told = ((table[:, k : k + 2] / size).sum(axis=1) for k in (0, 2, 4))
    return size_of(without, told, power, blocks_of(rows))


def delayed(seconds: float) -> Altered:
    """The fault that commands come so much later than they are stamped [s]."""

    def alter(vehicle: Vehicle, motion: Motion) -> tuple[Vehicle, Motion]:
        rows = np.arange(motion.time.size, dtype=float) - seconds * RATE
        given = np.arange(motion.time.size, dtype=float)
        commands = np.column_stack([np.interp(rows, given, column) for column in motion.commands.T])
        return vehicle, replace(motion, commands=commands)

    return alter


def misplaced(turned: frozenset[str], moved: frozenset[str]) -> Altered:
    """The fault that the thrusters of some channels push the other way, and those of some sit on the other side."""
    return _thrusters(dict.fromkeys(turned, -1.0), moved)


def weaker(channels: frozenset[str], share: float) -> Altered:
    """That the thrusters of some channels push as they should, and a share of what the vehicle says."""
    return _thrusters(dict.fromkeys(channels, share))


def _thrusters(factors: Mapping[str, float], moved: frozenset[str] = frozenset()) -> Altered:
    """That the forces of the thrusters of some channels are other by factors, and that some sit on the other side."""

    def alter(vehicle: Vehicle, motion: Motion) -> tuple[Vehicle, Motion]:
        thrusters = []
        for one in vehicle.thrusters:
            scale, y = one.scale * factors.get(one.channel, 1.0), -one.y if one.channel in moved else one.y
            thrusters.append(one.model_copy(update={"scale": scale, "y": y}))
        return vehicle.model_copy(update={"thrusters": tuple(thrusters)}), motion

    return alter
