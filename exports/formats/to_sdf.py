"""A Gazebo model: SDF with the plugins Hydrodynamics and Thruster, in Gazebo's axes (x ahead, y to port, z up).

Names are those of gz-sim's `Hydrodynamics.hh` and `Thruster.hh`. From Garden on, terms of all pairs of axes have names
(`nV`, `nUV`, `nRabsU`); the plugin's Coriolis force of the added mass, whose sign differs between versions, is switched
off and written as such terms. Fortress has diagonal terms alone, added mass of the other sign, and no such switch. No
gravity pulls the links, so the model stays at its height, and nothing collides, from which a buoyancy would be
computed.
"""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from ...physics.effects import PARAMETERS
from ...physics.errors import RequestError
from ...physics.momentum_balance import mass_rows, terms_by_symbol
from ...physics.motion import Array
from ...physics.thrusters import Thruster, command_of
from ...physics.vehicle import Vehicle
from ..approximation import difference, missing_forces, total_thrust
from ..elements import xml_node
from ..program.printer import identifier
from .base import Export, Given

_MOMENTS, _SPEEDS = "xyn", "UVR"
"""Letters of SNAME in the names of the plugin's terms: of surge, sway and yaw."""
_FLIPPED = {"u": 1.0, "v": -1.0, "r": -1.0}
"""Sign of a speed in Gazebo's axes."""
_SIGNS = (1.0, -1.0, -1.0)
"""Sign of a force on surge, sway and yaw in Gazebo's axes."""
_LONGER = 3.0
"""Length of the box that stands for the hull over its width and its height, which the model does not have."""
_ROLL, _PITCH = 0.2, 1.0
"""Ixx and Iyy as a share of Izz: those of this box."""
_PROPELLER = 0.001
"""Mass of a propeller's link [kg], which the hull has less: a link without any is unlawful."""
_BLADE = 0.4 * _PROPELLER * 0.05**2
"""Inertia of a propeller about its own axes [kg m^2]: of a ball of 0.1 m."""
_DECAY = 2.0
"""Damping of heave, roll and pitch, which the model does not have, over mass and inertia [1/s]: they die out."""
_NAMESPACES = {"garden": ("gz-sim", "gz::sim::systems"), "fortress": ("ignition-gazebo", "ignition::gazebo::systems")}
_LEAST = 1e-9
"""Size of a coefficient [SI] that is rounding."""


def plugin_terms(vehicle: Vehicle, gz: str, rigid_only: bool) -> tuple[dict[str, float], dict[str, float]]:
    """Elements of the plugin by name, and what of the vehicle has another value there, by symbol.

    Parameters
    ----------
    rigid_only : the physics engine has the added mass, and its Coriolis force with it
    """
    p = vehicle.values
    terms: dict[str, float] = {}
    lost: dict[str, float] = {}
    for symbol, (value, axis, form) in terms_by_symbol(vehicle).items():
        name = _name(axis, form.factors, gz)
        if name is not None and value:
            terms[name] = terms.get(name, 0.0) + _turned(axis, form.factors) * value
        elif value:
            lost[symbol] = 0.0
    if gz == "garden" and not rigid_only:
        for axis, factors, value in added_coriolis(vehicle):
            name = _name(axis, factors, gz)
            assert name is not None
            terms[name] = terms.get(name, 0.0) + _turned(axis, factors) * value
    if not rigid_only:
        sign = 1.0 if gz == "garden" else -1.0
        terms |= {"xDotU": sign * p["X_udot"], "yDotV": sign * p["Y_vdot"], "nDotR": sign * p["N_rdot"]}
        if p["Y_rdot"] and gz == "garden":
            terms |= {"yDotR": p["Y_rdot"], "nDotV": p["Y_rdot"]}
        elif p["Y_rdot"]:
            lost["Y_rdot"] = 0.0
    izz = p["inertia_z"]
    heave = {"zW": -_DECAY * p["mass"], "kP": -_DECAY * _ROLL * izz, "mQ": -_DECAY * _PITCH * izz}
    if gz == "fortress":  # whose terms are not zero where they are not named
        zeros = ("xDotU", "yDotV", "zDotW", "kDotP", "mDotQ", "nDotR", "xU", "yV", "nR", "xUU", "yVV", "zWW", "kPP")
        terms = dict.fromkeys((*zeros, "mQQ", "nRR"), 0.0) | terms
    return {name: x for name, x in (terms | heave).items() if gz == "fortress" or abs(x) > _LEAST}, lost


