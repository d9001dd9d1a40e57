"""What `compare` says of a second log, beside what a few lines of arithmetic say of it.

Of each pair of logs in a folder a model is found on the first, with `discover`, and judged on the second, with
`compare` as it is by default. The same errors are computed here from `model.yaml` and the table of the log alone: of
open-loop predictions of 10 s from every half second of the whole log, integrated by equations written in this file.
The two must agree in sign, and within five points. The speeds of the log and of the predictions are low-passed as the
manual says (4th order, 1.2 Hz, zero phase), because raw fixes of a receiver err by more than a good model, and white
noise that the low-pass leaves is taken out of the errors, as `compare` takes it out of its verdict.

Run it as `python benchmarks/second_log.py FOLDER [FIRST ...]` with `log_NNN.csv` files of `examples/real_blueboat.py`;
FIRST are the numbers of the logs on which models are found. With `--raw`, undertow reads the logs as they came from the
autopilot (`raw/rcou_NNN.csv`), with the vehicle file and the channel map that `init` makes of the first one and a mass
of 15 kg, and of how its thrusters are wired where `init` asks for that; the cleaned tables judge. It exits with 1 where
one pair disagrees.

`python benchmarks/second_log.py --simulated 50` asks the same of pairs of simulated logs at field noise, each of a
boat with two to four hidden effects. There the errors computed here are those against the true track of the second log,
which no sensor saw, of predictions that start where the log says that the boat is. `--start 1000` draws other pairs.
What is done is kept in the file of `--kept`, and not done again.
"""

import argparse
import csv
import importlib.util
import json
import math
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.hidden_effects import typical_effect
from undertow.physics.worlds.world import simulate_world

Array = NDArray[np.float64]
Table = Mapping[str, Array]

RATE = 10.0
LOW = butter(4, 1.2, fs=RATE, output="sos")
"""Rows a second that are judged, and what their speeds are low-passed by, as in `docs/method.md`."""
HORIZON, SPACING = 10.0, 0.5
"""Length of predictions, and from one to the next [s]."""
LONGEST = 0.025
"""Longest step of the integration [s]."""
WIRED = Path(__file__).resolve().parent.parent / "examples" / "maps" / "blueboat_raw.yaml"
"""Channel map of the raw logs, for who knows how the boat is wired."""
POINTS = 0.05
"""Share by which the two may differ."""
KNOWN = {
    "": {"about", "name", "mass", "inertia_z", "x_g", "added_mass", "damping", "coupling", "environment", "hull",
         "thrusters", "sources"},
    "added_mass": {"X_udot", "Y_vdot", "N_rdot", "Y_rdot"},
    "damping": {"X_u", "X_uu", "Y_v", "Y_vv", "N_r", "N_rr", "Y_r", "N_v", "N_ur"},
    "coupling": {"N_uv", "Y_ur", "X_vr"},
    "environment": {"yaw_trim"},
    "thrusters": {"name", "x", "y", "angle", "command", "curve", "scale", "thrust_scale", "arm_scale", "reverse_scale",
                  "thrust_exponent", "delay"},
}  # fmt: skip
"""What this file can compute; a vehicle with more is passed over, and said to be."""
HULLS = ("blueboat", "otter", "blueboat_paper")
HIDDEN = (
    *("surge_linear_damping", "surge_quadratic_damping", "sway_linear_damping", "sway_quadratic_damping"),
    *("yaw_linear_damping", "yaw_quadratic_damping", "yaw_speed_damping", "munk_moment", "sway_lift", "yaw_trim"),
    *("thruster_asymmetry", "thruster_arm", "reverse_thrust_loss", "input_delay", "cg_offset"),
)
"""Of the simulated boats, and what these have beside them."""


class BeyondError(ValueError):
    """A vehicle has what this file does not compute."""


def read(path: Path) -> dict[str, Array]:
    """The columns of a wide table, without rows that lack a number of them."""
    with path.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    table = {name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0]}
    whole = np.all([np.isfinite(table[name]) for name in ("t", "psi", "u", "v", "r")], axis=0)
    return {name: column[whole] for name, column in table.items()}


def smooth(table: Table) -> dict[str, Array]:
    """The table on an even time base, its speeds low-passed, commands held."""
    time = np.arange(table["t"][0], table["t"][-1] + 1e-9, 1.0 / RATE)
    found = {name: np.asarray(sosfiltfilt(LOW, np.interp(time, table["t"], table[name]))) for name in ("u", "v", "r")}
    last = np.clip(np.searchsorted(table["t"], time + 1e-9, side="right") - 1, 0, None)
    return {"t": time, **found, **{name: column[last] for name, column in table.items() if name not in ("t", *found)}}


