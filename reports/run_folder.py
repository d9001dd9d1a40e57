"""Read a run folder whole, and say clearly what is wrong with it when it cannot be shown."""

import hashlib
import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pandas as pd
import yaml

from ..physics.errors import RequestError, VehicleError
from ..physics.folders import finish
from ..physics.vehicle import Vehicle, vehicle_from_dict
from ..residuals.neural import is_network_folder

MEASURED = ("u_dot", "v_dot", "r_dot", "u", "v", "r", "north", "east")
SERIES_COLUMNS = (
    *("time", "log", "part", "psi"),
    *MEASURED,
    *(f"{name}_{model}" for model in ("before", "after") for name in MEASURED),
)
REMEDY = "run 'undertow discover LOG --vehicle V --out RUN' to write the folder anew"


@dataclass(frozen=True, slots=True)
class RunFolder:
    """The files that `discover` wrote, read and checked.

    Attributes
    ----------
    folder : Path
    findings, comparison : dict
        As in `findings.json` and `comparison.json`.
    nominal, corrected : Vehicle
        The vehicle before (`nominal.yaml`) and after (`model.yaml`).
    series : DataFrame
        `series.csv`, SI units, one row per time step (10 Hz).
    inspections : list of dict
        One of each log, as in `inspection.json`; none where that was not written.
    audit : dict
        As in `audit.json`; empty where that was not written.
    record : dict
        As in `run.json`, what the run was made from; empty where that was not written.
    digests : dict
        The first 12 hexadecimal digits of each file's SHA-256.
    """

    folder: Path
    findings: dict[str, Any]
    comparison: dict[str, Any]
    nominal: Vehicle
    corrected: Vehicle
    series: pd.DataFrame
    inspections: list[dict[str, Any]]
    audit: dict[str, Any]
    record: dict[str, Any]
    digests: dict[str, str]


def read_run(folder: Path) -> RunFolder:
    """Read a run folder.

    Raises
    ------
    RequestError
        When a file is missing, cannot be read, or is not of the expected schema.
    """
    folder = Path(folder)
    finish(folder)
    if not folder.is_dir():
        raise RequestError(f"expected a run folder at {folder}, but there is none; {REMEDY}")
    if is_network_folder(folder):
        raise RequestError(
            f"{folder} is the folder of a trained network, not of a run, and a page tells of a run; give a folder that "
            f"'undertow discover' wrote, with --model {folder} to put the network beside the run's own models"
        )
    digests: dict[str, str] = {}

    def text(name: str) -> str:
        try:
            content = (folder / name).read_bytes()
            digests[name] = hashlib.sha256(content).hexdigest()[:12]
            return content.decode()
        except FileNotFoundError:
            raise RequestError(f"run folder {folder} has no {name}; {REMEDY}") from None
        except (OSError, UnicodeDecodeError) as error:
            raise RequestError(f"{folder / name} cannot be read ({error}); {REMEDY}") from None

    findings = _json(text("findings.json"), "findings", folder / "findings.json")
    comparison = _json(text("comparison.json"), "comparison", folder / "comparison.json")
    inspections: dict[str, Any] = {"logs": []}
    if (folder / "inspection.json").exists():
        inspections = _json(text("inspection.json"), "inspections", folder / "inspection.json")
    audit: dict[str, Any] = {}
    if (folder / "audit.json").exists():
        audit = _json(text("audit.json"), "audit", folder / "audit.json")
        _check_records(audit, "laws", ("law", "verdict"), folder / "audit.json")
    record: dict[str, Any] = {}
    if (folder / "run.json").exists():
        record = _json(text("run.json"), "run", folder / "run.json")
        _check_records({"log_sha256": [], **record}, "log_sha256", (), folder / "run.json")
        _check_objects(record, ("versions",), folder / "run.json")
    _check_findings(findings, folder / "findings.json")
    _check_comparison(comparison, folder / "comparison.json")
    _check_inspections(inspections, folder / "inspection.json")
    return RunFolder(
        folder=folder,
        findings=findings,
        comparison=comparison,
        nominal=_vehicle(text("nominal.yaml"), folder / "nominal.yaml"),
        corrected=_vehicle(text("model.yaml"), folder / "model.yaml"),
        series=_series(text("series.csv"), folder / "series.csv"),
        inspections=inspections["logs"],
        audit=audit,
        record=record,
        digests=digests,
    )


def _json(text: str, schema: str, path: Path) -> dict[str, Any]:
    def refuse(constant: str) -> NoReturn:
        raise ValueError(f"{constant} is not JSON")

    try:
        content = json.loads(text, parse_constant=refuse)
    except ValueError as error:
        raise RequestError(f"{path} is not valid JSON ({error}); {REMEDY}") from None
    if not isinstance(content, dict):
        raise RequestError(f"{path}: expected a JSON object, got a {type(content).__name__}; {REMEDY}")
    expected = f"undertow.{schema}/1"
    if content.get("schema") != expected:
        raise RequestError(f"{path}: expected schema {expected!r}, got {content.get('schema')!r}; {REMEDY}")
    return content


