"""How well `fit` recovers the parameters of random hulls from a wrong start, step by step: errors and coverage.

    python benchmarks/calibration.py [--worlds 6] [--duration 300] [--horizons | --turning]

Every hull is a random sister of a shipped vehicle; the start has each damping and added mass wrong by up to a third.
A row gives, over all parameters and worlds: the median and 90th percentile of |error| / |true value|, the share of 95 %
intervals that hold the truth, and the root mean square error of 10 s rollouts on another, noise-free log of the same
hull. "as it is" leaves sensor noise in the normal equations; "fit" is what the verb writes. With `--horizons` it tells,
for logs of 45 s and more, what rollouts of 10 s leave of the error of rollouts of 5 s on that other log. With
`--turning` it steers hulls that turn by themselves, and tells by lengths of rollouts how near the truth their numbers
come, from a start that is the truth; the last length is the one that `fit` takes.
"""

import argparse
from dataclasses import replace

import numpy as np
from study.hidden_worlds import piloted
from study.worlds import GROWTH, NOISES, turning

from undertow.discovery.balance.shooting import rollout_squares
from undertow.discovery.balance.weak_form import WeakForm
from undertow.discovery.basis import DiscoverySettings
from undertow.discovery.calibration.before_calibration import ROLLOUTS, rollouts_over
from undertow.discovery.calibration.calibrate import Fitted, Steps, calibrate
from undertow.discovery.candidates.candidate import calibratable, nuisance_candidates
from undertow.discovery.search.estimation import block_bootstrap
from undertow.discovery.search.floating import Search
from undertow.physics.errors import RequestError
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.hidden_effects import random_hull
from undertow.physics.worlds.world import simulate_world

WORLDS = (
    ("blueboat", "field", "rich", 0.0),
    ("blueboat", "field", "gentle", 0.0),
    ("blueboat", "rough", "gentle", 0.0),
    ("blueboat", "field", "rich", 0.1),
    ("otter", "rough", "rich", 0.0),
)
"""Vehicle, noise, programme and significant amplitude of waves [m/s]."""
SETTINGS = DiscoverySettings()


def wrong_start(base: Vehicle, seed: int) -> tuple[Vehicle, Vehicle]:
    """A random hull, and the same with every calibratable parameter wrong by up to a third."""
    rng = np.random.default_rng(seed)
    true = random_hull(base, rng)
    factors = {s: true.value(s) * (1.0 + rng.uniform(-1 / 3, 1 / 3)) for s in calibratable(true)}
    return true, true.with_values(factors)


def as_it_is(motion: Motion, start: Vehicle) -> tuple[Vehicle, dict[str, tuple[float, float]]]:
    """Least squares on the weak form with sensor noise left in its normal equations."""
    pool = nuisance_candidates(start, calibratable(start))
    search = Search(WeakForm([motion], SETTINGS.weak), start, pool, SETTINGS.search)
    state = search.evaluate(start, ())
    linear, scores = search.linearise(state.vehicle, state.active, state.fit.in_sample)
    intervals = block_bootstrap(scores, [linear.options[key][0] for key in state.active], 0)
    return state.vehicle, {s: (i.lower, i.upper) for s, i in intervals.items()}


def ends(fitted: Fitted) -> tuple[Vehicle, dict[str, tuple[float, float]]]:
    return fitted.lawful.vehicle, {s: (i.lower, i.upper) for s, i in fitted.intervals.items()}


def horizons(worlds: int) -> None:
    """Error on another log by fits to rollouts of 10 s in that by fits to rollouts of 5 s, with its standard error."""
    for name, noise, programme, waves in WORLDS:
        for duration in (45.0, 60.0, 90.0, 120.0, 240.0):
            ratios = []
            for seed in range(200, 200 + worlds):
                true, start = wrong_start(load_vehicle(name), seed)
                log = simulate_world(
                    true, {}, programme=programme, duration=duration, noise=noise, waves=waves, seed=seed
                )
                held = simulate_world(true, {}, duration=120.0, noise="clean", seed=1000 + seed).motion(0.05)
                motion, pool = log.motion(0.05), nuisance_candidates(start, calibratable(start))
                weak = Steps(start, pool, SETTINGS).convex([motion]).lawful.vehicle
                both = [
                    Steps(start, pool, SETTINGS, replace(ROLLOUTS, horizon=horizon)).rollouts([motion], weak)
                    for horizon in (10.0, 5.0)
                ]
                long, brief = (rollout_squares([held], one.lawful.vehicle, 10.0).mean(axis=0) for one in both)
                ratios.append(0.5 * np.log(long / brief).mean())
            error = np.std(ratios, ddof=1) / np.sqrt(worlds)
            print(f"{name}, {noise}, {programme}, waves {waves:g} m/s, {duration:g} s: ", end="")
            print(f"{np.exp(np.mean(ratios)):.2f} (x/ {np.exp(error):.2f})", flush=True)


