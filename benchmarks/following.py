"""How quick, how honest and how watchful `undertow adapt` is while a log grows.

    python benchmarks/following.py [--worlds N] [--minutes M] [--seeds tuning|reporting] [--network KIND]

Each world is a random sister of a shipped vehicle that drives the rich programme under field noise. The nominal model
is the hull, exactly, or with every damping and added mass wrong by up to a tenth; what is followed is the default,
damping and the scale of each thruster, after a run-in of a minute.

- *Speed*: rows come one by one, as from a boat; every fifth of a second they end in an update. Counted is the time of
  the processor for all of it, from the text of the rows on; with the default, and with the couplings that ask for the
  conic programme.
- *Nothing happens*: hours without a change; an alarm in them is false. One in 24 h is allowed, which takes longer to
  show than anyone waits: so what the fit leaves of the rows after the run-in is put on anew, for a hundred hours a
  world, as a rehearsal does with those of the run-in.
- *Changes*: from four minutes on, a thruster gives 30 % less, or the drag ahead grows by half, or by 15 %. Late is the
  time from the change to the alarm, right an alarm that names the parameter, or one that the rows cannot tell from it.
- *A network*, with --network alone: one is trained on 5 min of a hull with two couplings and twice the quadratic drag
  that the file has; at three minutes of another log a coupling doubles, and in half of the logs the other falls to
  0.4 of it. Thrusters and the last layer are followed: its gains, and so many directions beside. Error is the largest
  over the axes of the force that is left from a minute after the change on, over the noise of a row.

Seeds of tuning and of reporting are apart; constants were chosen with the first.
"""

import argparse
import time
from functools import partial
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import undertow
from undertow.discovery.calibration.change_watch import AlarmSettings, SurrogateRuns
from undertow.discovery.calibration.following import (
    Follower,
    Update,
    candidates_to_follow,
    followed_by_default,
    informing_rows,
    learn_prior,
    rehearsed_watch,
)
from undertow.discovery.calibration.forgetting_fit import AdaptSettings
from undertow.discovery.candidates.candidate import calibratable
from undertow.physics.motion import Motion
from undertow.physics.stage import collect_and_freeze, collect_seldom
from undertow.physics.vehicle import Vehicle
from undertow.physics.worlds.hidden_effects import random_hull
from undertow.physics.worlds.world import NOISE, World

FIRST = {"tuning": 0, "reporting": 5000}
RUN_IN, CHANGES, WATCHED = 60.0, 240.0, 120.0  # [s]
COUPLED = ("sway_yaw_coupling", "munk_moment", "sway_lift", "surge_turn_drag")
LIMIT = 20.0  # [ms]
RUNS = 300
Rehearsed = tuple[int, float]


def hull_of(seed: int, wrong: float) -> tuple[Vehicle, Vehicle]:
    """The true hull and the nominal model."""
    rng = np.random.default_rng([seed, 5])
    hull = random_hull(undertow.load_vehicle(("blueboat", "otter")[seed % 2]), rng)
    values = {s: hull.value(s) * (1.0 + wrong * rng.uniform(-1.0, 1.0)) for s in calibratable(hull)}
    return hull, hull.with_values(values)


def follower_of(
    motion: Motion, nominal: Vehicle, names: tuple[str, ...] = (), runs: int = 0
) -> tuple[Follower, int, Rehearsed]:
    """A follower after the run-in, the rows that this took, and false alarms and hours with noise of later rows."""
    pool = candidates_to_follow(nominal, (*followed_by_default(nominal), *names), [motion])
    rows = round(RUN_IN / motion.time_step)
    first, settings = motion.slice(0, rows), AdaptSettings()
    known = learn_prior([first], nominal, pool, settings)
    watch = rehearsed_watch([first], known, AlarmSettings())
    rehearsed = 0, 0.0
    if runs and watch is not None:
        later = informing_rows([motion.slice(rows, motion.time.size)], known)
        asked = AlarmSettings(seed=1)
        again = SurrogateRuns(*later, known, asked, runs)
        rehearsed = again.alarms(watch.widening), again.hours
    return Follower(known, watch), rows, rehearsed


