"""What adding effects did to the predictions is told as the numbers have it, bad news first."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from sample_run import write_sample
from verbs import done

from undertow.comparison.facts import Best, ComparedModel, Comparison, Grounds, Margin
from undertow.discovery.findings import BY_OTHER_MEANS, Findings, NamelessForce, Rise, SensorError, Step, leading_force
from undertow.physics.presentation import NARROW, sentence_case
from undertow.physics.vehicle import load_vehicle
from undertow.reports.page.chapters.models import models
from undertow.reports.page.figures.model_figures import trust
from undertow.reports.page.markup import Html, render
from undertow.reports.page.outcome import (
    answer,
    cannot,
    gets_worse,
    headline,
    hero,
    opening,
    outcome,
    recommendation,
    section_title,
    settled,
)
from undertow.reports.page.page import page
from undertow.reports.run_contents import Rival
from undertow.reports.sureness import SURE, source_marks
from undertow.reports.terminal.findings_screen import remaining_error
from undertow.residuals.scores import ByAxis
from undertow.workflows.run_folder.read import read_run

NOTHING = Comparison(models=())
BOAT = load_vehicle("blueboat").with_values({"X_u": -9.0})
BEST = NOTHING.but(best=Best(model="nominal", sentence="Trust nominal: it keeps the laws of a hull."))


def story(before: float | None, after: float | None, *missing: str) -> Findings:
    steps = [
        Step.model_validate(
            {"added": name, "acceleration_rmse": {}, "rollout_rmse": {"10": {"surge": 0.1, "position": error}}}
        )
        for name, error in ((None, before), ("munk_moment", after))
    ]
    return Findings(
        verdict="missing",
        headline="The model is missing Munk moment.",
        missing=missing or ("munk_moment",),
        candidates=(),
        steps=tuple(steps),
    )


def paired(verdict: str) -> Comparison:
    keys = {"model": "corrected", "against": "nominal", "quantity": "rollout", "horizon": "10", "axis": "position"}
    return NOTHING.but(differences=[{**keys, "verdict": verdict}])


@pytest.mark.parametrize(
    ("before", "after", "verdict", "said"),
    [
        (2.0, 0.5, "better", "Adding it removes 75 % of the position error of 10 s predictions on unseen motion"),
        (2.0, 1.9, "no difference", "removes 5 % of the position error"),
        (2.0, 1.9, "no difference", "unseen motion, which may be chance."),
        (2.0, 0.5, "too short to tell", "unseen motion, on too few rows to exclude chance."),
        (2.0, 2.6, "worse", "makes the position error of 10 s predictions worse on unseen motion"),
        (2.0, 2.6, "worse", "unseen motion, from 2.0 to 2.6 m."),
        (2.0, 2.01, "no difference", "as it was on unseen motion, 2.0 m."),
        (2.0, None, "worse", "Adding it makes predictions over 10 s run away"),
    ],
)
def test_the_sentence_is_what_the_numbers_say(before: float, after: float | None, verdict: str, said: str):
    told = outcome(story(before, after), paired(verdict)).replace(NARROW, " ")
    assert said in told
    assert ("removes" in told) == (after is not None and after < 0.99 * before)


def test_bad_news_come_first_and_the_model_to_trust_last():
    worse, better = story(2.0, 2.6), story(2.0, 0.5)
    assert [text.split()[0] for text in opening(worse, BEST)] == ["Adding", "The", "Trust"]
    assert [text.split()[0] for text in opening(better, BEST)] == ["The", "Adding", "Trust"]
    assert gets_worse(story(2.0, None).steps)
    alone = better.but(steps=better.steps[:1])
    assert not gets_worse(alone.steps)
    assert opening(alone, NOTHING) == [better.headline]


def test_what_grows_by_more_than_chance_is_told_beside_what_shrinks(tmp_path: Path):
    grown = [("acceleration", None, "yaw", 0.12), ("rollout", "2", "sway", 0.081), ("rollout", "10", "position", 0.3)]
    rows = [
        {**told, "quantity": what, "horizon": over, "axis": axis, "relative": share}
        for what, over, axis, share in grown
        for told in (
            {"model": "corrected", "against": "nominal", "verdict": "worse"},
            {"model": "calibrated", "against": "nominal", "verdict": "worse"},
        )
    ]
    comparison = BEST.but(differences=[*rows, {**rows[0], "axis": "surge", "verdict": "no difference"}])
    said = "By more than chance, these errors grow: yaw acceleration by 12 % and sway of 2 s predictions by 8 %."
    better = story(2.0, 0.5)
    told = [text.replace(NARROW, " ") for text in opening(better, comparison)]
    assert [text.split()[0] for text in told] == ["The", "Adding", "By", "Trust"]
    assert told[2] == said  # the error that the story leads with has a sentence of its own
    assert "position of 10 s predictions by 30" in str(comparison)
    run = read_run(write_sample(tmp_path / "run", seconds=30.0))
    shown = page(replace(run, comparison=run.comparison.but(differences=comparison.differences)))
    assert said in shown.replace(NARROW, " ").split('class="card numbers"')[0]


def test_the_page_leads_with_an_error_that_grew(tmp_path: Path):
    run = read_run(write_sample(tmp_path / "run", seconds=30.0))
    steps = run.findings.steps
    first = steps[0].rollout("10")
    worse = steps[-1].but(rollout_rmse={"10": first.but(position=1.5 * first.position)})
    text = page(replace(run, findings=run.findings.but(steps=(*steps[:-1], worse))))
    assert '<p class="lead">Adding them makes the position error of 10 s predictions' in text
    assert "removes" not in text.split('class="card numbers"')[0]


def test_a_step_that_makes_something_worse_says_so_on_its_card_and_below_the_steps(tmp_path: Path):
    run = read_run(write_sample(tmp_path / "run", seconds=30.0))
    rise = Rise(horizon="10", axis="yaw", before=0.125, after=0.25, unit="rad/s")
    steps = tuple(one.but(rises=(rise,)) if one.added == "yaw_quadratic_damping" else one for one in run.findings.steps)
    told = page(replace(run, findings=run.findings.but(steps=steps))).replace(NARROW, " ")
    card = told.split("<h3>Yaw quadratic damping</h3>")[1].split("</div></div>")[0]
    assert "With it, the yaw error of 10 s predictions rises from 0.12 to 0.25 rad/s, on rows that no fit saw" in card
    assert "With yaw quadratic damping, the yaw error of 10 s predictions rises from 0.12 to 0.25 rad/s" in told
    assert "With yaw quadratic damping, the yaw error" in remaining_error(steps)


def test_discover_prints_which_model_to_trust(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "120")
    done(
        "simulate", "-v", "blueboat", "--effect", "surge_quadratic_damping=-12", "--duration", "100", "--out", "log.csv"
    )
    said = " ".join(done("discover", "log.csv", "-v", "blueboat", "--out", "run", "--no-report").split())
    sentence = read_run(tmp_path / "run").comparison.best.sentence
    assert sentence.replace(NARROW, " ") in said.replace(NARROW, " ")
    assert said.index("Trust ") < said.index("Effects, surest first")
    assert "Adding it removes" in said.split("Trust ")[0]
    marks, model = source_marks(read_run(tmp_path / "run").findings), load_vehicle(tmp_path / "run" / "model.yaml")
    assert f"X_uu {marks['X_uu']}: identified by undertow from" in str(model.sources)


def test_the_story_leads_with_the_horizon_that_decides(tmp_path: Path):
    run = read_run(write_sample(tmp_path / "run", seconds=30.0))
    assert hero(run.findings.steps)[0] == "10"
    short = {"2": run.findings.steps[0].rollout("10").but(position=0.125)}
    steps = [step.but(rollout_rmse={**step.rollout_rmse, **short}) for step in run.findings.steps]
    best = Best(model="corrected", sentence="Trust corrected: over 2 s it errs less.", horizon="2")
    short_log = replace(run, findings=run.findings.but(steps=tuple(steps)), comparison=run.comparison.but(best=best))
    told = page(short_log)
    assert "<strong>position error of 2 s predictions</strong>" in told
    assert "<strong>position error of 10 s predictions</strong>" not in told


def test_no_model_is_in_bold_where_none_is_to_be_trusted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    run = read_run(write_sample(tmp_path / "run", seconds=30.0))
    bold: list[str] = []

    def drawn(shown: Sequence[Rival], horizon: str, best: str, of: str = "") -> Html:
        bold.append(best)
        return trust(shown, horizon, best, of)

    monkeypatch.setattr("undertow.reports.page.chapters.models.trust", drawn)
    none = Best(sentence="Trust none of the models on these rows: nothing is better.")
    one, other = (models(run.comparison.but(best=best)) for best in (BEST.best, none))
    assert "The model to trust is in bold" in render(one)
    assert "None is in bold: none is to be trusted" in render(other)
    assert bold == ["nominal", ""]


def test_reasons_stand_below_a_short_headline(tmp_path: Path):
    run = read_run(write_sample(tmp_path / "run", seconds=30.0))
    findings = run.findings.but(verdict="undecided", headline="Undecided: it is short.", reasons=("It has 9 s.",))
    told = page(replace(run, findings=findings))
    assert "<h1>Undecided: it is short.</h1>" in told
    assert '<p class="lead">It has 9 s.' in told.replace("\n", "")
    assert opening(findings, NOTHING)[0] == "Undecided: it is short."
    assert "It has 9 s." in opening(findings, NOTHING)


def open_story(before: float, after: float, **more: object) -> Findings:
    """An undecided run with two names in its model."""
    likely, possible = (
        {
            "effect": name,
            "verdict": verdict,
            "confidence": sure,
            "error_drop": 0.1,
            "terms": [{"symbol": symbol, "value": -8.0, "unit": "N s/m", "ci95": [-9.0, -7.0], "in_model": -8.0}],
            "claim": {"gain": 9.0, "identity": 1.0, "rival": rival, "worth": {"force": 0.3}, "null_excluded": True},
        }
        for name, verdict, sure, symbol, rival in (
            ("surge_linear_damping", "possible", 0.63, "X_u", "surge_quadratic_damping"),
            ("munk_moment", "possible", 0.4, "N_uv", ""),
        )
    )
    content = {"verdict": "undecided", "missing": (), "candidates": (possible, likely), "headline": "Undecided: so."}
    return story(before, after).but(**{**content, **more})


def judged(best: str, **errors: float) -> Comparison:
    models = [{"name": name, "rollout": {"10": {"position": error}}} for name, error in errors.items()]
    told = Best(model=best, sentence=f"Trust {best}: it is so.", horizon="10")
    return Comparison.model_validate({"models": models}).but(best=told)


def test_an_open_verdict_is_an_answer_in_three_lines():
    found = open_story(2.0, 0.5)
    compared = judged("corrected", nominal=2.0, corrected=0.5)
    first, second, third = (line.in_words.replace(NARROW, " ") for line in answer(found, compared, BOAT))
    assert first == (
        "Predicts best: the corrected model (model.yaml), with a position error of 10 s predictions of 0.50 m on "
        "unseen rows, 75 % less than the nominal model's 2.0 m."
    )
    assert second == ("In play: surge linear damping (63 %) and Munk moment (40 %). model.yaml has them.")
    assert third == (
        "Next step: check X_u in the vehicle file: it says \N{MINUS SIGN}9.00, this log asks for about "
        "\N{MINUS SIGN}17.0 N s/m."
    )
    told = opening(found, compared, BOAT)
    assert [text.split(":")[0] for text in told] == ["Undecided", "Predicts best", "In play", "Next step"]
    assert not any("Trust" in text for text in told)


ADVICE = {"manoeuvre": "20/20 zigzag", "why": "would tell drag from lag", "effects": ["drag", "lag"]}


def test_the_next_step_is_a_channel_before_a_manoeuvre_before_a_line_of_the_file():
    compared = judged("corrected", nominal=2.0, corrected=0.5)
    advised = open_story(2.0, 0.5, advice=[ADVICE])
    assert (
        answer(advised, compared, BOAT)[2].text == "record this: 20/20 zigzag. It would tell drag from lag. "
        "'undertow plan RUN drag lag' makes a mission of the shortest."
    )
    otherwise = open_story(2.0, 0.5, advice=[{"manoeuvre": BY_OTHER_MEANS, "why": "would tell drag from lag: none"}])
    assert answer(otherwise, compared, BOAT)[2].text == f"{BY_OTHER_MEANS}. It would tell drag from lag."
    unjudged = advised.but(criterion={"force_scale": {"surge": 3.0, "sway": 0.0, "yaw": 1.0}})
    assert answer(unjudged, compared, BOAT)[2].text.startswith("log the sway speed v by another sensor")
    bare = open_story(2.0, 2.0, candidates=())
    assert "record a second log" in answer(bare, judged("nominal", nominal=2.0), BOAT)[2].text


@pytest.mark.parametrize(
    ("follows", "play", "step"),
    [
        (
            "the thrust of port from minute 2.7 on",
            "a moment in yaw that follows the thrust of port from minute 2.7 on; no name.",
            "find out what happened at about minute 2.7, such as weed, a blow or a payload: a moment in yaw that "
            "follows the thrust of port sets in there; 'undertow adapt' tells which number changes.",
        ),
        (
            "r from log c.csv on",
            "a moment in yaw that follows r from log c.csv on; no name.",
            "find out what is otherwise from log c.csv on, such as a payload, weed or the wind: a moment in yaw that "
            "follows r is there alone. Or search each log by itself.",
        ),
        (
            "r northwest of -1.2 m",
            "a moment in yaw that follows r differently northwest of -1.2 m than elsewhere; no name.",
            "drive there and elsewhere once more, for a wall or a shoal may be the cause: a moment in yaw that follows "
            "r differently northwest of -1.2 m than elsewhere.",
        ),
        (
            "r|r|^0.5",
            "a moment in yaw that follows r|r|^0.5 ('discover --residual best' may learn it); no name.",
            "search again with more in the vehicle file, for cross flow drag needs the size of the hull: give hull: "
            "{length, draught}, in metres, in the vehicle file.",
        ),
    ],
)
def test_what_a_force_without_a_name_follows_is_in_play_and_says_where_to_look(follows: str, play: str, step: str):
    found = open_story(
        2.0,
        2.0,
        candidates=(),
        nameless=NamelessForce(axis="yaw", follows=follows),
        advice=[{"manoeuvre": "20/20 zigzag"}],
    )
    _, second, third = answer(found, judged("nominal", nominal=2.0), BOAT)
    assert (second.text, third.text) == (play, step)


def test_of_a_boat_that_changed_it_is_asked_what_happened():
    change = {"effect": "lateral_cg", "terms": [{"symbol": "y_g", "value": 0.05, "unit": "m"}], "log": "a.csv"}
    found = open_story(2.0, 1.0, change={**change, "minute": 2.52, "since": False})
    compared = judged("corrected", nominal=2.0, corrected=1.0)
    begins = "The boat changes at minute 2.52: lateral cg (y_g by 0.050 m). Before then:"
    assert headline(found, compared).replace(NARROW, " ") == f"{begins} Undecided: so."
    assert answer(found, compared, BOAT)[2].text == (
        "find out what happened at about minute 2.52, such as weed, a blow or a payload; what is told here is of the "
        "part before then."
    )


def test_a_force_that_lasts_and_follows_nothing_is_in_play():
    rest = {"axis": "yaw", "force": 0.6, "share": 0.12, "unit": "N m"}
    found = open_story(2.0, 2.0, candidates=(), rests=[rest])
    play = answer(found, judged("nominal", nominal=2.0), BOAT)[1]
    assert play.text == "no name; in yaw a force lasts that nothing explains."


def test_a_force_without_a_name_stands_before_names_that_are_not_likely():
    force, compared = NamelessForce(axis="surge", follows="u from minute 1.3 on"), judged("corrected", nominal=2.0)
    found = open_story(2.0, 1.0, nameless=force)
    assert answer(found, compared, BOAT)[1].text.replace(NARROW, " ") == (
        "a force in surge that follows u from minute 1.3 on, which model.yaml lacks; it has surge linear damping "
        "(63 %) and Munk moment (40 %)."
    )
    unadded = [c.but(terms=[t.but(in_model=None) for t in c.terms]) for c in found.candidates]
    assert answer(found.but(candidates=unadded), compared, BOAT)[1].text.replace(NARROW, " ") == (
        "a force in surge that follows u from minute 1.3 on; perhaps surge linear damping (63 %) and Munk moment "
        "(40 %); model.yaml has none of it."
    )
    term = {"axis": "surge", "form": "u^3", "value": -1.0, "inclusion": 0.9}
    terms = open_story(2.0, 1.0, unnamed=[term], nameless=NamelessForce(axis="surge", follows="u^3"))
    assert answer(terms, compared, BOAT)[1].text.startswith("a force without a name in surge that follows u^3, surge")
    beyond = NamelessForce(axis="surge", follows="u beyond 0.8 m/s")
    told = answer(terms.but(nameless=beyond), compared, BOAT)[1].text
    assert told.startswith("a force without a name in surge that follows u beyond 0.8 m/s (as u^3), surge")
    assert told.endswith("model.yaml has them.")
    assert answer(terms.but(nameless=None), compared, BOAT)[1].text.startswith("surge linear damping (")


@pytest.mark.parametrize(
    ("follows", "told"),
    [
        ("u|u|", "a moment in yaw that follows u|u|"),
        ("", "a moment in yaw that is constant"),
        ("from minute 2.7 on", "a moment in yaw that is there from minute 2.7 on"),
        ("being north of 18 m", "a moment in yaw that is there north of 18 m"),
        (
            "u|u| north of 18 m",
            "a moment in yaw that follows u|u| differently north of 18 m than elsewhere",
        ),
    ],
)
def test_a_force_without_a_name_reads_as_a_sentence(follows: str, told: str):
    assert NamelessForce(axis="yaw", follows=follows).in_words == told


Form = tuple[str, str]


def test_which_force_without_a_name_is_told_first():
    def first(*forms: Form, terms: Sequence[Form] = (), lasts: Sequence[str] = (), rolls: bool = False) -> object:
        found = leading_force(terms, [(*form, 0.1) for form in forms], lasts, rollouts=rolls)
        return found and (found.axis, found.follows)

    assert first(("sway", "v"), ("surge", ""), ("yaw", "v^3")) == ("yaw", "v^3"), "a law of the catalogue is none"
    assert first(("sway", "v"), ("yaw", "r|u|")) is None
    assert first(("yaw", "v^3"), ("surge", "u^3"), lasts=("surge",)) == ("surge", "u^3")
    assert first(("yaw", "v^3"), ("surge", "u^3"), rolls=True) == ("surge", "u^3"), "sway and yaw may be the sea"
    assert first(("yaw", "v^3"), rolls=True) is None
    assert first(("yaw", "v^3"), rolls=True, lasts=("yaw",)) == ("yaw", "v^3")
    assert first(("surge", "u^3"), terms=(("sway", "u^2"), ("yaw", "r^3"), ("sway", "u^3"))) == ("sway", "u^2 and u^3")


@pytest.mark.parametrize(
    ("shares", "told"),
    [
        ((0.2, 0.11, 0.12), "u|u| east of 3 m"),
        ((0.2, 0.09, 0.08), "v^2|r|"),
        ((0.2, 0.11, 0.09), "all thrust times |r|"),
    ],
)
def test_a_thrust_or_a_place_is_told_before_a_product_of_speeds_that_goes_along_with_it(
    shares: tuple[float, ...], told: str
):
    axes = ("surge", "surge", "surge")
    forms = list(zip(axes, ("v^2|r|", "all thrust times |r|", "u|u| east of 3 m"), shares, strict=True))
    found = leading_force((), forms, (), rollouts=False)
    assert found is not None
    assert found.follows == told
    elsewhere = [("yaw", follows, share) for _, follows, share in forms[1:]]
    assert leading_force((), [forms[0], *elsewhere], (), rollouts=False) == NamelessForce(
        axis="surge", follows="v^2|r|"
    )
    kept = leading_force([("surge", "u^3")], forms[:2], (), rollouts=False)
    assert kept == NamelessForce(axis="surge", follows="all thrust times |r|"), "whatever is left beside a term"
    kink = [("surge", "u beyond 0.8 m/s", 0.3), *forms]
    assert leading_force((), kink, (), rollouts=False) == NamelessForce(axis="surge", follows="u beyond 0.8 m/s")


def test_where_the_nominal_model_is_as_good_the_line_says_what_the_other_reaches():
    compared = judged("nominal", nominal=2.0, corrected=1.9).but(differences=paired("no difference").differences)
    line = answer(open_story(2.0, 1.9), compared)[0].text
    assert line == (
        "none by more than chance in its speeds. The position error of 10 s predictions on unseen rows is 2.0 m of the "
        "nominal model, 1.9 m of model.yaml, which may be chance."
    )
    worse = answer(open_story(2.0, 2.1), compared.but(models=judged("nominal", nominal=2.0, corrected=2.1).models))[0]
    assert worse.text.startswith("the nominal model, with a position error of 10 s predictions of 2.0 m")


def test_names_keep_their_letters_where_a_sentence_begins():
    assert sentence_case("adding Munk moment of Port_A") == "Adding Munk moment of Port_A"


def test_nothing_is_missing_is_not_said_of_an_axis_that_was_not_judged_nor_of_a_model_that_changes_the_error():
    plain = {"verdict": "nothing missing", "headline": "Nothing material is missing.", "candidates": ()}
    sound = open_story(2.0, 1.99, **plain)
    compared = judged("nominal", nominal=2.0, corrected=1.99)
    assert settled(sound, compared)
    assert (headline(sound, compared), answer(sound, compared)) == ("Nothing material is missing.", ())
    blind = sound.but(criterion={"force_scale": {"surge": 3.0, "sway": 0.0, "yaw": 1.0}})
    changed = open_story(2.0, 1.6, **plain | {"candidates": open_story(2.0, 1.6).candidates})
    own = {"symbol": "X_u", "before": -9.0, "after": -12.0, "wanted": -12.0, "unit": "N s/m"}
    fitted = open_story(2.0, 1.6, **plain, calibrated=[own])
    for found, said in (
        (blind, "No force was judged in sway: the velocity there may be wrong. In surge and yaw, nothing is missing"),
        (changed, "No name is sure, and yet model.yaml removes 20 % of the position error of 10 s predictions."),
        (fitted, "No new effect is needed: numbers of the vehicle file are off, and putting them right removes"),
    ):
        assert not settled(found, compared)
        assert headline(found, compared).replace(NARROW, " ").startswith(said)
        assert len(answer(found, compared)) == 3
        assert section_title(found, compared) == "What may be missing"
        assert not any(text.startswith("Nothing") for text in opening(found, compared))
    windy = fitted.but(passing={"surge": 0.58, "sway": 0.3})
    ends = "58 % of the force at work in surge comes and goes within seconds, as in waves and gusts."
    assert (
        headline(windy, compared)
        .replace(NARROW, " ")
        .endswith(f" 20 % of the position error of 10 s predictions. {ends}")
    )
    harmed = open_story(2.0, 2.4, **plain, calibrated=[own])
    assert headline(harmed, compared) == "Nothing material is missing.", "numbers that err more put nothing right"
    assert "makes the position error of 10 s predictions worse on unseen motion" in opening(harmed, compared)[0]
    assert "the file's own numbers, calibrated (X_u)" in answer(fitted, compared)[1].text


def test_where_no_name_is_likely_and_the_numbers_of_the_file_are_enough_the_headline_says_so():
    own = {"symbol": "X_u", "before": -9.0, "after": -12.0, "wanted": -12.0, "unit": "N s/m"}
    compared = judged("calibrated", nominal=2.0, corrected=0.5)
    fitted = open_story(2.0, 0.5, calibrated=[own], candidates=())
    surely = compared.but(differences=paired("better").differences)
    said = headline(fitted, surely)
    assert said.replace(NARROW, " ") == (
        "Undecided: so. Fitting the file's own numbers removes 75 % of the position error of 10 s predictions."
    )
    assert headline(fitted.but(headline=said), surely) == said, "what is written is read again"
    assert headline(fitted, compared) == "Undecided: so.", "nobody says that it is more than chance"
    for other in (open_story(2.0, 0.5), open_story(2.0, 1.6, calibrated=[own], candidates=())):
        assert headline(other, surely) == "Undecided: so."


def test_likely_names_have_their_odds_beside_what_is_missing_and_alone(tmp_path: Path):
    run = read_run(write_sample(tmp_path / "run", seconds=30.0))
    text = page(run).replace(NARROW, " ")
    assert "Probably also sway quadratic damping (87 %)." in text
    assert '<span class="tag likely">Probably missing: 87 %</span>' in text
    assert '<span class="tag missing">The model is missing this: 97 %</span>' in text
    assert "What is missing</h2>" in text
    assert SURE in text
    likely = tuple(item for item in run.findings.candidates if item.verdict == "likely")
    alone = run.findings.but(verdict="likely", missing=(), candidates=likely, headline="")
    assert headline(alone, NOTHING).replace(NARROW, " ") == "Probably missing: sway quadratic damping (87 %)."
    assert "What is probably missing</h2>" in page(replace(run, findings=alone))


def test_what_to_trust_goes_with_what_is_missing():
    assert (
        recommendation(story(2.0, 0.5), BEST) == f"{BEST.best.sentence} What is missing hardly matters on these rows."
    )
    assert recommendation(open_story(2.0, 0.5), BEST) == BEST.best.sentence


def test_the_weather_of_a_log_is_no_part_of_its_boat(tmp_path: Path):
    run = read_run(write_sample(tmp_path))
    hull = run.findings.added[0]
    current = hull.but(effect="steady_current", terms=tuple(term.but(symbol="current_north") for term in hull.terms))
    trusted = NOTHING.but(best=Best(model="corrected", grounds=Grounds.BETTER, sentence="Trust corrected."))
    assert recommendation(run.findings.but(candidates=(hull,)), trusted) == "Trust corrected."
    told = recommendation(run.findings.but(candidates=(hull, current)), trusted)
    assert told == (
        "Trust corrected. Steady current is that of this log: for another day set current_north to 0 in model.yaml."
    )


def scored(name: str, r2: Sequence[float], speeds: Sequence[float | None], kind: str = "symbolic") -> ComparedModel:
    """A model by its R squared of the acceleration, and its errors of 10 s speeds, in surge, sway and yaw."""
    axes = ("surge", "sway", "yaw")
    content = {
        "name": name,
        "kind": kind,
        "acceleration": {"r2": dict(zip(axes, r2, strict=True))},
        "rollout": {"10": dict(zip(axes, speeds, strict=True))},
    }
    return ComparedModel.model_validate(content)


GUESS = scored("zero acceleration", (0.0, 0.0, 0.0), (0.5, 0.2, 0.3), "baseline")


@pytest.mark.parametrize(
    ("r2", "speeds", "said"),
    [
        ((0.6, 0.1, 0.4), (0.1, 0.1, 0.1), ""),
        ((0.6, -0.009, 0.4), (0.505, 0.2, 0.3), ""),
        ((0.6, -32.0, -12.1), (0.1, 0.1, 0.1), "in the acceleration of sway (R² -32) and yaw (R² -12)."),
        (
            (0.6, 0.1, -0.02),
            (0.51, 0.2, 0.3),
            "in the acceleration of yaw (R² -0.020) and in the speeds predicted over",
        ),
        ((0.6, 0.1, 0.4), (0.1, 0.3, 0.1), "in the speeds predicted over 10 s of sway."),
        ((0.6, 0.1, 0.4), (0.1, 0.1, None), "in the speeds predicted over 10 s of yaw."),
    ],
)
def test_what_the_model_cannot_do_stands_under_the_verdict(r2: tuple[float, ...], speeds: tuple[float, ...], said: str):
    models = (scored("nominal", (-99.0, -99.0, -99.0), (9.0, 9.0, 9.0)), scored("corrected", r2, speeds), GUESS)
    found = NOTHING.but(models=models, best=Best(model="corrected", sentence="Trust corrected."))
    told = cannot(found)
    assert (
        told.startswith(f"The corrected model errs more than a guess that knows nothing of the boat {said}")
        if said
        else not told
    )
    lines = opening(story(2.0, 0.5), found)
    assert lines[:2] == ["The model is missing Munk moment.", told] if said else told not in lines


def test_beside_a_poor_acceleration_it_is_told_that_the_speed_is_predicted_as_well_as_it_is_measured():
    models = (
        scored("nominal", (-99.0, -99.0, -99.0), (9.0, 9.0, 9.0)),
        scored("corrected", (0.6, -1.7, 0.4), (0.1,) * 3),
    )
    found = NOTHING.but(models=models, best=Best(model="corrected"))
    poor, yet = "in the acceleration of sway (R² -1.7", "yet it predicts that speed as well as the sensors tell it"
    assert f"{poor})" in cannot(found)
    assert f"{poor}, {yet})" in cannot(found.but(noise=ByAxis(surge=0.01, sway=0.08, yaw=0.01)))
    assert f"{poor})" in cannot(found.but(noise=ByAxis(surge=0.1, sway=0.06, yaw=0.1)))


def test_it_is_told_of_the_model_to_trust_and_of_the_corrected_one_where_none_is():
    models = (
        scored("nominal", (0.1, 0.1, 0.1), (0.1, 0.1, 0.1)),
        scored("corrected", (-9.0, 0.1, 0.1), (0.1, 0.1, 0.1)),
    )
    assert cannot(NOTHING.but(models=models, best=Best(model="nominal"))) == ""
    assert "surge (R² -9.0)" in cannot(NOTHING.but(models=models, best=Best(sentence="Trust none.")))
    assert cannot(NOTHING) == ""
    other = models[1].but(name="run")
    against = Margin(model="run", against=GUESS.name, relative=0.5)
    none = NOTHING.but(models=(models[0], other, GUESS), best=Best(sentence="Trust none.", guess=against))
    assert cannot(none).startswith(
        "run errs more than a guess that knows nothing of the boat in the acceleration of surge"
    )


@pytest.mark.parametrize("grounds", [None, *Grounds])
def test_what_is_missing_hardly_matters_only_where_no_model_errs_less(grounds: Grounds | None):
    best = Best(model="nominal", sentence="Trust nominal.", grounds=grounds)
    told = recommendation(story(2.0, 1.0).but(missing=("munk_moment",)), NOTHING.but(best=best))
    assert told.endswith("hardly matters on these rows.") == (grounds in (None, Grounds.NONE_BETTER))


def test_the_page_says_it_under_its_headline(tmp_path: Path):
    run = read_run(write_sample(tmp_path / "run", seconds=60.0))
    poor = [m.but(acceleration=m.acceleration.but(r2=m.acceleration.r2.but(sway=-32.0))) for m in run.comparison.models]
    said = str(page(replace(run, comparison=run.comparison.but(models=tuple(poor)))))
    _, _, after = said.partition("</h1>")
    assert re.match(r'\s*<p class="warn">[\w ]+ errs more than a guess [^<]*sway \(R² -32\)', after)


@pytest.mark.parametrize(
    ("horizon", "position", "led"), [("2", 0.15, "yaw"), ("2", 0.1, "position"), ("10", 0.15, "position")]
)
def test_where_two_seconds_decide_and_no_place_changes_a_speed_leads(horizon: str, position: float, led: str):
    def step(place: float, yaw: float) -> Any:
        errors = {"position": place, "surge": 0.03, "sway": 0.04, "yaw": yaw}
        return SimpleNamespace(rollout_rmse={horizon: errors}, rollout=lambda _: SimpleNamespace(of=errors.get))

    assert hero([step(0.15, 0.045), step(position, 0.004)], horizon).metric == led


def test_where_nothing_is_missing_the_first_sentence_says_which_sensors_err():
    scale = SensorError(error="gyro_scale", verdict="present", sentence="The gyro shows 1.12 of every turn.")
    bias = SensorError(error="gyro_bias", verdict="no evidence", sentence="As it should be.")
    nothing = story(2.0, 2.0).but(
        verdict="nothing missing", headline="Nothing material is missing.", steps=(), missing=(), sensors=(scale, bias)
    )
    told = headline(nothing, NOTHING)
    assert told.endswith("The log's sensors err: gyro scale.")
    assert headline(nothing.but(headline=told), NOTHING) == told
    assert "sensors" not in headline(story(2.0, 0.5).but(sensors=(scale,)), NOTHING)
