"""The harness of the studies, of made-up records: they are kept and scored, odds are fitted, pages tell what holds."""

import importlib
import json
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from made_up_records import NAMES, claim, drawn, record
from places import ROOT

from undertow.discovery.effect_findings import Reason
from undertow.discovery.judgement import SUPPORT, Logistic, Odds

SURE, UNSURE = (Odds(one, one, 0.001, 0.05, {}) for one in (Logistic(zero, {"gain": 1.0}) for zero in (0.0, -9.0)))


@pytest.fixture(scope="module", autouse=True)
def benchmarks() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "benchmarks"))
        yield


def chapter(name: str) -> ModuleType:
    return importlib.import_module(name)


# Records


def squared(number: int) -> dict[str, Any]:
    return {"number": number, "square": number**2, "third": number / 3.0}


def gathered(path: Path, numbers: range, judge: Any = squared) -> list[dict[str, Any]]:
    records = chapter("study.records")
    file = records.opened(path, ("fleet",))
    return list(records.resumed(file, numbers, judge, 1, lambda r: r["number"]))[-1]


def refuse(number: int) -> dict[str, Any]:
    raise AssertionError(f"{number} was asked again")


def test_a_study_goes_on_where_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    records, path = chapter("study.records"), tmp_path / "kept.jsonl.gz"
    assert [r["square"] for r in gathered(path, range(3))] == [0, 1, 4]
    assert gathered(path, range(3), refuse)[1] == {"number": 1, "square": 1, "third": 0.33333}
    with pytest.raises(AssertionError, match="3 was asked again"):
        gathered(path, range(4), refuse)
    assert len(gathered(path, range(2, 6))) == 4
    assert len(records.opened(path, ("fleet",)).records) == 6, "what is not asked about stays"
    monkeypatch.setattr(records, "fingerprint", lambda packages: "another source")
    assert records.opened(path, ("fleet",)).stale
    with pytest.raises(AssertionError, match="0 was asked again"):
        gathered(path, range(3), refuse)


def test_a_log_on_which_the_verb_fell_over_is_asked_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    studies, path = chapter("study.studies"), tmp_path / "kept.jsonl.gz"
    monkeypatch.setattr(studies, "answer", lambda logged: 1 / 0)
    monkeypatch.setitem(
        studies.STUDIES, "plain", studies.Study(lambda purpose: [("singles", 1)], lambda kind, seed: None)
    )
    (fell,) = [r for records in studies.run("plain", studies.opened(path), [("singles", 1)], 1) for r in records]
    assert (fell["verdict"], fell["told"]) == ("crashed", "ZeroDivisionError: division by zero")
    assert chapter("study.scoring").outcome(fell) == "crashed"
    monkeypatch.setattr(studies, "answer", lambda logged: record(seed=1))
    *_, (now,) = studies.run("plain", studies.opened(path), [("singles", 1)], 1)
    assert now["verdict"] == "missing"


