"""Kinematics: errors of sensors that records show of each other, with no force in between, and their correction.

psi_dot = (r - bias) / scale and p_dot = R(psi) nu hold whatever drives the boat (Fossen 2021, eq. 2.14 and 2.58), up to
scales, deviation, delays, moving water and lever arms. Both are fitted in weak form, so that no record is
differentiated, and all errors at once, so that none is blamed for another.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..physics.motion import Array, Motion, body_to_earth, earth_to_body
from .canonical import MOTION, Channel
from .compass import BENT, Compass, compass_of, remeasured
from .statistics.blocks import Fit, numbered_on, robust_fit

_CLEARLY = 6.0
"""Standard errors from which an error is there: of the stretches of one log they are known to a third."""
_OF_TURNING = 0.1
"""Share of the turning of a log from which a gyro's bias matters, however small it is."""
_TURNS_WITHIN = 1.0 / (2.0 * np.pi)
"""Time within which a boat's quickest turns change by themselves [s]: those of 1 Hz, beyond which is noise."""
LEAST_LEFT = 2.5
"""Length [s] that a motion keeps when its ends go; a shorter one keeps them."""
LIMITS = {
    "gyro_scale": (0.01, 0.3),
    "gyro_bias": (0.002, 0.2),
    "compass_sine": (0.02, BENT),
    "compass_cosine": (0.02, BENT),
    "velocity_scale": (0.01, 0.3),
    "misalignment": (0.02, 0.6),
    "velocity_latency": (0.03, 1.0),
    "position_latency": (0.03, 1.0),
    "water_north": (0.03, 3.0),
    "water_east": (0.03, 3.0),
    "arm_x": (0.1, 30.0),
    "arm_y": (0.1, 30.0),
}
"""Sizes [1, rad/s, rad, rad; 1, rad, s, s; m/s, m/s, m, m] from which an error matters, which is more than data sheets
of small sensors allow, and beyond which something else is wrong with a record."""


@dataclass(frozen=True, slots=True)
class Kinematics:
    """What the records of a log say of each other, by name: value and standard error; none where they cannot tell.

    Scales are 1 for a right sensor, all others 0: gyro_bias [rad/s]; the deviation compass_sine sin(psi) +
    compass_cosine cos(psi) and the constant misalignment [rad] that a heading lacks; how much later than the heading
    the speeds and the positions tell of a motion [s]; the way over ground that speeds miss, water_north and water_east
    [m/s]; and where the antenna of the positions is, arm_x and arm_y [m]. `agree` is False where the records contradict
    each other as no such errors explain, `body_speeds` True for speeds that a heading that deviates did not turn,
    `turning` the rms yaw rate [rad/s], beside which a gyro's bias matters: a ship turns slower than a boat's gyro errs,
    and `row` the longest step of a record [s], between which a line bends the motion; see `bend_between_rows`.
    """

    values: Mapping[str, tuple[float, float]]
    agree: bool = True
    body_speeds: bool = False
    turning: float = np.inf
    row: float = 0.0

    def least(self, name: str) -> float:
        """The size from which an error matters."""
        if name.endswith("latency"):
            return max(LIMITS[name][0], bend_between_rows(self.row))
        return min(LIMITS[name][0], _OF_TURNING * self.turning) if name == "gyro_bias" else LIMITS[name][0]

    def large(self, name: str) -> bool:
        """True when an error, or the other part of it, is nearer to the largest of sensors than to the least."""
        parts = [part for part in (name, _OTHER.get(name, name)) if part in self.values]
        return any(abs(self.values[p][0] - right_value(p)) > np.sqrt(LIMITS[p][0] * LIMITS[p][1]) for p in parts)

    @property
    def beyond(self) -> tuple[str, ...]:
        """What is further off than any sensor is: something else is wrong with a record."""
        off = {name: (abs(value - right_value(name)), error) for name, (value, error) in self.values.items()}
        return tuple(name for name, (by, error) in off.items() if by > max(LIMITS[name][1], _CLEARLY * error))

    def sharp(self, name: str) -> bool:
        """True when an error that matters would have shown."""
        return name in self.values and 2.0 * self.values[name][1] <= self.least(name)

    @property
    def present(self) -> tuple[str, ...]:
        """Errors that are clear, material, and such as sensors have."""
        off = {name: (abs(value - right_value(name)), error) for name, (value, error) in self.values.items()}
        least = {name: max(_CLEARLY * error, self.least(name)) for name, (_, error) in off.items()}
        return tuple(name for name, (by, _) in off.items() if least[name] < by <= LIMITS[name][1])

    @property
    def errors(self) -> dict[str, float]:
        """The errors that are present, by name, as `corrected_for` takes them."""
        present = set(self.present)
        pairs = [(second, first) for second, first in _PAIRS.items() if {first, second} & present]
        present |= {name for pair in pairs for name in pair if name in self.values}
        found = {name: self.values[name][0] for name in self.values if name in present}
        return found | ({"body_speeds": 1.0} if self.body_speeds and "compass_sine" in found else {})

    @property
    def late_over_ground(self) -> float:
        """How late speeds over ground came that the heading of that moment turned [s]; 0 where they did not."""
        return _late_over_ground(self.errors)

    def errors_but(self, left: Collection[str] = ()) -> dict[str, float]:
        """The errors that are present without some, which are named as `sentences` names what it tells of."""
        return {name: value for name, value in self.errors.items() if _PAIRS.get(name, name) not in left}

    @property
    def sentences(self) -> dict[str, str]:
        """What is wrong, in words with numbers, by name; the two parts of one vector are told together."""
        told: dict[str, str] = {}
        for name in self.present:
            first = _PAIRS.get(name, name)
            a, b = (self.values.get(n, (0.0, 0.0))[0] for n in (first, _OTHER.get(first, first)))
            words = _OVER_GROUND if name == "position_latency" and self.late_over_ground else _WORDS[first]
            told[first] = words.format(a, b, np.degrees(a), np.degrees(b), 100.0 * abs(a - 1.0), _less(a), -a)
        return told


