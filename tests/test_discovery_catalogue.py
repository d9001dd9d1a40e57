"""`simulate --effect` then `discover`: every single effect of the catalogue comes back, alone and with its size."""

from pathlib import Path

import numpy as np
import pytest

from undertow.discovery.discover import find_missing
from undertow.physics.effects import EFFECTS
from undertow.physics.typical_effects import typical_effect
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds import simulate_world
from undertow.reports.inputs import read_inputs

HULL = load_vehicle("blueboat")


def found_in(path: Path, hidden: dict[str, float], seed: int):
    simulate_world(HULL, hidden, duration=300.0, noise="field", seed=seed).write(path)
    return find_missing(read_inputs(path, HULL).fitting, HULL)


@pytest.mark.parametrize("name", [effect.name for effect in EFFECTS])
def test_each_effect_is_recovered_from_five_minutes_of_field_noise(name: str, tmp_path: Path):
    seed = 100 + [effect.name for effect in EFFECTS].index(name)
    hidden = typical_effect(name, HULL, np.random.default_rng(seed))
    found = found_in(tmp_path / "log.csv", hidden, seed)
    assert found.findings.missing == (name,)
    assert found.findings.unnamed == ()
    candidate = found.findings.candidates[0]
    assert (candidate.effect, candidate.verdict) == (name, "missing")
    values = {term.symbol: term.value for term in candidate.terms}
    for symbol, value in hidden.items():
        assert values[symbol] == pytest.approx(value, rel=0.12, abs=0.02), symbol


def test_a_world_without_a_secret_gives_nothing(tmp_path: Path):
    found = found_in(tmp_path / "log.csv", {}, seed=99)
    assert found.findings.verdict == "nothing missing"
    assert found.findings.unnamed == ()
    assert found.corrected is found.nominal
