"""Looks at an error that was planted: its place in words, its spectrum, its drift, and logs that cannot tell."""

import numpy as np
import pandas as pd
import pytest
from sample_run import failures

from undertow.comparison.failing.features import doing, features, merged
from undertow.comparison.failing.frequency import against_frequency, against_lag
from undertow.comparison.failing.places import segments, worst_places
from undertow.comparison.failing.rows import EDGE, Scene, fit_with_nuisances, scene
from undertow.comparison.failing.trends import against_heading, over_time
from undertow.residuals.series import SeriesTable

ACCELERATIONS = ("u_dot", "v_dot", "r_dot")


def table(seed: int = 0, seconds: float = 300.0, turns: float = 1.0) -> pd.DataFrame:
    """A boat that wanders under random steps of command, and a model that errs by smooth noise alone."""
    rng = np.random.default_rng(seed)
    count = round(10.0 * seconds)
    time = 0.1 * np.arange(count)

    def smooth(width: int) -> np.ndarray:
        noise = np.convolve(rng.normal(size=count + width), np.hanning(width), "valid")[:count]
        return noise / noise.std()

    steps = np.repeat(rng.uniform(-0.5, 1.0, (count // 30 + 1, 2)), 30, axis=0)[:count]
    columns = {
        "time": time,
        "log": 0,
        "part": "test",
        "u": 0.6 + 0.6 * smooth(60),
        "v": 0.15 * smooth(50),
        "r": 0.4 * smooth(40),
        "psi": turns * np.cumsum(0.05 * (1.0 + 0.5 * smooth(80))),
        "newton_port": 20.0 * steps[:, 0],
        "newton_stbd": 20.0 * steps[:, 1],
    }
    for name in ACCELERATIONS:
        columns[name] = smooth(20)
        for model in ("before", "after"):
            columns[f"{name}_{model}"] = columns[name] + 0.1 * smooth(6)
    return pd.DataFrame(columns)


def at(rows: pd.DataFrame, model: str = "before") -> Scene:
    return scene(SeriesTable.of(rows), model)


def thrust_of(rows: SeriesTable) -> np.ndarray:
    push = rows[["newton_port", "newton_stbd"]]
    return np.column_stack([push.mean(axis=1), 0.0 * push[:, 0], push[:, 0] - push[:, 1]]) / 20.0


@pytest.mark.parametrize("seed", range(8))
def test_smooth_noise_is_no_failure_of_any_kind(seed: int):
    stage = at(table(seed))
    assert worst_places(stage) == []
    assert segments(stage) == []
    assert not {one.verdict for one in against_heading(stage).values()} & {"depends on heading"}
    assert not {one.verdict for one in over_time(stage).values()} & {"drifts", "grows", "shrinks"}
    assert not [one for one in against_lag(stage, thrust_of(stage.table)).values() if one.suspects]


@pytest.mark.parametrize(
    ("mask", "words"),
    [
        (lambda d: d["r"] > 0.3, "turning faster than 0.3 rad/s to starboard"),
        (lambda d: d["r"] < -0.3, "turning faster than 0.3 rad/s to port"),
        (lambda d: d["r"].abs() > 0.5, "turning faster than 0.5 rad/s"),
        (lambda d: d["u"] > 1.2, "surge speed above 1.2 m/s"),
        (lambda d: d["v"].abs() > 0.2, "sway speed above 0.2 m/s to either side"),
        (lambda d: np.cos(d["psi"]) < -0.8, "heading within 35 degrees of south"),
    ],
)
def test_a_planted_regime_is_found_in_words_that_hold(mask, words: str):
    rows = table(3)
    rows.loc[mask(rows), "u_dot_before"] += 1.0
    worst = failures(SeriesTable.of(rows))[0]
    assert (worst.axis, worst.where) == ("surge", words)
    assert worst.share_of_error > 0.8 > 2.0 * (worst.share_of_rows or 1.0)
    assert failures(SeriesTable.of(rows), "after") == []


def test_the_moment_after_a_command_change_is_a_regime():
    rows = table(4)
    since = at(rows).since
    rows.loc[since < 0.55, "r_dot_before"] += 1.0
    assert failures(SeriesTable.of(rows))[0].where == "within 0.5 s of a command change"


def test_a_failure_of_one_half_of_the_log_alone_is_not_told():
    rows = table(5)
    rows.loc[(rows["u"] > 1.2) & (rows["time"] < 40.0), "u_dot_before"] += 1.0  # two visits prove nothing
    assert (at(rows).block[(rows["u"] > 1.2) & (rows["time"] < 40.0)]).size > 0
    told = failures(SeriesTable.of(rows))
    assert [place.where for place in told if place.where.startswith("surge speed above")] == []


def test_a_log_of_seconds_names_no_place():
    rows = table(6, seconds=30.0)
    rows.loc[rows["u"] > 0.8, "u_dot_before"] += 1.0
    assert failures(SeriesTable.of(rows)) == []


def test_rows_at_the_edges_of_a_stretch_do_not_count():
    rows = table(7)
    rows.loc[len(rows) - 8 :, "r_dot_before"] += 100.0
    assert worst_places(at(rows)) == []
    assert segments(at(rows)) == []
    assert np.isnan(at(rows).error[: round(EDGE / 0.1)]).all()


def test_a_modulus_is_told_with_its_quantity():
    found = features(at(table(8)))
    ((one, ends),) = merged({"turn rate": (0.3, np.inf), "yaw rate": (-0.1, np.inf)}, found)
    assert one.phrase(*ends) == "turning faster than 0.3 rad/s to starboard"
    ((one, ends),) = merged({"turn rate": (0.3, 0.8), "yaw rate": (-np.inf, 0.0)}, found)
    assert one.phrase(*ends) == "turning at 0.3 to 0.8 rad/s to port"
    both = merged({"turn rate": (-np.inf, 0.3), "yaw rate": (-0.1, np.inf)}, found)
    assert [one.name for one, _ in both] == ["turn rate", "yaw rate"]


@pytest.mark.parametrize(
    ("speed", "rate", "said"),
    [
        (0.0, 0.0, "nearly still, thrusters idle"),
        (1.2, 0.0, "going ahead at 1.2 m/s, thrusters idle"),
        (-0.8, 0.3, "turning to starboard astern at 0.80 m/s, thrusters idle"),
        (0.0, -0.4, "turning to port on the spot, thrusters idle"),
    ],
)
def test_what_the_boat_was_doing(speed: float, rate: float, said: str):
    rows = table(9)
    rows.loc[:100, ["u", "r", "newton_port", "newton_stbd"]] = speed, rate, 0.0, 0.0
    stage = at(rows)
    assert doing(stage, np.arange(len(rows)) <= 100) == said


def test_an_error_that_moves_with_a_speed_is_slow_and_coherent():
    rows = table(10)
    rows["r_dot_before"] += 0.8 * rows["v"] / rows["v"].std()
    found = against_frequency(at(rows))["yaw"]
    assert (found.verdict, found.coherent_with) == ("slow force", "sway speed")
    assert found.sentence.startswith("80")


def test_spectra_hold_the_power_of_the_error():
    rows = table(11)
    rows["u_dot_before"] = rows["u_dot"] + np.sin(2.0 * np.pi * 0.5 * rows["time"])
    found = against_frequency(at(rows))["surge"]
    hz, power = np.array(found.hz), np.array(found.error)
    assert hz[power.argmax()] == pytest.approx(0.5, abs=0.05)
    assert power.sum() * (hz[1] - hz[0]) == pytest.approx(0.5, rel=0.05)


def test_a_drift_is_measured_beside_what_the_boat_does():
    rows = table(12)
    rows["u_dot_before"] += 0.2 * rows["time"] / 60.0
    found = over_time(at(rows))["surge"]
    assert found.verdict == "drifts"
    assert found.ci95 is not None
    assert found.per_minute is not None
    assert found.ci95[0] < found.per_minute < found.ci95[1]
    assert found.per_minute == pytest.approx(0.2, rel=0.1)
    assert over_time(at(rows, "after"))["surge"].verdict == "steady"


def test_an_error_that_grows_is_told():
    rows = table(13)
    rows["v_dot_before"] = rows["v_dot"] + (rows["v_dot_before"] - rows["v_dot"]) * (1.0 + rows["time"] / 60.0)
    assert over_time(at(rows))["sway"].verdict == "grows"


def test_a_short_log_cannot_tell_a_drift_a_heading_or_a_spectrum():
    stage = at(table(14, seconds=20.0, turns=0.1))
    assert {one.verdict for one in over_time(stage).values()} == {"this log cannot tell"}
    assert {one.verdict for one in against_heading(stage).values()} == {"this log cannot tell"}
    assert {one.verdict for one in against_frequency(stage).values()} == {"this log cannot tell"}
    assert {one.verdict for one in against_lag(stage, thrust_of(stage.table)).values()} == {"this log cannot tell"}


def test_a_boat_that_keeps_its_heading_cannot_tell_a_current():
    rows = table(15, turns=0.002)
    rows["u_dot_before"] += 0.5
    found = against_heading(at(rows))["surge"]
    assert found.verdict == "this log cannot tell"
    assert found.harmonic is None
    assert found.mean.count(None) >= 6


def test_a_push_fixed_in_the_earth_points_where_it_pushes():
    rows = table(16)
    towards = np.radians(70.0)
    rows["u_dot_before"] -= 0.5 * np.cos(rows["psi"] - towards)  # the model lacks the push
    rows["v_dot_before"] += 0.5 * np.sin(rows["psi"] - towards)
    found = against_heading(at(rows))
    for axis in ("surge", "sway"):
        harmonic = found[axis].harmonic
        assert harmonic is not None
        assert harmonic.direction == pytest.approx(70.0, abs=5.0)
        assert harmonic.amplitude == pytest.approx(0.5, rel=0.1)
        assert found[axis].suspects == ("steady_current", "mean_wind")


def test_a_compass_error_shows_in_sway_with_the_speed():
    rows = table(17)
    rows["v_dot_before"] += 0.6 * rows["u"] * np.cos(rows["psi"])
    found = against_heading(at(rows))
    assert found["sway"].suspects == ("compass",)
    assert found["surge"].suspects == ()


def test_intervals_cover_the_truth_in_noise_with_memory():
    hits = 0
    for seed in range(60):
        rows = table(100 + seed, seconds=200.0)
        stage = at(rows)
        asked = np.cos(rows["psi"].to_numpy())[:, None]
        noise = np.convolve(np.random.default_rng(seed).normal(size=len(rows) + 40), np.hanning(40), "valid")[
            : len(rows)
        ]
        fit = fit_with_nuisances(stage, 0.3 * asked[:, 0] + 0.1 * noise, asked, np.ones((len(rows), 1)))
        assert fit is not None
        low, high = fit.interval(0)
        hits += low <= 0.3 <= high
    assert hits >= 52  # of 60; 57 are expected of a 95 % interval, 52 has a chance of about 2 % to be missed at 93 %
