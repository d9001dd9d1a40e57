"""Remedies are tried before they are told: late is not reversed, exchanged not swapped; a vehicle may be wrong too."""

import importlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from places import ROOT

from undertow.measurements.inspection import examine, inspect_log
from undertow.measurements.log import Log, read_log
from undertow.measurements.log_options import Reading
from undertow.measurements.quality.checks.neutral import NEUTRAL
from undertow.measurements.quality.record import Finding, Record
from undertow.measurements.statistics.blocks import surely_more
from undertow.physics.errors import LogError, VehicleError
from undertow.physics.thrusters import resting_commands
from undertow.physics.vehicle import Vehicle, load_vehicle, shipped_vehicles, vehicle_from_dict
from undertow.physics.worlds.hidden_effects import apply_effects
from undertow.physics.worlds.world import SimulatedLog, simulate_world
from undertow.workflows.inputs import read_inputs, refuse_broken_logs

BENCHMARKS = ROOT / "benchmarks"
DATA = ROOT / "tests" / "data"
HULL = load_vehicle("blueboat")


@pytest.fixture(scope="module")
def study() -> Iterator[ModuleType]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCHMARKS))
        yield importlib.import_module("study.remedies")


@pytest.fixture(scope="module")
def gazebo() -> Log:
    return read_log(DATA / "D_2.csv.gz")


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Log:
    return written(simulate_world(HULL, {}, duration=90.0, seed=3), tmp_path_factory.mktemp("log"))


def written(log: SimulatedLog, folder: Path) -> Log:
    return read_log(log.write(folder / "log.csv"))


def hull(change: Any = lambda content: None) -> Vehicle:
    content = HULL.to_dict()
    change(content)
    return vehicle_from_dict(content, "boat.yaml")


def only(findings: Any, check: str, channel: str = "") -> Finding:
    (found,) = [f for f in findings if f.check == check and (not channel or channel in f.channels)]
    return found


# Logs


@pytest.mark.parametrize("place", range(18))
@pytest.mark.parametrize("which", ["gazebo", "simulated"])
def test_a_fault_is_told_and_none_that_looks_like_it(
    study: ModuleType, which: str, place: int, request: pytest.FixtureRequest
):
    fault = (*study.FAULTS, *study.SPEED_FAULTS)[place]
    told = examine(fault.of(request.getfixturevalue(which)))
    assert study.accused(told.findings) == set(fault.told), fault.name


def test_every_fault_is_tried(study: ModuleType):
    assert len(study.FAULTS) + len(study.SPEED_FAULTS) == 18


@pytest.mark.parametrize("late", [1.0, 2.5])
def test_late_commands_are_moved_back_by_what_they_are_late(study: ModuleType, gazebo: Log, late: float):
    broken = replace(
        gazebo,
        channels={n: replace(c, time=c.time + late * n.startswith("newton")) for n, c in gazebo.channels.items()},
    )
    broken = replace(broken, channels={n: c for n, c in broken.channels.items() if not n.startswith("pwm")})
    told = examine(broken)
    found = only(told.findings, "clocks", "newton_port")
    assert (found.verdict, found.value) == ("defect", pytest.approx(-late, abs=0.03))
    clean = told.clean.channels["newton_port"].time - gazebo.channels["newton_port"].time
    assert np.allclose(clean, 0.0, atol=0.03)
    assert study.accused(examine(told.clean).findings) == set()


def test_exchanged_speeds_are_put_back(study: ModuleType, gazebo: Log):
    clean = examine(replace(gazebo, channels=study.exchanged(dict(gazebo.channels)))).clean
    assert np.array_equal(clean.channels["u"].value, gazebo.channels["u"].value)


def test_a_log_that_no_hypothesis_explains_alone_names_none():
    """One sine: late by half a period and reversed are one and the same."""
    time = np.arange(0.0, 120.0, 0.05)
    port, stbd = 10.0 * np.sin(2.0 * time), 10.0 * np.sin(2.0 * time + 1.0)
    channels = {}
    u, r = np.zeros(time.size), np.zeros(time.size)
    for k in range(1, time.size):
        u[k] = u[k - 1] + 0.05 * (-(port[k - 1] + stbd[k - 1]) / 30.0 - 0.5 * u[k - 1])
        r[k] = r[k - 1] + 0.05 * (-(port[k - 1] - stbd[k - 1]) / 30.0 - 0.8 * r[k - 1])
    values = {"psi": np.cumsum(r) * 0.05, "u": u, "v": 0.0 * u, "r": r, "newton_port": port, "newton_stbd": stbd}
    rng = np.random.default_rng(0)
    template = read_log(DATA / "D_2.csv.gz")
    for name, value in values.items():
        noise = 0.02 * rng.standard_normal(time.size) if name in ("u", "v", "r") else 0.0
        channels[name] = replace(
            template.channels["u" if name[0] != "n" else name], name=name, origin=name, time=time, value=value + noise
        )
    findings = examine(replace(template, channels=channels)).findings
    direction = only(findings, "direction")
    assert direction.verdict == "cannot tell"
    assert "explained alike if the boat answers" in direction.sentence
    assert "newton_port pushes ahead" in direction.sentence
    assert "newton_port pushes astern" in direction.sentence


