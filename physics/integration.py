"""Integration of the force equation: fixed-step RK4, rollouts from measured starts, and a step for stiff models.

Rollouts of several vehicles run side by side in one batch. The stiff step bounds models that nobody made stable.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple, TypeVar

import numpy as np

from .batch_rates import Flattened, Outside, Terms
from .errors import RequestError
from .forces import Actuation, actuation, memory_states, relative_velocity
from .motion import Array, Motion, body_to_earth
from .vehicle import Vehicle

SPEED_LIMIT = 50.0
"""Speed [m/s] and yaw rate [rad/s] beyond which a rollout counts as diverged and is held: 100 knots, and eight turns a
second."""

Item = TypeVar("Item")
Key = TypeVar("Key")
Forcing = TypeVar("Forcing")

Added = Callable[[int, Array], Array]
"""Acceleration over ground (3, batch) that is held during a step beside the vehicle's own, from the number of the step
and the state (6, batch) at its beginning; called once a step, in order."""


@dataclass(frozen=True, slots=True)
class Rollouts:
    """Open-loop rollouts from measured starts.

    `states` (starts, steps + 1, 6): north, east [m], psi [rad], u, v [m/s], r [rad/s], the first two only where they
    are followed; `diverged` (starts,) bool.
    """

    states: Array
    diverged: np.ndarray


class Around(NamedTuple):
    """Surroundings of a boat.

    Attributes
    ----------
    air : (2, steps + 1, batch) velocity of the air over ground, north and east [m/s]; None where it is still
    clock : minutes from the beginning of the log to each start, (batch,)
    """

    air: Array | None = None
    clock: Array | float = 0.0


STILL = Around()
"""Still air, at the beginning of the log."""


class Driven(NamedTuple):
    """Rollouts of one vehicle over one number of steps.

    Attributes
    ----------
    vehicle : None for a body on which no force acts
    initial : (batch, 6) north, east, psi, u, v, r; or (batch, 4) without north and east, which are then not followed
    thrust, load : (thrusters, steps + 1, batch) [N], [N s/m], linear between steps
    memory : (batch, 2) initial wake memory of sway speed and yaw rate; None: the initial velocities
    around : the air, linear between steps, and when the starts are
    """

    vehicle: Vehicle | None
    initial: Array
    thrust: Array
    load: Array
    memory: Array | None = None
    around: Around = STILL

    @property
    def batch(self) -> int:
        """Number of rollouts."""
        return self.initial.shape[0]

    @property
    def steps(self) -> int:
        """Number of steps of each."""
        return self.thrust.shape[1] - 1


_STABLE = 2.0
"""Rate times step up to which decay is followed: Runge and Kutta's method of fourth order is stable up to 2.79."""
_MOST_PARTS = 16
"""Most parts of a step; what decays faster is left to diverge."""


def integrate(driven: Driven, time_step: float, added: Added | None = None) -> Rollouts:
    """Integrate the force equation by classical Runge-Kutta for a batch of starts.

    Parameters
    ----------
    time_step : [s]
    added : acceleration beside the vehicle's; default: none. What is beyond `SPEED_LIMIT` in a step is cut there, or a
        rollout that diverges would be off the map before it is held
    """
    return integrate_together([driven], time_step, added)[0]


@np.errstate(over="ignore", invalid="ignore")  # of rollouts that run away
def integrate_together(crowd: Sequence[Driven], time_step: float, added: Added | None = None) -> list[Rollouts]:
    """Integrate the rollouts of several vehicles in one batch, which those that are done leave; see `integrate`.

    Parameters
    ----------
    crowd : all with north and east, or all without; a body on which no force acts is alone
    """
    of_vehicle = {id(one.vehicle): Terms(one.vehicle) for one in crowd if one.vehicle is not None}
    parts = [_parts(one, of_vehicle, time_step) for one in crowd]
    return _in_groups(crowd, parts, lambda group, number: _integrate(group, of_vehicle, time_step, added, number))


