"""Boats of another simulator, for the study of foreign worlds: equations in plain numbers, several integrators.

The plane is Fossen's 3-DOF model, M nu_r' + C(nu_r) nu_r + D(nu_r) nu_r = tau + other (Handbook of Marine Craft
Hydrodynamics and Motion Control, 2nd ed. 2021, sections 6.5 and 10.3), multiplied out by hand. The boat in six degrees
of freedom follows Kirchhoff: p1' = F - w x p1 and p2' = tau - w x p2 - v x p1 with momenta (p1, p2) = M (v, w), which
is what Fossen's theorem 3.2 says.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import cos, exp, sin, tan

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
State = list[float]
Rates = Callable[[int, float, State], State]
"""Derivative of a state from the number of the step, the time [s] and the state."""
Push = Sequence[Sequence[float]]
"""Force of the thrusters ahead, to starboard and in yaw [N, N, N m] in each step."""
Force = Callable[[int, float, State], tuple[float, float, float]]
"""Another force [N, N, N m], from the number of the step, the time [s] and the state."""
Current = Callable[[float], tuple[float, float, float, float]]
"""Velocity of the water north and east [m/s] and how fast that changes [m/s^2], from the time [s]."""
GRAVITY, WATER = 9.81, 1025.0


def planar(
    values: Mapping[str, float],
    push: Push,
    force: Force | None = None,
    current: Current | None = None,
    growth: Callable[[float], float] | None = None,
) -> Rates:
    """A boat in the plane: state x, y, psi, u, v, r over ground.

    Parameters
    ----------
    values : mass, inertia_z, x_g, y_g and the derivatives of SNAME by symbol; what is absent is zero
    push : of the thrusters
    force : what acts beside them
    current : velocity of the water; still water when None
    growth : factor of all damping at a time
    """
    p = {**dict.fromkeys(_SYMBOLS, 0.0), **{k: float(v) for k, v in values.items()}}
    m, x_g, y_g = p["mass"], p["x_g"], p["y_g"]
    m11, m22, m33 = m - p["X_udot"], m - p["Y_vdot"], p["inertia_z"] - p["N_rdot"]
    m13, m23 = -m * y_g, m * x_g - p["Y_rdot"]
    inverse = np.linalg.inv(np.array([[m11, 0.0, m13], [0.0, m22, m23], [m13, m23, m33]]))
    (a, b, c), (_, d, e), (_, _, f) = inverse.tolist()
    X_u, X_uu, Y_v, Y_vv, N_r, N_rr = (p[s] for s in _SYMBOLS[:6])
    Y_r, N_v, N_uv, Y_ur, X_vr, N_ur = (p[s] for s in _SYMBOLS[6:12])
    north, east = p["wind_force_north"], p["wind_force_east"]
    trim = p["surge_trim"], p["sway_trim"], p["yaw_trim"]
    windy = bool(north or east)

    def rates(k: int, t: float, s: State) -> State:
        psi, u, v, r = s[2], s[3], s[4], s[5]
        co, si = cos(psi), sin(psi)
        if current is None:
            ur, vr, du_c, dv_c = u, v, 0.0, 0.0
        else:
            cn, ce, dn, de = current(t)
            ahead, aside = co * cn + si * ce, co * ce - si * cn
            ur, vr = u - ahead, v - aside
            du_c, dv_c = r * aside + co * dn + si * de, co * de - si * dn - r * ahead
        drag = 1.0 if growth is None else growth(t)
        tau = push[k]
        X = tau[0] + trim[0] + drag * (X_u + X_uu * abs(ur)) * ur + (m22 * vr + m23 * r) * r + X_vr * vr * r
        Y = tau[1] + trim[1] + drag * (Y_v + Y_vv * abs(vr)) * vr - (m11 * ur + m13 * r) * r + Y_r * r + Y_ur * ur * r
        N = tau[2] + trim[2] + drag * (N_r + N_rr * abs(r) + N_ur * abs(ur)) * r + N_v * vr + N_uv * ur * vr
        N += (m11 - m22) * ur * vr - m23 * ur * r + m13 * vr * r
        if windy:
            X, Y = X + co * north + si * east, Y + co * east - si * north
        if force is not None:
            more = force(k, t, s)
            X, Y, N = X + more[0], Y + more[1], N + more[2]
        return [
            u * co - v * si,
            u * si + v * co,
            r,
            a * X + b * Y + c * N + du_c,
            b * X + d * Y + e * N + dv_c,
            c * X + e * Y + f * N,
        ]

    return rates


_SYMBOLS = (
    *("X_u", "X_uu", "Y_v", "Y_vv", "N_r", "N_rr", "Y_r", "N_v", "N_uv", "Y_ur", "X_vr", "N_ur"),
    *("mass", "inertia_z", "x_g", "y_g", "X_udot", "Y_vdot", "N_rdot", "Y_rdot"),
    *("wind_force_north", "wind_force_east", "surge_trim", "sway_trim", "yaw_trim"),
)


@dataclass(frozen=True, slots=True)
class Body:
    """What a boat in the plane does not know of itself.

    Attributes
    ----------
    z_g : centre of gravity below the origin, which is on the waterline [m]
    roll, pitch, heave : natural frequencies of its restoring [rad/s]
    damped : shares of critical damping of the three
    inertia_x, inertia_y : about the origin, water included [kg m^2]
    deep : depth at which sway drag acts [m]
    shaft : depth of the thrusters [m]
    """

    z_g: float
    roll: float
    pitch: float
    heave: float
    damped: tuple[float, float, float]
    inertia_x: float
    inertia_y: float
    deep: float
    shaft: float


def spatial(values: Mapping[str, float], push: Push, body: Body) -> Rates:
    """A boat in six degrees of freedom: x, y, z, roll, pitch, heading; u, v, w, p, q, r."""
    g = {**dict.fromkeys(_SYMBOLS, 0.0), **{k: float(v) for k, v in values.items()}}
    m, xg, yg, zg = g["mass"], g["x_g"], g["y_g"], body.z_g
    mass = np.diag([m, m, m, body.inertia_x, body.inertia_y, g["inertia_z"]])
    lever = m * np.array([[0.0, zg, -yg], [-zg, 0.0, xg], [yg, -xg, 0.0]])
    mass[:3, 3:], mass[3:, :3] = lever, lever.T
    mass += np.diag([-g["X_udot"], -g["Y_vdot"], m, 0.0, 0.0, -g["N_rdot"]])
    mass[1, 5] -= g["Y_rdot"]
    mass[5, 1] -= g["Y_rdot"]
    M, inverse = mass.tolist(), np.linalg.inv(mass).tolist()
    stiff = [w * w * mass[k, k] for w, k in ((body.heave, 2), (body.roll, 3), (body.pitch, 4))]
    soft = [
        2.0 * z * w * mass[k, k]
        for z, w, k in zip(body.damped, (body.roll, body.pitch, body.heave), (3, 4, 2), strict=True)
    ]
    deep, shaft = body.deep, body.shaft

    def rates(k: int, t: float, s: State) -> State:
        z, phi, theta, psi = s[2], s[3], s[4], s[5]
        nu = s[6:]
        u, v, w, p, q, r = nu
        p1, p2, p3, h1, h2, h3 = (sum([x * y for x, y in zip(row, nu, strict=True)]) for row in M)
        low = v - deep * p
        tau = push[k]
        X = tau[0] + (g["X_u"] + g["X_uu"] * abs(u)) * u + g["X_vr"] * v * r
        drag = (g["Y_v"] + g["Y_vv"] * abs(low)) * low + g["Y_r"] * r + g["Y_ur"] * u * r
        N = tau[2] + (g["N_r"] + g["N_rr"] * abs(r) + g["N_ur"] * abs(u)) * r + g["N_v"] * v + g["N_uv"] * u * v
        right = (
            X - (q * p3 - r * p2),
            tau[1] + drag - (r * p1 - p * p3),
            -stiff[0] * z - soft[2] * w - (p * p2 - q * p1),
            -stiff[1] * sin(phi) - soft[0] * p - deep * drag - (q * h3 - r * h2) - (v * p3 - w * p2),
            shaft * tau[0] - stiff[2] * sin(theta) - soft[1] * q - (r * h1 - p * h3) - (w * p1 - u * p3),
            N - (p * h2 - q * h1) - (u * p2 - v * p1),
        )
        cf, sf, ct, st, cp, sp = cos(phi), sin(phi), cos(theta), sin(theta), cos(psi), sin(psi)
        turn = q * sf + r * cf
        return [
            cp * ct * u + (cp * st * sf - sp * cf) * v + (sp * sf + cp * cf * st) * w,
            sp * ct * u + (cp * cf + sf * st * sp) * v + (st * sp * cf - cp * sf) * w,
            -st * u + ct * sf * v + ct * cf * w,
            p + tan(theta) * turn,
            q * cf - r * sf,
            turn / ct,
            *[sum([x * y for x, y in zip(row, right, strict=True)]) for row in inverse],
        ]

    return rates


def _rk4(rates: Rates, k: int, t: float, s: State, h: float) -> State:
    a = rates(k, t, s)
    half = 0.5 * h
    b = rates(k, t + half, [x + half * y for x, y in zip(s, a, strict=True)])
    c = rates(k, t + half, [x + half * y for x, y in zip(s, b, strict=True)])
    d = rates(k, t + h, [x + h * y for x, y in zip(s, c, strict=True)])
    sixth = h / 6.0
    return [x + sixth * (p + 2.0 * (q + r) + w) for x, p, q, r, w in zip(s, a, b, c, d, strict=True)]


def _euler(rates: Rates, k: int, t: float, s: State, h: float) -> State:
    return [x + h * y for x, y in zip(s, rates(k, t, s), strict=True)]


def _semi_implicit(rates: Rates, k: int, t: float, s: State, h: float) -> State:
    """Velocities first, then places with the new velocities, as the physics engines of Gazebo do."""
    half = len(s) // 2
    found = rates(k, t, s)
    moved = [x + h * y for x, y in zip(s[half:], found[half:], strict=True)]
    turned = rates(k, t, [*s[:half], *moved])[:half]
    return [*[x + h * y for x, y in zip(s[:half], turned, strict=True)], *moved]


INTEGRATORS = {"rk4": _rk4, "euler": _euler, "semi-implicit": _semi_implicit}


def driven(rates: Rates, start: State, steps: int, h: float, integrator: str = "rk4", first: int = 0) -> Array:
    """States (steps + 1, n) from a start on an even grid; the first step has this number."""
    step, state, found = INTEGRATORS[integrator], list(start), [list(start)]
    for k in range(first, first + steps):
        state = step(rates, k, k * h, state, h)
        found.append(state)
    return np.array(found)


def lagged(series: Array, lag: float, h: float) -> Array:
    """What a first-order lag [s] makes of a series that is held between rows."""
    left, found = exp(-h / lag), np.empty_like(series)
    now = series[0]
    for k, value in enumerate(series):
        found[k] = now = value + (now - value) * left
    return found


def wandering(rng: np.random.Generator, count: int, memory: float, h: float) -> Array:
    """Noise (count,) of standard deviation one that remembers for so long [s], on an even grid [s]."""
    drawn = rng.standard_normal(count)
    drawn[1:] *= np.sqrt(2.0 * memory / h)
    return lagged(drawn, memory, h)


def play(series: Array, half: float) -> Array:
    """What a backlash of this half width makes of a series (n, k): the output moves when the slack is taken up."""
    found, now = np.empty_like(series), series[0]
    for k, value in enumerate(series):
        found[k] = now = np.clip(now, value - half, value + half)
    return found


def slewed(series: Array, most: float) -> Array:
    """What a limit of the change in a step makes of a series (n, k)."""
    found, now = np.empty_like(series), series[0]
    for k, value in enumerate(series):
        found[k] = now = now + np.clip(value - now, -most, most)
    return found
