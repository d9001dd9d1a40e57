"""Commands beyond the curve, and throttle and steering named as sides: told with the line that mends them."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import yaml
from logged import without_a_file

from undertow.measurements.canonical import Channel
from undertow.measurements.channels.channel_map import entries_of
from undertow.measurements.inspection import examine
from undertow.measurements.log import Log
from undertow.measurements.quality.record import Finding
from undertow.physics.integration import rollout
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, load_vehicle, vehicle_from_dict
from undertow.physics.worlds.world import simulate_world

BOAT = load_vehicle("blueboat")
NAMES = ("newton_port", "newton_stbd")


@cache
def sound() -> Log:
    return without_a_file(simulate_world(BOAT, {}, programme="zigzag", duration=120.0, noise="field", seed=11))


def changed(**values: np.ndarray) -> Log:
    channels = sound().channels
    return replace(sound(), channels=channels | {n: replace(channels[n], value=v) for n, v in values.items()})


def told(log: Log, check: str, vehicle: Vehicle | None = BOAT) -> Finding | None:
    found = [one for one in examine(log, vehicle).findings if one.check == check]
    assert len(found) <= 1
    return found[0] if found else None


def sides() -> tuple[np.ndarray, np.ndarray]:
    port, stbd = (sound().channels[name].value for name in NAMES)
    return port, stbd


def test_a_sound_log_keeps_to_its_curves_and_names():
    ok = told(sound(), "command range")
    assert ok is not None
    assert ok.verdict == "ok"
    assert told(sound(), "mixed commands") is None
    assert told(sound(), "command range", vehicle=None) is None


@pytest.mark.parametrize(("factors", "scale"), [((10.0, 10.0), 0.1), ((100 / 35, 100 / 35), 0.35), ((1.6, 1.0), 0.625)])
def test_commands_in_another_unit_are_told_with_their_factor(factors, scale):
    log = changed(**{name: factor * value for name, factor, value in zip(NAMES, factors, sides(), strict=True)})
    finding = told(log, "command range")
    assert finding is not None
    assert finding.verdict == "defect"
    assert finding.channels == tuple(name for name, factor in zip(NAMES, factors, strict=True) if factor > 1.0)
    assert f"{finding.channels[0]}: {{from: ..., scale: {scale:g}}}" in finding.remedy
    assert "beyond the end of its curve at" in finding.sentence


def test_a_curve_that_ends_a_little_early_is_no_reason_to_refuse():
    short = {"kind": "table", "command": [-33.0, 0.0, 33.0], "force": [-33.0, 0.0, 33.0]}
    content = BOAT.to_dict()
    content["thrusters"] = [{**one, "curve": short} for one in content["thrusters"]]
    finding = told(sound(), "command range", vehicle_from_dict(content, "test"))
    assert finding is not None
    assert finding.verdict == "warning"


def test_a_spike_in_a_command_is_none():
    port, _ = sides()
    spiked = port.copy()
    spiked[100] = 1000.0
    finding = told(changed(newton_port=spiked), "command range")
    assert finding is not None
    assert finding.verdict == "ok"


@pytest.mark.parametrize("share", [0.5, 1.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("first", ["throttle", "steering"])
def test_throttle_and_steering_are_told_with_lines_that_mend_them(share, sign, first):
    port, stbd = sides()
    throttle, steering = share * (port + stbd), share * sign * (port - stbd)
    pair = (throttle, steering) if first == "throttle" else (steering, throttle)
    finding = told(changed(**dict(zip(NAMES, pair, strict=True))), "mixed commands")
    assert finding is not None
    assert finding.verdict == "defect"
    assert finding.fix is not None
    at = NAMES[0] if first == "throttle" else NAMES[1]
    assert f"'newton_port: {{from: {at}" in finding.remedy
    fixed = finding.fix.apply(changed(**dict(zip(NAMES, pair, strict=True))).channels)
    assert fixed["newton_port"].value == pytest.approx(port)
    assert fixed["newton_stbd"].value == pytest.approx(stbd)


def test_the_line_can_be_read():
    port, stbd = sides()
    finding = told(changed(newton_port=port + stbd, newton_stbd=stbd - port), "mixed commands")
    assert finding is not None
    lines = [part.split("'")[1] for part in finding.remedy.split("(--map): ")[1].split(" and ")]
    entries = entries_of(Path("map"), {key: value for line in lines for key, value in yaml.safe_load(line).items()})
    entry = entries["newton_port"]
    assert entry is not None
    assert (entry.source, entry.scale) == ("newton_port", 0.5)
    assert entry.steering is not None
    assert (entry.steering.source, entry.steering.scale) == ("newton_stbd", -0.5)


def test_without_a_vehicle_the_names_are_enough():
    port, stbd = sides()
    finding = told(changed(newton_port=port + stbd, newton_stbd=port - stbd), "mixed commands", vehicle=None)
    assert finding is not None
    assert finding.verdict == "note", "sure is only what a vehicle leaves: in a zigzag, the throttle hardly moves"


def test_one_thruster_alone_is_no_steering():
    _, stbd = sides()
    channels = sound().channels
    rest = Channel("newton_stbd", channels["newton_stbd"].time, np.zeros(stbd.size), "newton_stbd")
    assert told(replace(sound(), channels=channels | {"newton_stbd": rest}), "mixed commands") is None


def mixed_boat(wrong: str = "") -> Vehicle:
    """A boat of four thrusters at 45 degrees, of which one may be wired the wrong way."""
    places = {"fl": (0.4, -0.4, 45.0), "fr": (0.4, 0.4, -45.0), "al": (-0.4, -0.4, -45.0), "ar": (-0.4, 0.4, 45.0)}
    curve = {"kind": "table", "command": [-30, 0, 30], "force": [-30, 0, 30]}
    thrusters = [
        {"name": n, "x": x, "y": y, "angle": np.radians(a + 180.0 * (n == wrong)), "command": "newton", "curve": curve}
        for n, (x, y, a) in places.items()
    ]
    return vehicle_from_dict({**BOAT.to_dict(), "thrusters": thrusters}, "mixed")


@pytest.mark.parametrize(("wrong", "late"), [("", 0.0), ("", 4.0), ("", 6.0), ("ar", 0.0), ("fl", 0.0)])
def test_one_of_four_mixed_thrusters_that_is_wired_the_wrong_way_is_told_by_the_vehicle(wrong: str, late: float):
    rng, time = np.random.default_rng(4), np.arange(0.0, 150.0, 0.05)
    sticks = [np.interp(time, np.arange(0.0, 156.0, 6.0), rng.uniform(-12.0, 12.0, 26)) for _ in range(3)]
    boat, mixed = mixed_boat(), ((1, 1, 1), (1, -1, -1), (1, -1, 1), (1, 1, -1))
    commands = np.column_stack([sum(s * stick for s, stick in zip(row, sticks, strict=True)) for row in mixed])
    driven = Motion(time, np.zeros((3000, 2)), np.zeros(3000), np.zeros((3000, 3)), commands, ("fl", "fr", "al", "ar"))
    states = rollout(mixed_boat(wrong), driven, np.array([0]), 2999).states[0] + rng.normal(0.0, 0.002, (3000, 6))
    columns = dict(zip(("x", "y", "psi", "u", "v", "r"), states.T, strict=True))
    recorded = np.roll(commands, -round(late / 0.05), axis=0)
    columns |= {f"newton_{t.name}": column for t, column in zip(boat.thrusters, recorded.T, strict=True)}
    finding = told(Log(Path("mixed"), {n: Channel(n, time, c, n) for n, c in columns.items()}), "direction", boat)
    assert finding is not None
    assert finding.verdict == ("defect" if wrong else "cannot tell")
    assert not wrong or finding.channels == (f"newton_{wrong}",)
    assert ("scale: -1" in finding.remedy) == bool(wrong)