def _in_groups(
    items: Sequence[Item], keys: Sequence[Key], solve: Callable[[list[Item], Key], list[Rollouts]]
) -> list[Rollouts]:
    """Rollouts of all items, solved together where they have the same key, in the order of the items."""
    found: dict[int, Rollouts] = {}
    for key in dict.fromkeys(keys):
        alike = [k for k, other in enumerate(keys) if other == key]
        found |= dict(zip(alike, solve([items[k] for k in alike], key), strict=True))
    return [found[k] for k in range(len(items))]


def _parts(driven: Driven, terms: Mapping[int, Terms], time_step: float) -> int:
    """Parts into which each step is cut, so that damping of any size in a model decays as it does in the boat."""
    if driven.vehicle is None or not driven.batch:
        return 1
    rate = terms[id(driven.vehicle)].fastest_decay(np.abs(driven.initial[:, -3:]).max(axis=0).tolist())
    return int(np.clip(np.ceil(rate * time_step / _STABLE), 1, _MOST_PARTS))


def _integrate(
    crowd: Sequence[Driven], of_vehicle: Mapping[int, Terms], h: float, added: Added | None, parts: int
) -> list[Rollouts]:
    """Rollouts whose steps are cut into as many parts."""
    order = sorted(range(len(crowd)), key=lambda k: -crowd[k].steps)
    lined = [crowd[k] for k in order]
    ends = np.cumsum([0, *(one.batch for one in lined)]).tolist()
    terms = [of_vehicle[id(one.vehicle)] for one in lined if one.vehicle is not None]
    state, (pushed, lost, air, clock) = _side_by_side(lined, terms)
    first, held = 6 - lined[0].initial.shape[1], None
    own: Flattened | None = None

    def slope(x: Array, outside: Outside) -> Array:
        out = _idle(x) if own is None else own(x, outside)
        if held is not None:
            out[3:6] += held
        return out

    history = np.empty((lined[0].steps + 1, 6 - first, ends[-1]))
    diverged, done = np.zeros(ends[-1], dtype=bool), 0
    history[0] = state[first:6]
    while any(going := [one for one in lined if one.steps > done]):
        width = ends[len(going)]
        state = state[:, :width].copy()
        if terms:
            crew = [(own_terms, one.batch) for own_terms, one in zip(terms, going, strict=False)]
            own = Flattened(crew, placed=not first)
        pushed, lost, air = pushed[..., :width], _first(lost, width), _first(air, width)
        clock = clock[:width] if isinstance(clock, np.ndarray) else clock
        for k in range(done, going[-1].steps):
            held = None if added is None else np.clip(added(k, state[:6]), -SPEED_LIMIT / h, SPEED_LIMIT / h)
            ends_of_step = tuple((pushed[:, n], _at(lost, n), _at(air, n), clock + n * h / 60.0) for n in (k, k + 1))
            for begin, end in _cut(*ends_of_step, parts):
                state = runge_kutta(slope, state, (begin, _between(begin, end, 0.5), end), h / parts)
            fast = ~(np.abs(state[3:6]).max(axis=0) <= SPEED_LIMIT)
            if fast.any():
                diverged[:width] |= fast
                state[:, fast] = np.nan_to_num(state[:, fast], nan=0.0, posinf=0.0, neginf=0.0)
                state[3:, fast] = np.clip(state[3:, fast], -SPEED_LIMIT, SPEED_LIMIT)
                before = history[k][: 3 - first, :width][:, fast]
                state[first:3, fast] = np.clip(state[first:3, fast], before - SPEED_LIMIT * h, before + SPEED_LIMIT * h)
            history[k + 1, :, :width] = state[first:6]
        done = going[-1].steps
    rolled = [
        Rollouts(np.ascontiguousarray(history[: one.steps + 1, :, a:b].transpose(2, 0, 1)), diverged[a:b])
        for one, (a, b) in zip(lined, pairwise(ends), strict=True)
    ]
    return [rolled[order.index(k)] for k in range(len(crowd))]


_Series = tuple[Array, Array | None, Array | None, Array | float]
"""What acts along rollouts: accelerations (3, steps + 1, batch) by the thrusters at zero advance, what they lose per
advance speed, the velocity of the air (2, steps + 1, batch), and the minutes of the starts."""


