"""Trials: fixed manoeuvres that a person is told to drive, in words and numbers, and that any vehicle can simulate.

They follow the ITTC's full scale trials (7.5-04-02-01) and free model tests (7.5-02-06-01) in kind: stopping,
reversing, zigzags, turning circles both ways at two speeds, and straight runs on four headings; all open loop.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi

import numpy as np

from ..forces import actuation
from ..integration import Around, Driven, integrate
from ..motion import Array, Motion
from ..vehicle import Vehicle
from .manoeuvres import COMMAND_STEP, hold, thruster_commands

Step = tuple[float, float, float]
"""Seconds, and the common and differential command, normalised to -1..1; positive turns to starboard."""
REST = 5.0
"""Seconds without thrust before and after: they show neutral and the sensors' bias, and let the boat come to rest."""


@dataclass(frozen=True, slots=True)
class Trial:
    """One trial, from rest.

    Attributes
    ----------
    name : stable name
    words : what to drive, with levels [% of full command] and durations, as an instruction
    steps : the same as numbers; commands are held
    headings : directions in which the steps are driven, each from rest, relative to the first [rad]
    """

    name: str
    words: str
    steps: tuple[Step, ...]
    headings: tuple[float, ...] = (0.0,)

    @property
    def seconds(self) -> float:
        """Length of the whole trial [s]."""
        return len(self.headings) * sum(step[0] for step in self.steps)

    @property
    def text(self) -> str:
        """The words with the length of the whole trial."""
        return f"{self.words} ({self.seconds:.0f} s in all)"


def _both_sides(*steps: Step) -> tuple[Step, ...]:
    return (*steps, *((seconds, common, -turn) for seconds, common, turn in steps))


def _swings(common: float, turn: float, period: float, count: int) -> tuple[Step, ...]:
    return (
        (4.0, common, 0.0),
        (0.5 * period, common, turn),
        *((period, common, turn * (-1.0) ** k) for k in range(1, count)),
        (0.5 * period, common, turn * (-1.0) ** count),
    )


TRIALS: tuple[Trial, ...] = (
    Trial(
        "acceleration_coast",
        "straight ahead from rest: full ahead for 10 s, coast for 8 s, 40 % ahead for 10 s, coast for 8 s, full ahead "
        "for 4 s, coast for 6 s",
        ((10.0, 1.0, 0.0), (8.0, 0.0, 0.0), (10.0, 0.4, 0.0), (8.0, 0.0, 0.0), (4.0, 1.0, 0.0), (6.0, 0.0, 0.0)),
    ),
    Trial(
        "speed_steps",
        "straight ahead in steps of speed: 25, 50, 75 and 100 % ahead for 10 s each, then coast for 8 s",
        (*((10.0, level, 0.0) for level in (0.25, 0.5, 0.75, 1.0)), (8.0, 0.0, 0.0)),
    ),
    Trial(
        "astern_run",
        "an astern run, straight: 50 % astern for 12 s, coast for 6 s, full astern for 12 s, coast for 8 s, 50 % ahead "
        "for 8 s",
        ((12.0, -0.5, 0.0), (6.0, 0.0, 0.0), (12.0, -1.0, 0.0), (8.0, 0.0, 0.0), (8.0, 0.5, 0.0)),
    ),
    Trial(
        "reversals",
        "thrust reversals, straight: 80 % ahead, 70 % astern, 40 % ahead, full astern, full ahead and 30 % astern, 7 s "
        "each",
        tuple((7.0, level, 0.0) for level in (0.8, -0.7, 0.4, -1.0, 1.0, -0.3)),
    ),
    Trial(
        "turns_astern",
        "turns astern: 60 % astern with 25 % differential thrust to starboard for 10 s, to port for 10 s, then the "
        "same at 90 % astern",
        (*_both_sides((10.0, -0.6, 0.25)), *_both_sides((10.0, -0.9, 0.25))),
    ),
    Trial(
        "zigzag_10",
        "a gentle zigzag (as a 10/10): 50 % ahead with 15 % differential thrust to one side and the other, 5 s each, "
        "eight swings",
        _swings(0.5, 0.15, 5.0, 8),
    ),
    Trial(
        "zigzag_20",
        "a hard zigzag (as a 20/20): 70 % ahead with 30 % differential thrust to one side and the other, 4 s each, "
        "ten swings",
        _swings(0.7, 0.3, 4.0, 10),
    ),
    Trial(
        "circles",
        "turning circles both ways at two speeds: 40 % ahead with 20 % differential thrust for 12 s to starboard and "
        "12 s to port, then 75 % ahead with 25 % for 12 s each",
        (*_both_sides((12.0, 0.4, 0.2)), *_both_sides((12.0, 0.75, 0.25))),
    ),
    Trial(
        "spin",
        "turning on the spot, one side ahead and one astern: 60 % differential thrust to starboard for 8 s, to port "
        "for 8 s, 25 % to starboard for 8 s, to port for 8 s, none for 6 s, full to starboard for 4 s, none for 6 s",
        (
            *_both_sides((8.0, 0.0, 0.6)),
            *_both_sides((8.0, 0.0, 0.25)),
            (6.0, 0.0, 0.0),
            (4.0, 0.0, 1.0),
            (6.0, 0.0, 0.0),
        ),
    ),
    Trial(
        "turn_and_coast",
        "hard turns into a coast: 80 % ahead with 20 % differential thrust for 6 s, then no thrust for 6 s, to "
        "starboard, to port, and both again at 40 %",
        (
            *_both_sides((6.0, 0.8, 0.2), (6.0, 0.0, 0.0)),
            *_both_sides((6.0, 0.4, 0.2), (6.0, 0.0, 0.0)),
        ),
    ),
    Trial(
        "small_steps",
        "slow steps of small commands through zero: 4, 8, 12, 16, 20 and 25 % ahead and astern by turns, 4 s each",
        tuple((4.0, sign * level, 0.0) for level in (0.04, 0.08, 0.12, 0.16, 0.2, 0.25) for sign in (1.0, -1.0)),
    ),
    Trial(
        "sharp_steps",
        "sharp steps of the command: 70 % ahead for 2 s, none for 2 s, 40 % astern for 2 s, none for 2 s, six times",
        6 * ((2.0, 0.7, 0.0), (2.0, 0.0, 0.0), (2.0, -0.4, 0.0), (2.0, 0.0, 0.0)),
    ),
    Trial(
        "one_side",
        "one side at a time: port alone at 60 % ahead for 8 s, starboard alone for 8 s, port alone at 40 % astern for "
        "8 s, starboard alone for 8 s, both at 50 % ahead for 8 s",
        ((8.0, 0.3, 0.3), (8.0, 0.3, -0.3), (8.0, -0.2, -0.2), (8.0, -0.2, 0.2), (8.0, 0.5, 0.0)),
    ),
    Trial(
        "four_headings",
        "straight runs on four headings, 90 degrees apart, each from rest: 60 % ahead for 10 s, then coast for 5 s",
        ((10.0, 0.6, 0.0), (5.0, 0.0, 0.0)),
        (0.0, 0.5 * pi, pi, 1.5 * pi),
    ),
)
"""Every trial, from the simplest to the most laborious."""


