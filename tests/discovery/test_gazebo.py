"""The main job on real Gazebo logs: what was put into the simulator is what the tool names, and nothing else.

Four runs travel with the repository, and one of them is the demo's, whose own test tells what is found in it with
linear damping; the others are read from the shared data where that lies beside the checkout.
"""

from functools import cache

import pytest
from places import ROOT, shared

from undertow.discovery.add_effects import add_effects
from undertow.discovery.basis import DiscoverySettings
from undertow.discovery.discover import Discovery, find_missing
from undertow.discovery.findings import FittedTerm
from undertow.measurements.prepared_logs import Inputs
from undertow.residuals.models.base import VehicleModel
from undertow.residuals.scores import RolloutRecord, rollout_scores
from undertow.workflows.inputs import read_inputs

HERE = ROOT / "tests" / "data"
LEVEL = ("B_4", "F_1", "H_1")
QUADRATIC = ("B_4", "C_1", "C_2", "D_1", "D_2", "E_2", "G_2", "H_1")
PLAIN = ("A_1", "A_2", "F_1")


@cache
def inputs_of(run: str, hull: str) -> Inputs:
    travelling = ROOT / "data" / "gazebo_blueboat.csv.gz" if run == "B_2" else HERE / f"{run}.csv.gz"
    path = travelling if travelling.is_file() else shared("gazebo") / f"{run}.csv.gz"
    return read_inputs(path, HERE / f"vehicle_{hull}{'_level' if run in LEVEL else ''}.yaml")


@cache
def discovered(run: str, hull: str = "linear") -> Discovery:
    inputs = inputs_of(run, hull)
    return find_missing(inputs.fitting, inputs.vehicle)


def errors(run: str, found: Discovery) -> tuple[RolloutRecord, RolloutRecord]:
    """Errors of the held-out rollouts of 10 s, before and after."""
    held_out = inputs_of(run, "linear").parts.judged
    vehicles = {"nominal": found.nominal, "corrected": found.corrected}
    before, after = (rollout_scores(VehicleModel(v, name), held_out, (10.0,)) for name, v in vehicles.items())
    return before["10"].record, after["10"].record


def terms(run: Discovery) -> dict[str, FittedTerm]:
    return {t.symbol: t for c in run.findings.candidates if c.verdict == "missing" for t in c.terms}


@pytest.mark.parametrize("run", QUADRATIC)
def test_quadratic_damping_is_named_where_it_was(run: str):
    found = discovered(run)
    named = set(found.findings.missing)
    assert "surge_quadratic_damping" in named
    # E_2 cannot tell the Munk moment from a coupling, and without either its yaw damping is anything: it is in play.
    yaw = next(c for c in found.findings.candidates if c.effect == "yaw_quadratic_damping")
    assert yaw.verdict != "no evidence"
    assert run == "E_2" or yaw.confidence > 0.5, "it removes 3 % of the error, and is more likely there than not"
    assert terms(found)["X_uu"].value == pytest.approx(-8.0, rel=0.05)


@pytest.mark.parametrize("run", PLAIN)
def test_quadratic_damping_is_not_named_where_it_was_not(run: str):
    named = set(discovered(run).findings.missing)
    assert not named & {"surge_quadratic_damping", "sway_quadratic_damping", "yaw_quadratic_damping"}
    assert named == {"munk_moment", "sway_lift"}


@pytest.mark.parametrize("run", ["D_1", "D_2"])
def test_the_weak_thruster_is_named_with_its_scale(run: str):
    found = discovered(run)
    assert "thruster_asymmetry" in found.findings.missing
    assert terms(found)["stbd_scale"].value == pytest.approx(0.8, abs=0.03)
    assert "port_scale" not in terms(found)


@pytest.mark.parametrize("run", ["C_1", "C_2"])
def test_the_current_is_named_within_three_centimetres_a_second(run: str):
    found = discovered(run)
    assert "steady_current" in found.findings.missing
    assert terms(found)["current_north"].value == pytest.approx(0.15, abs=0.03)
    assert terms(found)["current_east"].value == pytest.approx(0.25, abs=0.03)


@pytest.mark.parametrize("run", [r for r in (*QUADRATIC, *PLAIN) if r[0] not in "CD"])
def test_no_current_and_no_weak_thruster_where_there_was_none(run: str):
    assert not {"thruster_asymmetry", "steady_current"} & set(discovered(run).findings.missing)


@pytest.mark.parametrize("run", ["B_2", "B_4"])
def test_the_simulators_own_coefficients_lack_exactly_two_terms(run: str):
    found = discovered(run, "full")
    assert set(found.findings.missing) == {"munk_moment", "sway_lift"}
    assert terms(found)["N_uv"].value == pytest.approx(12.0, abs=0.5)
    assert terms(found)["Y_ur"].value == pytest.approx(6.0, abs=0.2)
    assert not found.findings.unnamed


def test_drag_that_drives_is_left_unnamed_rather_than_given_a_wrong_name():
    found = discovered("F_1").findings
    values = {(t.axis, t.form): t.value for t in found.unnamed}
    assert values == {
        ("surge", "u^2"): pytest.approx(-8.0, rel=0.02),
        ("sway", "v^2"): pytest.approx(80.0, rel=0.02),  # -80 about the FLU axes of the simulator
        ("yaw", "r^2"): pytest.approx(8.0, rel=0.02),
    }


@pytest.mark.parametrize("run", [*QUADRATIC, *PLAIN])
def test_the_rollout_error_falls_to_a_third_or_less(run: str):
    before, after = errors(run, discovered(run))
    shares = {name: after.of(name) / before.of(name) for name in ("surge", "sway", "yaw", "position")}
    assert max(shares.values()) <= 1 / 3, shares


@pytest.mark.parametrize("run", ["A_2", "C_2", "D_2"])
def test_adding_the_named_effects_by_hand_gives_the_same_model(run: str):
    found = discovered(run)
    inputs = inputs_of(run, "linear")
    names = [candidate.key for candidate in found.findings.candidates if candidate.in_model]
    again = add_effects(inputs.fitting, inputs.vehicle, names, DiscoverySettings())
    before, after = errors(run, again)
    assert after.position <= before.position / 3
    for symbol, term in terms(found).items():
        assert again.corrected.value(symbol) == pytest.approx(found.corrected.value(symbol), rel=0.01, abs=0.005), term


@pytest.mark.parametrize("run", ["A_2", "C_2", "D_2"])
def test_intervals_hold_what_was_put_into_the_simulator(run: str):
    found = terms(discovered(run))
    truth = {"X_uu": -8.0, "stbd_scale": 0.8, "current_north": 0.15, "current_east": 0.25}
    for symbol in set(truth) & set(found):
        interval = found[symbol].ci95
        assert interval is not None
        slack = 0.02 * abs(truth[symbol])  # the simulator pitches and rolls, the model does not
        assert interval.lower - slack <= truth[symbol] <= interval.upper + slack