def _name(axis: int, factors: Sequence[str], gz: str) -> str | None:
    """Name of the plugin's term of a monomial; None where it has none."""
    begin = _MOMENTS[axis]
    signed = [factor for factor in factors if not factor.startswith("|")]
    moduli = [factor[1] for factor in factors if factor.startswith("|")]
    if len(factors) > 2 or not signed:
        return None
    own = "uvr"[axis]
    if gz == "fortress":
        if set(signed) | set(moduli) != {own} or (len(factors) == 2 and not moduli):
            return None
        return begin + own.upper() * len(factors)
    letters = [_SPEEDS["uvr".index(x)] for x in signed]
    if moduli:
        return f"{begin}{letters[0]}abs{_SPEEDS['uvr'.index(moduli[0])]}"
    return begin + "".join(sorted(letters, key="UVR".index))


def _turned(axis: int, factors: Sequence[str]) -> float:
    """Sign of a coefficient in Gazebo's axes."""
    return _SIGNS[axis] * float(np.prod([_FLIPPED.get(factor, 1.0) for factor in factors]))


def added_coriolis(vehicle: Vehicle) -> list[tuple[int, tuple[str, str], float]]:
    """(axis, factors, coefficient) of minus C_A nu, from M_A by Fossen (2021), theorem 3.2."""
    p = vehicle.values
    a11, a22, a23 = -p["X_udot"], -p["Y_vdot"], -p["Y_rdot"]
    found = [
        *((0, ("v", "r"), a22), (0, ("r", "r"), a23)),
        (1, ("u", "r"), -a11),
        *((2, ("u", "v"), a11 - a22), (2, ("u", "r"), -a23)),
    ]
    return [each for each in found if abs(each[2]) > _LEAST]


def added_mass(vehicle: Vehicle) -> Array:
    """M_A (3, 3) in Gazebo's axes [kg, kg m, kg m^2], which are those of M_A where both sway and yaw turn."""
    p = vehicle.values
    return np.array([[-p["X_udot"], 0.0, 0.0], [0.0, -p["Y_vdot"], -p["Y_rdot"]], [0.0, -p["Y_rdot"], -p["N_rdot"]]])


def growth(vehicle: Vehicle) -> float:
    """By how much a step of the plugin multiplies an error of the acceleration: its added mass over the rigid one."""
    rigid = np.array(mass_rows(vehicle)) - added_mass(vehicle)
    return float(np.abs(np.linalg.eigvals(np.linalg.solve(rigid, added_mass(vehicle)))).max())


def _left_out(given: Given) -> list[str]:
    vehicle, choices, envelope = given.vehicle, given.choices, given.facts.envelope
    inertial = choices.added_mass == "inertial"
    _, lost = plugin_terms(vehicle, choices.gz, inertial)
    kept = ("current_north", "current_east", "X_udot", "Y_vdot", "N_rdot", "Y_rdot", "mass", "inertia_z", "x_g", "y_g")
    drawn = ("thrust_scale", "arm_scale")
    curve = ("reverse_scale", "thrust_exponent", "dead_zone", "advance_loss")
    for symbol, parameter in PARAMETERS.items():
        product = parameter.axis is not None and parameter.form
        bends = symbol in curve or symbol.startswith("gain_")
        if "{" not in symbol and symbol not in (*kept, *drawn, "memory_time") and not product and not bends:
            lost[symbol] = parameter.null
    sentences = missing_forces(vehicle, envelope, lost) + _curve_told(vehicle)
    sentences += missing_forces(vehicle, envelope, {"advance_loss": 0.0})
    if choices.gz == "fortress" and not inertial:
        sentences.append(_fortress_coriolis(vehicle, given))
    speed = float(np.hypot(vehicle.value("current_north"), vehicle.value("current_east")))
    if inertial and speed:
        most = max(map(abs, (envelope.lower[2], envelope.upper[2])))
        size = max(-vehicle.value("X_udot"), -vehicle.value("Y_vdot")) * speed * most
        sentences.append(f"The physics engine's added mass does not know the current: up to {size:.3g} N in a turn.")
    sentences.append(
        "Heave, roll and pitch: their inertia and damping are invented, as is the box that is seen. Gravity does not "
        "pull the boat, which stays at its height in any world; it has no buoyancy, and collides with nothing."
    )
    return sentences


