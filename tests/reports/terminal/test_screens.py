"""The terminal tables hold every number at 80 columns and survive brackets, nulls and pipes."""

import io
import re

import pytest
from rich.console import Console

from undertow.comparison.facts import Best, Comparison
from undertow.discovery.findings import Findings, SensorError, Step
from undertow.measurements.inspection import Alignment, ChannelSummary, Inspection, Plan, Segment
from undertow.measurements.preparation.prepare import PAPER
from undertow.measurements.quality.checks.excitation import Excitation
from undertow.physics.vehicle import load_vehicle
from undertow.reports.sureness import BACK, COMES_BACK, SURE
from undertow.reports.terminal.comparison_screen import comparison_table, failures_table, trust_style
from undertow.reports.terminal.findings_screen import (
    added_table,
    advice_list,
    candidates_table,
    missing_in_words,
    not_judged,
    opening_lines,
    remaining_error,
    sensors_list,
    steps_table,
    unnamed_table,
)
from undertow.reports.terminal.inspection_screen import inspection_screen
from undertow.reports.terminal.layout import BAD, Prose, bullets, terminal

BOAT = load_vehicle("blueboat")
ERRORS = {"surge": 0.35, "sway": 0.23, "yaw": 0.486}
ROLLOUT = {"2": {**ERRORS, "position": 0.4}, "10": {**ERRORS, "position": 2.26, "diverged": 1, "starts": 60}}
DORMANT = "This log cannot tell: it holds no manoeuvre in which it would show. (Small commands give no thrust.)"
FINDINGS = Findings.model_validate(
    {
        "verdict": "missing",
        "missing": ["thruster_asymmetry"],
        "steps": [
            {"added": None, "acceleration_rmse": ERRORS, "rollout_rmse": ROLLOUT},
            {
                "added": "surge_quadratic_damping",
                "acceleration_rmse": ERRORS,
                "rollout_rmse": {"10": {"position": None}},
            },
        ],
        "candidates": [
            {
                "effect": "thruster_asymmetry",
                "verdict": "missing",
                "sentence": "One thruster pushes harder or weaker than the model says.",
                "confidence": 0.999,
                "error_drop": 0.41,
                "indistinguishable_from": ["thrust_scale", "thruster_asymmetry"],
                "terms": [{"symbol": "stbd_scale", "value": 0.806, "unit": "1", "ci95": [0.79, 0.82]}],
            },
            {
                "effect": "thrust_dead_zone",
                "verdict": "possible",
                "reason": "not_excited",
                "sentence": DORMANT,
                "confidence": 0.002,
                "error_drop": 0.0,
                "terms": [],
            },
            {"effect": "yaw_trim", "verdict": "no evidence", "confidence": 0.1, "error_drop": 0.07, "terms": []},
        ],
        "unnamed": [
            {"axis": "yaw", "form": "u|r|", "value": -1.2, "unit": "N m (s/m)^1 (s/rad)^1", "ci95": [-1.5, -0.9]}
        ],
        "advice": [
            {"manoeuvre": "sharp steps", "why": "would show lag"},
            {"manoeuvre": "sharp steps", "why": "would show delay"},
        ],
        "failures": [{"where": "surge speed 1 to 1.5 m/s [red]", "axis": "surge", "share_of_error": 0.62}],
    }
)
COMPARISON = Comparison.model_validate(
    {
        "split": "test",
        "models": [
            {"name": name, "acceleration": {"rmse": ERRORS}, "rollout": ROLLOUT, "audit": "pass"}
            for name in ("nominal", "corrected [x]")
        ],
        "failures": [
            {"model": "nominal", "where": "astern", "axis": "yaw", "share_of_error": 0.5, "share_of_rows": 0.1}
        ],
    }
)
SURGE = ChannelSummary(
    name="u",
    unit="m/s",
    origin="u",
    count=4800,
    start=0.0,
    end=240.0,
    rate=20.0,
    gaps=0,
    minimum=-1,
    maximum=2,
)
INSPECTION = Inspection(
    path="B_2.csv.gz",
    channels=(SURGE, SURGE.but(name="newton_port", unit="N", count=990, rate=10.0, gaps=3, longest_gap=1.25)),
    alignment=(Alignment(first="a", second="b", sentence="the b follows a by 0.02 s."),),
    excitation=Excitation(
        seconds=240.0,
        u=(-1.4556, 1.7257),
        v=(-0.2, 0.3),
        r=(-0.5, 0.5),
        astern=0.1731,
        turning_to_starboard=0.2,
        turning_to_port=0.0004,
        sentences=("The boat hardly turned.",),
    ),
    plan=Plan(
        recipe=PAPER,
        rate=10.0,
        segments=(Segment(start=0.05, end=240.0, rows=2400),),
        notes=("one gap is too long to bridge",),
    ),
    notes=("frame ENU, converted",),
    unused=("/imu:w.x", "/imu:w.y", *(f"column_{k}" for k in range(20))),
)


