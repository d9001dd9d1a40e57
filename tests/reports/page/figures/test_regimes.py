"""Regimes sort every row once, their shares sum to one, and a planted failure is found and described."""

import re

import numpy as np
import pandas as pd
import pytest
from sample_run import failures

from undertow.comparison.failing.features import splits
from undertow.reports.page.figures.error_figures import regime_table
from undertow.residuals.series import SeriesTable

ACCELERATIONS = ("u_dot", "v_dot", "r_dot")


@pytest.fixture
def series():
    """A boat that wanders through all speeds, rates, commands and headings; its model errs by white noise."""
    rng = np.random.default_rng(0)
    count = 4000
    speed = 0.5 + 1.3 * np.sin(np.linspace(0.0, 37.0, count))
    columns = {
        "u": speed,
        "v": rng.normal(0.0, 0.1, count),
        "r": 0.6 * np.sin(np.linspace(0.0, 91.0, count)),
        "psi": np.linspace(0.0, 40.0, count) % (2.0 * np.pi),
        "newton_port": 20.0 * np.sin(np.linspace(0.0, 53.0, count)),
        "newton_stbd": 20.0 * np.sin(np.linspace(0.0, 61.0, count)),
    }
    for name in ACCELERATIONS:
        columns[name] = rng.normal(0.0, 1.0, count)
        columns[f"{name}_before"] = columns[name] + rng.normal(0.0, 0.05, count)
        columns[f"{name}_after"] = columns[name] + rng.normal(0.0, 0.05, count)
    return pd.DataFrame(columns)


def test_shares_sum_to_one(series):
    table = regime_table(series)
    assert set(table["by"]) == {"surge speed", "yaw rate", "command", "heading"}
    sums = table.groupby(["by", "axis"])[["share_of_error", "share_of_rows"]].sum().to_numpy()
    np.testing.assert_allclose(sums, 1.0)
    # The filter has nothing to go on at both ends of a stretch, and errs there.
    assert (table.groupby(["by", "axis"])["rows"].sum() == len(series) - 2 * 8).all()


def test_error_by_regime_adds_up_to_the_whole(series):
    table = regime_table(series).query("by == 'heading' and axis == 'yaw'")
    inner = series.iloc[8:-8]
    whole = np.mean((inner["r_dot_before"] - inner["r_dot"]) ** 2)
    assert (table["rmse"] ** 2 * table["share_of_rows"]).sum() == pytest.approx(whole)


def test_shares_of_a_perfect_model_are_those_of_the_rows(series):
    for name in ACCELERATIONS:
        series[f"{name}_after"] = series[name]
    table = regime_table(series, "after")
    assert (table["rmse"] == 0.0).all()
    assert (table["share_of_error"] == table["share_of_rows"]).all()
    assert failures(SeriesTable.of(series), "after") == []


def test_even_error_is_no_failure(series):
    assert failures(SeriesTable.of(series)) == []


def test_planted_failure_at_speed_is_found(series):
    ahead = (series["u"] > 1.4) & (series["newton_port"] + series["newton_stbd"] > 0.0)
    series.loc[ahead, "u_dot_before"] += 1.0
    worst = failures(SeriesTable.of(series))[0]
    assert worst.axis == "surge"
    assert re.fullmatch(r"surge speed (above 1\.4|1\.4 to 1\.8) m/s, thrust ahead", worst.where)
    assert worst.share_of_error > 0.6 > 2.0 * (worst.share_of_rows or 1.0)
    assert worst.unit == "m/s^2"
    assert failures(SeriesTable.of(series), "after") == []


def test_planted_failure_in_a_turn_astern_is_found(series):
    both = (series["newton_port"] < -2.0) & (series["newton_stbd"] < -2.0)
    series.loc[both & (series["r"] < -0.2) & (series["u"] < 0.0), "r_dot_after"] += 0.8
    worst = failures(SeriesTable.of(series), "after")[0]
    assert worst.axis == "yaw"
    assert "(to port)" in worst.where or "both thrusters astern" in worst.where
    assert worst.model == "after"


def test_planted_failure_on_a_heading_is_found(series):
    series.loc[np.abs(series["psi"] - np.pi / 2.0) < 0.7, "v_dot_before"] += 1.0
    worst = failures(SeriesTable.of(series))[0]
    assert (worst.axis, worst.where) == ("sway", "heading within 40 degrees of east")


def test_few_places_are_named_and_none_twice(series):
    for name in ACCELERATIONS:
        series.loc[series["u"] > 1.4, f"{name}_before"] += 1.0
    found = failures(SeriesTable.of(series))
    assert len(found) <= 4
    assert len({(place.axis, place.where) for place in found}) == len(found)
    assert failures(SeriesTable.of(series), limit=1) == found[:1]


def test_rows_without_a_prediction_do_not_count(series):
    series.loc[:999, "u_dot_before"] = np.nan
    table = regime_table(series).query("by == 'command'")
    assert (
        table.query("axis == 'surge'")["rows"].sum() == len(series) - 1000 - 8
    )  # nor do the edges, 0.8 s at both ends
    assert table.query("axis == 'yaw'")["rows"].sum() == len(series) - 16


@pytest.mark.parametrize(
    ("port", "stbd", "speed", "state"),
    [
        (0.0, 0.5, 1.0, "thrusters idle"),
        (10.0, 12.0, 1.0, "both thrusters ahead"),
        (-10.0, -20.0, -1.0, "both thrusters astern"),
        (10.0, -10.0, 1.0, "thrusters opposed to turn"),
        (-10.0, -12.0, 1.0, "thrust against the motion"),
        (-10.0, -12.0, 0.05, "both thrusters astern"),
    ],
)
def test_commands_are_told_apart(series, port, stbd, speed, state):
    series.loc[0, ["newton_port", "newton_stbd", "u"]] = port, stbd, speed
    command = splits(SeriesTable.of(series))[2]
    assert command.labels[command.codes[0]] == state


def test_pwm_is_counted_from_neutral(series):
    pwm = series.rename(columns={"newton_port": "pwm_port", "newton_stbd": "pwm_stbd"})
    pwm[["pwm_port", "pwm_stbd"]] = 1500.0 + 20.0 * pwm[["pwm_port", "pwm_stbd"]]
    assert (splits(SeriesTable.of(pwm))[2].codes == splits(SeriesTable.of(series))[2].codes).all()


def test_log_without_commands_has_one_state(series):
    bare = series.drop(columns=["newton_port", "newton_stbd"])
    assert splits(SeriesTable.of(bare))[2].labels == ("no command in the log",)
    assert len(failures(SeriesTable.of(bare))) == 0


def test_boat_at_rest_is_sorted_too(series):
    series[["u", "r", "psi"]] = 0.0
    sums = regime_table(series).groupby(["by", "axis"])["share_of_rows"].sum()
    np.testing.assert_allclose(sums, 1.0)
