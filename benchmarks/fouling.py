"""How fast, and how honestly, `adapt` follows a drag that grows half-way through a log.

    python benchmarks/fouling.py [--worlds N]

Each world is a random sister of a shipped vehicle that drives the rich programme for five minutes under field noise. At
half-time its surge drag grows by a third up to more than double. The nominal model is the hull before that, exactly, or
with every other damping and added mass wrong by up to a tenth; `adapt` follows the quadratic drag alone, or the scale
of thrust beside it. Seconds are those of excitation from the change until the value is within a tenth of the new one
and stays there for 5 s of excitation. A value is covered when the truth is within two of its deviations.
"""

import argparse

import numpy as np

import undertow
from undertow.discovery.candidates.candidate import calibratable
from undertow.physics.worlds.hidden_effects import random_hull
from undertow.physics.worlds.world import NOISE, World

DURATION, HALF = 300.0, 150.0
SETTLED, WARM = 30.0, 20.0
"""Seconds of excitation after the change, and at the start, that count as transition for the second coverage."""
STAYS = 5.0
CASES = (
    ("drag alone, exact model", ("surge_quadratic_damping",), 0.0),
    ("drag alone, other parameters 10 % off", ("surge_quadratic_damping",), 0.1),
    ("drag and thrust scale, exact model", ("surge_quadratic_damping", "thrust_scale"), 0.0),
    ("drag and thrust scale, other parameters 10 % off", ("surge_quadratic_damping", "thrust_scale"), 0.1),
)


def judged(seed: int, effects: tuple[str, ...], wrong: float) -> tuple[float, float, float, float]:
    """Seconds of excitation to the new value (infinite for never), coverage of all and of settled rows, last error."""
    rng = np.random.default_rng([seed, 1])
    hull = random_hull(undertow.load_vehicle(("blueboat", "otter")[seed % 2]), rng)
    drag = hull.value("X_uu") + hull.value("X_u") / 1.5
    new = hull.value("X_uu") + rng.uniform(0.33, 1.2) * drag
    fouled = hull.with_values({"X_uu": new})
    motion = World(hull, "rich", DURATION, seed, becomes=fouled, changes_at=HALF).run(NOISE["field"]).motion()
    others = [s for s in calibratable(hull) if s != "X_uu"]
    nominal = hull.with_values({s: hull.value(s) * (1.0 + wrong * rng.uniform(-1.0, 1.0)) for s in others})
    found = undertow.adapt(motion, nominal, effects)
    at = found.symbols.index("X_uu")
    value, deviation = found.values[:, at], found.deviation[:, at]
    true = np.where(found.time - found.delay < HALF, hull.value("X_uu"), new)
    covered = np.abs(value - true) <= 2.0 * deviation
    since = found.excitation - found.excitation[np.searchsorted(found.time, HALF)]
    settled = (found.excitation > WARM) & ((since < 0.0) | (since > SETTLED))
    after = np.flatnonzero(found.time >= HALF)
    near = np.abs(value - new) <= 0.1 * abs(new)
    arrived = (k for k in after if near[(since >= since[k]) & (since <= since[k] + STAYS) & (found.time >= HALF)].all())
    first = next(arrived, None)
    seconds = np.inf if first is None else float(since[first])
    return seconds, float(covered.mean()), float(covered[settled].mean()), float(abs(value[-1] / new - 1.0))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--worlds", type=int, default=20)
    worlds = parser.parse_args().worlds
    print("| followed | median [s] | largest [s] | within 30 s | covered | covered, settled | last error |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name, effects, wrong in CASES:
        rows = np.array([judged(seed, effects, wrong) for seed in range(worlds)])
        seconds, every, settled, last = rows.T
        print(
            f"| {name} | {np.median(seconds):.1f} | {seconds.max():.1f} | {(seconds <= 30.0).sum()} of {worlds} | "
            f"{every.mean():.0%} | {settled.mean():.0%} | {np.median(last):.1%} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
