"""Figures of models over the seeds of the repeated paper."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from undertow.physics.frames import AXES

Records = Sequence[Mapping[str, Any]]


def values(records: Records, name: str, part: str, *keys: str) -> np.ndarray:
    """A figure of one model over all seeds, by the path of its keys, surge, sway and yaw: (seeds, 3)."""
    found = []
    for record in records:
        if record["name"] != name:
            continue
        inner: Any = record[part]
        for key in keys:
            inner = inner[key]
        found.append([float("nan") if inner[axis] is None else inner[axis] for axis in AXES])
    return np.array(found)


def relative(records: Records, name: str, other: str, part: str, *keys: str) -> np.ndarray:
    """By how much a model's errors lie below another's, mean over the axes, for each seed: 0.3 is 30 % less."""
    seeds = [{r["seed"] for r in records if r["name"] == each} for each in (name, other)]
    both = [r for r in records if r["seed"] in seeds[0] & seeds[1]]
    mine, theirs = values(both, name, part, *keys), values(both, other, part, *keys)
    if not mine.size:
        return np.zeros(0)
    return 1.0 - (mine / theirs).mean(axis=1)
