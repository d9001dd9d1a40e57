"""Logs of several days: each is taken into its own water where they ask for it, and a wind of each is told."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from undertow.discovery import water_of_logs
from undertow.discovery.basis import DiscoverySettings, choose_balance
from undertow.discovery.discover import find_missing, in_winds
from undertow.discovery.findings import Findings
from undertow.discovery.sensor_error_search import WATER, HiddenErrors
from undertow.discovery.water_of_logs import find_flows, flow_of, in_water, sentence_of
from undertow.physics.errors import RequestError
from undertow.physics.integration import rollout
from undertow.physics.motion import Motion
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import NOISE, World

HULL = load_vehicle("blueboat")
LACKING = HULL.with_values({"X_uu": 0.0})


@cache
def day(log: str, seed: int, **surroundings: float) -> Motion:
    boat = HULL.with_values(surroundings)
    return replace(World(boat, "rich", 60.0, seed).run(NOISE["field"]).motion(), source=log)


def of_days(*values: dict[str, float]) -> list[Motion]:
    return [day(f"logs/{k}.csv", k, **own) for k, own in enumerate(values)]


CURRENTS = ({"current_north": 0.2, "current_east": 0.05}, {"current_north": -0.15})


def test_a_log_in_its_water_is_one_in_still_water():
    still = day("still", 1)
    driven = replace(still, velocity=np.zeros_like(still.velocity), position=np.zeros_like(still.position))
    moving = HULL.with_values({"current_north": 0.3, "current_east": -0.2})
    at_rest = rollout(HULL, driven, np.array([0]), 800).states[0]
    with_water = replace(driven, velocity=in_water(driven, -0.3, 0.2).velocity)
    drifting = rollout(moving, with_water, np.array([0]), 800).states[0]
    seen = in_water(
        replace(
            driven.slice(0, 801), position=drifting[:, :2], heading=drifting[:, 2], velocity=drifting[:, 3:], past=None
        ),
        0.3,
        -0.2,
    )
    assert seen.velocity == pytest.approx(at_rest[:, 3:], abs=1e-6)
    assert seen.position - seen.position[0] == pytest.approx(at_rest[:, :2], abs=1e-5)


@pytest.mark.parametrize("own", [(CURRENTS[0], CURRENTS[0]), ({}, {}), (CURRENTS[0],)])
def test_one_current_for_all_logs_is_no_reason(own: tuple[dict[str, float], ...]):
    assert find_flows(choose_balance(of_days(*own), LACKING, DiscoverySettings())) == ((), ())


@pytest.mark.parametrize("usual", [0.1, 0.4])
def test_what_a_current_usually_is_decides_nothing(usual: float, monkeypatch: pytest.MonkeyPatch):
    basis = choose_balance(of_days(*CURRENTS), LACKING, DiscoverySettings())
    before, _ = find_flows(basis)
    monkeypatch.setattr(water_of_logs, "_USUAL", usual)
    after, _ = find_flows(basis)
    assert np.array([f[1:] for f in after]) == pytest.approx(np.array([f[1:] for f in before]), abs=1e-3)


def test_a_wind_of_each_log_is_told_as_such():
    winds = ({"wind_force_north": 10.0}, {"wind_force_east": -8.0})
    currents, found = find_flows(choose_balance(of_days(*winds), HULL, DiscoverySettings()))
    assert currents == ()
    assert np.array([flow[1:] for flow in found]) == pytest.approx(np.array([[10.0, 0.0], [0.0, -8.0]]), abs=1.5)
    before = Findings(verdict="undecided", missing=(), candidates=(), headline="Undecided: something.")
    told = in_winds(before, found)
    assert told.headline == "Undecided: the wind differs from log to log, and one model holds one wind."
    assert "N towards 0 degrees in 0.csv and" in told.reasons[0]
    assert [term.form for term in told.winds] == ["logs/0.csv"] * 2 + ["logs/1.csv"] * 2
    assert in_winds(before.but(verdict="missing", headline="The model is missing X."), found).headline.endswith("X.")


def test_what_is_missing_is_found_in_the_water_of_each_log_and_read_back():
    found = find_missing(of_days(*CURRENTS), LACKING)
    assert found.findings.missing == ("surge_quadratic_damping",)
    assert found.corrected.value("X_uu") == pytest.approx(HULL.value("X_uu"), rel=0.05)
    assert found.corrected.value("current_north") == 0.0
    (water,) = [sensor for sensor in found.findings.sensors if sensor.correction == WATER]
    assert "towards 14 degrees in 0.csv" in water.sentence
    assert found.hidden is not None
    assert [log for log, *_ in found.hidden.flows] == ["logs/0.csv", "logs/1.csv"]
    wanted = [[0.2, 0.05], [-0.15, 0.0]]
    assert np.array([flow[1:] for flow in found.hidden.flows]) == pytest.approx(np.array(wanted), abs=0.02)
    motion = day("logs/1.csv", 1, **CURRENTS[1])
    moved = replace(motion, source="/elsewhere/1.csv")
    again = HiddenErrors.of_findings(found.findings.sensors, ["0.csv", "/elsewhere/1.csv"])
    assert again is not None
    assert again.corrected(moved).velocity == pytest.approx(found.hidden.corrected(motion).velocity, abs=1e-6)
    assert np.array_equal(found.hidden.keeping((WATER,)).corrected(motion).velocity, motion.velocity)
    with pytest.raises(RequestError, match="expected the 2 logs of the run, each in its own water, got 1"):
        HiddenErrors.of_findings(found.findings.sensors, ["0.csv"])
    assert flow_of(moved, found.hidden.flows) == (0.0, 0.0)


def test_logs_of_one_name_and_a_current_in_the_file_keep_to_their_own_water():
    off = LACKING.with_values({"current_north": 0.2})
    days = [
        replace(one, source=name) for one, name in zip(of_days(*CURRENTS[:2]), ("log.csv", "a/log.csv"), strict=True)
    ]
    currents, winds = find_flows(choose_balance(days, off, DiscoverySettings()))
    assert winds == ()
    wanted = [[0.0, 0.05], [-0.35, 0.0]]
    assert np.array([flow[1:] for flow in currents]) == pytest.approx(np.array(wanted), abs=0.03)
    assert "in log.csv and" in sentence_of(currents, "The water moves at", "m/s")
    assert "in a/log.csv" in sentence_of(currents, "The water moves at", "m/s")
