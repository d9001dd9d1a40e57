"""What a corrected model is worth to a controller: random boats steered along tracks, model by model, in equal noise.

Each boat is a random sister of a BlueBoat or an Otter. Three effects of typical size are hidden from its nominal model
where the perfect one tracks at least two fifths better than the nominal one; or nothing is. All other models are made
from one log of five minutes of the true boat. Results are kept boat by boat in a folder, so that a study that was
stopped goes on where it was. Prints every figure beside what is asked of it, and exits 1 where something is broken.

    python benchmarks/control.py [--boats 20] [--first 0] [--networks lstm --networks tcn] [--table PAGE] [--tell]
"""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from measured import Figures
from study.steered import STEERED, mean_error, models, passages, world

from undertow.physics.errors import RequestError
from undertow.physics.files import write_json, write_text
from undertow.physics.vehicle import Vehicle

ROOT = Path(__file__).resolve().parents[1]
KINDS = {"hidden": "hidden effects that are worth it", "nothing": "nothing hidden"}
OTHER_SEED = 500
"""By how much the seed of the nominal model's second passage differs: how far the two are apart is noise."""
DRAWS = 10_000
"""Draws of boats from which an interval is read: its ends then move by less than is printed."""
ORDER = ("nominal", "calibrated", "corrected", "hybrid lstm", "hybrid tcn", "perfect")
Rows = list[dict[str, Any]]


def steer(kind: str, seed: int, networks: Sequence[str], target: Path) -> None:
    """Run what is not yet kept of a world."""
    kept: dict[str, Any] = json.loads(target.read_text("utf-8")) if target.is_file() else {"rows": [], "told": {}}
    names = [*ORDER[:3], *(f"hybrid {name}" for name in networks), ORDER[-1]]
    if set(names) <= {row["model"] for row in kept["rows"]}:
        return
    case = world(kind, seed, kept.get("drawn", 0))
    kept |= {"boat": case.nominal.name, "hidden": {k: dict(v) for k, v in case.hidden.items()}, "drawn": case.drawn}
    done = {row["model"] for row in kept["rows"]}
    for model, told in models(case, seed, networks, done):
        if model.name != "nominal" and model.kind != "hybrid" and same(model.vehicle, case.nominal):
            alike = [row for row in kept["rows"] if row["model"] == "nominal"]
            kept["rows"] += [{**row, "model": model.name} for row in alike]
            kept["told"][model.name] = {**told, "steers as": "nominal"}
            write_json(target, kept)
            continue
        for controller, tracks in STEERED[kind].items():
            kept["rows"] += passages(model, controller, case.true, case.nominal, seed, tracks)
            if model.name == "nominal" and kind == "nothing":
                again = passages(model, controller, case.true, case.nominal, seed + OTHER_SEED, tracks)
                kept["rows"] += [{**row, "model": "nominal, other noise"} for row in again]
        kept["told"][model.name] = told
        target.parent.mkdir(parents=True, exist_ok=True)
        write_json(target, kept)
        means = {c: mean_error(of(kept["rows"], model.name, c)) for c in STEERED[kind]}
        print(
            f"{kind} {seed}: {model.name}: " + ", ".join(f"{c} {m:.3f} m" for c, m in means.items()), told, flush=True
        )


def same(one: Vehicle, other: Vehicle) -> bool:
    """Whether two vehicles move alike, to the last digit."""
    return one.values == other.values and one.thrusters == other.thrusters


def of(rows: Rows, model: str, controller: str) -> Rows:
    """The rows of a model under a controller."""
    return [row for row in rows if row["model"] == model and row["controller"] == controller]


def ratios(worlds: Sequence[Rows], model: str, other: str, controller: str) -> np.ndarray:
    """Logarithms of the ratio of two models' mean errors, boat by boat; boats that have both."""
    pairs = [(of(rows, model, controller), of(rows, other, controller)) for rows in worlds]
    return np.array([np.log(mean_error(a) / mean_error(b)) for a, b in pairs if a and b])


def interval(logs: np.ndarray) -> tuple[float, float, float]:
    """Geometric mean of ratios, and its 95 % interval by drawing boats with replacement."""
    rng = np.random.default_rng(0)
    means = logs[rng.integers(0, logs.size, (DRAWS, logs.size))].mean(axis=1)
    low, high = np.quantile(means, (0.025, 0.975))
    return float(np.exp(logs.mean())), float(np.exp(low)), float(np.exp(high))


