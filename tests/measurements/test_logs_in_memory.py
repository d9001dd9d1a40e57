"""Logs of arrays and data frames are read as the same table in a file would be, and go all the way to a run."""

from importlib.metadata import version
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import undertow
from undertow.measurements.log import Log, read_log
from undertow.measurements.preparation.needs import require
from undertow.physics.errors import LogError, RequestError
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    """A wide table at 10 Hz: time, position, heading, velocity and the commands in newtons."""
    world = simulate_world(load_vehicle("blueboat"), {"surge_quadratic_damping": -12.0}, duration=90.0, seed=2)
    time = world.command_time
    states = np.column_stack([np.interp(time, world.odometry_time, column) for column in world.odometry.T])
    found = pd.DataFrame(states, columns=["x", "y", "psi", "u", "v", "r"])
    found.insert(0, "t", time)
    for k, name in enumerate(world.truth.thrusters):
        found[f"newton_{name}"] = world.commands[:, k]
    return found


def assert_same(one: Log, other: Log) -> None:
    assert list(one.channels) == list(other.channels)
    for name, channel in one.channels.items():
        assert np.allclose(channel.time, other.channels[name].time, atol=1e-9), name
        assert np.allclose(channel.value, other.channels[name].value, atol=1e-9), name


def test_a_data_frame_is_the_same_log_as_its_file(table: pd.DataFrame, tmp_path: Path) -> None:
    table.to_csv(tmp_path / "log.csv", index=False)
    read = read_log(tmp_path / "log.csv")
    assert_same(Log.from_dataframe(table), read)
    assert_same(Log.from_dataframe(table.set_index("t")), read)
    assert_same(Log.from_dataframe(table.rename(columns={"t": "clock"}), time="clock"), read)
    assert_same(Log.from_arrays(table.t, {name: table[name] for name in table.columns if name != "t"}), read)


def test_dates_count_from_the_first(table: pd.DataFrame) -> None:
    dated = table.set_index(pd.Timestamp("2026-11-22T08:00:00Z") + pd.to_timedelta(table.t, unit="s"))
    log = Log.from_dataframe(dated.drop(columns="t"))
    assert log.channels["u"].time == pytest.approx(table.t - table.t[0], abs=1e-6)


def test_units_and_names_are_those_of_channel_maps(table: pd.DataFrame) -> None:
    told = table.assign(psi=np.degrees(table.psi), u=table.u / 0.514444444)
    for unit in ("knots", "kn", "kt"):
        log = Log.from_dataframe(told, units={"psi": "deg", "u": unit})
        assert log.channels["psi"].value == pytest.approx(table.psi, abs=1e-9)
        assert log.channels["u"].value == pytest.approx(table.u, abs=1e-6)
    entry = Log.from_dataframe(told, channel_map={"u": {"from": "u", "unit": "kn"}}).entries["u"]
    assert entry is not None
    assert entry.scale < 0.52


def test_axes_are_turned_where_they_are_said_to_be_enu(table: pd.DataFrame) -> None:
    log = Log.from_dataframe(table, frame="enu")
    assert log.channels["r"].value == pytest.approx(-table.r)
    assert log.channels["x"].value == pytest.approx(table.y)


class Foreign:
    """A table of another library, which offers the interchange protocol alone."""

    def __init__(self, table: pd.DataFrame) -> None:
        self._table = table

    def __dataframe__(self, nan_as_null: bool = False, allow_copy: bool = True) -> object:
        return self._table.__dataframe__(nan_as_null, allow_copy)  # type: ignore[operator]


def test_anything_with_the_protocol_will_do(table: pd.DataFrame) -> None:
    assert_same(Log.from_dataframe(Foreign(table)), Log.from_dataframe(table))


def long(table: pd.DataFrame, *names: str) -> pd.DataFrame:
    """A row for each value: stamps, names and numbers under these columns."""
    stamps, label, number = names
    return table.melt("t", var_name=label, value_name=number).rename(columns={"t": stamps})


@pytest.mark.parametrize("names", [("t", "name", "value"), ("time", "field", "value"), ("_time", "_field", "_value")])
def test_a_long_table_is_the_same_log(table: pd.DataFrame, names: tuple[str, str, str]) -> None:
    told = long(table, *names)
    assert_same(Log.from_dataframe(told), Log.from_dataframe(table))
    shuffled = told.sample(frac=1.0, random_state=1)
    assert_same(Log.from_dataframe(shuffled), Log.from_dataframe(table))
    dated = told.assign(**{names[0]: (pd.Timestamp("2026-11-22") + pd.to_timedelta(told[names[0]], unit="s"))})
    log = Log.from_dataframe(dated.astype({names[0]: str}))
    assert log.channels["u"].time == pytest.approx(table.t - table.t[0], abs=1e-6)