def test_a_yaw_rate_of_the_other_sign_is_not_told_as_swapped_sides(gazebo: Log):
    turned = gazebo.channels | {"r": replace(gazebo.channels["r"], value=-gazebo.channels["r"].value)}
    findings = examine(replace(gazebo, channels=turned)).findings
    assert only(findings, "sides").verdict == "cannot tell"
    assert "heading and yaw rate turn opposite ways" in only(findings, "sides").sentence


def test_one_explanation_is_ruled_out_by_odds_and_not_by_chance():
    rng = np.random.default_rng(1)
    best = rng.chisquare(2, 40)
    assert surely_more(3.0 * best, best)
    assert not surely_more(best, best)
    assert not surely_more(rng.chisquare(2, 40), best)
    alone = best.copy()
    alone[0] *= 1e9  # one stretch of forty proves nothing
    assert not surely_more(alone, best)


# Neutral


@pytest.mark.parametrize(
    ("curve", "rest"),
    [
        (
            {"kind": "propeller", "scale": 70.0, "offset": -1.4, "k_t": 0.085, "rho": 1000.0, "diameter": 0.112},
            (1510.0, 1510.0),
        ),
        ({"kind": "table", "command": [1100.0, 1510.0, 1900.0], "force": [-20.0, 0.0, 35.0]}, (1510.0, 1510.0)),
        ({"kind": "table", "command": [1100.0, 1900.0], "force": [30.0, -30.0]}, (1500.0, 1500.0)),
        ({"kind": "table", "command": [1100.0, 1920.0], "force": [30.0, -30.0]}, (1510.0, 1510.0)),
        ({"kind": "table", "command": [1100.0, 1490.0, 1530.0, 1900.0], "force": [-9.0, 0.0, 0.0, 9.0]}, (1490, 1530)),
    ],
)
def test_the_neutral_that_agrees_with_the_curve_is_not_accused(simulated: Log, curve: dict[str, Any], rest: Any):
    def driven_by_pwm(content: dict[str, Any]) -> None:
        for thruster in content["thrusters"]:
            thruster |= {"command": "pwm", "curve": curve}

    boat = hull(driven_by_pwm)
    assert resting_commands(boat.thrusters[0]) == pytest.approx(rest)
    time = np.arange(0.0, 60.0, 0.05)
    neutral = 0.5 * sum(rest)
    values = {"psi": 0.0 * time, "u": np.where(time > 40.0, 1.0, 0.0), "v": 0.0 * time, "r": 0.0 * time}
    values |= {f"pwm_{side}": np.where(time > 40.0, 1700.0, neutral) for side in ("port", "stbd")}
    u = simulated.channels["u"]
    log = replace(simulated, channels={n: replace(u, name=n, time=time, value=v) for n, v in values.items()})
    (found,) = NEUTRAL.examine([Record.of(log, boat)])
    assert (found.verdict, found.value) == ("ok", neutral)


# Vehicles that cannot be


@pytest.mark.parametrize(
    ("change", "key", "match"),
    [
        (lambda c: c["damping"].update(X_u=9.0), "X_u", r"damping X_u = \+9 N s/m would drive the boat.*write -9"),
        (lambda c: c["damping"].update(N_rr=8.0), "N_rr", r"N_rr = \+8 N m s\^2/rad\^2 would drive"),
        (lambda c: c["added_mass"].update(X_udot=3.0), "X_udot", r"X_udot = \+3 kg.*write -3"),
        (lambda c: c["added_mass"].update(N_rdot=2.5), "N_rdot", r"N_rdot = \+2.5 .*write -2.5"),
        (lambda c: c.update(x_g=0.6), "x_g", r"x_g = 0.6 m.* inertia_z.* is 6.04548"),
        (lambda c: c["thrusters"][0].update(y=0.295), "port", r"thruster port: y = \+0.295 m .*write y: -0.295"),
        (lambda c: c["thrusters"][1].update(y=295.0), "stbd", r"thruster stbd: .*not aboard.*expected metres"),
        (
            lambda c: c.update(damping={}, terms=[{"axis": "surge", "form": "u^3", "value": 3.0}]),
            "surge:u^3",
            r"term surge:u\^3 = \+3 would drive the boat",
        ),
    ],
)
def test_a_vehicle_that_no_hull_has_is_refused_unless_it_insists(change: Any, key: str, match: str, tmp_path: Path):
    with pytest.raises(VehicleError, match=match) as refusal:
        hull(change)
    assert f"insist: [{key}]" in str(refusal.value)

    def insists(content: dict[str, Any]) -> None:
        change(content)
        content["insist"] = [key]

    boat = hull(insists)
    boat.save(tmp_path / "boat.yaml")
    assert load_vehicle(tmp_path / "boat.yaml") == boat
    content = hull().to_dict()
    change(content)
    assert vehicle_from_dict(content, "judged", judged=True).to_dict()["insist"] == [key]


