"""What a network of other hulls is worth to a new one: fresh weights, plain fine-tuning, and a start made to be one.

A cause without a name, of another size on each hull, is learnt beside the hull's own vehicle on a short log with field
noise, and judged on another log of the same boat: position over 10 s without noise, against the vehicle alone. The
plain start is the network of one other hull. The other start is made by Reptile (Nichol, Achiam and Schulman 2018):
again and again a few epochs on one of some hulls, then a part of the way there. Fresh hulls and starts are drawn by
seed; those from 100 on are for tuning, those from 0 for reporting.

    python benchmarks/fine_tuning.py [--seeds 5] [--first 0] [--minutes 1 2 4] [--cause NAME]... [--network mlp]

A seed takes some three minutes. It prints a line for each seed and length, and the means.
"""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np
import torch
from foreign_causes import Foreign
from study.foreign_forces import Force, causes

from undertow.measurements.prepared_logs import Inputs
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.typical_effects import random_hull
from undertow.physics.worlds.world import NOISE
from undertow.residuals.models.base import Model, VehicleModel
from undertow.residuals.models.network_model import NetworkModel
from undertow.residuals.scores import rollout_scores
from undertow.residuals.training.epochs import train
from undertow.residuals.training.fine_tuning import going_on_from, take_weights
from undertow.residuals.training.training_settings import Choice, TrainingSettings
from undertow.workflows.inputs import read_inputs

CAUSES = ("drag with a kink", "thrust lost in turns")
STARTS = ("fresh weights", "plain start", "start made to be one")
KNOWN, ROUNDS, PART = 6, 24, 0.5
"""Hulls that a start is made from, how often it goes to one of them, and what part of the way."""
SECONDS, HORIZON = 240.0, 10.0
WHOLE = TrainingSettings(device="cpu")
FEW = replace(WHOLE, epochs=10, averaging=0.0, shrink=False)
"""The way to one hull."""
TUNED = replace(WHOLE, epochs=60, learning_rate=2e-3)
"""After a start: smaller steps, or the first of them lose it."""


@dataclass(frozen=True, slots=True)
class Boat:
    """A hull that lacks a cause, whose size goes with the hull."""

    hull: Vehicle
    push: Force
    seed: int

    @classmethod
    def of(cls, cause: str, seed: int) -> Self:
        """The boat of a seed."""
        rng = np.random.default_rng([seed, *cause.encode()])
        hull = random_hull(load_vehicle("blueboat"), rng)
        return cls(hull, causes(hull, rng)[cause], seed)

    def log(self, seconds: float, noise: str = "field", judge: str = "test") -> Inputs:
        """A log as the verbs read it; one that judges is of another course."""
        world = Foreign(self.hull, "rich", seconds, 2 * self.seed + (judge == "all"), force=self.push)
        with tempfile.TemporaryDirectory() as scratch:
            path = world.run(NOISE[noise]).write(Path(scratch) / "log.csv")
            return read_inputs(path, self.hull, judge=judge, progress=None)


def made_start(cause: str, first: int, network: str) -> tuple[NetworkModel, NetworkModel]:
    """The network of one hull, and a start that was made from several."""
    boats = [Boat.of(cause, first + k) for k in range(KNOWN)]
    known = [(each.hull, each.log(SECONDS)) for each in boats]
    hull, inputs = known[0]
    plain = train(inputs.parts.split, hull, Choice(network), settings=WHOLE).model
    start = train(inputs.parts.split, hull, Choice(network), settings=replace(FEW, epochs=1)).model
    for turn in range(ROUNDS):
        hull, inputs = known[turn % KNOWN]
        there = train(inputs.parts.split, hull, going_on_from(start), settings=replace(FEW, seed=turn)).model
        with torch.no_grad():
            for mean, now in zip(there.network.parameters(), start.network.parameters(), strict=True):
                mean.lerp_(now, 1.0 - PART * (1.0 - turn / ROUNDS))
        take_weights(start.network, there)
    return plain, start


def error(model: Model, judged: Inputs) -> float:
    """Error of position in rollouts [m]."""
    return rollout_scores(model, judged.parts.judged, (HORIZON,))[f"{HORIZON:g}"].position


def gains(cause: str, seed: int, minutes: Sequence[float], network: str) -> dict[float, list[float]]:
    """By what share of the vehicle's own error each way errs less, by the length of the new hull's log [min]."""
    starts = [None, *made_start(cause, 1_000 * (seed + 1), network)]
    boat = Boat.of(cause, seed)
    hull, judged = boat.hull, boat.log(SECONDS, "clean", "all")
    alone = error(VehicleModel(hull, "nominal"), judged)
    found = {}
    for length in minutes:
        short = boat.log(60.0 * length).parts.split
        ways = [
            train(short, hull, Choice(network), settings=replace(WHOLE, seed=seed))
            if start is None
            else train(short, hull, going_on_from(start), settings=replace(TUNED, seed=seed))
            for start in starts
        ]
        found[length] = [error(way.model, judged) / alone - 1.0 for way in ways]
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Print what each way gains on each hull, and the means."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--minutes", type=float, nargs="+", default=[1.0, 2.0, 4.0])
    parser.add_argument("--cause", choices=CAUSES, action="append", help="may be repeated; default: all")
    parser.add_argument("--network", default="mlp")
    given = parser.parse_args(arguments)
    torch.set_num_threads(1)
    every: dict[float, list[list[float]]] = {}
    print(f"| cause | seed | minutes | {' | '.join(STARTS)} |\n| --- | ---: | ---: | ---: | ---: | ---: |")
    for cause in given.cause or CAUSES:
        for seed in range(given.first, given.first + given.seeds):
            for length, found in gains(cause, seed, given.minutes, given.network).items():
                every.setdefault(length, []).append(found)
                print(f"| {cause} | {seed} | {length:g} | {' | '.join(f'{g:+.0%}' for g in found)} |", flush=True)
    for length, found in every.items():
        means = np.mean(found, axis=0)
        print(f"| mean of {len(found)} | | {length:g} | {' | '.join(f'{g:+.0%}' for g in means)} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