def in_words(steps: Sequence[Step]) -> str:
    """Steps as an instruction.

    >>> in_words([(4.0, 0.6, -0.25), (2.5, 0.0, 0.0), (3.0, 0.0, 1.0)])
    '60 % ahead with 25 % differential thrust to port for 4 s, no thrust for 2.5 s, turning to starboard on the spot \
with 100 % for 3 s'
    """
    return ", ".join(f"{_level(common, turn)} for {seconds:g} s" for seconds, common, turn in steps)


def _level(common: float, turn: float) -> str:
    side = "starboard" if turn > 0.0 else "port"
    if not common:
        return f"turning to {side} on the spot with {100.0 * abs(turn):.0f} %" if turn else "no thrust"
    straight = f"{100.0 * abs(common):.0f} % {'ahead' if common > 0.0 else 'astern'}"
    return f"{straight} with {100.0 * abs(turn):.0f} % differential thrust to {side}" if turn else straight


def drive(
    vehicle: Vehicle, trials: Sequence[Trial] = TRIALS, heading: float = 0.0, minutes: float = 0.0
) -> tuple[tuple[Motion, ...], ...]:
    """Simulate trials from rest, all at once, in steps of 0.1 s.

    Thrusters that push sideways rest. A run that diverges is left out.

    Parameters
    ----------
    heading : of the first run of each trial [rad]
    minutes : after the beginning of a log at which all of them are driven

    Returns
    -------
    for each trial its motions, one a heading
    """
    runs = [(k, turn) for k, trial in enumerate(trials) for turn in trial.headings]
    rows = [1 + round(sum(step[0] for step in trial.steps) / COMMAND_STEP) for trial in trials]
    longest = max(rows)
    names = tuple(t.name for t in vehicle.thrusters)
    time = COMMAND_STEP * np.arange(longest, dtype=float)
    still: list[Motion] = []
    for trial in trials:
        level = _padded(hold(*trial.steps), longest)
        commands = thruster_commands(vehicle, level[:, 0], level[:, 1])
        rest = np.zeros((longest, 3))
        name, now = f"rehearsed: {trial.name}", np.full(longest, minutes)
        still.append(Motion(time, rest[:, :2], rest[:, 0], rest, commands, names, name, minutes=now))
    forces = [actuation(vehicle, motion) for motion in still]
    thrust = np.stack([forces[k].thrust for k, _ in runs], axis=-1)
    load = np.stack([forces[k].load for k, _ in runs], axis=-1)
    initial = np.zeros((len(runs), 6))
    initial[:, 2] = [heading + turn for _, turn in runs]
    with np.errstate(over="ignore", invalid="ignore"):
        result = integrate(Driven(vehicle, initial, thrust, load, around=Around(None, minutes)), COMMAND_STEP)
    driven: list[list[Motion]] = [[] for _ in trials]
    for (k, _), states, diverged in zip(runs, result.states, result.diverged, strict=True):
        if not diverged:
            whole = replace(
                still[k], position=states[:, :2].copy(), heading=states[:, 2].copy(), velocity=states[:, 3:].copy()
            )
            driven[k].append(whole.slice(0, rows[k]))
    return tuple(map(tuple, driven))


def _padded(series: Array, rows: int) -> Array:
    return np.concatenate([series, np.tile(series[-1], (rows - len(series), 1))])
