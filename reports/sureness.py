"""Words for a claim: how sure a name is, its numbers, and its coefficients before and after."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ..discovery.effect_findings import LIKELY, EffectFinding, rounded_probability
from ..discovery.findings import Findings
from ..physics.effects import BY_NAME, PARAMETERS
from ..physics.errors import VehicleError
from ..physics.presentation import MINUS, NARROW, finite, number, percent, share_removed, unit_text
from ..physics.vehicle import Vehicle
from .wording import effect_words, interval, within

SURE = "calibrated probability that the name is true, in worlds like those of the studies (docs/judgement.md)"
"""What stands under "sure" in every table, on every card and in every picture."""
SURE_IN_SHORT = "sure: calibrated probability that the name is true (docs/judgement.md)"
"""The same where there is one line for it."""
UNCALIBRATED = "not known: an earlier version wrote this run, before the odds of a name were calibrated"
"""What stands there of the findings of an earlier version."""
BACK = "comes back without it"
"""Over the column of what an effect is worth."""
COMES_BACK = (
    "squared force error on unseen rows when it alone is left out (or that it would still remove), as a share of the "
    "nominal model's on its best axis"
)
"""What that is."""


def odds(found: EffectFinding) -> str:
    """How sure a name is, such as "87 %"; empty where nobody knows.

    Nothing is told of what the log cannot show, nor of a number that contradicts its own verdict: a name that is merely
    possible has odds under those of a likely one, and what is larger there is another kind of number.

    Examples
    --------
    >>> from undertow.discovery.effect_findings import EffectFinding
    >>> from undertow.physics.presentation import NARROW
    >>> def sure(verdict, confidence):
    ...     found = EffectFinding(effect="munk_moment", verdict=verdict, confidence=confidence, error_drop=0.1)
    ...     return odds(found).replace(NARROW, " ")
    >>> sure("likely", 0.871), sure("missing", 1.0), sure("possible", 0.999), sure("possible", 0.4)
    ('87 %', '> 99 %', '', '40 %')
    """
    known = finite(found.confidence)
    if math.isnan(known) or found.cannot_tell or (known >= LIKELY and found.verdict in ("possible", "no evidence")):
        return ""
    return percent(rounded_probability(known))


def sure_caption(candidates: Iterable[EffectFinding]) -> str:
    """What "sure" is, in a phrase."""
    known = [item for item in candidates if not math.isnan(item.confidence)]
    return f"sure: {SURE if known else UNCALIBRATED}"


def with_odds(found: EffectFinding) -> str:
    """An effect in words, and how sure it is."""
    known = odds(found)
    return f"{effect_words(found)} ({known})" if known else effect_words(found)


def verdict_word(found: EffectFinding) -> str:
    """The verdict, or that the log cannot tell."""
    return "cannot tell" if found.cannot_tell else found.verdict


def marked(found: EffectFinding) -> str:
    """The verdict and how sure it is, such as "likely (87 %)"."""
    known = odds(found)
    return f"{verdict_word(found)} ({known})" if known else verdict_word(found)


def worth(found: EffectFinding) -> float:
    """Share of the nominal model's squared force error on unseen rows that comes back without an effect."""
    return finite(found.error_drop if found.claim is None else found.claim.worth.force)


def comes_back(found: EffectFinding) -> str:
    """The same in words; empty where the log cannot show it."""
    return "" if found.cannot_tell else share_removed(worth(found))


def in_order(candidates: Iterable[EffectFinding]) -> list[EffectFinding]:
    """Candidates by verdict, those of one verdict by the odds that are shown, then by what comes back without them.

    What the log cannot show stands after what it can.
    """

    def place(item: EffectFinding) -> tuple[int, bool, float, float]:
        shown = finite(item.confidence) if odds(item) else 0.0
        return item.rank, item.cannot_tell, -shown, -worth(item)

    return sorted(candidates, key=place)


def named(findings: Findings, *verdicts: str) -> list[EffectFinding]:
    """The candidates of some verdicts that stand in the corrected model, the surest first."""
    return [item for item in in_order(findings.added) if item.verdict in verdicts]


