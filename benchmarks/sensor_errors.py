"""What discovery makes of sensors that are wrong: a study over random hulls, with nothing hidden or one effect.

Each world is driven once; its log is then spoilt by one error of a sensor at a time, written to a file and read as any
other. An effect is false where it is not the hidden one. Beside that the study counts how often the sensor is told,
corrected and the hidden effect named, or the log refused with the cause.

    python benchmarks/sensor_errors.py [--seeds 12] [--first 9100] [--noise NAME]...
        [--table docs/sensor_errors.md]
    python benchmarks/sensor_errors.py --right --seeds 60 --first 9300

With `--right` no sensor is wrong: how often is one accused all the same, of noise of any kind and one of many effects?
Exit code 1 where a false name was given, or a right sensor accused.
"""

import argparse
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from spoiling import table_of

from undertow.discovery.discover import find_missing
from undertow.discovery.evidence.sensors_compared import sensor_errors
from undertow.measurements.kinematics import kinematics_of
from undertow.measurements.log import read_log
from undertow.physics.effects import COMMAND_OFFSET
from undertow.physics.errors import LogError, RequestError
from undertow.physics.frames import body_to_earth, earth_to_body
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.typical_effects import random_hull, typical_effect
from undertow.physics.worlds.world import simulate_world
from undertow.workflows.inputs import read_inputs

HIDDEN = (None, "surge_quadratic_damping", "sway_lift", "thruster_asymmetry", None, "cg_offset")
PROGRAMMES = ("rich", "zigzag", "gentle")
SECONDS, RATE = 240.0, 20.0
Spoil = Callable[[pd.DataFrame], None]


def _late(seconds: float, *names: str) -> Spoil:
    def spoil(table: pd.DataFrame) -> None:
        rows = round(seconds * RATE)
        for name in names:
            values = table[name].to_numpy()
            table[name] = np.concatenate([np.repeat(values[:1], rows), values[:-rows]])

    return spoil


def _times(factor: float, *names: str) -> Spoil:
    def spoil(table: pd.DataFrame) -> None:
        for name in names:
            table[name] *= factor

    return spoil


def _bias(table: pd.DataFrame) -> None:
    table["r"] += 0.02


def _compass(constant: float, sine: float) -> Spoil:
    def spoil(table: pd.DataFrame) -> None:
        off = np.radians(constant + sine * np.sin(table["psi"] - 0.7))
        table["u"], table["v"] = earth_to_body(off, table["u"].to_numpy(), table["v"].to_numpy())
        table["psi"] += off

    return spoil


def _arm(ahead: float, aside: float) -> Spoil:
    def spoil(table: pd.DataFrame) -> None:
        table["u"] -= aside * table["r"]
        table["v"] += ahead * table["r"]
        one = np.ones(len(table))
        north, east = body_to_earth(table["psi"].to_numpy(), ahead * one, aside * one)
        table["x"] += north
        table["y"] += east

    return spoil


def _water(table: pd.DataFrame) -> None:
    one = np.ones(len(table))
    ahead, aside = earth_to_body(table["psi"].to_numpy(), 0.2 * one, -0.1 * one)
    table["u"] -= ahead
    table["v"] -= aside


SPOILS: dict[str, tuple[Spoil, tuple[str, ...]]] = {
    "right sensors": (lambda table: None, ()),
    "gyro 5 % low": (_times(0.95, "r"), ("gyro_scale",)),
    "gyro off by 0.02 rad/s": (_bias, ("gyro_bias",)),
    "speeds 7 % low": (_times(0.93, "u", "v"), ("velocity_scale",)),
    "speeds 0.2 s late": (_late(0.2, "u", "v"), ("velocity_latency",)),
    "places and speeds 0.3 s late": (_late(0.3, "x", "y", "u", "v"), ("velocity_latency",)),
    "speeds through moving water": (_water, ("water_speed",)),
    "compass turned by 6 degrees": (_compass(6.0, 0.0), ("compass_deviation",)),
    "compass off by 8 sin(psi) degrees": (_compass(0.0, 8.0), ("compass_deviation",)),
    "antenna 0.6 m ahead": (_arm(0.6, 0.0), ("antenna_arm",)),
    "antenna 0.5 m to starboard": (_arm(0.0, 0.5), ("antenna_arm",)),
}
"""What is done to the table, and the finding that tells of it."""


@dataclass(slots=True)
class Count:
    """How logs with one error of a sensor came out."""

    logs: int = 0
    false: int = 0
    told: int = 0
    right: int = 0
    refused: int = 0


