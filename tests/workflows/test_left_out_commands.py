"""Outputs that never move are no thrusters, what a map leaves out stays out, and doubts are told as they are."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from dataflash_files import SERVOS, dataflash_of
from places import shared
from round_trip import world

from undertow.measurements.channels.channel_map import map_text, read_channel_map
from undertow.measurements.inspection import inspect_log
from undertow.measurements.log import Log, read_log
from undertow.measurements.log_options import Reading
from undertow.workflows.first_vehicle import Hull
from undertow.workflows.inputs import read_inputs
from undertow.workflows.inspect_and_init import init

SPARE = "pwm_2 never moves: left out, in the channel map as 'pwm_2: null'."


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    """A boat whose pilot logs three outputs by number: starboard, one that drives nothing, and port."""
    made = world(120.0)
    port, stbd = (made.commands[:, made.truth.thrusters.index(name)] for name in ("port", "stbd"))
    rows = np.searchsorted(made.command_time, made.odometry_time, side="right").clip(1) - 1
    motion = pd.DataFrame(made.odometry, columns=["x", "y", "psi", "u", "v", "r"])
    return motion.assign(t=made.odometry_time, pwm_1=stbd[rows], pwm_2=1500.0, pwm_3=port[rows])


def read_as(draft) -> dict[str, str]:
    return {one.channel: one.read_as for one in draft.thrusters}


def test_an_output_that_never_moves_is_left_out_and_every_verb_agrees(table: pd.DataFrame, tmp_path: Path) -> None:
    draft = init(Log.from_dataframe(table), Hull(mass=20.0, length=1.2), progress=None)
    assert read_as(draft) == {"pwm_port": "pwm_3", "pwm_stbd": "pwm_1"}
    assert draft.to_look_at[0].startswith(SPARE)
    assert draft.entries["pwm_2"] is None
    assert "pwm_2" in draft.unused
    draft.write(tmp_path / "vehicle.yaml", tmp_path / "channels.yaml")
    log = Log.from_dataframe(table, channel_map=tmp_path / "channels.yaml")
    assert "pwm_2" not in log.channels
    assert read_inputs(log, draft.vehicle, progress=None).warnings == ()


def test_outputs_that_move_are_judged_beside_one_that_does_not(table: pd.DataFrame) -> None:
    turned = table.assign(pwm_1=3000.0 - table.pwm_1)
    found = {f.check: f for f in inspect_log(Log.from_dataframe(turned)).quality}
    assert found["direction"].verdict in ("defect", "warning")
    assert found["direction"].channels == ("pwm_1",)
    assert set(found["sides"].channels) == {"pwm_1", "pwm_3"}


def test_where_no_output_moves_all_are_thrusters_and_said_to_be_unknown(table: pd.DataFrame) -> None:
    still = table.assign(pwm_1=1500.0, pwm_3=1600.0)
    draft = init(Log.from_dataframe(still), Hull(mass=20.0), progress=None)
    assert set(read_as(draft).values()) == {"pwm_1", "pwm_2", "pwm_3"}
    assert draft.remarks == ("pwm_1, pwm_2 and pwm_3 never move: nothing in the log shows what they do.",)


def test_one_that_moves_in_another_log_of_the_boat_is_a_thruster(table: pd.DataFrame) -> None:
    moved = table.assign(pwm_2=table.pwm_1)
    logs = [Log.from_dataframe(one, name=name) for name, one in (("a", table), ("b", moved))]
    draft = init(logs, Hull(mass=20.0), progress=None)
    assert set(read_as(draft).values()) == {"pwm_1", "pwm_2", "pwm_3"}


def test_one_that_the_autopilots_parameters_call_a_thruster_stays_one(tmp_path: Path) -> None:
    third = {"SERVO5_FUNCTION": 70, "SERVO5_MIN": 1100, "SERVO5_TRIM": 1500, "SERVO5_MAX": 1900, "SERVO5_REVERSED": 0}
    path = tmp_path / "12.bin"
    path.write_bytes(bytes(dataflash_of(world(), servos=SERVOS | third).content))
    draft = init(path, Hull(mass=22.0), progress=None)
    assert "pwm_throttle" in read_as(draft)
    (told,) = draft.remarks
    assert told.startswith("pwm_throttle never moves, but it is a thruster by the autopilot's parameters (SERVO5_")


@pytest.mark.parametrize("name", ["pwm_2", "pwm_thruster2"])
def test_a_command_is_left_out_by_the_name_in_the_log_and_by_that_in_the_vehicle(
    table: pd.DataFrame, tmp_path: Path, name: str
) -> None:
    path, chart = tmp_path / "log.csv", tmp_path / "map.yaml"
    table.assign(pwm_2=table.pwm_1).to_csv(path, index=False)
    chart.write_text(f"{name}: null\n")
    log = read_log(path, Reading(channel_map=chart))
    assert {n for n in log.channels if n.startswith("pwm")} == {"pwm_1", "pwm_3"}
    assert log.idle == ()
    draft = init(path, Hull(mass=20.0), reading=Reading(channel_map=chart), progress=None)
    assert draft.entries[name] is None
    chart.write_text(map_text(draft.entries, draft.unused))
    assert read_channel_map(chart)[name] is None
    assert set(read_log(path, Reading(channel_map=chart)).channels) >= {"pwm_port", "pwm_stbd"}
    assert "pwm_2" not in read_log(path, Reading(channel_map=chart)).channels


def test_a_line_that_leaves_nothing_out_is_told(table: pd.DataFrame, tmp_path: Path) -> None:
    path, chart = tmp_path / "log.csv", tmp_path / "map.yaml"
    table.to_csv(path, index=False)
    chart.write_text("pwm_thruster7: null\n")
    log = read_log(path, Reading(channel_map=chart))
    assert log.idle == ("pwm_thruster7",)
    assert [note for note in log.notes if "leaves out pwm_thruster7, but nothing is taken for it" in note]
    draft = init(path, Hull(mass=20.0), reading=Reading(channel_map=chart), progress=None)
    told = "'pwm_thruster7: null' leaves nothing out: no log has it. The commands are pwm_1, pwm_2 and pwm_3."
    assert told in draft.to_look_at


def test_what_is_likely_reversed_is_said_by_init_and_by_all_that_is_made_of_it() -> None:
    """A real log that shows it at long odds only: the starboard thruster of this boat is reversed."""
    path = shared("blueboat") / "log_231.csv"
    draft = init(path, Hull(mass=15.0, length=1.2, spacing=0.57), progress=None)
    first = draft.unsettled
    assert first.startswith("pwm_stbd is likely reversed (99 % sure")
    assert "Try it in a channel map: 'pwm_stbd: {from: pwm_stbd, scale: -1, offset: 3020}'" in first
    assert first.endswith("Until then, the map believes the names.")
    assert not [text for text in draft.to_look_at if "believed" in text or "certain" in text], "told once"
    assert first.partition(",")[0] in repr(draft)
    assert "offset: 3020}'" in repr(draft)
    inputs = read_inputs(path, draft.vehicle, progress=None)
    assert inputs.warnings[0].startswith("pwm_stbd is likely reversed (99 % sure")
