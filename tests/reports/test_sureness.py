"""How sure a name is, its numbers as a file has them, and the marks in a corrected vehicle file."""

from pathlib import Path

import pytest

from undertow.discovery.effect_findings import EffectFinding, FittedTerm
from undertow.discovery.findings import Calibrated, Findings
from undertow.discovery.search.estimation import Interval
from undertow.physics.presentation import MINUS, NARROW
from undertow.physics.sources import with_sources
from undertow.physics.vehicle import load_vehicle
from undertow.reports.sureness import comes_back, file_numbers, in_order, odds, source_marks, with_odds

BOAT = load_vehicle("blueboat").with_values({"X_u": -9.0, "X_uu": 0.0, "N_uv": 0.0})
HOW = "identified by undertow from log.csv"


def effect(
    name: str, verdict: str, sure: float, symbol: str = "", value: float = -8.0, **more: object
) -> EffectFinding:
    ends = Interval(value - 1.0, value + 1.0)
    term = FittedTerm(symbol=symbol, value=value, unit="N s/m", ci95=ends, in_model=value)
    content = {
        "effect": name,
        "verdict": verdict,
        "confidence": sure,
        "error_drop": 0.2,
        "terms": (term,) * bool(symbol),
    }
    return EffectFinding.model_validate({**content, **more})


@pytest.mark.parametrize(
    ("verdict", "sure", "said"),
    [
        ("missing", 0.97, "97 %"),
        ("missing", 1.0, "> 99 %"),
        ("likely", 0.87, "87 %"),
        ("possible", 0.4, "40 %"),
        ("possible", 0.999, ""),
        ("possible", 0.8, ""),
        ("no evidence", 0.003, "< 1 %"),
        ("missing", float("nan"), ""),
    ],
)
def test_odds_agree_with_the_verdict_or_are_not_told(verdict: str, sure: float, said: str):
    found = effect("munk_moment", verdict, sure)
    assert odds(found).replace(NARROW, " ") == said
    assert with_odds(found).replace(NARROW, " ") == f"Munk moment ({said})" if said else "Munk moment"


def test_the_worth_of_a_claim_stands_in_the_place_of_the_share_of_its_axis():
    plain = effect("munk_moment", "likely", 0.9)
    claim = {"gain": 9.0, "identity": 2.0, "worth": {"force": 0.55}, "null_excluded": True}
    assert comes_back(plain).replace(NARROW, " ") == "20 %"
    assert comes_back(plain.but(claim=claim)).replace(NARROW, " ") == "55 %"
    assert comes_back(plain.but(verdict="possible", reason="not_excited")) == ""


def test_verdict_comes_before_odds_and_what_the_log_cannot_show_after_what_it_can():
    unseen = effect("yaw_trim", "possible", 0.7, reason="not_excited")
    rows = [unseen, effect("sway_lift", "possible", 0.1), effect("cg_offset", "likely", 0.81)]
    rows += [effect("munk_moment", "missing", 0.95), effect("mass_offset", "likely", 0.9)]
    assert [item.effect for item in in_order(rows)] == [
        *("munk_moment", "mass_offset", "cg_offset"),
        *("sway_lift", "yaw_trim"),
    ]


def test_names_of_one_verdict_stand_in_the_order_of_the_columns_that_are_shown():
    hidden = effect("yaw_trim", "possible", 0.99)  # its odds contradict the verdict, and are not shown
    rows = [hidden, effect("sway_lift", "possible", 0.3), effect("sway_trim", "possible", 0.99, error_drop=0.4)]
    assert [item.effect for item in in_order(rows)] == ["sway_lift", "sway_trim", "yaw_trim"]


def test_a_wrong_number_of_the_file_is_told_as_such_and_a_new_one_as_new():
    (wrong,) = file_numbers(effect("surge_linear_damping", "missing", 0.99, "X_u"), BOAT)
    assert (wrong.value, wrong.ci95, wrong.in_file) == (-17.0, (-18.0, -16.0), -9.0)
    assert (
        wrong.told(minus="-").replace(NARROW, " ")
        == "X_u is about -17.0 N s/m (95 %: -18.0 to -16.0), the file says -9.00"
    )
    assert MINUS in wrong.told()
    (new,) = file_numbers(effect("surge_quadratic_damping", "missing", 0.99, "X_uu"), BOAT)
    assert (new.value, new.in_file) == (-8.0, None)
    assert new.told(minus="-").replace(NARROW, " ") == "X_uu = -8.0 N s/m (95 %: -9.0 to -7.0)"
    (whole,) = file_numbers(effect("thrust_scale", "missing", 0.99, "thrust_scale", 0.8), BOAT)
    assert (whole.value, whole.in_file) == (0.8, None)
    (mass,) = file_numbers(effect("mass_offset", "likely", 0.9, "mass", 3.0), BOAT)
    assert (mass.value, mass.in_file) == (BOAT.mass + 3.0, BOAT.mass)


def test_a_corrected_file_says_of_each_number_how_sure_it_is(tmp_path: Path):
    candidates = (
        effect("surge_linear_damping", "missing", 0.97, "X_u"),
        effect("surge_quadratic_damping", "likely", 0.85, "X_uu"),
        effect("munk_moment", "possible", 0.4, "N_uv"),
        effect("sway_lift", "no evidence", 0.1, "Y_ur").but(terms=()),
    )
    own = Calibrated(symbol="mass", before=22.0, after=25.0, wanted=25.0, unit="kg")
    findings = Findings(verdict="missing", missing=(), candidates=candidates, calibrated=(own,))
    marks = source_marks(findings)
    changed = BOAT.with_values({"X_u": -17.0, "X_uu": -8.0, "N_uv": -8.0, "mass": 25.0, "Y_v": -3.0})
    bare = changed.model_copy(update={"sources": {"mass": "scale"}})
    with_sources(BOAT, bare, HOW, marks).save(tmp_path / "model.yaml")
    assert load_vehicle(tmp_path / "model.yaml").sources == {
        "mass": f"calibrated: {HOW}; before: scale",
        "damping": f"X_u missing (97 %), X_uu likely (85 %), Y_v: {HOW}",
        "coupling": f"N_uv possible (40 %): {HOW}",
    }
