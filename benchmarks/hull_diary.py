"""How honestly the hull diary pools boats, and how soon it finds what happens to them, under its false-alarm budget.

    python benchmarks/hull_diary.py [--seeds tuning|reporting] [--pooled N] [--years N] [--repeats N] [--named N]
        [--jobs N] [--table docs/performance.md]

Fleets are simulated at the level of what their logs say: a day has one to three logs of 5 to 30 minutes with the
covariance that such logs have, and a scatter beyond it that no covariance tells: load, battery, waves, boats noisier
and quieter, of normal law, with the tails of Student's t of 6 degrees, or remembered from day to day by three tenths.
Boats log on seven days of ten and lie in harbour for three weeks. The scatter is estimated, never given.

Pooled: fleets of 3 to 20 boats with 10 to 40 days; intervals of boats and of the fleet's mean against the truth.
False alarms: fleets of twenty boats to which nothing happens, a year each (of which harbours take a little).
Found: twenty boats over half a year, three foul and one loses a propeller blade (a fifth to two fifths of its thrust).
The blade is found when the alarm comes with the logs of the first logged day or within a day after. Weed begins with
nothing, so nobody knows it within a day of its first: it is found when the alarm comes no later than one logged day, or
a day, after that of an oracle. The oracle has the same detector and budget, knows the true covariance of every day, and
looks for nothing but a drag that grows; it does not know when it began, how fast it grows, how much of it is aside, or
what the drag was before. A sharper oracle that knows how much is aside is told beside it.
"""

import argparse
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from measured import Figures, measure_parts
from study.fleets import DAY, PARAMETERS, START, Scatter, happening, simulated

from undertow.fleet.boat_days import boat_days, day_scatter, levels, odd, pool
from undertow.fleet.causes import Ray, rays
from undertow.fleet.diary import fleet_changes
from undertow.fleet.hull_changes import YEAR, WatchSettings, alarms, watched
from undertow.reports.hull_diary import Cause

SEEDS = {"tuning": 0, "reporting": 1_000_000}
SCATTERS = {"normal": Scatter(), "t of 6 degrees": Scatter(tails=6.0), "remembered by 0.3": Scatter(memory=0.3)}
BOATS = 20
HALF_YEAR = 180
NAMED = ("fouling", "propeller damage", "payload", "battery", "cleaning", "another")


