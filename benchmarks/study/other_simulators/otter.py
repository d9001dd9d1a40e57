"""Fossen's Otter in six degrees of freedom, rebuilt from `otter.py` of PythonVehicleSimulator and the Handbook.

A catamaran of 2 m by Maritime Robotics with a payload on deck. Kirchhoff's equations (Fossen 2021, theorem 3.2) for the
momenta of body and added mass, linear damping by time constants, cross-flow drag of 21 strips with Hoerner's
coefficient, linear restoring about the centre of flotation, and the payload's weight, which is turned into the body's
axes where buoyancy is not: with the trim that it causes it acts as a constant force ahead. Propellers follow with a lag
of 0.1 s, and their thrust goes with the square of shaft speed.
"""

from math import cos, sin, sqrt, tan
from typing import Any

import numpy as np

from undertow.physics.vehicle import vehicle_from_dict

from .craft import Craft, Equations, Loads, Numbers, State
from .vessels import ALL

RHO, RHO_STRIPS, GRAVITY = 1025.0, 1026.0, 9.81
LENGTH, BEAM, PONTOON, ARM = 2.0, 1.08, 0.25, 0.395
K_AHEAD, K_ASTERN = 0.02216 / 2.0, 0.01289 / 2.0
LAG = 0.1
STEP = 0.025
HULL, HULL_CG = 55.0, np.array([0.2, 0.0, -0.2])
N_MAX, N_MIN = sqrt(0.5 * 24.4 * GRAVITY / K_AHEAD), -sqrt(0.5 * 13.6 * GRAVITY / K_ASTERN)
_HOERNER = (
    (0.0109, 0.1766, 0.3530, 0.4519, 0.4728, 0.4929, 0.4933, 0.5585, 0.6464, 0.8336),
    (1.9661, 1.9657, 1.8976, 1.7872, 1.5837, 1.2786, 1.2108, 1.0836, 0.9986, 0.8796),
)
"""Beam over twice the draught, and drag coefficient of a section (Hoerner 1965), as far as this hull needs them."""