def _curve_told(vehicle: Vehicle) -> list[str]:
    most = 0.0
    share = np.linspace(-1.0, 1.0, 201)
    for thruster in vehicle.thrusters:
        force = thruster.lasting(command_of(thruster, share))[0]
        most = max(most, float(np.abs(force - np.where(share < 0, -force[0], force[-1]) * share).max()))
    if most < 1e-9 * total_thrust(vehicle.thrusters):
        return []
    return [
        "The way from a command to newtons: Gazebo is commanded in newtons, which the function `thrust` of the exports "
        f"to code gives; straight lines to both ends in its place are off by up to {most:.3g} N a thruster."
    ]


def _fortress_coriolis(vehicle: Vehicle, given: Given) -> str:
    """Fortress has -A22 v r where +A22 v r belongs, and no A22 in the yaw moment."""
    a22 = -vehicle.value("Y_vdot")
    wrong = vehicle.with_values(
        {"surge:vr": vehicle.value("surge:vr") - 2.0 * a22, "yaw:uv": vehicle.value("yaw:uv") + a22}
    )
    error = difference(vehicle, wrong, given.facts.envelope, "the error of the force")
    return f"Coriolis force of the added mass, which Fortress works out otherwise: {error}"


def _files(given: Given, path: Path) -> Mapping[Path, bytes]:
    choices, vehicle = given.choices, given.vehicle
    inertial = choices.added_mass == "inertial"
    if inertial and choices.gz == "fortress":
        raise RequestError("--added-mass inertial needs SDF 1.10, which Fortress does not read; use --gz garden")
    if not inertial and growth(vehicle) >= 1.0:
        raise RequestError(
            f"export: the added mass of {given.facts.name} is up to {growth(vehicle):.3g} times its own, and Gazebo's "
            "plugin, which takes the acceleration of the step before, explodes from 1 on; use --gz garden "
            "--added-mass inertial, which hands it to the physics engine (Garden and later)"
        )
    root = _document(given, identifier(path.stem), inertial)
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    return {path: f'<?xml version="1.0"?>\n{text}\n'.encode()}


def _placed(vehicle: Vehicle) -> None:
    """Refuse forces and moments that have no place: the plugin Thruster is a propeller.

    Raises
    ------
    RequestError
        which names them.
    """
    names = [thruster.channel for thruster in vehicle.thrusters if thruster.command == "tau"]
    if names:
        raise RequestError(
            f"export --to sdf: expected thrusters with a place, got {' and '.join(names)}, which are a force or "
            "moment of the whole vessel; Gazebo's Thruster cannot express them. Give the model its thrusters, or "
            "export it to python, c, casadi or fmi"
        )


def _document(given: Given, name: str, inertial: bool) -> ElementTree.Element:
    vehicle, choices = given.vehicle, given.choices
    _placed(vehicle)
    library, namespace = _NAMESPACES[choices.gz]
    facts = "\n".join(re.sub(r"-(?=-)", "- ", line) for line in given.facts.lines())
    facts += "\nixx and iyy of the hull are invented: see `Heave, roll and pitch`."
    facts += f"\nNewtons go to the topics /model/{name}/joint/THRUSTER_joint/cmd_thrust (docs/howto/export.md)."
    terms, _ = plugin_terms(vehicle, choices.gz, inertial)
    water = {"link_name": "base_link"} | {key: repr(float(value)) for key, value in terms.items()}
    if choices.gz == "garden":
        water |= {"disable_coriolis": "true"} | ({"disable_added_mass": "true"} if inertial else {})
    north, east = vehicle.value("current_north"), vehicle.value("current_east")
    if north or east:
        water["default_current"] = f"{east!r} {north!r} 0"
    pushes = []
    for thruster in vehicle.thrusters:
        low, high = np.sort(thruster.lasting(command_of(thruster, np.array([-1.0, 1.0])))[0]).tolist()
        push = {"namespace": name, "joint_name": f"{thruster.name}_joint", "thrust_coefficient": "0.02"}
        push |= {"fluid_density": "1000.0", "propeller_diameter": "0.1", "velocity_control": "true"}
        push |= {"max_thrust_cmd": repr(high), "min_thrust_cmd": repr(low)}
        pushes.append(xml_node("plugin", push, filename=f"{library}-thruster-system", name=f"{namespace}::Thruster"))
    model = xml_node(
        "model",
        xml_node("link", _FLOATING, _hull_inertia(vehicle, inertial), _hull_seen(vehicle), name="base_link"),
        *(part for thruster in vehicle.thrusters for part in _propeller(thruster)),
        xml_node("plugin", water, filename=f"{library}-hydrodynamics-system", name=f"{namespace}::Hydrodynamics"),
        *pushes,
        name=name,
    )
    return xml_node("sdf", ElementTree.Comment(f"\n{facts}\n"), model, version="1.10" if inertial else "1.9")


