"""What an effect looks like: its force, where it shows, what it is taken for; and the page that says so."""

import importlib.util
import re
from types import ModuleType

import numpy as np
import pytest
from places import ROOT

from undertow.physics.effects import EFFECTS
from undertow.physics.errors import RequestError
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.signatures import Signature, signatures

NUMBER = re.compile(r"-?\d+\.?\d*")


@pytest.fixture(scope="module")
def found() -> dict[str, Signature]:
    return {each.effect.name: each for each in signatures(load_vehicle("blueboat"))}


@pytest.fixture(scope="module")
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("effects_page", ROOT / "docs" / "effects.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_effect_has_one(found: dict[str, Signature]) -> None:
    assert list(found) == [effect.name for effect in EFFECTS]
    for each in found.values():
        assert each.size > 0.0
        assert 0.0 < each.apart <= 1.0
        assert each.time.shape == each.force.shape == each.values.shape
        assert (np.diff(each.time) > 0.0).all()


@pytest.mark.parametrize(
    ("name", "axis", "trial", "signal"),
    [
        ("surge_quadratic_damping", "surge", "acceleration_coast", "u"),
        ("reverse_thrust_loss", "surge", "reversals", "command"),
        ("thrust_dead_zone", "surge", "small_steps", "command"),
        ("yaw_added_mass", "yaw", "zigzag_20", "dr/dt"),
        ("yaw_trim", "yaw", "reversals", "time"),
        ("sway_trim", "sway", "four_headings", "time"),
    ],
)
def test_it_shows_where_an_engineer_would_look(
    found: dict[str, Signature], name: str, axis: str, trial: str, signal: str
) -> None:
    each = found[name]
    assert (each.axis_name, each.trial.name, each.signal) == (axis, trial, signal)


def test_the_force_is_that_of_the_equation(found: dict[str, Signature]) -> None:
    each = found["surge_quadratic_damping"]
    assert each.force == pytest.approx(each.amount["X_uu"] * each.values * np.abs(each.values), abs=1e-9)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("surge_linear_damping", "surge_quadratic_damping"),
        ("munk_moment", "sway_added_mass"),
        ("thruster_lag", "input_delay"),
    ],
)
def test_look_alikes_name_each_other(found: dict[str, Signature], one: str, other: str) -> None:
    assert other in dict(found[one].alike)
    assert one in dict(found[other].alike)


def test_what_changes_by_the_minute_is_told_from_what_does_not(found: dict[str, Signature]) -> None:
    for name in ("battery_sag", "hull_fouling", "turning_current", "thrust_scale", "steady_current"):
        assert found[name].apart > 0.4, name


def test_an_unknown_effect_is_refused() -> None:
    with pytest.raises(RequestError, match="did you mean 'munk_moment'"):
        signatures(load_vehicle("blueboat"), ["munk"])


def test_the_page_is_up_to_date(found: dict[str, Signature], script: ModuleType) -> None:
    cure = "run python docs/effects.py"
    shown = (ROOT / "docs" / "effects.md").read_text("utf-8")
    said = script.page(found, load_vehicle("blueboat"))
    assert NUMBER.sub("#", shown) == NUMBER.sub("#", said), cure
    numbers = [[float(text) for text in NUMBER.findall(part)] for part in (shown, said)]
    assert numbers[0] == pytest.approx(numbers[1], rel=0.02, abs=0.011), cure
    assert {path.stem for path in (ROOT / "docs" / "effects").glob("*.svg")} == set(found), cure
