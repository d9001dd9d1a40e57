"""The FMU is a valid one, compiles with all warnings as errors, and gives undertow's own rollouts in fmpy."""

import os
import shutil
import sys
import zipfile
from ctypes import byref, c_bool, c_double, c_uint, sizeof
from pathlib import Path

import numpy as np
import pytest
from exported import BOATS, EXACT, compare_rollouts, error, needed, program, run, trips, written

from undertow.exports.program.model_program import Program

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


class Slave:
    """A compiled unit and what its variables are called; each rollout is an instance of its own."""

    def __init__(self, unit: Path, asked: Program) -> None:
        from fmpy.fmi3 import FMU3Slave

        self.asked = asked
        description = fmpy.read_model_description(str(unit), validate=True)
        references = {variable.name: variable.valueReference for variable in description.modelVariables}
        self.inputs = [v.valueReference for v in description.modelVariables if v.causality == "input"]
        self.parameters = [v.valueReference for v in description.modelVariables if v.causality == "parameter"]
        self.outputs = [references[name] for name in asked.state[:6]]
        self.slave = FMU3Slave(
            guid=description.guid,
            unzipDirectory=str(unit),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="boat",
        )
        self.slave.instantiate()

    def rolled_out(self, start: np.ndarray, steps: np.ndarray, stride: int = 1) -> np.ndarray:
        """Motions at communication points some steps apart; inputs are those at the end of each."""
        slave, asked = self.slave, self.asked
        slave.enterInitializationMode()
        clock = next((group for group in asked.step.inputs if group.single), None)
        later = steps[:, :-1] if clock else steps
        first = float(steps[0, -1]) if clock else 0.0
        begun = dict(zip(places(asked), start, strict=True))
        acting = [begun[f"{name}.{k}"] for name, k in first_inputs(asked)]
        slave.setFloat64(self.parameters, [*start[:6], first])
        slave.setFloat64(self.inputs, [*acting, *([0.0] * (len(self.inputs) - len(acting)))])
        slave.exitInitializationMode()
        length, later = stride * asked.time_step, np.ascontiguousarray(later[stride - 1 :: stride])
        found = np.array([slave.getFloat64(self.outputs), *[[0.0] * 6] * len(later)])
        # Arrays are handed over where they lie, as a list a step would take most of the time.
        into, asking = ((c_uint * len(x))(*x) for x in (self.inputs, self.outputs))
        given, taken = (c_double * len(x) for x in (into, asking))
        event, end, early, until = *(byref(c_bool()) for _ in range(3)), byref(c_double())
        for k in range(len(later)):
            row = given.from_buffer(later.data, k * sizeof(given))
            motion = taken.from_buffer(found.data, (k + 1) * sizeof(taken))
            slave.fmi3SetFloat64(slave.component, into, len(into), row, len(into))
            slave.fmi3DoStep(slave.component, k * length, length, True, event, end, early, until)
            slave.fmi3GetFloat64(slave.component, asking, len(asking), motion, len(asking))
        slave.reset()
        return found


def places(asked: Program) -> list[str]:
    return [f"{group.name}.{k}" for group in asked.start.inputs for k in range(len(group.members))]


def first_inputs(asked: Program) -> list[tuple[str, int]]:
    groups = [group for group in asked.start.inputs if group.name in ("command", "air")]
    return [(group.name, k) for group in groups for k in range(len(group.members))]


@pytest.mark.parametrize("name", BOATS)
def test_it_is_undertows_own_simulation(name: str, tmp_path: Path):
    slave, trip = Slave(unpacked(name, tmp_path), program(name)), trips(name)
    rolled = zip(trip.start, trip.steps.swapaxes(0, 1), strict=True)
    compare_rollouts(name, np.array([slave.rolled_out(*one) for one in rolled]))


def test_a_longer_communication_step_is_several_in_a_straight_line(tmp_path: Path):
    """Commands that are straight for a second are the same in steps of 0.05 and of 0.25 s."""
    slave, trip = Slave(unpacked("lag alone", tmp_path), program("lag alone")), trips("lag alone")
    assert error(slave.rolled_out(trip.start[0], trip.steps[:, 0], stride=5), trip.expected[0, ::5]) < EXACT


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
