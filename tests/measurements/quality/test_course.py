"""Axes told by course and heading, where no speed was measured: on straight and on curved runs."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from logged import without_a_file

from undertow.measurements.canonical import Channel
from undertow.measurements.inspection import inspect_log
from undertow.measurements.log import Log
from undertow.measurements.quality.axes import course_of
from undertow.measurements.quality.record import Finding
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

BOAT = load_vehicle("blueboat")
TIME = np.arange(0.0, 240.0, 0.2)
CURVED = 0.8 * np.sin(0.05 * TIME) + 0.02 * TIME
STRAIGHT = np.full(TIME.size, np.radians(25.0)) + 0.02 * np.sin(0.7 * TIME)


def run(psi: np.ndarray, astern: bool = False, command: float | None = None) -> dict[str, Channel]:
    """A boat at 1.2 m/s that drifts a little outwards in turns."""
    speed = -1.2 if astern else 1.2
    course = psi + 0.5 * np.gradient(psi, TIME)
    rng = np.random.default_rng(3)
    x, y = (np.cumsum(0.2 * speed * part(course)) + 0.03 * rng.normal(size=TIME.size) for part in (np.cos, np.sin))
    values = {"x": x, "y": y, "psi": psi.copy()}
    if command is not None:
        values["newton_port"] = np.full(TIME.size, command)
    return {name: Channel(name, TIME, value, name) for name, value in values.items()}


def changed(channels: dict[str, Channel], **changes: np.ndarray) -> dict[str, Channel]:
    return channels | {name: Channel(name, TIME, value, name) for name, value in changes.items()}


def told(channels: dict[str, Channel]) -> list[Finding]:
    findings = inspect_log(Log(Path("log.csv"), channels)).quality
    return [one for one in findings if one.check == "units" and one.verdict in ("defect", "warning")]


def test_a_sound_log_has_nothing_told_on_any_course():
    for psi in (CURVED, STRAIGHT, -CURVED, 0.1 * TIME):
        assert told(run(psi)) == []
        assert told(run(psi, command=20.0)) == []


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda c: {"psi": 0.5 * np.pi - c["psi"].value},
            "^psi has the opposite.*by 90 degrees.*x and y are swapped",
        ),
        (lambda c: {"psi": -c["psi"].value}, "opposite sign.*y has the opposite sign"),
        (lambda c: {"x": c["y"].value, "y": c["x"].value}, "x and y are swapped"),
        (lambda c: {"x": -c["x"].value}, "x has the opposite sign"),
        (lambda c: {"psi": c["psi"].value + 0.5 * np.pi}, "90 degrees to the left"),
        (lambda c: {"psi": c["psi"].value - np.radians(40.0)}, "(39|40|41) degrees to the right"),
    ],
)
def test_mixed_axes_are_told_on_a_curved_run(change, words):
    channels = run(CURVED)
    (finding,) = told(changed(channels, **change(channels)))
    assert finding.verdict == "defect"
    assert finding.refused
    assert re.search(words, finding.sentence), finding.sentence
    assert "psi: {from: ..." in finding.remedy


def test_the_line_of_the_map_mends_it():
    channels = run(CURVED)
    mirrored = 0.5 * np.pi - channels["psi"].value
    (finding,) = told(changed(channels, psi=mirrored))
    assert "scale: -1, offset: 1.5708" in finding.remedy
    assert told(changed(channels, psi=1.5708 - mirrored)) == []


@pytest.mark.parametrize(("offset", "words"), [(np.pi / 2, "90 degrees to the left"), (-1.4, "degrees to the right")])
def test_on_one_course_it_is_a_warning_for_a_current_does_as_much(offset, words):
    channels = run(STRAIGHT)
    (finding,) = told(changed(channels, psi=channels["psi"].value + offset))
    assert finding.verdict == "warning"
    assert words in finding.sentence
    assert "a current or much drift does so, too" in finding.sentence


def test_the_bow_is_told_from_the_stern_by_what_is_commanded():
    ahead = run(CURVED, command=20.0)
    (finding,) = told(changed(ahead, psi=ahead["psi"].value + np.pi))
    assert "the bow is taken for the stern" in finding.sentence
    assert told(run(CURVED, astern=True, command=-20.0)) == []
    assert told(run(CURVED, astern=True)) == [], "it may have been driven astern"


@pytest.mark.parametrize("seed", [0, 1])
def test_axes_are_told_of_a_boat_that_spins_drifts_and_goes_astern(seed):
    """Of these logs a fixed concentration of course and heading, 0.8, told nothing."""
    log = without_a_file(simulate_world(BOAT, {}, programme="rich", duration=150.0, noise="field", seed=seed))
    channels = {name: channel for name, channel in log.channels.items() if name not in ("u", "v", "r")}
    assert told(channels) == []
    x, y = channels["x"], channels["y"]
    (finding,) = told(channels | {"x": replace(x, value=y.value), "y": replace(y, value=x.value)})
    assert finding.refused
    assert "x and y are swapped" in finding.sentence


def test_half_a_log_astern_is_sound():
    back = (TIME > 60.0) & (TIME < 150.0)
    channels = run(CURVED)
    way = np.where(back, -1.2, 1.2)
    course = CURVED + 0.5 * np.gradient(CURVED, TIME)
    north, east = (np.cumsum(0.2 * way * part(course)) for part in (np.cos, np.sin))
    assert told(changed(channels, x=north, y=east)) == []


def test_a_turn_to_one_side_with_much_drift_is_sound():
    psi = 0.3 * TIME
    channels = run(psi)
    north, east = (np.cumsum(0.2 * 1.2 * part(psi - np.radians(38.0))) for part in (np.cos, np.sin))
    assert told(changed(channels, x=north, y=east)) == []


@pytest.mark.parametrize(("still", "verdicts"), [(40.0, []), (0.0, ["defect"])])
def test_a_wrong_angle_is_wrong_from_the_first_piece_on_a_drift_grows(still, verdicts):
    """A boat that a tether drags aside after `still` s, on courses of all directions, was refused for its axes."""
    aside = np.radians(40.0 + 8.0 * np.sin(0.11 * TIME)) * np.clip((TIME - still) / 20.0 + (still == 0.0), 0.0, 1.0)
    psi = 2.0 * np.sin(0.06 * TIME)
    north, east = (np.cumsum(0.2 * 1.2 * part(psi + aside)) for part in (np.cos, np.sin))
    assert [one.verdict for one in told(changed(run(psi), x=north, y=east))] == verdicts


def test_a_heading_of_another_thing_contradicts_the_track():
    channels = run(0.1 * TIME)
    jitter = 0.3 + 0.05 * np.random.default_rng(0).normal(size=TIME.size)
    course = course_of([Log(Path("log.csv"), changed(channels, psi=jitter))])
    assert course is not None
    assert course.unrelated.refuses
    (finding,) = told(changed(channels, psi=jitter))
    assert "heading and track contradict each other" in finding.sentence


def test_heading_and_rate_that_share_nothing_are_told():
    channels = run(CURVED)
    rng = np.random.default_rng(5)
    other = rng.choice([-0.3, 0.3], TIME.size // 20 + 1).repeat(20)[: TIME.size]
    findings = told(changed(channels, r=other))
    assert any("heading and yaw rate contradict each other" in one.sentence for one in findings)
    late = np.interp(TIME - 3.0, TIME, np.gradient(channels["psi"].value, TIME))
    assert not any("contradict" in one.sentence for one in told(changed(channels, r=late))), "late is another fault"