def skew(a: np.ndarray) -> np.ndarray:
    """The matrix S(a) with S(a) b = a x b (Fossen 2021, eq. 2.10)."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def thrust(n: float) -> float:
    """Force of a propeller [N] at a shaft speed [rad/s]."""
    n = min(max(n, N_MIN), N_MAX)
    return (K_AHEAD if n > 0.0 else K_ASTERN) * n * abs(n)


def otter(
    rng: np.random.Generator,
    *,
    cross_flow: bool = True,
    statics: bool = True,
    drawn: bool = True,
    hull: bool = False,
) -> Craft:
    """An Otter under a payload that is drawn, or the one of the source (25 kg at 0.05 m ahead).

    Parameters
    ----------
    cross_flow : strips resist sway and turning; the file has them as Y_vv and N_rr, which is all that it can hold
    statics : the payload's weight acts, with its constant force ahead that the file does not know
    hull : the file has `hull: {length, draught}` for the catalogue's cross-flow drag, and nothing else of the strips
    """
    payload, ahead = (float(rng.uniform(10.0, 40.0)), float(rng.uniform(0.0, 0.12))) if drawn else (25.0, 0.05)
    place = np.array([ahead, 0.0, -0.35])
    mass = HULL + payload
    cg = (HULL * HULL_CG + payload * place) / mass
    about = HULL * np.diag([(0.4 * BEAM) ** 2, (0.25 * LENGTH) ** 2, (0.25 * LENGTH) ** 2])
    about = about - HULL * skew(cg) @ skew(cg) - payload * skew(place) @ skew(place)
    origin = about - mass * skew(cg) @ skew(cg)  # the source shifts twice
    numbers: dict[str, float] = {
        "mass": mass,
        "inertia_z": float(origin[2, 2]),
        "x_g": float(cg[0]),
        "y_g": 0.0,
        "z_g": float(cg[2]),
        "I_x": float(origin[0, 0]),
        "I_y": float(origin[1, 1]),
        "I_xz": float(origin[0, 2]),
        "X_udot": -0.1 * HULL,
        "Y_vdot": -1.5 * HULL,
        "Z_wdot": -HULL,
        "K_pdot": -0.2 * float(about[0, 0]),
        "M_qdot": -0.8 * float(about[1, 1]),
        "N_rdot": -1.7 * float(about[2, 2]),
    }
    draught = mass / RHO / (2.0 * 0.4 * PONTOON * LENGTH)
    c_d = float(np.interp(PONTOON / (2.0 * draught), *_HOERNER)) if cross_flow else 0.0
    size = 0.5 * RHO_STRIPS * draught * c_d
    places = np.linspace(-0.5 * LENGTH, 0.5 * LENGTH, 21)
    stiff, centred = _restoring(mass, draught, float(cg[2]))
    M = _mass_matrix(numbers)
    N_r = -float(M[5, 5])
    damped = {"X_u": -24.4 * GRAVITY / (6.0 * 0.5144), "Y_v": -float(M[1, 1]), "N_r": N_r}
    soft = [2.0 * z * sqrt(centred[k] * M[k, k]) for z, k in ((0.3, 2), (0.2, 3), (0.4, 4))]
    weight = payload * GRAVITY if statics else 0.0
    plane = (
        damped | {"N_rr": 10.0 * N_r}
        if hull
        else damped
        | {
            "Y_vv": -size * LENGTH / 20.0 * 21.0,
            "N_rr": 10.0 * N_r - size * LENGTH / 20.0 * float(np.sum(np.abs(places) ** 3)),
        }
    )
    shape = {"hull": {"length": LENGTH, "draught": draught}} if hull else {}
    file = vehicle_from_dict(_file(numbers, plane) | shape, "Otter")
    still = _at_rest(stiff, weight, place)
    law = _equations(
        damped | {"N_rr": 10.0 * N_r}, soft, stiff.tolist(), (weight, ahead, -0.35), (size, places.tolist())
    )
    own = {"surge_trim": ("surge_trim", -weight * sin(still[4]))} if statics else {}
    own |= {"cross_flow_drag": ("cross_flow", c_d)} if hull else {}
    return Craft(
        *("Otter", file, numbers, law, (thrust, thrust), ((N_MIN, N_MAX), (N_MIN, N_MAX))),
        step=STEP,
        pace=1.0,
        length=LENGTH,
        exact=ALL - set(own),
        lag=LAG,
        stages=2,
        places=(0, 1, 5, 6, 7, 11),
        rest=(*still, *[0.0] * 6),
        own=own,
    )


def _file(numbers: Numbers, damped: Numbers) -> dict[str, Any]:
    table = np.concatenate([np.linspace(N_MIN, 0.0, 41), np.linspace(0.0, N_MAX, 41)[1:]])
    curve = {"kind": "table", "command": table.tolist(), "force": [thrust(n) for n in table.tolist()]}
    unit = {"x": 0.0, "angle": 0.0, "command": "rad_s", "lag": LAG, "curve": curve}
    return {
        "name": "Otter",
        **{symbol: numbers[symbol] for symbol in ("mass", "inertia_z", "x_g")},
        "added_mass": {symbol: numbers[symbol] for symbol in ("X_udot", "Y_vdot", "N_rdot")},
        "damping": dict(damped),
        "thrusters": [{"name": name, "y": y, **unit} for name, y in (("port", -ARM), ("stbd", ARM))],
    }


def _mass_matrix(p: Numbers) -> np.ndarray:
    cg = np.array([p["x_g"], p["y_g"], p["z_g"]])
    matrix = np.diag([p["mass"]] * 3 + [p["I_x"], p["I_y"], p["inertia_z"]])
    matrix[3, 5] = matrix[5, 3] = p["I_xz"]
    matrix[:3, 3:], matrix[3:, :3] = -p["mass"] * skew(cg), p["mass"] * skew(cg)
    return matrix - np.diag([p[s] for s in ("X_udot", "Y_vdot", "Z_wdot", "K_pdot", "M_qdot", "N_rdot")])


def _restoring(mass: float, draught: float, z_g: float) -> tuple[np.ndarray, list[float]]:
    """Linear restoring (Fossen 2021, section 4.2) about the origin, and about the centre of flotation 0.2 m aft."""
    volume, waterplane, fill = mass / RHO, 0.75 * LENGTH * PONTOON, 0.75
    shape = 6.0 * fill**3 / ((1.0 + fill) * (1.0 + 2.0 * fill))
    across = 2.0 / 12.0 * LENGTH * PONTOON**3 * shape + 2.0 * waterplane * ARM**2
    along = 0.8 * 2.0 / 12.0 * PONTOON * LENGTH**3
    keel = (2.5 * draught - 0.5 * volume / (LENGTH * PONTOON)) / 3.0 - (draught - z_g)
    weight = RHO * GRAVITY
    centred = np.diag(
        [0.0, 0.0, weight * 2.0 * waterplane, weight * (volume * keel + across), weight * (volume * keel + along), 0.0]
    )
    shift = np.identity(6)
    shift[:3, 3:] = skew(np.array([-0.2, 0.0, 0.0])).T
    return shift.T @ centred @ shift, np.diag(centred).tolist()


def _at_rest(stiff: np.ndarray, weight: float, place: np.ndarray) -> list[float]:
    """Where the payload's weight makes it lie: x, y, z, roll, pitch, heading."""
    z = pitch = 0.0
    for _ in range(50):
        down, moment = weight * cos(pitch), -weight * (place[2] * sin(pitch) + place[0] * cos(pitch))
        z, pitch = np.linalg.solve(stiff[np.ix_([2, 4], [2, 4])], [down, moment]).tolist()
    return [0.0, 0.0, z, 0.0, pitch, 0.0]


