"""A vehicle in JavaScript without any library: a module for a browser or node, and what the page that plays needs.

There every number can be changed while it runs, so it has the numbers as data, and the force equation that reads them.
"""

from collections.abc import Mapping, Sequence
from json import dumps
from pathlib import Path
from typing import final

import numpy as np

from ...physics.effects import PARAMETERS
from ...physics.momentum_balance import AROUND, DENSITY, FORCES, STRIPS, terms_by_symbol
from ...physics.reading import Plain
from ...physics.thrusters import GAINS, Thruster
from ...physics.vehicle import SHARED_THRUSTER_KEYS, Vehicle
from ..known_facts import filled, remarks
from ..program.model_program import program_of
from ..program.printer import Language, calls, identifier, wrapped
from ..program.symbols import Function
from .base import Export, Given

FUNCTION = "undertowVehicle"
"""Name of the JavaScript function that makes a vehicle of `vehicle_data`."""


def force_equation() -> str:
    """The source of the force equation and its rollouts: a function `undertowVehicle(data)`."""
    return Path(__file__).with_name("force_equation.js").read_text("utf-8")


def vehicle_data(vehicle: Vehicle) -> Plain:
    """All that the JavaScript function needs of a vehicle, as JSON has it [SI units].

    Parameters and the catalogue's products of speeds come along, so that the function builds the momentum balance anew
    for any values.
    """
    return {
        "name": vehicle.name,
        "values": dict(vehicle.values),
        "thrusters": [_thruster(thruster) for thruster in vehicle.thrusters],
        "hydrodynamic": [
            [symbol, axis, list(form.factors), symbol in PARAMETERS and PARAMETERS[symbol].section == "damping"]
            for symbol, (_, axis, form) in terms_by_symbol(vehicle).items()
        ],
        "hull": None if vehicle.hull is None else vehicle.hull.model_dump(),
        "cross_flow": {"forces": [[axis, name] for axis, name in FORCES], "strips": STRIPS, "density": DENSITY},
        "around": [[axis, sign, list(factors), symbol] for axis, sign, factors, symbol in AROUND],
        "shared": list(SHARED_THRUSTER_KEYS),
        "gains": list(GAINS),
    }


def _thruster(thruster: Thruster) -> Plain:
    """A thruster's fields, and the commands in its own unit whose normalised values are zero and one."""
    at = np.array([0.0, 1.0])
    low, high = (float(thruster.curve.normalised(np.array(c), thruster.command)) for c in at)
    zero, one = ((share - low) / (high - low) for share in at)
    return {**thruster.model_dump(mode="json"), "at_zero": float(zero), "at_one": float(one)}


_TAKEN = """
arguments await break case catch class const continue debugger default delete do else enum eval export extends false
finally for function if implements import in instanceof interface let new null package private protected public return
static super switch this throw true try typeof undefined var void while with yield
exports module require document location top window
thrust rates derivatives start step
"""
"""What the language, node or a browser keeps for itself, and the functions of the module."""


@final
class JavaScript(Language):
    """JavaScript functions on arrays."""

    spelling = calls("Math.{}", absolute="abs", minimum="min", maximum="max", power="pow") | {"where": "({} ? {} : {})"}
    named = "const {} = {};"

    def curve(self, name: str, xs: Sequence[str], ys: Sequence[str]) -> str:
        """See `Language.curve`."""
        points = ["\n    ".join(wrapped(line, 100)) for line in (xs, ys)]
        return f"""
function {name}(x) {{
  const xs = [{points[0]}];
  const ys = [{points[1]}];
  if (x <= xs[0]) return ys[0];
  let k = 1;
  while (k < xs.length && xs[k] < x) k++;
  if (k === xs.length) return ys[k - 1];
  return ys[k - 1] + ((ys[k] - ys[k - 1]) / (xs[k] - xs[k - 1])) * (x - xs[k - 1]);
}}"""

    def define(self, function: Function, body: Sequence[str], results: Sequence[Sequence[str]]) -> str:
        """See `Language.define`."""
        text = "\n".join(f"// {line}" for line in function.description)
        inputs = ", ".join(group.name for group in function.inputs)
        groups = [f"[\n    {(',' + chr(10) + '    ').join(texts)},\n  ]" for texts in results]
        found = groups[0] if len(groups) == 1 else f"[{', '.join(groups)}]"
        lines = [*body, f"return {found};"]
        return f"\n{text}\nfunction {function.name}({inputs}) {{\n" + "\n".join(f"  {x}" for x in lines) + "\n}"


def _files(given: Given, path: Path) -> Mapping[Path, bytes]:
    program = program_of(given.vehicle, given.choices.time_step)
    name = identifier(path.stem)
    text = filled(
        Path(__file__).with_name("module.js.in"),
        name=f"{name}_model" if name in _TAKEN.split() else name,
        step=program.time_step,
        command=dumps(program.thrust.inputs[0].members),
        state=dumps(program.state),
        functions=JavaScript("", program.functions).text(),
    )
    return {path: (remarks(given.facts.lines(), "// ") + text).encode()}


EXPORT = Export("JavaScript module without any library", ".js", _files, ("// ", ""))
