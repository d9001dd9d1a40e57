"""Worlds with a hidden effect: programmes, noise, and the logs that they write."""

import gzip
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from undertow.physics.errors import RequestError
from undertow.physics.integration import simulate_motion
from undertow.physics.motion import body_to_earth
from undertow.physics.thrusters import TableCurve
from undertow.physics.vehicle import Vehicle, load_vehicle, shipped_vehicles
from undertow.physics.worlds.manoeuvres import MANOEUVRES, PROGRAMMES, draw_programme, programme, side
from undertow.physics.worlds.world import NOISE, Sensors, SimulatedLog, World, simulate_world


@pytest.fixture(scope="module")
def boat() -> Vehicle:
    return load_vehicle("blueboat")


@pytest.fixture(scope="module")
def field_log(boat: Vehicle) -> SimulatedLog:
    return simulate_world(boat, {"steady_current": (0.2, 0.1)}, duration=40.0, seed=4)


@pytest.fixture(scope="module")
def clean_log(boat: Vehicle) -> SimulatedLog:
    return simulate_world(boat, {}, duration=30.0, noise="clean", seed=4)


@pytest.mark.parametrize("name", PROGRAMMES)
@pytest.mark.parametrize("vehicle", shipped_vehicles())
def test_programme_fits_every_vehicle(name: str, vehicle: str) -> None:
    thrusters = load_vehicle(vehicle).thrusters
    commands = programme(load_vehicle(vehicle), name, 120.0, seed=2)
    assert commands.shape == (1201, len(thrusters))
    for thruster, column in zip(thrusters, commands.T, strict=True):
        fraction = thruster.curve.normalised(column, thruster.command)
        assert np.abs(fraction).max() <= 1.0 + 1e-12
        if isinstance(thruster.curve, TableCurve):
            assert thruster.curve.command[0] <= column.min() <= column.max() <= thruster.curve.command[-1]
        assert side(thruster) == 0 or np.ptp(fraction) > 0.1


def test_rich_programme_excites_every_regime(boat: Vehicle) -> None:
    port, stbd = programme(boat, "rich", 300.0).T / 35.0
    common, turn = 0.5 * (port + stbd), 0.5 * (port - stbd)
    assert common.max() == 1.0
    assert common.min() == -1.0
    small = np.abs(port[np.abs(port) > 0])
    assert small.min() < 0.05
    assert ((small > 0.05) & (small < 0.2)).sum() > 50
    assert (turn > 0.15).sum() > 200
    assert (turn < -0.15).sum() > 200
    assert ((np.abs(common) < 1e-9) & (np.abs(turn) > 0.3)).any(), "it spins"


def test_every_manoeuvre_of_a_programme_comes_before_any_comes_again(boat: Vehicle) -> None:
    rng = np.random.default_rng(0)
    assert set(PROGRAMMES["rich"]) | set(PROGRAMMES["gentle"]) == set(MANOEUVRES)
    longest = sum(len(MANOEUVRES[name](rng)) for name in PROGRAMMES["rich"]) / 10
    assert 200 < longest < 299, "all of them fit into the default five minutes"


def test_gentle_programme_goes_ahead_and_turns_little() -> None:
    common, turn = draw_programme("gentle", 200.0, np.random.default_rng(1))[10:].T
    assert common.min() > 0.05
    assert common.max() < 0.7
    assert np.abs(turn).max() < 0.15


def test_programme_depends_on_the_seed_alone(boat: Vehicle) -> None:
    np.testing.assert_array_equal(programme(boat, seed=1), programme(boat, seed=1))
    assert not np.array_equal(programme(boat, seed=1), programme(boat, seed=2))
    np.testing.assert_array_equal(programme(boat, duration=50.0), programme(boat, duration=300.0)[:501])


def test_more_to_port_turns_to_starboard(boat: Vehicle) -> None:
    for name, sign in (("circle_port_fast", -1), ("circle_starboard_fast", 1)):
        common, turn = MANOEUVRES[name](np.random.default_rng(0)).T
        assert np.all(common > 0)
        assert np.sign(turn[-1]) == sign
    common, turn = draw_programme("rich", 60.0, np.random.default_rng([0, 1])).T
    expected = 35.0 * np.clip(np.column_stack([common + turn, common - turn]), -1.0, 1.0)
    np.testing.assert_allclose(programme(boat, "rich", 60.0, seed=0), expected, atol=1e-12)
    log = simulate_world(boat, {}, duration=20.0, noise="clean")
    port, stbd = log.truth.commands.T
    assert np.corrcoef(port - stbd, log.truth.velocity[:, 2])[0, 1] > 0.5


