"""A boat that changes half way is told as one: which effect, when and by how much; one part is searched."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import undertow
from undertow.discovery.basis import DiscoverySettings, choose_balance
from undertow.discovery.changed_boat import find_change, searched, with_change
from undertow.discovery.findings import BoatChange, Findings
from undertow.discovery.search.rival_explanations import has_residual_structure
from undertow.discovery.selection import search_of
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.world import NOISE, SimulatedLog, World
from undertow.workflows.compare import compare_run
from undertow.workflows.run_folder.read import read_findings

HULL = load_vehicle("blueboat")
WEAKER = ("port_scale", 0.7)


@cache
def log_of(number: tuple[str, float] | None = None, at: float = 70.0) -> SimulatedLog:
    """A boat of which a number becomes another after some seconds; without it, one that stays as it is."""
    becomes = None if number is None else HULL.with_values(dict([number]))
    return World(HULL, "rich", 120.0, 3, becomes=becomes, changes_at=at if becomes else 0.0).run(NOISE["field"])


def change_of(motions: list[Motion], vehicle: Vehicle = HULL) -> BoatChange | None:
    return find_change(choose_balance(motions, vehicle, DiscoverySettings()), lambda text: None)


@pytest.mark.parametrize(
    ("effect", "symbol", "size", "at"),
    [("thruster_asymmetry[port]", "port_scale", -0.3, 70.0), ("lateral_cg", "y_g", 0.08, 45.0)],
)
def test_the_effect_the_instant_and_the_size_are_told(effect: str, symbol: str, size: float, at: float):
    change = change_of([log_of((symbol, HULL.value(symbol) + size), at).motion()])
    assert change is not None
    assert change.effect == effect
    assert 60.0 * (change.minute or 0.0) == pytest.approx(at, abs=1.5)
    (term,) = change.terms
    assert (term.symbol, term.value) == (symbol, pytest.approx(size, rel=0.1))
    assert change.since
    assert symbol in change.in_words


@pytest.mark.parametrize("wrong", [{}, {"X_u": -12.0, "N_uv": 9.0}], ids=["right", "wrong"])
def test_a_boat_that_stays_as_it_is_does_not_change(wrong: dict[str, float]):
    assert change_of([log_of().motion()], HULL.with_values(wrong)) is None


def test_of_several_logs_the_one_is_told_from_which_on():
    boats = (*[HULL] * 3, HULL.with_values(dict([WEAKER])))
    logs = [World(boat, "rich", 60.0, seed).run(NOISE["field"]) for seed, boat in enumerate(boats)]
    motions = [replace(log.motion(), source=f"{place}.csv") for place, log in enumerate(logs)]
    change = change_of(motions)
    assert change is not None
    assert (change.effect, change.when, change.since) == ("thruster_asymmetry[port]", "log 3.csv", False)
    kept = [motion for motion in motions for motion in searched(change, [f"{place}.csv" for place in range(4)], motion)]
    assert [motion.source for motion in kept] == ["0.csv", "1.csv", "2.csv"]


def test_a_part_is_cut_at_the_instant_and_a_moment_is_none():
    motion = log_of().motion()
    change = BoatChange(effect="lateral_cg", terms=(), log=motion.source, minute=0.5, since=True)
    (since,) = searched(change, [motion.source], motion)
    (before,) = searched(change.but(since=False), [motion.source], motion)
    assert since.minutes[0] >= 0.5 > before.minutes[-1]
    assert np.array_equal(np.concatenate([before.time, since.time]), motion.time)
    assert searched(change.but(minute=motion.minutes[-1] - 0.01), [motion.source], motion) == ()


def test_a_force_that_no_law_has_is_no_change():
    """It leaves structure, and in one log many things go with the time."""
    odd = HULL.with_values({"surge:u^3": -6.0, "yaw:v^2": 9.0})
    log = World(odd, "rich", 120.0, 3).run(NOISE["field"])
    basis = choose_balance([log.motion()], HULL, DiscoverySettings())
    search, _ = search_of(basis)
    assert has_residual_structure(search, search.run())
    assert find_change(basis, lambda text: None) is None


def test_water_that_moves_otherwise_is_no_other_boat():
    waters = ({"current_north": 0.2}, {"current_north": -0.15, "current_east": 0.2})
    days = [World(HULL.with_values(water), "rich", 90.0, seed).run(NOISE["field"]) for seed, water in enumerate(waters)]
    assert change_of([replace(day.motion(), source=f"{place}.csv") for place, day in enumerate(days)]) is None


def test_before_a_change_nothing_missing_is_no_verdict():
    found = Findings(verdict="nothing missing", missing=(), candidates=(), headline="")
    change = BoatChange(effect="lateral_cg", terms=(), log="a.csv", minute=2.0, since=False)
    told = with_change(found, change)
    assert (told.verdict, told.change, told.reasons) == ("undecided", change, (change.in_words,))
    assert with_change(found.but(verdict="missing"), change).verdict == "missing"


def test_the_verb_searches_one_part_and_says_so(tmp_path: Path):
    path = log_of(WEAKER, 45.0).write(tmp_path / "log.csv")
    run = undertow.discover(undertow.read_inputs(path, "blueboat"), progress=None)
    change = run.findings.change
    assert change is not None
    assert change.since
    assert run.findings.headline == (f"{change.begins} The model is missing thruster asymmetry of port.")
    assert change.in_words in run.findings.reasons
    assert run.findings.data.seconds == pytest.approx(75.0, abs=6.0)
    assert run.discovery.corrected.value("port_scale") == pytest.approx(0.7, abs=0.03)
    folder = undertow.write_run(run, tmp_path / "run", report=True)
    content = (folder / "findings.json").read_bytes()
    read = read_findings(content, folder / "findings.json").change
    assert read is not None
    assert (read.begins, read.in_words, read.log) == (change.begins, change.in_words, change.log)
    assert change.begins.removesuffix(":") in (folder / "report.html").read_text("utf-8")
    inputs = undertow.read_inputs(path, "blueboat")
    added = undertow.add(["surge_trim"], inputs, run.settings, run.findings, progress=None)
    assert added.findings.data.rows == run.findings.data.rows
    assert added.findings.change == change
    assert compare_run(folder).best.model
