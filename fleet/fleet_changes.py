"""The changes of every boat of a fleet: the scatter of its days, how wide it must be taken, alarms, and their names."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from .boat_days import BoatDays
from .causes import rays, stories
from .day_scatter import DayScatter, day_scatter
from .hull_changes import WatchSettings, alarms, watched
from .names_of_changes import HullChange, changes
from .odd_days import OddDay, odd_day, taken_back
from .rehearsed_widening import rehearsed_widening


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
    widening = rehearsed_widening(boats, scatter, directions, settings)
    taken = replace(scatter, covariance=widening * scatter.covariance)
    found, strange = {}, {}
    for boat in boats:
        own = taken.of(boat.boat)
        known, odd = alarms(watched(boat, own, directions), settings.threshold, taken_back(boat, own))
        found[boat.boat] = changes(boat, own, known, laws, odd)
        strange[boat.boat] = tuple(odd_day(boat, own, row, odd) for row in odd)
    return FleetChanges(scatter, taken, widening, found, strange)
