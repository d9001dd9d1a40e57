"""A number that was changed by hand, while its source still states another, is told; what is no such thing is not."""

from pathlib import Path

import pytest
from places import ROOT

from undertow.physics.sources import stale_sources, with_sources
from undertow.physics.vehicle import load_vehicle, shipped_vehicles
from undertow.workflows.check_and_explain import check

BOAT = load_vehicle("otter")


def sourced(sources: dict[str, object], **values: float) -> list[str]:
    return stale_sources(BOAT.with_values(values).model_copy(update={"sources": sources}))


@pytest.mark.parametrize("name", [*shipped_vehicles(), str(ROOT / "data" / "demo.yaml")])
def test_what_ships_is_as_its_sources_state(name: str) -> None:
    assert stale_sources(load_vehicle(name)) == []


def test_a_mass_that_was_changed_by_hand_is_told_by_check(tmp_path: Path) -> None:
    BOAT.with_values({"mass": 100.0, "x_g": 0.11}).save(tmp_path / "heavier.yaml")
    mass, place = check(tmp_path / "heavier.yaml", progress=None).notes
    assert mass == "mass is 100 kg, but its source says 55 + 25 kg = 80 kg. Correct the source, or the number."
    assert place.startswith("x_g is 0.11 m, but its source says 55 * 0.2 / 80 m = 0.1375 m.")
    assert check("otter", progress=None).notes == ()


@pytest.mark.parametrize(
    ("source", "told"),
    [
        ("weighed: 30.5 kg", True),
        ("hull 55 kg", True),
        ("weighed, 80.1 kg", False),
        ("hull 55 kg, payload 25 kg", False),
        ("of a water tank of 1000 kg/m^3 and 12 kg m^2", False),
        ("mass (30 + 2) kg", False),
        ("read off a scale", False),
    ],
)
def test_only_one_plain_number_in_the_unit_is_read(source: str, told: bool) -> None:
    assert bool(sourced({"mass": source})) is told


def test_sources_of_symbols_in_a_section_are_read_and_those_of_sections_are_not() -> None:
    assert len(sourced({"damping": {"X_u": "towing tank: -60 N s/m"}})) == 1
    assert sourced({"damping": {"X_u": "towing tank: -77.6 N s/m"}}) == []
    assert sourced({"damping": "towing tank: -60 N s/m"}) == []


def test_what_a_source_said_before_the_number_was_fitted_is_no_longer_asked() -> None:
    fitted = with_sources(BOAT, BOAT.with_values({"mass": 95.0}), "fitted by undertow to log.csv")
    assert "55 + 25 kg" in str(fitted.sources["mass"])
    assert stale_sources(fitted) == []
