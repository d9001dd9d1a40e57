"""A piece of a motion keeps the commands before it, and no more of them than lag and delay ask for."""

import numpy as np

from undertow.physics.motion import RUN_UP, Motion

STEP = 0.1


def motion(rows: int, before: int = 0) -> Motion:
    time = STEP * np.arange(rows, dtype=float)
    commands = np.arange(-before, rows, dtype=float)[:, None]
    return Motion(
        time=time,
        position=np.zeros((rows, 2)),
        heading=np.zeros(rows),
        velocity=np.zeros((rows, 3)),
        commands=commands[before:],
        thrusters=("port",),
        run_up=commands[:before] if before else None,
    )


def test_a_piece_keeps_the_last_commands_before_it():
    most = round(RUN_UP / STEP)
    for before, start in ((0, 50), (30, 50), (30, most - 10), (most, 20), (0, most + 40), (30, most + 40)):
        run_up = motion(1000, before).slice(start, start + 100).run_up
        assert run_up is not None
        first = max(start - most, -before)
        assert run_up[:, 0].tolist() == list(range(first, start))
    assert motion(1000).slice(0, 100).run_up is None


def test_a_piece_copies_none_of_a_long_log():
    long = motion(100_000, 200)
    run_up = long.slice(90_000, 91_000).run_up
    assert run_up is not None
    assert np.shares_memory(run_up, long.commands)
