"""The terminal tables hold every number at 80 columns and survive brackets, nulls and pipes."""

import io

import pytest
from rich.console import Console

from undertow.reports.terminal import (
    candidates_table,
    comparison_table,
    failures_table,
    inspection_table,
    steps_table,
)

ERRORS = {"surge": 0.35, "sway": 0.23, "yaw": 0.486}
ROLLOUT = {"2": {**ERRORS, "position": 0.4}, "10": {**ERRORS, "position": 2.26, "diverged": 1, "starts": 60}}
FINDINGS = {
    "steps": [
        {"added": None, "acceleration_rmse": ERRORS, "rollout_rmse": ROLLOUT},
        {"added": "surge_quadratic_damping", "acceleration_rmse": ERRORS, "rollout_rmse": {"10": {"position": None}}},
    ],
    "candidates": [
        {
            "effect": "thruster_asymmetry",
            "verdict": "missing",
            "confidence": 0.999,
            "error_drop": 0.41,
            "indistinguishable_from": ["thrust_scale"],
            "terms": [{"symbol": "stbd_scale", "value": 0.806, "unit": "1", "ci95": [0.79, 0.82]}],
        },
        {"effect": "yaw_trim", "verdict": "no evidence", "confidence": 0.1, "error_drop": 0.0, "terms": []},
    ],
    "failures": [{"where": "surge speed 1 to 1.5 m/s [red]", "axis": "surge", "share_of_error": 0.62}],
}
COMPARISON = {
    "split": "test",
    "models": [
        {"name": name, "acceleration": {"rmse": ERRORS}, "rollout": ROLLOUT, "audit": "pass"}
        for name in ("nominal", "corrected [x]")
    ],
    "failures": [{"model": "nominal", "where": "astern", "axis": "yaw", "share_of_error": 0.5, "share_of_rows": 0.1}],
}
INSPECTION = {
    "schema": "undertow.inspection/1",
    "path": "B_2.csv.gz",
    "channels": ({"name": "u", "unit": "m/s", "count": 4800, "rate": 20.0, "gaps": 0, "noise": None},),
    "alignment": ({"first": "a", "second": "b", "offset": None, "sentence": "b follows a by 0.02 s."},),
    "plan": {"rate": 10.0, "missing": (), "notes": ("one gap is too long to bridge",)},
    "notes": ("frame ENU, converted",),
    "unused": (),
}


def printed(table, width=80):
    stream = io.StringIO()
    Console(file=stream, width=width).print(table)
    text = stream.getvalue()
    assert "\x1b" not in text
    assert max(map(len, text.splitlines())) <= width
    return text


@pytest.mark.parametrize("width", [80, 100])
def test_steps_keep_all_numbers(width):
    text = printed(steps_table(FINDINGS), width)
    assert "nominal model" in text
    assert "+ surge quadratic damping" in text
    assert "0.486" in text
    assert "2.26" in text
    assert "n/a" in text


def test_candidates_give_value_interval_and_twins():
    text = printed(candidates_table(FINDINGS), 100)
    assert "stbd_scale = 0.806 (0.790 to 0.820)" in text
    assert "(or thrust scale)" in text
    assert "41\N{NO-BREAK SPACE}%" in text
    assert "and 1 more in findings.json" in printed(candidates_table(FINDINGS, most=1))


def test_failures_from_either_file_or_a_list():
    assert "surge speed 1 to 1.5 m/s [red]" in printed(failures_table(FINDINGS))
    assert printed(failures_table(COMPARISON)) == printed(failures_table(COMPARISON["failures"]))


def test_comparison_has_a_column_per_model():
    text = printed(comparison_table(COMPARISON))
    assert "corrected [x]" in text
    assert "10 s position" in text
    assert "1 of 60" in text


def test_inspection_shows_channels_plan_and_notes():
    text = printed(inspection_table(INSPECTION))
    assert "4800" in text
    assert "frame ENU, converted" in text
    assert "b follows a by 0.02 s." in text
    assert "one gap is too long to bridge" in text
