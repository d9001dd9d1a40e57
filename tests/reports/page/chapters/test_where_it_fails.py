"""The page's section on where models fail, its maps and what it says where there is little to say."""

import io
import re
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console
from sample_run import write_sample

from undertow.comparison.facts import Comparison
from undertow.comparison.failing.failures import Contributions
from undertow.comparison.failing.rows import scene
from undertow.discovery.findings import FailingPlace, Removal
from undertow.reports.page.chapters.where_it_fails import _worst, where_it_fails
from undertow.reports.page.figures.error_figures import error_map, heat_steps, local_error
from undertow.reports.page.figures.svg import HEAT
from undertow.reports.page.markup import DARK, LIGHT
from undertow.reports.run_contents import RunFolder
from undertow.reports.terminal.comparison_screen import failures_table, structure_list
from undertow.residuals.series import SeriesTable
from undertow.workflows.run_folder.read import read_run


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    return read_run(write_sample(tmp_path_factory.mktemp("reports") / "run", seconds=120.0))


@pytest.fixture(scope="module")
def section(run: RunFolder) -> str:
    return where_it_fails(run).body


def printed(part: object, width: int) -> str:
    console = Console(width=width, file=io.StringIO())
    with console.capture() as captured:
        console.print(part)
    return captured.get()


def lightness(colour: str) -> float:
    red, green, blue = (int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5))
    return 0.2126 * red**2.2 + 0.7152 * green**2.2 + 0.0722 * blue**2.2


@pytest.mark.parametrize(("roles", "sign"), [(LIGHT, -1.0), (DARK, 1.0)], ids=["light", "dark"])
def test_steps_of_error_are_steps_of_lightness_away_from_the_paper(roles: str, sign: float):
    colours = [re.search(rf"--{step}: (#\w{{6}})", roles) for step in HEAT]
    light = [lightness(found[1]) for found in colours if found]
    assert len(light) == 6
    assert (sign * np.diff(light) > 0.02).all()


def test_before_and_after_have_one_scale_of_colour(run: RunFolder, section: str):
    assert section.count("acceleration error [") == 1
    used = [set(re.findall(r"var\(--(heat\d)\)", svg)) for svg in re.findall(r"<svg.*?</svg>", section, re.DOTALL)[:2]]
    assert max(used[0]) > max(used[1])  # the corrected model never errs as much as the nominal one
    usual = float(run.series["r_dot"].std())
    small, large = (heat_steps(usual, [np.full(9, size * usual)] * 2) for size in (0.01, 3.0))
    for bounds, top in ((small, usual), (large, 3.0 * usual)):
        assert np.diff(bounds) == pytest.approx(bounds[0])
        assert top * 0.99 < bounds[-1] < 2.1 * top


def test_noise_stays_pale_where_nothing_was_added_and_there_is_one_map(run: RunFolder):
    """The error of a right model is noise; it must not be stretched over all colours."""
    series, rng = run.series.copy(), np.random.default_rng(0)
    for name in ("u_dot", "v_dot", "r_dot"):
        noisy = series[name] + 0.05 * series[name].std() * rng.normal(size=len(series))
        series[f"{name}_before"] = series[f"{name}_after"] = noisy
    quiet = run.comparison.but(failures=(), structure=())
    told = where_it_fails(replace(run, series=series, comparison=quiet, findings=run.findings.but(failures=()))).body
    figure = told.split("<figcaption>")[0]
    assert figure.count("<svg") == 1
    assert set(re.findall(r"stroke: var\(--(heat\d)\)", figure)) == {"heat1"}
    assert "nothing was added, so there is one map" in told


def test_no_number_of_a_place_can_be_cut(run: RunFolder):
    """Before and after stand below each other, each with its unit, and words may wrap."""
    places = (PLACE.but(rmse=1.51, rmse_after=0.0123, unit="m/s^2"),)
    told = where_it_fails(replace(run, comparison=run.comparison.but(failures=places))).body
    assert "<div>1.5 m/s\u00b2</div><div>\N{RIGHTWARDS ARROW} 0.012 m/s\u00b2</div></td>" in told
    assert f'<td class="text">{PLACE.where}</td>' in told


def test_a_map_widens_where_the_error_is_large(run: RunFolder):
    error = np.zeros(len(run.series))
    error[200:300] = 10.0
    drawing = error_map(run.series, error, np.arange(1.0, 6.0), "before", 0)
    lines = re.findall(r'<path d="([^"]+)"[^>]*stroke: var\(--heat6\)', drawing)
    assert len(lines) == 1
    assert drawing.count("var(--heat1)") == 1


def test_tracks_of_two_stretches_are_not_joined(run: RunFolder):
    apart = run.series[(run.series["time"] < 30.0) | (run.series["time"] > 60.0)]
    drawing = error_map(apart, np.zeros(len(apart)), np.arange(1.0, 6.0), "before", 0)
    (path,) = re.findall(r'<path d="([^"]+)"[^>]*stroke: var\(--heat1\)', drawing)
    assert path.count("M") == 2


