"""Intervals hold what the step of a record leaves where commands jump, which is in all blocks alike."""

import numpy as np
import pytest

from undertow.discovery.balance.weak_form import WeakForm, WeakSettings
from undertow.discovery.discover import find_missing
from undertow.discovery.search.bootstrap import Interval
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")
TRUE = HULL.values["N_rdot"] + 2.0


def interval(step: float, noise: str) -> Interval:
    """That of an inertia in yaw in a zigzag, whose commands switch all the time."""
    world = simulate_world(HULL, {"N_rdot": TRUE}, programme="zigzag", duration=200.0, noise=noise, seed=3)
    findings = find_missing([world.motion(step)], HULL).findings
    (found,) = [effect for effect in findings.candidates if effect.verdict in ("missing", "likely")]
    (term,) = found.terms
    assert term.symbol == "N_rdot"
    assert term.ci95 is not None
    return term.ci95


def test_a_coarse_step_is_in_the_interval(monkeypatch: pytest.MonkeyPatch):
    fine, coarse = (interval(step, "clean") for step in (0.05, 0.1))
    assert fine.lower <= TRUE <= fine.upper
    assert coarse.lower <= TRUE <= coarse.upper
    assert 2.0 < (coarse.upper - coarse.lower) / (fine.upper - fine.lower) < 6.0
    noisy = interval(0.1, "field")
    assert noisy.lower <= TRUE <= noisy.upper
    monkeypatch.setattr(WeakForm, "of_switches", lambda weak, vehicle: np.zeros((weak.time.size, 3)))
    blocks_alone = interval(0.1, "field")
    assert not blocks_alone.lower <= TRUE <= blocks_alone.upper
    clean = interval(0.1, "clean")
    assert clean.upper - clean.lower < 0.8 * (coarse.upper - coarse.lower), "what is left is wide, too, and not enough"


def test_sums_err_where_thrust_jumps():
    """A sum over rows less the same one over ten times as many is what jumps of the commands leave."""
    fine, coarse = (
        WeakForm(
            [simulate_world(HULL, {}, programme="zigzag", duration=60.0, noise="clean", seed=3).motion(step)],
            WeakSettings(),
        )
        for step in (0.02, 0.1)
    )
    found, less = (np.asarray(weak.of_switches(HULL))[:, 2] for weak in (coarse, fine))
    left = coarse.balance(HULL)[:, 2]
    assert np.abs(found).max() > 20.0 * np.abs(less).max()
    assert 0.2 < np.abs(left).max() / np.abs(found).max() < 5.0
    assert np.abs(np.corrcoef(found, left)[0, 1]) > 0.5
