"""Manoeuvres: command programmes that excite every regime of any vehicle with thrusters, and trials for a person.

A manoeuvre is a pair of normalised series at 10 Hz: the *common* command of both sides and the *differential* one
(positive turns to starboard). `programme` strings them together as commands of a vehicle's thrusters. Zigzags and
circles follow the ITTC manoeuvres (7.5-02-06-01) in kind, open loop. Trials are fixed manoeuvres that a person is told
to drive, in words and numbers, and that any vehicle can simulate. They follow the ITTC's full scale trials
(7.5-04-02-01) and free model tests (7.5-02-06-01) in kind: stopping, reversing, zigzags, turning circles both ways at
two speeds, and straight runs on four headings; all open loop.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import pi

import numpy as np

from ..errors import RequestError, nearest
from ..forces import actuation
from ..integration import Around, Driven, integrate
from ..motion import Array, Motion
from ..thrusters import Thruster, command_of
from ..vehicle import Vehicle

COMMAND_STEP = 0.1
"""Step of the command grid [s]; a command is held until the next one, as controllers at 10 Hz do."""

Manoeuvre = Callable[[np.random.Generator], Array]
"""Draws one manoeuvre: (m, 2) common and differential command, normalised to -1..1, 10 Hz."""


def hold(*steps: tuple[float, float, float]) -> Array:
    """(seconds, common, differential) steps as a series (m, 2) at 10 Hz."""
    return np.concatenate([np.tile([common, turn], (max(1, round(s / COMMAND_STEP)), 1)) for s, common, turn in steps])


def _acceleration_coast(rng: np.random.Generator) -> Array:
    return hold((8.0, 1.0, 0.0), (7.0, 0.0, 0.0), (5.0, rng.uniform(0.3, 0.7), 0.0), (4.0, 0.0, 0.0))


def _astern_run(rng: np.random.Generator) -> Array:
    turn = rng.choice([-1.0, 1.0]) * 0.3
    return hold((5.0, -1.0, 0.0), (4.0, -rng.uniform(0.3, 0.6), turn), (3.0, 0.0, 0.0))


def _zigzag(common: float, turn: float, period: float, swings: int) -> Manoeuvre:
    def draw(rng: np.random.Generator) -> Array:
        side = rng.choice([-1.0, 1.0])
        steps = [(period, common, side * turn * (-1.0) ** k) for k in range(swings)]
        return hold((3.0, common, 0.0), (0.5 * period, common, -side * turn), *steps)

    return draw


def _circle(common: float, turn: float) -> Manoeuvre:
    def draw(rng: np.random.Generator) -> Array:
        return hold((2.0, common, 0.0), (rng.uniform(8.0, 11.0), common, turn))

    return draw


def _reversals(rng: np.random.Generator) -> Array:
    turn = rng.uniform(-0.15, 0.15)
    levels = (0.8, -0.7, 0.4, -1.0, 1.0, -0.3)
    return hold(*((rng.uniform(2.5, 4.0), level, turn) for level in levels))


def _spin(rng: np.random.Generator) -> Array:
    side = rng.choice([-1.0, 1.0])
    return hold((5.0, 0.0, 0.6 * side), (5.0, 0.0, -0.35 * side), (2.0, 0.0, 0.0), (3.0, 0.0, side))


def _random_steps(rng: np.random.Generator) -> Array:
    return hold(*((rng.uniform(1.0, 3.5), rng.uniform(-0.6, 1.0), rng.uniform(-0.5, 0.5)) for _ in range(11)))


def _small_steps(rng: np.random.Generator) -> Array:
    levels = rng.permutation([0.04, -0.06, 0.09, -0.12, 0.15, -0.2, 0.25])
    return hold(*((2.5, level * rng.uniform(0.5, 1.0), 0.5 * level * rng.choice([-1.0, 1.0])) for level in levels))


def _one_side(rng: np.random.Generator) -> Array:
    a, b = 0.5 * rng.uniform(0.5, 1.0, 2)
    return hold((5.0, a, a), (5.0, b, -b), (2.5, -0.4, -0.4), (2.5, -0.4, 0.4))


def _legs(rng: np.random.Generator) -> Array:
    speeds, turns = rng.uniform(0.35, 0.9, 4), rng.choice([-1.0, 1.0], 4) * rng.uniform(0.25, 0.45, 4)
    return hold(*(leg for c, d in zip(speeds, turns, strict=True) for leg in ((5.0, c, 0.0), (2.5, 0.6 * c, d))))


def _sweep(rng: np.random.Generator) -> Array:
    time = np.arange(0.0, 40.0, COMMAND_STEP)
    periods, phases = rng.uniform((14.0, 8.0), (30.0, 16.0)), rng.uniform(0.0, 2.0 * np.pi, 2)
    middle, swing = rng.uniform(0.3, 0.45), rng.uniform(0.08, 0.18)
    common = middle + swing * np.sin(2.0 * np.pi * time / periods[0] + phases[0])
    return np.column_stack([common, 0.1 * np.sin(2.0 * np.pi * time / periods[1] + phases[1])])


def _small_turns(rng: np.random.Generator) -> Array:
    return hold(*((rng.uniform(4.0, 7.0), rng.uniform(0.25, 0.5), rng.uniform(-0.12, 0.12)) for _ in range(5)))


MANOEUVRES: dict[str, Manoeuvre] = {
    "acceleration_coast": _acceleration_coast,
    "astern_run": _astern_run,
    "zigzag_10": _zigzag(0.5, 0.15, 3.0, 6),
    "zigzag_20": _zigzag(0.6, 0.35, 4.0, 5),
    "zigzag_20_fast": _zigzag(0.85, 0.3, 3.5, 5),
    "circle_port_slow": _circle(0.35, -0.2),
    "circle_starboard_slow": _circle(0.35, 0.2),
    "circle_port_fast": _circle(0.75, -0.3),
    "circle_starboard_fast": _circle(0.75, 0.3),
    "reversals": _reversals,
    "spin": _spin,
    "random_steps": _random_steps,
    "small_steps": _small_steps,
    "one_side": _one_side,
    "legs": _legs,
    "sweep": _sweep,
    "small_turns": _small_turns,
}
"""Every manoeuvre by name."""

PROGRAMMES: dict[str, tuple[str, ...]] = {
    "rich": tuple(name for name in MANOEUVRES if name not in ("sweep", "small_turns")),
    "zigzag": ("zigzag_10", "zigzag_20", "zigzag_20_fast"),
    "gentle": ("sweep", "small_turns"),
}
"""Every programme by name: the manoeuvres that it mixes, in an order drawn by the seed."""


def draw_programme(name: str, duration: float, rng: np.random.Generator) -> Array:
    """Draw a programme's common and differential command, normalised, (ceil(10 duration) + 1, 2), at 10 Hz.

    It begins with one second of rest; all its manoeuvres come once, in random order, before any comes again.

    Parameters
    ----------
    name : of the programme
    duration : [s]
    rng : of the draws

    Raises
    ------
    RequestError
        for an unknown programme, naming the nearest, or a duration that is not positive.
    """
    if name not in PROGRAMMES:
        near = nearest(name, PROGRAMMES)
        raise RequestError(f"unknown programme {name!r}: did you mean {near!r}? There are: {', '.join(PROGRAMMES)}")
    if not 0.0 < duration < np.inf:
        raise RequestError(f"programme {name!r}: the duration must be a positive number of seconds, got {duration:g}")
    rows = int(np.ceil(duration / COMMAND_STEP - 1e-9)) + 1
    pieces, length = [hold((1.0, 0.0, 0.0))], round(1.0 / COMMAND_STEP)
    while length < rows:
        for k in rng.permutation(len(PROGRAMMES[name])):
            pieces.append(MANOEUVRES[PROGRAMMES[name][k]](rng))
            length += len(pieces[-1])
    return np.concatenate(pieces)[:rows]


def side(thruster: Thruster) -> int:
    """Side of a thruster in a pair: -1 port, 1 starboard, 0 neither (on the centre line, or pushing sideways)."""
    return 0 if abs(thruster.push[0]) < 0.5 else int(np.sign(thruster.y))


def programme(vehicle: Vehicle, name: str = "rich", duration: float = 300.0, seed: int = 0) -> Array:
    """Commands of a vehicle's thrusters along a programme, on the 10 Hz grid, each held until the next.

    Port and starboard thrusters take the common command plus and minus the differential one; a thruster on the centre
    line that pushes ahead takes the common one, one that pushes sideways small random steps of its own.

    Parameters
    ----------
    name : `rich`, `zigzag` or `gentle`
    duration : [s]

    Returns
    -------
    (ceil(10 duration) + 1, thrusters) in each thruster's command unit

    Raises
    ------
    RequestError
        for an unknown programme or a duration that is not positive.
    """
    rng = np.random.default_rng([seed, 1])
    common, turn = draw_programme(name, duration, rng).T

    def small_steps() -> Array:
        return np.repeat(rng.choice([-0.3, -0.15, 0.0, 0.0, 0.15, 0.3], common.size // 30 + 1), 30)[: common.size]

    return thruster_commands(vehicle, common, turn, small_steps)


def thruster_commands(
    vehicle: Vehicle, common: Array, turn: Array, sideways: Callable[[], Array] | None = None
) -> Array:
    """Commands of a vehicle's thrusters from a common and a differential command, both normalised, (n,).

    Parameters
    ----------
    sideways : gives the normalised command (n,) of each thruster that pushes sideways; without it they rest

    Returns
    -------
    (n, thrusters) in each thruster's command unit
    """
    columns = []
    for thruster in vehicle.thrusters:
        ahead, aside, _ = thruster.push
        if side(thruster):
            fraction = np.sign(ahead) * (common - side(thruster) * turn)
        elif abs(ahead) >= 0.5:
            fraction = np.sign(ahead) * common
        elif not ahead and not aside:
            fraction = turn  # a moment
        else:
            fraction = np.zeros_like(common) if sideways is None else sideways()
        columns.append(command_of(thruster, np.clip(fraction, -1.0, 1.0)))
    return np.column_stack(columns)


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
    still: list[Motion] = []
    for trial in trials:
        steps = hold(*trial.steps)
        level = np.pad(steps, ((0, longest - len(steps)), (0, 0)), mode="edge")
        commands = thruster_commands(vehicle, level[:, 0], level[:, 1])
        start = Motion.at_rest(COMMAND_STEP, commands, names, f"rehearsed: {trial.name}")
        still.append(replace(start, minutes=np.full(longest, minutes)))
    forces = [actuation(vehicle, motion) for motion in still]
    thrust = np.stack([forces[k].thrust for k, _ in runs], axis=-1)
    load = np.stack([forces[k].load for k, _ in runs], axis=-1)
    initial = np.zeros((len(runs), 6))
    initial[:, 2] = [heading + turn for _, turn in runs]
    result = integrate(Driven(vehicle, initial, thrust, load, around=Around(None, minutes)), COMMAND_STEP)
    driven: list[list[Motion]] = [[] for _ in trials]
    for (k, _), states, diverged in zip(runs, result.states, result.diverged, strict=True):
        if not diverged:
            whole = replace(
                still[k], position=states[:, :2].copy(), heading=states[:, 2].copy(), velocity=states[:, 3:].copy()
            )
            driven[k].append(whole.slice(0, rows[k]))
    return tuple(map(tuple, driven))