def noise(table: Table) -> Array:
    """Mean square (3,) of the white noise on the speeds that the low-pass leaves.

    The median of third differences tells it, whose variance is twenty times that of the noise; of it the filter leaves
    the sum of the squares of its answer to a single row.
    """
    time = np.arange(table["t"][0], table["t"][-1] + 1e-9, 1.0 / RATE)
    single = np.zeros(401)
    single[200] = 1.0
    left = float((sosfiltfilt(LOW, single) ** 2).sum()) / 20.0
    third = [np.diff(np.interp(time, table["t"], table[name]), 3) for name in ("u", "v", "r")]
    return left * np.array([(1.4826 * np.median(np.abs(d - np.median(d)))) ** 2 for d in third])


def check(vehicle: Mapping[str, Any]) -> None:
    """Refuse a vehicle that has more than this file computes."""
    sections = {section: vehicle.get(section, {}) for section in KNOWN if section not in ("", "thrusters")}
    own = [("", set(vehicle)), *((section, set(values)) for section, values in sections.items())]
    own += [("thrusters", set(thruster)) for thruster in vehicle["thrusters"]]
    beyond = sorted(name for section, names in own for name in names - KNOWN[section])
    if beyond:
        raise BeyondError(", ".join(beyond))


def thrust(thruster: Mapping[str, Any], command: Array) -> Array:
    """Force of a thruster [N] at commands (n,)."""
    curve, (low, high) = thruster["curve"], (1000.0, 2000.0)
    if curve["kind"] == "table":
        low, high = curve["command"][0], curve["command"][-1]

        def plain(c: Array) -> Array:
            return np.interp(c, curve["command"], curve["force"])
    else:

        def plain(c: Array) -> Array:
            n = (c - 1500.0) / 500.0 * curve["scale"] + curve["offset"]
            return np.asarray(curve["k_t"] * curve["rho"] * curve["diameter"] ** 4 * n * np.abs(n))

    force = plain(np.clip(command, low, high))
    full = np.where(force >= 0.0, plain(np.array([high])), -plain(np.array([low])))
    force = np.sign(force) * full * (np.abs(force) / full) ** thruster.get("thrust_exponent", 1.0)
    force = force * thruster.get("scale", 1.0) * thruster.get("thrust_scale", 1.0)
    return np.where(force < 0.0, thruster.get("reverse_scale", 1.0), 1.0) * force


def step_of(table: Table) -> float:
    """Time from one row of a table to the next [s]."""
    return float(table["t"][1] - table["t"][0])


def pushed(vehicle: Mapping[str, Any], table: Table) -> Array:
    """Forces and moment of the thrusters along a log, (n, 3) [N, N, N m]."""
    total, step = np.zeros((table["t"].size, 3)), step_of(table)
    for thruster in vehicle["thrusters"]:
        command = table[f"{thruster['command']}_{thruster['name']}"]
        # A command that acts later by part of a row is for that part of the row the one before.
        late, rows = divmod(thruster.get("delay", 0.0) / step, 1.0), np.arange(command.size)
        before, more = (command[np.maximum(rows - int(late[0]) - k, 0)] for k in (0, 1))
        force = (1.0 - late[1]) * thrust(thruster, before) + late[1] * thrust(thruster, more)
        angle, arm = thruster.get("angle", 0.0), thruster.get("arm_scale", 1.0)
        ahead, aside = math.cos(angle), math.sin(angle)
        turn = arm * (thruster["x"] * aside - thruster["y"] * ahead)
        total += force[:, None] * np.array([ahead, aside, turn])
    return total