_FLOATING = {"gravity": "false"}
"""Of a link, which gravity does not pull."""


def _place(thruster: Thruster) -> tuple[float, float]:
    """Where a thruster sits, in Gazebo's axes [m]; farther out where its arm counts more."""
    return thruster.arm_scale * thruster.x, -thruster.arm_scale * thruster.y


def _hull_inertia(vehicle: Vehicle, inertial: bool) -> ElementTree.Element:
    """Mass, centre and inertia of the hull, so that hull and propellers together have those of the vehicle."""
    p, places = vehicle.values, [_place(t) for t in vehicle.thrusters]
    mass = p["mass"] - _PROPELLER * len(places)
    x = (p["mass"] * p["x_g"] - _PROPELLER * sum(a for a, _ in places)) / mass
    y = (0.0 - p["mass"] * p["y_g"] - _PROPELLER * sum(b for _, b in places)) / mass
    beside = sum(_PROPELLER * (a * a + b * b) + _BLADE for a, b in places)
    izz = p["inertia_z"] - beside - mass * (x * x + y * y)
    if izz <= 0.0 or mass <= 0.0:
        raise RequestError(
            f"export: about its centre of gravity the hull would have an inertia of {izz:.3g} kg m^2 and a mass of "
            f"{mass:.3g} kg, which no body has; see inertia_z and x_g of the vehicle file"
        )
    ixx, iyy = _ROLL * izz, _PITCH * izz
    inertia = {"ixx": repr(ixx), "iyy": repr(iyy), "izz": repr(izz), "ixy": "0", "ixz": "0", "iyz": "0"}
    inside = [xml_node("inertia", inertia)]
    if inertial:
        m = added_mass(vehicle)
        moved = {"xx": m[0, 0], "yy": m[1, 1], "yr": m[1, 2], "rr": m[2, 2]}
        inside.append(xml_node("fluid_added_mass", {key: repr(float(part)) for key, part in moved.items()}))
    return xml_node("inertial", {"pose": f"{x!r} {y!r} 0 0 0 0", "mass": repr(mass)}, *inside)


def _hull_seen(vehicle: Vehicle) -> ElementTree.Element:
    """A box of the vehicle's mass and inertia about the vertical axis, about its centre of gravity."""
    p = vehicle.values
    izz = p["inertia_z"] - p["mass"] * (p["x_g"] ** 2 + p["y_g"] ** 2)
    length = float(np.sqrt(12.0 * izz / p["mass"] / (1.0 + _LONGER**-2)))
    box = xml_node("box", {"size": f"{length:.3f} {length / _LONGER:.3f} {length / _LONGER:.3f}"})
    pose = f"{p['x_g']!r} {0.0 - p['y_g']!r} 0 0 0 0"
    return xml_node("visual", {"pose": pose}, xml_node("geometry", box), name="box")


def _propeller(thruster: Thruster) -> tuple[ElementTree.Element, ElementTree.Element]:
    """The link of a thruster, and the joint about which it turns."""
    name, (x, y) = f"{thruster.name}_propeller", _place(thruster)
    inertia = xml_node("inertia", dict.fromkeys(("ixx", "iyy", "izz"), repr(_BLADE)))
    inside = xml_node("inertial", {"mass": repr(_PROPELLER)}, inertia)
    pose = f"{x!r} {y!r} 0 0 0 {0.0 - thruster.angle!r}"
    axis = xml_node("axis", {"xyz": "1 0 0"}, xml_node("limit", {"lower": "-1e+12", "upper": "1e+12"}))
    ends = {"parent": "base_link", "child": name}
    return (
        xml_node("link", _FLOATING | {"pose": pose}, inside, name=name),
        xml_node("joint", ends, axis, name=f"{thruster.name}_joint", type="revolute"),
    )


EXPORT = Export(
    "Gazebo model with the plugins Hydrodynamics and Thruster", ".sdf", _files, ("<!-- ", " -->"), _left_out
)
