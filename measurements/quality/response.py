"""Response of surge and yaw to each command, at every delay: which way a thruster pushes, and on which side it sits.

Also what they should do: by the vehicle file, or by the names of the commands.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...physics.effects import EFFECTS
from ...physics.motion import Array, earth_to_body
from ...physics.thrusters import Thruster, push_and_turn, side_named
from ..canonical import command_kind, kind_of
from ..preparation.resampling import command_step
from ..statistics.blocks import CI, Fit, robust_fit, surely_more
from ..statistics.signals import band_passed
from .faults import Size, size_of
from .lags import FOLLOWS, QUICK, Response, lag_anywhere, unexplained_shares
from .quick_motion import centre_of, stands_still
from .record import STEP, Record, Stretch, command_names, computed_once, values_called

_DERIVED = (0.1, 1.0)
"""A band slower than `QUICK` [Hz], for speeds that are made of positions, whose noise grows with frequency."""
_LEAST_BLOCKS = 8
"""Blocks that are needed: all of eight agree by chance in 1 of 128 cases."""
TIMES = 5.0
"""Standard errors from which a sign is certain."""
_SHARE = 0.15
"""Share of the record's size that a command must make: below, what else moves the boat may be what is seen. Thrusters
that drive the boat make two to four times as much, a propeller that was switched on once a tenth.
Steady, see `benchmarks/steady_limits.py`."""
_ALONE = 0.1
"""Share of a command's changes that no other command makes, from which its own effect can be told.
Twice as much finds the same, half of it accuses one sound log of 36 (`benchmarks/steady_limits.py --runs 6`)."""
_REACH, COARSE = 5.0, 0.1
"""Delays that are tried, both ways, and their step [s]: ten to the shortest period in the band is fine enough."""
MADE_GOOD = frozenset({"x", "y", "psi", "u"})
"""Channels that `made_good` needs."""
_ENDS = 0.25
"""Share of a stretch, at either end, up to which delays are tried: half of it is left to compare them on."""
SLOW = next(effect.parameters[0].upper for effect in EFFECTS if effect.name == "input_delay")
"""Longest delay of a boat after its commands [s]: none that the catalogue knows is longer."""
_LATE = 0.2
"""How much earlier than its row of the commands allows a sound boat may seem to answer [s]: a receiver that is late.
Steady, see `benchmarks/steady_limits.py`."""


@dataclass(frozen=True, slots=True)
class Answer:
    """How the boat answers one command that moves from neutral to its end.

    Attributes
    ----------
    surge, surge_error : [m/s^2] and its standard error
    yaw, yaw_error : [rad/s^2] and its standard error
    """

    surge: float
    surge_error: float
    yaw: float
    yaw_error: float

    @property
    def ahead(self) -> int:
        """1 where more of the command pushes ahead, -1 where it pushes astern, 0 where that is not certain."""
        return _sign(self.surge, self.surge_error)

    @property
    def turn(self) -> int:
        """1 where more of the command turns the boat to starboard, -1 to port, 0 where that is not certain."""
        return _sign(self.yaw, self.yaw_error)

    @property
    def side(self) -> str:
        """The side on which the thruster sits: pushing ahead, one at port turns the boat to starboard; or empty."""
        return {1: "port", -1: "starboard"}.get(self.turn * self.ahead, "")


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """The problem that a trial fits: changes of surge and yaw (n, 2) of power 1, columns of each, and their stretches.

    The first columns are those of the commands, in the order of their `names`.
    """

    names: tuple[str, ...]
    changes: Array
    columns: tuple[Array, ...]
    stretch: NDArray[np.int64]

    def errors(self, idle: Collection[str] = (), turning_nothing: Collection[str] = ()) -> Array:
        """Squared errors (n,) where some commands push nothing ahead, and some turn nothing."""
        result = np.zeros(self.stretch.size)
        for axis, silent in enumerate((idle, turning_nothing)):
            kept = np.delete(self.columns[axis], [k for k, name in enumerate(self.names) if name in silent], axis=1)
            result += self._errors(axis, kept)
        return result

    def _errors(self, axis: int, columns: Array) -> Array:
        wanted = self.changes[:, axis]
        return np.asarray((wanted - columns @ np.linalg.lstsq(columns, wanted, rcond=None)[0]) ** 2)

    def size_of_mix(self, throttle: str, steering: str) -> Size:
        """How much better a throttle that pushes alone and a steering that turns alone explain than two sides alike.

        Of surge and of yaw each, it is weighed against what the commands explain there.
        """
        alike, turned, mix, power = (np.zeros(self.stretch.size) for _ in range(4))  # or one of the sides turned round
        one, two = (self.names.index(name) for name in (throttle, steering))
        for axis, (alone, sign) in enumerate(((one, 1.0), (two, -1.0))):
            columns, besides = self.columns[axis], self.columns[axis][:, len(self.names) :]
            left = self._errors(axis, columns)
            explained = self._errors(axis, besides) - left
            total = max(float(explained.sum()), 1e-300)
            power += explained / total
            moved = (columns[:, one] + by * columns[:, two] for by in (sign, -sign))
            for found, column in zip((alike, turned, mix), (*moved, columns[:, alone]), strict=True):
                found += (self._errors(axis, np.column_stack([column, besides])) - left) / total
        return size_of(min(alike, turned, key=lambda sides: float(sides.sum())), mix, power, self.stretch)

    def size_beside(self, without: Array) -> Size:
        """How much of what the commands explain is gone where another fit leaves these squared errors (n,)."""
        left = self.errors()  # which is noise, and waves, and what else no command and no hull force makes
        gone, explained = without - left, self.errors(self.names, self.names) - left
        return size_of(gone, 0.0 * gone, explained, self.stretch)


@dataclass(frozen=True, slots=True)
class Trial:
    """The answers where the boat answers its commands `seconds` after them.

    Attributes
    ----------
    seconds : the delay tried [s]; negative where the boat moves before it is told to
    answers : to each command of one kind
    residual_squares : (stretches,) what this leaves of the changes of surge and yaw, over what the best delay leaves on
        average
    row : from one record of the commands to the next [s]
    fitted : what was fitted, to be weighed against other explanations
    """

    seconds: float
    answers: Mapping[str, Answer]
    residual_squares: Array
    row: float = COARSE
    fitted: "Fitted | None" = None

    @property
    def in_step(self) -> bool:
        """True when a sound log may have this delay."""
        return _earliest(self.row) <= self.seconds <= SLOW

    def contradicts(self, other: "Trial") -> bool:
        """True when a command pushes or turns the other way than in another trial."""
        pairs = [(self.answers[name], other.answers[name]) for name in self.answers]
        return any(one.ahead * two.ahead < 0 or one.turn * two.turn < 0 for one, two in pairs)


@dataclass(frozen=True, slots=True)
class Trials:
    """The delay that explains the motion best, and every other that may be the right one.

    Attributes
    ----------
    best : leaves least
    rivals : local optima of the delay that are not surely worse, best first
    stepped : the best of those in step, whether it is surely worse or not
    """

    best: Trial
    rivals: tuple[Trial, ...]
    stepped: Trial | None = None

    @property
    def contrary(self) -> tuple[Trial, ...]:
        """Rivals in which a command pushes or turns the other way: while there are any, no sign is certain."""
        return tuple(trial for trial in self.rivals if trial.contradicts(self.best))

    @property
    def late(self) -> bool:
        """True when it is certain that the boat answers at another time than a sound log may have it."""
        return not any(trial.in_step for trial in (self.best, *self.rivals))


def answers(records: Sequence[Record]) -> dict[str, Answer]:
    """The boat's answer to each command at the delay that explains it best, where its sign is certain; see `trials`."""
    return {name: answer for one in trials(records) if not one.contrary for name, answer in one.best.answers.items()}


