"""The law of dissipation, nu_r^T F(nu_r) <= 0 over an envelope of velocities, with positive mass: measured and proved.

F is the force of every damping, coupling and unnamed term (Fossen 2021, section 6.4 and property 6.3). Coriolis forces
do no work, a wake memory with positive gains stores and loses energy, and thrust, wind, current and trim come from
outside. The proof is a few 3x3 matrices in each orthant, see `Basis`; cross-flow drag needs none, as C_d >= 0 takes
energy out at every state (`physics.momentum_balance.cross_flow_forces`).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations_with_replacement, product
from math import comb, isfinite

import numpy as np

from ..effects import Form
from ..errors import RequestError
from ..forces import across_hull, through_water
from ..momentum_balance import active_terms, mass_matrix
from ..motion import Array, Motion
from ..vehicle import Vehicle

_LEAST = (1e-3, 1e-3, 1e-3)
"""Smallest reach of an envelope on an axis [m/s, m/s, rad/s]: the last digit that is kept of it."""
_MOMENT = 1.0
"""Time within which no hull gets far beyond its speed and back [s]: a fix that jumps and one that is held do."""
_SLOW = (0.1, 0.1, 0.05)
"""Speeds that no spike is told from [m/s, m/s, rad/s]: a boat that is nudged may reach them for a moment."""
_FAR_OUT = 1.5
"""How many times the speed that lasts a moment one must reach to be a sensor's: simulated zigzags and spins have peaks
of 1.24 times what lasts."""
_OTHER_WAY = 0.05
"""A measured envelope reaches at least this share of its longer side to the other side of rest: a boat that was never
driven astern drifts back a little."""
_DIGITS = 3
"""Decimals to which an envelope is rounded outwards, so that what is printed is what was judged."""

State = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Envelope:
    """A box of velocities relative to the water, with rest inside or on its border.

    Attributes
    ----------
    lower, upper : ends on u, v [m/s] and r [rad/s]

    Raises
    ------
    RequestError
        when an end is not finite, rest is outside, or the box is flat.
    """

    lower: State
    upper: State

    def __post_init__(self) -> None:
        ends = list(zip(self.lower, self.upper, strict=True))
        if not all(isfinite(low) and isfinite(high) and low <= 0.0 <= high and low < high for low, high in ends):
            raise RequestError(
                f"envelope: expected lower <= 0 <= upper and lower < upper on u, v and r, got {ends}; "
                "an envelope reaches from rest to the fastest motion"
            )

    @property
    def orthants(self) -> tuple[State, ...]:
        """The far corner of every part of the box in which no velocity changes its sign, at most eight."""
        sides = [tuple(x for x in (high, low) if x != 0.0) for low, high in zip(self.lower, self.upper, strict=True)]
        return tuple((u, v, r) for u, v, r in product(*sides))

    def to_dict(self) -> dict[str, list[float]]:
        """As the files write it: [lower, upper] by velocity."""
        return {name: [low, high] for name, low, high in zip("uvr", self.lower, self.upper, strict=True)}


def envelope_of(motions: Sequence[Motion], vehicle: Vehicle, share: float = 1.0) -> Envelope:
    """The envelope of measured motions: `share` times the extremes of velocity relative to the vehicle's water.

    Rest belongs to it, and a little of the other direction on every axis (a twentieth of the longer side), because a
    boat that goes ahead is sometimes pushed astern. A speed that is gone in a moment, far beyond all others, is a
    sensor's and not the boat's. Ends are rounded outwards to 0.001.

    Parameters
    ----------
    motions : measured
    vehicle : whose water the velocities are relative to
    share : factor on the extremes

    Raises
    ------
    RequestError
        when there is no motion.
    """
    if not motions:
        raise RequestError("envelope: expected at least one motion, got none")
    parts = [np.stack(through_water(vehicle, m), axis=-1) for m in motions]
    low, high = (sign * share * _reach([sign * part for part in parts], motions) for sign in (-1.0, 1.0))
    longest = np.maximum(np.maximum(-low, high), _LEAST)
    low, high = np.minimum(low, -_OTHER_WAY * longest), np.maximum(high, _OTHER_WAY * longest)
    unit = 10.0**-_DIGITS
    lower, upper = (
        np.round(f(x / unit - s) * unit, _DIGITS) for f, x, s in ((np.floor, low, -1e-9), (np.ceil, high, 1e-9))
    )
    return Envelope(_state(lower), _state(upper))


def _reach(states: Sequence[Array], motions: Sequence[Motion]) -> Array:
    """The furthest that motions (n, 3) go on each axis, 0 or more; a value that is gone in a moment is a sensor's."""
    furthest = np.max([part.max(axis=0) for part in states], axis=0)
    wide = [2 * round(0.5 * _MOMENT / motion.time_step) + 1 for motion in motions]
    far_out = furthest > _FAR_OUT * np.maximum(_largest(map(_in_pieces, states, wide)), _SLOW)
    if far_out.any():  # medians about every row take ten times as long, and are no less than those of pieces
        from scipy.ndimage import median_filter

        lasting = _largest(median_filter(part, (w, 1), mode="nearest") for part, w in zip(states, wide, strict=True))
        furthest = np.where(furthest > _FAR_OUT * np.maximum(lasting, _SLOW), lasting, furthest)
    return np.maximum(furthest, 0.0)