def updates_of(motion: Motion, nominal: Vehicle, runs: int = 0) -> tuple[Follower, list[Update], Rehearsed]:
    """All updates of a motion, rows in pieces of ten minutes."""
    follower, rows, rehearsed = follower_of(motion, nominal, runs=runs)
    edges = [0, rows, *range(rows, motion.time.size, 12_000)[1:], motion.time.size]
    found = [u for a, b in pairwise(edges) if b - a > 1 for u in follower.take(motion.slice(a, b))]
    return follower, found, rehearsed


def speed(names: tuple[str, ...], start: int) -> tuple[float, float, float]:
    """Milliseconds of an update from the row's text on: median, 99th percentile, worst."""
    from undertow.measurements.growing_log import GrowingLog
    from undertow.measurements.log_options import Reading

    hull, nominal = hull_of(start, 0.1)
    simulated = World(hull, "rich", 180.0, start).run(NOISE["field"])
    motion = simulated.motion()
    follower, rows, _ = follower_of(motion, nominal, names)
    growing = GrowingLog("log", nominal, Reading(), AdaptSettings().weak.stride)
    channels = [t.channel for t in nominal.thrusters]
    table = np.column_stack([motion.time, motion.position, motion.heading, motion.velocity, motion.commands])
    lines = [",".join(f"{x:.9g}" for x in row) for row in table]
    growing.table.take([",".join(["t", "x", "y", "psi", "u", "v", "r", *channels]), *lines[:rows]])
    growing.begin()
    for part in growing.motions():
        follower.take(part)
    collect_and_freeze()  # as the verb does when it begins
    taken, spent = [], 0.0
    for line in lines[rows:]:
        before = time.process_time()
        growing.table.take([line])
        updates = [u for part in growing.motions() for u in follower.take(part)]
        spent += time.process_time() - before
        if updates:
            taken.append(1e3 * spent / len(updates))
            spent = 0.0
    return float(np.median(taken)), float(np.percentile(taken, 99)), float(np.max(taken))


def quiet(seed: int, wrong: float, minutes: float) -> tuple[float, ...]:
    """False alarms, hours under way, the share of intervals that hold the truth; alarms and hours of noise put anew."""
    hull, nominal = hull_of(seed, wrong)
    motion = World(hull, "rich", 60.0 * minutes, seed).run(NOISE["field"]).motion()
    follower, updates, rehearsed = updates_of(motion, nominal, RUNS)
    truth = np.array([hull.value(s) for s in follower.symbols])
    later = [u for u in updates if u.time > RUN_IN and u.excited]
    held = np.mean([np.abs(u.values - truth) <= 1.96 * u.deviation for u in later])
    return sum(u.alarm is not None for u in updates), 0.2 * len(later) / 3600.0, float(held), *rehearsed


def changed(seed: int, wrong: float, factors: dict[str, float]) -> tuple[float, bool]:
    """Seconds from a change to the alarm, infinite for none, and whether it names a parameter that changed."""
    hull, nominal = hull_of(seed, wrong)
    named = {s.replace("THRUSTER", hull.thrusters[0].name): f for s, f in factors.items()}
    becomes = hull.with_values({s: f * hull.value(s) for s, f in named.items()})
    world = World(hull, "rich", CHANGES + WATCHED, seed, becomes=becomes, changes_at=CHANGES)
    _, updates, _ = updates_of(world.run(NOISE["field"]).motion(), nominal)
    first = next((u.alarm for u in updates if u.alarm is not None and u.time > CHANGES), None)
    if first is None:
        return np.inf, False
    return first.time - CHANGES, bool({first.symbol, *first.alike} & set(named))