def test_the_section_tells_places_times_and_effects(run: RunFolder, section: str):
    for place in run.comparison.failures:
        assert place.where.replace("\N{NO-BREAK SPACE}", " ") in section.replace("\N{NO-BREAK SPACE}", " ")
    for words in ("The worst seconds", "What the error is like", "Fast or slow", "Early or late", "Over time"):
        assert words in section
    assert "surge quadratic damping (80" in section
    assert "None" not in section
    assert "nan" not in re.sub(r"<[^>]*>", "", section)


def test_a_run_of_an_earlier_version_has_a_section_too(run: RunFolder):
    old = {key: value for key, value in run.comparison.to_dict().items() if key != "structure"}
    old["failures"] = [{"where": "surge speed 1 to 2 m/s", "axis": "surge", "share_of_error": 0.4, "rows": 12}]
    text = where_it_fails(replace(run, comparison=Comparison.read(old, "comparison.json", "write it anew"))).body
    assert "surge speed 1 to 2 m/s" in text
    assert "What the error is like" not in text


def test_an_even_error_is_said_to_be_even(run: RunFolder):
    comparison, findings = run.comparison.but(failures=()), run.findings.but(failures=())
    text = where_it_fails(replace(run, comparison=comparison, findings=findings)).body
    assert "No regime of speeds, turns or commands stands out" in text


PLACE = FailingPlace(
    model="nominal",
    where="sway speed above 0.44 m/s to either side",
    axis="yaw",
    share_of_error=0.79,
    share_of_rows=0.29,
    rmse=1.6,
    unit="rad/s^2",
    removed_by=(Removal(effect="munk_moment", share_removed=0.9994, sentence="..."),),
)


def test_the_effect_has_a_column_where_there_is_room_and_a_line_where_not():
    wide, narrow = (printed(failures_table([PLACE]), width) for width in (120, 80))
    assert re.search(r"removed by\s*\n", wide)
    assert re.search(r"1\.6 rad/s²\s+Munk moment >\s99", wide)
    assert re.search(r"removed by Munk moment\s+>\s99\s%", narrow)
    assert not re.search(r"\n\s*%", narrow)
    assert "removed by" not in printed(failures_table([PLACE.but(removed_by=())]), 120)


def test_only_what_is_plain_is_told_on_the_terminal(run: RunFolder):
    first = run.comparison.structure[0]
    assert structure_list([]) is None
    for look in ("frequency", "lag", "heading", "drift"):
        told = getattr(first, look)
        first = first.but(**{look: {axis: told[axis].but(verdict="this log cannot tell") for axis in told}})
    assert structure_list([first]) is None
    early = first.lag["yaw"].but(verdict="early", sentence="the model answers 0.3 s before the boat")
    text = printed(structure_list([first.but(lag={**first.lag, "yaw": early})]), 80)
    assert "the model answers 0.3 s before the boat" in text
    assert "surge" not in text


def test_local_error_is_blind_at_the_edges(run: RunFolder):
    error = local_error(run.series, "before", 0)
    assert np.isnan(error[:8]).all()
    assert np.isfinite(error[8:-8]).all()


def test_why_no_effect_is_named_stands_where_its_name_would():
    place = PLACE.but(removed_by=(), unlinked="not seen on held-out rows (0.4 s of this are, 2 s are needed)")
    for width in (80, 120):
        told = " ".join(printed(failures_table([place]), width).split())
        assert "removed by: not seen" in told
    assert "not seen on held-out rows" in str(_worst([place], ""))


def test_a_share_above_the_whole_is_no_percentage():
    place = PLACE.but(removed_by=(Removal(effect="sway_lift", share_removed=1.34),))
    shown = " ".join(printed(failures_table([place]), 120).split())
    assert "sway lift more than all" in shown
    assert "More than all: others, alone, would add to it." in shown
    assert "sway lift (more than all)" in str(_worst([place], ""))


@pytest.mark.parametrize(("times", "words"), [(1.0, "removes >\N{NO-BREAK SPACE}99"), (1.3, "removes more than all")])
def test_an_effect_is_named_only_where_held_out_rows_saw_it(run: RunFolder, times: float, words: str):
    stage = scene(SeriesTable.of(run.series), "before")
    square = np.square(stage.error)[None]
    one = Contributions(("munk_moment",), ("N_uv from 0 to -25",), times * square, square)
    everywhere = np.ones(len(run.series), bool)
    (found,), why = one.to(stage, everywhere, 2)
    assert words in found.sentence
    assert why == ""
    found, why = one.to(stage, ~stage.held_out, 2)
    assert (found, why) == ((), "not seen on held-out rows (0.0 s of this are, 2 s are needed)")
    found, why = Contributions(one.effects, one.changes, 0.01 * square, square).to(stage, everywhere, 2)
    assert found == ()
    assert why.startswith("no effect removes a tenth")
