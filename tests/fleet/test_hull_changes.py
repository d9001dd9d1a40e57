"""The watch over hulls: its e-process, its alarms, and the names of what it finds."""

from dataclasses import replace

import numpy as np
import pytest

import undertow.fleet.hull_changes as rehearsed
from undertow.fleet.boat_days import DAY, BoatDays, boat_days, day_scatter
from undertow.fleet.causes import changes, rays, stories
from undertow.fleet.hull_changes import (
    WatchSettings,
    alarms,
    calibrate_scatter,
    detector,
    odd_day,
    taken_back,
    watched,
)
from undertow.fleet.parameter_estimates import Fleet, HullEstimate
from undertow.physics.errors import RequestError
from undertow.reports.hull_diary import Cause

PARAMETERS = ("X_u", "X_uu", "Y_vv", "N_rr", "thrusters.port.scale", "thrusters.stbd.scale", "mass")
SCATTER = 0.03
DAYS = 80


def days_of(change: np.ndarray, seed: int = 0, boat: str = "one", scatter: float = SCATTER) -> BoatDays:
    """A boat on every second day but for three weeks in harbour, with a change by day (days, p) in shares."""
    rng = np.random.default_rng(seed)
    at = np.array([2.0 * k + (21.0 if k > 20 else 0.0) for k in range(DAYS)])
    values = 1.0 + scatter * rng.standard_normal((DAYS, len(PARAMETERS))) + change
    covariance = np.tile((0.1 * SCATTER) ** 2 * np.eye(len(PARAMETERS)), (DAYS, 1, 1))
    return BoatDays(boat, DAY * at, np.full(DAYS, 0.3), values, covariance, np.ones(values.shape, dtype=bool))


def happened(kind: str, size: float, first: int = 40) -> np.ndarray:
    since = np.arange(DAYS) - first
    shape = np.maximum(since + 1, 0) if kind == "fouling" else since >= 0
    direction = {
        "fouling": [1.0, 1.0, 0.4, 0.4, 0.0, 0.0, 0.0],
        "cleaning": [-1.0, -1.0, -0.4, -0.4, 0.0, 0.0, 0.0],
        "propeller damage": [0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0],
        "payload": [0.5, 0.5, 0.2, 0.2, 0.0, 0.0, 1.0],
        "battery": [0.0, 0.0, 0.0, 0.0, -1.0, -1.0, 0.0],
        "a change without a name": [0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0],
    }[kind]
    return size * shape[:, None] * np.array(direction)


def test_while_nothing_happens_the_detector_is_the_days_gone_by_in_the_mean():
    ends = []
    for seed in range(20):
        watch = watched(days_of(np.zeros((DAYS, 7)), seed), SCATTER**2 * np.eye(7), rays(PARAMETERS))
        ends.append(np.exp(detector(watch)[12]))
    assert np.mean(ends) < 2.0 * 24.0  # days until the thirteenth; heavy-tailed, so a bound
    assert np.median(ends) < 24.0


@pytest.mark.parametrize(
    ("kind", "size"),
    [
        ("fouling", 0.01),
        ("cleaning", 0.25),
        ("propeller damage", 0.25),
        ("payload", 0.25),
        ("battery", 0.2),
        ("a change without a name", 0.3),
    ],
)
def test_what_happened_is_found_and_named(kind: str, size: float):
    boat = days_of(happened(kind, size))
    scatter = SCATTER**2 * np.eye(7)
    watch = watched(boat, scatter, rays(PARAMETERS))
    known, odd = alarms(watch, WatchSettings().threshold, taken_back(boat, scatter))
    assert odd == []
    (found,) = changes(boat, scatter, known, stories(PARAMETERS))
    assert [cause.value for cause in found.causes] == [kind]
    assert found.thrusters == (("thrusters.stbd.scale",) if kind == "propeller damage" else ())
    assert found.between[0] <= 40 <= found.between[1] + 1
    assert found.alarm <= (48 if kind == "fouling" else 40)
    assert found.slope == (kind == "fouling")


def test_a_log_that_cannot_tell_two_causes_apart_is_given_both():
    boat = days_of(happened("battery", 0.2))
    ratio = np.array(
        [0.5, 0.5, 0.2, 0.2, 1.0, 1.0, 1.0]
    )  # less thrust, or more mass and drag: the logs see one of both
    covariance = np.tile((0.1 * SCATTER) ** 2 * np.eye(7) + 25.0 * np.outer(ratio, ratio), (DAYS, 1, 1))
    one = BoatDays(boat.boat, boat.time, boat.hours, boat.values, covariance, boat.known)
    scatter = SCATTER**2 * np.eye(7)
    known, _ = alarms(watched(one, scatter, rays(PARAMETERS)), WatchSettings().threshold)
    (found,) = changes(one, scatter, known[:1], stories(PARAMETERS))
    assert Cause.BATTERY in found.causes
    assert len(found.causes) > 1


