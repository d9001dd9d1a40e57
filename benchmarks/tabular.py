"""What learners of tables make of the rows that a network learns from: trees and processes beside the perceptron.

Both see the same inputs along one Gazebo run, beside the vehicle that was calibrated on it, and are judged one step
ahead on another run: on the rows inside the box of the training inputs, and beyond it. The trees (scikit-learn's
HistGradientBoostingRegressor as it is, an axis each) are fitted to the filtered target row by row; beside them stand
the trees and the Gaussian processes that `train` keeps. Those and the perceptron count whole. Each is also
fitted with the heading as inputs (`train --heading`), which a current asks for. A line tells the means over the seeds;
the last lines, what each learner adds to the mean error of the boosted trees on the run where it does worst. It takes
four minutes a seed.

    python benchmarks/tabular.py GAZEBO [--only B_2] [--network gp] [--seeds 5] [--first 0]
"""

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import HistGradientBoostingRegressor

from undertow.measurements.preparation.prepare import DataSet
from undertow.measurements.preparation.split import Split
from undertow.physics.motion import Array, Motion
from undertow.physics.vehicle import Vehicle
from undertow.residuals.models.network_inputs import network_inputs
from undertow.residuals.scores import same_filter, target_acceleration
from undertow.residuals.training.epochs import train
from undertow.residuals.training.training_settings import Choice, TrainingSettings
from undertow.workflows.fit import fit
from undertow.workflows.inputs import read_inputs

PAIRS = {"A_1": "A_2", "B_2": "B_4", "C_1": "C_2", "D_2": "D_3"}
"""Runs that are trained on, and the one that judges each."""
NETWORKS = {"trees": "trees of ours", "gp": "Gaussian processes", "mlp": "MLP"}
SEEN = {False: "", True: ", heading seen"}
"""What a learner's name says of its inputs."""
Says = Callable[[Motion], Array]


def table(vehicle: Vehicle, data: DataSet, heading: bool = False) -> tuple[Array, Array]:
    """Inputs (rows, inputs) and target (rows, 3) of all rows."""
    seen = [network_inputs(vehicle, motion, heading=heading) for motion in data.motions]
    return np.concatenate(seen), np.concatenate([target_acceleration(vehicle, m, data, False) for m in data.motions])


def errors(says: Says, vehicle: Vehicle, data: DataSet, box: tuple[Array, Array]) -> Array:
    """Root mean square errors (3, 3) by axis of all rows, of those in the box, and of those beyond it."""
    rows = [same_filter(says(m), m, data) - target_acceleration(vehicle, m, data, False) for m in data.motions]
    error, inside = np.concatenate(rows), _inside(vehicle, data, box)
    return np.array([np.sqrt((e**2).mean(axis=0)) for e in (error, error[inside], error[~inside])])


def _inside(vehicle: Vehicle, data: DataSet, box: tuple[Array, Array]) -> NDArray[np.bool_]:
    seen, _ = table(vehicle, data)
    return np.asarray(((seen >= box[0]) & (seen <= box[1])).all(axis=1))


def learners(vehicle: Vehicle, split: Split, seed: int, networks: Sequence[str]) -> dict[str, Says]:
    """What the trees of scikit-learn and some networks say along a motion, by their names."""
    found: dict[str, Says] = {"vehicle alone": lambda motion: np.zeros((motion.time.size, 3))}
    for heading, how in SEEN.items():
        found[f"boosted trees{how}"] = _boosted(vehicle, split, heading, seed)
    settings = TrainingSettings(seed=seed, trust=False)
    for network in networks:
        for heading, how in SEEN.items():
            model = train(split, vehicle, Choice(network, heading=heading), settings=settings).model
            found[f"{NETWORKS[network]}{how}"] = model.correction
    return found


def _boosted(vehicle: Vehicle, split: Split, heading: bool, seed: int) -> Says:
    inputs, target = table(vehicle, split.train, heading)
    trees = [HistGradientBoostingRegressor(random_state=seed).fit(inputs, column) for column in target.T]

    def says(motion: Motion) -> Array:
        seen = network_inputs(vehicle, motion, heading=heading)
        return np.column_stack([tree.predict(seen) for tree in trees])

    return says


def main(arguments: Sequence[str] | None = None) -> int:
    """Fit, judge and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("gazebo", type=Path, help="folder of the Gazebo logs A_1.csv.gz ... and vehicle_linear.yaml")
    parser.add_argument("--only", action="append", choices=PAIRS, help="a run to train on; may be repeated")
    parser.add_argument("--network", action="append", choices=NETWORKS, help="may be repeated; default: all")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="first seed; from 100 on for tuning")
    given = parser.parse_args(arguments)
    nominal = given.gazebo / "vehicle_linear.yaml"
    print("root mean squares of surge, sway [m/s^2], yaw [rad/s^2]; means of the seeds, and their range")
    print("| trained on | learner | held-out run | in the box | beyond | rows in the box |")
    print("| --- | --- | --- | --- | --- | ---: |")
    worse: dict[str, dict[str, Array]] = {}
    for run in given.only or PAIRS:
        inputs = read_inputs(given.gazebo / f"{run}.csv.gz", nominal, progress=None)
        other = read_inputs(given.gazebo / f"{PAIRS[run]}.csv.gz", nominal, judge="all", progress=None).parts.judged
        vehicle, split = fit(inputs, progress=None).vehicle, inputs.parts.split
        seen, _ = table(vehicle, split.train)
        box = seen.min(axis=0), seen.max(axis=0)
        found: dict[str, list[Array]] = {}
        for seed in range(given.first, given.first + given.seeds):
            for name, says in learners(vehicle, split, seed, given.network or [*NETWORKS]).items():
                found.setdefault(name, []).append(errors(says, vehicle, other, box))
        share = f"{_inside(vehicle, other, box).mean():.0%}"
        mean = {name: np.mean(each, axis=0) for name, each in found.items()}
        for name, each in found.items():
            print(f"| {run} | {name} | {' | '.join(_cell(np.array(each)[:, part]) for part in range(3))} | {share} |")
            worse.setdefault(name, {})[run] = mean[name][0] / mean["boosted trees"][0] - 1.0
        sys.stdout.flush()
    for name, runs in worse.items():
        worst = max(runs, key=lambda run: runs[run].max())
        axes = ", ".join(f"{change:+.0%}" for change in runs[worst])
        print(f"{name} against boosted trees: worst after {worst}: {axes}; mean {np.mean(list(runs.values())):+.0%}")
    return 0


def _cell(each: Array) -> str:
    """Means over seeds by axis, with the least and the most where they differ; seeds (seeds, 3)."""
    spread = np.ptp(each, axis=0) > 5e-5
    return " ".join(
        f"{mean:.4f} ({least:.4f} to {most:.4f})" if wide else f"{mean:.4f}"
        for mean, least, most, wide in zip(each.mean(axis=0), each.min(axis=0), each.max(axis=0), spread, strict=True)
    )


if __name__ == "__main__":
    sys.exit(main())
