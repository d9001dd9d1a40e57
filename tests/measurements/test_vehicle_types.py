"""What kind of vehicle a log is of: read from every autopilot's log, told by inspect, refused by init."""

import numpy as np
import pytest
import ulog_files
from dataflash_files import dataflash_of
from log_samples import small_world
from pymavlink.dialects.v20 import ardupilotmega
from round_trip import world
from telemetry_files import BOOT, telemetry_of
from telemetry_files import Writer as Telemetry

from undertow.measurements.formats.autopilots.autopilot import by_firmware, by_mav_type, by_px4_status
from undertow.measurements.formats.base import Craft
from undertow.measurements.inspection import inspect_log
from undertow.measurements.log import Log, read_log
from undertow.measurements.log_options import Reading
from undertow.physics.errors import LogError
from undertow.workflows.inspect_and_init import init


def text_log(path, message: str):
    writer = dataflash_of(world())
    lines = ["FMT, 134, 75, MSG, QZ, TimeUS,Message", f"MSG, 1000, {message}", *writer.text]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize(
    ("message", "craft"),
    [
        ("ArduCopter V4.5.0 (1a2b)", Craft.COPTER),
        ("ArduSub V4.1.0", Craft.SUBMARINE),
        ("APM:Plane V3.2", Craft.PLANE),
        ("ArduRover V4.2.0 (BlueBoat)", Craft.ROVER),
    ],
)
def test_a_dataflash_log_says_its_firmware(tmp_path, message, craft):
    log = read_log(text_log(tmp_path / "log.log", message))
    assert log.craft is not None
    assert log.craft.craft is craft
    found = [finding for finding in inspect_log(log).quality if finding.check == "vessel"]
    assert [finding.verdict for finding in found] == ["ok" if craft.floats else "warning"]
    assert craft.value in found[0].sentence


@pytest.mark.parametrize(("number", "craft"), [(2, Craft.COPTER), (11, Craft.BOAT), (12, Craft.SUBMARINE)])
def test_a_telemetry_log_says_it_in_its_heartbeat(tmp_path, number, craft):
    writer = Telemetry()
    for stamp in range(3):
        message = ardupilotmega.MAVLink_heartbeat_message(number, 3, 0, 0, 4, 3)
        writer.add(BOOT + stamp, message)
    content = bytes(telemetry_of(world()).content)
    (tmp_path / "log.tlog").write_bytes(bytes(writer.content) + content if number != 11 else content)
    log = read_log(tmp_path / "log.tlog")
    assert log.craft is not None
    assert log.craft.craft is craft


def test_a_ulog_says_it_in_a_parameter(tmp_path):
    writer = ulog_files.Writer(parameters={**ulog_files.PARAMETERS, "MAV_TYPE": 2})
    (tmp_path / "log.ulg").write_bytes(bytes(ulog_files.ulog_of(world(), writer).content))
    log = read_log(tmp_path / "log.ulg")
    assert log.craft is not None
    assert log.craft.craft is Craft.COPTER


def test_init_refuses_what_is_no_boat_unless_told_to_go_on(tmp_path):
    path = text_log(tmp_path / "log.log", "ArduCopter V4.5.0 (1a2b)")
    with pytest.raises(LogError, match=r"is of a copter, which is no surface vessel \(MSG: ArduCopter V4.5.0\)"):
        init([path], progress=None)
    assert init([path], reading=Reading(as_is=True), progress=None).thrusters


def test_what_says_nothing_is_no_kind():
    assert by_firmware(["ArduPilot Ready", "Frame: boat"], "MSG") is None
    assert by_mav_type(6, "HEARTBEAT") is None, "a ground station"
    assert by_px4_status(0) is None
    table = Log.from_arrays(np.arange(30.0), {"psi": np.zeros(30)})
    assert table.craft is None
    assert not [finding for finding in inspect_log(table).quality if finding.check == "vessel"]


def test_a_table_of_a_world_says_nothing(tmp_path):
    assert read_log(small_world().write(tmp_path / "log.csv")).craft is None