def test_records_are_carried_over_where_facts_stay(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    studies, path = chapter("study.studies"), tmp_path / "kept.jsonl.gz"
    keys = [("singles", seed) for seed in range(50)]
    monkeypatch.setitem(studies.STUDIES, "plain", studies.Study(lambda purpose: keys, lambda kind, seed: seed))
    monkeypatch.setattr(studies, "answer", lambda seed: record(seed=seed, rests=[["surge", 0.1]]))
    list(studies.run("plain", studies.opened(path), keys, 1))
    asked: list[int] = []

    def slightly_other(seed: int) -> dict[str, Any]:
        asked.append(seed)
        return record(seed=seed, rests=[["surge", 0.10001]], missing=["judged otherwise"], seconds=9.0)

    monkeypatch.setattr(studies, "answer", slightly_other)
    monkeypatch.setattr(chapter("study.records"), "fingerprint", lambda packages: "another source")
    *_, kept = studies.run("plain", studies.opened(path), keys, 1)
    assert len(asked) == 20, "a sample"
    assert [one["rests"][0][1] for one in kept] == [0.1] * 50
    assert not studies.opened(path).stale
    monkeypatch.setattr(studies, "answer", lambda seed: record(seed=seed, rests=[["surge", 0.11]]))
    monkeypatch.setattr(chapter("study.records"), "fingerprint", lambda packages: "a third source")
    list(studies.run("plain", studies.opened(path), keys[:10], 1))
    file = studies.opened(path)
    assert [one["rests"][0][1] for one in file.records] == [0.11] * 10, "other facts: made anew"
    assert {one["source"] for one in file.older} == {"another source"}, "what is not asked about stays"
    assert len(studies.told(file, keys, chapter("study.scoring").read_odds())) == 50
    *_, kept = studies.run("plain", file, keys, 1)
    assert [one["rests"][0][1] for one in kept] == [0.11] * 50


@pytest.mark.parametrize(
    ("written", "same"),
    [([0.04, 0.0, 0.0], True), ([0.0408, 0.0, 0.0], True), ([0.05, 0.0, 0.0], False), ([None], False)],
)
def test_errors_on_another_run_are_alike_by_a_share_of_the_nominal_error(written: list[float | None], same: bool):
    alike, nominal = chapter("study.studies").alike, [1.0, 0.0, 0.0]
    was = record(fresh={"nominal": nominal, "written": [0.04, 0.0, 0.0]})
    assert alike(was, {**was, "fresh": {"nominal": nominal, "written": written}}) == same
    assert not alike(was, {**was, "fresh": {"nominal": nominal}})


def test_words_about_the_source_make_no_record_stale():
    bare = chapter("study.records").bare
    plain = 'def f(x: int) -> str:\n    return "a"\n'
    told = '"""What it is."""\n\n# why\ndef f(x: int) -> str:\n    """Give a letter."""\n\n    return "a"\n'
    assert bare(plain) == bare(told)
    assert bare(plain) != bare(plain.replace('"a"', '"b"'))


def test_what_makes_facts_is_there():
    records = chapter("study.records")
    assert [one for one in records.FACTS if not (records.ROOT / one).exists()] == []
    assert records.fingerprint(("residuals/scores.py",)) != records.fingerprint(("residuals/series.py",))


def test_the_judgement_makes_no_fact(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    records = chapter("study.records")
    monkeypatch.setattr(records, "ROOT", tmp_path)
    (tmp_path / "discovery").mkdir()
    for name, text in (("search.py", "X = 1\n"), ("judgement.py", "Y = 1\n"), ("odds.json", "{}")):
        (tmp_path / "discovery" / name).write_text(text)

    def now() -> str:
        records.fingerprint.cache_clear()
        return records.fingerprint()

    before = now()
    for name in ("judgement.py", "odds.json"):
        (tmp_path / "discovery" / name).write_text("")
        assert now() == before
    (tmp_path / "discovery" / "search.py").write_text("X = 2\n")
    assert now() != before
    records.fingerprint.cache_clear()


# Scores


def test_names_are_held_against_the_truth():
    scoring = chapter("study.scoring")
    weak = record(true=["thruster_asymmetry[port]"], missing=["thruster_asymmetry[stbd]"])
    assert not scoring.exact(weak)
    assert scoring.false_names(weak) == ["thruster_asymmetry[stbd]"]
    assert scoring.exact({**weak, "true": ["thruster_asymmetry"]})
    term = record(unnamed=["yaw:u|r|"])
    assert scoring.false_names(term) == ["yaw:u|r|"]
    assert not scoring.exact(term)
    assert scoring.exact({**term, "study": "foreign"}), "where the model is not the catalogue's, a term is honest"
    both = record(true=["sway_lift", "yaw_trim"], likely=["yaw_trim"])
    assert not scoring.exact(both)
    assert scoring.exact(both, "missing", "likely")


def test_another_judgement_of_the_same_facts_answers_otherwise():
    scoring = chapter("study.scoring")
    kept = record(likely=["yaw_trim"], claims=[claim("sway_lift"), claim("yaw_trim", "false", gain=3.0)])
    sure = scoring.rescored(kept, SURE)
    assert (sure["missing"], sure["likely"], sure["first"]) == (["sway_lift"], ["yaw_trim"], "sway_lift")
    unsure = scoring.rescored(kept, UNSURE)
    assert (unsure["missing"], unsure["likely"], unsure["verdict"]) == ([], [], "undecided")
    same = claim("sway_lift", null_excluded=False)
    assert scoring.rescored(record(claims=[same]), SURE)["missing"] == []
    assert scoring.rescored(record(claims=[{**claim("sway_lift"), "kept": False}]), SURE)["missing"] == []


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({}, "exact"),
        ({"missing": ["yaw_trim"]}, "false"),
        ({"true": ["sway_lift", "yaw_trim"]}, "part"),
        ({"missing": [], "likely": ["sway_lift"], "verdict": "likely"}, "likely"),
        (
            {"missing": [], "sensors": ["gyro_bias"], "sensors_true": ["gyro_bias"], "verdict": "undecided"},
            "sensor told",
        ),
        ({"missing": [], "forms": [["surge", "u beyond 0.8 m/s", 0.2]], "forces": ["surge:u"]}, "a force"),
        (
            {"missing": [], "forms": [["surge", "r|r|", 0.2]], "forces": ["surge:u"], "verdict": "undecided"},
            "undecided",
        ),
        ({"missing": [], "verdict": "nothing missing"}, "passed by"),
        ({"missing": [], "true": [], "verdict": "nothing missing"}, "exact"),
        ({"verdict": "refused", "told": "no heading"}, "refused"),
        ({"verdict": "refused", "told": "10 values stand far out of their record", "kind": "outliers"}, "sensor told"),
    ],
)
def test_an_answer_has_one_outcome(changes: dict[str, Any], word: str):
    assert chapter("study.scoring").outcome(record(**changes)) == word


