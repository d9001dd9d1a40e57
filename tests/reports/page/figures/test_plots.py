"""Plots for a notebook show what the run found, on axes that the caller gets back."""

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from added_run import write_added

import undertow
from undertow.physics.errors import RequestError
from undertow.reports.page.figures.effect_figures import MissingForce, best_signal, convincing, means, signal_rows

matplotlib.use("agg")
import matplotlib.pyplot as plt


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Any:
    return write_added(tmp_path_factory.mktemp("plots"), report=False)


@pytest.fixture(autouse=True)
def _closed() -> Any:
    yield
    plt.close("all")


def test_the_staircase_falls_by_the_errors_of_the_findings(run: Any) -> None:
    axes = run.plot.staircase()
    told = [step.rollout("10").position for step in run.findings.steps]
    assert [bar.get_width() for bar in axes.patches] == pytest.approx(told)
    assert [text.get_text() for text in axes.get_yticklabels()] == ["nominal", "surge quadratic damping"]


def test_the_force_is_drawn_over_what_tells_most_of_it_with_the_law_that_was_added(run: Any) -> None:
    axes = run.plot.force()
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("surge speed [m/s]", "surge [N]")
    law = axes.lines[-1]
    u, added = np.asarray(law.get_xdata(), dtype=float), np.asarray(law.get_ydata(), dtype=float)
    inner = slice(2, -2)  # the first and the last part hold all that is beyond them
    assert added[inner] == pytest.approx((-12.0 * u * np.abs(u))[inner], abs=1.0)
    assert run.plot.force("yaw", against="r").get_xlabel() == "yaw rate [rad/s]"


def test_speeds_are_drawn_on_three_axes(run: Any) -> None:
    axes = run.plot.predictions()
    assert [one.get_ylabel() for one in axes] == ["u [m/s]", "v [m/s]", "r [rad/s]"]
    assert [line.get_label() for line in axes[0].lines] == ["measured", "nominal", "corrected"]


def test_coefficients_stand_before_and_after(run: Any) -> None:
    axes = run.plot.coefficients()
    (label,) = [text.get_text() for text in axes.get_yticklabels()]
    assert label.startswith("X_uu = -20")


def test_failures_are_coloured_by_the_error_of_each_row(run: Any) -> None:
    before, after = (run.plot.failures("surge", model).collections[0].get_array() for model in ("before", "after"))
    assert np.nanmean(after) < 0.5 * np.nanmean(before)


def test_a_run_folder_draws_the_same_on_axes_that_it_is_given(run: Any, tmp_path: Path) -> None:
    folder = undertow.load_run(undertow.write_run(run, tmp_path / "run", report=False))
    _, axes = plt.subplots()
    assert folder.plot.staircase(ax=axes) is axes
    assert folder.findings.plot.staircase(ax=axes) is folder.comparison.plot.errors(ax=axes) is axes


def test_findings_and_comparisons_draw_themselves(run: Any) -> None:
    stairs = [bar.get_width() for bar in run.findings.plot.staircase("surge", "2").patches]
    assert stairs == pytest.approx([step.rollout("2").surge for step in run.findings.steps])
    (label,) = [text.get_text() for text in run.findings.plot.coefficients().get_yticklabels()]
    assert label.startswith("X_uu = -1")  # what is added, and not what the vehicle then has
    compared = run.comparison
    errors = run.comparison.plot.errors()
    assert [text.get_text() for text in errors.get_yticklabels()] == [model.name for model in compared.models]
    assert [bar.get_width() for bar in errors.patches] == pytest.approx(
        [m.rollout["10"].position for m in compared.models]
    )
    assert errors.get_xlabel() == "position error of 10 s predictions [m]"
    places = [place for place in compared.failures if place.model == "nominal"]
    drawn = [bar.get_width() for bar in compared.plot.failures().patches[::2]]
    assert drawn == pytest.approx([100.0 * place.share_of_error for place in places])
    assert len(run.findings.plot.failures().patches) == 2 * len(run.findings.failures)
    with pytest.raises(RequestError, match="no failures of a model 'lstm'; there are those of nominal"):
        compared.plot.failures("lstm")
    with pytest.raises(RequestError, match="no error of position over 99 s"):
        compared.plot.errors(horizon="99")


