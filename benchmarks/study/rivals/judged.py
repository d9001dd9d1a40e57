"""Making and scoring the contenders of one case and seed, one by one; each record is kept as soon as it is there."""

import json
from collections.abc import Collection
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from undertow.physics.errors import LogError, RequestError, VehicleError
from undertow.physics.files import write_json
from undertow.physics.motion import AXES, Array
from undertow.physics.vehicle import Vehicle
from undertow.residuals.models.base import Model
from undertow.residuals.scores import evaluate
from undertow.workflows.fit import fit

from ..records import fingerprint
from .cases import Case, Data
from .contenders import CONTENDERS

PACKAGES = ("physics", "measurements", "residuals", "discovery", "benchmarks/study/rivals")
"""Packages whose source decides the results."""
HORIZONS = (2.0, 10.0)
"""Of the rollouts [s]."""
Record = dict[str, Any]


def wanted(case: Case, seed: int, first: int) -> list[str]:
    """Contenders of a seed: what is not random is made once for data that a seed does not change."""
    return [name for name, who in CONTENDERS.items() if who.random or case.moves or seed == first]


def kept(target: Path) -> dict[str, Record]:
    """Records of an earlier run by contender, if the same source made them."""
    stored = json.loads(target.read_text("utf-8")) if target.is_file() else {}
    return stored["records"] if stored.get("source") == fingerprint(PACKAGES) else {}


def judge(case: Case, seed: int, target: Path, names: Collection[str]) -> list[Record]:
    """The records of some contenders, those that are missing made first."""
    records = kept(target)
    missing = [name for name in names if name not in records]
    if missing:
        data, made_by = case.make(seed), fingerprint(PACKAGES)
        vehicles = {"nominal": data.run.vehicle, "calibrated": fit(data.run, progress=None).vehicle}
    for name in missing:
        records[name] = {"name": name, "seed": seed} | _record(name, data, vehicles[CONTENDERS[name].beside], seed)
        target.parent.mkdir(parents=True, exist_ok=True)
        write_json(target, {"source": made_by, "records": records})
        print(f"{target.stem}: {name}: {told(records[name])}", flush=True)
    return [records[name] for name in names]


def _record(name: str, data: Data, vehicle: Vehicle, seed: int) -> Record:
    begun = perf_counter()
    try:
        model = CONTENDERS[name].make(data, vehicle, name, seed)
        seconds = perf_counter() - begun
        return scored(model, data) | {"seconds": seconds}
    except (LogError, RequestError, VehicleError, np.linalg.LinAlgError) as error:
        return {"failed": str(error)[:200]}


def scored(model: Model, data: Data) -> Record:
    """Errors of a model on the run that judges, as plain data."""
    found = evaluate(model, data.held, HORIZONS)
    record: Record = {"parameters": model.parameters, "acceleration": _by_axis(found.acceleration_score.rmse)}
    for horizon, score in found.rollout_scores.items():
        record[horizon] = _by_axis(score.velocity) | {"position": score.position}
        record[horizon] |= {"diverged": score.diverged, "starts": score.starts}
    return record


def told(record: Record) -> str:
    """A record in a line."""
    if "failed" in record:
        return f"failed: {record['failed']}"
    errors = ", ".join(f"{x:.4f}" for x in record["acceleration"].values())
    return f"{errors}; 10 s {record['10']['position']:.3f} m; {record['seconds']:.1f} s"


def _by_axis(values: Array) -> dict[str, float]:
    return dict(zip(AXES, values.tolist(), strict=True))