def _side_by_side(lined: Sequence[Driven], terms: Sequence[Terms]) -> tuple[Array, _Series]:
    """States (8, batch) at the starts of all rollouts, and what acts along them."""
    state = np.zeros((8, sum(one.batch for one in lined)))
    state[6 - lined[0].initial.shape[1] : 6] = np.concatenate([one.initial.T for one in lined], axis=1)
    clocks = [one.around.clock for one in lined]
    clock = (
        clocks[0]
        if len(lined) == 1
        else np.concatenate([np.broadcast_to(c, one.batch) for c, one in zip(clocks, lined, strict=True)])
    )
    if not terms:
        return state, (np.zeros((3, lined[0].steps + 1, lined[0].batch)), None, None, clock)
    state[6:] = np.concatenate([_remembered(one) for one in lined], axis=1)
    pairs = list(zip(terms, lined, strict=True))
    lost = air = None
    pushed = _joined([own.accelerations(one.thrust) for own, one in pairs])
    if any(one.load.any() for one in lined):
        lost = _joined([own.accelerations(one.load) for own, one in pairs])
    if any(one.around.air is not None for one in lined):
        air = _joined(
            [np.zeros((2, one.steps + 1, one.batch)) if (moving := one.around.air) is None else moving for one in lined]
        )
    return state, (pushed, lost, air, clock)


def _remembered(one: Driven) -> Array:
    """Wake memory of sway speed and yaw rate at the starts, (2, batch)."""
    assert one.vehicle is not None, "a body on which no force acts has no wake"
    if one.memory is not None:
        return one.memory.T
    psi, u, v, r = one.initial.T[-4:]
    return np.stack(relative_velocity(one.vehicle, psi, (u, v, r), one.around.clock)[1:])


def _joined(parts: Sequence[Array]) -> Array:
    """Series (axes, steps + 1, batch) side by side, the longest first; zero after their ends."""
    if len(parts) == 1:
        return parts[0]
    result, begin = np.zeros((*parts[0].shape[:2], sum(part.shape[2] for part in parts))), 0
    for part in parts:
        result[:, : part.shape[1], begin : begin + part.shape[2]] = part
        begin += part.shape[2]
    return result


def _first(series: Array | None, width: int) -> Array | None:
    return None if series is None else series[..., :width]


def _at(series: Array | None, step: int) -> Array | None:
    return None if series is None else series[:, step]


def _cut(begin: Outside, end: Outside, parts: int) -> Iterator[tuple[Outside, Outside]]:
    """The parts of a step, along which everything changes in proportion to time."""
    earlier = begin
    for part in range(1, parts + 1):
        later = end if part == parts else _between(begin, end, part / parts)
        yield earlier, later
        earlier = later


def _between(begin: Outside, end: Outside, share: float) -> Outside:
    """What acts at a share of the time from the beginning to the end."""

    def mean(one: Array, other: Array) -> Array:
        return (1.0 - share) * one + share * other

    loss, air = (None if a is None or b is None else mean(a, b) for a, b in ((begin[1], end[1]), (begin[2], end[2])))
    return mean(begin[0], end[0]), loss, air, (1.0 - share) * begin[3] + share * end[3]


def _idle(x: Array) -> Array:
    """Rates of change of the states (8, batch) of bodies on which no force acts."""
    out = np.zeros_like(x)
    out[0], out[1] = body_to_earth(x[2], x[3], x[4])
    out[2] = x[5]
    return out


def runge_kutta(
    slope: Callable[[Array, Forcing], Array], state: Array, forcing: tuple[Forcing, Forcing, Forcing], step: float
) -> Array:
    """One step of the classical Runge-Kutta method, of arrays or of tensors.

    Parameters
    ----------
    slope : rate of change of a state under a forcing
    forcing : at the beginning, in the middle and at the end of the step
    step : [s]
    """
    first, middle, last = forcing
    k1 = slope(state, first)
    k2 = slope(state + 0.5 * step * k1, middle)
    k3 = slope(state + 0.5 * step * k2, middle)
    k4 = slope(state + step * k3, last)
    return state + (step / 6.0) * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


