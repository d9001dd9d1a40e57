"""Quality: each planted defect is found with its sign and size, and a sound log is not accused."""

import importlib
import re
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from places import ROOT

from undertow.measurements.canonical import Channel, Output
from undertow.measurements.inspection import CHECKS, examine, inspect_log, inspect_logs, pool, verdict
from undertow.measurements.log import Log, read_log
from undertow.measurements.quality.checks.late import fixes_of
from undertow.measurements.quality.checks.sides import SIDES
from undertow.measurements.quality.lags import Response, lag_of
from undertow.measurements.quality.record import SEVERITY, Finding, Record
from undertow.measurements.quality.response import Answer, Trial, Trials, answers, side_of
from undertow.measurements.statistics.blocks import robust_fit
from undertow.physics.motion import body_to_earth
from undertow.workflows.inputs import _alignment_notes

BENCHMARKS = ROOT / "benchmarks"
DATA = ROOT / "tests" / "data"
ACCUSED = ("warning", "defect")
PLANTED = (
    "port and starboard swapped",
    "port output reversed",
    "neutral PWM off",
    "fixes held over two rows",
    "fixes a row late",
    "gyro late",
    "commands late",
    "heading in degrees",
    "gyro in degrees",
    "gyro stuck",
    "stamps repeated",
    "stamps backward",
    "speeds in knots",
    "speeds in km/h",
    "speeds late",
)


@pytest.fixture(scope="module")
def study() -> Iterator[ModuleType]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCHMARKS))
        yield importlib.import_module("quality")


@pytest.fixture(scope="module")
def odometry(study: ModuleType) -> Log:
    return study.worlds(1, 180.0)[0][1]


@pytest.fixture(scope="module")
def autopilot(study: ModuleType, odometry: Log) -> Log:
    return study.autopilot_log(odometry, 0)


def accused(log: Log) -> list[Finding]:
    return [finding for finding in examine(log).findings if finding.verdict in ACCUSED]


def only(findings: Any, check: str) -> Finding:
    (found,) = [finding for finding in findings if finding.check == check]
    return found


