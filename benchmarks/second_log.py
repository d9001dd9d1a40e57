"""What `compare` says of a second log, beside what a few lines of arithmetic say of it.

Of each pair of logs in a folder a model is found on the first, with `discover`, and judged on the second, with
`compare` as it is by default. The same errors are computed here from `model.yaml` and the table of the log alone: of
open-loop predictions of 10 s from every half second of the whole log, integrated by equations written in this file.
The two must agree in sign, and within five points. The speeds of the log are low-passed as the manual says (4th order,
1.2 Hz, zero phase), because raw fixes of a receiver err by more than a good model.

Run it as `python benchmarks/second_log.py FOLDER [FIRST ...]` with `log_NNN.csv` files of `examples/real_blueboat.py`;
FIRST are the numbers of the logs on which models are found. It exits with 1 where one pair disagrees.
"""

import csv
import importlib.util
import math
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

Array = NDArray[np.float64]
Table = Mapping[str, Array]

RATE, CUTOFF = 10.0, 1.2
"""Rows a second that are judged, and what the speeds are low-passed at [Hz], as in `docs/method.md`."""
HORIZON, SPACING = 10.0, 0.5
"""Length of predictions, and from one to the next [s]."""
POINTS = 0.05
"""Share by which the two may differ."""
KNOWN = {
    "": {"name", "mass", "inertia_z", "x_g", "added_mass", "damping", "coupling", "thrusters", "sources"},
    "added_mass": {"X_udot", "Y_vdot", "N_rdot", "Y_rdot"},
    "damping": {"X_u", "X_uu", "Y_v", "Y_vv", "N_r", "N_rr", "Y_r", "N_v", "N_ur"},
    "coupling": {"N_uv", "Y_ur", "X_vr"},
    "thrusters": {"name", "x", "y", "angle", "command", "curve", "scale", "thrust_scale", "arm_scale", "reverse_scale",
                  "thrust_exponent"},
}  # fmt: skip
"""What this file can compute; a vehicle with more is passed over, and said to be."""


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
    found = {name: np.interp(time, table["t"], table[name]) for name in ("u", "v", "r")}
    low = butter(4, CUTOFF, fs=RATE, output="sos")
    even = {name: np.asarray(sosfiltfilt(low, column)) for name, column in found.items()}
    last = np.clip(np.searchsorted(table["t"], time + 1e-9, side="right") - 1, 0, None)
    return {"t": time, **even, **{name: column[last] for name, column in table.items() if name not in ("t", *even)}}


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


def pushed(vehicle: Mapping[str, Any], table: Table) -> Array:
    """Forces and moment of the thrusters along a log, (n, 3) [N, N, N m]."""
    total = np.zeros((table["t"].size, 3))
    for thruster in vehicle["thrusters"]:
        force = thrust(thruster, table[f"{thruster['command']}_{thruster['name']}"])
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

    def accelerated(speed: Array, force: Array) -> Array:
        u, v, r = speed.T
        x = (m22 * v + m23 * r) * r + d["X_u"] * u + d["X_uu"] * u * abs(u) + c["X_vr"] * v * r
        y = -m11 * u * r + d["Y_v"] * v + d["Y_vv"] * v * abs(v) + d["Y_r"] * r + c["Y_ur"] * u * r
        n = (m11 - m22) * u * v - m23 * u * r + d["N_r"] * r + d["N_rr"] * r * abs(r) + d["N_v"] * v
        n = n + d["N_ur"] * abs(u) * r + c["N_uv"] * u * v
        return np.asarray((force + np.column_stack([x, y, n])) @ inverse.T)

    return accelerated