def motion_of(vehicle: Mapping[str, Any]) -> Callable[[Array, Array], Array]:
    """What gives the accelerations (n, 3) at speeds (n, 3) under forces (n, 3), as in `docs/conventions.md`."""
    added, drag, couple = (vehicle.get(name, {}) for name in ("added_mass", "damping", "coupling"))
    mass, x_g = vehicle["mass"], vehicle.get("x_g", 0.0)
    m11, m22 = mass - added.get("X_udot", 0.0), mass - added.get("Y_vdot", 0.0)
    m23, m33 = mass * x_g - added.get("Y_rdot", 0.0), vehicle["inertia_z"] - added.get("N_rdot", 0.0)
    inverse = np.linalg.inv(np.array([[m11, 0.0, 0.0], [0.0, m22, m23], [0.0, m23, m33]]))
    d = {name: drag.get(name, 0.0) for name in KNOWN["damping"]}
    c = {name: couple.get(name, 0.0) for name in KNOWN["coupling"]}
    trim = vehicle.get("environment", {}).get("yaw_trim", 0.0)

    def accelerated(speed: Array, force: Array) -> Array:
        u, v, r = speed.T
        x = (m22 * v + m23 * r) * r + d["X_u"] * u + d["X_uu"] * u * abs(u) + c["X_vr"] * v * r
        y = -m11 * u * r + d["Y_v"] * v + d["Y_vv"] * v * abs(v) + d["Y_r"] * r + c["Y_ur"] * u * r
        n = (m11 - m22) * u * v - m23 * u * r + d["N_r"] * r + d["N_rr"] * r * abs(r) + d["N_v"] * v
        n = n + d["N_ur"] * abs(u) * r + c["N_uv"] * u * v + trim
        return np.asarray((force + np.column_stack([x, y, n])) @ inverse.T)

    return accelerated


def squares(vehicle: Mapping[str, Any], table: Table, seen: Table | None = None) -> Array:
    """Mean square errors (3,) of u, v [m^2/s^2] and r [rad^2/s^2] over all predictions along a log.

    Parameters
    ----------
    table : judges the predictions: a record that was low-passed, as they then are, too, or a true track
    seen : the low-passed record from which predictions start, where a true track judges them
    """
    check(vehicle)
    step = step_of(table)
    parts = math.ceil(step / LONGEST)
    measured, force = np.column_stack([table["u"], table["v"], table["r"]]), pushed(vehicle, table)
    rows, accelerated = round(HORIZON / step), motion_of(vehicle)
    starts = np.arange(0, len(measured) - rows, round(SPACING / step))
    begins = table if seen is None else seen
    speed = np.column_stack([begins["u"], begins["v"], begins["r"]])[starts]
    ahead, small = [speed], step / parts
    for row in range(rows):
        push = force[starts + row]
        for _ in range(parts):
            k1 = accelerated(speed, push)
            k2 = accelerated(speed + 0.5 * small * k1, push)
            k3 = accelerated(speed + 0.5 * small * k2, push)
            k4 = accelerated(speed + small * k3, push)
            speed = speed + small / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        ahead.append(speed)
    told = np.array(ahead) if seen is not None else sosfiltfilt(LOW, ahead, axis=0)
    judges = measured[starts + np.arange(rows + 1)[:, None]]
    return np.asarray(((told - judges)[1:] ** 2).mean(axis=(0, 1)))


def saved(before: Array, after: Array) -> float:
    """Share of an error that a model saves, of mean squares (3,): the geometric mean over the three speeds."""
    return float(1.0 - np.exp(0.5 * np.log(after / before).mean()))


def told(comparison: Any, name: str) -> float:
    """Share of the nominal model's error that another saves, as the verdict of `compare` has it."""
    return next(-float(margin.relative) for margin in comparison.best.margins if margin.model == name)


def beyond(square: Array, noise: Array) -> Array:
    """Mean squares (3,) without those of noise; a tenth stays where it may all be noise."""
    return np.maximum(square - noise, 0.1 * square)


@dataclass(frozen=True)
class Field:
    """Field logs: which ones undertow reads, with which vehicle and map, and those whose table judges.

    Attributes
    ----------
    folder : keeps vehicle files, channel maps and runs
    start : vehicle file; of raw logs, `init` makes one
    channels : map of the cleaned tables
    raw : read what came from the autopilot
    """

    folder: Path
    start: Path
    channels: Path
    raw: bool

    def read(self, log: Path, first: Path) -> Any:
        """What undertow reads of a log, for the model that is found on the first."""
        import undertow

        if not self.raw:
            reading = undertow.Reading(channel_map=str(self.channels))
            return undertow.read_inputs(log, self.start, reading, progress=None)
        vehicle, channels = (self.folder / f"{first.stem}_{name}.yaml" for name in ("vehicle", "channels"))
        if not vehicle.exists():
            hull, wired = undertow.Hull(mass=15.0), undertow.Reading(channel_map=str(WIRED))
            draft = undertow.init(self.seen(first), hull, progress=None)
            if draft.unsettled:
                draft = undertow.init(self.seen(first), hull, reading=wired, progress=None)
            draft.write(vehicle, channels)
        reading = undertow.Reading(channel_map=str(channels))
        return undertow.read_inputs(self.seen(log), vehicle, reading, progress=None)

    def seen(self, log: Path) -> Path:
        """The file that undertow reads in the place of a cleaned table."""
        return log.parent / "raw" / log.name.replace("log_", "rcou_") if self.raw else log

    def table(self, log: Path) -> dict[str, Array]:
        """The cleaned table of a log."""
        table = dict(read(log))
        for name, rule in yaml.safe_load(self.channels.read_text("utf-8")).items():
            table[name] = table[rule["from"]] * rule["scale"] + rule["offset"]
        return table