def _in_pieces(state: Array, wide: int) -> Array:
    """Medians of a motion (n, 3) over pieces of so many rows, or what is less, (pieces, 3)."""
    if len(state) < wide:
        return state.min(axis=0, keepdims=True)
    return np.median(state[: len(state) // wide * wide].reshape(-1, wide, 3), axis=1)


def _largest(parts: Iterable[Array]) -> Array:
    """The largest of several (n, 3) on each axis."""
    return np.max([part.max(axis=0) for part in parts], axis=0)


def damping_power(vehicle: Vehicle, velocity: Array) -> Array:
    """Power nu_r^T F(nu_r) [W] that damping, coupling and unnamed terms put into the hull, (...) for (..., 3).

    Cross-flow drag is among them; its share is -C_d (v F_Y + r F_N), never above zero (see `cross_flow`).
    """
    u, v, r = state = np.moveaxis(np.asarray(velocity, dtype=float), -1, 0)
    power = np.zeros_like(u)
    for value, axis, form in active_terms(vehicle):
        power = power + value * form(u, v, r) * state[axis]
    coefficient = vehicle.values["cross_flow"]
    if coefficient:
        force, moment = across_hull(vehicle, v, r)
        power = power - coefficient * (v * force + r * moment)
    return power


@dataclass(frozen=True, slots=True)
class WorstPower:
    """The state at which damping puts the most power into the hull: `power` [W] at `state` (u, v, r)."""

    power: float
    state: State


def worst_dissipation(
    vehicle: Vehicle, envelope: Envelope, samples: int = 100_000, seed: int = 0, refinements: int = 20
) -> WorstPower:
    """Random search of the envelope for the largest power of the damping force; at rest it is 0 W.

    Half of the states are drawn evenly over the box, a quarter on its faces, a quarter along rays at all scales, since
    linear terms show at low and cubic ones at high speed. The best by power, and the best by power over squared
    speed (else rest, where there is no power, would hide all else), are then moved at random, ever less.

    Parameters
    ----------
    vehicle : whose damping it is
    envelope : of velocities relative to the water [m/s, m/s, rad/s]
    samples, refinements : states drawn, and rounds of random steps
    seed : of both
    """
    rng = np.random.default_rng(seed)
    low, high = np.array(envelope.lower), np.array(envelope.upper)
    states = low + (high - low) * rng.random((samples, 3))
    quarter = samples // 4
    face = np.arange(quarter)
    axis = rng.integers(0, 3, quarter)
    states[face, axis] = np.where(rng.random(quarter) < 0.5, low[axis], high[axis])
    states[quarter : 2 * quarter] *= 10.0 ** rng.uniform(-3.0, 0.0, (quarter, 1))

    def share(where: Array) -> Array:
        return damping_power(vehicle, where) / np.maximum(((where / (high - low)) ** 2).sum(axis=-1), 1e-12)

    found = [states]
    for worth in (share, lambda where: damping_power(vehicle, where)):
        pool = np.concatenate(found)
        best = pool[np.argsort(-worth(pool))[:64]]
        reach = 0.1 * (high - low)
        for _ in range(refinements):
            trial = np.clip(best[:, None, :] + reach * rng.normal(size=(best.shape[0], 16, 3)), low, high)
            trial = np.concatenate([best[:, None, :], trial], axis=1)
            best = trial[np.arange(best.shape[0]), np.argmax(worth(trial), axis=1)]
            reach = 0.7 * reach
        found.append(best)
    states = np.concatenate(found)
    power = damping_power(vehicle, states)
    k = int(np.argmax(power))
    if power[k] <= 0.0:
        return WorstPower(0.0, (0.0, 0.0, 0.0))
    return WorstPower(float(power[k]), _state(states[k]))


def mass_margin(vehicle: Vehicle) -> float:
    """Smallest eigenvalue of M scaled to a unit diagonal of the rigid body; positive where kinetic energy is.

    M is symmetric by construction (N_vdot = Y_rdot, Fossen 2021, property 6.1).
    """
    least = min(vehicle.mass, vehicle.inertia_z)
    if least <= 0.0:  # a rigid body has mass; added mass cannot make up for it
        return float(np.sign(least))
    size = np.sqrt([vehicle.mass, vehicle.mass, vehicle.inertia_z])
    return float(np.linalg.eigvalsh(mass_matrix(vehicle) / np.outer(size, size)).min())


def state_in_words(state: State) -> str:
    """Velocities with units.

    >>> state_in_words((1.954, 0.0, -0.0001))
    'u = 1.95 m/s, v = 0.00 m/s, r = 0.00 rad/s'
    """
    u, v, r = (round(x, 2) + 0.0 for x in state)
    return f"u = {u:.2f} m/s, v = {v:.2f} m/s, r = {r:.2f} rad/s"


def _state(values: Array) -> State:
    u, v, r = (float(x) for x in values)
    return u, v, r


Exponents = tuple[int, int, int]
_PAIRS = tuple(combinations_with_replacement(range(3), 2))


@dataclass(frozen=True, slots=True)
class Basis:
    """Basis by which polynomial coefficients and slacks make matrices at control points; the same for every orthant.

    In one orthant of the envelope nu = e p, with e its far corner and p in the unit cube, and moduli are plain numbers,
    so the power of the damping force is a polynomial P(p) [W] with coefficients linear in the vehicle's parameters.
    Write P = -p^T S(p) p. An S(p) in Bernstein form that is positive semidefinite at its control points is so on the
    whole cube. For damping of the catalogue S is affine and the control points are the corners, where S = (D + D^T) / 2
    in these units: the vertex LMIs of Boyd et al. (1994, section 4.3). Unnamed terms of degree three need degree two on
    some axes, with one more control point halfway (Farouki 2012, section 9).

    S is not unique: u v r may stand as u in row v, column r, or as v in row u, column r, or as r in row u, column v.
    Each such exchange is a free variable (a slack) of each orthant. Without them honest couplings are rejected: Y_ur +
    N_uv + X_vr = 0 does no work whatever its size.

    Attributes
    ----------
    monomials : exponents of p in P, m of them
    points : (K, 3) control points in the unit cube
    lift : (K, 3, 3, m) S at the control points for each coefficient of P
    slack : (K, 3, 3, s) S at the control points for each exchange, with p^T S p = 0
    """

    monomials: tuple[Exponents, ...]
    points: Array
    lift: Array
    slack: Array


@lru_cache(maxsize=4)
def basis(degree: Exponents) -> Basis:
    """The basis for damping matrices of a degree, 1 or 2, in each of the three velocities."""
    points = np.array(list(product(*(range(d + 1) for d in degree))))
    total = 2 + max(degree)
    exponents, lift, slack = [], [], []
    cubes = ((i, j, k) for i, j, k in product(range(total + 1), repeat=3))
    for e in sorted(cubes, key=lambda e: (sum(e), e)):
        fits = [(i, j) for i, j in _PAIRS if all(0 <= x <= d for x, d in zip(_without(e, i, j), degree, strict=True))]
        slots = fits if 2 <= sum(e) <= total else []
        if not slots:
            continue
        exponents.append(e)
        matrices = [_slot(i, j, e, points, degree) for i, j in slots]
        diagonal = [m for (i, j), m in zip(slots, matrices, strict=True) if i == j]
        natural = diagonal or matrices
        lift.append(-np.mean(natural, axis=0))
        slack += [m - matrices[0] for m in matrices[1:]]
    return Basis(tuple(exponents), points / np.array(degree), np.stack(lift, axis=-1), np.stack(slack, axis=-1))


def degree_of(terms: Sequence[tuple[int, Form]]) -> Exponents:
    """Degree of S in each velocity that given (axis, monomial) terms need; (1, 1, 1) for all of the catalogue."""
    degree, cubic = [1, 1, 1], [axis for axis, form in terms if form.degree > 2]
    for axis, form in terms:
        factors = [f.strip("|") for f in form.factors]
        if "uvr"[axis] in factors:
            factors.remove("uvr"[axis])
        elif form.column is not None:
            factors.remove("uvr"[form.column])
        else:
            factors.pop()
        for k, name in enumerate("uvr"):
            degree[k] = max(degree[k], factors.count(name))
    if cubic and max(degree) == 1:  # u r in every row is affine on each axis, yet P is of degree four
        degree[cubic[0]] = 2
    return degree[0], degree[1], degree[2]


def vehicle_degree(*vehicles: Vehicle) -> Exponents:
    """Degree of S in each velocity that serves all of some vehicles."""
    return degree_of([(axis, form) for vehicle in vehicles for _, axis, form in active_terms(vehicle)])


def power_of(axis: int, form: Form, envelope: Envelope, degree: Exponents) -> Array:
    """Coefficients (orthants, m) [W] of the power of a unit force `form` on an axis, in every orthant.

    Parameters
    ----------
    axis : 0 to 2
    form : monomial of velocity
    envelope : of velocities [m/s, m/s, rad/s]
    degree : of S in each velocity
    """
    speeds = "uvr"[axis] + "".join(form.factors)
    monomials = basis(degree).monomials
    column = monomials.index((speeds.count("u"), speeds.count("v"), speeds.count("r")))
    result = np.zeros((len(envelope.orthants), len(monomials)))
    for k, far in enumerate(envelope.orthants):
        size = far[axis]
        for factor in form.factors:
            x = far["uvr".index(factor.strip("|"))]
            size *= abs(x) if factor.startswith("|") else x
        result[k, column] = size
    return result


def vehicle_power(vehicle: Vehicle, envelope: Envelope, degree: Exponents) -> Array:
    """Coefficients (orthants, m) [W] of the power of all damping, coupling and unnamed terms of a vehicle.

    But for cross-flow drag, whose power is never above zero.

    Parameters
    ----------
    vehicle : whose terms they are
    envelope : of velocities [m/s, m/s, rad/s]
    degree : of S in each velocity
    """
    total = np.zeros((len(envelope.orthants), len(basis(degree).monomials)))
    for value, axis, form in active_terms(vehicle):
        total += value * power_of(axis, form, envelope, degree)
    return total


def control_matrices(power: Array, slack: Array | None, degree: Exponents) -> Array:
    """S at every control point [W], (orthants, K, 3, 3), from coefficients of P (orthants, m), slacks (orthants, s).

    Parameters
    ----------
    power : coefficients of P (orthants, m) [W]
    slack : exchanges (orthants, s) [W]; none for None
    degree : of S in each velocity
    """
    b = basis(degree)
    matrices = np.einsum("kijm,om->okij", b.lift, power)
    return matrices if slack is None else matrices + np.einsum("kijs,os->okij", b.slack, slack)


def corner_state(envelope: Envelope, orthant: int, point: int, degree: Exponents) -> tuple[float, float, float]:
    """Velocities (u, v, r) of a control point.

    Parameters
    ----------
    envelope : of velocities [m/s, m/s, rad/s]
    orthant, point : numbers of the orthant and of the control point in it
    degree : of S in each velocity
    """
    return _state(np.array(envelope.orthants[orthant]) * basis(degree).points[point] + 0.0)


def _without(exponents: Exponents, i: int, j: int) -> list[int]:
    """What is left of a monomial of P where it stands in row i, column j of S: below zero where it cannot."""
    return [x - (k == i) - (k == j) for k, x in enumerate(exponents)]


def _slot(i: int, j: int, exponents: Exponents, points: np.ndarray, degree: Exponents) -> Array:
    """The control matrices (K, 3, 3) of the S in which one monomial of P stands in rows and columns i, j."""
    matrix = np.zeros((3, 3))
    matrix[i, j] = matrix[j, i] = 1.0 if i == j else 0.5
    values = np.ones(len(points))
    for axis, power in enumerate(_without(exponents, i, j)):
        values *= [comb(int(k), power) / comb(degree[axis], power) for k in points[:, axis]]
    return values[:, None, None] * matrix
