"""A search of the training recipe, on tuning worlds alone: what one setting moved makes of the error in rollouts.

The worlds are those of `unnamed.py`, a random hull each that lacks one cause without a name, with seeds from 100 on,
which no study reports. In each a network is trained with the recipe as it is, and with one setting of it moved at a
time; what makes the error of position over 10 s on another log less is what a recipe should have. Corrections
count whole, so that no probe takes part in it, and nothing declines. The judge is a log without
noise that no training saw; change is the geometric mean of the ratio to the recipe as it is, world by world, with its
95 % interval by Student's t.

With so many settings one of twenty lies outside its interval by chance: what looks better here is asked again, on other
seeds (`--first 200 --only NAME`), before it becomes the recipe. Results are kept in a folder, so that a search which
was stopped goes on where it was.

    python benchmarks/recipe.py [--network lstm] [--seeds 1] [--first 100] [--only NAME]... [--jobs 2] [--tell]
"""

import argparse
import hashlib
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from functools import partial
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats
from study.records import ROOT, Kept, in_a_table, opened, resumed
from unnamed import CAUSES, NOTHING, boats, position, read

from undertow.residuals.models.base import VehicleModel
from undertow.residuals.networks.registry import NETWORKS, default_options
from undertow.residuals.training.epochs import train
from undertow.residuals.training.training_settings import Choice, TrainingSettings

PACKAGES = ("physics", "measurements", "residuals")
WORLDS = tuple(cause for cause in CAUSES if cause != NOTHING)
TUNING = 100
"""Least seed of a tuning world."""
AS_IS = "as it is"
MOVED: dict[str, Sequence[float]] = {
    "learning_rate": (3e-3, 3e-2),
    "batch": (8, 32),
    "window": (5.0, 20.0),
    "overlap": (0.5,),
    "epochs": (75, 300),
    "averaging": (0.0, 0.95, 0.997),
    "weight_decay": (0.0, 1e-2),
    "clip": (0.3, 10.0),
    "huber": (2.0,),
    "lambda_phys": (0.0,),
    "lambda_smooth": (0.0, 0.1),
    "sensor_noise": (0.0, 2.0),
    "rollout_rows": (10, 30),
    "units": (0.5, 2.0),
    "layers": (2.0,),
}
"""Values of each setting beside that of the recipe; of the network's options as multiples of what they are."""


def variants(network: str, only: Sequence[str]) -> dict[str, tuple[dict[str, Any], dict[str, Any]]]:
    """Settings and options that differ from the recipe, by a name; the recipe itself first."""
    known, options = {f.name for f in fields(TrainingSettings)}, default_options(network)
    found: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {AS_IS: ({}, {})}
    for name, values in MOVED.items():
        if only and name not in only:
            continue
        for value in values:
            if name in known:
                settings: dict[str, Any] = {name: value}
                if name == "epochs":
                    settings["patience"] = value
                found[f"{name} {value:g}"] = settings, {}
            elif name in options:
                moved = type(options[name])(options[name] * value)
                found[f"{name} {moved:g}"] = {}, {name: moved}
    return found


def judge(network: str, first: int, only: Sequence[str], n: int) -> dict[str, Any]:
    """A record of the n-th training; those of a world come one after the other."""
    made = variants(network, only)
    world, which = divmod(n, len(made))
    seed, cause = first + world // len(WORLDS), WORLDS[world % len(WORLDS)]
    variant = list(made)[which]
    settings, options = made[variant]
    hull, log = boats(cause, seed)
    split = read(log("rich", 1000 + seed), "field", hull).parts.split
    clean = read(log("rich", 2000 + seed), "clean", hull, "all")
    alone = position(VehicleModel(hull, "alone"), clean)
    begun = time.perf_counter()
    recipe = replace(TrainingSettings(seed=seed, trust=False), **settings)
    done = train(split, hull, Choice(network, options=options), settings=recipe)
    seconds = time.perf_counter() - begun
    error = position(done.model, clean)
    return {
        "number": n,
        "cause": cause,
        "seed": seed,
        "variant": variant,
        "error": error,
        "change": error / alone - 1.0,
        "seconds": seconds,
    }


def page(records: Kept, network: str) -> str:
    """The table of a search, the best variant first."""
    by_world: dict[tuple[str, int], dict[str, Mapping[str, Any]]] = {}
    for record in records:
        by_world.setdefault((record["cause"], record["seed"]), {})[record["variant"]] = record
    whole = [found for found in by_world.values() if AS_IS in found]
    rows: list[tuple[float, list[str]]] = []
    for variant in dict.fromkeys(r["variant"] for r in records):
        both = [(found[variant], found[AS_IS]) for found in whole if variant in found]
        if not both:
            continue
        logs = np.array([np.log(mine["error"] / theirs["error"]) for mine, theirs in both])
        middle = float(logs.mean())
        span = ""
        if len(logs) > 1:
            half = float(stats.t.ppf(0.975, len(logs) - 1) * logs.std(ddof=1) / np.sqrt(len(logs)))
            span = f"{100 * np.expm1(middle - half):+.0f} to {100 * np.expm1(middle + half):+.0f}"
        alone = np.mean([mine["change"] for mine, _ in both])
        longer = float(np.mean([mine["seconds"] / theirs["seconds"] for mine, theirs in both]))
        cells = [variant, f"{100 * np.expm1(middle):+.0f} %", span, f"{int((logs < 0).sum())} of {len(logs)}"]
        rows.append((middle, [*cells, f"{100 * alone:+.0f} %", f"{longer:.2f}"]))
    head = [network, "10 s position against the recipe", "95 %", "better in", "against the hull alone", "time"]
    return in_a_table(head, [cells for _, cells in sorted(rows, key=lambda row: row[0])])


def main(arguments: Sequence[str] | None = None) -> int:
    """Carry the search out and print its table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--network", choices=[n for n, c in NETWORKS.items() if c.grown is None], default="lstm")
    parser.add_argument("--seeds", type=int, default=1, help="hulls for each cause")
    parser.add_argument("--first", type=int, default=TUNING, help=f"first seed, {TUNING} or more")
    parser.add_argument("--only", choices=MOVED, action="append", help="settings that are moved; may be repeated")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--tell", action="store_true", help="run nothing, only tell what is kept")
    parser.add_argument("--folder", type=Path, default=ROOT / "runs" / "recipe", help="where results are kept")
    given = parser.parse_args(arguments)
    if given.first < TUNING:
        parser.error(f"expected tuning seeds, {TUNING} or more, got {given.first}: those below are for reporting")
    only = given.only or []
    asked_for = variants(given.network, only)
    digest = hashlib.sha256(repr(asked_for).encode()).hexdigest()[:8]
    file = opened(given.folder / f"{given.network}-{given.first}-{digest}.jsonl.gz", PACKAGES)
    count = given.seeds * len(WORLDS) * len(asked_for)
    records = [record for record in file.records if record["number"] < count]
    if not given.tell:
        asked = partial(judge, given.network, given.first, only)
        for records in resumed(file, range(count), asked, given.jobs, itemgetter("number")):
            if records:
                last = records[-1]
                told = f"{last['cause']} {last['seed']}, {last['variant']}: {last['error']:.3f} m"
                print(f"{len(records)}/{count}: {told}, {last['seconds']:.0f} s", file=sys.stderr, flush=True)
    print(page(records, given.network))
    return 0


if __name__ == "__main__":
    sys.exit(main())
