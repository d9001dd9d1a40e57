"""What the network of the whole answer is worth on another run, and what rules for its kind, and limits, would change.

Each log goes through `discover`; beside the corrected model every kind of `train --residual best` is tried on blocks of
the log, and trained, whatever it earned. Corrected model and networks predict another run of the same boat, which
neither fit nor choice saw: mean logarithm of 10 s errors of speeds and position, in those of the nominal model.

    python benchmarks/whole_answer.py [--study NAME]... [--logs 12] [--every] [--jobs N]

Tuning seeds. Prints a row a log, and for each rule by which a kind is taken, and each limit on the error that blocks
leave it of the corrected model's: networks that are kept, those of them that err more on the other run by 3 % of the
nominal error, and the error of the answer over that of the corrected model, geometric mean over all logs. Logs of
which no more than noise is left get no network, and are left out; with `--every` they get one, too.
"""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
from joblib import Parallel, delayed
from study.records import processors
from study.studies import STUDIES

from undertow.physics.errors import LogError, RequestError
from undertow.physics.forces import at_beginning
from undertow.physics.motion import Array
from undertow.residuals.learnable_residual import measure_learnable_residual
from undertow.residuals.models.base import Model, VehicleModel
from undertow.residuals.scores import rollout_errors
from undertow.residuals.training.best_kind import KINDS, Candidate, candidates, simplest_of
from undertow.residuals.training.epochs import probes_of, train
from undertow.residuals.training.probes import Probed, held_out_parts
from undertow.residuals.training.training_settings import TrainingSettings
from undertow.workflows.discover_and_add import discover
from undertow.workflows.inputs import read_inputs

LIMITS = (np.inf, 1.0, 0.95, 0.9)
WORSE = 0.03
"""Share of the nominal error by which a network may err more than what it stands on."""


class Tried(NamedTuple):
    """A kind beside the corrected model: what blocks say of it, and its errors on another run (4,)."""

    kind: Candidate
    errors: Array


class Asked(NamedTuple):
    """A log: errors of the corrected model on another run in the nominal model's (4,), and the kinds beside it."""

    name: str
    corrected: Array
    tried: list[Tried]


def least(found: Sequence[Candidate]) -> Candidate:
    """The kind that errs least."""
    return min(found, key=lambda one: one.ratio)


def within(found: Sequence[Candidate]) -> Candidate:
    """The kind that errs least, by blocks of the training part alone."""
    return min(found, key=lambda one: float(np.log(one.ratios[:-1]).mean()))


RULES = {"simplest": simplest_of, "least": least, "least of the training part": within}


def asked(study: str, key: tuple[str, int], every: bool) -> Asked | None:
    """Ask one log; None where it has no other run, is refused, or nothing but noise is left of it."""
    logged = STUDIES[study].logged(*key)
    if logged.fresh is None:
        return None
    try:
        with tempfile.TemporaryDirectory() as folder:
            inputs = read_inputs(logged.write(Path(folder) / "log.csv"), logged.vehicle, progress=None)
            run = discover(inputs, progress=None)
            fresh = read_inputs(logged.fresh(Path(folder) / "fresh.csv"), logged.vehicle, progress=None)
        split, vehicle = inputs.parted("train").parts.split, at_beginning(run.discovery.corrected)
        if not (every or measure_learnable_residual(vehicle, (split.train, split.validation)).worth_it):
            return Asked(f"{study} {key[0]} {key[1]}", np.ones(4), [])
        settings = TrainingSettings(device="cpu")
        kinds = sorted(candidates(split, vehicle, settings), key=lambda one: KINDS.index(one.choice))
        regions = [part for part in held_out_parts(split.train, vehicle, settings.window) if not part.block]
        models = []
        for kind in kinds:
            probes = kind.probes
            if all(part.block for _, part in probes.parts):  # of the one that is taken all parts are asked
                probes += probes_of(split, vehicle, kind.choice, settings, regions)
            models.append(train(split, vehicle, replace(kind.choice, probes=probes), settings=settings).model)
    except (LogError, RequestError):
        return None
    other = fresh.parted("train").parts.split

    def error(model: Model) -> Array:
        parts = [rollout_errors(model, part, (10.0,)) for part in (other.train, other.validation, other.test)]
        return np.sqrt(
            np.concatenate([row for part in parts if "10" in part for row in part["10"].squares]).mean(axis=0)
        )

    nominal = error(VehicleModel(logged.vehicle, "nominal"))
    corrected = error(VehicleModel(vehicle, "corrected")) / nominal
    tried = [
        Tried(replace(kind, probes=Probed()), error(model) / nominal) for kind, model in zip(kinds, models, strict=True)
    ]
    return Asked(f"{study} {key[0]} {key[1]}", corrected, tried)


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
    parser.add_argument("--every", action="store_true", help="networks also where nothing but noise is left")
    parser.add_argument("--jobs", type=int, default=processors())
    given = parser.parse_args()
    keys = [
        (study, key)
        for study in given.study or ("plain", "nameless", "foreign", "others")
        for key in spread(list(STUDIES[study].keys("tuning")), given.logs)
    ]
    found: list[Asked] = []
    for one in Parallel(n_jobs=given.jobs, return_as="generator")(delayed(asked)(*each, given.every) for each in keys):
        if one is not None:
            found.append(one)
            print(f"{one.name}: {one.corrected.round(3) if one.tried else 'nothing left'}")
            for kind, errors in one.tried:
                change = float(np.exp(np.log(errors / one.corrected).mean()))
                blocks = f"blocks {kind.ratios.round(2)} {kind.ratio:.3f}"
                print(f"    {kind.name}: {blocks}, other run {change:.3f}, {errors.round(3)}")
            sys.stdout.flush()
    print(f"{len(found)} logs, {sum(bool(one.tried) for one in found)} of which leave something to learn")
    print("\n| rule | limit | kept | worse | error |\n| --- | --- | ---: | ---: | ---: |")
    for rule, limit in product(RULES, LIMITS):
        taken = [(one, RULES[rule]([tried.kind for tried in one.tried])) for one in found if one.tried]
        kept = [
            (one.corrected, next(tried.errors for tried in one.tried if tried.kind is kind))
            for one, kind in taken
            if kind.ratio < limit
        ]
        worse = sum(bool((whole - corrected > WORSE).any()) for corrected, whole in kept)
        gain = sum(float(np.log(whole / corrected).mean()) for corrected, whole in kept) / max(len(found), 1)
        print(f"| {rule} | {limit:g} | {len(kept)} | {worse} | {np.exp(gain):.3f} |")


if __name__ == "__main__":
    main()
