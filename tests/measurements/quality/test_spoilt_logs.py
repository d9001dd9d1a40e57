"""Logs that were spoilt: what happened to them is named, and refused where it matters; a sound log is left alone."""

import importlib
import tracemalloc
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pandas as pd
import pytest
from bags import recorded, write_mcap
from matlab_files import structs_of, write_mat
from places import ROOT
from ulog_files import ulog_of
from verbs import call, strict

from undertow.discovery.discover import find_missing
from undertow.measurements.channels.conversion import APART
from undertow.measurements.inspection import examine, inspect_log
from undertow.measurements.log import read_log
from undertow.measurements.quality.axes import mixed_up, track_of
from undertow.measurements.quality.checks.units import speed_unit
from undertow.measurements.quality.record import Finding, Reach, Record
from undertow.physics.errors import LogError
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.manoeuvres import programme
from undertow.physics.worlds.world import NOISE, Orders, World, simulate_world
from undertow.workflows.inputs import read_inputs

BENCHMARKS = ROOT / "benchmarks"
NAMED = (
    "clock set forward by 1.7e9 s",
    "clock set back by 50 s",
    "one stamp of 1.7e9 s",
    "one stamp of -3 s",
    "port command frozen",
    "port command constant",
    "both commands constant",
    "commands of another run",
    "sway 0",
    "speeds 0",
    "x and y exchanged",
    "u and v exchanged",
    "sway reversed",
    "y reversed",
    "knots without positions",
    "heading reversed",
    "heading off by 90 degrees",
    "gyro 0.8",
    "two logs in one",
    "commands clipped",
)


@pytest.fixture(scope="module")
def study() -> Iterator[ModuleType]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCHMARKS))
        yield importlib.import_module("spoiling")


@pytest.fixture(scope="module")
def case(study: ModuleType):
    """A hull known exactly, and its log of three minutes with field noise."""
    return study.simulated(2, 180.0)[0]


def spoilt(study: ModuleType, case, name: str, folder: Path) -> tuple[Path, object]:
    (spoil,) = [one for one in (*study.SOUND, *study.SPOILS) if one.name == name]
    path = folder / "log.csv"
    spoil.plant(case.table, np.random.default_rng(3)).to_csv(path, index=False)
    return path, spoil


@pytest.mark.parametrize("name", NAMED)
def test_what_spoilt_a_log_is_named(study: ModuleType, case, name: str, tmp_path: Path):
    path, spoil = spoilt(study, case, name, tmp_path)
    named, _, said = study.looked_over(path, case, spoil)
    assert named, said


@pytest.mark.parametrize("name", ["untouched", "interpolated to 200 Hz", "held to 200 Hz", "without positions"])
def test_what_is_sound_is_not_accused(study: ModuleType, case, name: str, tmp_path: Path):
    path, spoil = spoilt(study, case, name, tmp_path)
    _, sound, said = study.looked_over(path, case, spoil)
    assert sound, said


def test_commands_that_know_only_their_extremes_are_refused_only_where_the_boat_moves_beyond_them(
    study: ModuleType, tmp_path: Path
):
    zigzag = study.simulated(1, 120.0)[0]  # its commands have ten values, and three where they are cut
    path, _ = spoilt(study, zigzag, "commands clipped", tmp_path)
    (found,) = [f for f in inspect_log(read_log(path), zigzag.vehicle).quality if f.check == "limited"]
    assert (found.verdict, "comes by fits" in found.sentence) == ("defect", True)
    path, _ = spoilt(study, zigzag, "untouched", tmp_path)
    assert not [f for f in inspect_log(read_log(path), zigzag.vehicle).quality if f.check == "limited"]


@pytest.mark.parametrize("run", ["A_2", "C_2", "D_2"])
def test_real_commands_that_stand_at_their_largest_are_not_cut(run: str):
    """One thruster of D_2 is weak: what follows each step of it rings on in a filter, and is no motion of its own."""
    folder = ROOT / "tests" / "data"
    quality = inspect_log(read_log(folder / f"{run}.csv.gz"), load_vehicle(folder / "vehicle_linear.yaml")).quality
    assert [f.verdict for f in quality if f.check == "limited"] == ["ok"]


