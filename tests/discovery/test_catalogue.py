"""`simulate --effect` then `discover`: every single effect of the catalogue comes back, alone and with its size."""

from pathlib import Path

import numpy as np
import pytest

from undertow.discovery.discover import find_missing
from undertow.physics.effects import EFFECTS
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.hidden_effects import typical_effect, with_hull
from undertow.physics.worlds.world import simulate_world
from undertow.workflows.inputs import read_inputs

HULL = with_hull(load_vehicle("blueboat"), np.random.default_rng(1))


def found_in(path: Path, hidden: dict[str, float], seed: int, duration: float = 180.0):
    simulate_world(HULL, hidden, duration=duration, noise="field", seed=seed).write(path)
    return find_missing(read_inputs(path, HULL).fitting, HULL)


@pytest.mark.parametrize("name", [effect.name for effect in EFFECTS])
def test_each_effect_is_recovered_from_minutes_of_field_noise(name: str, tmp_path: Path):
    seed = 100 + [effect.name for effect in EFFECTS].index(name)
    hidden = typical_effect(name, HULL, np.random.default_rng(seed))
    found = found_in(tmp_path / "log.csv", hidden, seed, 300.0 if name == "steady_current" else 180.0)
    assert found.findings.missing == (name,)
    assert found.findings.unnamed == ()
    candidate = found.findings.candidates[0]
    assert (candidate.effect, candidate.verdict) == (name, "missing")
    values = {term.symbol: term.value for term in candidate.terms}
    for symbol, value in hidden.items():
        assert values[symbol] == pytest.approx(value, rel=0.12, abs=0.02), symbol


@pytest.mark.parametrize(
    ("effect", "hidden"), [("thruster_lag", {"lag": 2.5}), ("wake_memory", {"memory_sway": 30.0, "memory_time": 2.5})]
)
def test_what_remembers_is_recovered_from_a_log_full_of_gaps(effect: str, hidden: dict[str, float], tmp_path: Path):
    """Every 12 s a gap of 1 s: a thruster must know the commands from before each stretch, a wake the motion."""
    path = tmp_path / "log.csv"
    simulate_world(HULL, hidden, duration=300.0, noise="field", seed=20).write(path)
    lines = path.read_text().splitlines()
    kept = [x for x in lines[1:] if ",odometry," not in x or float(x.split(",", 1)[0]) % 12.0 >= 1.0]
    path.write_text("\n".join([lines[0], *kept]))
    motions = read_inputs(path, HULL).fitting
    assert len(motions) > 15
    found = find_missing(motions, HULL)
    assert found.findings.missing == (effect,)
    for symbol, value in hidden.items():
        assert found.corrected.value(symbol) == pytest.approx(value, rel=0.04), symbol


@pytest.mark.parametrize(
    ("hidden", "symbol", "value"),
    [
        ({"steady_current": (-0.3, -0.1)}, "current_north", -0.3),
        ({"port_scale": 0.8}, "port_scale", 0.8),
        ({"wake_memory": (20.0, 0.0, 1.5)}, "memory_sway", 20.0),
    ],
)
def test_other_signs_and_sides_are_recovered_with_their_intervals(hidden, symbol: str, value: float, tmp_path: Path):
    path = tmp_path / "log.csv"
    simulate_world(HULL, hidden, duration=180.0, noise="field", seed=41).write(path)
    found = find_missing(read_inputs(path, HULL).fitting, HULL).findings
    assert len(found.missing) == 1
    term = next(t for t in found.candidates[0].terms if t.symbol == symbol)
    assert term.ci95 is not None
    slack = 0.01 * abs(value)
    assert term.ci95.lower - slack <= value <= term.ci95.upper + slack


def test_a_world_without_a_secret_gives_nothing(tmp_path: Path):
    found = found_in(tmp_path / "log.csv", {}, seed=99)
    assert found.findings.verdict == "nothing missing"
    assert found.findings.unnamed == ()
    assert found.corrected is found.nominal
