"""What the log's own record is found to do wrong, beside which every effect was judged."""

from collections.abc import Mapping

from ...physics.vehicle import Vehicle
from ..candidates.candidate import Kind
from ..findings import SensorError
from ..search.bootstrap import Interval
from ..search.scoring import Scoring
from .verdicts import found_terms

_MATERIAL = 0.2
"""Share of the time between two records from which an offset is worth a word: less is how the averages fall."""


def record_errors(
    search: Scoring, fitted: Vehicle, active: tuple[str, ...], intervals: Mapping[str, Interval]
) -> tuple[SensorError, ...]:
    """Findings on the timing of the commands, where a model with the keys `active` has one that is fitted.

    Parameters
    ----------
    fitted : what the log asks for
    intervals : 95 % intervals by symbol
    """
    found = []
    for candidate in search.pool:
        if candidate.kind is not Kind.SENSOR or candidate.key not in active:
            continue
        terms = found_terms(candidate, search.nominal, fitted, intervals)
        (term,), (parameter,) = terms, candidate.parameters
        sure = term.ci95 is not None and not term.ci95.lower <= 0.0 <= term.ci95.upper
        present = sure and abs(term.value) >= _MATERIAL * parameter.upper
        when = "later" if term.value > 0.0 else "earlier"
        sentence = (
            f"The commands act {abs(term.value):.2g} s {when} than their record says, which is within the "
            f"{parameter.upper:.2g} s from one record to the next; every effect was judged beside that."
            if present
            else f"The commands act when their record says, as far as its step of {parameter.upper:.2g} s tells."
        )
        verdict = "present" if present else "no evidence"
        found.append(SensorError(error="channel_offset", verdict=verdict, sentence=sentence, terms=terms))
    return tuple(found)