def test_the_streams_of_a_long_table_have_their_own_stamps_and_units(table: pd.DataFrame) -> None:
    told = long(table.assign(psi=np.degrees(table.psi)), "time", "field", "value").assign(topic="boat")
    slow = told[(told.field != "psi") | (np.arange(len(told)) % 2 == 0)]
    log = Log.from_dataframe(slow, units={"boat:psi": "deg"})
    assert log.channels["psi"].time.size == len(table) // 2 + len(table) % 2
    assert log.channels["u"].time.size == len(table)
    assert np.abs(log.channels["psi"].value).max() == pytest.approx(np.abs(table.psi).max(), rel=0.01)


def test_a_long_table_without_values_says_how_to_pivot(table: pd.DataFrame) -> None:
    told = long(table, "time", "channel", "reading")
    match = (
        r"'channel' holds names.*rename the column.*table.pivot_table\(index='time', columns='channel', values=\.\.\.\)"
    )
    with pytest.raises(LogError, match=match):
        Log.from_dataframe(told)


def test_a_library_that_cannot_make_a_table_of_pandas_is_asked_by_the_protocol(table: pd.DataFrame) -> None:
    class Polar(Foreign):
        def to_pandas(self) -> pd.DataFrame:
            raise ModuleNotFoundError("pyarrow is required for converting to pandas")

    class Columns:
        columns = tuple(table.columns)

        def __getitem__(self, name: str) -> list[float]:
            return table[name].tolist()

        def to_pandas(self) -> pd.DataFrame:
            raise ModuleNotFoundError("pyarrow is required for converting to pandas")

    for other in (Polar(table), Columns()):
        assert_same(Log.from_dataframe(other), Log.from_dataframe(table))


def test_what_cannot_be_is_refused_in_words(table: pd.DataFrame) -> None:
    with pytest.raises(LogError, match="no column holds the time; say time="):
        Log.from_dataframe(table.drop(columns="t"))
    with pytest.raises(LogError, match="no column 'clock'; expected one of t, x"):
        Log.from_dataframe(table, time="clock")
    with pytest.raises(LogError, match="expected a data frame, got list"):
        Log.from_dataframe([1.0, 2.0])
    with pytest.raises(LogError, match="units are given for speed, which is not among the channels"):
        Log.from_dataframe(table, units={"speed": "knots"})
    with pytest.raises(LogError, match="needs a unit among|expected a unit that fits"):
        Log.from_dataframe(table, units={"u": "deg"})
    with pytest.raises(LogError, match="u has 2 values, time has 3"):
        Log.from_arrays([0.0, 1.0, 2.0], {"u": [1.0, 2.0]})
    with pytest.raises(LogError, match="u: expected numbers, got list"):
        Log.from_arrays([0.0], {"u": ["fast"]})
    with pytest.raises(RequestError, match="expected enu or ned"):
        Log.from_dataframe(table, frame="nwu")


def test_what_init_found_of_a_table_reads_it_the_right_way_round(table: pd.DataFrame, tmp_path: Path) -> None:
    wired = table.assign(newton_stbd=-table.newton_stbd)
    draft = undertow.init(Log.from_dataframe(wired), undertow.Hull(mass=20.0), progress=None)
    assert draft.thrusters[1].turned
    log = Log.from_dataframe(wired, channel_map=draft.entries)
    assert log.channels["newton_stbd"].value == pytest.approx(table.newton_stbd)
    assert undertow.read_inputs(log, draft.vehicle, progress=None).warnings == ()
    draft.write(tmp_path / "vehicle.yaml", tmp_path / "channels.yaml")
    assert_same(Log.from_dataframe(wired, channel_map=tmp_path / "channels.yaml"), log)


def test_a_channel_map_of_plain_values_is_what_its_file_would_be(table: pd.DataFrame) -> None:
    renamed = table.rename(columns={"newton_port": "left"})
    chart = {"newton_port": {"from": "left", "scale": -1.0}, "newton_stbd": "newton_stbd", "r": None}
    log = Log.from_dataframe(renamed, channel_map=chart)
    assert log.channels["newton_port"].value == pytest.approx(-table.newton_port)
    assert log.entries["r"] is None
    with pytest.raises(LogError, match="must be 'topic:field', a column or its number, null, or a mapping with 'from'"):
        Log.from_dataframe(renamed, channel_map={"newton_port": {"of": "left"}})
    with pytest.raises(LogError, match="unknown channel 'port' in the channel map"):
        Log.from_dataframe(renamed, channel_map={"port": "left"})


