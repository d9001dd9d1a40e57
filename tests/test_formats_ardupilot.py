"""ArduPilot's DataFlash logs: a world written as the autopilot writes it is the same motion when it is read."""

import numpy as np
import pytest
from dataflash_files import dataflash_of, write

from undertow.measurements.log import read_log
from undertow.measurements.prepare import WEAK, prepare
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds import simulate_world


@pytest.fixture(scope="module")
def vehicle():
    return load_vehicle("blueboat_paper")


@pytest.fixture(scope="module")
def world(vehicle):
    return simulate_world(vehicle, {}, duration=60.0, noise="clean", seed=3)


@pytest.fixture(scope="module")
def expected(world, vehicle, tmp_path_factory):
    return prepare(read_log(world.write(tmp_path_factory.mktemp("csv") / "world.csv")), vehicle, WEAK).motions[0]


def close(motion, expected):
    """Equal to what the format can hold: 0.01 degrees, single precision, whole microseconds."""
    assert motion.time.size == expected.time.size
    heading = 0.5 * np.radians(0.01) + 1e-7
    fastest = np.abs(expected.velocity[:, :2]).max()
    assert np.abs(motion.position - expected.position).max() < 1e-5
    assert np.abs(motion.heading - expected.heading).max() < heading
    assert np.abs(motion.velocity[:, :2] - expected.velocity[:, :2]).max() < fastest * heading + 1e-6
    assert np.abs(motion.velocity[:, 2] - expected.velocity[:, 2]).max() < 1e-6
    assert np.abs(motion.commands - expected.commands).max() < 0.51


@pytest.fixture(scope="module")
def written(world, tmp_path_factory):
    return write(tmp_path_factory.mktemp("bin") / "00000012.BIN", dataflash_of(world))


def test_a_world_written_as_dataflash_is_the_same_motion(written, vehicle, expected):
    close(prepare(read_log(written), vehicle, WEAK).motions[0], expected)


def test_a_world_written_as_text_is_the_same_motion(world, vehicle, expected, tmp_path):
    path = write(tmp_path / "12.log", dataflash_of(world))
    close(prepare(read_log(path), vehicle, WEAK).motions[0], expected)
