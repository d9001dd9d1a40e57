"""What a shape of thrust for each thruster, and for surge and yaw apart, would be worth on a real boat.

A propeller beside a hull meets other water than its neighbour, and what it gives ahead need not be what turns the boat.
`discover` has a scale for each thruster, and one curve, one loss astern and one arm for all. Here more is given to the
model that it finds: a scale, a loss astern and an exponent for each thruster, and then for each of its two parts, the
push and the turn. All are fitted on rollouts of 10 s of the logs that discovery saw, with a prior of a third on each
logarithm, and judged on whole logs that nothing saw. The shape of all thrusters together is fitted in the same way, so
that what is compared is freedom and not the fit. Logs are held out as in `examples/real_blueboat.py`.

    python benchmarks/thrust_shapes.py FOLDER [--splits 3]
"""

import argparse
import runpy
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from undertow.measurements.preparation.prepare import PAPER, WEAK, prepare
from undertow.physics.integration import Legs, rollouts
from undertow.physics.motion import Array, Motion
from undertow.physics.thrusters import Thruster
from undertow.physics.vehicle import Vehicle, vehicle_from_dict

EXAMPLE = runpy.run_path(str(Path(__file__).parents[1] / "examples" / "real_blueboat.py"))
HORIZON, APART = 10.0, 4.0
"""Rollouts that are fitted, and from one to the next [s]."""
PRIOR = 1.0 / 3.0
"""Standard deviation of each logarithm."""
FAR = 1000.0
"""Times the arm of a thruster at which the one that only turns sits, with as much less force."""
TURNS = "_turns"
FIELDS = ("scale", "reverse_scale", "thrust_exponent")


def halved(motion: Motion) -> Motion:
    """A motion whose commands are those of the halves, too."""
    run_up = np.hstack([motion.run_up] * 2) if motion.run_up is not None else None
    names = (*motion.thrusters, *(f"{name}{TURNS}" for name in motion.thrusters))
    return replace(motion, commands=np.hstack([motion.commands] * 2), thrusters=names, run_up=run_up)


def in_halves(vehicle: Vehicle) -> Vehicle:
    """Each thruster as one that pushes along the keel, and one far out that hardly pushes, and turns as it did."""
    along = [t.model_copy(update={"y": 0.0}) for t in vehicle.thrusters]
    turning = [
        t.model_copy(
            update={
                "name": f"{t.name}{TURNS}",
                "y": FAR * t.y,
                "scale": t.scale / FAR,
                "advance_loss": t.advance_loss / FAR,
            }
        )
        for t in vehicle.thrusters
    ]
    return vehicle.model_copy(update={"thrusters": (*along, *turning)})


def shaped(vehicle: Vehicle, groups: Sequence[Sequence[int]], logs: Array) -> Vehicle:
    """The vehicle with the fields of each group of thrusters multiplied by the exponentials of `logs`."""
    found: list[Thruster] = list(vehicle.thrusters)
    for group, own in zip(groups, np.exp(logs).reshape(len(groups), len(FIELDS)), strict=True):
        for k in group:
            found[k] = found[k].model_copy(
                update={name: getattr(found[k], name) * x for name, x in zip(FIELDS, own.tolist(), strict=True)}
            )
    return vehicle.model_copy(update={"thrusters": tuple(found)})


def fitted(vehicle: Vehicle, groups: Sequence[Sequence[int]], motions: Sequence[Motion]) -> Vehicle:
    """The fields of each group of thrusters fitted to rollouts."""
    asked = []
    for motion in motions:
        steps = round(HORIZON / motion.time_step)
        starts = np.arange(0, motion.time.size - steps, round(APART / motion.time_step))
        if starts.size:
            asked.append(Legs(motion, starts, steps))
    measured = [legs.motion.velocity[legs.starts[:, None] + np.arange(1, legs.steps + 1)] for legs in asked]
    driven = [EXAMPLE["active"](legs.motion)[legs.starts[:, None] + np.arange(1, legs.steps + 1)] for legs in asked]
    unit = np.sqrt(np.mean(np.concatenate([(m[d] ** 2)[:, [0, 2]] for m, d in zip(measured, driven, strict=True)]), 0))

    def errors(logs: Array) -> Array:
        own = shaped(vehicle, groups, logs)
        parts = [logs / PRIOR]
        for legs, rolled, truth, rows in zip(
            asked, rollouts([(own, legs) for legs in asked], placed=False), measured, driven, strict=True
        ):
            off = (rolled.states[:, 1:, 3:] - truth)[..., [0, 2]] / unit
            # one error a rollout and second counts; those in between are its neighbours'
            every = round(1.0 / legs.motion.time_step)
            parts.append((off * rows[..., None])[:, ::every].ravel())
        return np.nan_to_num(np.concatenate(parts), nan=1e3, posinf=1e3, neginf=-1e3)

    start = np.zeros(len(groups) * len(FIELDS))
    done = least_squares(errors, start, loss="soft_l1", diff_step=1e-3, max_nfev=15, bounds=(-1.2, 1.0))
    return shaped(vehicle, groups, done.x)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study and print its table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--splits", type=int, default=3)
    given = parser.parse_args(arguments)
    logs = EXAMPLE["read"](given.folder)
    start = vehicle_from_dict(EXAMPLE["START"], "start")
    fitting = {log.name: prepare(log, start, WEAK).motions for log in logs}
    judging = {log.name: prepare(log, start, PAPER).motions for log in logs}
    totals: dict[str, list[Array]] = {}
    for number, held in enumerate(EXAMPLE["divisions"](list(fitting), given.splits), start=1):
        seen = [m for name, motions in fitting.items() if name not in held for m in motions]
        taught = [halved(m) for name, motions in judging.items() if name not in held for m in motions]
        test = [halved(m) for name in held for m in judging[name]]
        found = in_halves(EXAMPLE["model"](seen, start)[1].corrected)
        count = len(start.thrusters)
        every, sides = list(range(2 * count)), [[k, k + count] for k in range(count)]
        made: dict[str, Callable[[Vehicle], Vehicle]] = {
            "as discovered": lambda vehicle: vehicle,
            "one shape": lambda vehicle, t=taught, g=[every]: fitted(vehicle, g, t),
            "a shape for each thruster": lambda vehicle, t=taught, g=sides: fitted(vehicle, g, t),
            "a surge and a yaw shape for each": lambda vehicle, t=taught, g=[[k] for k in every]: fitted(vehicle, g, t),
        }
        print(f"split {number}, held out {', '.join(held)}", flush=True)
        for label, make in made.items():
            own = make(found)
            squares, driven, lost = EXAMPLE["errors"](own, test, HORIZON)
            totals.setdefault(label, []).append(squares[driven])
            print(f"  {label}: {EXAMPLE['told'](squares[driven])}, {lost} diverged", flush=True)
            for t in own.thrusters if label != "as discovered" else ():
                told = ", ".join(f"{name} {getattr(t, name):.3g}" for name in FIELDS)
                print(f"    {t.name}: {told}")
    print("\n| thrust | surge [m/s] | yaw [rad/s] | place [m] |\n| --- | ---: | ---: | ---: |")
    for label, squares in totals.items():
        surge, _, yaw, place = np.sqrt(np.concatenate(squares).mean(axis=0))
        print(f"| {label} | {surge:.3f} | {yaw:.3f} | {place:.2f} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
