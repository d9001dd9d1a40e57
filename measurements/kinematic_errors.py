"""Errors of sensors: their sizes, the words that tell of them, and a motion as right sensors would have measured it."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..physics.frames import Array, body_to_earth, earth_to_body
from ..physics.motion import Motion
from .compass import remeasured

_CLEARLY = 6.0
"""Standard errors from which an error is there: of the stretches of one log they are known to a third."""
_OF_TURNING = 0.1
"""Share of the turning of a log from which a gyro's bias matters, however small it is."""
LEAST_LEFT = 2.5
"""Length [s] that a motion keeps when its ends go; a shorter one keeps them."""
LIMITS = {
    "gyro_scale": (0.01, 0.3),
    "gyro_bias": (0.002, 0.2),
    "compass_sine": (0.02, 0.6),
    "compass_cosine": (0.02, 0.6),
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
    each other as no such errors explain, `body_speeds` True for speeds that a heading that deviates did not turn, and
    `turning` the rms yaw rate [rad/s], beside which a gyro's bias matters: a ship turns slower than a boat's gyro errs.
    """

    values: Mapping[str, tuple[float, float]]
    agree: bool = True
    body_speeds: bool = False
    turning: float = np.inf

    def least(self, name: str) -> float:
        """The size from which an error matters."""
        return min(LIMITS[name][0], _OF_TURNING * self.turning) if name == "gyro_bias" else LIMITS[name][0]

    @property
    def beyond(self) -> tuple[str, ...]:
        """What is further off than any sensor is: something else is wrong with a record."""
        off = {name: (abs(value - right_value(name)), error) for name, (value, error) in self.values.items()}
        return tuple(name for name, (by, error) in off.items() if by > max(LIMITS[name][1], _CLEARLY * error))

    def sharp(self, name: str) -> bool:
        """Whether an error that matters would have shown."""
        return name in self.values and 2.0 * self.values[name][1] <= self.least(name)

    @property
    def present(self) -> tuple[str, ...]:
        """Errors that are clear, material, and such as sensors have."""
        found = []
        for name, (value, error) in self.values.items():
            if max(_CLEARLY * error, self.least(name)) < abs(value - right_value(name)) <= LIMITS[name][1]:
                found.append(name)
        return tuple(found)

    @property
    def errors(self) -> dict[str, float]:
        """The errors that are present, by name, as `corrected_for` takes them."""
        present = set(self.present)
        pairs = [(second, first) for second, first in _PAIRS.items() if {first, second} & present]
        present |= {name for pair in pairs for name in pair if name in self.values}
        found = {name: self.values[name][0] for name in self.values if name in present}
        return found | ({"body_speeds": 1.0} if self.body_speeds and "compass_sine" in found else {})

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
            told[first] = _WORDS[first].format(a, b, np.degrees(a), np.degrees(b), 100.0 * abs(a - 1.0), _less(a))
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


def _less(scale: float) -> str:
    return "little" if scale < 1.0 else "much"


def right_value(name: str) -> float:
    """What a sensor without an error has: 1 for a scale, else 0."""
    return 1.0 if name.endswith("scale") else 0.0


def corrected_for(motion: Motion, errors: Mapping[str, float]) -> Motion:
    """A motion without errors of its sensors, by name; rows at its ends for which a late record has no value go.

    Beside those of `Kinematics` there are errors that no other record shows: compass_constant [rad], which a heading
    lacks that turned the speeds, and mount_x and mount_y [m], where places and speeds are measured.
    """
    if not errors:
        return motion
    time, late = motion.time, [errors.get(f"{name}_latency", 0.0) for name in ("velocity", "position")]

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

    on_row = np.column_stack([on_time(motion.velocity[:, :2], late[0]), motion.velocity[:, 2]])
    found = remeasured(motion, true, on_row)
    ones = np.ones_like(motion.heading)
    places = (errors.get("arm_x", 0.0) + mount[0]) * ones, (errors.get("arm_y", 0.0) + mount[1]) * ones
    arm = body_to_earth(found.heading, *places)
    found = replace(found, position=on_time(motion.position, late[1]) - np.column_stack(arm))
    first, last = (int(np.ceil(max(0.0, *side) / motion.time_step)) for side in ([-x for x in late], late))
    enough = (time.size - first - last) * motion.time_step > LEAST_LEFT
    return found.slice(first, time.size - last) if (first or last) and enough else found
