"""Simulators in the plane, rebuilt from their mathematics: two vessels of MCSimPython, VRX's WAM-V, strips, Nomoto.

Each gives its equations in plain floats and a vehicle file that is the same boat in Fossen's form, by linear algebra
from the simulator's own numbers. What that form cannot hold is said with each.
"""

from collections.abc import Mapping
from math import exp, sqrt
from typing import Any

import numpy as np

from undertow.physics.vehicle import Vehicle, vehicle_from_dict

from .craft import Craft, Equations, Law, Loads, Numbers, State, damping, moved_by

WATER, GRAVITY = 1025.0, 9.81
STRIPS = 20
_THRUST = ("thrust_scale", "thruster_asymmetry", "thruster_arm", "battery_sag", "thrust_dead_zone", "thruster_lag")
_SHAPE = ("input_delay", "advance_loss", "reverse_thrust_loss", "thrust_exponent")
_DRAG = (
    *("surge_linear_damping", "surge_quadratic_damping", "sway_linear_damping", "sway_quadratic_damping"),
    *("yaw_linear_damping", "yaw_quadratic_damping", "yaw_speed_damping", "sway_yaw_coupling", "munk_moment"),
    *("sway_lift", "surge_turn_drag"),
)
_FIXED = ("mean_wind", "yaw_trim", "surge_trim", "sway_trim")
_MASS = ("mass_offset", "cg_offset", "surge_added_mass", "sway_added_mass")
COMMON = frozenset((*_THRUST, *_SHAPE, *_DRAG, *_FIXED, "yaw_added_mass", "steady_current"))
"""Effects that every simulator here can make: whoever gives it loads decides what they are."""
ALL = COMMON | {*_MASS, "lateral_cg"}
_SWIFT = {"sway_quadratic_damping", "yaw_quadratic_damping", "munk_moment", "sway_lift", "surge_turn_drag"}
"""Effects that no number which a hull can have makes felt at the speeds of a model basin."""


def inverse(matrix: list[list[float]]) -> list[list[float]]:
    """The inverse of a mass matrix, in plain floats."""
    return np.linalg.inv(np.array(matrix)).tolist()


def pushing(name: str, x: float, y: float, angle: float, low: float, high: float) -> dict[str, Any]:
    """A thruster of a file that takes newtons."""
    forces = [low, 0.0, high]
    curve = {"kind": "table", "command": forces, "force": forces}
    return {"name": name, "x": x, "y": y, "angle": angle, "command": "newton", "curve": curve}


def newtons(thrusters: list[dict[str, Any]]) -> dict[str, Any]:
    """Laws and ends of thrusters that take newtons."""
    ends = tuple((t["curve"]["command"][0], t["curve"]["command"][-1]) for t in thrusters)
    return {"ends": ends, "laws": tuple(_clipped(low, high) for low, high in ends)}


def _clipped(low: float, high: float) -> Law:
    return lambda command: min(max(command, low), high)


