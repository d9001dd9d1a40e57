"""Manoeuvres: command programmes that excite every regime of any vehicle with thrusters.

A manoeuvre is a pair of normalised series at 10 Hz: the *common* command of both sides and the *differential* one
(positive turns to starboard). `programme` strings them together as commands of a vehicle's thrusters. Zigzags and
circles follow the ITTC manoeuvres (7.5-02-06-01) in kind, open loop.
"""

from collections.abc import Callable
from difflib import get_close_matches

import numpy as np

from ..errors import RequestError
from ..motion import Array
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
        near = get_close_matches(name, PROGRAMMES, n=1, cutoff=0.0)
        raise RequestError(f"unknown programme {name!r}: did you mean {near[0]!r}? There are: {', '.join(PROGRAMMES)}")
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
