"""Where numbers came from, after some of them were identified anew."""

import undertow
from undertow.physics.sources import with_sources

BOAT = undertow.load_vehicle("blueboat").model_copy(update={"sources": {}})
HOW = "identified by undertow from log.csv"


def sourced(**sources: object) -> undertow.Vehicle:
    return BOAT.model_copy(update={"sources": sources})


def after(before: undertow.Vehicle, changes: dict[str, float], how: str = HOW) -> dict[str, object]:
    found = with_sources(before, before.with_values(changes), how)
    assert found.values == before.with_values(changes).values
    return found.sources


def test_every_section_whose_numbers_moved_says_which_and_how():
    changes = {"X_uu": -20.0, "N_rr": -3.0, "N_uv": 4.0, "port_scale": 0.8, "lag": 0.2, "yaw:u|r|": -1.0}
    assert after(BOAT, {**changes, "current_north": 0.1, "mass": 31.0, "memory_yaw": 2.0, "X_udot": -4.0}) == {
        "mass": HOW,
        "added_mass": f"X_udot: {HOW}",
        "damping": f"X_uu, N_rr: {HOW}",
        "coupling": f"N_uv: {HOW}",
        "environment": f"current_north: {HOW}",
        "memory": f"memory_yaw: {HOW}",
        "thrusters": f"lag, port_scale: {HOW}",
        "terms": f"yaw:u|r|: {HOW}",
    }


def test_what_an_entry_said_stays_the_source_of_the_other_numbers():
    found = after(sourced(damping="towing tank", thrusters="maker"), {"X_uu": -20.0})
    assert found == {"damping": f"X_uu: {HOW}; the others, and these before: towing tank", "thrusters": "maker"}


def test_an_entry_of_a_symbol_is_that_symbol_s():
    assert after(sourced(mass="scale", X_u="tank", X_uu="book"), {"X_uu": -20.0, "mass": 31.0}) == {
        "mass": f"{HOW}; before: scale",
        "X_u": "tank",
        "X_uu": f"{HOW}; before: book",
    }
    nested = after(sourced(damping={"X_u": "tank", "X_uu": "book"}), {"X_uu": -20.0, "Y_vv": -9.0})
    assert nested == {"damping": {"X_u": "tank", "X_uu": f"{HOW}; before: book", "Y_vv": HOW}}


def test_the_entry_for_all_numbers_speaks_of_the_identified_ones_no_longer():
    first = after(sourced(all="a thesis"), {"X_uu": -20.0})
    assert first == {"all": "Not of what undertow identified (see damping): a thesis", "damping": f"X_uu: {HOW}"}
    second = after(sourced(**first), {"mass": 31.0}, "fitted by undertow to other.csv")
    assert second["all"] == "Not of what undertow identified (see damping, mass): a thesis"
    assert second["damping"] == f"X_uu: {HOW}"


def test_where_nothing_moved_nothing_is_said():
    assert after(sourced(all="a thesis", damping="tank"), {}) == {"all": "a thesis", "damping": "tank"}
    assert after(sourced(all="a thesis"), {"X_uu": BOAT.value("X_uu")}) == {"all": "a thesis"}