def csad(rng: np.random.Generator) -> Craft:
    """C/S Arctic Drillship, the manoeuvring model of MCSimPython 0.1.6 (`CSADMan3DOF`, NTNU 2023).

    M nu' = tau - (D + B_v) nu_r + M_A nu_c', without any Coriolis force; the file takes away those of Fossen's form.
    Added mass and potential damping are those of the highest frequency of its data. With a current, Fossen's form
    turns the rigid body's momentum with the water, and this model does not: 0.6 N at 0.1 m/s and 0.05 rad/s; its
    nu_c' has a third component, of u and v, which is kept. Three thrusters are fixed to the hull, 16 N each.
    """
    numbers = {
        "mass": 127.51217,
        "inertia_z": 61.768936,
        "X_udot": -1.484425838729,
        "Y_vdot": -11.632231,
        "N_rdot": -8.3942728,
        "Y_rdot": -0.59218287,
    }
    damped = {
        "X_u": -(68.713256245077 + 16.433281209944),
        "Y_v": -(538.44958 + 128.774182),
        "N_r": -(225.60416 + 50.508194),
        "Y_r": -43.089149,
        "N_v": -43.089149,
    }
    thrusters = [
        pushing("port", -1.0, -0.25, 0.0, -16.0, 16.0),
        pushing("stbd", -1.0, 0.25, 0.0, -16.0, 16.0),
        pushing("bow", 0.9, 0.0, np.pi / 2.0, -16.0, 16.0),
    ]

    def equations(p: Numbers) -> Equations:
        (_, m11), (_, m22), (_, m33) = (
            (0, p[m] - p[a]) for m, a in (("mass", "X_udot"), ("mass", "Y_vdot"), ("inertia_z", "N_rdot"))
        )
        m23, a11, a22, a33 = -p["Y_rdot"], -p["X_udot"], -p["Y_vdot"], -p["N_rdot"]
        over = m22 * m33 - m23 * m23
        drag = damping(damped)

        def rates(s: State, loads: Loads, water: tuple[float, float]) -> State:
            kin, rel, (duc, dvc) = moved_by(s, water)
            X, Y, N = drag(0.0, (0.0, 0.0, 0.0, *rel), ())
            slip = (s[4] - rel[1]) * s[3] - (s[3] - rel[0]) * s[4]
            X, Y = X + loads[0] + a11 * duc, Y + loads[1] + a22 * dvc - m23 * slip
            N += loads[2] + m23 * dvc - a33 * slip
            return [*kin, X / m11, (m33 * Y - m23 * N) / over, (m22 * N - m23 * Y) / over]

        return rates

    m11, m22, m23 = (
        numbers["mass"] - numbers["X_udot"],
        numbers["mass"] - numbers["Y_vdot"],
        -numbers["Y_rdot"],
    )
    file = vehicle_from_dict(
        {
            "name": "C/S Arctic Drillship",
            **split(numbers, damped),
            "coupling": {"X_vr": -m22, "Y_ur": m11, "N_uv": m22 - m11},
            "terms": [
                {"axis": "surge", "form": "r^2", "value": -m23},
                {"axis": "yaw", "form": "ur", "value": m23},
            ],
            "thrusters": thrusters,
        },
        "C/S Arctic Drillship",
    )
    return Craft(
        "CSAD", file, numbers, equations, **newtons(thrusters), step=0.05, pace=1.5, length=2.6, exact=COMMON - _SWIFT
    )


def gunnerus(rng: np.random.Generator) -> Craft:
    """R/V Gunnerus, 36 m, the manoeuvring model of MCSimPython 0.1.6 (`GunnerusManeuvering3DoF`, NTNU 2023).

    (M_RB + M_A) nu' = tau - D(nu_r) nu_r - C_RB(nu) nu - C_A(nu_r) nu_r + M_A nu_c' with D = D_l + D_u |u_r| + D_v
    |v_r| + D_r |r|. Its M_A is not symmetric (-473 and -571 t m); the file holds the mean. Two fixed thrusters aft.
    """
    load = float(rng.uniform(0.95, 1.05))
    numbers = {
        "mass": 574127.69 * load,
        "inertia_z": 41237080.0 * load,
        "x_g": 0.0,
        "X_udot": -26599.247217212105,
        "Y_vdot": -132619.44,
        "N_rdot": -13320142.0,
        "Y_rdot": 473277.78,
        "N_vdot": 571162.06,
    }
    damped = {
        "X_u": -1117.598305149,
        "X_uu": -1671.60006965,
        "Y_v": -22288.64,
        "Y_vv": -23611.351393,
        "N_r": -1949686.56,
        "N_rr": -365427333.8257,
    }
    thrusters = [pushing(n, -14.0, y, 0.0, -20000.0, 30000.0) for n, y in (("port", -8.0), ("stbd", 8.0))]

    def equations(p: Numbers) -> Equations:
        m, xg = p["mass"], p["x_g"]
        a11, a22, a33, a23, a32 = -p["X_udot"], -p["Y_vdot"], -p["N_rdot"], -p["Y_rdot"], -p["N_vdot"]
        (_, b, c), (_, d, e) = inverse(
            [[1.0, 0.0, 0.0], [0.0, m + a22, m * xg + a23], [0.0, m * xg + a32, p["inertia_z"] + a33]]
        )[1:]
        mean, m11, drag = 0.5 * (a23 + a32), m + a11, damping(damped)

        def rates(s: State, loads: Loads, water: tuple[float, float]) -> State:
            kin, (ur, vr, r), (duc, dvc) = moved_by(s, water)
            u, v = s[3], s[4]
            X, Y, N = drag(0.0, (0.0, 0.0, 0.0, ur, vr, r), ())
            rigid, added = m * v + m * xg * r, a22 * vr + mean * r
            X += loads[0] + (rigid + added) * r + a11 * duc
            Y += loads[1] - (m * u + a11 * ur) * r + a22 * dvc
            N += loads[2] - rigid * u - added * ur + m * u * v + a11 * ur * vr + a32 * dvc
            return [*kin, X / m11, b * Y + c * N, d * Y + e * N]

        return rates

    in_file = {k: v for k, v in numbers.items() if k != "N_vdot"}
    in_file["Y_rdot"] = 0.5 * (numbers["Y_rdot"] + numbers["N_vdot"])
    file = vehicle_from_dict({"name": "R/V Gunnerus", **split(in_file, damped), "thrusters": thrusters}, "R/V Gunnerus")
    able = COMMON | {*_MASS}
    return Craft(
        "Gunnerus", file, numbers, equations, **newtons(thrusters), step=0.1, pace=8.0, length=36.0, exact=able
    )