def _equations(
    damped: Numbers,
    soft: list[float],
    stiff: list[list[float]],
    payload: tuple[float, float, float],
    strips: tuple[float, list[float]],
) -> Any:
    X_u, Y_v, N_r, N_rr = (damped[s] for s in ("X_u", "Y_v", "N_r", "N_rr"))
    weight, ahead, low = payload
    size, places = strips[0] * LENGTH / 20.0, strips[1]
    g33, g35, g44, g53, g55 = stiff[2][2], stiff[2][4], stiff[3][3], stiff[4][2], stiff[4][4]

    def equations(p: Numbers) -> Equations:
        mass = _mass_matrix(p)
        M, inverse = mass.tolist(), np.linalg.inv(mass).tolist()

        def rates(s: State, loads: Loads, water: tuple[float, float]) -> State:
            _, _, z, phi, theta, psi, u, v, w, pr, q, r = s
            cf, sf, ct, st, cp, sp = cos(phi), sin(phi), cos(theta), sin(theta), cos(psi), sin(psi)
            along, across = cp * water[0] + sp * water[1], cp * water[1] - sp * water[0]
            ur, vr = u - along, v - across
            p1, p2, p3, h1, h2, h3 = (a * ur + b * vr + c * w + d * pr + e * q + f * r for a, b, c, d, e, f in M)
            fx, fy, fz = -st * weight, ct * sf * weight, ct * cf * weight
            drag = turning = 0.0
            if size:
                for x in places:
                    flow = vr + x * r
                    local = size * flow * abs(flow)
                    drag, turning = drag - local, turning - x * local
            R1 = loads[0] + X_u * ur + fx - (q * p3 - r * p2)
            R2 = loads[1] + Y_v * vr + drag + fy - (r * p1 - pr * p3)
            R3 = fz - g33 * z - g35 * theta - soft[0] * w - (pr * p2 - q * p1)
            R4 = -low * fy - g44 * phi - soft[1] * pr - (q * h3 - r * h2) - (vr * p3 - w * p2)
            R5 = low * fx - ahead * fz - g53 * z - g55 * theta - soft[2] * q - (r * h1 - pr * h3) - (w * p1 - ur * p3)
            R6 = loads[2] + (N_r + N_rr * abs(r)) * r + turning + ahead * fy - (pr * h2 - q * h1) - (ur * p2 - vr * p1)
            ax, ay, *rest = (a * R1 + b * R2 + c * R3 + d * R4 + e * R5 + f * R6 for a, b, c, d, e, f in inverse)
            turn = q * sf + r * cf
            return [
                cp * ct * u + (cp * st * sf - sp * cf) * v + (sp * sf + cp * cf * st) * w,
                sp * ct * u + (cp * cf + sf * st * sp) * v + (st * sp * cf - cp * sf) * w,
                -st * u + ct * sf * v + ct * cf * w,
                pr + tan(theta) * turn,
                q * cf - r * sf,
                turn / ct,
                ax + r * across,
                ay - r * along,
                *rest,
            ]

        return rates

    return equations