def trials(records: Sequence[Record]) -> list[Trials]:
    """Fit the boat's answer to its commands, in the band of 0.2 to 2 Hz (0.1 to 1 Hz for speeds made of positions).

    Every delay within 5 s is tried, both ways. A delay is ruled out where it leaves more than the best one in so many
    stretches of the log that chance does not do it (see `surely_more`). A command that is late by
    half a period of what is sailed looks reversed: only this tells the two apart, and where it does not, nobody can.

    Commands of one kind are fitted together; one that never moves has no part in what changes. Commands of a kind are
    left out where one of them only ever moves with the others, and where there are fewer than eight stretches of the
    slowest period in the band. The error is infinite where a command makes too little of what the boat does.
    """
    return computed_once(records, "trials", lambda: _trials(records)) if records else []


def _trials(records: Sequence[Record]) -> list[Trials]:
    names = command_names(records)
    names = [name for name in names if not stands_still(records, name)]
    kinds = sorted({kind_of(name) for name in names})
    found = [_of_kind(records, [name for name in names if kind_of(name) == kind]) for kind in kinds]
    return [one for one in found if one is not None]


def made_good(record: Record, stretch: Stretch) -> Response:
    """The surge speed of a record, and what it makes good over ground by its places, which drive it: see `lag_of`."""
    motion = stretch.motion
    north, east = np.gradient(motion.position, STEP, axis=0).T
    ahead, _ = earth_to_body(motion.heading, north, east)
    return Response(motion.velocity[:, 0], ahead[:, None], np.zeros((motion.time.size, 0)))


