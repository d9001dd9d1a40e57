"""The hull diary: its facts, its sentences, its page, and the verb."""

import json
import re
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import RendererAgg
from verbs import done, refused

import undertow.fleet.hull_changes as rehearsed
import undertow.fleet.parameter_estimates as reading
from undertow.fleet.diary import diary_of
from undertow.fleet.parameter_estimates import Fleet, HullEstimate
from undertow.physics.errors import RequestError
from undertow.physics.presentation import NARROW
from undertow.reports.hull_diary import (
    Band,
    Cause,
    ChangeRecord,
    DiaryFacts,
    Moved,
    boat_sentences,
    caution,
    change_sentence,
    verdict,
)
from undertow.reports.page.figures import fleet_figures as diary_figures
from undertow.reports.page.figures.fleet_figures import strip
from undertow.reports.page.page import diary_page

PARAMETERS = ("X_u", "X_uu", "thrusters.port.scale", "thrusters.stbd.scale", "mass")
NOMINAL = np.array([-15.0, -8.0, 1.0, 1.0, 30.0])
START = datetime(2026, 5, 1, 12, tzinfo=UTC).timestamp()


def made() -> Fleet:
    """Three boats on forty days; the second loses a blade on the thirtieth."""
    rng = np.random.default_rng(2)
    estimates = []
    for boat in ("ada", "bo & co", "cy"):
        for day in range(40):
            shares = 1.0 + 0.02 * rng.standard_normal(5)
            shares[3] -= 0.3 * (boat == "bo & co" and day >= 29)
            shares[4] += 0.4 * (boat == "cy" and day == 20)
            values = NOMINAL * shares
            covariance = np.diag((0.005 * NOMINAL) ** 2)
            estimates.append(HullEstimate(boat, START + 86400.0 * day, 0.25, values, covariance, f"{boat}/{day}.csv"))
    return Fleet(PARAMETERS, NOMINAL, tuple(sorted(estimates, key=lambda one: one.time)))


@pytest.fixture(scope="module")
def diary() -> DiaryFacts:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rehearsed, "MOST_REPEATS", 2)
        return diary_of(made(), "harbour")


def test_the_facts_say_what_happened_to_which_boat_and_when(diary: DiaryFacts):
    assert [boat.boat for boat in diary.changed] == ["bo & co"]
    (change,) = diary.changed[0].changes
    assert change.causes == (Cause.PROPELLER,)
    assert change.thrusters == ("thrusters.stbd.scale",)
    assert (change.first, change.alarm) == ("2026-05-30", "2026-05-30")
    lost = next(one.share for one in change.moved if one.parameter == "thrusters.stbd.scale")
    assert lost.low < -0.3 < lost.high
    now = diary.changed[0].parameters[3]
    assert now.own.high < 0.8
    assert len(now.rows) == 40
    assert DiaryFacts.read(json.loads(json.dumps(diary.to_dict(), allow_nan=False)), "file", "") == diary


def test_the_sentences_say_it(diary: DiaryFacts):
    assert verdict(diary) == "1 of 3 boats changed."
    told = boat_sentences(diary.changed[0]).replace("\N{NO-BREAK SPACE}", " ")
    assert re.match(
        r"Propeller damage \(stbd\)\. Thrust of stbd (29|30|31) % less \(\d\d to \d\d %\) from 2026-05-30", told
    )
    assert caution(diary).startswith("Alarms are set for at most 1 false a boat and year")
    assert caution(diary).endswith("%.")
    lacking = caution(diary.but(missing=("bo/2026-06-20.csv",)))
    assert lacking.endswith(" 1 log given to this fleet is not in it: its fleet.json says why.")
    assert "On 2026-05-21 alone, mass was 4" in boat_sentences(diary.boats[2])
    same = boat_sentences(diary.boats[0])
    assert same.startswith(
        "Nothing changed on the 40 days that it logged; a week would have shown a change of drag ahead"
    )