def test_an_unknown_key_to_insist_on_is_named():
    with pytest.raises(VehicleError, match="unknown key 'X_q' in insist: did you mean 'X_u"):
        hull(lambda content: content.update(insist=["X_q"]))


@pytest.mark.parametrize("name", shipped_vehicles())
def test_what_a_search_makes_of_a_vehicle_is_read_back(name: str, tmp_path: Path):
    """A term, a sign or a place outside the limits that undertow itself wrote is told in the file, not refused."""
    boat, rng = load_vehicle(name), np.random.default_rng(4)
    assert boat.insist == ()
    symbols = ["X_u", "Y_vv", "N_r", "X_udot", "x_g", "surge:u^3", "yaw:r|r|"]
    for _ in range(20):
        drawn = {str(s): float(rng.normal(0.0, 0.2)) for s in rng.choice(symbols, 3, replace=False)}
        moved = boat.with_values(drawn).checked()
        moved.save(tmp_path / "moved.yaml")
        assert load_vehicle(tmp_path / "moved.yaml") == moved


# Vehicles that the log contradicts


def exchanged_sides(content: dict[str, Any]) -> None:
    for thruster in content["thrusters"]:
        thruster["y"] *= -1.0
    content["insist"] = ["port", "stbd"]


def unnamed(content: dict[str, Any]) -> None:
    for thruster, name in zip(content["thrusters"], "ab", strict=True):
        thruster["name"] = name


def unnamed_and_exchanged(content: dict[str, Any]) -> None:
    unnamed(content)
    for thruster in content["thrusters"]:
        thruster["y"] *= -1.0


def turned_round(content: dict[str, Any]) -> None:
    content["thrusters"][1]["angle"] = float(np.pi)


def wired_round(content: dict[str, Any]) -> None:
    content["thrusters"][0]["curve"]["force"] = [35.0, 0.0, -35.0]


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (exchanged_sides, "thruster port of the vehicle is at y = .0.295 m.*change the sign of y of port and stbd"),
        (turned_round, "newton_stbd is reversed: .*if the vehicle file is, change the curve or the angle of stbd"),
        (wired_round, "newton_port is reversed: .*if the vehicle file is, change the curve or the angle of port"),
    ],
)
def test_a_vehicle_that_the_log_contradicts_is_refused_with_both_cures(simulated: Log, change: Any, match: str):
    boat = hull(change)
    with pytest.raises(LogError, match=match):
        read_inputs(simulated.path, boat)
    (warning, *_) = read_inputs(simulated.path, boat, Reading(as_is=True)).warnings
    assert warning.startswith("Taken as it is, so no result can be trusted")


@pytest.mark.parametrize(("change", "refused"), [(unnamed, False), (unnamed_and_exchanged, True)])
def test_sides_are_those_of_the_vehicle_where_names_say_nothing(simulated: Log, change: Any, refused: bool):
    names = {"newton_port": "newton_a", "newton_stbd": "newton_b"}
    channels = {names.get(n, n): replace(c, name=names.get(n, n)) for n, c in simulated.channels.items()}
    boat = hull(change)
    inspection = inspect_log(replace(simulated, channels=channels), boat)
    assert only(inspection.quality, "sides").verdict == ("defect" if refused else "ok")
    assert bool(refuse_broken_logs([inspection], (), boat, as_is=True)) == refused


@pytest.mark.parametrize(
    "effects",
    [
        {"stbd_scale": 0.0},
        {"stbd_scale": 0.3},
        {"reverse_thrust_loss": 0.3},
        {"steady_current": (0.4, -0.3)},
        {"input_delay": 0.8},
        {"thruster_lag": 1.0},
        {"yaw_trim": 4.0},
    ],
    ids=str,
)
def test_a_true_effect_is_no_contradiction(effects: dict[str, Any], tmp_path: Path):
    assert apply_effects(HULL, effects) != HULL
    log = written(simulate_world(HULL, effects, duration=90.0, seed=5), tmp_path)
    inspection = inspect_log(log, HULL)
    assert not any(text.startswith("Taken as it is") for text in refuse_broken_logs([inspection], (), HULL, as_is=True))
    assert {f.check for f in inspection.quality if f.verdict in ("warning", "defect")} <= {"compass"}
