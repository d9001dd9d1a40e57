"""The coefficients of missing effects: before, after, and the interval of each, for page, figures and fleet."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...discovery.found_effects import FoundEffect
from ...physics.effects import BY_NAME
from ...physics.vehicle import Vehicle
from ..sureness import vehicle_value


@dataclass(frozen=True, slots=True)
class CoefficientRow:
    """One coefficient of a missing effect: before, after, and the 95 % interval of the value after [`unit`]."""

    symbol: str
    unit: str
    before: float
    after: float
    interval: tuple[float, float]


def coefficient_rows(
    candidates: Sequence[FoundEffect], names: Sequence[str], nominal: Vehicle, corrected: Vehicle
) -> list[CoefficientRow]:
    """The coefficients of some effects; an interval of an added amount is shifted by the nominal value."""
    rows = []
    for candidate in candidates:
        if candidate.effect not in names:
            continue
        effect = BY_NAME.get(candidate.effect)
        for term in candidate.terms:
            symbol, value = term.symbol, term.value
            low, high = term.ci95 or (np.nan, np.nan)
            before, after = vehicle_value(nominal, symbol), vehicle_value(corrected, symbol)
            shift = before if effect is not None and effect.added else 0.0
            after = after if np.isfinite(after) else value + shift
            interval = (low + shift, high + shift) if np.isfinite([low, high]).all() else (after, after)
            if np.isfinite([before, after]).all():
                rows.append(CoefficientRow(symbol, term.unit, before, after, interval))
    return rows