def printed(table, width=80):
    stream = io.StringIO()
    Console(file=stream, width=width).print(table if table is not None else "")
    text = stream.getvalue()
    assert "\x1b" not in text
    assert max(map(len, text.splitlines())) <= width
    return text


@pytest.mark.parametrize("width", [80, 100])
def test_steps_keep_all_numbers(width):
    text = printed(steps_table(FINDINGS.steps, FINDINGS.candidates), width)
    assert "nominal model" in text
    assert "+ surge quadratic damping" in text
    assert "0.49" in text
    assert "2.3" in text
    assert "n/a" in text
    assert "\N{HORIZONTAL ELLIPSIS}" not in text


def test_a_calibration_alone_stands_below_the_steps():
    """What effects explain is what is left beyond it, not beyond a file that nobody has fitted."""
    errors = {"surge": 0.4321, "sway": 0.1, "yaw": 0.2, "position": 3.14}
    model = {"name": "calibrated", "acceleration": {"rmse": errors}, "rollout": {"10": errors}}
    beside = Comparison.model_validate({**COMPARISON.to_dict(), "models": [model]})
    text = printed(steps_table(FINDINGS.steps, FINDINGS.candidates, beside))
    assert text.splitlines()[-1].split()[:2] == ["calibrated", "alone"]
    assert text.splitlines()[-1].split()[-1] == "3.1"
    assert "calibrated alone" not in printed(steps_table(FINDINGS.steps, FINDINGS.candidates, COMPARISON))


def test_steps_fit_whatever_the_numbers_and_names():
    tiny = {"surge": 0.000123, "sway": 1.234e-7, "yaw": 0.0123, "position": 1234567.0}
    step = Step.model_validate({"acceleration_rmse": tiny, "rollout_rmse": {"10": tiny}})
    steps = [step, step.but(added="thruster_asymmetry"), step.but(added="sway:v|v||r|")]
    text = printed(steps_table(steps, FINDINGS.candidates))
    assert "(stbd)" in text
    assert text.count("1.2e-07") == 6
    assert "\N{HORIZONTAL ELLIPSIS}" not in text


def test_what_is_left_of_the_error():
    after = {"surge": 0.007, "sway": 0.23, "yaw": None, "position": 0.001}
    last = Step.model_validate({"added": "yaw_trim", "acceleration_rmse": ERRORS, "rollout_rmse": {"10": after}})
    steps = [FINDINGS.steps[0], last]
    said = remaining_error(steps).replace("\N{NO-BREAK SPACE}", " ")
    assert said.endswith("as a share of before: surge 2 %, sway 100 %, yaw n/a, position < 1 %.")
    assert remaining_error(steps[:1]) == ""


def test_candidates_give_value_interval_and_twins():
    text = printed(candidates_table(FINDINGS.candidates, BOAT), 120)
    assert "stbd_scale = 0.806 (0.790 to 0.820)" in text
    assert "thruster asymmetry (stbd)" in text
    assert "(or thrust scale, another thruster)" in text
    assert "41\N{NO-BREAK SPACE}%" in text
    told = " ".join(printed(candidates_table(FINDINGS.candidates, BOAT, most=1), 120).split())
    assert f"sure: {SURE}; {BACK}: {COMES_BACK} 2 effects more are in findings.json." in told
    narrow = printed(candidates_table(FINDINGS.candidates, BOAT), 70).splitlines()
    value = next(index for index, line in enumerate(narrow) if "stbd_scale = 0.806" in line)
    assert "(0.790 to 0.820)" in narrow[value + 1]


def test_what_the_log_cannot_tell_has_no_numbers():
    text = printed(candidates_table(FINDINGS.candidates, BOAT))
    (line,) = [line for line in text.splitlines() if "dead zone" in line]
    assert line.split() == ["thrust", "dead", "zone", "cannot", "tell"]
    assert "7\N{NO-BREAK SPACE}%" in text
    assert not_judged(FINDINGS.candidates) == "Could not be judged in this log: thrust dead zone."
    assert not_judged(FINDINGS.candidates[:1]) == ""


def test_missing_effects_and_advice_are_said_in_words():
    assert "thruster asymmetry (stbd)  One thruster pushes" in printed(missing_in_words(FINDINGS, BOAT))
    assert missing_in_words(FINDINGS.but(candidates=FINDINGS.candidates[1:]), BOAT) is None
    assert "- sharp steps: would show lag; would show delay" in printed(advice_list(FINDINGS.advice))
    assert advice_list([]) is None