def test_the_scatter_of_days_is_found_beside_a_boat_that_changes():
    boats = [days_of(happened("payload", 0.3) * (k == 0), seed=k, boat=f"b{k}") for k in range(4)]
    found = day_scatter(boats)
    assert np.sqrt(np.diag(found.covariance)) == pytest.approx(np.full(7, SCATTER), rel=0.15)
    noisy = day_scatter([*boats[1:], days_of(np.zeros((DAYS, 7)), 9, "noisy", 2.0 * SCATTER)])
    assert noisy.factor["noisy"] > 2.5 * noisy.factor["b1"]


def test_a_single_odd_day_is_no_change_and_hides_none(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(rehearsed, "MOST_REPEATS", 2)
    scatter, ways = SCATTER**2 * np.eye(7), rays(PARAMETERS)
    once = happened("payload", 0.4) - happened("payload", 0.4, first=41)
    boat = days_of(once + happened("propeller damage", 0.25, first=60))
    watch = watched(boat, scatter, ways)
    assert alarms(watch, WatchSettings().threshold)[0][:2] == [40, 41]  # there and back, were it not known
    known, odd = alarms(watch, WatchSettings().threshold, taken_back(boat, scatter))
    assert (known, odd) == ([60], [40])
    told = odd_day(boat, scatter, 40, odd)
    assert told.change[-1] == pytest.approx(0.4, abs=4.0 * told.deviation[-1])
    (found,) = changes(boat, scatter, known, stories(PARAMETERS), odd)
    assert (found.causes, found.first) == ((Cause.PROPELLER,), 60)
    fleet = [days_of(20.0 * once), *(days_of(0.0 * once, seed, f"b{seed}") for seed in (1, 2))]
    assert calibrate_scatter(fleet, day_scatter(fleet), ways, WatchSettings()) < 2.0


def test_scatter_that_lasts_is_taken_wider(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(rehearsed, "MOST_REPEATS", 4)
    rng = np.random.default_rng(4)
    lasting = np.zeros((DAYS, 7))
    for day in range(1, DAYS):
        lasting[day] = 0.7 * lasting[day - 1] + 2.0 * SCATTER * rng.standard_normal(7)
    settings = WatchSettings(budget=4.0)
    calm, moody = ([days_of(change, 1), days_of(change[::-1], 2, "two")] for change in (0.0 * lasting, lasting))
    ways = rays(PARAMETERS)
    at_rest = calibrate_scatter(calm, day_scatter(calm), ways, settings)
    assert calibrate_scatter(moody, day_scatter(moody), ways, settings) > at_rest
    monkeypatch.setattr(rehearsed, "AIM", 1.0)
    assert calibrate_scatter(calm, day_scatter(calm), ways, settings) < at_rest  # half of the budget may ring


def test_logs_of_a_day_are_one_and_what_none_says_is_not_known():
    nominal = np.array([-10.0, 2.0])
    logs = [
        HullEstimate("a", 3600.0, 0.5, np.array([-11.0, np.nan]), np.diag([1.0, np.nan]), "1.csv"),
        HullEstimate("a", 7200.0, 0.5, np.array([-9.0, np.nan]), np.diag([0.25, np.nan]), "2.csv"),
        HullEstimate("a", 2.0 * DAY, 0.5, np.array([-10.0, 3.0]), np.diag([1.0, 0.1]), "3.csv"),
    ]
    (boat,) = boat_days(Fleet(("X_u", "mass"), nominal, tuple(logs)))
    assert boat.time.tolist() == [5400.0, 2.0 * DAY]
    assert boat.values[0, 0] == pytest.approx((1.1 * 1.0 + 0.9 * 4.0) / 5.0, rel=1e-3)
    assert boat.known.tolist() == [[True, False], [True, True]]
    assert boat.values[0, 1] == pytest.approx(1.5, rel=1e-3)


def test_weed_is_found_as_soon_as_by_one_who_looks_for_nothing_else():
    scatter, budget = SCATTER**2 * np.eye(7), WatchSettings()
    assert budget.threshold == 365.25  # one false alarm a boat and year, as the page says
    alone = [ray for ray in rays(PARAMETERS) if ray.cause is Cause.FOULING]
    alone = [replace(ray, weight=1.0 / len(alone)) for ray in alone]
    late = []
    for seed in range(16):
        boat = days_of(happened("fouling", 0.003), seed)
        first, oracle = (alarms(watched(boat, scatter, w), budget.threshold)[0][0] for w in (rays(PARAMETERS), alone))
        late.append(first - oracle)
    assert np.mean(np.array(late) <= 1) > 0.9


def test_a_budget_of_nothing_is_refused():
    with pytest.raises(RequestError, match="expected a budget of false alarms above 0"):
        WatchSettings(budget=0.0)
