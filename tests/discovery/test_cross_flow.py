"""Cross-flow drag from files: named where the vehicle file states the hull, and no crash where it does not."""

from pathlib import Path

import numpy as np
import pytest

import undertow
from undertow.discovery.basis import DiscoverySettings, choose_balance
from undertow.discovery.candidates.candidate import beyond_any_hull, candidates
from undertow.discovery.discover import find_missing
from undertow.discovery.search import floating
from undertow.discovery.search.floating import Search
from undertow.physics.errors import RequestError
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.hidden_effects import with_hull
from undertow.physics.worlds.world import simulate_world

C_D = 0.7


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log with hidden cross-flow drag, and two vehicle files: one that states the hull, one that does not."""
    place = tmp_path_factory.mktemp("across")
    bare = load_vehicle("blueboat_paper")
    boat = with_hull(bare, np.random.default_rng(1))
    boat.save(place / "boat.yaml")
    bare.save(place / "bare.yaml")
    simulate_world(boat, {"cross_flow_drag": C_D}, duration=180.0, noise="field", seed=5).write(place / "log.csv")
    return place


def test_it_is_named_exactly_where_the_file_states_the_hull(folder: Path) -> None:
    run = undertow.discover(undertow.read_inputs(folder / "log.csv", folder / "boat.yaml"))
    findings = run.findings
    assert (findings.missing, findings.unnamed) == (("cross_flow_drag",), ())
    (term,) = findings.candidates[0].terms
    assert (term.symbol, term.unit) == ("cross_flow", "1")
    assert term.value == pytest.approx(C_D, rel=0.02)
    assert term.ci95 is not None
    assert term.ci95.lower < C_D < term.ci95.upper
    assert findings.passivity is not None
    assert (findings.passivity.verdict, findings.passivity.proof) == ("pass", "vertex LMI")
    corrected = run.discovery.corrected
    corrected.save(folder / "model.yaml")
    again: Vehicle = load_vehicle(folder / "model.yaml")
    assert again.hull == corrected.hull == load_vehicle(folder / "boat.yaml").hull
    assert again.value("cross_flow") == pytest.approx(C_D, rel=0.02)


@pytest.mark.parametrize(
    ("hidden", "seed"), [({"yaw_quadratic_damping": -300.0}, 1), ({"yaw_linear_damping": -60.0}, 2)], ids=str
)
def test_what_no_hull_has_gives_way_to_what_acts(hidden: dict[str, float], seed: int) -> None:
    """In gentle driving a drag coefficient of a dozen explains as much: the noise that it lets in hides the rest."""
    boat = load_vehicle("otter")
    log = simulate_world(boat, hidden, programme="gentle", duration=120.0, noise="field", seed=seed)
    findings = find_missing([log.motion()], boat).findings
    assert [c.key for c in findings.candidates if c.verdict in ("missing", "likely")] == list(hidden)
    assert findings.candidates[0].terms[0].value == pytest.approx(next(iter(hidden.values())), rel=0.1)
    assert "cross_flow_drag" not in {c.key for c in findings.candidates if c.in_model}
    assert findings.folds is not None
    assert findings.folds.named == dict.fromkeys(hidden, findings.folds.count)


def test_without_a_hull_other_names_stand_in_and_nothing_crashes(folder: Path) -> None:
    run = undertow.discover(undertow.read_inputs(folder / "log.csv", folder / "bare.yaml"))
    assert "cross_flow_drag" not in {c.effect for c in run.findings.candidates}
    assert run.findings.verdict != "nothing missing"
    assert run.discovery.corrected.value("cross_flow") == 0.0


def test_it_is_added_by_name_where_the_file_states_the_hull(folder: Path) -> None:
    found = undertow.add(["cross_flow_drag"], undertow.read_inputs(folder / "log.csv", folder / "boat.yaml"))
    assert found.discovery.corrected.value("cross_flow") == pytest.approx(C_D, rel=0.02)
    bare = undertow.read_inputs(folder / "log.csv", folder / "bare.yaml")
    with pytest.raises(RequestError, match=r"add: cross_flow_drag needs the size of the hull: give hull: \{leng"):
        undertow.add(["cross_flow_drag"], bare)


def test_what_is_fitted_beside_every_model_stays_wherever_it_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """The offset of the commands at its own limit is the log's, and no name to be replaced."""
    boat = load_vehicle("otter")
    log = simulate_world(boat, {"yaw_quadratic_damping": -300.0}, programme="gentle", duration=120.0, seed=1)
    basis = choose_balance([log.motion()], boat, DiscoverySettings())
    search = Search(basis.balance(), boat, basis.pool, basis.settings.search)
    state = search.evaluate(boat.with_values({"cross_flow": 5.0}), ("cross_flow_drag",))
    assert "command_offset" in state.active
    monkeypatch.setattr(
        floating, "beyond_any_hull", lambda c, before, found: c.key in ("cross_flow_drag", "command_offset")
    )
    assert search._within_limits(state, print).active == ("command_offset", "yaw_quadratic_damping")


@pytest.mark.parametrize(
    ("key", "file", "found", "beyond"),
    [
        ("cross_flow_drag", {}, {"cross_flow": 5.0}, True),
        ("cross_flow_drag", {"cross_flow": 1.1}, {"cross_flow": 0.0}, False),
        ("advance_loss", {"advance_loss": 15.0}, {"advance_loss": 0.0}, False),
        ("thruster_asymmetry[port]", {}, {"port_scale": 0.0}, False),
        ("sway_added_mass", {}, {"Y_vdot": 0.0}, True),
        ("cg_offset", {}, {"x_g": 2.0}, True),
    ],
    ids=str,
)
def test_a_boat_may_have_nothing_of_a_thing_but_of_mass(
    key: str, file: dict[str, float], found: dict[str, float], beyond: bool
) -> None:
    boat = load_vehicle("otter").with_values(file)
    (candidate,) = (c for c in candidates(boat) if c.key == key)
    assert beyond_any_hull(candidate, boat, boat.with_values(found)) is beyond
