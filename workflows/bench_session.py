"""A log on the bench: models fitted to it by hand, weighed on rows that no fit saw, and findings as cards."""

from dataclasses import replace

import numpy as np

from ..comparison.recommendation import what_decides
from ..discovery.add_effects import Bench, ManualModel
from ..discovery.basis import Basis, DiscoverySettings
from ..discovery.effect_findings import EffectFinding
from ..discovery.findings import Findings, SensorError
from ..discovery.sequential_fit import basis_for
from ..measurements.statistics.blocks import Verdict, paired_ratio
from ..physics.effects import BY_NAME, COMMAND_OFFSET
from ..physics.errors import RequestError
from ..physics.presentation import listing, number, percent, sentence_case, unit_text, words
from ..reports.page.chapters.play import knobs_of
from ..reports.page.figures.effect_figures import MissingForce, best_signal, force_drawing, signal_rows
from ..reports.sureness import file_numbers, in_order, odds
from ..reports.wording import effect_words, interval, risen, twins, within
from ..residuals.models.base import VehicleModel
from ..residuals.scores import evaluate_all
from ..residuals.series import prediction_band
from .log_view import FORCES, HORIZON, LogView
from .workbench_facts import OWN_NUMBERS, Card, Fit, ModelChoice, Value

_KEPT = 40
"""Models whose predictions are kept, the latest: a slider makes hundreds, each as long as the log."""


class BenchSession:
    """A log in one reading.

    Parameters
    ----------
    log : the log
    settings : of whatever judges it
    left : corrections of the search that this reading does without; stands must have the same
    basis : what judges it, where a discovery has chosen it; else it is chosen when it is first asked for
    searched : findings of a search of this reading: what its model has is added with its numbers
    """

    def __init__(
        self,
        log: LogView,
        settings: DiscoverySettings,
        left: tuple[str, ...] = (),
        basis: Basis | None = None,
        searched: Findings | None = None,
    ) -> None:
        self.log, self.inputs, self.rows = log, log.inputs, log.rows
        self._settings, self._left, self._basis, self._searched = settings, left, basis, searched
        self._benches: dict[bool, Bench] = {}
        self._fits: dict[ModelChoice, Fit] = {}

    def fit(self, stand: ModelChoice) -> Fit:
        """See `Workbench.fit`."""
        result = self._fits.pop(stand, None) or self._fitted(stand)
        self._fits[stand] = result
        if len(self._fits) > _KEPT:
            del self._fits[next(iter(self._fits))]
        return result

    def model(self, stand: ModelChoice) -> VehicleModel:
        """The model of a stand."""
        made = self._made(stand.names)
        if made is None and not stand.moved:
            return VehicleModel(self.inputs.vehicle, "nominal", "physics")
        vehicle = self.inputs.vehicle if made is None else made.vehicle
        if stand.moved:
            return VehicleModel(vehicle.with_values(dict(stand.moved)), "by hand", "symbolic")
        return VehicleModel(vehicle, "corrected", "symbolic", unseen=() if made is None else made.without_folds)

    @property
    def basis(self) -> Basis:
        """The basis that judges it."""
        if self._basis is None:
            chosen = basis_for(self.inputs.fitting, self.inputs.vehicle, self._settings, self._searched)
            self._basis = chosen.keeping_errors(self._left)
        return self._basis

    @property
    def refits(self) -> bool:
        """True when its search fits the model's own numbers, and the log shows any of them."""
        return bool(self.basis.settings.refit) and self._bench(own=True).frees

    def _bench(self, own: bool) -> Bench:
        if own not in self._benches:
            self._benches[own] = Bench(self.basis, own=own, searched=self._searched)
        return self._benches[own]

    def _made(self, names: tuple[str, ...]) -> ManualModel | None:
        """The model with these effects; None where there are none."""
        effects = tuple(name for name in names if name != OWN_NUMBERS)
        return self._bench(OWN_NUMBERS in names).with_effects(effects) if names else None

    def _fitted(self, stand: ModelChoice) -> Fit:
        model, made, nominal = self.model(stand), self._made(stand.names), self.inputs.vehicle
        error, lost = self.log.error(model)
        ends = {} if made is None else {s: (float(low), float(high)) for s, (low, high) in made.ci95.items()}
        values = tuple(
            Value(k.symbol, k.what, unit_text(k.unit), k.before, k.after, ends.get(k.symbol), k.low, k.high)
            for k in knobs_of(nominal, model.vehicle)
        )
        passivity = None if made is None or stand.moved else made.passivity
        verdict, law = ("", "") if passivity is None else (passivity.verdict, passivity.sentence)
        unseen = bool(stand.names) and not stand.moved
        band = prediction_band([(model, self.inputs.parts.judged)]) if unseen else None
        columns = self.rows.columns(model, nominal, band)
        return Fit(stand.names, error, lost, columns, values, verdict, law, unseen, band=band)


_TOLD: dict[Verdict, tuple[str, str]] = {
    "better": (
        "betters unseen rows",
        "On rows that the fit did not see, the model errs {by} less in {what} with it than without: more than chance.",
    ),
    "worse": (
        "worse on unseen rows",
        "On rows that the fit did not see, the model errs {by} more in {what} with it than without.",
    ),
    "no difference": (
        "cannot tell",
        "On rows that the fit did not see, the error in {what} differs by {by}, which is nothing or may be chance.",
    ),
    "too short to tell": ("cannot tell", "The log is too short to judge on rows that the fit did not see."),
}
"""Verdict on the card, and the sentence, by what the comparison on unseen rows says."""