def pair(first: Path, second: Path, field: Field) -> bool:
    """Print what both say of a pair of logs; False where they disagree. Models are found once, and kept in a folder."""
    import undertow

    run = field.folder / f"run_{first.stem}"
    if not run.exists():
        # A file of init says itself what is guessed.
        settings = undertow.DiscoverySettings() if field.raw else undertow.DiscoverySettings(refit=True)
        found = undertow.discover(field.read(first, first), settings, progress=None)
        undertow.write_run(found, run, report=False, progress=None)
    try:
        done = undertow.compare(field.read(second, first), [run], progress=None)
    except undertow.LogError:
        print(f"{first.stem} {second.stem}: passed over, undertow refuses the second log")
        return True
    table = field.table(second)
    try:
        ends = (yaml.safe_load((run / f"{name}.yaml").read_text("utf-8")) for name in ("nominal", "model"))
        own = saved(*(beyond(squares(one, smooth(table)), noise(table)) for one in ends))
    except BeyondError as error:
        print(f"{first.stem} {second.stem}: passed over, the model has {error}")
        return True
    theirs = told(done, run.name)
    agree = holds(theirs, own)
    print(
        f"{first.stem} {second.stem}: compare on {done.split} {100.0 * theirs:.1f} %, here {100.0 * own:.1f} %"
        f"{'' if agree else ' DISAGREE'}; {done.best.sentence}",
        flush=True,
    )
    return agree


def true_track(world: Any) -> dict[str, Array]:
    """The motion of a simulated log as no sensor saw it, and the commands until the next row, at the simulator's steps.

    The first row is that at which the log first has a motion and commands, so that predictions start where its do:
    where a motion is unstable, which starts are taken decides the error.
    """
    truth = world.truth
    first = world.odometry_time[np.searchsorted(world.odometry_time, world.command_time[0])]
    time = np.arange(first, world.odometry_time[-1], truth.time_step)
    speeds = dict(zip(("u", "v", "r"), truth.velocity.T, strict=True))
    names = [thruster.channel for thruster in world.vehicle.thrusters]
    held = dict(zip(names, truth.commands.T, strict=True))
    found = {name: np.interp(time, truth.time, column) for name, column in speeds.items()}
    middle = time + 0.5 * truth.time_step
    return {"t": time, **found, **{name: np.interp(middle, truth.time, column) for name, column in held.items()}}


def seen_track(world: Any, time: Array) -> dict[str, Array]:
    """The speeds of a simulated log as its sensors saw them, low-passed as the judged rows are, at other stamps."""
    columns = dict(zip(("u", "v", "r"), world.odometry.T[3:6], strict=True))
    rows = np.arange(time[0], world.odometry_time[-1], 1.0 / RATE)
    low = {name: sosfiltfilt(LOW, np.interp(rows, world.odometry_time, column)) for name, column in columns.items()}
    return {name: np.interp(time, rows, column) for name, column in low.items()}