def test_same_seed_gives_the_same_bytes(boat: Vehicle, field_log: SimulatedLog, tmp_path: Path) -> None:
    again = simulate_world(boat, {"steady_current": (0.2, 0.1)}, duration=40.0, seed=4)
    other = simulate_world(boat, {"steady_current": (0.2, 0.1)}, duration=40.0, seed=5)
    for name in ("a.csv", "a.csv.gz", "a.parquet"):
        one, two, three = (
            log.write(tmp_path / f"{k}{name}").read_bytes() for k, log in enumerate((field_log, again, other))
        )
        assert one == two != three
    assert (tmp_path / "0a.csv.gz").read_bytes()[4:8] == bytes(4), "gzip keeps no time of writing"
    assert not list(tmp_path.glob(".*")), "no temporary file is left"


@pytest.mark.parametrize("name", ["a.txt", "a.mat", "a.gz", "a.csv.zst", "a.mcap"])
def test_a_log_is_not_written_under_the_name_of_another_format(
    name: str, field_log: SimulatedLog, tmp_path: Path
) -> None:
    with pytest.raises(RequestError, match=f"{name}: expected a name that ends in .csv, .* bags are read, not written"):
        field_log.write(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_the_three_formats_hold_the_same_log(field_log: SimulatedLog, tmp_path: Path) -> None:
    text = field_log.write(tmp_path / "a.csv").read_bytes()
    assert gzip.decompress(field_log.write(tmp_path / "a.csv.gz").read_bytes()) == text
    plain, parquet = pd.read_csv(tmp_path / "a.csv"), pd.read_parquet(field_log.write(tmp_path / "a.parquet"))
    assert list(plain.columns) == list(parquet.columns) == ["time", "topic", "field", "value"]
    np.testing.assert_allclose(plain["value"], parquet["value"], rtol=1e-8, atol=1e-12)
    assert (plain["field"] == parquet["field"]).all()


def test_file_is_a_long_table_of_canonical_channels(field_log: SimulatedLog, tmp_path: Path) -> None:
    table = pd.read_csv(field_log.write(tmp_path / "a.csv"))
    assert table["time"].is_monotonic_increasing
    fields = {topic: set(rows["field"]) for topic, rows in table.groupby("topic")}
    assert fields == {"odometry": {"x", "y", "psi", "u", "v", "r"}, "command": {"newton_port", "newton_stbd"}}
    for field, rows in table.groupby("field"):
        steps = np.diff(rows["time"])
        assert steps.min() > 0
        assert np.median(steps) == pytest.approx(0.1 if "newton" in str(field) else 0.05, abs=1e-3)
    assert table.loc[table["field"] == "psi", "value"].abs().max() <= np.pi


def test_a_written_log_reads_back_as_the_same_motion(clean_log: SimulatedLog, tmp_path: Path) -> None:
    table = pd.read_csv(clean_log.write(tmp_path / "a.csv.gz"))
    u = table[table["field"] == "u"]
    np.testing.assert_allclose(u["value"], clean_log.motion().velocity[:, 0], rtol=1e-8, atol=1e-12)


def test_noise_has_the_size_of_its_preset(field_log: SimulatedLog) -> None:
    truth, sensors = field_log.truth, NOISE["field"]
    exact = np.column_stack([truth.position, truth.heading, truth.velocity])
    stamps = field_log.odometry_time
    noise = field_log.odometry - np.column_stack([np.interp(stamps, truth.time, c) for c in exact.T])
    wanted = [sensors.position] * 2 + [sensors.heading] + [sensors.speed] * 2 + [sensors.yaw_rate]
    np.testing.assert_allclose(noise.std(axis=0), wanted, rtol=0.1)
    jitter = stamps - 0.05 * np.round(stamps / 0.05)
    assert jitter.std() == pytest.approx(sensors.jitter, rel=0.15)
    lost = 1.0 - stamps.size / 801
    assert 0.002 < lost < 0.025


def test_noise_leaves_the_world_alone(boat: Vehicle, field_log: SimulatedLog) -> None:
    clean = simulate_world(boat, {"steady_current": (0.2, 0.1)}, duration=40.0, noise="clean", seed=4)
    np.testing.assert_array_equal(clean.truth.velocity, field_log.truth.velocity)
    assert clean.odometry_time.size == 801


def test_waves_are_what_a_boat_would_feel(boat: Vehicle, clean_log: SimulatedLog) -> None:
    """Position, heading, velocity and yaw rate in waves belong together, and the sea changes nothing else."""
    log = simulate_world(boat, {}, duration=30.0, noise="clean", waves=0.2, seed=4)
    np.testing.assert_array_equal(log.truth.velocity, clean_log.truth.velocity)
    calm, wavy = clean_log.motion(), log.motion()
    north, east = body_to_earth(wavy.heading, wavy.velocity[:, 0], wavy.velocity[:, 1])
    speeds = np.column_stack([north, east, wavy.velocity[:, 2]])
    places = np.column_stack([wavy.position, wavy.heading])
    np.testing.assert_allclose(np.gradient(places, wavy.time, axis=0)[1:-1], speeds[1:-1], atol=0.02)
    orbit = speeds[:, :2] - np.column_stack(body_to_earth(calm.heading, calm.velocity[:, 0], calm.velocity[:, 1]))
    assert 2.0 * np.sqrt((orbit**2).sum(axis=1).mean()) == pytest.approx(0.2, rel=0.2)
    assert 0.002 < (wavy.velocity[:, 2] - calm.velocity[:, 2]).std() < 0.2
    power = np.abs(np.fft.rfft(orbit, axis=0)).sum(axis=1)
    frequency = np.fft.rfftfreq(wavy.time.size, wavy.time_step)
    assert 0.4 < frequency[np.argmax(power)] < 0.6


def test_clean_log_is_the_truth(clean_log: SimulatedLog, boat: Vehicle) -> None:
    motion, truth = clean_log.motion(0.1), clean_log.truth
    np.testing.assert_allclose(motion.velocity, truth.velocity[::5], atol=1e-12)
    np.testing.assert_allclose(motion.position, truth.position[::5], atol=1e-12)
    np.testing.assert_allclose(motion.heading, truth.heading[::5], atol=1e-12)
    again = simulate_motion(boat, truth)
    np.testing.assert_array_equal(again.velocity, truth.velocity)


def test_motion_from_a_coarse_log_still_follows_the_model(clean_log: SimulatedLog, boat: Vehicle) -> None:
    """Commands as means over the step keep the area of every held step: a 0.1 s grid drives the same motion."""
    motion = clean_log.motion(0.1)
    again = simulate_motion(boat, motion)
    error = np.abs(again.velocity - motion.velocity)
    # The rounded corners at the steps themselves are what remains.
    assert error.mean() < 1e-3
    assert np.median(error) < 3e-4
    assert np.abs(motion.velocity).max(axis=0).min() > 0.1


def test_jittered_stamps_increase_whatever_the_jitter(boat: Vehicle) -> None:
    log = World(boat, duration=20.0).run(Sensors(jitter=0.5))
    assert np.diff(log.odometry_time).min() > 0
    assert np.diff(log.command_time).min() > 0
    assert log.odometry_time[0] >= 0


def test_an_effect_shows_in_the_truth(boat: Vehicle, clean_log: SimulatedLog) -> None:
    hidden = simulate_world(boat, {"surge_quadratic_damping": -9.0}, duration=30.0, noise="clean", seed=4)
    np.testing.assert_array_equal(hidden.truth.commands, clean_log.truth.commands)
    assert hidden.vehicle.value("X_uu") == boat.value("X_uu") - 9.0
    assert np.abs(hidden.truth.velocity[:, 0]).max() < 0.95 * np.abs(clean_log.truth.velocity[:, 0]).max()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"programme": "rihc"}, "unknown programme 'rihc': did you mean 'rich'"),
        ({"noise": "felid"}, "unknown noise 'felid': did you mean 'field'"),
        ({"waves": -0.1}, r"expected waves of 0 m/s or more, got -0\.1 m/s"),
        ({"waves": float("nan")}, "expected waves of 0 m/s or more, got nan m/s"),
        ({"duration": 0.2}, r"expected a duration of 1 to 86400 s, got 0\.2 s"),
        ({"duration": 86401.0}, "expected a duration of 1 to 86400 s, got 86401 s"),
        ({"duration": float("nan")}, "expected a duration of 1 to 86400 s, got nan"),
        ({"effects": {"surge:u^3": 30.0}}, "the motion of .* diverges; make the hidden effect smaller"),
    ],
)
def test_world_that_cannot_be_is_refused(boat: Vehicle, options: dict[str, object], message: str) -> None:
    arguments: dict[str, object] = {"effects": {}, "duration": 20.0} | options
    with pytest.raises(RequestError, match=message):
        simulate_world(boat, **arguments)  # type: ignore[arg-type]


def test_programme_without_a_duration_is_refused(boat: Vehicle) -> None:
    with pytest.raises(RequestError, match="the duration must be a positive number of seconds, got -1"):
        programme(boat, "rich", -1.0)


def test_writing_into_no_folder_is_refused(clean_log: SimulatedLog, tmp_path: Path) -> None:
    with pytest.raises(RequestError, match="the folder .*nowhere does not exist"):
        clean_log.write(tmp_path / "nowhere" / "a.csv")
    with pytest.raises(RequestError, match="a step of 100 s does not fit a log of 30 s"):
        clean_log.motion(100.0)
    assert not list(tmp_path.iterdir())
