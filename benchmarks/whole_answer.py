"""What the network of the whole answer is worth on another run, and what the rules that decline one stop and cost.

Each log goes through `discover`; beside the corrected model the kinds of `train --residual best` are tried, and the
best is trained whatever it earned. Corrected model and network predict another run of the same boat, which neither fit
nor choice saw: mean logarithm of 10 s errors of speeds and position, in those of the nominal model.

    python benchmarks/whole_answer.py [--study NAME]... [--logs 12] [--gazebo FOLDER] [--kind NAME]... [--jobs N]

Tuning seeds, and runs of the Gazebo BlueBoat that no case of `rivals.py` pairs so. Prints a row a log, and for each
rule networks that are kept, those of them that err more on the other run by 3 % of the nominal error, and the error of
the answer over that of the corrected model, geometric mean. `--kind` tries other kinds of network than
`--residual best` does.
"""

import argparse
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from joblib import Parallel, delayed
from study.records import processors
from study.studies import STUDIES

from undertow.discovery.balance.shooting import TRIFLE
from undertow.measurements.prepared_logs import Inputs
from undertow.physics.effects import COMMAND_OFFSET
from undertow.physics.errors import LogError, RequestError
from undertow.physics.forces import at_beginning
from undertow.physics.motion import Array
from undertow.residuals.learnable_residual import measure_learnable_residual
from undertow.residuals.models.base import Model, VehicleModel
from undertow.residuals.networks.registry import NETWORKS
from undertow.residuals.scores import rollout_errors
from undertow.residuals.training.best_kind import KINDS, Candidate, best_of, candidates
from undertow.residuals.training.epochs import train
from undertow.residuals.training.probes import Probed
from undertow.residuals.training.training_settings import Choice, TrainingSettings
from undertow.workflows.discover_and_add import discover
from undertow.workflows.inputs import read_inputs
from undertow.workflows.whole_answer import names_leave

GAZEBO = (("A_2", "A_1"), ("B_4", "B_2"), ("C_2", "C_1"), ("D_1", "D_2"), ("D_3", "D_1"))
"""Runs of one boat: what is learnt of, and what judges. B_4 and D_3 have another geometry than the other."""
WORSE = 0.03
"""Share of the nominal error by which a network may err more than what it stands on."""


class Asked(NamedTuple):
    """A log: what parts say of the best kind, and errors on another run in the nominal model's, (4,) each.

    `worth`: whether what the corrected model leaves is surely more than noise and preparation. `left`: what names leave
    of the nominal model's error of position on rows that they did not see.
    """

    name: str
    worth: bool
    left: float
    best: Candidate
    corrected: Array
    whole: Array


RULES: dict[str, Callable[[Asked], bool]] = {
    "it was tried": lambda _: True,
    "surely more than noise is left": lambda one: one.worth,
    "it errs less on parts that it does not know": lambda one: one.best.holds(learnable=True),
    "both": lambda one: one.worth and one.best.holds(learnable=True),
    "it surely errs less there": lambda one: one.best.holds(learnable=False),
    "it errs less there, surely where no more than noise is left": lambda one: one.best.holds(learnable=one.worth),
}
"""Ways to decide whether a network stands beside the corrected model."""
for _share in (0.01, 0.02, TRIFLE, 0.05, 0.1):
    RULES[f"the same, and names leave {_share:.0%} and more{' (the verb)' * (_share == TRIFLE)}"] = (
        lambda one, share=_share: one.left >= share and one.best.holds(learnable=one.worth)
    )


def asked(study: str, key: tuple[str, int], tried: Sequence[Choice]) -> Asked | None:
    """Ask one log for the best of some kinds; None where it has no other run, or is refused."""
    logged = STUDIES[study].logged(*key)
    if logged.fresh is None:
        return None
    try:
        with tempfile.TemporaryDirectory() as folder:
            inputs = read_inputs(logged.write(Path(folder) / "log.csv"), logged.vehicle, progress=None)
            fresh = read_inputs(logged.fresh(Path(folder) / "fresh.csv", 1), logged.vehicle, progress=None)
        return judged(f"{study} {key[0]} {key[1]}", inputs, fresh, tried)
    except (LogError, RequestError):
        return None