LENGTHS = (10.0, 5.0, 3.0, 2.0)
"""Lengths of the rollouts that are tried on hulls that turn by themselves [s]."""


def steered(worlds: int) -> None:
    """Errors of the numbers of hulls that an autopilot keeps on course, by the length of the rollouts."""
    print("hull, growth [1/s], then by rollouts of 10, 5, 3, 2 s and those of `fit`: length [s], median error")
    medians: dict[str, list[float]] = {}
    for seed in range(300, 300 + worlds):
        rng = np.random.default_rng(seed)
        name, growth = str(rng.choice(("blueboat", "otter"))), float(rng.uniform(*GROWTH))
        hull = turning(random_hull(load_vehicle(name), rng), growth)
        motion, row = piloted(hull, NOISES["field"], rng).motion(0.05), ""
        pool = nuisance_candidates(hull, calibratable(hull))
        weak = Steps(hull, pool, SETTINGS).convex([motion]).lawful.vehicle
        rule = rollouts_over([motion], hull, weak)
        tried = {f"{h:g} s": replace(rule, horizon=h, spacing=min(ROLLOUTS.spacing, 0.5 * h)) for h in LENGTHS}
        for label, layout in (tried | {"fit": rule}).items():
            found = Steps(hull, pool, SETTINGS, layout).rollouts([motion], weak).lawful.vehicle
            error = np.median([abs(found.value(s) / hull.value(s) - 1.0) for s in calibratable(hull)])
            medians.setdefault(label, []).append(float(error))
            row += f"  {layout.horizon:g} s {error:.0%}"
        print(f"{name}, {growth:.2f}: {row}", flush=True)
    told = (f"{label} {np.median(m):.0%}, at most {max(m):.0%}" for label, m in medians.items())
    print("all: " + "; ".join(told))


def steps(worlds: int, duration: float) -> None:
    """How near the truth each step comes."""
    print("world, method, median error, 90 % error, covered, 10 s rollouts [m/s, m/s, rad/s]")
    for name, noise, programme, waves in WORLDS:
        rows: dict[str, list[tuple[float, bool]]] = {}
        squares: dict[str, list[np.ndarray]] = {}
        for seed in range(worlds):
            true, start = wrong_start(load_vehicle(name), seed)
            log = simulate_world(true, {}, programme=programme, duration=duration, noise=noise, waves=waves, seed=seed)
            held = simulate_world(true, {}, duration=120.0, noise="clean", seed=1000 + seed).motion(0.05)
            motion = log.motion(0.05)
            pool = nuisance_candidates(start, calibratable(start))
            both = Steps(start, pool, SETTINGS)
            weak = both.convex([motion])
            found = {"weak form, as it is": as_it_is(motion, start), "weak form": ends(weak)}
            try:
                found["output error"] = ends(both.rollouts([motion], weak.lawful.vehicle))
            except RequestError as error:
                print(f"  seed {seed}: {error}")
            final = calibrate([motion], start)
            given = {p.symbol: (p.ci95.lower, p.ci95.upper) for p in final.parameters if p.ci95 is not None}
            found["fit"] = (final.vehicle, given)
            for method, (vehicle, intervals) in found.items():
                for symbol, (low, high) in intervals.items():
                    value, truth = vehicle.value(symbol), true.value(symbol)
                    rows.setdefault(method, []).append((abs(value - truth) / abs(truth), low <= truth <= high))
                squares.setdefault(method, []).append(rollout_squares([held], vehicle, 10.0).mean(axis=0))
        world = f"{name}, {noise}, {programme}{f', waves {waves:g} m/s' if waves else ''}"
        for method, pairs in rows.items():
            error, covered = np.array([p[0] for p in pairs]), np.mean([p[1] for p in pairs])
            root = np.sqrt(np.mean(squares[method], axis=0))
            print(
                f"{world:38} {method:20} {np.median(error):6.2%} {np.quantile(error, 0.9):7.2%} {covered:5.0%} "
                f"({len(pairs)})  {root[0]:.4f} {root[1]:.4f} {root[2]:.4f}",
                flush=True,
            )


def main() -> None:
    """Run one of the two studies."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--worlds", type=int, default=6)
    parser.add_argument("--duration", type=float, default=300.0)
    parser.add_argument("--horizons", action="store_true", help="compare lengths of rollouts by lengths of logs")
    parser.add_argument("--turning", action="store_true", help="the same on hulls that turn by themselves")
    options = parser.parse_args()
    if options.turning:
        steered(options.worlds)
    else:
        horizons(options.worlds) if options.horizons else steps(options.worlds, options.duration)


if __name__ == "__main__":
    main()