@dataclass(frozen=True, slots=True)
class FileNumber:
    """A number of an effect as a corrected vehicle file has it: the whole of it, not what is added.

    Attributes
    ----------
    symbol, unit : its name and SI unit
    value : what the log asks for [unit]
    ci95 : 95 % interval [unit]; None where there is none
    in_file : what the nominal vehicle's file says [unit]; None where it says nothing of it
    written : what the corrected model has, where the laws moved it [unit]; else None
    """

    symbol: str
    unit: str
    value: float
    ci95: tuple[float, float] | None
    in_file: float | None = None
    written: float | None = None

    def told(self, *, minus: str = MINUS) -> str:
        """Value and unit; of a number that the file has, what it says, too."""
        ends = f" (95{NARROW}%: {interval(self.ci95, minus=minus)})" if self.ci95 else ""
        amount = f"{self.amount(minus=minus)}{ends}"
        if self.in_file is None:
            return f"{self.symbol} = {amount}"
        return f"{self.symbol} is about {amount}, the file says {self.filed(minus=minus)}"

    def amount(self, *, minus: str = MINUS) -> str:
        """The value with its unit."""
        return f"{within(self.value, self.ci95, minus=minus)} {unit_text(self.unit)}".rstrip()

    def filed(self, *, minus: str = MINUS) -> str:
        """What the file has; empty where it says nothing of it."""
        return "" if self.in_file is None else number(self.in_file, minus=minus)


def file_numbers(found: EffectFinding, nominal: Vehicle) -> list[FileNumber]:
    """The numbers of an effect as a corrected file has them, beside what the nominal file says.

    An effect of drag, coupling, mass or trim is found as an amount to add; a reader compares it with his file.
    """
    effect = BY_NAME.get(found.effect)
    numbers = []
    for term in found.terms:
        own = vehicle_value(nominal, term.symbol) if effect is not None and effect.added else math.nan
        null = PARAMETERS[term.symbol].null if term.symbol in PARAMETERS else 0.0
        filed = None if math.isnan(own) or own == null else own
        shift = filed or 0.0
        ends = None if term.ci95 is None else (term.ci95.lower + shift, term.ci95.upper + shift)
        written = term.in_model + shift if term.moved and term.in_model is not None else None
        numbers.append(FileNumber(term.symbol, term.unit, term.value + shift, ends, filed, written))
    return numbers


def vehicle_value(vehicle: Vehicle, symbol: str) -> float:
    """A vehicle's value of a symbol; NaN when it has no such parameter."""
    try:
        return vehicle.value(symbol)
    except VehicleError:
        return math.nan


def source_marks(findings: Findings) -> dict[str, str]:
    """How sure each number of the corrected model is, by symbol: "missing (97 %)", ..., or "calibrated".

    A vehicle file takes them into its `sources`, see `physics.sources.with_sources`.
    """

    def mark(item: EffectFinding) -> str:
        return marked(item).replace(NARROW, " ")  # a file is typed and searched

    marks = {item.symbol: "calibrated" for item in findings.calibrated}
    marks |= {term.symbol or f"{term.axis}:{term.form}": "possible" for term in findings.unnamed}
    return marks | {term.symbol: mark(item) for item in findings.added for term in item.terms}


@dataclass(frozen=True, slots=True)
class CoefficientRow:
    """One coefficient of a missing effect: before, after, and the 95 % interval of the value after [`unit`]."""

    symbol: str
    unit: str
    before: float
    after: float
    interval: tuple[float, float]


def coefficient_rows(
    candidates: Sequence[EffectFinding], names: Sequence[str], nominal: Vehicle, corrected: Vehicle
) -> list[CoefficientRow]:
    """The coefficients of some effects; an interval of an added amount is shifted by the nominal value."""
    rows = []
    for one in (one for item in candidates if item.effect in names for one in file_numbers(item, nominal)):
        before, after = (vehicle_value(vehicle, one.symbol) for vehicle in (nominal, corrected))
        after = after if np.isfinite(after) else one.value
        ends = one.ci95 if one.ci95 and np.isfinite(one.ci95).all() else (after, after)
        if np.isfinite([before, after]).all():
            rows.append(CoefficientRow(one.symbol, one.unit, before, after, ends))
    return rows


def known_intervals(findings: Findings, nominal: Vehicle) -> dict[str, tuple[float, float]]:
    """95 % intervals of what was found or calibrated, by symbol: of whole values, as the vehicle file has them."""
    found = {one.symbol: one.ci95 for one in findings.calibrated}
    found |= {term.symbol or f"{term.axis}:{term.form}": term.ci95 for term in findings.unnamed}
    known = {symbol: (ends.lower, ends.upper) for symbol, ends in found.items() if ends is not None}
    added = [one for effect in findings.added for one in file_numbers(effect, nominal)]
    return known | {one.symbol: one.ci95 for one in added if one.ci95 is not None}