def test_plots_show_what_can_be_drawn(run: Any) -> None:
    for plots in (run.plot, run.findings.plot, run.comparison.plot):
        names = [line.split("()")[0].strip() for line in repr(plots).splitlines()[1:]]
        assert names
        assert all(callable(getattr(plots, name.removeprefix("."))) for name in names)
    assert ".force()         The force that the nominal model lacks" in repr(run.plot)


def test_what_is_not_there_is_refused(run: Any) -> None:
    with pytest.raises(RequestError, match="no error of heading over 10 s"):
        run.plot.staircase("heading")
    with pytest.raises(RequestError, match="expected surge, sway, yaw or an effect, got 'heave'"):
        run.plot.force("heave")
    with pytest.raises(RequestError, match="no column 'w' in the series; there are u, v"):
        run.plot.force(against="w")


def test_the_page_shows_the_force_of_the_axis_on_which_something_was_added(run: Any) -> None:
    found = convincing(run.findings, run.series, run.discovery.nominal)
    assert (found[0].axis, found[0].signal) == (0, "u")
    assert found[0].told > 0.95
    assert convincing(run.findings.but(candidates=()), run.series, run.discovery.nominal) == []


def test_a_law_is_drawn_over_the_signal_by_which_it_is_known() -> None:
    rng = np.random.default_rng(0)
    names = ("u", "v", "r", "psi", "u_dot", "v_dot", "r_dot", "pwm_port")
    columns = {name: rng.normal(size=2000) for name in names} | {"psi": np.linspace(-50.0, -5.0, 2000)}
    rows = signal_rows(columns)
    assert 0.0 <= rows["psi"].min() < 5.0
    assert 355.0 < rows["psi"].max() < 360.0
    u, command = columns["u"], columns["pwm_port"]
    laws = {
        "u": -8.0 * u * np.abs(u),
        "psi": 4.0 * np.cos(columns["psi"] - 1.0),
        "u_dot": -15.0 * columns["u_dot"],
        "pwm_port": 0.2 * command,
        "r": np.full(2000, 0.6) + 1e-3 * columns["u_dot"],  # a trim, which no signal tells
    }
    assert {name: best_signal(rows, law, 2 if name == "r" else 0) for name, law in laws.items()} == {n: n for n in laws}
    assert best_signal(rows, u + 1.1 * command, 0) == "u", "of what tells about as much, the one that is known best"
    assert best_signal(rows, laws["u"], 1, ["surge"]) not in ("u", "u_dot")
    heading = MissingForce(0, laws["psi"], laws["psi"], "psi", rows["psi"])
    assert heading.label == "heading [deg]"
    assert np.ptp(means(heading.values, heading.added)[1]) > 7.0, "one wave, not the mean of many"


def test_no_force_is_drawn_over_a_velocity_that_was_not_judged(run: Any) -> None:
    scales = {**run.findings.criterion.force_scale, "surge": 1e-9}
    doubted = run.findings.but(criterion=run.findings.criterion.but(force_scale=scales))
    assert doubted.criterion.unjudged == ("surge",)
    found = convincing(doubted, run.series, run.discovery.nominal)
    assert all(one.axis != 0 and one.signal not in ("u", "u_dot") for one in found)
    plots = undertow.Plots(doubted, run.series, run.discovery.nominal, run.discovery.corrected)
    assert plots.force("yaw").get_xlabel() not in ("surge speed [m/s]", "surge acceleration [m/s²]")
    assert plots.force("surge", against="u").get_xlabel() == "surge speed [m/s]"
