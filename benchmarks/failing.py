"""How often the worst failure is linked to the effect that was hidden, and how often a failure is told of noise.

Each world is four minutes of a shipped vehicle with one hidden effect of random size at field noise, or with nothing
hidden. `discover` finds what is missing, and the comparison says where the nominal model fails and what removes it. A
link is *wrong* when it names another effect than the hidden one for any place or stretch of time; a *look-alike* that
the findings themselves say could stand in the hidden effect's place is counted apart. A claim about lag, heading or
drift is *odd* when it is made of a model whose error has none: heading where no current, wind or heading-bound effect
is hidden, lag where no lag or delay is, drift anywhere.

    python benchmarks/failing.py [WORLDS] [EMPTY]
"""

import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from undertow.physics.effects import EFFECTS
from undertow.physics.errors import RequestError
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.hidden_effects import random_hull, typical_effect, with_hull
from undertow.physics.worlds.world import simulate_world
from undertow.workflows.discover_and_add import discover
from undertow.workflows.inputs import read_inputs
from undertow.workflows.run_folder.write import Run

OUTSIDE = {"steady_current", "mean_wind", "apparent_wind"}
LATE = {"thruster_lag", "input_delay"}
FIRST_SEED = 7000


def run(effect: str | None, seed: int, folder: Path) -> Run | None:
    """Discovery in one world; None where no size of the effect suits the hull."""
    rng = np.random.default_rng([seed, 11])
    hull = with_hull(random_hull(load_vehicle("blueboat"), rng), np.random.default_rng([seed, 12]))
    try:
        hidden = {} if effect is None else typical_effect(effect, hull, rng)
    except RequestError:
        return None
    path = simulate_world(hull, hidden, duration=240.0, seed=seed).write(folder / "world.csv")
    return discover(read_inputs([path], hull))


def judged(found: Run, effect: str | None) -> dict[str, Any]:
    """What the comparison says of one world, against what is hidden in it."""
    comparison, findings = found.comparison, found.findings
    alike = {effect} | {
        name for c in findings.candidates if c.effect == effect for name in (*c.indistinguishable_from, c.effect)
    }
    alike |= {c.effect for c in findings.candidates if effect in c.indistinguishable_from}
    nominal = comparison.structure[0]
    places = [place for place in comparison.failures if place.model == "nominal"]
    after = [place for place in comparison.failures if place.model != "nominal"]
    links = [[one.effect for one in place.removed_by] for place in (*places, *nominal.segments)]
    top = links[0] if places else []
    odd = [f"heading:{axis}" for axis, one in nominal.heading.items() if one.verdict == "depends on heading"]
    odd = [] if effect in OUTSIDE else odd
    if effect not in LATE:
        odd += [f"lag:{axis}" for axis, one in nominal.lag.items() if one.suspects]
    odd += [f"drift:{axis}" for axis, one in nominal.drift.items() if one.verdict in ("drifts", "grows", "shrinks")]
    named = {name for link in links for name in link}
    return {
        "effect": effect,
        "missing": findings.missing,
        "told": len(places),
        "where": f"{places[0].where} ({places[0].axis})" if places else "",
        "top": "true" if effect in top else "none" if not top else "look-alike" if set(top) <= alike else "wrong",
        "wrong": sorted(named - alike),
        "odd": odd,
        "after": len(after),
        "segments": len(nominal.segments),
        "heading": [nominal.heading[axis].verdict for axis in ("surge", "sway")],
        "lag": [nominal.lag[axis].seconds for axis in ("surge", "yaw")],
    }


def main(worlds: int, empty: int) -> None:
    names = [effect.name for effect in EFFECTS]
    began = time.perf_counter()
    records: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as scratch:
        for number in range(worlds + empty):
            effect = names[number % len(names)] if number < worlds else None
            found = run(effect, FIRST_SEED + number, Path(scratch))
            if found is None:
                print(f"{number:3d} {effect}: no size of it suits this hull")
                continue
            one = judged(found, effect)
            records.append(one)
            strange = "".join(f", {key} {', '.join(one[key])}" for key in ("wrong", "odd") if one[key])
            told = f"{one['told']} places, worst: {one['where'] or 'none'}, link {one['top']}{strange}"
            print(f"{number:3d} {effect or 'nothing hidden'}: {told}", flush=True)
    hidden = [one for one in records if one["effect"]]
    nothing = [one for one in records if not one["effect"]]
    seen = [one for one in hidden if one["told"]]
    found = [one for one in seen if one["effect"] in one["missing"]]
    links = Counter(one["top"] for one in seen)
    print(f"\n{len(hidden)} worlds with one hidden effect, {time.perf_counter() - began:.0f} s")
    print(
        f"  a failure of the nominal model is told in {len(seen)}; discovery names the effect in {len(found)} of these"
    )
    print(
        "  the worst failure is linked to the hidden effect in {true}, to a look-alike in {look-alike}, to a wrong one "
        "in {wrong}, to none in {none}".format_map({k: links[k] for k in ("true", "look-alike", "wrong", "none")})
    )
    print(f"  any place or stretch of time is linked to a wrong effect in {sum(bool(one['wrong']) for one in hidden)}")
    print(f"  the corrected model still has a failure in {sum(bool(one['after']) for one in hidden)}")
    print(f"  odd claims about lag, heading or drift in {sum(bool(one['odd']) for one in hidden)}")
    print(f"{len(nothing)} worlds with nothing hidden")
    print(
        f"  a failure is told in {sum(bool(one['told']) for one in nothing)}, a stretch of time in "
        f"{sum(bool(one['segments']) for one in nothing)}, an odd claim in {sum(bool(one['odd']) for one in nothing)}"
    )


if __name__ == "__main__":
    given = [int(text) for text in sys.argv[1:3]]
    main(*given, *(29, 20)[len(given) :])