def test_sizes_are_told_as_they_are():
    def told(value: float, low: float, high: float) -> str:
        moved = Moved(parameter="X_uu", part="drag ahead", share=Band(value=value, low=low, high=high))
        days = dict.fromkeys(("alarm", "first", "earliest", "latest"), "2026-05-30")
        return change_sentence(ChangeRecord(causes=(Cause.UNNAMED,), moved=(moved,), **days)).replace(NARROW, " ")

    assert told(0.997, 0.9, 1.1).startswith("Quadratic drag ahead 100 % more (90 to 110 %) from")
    assert "25 % less (24.8 to 25.2 %)" in told(-0.25, -0.252, -0.248)
    assert "4 % less (-2.0 to 10 %)" in told(-0.04, -0.1, 0.02)  # the other way is within it


def test_two_causes_are_told_as_two():
    change = ChangeRecord(
        causes=(Cause.PAYLOAD, Cause.BATTERY),
        alarm="2026-05-30",
        first="2026-05-30",
        earliest="2026-05-29",
        latest="2026-05-30",
        moved=(Moved(parameter="mass", part="mass", share=Band(value=0.2, low=0.1, high=0.3)),),
    )
    assert change_sentence(change).endswith("known on 2026-05-30. The logs do not tell these apart.")


def test_the_page_is_whole_and_quiet(diary: DiaryFacts):
    page = diary_page(diary)
    assert page.count("<svg") == 1 + 1 + 3 * len(PARAMETERS)  # the sign, the strip, the courses
    assert "bo &amp; co" in page
    assert 'id="boat-bo%20%26%20co"' in page
    assert re.findall(r"(?:src|href)=\"(?!#|data:)[^\"]*\"", page) == []


def test_names_in_the_strip_do_not_lie_over_each_other(diary: DiaryFacts, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(diary_figures, "drawn", lambda figure, _: figure)
    boat = diary.changed[0]
    days = (("2026-05-14", "2026-05-20"), ("2026-05-23", "2026-05-29"))
    several = tuple(boat.changes[0].but(first=f, earliest=f, latest=f, alarm=a, goes_on=True) for f, a in days)
    for last, told in (("2026-05-29", "13 May"), ("2026-06-30", "15 May")):
        (axes,) = strip(diary, [boat.but(changes=several, first="2026-05-01", last=last)]).axes  # type: ignore[attr-defined]
        assert told in {label.get_text() for label in axes.get_xticklabels()}  # days, and of which month
        drawer = RendererAgg(2000, 200, 72)
        one, other = (text.get_window_extent(drawer) for text in axes.texts if "%" in text.get_text())
        assert not one.overlaps(other)


def test_the_verb_writes_a_page_and_prints_facts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(rehearsed, "MOST_REPEATS", 2)
    monkeypatch.setattr(reading, "read_fleet", lambda folder: made())
    page = tmp_path / "diary.html"
    assert "Propeller damage (stbd)" in done("diary", tmp_path / "fleet", "--out", page)
    assert page.read_text(encoding="utf-8").startswith("<!doctype html>")
    told = json.loads(done("diary", tmp_path / "fleet", "--out", page, "--json"))
    assert told["schema"] == "undertow.diary/1"
    assert [boat["changes"][0]["causes"] for boat in told["boats"] if boat["changes"]] == [["propeller damage"]]
    page.write_text("mine")
    monkeypatch.chdir(tmp_path)
    refused("diary", tmp_path / "fleet", "--out", page, match="--force")


def test_what_no_log_says_is_not_told(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(rehearsed, "MOST_REPEATS", 1)
    fleet = made()
    unknown = np.array([1.0, 1.0, 1.0, 1.0, np.nan])
    logs = [replace(one, values=one.values * unknown, covariance=one.covariance * unknown) for one in fleet.estimates]
    diary = diary_of(replace(fleet, estimates=tuple(logs)))
    (change,) = diary.changed[0].changes
    assert change.causes == (Cause.PROPELLER,)
    assert "mass" not in {moved.parameter for moved in change.moved}
    assert not any("mass" in boat_sentences(boat) for boat in diary.boats)
    assert np.isnan(diary.parameters[4].mean.value)
    (day,) = diary_of(replace(fleet, estimates=fleet.estimates[:1])).boats
    assert boat_sentences(day).startswith("Nothing changed on the only day that it logged; that is too little")


def test_a_fleet_that_says_nothing_is_refused():
    with pytest.raises(RequestError, match="expected logs that say something of a hull, got none"):
        diary_of(Fleet(PARAMETERS, NOMINAL, ()))
    with pytest.raises(RequestError, match="read_fleet"):
        diary_of("fleet")  # type: ignore[arg-type]