def _check_findings(findings: Mapping[str, Any], path: Path) -> None:
    _check_records(findings, "candidates", ("effect", "verdict"), path)
    for candidate in findings["candidates"]:
        _check_records({"terms": [], **candidate}, "terms", (), path)
    for key in ("unnamed", "failures", "advice"):
        _check_records({key: [], **findings}, key, (), path)
    _check_records(findings, "steps", ("acceleration_rmse", "rollout_rmse"), path)
    if not findings["steps"]:
        raise RequestError(f"{path}: expected at least one entry in 'steps' (the nominal model), got none; {REMEDY}")
    for step in findings["steps"]:
        _check_errors(step["acceleration_rmse"], step["rollout_rmse"], path)
    _check_objects(findings, ("data", "criterion", "identifiability"), path)
    if not isinstance(findings.get("missing"), list):
        raise RequestError(f"{path}: expected a list under 'missing', got {findings.get('missing')!r}; {REMEDY}")


def _check_comparison(comparison: Mapping[str, Any], path: Path) -> None:
    _check_records(comparison, "models", ("name",), path)
    for key in ("failures", "differences"):
        _check_records({key: [], **comparison}, key, (), path)
    _check_objects(comparison, ("best",), path)
    if not isinstance(comparison.get("logs", []), list):
        raise RequestError(f"{path}: expected a list under 'logs', got {comparison['logs']!r}; {REMEDY}")
    for model in comparison["models"]:
        acceleration = model.get("acceleration", {})
        rmse = acceleration.get("rmse", {}) if isinstance(acceleration, dict) else acceleration
        _check_errors(rmse, model.get("rollout", {}), path)
        _check_records({"laws": [], **model}, "laws", ("law", "verdict"), path)
        _check_objects(model, ("domain",), path)


def _check_inspections(inspections: Mapping[str, Any], path: Path) -> None:
    _check_records(inspections, "logs", ("path",), path)
    for log in inspections["logs"]:
        for key in ("channels", "alignment"):
            _check_records({key: [], **log}, key, (), path)
        for key in ("excitation", "plan"):
            if not isinstance(log.get(key) or {}, dict):
                raise RequestError(f"{path}: expected an object or null under {key!r}, got {log[key]!r}; {REMEDY}")
        _check_records({"segments": [], **(log.get("plan") or {})}, "segments", (), path)


def _check_objects(content: Mapping[str, Any], keys: tuple[str, ...], path: Path) -> None:
    """What is optional may be missing or null, but nothing else than an object."""
    for key in keys:
        if content.get(key) is not None and not isinstance(content[key], dict):
            raise RequestError(f"{path}: expected an object under {key!r}, got {content[key]!r}; {REMEDY}")


def _check_errors(acceleration: Any, rollout: Any, path: Path) -> None:
    """Acceleration errors by axis, and rollout errors by horizon [s], then axis."""
    try:
        horizons = [float(key) for key in rollout]
        sound = all(isinstance(part, dict) for part in (acceleration, rollout, *rollout.values()))
    except (AttributeError, TypeError, ValueError):
        horizons, sound = [], False
    if not sound or not np.isfinite(horizons).all():
        raise RequestError(f"{path}: expected errors by axis, and by horizon in seconds, of every model; {REMEDY}")


def _check_records(content: Mapping[str, Any], key: str, keys: tuple[str, ...], path: Path) -> None:
    records = content.get(key)
    if not isinstance(records, list) or not all(isinstance(record, dict) for record in records):
        raise RequestError(f"{path}: expected a list of objects under {key!r}; {REMEDY}")
    for index, record in enumerate(records):
        lacking = [name for name in keys if name not in record]
        if lacking:
            raise RequestError(f"{path}: {key}[{index}] lacks {', '.join(map(repr, lacking))}; {REMEDY}")


def _vehicle(text: str, path: Path) -> Vehicle:
    try:
        return vehicle_from_dict(yaml.safe_load(text), str(path))
    except VehicleError as error:
        raise RequestError(f"{error}; {REMEDY}") from None
    except yaml.YAMLError as error:
        raise RequestError(f"{path} is not valid YAML ({error}); {REMEDY}") from None


def _series(text: str, path: Path) -> pd.DataFrame:
    try:
        series = pd.read_csv(io.StringIO(text))
    except (pd.errors.ParserError, pd.errors.EmptyDataError) as error:
        raise RequestError(f"{path} is not a readable CSV ({error}); {REMEDY}") from None
    lacking = [name for name in SERIES_COLUMNS if name not in series.columns]
    if lacking:
        raise RequestError(f"{path} lacks the column {', '.join(lacking)}; {REMEDY}")
    if series.empty:
        raise RequestError(f"{path} has no rows; {REMEDY}")
    broken = [
        name
        for name in SERIES_COLUMNS
        if name not in ("part", "log") and not pd.api.types.is_numeric_dtype(series[name])
    ]
    if broken:
        raise RequestError(f"{path}: expected numbers in the column {', '.join(broken)}; {REMEDY}")
    return series
