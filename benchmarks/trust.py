"""How far a correction is to be trusted: its gain as `train` estimates it, and what each part of the estimate is worth.

Networks are trained beside a calibrated vehicle on a log, most of them gentle, and judged on a whole run that is not
like it. *verb* is what `train` gives: the vehicle alone where it declines, since nothing is left to learn. Beside its
gain (*train*, also where it declines) stand others of the same network: none of it (*whole*), a fade of half a
deviation (*narrow*), gains that know no held-out regions (*blocks*), that sum no rows (*rows*), that never end
(*stays*), and that end at once, twice or eight times what was tried, not at four times (*ends 1*, *ends 2*, *ends 8*).
An error is worse where it exceeds that of the vehicle alone by more than 3 % of that of the nominal file, on any axis
or of position, one step ahead or over 2 and 10 s. Results are kept one by one in a folder; they count only for the
source that made them. Seeds from 100 are for tuning.

    python benchmarks/trust.py [--gazebo FOLDER] [--only NAME]... [--network gp]... [--seeds 1] [--folder DIR]
        [--table trust.md]

A pair takes half a minute with `gp`. Exits 1 where what `train` gives is worse on any pair.
"""

import argparse
import json
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from study.records import fingerprint, in_a_table
from unnamed import CAUSES, NOTHING, boats, read

from undertow.measurements.prepared_logs import Inputs
from undertow.physics.files import write_json, write_text
from undertow.physics.motion import AXES, Array
from undertow.physics.vehicle import Vehicle
from undertow.residuals.learnable_residual import measure_learnable_residual
from undertow.residuals.models.base import Model, VehicleModel
from undertow.residuals.networks.trust import ENDS, Trust, stacked
from undertow.residuals.scores import evaluate
from undertow.residuals.training.epochs import probes_of, train
from undertow.residuals.training.probes import Probed, held_out_parts, predict_held_out
from undertow.residuals.training.training_settings import Choice, TrainingSettings
from undertow.workflows.fit import fit
from undertow.workflows.inputs import read_inputs

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("physics", "measurements", "residuals", "discovery")
"""Packages whose source decides the results."""
RUNS = (("A_1", "A_2"), ("B_2", "B_4"), ("C_1", "C_2"), ("D_1", "D_2"), ("D_1", "D_3"), ("D_2", "D_1"), ("D_2", "D_3"))
"""Runs of Gazebo that are trained on, and that judge; the others are gentle logs of simulated hulls, and rich ones."""
MOST, SUMMED = 0.03, 20
"""Share of the nominal error by which a model may be worse than its base, and rows that are added up, as in `train`."""
VARIANTS = ("verb", "train", "whole", "narrow", "blocks", "rows", "stays", "ends 1", "ends 2", "ends 8")
Pair = Callable[[], tuple[Inputs, Inputs, Vehicle, Vehicle]]


def gazebo(folder: Path, own: str, other: str) -> tuple[Inputs, Inputs, Vehicle, Vehicle]:
    """A log, another, the nominal vehicle and the calibrated one."""
    nominal = folder / "vehicle_linear.yaml"
    run = read_inputs(folder / f"{own}.csv.gz", nominal, progress=None)
    judge = read_inputs(folder / f"{other}.csv.gz", nominal, judge="all", progress=None)
    return run, judge, run.vehicle, fit(run, progress=None).vehicle


def simulated(cause: str, seed: int) -> tuple[Inputs, Inputs, Vehicle, Vehicle]:
    """The same of a hull that lacks a cause: a gentle log with noise, and a rich one without."""
    hull, world = boats(cause, seed)
    run = read(world("gentle", 1000 + seed), "field", hull)
    return run, read(world("rich", 2000 + seed), "clean", hull, "all"), hull, fit(run, progress=None).vehicle


def pairs(folder: Path | None, seed: int) -> Mapping[str, Pair]:
    """All pairs by name; those of Gazebo only where its folder is given."""
    found: dict[str, Pair] = {}
    if folder is not None:
        found |= {f"{own} on {other}": partial(gazebo, folder, own, other) for own, other in RUNS}
    return found | {cause: partial(simulated, cause, seed) for cause in CAUSES if cause != NOTHING}


def errors(model: Model, judge: Inputs) -> list[float]:
    """One step on each axis, then speeds and position over 2 s and over 10 s."""
    found = evaluate(model, judge.parts.judged, (2.0, 10.0))
    rolled = (found.rollout_scores[h] for h in ("2", "10"))
    return [*found.acceleration_score.rmse.tolist(), *(x for s in rolled for x in (*s.velocity.tolist(), s.position))]