def test_steps_behind_commands_that_stand_come_by_fits_and_waves_do_not(tmp_path: Path):
    """What stands elsewhere is too little to compare with, and need not be."""
    folder, table = ROOT / "tests" / "data", pd.read_csv(ROOT / "tests" / "data" / "A_2.csv.gz")
    commands = table["topic"].str.endswith("cmd_thrust")
    table.loc[commands, "value"] = table.loc[commands, "value"].clip(-12.2, 12.2)
    table.to_csv(tmp_path / "cut.csv", index=False)
    quality = inspect_log(read_log(tmp_path / "cut.csv"), load_vehicle(folder / "vehicle_linear.yaml")).quality
    (found,) = [f for f in quality if f.check == "limited"]
    assert (found.verdict, "comes by fits" in found.sentence) == ("defect", True)
    hull = load_vehicle("blueboat")
    path = simulate_world(hull, {}, duration=200.0, noise="clean", waves=0.2, seed=6).write(tmp_path / "waves.csv")
    assert not [f for f in inspect_log(read_log(path), hull).quality if f.check == "limited" and f.verdict != "note"]


def test_knots_are_told_by_the_mass_beside_a_weak_thruster(study: ModuleType, tmp_path: Path):
    hull = load_vehicle("blueboat")
    path = simulate_world(hull, {"stbd_scale": 0.6}, duration=150.0, noise="field", seed=3).write(tmp_path / "log.csv")
    table = study.table_of(read_log(path)).drop(columns=["x", "y"])
    for name, scale, verdict in (("same", 1.0, "ok"), ("knots", 1.0 / 0.514444, "defect")):
        table.assign(u=scale * table["u"], v=scale * table["v"]).to_csv(tmp_path / f"{name}.csv", index=False)
        quality = inspect_log(read_log(tmp_path / f"{name}.csv"), hull).quality
        (found,) = [f for f in quality if f.check == "units" and "mass" in f.sentence]
        assert found.verdict == verdict
        assert found.value == pytest.approx(1.0 / scale, rel=0.06)


def test_a_resampled_log_is_told_of(study: ModuleType, case, tmp_path: Path):
    for name, words in (("interpolated to 200 Hz", "interpolated to 200 Hz from about 2"), ("held to 200 Hz", "held")):
        path, _ = spoilt(study, case, name, tmp_path)
        (told,) = [f for f in inspect_log(read_log(path)).quality if f.check == "resampled"]
        assert told.verdict == "note"
        assert words in told.sentence


def test_a_slow_log_on_a_fine_grid_does_not_stand_still(tmp_path: Path):
    """Where it is rounded, a straight line between two equal samples repeats one value for many rows."""
    log = read_log(ROOT / "tests" / "data" / "D_2.csv.gz")
    t = log.channels["u"].time
    grid = np.arange(t[0], t[-1], 0.005)
    moved = {n: np.interp(grid, c.time, np.unwrap(c.value) if n == "psi" else c.value) for n, c in log.channels.items()}
    pd.DataFrame({"t": grid, **moved}).to_csv(tmp_path / "fine.csv", index=False)
    assert {f.verdict for f in inspect_log(read_log(tmp_path / "fine.csv")).quality if f.check == "stuck"} == {"ok"}


@pytest.mark.parametrize("name", ["port command frozen", "sway 0", "x and y exchanged", "commands of another run"])
def test_whoever_computes_refuses_them(study: ModuleType, case, name: str, tmp_path: Path):
    path, _ = spoilt(study, case, name, tmp_path)
    with pytest.raises(LogError, match="Nothing found in such logs is about the boat"):
        read_inputs(path, case.vehicle)


def test_a_clock_that_was_set_takes_no_memory_and_keeps_both_stretches(study: ModuleType, case, tmp_path: Path):
    path, _ = spoilt(study, case, "clock set forward by 1.7e9 s", tmp_path)
    log = read_log(path)
    tracemalloc.start()
    inspection = inspect_log(log, case.vehicle)
    assert tracemalloc.get_traced_memory()[1] < 100e6
    tracemalloc.stop()
    assert len(inspection.plan.segments) == 2
    assert inspection.plan.segments[1].start - inspection.plan.segments[0].end == pytest.approx(APART, abs=0.01)
    assert inspection.usable
    assert any("the clock was set at t = " in note for note in log.notes)