@pytest.mark.parametrize(
    ("text", "signals"),
    [
        ("u|u|", {"u"}),
        ("v beyond 0.2 m/s either way", {"v"}),
        ("ur", {"u", "r"}),
        ("the thrust of port times |r|", {"thrust", "r"}),
        ("from minute 2.1 on", {"time"}),
        ("u northeast of 12 m", {"u", "place"}),
        ("the cosine of the heading", {"heading"}),
        ("", set()),
    ],
)
def test_a_form_says_what_it_follows(text: str, signals: set[str]):
    assert chapter("study.scoring").follows(text) == signals


# Odds


@pytest.fixture(scope="module")
def names() -> Any:
    return chapter("study.fitted_odds").names_of(drawn(400))


def test_no_cause_is_in_two_folds(names: Any):
    folds = chapter("study.fitted_odds").folds_of(names.cause)
    of = {cause: {int(f) for c, f in zip(names.cause, folds, strict=True) if c == cause} for cause in set(names.cause)}
    assert set(of) == {*NAMES, "net", "gusts", "tether"}
    assert all(len(found) == 1 for found in of.values())
    assert np.bincount(folds).max() < 2 * np.bincount(folds).min()


def test_weights_have_the_signs_of_sense_and_tell_the_truth(names: Any):
    fitted = chapter("study.fitted_odds")
    turned = fitted.fit(names.columns, -names.features, names.true, 1e-3)
    weights = fitted.fit(names.columns, names.features, names.true, 1e-3)
    for each in (weights, turned):
        for name, weight in zip(names.columns, each[1:], strict=True):
            assert weight >= 0.0 if name in SUPPORT else weight <= 0.0, name
    assert weights[1 + names.columns.index("identity")] > 0.0
    assert weights[1 + names.columns.index("unexplained")] < 0.0
    odds = fitted.cross_validated(names, names.columns, (1e-3, 0.1))
    score = chapter("study.scoring").log_score
    assert score(odds, names.true) > score(fitted.as_odds(fitted.hard_rule(names), names), names.true)
    assert np.mean(odds[names.true]) > 0.8 > 0.3 > np.mean(odds[~names.true])


def test_a_fit_is_where_its_slope_is_none(names: Any):
    """Of one feature without a price, against the score equations of maximum likelihood."""
    fitted = chapter("study.fitted_odds")
    column = names.column(["identity"])
    weights = fitted.fit(["identity"], column, names.true, 0.0)
    rest = names.true - fitted.applied(weights, column)
    assert abs(rest.mean()) < 1e-3
    assert abs((rest * column[:, 0]).mean()) < 1e-3


