"""Making and scoring the models of a study, one by one; each result is kept as soon as it is there."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import torch

from undertow.measurements.preparation.prepare import DataSet
from undertow.measurements.preparation.resampling import accelerations
from undertow.physics.files import write_json
from undertow.physics.motion import AXES, Array
from undertow.residuals.models.base import Model
from undertow.residuals.scores import acceleration_score, rollout_scores

from .cases import Setting
from .contenders import CONTENDERS, made, vehicles

DRAWN = 40.0
"""Stretch of the held-out data whose accelerations are kept for drawing [s]."""


def judge(setting: Setting, seed: int, target: Path, made_by: str) -> list[dict[str, Any]]:
    """Fit and score every contender of one case and one seed; results of another source do not count."""
    torch.set_num_threads(1)
    stored = json.loads(target.read_text("utf-8")) if target.is_file() else {}
    records: dict[str, Any] = stored.get("records", {}) if stored.get("source") == made_by else {}
    if set(CONTENDERS) <= set(records):
        return list(records.values())
    case = setting.make(seed)
    bases, built = vehicles(case), {}
    for name, who in CONTENDERS.items():
        if name in records:
            continue
        if who.base not in built:
            built[who.base] = bases[who.base]()
        model = made(who, built[who.base], case.train, seed)
        record: dict[str, Any] = {"name": name, "seed": seed}
        for part, inputs in (("own", case.train), ("held", case.held)):
            data = inputs.parts.judged
            record[part] = {
                "acceleration": acceleration_score(model, data).record.to_dict(),
                "unfiltered": unfiltered_score(model, data),
                "rollout": {h: s.record.to_dict() for h, s in rollout_scores(model, data).items()},
            }
        if seed == 0:
            record["drawn"] = drawn(model, case.held.parts.judged)
        records[name] = record
        target.parent.mkdir(parents=True, exist_ok=True)
        write_json(target, {"source": made_by, "records": records})
        held = record["held"]["acceleration"]["rmse"]
        print(f"{target.stem}: {name}: " + ", ".join(f"{axis} {x:.4f}" for axis, x in held.items()), flush=True)
    return list(records.values())


def unfiltered_score(model: Model, data: DataSet) -> dict[str, dict[str, float]]:
    """One-step errors of what a model says, as it says it, against the filtered measurement."""
    measured = np.concatenate([accelerations(motion) for motion in data.motions])
    error = measured - np.concatenate([model.acceleration(motion) for motion in data.motions])
    spread = np.square(measured - measured.mean(axis=0)).sum(axis=0)
    told = {
        "rmse": np.sqrt(np.square(error).mean(axis=0)),
        "mae": np.abs(error).mean(axis=0),
        "r2": 1.0 - np.square(error).sum(axis=0) / np.maximum(spread, 1e-300),
    }
    return {key: _by_axis(values) for key, values in told.items()}


def drawn(model: Model, data: DataSet) -> dict[str, Any]:
    """Measured and modelled acceleration of the liveliest stretch of the longest motion."""
    motion = max(data.motions, key=lambda each: each.duration)
    measured, said = accelerations(motion), model.acceleration(motion)
    rows = min(round(DRAWN / motion.time_step), motion.time.size)
    power = np.cumsum(np.concatenate([[0.0], np.square(measured / measured.std(axis=0)).sum(axis=1)]))
    first = int(np.argmax(power[rows:] - power[:-rows]))
    part = slice(first, first + rows)
    return {"step": motion.time_step, "measured": measured[part].tolist(), "said": said[part].tolist()}


def _by_axis(values: Array) -> dict[str, float]:
    return dict(zip(AXES, values.tolist(), strict=True))
