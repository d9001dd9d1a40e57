"""What a corrected model is worth to a controller: random boats steered along tracks, model by model, in equal noise.

Each boat is a random sister of a BlueBoat or an Otter. Three effects of typical size are hidden from its nominal model
where the perfect one tracks at least two fifths better than the nominal one; or nothing is. All other models are made
from one log of five minutes of the true boat. Results are kept boat by boat in a folder, so that a study that was
stopped goes on where it was; boats of other sources are steered anew. Prints every figure beside what is asked of it,
and exits 1 where something is broken.

    python benchmarks/control.py [--boats 20] [--first 0] [--networks lstm --networks tcn] [--table PAGE] [--tell]
"""

import argparse
import json
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from measured import Figures
from scipy import stats
from study.records import fingerprint
from study.steered import PERFECT, STEERED, mean_error, models, passages, world

from undertow.physics.errors import RequestError
from undertow.physics.files import write_json, write_text
from undertow.physics.vehicle import Vehicle
from undertow.residuals.networks.registry import NETWORKS

ROOT = Path(__file__).resolve().parents[1]
KINDS = {"hidden": "hidden effects that are worth it", "nothing": "nothing hidden"}
OTHER_SEED = 500
"""By how much the seed of the nominal model's second passage differs: how far the two are apart is noise."""
PACKAGES = ("physics", "measurements", "residuals", "discovery", "exports/formats", "exports/program", "steering")
"""Packages whose source decides the results."""
FORMULAS = ("nominal", "calibrated", "corrected")
Rows = list[dict[str, Any]]


def steer(kind: str, seed: int, networks: Sequence[str], target: Path, source: str) -> None:
    """Run what is not yet kept of a world, or all of it where another source made it."""
    kept: dict[str, Any] = json.loads(target.read_text("utf-8")) if target.is_file() else {}
    if kept.get("source") != source:
        kept = {"source": source, "rows": [], "told": {}}
    names = [*FORMULAS, *(f"hybrid {name}" for name in networks), PERFECT]
    if set(names) <= {row["model"] for row in kept["rows"]}:
        return
    case = world(kind, seed, kept.get("drawn", 0))
    kept |= {"boat": case.nominal.name, "hidden": {k: dict(v) for k, v in case.hidden.items()}, "drawn": case.drawn}
    done = {row["model"] for row in kept["rows"]}
    for model, told in models(case, seed, networks, done):
        if model.name != "nominal" and model.kind != "hybrid" and same(model.vehicle, case.nominal):
            alike = [row for row in kept["rows"] if row["model"] == "nominal"]
            kept["rows"] += [{**row, "model": model.name, "copied": True} for row in alike]
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


def interval(logs: np.ndarray) -> str:
    """Geometric mean of ratios, with its 95 % interval by Student's t on their logarithms; without, of one boat."""
    middle = float(logs.mean())
    if logs.size < 2:
        return f"{np.exp(middle):.2f}"
    half = float(stats.t.ppf(0.975, logs.size - 1) * logs.std(ddof=1) / np.sqrt(logs.size))
    return f"{np.exp(middle):.2f} ({np.exp(middle - half):.2f} to {np.exp(middle + half):.2f})"