def judged(pair: Pair, network: str, seed: int) -> dict[str, list[float]]:
    """Errors of the nominal and the calibrated vehicle, and of one network by each gain."""
    run, judge, nominal, base = pair()
    split, choice, settings = run.parts.split, Choice(network), TrainingSettings(seed=seed, device="cpu")
    every = held_out_parts(split.train, base, settings.window)
    blocks, regions = (
        probes_of(split, base, choice, settings, [p for p in every if p.block is block]) for block in (True, False)
    )
    probes = Probed((*blocks.parts, *regions.parts))
    model = train(split, base, replace(choice, probes=probes), settings=settings).model
    assert model.network.gain is not None, "it is asked of its log"
    given = model.network.gain.trust
    alone = model
    if model.network.grown is not None:  # it has learnt the validation part by now
        alone = train(split, base, choice, settings=replace(settings, trust=False)).model
    own = predict_held_out(alone, split.train, split.validation)

    def by(tried: Sequence[Any], rows: int) -> Trust:
        common = model.network.rests_on == "itself"
        reaches, weights, error = stacked(tried, rows, common=common, seed=0)
        return replace(given, reaches=reaches, weights=weights, error=error)

    def ending(times: float) -> Trust:
        reaches, weights = given.reaches.copy(), given.weights.copy()
        if reaches.size > 1 and reaches[-1] == ENDS * reaches[-2]:  # else nothing was tried far out
            if times < np.inf:
                reaches[-1] = times * reaches[-2]
            else:
                weights = np.column_stack([given.weights[:, :-2], np.zeros(3), given.weights[:, -2]])
        return replace(given, reaches=reaches, weights=weights)

    whole: Array = np.tile([0.0, 1.0], (3, 1))
    gains = {
        "train": given,
        "whole": replace(given, reaches=given.reaches[:1], weights=whole),
        "narrow": replace(given, reaches=given.reaches[:1], weights=whole[:, ::-1].copy()),
        "blocks": by([*blocks.tried, *own], SUMMED),
        "rows": by([*probes.tried, *own], 1),
        "stays": ending(np.inf),
        "ends 1": ending(1.0),
        "ends 2": ending(2.0),
        "ends 8": ending(8.0),
    }
    learnable = measure_learnable_residual(base, (split.train, split.validation)).worth_it
    found = {"nominal": errors(VehicleModel(nominal, "nominal"), judge), "base": errors(VehicleModel(base, "b"), judge)}
    for name, gain in gains.items():
        model.trust(gain)
        found[name] = errors(model, judge)
    return found | {"verb": found["train" if learnable else "base"]}


def worst(record: Mapping[str, Any], variant: str) -> float:
    """By how much a model is worse than its base at most, as a share of the nominal error."""
    mine, base, nominal = (np.array(record[name]) for name in (variant, "base", "nominal"))
    return float(((mine - base) / np.maximum(nominal, 1e-12)).max())


def page(records: Mapping[str, Mapping[str, Any]]) -> str:
    """Change of the error of position over 10 s by each gain, and the worst of all errors."""
    rows = []
    for name, record in records.items():
        base = record["base"][-1]
        cells = [f"{100.0 * (record[v][-1] / base - 1.0):+.0f} %".replace("-", "−") for v in VARIANTS]
        rows.append((name, f"{record['nominal'][-1]:.3g}", f"{base:.3g}", *cells))
    geometric = [np.exp(np.mean([np.log(r[v][-1] / r["base"][-1]) for r in records.values()])) for v in VARIANTS]
    rows.append(("geometric mean", "", "", *(f"{100.0 * (g - 1.0):+.0f} %".replace("-", "−") for g in geometric)))
    most = [max(worst(r, v) for r in records.values()) for v in VARIANTS]
    rows.append(("worst of all errors", "", "", *(f"{100.0 * m:+.1f} %".replace("-", "−") for m in most)))
    over = [sum(worst(r, v) > MOST for r in records.values()) for v in VARIANTS]
    rows.append((f"pairs worse by over {100 * MOST:.0f} %", "", "", *(f"{n} of {len(records)}" for n in over)))
    head = ("pair", "nominal [m]", "base [m]", *VARIANTS)
    return "\n\n".join(("# How far a network is trusted", _text(), in_a_table(head, rows))) + "\n"


def _text() -> str:
    return (
        "Change of the error of position over 10 s beside the calibrated vehicle, by the gain of the same network; "
        f"the worst is that of accelerations, speeds ({', '.join(AXES)}) and position over 2 and 10 s, as a share of "
        "the nominal error. What the columns are: `benchmarks/trust.py`, which printed this."
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study and print its table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gazebo", type=Path, help="folder of the Gazebo logs A_1.csv.gz ... and vehicle_linear.yaml")
    parser.add_argument("--only", action="append", help="a pair; may be repeated; default: all that there are")
    parser.add_argument("--network", action="append", help="may be repeated; default: gp")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="first seed; from 100 on for tuning")
    parser.add_argument("--folder", type=Path, default=ROOT / "runs" / "trust", help="where results are kept")
    parser.add_argument("--table", type=Path, help="page to write, in Markdown")
    given = parser.parse_args(arguments)
    made_by, kept = fingerprint(PACKAGES), given.folder / "records.json"
    stored = json.loads(kept.read_text("utf-8")) if kept.is_file() else {}
    records: dict[str, Any] = stored.get("records", {}) if stored.get("source") == made_by else {}
    wanted = []
    for seed in range(given.first, given.first + given.seeds):
        for name, pair in pairs(given.gazebo, seed).items():
            for network in given.network or ["gp"] if name in (given.only or [name]) else []:
                wanted.append(f"{name}, {network}" + (f", seed {seed}" if given.seeds > 1 else ""))
                if wanted[-1] not in records:
                    records[wanted[-1]] = judged(pair, network, seed)
                    kept.parent.mkdir(parents=True, exist_ok=True)
                    write_json(kept, {"source": made_by, "records": records})
                    print(f"{wanted[-1]}: done", file=sys.stderr, flush=True)
    text = page({key: records[key] for key in wanted})
    if given.table is not None:
        write_text(given.table, text)
    print(text)
    return int(any(worst(records[key], "verb") > MOST for key in wanted))


if __name__ == "__main__":
    sys.exit(main())