def split(numbers: Numbers, damped: Numbers) -> dict[str, Any]:
    """Sections of a vehicle file, of masses and derivatives by symbol."""
    added = ("X_udot", "Y_vdot", "N_rdot", "Y_rdot")
    return {
        **{k: v for k, v in numbers.items() if k not in added},
        "added_mass": {k: v for k, v in numbers.items() if k in added},
        "damping": dict(damped),
    }


def wam_v(rng: np.random.Generator) -> Craft:
    """VRX's WAM-V 16: rigid body and `SimpleHydrodynamics` (Bingham et al. 2019, OCEANS; osrf/vrx, vrx_gz).

    The plugin adds drag and added mass times acceleration; it computes a Coriolis matrix of added mass and leaves it
    out of the sum of forces. Added mass is zero as it is delivered. Hull 180 kg with 446 kg m^2, two engines of 15.5 kg
    at 2.374 m aft and 1.027 m aside, a payload drawn here. Thrust follows two generalised logistic functions of the
    command, within -100 and 250 N (`Thruster`, mapping type 1; the step of 0.04 N at no command is left out).
    """
    payload, place = float(rng.uniform(0.0, 60.0)), float(rng.uniform(-0.5, 0.8))
    mass, x, y = 211.0 + payload, 2.373776, 1.027135
    numbers = {
        "mass": mass,
        "inertia_z": 446.0 + 31.0 * (x * x + y * y) + payload * place**2,
        "x_g": (payload * place - 31.0 * x) / mass,
        "y_g": 0.0,
        "X_udot": 0.0,
        "Y_vdot": 0.0,
        "N_rdot": 0.0,
    }
    damped = {"X_u": -100.0, "X_uu": -150.0, "Y_v": -100.0, "Y_vv": -100.0, "N_r": -800.0, "N_rr": -800.0}
    grid = np.unique(np.concatenate([np.linspace(-1.0, 1.0, 81), [-0.005, 0.0, 0.005, 0.015]])).round(6)
    curve = {"kind": "table", "command": grid.tolist(), "force": [logistic_thrust(c) for c in grid.tolist()]}
    thrusters = [
        {"name": n, "x": -x, "y": side * y, "command": "normalized", "curve": curve}
        for n, side in (("port", -1.0), ("stbd", 1.0))
    ]
    file = vehicle_from_dict({"name": "WAM-V", **split(numbers, damped), "thrusters": thrusters}, "WAM-V")

    def equations(p: Numbers) -> Equations:
        m, xg, yg, drag = p["mass"], p["x_g"], p["y_g"], damping(damped)
        M = [
            [m - p["X_udot"], 0.0, -m * yg],
            [0.0, m - p["Y_vdot"], m * xg],
            [-m * yg, m * xg, p["inertia_z"] - p["N_rdot"]],
        ]
        (a, b, c), (_, d, e), (_, _, f) = inverse(M)

        def rates(s: State, loads: Loads, water: tuple[float, float]) -> State:
            kin, (u, v, r), _ = moved_by(s, (0.0, 0.0))
            X, Y, N = drag(0.0, (0.0, 0.0, 0.0, u, v, r), ())
            X += loads[0] + m * (v + xg * r) * r
            Y += loads[1] - m * (u - yg * r) * r
            N += loads[2] - m * (xg * u + yg * v) * r
            return [*kin, a * X + b * Y + c * N, b * X + d * Y + e * N, c * X + e * Y + f * N]

        return rates

    able = (COMMON - {"steady_current"}) | {"mass_offset", "cg_offset", "lateral_cg"}
    law: Law = logistic_thrust
    return Craft(
        *("WAM-V", file, numbers, equations, (law, law), ((-1.0, 1.0), (-1.0, 1.0))),
        step=0.05,
        pace=2.0,
        length=4.9,
        exact=able,
    )


