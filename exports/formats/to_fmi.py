"""A functional mock-up unit (FMI 3.0, co-simulation) of source code: the C99 header, and what the standard asks for.

Inputs are the commands (and the air's velocity), parameters the motion at the start, outputs the motion.
"""

import hashlib
import io
import zipfile
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from xml.etree import ElementTree

from ...physics.thrusters import neutral_command
from ..elements import xml_node
from ..known_facts import KnownFacts
from ..program.model_program import MOTION, Program, program_of
from ..program.printer import identifier
from ..program.symbols import Function
from .base import Export, Given
from .to_c import header

_UNITS = {"north": "m", "east": "m", "psi": "rad", "u": "m/s", "v": "m/s", "r": "rad/s"}
_OF_COMMAND = {"pwm": "us", "normalized": "1", "rad_s": "rad/s", "newton": "N", "tau": "N"}
_STAMP = (1980, 1, 1, 0, 0, 0)
"""Time of all files in the archive, the earliest that one can have: equal models give equal bytes."""


def _called(program: Program, function: Function, prefix: str) -> str:
    """A call of `start` or `step` with what the unit has at hand."""
    commands = len(program.thrust.inputs[0].members)
    at_hand = {"motion": "parameter", "state": "state", "command": "input", "air": f"input + {commands}"}
    clock = {"start": "parameter[6] + unit->time / 60.0", "step": "minutes"}[function.name]
    given = [clock if group.single else at_hand[group.name] for group in function.inputs]
    into = "state" if function.name == "start" else "after"
    return f"{prefix}_{function.name}({', '.join([*given, into])})"


def source(program: Program, name: str, token: str) -> str:
    """The C file of the unit."""
    inputs = _inputs(program)
    told = {
        "INPUTS": str(len(inputs)),
        "PARAMETERS": "7",
        "STATES": str(len(program.state)),
        "BEGUN": ", ".join(repr(value) for _, _, value in inputs),
        "STEP": repr(program.time_step),
        "CLOCK": "parameter[6]",
        "TOKEN": f'"{token}"',
        "START": _called(program, program.start, name),
        "NEXT": _called(program, program.step, name),
    }
    text = (resources.files(__package__ or "undertow.exports.formats") / "fmu.c").read_text("utf-8")
    head = "".join(f"#define {key} {value}\n" for key, value in told.items())
    return head + text.replace('"MODEL.h"', f'"{name}.h"').replace("MODEL.h", f"{name}.h")


def _inputs(program: Program) -> list[tuple[str, str, float]]:
    """Name, unit, and value at the start of each input."""
    found = [
        (t.channel, "N.m" if t.push[:2] == (0.0, 0.0) else _OF_COMMAND[t.command], neutral_command(t))
        for t in program.vehicle.thrusters
    ]
    if any(group.name == "air" for group in program.step.inputs):
        found += [("air_north", "m/s", 0.0), ("air_east", "m/s", 0.0)]
    return found


def description(program: Program, name: str, token: str, facts: KnownFacts) -> bytes:
    """modelDescription.xml."""
    inputs = _inputs(program)
    rows = [("time", "s", {"causality": "independent"})]
    rows += [(label, unit, {"causality": "input", "start": repr(value)}) for label, unit, value in inputs]
    fixed = {"causality": "parameter", "variability": "fixed", "start": "0.0"}
    rows += [(f"{label}_start", _UNITS[label], fixed) for label in MOTION] + [("minutes_start", "min", fixed)]
    rows += [(label, _UNITS[label], {"causality": "output"}) for label in MOTION]
    variables = []
    for reference, (label, unit, rest) in enumerate(rows):
        here = {"name": label, "valueReference": str(reference), "variability": "continuous", "unit": unit} | rest
        variables.append(xml_node("Float64", **here))
    units = dict.fromkeys(["s", "min", *_UNITS.values(), *(unit for _, unit, _ in inputs)])
    outputs = range(len(rows) - len(MOTION), len(rows))
    structure = [xml_node(kind, valueReference=str(k)) for kind in ("Output", "InitialUnknown") for k in outputs]
    step = repr(program.time_step)
    able = {"canGetAndSetFMUState": "true", "canSerializeFMUState": "true", "fixedInternalStepSize": step}
    root = xml_node(
        "fmiModelDescription",
        xml_node("CoSimulation", modelIdentifier=name, **able),
        xml_node("UnitDefinitions", *(xml_node("Unit", name=unit) for unit in units)),
        xml_node("LogCategories", xml_node("Category", name="logStatusError")),
        xml_node("DefaultExperiment", startTime="0", stepSize=step),
        xml_node("ModelVariables", *variables),
        xml_node("ModelStructure", *structure),
        fmiVersion="3.0",
        modelName=name,
        generationTool=f"undertow export {facts.version}",
        instantiationToken=token,
        description=" ".join(facts.lines()).replace("  ", " "),
    )
    return _xml(root)


def build_description(name: str) -> bytes:
    """sources/buildDescription.xml."""
    files = xml_node("SourceFileSet", xml_node("SourceFile", name="fmu.c"), language="C99")
    one = xml_node("BuildConfiguration", files, modelIdentifier=name)
    return _xml(xml_node("fmiBuildDescription", one, fmiVersion="3.0"))


def _xml(root: ElementTree.Element) -> bytes:
    ElementTree.indent(root)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="utf-8") + b"\n"


def _files(given: Given, path: Path) -> Mapping[Path, bytes]:
    program, name = program_of(given.vehicle, given.choices.time_step), identifier(path.stem)
    code = header(program, name, given.facts)
    token = hashlib.sha256(code.encode()).hexdigest()[:32]
    inside = {
        "modelDescription.xml": description(program, name, token, given.facts),
        "sources/buildDescription.xml": build_description(name),
        "sources/fmu.c": source(program, name, token).encode(),
        f"sources/{name}.h": code.encode(),
        "documentation/facts.txt": "\n".join([*given.facts.lines(), ""]).encode(),
    }
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for file, content in inside.items():
            # The description is not pressed, so that the beginning of the file says who wrote it.
            how = zipfile.ZIP_STORED if file == "modelDescription.xml" else zipfile.ZIP_DEFLATED
            archive.writestr(zipfile.ZipInfo(file, _STAMP), content, how)
    return {path: stream.getvalue()}


EXPORT = Export("functional mock-up unit of source code, FMI 3.0 co-simulation", ".fmu", _files, ("", ""))
