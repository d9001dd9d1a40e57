"""The FMU is a valid one, compiles with all warnings as errors, and gives undertow's own rollouts in fmpy."""

import os
import shutil
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from exported import BOATS, EXACT, FEW, MANY, envelope, needed, program, run, seconds, written

from undertow.exports.program.model_program import Program
from undertow.exports.program.vectors import Driven, driven, error

fmpy = pytest.importorskip("fmpy", reason="what runs an FMU: pip install '.[dev]'")


def unpacked(name: str, folder: Path) -> Path:
    """An FMU whose sources are compiled, in a folder."""
    with zipfile.ZipFile(written(name, "fmi", folder / "model.fmu")) as archive:
        archive.extractall(folder / "unit")
    binaries = folder / "unit" / "binaries" / fmpy.platform_tuple
    binaries.mkdir(parents=True)
    cc = needed("gcc", shutil.which("gcc"), "package gcc")
    strict = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-fvisibility=hidden")
    run([cc, *strict, "-shared", "-fPIC", "fmu.c", "-o", binaries / "model.so", "-lm"], folder / "unit" / "sources")
    return folder / "unit"


def rolled_out(unit: Path, asked: Program, rolled: Driven, stride: int = 1) -> np.ndarray:
    """Motions at communication points some steps apart; inputs are those at the end of each."""
    from fmpy.fmi3 import FMU3Slave

    description = fmpy.read_model_description(str(unit), validate=True)
    references = {variable.name: variable.valueReference for variable in description.modelVariables}
    inputs = [v.valueReference for v in description.modelVariables if v.causality == "input"]
    parameters = [v.valueReference for v in description.modelVariables if v.causality == "parameter"]
    outputs = [references[name] for name in asked.state[:6]]
    slave = FMU3Slave(
        guid=description.guid,
        unzipDirectory=str(unit),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="boat",
    )
    slave.instantiate()
    slave.enterInitializationMode()
    clock = next((group for group in asked.step.inputs if group.single), None)
    later = rolled.steps[:, :-1] if clock else rolled.steps
    first = float(rolled.steps[0, -1]) if clock else 0.0
    begun = dict(zip(places(asked), rolled.start, strict=True))
    start = [begun[f"{name}.{k}"] for name, k in first_inputs(asked)]
    slave.setFloat64(parameters, [*rolled.start[:6], first])
    slave.setFloat64(inputs, start if len(start) == len(inputs) else [*start, *([0.0] * (len(inputs) - len(start)))])
    slave.exitInitializationMode()
    found = [slave.getFloat64(outputs)]
    for k in range(stride - 1, len(later), stride):
        slave.setFloat64(inputs, later[k].tolist())
        slave.doStep((k + 1 - stride) * asked.time_step, stride * asked.time_step)
        found.append(slave.getFloat64(outputs))
    slave.terminate()
    slave.freeInstance()
    return np.array(found)


def places(asked: Program) -> list[str]:
    return [f"{group.name}.{k}" for group in asked.start.inputs for k in range(len(group.members))]


def first_inputs(asked: Program) -> list[tuple[str, int]]:
    groups = [group for group in asked.start.inputs if group.name in ("command", "air")]
    return [(group.name, k) for group in groups for k in range(len(group.members))]


@pytest.mark.parametrize("count", [FEW, MANY], ids=["few", "many"])
@pytest.mark.parametrize("name", BOATS)
def test_it_is_undertows_own_simulation(name: str, count: int, tmp_path: Path):
    unit, asked = unpacked(name, tmp_path), program(name)
    for seed in range(count):
        rolled = driven(asked, envelope(name), seconds(count), seed)
        assert error(rolled_out(unit, asked, rolled), rolled.expected) < EXACT


def test_a_longer_communication_step_is_several_in_a_straight_line(tmp_path: Path):
    """Commands that are straight for a second are the same in steps of 0.05 and of 0.25 s."""
    unit, asked = unpacked("lag alone", tmp_path), program("lag alone")
    rolled = driven(asked, envelope("lag alone"), 10.0)
    assert error(rolled_out(unit, asked, rolled, stride=5), rolled.expected[::5]) < EXACT


def test_a_communication_step_of_another_length_is_refused_in_words(tmp_path: Path):
    from fmpy.fmi1 import FMICallException
    from fmpy.fmi3 import FMU3Slave

    unit = unpacked("as it is", tmp_path)
    description = fmpy.read_model_description(str(unit), validate=True)
    slave = FMU3Slave(guid=description.guid, unzipDirectory=str(unit), modelIdentifier="model", instanceName="boat")
    said: list[tuple[bytes, bytes]] = []
    slave.instantiate(logMessage=lambda environment, status, category, message: said.append((category, message)))
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    slave.doStep(0.0, 0.1)
    assert said == []
    with pytest.raises(FMICallException):
        slave.doStep(0.1, 0.07)
    slave.freeInstance()
    told = b"fmi3DoStep: expected a communication step of 0.05 s or a multiple of it"
    assert said == [(b"logStatusError", told)]


def test_fmpy_finds_nothing_wrong_and_builds_it_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    from fmpy.build import build_platform_binary
    from fmpy.validation import validate_fmu

    path = written("as it is", "fmi", tmp_path / "model.fmu")
    assert validate_fmu(str(path)) == []
    needed("gcc", shutil.which("gcc"), "package gcc")
    with zipfile.ZipFile(path) as archive:
        archive.extractall(tmp_path / "built")
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")  # where cmake is
    (tmp_path / "cmake").mkdir()
    build_platform_binary(tmp_path / "built", tmp_path / "cmake")
    result = fmpy.simulate_fmu(
        str(tmp_path / "built"),
        stop_time=5.0,
        step_size=0.05,
        output_interval=0.05,
        start_values={"u_start": 1.0},
        output=["u"],
    )
    assert 0.0 < result["u"][-1] < 0.5 < result["u"][0] == 1.0


def test_equal_models_give_equal_bytes(tmp_path: Path):
    one, other = (written("as it is", "fmi", tmp_path / folder).read_bytes() for folder in ("a.fmu", "a.fmu"))
    assert one == other
    assert b"undertow export" in one[:400]
