"""Cross-flow drag by strip theory: the force of water that crosses a hull, strip by strip along its length.

Fossen (2021), eq. 6.91 ff., and Faltinsen, *Sea Loads on Ships and Offshore Structures* (1990), chapter 6: each section
of the hull is dragged like a cylinder across the flow, by its own sway speed w(x) = v_r + x r,

    Y = -1/2 rho C_d T integral |w| w dx,    N = -1/2 rho C_d T integral x |w| w dx,    |x| <= L / 2.

One coefficient C_d serves the whole length. The integral is a sum over twenty strips, each at its middle (midpoint
rule), everywhere: in simulation, columns and exports. In pure sway the sum is exact, Y = -1/2 rho C_d T L v |v|; in
pure yaw N = -1/2 rho C_d T r |r| L^4 / 32 comes out half a per cent too small.

Its power is never positive: v Y + r N = -1/2 rho C_d T sum |w|^3 dx, since the power of a strip is its force times its
own speed. So C_d >= 0 takes energy out at every state, and D of it is positive semidefinite: a sum of
|w| dx [0, 1, x]^T [0, 1, x].
"""

from typing import Any

import numpy as np

from .frames import Array

STRIPS = 20
"""Strips of the hull; an even number, so that they come in pairs about the origin."""
DENSITY = 1025.0
"""Of the water [kg/m^3]: sea water at 15 degrees (Fossen 2021). In fresh water C_d comes out 2.4 % too small."""
SHARES: tuple[float, ...] = tuple((k + 0.5) / STRIPS for k in range(STRIPS // 2))
"""Places of the strips ahead of the origin, as shares of the length; those abaft lie as far behind it."""
FORCES: tuple[tuple[int, str], ...] = ((1, "F_Y"), (2, "F_N"))
"""Axis and name of the forces that a hull of C_d = 1 resists with, as the momentum balance has them [N, N m]."""


def pressure_width(length: Any, draught: Any) -> Any:
    """1/2 rho T dx [kg/m]: what a strip of C_d = 1 makes of |w| w."""
    return 0.5 * DENSITY * draught * length / STRIPS


def pair_forces(place: Any, sway_speed: Any, yaw_rate: Any) -> tuple[Any, Any]:
    """|w| w of the strips at plus and minus a place [m], summed, and its moment; all of them broadcast.

    In pairs what cancels on paper cancels to the bit: pure sway turns no hull, pure yaw pushes none aside.
    """
    turning = place * yaw_rate
    ahead, abaft = sway_speed + turning, sway_speed - turning
    ahead, abaft = abs(ahead) * ahead, abs(abaft) * abaft
    return ahead + abaft, place * (ahead - abaft)


def cross_flow_forces(length: float, draught: float, sway_speed: Any, yaw_rate: Any) -> tuple[Any, Any]:
    """F_Y [N] and F_N [N m]: what a hull of C_d = 1 resists with.

    Parameters
    ----------
    length, draught : of the hull [m]
    sway_speed, yaw_rate : relative to the water [m/s, rad/s], of one shape; arrays, tensors or symbols
    """
    force, moment = 0.0 * sway_speed, 0.0 * yaw_rate
    for share in SHARES:
        both, turned = pair_forces(share * length, sway_speed, yaw_rate)
        force, moment = force + both, moment + turned
    width = pressure_width(length, draught)
    return width * force, width * moment


def cross_flow_matrix(length: float, draught: float, sway_speed: Array, yaw_rate: Array) -> Array:
    """D (..., 3, 3) of C_d = 1, with D nu_r = (0, F_Y, F_N); positive semidefinite at every state."""
    shares = np.array(SHARES)
    place = length * np.concatenate([-shares[::-1], shares])
    crossing = np.abs(np.asarray(sway_speed)[..., None] + place * np.asarray(yaw_rate)[..., None])
    arms = np.stack([0.0 * place, 1.0 + 0.0 * place, place])
    return pressure_width(length, draught) * np.einsum("...s,is,js->...ij", crossing, arms, arms)


def power_bounds(length: float, draught: float, middle: Array, half: Array) -> tuple[Array, Array]:
    """Least and most power [W] that C_d = 1 takes out of a hull in boxes of velocities, (k,) each.

    Parameters
    ----------
    middle, half : (k, 3) middles and half sides of the boxes [m/s, m/s, rad/s]
    """
    shares = np.array(SHARES)
    place = length * np.concatenate([-shares, shares])
    speed = np.abs(middle[:, 1:2] + place * middle[:, 2:])
    spread = half[:, 1:2] + np.abs(place) * half[:, 2:]
    width = pressure_width(length, draught)
    least = width * (np.maximum(speed - spread, 0.0) ** 3).sum(axis=1)
    return least, width * ((speed + spread) ** 3).sum(axis=1)