def of_gazebo(folder: Path, own: str, other: str, tried: Sequence[Choice]) -> Asked:
    """Ask a run of the Gazebo BlueBoat; another one judges."""
    inputs, fresh = (
        read_inputs(folder / f"{name}.csv.gz", folder / "vehicle_linear.yaml", progress=None) for name in (own, other)
    )
    return judged(f"Gazebo {own}, {other}", inputs, fresh, tried)


def judged(name: str, inputs: Inputs, fresh: Inputs, tried: Sequence[Choice]) -> Asked:
    """Ask what was read for the best of some kinds, and another run for what it is worth."""
    run = discover(inputs, progress=None)
    split, vehicle = inputs.parted("train").parts.split, at_beginning(run.discovery.corrected)
    along = vehicle.with_values({COMMAND_OFFSET.symbol: run.findings.command_offset})
    worth = measure_learnable_residual(along, (split.train, split.validation)).worth_it
    kinds = candidates(split, along, TrainingSettings(device="cpu"), tried)
    best = best_of(kinds, learnable=worth) or kinds[0]
    model = train(split, along, replace(best.choice, probes=best.probes)).model
    model.vehicle = vehicle
    other = fresh.parted("train").parts.split

    def error(model: Model) -> Array:
        parts = [rollout_errors(model, part, (10.0,)) for part in (other.train, other.validation, other.test)]
        return np.sqrt(
            np.concatenate([row for part in parts if "10" in part for row in part["10"].squares]).mean(axis=0)
        )

    nominal = error(VehicleModel(inputs.vehicle, "nominal"))
    one, both = (error(each) / nominal for each in (VehicleModel(vehicle, "corrected"), model))
    return Asked(name, worth, names_leave(run.findings), replace(best, probes=Probed()), one, both)


def spread(keys: Sequence[tuple[str, int]], count: int) -> list[tuple[str, int]]:
    """So many logs, spread over the kinds of a study."""
    kinds = list(dict.fromkeys(kind for kind, _ in keys))
    firsts = sorted(keys, key=lambda key: [one for kind, one in keys if kind == key[0]].index(key[1]))
    chosen = np.linspace(0, max(len(kinds), count) - 1, count).astype(int)
    return [firsts[k] for k in chosen.tolist() if k < len(firsts)]


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--study", action="append", choices=STUDIES, help="may be repeated; default: four of them")
    parser.add_argument("--logs", type=int, default=12, help="of each study")
    parser.add_argument("--gazebo", type=Path, help="folder of the Gazebo logs A_1.csv.gz ... and vehicle_linear.yaml")
    parser.add_argument("--kind", action="append", choices=NETWORKS, help="may be repeated; with and without heading")
    parser.add_argument("--jobs", type=int, default=processors())
    given = parser.parse_args()
    keys = [
        (study, key)
        for study in given.study or ("plain", "nameless", "foreign", "others")
        for key in spread(list(STUDIES[study].keys("tuning")), given.logs)
    ]
    kinds = [Choice(name, heading=heading) for name in given.kind or () for heading in (False, True)] or KINDS
    found: list[Asked] = []
    work = [delayed(asked)(*each, kinds) for each in keys]
    work += [delayed(of_gazebo)(given.gazebo, *pair, kinds) for pair in GAZEBO if given.gazebo is not None]
    for one in Parallel(n_jobs=given.jobs, return_as="generator")(work):
        if one is not None:
            found.append(one)
            print(
                f"{one.name}: {'' if one.worth else 'nothing left, '}names leave {one.left:.1%}, "
                f"{one.best.name} {one.best.ratio:.3f} "
                f"(error of its logarithm {one.best.error:.3f}), "
                f"{one.corrected.round(3)} -> {one.whole.round(3)}",
                flush=True,
            )
    print(f"{len(found)} logs, {sum(one.worth for one in found)} of which leave something to learn")
    print("\n| a network is kept where | kept | worse | error |\n| --- | ---: | ---: | ---: |")
    for title, rule in RULES.items():
        kept = [one for one in found if rule(one)]
        worse = sum(bool((one.whole - one.corrected > WORSE).any()) for one in kept)
        gain = sum(float(np.log(one.whole / one.corrected).mean()) for one in kept) / max(len(found), 1)
        print(f"| {title} | {len(kept)} | {worse} | {np.exp(gain):.3f} |")


if __name__ == "__main__":
    main()