def simulated_pair(number: int, folder: Path, seconds: float = 180.0) -> dict[str, Any]:
    """What `compare` says of a second simulated log, and what holds on its true track."""
    import undertow

    rng, hull = np.random.default_rng([57, number]), load_vehicle(HULLS[number % len(HULLS)])
    names = [str(name) for name in rng.choice(HIDDEN, rng.integers(2, 5), replace=False)]
    effects = {symbol: value for name in names for symbol, value in typical_effect(name, hull, rng).items()}
    first, second = (
        simulate_world(hull, effects, programme=programme, duration=seconds, seed=2 * number + k)
        for k, programme in enumerate(("rich", str(rng.choice(["rich", "zigzag"]))))
    )
    for world, name in ((first, "first"), (second, "second")):
        world.write(folder / f"{name}.csv")
    found = undertow.discover(undertow.read_inputs(folder / "first.csv", hull, progress=None), progress=None)
    undertow.write_run(found, folder / "run", report=False, progress=None)
    done = undertow.compare(
        undertow.read_inputs(folder / "second.csv", hull, progress=None), [folder / "run"], progress=None
    )
    record = {"number": number, "hidden": names, "verdict": done.best.sentence, "told": told(done, "run")}
    nominal, model = (
        yaml.safe_load((folder / "run" / f"{name}.yaml").read_text("utf-8")) for name in ("nominal", "model")
    )
    track = true_track(second)
    seen = seen_track(second, track["t"])
    try:
        return record | {"true": saved(*(squares(one, track, seen) for one in (nominal, model)))}
    except BeyondError as error:
        return record | {"beyond": str(error)}


def holds(theirs: float, own: float) -> bool:
    """Whether two shares of error saved agree in sign and within five points; a model that changes nothing has none."""
    return (own * theirs > 0.0 or own == theirs) and abs(own - theirs) <= POINTS


def line_of(pair: Mapping[str, Any]) -> str:
    """What is told of a pair of simulated logs."""
    start = f"{pair['number']} {', '.join(pair['hidden'])}: compare {100.0 * pair['told']:.1f} %"
    if "beyond" in pair:
        return f"{start}, passed over, the model has {pair['beyond']}"
    return f"{start}, true {100.0 * pair['true']:.1f} %{'' if holds(pair['told'], pair['true']) else ' DISAGREE'}"


def simulated(pairs: int, kept: Path, start: int = 0) -> bool:
    """Print how many pairs of simulated logs agree; True where all do."""
    known = [json.loads(line) for line in kept.read_text("utf-8").splitlines()] if kept.exists() else []
    records = {record["number"]: record for record in known}
    asked = range(start, start + pairs)
    for number in asked:
        if number not in records:
            with tempfile.TemporaryDirectory() as folder:
                records[number] = simulated_pair(number, Path(folder))
            with kept.open("a", encoding="utf-8") as stream:
                stream.write(json.dumps(records[number]) + "\n")
        print(line_of(records[number]), flush=True)
    judged = [records[number] for number in asked if "beyond" not in records[number]]
    agree = sum(holds(one["told"], one["true"]) for one in judged)
    print(f"{agree} of {len(judged)} pairs agree in sign and within {100.0 * POINTS:.0f} points.")
    return agree == len(judged)


def main(source: Path, firsts: Sequence[str] = (), seconds: Sequence[str] = (), *, raw: bool = False) -> bool:
    """True where all pairs agree, of the logs of these numbers or of all."""
    place = Path(__file__).resolve().parent.parent / "examples" / "real_blueboat.py"
    spec = importlib.util.spec_from_file_location("real_blueboat", place)
    assert spec is not None
    assert spec.loader is not None
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    logs = sorted(source.glob("log_*.csv"))
    if not logs:
        sys.exit(f"{source}: no log_*.csv here")
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        field = Field(folder, folder / "vehicle.yaml", folder / "channels.yaml", raw)
        field.channels.write_text(example.CHANNELS, encoding="utf-8")
        field.start.write_text(yaml.safe_dump(example.START), encoding="utf-8")
        some, others = (
            [log for log in logs if not wanted or log.stem.removeprefix("log_") in wanted]
            for wanted in (firsts, seconds)
        )
        agreed = [pair(first, other, field) for first in some for other in others if other != first]
    print(f"{sum(agreed)} of {len(agreed)} pairs agree in sign and within {100.0 * POINTS:.0f} points.")
    return all(agreed)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("first", nargs="*")
    parser.add_argument("--raw", action="store_true", help="read raw logs, with what init makes of the first")
    parser.add_argument("--simulated", type=int, metavar="PAIRS")
    parser.add_argument("--start", type=int, default=0, metavar="NUMBER", help="of the first pair")
    parser.add_argument("--kept", type=Path, default=Path("second_log.jsonl"))
    given = parser.parse_args()
    if given.simulated is None and given.folder is None:
        parser.error("give a folder of logs, or --simulated PAIRS")
    if given.simulated is None:
        right = main(given.folder, given.first, raw=given.raw)
    else:
        right = simulated(given.simulated, given.kept, given.start)
    sys.exit(0 if right else 1)