def pooled(seed: int) -> tuple[int, float, float, float, bool]:
    """Boats of a fleet, shares of its boats' and means' intervals that cover, mean ratio of widths, any boat odd."""
    rng = np.random.default_rng([seed, 1])
    boats = (3, 5, 8, 12, 20)[seed % 5]
    scatter = list(SCATTERS.values())[seed // 5 % 3]
    apart = float(rng.choice([0.3, 1.0]))
    fleet, own, _ = simulated(boats, int(rng.integers(10, 41)), rng, scatter=scatter, apart=apart)
    days = boat_days(fleet)
    if len(days) < boats:
        return boats, np.nan, np.nan, np.nan, False
    found, covariance = levels(days, day_scatter(days))
    each = [pool(found[:, k], np.sqrt(covariance[:, k, k])) for k in range(len(PARAMETERS))]
    low, high = (np.column_stack([p.own_interval[:, end] for p in each]) for end in (0, 1))
    means = [p.mean_interval[0] <= 1.0 <= p.mean_interval[1] for p in each]
    alone = 2.0 * 1.96 * np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    told = bool(odd(np.column_stack([p.chance for p in each])).any())
    return (
        boats,
        float(((low <= own) & (own <= high)).mean()),
        float(np.mean(means)),
        float(((high - low) / alone).mean()),
        told,
    )


def quiet(seed: int) -> tuple[str, int, float, Counter[str]]:
    """A fleet to which nothing happens: its scatter, false alarms, boat-years, and their names.

    An odd day was an alarm for a day, and counts.
    """
    kind = list(SCATTERS)[seed % 3]
    fleet, *_ = simulated(BOATS, 365, np.random.default_rng([seed, 2]), scatter=SCATTERS[kind])
    days = boat_days(fleet)
    seen = fleet_changes(days, PARAMETERS, WatchSettings(seed=seed))
    names = Counter(c.value for changes in seen.by_boat.values() for change in changes for c in change.causes)
    odd = sum(map(len, seen.odd.values()))
    names["an odd day"] += odd
    return kind, odd + sum(map(len, seen.by_boat.values())), sum(boat.days[-1] for boat in days) / YEAR, names


def wrecked(seed: int, scatter: Scatter) -> list[tuple[str, float, float, float, bool, bool]]:
    """Of each boat that changes: what, days to the alarm, after the oracle's and the sharper one's, in time, named."""
    rng = np.random.default_rng([seed, 3])
    kinds = ("fouling", "fouling", "fouling", "propeller damage")
    happens = {boat: happening(kind, rng, rng.uniform(40.0, 120.0)) for boat, kind in enumerate(kinds)}
    fleet, own, noisy = simulated(BOATS, HALF_YEAR, rng, happens, scatter)
    days = boat_days(fleet)
    settings = WatchSettings(seed=seed)
    seen = fleet_changes(days, PARAMETERS, settings)
    told = []
    for boat, what in happens.items():
        one = days[boat]
        when = (one.time - START) / DAY
        first = int(np.searchsorted(when, what.day))
        raised = [change for change in seen.by_boat[one.boat] if change.alarm >= first]
        if first >= when.size:
            continue
        alarm = raised[0].alarm if raised else when.size - 1
        due = sharp = first
        if what.kind == "fouling":
            # Student's tails and memory are in no covariance: the oracle is one of the normal world.
            columns = own[boat][:, None] * scatter.factors()
            true = noisy[boat] * columns @ columns.T
            growth = [ray for ray in rays(PARAMETERS) if ray.cause is Cause.FOULING]
            family = [replace(ray, weight=1.0 / len(growth)) for ray in growth]
            exact = [Ray(Cause.FOULING, what.a_day / what.a_day[0], True, 1.0)]
            dues = []
            for known in (family, exact):
                raised_by = [day for day in alarms(watched(one, true, known), settings.threshold)[0] if day >= first]
                dues.append(raised_by[0] if raised_by else when.size - 1)
            due, sharp = dues
        in_time = bool(raised) and (alarm <= due + 1 if what.kind == "fouling" else alarm <= due)
        in_time |= bool(raised) and when[alarm] - when[due] <= 1.0
        named = bool(raised) and what.kind in [c.value for c in raised[0].causes]
        after = (when[alarm] - what.day, when[alarm] - when[due], when[alarm] - when[sharp])
        told.append((what.kind, *map(float, after), in_time, named))
    return told


def named(seed: int, scatter: Scatter) -> list[tuple[str, str]]:
    """What happened to each boat of a fleet, and what it was called: right, both, no name, wrong, not found."""
    rng = np.random.default_rng([seed, 4])
    happens = {boat: happening(NAMED[boat % 6], rng, rng.uniform(40.0, 120.0)) for boat in range(12)}
    fleet, *_ = simulated(BOATS, HALF_YEAR, rng, happens, scatter)
    days = boat_days(fleet)
    seen = fleet_changes(days, PARAMETERS, WatchSettings(seed=seed)).by_boat
    told = []
    for boat, what in happens.items():
        when = (days[boat].time - START) / DAY
        after = [change for change in seen[days[boat].boat] if when[change.alarm] >= what.day]
        if not after:
            told.append((what.kind, "not found"))
            continue
        causes = [c.value for c in after[0].causes]
        right = Cause.UNNAMED.value if what.kind == "another" else what.kind
        if causes == [right]:
            told.append((what.kind, "right"))
        elif right in causes:
            told.append((what.kind, "right, among others"))
        else:
            told.append((what.kind, "no name" if causes == [Cause.UNNAMED.value] else "wrong"))
    return told


def tell_pooled(figures: Figures, rows: Sequence[tuple[int, float, float, float, bool]]) -> None:
    """Shares of intervals that cover."""
    size, own, mean, width, odds = (np.array(column, dtype=float) for column in zip(*rows, strict=True))
    for what, shares, weights in (("boats' own values", own, size), ("fleet means", mean, np.ones(size.size))):
        covered = float(100.0 * np.average(shares, weights=weights))
        figures.tell(f"intervals of {what} that cover, {size.size} fleets", covered, 92.0, "%", least=True)
        figures.tell("the same, at most", covered, 98.0, "%")
        for boats in np.unique(size):
            figures.tell(f"of them fleets of {boats:.0f}", float(100.0 * shares[size == boats].mean()), None, "%")
    figures.tell("width over that of a boat alone", float(width.mean()), None, "")
    figures.tell("fleets of equals in which a boat is said to differ", float(100.0 * odds.mean()), None, "%")


def tell_quiet(figures: Figures, rows: Sequence[tuple[str, int, float, Counter[str]]]) -> None:
    """False alarms."""
    count, lived = sum(row[1] for row in rows), sum(row[2] for row in rows)
    figures.tell(f"false alarms a boat and year, {lived:.0f} boat-years", count / lived, 1.0, "")
    for kind in SCATTERS:
        part = [row for row in rows if row[0] == kind]
        if part:
            figures.tell(f"scatter {kind}", sum(r[1] for r in part) / sum(r[2] for r in part), 1.0, "")
    print(f"names of false alarms: {dict(sum((row[3] for row in rows), Counter()))}")


def tell_found(figures: Figures, kind: str, rows: Sequence[tuple[str, float, float, float, bool, bool]]) -> None:
    """What was found in time, and how late."""
    for what in ("propeller damage", "fouling"):
        of = [row[1:] for row in rows if row[0] == what]
        if not of:
            continue
        days, after, sharp, in_time, rightly = (np.array(column, dtype=float) for column in zip(*of, strict=True))
        asked = 90.0 if kind == "normal" else None
        found = f"{what} found in time, scatter {kind}, {len(of)}"
        figures.tell(found, float(100.0 * in_time.mean()), asked, "%", least=True)
        figures.tell("rightly named, alone or among others", float(100.0 * rightly.mean()), None, "%")
        for name, late in (("the change", days), ("the oracle", after), ("the sharper oracle", sharp)):
            figures.tell(f"days after {name}, half", float(np.median(late)), None, "d")
            figures.tell(f"days after {name}, nine tenths", float(np.quantile(late, 0.9)), None, "d")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", choices=SEEDS, default="tuning")
    for name, usual in (("pooled", 60), ("years", 60), ("repeats", 6), ("named", 3), ("jobs", 1)):
        parser.add_argument(f"--{name}", type=int, default=usual)
    parser.add_argument("--table", type=Path)
    given = parser.parse_args()
    start = SEEDS[given.seeds]

    def intervals(figures: Figures) -> None:
        rows = _each(given.jobs, pooled, [(start + k,) for k in range(given.pooled)])
        tell_pooled(figures, [row for row in rows if np.isfinite(row[1])])

    def found(figures: Figures) -> None:
        for kind, scatter in SCATTERS.items():
            tell_found(figures, kind, _joined(_each(given.jobs, wrecked, _seeds(start, given.repeats, scatter))))

    def names(figures: Figures) -> None:
        for kind, scatter in SCATTERS.items():
            counts = Counter(_joined(_each(given.jobs, named, _seeds(start, given.named, scatter))))
            for (happened, called), times in sorted(counts.items()):
                figures.tell(f"{happened}, scatter {kind}: called {called}", times, None, "")

    def alarms_of_nothing(figures: Figures) -> None:
        tell_quiet(figures, _each(given.jobs, quiet, [(start + k,) for k in range(-(-given.years // BOATS))]))

    parts: dict[str, tuple[int, Callable[[Figures], None]]] = {
        "pooled intervals": (given.pooled, intervals),
        "what is found": (given.repeats, found),
        "what it is called": (given.named, names),
        "false alarms": (given.years, alarms_of_nothing),
    }
    asked = {name: measure for name, (wanted, measure) in parts.items() if wanted}
    return int(measure_parts(asked, given.table, "Diary", "benchmarks/hull_diary.py", f"Seeds: {given.seeds}."))


def _seeds(start: int, count: int, scatter: Scatter) -> list[tuple[Any, ...]]:
    return [(start + k, scatter) for k in range(count)]


def _joined(parts: Sequence[list[Any]]) -> list[Any]:
    return [row for part in parts for row in part]


def _each(jobs: int, work: Callable[..., Any], arguments: Sequence[tuple[Any, ...]]) -> list[Any]:
    return list(Parallel(n_jobs=jobs)(delayed(work)(*words) for words in arguments))


if __name__ == "__main__":
    raise SystemExit(main())