def study(seed: int, noise: str, counts: dict[str, Count]) -> None:
    """One world, spoilt in every way."""
    rng = np.random.default_rng([seed, 9])
    hull = random_hull(load_vehicle("blueboat"), rng)
    hidden = HIDDEN[seed % len(HIDDEN)]
    effects = {} if hidden is None else typical_effect(hidden, hull, rng)
    programme = PROGRAMMES[seed // 2 % len(PROGRAMMES)]
    world = simulate_world(hull, effects, programme=programme, duration=SECONDS, noise=noise, seed=seed)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        world.write(path)
        table = table_of(read_log(path))
        for name, (spoil, wanted) in SPOILS.items():
            other, count = table.copy(), counts[name]
            spoil(other)
            other.round(9).to_csv(path, index=False)
            count.logs += 1
            try:
                inputs = read_inputs(path, hull)
                findings = find_missing(inputs.fitting, inputs.vehicle).findings
            except (LogError, RequestError) as error:
                count.refused += 1
                print(f"{seed} {programme} {noise} {hidden} | {name} | refused: {str(error)[:110]}")
                continue
            false = set(findings.missing) - {hidden}
            told = {
                sensor.error
                for sensor in (*findings.sensors, *sensor_errors(inputs.sensors))
                if sensor.verdict == "present"
            }
            count.false += bool(false)
            count.told += bool(set(wanted) & told)
            count.right += set(findings.missing) == ({hidden} if hidden else set())
            named = findings.headline[:90]
            print(f"{seed} {programme} {noise} {hidden} | {name} | {named} | {sorted(told)}", flush=True)


RIGHT = (
    *(
        None,
        "surge_quadratic_damping",
        "cg_offset",
        "sway_yaw_coupling",
        "yaw_added_mass",
        "munk_moment",
        "wake_memory",
    ),
    *("steady_current", "sway_lift", "thruster_asymmetry", "yaw_trim", "thrust_curve", "mean_wind", "lateral_cg"),
)


def right(seeds: range) -> int:
    """Sensors that are right: how many logs have one accused, or a false name."""
    accused = false = logs = 0
    for seed in seeds:
        rng = np.random.default_rng([seed, 21])
        hull, hidden = random_hull(load_vehicle("blueboat"), rng), RIGHT[seed % len(RIGHT)]
        programme, noise = rng.choice(PROGRAMMES), rng.choice(("clean", "field", "rough"))
        try:
            effects = {} if hidden is None else typical_effect(hidden, hull, rng)
            world = simulate_world(hull, effects, programme=programme, duration=200.0, noise=noise, seed=seed)
            motion = world.motion(1.0 / RATE)
        except RequestError:  # no draw of the effect changes the motion of this hull
            continue
        findings = find_missing([motion], hull).findings
        hidden_ones = {s.what for s in findings.sensors if s.verdict == "present"} - {COMMAND_OFFSET.symbol}
        told = hidden_ones | set(kinematics_of([motion]).present)
        wrong = set(findings.missing) - {hidden}
        logs, accused, false = logs + 1, accused + bool(told), false + bool(wrong)
        if told or wrong:
            print(f"{seed} {programme} {noise} {hidden} | accused {sorted(told)} | false {sorted(wrong)}", flush=True)
    print(f"{logs} logs with right sensors: {accused} with one accused, {false} with a false name")
    return int(accused > 0 or false > 0)


def page(counts: dict[str, dict[str, Count]], seeds: range) -> str:
    """The text of the table."""
    lines = [
        "# Sensors that are wrong\n",
        "Written by `python benchmarks/sensor_errors.py --table docs/sensor_errors.md`; do not edit. Random hulls "
        f"(seeds {seeds.start} to {seeds.stop - 1}), {SECONDS:g} s at {RATE:g} Hz, nothing hidden or one effect, one "
        "error of a sensor at a time. False: an effect was called missing that is not hidden. Told: the sensor is "
        "named in `sensors`. Right: exactly what is hidden is named.\n",
    ]
    for noise, rows in counts.items():
        lines += [f"## Noise: {noise}\n", "| sensor | logs | false | told | right | refused |", "| --- " * 6 + "|"]
        lines += [f"| {n} | {c.logs} | {c.false} | {c.told} | {c.right} | {c.refused} |" for n, c in rows.items()]
        lines.append("")
    return "\n".join(lines)


def main() -> int:
    """Run the study."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=12)
    parser.add_argument("--first", type=int, default=9100)
    parser.add_argument("--noise", action="append", choices=("clean", "field", "rough"))
    parser.add_argument("--right", action="store_true")
    parser.add_argument("--table", type=Path)
    given = parser.parse_args()
    seeds = range(given.first, given.first + given.seeds)
    if given.right:
        return right(seeds)
    counts = {noise: {name: Count() for name in SPOILS} for noise in given.noise or ("clean", "field")}
    for noise, rows in counts.items():
        for seed in seeds:
            study(seed, noise, rows)
    text = page(counts, seeds)
    print(text)
    if given.table:
        given.table.write_text(text, encoding="utf-8")
    return int(any(count.false for rows in counts.values() for count in rows.values()))


if __name__ == "__main__":
    raise SystemExit(main())
