"""What a world's log must be, however it was written: for the tests of the formats."""

from pathlib import Path

import numpy as np

from undertow.measurements.canonical import Channel
from undertow.measurements.log import Log
from undertow.measurements.preparation.prepare import WEAK, prepare
from undertow.physics.worlds.world import SimulatedLog


def without_a_file(world: SimulatedLog) -> Log:
    """The log as the world has it, on the time axis of a bag, whose first message is at 0."""
    first = min(world.odometry_time[0], world.command_time[0])

    def channel(name, time, value):
        return Channel(name, (np.round(1e9 * time) - round(1e9 * float(first))) / 1e9, value.copy(), name)

    odometry = zip(("x", "y", "psi", "u", "v", "r"), world.odometry.T, strict=True)
    commands = zip((thruster.channel for thruster in world.vehicle.thrusters), world.commands.T, strict=True)
    channels = {name: channel(name, world.odometry_time, value) for name, value in odometry}
    return Log(Path("truth"), channels | {name: channel(name, world.command_time, value) for name, value in commands})


def assert_same_motion(log: Log, truth: Log, world: SimulatedLog) -> None:
    """Both logs prepare to one and the same motion."""
    found, expected = (prepare(each, world.vehicle, WEAK).motions for each in (log, truth))
    assert len(found) == len(expected) == 1
    for name in ("time", "position", "velocity", "commands"):
        np.testing.assert_allclose(getattr(found[0], name), getattr(expected[0], name), rtol=0, atol=1e-8)
    turned = found[0].heading - expected[0].heading
    np.testing.assert_allclose(np.exp(1j * turned), 1.0, atol=1e-8)


def note(log: Log, *parts: str) -> str:
    """The one note of a log that holds all these words."""
    found = [text for text in log.notes if all(part in text for part in parts)]
    assert len(found) == 1, log.notes
    return found[0]