@pytest.mark.parametrize("ending", [".ulg", ".mat", ".mcap"])
def test_a_clock_that_was_set_is_told_whatever_the_format(ending: str, tmp_path: Path):
    world, path = simulate_world(load_vehicle("blueboat_paper"), {}, duration=60.0, seed=3), tmp_path / f"log{ending}"
    stamps = {name: getattr(world, name) for name in ("odometry_time", "command_time")}
    world = replace(world, **{name: np.where(t > 30.0, t + 4e8, t) for name, t in stamps.items()})
    if ending == ".ulg":
        path.write_bytes(ulog_of(world).content)
    else:
        write_mat(path, structs_of(world)) if ending == ".mat" else write_mcap(path, recorded(world))
    log = read_log(path)
    tracemalloc.start()
    quality = inspect_log(log).quality
    assert tracemalloc.get_traced_memory()[1] < 100e6
    tracemalloc.stop()
    assert [f.sentence[:32] for f in quality if f.check == "stamps"] == ["the clock was set forward by 4e+"]


def test_pieces_of_a_clock_that_was_set_are_told_apart_in_every_channel(tmp_path: Path):
    """A slow and a fast stream, in one file, of a clock that was set twice."""
    time = 0.1 * np.arange(900)
    set_by = np.select([time < 30.0, time < 60.0], [0.0, 1.7e9], -20.0)
    lines = []
    for k, t in enumerate((time + set_by).tolist()):
        lines.append(f"{t:.3f},compass,psi,{time[k]:.3f}")
        lines += [f"{t:.3f},dvl,u,{time[k]:.3f}"] if k % 7 == 0 else []
    (tmp_path / "log.csv").write_text("time,topic,field,value\n" + "\n".join(lines) + "\n")
    found = read_log(tmp_path / "log.csv", mend=True).channels
    for channel in found.values():
        want = (
            channel.value
            + APART * ((channel.value >= 30.0).astype(float) + (channel.value >= 60.0))
            - 0.1 * ((channel.value >= 30.0).astype(float) + (channel.value >= 60.0))
        )
        np.testing.assert_allclose(channel.time, want, atol=0.11)
        assert len(channel.lost.sets) == 2
    with pytest.raises(LogError, match="time runs backwards"):
        read_log(tmp_path / "log.csv")


@pytest.mark.parametrize("stamp", [1e300, -1e18, 9.3e18, -5.0, 0.0, float("nan"), float("inf")])
def test_one_stamp_that_is_wrong_costs_one_row(case, tmp_path: Path, stamp: float):
    table = case.table.iloc[:600].copy()
    table.loc[300, "t"] = stamp
    table.to_csv(tmp_path / "log.csv", index=False)
    u = read_log(tmp_path / "log.csv").channels["u"]
    np.testing.assert_allclose(u.time, table["t"].drop(300), atol=1e-6)


def test_time_that_stands_or_runs_backwards_all_along_ends_in_a_message(case, tmp_path: Path):
    for change in (0.0, -1.0):
        case.table.assign(t=5.0 + change * case.table["t"]).to_csv(tmp_path / "log.csv", index=False)
        result = call("inspect", tmp_path / "log.csv")
        assert result.exit_code == 1, result.output
        assert "Not usable" in result.stdout


def test_axes_are_told_by_one_rule_and_its_angle(case, study: ModuleType, tmp_path: Path):
    for name, turn, side, angle in (
        ("untouched", 1, 1, 0.0),
        ("x and y exchanged", -1, -1, 90.0),
        ("u and v exchanged", 1, -1, 90.0),
        ("heading reversed", -1, 1, 0.0),
        ("heading off by 90 degrees", 1, 1, -90.0),
    ):
        path, _ = spoilt(study, case, name, tmp_path)
        track = track_of([read_log(path)])
        assert track is not None
        assert (track.turn, track.side) == (turn, side)
        assert np.degrees(track.angle) == pytest.approx(angle, abs=2.0)
        assert track.scale == pytest.approx(1.0, abs=0.03)
        assert (mixed_up(track, None) is None) == (name == "untouched")


def test_a_fix_puts_exchanged_axes_right(case, study: ModuleType, tmp_path: Path):
    path, _ = spoilt(study, case, "x and y exchanged", tmp_path)
    clean = examine(read_log(path)).clean
    np.testing.assert_allclose(clean.channels["x"].value, case.table["x"], atol=1e-9)


