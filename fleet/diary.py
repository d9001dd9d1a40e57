"""The hull diary: the changes of every boat of a fleet over its days, as facts for page and file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime

import numpy as np

from ..measurements.statistics.blocks import CI
from ..physics.effects import EFFECTS
from ..physics.errors import RequestError, expect
from ..physics.motion import Array
from ..reports import hull_diary
from .boat_days import BoatDays, DayScatter, Part, boat_days, day_scatter, levels, odd, part_of, pool, scales
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
    if not (boats := boat_days(fleet)):
        raise RequestError("diary: expected logs that say something of a hull, got none; look at the fleet's own list")
    return _Diary(fleet, boats, settings).facts(name)


class _Diary:
    """The diary of a fleet, boat by boat: every number in the units of its parameter."""

    def __init__(self, fleet: Fleet, boats: Sequence[BoatDays], settings: WatchSettings) -> None:
        self._fleet, self._boats, self._settings, self._parameters = fleet, boats, settings, fleet.parameters
        self._scale = scales(fleet)
        self._seen = seen = fleet_changes(boats, fleet.parameters, settings)
        recent = [_since(boat, seen.by_boat[boat.boat], [odd.row for odd in seen.odd[boat.boat]]) for boat in boats]
        level, covariance = levels(recent, seen.scatter)
        said = np.array([boat.known.any(axis=0) for boat in recent])
        noise = np.where(said, np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)), np.inf)
        self._pooled = [pool(level[:, k], noise[:, k]) for k in range(self._scale.size)]
        self._differs = odd(np.column_stack([one.chance for one in self._pooled]))

    def facts(self, name: str) -> hull_diary.DiaryFacts:
        """All of it, under the name of the fleet."""
        units = {p.symbol: p.unit for effect in EFFECTS for p in effect.parameters} | {"mass": "kg"}
        parameters = (
            hull_diary.FleetParameter(
                name=parameter,
                unit=units.get(parameter, ""),
                nominal=float(self._fleet.nominal[k]),
                mean=_band(one.mean, one.mean_interval, self._scale[k]),
                spread=_band(one.spread, one.spread_interval, abs(self._scale[k])),
            )
            for k, (parameter, one) in enumerate(zip(self._parameters, self._pooled, strict=True))
        )
        return hull_diary.DiaryFacts(
            fleet=name,
            budget=self._settings.budget,
            widening=self._seen.widening,
            missing=self._fleet.missing,
            parameters=tuple(parameters),
            boats=tuple(self._boat(index, boat) for index, boat in enumerate(self._boats)),
        )

    def _boat(self, index: int, boat: BoatDays) -> hull_diary.BoatRecord:
        return hull_diary.BoatRecord(
            boat=boat.boat,
            logs=sum(estimate.boat == boat.boat for estimate in self._fleet.estimates),
            days=boat.time.size,
            hours=float(boat.hours.sum()),
            first=_date(boat.time[0]),
            last=_date(boat.time[-1]),
            changes=tuple(self._change(boat, change) for change in self._seen.by_boat[boat.boat]),
            odd_days=tuple(self._odd_day(boat, odd) for odd in self._seen.odd[boat.boat]),
            visible=self._visible(boat),
            parameters=tuple(self._parameter(index, boat, k) for k in range(len(self._parameters))),
        )

    def _moved(self, k: int, change: Array, deviation: Array) -> hull_diary.Moved:
        """By how much a parameter moved, with its interval."""
        value, half, name = float(change[k]), CI * float(deviation[k]), self._parameters[k]
        share = hull_diary.Band(value=value, low=value - half, high=value + half)
        return hull_diary.Moved(parameter=name, part=part_of(name).value, share=share)

    def _odd_day(self, boat: BoatDays, odd: OddDay) -> hull_diary.OddDayRecord:
        """An odd day, by the parameter that tells it best."""
        k = int(np.argmax(np.where(boat.known[odd.row], np.abs(odd.change) / odd.deviation, 0.0)))
        moved = self._moved(k, odd.change, odd.deviation)
        return hull_diary.OddDayRecord(day=_date(boat.time[odd.row]), moved=moved)

    def _change(self, boat: BoatDays, change: HullChange) -> hull_diary.ChangeRecord:
        known = np.flatnonzero(boat.known.any(axis=0))
        return hull_diary.ChangeRecord(
            causes=change.causes,
            thrusters=change.thrusters,
            alarm=_date(boat.time[change.alarm]),
            first=_date(boat.time[change.first]),
            earliest=_date(boat.time[change.between[0]]),
            latest=_date(boat.time[change.between[1]]),
            goes_on=change.slope,
            days=change.days,
            moved=tuple(self._moved(int(k), change.change, change.deviation) for k in known),
        )

    def _parameter(self, index: int, boat: BoatDays, k: int) -> hull_diary.BoatParameter:
        scatter, scale, known = self._seen.scatter.of(boat.boat)[k, k], self._scale[k], boat.known[:, k]
        half = CI * np.sqrt(boat.covariance[:, k, k] + scatter)
        rows = (
            hull_diary.DiaryRow(day=_date(time), seen=_band(value, (value - wide, value + wide), scale))
            for time, value, wide in zip(boat.time[known], boat.values[known, k], half[known], strict=True)
        )
        low, high = self._pooled[k].own_interval[index]
        own, differs = _band(self._pooled[k].own[index], (low, high), scale), bool(self._differs[index, k])
        return hull_diary.BoatParameter(name=self._parameters[k], own=own, differs=differs, rows=tuple(rows))

    def _visible(self, boat: BoatDays) -> tuple[hull_diary.Visible, ...]:
        """What a week of logged days would have shown nine times in ten, the best seen parameter of each part."""
        if boat.time.size < WEEK + 1:
            return ()
        watch = watched(boat, self._seen.taken.of(boat.boat), rays(self._parameters))
        least: dict[Part, float] = {}
        for k, ray in enumerate(watch.rays):
            moved = np.flatnonzero(ray.direction)
            parts = {part_of(self._parameters[int(j)]) for j in moved}
            if ray.slope or len(parts) > 1 or not boat.known[:, moved].any(axis=0).all():
                continue
            before, after = watch.precision[:-WEEK, k].sum(), watch.precision[-WEEK:, k].sum()
            needed = np.sqrt(2.0 * np.log(self._settings.threshold / (WEEK * ray.weight))) + NINE_OF_TEN
            size = float(needed / np.sqrt(before * after / (before + after)))
            (part,) = parts
            least[part] = min(size, least.get(part, np.inf))
        return tuple(hull_diary.Visible(part=part.value, share=size) for part, size in least.items())


def _since(boat: BoatDays, changes: Sequence[HullChange], odd: Sequence[int]) -> BoatDays:
    """The days since the last change began, but for odd ones; where a hull still changes, those of the last week."""
    row = changes[-1].first if changes else 0
    if changes and changes[-1].slope:
        row = max(row, boat.time.size - WEEK)
    return boat.of([k for k in range(min(row, boat.time.size - 1), boat.time.size) if k not in odd] or [-1])


def _band(value: float, ends: tuple[float, float], scale: float) -> hull_diary.Band:
    low, high = sorted((float(ends[0] * scale), float(ends[1] * scale)))
    return hull_diary.Band(value=float(value * scale), low=low, high=high)


def _date(time: float) -> str:
    return datetime.fromtimestamp(float(time), UTC).date().isoformat()
