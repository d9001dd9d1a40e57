"""A world, the motion that its log is, and how near another log of it comes."""

from functools import cache
from pathlib import Path

import numpy as np

from undertow.measurements.log import read_log
from undertow.measurements.preparation.prepare import WEAK, prepare
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.world import SimulatedLog, simulate_world


@cache
def vehicle() -> Vehicle:
    return load_vehicle("blueboat_paper")


@cache
def world(duration: float = 60.0) -> SimulatedLog:
    """A boat with pulses as commands, that turns through north."""
    return simulate_world(vehicle(), {}, duration=duration, noise="clean", seed=3)


def motion_of(path: Path) -> Motion:
    """The one motion of a log."""
    (motion,) = prepare(read_log(path), vehicle(), WEAK).motions
    return motion


def expected(folder: Path) -> Motion:
    """The motion of the world by way of a long CSV."""
    return motion_of(world().write(folder / "world.csv"))


def assert_equal(
    motion: Motion, other: Motion, *, position: float, heading: float, speed: float, rate: float, command: float
) -> None:
    """Compare two motions of one world, whose clocks begin at different instants, within limits in SI units and us."""
    assert motion.time.size == other.time.size
    assert np.ptp((motion.time - motion.time[0]) - (other.time - other.time[0])) < 1e-9
    assert np.abs(motion.position - other.position).max() < position
    assert np.abs(motion.heading - other.heading).max() < heading
    assert np.abs(motion.velocity[:, :2] - other.velocity[:, :2]).max() < speed
    assert np.abs(motion.velocity[:, 2] - other.velocity[:, 2]).max() < rate
    assert np.abs(motion.commands - other.commands).max() < command
