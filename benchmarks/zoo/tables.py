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
    """Logarithm of a model's errors over another's, mean over the axes, for each seed that both have: 0 is equal."""
    seeds = [{r["seed"] for r in records if r["name"] == each} for each in (name, other)]
    both = [r for r in records if r["seed"] in seeds[0] & seeds[1]]
    mine, theirs = values(both, name, part, *keys), values(both, other, part, *keys)
    return np.log(mine / theirs).mean(axis=1) if mine.size else np.zeros(0)
