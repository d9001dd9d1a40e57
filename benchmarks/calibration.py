"""How well `fit` recovers the parameters of random hulls from a wrong start, step by step: errors and coverage.

    python benchmarks/calibration.py [--worlds 6] [--duration 300] [--horizons]

Every hull is a random sister of a shipped vehicle; the start has each damping and added mass wrong by up to a third.
A row gives, over all parameters and worlds: the median and 90th percentile of |error| / |true value|, the share of 95 %
intervals that hold the truth, and the root mean square error of 10 s rollouts on another, noise-free log of the same
hull. "as it is" leaves sensor noise in the normal equations; "fit" is what the verb writes. With `--horizons` it tells,
for logs of 45 s and more, what rollouts of 10 s leave of the error of rollouts of 5 s on that other log.
"""

import argparse
from dataclasses import replace

import numpy as np

from undertow.discovery.balance.shooting import rollout_squares
from undertow.discovery.balance.weak_form import WeakForm
from undertow.discovery.basis import DiscoverySettings
from undertow.discovery.calibration.before_calibration import ROLLOUTS
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
    options = parser.parse_args()
    horizons(options.worlds) if options.horizons else steps(options.worlds, options.duration)


if __name__ == "__main__":
    main()