_PAIRS = {"compass_cosine": "compass_sine", "water_east": "water_north", "arm_y": "arm_x"}
_OTHER = {first: second for second, first in _PAIRS.items()}
_WORDS = {
    "gyro_scale": "the gyro shows {0:.3f} of the turning that the heading tells of, {4:.1f} % too {5}",
    "gyro_bias": "the gyro is off by {0:+.4f} rad/s, as the heading tells",
    "compass_sine": "the compass lacks {2:+.1f} sin(psi) {3:+.1f} cos(psi) degrees, as the gyro tells",
    "velocity_scale": "the speeds are {0:.3f} of those that the positions tell of, {4:.1f} % too {5}",
    "misalignment": "the heading lacks {2:+.1f} degrees, as the ways of speeds and positions tell",
    "velocity_latency": "the speeds are {0:+.2f} s later than the heading, as the way in turns tells",
    "position_latency": "the positions are {0:+.2f} s later than the heading, as the way in turns tells",
    "water_north": "the speeds miss {0:+.2f} m/s to the north and {1:+.2f} m/s to the east of the way over ground, as "
    "those through moving water do",
    "arm_x": "the antenna of the positions is {0:+.2f} m ahead and {1:+.2f} m to starboard of where the speeds are",
}

_OVER_GROUND = "the speeds over ground are {6:.2f} s later than the positions, as of a receiver that smooths them"
"""Of positions that tell of a motion before heading and speeds do, which no record can."""


def bend_between_rows(row: float) -> float:
    """The delay that lines between rows feign [s]: a curve of curvature c lies c row^2 / 12 beside them on the mean.

    Parameters
    ----------
    row : from one row of a record to the next [s]

    Examples
    --------
    >>> [round(bend_between_rows(1.0 / rate), 3) for rate in (10, 5, 1)]
    [0.005, 0.021, 0.524]
    """
    return row**2 / 12.0 / _TURNS_WITHIN


def _less(scale: float) -> str:
    return "little" if scale < 1.0 else "much"


def right_value(name: str) -> float:
    """What a sensor without an error has: 1 for a scale, else 0."""
    return 1.0 if name.endswith("scale") else 0.0


