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
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from unnamed import SECONDS, boats, position, read

from undertow.measurements.prepared_logs import Inputs
from undertow.physics.vehicle import Vehicle
from undertow.residuals.models.base import VehicleModel
from undertow.residuals.models.network_model import NetworkModel
from undertow.residuals.training.epochs import train
from undertow.residuals.training.preparation import going_on_from, take_weights
from undertow.residuals.training.training_settings import Choice, TrainingSettings

CAUSES = ("drag with a kink", "thrust lost in turns")
STARTS = ("fresh weights", "plain start", "start made to be one")
KNOWN, ROUNDS, PART = 6, 24, 0.5
"""Hulls that a start is made from, how often it goes to one of them, and what part of the way."""
WHOLE = TrainingSettings(device="cpu")
FEW = replace(WHOLE, epochs=10, averaging=0.0, trust=False)
"""The way to one hull."""
TUNED = replace(WHOLE, epochs=60, learning_rate=2e-3)
"""After a start: smaller steps, or the first of them lose it."""


def log_of(cause: str, seed: int, seconds: float = SECONDS, noise: str = "field") -> tuple[Vehicle, Inputs]:
    """A hull that lacks a cause, and its log; one without noise is of another course, and judges."""
    hull, world = boats(cause, seed)
    clean = noise == "clean"
    driven = replace(world("rich", 2 * seed + clean), duration=seconds)
    return hull, read(driven, noise, hull, "all" if clean else "test")


def made_start(cause: str, first: int, network: str) -> tuple[NetworkModel, NetworkModel]:
    """The network of one hull, and a start that was made from several."""
    known = [log_of(cause, first + k) for k in range(KNOWN)]
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


def gains(cause: str, seed: int, minutes: Sequence[float], network: str) -> dict[float, list[float]]:
    """By what share of the vehicle's own error each way errs less, by the length of the new hull's log [min]."""
    starts = [None, *made_start(cause, 1_000 * (seed + 1), network)]
    hull, judged = log_of(cause, seed, noise="clean")
    alone = position(VehicleModel(hull, "nominal"), judged)
    found = {}
    for length in minutes:
        short = log_of(cause, seed, 60.0 * length)[1].parts.split
        ways = [
            train(short, hull, Choice(network), settings=replace(WHOLE, seed=seed))
            if start is None
            else train(short, hull, going_on_from(start), settings=replace(TUNED, seed=seed))
            for start in starts
        ]
        found[length] = [position(way.model, judged) / alone - 1.0 for way in ways]
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
