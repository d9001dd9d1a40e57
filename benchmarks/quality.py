"""How well `inspect` finds planted defects, and how often it accuses a sound log, over simulated boats and seeds.

Each world is a BlueBoat on a random heading and programme, with the noise of field sensors, in two shapes: as an
autopilot writes it (positions, heading, gyro, PWM about a neutral of 1500, at 10 Hz), and as odometry with speeds.
Each defect is planted alone, with a size drawn from its range; it is found when the check accuses the right channel,
and right when the number, sign included, is within its tolerance. Sound logs, the same with rough sensors, and the
Gazebo logs where they are at hand, must accuse nobody, and a check that misses its defect must say that it cannot tell:
otherwise the exit code is 1. Faults whose remedies look alike (late, reversed, swapped, exchanged) are planted alone
and together; a remedy that is not the fault's is wrong.

    python benchmarks/quality.py [--seeds 10] [--duration 240] [--remedies] [--table FILE]
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from study.planting import DEFECTS, SPEED_DEFECTS, Defect, autopilot_log
from study.remedies import FAULTS, SPEED_FAULTS, Fault, accused

from undertow.measurements.canonical import Channel
from undertow.measurements.inspection import examine
from undertow.measurements.log import Log, read_log
from undertow.measurements.quality.record import Finding
from undertow.physics.files import write_text
from undertow.physics.vehicle import Vehicle, load_vehicle, vehicle_from_dict
from undertow.physics.worlds.world import NOISE, Sensors, simulate_world

ACCUSED = ("warning", "defect")
PROGRAMMES = ("rich", "zigzag", "gentle")
GAZEBO = Path(__file__).resolve().parents[1].parent / "shared" / "data" / "gazebo"


def pwm_boat() -> Vehicle:
    """A BlueBoat whose thrusters take PWM, 35 N at the ends of 1100 to 1900 us."""
    content = load_vehicle("blueboat").to_dict()
    for thruster in content["thrusters"]:
        thruster |= {
            "command": "pwm",
            "curve": {"kind": "table", "command": [1100.0, 1500.0, 1900.0], "force": [-35.0, 0.0, 35.0]},
        }
    return vehicle_from_dict(content, "a BlueBoat driven by PWM")


def worlds(seeds: int, duration: float, noise: str = "field") -> list[tuple[str, Log]]:
    """Sound logs with their names."""
    boat, found = pwm_boat(), []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(seeds):
            programme = PROGRAMMES[seed % len(PROGRAMMES)]
            path = Path(folder) / f"{programme}_{seed}.csv"
            simulate_world(boat, {}, programme=programme, duration=duration, noise=noise, seed=seed).write(path)
            found.append((f"{noise} {path.name}", with_rest(read_log(path), NOISE[noise])))
    return found


def with_rest(log: Log, sensors: Sensors) -> Log:
    """The same log with 10 s at rest before it, in which the sensors hold what they showed first, plus their noise."""
    rng, channels = np.random.default_rng(1), {}
    deviations = {"u": sensors.speed, "v": sensors.speed, "r": sensors.yaw_rate, "psi": sensors.heading}
    deviations |= {"x": sensors.position, "y": sensors.position}
    for name, channel in log.channels.items():
        before = np.arange(-10.0, channel.time[0] - 0.01, 0.05)
        noise = deviations.get(name, 0.0)
        rest = {"psi": channel.value[0], "x": channel.value[0], "y": channel.value[0]}.get(name, 0.0)
        value = (1500.0 if name.startswith("pwm") else rest) + noise * rng.standard_normal(before.size)
        time = np.concatenate([before, channel.time]) + 10.0
        channels[name] = Channel(name, time, np.concatenate([value, channel.value]), channel.origin)
    return replace(log, channels=channels)


def tried(defect: Defect, log: Log, seed: int) -> tuple[bool, bool, bool]:
    """Plant a defect; whether it is found, found right, and, if not found, whether the check said it cannot tell."""
    rng = np.random.default_rng([seed, len(defect.name)])
    size = float(rng.uniform(*defect.sizes))
    findings = examine(replace(log, channels=defect.plant(dict(log.channels), size, rng))).findings
    asked = [f for f in findings if f.check == defect.check]
    asked = [f for f in asked if not defect.channel or defect.channel in f.channels]
    told = accusations(asked)
    if not told:
        return False, False, any(f.verdict == "cannot tell" for f in asked)
    if defect.value is None:
        return True, True, False
    wanted, near = defect.value(size), defect.tolerance(size)
    return True, any(f.value is not None and abs(f.value - wanted) <= near for f in told), False


def remedies(faults: Sequence[Fault], logs: Sequence[tuple[str, Log]]) -> tuple[list[str], int]:
    """Rows of faults whose remedies look alike, and how many remedies were told that were not the fault's."""
    lines, wrong = [], 0
    for fault in faults:
        told = [accused(examine(fault.of(log)).findings) for _, log in logs]
        right = sum(one == set(fault.told) for one in told)
        false = [(name, one - set(fault.told)) for (name, _), one in zip(logs, told, strict=True)]
        wrong += sum(bool(one) for _, one in false)
        rows = [f"| {fault.name} | {len(logs)} | {right} | {sum(bool(one) for _, one in false)} |"]
        rows += [f"| - {name}: told {', '.join(sorted(one))} | | | |" for name, one in false if one]
        print("\n".join(rows), flush=True)
        lines += rows
    return lines, wrong


