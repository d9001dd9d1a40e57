"""Whether a prior of simulated craft is worth shipping: a minute of a new boat with it, and ten minutes without.

The prior is a perceptron of tanh units in the units of each log (inputs by their spread there, the correction by what
the vehicle leaves), so that its weights mean the same on every hull. It is made of many simulated craft, each of which
lacks one to three effects of the catalogue, by Reptile (Nichol, Achiam and Schulman 2018): a few epochs on the
minute's log of one craft, then a part of the way there. A boat of another simulator, with an effect that its file
lacks, is then learnt beside its nominal file

* from a minute of log, from fresh weights and from the prior, and
* from ten minutes, from fresh weights,

and judged by its position over 10 s on another run. Each boat is a draw by seed; those from 100 are for tuning.

    python benchmarks/prior.py [--craft 1000] [--hulls 50] [--first 0] [--weights FILE]

Prints a line a boat, and the medians: a prior is worth shipping where a minute with it is at least equal to ten minutes
without. The prior takes 2 s a craft, and stays in `--weights` for the next time; a boat takes half a minute.
"""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from study.other_simulators.kinds import with_hulls
from study.other_simulators.worlds import world_of
from study.worlds import PARTS, draw

from undertow.measurements.preparation.split import Split
from undertow.measurements.prepared_logs import Inputs
from undertow.physics.errors import LogError, RequestError
from undertow.physics.vehicle import Vehicle
from undertow.residuals.models.base import Model, VehicleModel
from undertow.residuals.models.network_model import NetworkModel
from undertow.residuals.scores import rollout_scores
from undertow.residuals.training.epochs import train
from undertow.residuals.training.preparation import going_on_from, prepare_training
from undertow.residuals.training.training_settings import Choice, TrainingSettings
from undertow.workflows.inputs import read_inputs

ROOT = Path(__file__).resolve().parents[1]
KINDS = tuple(f"{boat}: one effect" for boat in ("Otter", "WAM-V", "strips"))
"""Boats of other simulators with a thruster to port and one to starboard, as the craft have."""
EFFECTS = ("singles", "pairs", "triples")
"""What the craft lack: parts of the study of effects; their seeds lie beyond all others."""
CRAFT = 70_000_000
MINUTE, LONG, PART = 60.0, 600.0, 0.3
"""Lengths of the logs [s], and what part of the way to a craft the prior goes, falling to nothing."""
CHOICE = Choice("mlp", {"units": 64, "activation": 2})
WHOLE = TrainingSettings(device="cpu")
FEW = replace(WHOLE, epochs=5, averaging=0.0, trust=False, lambda_phys=0.0)
"""The way to one craft: the laws are asked of the boat that comes after."""
TUNED = replace(WHOLE, epochs=60, learning_rate=2e-3)
"""After a start: smaller steps, or the first of them lose it."""
Weights = dict[str, torch.Tensor]


def started(weights: Weights, split: Split, vehicle: Vehicle) -> Choice:
    """A choice that goes on from weights, in the units of a log."""
    prepared = prepare_training(split, vehicle, CHOICE, FEW)
    with torch.no_grad():
        for name, parameter in prepared.network.named_parameters():
            parameter.copy_(weights[name])
    return going_on_from(NetworkModel(vehicle, prepared.network, prepared.time_step))


def craft(number: int) -> Inputs | None:
    """The log of a simulated craft that lacks some effects; None where the draw gives no sound one."""
    part = replace(PARTS[EFFECTS[number % len(EFFECTS)]], seconds=MINUTE)
    with suppress(LogError, RequestError), tempfile.TemporaryDirectory() as folder:
        case = draw(part, number, CRAFT + number)
        return read_inputs(case.log.write(Path(folder) / "log.csv"), case.nominal, progress=None)
    return None


def prior(count: int, place: Path) -> Weights:
    """Weights that some epochs on a new boat take far; those of `place`, where they are there."""
    if place.is_file():
        kept = torch.load(place, weights_only=True)
        if kept["craft"] != count:
            sys.exit(f"{place} is of {kept['craft']} craft, not of {count}: give --craft {kept['craft']}, or remove it")
        return kept["weights"]
    weights: Weights = {}
    for number in range(count):
        inputs = craft(number)
        if inputs is None:
            continue
        split, vehicle = inputs.parts.split, inputs.vehicle
        with suppress(RequestError):
            if not weights:
                fresh = prepare_training(split, vehicle, CHOICE, FEW).network
                weights = {name: values.detach().clone() for name, values in fresh.named_parameters()}
            settings = replace(FEW, seed=number)
            there = train(split, vehicle, started(weights, split, vehicle), settings=settings).model
            for name, values in there.network.named_parameters():
                weights[name] = weights[name].lerp(values.detach(), PART * (1.0 - number / count))
        if number % 50 == 49:
            print(f"{number + 1} craft", file=sys.stderr, flush=True)
    place.parent.mkdir(parents=True, exist_ok=True)
    torch.save({"craft": count, "weights": weights}, place)
    return weights


def errors(seed: int, weights: Weights) -> list[float]:
    """Errors of position [m]: of the nominal file, then after a minute, after a minute with the prior, after ten."""
    kind = KINDS[seed % len(KINDS)]
    world, _ = world_of(kind, with_hulls()[kind], seed)
    file, logs = world.craft.file, []
    with tempfile.TemporaryDirectory() as folder:
        for run, seconds in enumerate((MINUTE, LONG, LONG)):
            driven = replace(world, book=replace(world.book, seconds=seconds))
            path = driven.written(driven.driven(run % 2), Path(folder) / f"{run}.csv", run % 2)
            logs.append(read_inputs(path, file, judge="all" if run == 1 else "test", progress=None))
    short, judge, long = (one.parts for one in logs)
    settings = replace(WHOLE, seed=seed)
    models: list[Model] = [
        VehicleModel(file, "nominal"),
        train(short.split, file, CHOICE, settings=settings).model,
        train(short.split, file, started(weights, short.split, file), settings=replace(TUNED, seed=seed)).model,
        train(long.split, file, CHOICE, settings=settings).model,
    ]
    return [rollout_scores(model, judge.judged, (10.0,))["10"].position for model in models]


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the errors of each boat, and the medians."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--craft", type=int, default=1000)
    parser.add_argument("--hulls", type=int, default=50)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--weights", type=Path, default=ROOT / "runs" / "prior.pt")
    given = parser.parse_args(arguments)
    torch.set_num_threads(1)
    weights = prior(given.craft, given.weights)
    print("| boat | nominal [m] | a minute | a minute, prior | ten minutes |\n| --- | ---: | ---: | ---: | ---: |")
    found = []
    for seed in range(given.first, given.first + given.hulls):
        try:
            found.append(errors(seed, weights))
        except (ArithmeticError, LogError, RequestError) as error:
            print(f"| {seed}: not counted, {str(error)[:80]} | | | | |", flush=True)
            continue
        cells = " | ".join(f"{error:.3g}" for error in found[-1])
        print(f"| {seed}, {KINDS[seed % len(KINDS)]} | {cells} |", flush=True)
    if not found:
        return 1
    print(f"The prior is of {given.craft} craft.\n")
    ratios = np.array(found)[:, 1:] / np.array(found)[:, :1]
    print(
        f"| median of {len(found)}, in the nominal error | 1 | {' | '.join(f'{r:.2f}' for r in np.median(ratios, 0))} |"
    )
    equal = float(np.mean(ratios[:, 1] <= ratios[:, 2]))
    print(f"\nA minute with the prior errs no more than ten minutes without on {equal:.0%} of {len(found)} boats.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