_ERROR, _PARTS = 0.3, 8
"""Error of a step, as a share of the speeds, above which it is halved, and most parts of a step: what turns fast under
a force that only turns it has no other limit. Stability needs no more, and only bounds are asked of such rollouts."""
_PROBE = 1e-4
"""Step of a difference [m/s, rad/s], at rest: above the rounding of single precision, below what drag bends over."""

Answer = Callable[[Array, Array, Array], Array]
"""Acceleration (n, 3) of velocities (n, 3), headings (n,) and commands (n, thrusters)."""


def integrate_stiff(answer: Answer, initial: Array, commands: Array, time_step: float, limit: float) -> Rollouts:
    """Integrate an acceleration that may be stiff, by a linearly implicit step of second order.

    ROS2 of Verwer et al. (1999, SIAM J. Sci. Comput. 20(4), eq. 2.1) with gamma = 1 - 1/sqrt(2): L-stable, so that
    damping of any size decays in a step of any size, and of second order whatever matrix stands for the Jacobian. Here
    that is made of differences, its growing part taken off: else an L-stable step would damp what truly explodes.

    Parameters
    ----------
    answer : called twice a step, once with four times the batch
    initial : (batch, 6) north, east, psi, u, v, r
    commands : (batch, steps + 1, thrusters), linear between steps
    limit : speed [m/s] and yaw rate [rad/s] beyond which a rollout counts as diverged and is held
    """
    batch, steps = commands.shape[0], commands.shape[1] - 1
    history = np.empty((batch, steps + 1, 6))
    history[:, 0] = state = initial.astype(float)
    diverged, parts = np.zeros(batch, dtype=bool), 1
    for k in range(steps):
        ends, done = (commands[:, k], commands[:, k + 1]), 0
        while done < parts:
            pushed = ends[0] + (ends[1] - ends[0]) * ((done + 0.5) / parts)
            trial, error = _implicit_step(answer, state, pushed, time_step / parts)
            if parts < _PARTS and float(error[~diverged].max(initial=0.0)) > _ERROR:
                done, parts = 2 * done, 2 * parts
                continue
            gone = ~(np.abs(trial[:, 3:]).max(axis=1) <= limit) | ~np.isfinite(trial).all(axis=1)
            trial[gone, 3:] = np.clip(np.nan_to_num(trial[gone, 3:], nan=limit), -limit, limit)
            far = limit * time_step / parts
            trial[gone, :3] = np.clip(np.nan_to_num(trial[gone, :3]), state[gone, :3] - far, state[gone, :3] + far)
            diverged |= gone
            state, done = np.where(diverged[:, None] & ~gone[:, None], state, np.nan_to_num(trial)), done + 1
        history[:, k + 1] = state
        if parts > 1 and float(error[~diverged].max(initial=0.0)) < 0.1 * _ERROR:
            parts //= 2
    return Rollouts(history, diverged)


def _implicit_step(answer: Answer, state: Array, pushed: Array, h: float) -> tuple[Array, Array]:
    """States (batch, 6) one step of `integrate_stiff` later, and its error (batch,) as a share of the speeds."""
    gamma, eye, batch = 1.0 - np.sqrt(0.5), np.eye(3), state.shape[0]
    psi, nu = state[:, 2], state[:, 3:]
    probe = _PROBE * (1.0 + np.abs(nu))
    asked = np.concatenate([nu[:, None], nu[:, None] + probe[:, :, None] * eye], axis=1).reshape(-1, 3)
    said = answer(asked, np.repeat(psi, 4), np.repeat(pushed, 4, axis=0)).reshape(batch, 4, 3)
    jacobian = np.swapaxes((said[:, 1:] - said[:, :1]) / probe[:, :, None], 1, 2)
    growth = np.maximum(np.linalg.eigvals(jacobian).real.max(axis=1), 0.0)
    inverse = np.linalg.inv(eye - gamma * h * (jacobian - growth[:, None, None] * eye))
    one = np.einsum("bij,bj->bi", inverse, said[:, 0])
    two = np.einsum("bij,bj->bi", inverse, answer(nu + h * one, psi + h * nu[:, 2], pushed) - 2.0 * one)
    after = nu + h * (1.5 * one + 0.5 * two)
    turned = psi + 0.5 * h * (nu[:, 2] + after[:, 2])
    before, later = (body_to_earth(a, x[:, 0], x[:, 1]) for a, x in ((psi, nu), (turned, after)))
    moved = 0.5 * h * (np.stack(before, axis=-1) + np.stack(later, axis=-1))
    size = np.maximum(np.abs(nu), np.abs(after))
    size = np.maximum(size, 0.1 * size.max(axis=0)) + _PROBE
    error = np.abs(0.5 * h * (one + two) / size).max(axis=1)
    return np.column_stack([state[:, :2] + moved, turned, after]), error


