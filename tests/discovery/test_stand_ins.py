"""Causes that the catalogue does not hold: what stands in for them is in play with its doubts, and is never missing."""

from dataclasses import replace

import numpy as np
import pytest
from dragged_world import Push, Pushed, beyond

from undertow.discovery.discover import find_missing
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import NOISE

HULL = load_vehicle("blueboat")
BESIDE = np.array([thruster.y for thruster in HULL.thrusters])


def kink(t: float, x: np.ndarray, c: np.ndarray) -> np.ndarray:
    """A drag that sets in at 0.8 m/s."""
    return np.array([beyond(0.8, 25.0)(t, x[3]), 0.0, 0.0])


def strips(t: float, x: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Cross-flow drag of the strips of a hull of 1 m (Faltinsen 1990, chapter 6)."""
    along = np.linspace(-0.5, 0.5, 9)
    flow = x[4] + along * x[5]
    drag = -60.0 * flow * np.abs(flow) / along.size
    return np.array([0.0, drag.sum(), (drag * along).sum()])


def lost_in_turns(t: float, x: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Propellers that lose thrust by their turns and the water that each meets (Fossen 2021, eq. 9.7)."""
    loss = 8.0 * np.sqrt(np.abs(c)) * (x[3] - BESIDE * x[5])
    return np.array([-loss.sum(), 0.0, (BESIDE * loss).sum()])


def disturbed(t: float, x: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Two propellers that take each other's water."""
    return np.array([-20.0 * c.prod(), 0.0, 0.0])


def caught(t: float, x: np.ndarray, c: np.ndarray) -> np.ndarray:
    """A net that is caught after a minute and a half."""
    return np.array([-12.0 * x[3] * (t > 90.0), 0.0, 0.0])


@pytest.mark.parametrize("cause", [kink, strips, lost_in_turns, disturbed, caught], ids=lambda cause: cause.__name__)
def test_what_stands_in_for_a_cause_without_a_name_is_never_missing(cause: Push):
    motion = Pushed(HULL, "rich", 240.0, 4, push=cause).run(NOISE["field"]).motion()
    findings = find_missing([motion], HULL).findings
    assert findings.missing == ()
    assert findings.verdict != "nothing missing"
    for found in findings.candidates:
        if found.claim is not None:
            assert found.claim.tests, found.effect
            assert found.reason is not None


def test_what_a_coarse_record_of_the_commands_makes_is_never_missing():
    motion = Pushed(HULL, "zigzag", 200.0, 3).run(NOISE["clean"]).motion()
    step = 0.05 * np.abs(motion.commands).max()
    findings = find_missing([replace(motion, commands=np.round(motion.commands / step) * step)], HULL).findings
    assert findings.missing == ()