def test_a_judge_of_few_names_is_drawn_towards_that_of_all(names: Any):
    fitted, columns = chapter("study.fitted_odds"), ["identity", "unexplained"]
    claims = [
        dict(one, claim={**one["claim"], "tests": {**one["claim"]["tests"], "rolls": 1.0}}) for one in names.claims
    ]
    some = [k < 10 for k in range(len(claims))]
    both = replace(names, claims=[b if few else a for a, b, few in zip(names.claims, claims, some, strict=True)])
    assert (both.judge == "rollouts").sum() == 10
    free, drawn_near = (fitted.fit_judges(both, columns, (1e-3, own)) for own in (0.0, 100.0))
    common = fitted.fit(columns, both.column(columns), both.true, 1e-3, both.share)
    assert drawn_near["rollouts"][1:] == pytest.approx(common[1:], rel=0.05)
    assert abs(free["rollouts"][1:] - common[1:]).max() > 10.0 * abs(drawn_near["rollouts"][1:] - common[1:]).max()


def test_odds_that_say_too_little_and_too_much_are_calibrated():
    """What is true in 0.5 p^2 / (0.5 p^2 + (1 - p)^0.5) of the cases where p is said."""
    fitted, draw = chapter("study.fitted_odds"), np.random.default_rng(3)
    said = draw.uniform(0.01, 0.99, 20_000)
    true = draw.uniform(size=said.size) < 0.5 * said**2 / (0.5 * said**2 + (1.0 - said) ** 0.5)
    shift, low, high = fitted.calibration_of(said, true)
    assert (shift, low, high) == pytest.approx((np.log(0.5), 2.0, 0.5), abs=0.1)


def test_a_feature_that_no_name_has_is_not_fitted(names: Any):
    fitted = chapter("study.fitted_odds")
    assert {*names.judge} == {"forces"}
    found = fitted.fitted(names)
    _, weights = found.models["forces"]
    columns = list(weights)
    common = fitted.fit(columns, names.column(columns), names.true, found.price[0], names.share)
    others = dict(zip(columns, common[1:], strict=True))
    assert found.models["rollouts"][1] == pytest.approx(others, rel=0.02), "none has the other judge: it takes all"
    assert weights
    assert set(weights) <= {name for name in fitted.FEATURES if np.ptp(names.column([name])) > 0.0}
    assert found.price in fitted.PRICES
    least = min(weights, key=lambda name: abs(weights[name]))
    assert least not in fitted.fitted(names, least).models["forces"][1]


def test_odds_are_written_as_the_judgement_reads_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any):
    script, studies = chapter("odds"), chapter("study.studies")
    path = tmp_path / "odds.json"
    command = ["--studies", "plain", "--folder", str(tmp_path), "--write", "--into", str(path)]
    assert script.main(command) == 2
    file = studies.stored("plain", "tuning", tmp_path)
    file.save([*drawn(300), record(true=["sway_lift", "yaw_trim"], nearly=["yaw_trim"], sensors=["gyro_bias"])])
    assert script.main(command) == 0
    odds = chapter("study.scoring").read_odds(path)
    assert 0.0 < odds.unselected < odds.nearly < 1.0
    assert odds.sensors["present"] == pytest.approx(10.0 * 0.9 / 11.0, rel=1e-4)
    assert json.loads(path.read_text())["made"].startswith("python benchmarks/odds.py --write: 301 names of 301 logs")
    assert "| 0.95 to 1 |" in capsys.readouterr().out
    monkeypatch.setattr(chapter("study.records"), "fingerprint", lambda packages: "another source")
    assert script.main(command) == 2
    assert "STALE, left out: plain-tuning" in capsys.readouterr().err


# Ablation


def test_every_doubt_and_every_test_has_a_row():
    script = chapter("ablation")
    odds = chapter("study.scoring").read_odds()
    page = script.page(drawn(300), [record(seed=n) for n in range(5)], odds, "this")
    rows = [line.split(" | ")[0].removeprefix("| ") for line in page.splitlines() if line.startswith("| ")]
    assert {reason.value for reason in Reason} <= set(rows)
    assert set(chapter("study.fitted_odds").names_of(drawn(1)).columns) <= set(rows)
    (told,) = [line for line in page.split("## Each doubt")[1].splitlines() if line.startswith("| lasting_rest |")]
    false = [r for r in drawn(300) if r["claims"][0]["label"] == "false"]
    nameless = sum(r["nameless"] for r in false)
    assert told == f"| lasting_rest | {len(false) - nameless}, 0 | 0, 0 | {nameless}, 0 | 0, 0 | 0, 0 |"
    assert "| told 0.95 to 1: told and true differ by | at most 5 % |" in page