class Legs(NamedTuple):
    """Rollouts that are asked of a motion: row numbers of their starts (batch,), and their number of time steps."""

    motion: Motion
    starts: np.ndarray
    steps: int


def rollout(
    vehicle: Vehicle | None,
    motion: Motion,
    starts: np.ndarray,
    steps: int,
    added: Added | None = None,
    placed: bool = True,
) -> Rollouts:
    """Open-loop rollouts from measured starts along a motion, with its commands, their history, and its wind.

    Parameters
    ----------
    vehicle, added : see `integrate`
    starts : (batch,) row numbers of `motion`; each needs `steps` rows after it
    steps : number of steps of `motion.time_step`
    placed : north and east are followed, too

    Raises
    ------
    RequestError
        when a start leaves fewer than `steps` rows.
    """
    return integrate(_driven(vehicle, Legs(motion, starts, steps), placed), motion.time_step, added)


@np.errstate(over="ignore", invalid="ignore")  # of motions that ran away
def rollouts(asked: Sequence[tuple[Vehicle, Legs]], placed: bool = True) -> list[Rollouts]:
    """`rollout` of several vehicles and motions, in one batch for each time step.

    Raises
    ------
    RequestError
        when a start leaves fewer rows than its steps.
    """
    steps = [legs.motion.time_step for _, legs in asked]
    driven = [_driven(vehicle, legs, placed) for vehicle, legs in asked]
    return _in_groups(driven, steps, integrate_together)


def _driven(vehicle: Vehicle | None, legs: Legs, placed: bool = True) -> Driven:
    motion, steps = legs.motion, legs.steps
    starts = check_starts(motion, legs.starts, steps)
    if vehicle is None:
        idle = np.zeros((0, motion.time.size))
        act, memory = Actuation(idle, idle), None
    else:
        act, memory = actuation(vehicle, motion), np.column_stack(memory_states(vehicle, motion))[starts]
    window = starts[None, :] + np.arange(steps + 1)[:, None]
    where = (motion.position,) if placed else ()
    initial = np.column_stack([*where, motion.heading, motion.velocity])[starts]
    air = None if motion.air is None else motion.air.T[:, window]
    around = Around(air, motion.minutes[starts])
    return Driven(vehicle, initial, act.thrust[:, window], act.load[:, window], memory, around)


def check_starts(motion: Motion, starts: np.ndarray, steps: int) -> np.ndarray:
    """Rows from which a motion is rolled out, as whole numbers.

    Parameters
    ----------
    motion : that is rolled out
    starts : row numbers (batch,)
    steps : rows that must follow each

    Raises
    ------
    RequestError
        when a start leaves fewer than `steps` rows.
    """
    result = np.asarray(starts, dtype=int)
    if result.size == 0 or result.min() < 0 or result.max() + steps >= motion.time.size:
        raise RequestError(
            f"rollout of {steps} steps: starts must lie in 0..{motion.time.size - steps - 1}, got {result.tolist()[:5]}"
        )
    return result


def simulate_motion(vehicle: Vehicle, motion: Motion) -> Motion:
    """The motion that a vehicle makes from the first state of `motion` under its commands."""
    result = rollout(vehicle, motion, np.array([0]), motion.time.size - 1).states[0]
    return replace(motion, position=result[:, :2].copy(), heading=result[:, 2].copy(), velocity=result[:, 3:].copy())