def test_terms_without_a_name_have_values():
    text = printed(unnamed_table(FINDINGS.unnamed))
    assert text.splitlines()[3].split() == [
        "yaw",
        "u|r|",
        "-1.20",
        "N",
        "m",
        "(s/m)",
        "(s/rad)",
        "-1.50",
        "to",
        "-0.90",
    ]


def test_added_effects_have_values_and_verdicts():
    text = printed(added_table(FINDINGS.candidates, BOAT), 120)
    assert "stbd_scale = 0.806 (0.790 to 0.820)" in text
    assert re.search(r"missing +>.99.% +stbd_scale", text)


def test_failures_are_told_as_they_are_written():
    assert "surge speed 1 to 1.5 m/s [red]" in printed(failures_table(FINDINGS.failures))


def test_failures_say_which_rows_they_are_about():
    place = COMPARISON.failures[0]
    for rows_of, title in (("all", "whole log"), ("test", "held-out part"), ("train", "train part")):
        assert f"Where it fails ({title})\n" in re.sub(
            " +\n", "\n", printed(failures_table([place.but(rows_of=rows_of)]))
        )
    assert "Where it fails\n" in re.sub(" +\n", "\n", printed(failures_table([place])))


def test_many_models_keep_their_numbers_and_names():
    first = COMPARISON.models[0]
    names = [f"a_folder_with_a_long_name_{k}" for k in range(9)]
    text = printed(comparison_table([first, *(first.but(name=name) for name in names)], "all"))
    assert text.count(" on all rows") == 2
    assert "…" not in text
    assert max(map(len, text.splitlines())) <= 80
    for name in names:
        assert name[-2:] in text


def test_comparison_has_a_line_per_model_in_each_table():
    for width in (60, 70):  # what finds no room goes, and no number is cut
        assert "\N{HORIZONTAL ELLIPSIS}" not in printed(comparison_table(COMPARISON.models, COMPARISON.split), width)
    text = printed(comparison_table(COMPARISON.models, COMPARISON.split))
    assert text.count("corrected [x]") == 4  # acceleration, 2 s, 10 s, laws
    assert "10 s" in text
    assert "1 of 60" in text


def test_inspection_says_the_plan_first_and_the_channels_last():
    text = printed(inspection_screen(INSPECTION)).replace("\N{NO-BREAK SPACE}", " ")
    titles = ("What undertow would do with it", "Notes", "What the boat did", "Time alignment", "Channels")
    places = [text.index(f"\n{title}") for title in titles]
    assert places == sorted(places)
    for words in (
        "B_2.csv.gz: 240 s of usable motion",
        "Take one stretch without gaps: 0.1 to 240 s.",
        "Commands in the log: newton_port.",
        "velocities low-passed at 1.2 Hz",
        "judges on the last 15 % (36 s), which no fit sees; discover judges every part",
        "- One gap is too long to bridge",
        "- frame ENU, converted",
        "Not used: w.x, w.y of /imu; column_0",
        "and 10 more (--json has them all)",
        "surge -1.5 to 1.7 m/s",
        "astern 17 %, turning to starboard 20 %, turning to port < 1 %",
        "- The boat hardly turned.",
        "- The b follows a by 0.02 s.",
    ):
        assert words in re.sub(r"\s+", " ", text), words
    assert re.search(r"newton_port +N +990 +10.0 +3 +1.25", text)
    assert "\N{HORIZONTAL ELLIPSIS}" not in text
    assert "no gaps" not in text


def test_inspection_says_what_a_vehicle_needs():
    boat = load_vehicle("blueboat")
    fits = printed(inspection_screen(INSPECTION, boat))
    assert f"What undertow would do with it for {boat.name}" in fits
    assert "newton_port and newton_stbd, held" in fits
    plan = Plan(recipe=PAPER, rate=10.0, missing=("missing command channel newton_stbd",))
    text = printed(inspection_screen(INSPECTION.but(plan=plan), boat))
    assert f"Not usable for {boat.name}, because" in text
    assert "- missing command channel newton_stbd" in text
    assert "column_19" in text
    assert "Judge models" not in text


@pytest.mark.parametrize(("width", "columns"), [(100, "unit noise"), (80, "unit range"), (70, "gaps"), (50, "range")])
def test_channels_lose_columns_and_never_letters(width, columns):
    name = "newton_port_forward_azimuth"
    channels = [channel.but(name=name, minimum=-0.0123, maximum=0.0234) for channel in INSPECTION.channels]
    text = printed(inspection_screen(INSPECTION.but(channels=channels)), width)
    assert name in text
    assert all(column in text for column in columns.split())
    assert "-0.0123 to 0.0234" in text
    assert "\N{HORIZONTAL ELLIPSIS}" not in text