def squares(vehicle: Mapping[str, Any], table: Table) -> Array:
    """Mean square errors (3,) of u, v [m^2/s^2] and r [rad^2/s^2] over all predictions along a log."""
    check(vehicle)
    step, parts = 1.0 / RATE, 4
    measured, force = np.column_stack([table["u"], table["v"], table["r"]]), pushed(vehicle, table)
    rows, accelerated = round(HORIZON * RATE), motion_of(vehicle)
    starts = np.arange(0, len(measured) - rows, round(SPACING * RATE))
    speed, total, small = measured[starts], np.zeros(3), step / parts
    for row in range(rows):
        push = force[starts + row]
        for _ in range(parts):
            k1 = accelerated(speed, push)
            k2 = accelerated(speed + 0.5 * small * k1, push)
            k3 = accelerated(speed + 0.5 * small * k2, push)
            k4 = accelerated(speed + small * k3, push)
            speed = speed + small / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        total += ((speed - measured[starts + row + 1]) ** 2).mean(axis=0)
    return total / rows


def saved(nominal: Mapping[str, Any], model: Mapping[str, Any], table: Table) -> float:
    """Share of the nominal model's error that a model saves on a log: the geometric mean over the three speeds."""
    before, after = squares(nominal, table), squares(model, table)
    return float(1.0 - np.exp(0.5 * np.log(after / before).mean()))


def told(comparison: Any, name: str) -> float:
    """The same by the errors that `compare` tells."""
    rolled = {model.name: model.rollout[f"{HORIZON:g}"] for model in comparison.models}
    ratios = [rolled[name].of(axis) / rolled["nominal"].of(axis) for axis in ("surge", "sway", "yaw")]
    return float(1.0 - np.exp(np.log(ratios).mean()))


def pair(first: Path, second: Path, folder: Path, start: Mapping[str, Any], channels: Path) -> bool:
    """Print what both say of a pair of logs; False where they disagree. Models are found once, and kept in a folder."""
    import undertow

    reading, run = undertow.Reading(channel_map=str(channels)), folder / f"run_{first.stem}"
    vehicle = folder / "vehicle.yaml"
    if not run.exists():
        settings = undertow.DiscoverySettings(refit=True)
        found = undertow.discover(undertow.read_inputs(first, vehicle, reading, progress=None), settings, progress=None)
        undertow.write_run(found, run, report=False, progress=None)
    try:
        done = undertow.compare(undertow.read_inputs(second, vehicle, reading, progress=None), [run], progress=None)
    except undertow.LogError:
        print(f"{first.stem} {second.stem}: passed over, undertow refuses the second log")
        return True
    table = dict(read(second))
    for name, rule in yaml.safe_load(channels.read_text("utf-8")).items():
        table[name] = table[rule["from"]] * rule["scale"] + rule["offset"]
    try:
        own = saved(start, yaml.safe_load((run / "model.yaml").read_text("utf-8")), smooth(table))
    except BeyondError as error:
        print(f"{first.stem} {second.stem}: passed over, the model has {error}")
        return True
    theirs = told(done, run.name)
    holds = own * theirs > 0.0 and abs(own - theirs) <= POINTS
    print(
        f"{first.stem} {second.stem}: compare on {done.split} {100.0 * theirs:.1f} %, here {100.0 * own:.1f} %"
        f"{'' if holds else ' DISAGREE'}; {done.best.sentence}",
        flush=True,
    )
    return holds


def main(source: Path, firsts: Sequence[str] = (), seconds: Sequence[str] = ()) -> bool:
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
        channels = folder / "channels.yaml"
        channels.write_text(example.CHANNELS, encoding="utf-8")
        (folder / "vehicle.yaml").write_text(yaml.safe_dump(example.START), encoding="utf-8")
        some, others = (
            [log for log in logs if not wanted or log.stem.removeprefix("log_") in wanted]
            for wanted in (firsts, seconds)
        )
        pairs = [(first, other) for first in some for other in others if other != first]
        agreed = [pair(first, other, folder, example.START, channels) for first, other in pairs]
    return all(agreed)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        print(__doc__)
        sys.exit(2)
    sys.exit(0 if main(Path(sys.argv[1]), sys.argv[2:]) else 1)
