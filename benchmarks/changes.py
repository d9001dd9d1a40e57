"""Boats that change while a log is recorded: whether the effect, the instant and the size are told, and what it costs.

Each log has a random hull of undertow's own simulator of which one effect gets a material size at an instant between
0.3 and 0.7 of 240 s, with field noise; in every other log another effect is hidden from the first row on. Files in,
verb out; the same with `find_change` taken away is what a user would get without it. Then logs of the other studies, in
which no boat changes at an instant, are asked for a change.

    python benchmarks/changes.py [--logs 24] [--still 150] [--seeds tuning|reporting] [--without]
"""

import argparse
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

import numpy as np
from study.studies import STUDIES

from undertow.discovery.basis import DiscoverySettings, choose_balance
from undertow.discovery.changed_boat import find_change
from undertow.physics.errors import LogError, RequestError
from undertow.physics.presentation import number
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.hidden_effects import apply_effects, random_hull, typical_effect
from undertow.physics.worlds.world import NOISE, SimulatedLog, World
from undertow.workflows import discover_and_add
from undertow.workflows.inputs import read_inputs

FIRST = {"tuning": 5_000, "reporting": 7_000}
CHANGING = (
    *("thruster_asymmetry", "surge_quadratic_damping", "lateral_cg", "yaw_quadratic_damping", "mass_offset"),
    *("surge_trim", "thrust_scale", "mean_wind", "sway_linear_damping", "yaw_trim", "steady_current", "thruster_arm"),
)
"""What a blow, weed, a payload or the weather changes at once, in turn."""
BESIDE = ("munk_moment", "surge_linear_damping", "thrust_exponent", "yaw_linear_damping", "sway_yaw_coupling")
PROGRAMMES, BOATS, SECONDS = ("rich", "zigzag", "gentle"), ("blueboat", "otter"), 240.0
CHANGES = (
    *("payload that shifts", "weakens", "wind that rises", "gusts", "cargo", "changes half way", "sets in", "fouling"),
    *("battery", "hit", "caught", "wander", "turns", "waves", "wake behind"),
)
"""Parts of the names of kinds in which something does change with the time."""
OTHERS = ("plain", "nothing", "nameless", "foreign", "others", "sensors", "turning")


@dataclass(frozen=True, slots=True)
class Changing:
    """A log and what is true of it: the effect, the instant [min], how much each number changes, and what is beside."""

    nominal: Vehicle
    log: SimulatedLog
    effect: str
    minute: float
    sizes: dict[str, float]
    beside: str


def drawn(seed: int) -> Changing:
    """A boat that changes."""
    rng = np.random.default_rng([seed, 11])
    effect, beside = CHANGING[seed % len(CHANGING)], BESIDE[seed % len(BESIDE)] if seed % 2 else ""
    while True:
        nominal = random_hull(load_vehicle(BOATS[seed % len(BOATS)]), rng)
        at = float(rng.uniform(0.3, 0.7)) * SECONDS
        try:
            first = apply_effects(nominal, typical_effect(beside, nominal, rng)) if beside else nominal
            sizes = typical_effect(effect, first, rng, floor=0.1)
            second = apply_effects(first, sizes)
            world = World(first, PROGRAMMES[seed % 3], SECONDS, seed, becomes=second, changes_at=at)
            log = world.run(NOISE["field"])
        except RequestError:
            continue
        changes = {symbol: second.value(symbol) - first.value(symbol) for symbol in sizes}
        return Changing(nominal, log, effect, at / 60.0, changes, beside)