def test_words_wrap_but_a_number_keeps_its_percent_sign():
    text = "turning to port 50\N{NO-BREAK SPACE}% of the time"
    assert printed(Prose(text), 19).splitlines()[:2] == ["turning to port", "50\N{NO-BREAK SPACE}% of the time"]
    path = "/a/very/long/path/that/has/no/end"
    assert "".join(line[2:].strip() for line in printed(bullets([path]), 20).splitlines()) == path
    assert printed(Prose("")) == "\n"


def test_an_interval_never_collapses_to_one_number():
    terms = [{"symbol": "X_uu", "value": -12.0042, "ci95": [-12.0213, -11.9871], "unit": "N s^2/m^2"}]
    candidate = FINDINGS.candidates[0].but(effect="surge_quadratic_damping", terms=terms)
    text = printed(candidates_table([candidate], BOAT.with_values({"X_uu": 0.0})), 120)
    assert "X_uu = -12.004 N s²/m² (-12.021 to -11.987)" in text


def test_a_number_of_the_file_is_told_whole_and_beside_what_the_file_says():
    terms = [{"symbol": "X_u", "value": -8.0, "ci95": [-9.0, -7.0], "unit": "N s/m", "in_model": -8.0}]
    candidate = FINDINGS.candidates[0].but(effect="surge_linear_damping", terms=terms)
    boat, found = BOAT.with_values({"X_u": -9.0}), FINDINGS.but(candidates=(candidate,))
    text = printed(candidates_table([candidate], boat), 120)
    assert "X_u = -17.0 N s/m (-18.0 to -16.0)" in text
    assert "the file says -9.00" in text
    told = " ".join(printed(missing_in_words(found, boat), 120).split())  # no-break spaces, too
    assert "X_u is about -17.0 N s/m (95 %: -18.0 to -16.0), the file says -9.00. One thruster pushes" in told
    new = printed(candidates_table([candidate], BOAT.with_values({"X_u": 0.0})), 120)
    assert "X_u = -8.0 N s/m (-9.0 to -7.0)" in new
    assert "the file" not in new


def test_likely_effects_stand_between_missing_and_possible_ones_by_their_odds():
    first = FINDINGS.candidates[0]
    odds = (("possible", 0.41), ("likely", 0.83), ("missing", 0.96), ("likely", 0.91), ("missing", 1.0))
    names = ("yaw_trim", "munk_moment", "sway_lift", "mass_offset", "cg_offset")
    found = [
        first.but(effect=name, verdict=verdict, confidence=sure, indistinguishable_from=(), terms=())
        for name, (verdict, sure) in zip(names, odds, strict=True)
    ]
    rows = printed(candidates_table(found, BOAT), 120).replace("\N{NO-BREAK SPACE}", " ").splitlines()
    assert [re.split(r"  +", row.strip())[:3] for row in rows if re.search(r" (missing|likely|possible) ", row)] == [
        ["cg offset", "missing", "> 99 %"],
        ["sway lift", "missing", "96 %"],
        ["mass offset", "likely", "91 %"],
        ["Munk moment", "likely", "83 %"],
        ["yaw trim", "possible", "41 %"],
    ]


def test_two_weak_thrusters_are_told_apart_in_the_steps():
    step = Step.model_validate({"acceleration_rmse": ERRORS, "rollout_rmse": {"10": ERRORS}})
    added = [step.but(added="thruster_asymmetry", thruster=side) for side in ("port", "stbd")]
    text = " ".join(printed(steps_table([step, *added], FINDINGS.candidates), 120).split())
    assert "+ thruster asymmetry (port)" in text
    assert "(stbd)" in text


def test_what_the_log_does_wrong_is_told_and_nothing_else():
    sentence = "The commands act 0.06 s earlier than their record says."
    late, sound = (
        SensorError.model_validate({"error": "channel_offset", "verdict": verdict, "sentence": text})
        for verdict, text in (("present", sentence), ("no evidence", "All is well."))
    )
    assert sensors_list([sound]) is None
    told = printed(sensors_list([sound, late]))
    assert "The commands act 0.06 s earlier" in told
    assert "All is well" not in told


def test_colours_say_what_the_words_say_and_go_where_nobody_wants_them(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    found = FINDINGS.but(headline="One is missing.")
    comparison = Comparison(models=(), best=Best(model="corrected", sentence="Trust corrected."))

    def shown() -> str:
        for line in opening_lines(found, comparison, BOAT):
            terminal().print(line)
        return capsys.readouterr().out

    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    coloured = shown()
    assert "\x1b[32mTrust corrected.\x1b[0m" in coloured
    assert "\x1b[1;36mOne is missing.\x1b[0m" in coloured
    assert trust_style(comparison.but(best=Best(sentence="Trust none."))) == BAD
    monkeypatch.setenv("NO_COLOR", "1")
    assert not re.search(r"\x1b\[[\d;]*3\d", shown())
    monkeypatch.delenv("FORCE_COLOR")
    assert "\x1b" not in shown()