def _late_over_ground(errors: Mapping[str, float]) -> float:
    """How late speeds over ground are [s]: no record tells of what will be, so it is not the positions that are ahead.

    Such are the speeds of a receiver that smooths them, and that the heading turned into the body when they came.
    """
    ahead = -errors.get("position_latency", 0.0)
    return max(ahead, 0.0) if errors.get("velocity_latency", 0.0) >= 0.0 else 0.0


def moved_over_ground(time: Array, heading: Array, speeds: Array, seconds: float) -> Array:
    """Speeds moved in time as vectors over ground, while the heading stays, (n, 2) [m/s].

    Parameters
    ----------
    time, heading : (n,) [s], [rad]
    speeds : (n, 2) ahead and to starboard [m/s]
    seconds : by which they come later; less than 0: earlier [s]
    """
    ground = body_to_earth(heading, *speeds.T)
    return np.column_stack(earth_to_body(heading, *(np.interp(time - seconds, time, part) for part in ground)))


def corrected_for(motion: Motion, errors: Mapping[str, float]) -> Motion:
    """A motion without errors of its sensors, by name; rows at its ends for which a late record has no value go.

    Beside those of `Kinematics` there are errors that no other record shows: compass_constant [rad], which a heading
    lacks that turned the speeds, and mount_x and mount_y [m], where places and speeds are measured.
    """
    if not errors:
        return motion
    time, late = motion.time, [errors.get(f"{name}_latency", 0.0) for name in ("velocity", "position")]
    over_ground = _late_over_ground(errors)
    late[1] += over_ground

    def on_time(series: Array, by: float) -> Array:
        return np.column_stack([np.interp(time + by, time, column) for column in series.T]) if by else series

    mount = errors.get("mount_x", 0.0), errors.get("mount_y", 0.0)

    def true(heading: Array, velocity: Array) -> tuple[Array, Array]:
        rate = (velocity[:, 2] - errors.get("gyro_bias", 0.0)) / errors.get("gyro_scale", 1.0)
        surge, sway = velocity[:, :2].T / errors.get("velocity_scale", 1.0)
        sine, cosine = errors.get("compass_sine", 0.0), errors.get("compass_cosine", 0.0)
        deviation = errors.get("compass_constant", 0.0) + sine * np.sin(heading) + cosine * np.cos(heading)
        # Speeds that a satellite measured over ground were turned into the body by the heading: they turn back with it.
        if not errors.get("body_speeds"):
            surge, sway = earth_to_body(deviation, surge, sway)
        heading = heading + deviation + errors.get("misalignment", 0.0)
        north, east = (np.full_like(heading, errors.get(f"water_{side}", 0.0)) for side in ("north", "east"))
        ahead, aside = earth_to_body(heading, north, east)
        return heading, np.column_stack([surge + ahead + mount[1] * rate, sway + aside - mount[0] * rate, rate])

    speeds = motion.velocity[:, :2]
    if over_ground:
        speeds = moved_over_ground(time, motion.heading, speeds, -over_ground)
    on_row = np.column_stack([on_time(speeds, late[0]), motion.velocity[:, 2]])
    found = remeasured(motion, true, on_row)
    ones = np.ones_like(motion.heading)
    places = (errors.get("arm_x", 0.0) + mount[0]) * ones, (errors.get("arm_y", 0.0) + mount[1]) * ones
    arm = body_to_earth(found.heading, *places)
    found = replace(found, position=on_time(motion.position, late[1]) - np.column_stack(arm))
    late = [late[0] + over_ground, late[1]]
    first, last = (int(np.ceil(max(0.0, *side) / motion.time_step)) for side in ([-x for x in late], late))
    enough = (time.size - first - last) * motion.time_step > LEAST_LEFT
    return found.slice(first, time.size - last) if (first or last) and enough else found


