"""A limits file is read strictly, in words, and written so that it reads back as it was."""

import math
from pathlib import Path

import pytest

from undertow.comparison.error_limits import Limits, held, limits_from_dict, load_limits, with_margin
from undertow.comparison.facts import ComparedModel
from undertow.physics.errors import RequestError
from undertow.physics.reading import parse_yaml
from undertow.residuals.scores import AccelerationRecord, ByAxis, RolloutRecord

ERRORS = RolloutRecord(position=1.0, surge=0.1, sway=0.05, yaw=0.2, diverged=0, starts=40)
STEPS = AccelerationRecord(rmse=ByAxis(surge=0.3, sway=0.1, yaw=0.4))


def model(**more: object) -> ComparedModel:
    return ComparedModel.model_validate(
        {"name": "boat", "rollout": {"10": ERRORS}, "acceleration": STEPS, "audit": "pass", **more}
    )


def test_what_is_written_reads_back(tmp_path: Path) -> None:
    made = Limits.model_validate(
        {"predictions": {"2": {"yaw": 0.1}, 10: {"position": 1.5, "surge": 1e-6}}, "acceleration": {"sway": 2.0}}
    )
    assert load_limits(made.save(tmp_path / "limits.yaml", "made\nup")) == made
    assert made.horizons == (2.0, 10.0)
    assert "  10: {position: 1.5, surge: 1e-06}  # m, m/s\n" in made.text()
    assert parse_yaml(made.text())["acceleration"] == {"sway": 2.0}


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("predictions: {10: {positon: 1}}", "unknown key 'positon' in predictions.10: did you mean 'position'"),
        ("acceleration: {position: 1}", "unknown key 'position' in acceleration; there are surge, sway, yaw"),
        ("predicitons: {10: {surge: 1}}", "unknown key 'predicitons' in the limits file: did you mean 'predictions'"),
        ("predictions: {ten: {surge: 1}}", "predictions: expected seconds ahead, .*such as 10, got 'ten'"),
        ("predictions: {0: {surge: 1}}", "expected seconds ahead, 0.1 to 600"),
        ("predictions: {0.04: {surge: 1}}", "expected seconds ahead, 0.1 to 600"),
        ("predictions: {1e9: {surge: 1}}", "expected seconds ahead, 0.1 to 600"),
        ("predictions: {10: {surge: 1}, '10.0': {sway: 1}}", "10 s stands twice; keep one"),
        ("predictions: {10: {surge: 0}}", "predictions.10.surge: expected a number above 0, got 0"),
        ("predictions: {10: {surge: true}}", "predictions.10.surge: expected a number, got True"),
        ("predictions: {10: {surge: 1 m}}", "predictions.10.surge: expected a number, got '1 m'"),
        ("predictions: {10: 3}", "predictions.10: expected lines of 'key: value', got 3"),
        ("predictions: [10]", r"predictions: expected lines of 'key: value', got \[10\]"),
        ("laws: yes", "laws: expected 'pass', got"),
        ("{}", "expected at least one limit, as in 'predictions: {10: {position: 1.5}}'"),
        ("predictions: {10: {}}", "expected at least one limit"),
        ("- 10", "expected the keys predictions, acceleration and laws, got"),
        ("a: [", "cannot be read"),
    ],
)
def test_what_is_no_limit_is_refused_in_words(text: str, match: str, tmp_path: Path) -> None:
    (tmp_path / "limits.yaml").write_text(text, "utf-8")
    with pytest.raises(RequestError, match=f"limits.yaml.*{match}"):
        load_limits(tmp_path / "limits.yaml")


def test_a_file_that_is_not_there_is_said_how_to_make(tmp_path: Path) -> None:
    with pytest.raises(RequestError, match="but there is none; 'undertow ci LOG --vehicle V --write-limits"):
        load_limits(tmp_path / "limits.yaml")


def test_a_limit_holds_up_to_itself_and_no_further() -> None:
    for limit, holds in ((1.0, True), (1.0 - 1e-6, False)):
        (row,) = held(model(), limits_from_dict({"predictions": {10: {"position": limit}}}, "limits"))
        assert (row.holds, row.measured, row.unit, row.axis) == (holds, 1.0, "m", "position")


def test_an_error_that_is_no_number_holds_nothing() -> None:
    lost = ERRORS.but(position=math.nan, diverged=3)
    (row,) = held(model(rollout={"10": lost}), limits_from_dict({"predictions": {10: {"position": 9.0}}}, "limits"))
    assert (row.holds, row.told) == (False, "3 of 40 ran away")
    with pytest.raises(RequestError, match="not finite, so no limit can be made"):
        with_margin(STEPS, {"10": lost}, 0.2, lawful=True)


def test_broken_laws_are_named() -> None:
    laws = [
        {"law": "dissipation", "verdict": "fail"},
        {"law": "bounded speed", "verdict": "pass"},
        {"law": "mirror symmetry", "verdict": "fail", "counts": False},
    ]
    (row,) = held(model(laws=laws, audit="fail"), limits_from_dict({"laws": "pass"}, "limits"))
    assert (row.holds, row.measured, row.told) == (False, 1.0, "dissipation")


def test_a_prediction_that_no_log_has_room_for_is_refused() -> None:
    with pytest.raises(RequestError, match="30: no stretch of the logs is longer than 30 s"):
        held(model(), limits_from_dict({"predictions": {30: {"yaw": 1.0}}}, "limits"))


def test_first_limits_are_rounded_up_and_hold() -> None:
    made = with_margin(STEPS, {"10": ERRORS}, 0.2, lawful=True)
    assert made.predictions[10.0].given() == {"position": 1.2, "surge": 0.12, "sway": 0.06, "yaw": 0.24}
    assert made.acceleration.given() == {"surge": 0.36, "sway": 0.12, "yaw": 0.48}
    for margin in (0.0, 0.013, 0.2):
        limits = with_margin(STEPS, {"10": ERRORS.but(position=0.123456)}, margin, lawful=True)
        rows = held(model(rollout={"10": ERRORS.but(position=0.123456)}), limits)
        assert all(row.holds and row.measured * (1.0 + margin) <= row.limit * (1.0 + 1e-9) for row in rows)
    assert with_margin(STEPS, {"10": ERRORS.but(sway=0.0)}, 0.2, lawful=False).predictions[10.0].sway == 1e-6