def asked(case: Changing, folder: Path, *, without: bool) -> tuple[str, dict[str, float]]:
    """A line on what the verb says, and what is counted."""
    inputs = read_inputs(case.log.write(folder / "log.csv"), case.nominal, progress=None)
    look = patch.object(discover_and_add, "find_change", lambda *_: None) if without else nullcontext()
    with look:
        found = discover_and_add.discover(inputs, progress=None).findings
    change = found.change
    names = [] if change is None else [key.partition("[")[0] for key in (change.effect, *change.alike)]
    said = {name.partition("[")[0] for name in (*found.missing, *found.likely)}
    counted = {
        "told": float(bool(names)),
        "the effect is right": float(names[:1] == [case.effect]),
        "or a look-alike that is told": float(case.effect in names),
        "verdict missing": float(found.verdict == "missing"),
        "a false name": float(bool(said - {case.effect, case.beside})),
    }
    position = [step.rollout("10").position for step in found.steps]
    counted["share of the 10 s position error that is left"] = position[-1] / position[0] if position else 1.0
    if change is not None:
        counted["instant off [s]"] = 60.0 * abs((change.minute or 0.0) - case.minute)
    known = [(t, case.sizes[t.symbol]) for t in (change.terms if change else ()) if t.symbol in case.sizes]
    if known:
        counted["size off, share"] = max(abs(term.value / size - 1.0) for term, size in known)
        held = [term.ci95 is not None and term.ci95.lower <= size <= term.ci95.upper for term, size in known]
        counted["intervals that hold the size"] = float(np.mean(held))
    sizes = ", ".join(f"{symbol} {number(size, 3)}" for symbol, size in case.sizes.items())
    truth = f"{case.effect} ({sizes}) at {case.minute:.2f}{f', {case.beside}' * bool(case.beside)}"
    told = "nothing" if change is None else f"{change.effect} at {change.minute} {[t.in_words for t in change.terms]}"
    return f"{truth}: {told} | {found.headline}", counted


def still(logs: int, seeds: str) -> Iterator[tuple[str, str]]:
    """Logs of the other studies in which no boat changes, and the change that is told of each; nothing is right."""
    keys = [(study, key) for study in OTHERS for key in STUDIES[study].keys(seeds)]
    keys = [(study, key) for study, key in keys if not any(part in key[0] for part in CHANGES)]
    for place in np.linspace(0, len(keys) - 1, min(logs, len(keys))).round().astype(int):
        study, key = keys[place]
        logged = STUDIES[study].logged(*key)
        with tempfile.TemporaryDirectory() as folder:
            try:
                inputs = read_inputs(logged.write(Path(folder) / "log.csv"), logged.vehicle, progress=None).whole()
                basis = choose_balance(inputs.fitting, inputs.vehicle, DiscoverySettings())
                change = find_change(basis, lambda _: None)
            except (LogError, RequestError):
                continue
        yield f"{study} {key}", "" if change is None else change.in_words


def main(arguments: Sequence[str] | None = None) -> int:
    """Print what is told of each log, and the counts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--logs", type=int, default=24)
    parser.add_argument("--still", type=int, default=150)
    parser.add_argument("--seeds", choices=FIRST, default="tuning")
    parser.add_argument("--without", action="store_true", help="as if nothing looked for changes")
    given = parser.parse_args(arguments)
    counts: list[dict[str, float]] = []
    for seed in range(FIRST[given.seeds], FIRST[given.seeds] + given.logs):
        with tempfile.TemporaryDirectory() as folder:
            line, counted = asked(drawn(seed), Path(folder), without=given.without)
        counts.append(counted)
        print(f"{seed} {line}", flush=True)
    for what in dict.fromkeys(key for counted in counts for key in counted):
        values = [counted[what] for counted in counts if what in counted]
        mean, middle = (number(float(of(values)), 3) for of in (np.mean, np.median))
        print(f"{what}: mean {mean}, median {middle} of {len(values)}")
    told = [(name, words) for name, words in still(given.still, given.seeds)]
    for name, words in told:
        if words:
            print(f"{name}: {words}")
    print(f"a boat that does not change is said to in {sum(bool(words) for _, words in told)} of {len(told)} logs")
    return 0


if __name__ == "__main__":
    sys.exit(main())