_HALF, _STRIDE, _BLOCK = 1.0, 0.25, 10.0
"""Half the support of a test function, the distance of two, and a stretch that counts once [s]."""
_LONG = 4.0
"""Half the support of other test functions [s], by which the gyro is asked again: a heading that a filter made of a
compass and that same gyro follows the one fast and the other slowly, and what it says depends on the time."""
_TURNS, _ALL_ROUND = 4.0 * np.pi, 6
"""Turning [rad] and eighths of the circle without which a gyro's scale and a compass' deviation look alike."""
_PASSED = 0.02
"""Share of the rows from which a boat has been on an eighth of the circle."""
_LEAST_HALF = 4
"""Rows in half a test function: of fewer, sums are no integrals."""
_LEAST_ROWS = 60
"""Test functions without which nothing is said: 15 s."""
_LEAST_SLOPE = 0.1
"""Of one record over another of the same motion, below which they are not of the same."""
_CLEARLY_LATE = 6.0
"""Standard errors from which a gyro is late."""
_ROUNDS = 4
"""Fits and corrections in turn: what is found of a delay bends what is found of the rest."""
_GYRO = ("gyro_scale", "gyro_bias", "compass_sine", "compass_cosine")
_SPEEDS = ("velocity_scale", "misalignment", "heading_latency", "position_latency")
_PLACES = ("water_north", "water_east", "arm_x", "arm_y")


def longest_row(channels: Mapping[str, Channel]) -> float:
    """The longest step of the records that are compared [s]."""
    return max((channel.period for name, channel in channels.items() if name in MOTION), default=0.0)


def kinematics_of(motions: Sequence[Motion], channels: Collection[str] = MOTION, row: float = 0.0) -> Kinematics:
    """What is wrong with the sensors of a log, as far as its records tell it of each other.

    Parameters
    ----------
    motions : gap-free stretches of one log, unfiltered
    channels : that the log has; records that were derived from others say nothing of them
    row : longest step of these records in the log [s]
    """
    gyro, speeds = {"psi", "r"} <= set(channels), {"x", "y", "u", "v", "psi"} <= set(channels)
    motions = [m for m in motions if m.duration > LEAST_LEFT]
    total: dict[str, float] = {}
    turning = float(np.sqrt(np.mean(np.concatenate([m.velocity[:, 2] for m in motions]) ** 2))) if motions else np.inf
    here, body = tuple(motions), False
    for _ in range(_ROUNDS):
        found = replace(_compared(here, gyro, speeds, row), turning=turning, row=row)
        wrong = [name for name in found.present if name.endswith("latency")] or found.present
        values = {
            n: (total.get(n, right_value(n)) + v - right_value(n), error) for n, (v, error) in found.values.items()
        }
        so_far = Kinematics(values, body_speeds=body, turning=turning, row=row)
        if not wrong or so_far.beyond:
            return so_far
        for name in wrong:
            total[name] = values[name][0]
        if speeds and ("compass_sine" in wrong or "compass_cosine" in wrong):
            left = _unexplained_share(motions, {**total, "body_speeds": 1.0})
            body = left < _unexplained_share(motions, total)
        flags = {"body_speeds": 1.0} if body else {}
        here = tuple(corrected_for(motion, {**total, **flags}) for motion in motions)
    return Kinematics({}, agree=False)


def turning_of(motions: Sequence[Motion]) -> Kinematics:
    """The gyro's scale beside a heading, where the boat turns too little to tell it from a compass that deviates.

    Nothing where it turns enough, for then `kinematics_of` tells the two apart.
    """
    seen = [m for m in motions if not m.derived[2] and m.duration > LEAST_LEFT]
    if not seen or "gyro_scale" in _of_gyro(seen):
        return Kinematics({})
    fit = _fit([(columns[:, :2], rate, stretch) for columns, rate, stretch in (_turning(m, _HALF) for m in seen)])
    if fit is None or fit.values[0] < _LEAST_SLOPE:
        return Kinematics({})
    slope, error = float(fit.values[0]), float(fit.errors[0])
    return Kinematics({"gyro_scale": (1.0 / slope, error / slope**2)})