def logistic_thrust(command: float) -> float:
    """Force [N] of one engine of the WAM-V at a command from -1 to 1."""
    if command == 0.0:
        return 0.0
    if command > 0.01:
        return min(0.01 + 59.81 / (0.56 + exp(-5.0 * (command - 0.28))) ** (1.0 / 0.38), 250.0)
    if command > 0.0:
        return command / 0.01 * logistic_thrust(0.010001)
    found = -199.13 + 199.04 / (0.99 + exp(-8.84 * (command + 0.57))) ** (1.0 / 5.34)
    return max(min(found, 0.0), -100.0)


def strip_drag(length: float, size: float) -> Any:
    """Cross-flow drag of twenty strips: -size |v + x r| (v + x r) a metre (Fossen 2021, eq. 6.91), size in kg/m^2."""
    width = length / STRIPS
    places = [(k + 0.5) * width - 0.5 * length for k in range(STRIPS)]

    def drag(v: float, r: float) -> tuple[float, float]:
        Y = N = 0.0
        for x in places:
            flow = v + x * r
            local = -size * width * flow * abs(flow)
            Y, N = Y + local, N + x * local
        return Y, N

    return drag


def as_quadratic(length: float, size: float) -> dict[str, float]:
    """What strips are in pure sway and in pure turning: Y_vv and N_rr."""
    places = (np.arange(STRIPS) + 0.5) * length / STRIPS - 0.5 * length
    return {"Y_vv": -size * length, "N_rr": -size * length / STRIPS * float(np.sum(np.abs(places) ** 3))}


def strip_boat(rng: np.random.Generator, *, told: bool = True, hull: bool = False) -> Craft:
    """A displacement hull of 1 to 5 m drawn at random, with strip-theory cross-flow drag (Fossen 2021, section 6.7).

    Ratios of small hulls: length over beam 2.2 to 4.5, block coefficient 0.4 to 0.65, added masses of slender bodies
    (Fossen 2021, section 6.5), a Munk moment that viscous lift reduces, top speed at a Froude number of 0.25 to 0.4, a
    turn in one to two lengths at unlike full thrusts.

    Parameters
    ----------
    told : the file has the strips as Y_vv and N_rr, which is all that its plane can hold; else nothing of them
    hull : the file has `hull: {length, draught}` for the catalogue's cross-flow drag, and nothing else of the strips
    """
    length = float(rng.uniform(1.0, 5.0))
    beam = length / float(rng.uniform(2.2, 4.5))
    draught = beam * float(rng.uniform(0.15, 0.3))
    mass = WATER * float(rng.uniform(0.4, 0.65)) * length * beam * draught
    inertia = mass * (0.25 * length) ** 2
    top = float(rng.uniform(0.25, 0.4)) * sqrt(GRAVITY * length)
    way, c_d = float(rng.uniform(2.0, 5.0)) * sqrt(length), float(rng.uniform(0.6, 1.2))
    numbers = {
        "mass": mass,
        "inertia_z": inertia,
        "x_g": float(rng.uniform(-0.03, 0.03)) * length,
        "y_g": 0.0,
        "X_udot": -0.08 * mass,
        "Y_vdot": -float(rng.uniform(0.5, 1.0)) * mass,
        "N_rdot": -float(rng.uniform(0.4, 0.8)) * inertia,
        "Y_rdot": 0.0,
    }
    m11, m22 = mass - numbers["X_udot"], mass - numbers["Y_vdot"]
    sway, full, arm = way * float(rng.uniform(0.3, 0.6)), 0.5 * m11 * top / way, 0.35 * beam
    rate = float(rng.uniform(0.5, 1.0)) * top / length
    own = {
        "X_u": -0.4 * m11 / way,
        "X_uu": -0.6 * m11 / way / top,
        "Y_v": -m22 / sway,
        "N_r": -arm * full / rate,
        "N_uv": float(rng.uniform(0.6, 0.9)) * (m22 - m11),
    }
    size = 0.5 * WATER * c_d * draught
    kept = {k: v for k, v in own.items() if k != "N_uv"} | (as_quadratic(length, size) if told and not hull else {})
    thrusters = [
        pushing(name, -0.45 * length, side * arm, 0.0, -float(rng.uniform(0.6, 1.0)) * full, full)
        for name, side in (("port", -1.0), ("stbd", 1.0))
    ]
    data = {"name": "hull of strips", **split(numbers, kept), "coupling": {"N_uv": own["N_uv"]}, "thrusters": thrusters}
    file = vehicle_from_dict(
        data | ({"hull": {"length": length, "draught": draught}} if hull else {}), "hull of strips"
    )

    def equations(p: Numbers) -> Equations:
        return fossen(p, own, strip_drag(length, size))

    return Craft(
        *("strips", file, numbers, equations),
        **newtons(thrusters),
        step=0.05,
        pace=max(1.0, way / 5.0),
        length=length,
        exact=ALL,
        own={"cross_flow_drag": ("cross_flow", c_d)} if hull else {},
    )