def cruise(deviation: Any = lambda psi: 0.0 * psi, rate: float = 10.0, noise: float = 0.0, **changes: Any) -> Log:
    """A boat that runs straight for 15 s on each of 12 headings, turning between them, at 1 to 2 m/s."""
    time = np.arange(0.0, 240.0, 1.0 / rate)
    turn = 0.5 * (1.0 + np.tanh(4.0 * ((time % 20.0) / 20.0 - 0.8) * 5.0))
    psi = np.radians(30.0) * (time // 20.0 + turn)
    u = 1.5 + 0.5 * np.sin(0.2 * time)
    north, east = body_to_earth(psi, u, 0.0)
    place = [np.concatenate(([0.0], np.cumsum(0.5 * (v[1:] + v[:-1]) / rate))) for v in (north, east)]
    rng = np.random.default_rng(0)
    values = {
        "x": place[0] + noise * rng.standard_normal(time.size),
        "y": place[1] + noise * rng.standard_normal(time.size),
        "psi": psi - deviation(psi),
        "r": np.gradient(psi, time),
    } | changes
    return Log(Path("cruise.csv"), {name: Channel(name, time, value, name) for name, value in values.items()})


# What is sound


def test_a_sound_log_is_not_accused(odometry: Log, autopilot: Log):
    assert accused(odometry) == []
    assert accused(autopilot) == []
    assert inspect_log(odometry).verdict.startswith("Usable; no defect was found.")


@pytest.mark.parametrize("name", ["A_2", "C_2", "D_2"])
def test_a_gazebo_log_is_not_accused(name: str):
    assert accused(read_log(DATA / f"{name}.csv.gz")) == []


def test_every_check_answers_in_one_form(autopilot: Log):
    assert len({check.name for check in CHECKS}) == len(CHECKS)
    for finding in examine(autopilot).findings:
        content = finding.to_dict()
        assert content["verdict"] in SEVERITY
        assert content["sentence"]
        assert content["ci95"] is None or content["ci95"][0] <= content["value"] <= content["ci95"][1]


def test_a_log_without_motion_is_no_error():
    time = np.arange(0.0, 5.0, 0.1)
    short = Log(Path("short.csv"), {"pwm_port": Channel("pwm_port", time, 1500.0 + 0 * time, "pwm_port")})
    findings = examine(short).findings
    assert only(findings, "excitation").verdict == "cannot tell"
    assert only(findings, "direction").verdict == "cannot tell"
    assert "expected a heading" in inspect_log(short).verdict


# What is planted


@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_defect_is_found_with_its_sign_and_size(study: ModuleType, odometry: Log, autopilot: Log, name: str):
    cases = {defect.name: (defect, autopilot) for defect in study.DEFECTS}
    cases |= {defect.name: (defect, odometry) for defect in study.SPEED_DEFECTS}
    defect, log = cases[name]
    assert study.tried(defect, log, 1) == (True, True, False)
    size = float(np.mean(defect.sizes))
    broken = replace(log, channels=defect.plant(dict(log.channels), size, np.random.default_rng(2)))
    for finding in accused(broken):
        assert finding.consequence
        assert finding.remedy


def test_a_deviation_is_told_as_a_curve():
    log = cruise(lambda psi: np.radians(1.2 + 2.2 * np.sin(psi) + 7.4 * np.cos(psi)), noise=0.005)
    found = only(examine(log).findings, "compass")
    assert found.verdict == "defect"
    assert [found.parts[name] for name in ("constant", "sin", "cos")] == pytest.approx([1.2, 2.2, 7.4], abs=0.7)
    assert "1." in found.sentence
    straight = only(examine(cruise(noise=0.005)).findings, "compass")
    assert straight.verdict == "ok"


def test_a_deviation_seen_on_few_headings_is_told_without_a_curve():
    log = cruise(lambda psi: np.radians(8.0) * np.cos(psi), noise=0.005)
    part = {n: Channel(n, c.time[:800], c.value[:800], n) for n, c in log.channels.items()}
    found = only(examine(Log(log.path, part)).findings, "compass")
    assert found.verdict == "defect"
    assert "on others, which these are too few to tell, the deviation is an estimate" in found.sentence
    assert "by the curve through these headings" in found.remedy
    assert found.parts == {}


def test_late_fixes_are_put_back_to_a_few_millimetres(study: ModuleType, autopilot: Log):
    plant = {d.name: d.plant for d in study.DEFECTS}["fixes a row late"]
    broken = replace(autopilot, channels=plant(dict(autopilot.channels), 0.3, np.random.default_rng(4)))
    fixes = fixes_of(broken.channels)
    assert fixes is not None
    assert (fixes.rows, round(fixes.beat, 6)) == (2, 0.2)
    steps = np.diff(fixes.retimed()) / 0.2
    assert np.abs(steps - np.rint(steps)).max() < 1e-6
    late = fixes.time - fixes.retimed()
    assert set(np.round(late, 6)) == {0.0, 0.1}
    assert np.mean(late > 0.05) == pytest.approx(0.3, abs=0.06)
    clean = examine(broken).clean
    assert only(examine(clean).findings, "late fixes").verdict == "ok"
    raw, mended = (np.gradient(log.channels["x"].value, log.channels["x"].time) for log in (broken, clean))
    assert np.abs(mended).max() < 0.7 * np.abs(raw).max()


def test_stamps_that_jitter_are_not_called_late_fixes(study: ModuleType):
    for name, log in study.worlds(3, 150.0, "rough"):
        found = only(examine(log).findings, "late fixes")
        assert found.verdict == "note", name
        assert "the stamps jitter" in found.sentence
        assert accused(log) == [], name


def test_a_few_jittering_rows_of_a_slow_log_are_not_called_late(autopilot: Log):
    rng = np.random.default_rng(2)
    late = 0.1 * np.clip(0.35 * rng.standard_normal(autopilot.channels["x"].time.size), -0.45, 0.45)
    broken = autopilot.channels | {
        n: replace(autopilot.channels[n], time=autopilot.channels[n].time + late) for n in "xy"
    }
    found = only(examine(replace(autopilot, channels=broken)).findings, "late fixes")
    assert (found.verdict, found.fix) == ("note", None)


def test_irregular_fixes_with_honest_stamps_are_not_called_late():
    log = cruise(rate=20.0)
    time = log.channels["x"].time
    rng = np.random.default_rng(1)
    row = np.flatnonzero(rng.random(time.size) < 0.4)
    shown = row[np.clip(np.searchsorted(row, np.arange(time.size), "right") - 1, 0, None)]
    broken = log.channels | {n: replace(log.channels[n], value=log.channels[n].value[shown]) for n in "xy"}
    assert only(examine(replace(log, channels=broken)).findings, "late fixes").verdict == "note"


def test_positions_in_feet_and_opposite_axes_are_told(odometry: Log):
    feet = odometry.channels | {
        n: replace(odometry.channels[n], value=odometry.channels[n].value / 0.3048) for n in "xy"
    }
    (found,) = [
        f for f in examine(replace(odometry, channels=feet)).findings if f.check == "units" and "x" in f.channels
    ]
    assert found.verdict == "defect"
    assert "feet" in found.sentence
    assert found.fix is None  # speeds in ft/s over metres would look the same to a machine
    turned = odometry.channels | {"r": replace(odometry.channels["r"], value=-odometry.channels["r"].value)}
    (found,) = [
        f for f in examine(replace(odometry, channels=turned)).findings if f.check == "units" and "r" in f.channels
    ]
    assert (found.verdict, found.value) == ("defect", pytest.approx(-1.0, abs=0.05))


def test_unnamed_thrusters_are_told_their_sides(autopilot: Log):
    names = {"pwm_port": "pwm_c3", "pwm_stbd": "pwm_c1"}
    channels = {names.get(n, n): replace(c, name=names.get(n, n)) for n, c in autopilot.channels.items()}
    found = only(SIDES.examine([Record.of(replace(autopilot, channels=channels))]), "sides")
    assert (found.verdict, found.parts) == ("note", {"pwm_c1": "starboard", "pwm_c3": "port"})
    assert [side_of(n) for n in ("pwm_left", "newton_bow", "pwm_port_stbd")] == ["port", "", ""]


def test_two_commands_that_move_as_one_tell_no_side(autopilot: Log):
    both = autopilot.channels | {"pwm_stbd": replace(autopilot.channels["pwm_port"], name="pwm_stbd")}
    findings = SIDES.examine([Record.of(replace(autopilot, channels=both))])
    assert {finding.verdict for finding in findings} == {"cannot tell"}


def turned_round(log: Log, *names: str) -> Log:
    """The same log with these PWM outputs reversed."""
    return replace(
        log,
        channels={n: replace(c, value=3000.0 - c.value) if n in names else c for n, c in log.channels.items()},
    )


def renamed(log: Log, **names: str) -> Log:
    channels = {names.get(n, n): replace(c, name=names.get(n, n)) for n, c in log.channels.items()}
    return replace(log, channels=channels)


def test_a_reversed_output_keeps_its_side_in_the_advice_unless_the_sides_are_told(
    autopilot: Log, monkeypatch: pytest.MonkeyPatch
):
    swapped = renamed(turned_round(autopilot, "pwm_port"), pwm_port="pwm_stbd", pwm_stbd="pwm_port")
    remedies = {f.check: f.remedy for f in SIDES.examine([Record.of(swapped)])}
    # Whoever follows the advice on the direction alone loses no command.
    lines = re.findall(r"'(pwm_\w+): (?:\{from: )?(pwm_\w+)", remedies["direction"])
    assert lines == [("pwm_stbd", "pwm_stbd"), ("pwm_port", "pwm_port")]
    told = answers([Record.of(swapped)])
    unsure = told | {"pwm_port": replace(told["pwm_port"], yaw_error=np.inf)}
    monkeypatch.setattr("undertow.measurements.quality.checks.sides.answers", lambda records: unsure)
    alone = SIDES.examine([Record.of(swapped)])
    assert only(alone, "sides").verdict == "cannot tell"
    (line,) = re.findall(r"'(.*)'", only(alone, "direction").remedy)
    assert line == "pwm_stbd: {from: pwm_port, scale: -1, offset: 3000}"


def test_one_stream_that_feeds_two_thrusters_is_told(autopilot: Log):
    both = autopilot.channels | {"pwm_stbd": replace(autopilot.channels["pwm_port"], name="pwm_stbd")}
    found = only(examine(replace(autopilot, channels=both)).findings, "commands")
    assert (found.verdict, found.channels) == ("warning", ("pwm_port", "pwm_stbd"))
    assert found.sentence == "pwm_port is the command of 2 thrusters: pwm_port, pwm_stbd"


def test_the_neutral_is_compared_with_the_curve_of_the_vehicle(study: ModuleType, odometry: Log):
    moved = {n: replace(c, value=c.value + 10.0 * n.startswith("pwm")) for n, c in odometry.channels.items()}
    log = replace(odometry, channels=moved)
    boat = study.pwm_boat()
    thrusters = [
        t.model_copy(update={"curve": t.curve.model_copy(update={"command": (1110.0, 1510.0, 1910.0)})})
        for t in boat.thrusters
    ]
    at_1510 = boat.model_copy(update={"thrusters": tuple(thrusters)})
    alone = examine(log)
    assert only(alone.findings, "neutral").verdict == "warning"
    assert "1510, as init does" in only(alone.findings, "neutral").remedy
    assert alone.fixes == (), "a shift to 1500 would contradict the file that init makes of this log"
    agreed = examine(log, at_1510)
    assert (only(agreed.findings, "neutral").verdict, agreed.fixes) == ("ok", ())
    assert "the vehicle's curve has its zero there" in only(agreed.findings, "neutral").sentence
    biased = only(examine(odometry, at_1510).findings, "neutral")
    assert (biased.verdict, biased.value, biased.fix) == ("warning", 1500.0, None)
    assert "but the vehicle's curve has its zero at 1510" in biased.sentence
    assert "offset: +10" in biased.remedy
    # Every verb that is given the vehicle says it too.
    (note,) = [note for note in _alignment_notes(inspect_log(odometry, at_1510), False)[0] if "neutral" in note]
    assert "neutral PWM is 1500 us on all 2 thrusters, but the vehicle's curve has its zero at 1510" in note


def test_a_neutral_that_the_log_states_is_not_shifted_away(odometry: Log):
    stated = {
        n: replace(c, output=Output(1510.0, 1110.0, 1910.0, "SERVO1_TRIM 1510")) if n.startswith("pwm") else c
        for n, c in odometry.channels.items()
    }
    moved = {n: replace(c, value=c.value + 10.0 * n.startswith("pwm")) for n, c in stated.items()}
    told = examine(replace(odometry, channels=moved))
    found = only(told.findings, "neutral")
    assert (found.verdict, found.value, told.fixes) == ("note", 1510.0, ())
    assert "the log's parameters have it there" in found.sentence
    assert "zero in the vehicle file to 1510" in found.remedy
    off = only(examine(replace(odometry, channels=stated)).findings, "neutral")
    assert (off.verdict, off.fix) == ("warning", None)


def test_an_answer_a_little_early_is_told_in_words(odometry: Log):
    late = {n: replace(c, time=c.time + 0.04 * n.startswith("pwm")) for n, c in odometry.channels.items()}
    told = [f for f in examine(replace(odometry, channels=late)).findings if "answers its commands" in f.sentence]
    assert [(f.verdict, f.value is not None and f.value < 0.0) for f in told] == [("ok", True)]
    assert told[0].sentence == "the boat answers its commands in the same row of 0.095 s"


def test_a_delay_is_not_known_where_it_hangs_on_a_sign_that_is_not(odometry: Log, monkeypatch: pytest.MonkeyPatch):
    ahead, astern = ({"pwm_port": Answer(sign, 0.01, 0.0, 1.0)} for sign in (1.0, -1.0))
    either = Trials(Trial(0.0, ahead, np.ones(9)), (Trial(0.4, astern, np.ones(9)),))
    monkeypatch.setattr("undertow.measurements.quality.checks.clocks.trials", lambda records: [either])
    (found,) = [f for f in examine(odometry).findings if "answers its commands" in f.sentence]
    assert (found.check, found.verdict) == ("clocks", "cannot tell")
    assert found.sentence.endswith("hangs on which way its thrusters push: 0.0 s after them or 0.4 s after them")


def test_positions_alone_tell_the_sides(odometry: Log):
    rng = np.random.default_rng(1)
    bare = {n: c for n, c in odometry.channels.items() if n not in ("u", "v")}
    for name in ("x", "y"):
        coarse = bare[name]
        noise = 0.03 * rng.standard_normal(coarse.time[::4].size)
        bare[name] = replace(coarse, time=coarse.time[::4], value=coarse.value[::4] + noise)
    found = {f.check: f.verdict for f in SIDES.examine([Record.of(replace(odometry, channels=bare))])}
    assert found == {"direction": "ok", "sides": "ok"}


def test_turns_without_a_sure_push_are_told_as_they_are(odometry: Log, monkeypatch: pytest.MonkeyPatch):
    told = {n: replace(a, surge_error=np.inf) for n, a in answers([Record.of(odometry)]).items()}
    monkeypatch.setattr("undertow.measurements.quality.checks.sides.answers", lambda records: told)
    found = only(SIDES.examine([Record.of(odometry)]), "sides")
    assert (found.verdict, found.sentence.split(",")[0]) == ("cannot tell", "the boat turns by its thrusters")


def test_a_command_that_hardly_moves_is_not_accused_of_what_else_moves_the_boat(odometry: Log):
    u = odometry.channels["u"]
    # A propeller switched on once, and a speed that slowly falls and rises by itself.
    time = np.arange(0.0, 180.0, 0.1)
    rpm = np.where(time < 20.0, 0.0, 62.8)
    drift = -0.02 * np.cumsum(np.exp(-((time - 20.0) ** 2) / 2.0)) * 0.1
    speed = 1.0 + drift + 0.1 * np.sin(1.3 * time)
    psi = 0.3 * np.sin(0.05 * time)
    values = {"psi": psi, "u": speed, "v": 0.0 * time, "r": np.gradient(psi, time), "rad_s_propeller": rpm}
    log = replace(odometry, channels={n: replace(u, name=n, origin=n, time=time, value=v) for n, v in values.items()})
    answer = answers([Record.of(log)])["rad_s_propeller"]
    assert (answer.ahead, answer.surge_error) == (0, np.inf)
    assert only(SIDES.examine([Record.of(log)]), "direction").verdict == "cannot tell"


def test_a_slow_log_a_gap_and_a_shaky_clock_are_told(odometry: Log):
    slow = {n: Channel(n, c.time[::40], c.value[::40], n) for n, c in odometry.channels.items()}
    found = only(examine(replace(odometry, channels=slow)).findings, "rates")
    assert (found.verdict, found.value) == ("defect", pytest.approx(0.5, rel=0.05))
    u = odometry.channels["u"]
    keep = (u.time < 60.0) | (u.time > 90.0)
    holed = odometry.channels | {"u": replace(u, time=u.time[keep], value=u.value[keep])}
    found = only(examine(replace(odometry, channels=holed)).findings, "gaps")
    assert (found.verdict, found.channels) == ("warning", ("u",))
    assert found.parts["longest"] == pytest.approx(30.0, abs=0.2)
    rng = np.random.default_rng(0)
    shaky = {n: replace(c, time=c.time + 0.05 * rng.random(c.time.size)) for n, c in odometry.channels.items()}
    assert only(examine(replace(odometry, channels=shaky)).findings, "rates").verdict == "note"


def test_a_leaning_accelerometer_is_told_with_its_sign():
    log = cruise(noise=0.002)
    time = log.channels["psi"].time
    u = 1.5 + 0.5 * np.sin(0.2 * time)
    leaning = np.gradient(u, time) + 0.4 * u * np.abs(u)
    found = only(examine(cruise(noise=0.002, ax=leaning)).findings, "tilt")
    assert (found.verdict, found.value) == ("warning", pytest.approx(1.6, abs=0.2))
    level = only(examine(cruise(noise=0.002, ax=np.gradient(u, time))).findings, "tilt")
    assert level.verdict == "ok"


def test_a_rudder_is_told(odometry: Log):
    rudder = replace(odometry.channels["u"], name="steering_rudder", origin="rudder_angle")
    own = {n: odometry.channels[n] for n in ("psi", "u", "v", "r")}
    ship = replace(odometry, auxiliary={rudder.name: rudder}, channels=own)
    told = [finding.sentence for finding in examine(ship).findings if finding.check == "commands"]
    assert len(told) == 2
    assert "rudder_angle" in told[0]
    assert "no command of a thruster" in told[1]


# How it is measured


@pytest.mark.parametrize("late", [-0.13, 0.0, 0.27])
def test_a_delay_beside_a_tilt_is_found(late: float):
    time = np.arange(0.0, 120.0, 0.05)

    def push(t):
        return np.sin(0.5 * t) + 0.6 * np.sin(1.3 * t + 1.0) + 0.4 * np.sin(2.4 * t)

    speed = np.cumsum(push(time)) * 0.05
    measured = push(time - late) + 0.5 * speed
    lag = lag_of([Response(measured, push(time)[:, None], speed[:, None])], 0.05)
    assert lag is not None
    assert lag.seconds == pytest.approx(late, abs=0.02)
    assert lag.ci95[0] - 0.02 <= late <= lag.ci95[1] + 0.02


def test_a_direction_that_no_row_shows_has_no_error():
    rng = np.random.default_rng(0)
    one = rng.standard_normal(400)
    fit = robust_fit(np.column_stack([one, one]), 2.0 * one, np.arange(400) // 20)
    assert np.isinf(fit.errors).all()
    assert fit.interval(0) is None
    known = robust_fit(one[:, None], 2.0 * one + 0.1 * rng.standard_normal(400), np.arange(400) // 20)
    low, high = known.interval(0) or (0.0, 0.0)
    assert low < 2.0 < high
    assert high - low < 0.05


def test_several_logs_pool_their_evidence(autopilot: Log):
    parts = []
    for k in range(4):
        cut = {n: c.time < 190.0 for n, c in autopilot.channels.items()}
        span = {n: (c.time >= 45.0 * k) & (c.time < 45.0 * (k + 1)) & cut[n] for n, c in autopilot.channels.items()}
        channels = {n: Channel(n, c.time[span[n]], c.value[span[n]], n) for n, c in autopilot.channels.items()}
        parts.append(Log(Path(f"part{k}.csv"), channels))
    each = [examine(log) for log in parts]
    together = pool(each)
    alone = [only(one.findings, "sides").verdict for one in each]
    assert only(together, "sides").verdict == "ok"
    assert "cannot tell" in alone
    content = inspect_logs(parts).to_dict()
    assert content["schema"] == "undertow.inspections/1"
    assert len(content["logs"]) == 4
    assert [f["check"] for f in content["quality"]] == [f.check for f in together]


@pytest.mark.parametrize("others", [("bow",), ("bow", "stern"), ("stbd", "bow", "port")])
def test_logs_with_other_commands_pool_their_evidence(autopilot: Log, others: tuple[str, ...]):
    pushed = {name: channel for name, channel in autopilot.channels.items() if re.search("port|stbd", name)}
    kept = {name: channel for name, channel in autopilot.channels.items() if name not in pushed}
    renamed = {re.sub("port|stbd", other, name): channel for other in others for name, channel in pushed.items()}
    boats = [examine(log) for log in (autopilot, Log(Path("other.csv"), kept | renamed))]
    alone, together = (
        [one.verdict for one in found if one.check == "clocks"] for found in (boats[0].findings, pool(boats))
    )
    assert alone[-1] == together[-1] == "ok"


def test_the_verdict_says_the_worst_first():
    defect = Finding(check="sides", verdict="defect", sentence="port and starboard look swapped")
    warning = Finding(check="tilt", verdict="warning", sentence="a long story", short="it leans")
    assert verdict([warning, defect]) == "Usable after repair: port and starboard look swapped; it leans."
    assert verdict([warning]) == "Usable, but mind: it leans."
    assert verdict([defect], ["no heading."], True) == (
        "Not usable as it is: no heading. --fix OUT.csv writes a log that can be used."
    )
    assert verdict([Finding(check="tilt", verdict="cannot tell", sentence="?")]).endswith("too calm to tell one thing.")


def test_the_study_prints_its_table(study: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    planting = sys.modules["study.planting"]
    monkeypatch.setattr(study, "DEFECTS", planting.DEFECTS[2:3])
    monkeypatch.setattr(study, "SPEED_DEFECTS", ())
    monkeypatch.setattr(study, "GAZEBO", tmp_path)
    monkeypatch.setattr(
        sys, "argv", ["quality.py", "--seeds", "1", "--duration", "60", "--table", str(tmp_path / "t.md")]
    )
    assert study.main() == 0
    text = (tmp_path / "t.md").read_text()
    assert "| neutral PWM off | 1 | 1 | 1 | 0 |" in text
    assert "Defects missed without a word: 0. False alarms: 0 on 3 sound logs." in text
