"""Bounded speed: bounded thrust makes bounded motion, and not a much faster one than that thrust can give.

It is seen in a trial: extremes held and random commands, met from rest; and how fast a vehicle goes in it.
"""

from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from typing import ClassVar, final

import numpy as np

from ...batch_rates import Flattened, Terms
from ...forces import calm, held_thrust
from ...integration import Answer, Rollouts, integrate_stiff
from ...momentum_balance import mass_matrix
from ...motion import Array, Motion
from ...thrusters import command_of
from ...vehicle import Vehicle
from ..damping_power import Envelope, envelope_of, mass_margin
from ..energy import coasting_power, full_force
from .base import EXACT, Law, Ruling, Witness, finite

SECONDS = 60.0
"""Shortest trial [s]; four times as long, and again, where a vehicle's speeds take longer to settle."""
STEPS = 600
"""Steps of a trial, whatever its length: 0.1 s in the shortest, as logs are prepared."""
_LONGER, _LONGEST = 4.0, 5
"""Factor between the lengths that are tried, and their number: the last is 4 hours, enough for any ship."""
FASTEST = 1e5
"""Speed [m/s] and yaw rate [rad/s] beyond which a trial has diverged; a toy spins at some thousands."""
_HOLDS = (20, 80)
"""Random commands last between these steps: 2 to 8 s in 60."""
_RANDOM = 24
"""Trials with random commands: of 5 s each on average, they meet some 290 in the shortest trial."""
_LEVELS = 5
"""Levels of each thruster: none, half and full, ahead and astern."""
_MOST = 2000
"""Commands of all thrusters together: all levels of up to four, and as many drawn where there are more."""
_SETTLED, _SLOWING = 0.02, 0.9
"""Held speeds settle where the last third of a trial tops the rest by less than this share of the largest, or of what
the middle third added: what nothing brakes adds as much in each third, and what settles ever less."""
_NOTHING = 1e-6
"""Speed [m/s] and yaw rate [rad/s] that are rounding, which a hull that does not hold its course lets grow."""
_BEGINNING = 3.0
"""Time [s] of full thrust on a hull that nothing stops which gives its envelope: it has no speed of its own."""


def possible_commands(vehicle: Vehicle, seed: int = 0) -> Array:
    """Commands of all thrusters together (m, thrusters), from full astern to full ahead."""
    count = len(vehicle.thrusters)
    levels = np.linspace(-1.0, 1.0, _LEVELS)
    if _LEVELS**count <= _MOST:
        fractions = np.array(list(product(levels, repeat=count)))
    else:
        fractions = np.random.default_rng([seed, 9]).choice(levels, size=(_MOST, count))
    return np.column_stack([command_of(t, fractions[:, k]) for k, t in enumerate(vehicle.thrusters)])


