"""A ROS 2 parameter file with every number of the vehicle, for a node that has the force equation.

Parameters of ROS 2 are scalars and lists of one type; a dictionary is a name with dots. So thrusters and terms without
a name stand under their names, with a list of these beside them (`thruster_names`, `term_names`).
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...physics.files import yaml_text
from ...physics.vehicle import SECTIONS, Vehicle
from ..known_facts import remarks
from ..program.printer import identifier
from .base import Export, Given


def ros_parameters(vehicle: Vehicle) -> dict[str, Any]:
    """The parameters below `ros__parameters`: floats, texts, and lists of either."""
    result: dict[str, Any] = {"vehicle_name": vehicle.name, "axes": "NED/FRD, SI units"}
    result |= {name: float(vehicle.values[name]) for name in ("mass", "inertia_z", "x_g", "y_g")}
    if vehicle.hull is not None:
        result["hull"] = _plain(vehicle.hull.model_dump())
    sections = {section: _plain(dict(getattr(vehicle, section))) for section in SECTIONS}
    result |= {section: numbers for section, numbers in sections.items() if numbers}
    result["thruster_names"] = [t.name for t in vehicle.thrusters]
    result["thrusters"] = {t.name: _plain(t.model_dump(mode="json", exclude={"name"})) for t in vehicle.thrusters}
    if vehicle.terms:
        names = [f"term_{k + 1}" for k in range(len(vehicle.terms))]
        result["term_names"] = names
        result["terms"] = {n: _plain(term.model_dump()) for n, term in zip(names, vehicle.terms, strict=True)}
    return result


def _plain(value: Any) -> Any:
    """Numbers as floats, at any depth: a list of ROS 2 holds one type."""
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_plain(each) for each in value]
    return float(value) if isinstance(value, int | float) else value


def _files(given: Given, path: Path) -> Mapping[Path, bytes]:
    node = {identifier(path.stem): {"ros__parameters": ros_parameters(given.vehicle)}}
    return {path: (remarks(given.facts.lines()) + yaml_text(node, width=110)).encode()}


EXPORT = Export("ROS 2 parameter file with every number of the vehicle", ".yaml", _files)
