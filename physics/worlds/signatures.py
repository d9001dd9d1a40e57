"""Signatures of effects: the force that a typical amount makes, where it shows, and what looks like it."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ..effects import EFFECTS, Effect, effect_named
from ..errors import RequestError
from ..forces import modelled_acceleration
from ..momentum_balance import mass_matrix
from ..motion import AXES, Array, Motion
from ..sampled_series import explained_share
from ..vehicle import Vehicle, hull_of
from .hidden_effects import WIND, apply_effects, commanded_motion, typical_effect, with_hull
from .manoeuvres import COMMAND_STEP, TRIALS, Trial, drive, programme

ALIKE = 0.9
"""Cosine between the forces of two effects along gentle driving from which one may be taken for the other."""
_ORDINARY = 240.0
"""Length of the gentle driving in which look-alikes are sought [s]."""
_MINUTES = (0.0, 5.0)
"""When each trial is driven after the beginning of a log: what changes by the minute shows between the two."""
_CONSTANT = 0.05
"""Scatter of a force over its root mean square below which it is constant, and no signal tells anything of it."""
_SIGNALS = ("u", "v", "r", "command", "steering", "du/dt", "dr/dt", "heading")


@dataclass(frozen=True, slots=True, eq=False)
class Signature:
    """An effect on a vehicle.

    Attributes
    ----------
    effect : of the catalogue
    amount : a typical amount of it by symbol, as `simulate --effect` takes it
    trial : the manoeuvre in which it shows most clearly apart from every other effect
    axis : on which its force is largest in comparison with the vehicle's own in all trials: 0 surge, 1 sway, 2 yaw
    size : root mean square of its force on that axis there [N, N m]
    apart : share of its force there that the effect most like it does not make
    alike : effects that make nearly the same force along gentle driving, each with the cosine between the two
    time : of the trial's runs, one after the other (n,) [s]
    force : of the effect on that axis (n,) [N, N m]
    assumed : what of the vehicle was assumed since its file does not state it; empty where nothing was
    signal, values : the quantity that tells most of the force, and its values (n,); "time" for a constant force
    """

    effect: Effect
    amount: dict[str, float]
    trial: Trial
    axis: int
    size: float
    apart: float
    alike: tuple[tuple[str, float], ...]
    time: Array
    force: Array
    signal: str
    values: Array
    assumed: str = ""

    @property
    def axis_name(self) -> str:
        """The axis in words."""
        return AXES[self.axis]


@dataclass(frozen=True, slots=True, eq=False)
class _Run:
    """Motions, the force of the vehicle along them (n, 3), and that of each effect by name."""

    motions: tuple[Motion, ...]
    force: Array
    effects: dict[str, Array]


def signatures(vehicle: Vehicle, names: Sequence[str] = ()) -> tuple[Signature, ...]:
    """Typical amounts of effects on a vehicle, where each shows, and what it may be taken for.

    The force of an effect is what it adds to the force equation along the motion of the vehicle without it. Effects are
    compared by the cosine between their forces on all axes, each axis in proportion to the vehicle's own force there.
    A vehicle whose file does not state the size of its hull is given a typical one, for the effects that need it.

    Parameters
    ----------
    names : of the catalogue; default: all. All are compared with all

    Raises
    ------
    RequestError
        for an unknown effect, or a vehicle that none of the trials leaves in one piece.
    """
    wanted = [effect_named(name) for name in names] or list(EFFECTS)
    seen = _driven(vehicle.model_dump_json())
    silent = [effect.name for effect in wanted if effect.name not in seen.amounts]
    if names and silent:
        raise RequestError(f"{silent[0]}: no plausible amount of it changes the motion of {vehicle.name} by 3 %")
    chosen = [effect for effect in wanted if effect.name in seen.amounts]
    return tuple(_signature(vehicle, effect, seen) for effect in chosen)


@dataclass(frozen=True, slots=True, eq=False)
class _Driven:
    """All trials driven by a vehicle, and gentle driving, with the force of a typical amount of each effect.

    `scale` (3,) is the root mean square of the vehicle's own force in all trials, `assumed` the hull that it was given.
    """

    amounts: dict[str, dict[str, float]]
    runs: dict[Trial, "_Run"]
    ordinary: "_Run"
    scale: Array
    assumed: str


@lru_cache(maxsize=1)
def _driven(content: str) -> _Driven:
    """Drive a vehicle, given as its JSON: one effect after the other is asked of the same vehicle."""
    stated = Vehicle.model_validate_json(content)
    vehicle = with_hull(stated, np.random.default_rng(7))
    hull = hull_of(vehicle)
    assumed = f"a hull of {hull.length:.2g} m that draws {hull.draught:.2g} m, which the file does not state"
    amounts = {}
    for effect in EFFECTS:
        with suppress(RequestError):  # of which no amount matters on this vehicle
            amounts[effect.name] = typical_effect(effect.name, vehicle, np.random.default_rng(7))
    changed = {name: apply_effects(vehicle, amount) for name, amount in amounts.items()}
    driven = zip(TRIALS, *(drive(vehicle, TRIALS, minutes=when) for when in _MINUTES), strict=True)
    runs = {trial: _run(vehicle, changed, (*first, *later)) for trial, first, later in driven if first and later}
    if not runs:
        raise RequestError(f"{vehicle.name}: none of the manoeuvres ends without diverging; mend the vehicle first")
    gentle = commanded_motion(vehicle, programme(vehicle, "gentle", _ORDINARY), COMMAND_STEP)
    scale = np.sqrt(np.mean([(run.force**2).mean(axis=0) for run in runs.values()], axis=0)) + 1e-12
    given = "" if stated.hull is not None else assumed
    return _Driven(amounts, runs, _run(vehicle, changed, (gentle,)), scale, given)


def _run(vehicle: Vehicle, changed: dict[str, Vehicle], motions: Sequence[Motion]) -> _Run:
    blown = tuple(replace(motion, air=np.tile(WIND, (motion.time.size, 1))) for motion in motions)
    mass = mass_matrix(vehicle)
    own = [modelled_acceleration(vehicle, motion) for motion in blown]
    effects = {
        name: np.concatenate(
            [(modelled_acceleration(other, motion) - a) @ mass.T for motion, a in zip(blown, own, strict=True)]
        )
        for name, other in changed.items()
    }
    return _Run(blown, np.concatenate(own) @ mass.T, effects)


def _signature(vehicle: Vehicle, effect: Effect, seen: _Driven) -> Signature:
    amount, runs, ordinary, scale = seen.amounts[effect.name], seen.runs, seen.ordinary, seen.scale
    name = effect.name
    clear: dict[Trial, tuple[float, float]] = {}
    for trial, run in runs.items():
        own = run.effects[name] / scale
        near = max((abs(_cosine(own, force / scale)) for key, force in run.effects.items() if key != name), default=0.0)
        clear[trial] = float((own**2).mean()) * (1.0 - near**2), near
    best = max(clear, key=lambda trial: clear[trial][0])
    run = runs[best]
    sizes = np.sqrt((run.effects[name] ** 2).mean(axis=0))
    axis = int(np.argmax(sizes / scale))
    other = ordinary.effects[name] / scale
    alike = {key: abs(_cosine(other, force / scale)) for key, force in ordinary.effects.items() if key != name}
    near = sorted(((key, value) for key, value in alike.items() if value >= ALIKE), key=lambda pair: -pair[1])
    half = len(run.motions) // 2
    motions = run.motions[half:]
    force = run.effects[name][sum(motion.time.size for motion in run.motions[:half]) :, axis]
    signal, values = _telling(vehicle, motions, force)
    steps = [motion.time - motion.time[0] for motion in motions]
    begins = np.cumsum([0.0, *(step[-1] + COMMAND_STEP for step in steps[:-1])])
    time = np.concatenate([begin + step for begin, step in zip(begins, steps, strict=True)])
    size, apart = float(sizes[axis]), float(np.sqrt(max(1.0 - clear[best][1] ** 2, 0.0)))
    assumed = seen.assumed if effect.requires else ""
    return Signature(effect, amount, best, axis, size, apart, tuple(near), time, force, signal, values, assumed)


def _cosine(one: Array, other: Array) -> float:
    size = float(np.sqrt((one**2).sum() * (other**2).sum()))
    return float((one * other).sum()) / size if size > 0.0 else 0.0


def _telling(vehicle: Vehicle, motions: Sequence[Motion], force: Array) -> tuple[str, Array]:
    """The signal of which the force is most nearly a function, and its values (n,)."""
    if force.std() < _CONSTANT * np.sqrt((force**2).mean()):
        return "time", COMMAND_STEP * np.arange(force.size, dtype=float)
    found: dict[str, list[Array]] = {name: [] for name in _SIGNALS}
    for motion in motions:
        u, v, r = motion.velocity.T
        given = zip(vehicle.thrusters, motion.commands.T, strict=True)
        commands = np.column_stack([t.curve.normalised(command, t.command) for t, command in given])
        mean, step = commands.mean(axis=1), motion.time_step
        series = (u, v, r, mean, commands[:, 0] - mean, np.gradient(u, step), np.gradient(r, step), motion.heading)
        for name, values in zip(_SIGNALS, series, strict=True):
            found[name].append(values)
    joined = {name: np.concatenate(parts) for name, parts in found.items()}
    best = max(_SIGNALS, key=lambda name: explained_share(joined[name], force))
    return best, joined[best]