def trial_commands(pool: Array, seed: int) -> tuple[Array, int]:
    """Commands (starts, STEPS + 1, thrusters) that are met from rest: extremes of a pool held, then random ones.

    Returns
    -------
    (commands, held)
        the first `held` of them are one command that lasts
    """
    rng = np.random.default_rng([seed, 3])
    extremes = np.stack([pool[int(np.argmax(pool @ side))] for side in _sides(pool.shape[1])])
    held = np.repeat(extremes[:, None], STEPS + 1, axis=1)
    lengths = rng.integers(*_HOLDS, (_RANDOM, STEPS // _HOLDS[0] + 2)).cumsum(axis=1)
    chosen = rng.integers(0, pool.shape[0], lengths.shape)
    rows = [chosen[k, np.searchsorted(lengths[k], np.arange(STEPS + 1), side="right")] for k in range(_RANDOM)]
    return np.concatenate([held, pool[np.stack(rows)]]), held.shape[0]


def trial_motion(vehicle: Vehicle, commands: Array, time_step: float) -> tuple[Motion, np.ndarray]:
    """The same as one motion at rest, for models that are rolled out along a motion, and the rows to start from.

    Parameters
    ----------
    vehicle : whose commands they are
    commands : (trials, rows, thrusters), each in its unit
    time_step : [s]
    """
    count, rows, _ = commands.shape
    names = tuple(t.name for t in vehicle.thrusters)
    motion = Motion.at_rest(time_step, commands.reshape(count * rows, -1), names, "trial")
    return replace(motion, minutes=np.zeros(count * rows)), np.arange(count) * rows


def rolled(answer: Answer, commands: Array, seconds: float) -> Rollouts:
    """Rollouts from rest, heading north, under every other command of a trial that lasts so long [s].

    Parameters
    ----------
    answer : acceleration of a model from velocity, heading and a row of the commands
    commands : (trials, rows, k), whatever `answer` takes
    seconds : of a rollout [s]
    """
    chosen = commands[:, ::2]
    h = seconds / (chosen.shape[1] - 1)
    with np.errstate(over="ignore", invalid="ignore"):
        return integrate_stiff(answer, np.zeros((chosen.shape[0], 6)), chosen, h, FASTEST)


@dataclass(frozen=True, slots=True, eq=False)
class Settling:
    """Speeds of a vehicle in a trial in calm water.

    Attributes
    ----------
    seconds : length of the trial in which held speeds settle; of the longest one, where they do not [s]
    settles : whether they do
    speed, turning : largest speed [m/s] and yaw rate [rad/s]
    velocity : of all rollouts (starts, rows, 3); held commands for `seconds`, random ones for 60 s
    """

    seconds: float
    settles: bool
    speed: float
    turning: float
    velocity: Array


def settling(vehicle: Vehicle, pool: Array, seed: int = 0) -> Settling:
    """Roll a vehicle out under extreme and random commands, the former until its speeds settle, if they do.

    Parameters
    ----------
    vehicle : that is rolled out
    pool : commands (n, thrusters)
    seed : of the random ones
    """
    commands, held = trial_commands(pool, seed)
    terms = Terms(calm(vehicle))
    rates = cache(lambda batch: Flattened([(terms, batch)], placed=False))  # a batch of each size has its own
    both = (each.reshape(-1, *commands.shape[:2]) for each in held_thrust(vehicle, commands.reshape(-1, pool.shape[1])))
    thrust = np.concatenate([terms.accelerations(each) for each in both]).transpose(1, 2, 0)

    def answer(nu: Array, psi: Array, pushed: Array) -> Array:
        state = np.vstack([np.zeros((2, psi.size)), psi, nu.T, nu.T[1:]])  # a wake that has settled
        return rates(psi.size)(state, (pushed[:, :3].T, pushed[:, 3:].T, None, 0.0))[3:6].T

    done, seconds = rolled(answer, thrust, SECONDS), SECONDS
    random, done = (Rollouts(done.states[rows], done.diverged[rows]) for rows in (slice(held, None), slice(held)))
    for _ in range(_LONGEST):
        settles = not done.diverged.any() and _settles(done.states[..., 3:])
        if settles or done.diverged.any():
            break
        seconds *= _LONGER
        done = rolled(answer, thrust[:held], seconds)
    velocity = np.concatenate([done.states[..., 3:], random.states[..., 3:]])
    # Random commands may drive a hull of faint damping beyond all speeds; whether it is braked, the held ones tell.
    speed = float(np.linalg.norm(velocity[..., :2], axis=-1).max())
    return Settling(seconds, settles, speed, float(np.abs(velocity[..., 2]).max()), velocity)


def reachable(vehicle: Vehicle, pool: Array) -> tuple[Envelope, str]:
    """The envelope of velocities that a vehicle reaches in calm water under a pool of commands, and how it was found.

    A hull that nothing stops has no speeds of its own: then full thrust acts for a moment. One without a positive mass
    does not move as anything does: then the box is one unit wide.

    Parameters
    ----------
    vehicle : that is rolled out
    pool : commands (n, thrusters)
    """
    if mass_margin(vehicle) <= 0.0:
        return Envelope((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0)), "a box of one unit, as its mass is that of no vehicle"
    found = settling(vehicle, pool)
    velocity, source = found.velocity.reshape(-1, 3), "the speeds that the vehicle reaches with its thrusters"
    if not found.settles:
        most = _BEGINNING * full_force(vehicle) / np.diag(mass_matrix(vehicle))
        velocity = np.stack([most, -most])
        source = f"{_BEGINNING:g} s of full thrust, as the vehicle's speeds grow without bound"
    names = tuple(t.name for t in vehicle.thrusters)
    run = Motion.at_rest(1.0, np.zeros((len(velocity), len(names))), names)
    return envelope_of([replace(run, velocity=velocity)], calm(vehicle)), source


def _settles(velocity: Array) -> bool:
    """True when the speeds and yaw rates of held commands (n, rows, 3) have settled in the last third."""
    for size in (np.linalg.norm(velocity[..., :2], axis=-1), np.abs(velocity[..., 2])):
        third = size.shape[1] // 3
        early, late, last = (size[:, : k * third + 1].max(axis=1) for k in (1, 2, 3))
        few = _SETTLED * size.max(axis=1) + _NOTHING
        if (last - late > np.maximum(few, _SLOWING * (late - early))).any():
            return False
    return True


def _sides(count: int) -> list[Array]:
    """Directions among commands in which extremes are sought: all ahead, all astern, each against the rest."""
    alone = 2.0 * np.eye(count) - 1.0 if count > 1 else ()
    return [np.ones(count), -np.ones(count), *alone]


MOST = 3.0
"""Multiple of the speed and yaw rate in question that no rollout may exceed: drag that grows linearly lets a thrust
that is three times too strong reach it, and no thruster is that."""
_FAR = 1e3
"""Multiple of the envelope at which drag must have outgrown thrust: what does not brake there never does."""
_PATIENCE = 4.0
"""Multiple of the time in which the vehicle file settles for which a function is rolled out: what nothing brakes then
goes far beyond what settles."""


@final
class BoundedSpeed(Law):
    """Open-loop rollouts from rest under held and random commands stay within three times what can be expected.

    That is the speed of the envelope or, where faster, the speed at which the vehicle file settles in the same trial:
    a log may be slow. A vehicle whose own speeds do not settle tells nothing, then the envelope alone does; and of a
    formula, which is its vehicle file, just that is asked. Speed through the water and yaw rate are judged, not sway
    alone, which in a log may hardly move. A trial lasts 60 s or, for a slow ship, as long as its speeds need to settle.
    """

    name: ClassVar[str] = "bounded speed"
    place: ClassVar[int] = 70

    def judge(self, witness: Witness) -> Ruling:
        """See `Law.judge`."""
        expected = settling(witness.vehicle, witness.commands, witness.seed)
        commands, held = trial_commands(witness.commands, witness.seed)
        fastest, quickest, source = float(np.hypot(*witness.reach[:2])), float(witness.reach[2]), "the envelope"
        if expected.settles and (expected.speed > fastest or expected.turning > quickest):
            fastest, quickest = max(fastest, expected.speed), max(quickest, expected.turning)
            source = "the envelope and the vehicle file under the same commands"
        if witness.exact:
            seconds, velocity = expected.seconds, expected.velocity
            wild = np.full(commands.shape[0], not expected.settles or _unbraked(witness, commands[:held, 0]))
        else:
            seconds = _PATIENCE * expected.seconds if expected.settles else SECONDS
            if witness.rollout is not None:
                seconds = STEPS * witness.time_step
            velocity, wild = _met(witness, commands, held, seconds)
        speed = np.linalg.norm(velocity[..., :2], axis=-1).max(axis=1)
        turning = np.abs(velocity[..., 2]).max(axis=1)
        ratio = np.maximum(speed / fastest, turning / quickest)
        ratio = np.where(wild | ~np.isfinite(ratio), np.inf, ratio)
        k = int(np.argmax(ratio))
        worst = finite(float(ratio[k]))
        which = "held commands" if k < held else "random commands"
        last = velocity[k, -1]
        at = {"u": float(last[0]), "v": float(last[1]), "r": float(last[2])}
        seen = f"{ratio.size} rollouts of {seconds:g} s"
        if seconds > SECONDS and witness.rollout is None:
            seen = f"{held} rollouts of {seconds:g} s and {ratio.size - held} of {SECONDS:g} s"
        much = f"the boat goes {worst:.2g} times as fast as {source}"
        if np.isinf(ratio).any():
            much = "speeds grow without bound"
        most = f"{float(speed.max()):.3g} m/s and {float(turning.max()):.3g} rad/s"
        compared = f"{max(worst, 0.0):.2g} times as fast as {source}, where {MOST:g} times are let pass"
        if witness.exact and expected.settles:
            compared = "and its speeds settle under commands that are held"
        return self.rule(
            value=worst,
            limit=MOST,
            unit="times the expected",
            at=at,
            share=float((ratio > MOST).mean()),
            kept=f"In {seen} under bounded thrust the boat reaches {most}, {compared}.",
            broken=f"Under {which} {much} ({int((ratio > MOST).sum())} of {seen}; {MOST:g} times are let pass).",
        )


def _unbraked(witness: Witness, commands: Array) -> bool:
    """True when motion along some axis, far faster than the envelope, still gains power under a command that lasts.

    A rollout need not tell: rounding lets a hull leave a straight course long before its speed is out of bounds.
    """
    sides = np.concatenate([np.diag(witness.reach), -np.diag(witness.reach)]) * _FAR
    states = np.repeat(np.pad(sides, ((0, 0), (0, 1))), len(commands), axis=0)
    gained = coasting_power(witness.mass, states[:, :3], witness.relative(states, np.tile(commands, (len(sides), 1))))
    return bool((gained > EXACT * witness.full_power(states)).any())


def _met(witness: Witness, commands: Array, held: int, seconds: float) -> tuple[Array, np.ndarray]:
    """Velocities relative to the water (starts, rows, 3) under the commands of a trial, and which starts diverge."""
    if witness.rollout is not None:  # a network knows one rate
        motion, starts = trial_motion(witness.vehicle, commands, witness.time_step)
        done = witness.rollout(motion, starts, commands.shape[1] - 1)
        p = witness.vehicle.values
        drift = float(np.hypot(p["current_north"], p["current_east"]))
        velocity = done.states[..., 3:].copy()
        speed = np.linalg.norm(velocity[..., :2], axis=-1, keepdims=True)
        velocity[..., :2] *= np.maximum(speed - drift, 0.0) / np.maximum(speed, 1e-12)
        return velocity, done.diverged

    def answer(nu: Array, psi: Array, asked: Array) -> Array:
        return witness.relative(np.column_stack([nu, psi]), asked)

    lasting, random = rolled(answer, commands[:held], seconds), rolled(answer, commands[held:], SECONDS)
    velocity = np.concatenate([lasting.states[..., 3:], random.states[..., 3:]])
    return velocity, np.concatenate([lasting.diverged, random.diverged])