def test_a_reading_takes_the_path_of_a_map_and_says_who_takes_its_lines() -> None:
    with pytest.raises(RequestError, match=r"expected the path of a YAML file.*got dict.*Log.from_dataframe"):
        undertow.Reading(channel_map={"pwm_stbd": {"from": "pwm_stbd"}})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("least", "most", "name"),
    [(-1.025, 0.975, "normalized_stbd"), (1100.0, 1900.0, "pwm_stbd"), (-40.0, 35.0, "newton_stbd")],
)
def test_a_table_without_what_a_search_needs_says_what_looks_like_it(
    table: pd.DataFrame, least: float, most: float, name: str
) -> None:
    command = np.linspace(least, most, len(table))
    log = Log.from_dataframe(table.drop(columns=["newton_port", "newton_stbd"]).assign(cmd_stbd=command, cmd_any=1.0))
    (told,) = log.lacks
    assert told == log.notes[0]
    assert told.startswith("A search needs the command of each thruster, such as pwm_port [us]")
    assert told.endswith(f"try channel_map={{{name!r}: 'cmd_stbd'}}.")
    assert "to add" in repr(log)
    assert Log.from_dataframe(table).lacks == ()


def test_a_map_that_has_the_units_in_it_is_not_turned_twice(table: pd.DataFrame) -> None:
    degrees = table.assign(psi=np.degrees(table.psi))
    first = Log.from_dataframe(degrees, units={"psi": "deg"})
    again = Log.from_dataframe(degrees, units={"psi": "deg"}, channel_map=first.entries)
    np.testing.assert_allclose(again.channels["psi"].value, table.psi)
    half = Log.from_dataframe(degrees, units={"psi": "deg"}, channel_map={"psi": {"from": "psi", "scale": 0.5}})
    np.testing.assert_allclose(half.channels["psi"].value, 0.5 * table.psi)


def test_a_heading_and_a_place_by_other_names_are_told_with_the_lines_that_take_them(table: pd.DataFrame) -> None:
    other = table.rename(columns={"x": "north", "y": "east", "psi": "heading"}).drop(columns=["u", "v", "r"])
    log = Log.from_dataframe(other.assign(heading=np.degrees(other.heading) % 360.0))
    heading, place = log.lacks
    assert heading.endswith("try channel_map={'psi': {'from': 'heading', 'unit': 'deg'}}.")
    assert place.endswith("try channel_map={'x': 'north', 'y': 'east'}.")
    chart = {"psi": {"from": "heading", "unit": "deg"}, "x": "north", "y": "east"}
    assert Log.from_dataframe(other, channel_map=chart).lacks == ()
    with pytest.raises(
        LogError, match=r"expected a heading.*try channel_map=\{'psi': \{'from': 'heading', 'unit': 'deg'"
    ):
        require(log, None)
    assert "not used  north, east, heading" in str(log)


def test_it_goes_all_the_way_to_a_run(table: pd.DataFrame, tmp_path: Path) -> None:
    inputs = undertow.read_inputs(undertow.Log.from_dataframe(table, name="monday"), "blueboat")
    run = undertow.discover(inputs)
    assert run.findings.missing == ("surge_quadratic_damping",)
    folder = undertow.write_run(run, tmp_path / "run", report=False)
    read = undertow.load_run(folder)
    assert read.findings.missing == ("surge_quadratic_damping",)
    assert [log.path for log in read.record.log_sha256] == ["monday"]


def test_a_log_in_memory_is_not_read_again(table: pd.DataFrame) -> None:
    with pytest.raises(RequestError, match="read already; give frame and channel_map to Log.from_dataframe"):
        undertow.read_inputs(Log.from_dataframe(table), "blueboat", undertow.Reading(frame="enu"))


def test_two_of_one_name_are_refused(table: pd.DataFrame) -> None:
    log = Log.from_dataframe(table)
    with pytest.raises(RequestError, match="two logs are called 'dataframe'"):
        undertow.read_inputs([log, log], "blueboat")


def test_the_package_says_its_version() -> None:
    assert undertow.__version__ == version("undertow")