def table(worlds: Sequence[Rows], controller: str) -> list[str]:
    """A line for each model."""
    lines = [
        "| model | boats | error [m] | against nominal | against perfect | effort | off lane | at limit "
        "| step, median [ms] | slow step [ms] | unsolved | lost |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for model in ORDER:
        rows = [row for each in worlds for row in of(each, model, controller)]
        if not rows:
            continue
        boats = sum(bool(of(each, model, controller)) for each in worlds)
        told = []
        for other in ("nominal", "perfect"):
            logs = ratios(worlds, model, other, controller)
            told.append("" if model == other else "{:.2f} ({:.2f} to {:.2f})".format(*interval(logs)))
        mean = {k: float(np.mean([row[k] for row in rows])) for k in ("effort", "off_lane", "at_limit")}
        step, slow = (float(np.median([row[k] for row in rows])) for k in ("step", "slow_step"))
        lines.append(
            f"| {model} | {boats} | {mean_error(rows):.3f} | {told[0]} | {told[1]} | {mean['effort']:.2f} "
            f"| {mean['off_lane']:.0%} | {mean['at_limit']:.0%} | {step:.1f} | {slow:.1f} "
            f"| {sum(row['unsolved'] for row in rows)} | {sum(row['lost'] for row in rows)} |"
        )
    return lines


def page(kept: dict[str, list[dict[str, Any]]], given: argparse.Namespace) -> tuple[str, bool]:
    """The page, and whether something is broken."""
    figures, lines = Figures(), []
    command = f"python benchmarks/control.py --boats {given.boats} --first {given.first} --networks lstm --networks tcn"
    for kind, content in kept.items():
        worlds = [each["rows"] for each in content]
        for controller in STEERED[kind]:
            lines += ["", f"## {controller}, {KINDS[kind]}, {len(worlds)} boats", "", *table(worlds, controller)]
            judge(figures, kind, controller, worlds)
    asked = ["", "## What is asked", "", "| what | measured | asked | |", "| --- | --- | --- | --- |"]
    counted = ", ".join(f"{len(found)} of {given.boats} boats with {KINDS[kind]}" for kind, found in kept.items())
    head = [
        "# Closed loop: the figures",
        "",
        f"Written by `{command}`; [control.md](control.md) says what they are. In it are {counted}; the study goes on "
        "where it was stopped. Errors are geometric means over tracks and boats, intervals (95 %) are of paired "
        "ratios, by drawing boats with replacement. Times are those of the processor.",
    ]
    return "\n".join([*head, *asked, *map(figures.line, figures.rows), *lines, ""]), figures.broken


def judge(figures: Figures, kind: str, controller: str, worlds: Sequence[Rows]) -> None:
    """What must hold, of a kind of worlds and a controller."""
    against = {other: ratios(worlds, "corrected", other, controller) for other in ("nominal", "perfect")}
    if kind == "hidden" and against["nominal"].size:
        for other, limit in (("nominal", 0.7), ("perfect", 1.1)):
            middle, low, high = interval(against[other])
            figures.tell(f"{controller}: corrected against {other}, {low:.2f} to {high:.2f}", middle, limit, "")
            worst = float(np.exp(against[other].max()))
            figures.tell(f"{controller}: the same, worst of {against[other].size} boats", worst, None, "")
    elif against["nominal"].size:
        noise = np.abs(ratios(worlds, "nominal, other noise", "nominal", controller))
        limit = float(np.exp(np.quantile(noise, 0.95)))
        worst = float(np.exp(against["nominal"].max()))
        figures.tell(f"{controller}, nothing hidden: corrected against nominal, worst boat", worst, limit, "")
    for model, limit in (("corrected", 20.0), ("hybrid lstm", 60.0)):
        steps = [row["step"] for rows in worlds for row in of(rows, model, controller)]
        if controller == "nmpc" and kind == "hidden" and steps:
            figures.tell(f"nmpc: median step with {model}", float(np.median(steps)), limit, "ms")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study, print its figures, and write the page that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--boats", type=int, default=20, help="of each kind")
    parser.add_argument("--first", type=int, default=0, help="seed of the first boat")
    parser.add_argument("--kind", choices=KINDS, action="append", help="may be repeated; default: both")
    parser.add_argument("--networks", choices=("lstm", "tcn"), action="append", help="may be repeated; default: none")
    parser.add_argument("--tell", action="store_true", help="run nothing, only tell what is kept")
    parser.add_argument("--folder", type=Path, default=ROOT / "runs" / "control", help="where results are kept")
    parser.add_argument("--table", type=Path, help="page to write")
    given = parser.parse_args(arguments)
    kinds = given.kind or list(KINDS)
    seeds = range(given.first, given.first + given.boats)
    places = [(kind, seed, given.folder / f"{kind}-{seed}.json") for seed in seeds for kind in kinds]
    for kind, seed, target in [] if given.tell else places:
        try:
            steer(kind, seed, given.networks or (), target)
        except RequestError as error:
            print(f"{kind} {seed}: {error}", flush=True)
    kept: dict[str, list[dict[str, Any]]] = {kind: [] for kind in kinds}
    for kind, _, target in places:
        if target.is_file():
            found = json.loads(target.read_text("utf-8"))
            rows = [row for row in found["rows"] if row["track"] in STEERED[kind][row["controller"]]]
            kept[kind].append({**found, "rows": rows})
    text, broken = page({kind: found for kind, found in kept.items() if found}, given)
    if given.table is not None:
        write_text(given.table, text)
    print(text)
    return int(broken)


if __name__ == "__main__":
    sys.exit(main())