def test_a_defect_is_refused_by_its_reach_and_not_by_its_name():
    assert Finding(check="anything", verdict="defect", sentence="it is wrong", reach=Reach.LOG).refused
    assert not Finding(check="units", verdict="defect", sentence="it is wrong").refused
    assert not Finding(check="units", verdict="warning", sentence="it is wrong", reach=Reach.LOG).refused


def test_inspect_ends_with_1_for_a_defect_and_0_for_a_sound_log(case, study: ModuleType, tmp_path: Path):
    path, _ = spoilt(study, case, "untouched", tmp_path)
    assert call("inspect", path, "--json").exit_code == 0
    path, _ = spoilt(study, case, "x and y exchanged", tmp_path)
    result = call("inspect", path, "--json")
    assert result.exit_code == 1
    assert strict(result.stdout)["usable"] is False
    repaired = call("inspect", path, "--fix", tmp_path / "clean.csv")
    assert repaired.exit_code == 0, repaired.output
    assert call("inspect", tmp_path / "clean.csv").exit_code == 0
    pd.DataFrame({"t": [0.0, 1.0], "psi": [0.0, 0.0]}).to_csv(path, index=False)
    assert call("inspect", path).exit_code == 1


# One of a pair that stands still


@pytest.mark.parametrize(
    ("held", "moved", "verdict", "words"),
    [
        (12.0, True, "defect", "as if its thruster worked"),  # half a dozen effects would explain its frozen record
        (0.0, True, "defect", "as if its thruster worked"),
        (12.0, False, "warning", "held"),  # which of the two the log cannot tell, and that is no reason to refuse it
        (0.0, False, "note", "never changes"),  # at rest: the boat was driven by the other alone
        (35.0, False, "note", "never changes"),  # saturated
    ],
)
def test_a_record_that_stands_still_is_refused_only_where_its_thruster_moved_the_boat(
    held: float, moved: bool, verdict: str, words: str, tmp_path: Path
):
    hull = load_vehicle("blueboat")
    truth = programme(hull, "zigzag", 150.0, 442)
    record = truth.copy()
    record[:, 0] = held
    orders = Orders(truth if moved else record, 0.5)
    log = World(hull, duration=150.0, seed=442, orders=orders).run(NOISE["field"])
    path = replace(log, commands=record).write(tmp_path / "log.csv")
    (found,) = [f for f in inspect_log(read_log(path), hull).quality if f.check == "drive"]
    assert (found.verdict, found.channels) == (verdict, ("newton_port",))
    assert words in found.sentence


# Speeds that are derived


def test_speeds_derived_from_positions_name_nothing_that_is_not_there(tmp_path: Path):
    hull = load_vehicle("blueboat")
    log = simulate_world(hull, {"surge_quadratic_damping": -8.0}, duration=200.0, noise="field", seed=5)
    table = pd.read_csv(log.write(tmp_path / "log.csv"))
    path = tmp_path / "positions.csv"
    table[~table["field"].isin(["u", "v"])].to_csv(path, index=False)
    inputs = read_inputs(path, hull)
    (motion,) = inputs.weak.train.motions
    assert motion.derived == (True, True, False)
    assert set(find_missing(inputs.fitting, hull).findings.missing) <= {"surge_quadratic_damping"}


# Knots beside a drag that the vehicle lacks


@pytest.mark.parametrize(("factor", "check"), [(1.94384, "defect"), (1.0, "ok")])
def test_knots_are_told_by_what_thrust_does_to_the_mass(factor: float, check: str, tmp_path: Path):
    hull = load_vehicle("blueboat")
    log = simulate_world(hull, {"surge_quadratic_damping": -8.0}, duration=150.0, noise="field", seed=6)
    table = pd.read_csv(log.write(tmp_path / "log.csv"))
    table = table[~table["field"].isin(["x", "y"])]
    table.loc[table["field"].isin(["u", "v"]), "value"] *= factor
    table.to_csv(tmp_path / "speeds.csv", index=False)
    (found,) = speed_unit([Record.of(read_log(tmp_path / "speeds.csv"), hull)])
    assert (found.check, found.verdict) == ("units", check)
    assert ("in knots" in found.sentence) is (check == "defect")