def table(worlds: Sequence[Rows], controller: str) -> list[str]:
    """A line for each model."""
    lines = [
        "| model | boats | error [m] | nominal, same boats [m] | against nominal | against perfect | effort | off lane "
        "| at limit | step, median [ms] | slow step [ms] | unsolved | lost |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    beside = sorted({row["model"] for each in worlds for row in each if row["model"].startswith("hybrid ")})
    for model in (*FORMULAS, *beside, PERFECT):
        steered = [each for each in worlds if of(each, model, controller)]
        if not steered:
            continue
        rows, nominal = ([row for each in steered for row in of(each, m, controller)] for m in (model, "nominal"))
        copied = sum(any(row.get("copied") for row in of(each, model, controller)) for each in steered)
        boats = f"{len(steered)}, {copied} as nominal" if copied else str(len(steered))
        told = []
        for other in ("nominal", "perfect"):
            logs = ratios(worlds, model, other, controller)
            told.append("" if model == other or not logs.size else interval(logs))
        mean = {k: float(np.mean([row[k] for row in rows])) for k in ("effort", "off_lane", "at_limit")}
        step, slow = (float(np.median([row[k] for row in rows])) for k in ("step", "slow_step"))
        lines.append(
            f"| {model} | {boats} | {mean_error(rows):.3f} | {mean_error(nominal):.3f} | {told[0]} | {told[1]} "
            f"| {mean['effort']:.2f} | {mean['off_lane']:.0%} | {mean['at_limit']:.0%} | {step:.1f} | {slow:.1f} "
            f"| {sum(row['unsolved'] for row in rows)} | {sum(row['lost'] for row in rows)} |"
        )
    return lines


def page(kept: dict[str, list[dict[str, Any]]], given: argparse.Namespace) -> tuple[str, bool]:
    """The page, and whether something is broken."""
    figures, lines = Figures(), []
    for kind, content in kept.items():
        worlds = [each["rows"] for each in content]
        for controller in STEERED[kind]:
            lines += ["", f"## {controller}, {KINDS[kind]}, {len(worlds)} boats", "", *table(worlds, controller)]
            judge(figures, kind, controller, worlds, given.boats)
    asked = ["", "## What is asked", "", "| what | measured | asked | |", "| --- | --- | --- | --- |"]
    counted = ", ".join(f"{len(found)} of {given.boats} boats with {KINDS[kind]}" for kind, found in kept.items())
    head = [
        "# Closed loop: the figures",
        "",
        f"[control.md](control.md) says what they are. In it are {counted}. Errors are geometric means over tracks "
        "and boats. Intervals (95 %) are of the ratios boat by boat, by Student's t on their logarithms; one boat "
        "has none. *As nominal*: of so many boats the model is the nominal one to the last digit, so its figures are "
        "those of the nominal passages. Times are those of the processor.",
    ]
    made_by = Counter(each.get("source", "not kept") for found in kept.values() for each in found)
    if len(made_by) > 1:
        told = ", ".join(f"{number} by {source}" for source, number in made_by.items())
        head += ["", f"The boats were steered by different sources: {told}."]
    foot = ["", f"Written by `{command(given)}`; do not edit.", ""]
    return "\n".join([*head, *asked, *map(figures.line, figures.rows), *lines, *foot]), figures.broken


def command(given: argparse.Namespace) -> str:
    """The call that makes the page, without the folders."""
    words = [f"--boats {given.boats} --first {given.first}", *(f"--kind {kind}" for kind in given.kind or ())]
    words += [*(f"--networks {name}" for name in given.networks or ()), *["--tell"] * given.tell]
    return f"python benchmarks/control.py {' '.join(words)}"


def judge(figures: Figures, kind: str, controller: str, worlds: Sequence[Rows], boats: int) -> None:
    """What must hold, of a kind of worlds and a controller; with fewer boats than asked for, it holds so far."""
    against = {other: ratios(worlds, "corrected", other, controller) for other in ("nominal", "perfect")}
    if kind == "hidden" and against["nominal"].size:
        for other, limit in (("nominal", 0.7), ("perfect", 1.1)):
            logs = against[other]
            if not logs.size:
                continue
            what = f"{controller}: corrected against {other}, {logs.size} boats, {interval(logs)}"
            figures.tell(what, float(np.exp(logs.mean())), limit, "", whole=logs.size >= boats)
            figures.tell(f"{controller}: the same, worst boat", float(np.exp(logs.max())), None, "")
    elif against["nominal"].size:
        noise = np.abs(ratios(worlds, "nominal, other noise", "nominal", controller))
        limit = float(np.exp(np.quantile(noise, 0.95)))
        worst = float(np.exp(against["nominal"].max()))
        what = f"{controller}, nothing hidden: corrected against nominal, worst of {against['nominal'].size} boats"
        figures.tell(what, worst, limit, "", whole=against["nominal"].size >= boats)
    for model, limit in (("corrected", 20.0), ("hybrid lstm", 60.0)):
        steered = [of(rows, model, controller) for rows in worlds if of(rows, model, controller)]
        if controller == "nmpc" and kind == "hidden" and steered:
            step = float(np.median([row["step"] for rows in steered for row in rows]))
            what = f"nmpc: median step with {model}, {len(steered)} boats"
            figures.tell(what, step, limit, "ms", whole=len(steered) >= boats)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study, print its figures, and write the page that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--boats", type=int, default=20, help="of each kind")
    parser.add_argument("--first", type=int, default=0, help="seed of the first boat")
    parser.add_argument("--kind", choices=KINDS, action="append", help="may be repeated; default: both")
    parser.add_argument("--networks", choices=NETWORKS, action="append", help="may be repeated; default: none")
    parser.add_argument("--tell", action="store_true", help="run nothing, only tell what is kept")
    parser.add_argument("--folder", type=Path, default=ROOT / "runs" / "control", help="where results are kept")
    parser.add_argument("--table", type=Path, help="page to write")
    given = parser.parse_args(arguments)
    kinds = given.kind or list(KINDS)
    seeds = range(given.first, given.first + given.boats)
    places = [(kind, seed, given.folder / f"{kind}-{seed}.json") for seed in seeds for kind in kinds]
    source = fingerprint(PACKAGES)
    for kind, seed, target in [] if given.tell else places:
        try:
            steer(kind, seed, given.networks or (), target, source)
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