def test_a_test_alone_stops_what_is_beyond_its_limit():
    stops = chapter("study.fitted_odds").stops
    strong = claim("sway_lift")
    weak = claim(
        "sway_lift", gain=3.0, identity=0.0, force=0.001, rollout=0.5, null_excluded=False, tests={"unexplained": 0.6}
    )
    assert not [
        test for test in ("gain", "identity", "worth", "rollout_worth", "clear", "unexplained") if stops(test, strong)
    ]
    stopped = ["gain", "identity", "worth", "clear", "unexplained"]
    assert [test for test in (*stopped, "rollout_worth", "accused") if stops(test, weak)] == stopped


# Pages


def test_a_limit_that_does_not_hold_is_told():
    limits, tables = chapter("study.limits"), chapter("study.tables")
    good, bad = record(), record(seed=1, missing=["yaw_trim"], first="yaw_trim", claims=[claim("yaw_trim", "false")])
    page = tables.page("hidden_effects", {"plain": [good, bad]}, "this")
    assert "Written by `this`; do not edit." in page
    assert "**1 of 2 logs got a false name**" in page
    assert "of those that can be told | at least 99 % | 50.0 % (1 of 2) | **no** |" in page
    assert "| three effects: the same | at least 95 % | not run |  |" in page
    assert "- singles, seed 1 (rich, field): missing yaw_trim, for sway_lift" in page
    untellable = {**bad, "tellable": False, "bound": "mean_wind in place of sway_lift: +1.0"}
    page = tables.page("hidden_effects", {"plain": [good, untellable]}, "this")
    assert "of those that can be told | at least 99 % | 100.0 % (1 of 1) | yes |" in page
    assert "(mean_wind in place of sway_lift: +1.0)" in page
    assert limits.NOTHING[0].cells({"nothing": [record("nothing", "rich", true=[])]})[3] == "**no**"


def test_figures_of_foreign_worlds():
    limits, shown = chapter("study.limits"), {}
    told = record("foreign", "arm 5 % wrong")
    mute = {**told, "missing": [], "verdict": "undecided", "claims": []}
    errs = {**mute, "sensors_true": ["gyro_bias"]}
    trifle = {**mute, "matters": 0.01, "dominant": ""}
    other = {**told, "study": "others", "missing": ["yaw_trim"], "likely": ["sway_lift"], "seconds": 20.0}
    records = {"foreign": [told, mute, errs, trifle], "others": [other]}
    for row in limits.FOREIGN:
        shown.setdefault(row.title, row.cells(records)[2])
    assert shown["the cause is in the catalogue: it is missing or likely"] == "50.0 % (2 of 4)"
    assert shown["the same, where no sensor errs"] == "66.7 % (2 of 3)"
    assert shown["a false name is missing"] == "20.0 % (1 of 5)"
    assert shown["undecided or nothing missing, though one effect makes over half of the error"] == "50.0 % (2 of 4)"
    assert shown["answered within 10 s"] == "80.0 % (4 of 5)"


def test_a_written_model_is_held_against_the_best_of_the_others():
    worse = chapter("study.limits").worse_on_fresh
    nominal = [1.0, 0.5, 0.5]
    assert not worse({"fresh": {"nominal": nominal, "written": nominal}})
    assert not worse({"fresh": {"nominal": nominal, "written": [0.02, 0.0, 0.0], "calibrated": [0.0196, 0.0, 0.0]}})
    assert worse({"fresh": {"nominal": nominal, "written": [0.4, 0.0, 0.0], "calibrated": [0.2, 0.0, 0.0]}})
    assert worse({"fresh": {"nominal": nominal, "written": [None, 0.0, 0.0]}})


