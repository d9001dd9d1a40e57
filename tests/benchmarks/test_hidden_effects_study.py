"""A slice of the studies of hidden effects, of nothing and of pieces: they draw, ask the verb, and say what is true."""

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from places import ROOT

from undertow.discovery.discover import find_missing
from undertow.measurements.log import read_log
from undertow.physics.worlds.world import NOISE


@pytest.fixture(scope="module")
def study() -> Iterator[ModuleType]:
    """The chapter of undertow's own worlds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "benchmarks"))
        yield importlib.import_module("study.hidden_worlds")


@pytest.mark.parametrize(("kind", "seed"), [("singles", 1), ("triples", 441), ("nothing", 550)])
def test_discovery_names_what_is_hidden_in_a_slice(study: ModuleType, kind: str, seed: int):
    logged = study.plain(kind, seed)
    record = importlib.import_module("study.verb").answer(logged)
    scoring = importlib.import_module("study.scoring")
    assert len(logged.true) == {"singles": 1, "triples": 3, "nothing": 0}[kind]
    assert scoring.exact(record)
    assert not importlib.import_module("study.limits").worse_on_fresh(record)
    known = importlib.import_module("study.limits").right_terms([record])
    assert len(known) >= len(logged.true)
    assert all(abs(term["value"] - term["truth"]) < 0.15 * term["length"] for term in known)
    assert {claim["label"] for claim in record["claims"] if claim["verdict"] == "missing"} <= {"true"}


def test_a_rival_that_does_as_well_is_what_no_judge_could_tell(study: ModuleType, monkeypatch: pytest.MonkeyPatch):
    worlds = importlib.import_module("study.worlds")
    monkeypatch.setattr(worlds, "DURATION", 150.0)
    case = worlds.draw(worlds.PARTS["singles"], 1, 1)
    monkeypatch.setattr(study, "rivals", lambda *given: iter([("sway_lift", ["sway_trim", "mean_wind"], 3.2)]))
    assert study.bound(case) == "sway_trim and mean_wind in place of sway_lift: +3.2"
    monkeypatch.setattr(study, "rivals", lambda *given: iter([("sway_lift", ["sway_trim"], 30.0)]))
    assert study.bound(case) == ""
    monkeypatch.setattr(study, "materiality", lambda *vehicles: np.array([0.0, 0.01, 0.02]))
    assert study.bound(case).endswith("10 s rollouts change by 2.0 %")


def test_the_best_rival_of_a_truth_is_worse(study: ModuleType):
    worlds = importlib.import_module("study.worlds")
    part = worlds.Part("", 1, 1, seconds=60.0)
    case = worlds.draw(part, 1, 1)
    oracle = importlib.import_module("study.oracle")
    search = oracle.search_of([case.log.motion(worlds.STEP)], case.nominal)
    true = search.evaluate(study.apply_effects(case.nominal, worlds.merged(case.hidden)), tuple(case.hidden))
    found = list(oracle.rivals(search, true))
    assert {of for of, _, _ in found} == set(case.hidden)
    assert all(set(by).isdisjoint(case.hidden) for _, by, _ in found)
    assert all(worse > 10.6 for _, _, worse in found)


def test_seeds_of_parts_and_purposes_are_apart(study: ModuleType):
    worlds = importlib.import_module("study.worlds")
    (tuning, block), (reporting, other) = worlds.SEEDS["tuning"], worlds.SEEDS["reporting"]
    assert tuning + len(worlds.PARTS) * block <= min(2_000, reporting)
    assert max(part.full for part in worlds.PARTS.values()) <= min(block, other)
    for name, every in importlib.import_module("study.studies").STUDIES.items():
        tuned, reported = ([tuple(key) for key in every.keys(purpose)] for purpose in ("tuning", "reporting"))
        assert len({*tuned, *reported}) == len(tuned) + len(reported), name


def test_an_autopilot_reacts_to_what_its_log_says(study: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(study, "DURATION", 30.0)
    boat = importlib.import_module("undertow.physics.vehicle").load_vehicle("blueboat")
    noisy, clean = (study.piloted(boat, NOISE[noise], np.random.default_rng(5)) for noise in ("rough", "clean"))
    restless = [np.median(np.abs(np.diff(log.commands, n=2, axis=0))) for log in (noisy, clean)]
    assert restless[0] > 5.0 * restless[1]
    apart = clean.odometry - np.column_stack([clean.truth.position, clean.truth.heading, clean.truth.velocity])[::5]
    assert np.abs(apart).max() < 1e-9
    log = read_log(clean.write(tmp_path / "log.csv"))
    assert {"u", "v", "r", *(unit.channel for unit in boat.thrusters)} <= set(log.channels)
    again = importlib.import_module("undertow.physics.integration").simulate_motion(boat, clean.motion(0.02))
    assert np.abs(again.velocity - clean.motion(0.02).velocity).max() < 0.02, "it drives by the commands of its log"


def test_a_piece_is_as_long_as_it_says(study: ModuleType):
    logged = study.short("20 s", 220_000)
    log = logged.write.__self__
    assert 20.0 <= np.ptp(log.odometry_time) < 20.2
    assert log.command_time[0] < log.odometry_time[0]
    assert log.command_time[-1] > log.odometry_time[-1]


def test_a_simple_law_that_a_free_curve_refutes_is_no_name(study: ModuleType):
    """The curve costs more for its many numbers than the law of the power that stood in for it."""
    worlds = importlib.import_module("study.worlds")
    case = worlds.draw(worlds.PARTS["gentle"], 103, 17064)
    motion = case.log.motion(worlds.STEP)
    rows = round(0.85 * motion.time.size)
    findings = find_missing([motion.slice(0, rows)], case.nominal).findings
    assert set(findings.missing) <= {"thrust_curve"} == set(case.hidden)
    law = [e for e in findings.candidates if e.effect == "thrust_exponent"]
    assert all("thrust_curve" in e.indistinguishable_from for e in law if e.verdict != "no evidence")


def test_a_page_tells_how_rare_chance_is(study: ModuleType):
    rare = importlib.import_module("how_rare_chance_is")
    record = {"seed": 1, "part": "field", "gain": -1.0, "rolls": False}
    even = [{**record, "better": n} for n in range(0, 1000, 10)]
    assert "**0 of 14 shares" in rare.page(even, "this")
    often = [{**record, "better": 0, "gain": 2.0}, *even[::2]]
    told = rare.page([*often, *({**r, "part": "waves"} for r in often)], "this")
    assert "**1 of 14 shares" in told  # one log of 51 is among the best of 1,000
    assert "| share p of rehearsals | field (51 logs) | waves (51 logs) |" in told
    assert "| an effect earns its price | 2.0% | 2.0% |" in told


def test_the_best_effect_of_a_log_is_rehearsed(study: ModuleType):
    rare = importlib.import_module("how_rare_chance_is")
    record = rare.judge(rare.FIRST["tuning"], 1)
    assert (record["part"], record["noise"]) == ("rough", "rough")
    assert 0 <= record["better"] <= 999
    assert not record["rolls"]
    assert "study.hidden_worlds" in sys.modules
