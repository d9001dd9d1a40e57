"""Which logs of several disagree with the others on a corrected model."""

import numpy as np

from ...physics.frames import AXES
from ...physics.vehicle import Vehicle
from ..balance.base import Balance


def disagreements(form: Balance, nominal: Vehicle, corrected: Vehicle) -> list[str]:
    """Sentences on logs in which rollouts of the corrected model are worse than the nominal model's on some axis."""
    sources = form.sources
    if len(set(sources)) < 2:
        return []
    before, after = form.squares(nominal), form.squares(corrected)
    notes = []
    for source in dict.fromkeys(sources):
        rows = np.array([s == source for s in sources])
        was, now = (np.sqrt(x[rows].mean(axis=0)) for x in (before, after))
        worse = [
            f"{name} {b:.2f} instead of {a:.2f} {unit}"
            for name, a, b, unit, level in zip(AXES, was, now, form.unit, np.sqrt(after.mean(axis=0)), strict=True)
            if b > 1.2 * a and b > level
        ]
        if worse:
            notes.append(f"{_name(source)} disagrees with the other logs: rollout error {', '.join(worse)}")
    return notes


def _name(source: str) -> str:
    return source.replace("\\", "/").rsplit("/", 1)[-1]
