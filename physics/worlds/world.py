"""Worlds: a vehicle with a hidden effect drives a programme in waves, and sensors write the log.

First-order wave motion is added to the motion of the forces, as is usual for control (Fossen 2021, chapter 10): the
boat follows the orbits of the water and turns with it. Sensors see waves, but no mean force acts.
"""

import gzip
import io
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import RequestError, expect, nearest
from ..files import in_stamps, parquet_data, remark, write_bytes
from ..forces import apparent_wind
from ..integration import SPEED_LIMIT, simulate_motion
from ..motion import GRAVITY, Array, Motion, body_to_earth, earth_to_body, wrap_angle
from ..registry_members import how_to_install
from ..sampled_series import area_average, understated_noise
from ..vehicle import Vehicle
from .hidden_effects import Values, apply_effects
from .manoeuvres import COMMAND_STEP, programme

ODOMETRY_FIELDS = ("x", "y", "psi", "u", "v", "r")
WIND_FIELDS = ("wind_u", "wind_v")
_ENDINGS = (".csv", ".csv.gz", ".parquet")


def check_ending(path: Path) -> None:
    """Refuse a name whose ending promises another format, or that no reader looks for in a folder.

    Raises
    ------
    RequestError
        for an ending that is none of .csv, .csv.gz and .parquet; a name without one is a table.
    """
    if path.suffix and not path.name.lower().endswith(_ENDINGS):
        raise RequestError(
            f"cannot write {path}: expected a name that ends in .csv, .csv.gz or .parquet; bags are read, not written"
        )


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedLog:
    """A log of a world, and the truth.

    Attributes
    ----------
    vehicle : the true vehicle, effects included
    truth : the motion without noise and waves, on the simulation's grid
    odometry_time : (n,) stamps [s], increasing
    odometry : (n, 6) north, east [m], psi [rad, continuous], u, v [m/s], r [rad/s], noisy
    command_time : (m,) stamps [s], increasing; a command is held until the next stamp
    commands : (m, thrusters) in the thrusters' command units
    wind : (n, 2) apparent wind, ahead and to starboard [m/s], at the stamps of the odometry, noisy; None without an
        anemometer
    """

    vehicle: Vehicle
    truth: Motion
    odometry_time: Array
    odometry: Array
    command_time: Array
    commands: Array
    wind: Array | None = None

    def motion(self, time_step: float = 0.05) -> Motion:
        """The logged (noisy) motion on an even grid, without a file in between.

        Measurements are interpolated linearly (over dropouts too), held commands become means over each step.

        Parameters
        ----------
        time_step : [s]

        Raises
        ------
        RequestError
            when the log has no two grid points.
        """
        stamps = self.odometry_time
        first, last = np.ceil(stamps[0] / time_step - 1e-6), np.floor(stamps[-1] / time_step + 1e-6)
        if not time_step > 0 or last <= first:
            raise RequestError(f"motion: a step of {time_step:g} s does not fit a log of {stamps[-1] - stamps[0]:g} s")
        time = time_step * np.arange(first, last + 1)
        columns = [np.interp(time, stamps, column) for column in self.odometry.T]
        state = np.column_stack(columns)
        commands = area_average(self.command_time, self.commands, time, time_step)
        told = understated_noise(stamps, time)
        air = None
        if self.wind is not None:
            ahead, starboard = (np.interp(time, stamps, column) for column in self.wind.T)
            air = np.column_stack(body_to_earth(columns[2], ahead + columns[3], starboard + columns[4]))
        return Motion(
            time,
            state[:, :2].copy(),
            columns[2],
            state[:, 3:].copy(),
            commands,
            self.truth.thrusters,
            self.truth.source,
            air=air,
            understated=(told, told, told),
        )

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write the log as a long table `time,topic,field,value` (NED/FRD, seconds), to a temporary name, then renamed.

        Topic `odometry` has the fields x y psi u v r, topic `command` one field `<command>_<thruster>` each, and topic
        `anemometer`, if there is one, wind_u and wind_v. Gzip when the name ends in `.csv.gz`, Parquet when it ends in
        `.parquet`, CSV when it ends in `.csv` or has no ending. The same log gives the same bytes, with a mark of the
        verb `simulate` (see `files`).

        Raises
        ------
        RequestError
            when the folder does not exist, the name ends otherwise, or Parquet is asked for without pyarrow.
        """
        target = Path(path)
        check_ending(target)
        if not target.parent.is_dir():
            raise RequestError(f"cannot write {target}: the folder {target.parent} does not exist; create it first")
        if target.suffix.lower() == ".parquet":
            data = self._parquet(target)
        else:
            text = "".join(["time,topic,field,value\n", *(f"{t:.6f},{a},{b},{x:.9g}\n" for t, a, b, x in self._rows())])
            data = in_stamps(text).encode("utf-8")
            data = gzip.compress(data, mtime=0) if target.suffix.lower() == ".gz" else data
        return write_bytes(target, data)

    def _rows(self) -> list[tuple[float, str, str, float]]:
        state = self.odometry.copy()
        state[:, 2] = wrap_angle(state[:, 2])
        channels = [t.channel for t in self.vehicle.thrusters]
        wind = [] if self.wind is None else [("anemometer", WIND_FIELDS, self.odometry_time, self.wind)]
        rows = [
            (t, topic, field, x)
            for topic, names, stamps, table in (
                ("command", channels, self.command_time, self.commands),
                ("odometry", ODOMETRY_FIELDS, self.odometry_time, state),
                *wind,
            )
            for t, line in zip(stamps.tolist(), table.tolist(), strict=True)
            for field, x in zip(names, line, strict=True)
        ]
        return sorted(rows, key=lambda row: row[0])

    def _parquet(self, target: Path) -> bytes:
        import pandas as pd

        table = pd.DataFrame(self._rows(), columns=["time", "topic", "field", "value"])
        plain, marked = io.BytesIO(), io.BytesIO()
        try:
            table.to_parquet(plain, index=False)
            table.attrs["undertow"] = remark("simulate", parquet_data(plain.getvalue()))
            table.to_parquet(marked, index=False)
        except ImportError:
            raise RequestError(f"cannot write {target}: Parquet needs pyarrow: {how_to_install('logs')}") from None
        return marked.getvalue()


BAND = (0.3, 0.8)
"""Lowest and highest frequency met [Hz]: of waves of 2.4 to 17 m where the boat lies still, longer than small boats and
too quick for their thrusters."""
PEAK, SHARPNESS = 0.5, 3.3
"""Peak [Hz], of waves of 6 m, and peak enhancement factor (gamma) of the spectrum, the mean of JONSWAP."""
_COMPONENTS = 60
"""Waves that are added, one from each equal part of the band: enough for a sum that is normally distributed."""


def jonswap(frequency: Array) -> Array:
    """Elevation spectrum at frequencies [Hz], in no particular unit (Hasselmann et al. 1973, the JONSWAP formula)."""
    width = np.where(frequency <= PEAK, 0.07, 0.09)
    bump = np.exp(-((frequency - PEAK) ** 2) / (2.0 * width**2 * PEAK**2))
    return frequency**-5.0 * np.exp(-1.25 * (PEAK / frequency) ** 4) * SHARPNESS**bump


def in_waves(motion: Motion, amplitude: float, rng: np.random.Generator) -> Motion:
    """Add the motion in long-crested waves of a random direction to a boat that follows `motion` in calm water.

    The water's orbital velocity w(t) = sum a_k cos(omega_k t + e_k) along the waves moves the boat, and its shear turns
    it: a line at an angle beta to the waves turns by sin(beta) cos(beta) sum (kappa_k a_k / omega_k) cos(omega_k t +
    e_k), with the wave number kappa_k = omega_k^2 / g (deep water, waves longer than the boat). Frequencies are those
    met. Position and velocity over ground, heading and yaw rate belong together: one is the derivative of the other.

    Parameters
    ----------
    amplitude : significant amplitude of the orbital velocity, twice its standard deviation [m/s]
    rng : draws the direction, the frequencies and the phases
    """
    direction = rng.uniform(-np.pi, np.pi)
    edges = np.linspace(*BAND, _COMPONENTS + 1)
    frequency = rng.uniform(edges[:-1], edges[1:])
    phase = rng.uniform(0.0, 2.0 * np.pi, _COMPONENTS)
    omega = 2.0 * np.pi * frequency
    size = omega * np.sqrt(jonswap(frequency))
    size *= 0.5 * amplitude / np.sqrt(0.5 * (size**2).sum())
    angle = motion.time[:, None] * omega + phase
    speed, shift = np.cos(angle) @ size, np.sin(angle) @ (size / omega)
    off = motion.heading - direction
    turned = np.sin(off) * np.cos(off) * (np.cos(angle) @ (size * omega / GRAVITY))
    heading = motion.heading + turned
    along = np.array([np.cos(direction), np.sin(direction)])
    north, east = body_to_earth(motion.heading, motion.velocity[:, 0], motion.velocity[:, 1])
    ahead, starboard = earth_to_body(heading, north + along[0] * speed, east + along[1] * speed)
    rate = motion.velocity[:, 2] + np.gradient(turned, motion.time)
    position, velocity = motion.position + shift[:, None] * along, np.column_stack([ahead, starboard, rate])
    return replace(motion, position=position, heading=heading, velocity=velocity)


FINE_STEP = 0.02
"""Step of the simulation [s]; it divides the command step."""
DURATIONS = (1.0, 86400.0)
"""Shortest and longest world [s]: one that moves at all, and a day."""


@dataclass(frozen=True, slots=True)
class Sensors:
    """Sensors of a world: standard deviations of white noise, losses, and waves.

    Attributes
    ----------
    speed : of u and v [m/s]
    yaw_rate : of r [rad/s]
    heading : of psi [rad]
    position : of north and east [m]
    jitter : of the time stamps [s], cut at 0.4 of the channel's step, so that stamps always increase
    dropouts : share of odometry rows that are lost
    odometry_rate : [Hz]
    waves : significant amplitude of the waves' orbital velocity [m/s]; see `in_waves`
    wind : of each component of the apparent wind [m/s], where there is an anemometer
    """

    speed: float = 0.0
    yaw_rate: float = 0.0
    heading: float = 0.0
    position: float = 0.0
    jitter: float = 0.0
    dropouts: float = 0.0
    odometry_rate: float = 20.0
    waves: float = 0.0
    wind: float = 0.0


NOISE: dict[str, Sensors] = {
    "clean": Sensors(),
    "field": Sensors(speed=0.015, yaw_rate=0.006, heading=0.005, position=0.05, jitter=0.001, dropouts=0.01, wind=0.2),
    "rough": Sensors(speed=0.04, yaw_rate=0.015, heading=0.015, position=0.2, jitter=0.004, dropouts=0.01, wind=0.5),
}
"""The noise presets."""


class Orders(NamedTuple):
    """Commands that a vehicle is to drive in the place of a programme.

    Attributes
    ----------
    commands : (n, thrusters) in each thruster's unit, at 10 Hz, each held until the next
    heading : on which it begins [rad]
    """

    commands: Array
    heading: float


@dataclass(frozen=True, slots=True)
class World:
    """A true vehicle and the programme that it drives, from rest, on a heading that the seed draws.

    Attributes
    ----------
    vehicle : the true vehicle, hidden effects included
    programme : one of `manoeuvres.PROGRAMMES`
    duration : [s], 1 to 86400
    seed : decides the programme's order, the start heading and (apart) the noise
    wind : steady velocity of the air, towards north and east [m/s], which an anemometer on board sees. None:
        where the vehicle feels wind, 4 to 8 m/s from anywhere, drawn from the seed; else neither wind nor anemometer
    becomes, changes_at : the true vehicle from an instant on [s], as a hull that is fouled or a propeller that is hit;
        it has the same thrusters and takes the motion over as it is, its wake memory at rest in that motion. None for
        a vehicle that stays as it is
    orders : commands that are driven in the place of the programme, for `duration`; None for the programme
    """

    vehicle: Vehicle
    programme: str = "rich"
    duration: float = 300.0
    seed: int = 0
    wind: tuple[float, float] | None = None
    becomes: Vehicle | None = None
    changes_at: float = 0.0
    orders: Orders | None = None

    def run(self, sensors: Sensors) -> SimulatedLog:
        """Simulate the world and log it.

        Raises
        ------
        RequestError
            for an unknown programme, a duration outside 1 to 86400 s, waves of no finite amplitude, a change that does
            not fall within the world or brings other thrusters, or a world whose motion diverges.
        """
        shortest, longest = DURATIONS
        if not shortest <= self.duration <= longest:
            raise RequestError(
                f"simulate: expected a duration of {shortest:g} to {longest:g} s, got {self.duration:g} s"
            )
        if not 0.0 <= sensors.waves < np.inf:
            raise RequestError(f"simulate: expected waves of 0 m/s or more, got {sensors.waves:g} m/s")
        self._check_change()
        if self.orders is None:
            held = programme(self.vehicle, self.programme, self.duration, self.seed)
        else:
            held = self.orders.commands
        stamps = COMMAND_STEP * np.arange(held.shape[0], dtype=float)
        truth = self._truth(stamps, held)
        rng = np.random.default_rng([self.seed, 3])
        period = 1.0 / sensors.odometry_rate
        time = period * np.arange(int(truth.time[-1] / period + 1e-6) + 1, dtype=float)
        sensed = in_waves(truth, sensors.waves, np.random.default_rng([self.seed, 4])) if sensors.waves else truth
        exact = np.column_stack([sensed.position, sensed.heading, sensed.velocity])
        deviation = np.array([sensors.position] * 2 + [sensors.heading] + [sensors.speed] * 2 + [sensors.yaw_rate])
        state = np.column_stack([np.interp(time, truth.time, column) for column in exact.T])
        state = state + deviation * rng.standard_normal(state.shape)
        seen = None
        if sensed.air is not None:
            blows = np.column_stack(apparent_wind(sensed.heading, tuple(sensed.velocity.T[:2]), tuple(sensed.air.T)))
            seen = np.column_stack([np.interp(time, truth.time, column) for column in blows.T])
            seen = seen + sensors.wind * np.random.default_rng([self.seed, 6]).standard_normal(seen.shape)
        kept = rng.random(time.size) >= sensors.dropouts
        kept[[0, -1]] = True
        logged = _jittered(time, sensors.jitter, rng)[kept]
        wind = None if seen is None else seen[kept]
        return SimulatedLog(
            self.vehicle, truth, logged, state[kept], _jittered(stamps, sensors.jitter, rng), held, wind
        )

    def _air(self, rows: int) -> Array | None:
        """Velocity of the air at each row (rows, 2), None in a world without wind."""
        wind = self.wind
        if wind is None and any(self.vehicle.value(symbol) for symbol in ("wind_x", "wind_y", "wind_n")):
            rng = np.random.default_rng([self.seed, 7])
            speed, angle = rng.uniform(4.0, 8.0), rng.uniform(-np.pi, np.pi)
            wind = (float(speed * np.cos(angle)), float(speed * np.sin(angle)))
        return None if wind is None else np.tile(wind, (rows, 1))

    def _truth(self, stamps: Array, held: Array) -> Motion:
        time = FINE_STEP * np.arange(int(self.duration / FINE_STEP + 1e-6) + 1, dtype=float)
        drawn = float(np.random.default_rng([self.seed, 2]).uniform(-np.pi, np.pi))
        heading = drawn if self.orders is None else self.orders.heading
        commands, names = area_average(stamps, held, time, FINE_STEP), tuple(t.name for t in self.vehicle.thrusters)
        source = f"simulated: {self.vehicle.name}, {self.programme}, seed {self.seed}"
        start = Motion.at_rest(FINE_STEP, commands, names, source, heading)
        truth = self._driven(replace(start, air=self._air(time.size)))
        if np.abs(truth.velocity).max() >= SPEED_LIMIT:
            raise RequestError(f"simulate: the motion of {self.vehicle.name} diverges; make the hidden effect smaller")
        return truth

    def _check_change(self) -> None:
        if self.becomes is None:
            return
        if not 0.0 < self.changes_at < self.duration:
            raise RequestError(
                f"simulate: expected a change within the {self.duration:g} s of the world, got {self.changes_at:g} s"
            )
        names = [[t.channel for t in v.thrusters] for v in (self.vehicle, self.becomes)]
        if names[0] != names[1]:
            raise RequestError(
                f"simulate: expected a vehicle with the thrusters {' '.join(names[0])} after the change, got "
                f"{' '.join(names[1])}"
            )

    def _driven(self, start: Motion) -> Motion:
        """The motion from the first state of `start`, by one vehicle or by two in turn."""
        first = simulate_motion(self.vehicle, start)
        row = max(1, round(self.changes_at / FINE_STEP))
        if self.becomes is None or row >= start.time.size - 1:
            return first
        rest = simulate_motion(self.becomes, first.slice(row, first.time.size))
        return replace(
            first,
            position=np.concatenate([first.position[:row], rest.position]),
            heading=np.concatenate([first.heading[:row], rest.heading]),
            velocity=np.concatenate([first.velocity[:row], rest.velocity]),
        )


def simulate_world(
    vehicle: Vehicle,
    effects: Mapping[str, Values],
    *,
    programme: str = "rich",
    duration: float = 300.0,
    noise: str = "field",
    waves: float = 0.0,
    seed: int = 0,
    wind: tuple[float, float] | None = None,
) -> SimulatedLog:
    """The log of a world in which `vehicle` has hidden `effects`.

    Parameters
    ----------
    effects : by name or symbol, as `apply_effects` takes them; empty for a world without a secret
    programme : `rich`, `zigzag` or `gentle`
    duration : [s], 1 to 86400
    noise : `clean`, `field` or `rough` (see `NOISE`)
    waves : significant amplitude of orbital velocity that the sensors see on top [m/s]
    wind : steady velocity of the air, towards north and east [m/s], and an anemometer; see `World`

    Raises
    ------
    RequestError
        for an unknown effect, programme or noise preset, a duration or waves out of range, values that give no sound
        vehicle, or a diverging motion.
    """
    expect("simulate_world: vehicle", vehicle, Vehicle, "undertow.load_vehicle(PATH) reads one")
    expect(
        "simulate_world: effects", effects, Mapping, 'give values by name, such as {"surge_quadratic_damping": -9.0}'
    )
    if noise not in NOISE:
        near = nearest(noise, NOISE)
        raise RequestError(f"unknown noise {noise!r}: did you mean {near!r}? There are: {', '.join(NOISE)}")
    world = World(apply_effects(vehicle, effects), programme, duration, seed, wind)
    return world.run(replace(NOISE[noise], waves=waves))


def _jittered(stamps: Array, deviation: float, rng: np.random.Generator) -> Array:
    limit = 0.4 * float(stamps[1] - stamps[0])
    noise = np.clip(deviation * rng.standard_normal(stamps.size), -limit, limit)
    noise[0] = abs(noise[0])
    return stamps + noise