def test_intervals_and_errors_of_right_names():
    limits = chapter("study.limits")
    vector = claim("steady_current")
    vector["terms"] = [
        {"symbol": "current_north", "value": 0.31, "ci95": [0.29, None], "truth": 0.3},
        {"symbol": "current_east", "value": 0.4, "ci95": [0.41, 0.5], "truth": 0.4},
    ]
    records = {"plain": [record(true=["steady_current"], claims=[vector, claim("yaw_trim", "false")])]}
    shown = {row.title: row.cells(records)[2] for row in limits.HIDDEN}
    assert shown["95 % intervals hold the truth"] == "50.0 % (1 of 2)"
    assert shown["error of coefficients, 90th percentile"] == "1.80 % (2 numbers)"


def test_a_nameless_cause_is_told_in_part_or_as_a_force():
    row = chapter("study.limits").NAMELESS[2]
    nameless = record("nameless", "a net", true=[], nameless=True, missing=[], claims=[], verdict="undecided")
    forces = {"forces": ["surge:u", "surge:time"]}
    part = {**nameless, "part": ["surge_linear_damping"], "likely": ["surge_linear_damping"]}
    force = {**nameless, **forces, "forms": [["surge", "u from minute 2.0 on", 0.1]]}
    axis = {**nameless, **forces, "forms": [["sway", "u", 0.1]]}
    pair = record("nameless", "two effects of the catalogue")
    assert row.cells({"nameless": [part, force, axis, nameless, pair]})[2] == "50.0 % (2 of 4)"


# The command


def test_what_other_sources_made_is_told_alone_where_it_is_asked_for(tmp_path: Path, capsys: Any, monkeypatch: Any):
    script, studies = chapter("through_the_verb"), chapter("study.studies")
    kept = [record(kind=kind, seed=seed) for kind, seed in studies.STUDIES["plain"].keys("tuning")[:3]]
    studies.stored("plain", "tuning", tmp_path).save(kept)
    odds = tmp_path / "odds.json"
    odds.write_text(json.dumps(asdict(SURE)))
    where = ["--folder", str(tmp_path), "--pages", str(tmp_path), "--odds", str(odds)]
    command = ["plain", "--tell", "--logs", "3", *where]
    assert script.main(command) == 0
    assert "plain, tuning: 3 logs: 3 exact" in capsys.readouterr().out
    assert "# Hidden effects" in (tmp_path / "hidden_effects.md").read_text()
    monkeypatch.setattr(chapter("study.records"), "fingerprint", lambda packages: "another source")
    assert script.main(command) == 2
    assert "STALE" in capsys.readouterr().err
    assert script.main([*command, "--stale"]) == 0
    told = capsys.readouterr()
    assert "STALE" in told.err
    assert "3 exact" in told.out


def test_logs_that_are_not_here_are_passed_over_aloud(tmp_path: Path, capsys: Any, monkeypatch: Any):
    script, field = chapter("through_the_verb"), chapter("study.field_logs")
    monkeypatch.setattr(field, "FOLDERS", dict.fromkeys(field.FOLDERS, tmp_path / "nowhere"))
    command = ["field", "--seeds", "reporting", "--folder", str(tmp_path), "--jobs", "1"]
    assert script.main(command) == 0
    assert "field: passed over, for they are not there: BlueBoat on a lake" in capsys.readouterr().out


def test_field_logs_say_what_is_true(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    field = chapter("study.field_logs")
    every = field.keys("reporting")
    if not every:
        pytest.skip("these logs are not beside the repository (../shared/data)")
    assert field.keys("tuning") == []
    for key in every:
        logged = field.logged(*key)
        assert logged.true | logged.part, key
    lake = next(field.logged(*key) for key in every if key[0] == field.LAKE)
    first, last = (lake.write(tmp_path / "log.csv").read_text().splitlines()[k].split(",") for k in (0, 1))
    assert first == ["t", "x", "y", "psi", "u", "v", "r", "pwm_port", "pwm_stbd"]
    assert len(last) == len(first)


def test_the_numbers_that_decide_are_listed_with_the_odds_of_both_judges():
    listed = chapter("decisive_numbers").listed()
    odds = json.loads((ROOT / "discovery" / "odds.json").read_text("utf-8"))
    found = {number.name: number.value for number in listed if number.path == "discovery/odds.json"}
    for judge in ("forces", "rollouts"):
        for name, weight in odds[judge]["weights"].items():
            assert float(found[f"{judge}, {name}"]) == pytest.approx(weight, rel=1e-5)
    assert any(number.path.startswith("measurements/quality") for number in listed)