def gyro_lateness(motions: Sequence[Motion]) -> float:
    """How much later the gyro tells of turns than the heading does [s]; 0 where that is not clear, or is rounding.

    To first order: psi_dot(t) = r(t) + T dr/dt for a gyro that is T late.
    """
    seen = [m for m in motions if not m.derived[2] and m.duration > LEAST_LEFT]
    asked = [_turning(motion, _HALF) for motion in seen]
    fit = _fit([(columns[:, [0, 1, 4]], rate, stretch) for columns, rate, stretch in asked])
    if fit is None or not fit.certain(2, _CLEARLY_LATE):
        return 0.0
    late = float(fit.values[2])
    return late if abs(late) > 0.5 * max(motion.time_step for motion in seen) else 0.0


def _unexplained_share(motions: Sequence[Motion], errors: Mapping[str, float]) -> float:
    """Share of the way over ground that speeds do not explain beside errors."""
    fit = _fit([_moving(corrected_for(m, errors)) for m in motions if not any(m.derived[:2])])
    return 1.0 if fit is None else 1.0 - fit.explained


def compass_shown(motions: Sequence[Motion]) -> Compass:
    """What straight runs say of the compass, once the gyro has said what it can of it.

    A deviation that changes with the heading makes the heading turn faster or slower than the gyro. Where that is
    known not to be, the sway of straight runs that changes with the heading is drift, as of a boat that a weak thruster
    or lift in a turn pushes aside.
    """
    seen = _of_gyro([m for m in motions if not m.derived[2]])
    known = Kinematics(seen)
    parts = ("compass_sine", "compass_cosine")
    none = all(known.sharp(name) and abs(seen[name][0]) <= LIMITS[name][0] for name in parts)
    return compass_of(motions, constant=none)


def _compared(motions: Sequence[Motion], gyro: bool, speeds: bool, row: float) -> Kinematics:
    """One fit of heading to gyro, and one of positions to speeds, where the log has both."""
    found = _of_gyro([m for m in motions if not m.derived[2]]) if gyro else {}
    fit = _fit([_moving(m) for m in motions if not any(m.derived[:2])]) if speeds else None
    if fit is not None and fit.values[0] > _LEAST_SLOPE:
        found |= dict(zip((*_SPEEDS, *_PLACES), zip(fit.values, fit.errors, strict=True), strict=True))
        slope, error = found["velocity_scale"]
        cut_short, speed = _chords(motions, row)
        off = speed * bend_between_rows(row)
        found["velocity_scale"] = 1.0 / slope, error / slope**2 + cut_short / _CLEARLY
        found |= {name: (found[name][0], found[name][1] + off / _CLEARLY) for name in ("arm_x", "arm_y")}
        # Of speeds that are late by a and positions by b, the fit shows -a beside the heading, and a - b.
        (ahead, unsure), (apart, error) = found.pop("heading_latency"), found["position_latency"]
        found["velocity_latency"] = -ahead, unsure
        found["position_latency"] = -ahead - apart, float(np.hypot(unsure, error))
    known = {name: (float(value), float(error)) for name, (value, error) in found.items()}
    return Kinematics({name: pair for name, pair in known.items() if np.isfinite(pair).all()})


def _chords(motions: Sequence[Motion], row: float) -> tuple[float, float]:
    """Share of the way that lines between positions `row` [s] apart leave out, and the usual speed [m/s].

    Chords of an arc of radius R lie at R (1 - r^2 row^2 / 12) on the mean; speeds turned by the heading do not.
    """
    velocity = np.concatenate([motion.velocity for motion in motions])
    power, turning = (velocity[:, :2] ** 2).sum(axis=1), velocity[:, 2] ** 2
    share = float(power @ turning / max(float(power.sum()), 1e-300))
    return share * row**2 / 12.0, float(np.sqrt(power.mean()))