@dataclass(frozen=True, slots=True, eq=False)
class _Table:
    """One stretch in the band: changes of surge and yaw (n, 2), commands (n, c), drag (n, 5), and numbered rows."""

    changes: Array
    commands: Array
    drag: Array
    stretch: NDArray[np.int64]

    def at(self, lag: int, margin: int) -> tuple[Array, Array, Array]:
        """Changes, commands and drag in the rows that every lag has, with the commands of `lag` rows before."""
        rows = slice(margin, self.changes.shape[0] - margin)
        moved = self.commands[margin - lag : self.commands.shape[0] - margin - lag]
        return self.changes[rows], moved, self.drag[rows]


def _of_kind(records: Sequence[Record], names: list[str]) -> Trials | None:
    centre = {name: centre_of(records, name) for name in names}
    tables, margin = _long_enough(_tables(records, names, centre))
    if not tables or not all(_alone(np.concatenate([t.commands for t in tables]), k) for k in range(len(names))):
        return None
    coarse = round(COARSE / STEP)
    lags = np.arange(-(margin // coarse), margin // coarse + 1) * coarse

    def left_at(tables: Sequence[_Table]) -> Array:
        return np.column_stack([_residual_squares(tables, lags.tolist(), margin, axis) for axis in range(2)])

    left, late = left_at(tables), _late_speeds(records)
    if late:  # late speeds answer later than the gyro does: no one delay fits both, and a wrong one turns a sign round
        moved, _ = _long_enough(_tables(records, names, centre, late))
        tables, left = min((tables, left), (moved, left_at(moved)), key=lambda tried: _scores(tried[1]).min())
    score = _scores(left)
    inner = np.flatnonzero((score[1:-1] <= score[:-2]) & (score[1:-1] < score[2:])) + 1
    row = row_of(records, names)
    near = np.flatnonzero((lags * STEP >= _earliest(row)) & (lags * STEP <= SLOW))
    # The delays at which a sound log may be are always tried: they need not be an optimum.
    tried = sorted({int(np.argmin(score)), *inner.tolist(), int(near[np.argmin(score[near])])}, key=lambda k: score[k])
    full = {name: float(np.abs(values_called(records, name) - centre[name]).max()) for name in names}
    found = [_trial(tables, int(lags[k]), margin, full, left[tried[0]], row) for k in tried]
    if found[0].residual_squares.size < _LEAST_BLOCKS:
        return None
    rivals = [one for one in found[1:] if not surely_more(one.residual_squares, found[0].residual_squares)]
    return Trials(found[0], tuple(rivals), next((trial for trial in found if trial.in_step), None))


def _scores(left: Array) -> Array:
    """What each lag leaves of surge and yaw together, (lags,), of (lags, 2)."""
    return np.asarray(np.log(left).sum(axis=1))


def _late_speeds(records: Sequence[Record]) -> float:
    """How much later than the places the speeds are [s], where that is known and may turn a sign round; else 0."""
    if not all(set(record.log.channels) >= MADE_GOOD for record in records):
        return 0.0
    lag = lag_anywhere([made_good(record, stretch) for record in records for stretch in record.stretches], STEP)
    known = lag is not None and lag.explained >= FOLLOWS and abs(lag.seconds) > max(STEP, CI * lag.error)
    return lag.seconds if lag is not None and known else 0.0


def _tables(
    records: Sequence[Record], names: list[str], centre: Mapping[str, float], late: float = 0.0
) -> list[_Table]:
    """The stretches of some logs in the band, with speeds `late` seconds earlier than they are stamped."""
    measured = all("u" in record.log.channels for record in records)
    band = QUICK if measured else _DERIVED
    tables, begun = [], 0
    for record in records:
        if not set(names) <= set(record.commands):
            continue
        columns = [record.commands.index(name) for name in names]
        for one in record.stretches:
            commands = one.commands[:, columns] - np.array([centre[name] for name in names])
            if one.motion.time.size < 2 * _REACH / STEP or not np.isfinite(commands).all():
                continue
            surge, _, rate = one.motion.velocity.T
            surge = np.interp(one.motion.time + late, one.motion.time, surge)
            drag = np.column_stack([surge, surge * np.abs(surge), rate, np.abs(surge) * rate, np.abs(rate) * rate])
            changes = np.column_stack([np.gradient(surge, STEP), np.gradient(rate, STEP)])
            table = band_passed(np.column_stack([changes, commands, drag]), STEP, band)
            number = ((one.motion.time - one.motion.time[0]) * band[0]).astype(np.int64)
            end = 2 + len(names)
            tables.append(_Table(table[:, :2], table[:, 2:end], table[:, end:], begun + number))
            begun += int(number[-1]) + 1
    return tables


def _earliest(row: float) -> float:
    """The least delay after its commands that a sound log may have [s]: a command was given up to a row before it."""
    return round(-_LATE - max(row, COARSE), 9)


def row_of(records: Sequence[Record], names: Iterable[str]) -> float:
    """The longest time from one record of some commands to the next, of those that are recorded at a rate [s]."""
    logged = (record.log.channels[n] for n in names for record in records if n in record.log.channels)
    return command_step(logged) or COARSE


def _long_enough(tables: list[_Table]) -> tuple[list[_Table], int]:
    """The stretches in which all delays can be tried, if they are most of the log; else all, and shorter delays."""
    sizes = np.array([table.changes.shape[0] for table in tables])
    long = sizes * _ENDS >= _REACH / STEP
    if 2 * sizes[long].sum() >= sizes.sum():
        return [table for table, enough in zip(tables, long, strict=True) if enough], round(_REACH / STEP)
    return tables, int(_ENDS * sizes.min())


_DRAG = (slice(0, 2), slice(2, 5))
"""The drag of surge and of yaw among the columns of a table: no number that decides."""


def _residual_squares(tables: Sequence[_Table], lags: Sequence[int], margin: int, axis: int) -> Array:
    """What least squares leave of the changes of surge or of yaw at each lag, (lags,)."""
    many, drag = tables[0].commands.shape[1], _DRAG[axis]
    size = many + drag.stop - drag.start + 1
    every = np.zeros((len(lags), size, size))
    for table in tables:
        changes, _, besides = table.at(0, margin)
        beside = np.column_stack([besides[:, drag], changes[:, axis]])
        every[:, many:, many:] += beside.T @ beside
        for gram, lag in zip(every, lags, strict=True):
            moved = table.at(lag, margin)[1]
            gram[:many, :many] += moved.T @ moved
            gram[:many, many:] += moved.T @ beside
    every[:, many:, :many] = every[:, :many, many:].swapaxes(1, 2)
    return np.asarray(np.maximum(every[:, -1, -1] * unexplained_shares(every), 1e-300))


def _trial(
    tables: Sequence[_Table], lag: int, margin: int, full: Mapping[str, float], scale: Array, row: float
) -> Trial:
    parts = [table.at(lag, margin) for table in tables]
    changes, commands, drag = (np.concatenate([part[k] for part in parts]) for k in range(3))
    stretch = np.concatenate([table.stretch[margin : table.stretch.size - margin] for table in tables])
    beside_drag = [np.column_stack([commands, drag[:, own]]) for own in _DRAG]
    surge, yaw = (robust_fit(columns, changes[:, axis], stretch) for axis, columns in enumerate(beside_drag))
    size, told = np.sqrt((commands**2).mean(axis=0)), {}
    powers = [max(np.sqrt((column**2).mean()), 1e-300) for column in changes.T]
    for k, name in enumerate(full):
        both = [_coefficient(fit, k, size[k] / power) for fit, power in zip((surge, yaw), powers, strict=True)]
        told[name] = Answer(*(full[name] * number for part in both for number in part))
    _, number = np.unique(stretch, return_inverse=True)
    count = int(number.max()) + 1 if number.size else 0

    left, size = np.zeros(count), np.maximum((changes**2).mean(axis=0), 1e-300)
    for axis, columns in enumerate(beside_drag):
        rest = changes[:, axis] - columns @ np.linalg.lstsq(columns, changes[:, axis], rcond=None)[0]
        left += np.bincount(number, rest**2, count) / scale[axis] * count
    fitted = Fitted(tuple(full), changes / np.sqrt(size), tuple(beside_drag), number)
    return Trial(lag * STEP, told, left, row, fitted)


def _coefficient(fit: Fit, place: int, size: float) -> tuple[float, float]:
    """A coefficient and its error, for a command of `size` times the record's."""
    value = float(fit.values[place])
    return value, float(fit.errors[place]) if abs(value) * size >= _SHARE else np.inf


def _alone(commands: Array, place: int) -> bool:
    """True when a command moves enough on its own for its effect to be told from the others'."""
    own = commands[:, place]
    power = float(own @ own)
    if power <= 0.0:
        return False
    others = np.delete(commands, place, axis=1)
    if others.shape[1]:
        own = own - others @ np.linalg.lstsq(others, own, rcond=None)[0]
    return float(own @ own) >= _ALONE * power


def _sign(value: float, error: float) -> int:
    return int(np.sign(value)) if abs(value) > TIMES * error else 0


SIDE = {"port": 1, "starboard": -1}
"""Sign of the yaw moment of a thruster on that side which pushes ahead."""


@dataclass(frozen=True, slots=True)
class Expected:
    """What a command should do: push ahead (1) or astern (-1), from port (1) or starboard (-1); 0 where nobody says."""

    push: int
    side: int
    thruster: Thruster | None = None

    def ahead_as(self, answer: Answer) -> bool:
        """True when nothing speaks against the way it pushes."""
        return answer.ahead * self.push >= 0


def expected_of(records: Sequence[Record], names: Sequence[str]) -> dict[str, Expected]:
    """By command; of the vehicle's own where it has some of them, since no other moves its model."""
    thrusters = {t.channel: t for record in records for t in (record.vehicle.thrusters if record.vehicle else ())}
    found = {}
    for name in [name for name in names if name in thrusters]:
        push, turn = push_and_turn(thrusters[name])
        found[name] = Expected(push, push * turn, thrusters[name])
    return found or {name: Expected(1, SIDE.get(side_of(name), 0)) for name in names}


def as_expected(told: Mapping[str, Answer], expected: Mapping[str, Expected]) -> bool:
    """True when no command pushes or turns the boat the other way."""
    pairs = [(answer, expected[name]) for name, answer in told.items() if name in expected]
    return all(e.ahead_as(a) and a.turn * e.push * e.side >= 0 for a, e in pairs)


def explained_as_expected(records: Sequence[Record]) -> bool:
    """True when what explains the log best, sure or not, lets every thruster push and turn as it should."""
    expected = expected_of(records, command_names(records))
    return all(as_expected(one.best.answers, expected) for one in trials(records))


def side_of(name: str) -> str:
    """The side that a command's name speaks of, empty where it speaks of none.

    >>> side_of("pwm_stbd"), side_of("newton_bow")
    ('starboard', '')
    """
    return side_named((command_kind(name) or ("", name))[1])


def source_of(records: Sequence[Record], name: str) -> str:
    """What a command was read from."""
    return next(record.log.channels[name].origin for record in records if name in record.log.channels)


def called(records: Sequence[Record], name: str) -> str:
    """A command by its name, with what it was read from where that is called otherwise."""
    origin = source_of(records, name)
    return name if origin == name or origin.endswith(f":{name}") else f"{origin} (read as {name})"


def other_side(name: str) -> str:
    """The name of the same command on the other side."""
    other = {"port": "stbd", "left": "right", "stbd": "port", "starboard": "port", "right": "left"}
    kind, thruster = command_kind(name) or ("", name)
    return f"{kind}_{'_'.join(other.get(word, word) for word in thruster.split('_'))}"
