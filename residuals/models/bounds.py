"""Interval bounds on a perceptron: a proof that it creates no energy without thrust, by linear relaxations.

In a cell nu = c + h e, |e| <= 1, each ReLU or tanh lies between two lines, and so the perceptron between two affine
functions of e (CROWN; Zhang et al. 2018, carried forwards). With the Taylor polynomial of the damping power they bound
nu^T M a(nu) + P(nu). A cell whose bound is too large is halved, until all are small enough or one violates.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np
from torch import nn

from ...physics.laws.damping_power import Envelope
from ...physics.momentum_balance import active_terms, mass_matrix, power_bounds
from ...physics.motion import Array
from ...physics.vehicle import Vehicle, hull_of
from .network_model import NetworkModel

Line = tuple[Array, Array]
"""Slope, never below zero, and offset of a line for each interval."""
Relaxation = Callable[[Array, Array], tuple[Line, Line]]
"""The lines below and above an activation on intervals from their least and their most, of any one shape."""

_HALVINGS = 12
"""Of the interval in which a tangent touches: it is then found to a four-thousandth of it, and it bounds anyhow."""
_TINY = 1e-300
"""Stands for the width of an interval that has none."""


def relu_lines(least: Array, most: Array) -> tuple[Line, Line]:
    """Lines below and above max(0, x); where zero is inside, of the two below the one that leaves less between.

    >>> import numpy as np
    >>> relu_lines(np.array([-1.0]), np.array([3.0]))
    ((array([1.]), array([0.])), (array([0.75]), array([0.75])))
    """
    torn, right = (least < 0.0) & (most > 0.0), (least >= 0.0).astype(float)
    chord = np.where(torn, most / np.maximum(most - least, _TINY), right)
    keep = np.where(torn, (most > -least).astype(float), right)
    return (keep, 0.0 * keep), (chord, np.where(torn, -chord * least, 0.0))


def tanh_lines(least: Array, most: Array) -> tuple[Line, Line]:
    """Lines below and above tanh; it is odd, so that those below are those above seen from the other side.

    tanh is concave above zero and convex below it, so that a chord lies on one side and a tangent on the other. Where
    zero is inside, the tangent above touches where it still passes over the lower end; where no such point is left, the
    chord is above.
    """
    slope, offset = _above_tanh(-most, -least)
    return (slope, -offset), _above_tanh(least, most)


def _above_tanh(least: Array, most: Array) -> Line:
    """A line above tanh: a tangent at the middle or, where that is not above, as near to it as one is; else a chord."""
    low, high = np.tanh(least), np.tanh(most)
    chord = (high - low) / np.maximum(most - least, _TINY)
    touch, torn = 0.5 * (least + most), (least < 0.0) & (most > 0.0)
    touch[torn] = np.maximum(touch[torn], _touching(least[torn], most[torn]))
    there = np.tanh(touch)
    tangent = (touch >= 0.0) & (_over(touch, least) | (least >= 0.0))
    slope = np.where(tangent, 1.0 - there**2, chord)
    return slope, np.where(tangent, there - slope * touch, low - chord * least)


def _touching(least: Array, most: Array) -> Array:
    """Where above zero the tangent of tanh passes over the end below zero, or the upper end where nowhere before it."""
    near, far = np.zeros_like(most), most
    for _ in range(_HALVINGS):
        middle = 0.5 * (near + far)
        over = _over(middle, least)
        near, far = np.where(over, near, middle), np.where(over, middle, far)
    return far


def _over(touch: Array, end: Array) -> np.ndarray:
    """Whether the tangent of tanh at `touch` lies above tanh at `end`."""
    there = np.tanh(touch)
    return there + (1.0 - there**2) * (end - touch) >= np.tanh(end)


_MOST = 200_000
"""Cells looked at before there is no proof."""
_BATCH = 2048
"""Cells at once, so that the bounds of the widest layers stay within some 100 MB."""


_LINES: dict[type[nn.Module], Relaxation] = {nn.ReLU: relu_lines, nn.Tanh: tanh_lines}
"""Of the activations that a perceptron may have."""


@dataclass(frozen=True, slots=True, eq=False)
class Perceptron:
    """Layers from velocity [m/s, m/s, rad/s] to acceleration [m/s^2, m/s^2, rad/s^2], without thrust.

    Attributes
    ----------
    layers : weights and biases, the head last
    lines : those below and above the activation between two layers
    """

    layers: list[tuple[Array, Array]]
    lines: Relaxation = relu_lines


@dataclass(frozen=True, slots=True, eq=False)
class Bounded:
    """Outcome of a bound on the power: proved, or the state u, v, r (3,) `against` it, where one was met."""

    proved: bool
    against: Array | None = None


def bound_power(model: NetworkModel, envelope: Envelope, limit: float, force: Array | None = None) -> Bounded:
    """Prove that the power without thrust is at most `limit` [W] everywhere in an envelope, or meet a state against it.

    With a `force` (3,) [N, N, N m] the limit rises with speed, by its power along each axis. Of a correction with
    a gain on each axis the proof is that of the vehicle with the most of it and with none, axis by axis: the power is
    linear in each gain, so what lies between has a power between theirs.

    The network must be a perceptron of ReLU or tanh that does not see the heading, and the vehicle's water must not
    stream where the network gives the whole acceleration; else there is no proof. No proof is no disproof.

    Parameters
    ----------
    model : the network
    envelope : of velocities relative to the water [m/s, m/s, rad/s]
    limit : power [W]
    force : (3,) [N, N, N m] whose power is added to the limit
    """
    perceptron = _perceptron(model)
    if perceptron is None:
        return Bounded(False)
    result = Bounded(True)
    for gain in _gains(model):
        head, bias = perceptron.layers[-1]
        heads = [*perceptron.layers[:-1], (head * gain[:, None], bias * gain)]
        result = _bound(model, Perceptron(heads, perceptron.lines), envelope, limit, force)
        if not result.proved:
            break
    return result


def _gains(model: NetworkModel) -> Array:
    """The corners (corners, 3) of what the gain may be on the three axes, the largest first."""
    gain = model.network.gain
    if gain is None:
        return np.ones((1, 3))
    most = gain.trust.gain(np.zeros(()))
    alike = (gain.trust.weights == gain.trust.weights[0]).all()
    return np.array([(1.0, 1.0, 1.0), (0.0, 0.0, 0.0)] if alike else list(product((1.0, 0.0), repeat=3))) * most


def _bound(
    model: NetworkModel, perceptron: Perceptron, envelope: Envelope, limit: float, force: Array | None
) -> Bounded:
    """The same with this perceptron in the place of the network."""
    terms = [] if model.pure else _monomials(model.vehicle)
    mass = mass_matrix(model.vehicle)
    cells = _orthants(envelope)
    looked_at = 0
    while cells.shape[1]:
        looked_at += cells.shape[1]
        if looked_at > _MOST:
            return Bounded(False)
        left = []
        for start in range(0, cells.shape[1], _BATCH):
            middle, half = cells[:, start : start + _BATCH]
            slope, offset, slack = _affine(perceptron, middle, half)
            value, upper = _power(mass, terms, middle, half, slope, offset, slack, force)
            crossing = np.zeros((2, middle.shape[0])) if model.pure else _crossing(model.vehicle, middle, half)
            value, upper = value + crossing[0], upper + crossing[1]
            if (value > limit).any():
                return Bounded(False, middle[int(np.argmax(value))])
            left.append(cells[:, start : start + _BATCH][:, upper > limit])
        cells = _halved(np.concatenate(left, axis=1), np.array(envelope.upper) - np.array(envelope.lower))
    return Bounded(True)


def _perceptron(model: NetworkModel) -> Perceptron | None:
    """The network with its scaling in its weights and thrust at zero; None where it is no such perceptron."""
    network, p = model.network.plain(), model.vehicle.values
    streaming = model.pure and (p["current_north"] != 0.0 or p["current_east"] != 0.0)
    body = dict(network.named_children()).get("body")
    if network.name != "mlp" or model.heading or streaming or not isinstance(body, nn.Sequential):
        return None
    found = []
    for layer in (*(m for m in body if isinstance(m, nn.Linear)), network.get_submodule("head")):
        parameters = dict(layer.named_parameters())
        found.append(tuple(parameters[n].detach().double().cpu().numpy() for n in ("weight", "bias")))
    constants = network.scaling.inputs
    weight, bias = found[0]
    found[0] = (weight[:, :3] / constants.scale[:3], bias - weight @ (constants.mean / constants.scale))
    weight, bias = found[-1]
    size = network.scaling.output
    found[-1] = (weight * size[:, None], bias * size)
    return Perceptron(found, _LINES[type(body[1])])


def _affine(perceptron: Perceptron, middle: Array, half: Array) -> tuple[Array, Array, Array]:
    """Slope (k, 3, 3), offset (k, 3) and slack (k, 3) of the acceleration in cells: |a - offset - slope e| <= slack."""
    weight, bias = perceptron.layers[0]
    low_slope = high_slope = weight * half[:, None, :]
    low = high = middle @ weight.T + bias
    for weight, bias in perceptron.layers[1:]:
        least, most = low - np.abs(low_slope).sum(-1), high + np.abs(high_slope).sum(-1)
        (below, under), (above, over) = perceptron.lines(least, most)
        low, low_slope = below * low + under, below[..., None] * low_slope
        high, high_slope = above * high + over, above[..., None] * high_slope
        up, down = np.maximum(weight, 0.0), np.minimum(weight, 0.0)
        low, high = low @ up.T + high @ down.T + bias, high @ up.T + low @ down.T + bias
        low_slope, high_slope = up @ low_slope + down @ high_slope, up @ high_slope + down @ low_slope
    slack = 0.5 * (high - low) + 0.5 * np.abs(high_slope - low_slope).sum(-1)
    return 0.5 * (low_slope + high_slope), 0.5 * (low + high), slack


def _power(
    mass: Array,
    terms: list[tuple[float, tuple[int, int, int], Array]],
    middle: Array,
    half: Array,
    slope: Array,
    offset: Array,
    slack: Array,
    force: Array | None = None,
) -> tuple[Array, Array]:
    """Least that the power is known to reach at the middle of cells, and upper bounds on it in them [W], (k,) each.

    Both less the power of a `force` along each axis, which is linear in a cell, where no velocity changes its sign.
    """
    arm = middle @ mass
    most = (np.abs(middle) + half) @ np.abs(mass)
    value = (arm * offset).sum(-1)
    gradient = half * (offset @ mass) + np.einsum("ki,kij->kj", arm, slope)
    curved = np.abs(half[:, :, None] * np.einsum("ij,kjl->kil", mass, slope)).sum((1, 2))
    far = np.abs(middle) + half
    for factor, powers, moduli in terms:
        sign = np.where(moduli, np.sign(middle), 1.0).prod(-1)
        at = factor * sign
        value = value + at * _monomial(middle, powers)
        for i in range(3):
            once = _lowered(powers, i)
            if once is None:
                continue
            gradient[:, i] += at * powers[i] * _monomial(middle, once) * half[:, i]
            for j in range(3):
                twice = _lowered(once, j)
                if twice is not None:
                    rise = abs(factor) * powers[i] * once[j] * _monomial(far, twice)
                    curved = curved + 0.5 * rise * half[:, i] * half[:, j]
    if force is not None:
        value = value - np.abs(middle) @ force
        gradient = gradient - np.sign(middle) * force * half
    loose = (most * slack).sum(-1)
    return value - loose, value + np.abs(gradient).sum(-1) + curved + loose


def _crossing(vehicle: Vehicle, middle: Array, half: Array) -> Array:
    """Power of cross-flow drag [W] at the middle of cells, and an upper bound on it in them, (2, k)."""
    coefficient = vehicle.values["cross_flow"]
    if not coefficient:
        return np.zeros((2, middle.shape[0]))
    hull = hull_of(vehicle)
    here, _ = power_bounds(hull.length, hull.draught, middle, 0.0 * half)
    least, most = power_bounds(hull.length, hull.draught, middle, half)
    return -coefficient * np.stack([here, least if coefficient > 0.0 else most])


def _monomials(vehicle: Vehicle) -> list[tuple[float, tuple[int, int, int], Array]]:
    """The power of each damping term: its coefficient, exponents of u, v, r, and where an odd count of moduli is."""
    result = []
    for value, axis, form in active_terms(vehicle):
        powers, moduli = [0, 0, 0], np.zeros(3, dtype=int)
        powers[axis] += 1
        for factor in form.factors:
            k = "uvr".index(factor.strip("|"))
            powers[k] += 1
            moduli[k] += factor.startswith("|")
        result.append((value, (powers[0], powers[1], powers[2]), moduli % 2 == 1))
    return result


def _monomial(x: Array, powers: tuple[int, int, int]) -> Array:
    return x[:, 0] ** powers[0] * x[:, 1] ** powers[1] * x[:, 2] ** powers[2]


def _lowered(powers: tuple[int, int, int], axis: int) -> tuple[int, int, int] | None:
    """Exponents after a derivative; None where it is zero."""
    if powers[axis] == 0:
        return None
    found = list(powers)
    found[axis] -= 1
    return found[0], found[1], found[2]


def _orthants(envelope: Envelope) -> Array:
    """Middles and half sides (2, k, 3) of the parts of the envelope in which no velocity changes its sign."""
    far = np.array(envelope.orthants)
    return np.stack([0.5 * far, 0.5 * np.abs(far)])


def _halved(cells: Array, width: Array) -> Array:
    """Each cell in two, across the side that is longest as a share of the envelope."""
    middle, half = cells
    rows = np.arange(middle.shape[0])
    axis = np.argmax(half / width, axis=1)
    half = half.copy()
    half[rows, axis] *= 0.5
    step = np.zeros_like(half)
    step[rows, axis] = half[rows, axis]
    return np.stack([np.concatenate([middle - step, middle + step]), np.concatenate([half, half])])
