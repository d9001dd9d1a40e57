"""How far from its training a hybrid stays as good as the vehicle beside it: with the fade, and without.

Networks are trained on one Gazebo run beside two bases, the vehicle calibrated on that run and the corrected one, and
judged on other runs of a hull of the same kind: error of position in 10 s rollouts, against that of the base alone.
Where `train` would decline the vehicle is left alone; `--always` trains all the same.
Results are kept one by one in a folder, so that a study that was stopped goes on; they count only for the source that
made them. Seeds from 100 are for tuning, seeds from 0 for reporting.

    python benchmarks/fading.py GAZEBO [--only D_1] [--network tcn] [--seeds 5] [--first 0] [--fade 0.5] [--folder DIR]

With --seeds 1 that takes a quarter of an hour. It prints a line for each base, network and run, and the worst of all.
It exits 1 when a hybrid beside the corrected model is more than 3 % worse than the model alone, on the mean of the
seeds.
"""

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from study.records import fingerprint

from undertow.comparison.coverage import coverage
from undertow.measurements.preparation.dataset import DataSet
from undertow.measurements.preparation.split import Split
from undertow.physics.files import write_json
from undertow.physics.frames import AXES
from undertow.physics.vehicle import Vehicle
from undertow.residuals.left_to_learn import left_to_learn
from undertow.residuals.models.base import Model, VehicleModel
from undertow.residuals.scores import evaluate, rollout_scores
from undertow.residuals.training.epochs import train
from undertow.residuals.training.training_settings import Choice, TrainingSettings
from undertow.workflows.discover_and_add import discover
from undertow.workflows.fit import fit
from undertow.workflows.inputs import read_inputs

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("physics", "measurements", "residuals", "discovery")
"""Packages whose source decides the results."""
RUNS = {"A_1": ("A_2",), "B_2": ("B_4", "G_2"), "C_1": ("C_2",), "D_1": ("D_2", "D_3"), "D_2": ("D_1", "D_3")}
"""Runs that are trained on, and those that judge. Those of B and D differ in their hull's geometry, those of B and G in
the simulator's hydrodynamics: what is learnt of one need not hold for the other."""
BASES = ("calibrated", "corrected")
"""What networks are put beside: the vehicle calibrated on the run, and that with the effects that were found on it."""
Data = Mapping[str, DataSet]
FEW = 100
"""Rows that tell too little of an interval."""
MOST, HORIZON = 0.03, 10.0
"""By how much a hybrid may be worse than its base, and the length of the rollouts [s]."""


def position(model: Model, data: DataSet) -> float:
    """Error of position in rollouts [m]."""
    return rollout_scores(model, data, (HORIZON,))[f"{HORIZON:g}"].position


def bases(folder: Path, run: str) -> dict[str, Vehicle]:
    """The vehicles that networks are put beside."""
    inputs = read_inputs(folder / f"{run}.csv.gz", folder / "vehicle_linear.yaml", progress=None)
    corrected = discover(inputs, progress=None).discovery.corrected
    return {"calibrated": fit(inputs, progress=None).vehicle, "corrected": corrected}


def held(model: Model, data: DataSet) -> list[float]:
    """Shares of the rows within what a model has seen that its interval holds, by axis; empty where these are few."""
    told = coverage(model, evaluate(model, data, ()), data)
    shares = None if told is None or told.inside.rows < FEW else told.inside.share
    return [] if shares is None else [shares.of(axis) for axis in AXES]


def errors_of(split: Split, base: Vehicle, choice: Choice, settings: TrainingSettings, data: Data) -> dict[str, Any]:
    """Errors of a hybrid on each data set with the fade and without, how much is kept, and where nothing is left."""
    found = train(split, base, choice, settings=settings)
    model = found.model
    fading = {name: position(model, part) for name, part in data.items()}
    far = {
        name: float((np.concatenate([model.beyond(m) for m in part.motions]) > model.far).mean())
        for name, part in data.items()
    }
    holds, fade = {name: held(model, part) for name, part in data.items()}, model.far
    model.network.fade_beyond(None)
    whole = {name: position(model, part) for name, part in data.items()}
    return {"fading": fading, "whole": whole, "far": far, "share": found.share, "holds": holds, "fade": fade}


