"""What discovery makes of commands that are not recorded as they acted: a study over random hulls.

Nothing is hidden, or one effect is. What the thrusters do is the same in every world; what the log says of it differs:
switches fall between two records, records are held or joined by lines, come late, or are rounded. A name is false
where it is hidden from nobody.

    python benchmarks/command_records.py [--seeds 4] [--first 7000] [--kind NAME]... [--jobs 1]
"""

import argparse
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from joblib import Parallel, delayed

from undertow.discovery.discover import find_missing
from undertow.physics.errors import RequestError
from undertow.physics.integration import simulate_motion
from undertow.physics.motion import Array, Motion
from undertow.physics.sampled_series import area_average
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.hidden_effects import apply_effects, random_hull, typical_effect
from undertow.physics.worlds.manoeuvres import COMMAND_STEP, programme
from undertow.physics.worlds.world import NOISE

STEP, FINE = 0.05, 0.01
PROGRAMMES = ("zigzag", "rich", "gentle")
HIDDEN = (None, "surge_quadratic_damping", "yaw_added_mass", "thruster_asymmetry", "thruster_lag", "input_delay")
VEHICLES = ("blueboat", "otter")

Record = Callable[[Array, Array, np.random.Generator], tuple[Array, Array, bool]]
"""(instants, commands that acted) -> stamps and values of the record, and whether it is read as held."""


def _sampled(time: Array, acted: Array, rng: np.random.Generator) -> tuple[Array, Array, bool]:
    rows = np.arange(0, time.size, round(COMMAND_STEP / FINE))
    return time[rows], acted[rows], True


def _late(time: Array, acted: Array, rng: np.random.Generator) -> tuple[Array, Array, bool]:
    stamps, values, hold = _sampled(time, acted, rng)
    return stamps + 0.6 * COMMAND_STEP, values, hold


def _lines(time: Array, acted: Array, rng: np.random.Generator) -> tuple[Array, Array, bool]:
    stamps, values, _ = _sampled(time, acted, rng)
    return stamps, values, False


def _rounded(time: Array, acted: Array, rng: np.random.Generator) -> tuple[Array, Array, bool]:
    stamps, values, hold = _sampled(time, acted, rng)
    step = np.ptp(values, axis=0) / 30.0
    step[step == 0.0] = 1.0
    return stamps, np.round(values / step) * step, hold


@dataclass(frozen=True, slots=True)
class Kind:
    """How commands come about and are recorded: do switches fall between records, how fast do they slew, the record."""

    between: bool
    slew: float
    record: Record


KINDS = {
    "as they acted": Kind(False, 0.0, _sampled),
    "switched between records": Kind(True, 0.0, _sampled),
    "slewed over 0.3 s": Kind(True, 0.3, _sampled),
    "joined by lines": Kind(False, 0.0, _lines),
    "0.06 s late": Kind(False, 0.0, _late),
    "rounded to a thirtieth": Kind(False, 0.0, _rounded),
}


def acted(held: Array, kind: Kind, rng: np.random.Generator) -> tuple[Array, Array]:
    """Instants [s] and the commands that act there, from a series on the 10 Hz grid."""
    time = FINE * np.arange(held.shape[0] * round(COMMAND_STEP / FINE))
    stamps = COMMAND_STEP * np.arange(held.shape[0], dtype=float)
    if kind.between:
        stamps[1:] -= rng.uniform(0.0, COMMAND_STEP, held.shape[0] - 1)
    values = held[np.clip(np.searchsorted(stamps, time + 1e-9, "right") - 1, 0, None)]
    if kind.slew:
        width = round(kind.slew / FINE)
        padded = np.concatenate([np.repeat(values[:1], width - 1, axis=0), values])
        total = np.cumsum(np.concatenate([np.zeros((1, values.shape[1])), padded]), axis=0)
        values = (total[width:] - total[:-width]) / width
    return time, values