def accusations(findings: Sequence[Finding]) -> list[Finding]:
    """What accuses the log."""
    return [finding for finding in findings if finding.verdict in ACCUSED]


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--duration", type=float, default=240.0)
    parser.add_argument("--table", type=Path)
    parser.add_argument("--remedies", action="store_true", help="only the faults whose remedies look alike")
    chosen = parser.parse_args()
    begun = time.perf_counter()
    odometry = worlds(chosen.seeds, chosen.duration)
    autopilot = [(name, autopilot_log(log, seed)) for seed, (name, log) in enumerate(odometry)]
    gazebo = [(path.name, read_log(path)) for path in sorted(GAZEBO.glob("*.csv.gz"))]
    kept, wrong = ["| planted | logs | all told, and no more | wrong remedies |", "| --- | --- | --- | --- |"], 0
    for faults, logs in ((FAULTS, [*autopilot, *odometry, *gazebo]), (SPEED_FAULTS, [*odometry, *gazebo])):
        rows, false = remedies(faults, logs)
        kept, wrong = [*kept, *rows], wrong + false
    if chosen.remedies:
        if chosen.table is not None:
            write_text(chosen.table, "\n".join(kept) + "\n")
        return 1 if wrong else 0
    lines = ["| defect | logs | found | right sign and size | cannot tell |", "| --- | --- | --- | --- | --- |"]
    silent = 0
    for defects, logs in ((DEFECTS, autopilot), (SPEED_DEFECTS, odometry)):
        for defect in defects:
            results = [tried(defect, log, seed) for seed, (_, log) in enumerate(logs)]
            found, right, untold = (sum(result[k] for result in results) for k in range(3))
            lines.append(f"| {defect.name} | {len(logs)} | {found} | {right} | {untold} |")
            silent += len(logs) - found - untold
            print(lines[-1], flush=True)
    sound = [
        *((f"autopilot {name}", log) for name, log in autopilot),
        *((f"odometry {name}", log) for name, log in odometry),
        *((f"odometry {name}", log) for name, log in worlds(chosen.seeds, chosen.duration, "rough")),
    ]
    sound += gazebo
    false = [(name, f) for name, log in sound for f in accusations(examine(log).findings)]
    lines.append(f"\nDefects missed without a word: {silent}. False alarms: {len(false)} on {len(sound)} sound logs.")
    lines += [f"- {name}: {finding.check}: {finding.sentence}" for name, finding in false]
    print("\n".join(lines[-1 - len(false) :]))
    print(f"{time.perf_counter() - begun:.0f} s")
    if chosen.table is not None:
        write_text(chosen.table, "\n".join([*lines, "", *kept]) + "\n")
    return 1 if false or silent or wrong else 0


if __name__ == "__main__":
    sys.exit(main())
