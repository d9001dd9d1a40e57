"""Python functions that are given something of another kind say what they expected, what came, and what to give."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import undertow
from undertow.physics.motion import Motion

VEHICLE = undertow.load_vehicle("blueboat")
TIME = 0.1 * np.arange(300, dtype=float)
MOTION = Motion(TIME, np.zeros((300, 2)), 0.0 * TIME, np.zeros((300, 3)), np.zeros((300, 2)), ("port", "stbd"))
INPUTS = r"read_inputs\(LOGS, VEHICLE\) makes them"
LOADED = r"undertow.load_vehicle\(PATH\) reads one"

Call = Callable[..., Any]
CASES: dict[str, tuple[Call, tuple[Any, ...], str]] = {
    "adapt, a path as vehicle": (
        undertow.adapt,
        (MOTION, "boat.yaml", ["yaw_trim"]),
        rf"adapt: vehicle: expected a Vehicle, got a str 'boat.yaml'; {LOADED}",
    ),
    "adapt, a path as motions": (
        undertow.adapt,
        (Path("log.csv"), VEHICLE, ["yaw_trim"]),
        r"adapt: motions: expected a Motion or Iterable, got a \w*Path; undertow.prepare",
    ),
    "adapt, a text as motions": (
        undertow.adapt,
        ("log.csv", VEHICLE, ["yaw_trim"]),
        r"adapt: motions: expected a Motion, got a str 'log.csv'; undertow.prepare",
    ),
    "adapt, logs as motions": (
        undertow.adapt,
        ([TIME], VEHICLE, ["yaw_trim"]),
        r"adapt: motions: expected a Motion, got a ndarray",
    ),
    "adapt, one name": (
        undertow.adapt,
        (MOTION, VEHICLE, "yaw_trim"),
        r"adapt: effects: expected a list or tuple, got a str 'yaw_trim'; give a list of names",
    ),
    "adapt, settings": (
        undertow.adapt,
        (MOTION, VEHICLE, ["yaw_trim"], undertow.DiscoverySettings()),
        r"adapt: settings: expected an AdaptSettings, got a DiscoverySettings; undertow.AdaptSettings",
    ),
    "report, what is no run folder": (
        undertow.report,
        (VEHICLE.values.get,),
        r"report: runs: expected a str or PathLike, got a \w+; undertow.write_run\(RUN, FOLDER\) writes one",
    ),
    "report, one path": (undertow.report, ("nowhere",), "expected a run folder at nowhere, but there is none"),
    "distil, a path as inputs": (
        undertow.distil,
        ("lstm", "log.csv"),
        rf"distil: inputs: expected an Inputs, got a str 'log.csv'; undertow.{INPUTS}",
    ),
    "distil, inputs as model": (
        undertow.distil,
        (undertow.load_vehicle, VEHICLE),
        rf"distil: inputs: expected an Inputs, got a Vehicle; undertow.{INPUTS}",
    ),
    "write_run, findings": (
        undertow.write_run,
        ({"schema": "undertow.findings/1"}, "run"),
        r"write_run: run: expected a Run, got a dict; undertow.discover\(INPUTS\) and undertow.add",
    ),
    "discover, a log": (
        undertow.discover,
        ("log.csv",),
        rf"discover: inputs: .* got a str 'log.csv'; undertow.{INPUTS}",
    ),
    "add, one name": (
        undertow.add,
        ("yaw_trim", None),
        r"add: effects: expected a list or tuple, got a str 'yaw_trim'",
    ),
    "add, a log": (undertow.add, (["yaw_trim"], "log.csv"), rf"add: inputs: .*{INPUTS}"),
    "fit, a log": (undertow.fit, ("log.csv",), rf"fit: inputs: .*{INPUTS}"),
    "compare, a log": (undertow.compare, ("log.csv",), rf"compare: inputs: .*{INPUTS}"),
    "train, a log": (undertow.train, ("log.csv",), rf"train: inputs: .*{INPUTS}"),
    "audit, a vehicle": (undertow.audit, (VEHICLE, None), r"audit: model: expected a Model, got a Vehicle"),
    "simulate_world, a name": (
        undertow.simulate_world,
        ("blueboat", {}),
        rf"vehicle: expected .* 'blueboat'; {LOADED}",
    ),
    "simulate_world, a list": (
        undertow.simulate_world,
        (VEHICLE, ["yaw_trim"]),
        r"simulate_world: effects: expected a Mapping, got a list; give values by name",
    ),
    "read_inputs, a log": (
        undertow.read_inputs,
        ([VEHICLE], VEHICLE),
        r"read_inputs: logs: expected a str or PathLike or Log, got a Vehicle; give paths",
    ),
    "read_inputs, a number": (
        undertow.read_inputs,
        ("log.csv", 3),
        rf"read_inputs: vehicle: expected a Vehicle or str or PathLike, got an int 3; {LOADED}",
    ),
    "prepare, a path": (
        undertow.prepare,
        ("log.csv", VEHICLE),
        r"prepare: logs: expected a Log, got a str 'log.csv'; undertow.read_log\(PATH\) reads one",
    ),
    "prepare, a vehicle's path": (undertow.prepare, ([], "boat.yaml"), rf"prepare: vehicle: .*{LOADED}"),
}


@pytest.mark.parametrize("case", CASES)
def test_an_argument_of_another_kind(case: str) -> None:
    function, arguments, match = CASES[case]
    with pytest.raises(undertow.RequestError, match=match):
        function(*arguments)


def test_paths_may_come_one_by_one_and_a_vehicle_is_no_model(tmp_path: Path) -> None:
    undertow.simulate_world(VEHICLE, {}, duration=40.0).write(tmp_path / "log.csv")
    inputs = undertow.read_inputs(tmp_path.glob("*.csv"), VEHICLE)
    assert inputs.paths == (str(tmp_path / "log.csv"),)
    with pytest.raises(undertow.RequestError, match="distil: model: expected a Model or str or PathLike, got a V"):
        undertow.distil(VEHICLE, inputs)  # type: ignore[arg-type]