def fossen(p: Numbers, own: Numbers, strips: Any) -> Equations:
    """Fossen's plane (2021, eq. 6.116) with strips beside: M nu_r' + C(nu_r) nu_r = D(nu_r) nu_r + tau."""
    m, xg, yg = p["mass"], p["x_g"], p["y_g"]
    m11, m22, m13, m23 = m - p["X_udot"], m - p["Y_vdot"], -m * yg, m * xg - p["Y_rdot"]
    (a, b, c), (_, d, e), (_, _, f) = inverse(
        [[m11, 0.0, m13], [0.0, m22, m23], [m13, m23, p["inertia_z"] - p["N_rdot"]]]
    )
    drag = damping(own)

    def rates(s: State, loads: Loads, water: tuple[float, float]) -> State:
        kin, (u, v, r), (duc, dvc) = moved_by(s, water)
        X, Y, N = drag(0.0, (0.0, 0.0, 0.0, u, v, r), ())
        across, turning = strips(v, r)
        p1, p2 = m11 * u + m13 * r, m22 * v + m23 * r
        X, Y, N = X + loads[0] + p2 * r, Y + loads[1] + across - p1 * r, N + loads[2] + turning + p1 * v - p2 * u
        return [*kin, a * X + b * Y + c * N + duc, b * X + d * Y + e * N + dvc, c * X + e * Y + f * N]

    return rates


def nomoto(rng: np.random.Generator) -> Craft:
    """A slow ship after Nomoto (1957): T r' + r = K N, T_v v' + v = -d r, and quadratic drag ahead.

    First-order steering (Fossen 2021, section 7.2) with the drift that goes with it. The ship knows nothing of Coriolis
    forces; its file takes away those of Fossen's form. Two fixed thrusters in newtons.
    """
    length = float(rng.uniform(12.0, 40.0))
    mass = WATER * 0.6 * length**3 / 48.0
    top, T = 0.2 * sqrt(GRAVITY * length), float(rng.uniform(8.0, 25.0))
    m11, m22, m33 = 1.06 * mass, 1.8 * mass, 1.6 * mass * (0.25 * length) ** 2
    T_v, drift = float(rng.uniform(0.4, 0.8)) * T, float(rng.uniform(0.2, 0.4)) * length
    full = 0.5 * float(rng.uniform(0.6, 1.0)) * m11 * top / (4.0 * T)
    numbers = {
        "mass": mass,
        "inertia_z": mass * (0.25 * length) ** 2,
        "x_g": 0.0,
        "X_udot": mass - m11,
        "Y_vdot": mass - m22,
        "N_rdot": -0.6 * mass * (0.25 * length) ** 2,
    }
    X_uu = -2.0 * full / top**2
    damped = {"X_u": 0.0, "X_uu": X_uu, "Y_v": -m22 / T_v, "N_r": -m33 / T, "Y_r": -m22 * drift / T_v}
    arm = 0.5 * m33 / T * 0.6 * top / length / full  # unlike thrusts turn the ship in ten lengths
    thrusters = [
        pushing(name, -0.45 * length, side * arm, 0.0, -0.7 * full, full)
        for name, side in (("port", -1.0), ("stbd", 1.0))
    ]

    def equations(p: Numbers) -> Equations:
        surge, sway, yaw = p["mass"] - p["X_udot"], p["mass"] - p["Y_vdot"], p["inertia_z"] - p["N_rdot"]
        gain = T / m33

        def rates(s: State, loads: Loads, water: tuple[float, float]) -> State:
            kin, (u, v, r), (duc, dvc) = moved_by(s, water)
            lag = T * yaw / m33
            return [
                *kin,
                (loads[0] + X_uu * abs(u) * u) / surge + duc,
                (loads[1] - m22 / T_v * (v + drift * r)) / sway + dvc,
                (gain * loads[2] - r) / lag,
            ]

        return rates

    coupling = {"X_vr": -m22, "Y_ur": m11, "N_uv": m22 - m11}
    data: Mapping[str, Any] = {"name": "Nomoto ship", **split(numbers, damped), "coupling": coupling}
    file: Vehicle = vehicle_from_dict({**data, "thrusters": thrusters}, "Nomoto ship")
    pace = float(np.clip(T / 3.0, 3.0, 8.0))
    return Craft(
        "Nomoto", file, numbers, equations, **newtons(thrusters), step=0.1, pace=pace, length=length, exact=COMMON
    )