def _of_gyro(motions: Sequence[Motion]) -> dict[str, tuple[float, float]]:
    """What heading and gyro say of each other: all of it where the boat turns enough and every way, else the bias.

    A bias turns the heading all the time, as no scale and no compass does.
    """
    heading = np.concatenate([np.zeros(0), *(m.heading for m in motions)])
    eighths = np.bincount((heading // (0.25 * np.pi)).astype(int) % 8, minlength=8) >= _PASSED * heading.size
    turned = sum(float(np.abs(np.diff(m.heading[:: max(1, round(_HALF / m.time_step))])).sum()) for m in motions)
    enough = turned >= _TURNS and np.count_nonzero(eighths) >= _ALL_ROUND
    asked = [[_turning(m, half) for m in motions] for half in (_HALF, _LONG)]
    if not enough:
        asked = [[(columns[:, :2], rate, stretch) for columns, rate, stretch in one] for one in asked]
    short, long = map(_fit, asked)
    if short is None or long is None or min(short.values[0], long.values[0]) < _LEAST_SLOPE:
        return {}
    (slope, shift), (other, away) = short.values[:2], long.values[:2]
    pairs = [
        (1.0 / slope, 1.0 / other, short.errors[0] / slope**2),
        (-shift / slope, -away / other, short.errors[1] / abs(slope)),
        *((short.values[k], long.values[k], short.errors[k]) for k in (2, 3) if enough),
    ]
    found = {name: (a, max(error, abs(a - b))) for name, (a, b, error) in zip(_GYRO, pairs, strict=False)}
    return found if enough else {"gyro_bias": found["gyro_bias"]}


def _fit(parts: Sequence[tuple[Array, Array, NDArray[np.int64]]]) -> Fit | None:
    """The robust fit of columns (n, p) to a target (n,), in stretches (n,) of the motions one after the other."""
    if sum(target.size for _, target, _ in parts) < _LEAST_ROWS:
        return None
    columns, target, stretch = zip(*parts, strict=True)
    return robust_fit(np.concatenate(columns), np.concatenate(target), numbered_on(stretch))


def _turning(motion: Motion, half: float) -> tuple[Array, Array, NDArray[np.int64]]:
    """Rate of the heading; gyro, its bias, the deviations of the compass, and a gyro that is late."""
    value, rate, stretch = _tests(motion, half)
    psi, r = motion.heading, motion.velocity[:, 2]
    columns = [value(r), value(np.ones_like(r)), -rate(np.sin(psi)), -rate(np.cos(psi)), rate(r)]
    return np.column_stack(columns), rate(psi), stretch


def _moving(motion: Motion) -> tuple[Array, Array, NDArray[np.int64]]:
    """Rates of the position, north and then east; what is due to speeds, heading, delays, water and arm."""
    value, rate, stretch = _tests(motion, _HALF)
    psi, (u, v, r) = motion.heading, motion.velocity.T
    north, east = body_to_earth(psi, u, v)
    cos, sin, one, none = np.cos(psi), np.sin(psi), np.ones_like(u), np.zeros_like(u)
    averaged = [(north, east), (-east, north), (-r * east, r * north)]
    columns = [np.concatenate([value(a), value(b)]) for a, b in averaged]
    columns.append(np.concatenate([rate(north), rate(east)]))
    columns += [np.concatenate([value(a), value(b)]) for a, b in ((one, none), (none, one))]
    columns += [np.concatenate([rate(a), rate(b)]) for a, b in ((cos, sin), (-sin, cos))]
    target = np.concatenate([rate(x) for x in motion.position.T])
    return np.column_stack(columns), target, np.concatenate([stretch, stretch])


def _tests(
    motion: Motion, support: float
) -> tuple[Callable[[Array], Array], Callable[[Array], Array], NDArray[np.int64]]:
    """Averages of a series (n,) under test functions, those of its derivative, and the stretch of each."""
    step = motion.time_step
    half = max(_LEAST_HALF, round(support / step))
    grid = np.arange(-half, half + 1) / half
    phi = (1.0 - grid**2) ** 3
    slope = -6.0 * grid * (1.0 - grid**2) ** 2 / (half * step)
    stride = max(1, round(_STRIDE / step))

    def through(weights: Array, unit: float) -> Callable[[Array], Array]:
        def apply(series: Array) -> Array:
            if series.size <= 2 * half:
                return np.zeros(0)
            return np.convolve(series, weights[::-1], mode="valid")[::stride] / unit

        return apply

    centres = motion.time[half : motion.time.size - half : stride] - motion.time[0]
    ramp = float(-slope @ grid) * half * step  # what the sum, not the integral, makes of a rate of one
    return through(phi, phi.sum()), through(-slope, ramp), (centres // _BLOCK).astype(np.int64)