def by_network(seed: int, kind: str) -> list[tuple[str, float, float, str]]:
    """By what is followed and changes: force left as trained and as followed, over the noise, and the first alarm."""
    from undertow.residuals.models.last_layer import LastLayer
    from undertow.workflows.inputs import read_inputs
    from undertow.workflows.train import choice_of, train

    hull, _ = hull_of(seed, 0.0)
    mass = hull.value("mass")
    drag = {symbol: 2.0 * hull.value(symbol) for symbol in ("X_uu", "N_rr")}

    def coupled(first: float, second: float) -> Vehicle:
        return hull.with_values(drag | {"X_vr": 2.0 * first * mass, "N_uv": 0.5 * second * mass})

    with TemporaryDirectory() as folder:
        log = World(coupled(1.0, 1.0), "rich", 300.0, seed).run(NOISE["field"]).write(Path(folder) / "log.csv")
        model = train(read_inputs(log, hull, progress=None), choice_of(None, kind), progress=None).model
    found = []
    for change in ((2.0, 1.0), (2.0, 0.4)):
        world = World(coupled(1.0, 1.0), "rich", 360.0, seed + 100, becomes=coupled(*change), changes_at=180.0)
        motion = world.run(NOISE["field"]).motion()
        first = motion.slice(0, round(RUN_IN / motion.time_step))
        pool = candidates_to_follow(hull, ("thruster_asymmetry",), [motion])
        for count in LAYERS:
            carrying = None if count is None else partial(LastLayer, model, [first], directions=count)
            known = learn_prior([first], hull, pool, AdaptSettings(), carrying)
            updates = Follower(known, rehearsed_watch([first], known, AlarmSettings())).take(motion)
            late = [u for u in updates if u.time > 240.0]
            was, now = (np.sqrt(np.mean([getattr(u, e) ** 2 for u in late], axis=0)) for e in ("before", "error"))
            alarms = [u.alarm for u in updates if u.alarm is not None]
            told = f"{alarms[0].symbol} {alarms[0].time - 180.0:+.0f} s" if alarms else "none"
            found.append(
                (f"{change} {count}", float((was / known.noise).max()), float((now / known.noise).max()), told)
            )
    return found


LAYERS = (None, 0, 2, 4, 8)
"""Directions that are followed beside the gains; None: no layer at all."""
KINDS = {
    "a thruster 30 % weaker": {"THRUSTER_scale": 0.7},
    "drag ahead 50 % more": {"X_u": 1.5, "X_uu": 1.5},
    "drag ahead 15 % more": {"X_u": 1.15, "X_uu": 1.15},
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--worlds", type=int, default=20)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--seeds", choices=tuple(FIRST), default="tuning")
    parser.add_argument("--network", help="kind of network whose last layer is followed; nothing else is then run")
    asked = parser.parse_args()
    collect_seldom()  # as the command line does
    first = FIRST[asked.seeds]
    if asked.network:
        print(f"| {asked.network}: couplings become, directions | left as trained | as followed | first alarms |")
        print("| --- | --- | --- | --- |")
        every = [by_network(seed, asked.network) for seed in range(first, first + asked.worlds)]
        for rows in zip(*every, strict=True):
            was, now = (np.median([row[k] for row in rows]) for k in (1, 2))
            print(f"| {rows[0][0]} | {was:.1f} | {now:.1f} | {', '.join(row[3] for row in rows)} |", flush=True)
        return
    print(f"| an update, row by row (limit {LIMIT:g} ms) | median [ms] | 99 % [ms] | worst [ms] |")
    print("| --- | --- | --- | --- |")
    for name, more in (("damping and thrusters", ()), ("and couplings", COUPLED)):
        print(f"| {name} | " + " | ".join(f"{x:.1f}" for x in speed(more, first)) + " |", flush=True)
    print("\n| nothing happens | hours | false alarms | hours, noise put on anew | false alarms | truth in interval |")
    print("| --- | --- | --- | --- | --- | --- |")
    seeds = range(first, first + asked.worlds)
    for name, wrong in (("exact model", 0.0), ("all parameters up to 10 % off", 0.1)):
        rows = np.array([quiet(seed, wrong, asked.minutes) for seed in seeds])
        alarms, hours, _, again, rehearsed = rows.sum(axis=0)
        cells = f"{hours:.1f} | {alarms:.0f} | {rehearsed:.0f} | {again:.0f} | {rows[:, 2].mean():.1%}"
        print(f"| {name} | {cells} |", flush=True)
    print("\n| change | model | found in 2 min | median late [s] | latest [s] | right parameter |")
    print("| --- | --- | --- | --- | --- | --- |")
    for kind, factors in KINDS.items():
        for name, wrong in (("exact", 0.0), ("10 % off", 0.1)):
            found = [changed(seed, wrong, factors) for seed in seeds]
            late = np.array([seconds for seconds, _ in found])
            right = sum(ok for _, ok in found)
            worst = "never" if np.isinf(late).any() else f"{late.max():.1f}"
            cells = (f"{np.isfinite(late).sum()} of {late.size}", f"{np.median(late):.1f}", worst, f"{right}")
            print(f"| {kind} | {name} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