def motion(true: Vehicle, kind: Kind, drive: str, noise: str, duration: float, seed: int) -> Motion:
    """The log of a world as discovery gets it."""
    rng = np.random.default_rng([seed, 21])
    time, values = acted(programme(true, drive, duration, seed), kind, rng)
    n = time.size
    heading = np.full(n, rng.uniform(-np.pi, np.pi))
    names = tuple(t.name for t in true.thrusters)
    truth = simulate_motion(true, Motion(time, np.zeros((n, 2)), heading, np.zeros((n, 3)), values, names))
    stamps, recorded, hold = kind.record(time, values, rng)
    rows = np.arange(0, n, round(STEP / FINE))
    grid, sensors = time[rows], NOISE[noise]
    drawn = rng.standard_normal((rows.size, 6))
    return replace(
        truth,
        time=grid,
        position=truth.position[rows] + sensors.position * drawn[:, :2],
        heading=truth.heading[rows] + sensors.heading * drawn[:, 2],
        velocity=truth.velocity[rows] + drawn[:, 3:] * [sensors.speed, sensors.speed, sensors.yaw_rate],
        commands=area_average(stamps, recorded, grid, STEP, hold=hold),
        command_step=COMMAND_STEP,
        source=f"{drive} {noise} {seed}",
    )


def judged(name: str, drive: str, noise: str, hidden: str | None, duration: float, seed: int) -> dict[str, Any]:
    """What is named in one world."""
    rng = np.random.default_rng([seed, 22])
    for _ in range(50):
        try:
            hull = random_hull(load_vehicle(VEHICLES[seed // 2 % len(VEHICLES)]), rng)
            true = apply_effects(hull, {} if hidden is None else typical_effect(hidden, hull, rng))
            log = motion(true, KINDS[name], drive, noise, duration, seed)
            break
        except RequestError:
            continue
    else:
        raise RequestError(f"seed {seed}: no sound world in fifty draws")
    begun = time.process_time()
    findings = find_missing([log], hull).findings
    named = [c.effect for c in findings.candidates if c.verdict == "missing"] + [u.form for u in findings.unnamed]
    return {
        "kind": name,
        "drive": drive,
        "noise": noise,
        "hidden": hidden,
        "named": named,
        "false": [n for n in named if n.split("[")[0] != hidden],
        "found": hidden is None or any(n.split("[")[0] == hidden for n in named),
        "seconds": time.process_time() - begun,
    }


def main() -> None:
    """Print a row for each kind of record, and every false name."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--first", type=int, default=7000)
    parser.add_argument("--duration", type=float, default=200.0)
    parser.add_argument("--kind", action="append", choices=KINDS)
    parser.add_argument("--jobs", type=int, default=1)
    given = parser.parse_args()
    cases = [
        (name, drive, noise, HIDDEN[(n + k) % len(HIDDEN)] if n % 2 else None, given.duration, given.first + n)
        for name in given.kind or KINDS
        for n in range(given.seeds)
        for k, (drive, noise) in enumerate((d, s) for d in PROGRAMMES for s in ("clean", "field"))
    ]
    todo = (delayed(judged)(*case) for case in cases)
    records = cast("list[dict[str, Any]]", Parallel(n_jobs=given.jobs)(todo))
    for r in records:
        if r["false"]:
            print(f"false: {r['kind']}, {r['drive']}, {r['noise']}, hidden {r['hidden']}: {', '.join(r['false'])}")
    print("| commands | logs | with a false name | hidden effect named | processor seconds a log |")
    print("| --- | --- | --- | --- | --- |")
    for name in given.kind or KINDS:
        mine = [r for r in records if r["kind"] == name]
        with_one = [r for r in mine if r["hidden"]]
        false = sum(bool(r["false"]) for r in mine)
        found = f"{sum(r['found'] for r in with_one)} of {len(with_one)}"
        print(f"| {name} | {len(mine)} | {false} | {found} | {np.mean([r['seconds'] for r in mine]):.1f} |")
    print(Counter(n for r in records for n in r["false"]))


if __name__ == "__main__":
    main()
