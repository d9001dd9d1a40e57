"""The hull diary: the changes of every boat of a fleet over its days, as facts for page and file."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime

import numpy as np

from ..measurements.statistics.blocks import CI
from ..physics.effects import EFFECTS
from ..physics.errors import RequestError, expect
from ..physics.motion import Array
from ..reports import hull_diary
from .boat_days import BoatDays, DayScatter, Part, Pooled, boat_days, day_scatter, levels, odd, part_of, pool, scales
from .causes import HullChange, changes, rays, stories
from .hull_changes import OddDay, WatchSettings, alarms, calibrate_scatter, odd_day, taken_back, watched
from .parameter_estimates import Fleet


@dataclass(frozen=True, slots=True, eq=False)
class FleetChanges:
    """What was seen of a fleet.

    Attributes
    ----------
    scatter : of the days
    taken : the same as the watch takes it, widened by `widening`
    by_boat : changes of each boat, in order of time
    odd : days of each boat that were odd for once
    """

    scatter: DayScatter
    taken: DayScatter
    widening: float
    by_boat: Mapping[str, tuple[HullChange, ...]]
    odd: Mapping[str, tuple[OddDay, ...]]


def fleet_changes(boats: Sequence[BoatDays], parameters: Sequence[str], settings: WatchSettings) -> FleetChanges:
    """Watch every boat from its first day to its last."""
    scatter = day_scatter(boats)
    directions, laws = rays(parameters), stories(parameters)
    widening = calibrate_scatter(boats, scatter, directions, settings)
    taken = replace(scatter, covariance=widening * scatter.covariance)
    found, strange = {}, {}
    for boat in boats:
        own = taken.of(boat.boat)
        known, odd = alarms(watched(boat, own, directions), settings.threshold, taken_back(boat, own))
        found[boat.boat] = changes(boat, own, known, laws, odd)
        strange[boat.boat] = tuple(odd_day(boat, own, row, odd) for row in odd)
    return FleetChanges(scatter, taken, widening, found, strange)


WEEK = 7
"""Logged days within which a change is said to be visible."""
NINE_OF_TEN = 1.28
"""Deviations above its threshold at which a change is seen nine times in ten."""


def diary_of(fleet: Fleet, name: str = "fleet", settings: WatchSettings | None = None) -> hull_diary.DiaryFacts:
    """The diary of a fleet.

    Parameters
    ----------
    fleet : what its logs say
    name : of the fleet, as the page has it

    Raises
    ------
    RequestError
        when no log says anything of a parameter, or something else than a fleet is given.
    """
    settings = settings or WatchSettings()
    expect("diary_of: fleet", fleet, Fleet, "undertow.read_fleet(FOLDER) reads one")
    expect("diary_of: settings", settings, WatchSettings, "undertow.WatchSettings(budget=...) makes them")
    boats = boat_days(fleet)
    if not boats:
        raise RequestError("diary: expected logs that say something of a hull, got none; look at the fleet's own list")
    scale = scales(fleet)
    seen = fleet_changes(boats, fleet.parameters, settings)
    recent = [_since(boat, seen.by_boat[boat.boat], [odd.row for odd in seen.odd[boat.boat]]) for boat in boats]
    level, covariance = levels(recent, seen.scatter)
    said = np.array([boat.known.any(axis=0) for boat in recent])
    noise = np.where(said, np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)), np.inf)
    pooled = [pool(level[:, k], noise[:, k]) for k in range(scale.size)]
    differs = odd(np.column_stack([one.chance for one in pooled]))
    logs = Counter(estimate.boat for estimate in fleet.estimates)
    units = {p.symbol: p.unit for effect in EFFECTS for p in effect.parameters} | {"mass": "kg"}
    return hull_diary.DiaryFacts(
        fleet=name,
        budget=settings.budget,
        widening=seen.widening,
        missing=fleet.missing,
        parameters=tuple(
            hull_diary.FleetParameter(
                name=parameter,
                unit=units.get(parameter, ""),
                nominal=float(fleet.nominal[k]),
                mean=_band(one.mean, one.mean_interval, scale[k]),
                spread=_band(one.spread, one.spread_interval, abs(scale[k])),
            )
            for k, (parameter, one) in enumerate(zip(fleet.parameters, pooled, strict=True))
        ),
        boats=tuple(
            hull_diary.BoatRecord(
                boat=boat.boat,
                logs=logs[boat.boat],
                days=boat.time.size,
                hours=float(boat.hours.sum()),
                first=_date(boat.time[0]),
                last=_date(boat.time[-1]),
                changes=tuple(_change(boat, change, fleet.parameters) for change in seen.by_boat[boat.boat]),
                odd_days=tuple(_odd_day(boat, odd, fleet.parameters) for odd in seen.odd[boat.boat]),
                visible=_visible(boat, seen, fleet.parameters, settings),
                parameters=_parameters(boat, index, fleet.parameters, scale, pooled, differs, seen),
            )
            for index, boat in enumerate(boats)
        ),
    )


def _since(boat: BoatDays, changes: Sequence[HullChange], odd: Sequence[int]) -> BoatDays:
    """The days since the last change began, but for odd ones; where a hull still changes, those of the last week."""
    row = 0
    if changes:
        row = max(changes[-1].first, boat.time.size - WEEK) if changes[-1].slope else changes[-1].first
    return boat.of([k for k in range(min(row, boat.time.size - 1), boat.time.size) if k not in odd] or [-1])


def _odd_day(boat: BoatDays, odd: OddDay, parameters: Sequence[str]) -> hull_diary.OddDayRecord:
    """An odd day, by the parameter that tells it best."""
    k = int(np.argmax(np.where(boat.known[odd.row], np.abs(odd.change) / odd.deviation, 0.0)))
    share = _about(float(odd.change[k]), CI * float(odd.deviation[k]))
    moved = hull_diary.Moved(parameter=parameters[k], part=part_of(parameters[k]).value, share=share)
    return hull_diary.OddDayRecord(day=_date(boat.time[odd.row]), moved=moved)


def _change(boat: BoatDays, change: HullChange, parameters: Sequence[str]) -> hull_diary.ChangeRecord:
    low, high = change.between
    return hull_diary.ChangeRecord(
        causes=change.causes,
        thrusters=change.thrusters,
        alarm=_date(boat.time[change.alarm]),
        first=_date(boat.time[change.first]),
        earliest=_date(boat.time[low]),
        latest=_date(boat.time[high]),
        goes_on=change.slope,
        days=change.days,
        moved=tuple(
            hull_diary.Moved(parameter=p, part=part_of(p).value, share=_about(float(moved), CI * float(deviation)))
            for p, moved, deviation, known in zip(
                parameters, change.change, change.deviation, np.atleast_1d(boat.known.any(axis=0)), strict=True
            )
            if known
        ),
    )


def _parameters(
    boat: BoatDays,
    index: int,
    parameters: Sequence[str],
    scale: Array,
    pooled: Sequence[Pooled],
    differs: np.ndarray,
    seen: FleetChanges,
) -> tuple[hull_diary.BoatParameter, ...]:
    dates = [_date(time) for time in boat.time]
    scatter = np.diag(seen.scatter.of(boat.boat))
    found = []
    for k, name in enumerate(parameters):
        half = CI * np.sqrt(boat.covariance[:, k, k] + scatter[k])
        low, high = pooled[k].own_interval[index]
        rows = (
            hull_diary.DiaryRow(day=day, seen=_band(value, (value - wide, value + wide), scale[k]))
            for day, value, wide, known in zip(dates, boat.values[:, k], half, boat.known[:, k], strict=True)
            if known
        )
        own = _band(pooled[k].own[index], (low, high), scale[k])
        found.append(hull_diary.BoatParameter(name=name, own=own, differs=bool(differs[index, k]), rows=tuple(rows)))
    return tuple(found)


def _visible(
    boat: BoatDays, seen: FleetChanges, parameters: Sequence[str], settings: WatchSettings
) -> tuple[hull_diary.Visible, ...]:
    """What a week of logged days would have shown nine times in ten, the best seen parameter of each part."""
    if boat.time.size < WEEK + 1:
        return ()
    watch = watched(boat, seen.taken.of(boat.boat), rays(parameters))
    least: dict[Part, float] = {}
    for k, ray in enumerate(watch.rays):
        moved = np.flatnonzero(ray.direction)
        parts = {part_of(parameters[int(j)]) for j in moved}
        if ray.slope or len(parts) > 1 or not boat.known[:, moved].any(axis=0).all():
            continue
        before, after = watch.precision[:-WEEK, k].sum(), watch.precision[-WEEK:, k].sum()
        needed = np.sqrt(2.0 * np.log(settings.threshold / (WEEK * ray.weight))) + NINE_OF_TEN
        size = float(needed / np.sqrt(before * after / (before + after)))
        (part,) = parts
        least[part] = min(size, least.get(part, np.inf))
    return tuple(hull_diary.Visible(part=part.value, share=size) for part, size in least.items())


def _band(value: float, ends: tuple[float, float], scale: float) -> hull_diary.Band:
    low, high = sorted((float(ends[0] * scale), float(ends[1] * scale)))
    return hull_diary.Band(value=float(value * scale), low=low, high=high)


def _about(value: float, half: float) -> hull_diary.Band:
    return hull_diary.Band(value=value, low=value - half, high=value + half)


def _date(time: float) -> str:
    return datetime.fromtimestamp(float(time), UTC).date().isoformat()
