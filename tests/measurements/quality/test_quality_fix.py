"""`inspect --fix`: the safe repairs are written with a note each, the rest is told, and the raw log is kept."""

import gzip
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from verbs import call, done, inspected, refused, strict

from undertow.measurements.canonical import command_kind
from undertow.measurements.channels.conversion import APART
from undertow.measurements.inspection import examine
from undertow.measurements.log import Log, read_log
from undertow.measurements.log_options import Reading
from undertow.measurements.preparation.prepare import prepare
from undertow.measurements.quality.record import Finding
from undertow.physics.errors import LogError
from undertow.physics.motion import body_to_earth, earth_to_body
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.workflows.inputs import read_inputs

TIME = np.arange(0.0, 60.0, 0.1)


def table(**changes: Any) -> dict[str, np.ndarray]:
    """A boat that weaves ahead, in the columns of a wide table."""
    psi = 0.8 * np.sin(0.4 * TIME) + 0.3 * np.sin(1.1 * TIME)
    u = 1.2 + 0.4 * np.sin(0.3 * TIME)
    north, east = u * np.cos(psi), u * np.sin(psi)
    x, y = (np.concatenate(([0.0], np.cumsum(0.05 * (v[1:] + v[:-1])))) for v in (north, east))
    columns = {"t": TIME, "x": x, "y": y, "psi": psi, "u": u, "v": 0.0 * u, "r": np.gradient(psi, TIME)}
    push, turn = 10.0 + 20.0 * np.gradient(u, TIME), 8.0 * np.gradient(columns["r"], TIME)
    return columns | {"newton_port": push + turn, "newton_stbd": push - turn} | changes