def judged(
    folder: Path,
    run: str,
    networks: Sequence[str],
    seeds: range,
    kept: Path,
    beside: Sequence[str],
    always: bool,
    fade: float | None,
) -> list[dict[str, Any]]:
    """Errors beside the bases on the held-out end of a run and on the runs that judge it."""
    made_by = fingerprint(PACKAGES)
    told = json.loads(kept.read_text("utf-8")) if kept.is_file() else {}
    records: dict[str, dict[str, Any]] = told.get("records", {}) if told.get("source") == made_by else {}
    how = f"{' always' * always}{'' if fade is None else f' fade {fade:g}'}"
    wanted = {f"{b} {n} {s}{how}": (b, n, s) for b in beside for n in networks for s in seeds}
    missing = {key: words for key, words in wanted.items() if key not in records}
    if missing:
        nominal = folder / "vehicle_linear.yaml"
        split = read_inputs(folder / f"{run}.csv.gz", nominal, progress=None).parts.split
        data = {f"{run} (end)": split.test} | {
            name: read_inputs(folder / f"{name}.csv.gz", nominal, judge="all", progress=None).parts.judged
            for name in RUNS[run]
        }
        vehicles = bases(folder, run)
        left = {b: left_to_learn(v, (split.train, split.validation)) for b, v in vehicles.items()}
        alone = {
            b: {name: position(VehicleModel(v, b), part) for name, part in data.items()} for b, v in vehicles.items()
        }
    for key, (base, network, seed) in missing.items():
        if always or left[base].worth_it:
            chosen = Choice(network, axes=left[base].axes)
            found = errors_of(split, vehicles[base], chosen, TrainingSettings(seed=seed, fade=fade), data)
        else:
            found = {"fading": alone[base], "whole": alone[base], "far": dict.fromkeys(data, 0.0)}
            found |= {"share": 0.0, "fade": 0.0, "holds": {name: [] for name in data}}
        times = left[base].position / left[base].position_preparation
        words = {"run": run, "base": base, "network": network, "seed": seed, "alone": alone[base], "times": times}
        records[key] = words | found
        kept.parent.mkdir(parents=True, exist_ok=True)
        write_json(kept, {"source": made_by, "records": records})
        print(f"{run}: {key}: done", file=sys.stderr, flush=True)
    return [records[key] for key in wanted]


def table(records: Sequence[dict[str, Any]]) -> tuple[list[str], float]:
    """A line for each base, network and run, and by how much the worst beside a corrected model is worse."""
    head = (
        "| base | times what preparing leaves | network | trained on | judged on | base [m] | never fades | fades |"
        " fade [deviations] | nothing left | share kept | interval holds |"
    )
    lines, worst = [head, "| --- | ---: | --- | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"], -np.inf
    groups = list(dict.fromkeys((r["base"], r["network"], r["run"]) for r in records))
    for base, network, run in groups:
        mine = [r for r in records if (r["base"], r["network"], r["run"]) == (base, network, run)]
        for name, alone in mine[0]["alone"].items():
            change = {k: np.array([r[k][name] / alone - 1.0 for r in mine]) for k in ("whole", "fading")}
            cells = [f"{100 * v.mean():+.1f} % ({100 * v.min():+.0f} to {100 * v.max():+.0f})" for v in change.values()]
            far = np.mean([r["far"][name] for r in mine])
            widths = np.array([r["fade"] for r in mine])
            cells += [f"{widths.mean():.2g} ({widths.min():.2g} to {widths.max():.2g})"]
            cells += [f"{far:.0%}", f"{np.mean([r['share'] for r in mine]):.2f}"]
            shares = [r["holds"][name] for r in mine if r["holds"][name]]
            cells.append(", ".join(f"{100 * x:.0f}" for x in np.mean(shares, axis=0)) + " %" if shares else "")
            first = [base, f"{mine[0]['times']:.1f}", network, run, name, f"{alone:.4f}"]
            lines.append(f"| {' | '.join([*first, *cells])} |")
            if base == "corrected" and "(end)" not in name:
                worst = max(worst, float(change["fading"].mean()))
    return lines, worst


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study and print its table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("gazebo", type=Path, help="folder of the Gazebo logs A_1.csv.gz ... and vehicle_linear.yaml")
    parser.add_argument("--only", action="append", choices=RUNS, help="a run to train on; may be repeated")
    parser.add_argument("--network", action="append", help="may be repeated; default: lstm and tcn")
    parser.add_argument("--base", action="append", choices=BASES, help="may be repeated; default: both")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--first", type=int, default=0, help="first seed; from 100 on for tuning")
    parser.add_argument("--always", action="store_true", help="also where train declines: too little is left")
    parser.add_argument("--fade", type=float, help="of all networks; default: what their logs say")
    parser.add_argument("--folder", type=Path, default=ROOT / "runs" / "fading", help="where results are kept")
    given = parser.parse_args(arguments)
    seeds = range(given.first, given.first + given.seeds)
    records = [
        record
        for run in given.only or RUNS
        for record in judged(
            given.gazebo,
            run,
            given.network or ["lstm", "tcn"],
            seeds,
            given.folder / f"{run}.json",
            given.base or BASES,
            given.always,
            given.fade,
        )
    ]
    lines, worst = table(records)
    print("\n".join(lines))
    print(f"\nworst beside a corrected model: {100 * worst:+.1f} % (at most {100 * MOST:+.0f} %)")
    return int(worst > MOST)


if __name__ == "__main__":
    sys.exit(main())