def weighed(bench: BenchSession, stand: ModelChoice, name: str) -> Card:
    """The card of something in a model that no search has weighed.

    Parameters
    ----------
    stand : the model; numbers that were moved by hand count as they were fitted
    name : of the term or effect in it

    Raises
    ------
    RequestError
        as `BenchSession.model` does.
    """
    whole = replace(stand, moved=())
    without = replace(whole, names=tuple(one for one in stand.names if one != name))
    before = {value.symbol for value in bench.fit(without).values}
    own = [value for value in bench.fit(whole).values if value.symbol == name or value.symbol not in before]
    errors = evaluate_all([bench.model(without), bench.model(whole)], bench.inputs.parts.judged)
    decides = what_decides(errors)
    found = paired_ratio(decides.squares[1], decides.squares[0], decides.shortest)
    verdict, sentence = _TOLD[found.verdict if decides.what else "too short to tell"]
    told = sentence.format(by=percent(abs(found.relative)), what=decides.what)
    unsure = [v for v in own if v.ci95 is not None and v.ci95[0] <= v.before <= v.ci95[1]]
    if unsure:
        inside = listing([f"{number(v.before)} in that of {v.symbol}" for v in unsure])
        verdict = "cannot tell"
        told = f"This log cannot tell: what the model has without it lies in the interval, {inside}. {told}"
    numbers = tuple(_number(value.symbol, value.after, value.unit, value.ci95) for value in own)
    return Card(name, words(name), "", told, verdict, numbers)


def _number(symbol: str, value: float, unit: str, ci95: tuple[float, float] | None) -> str:
    """A value with its interval."""
    ends = f" (95 %: {interval(ci95)})" if ci95 else ""
    return f"{symbol} = {within(value, ci95)} {unit_text(unit)}".strip() + ends


_TELLS = 0.05
"""Share of the missing force that an effect must explain by itself for a picture of it to tell anything."""
_DRAWN = 8
"""Effects that get a picture: more would not be looked at, and each takes a tenth of a second."""


def effect_cards(findings: Findings, bench: BenchSession) -> tuple[Card, ...]:
    """A card for every effect that could be judged, the most valuable first."""
    judged = [c for c in in_order(findings.candidates) if not c.cannot_tell]
    return tuple(_effect(c, findings, bench, drawn=k < _DRAWN) for k, c in enumerate(judged))


def sensor_cards(findings: Findings) -> tuple[Card, ...]:
    """A card for everything that the sensors or their record do wrong, by the name of its correction."""
    return tuple(_sensor(s, findings) for s in findings.sensors if s.verdict != "no evidence")


def _sensor(found: SensorError, findings: Findings) -> Card:
    of_commands = found.what in (found.error, COMMAND_OFFSET.symbol)  # of no other record is a delay the twin
    alike = [effect_words(c) for c in findings.candidates if of_commands and found.error in c.indistinguishable_from]
    title = sentence_case(words(found.error))
    numbers = tuple(_number(term.symbol, term.value, term.unit, term.ci95) for term in found.terms)
    return Card(found.correction, title, "", found.sentence, found.verdict, numbers, twins=tuple(alike))


def _effect(found: EffectFinding, findings: Findings, bench: BenchSession, *, drawn: bool) -> Card:
    tell = next((one.manoeuvre for one in findings.advice if words(found.effect) in one.why), "")
    effect = BY_NAME.get(found.effect)
    numbers = file_numbers(found, bench.inputs.vehicle) if found.verdict != "no evidence" else ()
    shown = bench if drawn and effect is not None and found.verdict != "no evidence" else None
    return Card(
        found.key,
        sentence_case(effect_words(found)),
        found.equation,
        " ".join([unit_text(found.sentence), *risen(findings.steps, f"{HORIZON:g}", found)]),
        found.verdict,
        tuple(one.told() for one in numbers),
        tuple(twins(found)),
        tell,
        _picture(found, shown) if shown is not None else "",
        odds(found),
    )


def _picture(found: EffectFinding, bench: BenchSession) -> str:
    """The missing force on the axis that the effect explains best, and what it alone adds there."""
    vehicle = bench.inputs.vehicle
    try:
        model = bench.model(ModelChoice((found.key,)))
    except RequestError:
        return ""
    table = bench.rows.measured(bench.inputs.channels)
    left = bench.rows.columns(model, vehicle)
    nominal = bench.rows.columns(VehicleModel(vehicle, "nominal"), vehicle)
    drawn = []
    for axis, force in enumerate(FORCES):
        known = np.isfinite(nominal[force]) & np.isfinite(left[force])
        lacking, added = nominal[force][known], (nominal[force] - left[force])[known]
        if lacking.size and np.any(added):
            rows = signal_rows({name: values[known] for name, values in table.items()})
            signal = best_signal(rows, added, axis)
            drawn.append(MissingForce(axis, lacking, added, signal, rows[signal]))
    best = max(drawn, key=lambda one: one.told, default=None)
    return str(force_drawing(best)) if best is not None and best.told >= _TELLS else ""