def written(path: Path, columns: dict[str, np.ndarray]) -> Path:
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    lines = [",".join(columns), *(",".join(f"{value:.9g}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    return tmp_path


def test_speeds_over_ground_that_are_late_are_moved_over_ground(place: Path):
    """Moved in the body instead, they would tell of other turns than the heading."""
    motion = simulate_world(load_vehicle("blueboat"), {}, duration=200.0, noise="clean", seed=7).motion(0.05)
    then = motion.time - 0.5
    ground = [np.interp(then, motion.time, x) for x in body_to_earth(motion.heading, *motion.velocity[:, :2].T)]
    late = dict(zip("uv", earth_to_body(motion.heading, *ground), strict=True))
    columns = {"t": motion.time, "x": motion.position[:, 0], "y": motion.position[:, 1], "psi": motion.heading}
    commands = dict(zip(("newton_port", "newton_stbd"), motion.commands.T, strict=True))
    written(place / "raw.csv", columns | late | {"r": motion.velocity[:, 2]} | commands)
    screen = inspected("inspect", "raw.csv", "--fix", "clean.csv")
    assert re.search(r"u and v moved over ground by -0\.(49|50)", screen)
    channels = read_log("clean.csv").channels
    for name, right in zip("uv", motion.velocity.T[:2], strict=True):
        left = channels[name].value - np.interp(channels[name].time, motion.time, right)
        assert np.sqrt(np.mean(left[20:-20] ** 2)) < 0.1 * np.sqrt(np.mean((late[name] - right)[20:-20] ** 2))


def test_degrees_are_repaired_and_the_repair_is_noted_in_the_data(place: Path):
    raw = written(place / "raw.csv", table(psi=np.degrees(table()["psi"])))
    before = raw.read_bytes()
    content = strict(inspected("inspect", "raw.csv", "--fix", "clean.csv", "--json"))
    assert "psi turned from degrees into radians" in content["fixed"]["done"]
    (told,) = [f for f in content["quality"] if f["check"] == "units" and f["verdict"] == "defect"]
    assert (told["channels"], told["fix"]) == (["psi"], "psi turned from degrees into radians")
    assert raw.read_bytes() == before
    log = read_log("clean.csv")
    assert np.allclose(log.channels["psi"].value, table()["psi"], atol=1e-6)
    assert "repaired by undertow from raw.csv" in log.notes
    assert "fixed: psi turned from degrees into radians" in log.notes
    again = strict(inspected("inspect", "clean.csv", "--json"))
    assert all(f["verdict"] != "defect" for f in again["quality"])
    assert log.notes[0] in inspected("inspect", "clean.csv")


def test_the_same_log_is_repaired_to_the_same_bytes(place: Path):
    written(place / "raw.csv", table(r=np.degrees(table()["r"])))
    inspected("inspect", "raw.csv", "--fix", "one.csv")
    inspected("inspect", "raw.csv", "--fix", "two.csv.gz")
    assert gzip.decompress((place / "two.csv.gz").read_bytes()) == (place / "one.csv").read_bytes()


def test_channels_on_stamps_of_their_own_make_a_long_table(place: Path):
    late = np.interp(TIME - 0.2, TIME, table()["r"])
    written(place / "raw.csv", table(r=late))
    screen = inspected("inspect", "raw.csv", "--fix", "clean.csv")
    assert re.search(r"stamps of r moved by -0\.(19|20)", screen)
    lines = [line for line in (place / "clean.csv").read_text().splitlines() if not line.startswith("#")]
    assert lines[0] == "time,topic,field,value"
    r = read_log("clean.csv").channels["r"]
    inside = (r.time > 1.0) & (r.time < 58.0)
    assert np.allclose(r.value[inside], np.interp(r.time, TIME, table()["r"])[inside], atol=0.02)


def test_rows_out_of_order_are_sorted_and_every_other_verb_refuses_them(place: Path):
    columns = table()
    order = np.arange(TIME.size)
    order[[100, 101, 300, 301]] = order[[101, 100, 301, 300]]
    written(place / "raw.csv", {name: column[order] for name, column in columns.items()})
    with pytest.raises(LogError, match=r"time runs backwards in .*inspect LOG --fix OUT.csv"):
        read_log("raw.csv")
    content = strict(inspected("inspect", "raw.csv", "--fix", "clean.csv", "--json"))
    assert content["verdict"].startswith("Not usable as it is: time runs backwards in x, ")
    assert content["verdict"].endswith("--fix OUT.csv writes a log that can be used.")
    (told,) = [f for f in content["quality"] if f["check"] == "stamps"]
    assert (told["verdict"], told["channels"][0]) == ("defect", "x")
    assert np.allclose(read_log("clean.csv").channels["x"].value, columns["x"], atol=1e-6)


def test_a_log_that_counts_from_1970_keeps_its_stamps(place: Path):
    start = 1_700_000_000_123_456_789
    columns = table()
    for name, many in (("raw.csv", columns), ("long.csv", {"t": TIME, "psi": columns["psi"]})):
        text = written(Path("part.csv"), many).read_text().splitlines()
        rows = [f"{start + round(1e9 * float(row.split(',')[0]))},{row.split(',', 1)[1]}" for row in text[1:]]
        if name == "long.csv":
            rows = [row.replace(",", ",compass,psi,") for row in rows]
            rows += [f"{start + 50_000_000 + round(1e9 * t)},dvl,u,1.5" for t in TIME]
        head = "timestamp_ns,topic,field,value" if name == "long.csv" else text[0].replace("t,", "timestamp_ns,", 1)
        Path(name).write_text("\n".join([head, *rows]) + "\n")
        inspected("inspect", name, "--fix", f"clean_{name}")
        raw, clean = read_log(name), read_log(f"clean_{name}")
        assert clean.start_ns == raw.start_ns == start
        for channel in raw.channels.values():
            assert np.array_equal(clean.channels[channel.name].time, channel.time)


def test_a_clock_that_is_set_back_is_told_and_its_pieces_are_joined(place: Path):
    written(place / "raw.csv", table(t=np.where(TIME < 30.0, TIME, TIME - 20.0)))
    content = strict(inspected("inspect", "raw.csv", "--json"))
    (stamps,) = [f for f in content["quality"] if f["check"] == "stamps"]
    assert stamps["verdict"] == "defect"
    assert stamps["value"] == pytest.approx(-20.0, abs=0.01)
    assert content["verdict"].startswith("Not usable")
    assert content["verdict"].endswith("--fix OUT.csv writes a log that can be used.")
    inspected("inspect", "raw.csv", "--fix", "clean.csv")
    clean = read_log("clean.csv").channels["x"]
    np.testing.assert_allclose(clean.value, table()["x"], atol=1e-6)
    assert np.diff(clean.time).max() == pytest.approx(APART, abs=0.01)


@pytest.mark.parametrize("long", [False, True])
def test_the_pieces_of_a_clock_that_is_set_back_are_not_mixed(place: Path, long: bool):
    psi, u = (np.repeat(values, 300) for values in ((0.25, 1.0), (1.0, 2.0)))
    psi[:10], u[300:305] = np.nan, np.nan  # each channel has more numbers in another piece
    columns = table(t=np.tile(TIME[:300], 2), psi=psi, u=u)
    written(place / "raw.csv", columns)
    if long:
        rows = zip(*(columns[name].tolist() for name in ("t", "psi", "u")), strict=True)
        lines = [f"{t},compass,psi,{p}\n{t},dvl,u,{s}\n" for t, p, s in rows]
        (place / "raw.csv").write_text("time,topic,field,value\n" + "".join(lines))
    found = read_log("raw.csv", mend=True).channels
    for name, first in (("psi", 0.25), ("u", 1.0)):
        assert np.array_equal(found[name].value == first, found[name].time < 30.0)
        assert found[name].time[-1] == pytest.approx(29.9 + APART + 29.9, abs=0.01)


def test_a_repaired_log_keeps_every_digit(place: Path):
    psi = 1.0 / 3.0 + 1e-13 * np.arange(TIME.size)
    lines = [f"{t!r},{p!r},{g!r}" for t, p, g in zip(TIME.tolist(), psi.tolist(), (100.0 * psi).tolist(), strict=True)]
    (place / "raw.csv").write_text("t,psi,x\n" + "\n".join(lines) + "\n")
    inspected("inspect", "raw.csv", "--fix", "clean.csv")
    raw, clean = read_log("raw.csv").channels, read_log("clean.csv").channels
    assert np.abs(clean["psi"].value - raw["psi"].value).max() < 1e-15
    assert np.abs(clean["x"].value - raw["x"].value).max() < 1e-13


def test_repeated_stamps_are_counted_and_dropped(place: Path):
    columns = {name: np.repeat(column, 1 + (np.arange(TIME.size) % 10 == 0)) for name, column in table().items()}
    written(place / "raw.csv", columns)
    content = strict(inspected("inspect", "raw.csv", "--fix", "clean.csv", "--json"))
    (told,) = [f for f in content["quality"] if f["check"] == "stamps"]
    assert (told["verdict"], told["value"]) == ("warning", pytest.approx(60 / 660, abs=1e-9))
    assert read_log("clean.csv").channels["x"].time.size == TIME.size


def test_what_is_not_safe_is_told_in_the_data_too(place: Path):
    columns = table(x=3.28084 * table()["x"], y=3.28084 * table()["y"])
    written(place / "raw.csv", columns)
    screen = inspected("inspect", "raw.csv", "--fix", "clean.csv")
    assert "Not put right" in screen
    notes = read_log("clean.csv").notes
    assert any(note.startswith("not fixed: the way made good is 3.28 times") for note in notes)
    assert np.allclose(read_log("clean.csv").channels["x"].value, columns["x"], atol=1e-4)


def test_a_clean_log_can_be_used_by_everything_else(place: Path):
    written(place / "raw.csv", table(psi=np.degrees(table()["psi"])))
    inspected("inspect", "raw.csv", "--fix", "clean.csv")
    data = prepare(read_log("clean.csv"), None)
    assert data.seconds > 50.0
    assert any("turned from degrees" in note for note in data.notes)


def test_files_that_fix_must_not_write(place: Path):
    written(place / "raw.csv", table())
    written(place / "other.csv", table())
    refused("inspect", "raw.csv", "--fix", "raw.csv", match=r"--fix raw.csv is read by this call; give another name")
    refused("inspect", "raw.csv", "--fix", "clean.mat", match=r"expected a name that ends in \.csv or \.csv\.gz")
    refused("inspect", "raw.csv", "--fix", "none/clean.csv", match=r"the folder none does not exist")
    refused("inspect", "raw.csv", "other.csv", "--fix", "c.csv", match=r"expected one log to repair, got 2")
    refused("inspect", "raw.csv", "raw.csv", match=r"given twice")


def test_several_logs_and_a_folder_are_looked_over_together(place: Path):
    (place / "logs").mkdir()
    for name in ("a.csv", "b.csv"):
        written(place / "logs" / name, table(psi=np.degrees(table()["psi"])))
    content = strict(inspected("inspect", "logs", "--json"))
    assert [Path(log["path"]).name for log in content["logs"]] == ["a.csv", "b.csv"]
    assert content["quality"][0]["check"] == "stamps"
    assert content["notes"] == []
    screen = inspected("inspect", "logs/a.csv", "logs/b.csv")
    assert "2 logs together" in screen
    assert "psi is in degrees" in screen
    assert "cannot be used as they are" in screen


def test_the_files_of_a_folder_that_are_no_logs_are_named(place: Path):
    (place / "logs").mkdir()
    (place / "logs" / "readme.txt").write_text("recorded on Tuesday")
    written(place / "logs" / "a.csv", table())
    told = "logs: 1 logs; not logs, and not read: readme.txt"
    assert told in strict(inspected("inspect", "logs", "--json"))["notes"]
    written(place / "logs" / "b.csv", table())
    assert strict(inspected("inspect", "logs", "--json"))["notes"] == [told.replace("1 logs", "2 logs")]
    assert "not read: readme.txt" in inspected("inspect", "logs")


def test_a_file_that_is_replaced_is_named(place: Path):
    written(place / "raw.csv", table())
    first = call("inspect", "raw.csv", "--fix", "clean.csv", "--map-out", "map.yaml")
    assert "replaced" not in first.stderr
    again = call("inspect", "raw.csv", "--fix", "clean.csv", "--map-out", "map.yaml")
    assert "replaced the earlier map.yaml" in again.stderr
    assert "replaced the earlier clean.csv" in again.stderr


def test_an_esc_that_drives_one_way_is_not_shifted_out_of_its_range(place: Path):
    time = np.arange(0.0, 200.0, 0.1)
    idle, phase = time % 40.0 < 12.0, np.floor(time / 40.0)
    port = np.where(idle, 1000.0, 1000.0 + np.round(500.0 * (1.0 + np.sin(0.5 * time + phase))))
    stbd = np.where(idle, 1000.0, 1000.0 + np.round(500.0 * (1.0 + np.cos(0.4 * time + phase))))
    u, r = np.zeros(time.size), np.zeros(time.size)
    for k in range(1, time.size):
        u[k] = u[k - 1] + 0.1 * ((port[k] + stbd[k] - 2000.0) / 1000.0 - 0.9 * u[k - 1])
        r[k] = r[k - 1] + 0.1 * ((port[k] - stbd[k]) / 1000.0 - 1.5 * r[k - 1])
    psi = 0.1 * np.cumsum(r)
    way = 0.1 * np.cumsum([u * np.cos(psi), u * np.sin(psi)], axis=1)
    columns = {"t": time, "x": way[0], "y": way[1], "psi": psi, "u": u, "v": 0.0 * u, "r": r}
    written(place / "raw.csv", columns | {"pwm_port": port, "pwm_stbd": stbd})
    content = strict(inspected("inspect", "raw.csv", "--fix", "clean.csv", "--json"))
    (told,) = [f for f in content["quality"] if f["check"] == "neutral"]
    assert (told["verdict"], told["value"], told["fix"]) == ("warning", 1000.0, None)
    assert "at an end of the range 1000 to 2000" in told["sentence"]
    assert "%" not in told["consequence"]
    assert "offset" not in told["remedy"]
    assert np.array_equal(read_log("clean.csv").channels["pwm_port"].value, port)


def test_the_screen_begins_with_the_verdict(place: Path):
    written(place / "raw.csv", table(psi=np.degrees(table()["psi"])))
    lines = [line for line in inspected("inspect", "raw.csv").splitlines() if line.strip()]
    assert lines[1].startswith("Not usable as it is: psi")
    assert "what was found, what follows, and what to do" in " ".join(lines[3:8])
    assert call("inspect", "raw.csv").exit_code == 1


def test_remarks_above_a_table_are_notes(place: Path):
    (place / "a.csv").write_text("# sailed on Tuesday\n#  wind from the west\nt,psi\n0,0.1\n1,0.2\n")
    log = read_log("a.csv")
    assert log.notes[:2] == ("sailed on Tuesday", "wind from the west")
    assert log.channels["psi"].value.tolist() == [0.1, 0.2]


def test_milliseconds_and_units_of_a_channel_map_are_read(place: Path):
    (place / "a.csv").write_text("timestamp(ms),Heading\n1000,90\n2500,180\n")
    (place / "map.yaml").write_text("psi: {from: Heading, unit: deg}\n")
    psi = read_log("a.csv", Reading(channel_map="map.yaml")).channels["psi"]
    assert psi.time.tolist() == [1.0, 2.5]
    assert psi.value == pytest.approx([np.pi / 2.0, np.pi])
    (place / "map.yaml").write_text("psi: {from: Heading, unit: gon}\n")
    with pytest.raises(LogError, match=r"needs a unit among deg, deg/s, .*got 'gon'"):
        read_log("a.csv", Reading(channel_map="map.yaml"))


def test_a_unit_of_a_channel_map_must_fit_its_channel(place: Path):
    lines = [f"{k},{60.0 + 1e-5 * k!r},10.0,900000000,{3.6 * k}" for k in range(20)]
    (place / "a.csv").write_text("\n".join(["t,Latitude,Longitude,Heading,Speed", *lines]) + "\n")
    degrees = "lat: {from: Latitude, unit: deg}\nlon: {from: Longitude, unit: deg}\n"
    (place / "map.yaml").write_text(
        f"{degrees}psi: {{from: Heading, unit: 1e-7 deg}}\nu: {{from: Speed, unit: km/h}}\n"
    )
    found = read_log("a.csv", Reading(channel_map="map.yaml")).channels
    assert found["x"].value[-1] == pytest.approx(19e-5 * 111_412.0, rel=1e-3)
    assert found["psi"].value == pytest.approx(np.pi / 2.0)
    assert found["u"].value[-1] == pytest.approx(19.0)
    for line, text in (
        ("psi: {from: Heading, unit: knots}", r"'psi' is a channel in rad; .*\(deg, 1e-7 deg\).*got 'knots'"),
        ("u: {from: Speed, unit: deg/s}", r"'u' is a channel in m/s; .*\(knots, km/h, cm/s\).*got 'deg/s'"),
        ("psi: {from: Heading, unit: [deg]}", r"needs a unit among .*got \['deg'\]"),
    ):
        (place / "map.yaml").write_text(line + "\n")
        with pytest.raises(LogError, match=text):
            read_log("a.csv", Reading(channel_map="map.yaml"))


def test_a_defect_of_the_log_is_told_beside_every_finding(place: Path):
    done("simulate", "-v", "blueboat", "--duration", "120", "--out", "raw.csv")
    text = (place / "raw.csv").read_text()
    other = {"port": "stbd", "stbd": "port"}
    (place / "swapped.csv").write_text(re.sub(r"_(port|stbd),", lambda side: f"_{other[side[1]]},", text))
    with pytest.raises(LogError, match="port and starboard look swapped"):
        read_inputs("swapped.csv", "blueboat")
    warnings = read_inputs("swapped.csv", "blueboat", Reading(as_is=True)).warnings
    assert any("port and starboard look swapped" in warning for warning in warnings)
    assert not any("swapped" in note for note in read_inputs("raw.csv", "blueboat").notes)


def test_the_map_of_the_raw_log_is_refused_beside_the_repaired_one(place: Path):
    raw = table()
    raw["SPEED"] = raw.pop("u")
    written(place / "raw.csv", raw)
    (place / "map.yaml").write_text("u: {from: SPEED}\n")
    call("inspect", "raw.csv", "--map", "map.yaml", "--fix", "fixed.csv")
    told = refused("inspect", "fixed.csv", "--map", "map.yaml", match="the channel map takes 'SPEED', which is not in")
    assert "'undertow inspect --fix' wrote it" in told
    assert "Leave --map out" in told
    (place / "map.yaml").write_text("v: {from: v, scale: -1}\n")  # of the repaired one
    call("inspect", "fixed.csv", "--map", "map.yaml")


@pytest.mark.parametrize(("programme", "seconds"), [("rich", 0.37), ("rich", 0.5), ("gentle", 0.5)])
def test_sides_are_told_of_speeds_that_are_later_than_the_gyro(place: Path, programme: str, seconds: float):
    done("simulate", "-v", "otter", "--programme", programme, "--duration", "180", "--out", "raw.csv")
    log = read_log("raw.csv")
    late = {name: replace(c, time=c.time + seconds * (name in "uv")) for name, c in log.channels.items()}
    found = examine(replace(log, channels=late)).findings
    assert [f.verdict for f in found if f.check in ("direction", "sides")] == ["ok", "ok"]
    assert any("surge speed" in f.sentence and f.verdict in ("defect", "warning") for f in found)


@pytest.mark.parametrize(("late", "told"), [(0.0, []), (2.0, ["defect"])])
def test_commands_that_are_recorded_once_a_second_are_late_from_a_row_on(place: Path, late: float, told: list[str]):
    done("simulate", "-v", "otter", "--duration", "240", "--out", "raw.csv")
    log = read_log("raw.csv")
    seldom = {}
    for name, c in log.channels.items():
        every, seconds = (round(1.0 / c.period), late) if command_kind(name) else (1, 0.0)
        seldom[name] = replace(c, time=c.time[every - 1 :: every] + seconds, value=c.value[every - 1 :: every])
    for vehicle in (load_vehicle("otter"), None):
        clocks = [f for f in examine(replace(log, channels=seldom), vehicle).findings if f.check == "clocks"]
        assert [f.verdict for f in clocks if f.verdict in ("warning", "defect")] == told


def found(columns: dict[str, np.ndarray], check: str) -> list[Finding]:
    channels = {name: value for name, value in columns.items() if name != "t"}
    return [f for f in examine(Log.from_arrays(columns["t"], channels)).findings if f.check == check]


def test_milliseconds_are_told_by_heading_and_track():
    (finding,) = found(table(t=1e3 * TIME), "time unit")
    assert finding.refused
    assert "the stamps are in ms" in finding.sentence
    assert finding.fix is not None
    mended = finding.fix.apply(Log.from_arrays(1e3 * TIME, {"x": table()["x"]}).channels)
    assert mended["x"].time == pytest.approx(TIME)
    assert found(table(), "time unit") == []


def test_stamps_in_no_unit_are_told_with_their_factor():
    (finding,) = found(table(t=3.0 * TIME), "time unit")
    assert finding.fix is None
    assert "give the time in seconds (times 0.33" in finding.remedy


def test_positions_in_whole_metres_are_rounded_and_not_held():
    columns = table()
    rounded = {name: columns[name].round() for name in ("x", "y")}
    (finding,) = found(columns | rounded, "held fixes")
    assert (finding.verdict, finding.value) == ("note", 1.0)
    assert "rounded to 1 m" in finding.sentence
    assert [f.verdict for f in found(columns | rounded, "late fixes")] == ["cannot tell"]
    held = {name: columns[name][np.arange(TIME.size) // 5 * 5].round(2) for name in ("x", "y")}
    (finding,) = found(columns | held, "held fixes")
    assert finding.verdict == "warning"
    assert "held in between" in finding.sentence


def test_a_steady_turn_without_noise_is_no_stuck_sensor():
    """Of a simulator, rate and sway come to one value each; a gyro that stops while the speed goes on is stuck."""
    steady = (TIME > 20.0) & (TIME < 40.0)
    columns = table()
    r = np.where(steady, 0.2, columns["r"])
    alone = columns | {"r": r}
    assert [f.channels for f in found(alone, "stuck")] == [("r",)]
    all_of_it = alone | {name: np.where(steady, 0.3, columns[name]) for name in ("u", "v")}
    assert [f.verdict for f in found(all_of_it, "stuck")] == ["ok"]
