"""A log as it is read, with or without corrections of its sensors, and every model that is fitted to it by hand."""

from ..discovery.basis import Basis
from ..discovery.by_hand import Bench, ByHand
from ..discovery.findings import Findings
from ..discovery.in_order import chosen_for
from ..discovery.settings import DiscoverySettings
from ..physics.in_words import unit_text
from ..reports.page.chapters.play import knobs_of
from ..residuals.models.base import VehicleModel
from ..residuals.prediction_band import prediction_band
from .opened_log import OpenedLog
from .workbench_facts import OWN_NUMBERS, Fit, Stand, Value, Way

_KEPT = 40
"""Models whose predictions are kept, the latest: a slider makes hundreds, each as long as the log."""


class LogOnBench:
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
        log: OpenedLog,
        settings: DiscoverySettings,
        left: tuple[str, ...] = (),
        basis: Basis | None = None,
        searched: Findings | None = None,
    ) -> None:
        self.log, self.inputs, self.rows = log, log.inputs, log.rows
        self._settings, self._left, self._basis, self._searched = settings, left, basis, searched
        self._benches: dict[bool, Bench] = {}
        self._fits: dict[Stand, Fit] = {}

    def fit(self, stand: Stand) -> Fit:
        """See `Workbench.fit`."""
        found = self._fits.pop(stand, None) or self._fitted(stand)
        self._fits[stand] = found
        if len(self._fits) > _KEPT:
            del self._fits[next(iter(self._fits))]
        return found

    def way(self, stand: Stand, time: float) -> Way:
        """See `OpenedLog.way`."""
        return self.log.way(self.model(stand).vehicle, time)

    def model(self, stand: Stand) -> VehicleModel:
        """The model of a stand."""
        made = self._made(stand.names)
        if made is None and not stand.moved:
            return VehicleModel(self.inputs.vehicle, "nominal", "physics")
        vehicle = self.inputs.vehicle if made is None else made.vehicle
        if stand.moved:
            return VehicleModel(vehicle.with_values(dict(stand.moved)), "by hand", "symbolic")
        return VehicleModel(vehicle, "corrected", "symbolic", unseen=() if made is None else made.apart)

    @property
    def basis(self) -> Basis:
        """What judges it."""
        if self._basis is None:
            chosen = chosen_for(self.inputs.fitting, self.inputs.vehicle, self._settings, self._searched)
            self._basis = chosen.leaving(self._left)
        return self._basis

    @property
    def refits(self) -> bool:
        """Whether its search fits the model's own numbers, and the log shows any of them."""
        return bool(self.basis.settings.refit) and self._bench(own=True).frees

    def _bench(self, own: bool) -> Bench:
        if own not in self._benches:
            self._benches[own] = Bench(self.basis, own=own, searched=self._searched)
        return self._benches[own]

    def _made(self, names: tuple[str, ...]) -> ByHand | None:
        """The model with these effects; None where there are none."""
        effects = tuple(name for name in names if name != OWN_NUMBERS)
        return self._bench(OWN_NUMBERS in names).with_effects(effects) if names else None

    def _fitted(self, stand: Stand) -> Fit:
        model, made, nominal = self.model(stand), self._made(stand.names), self.inputs.vehicle
        error, lost = self.log.error(model)
        ci95 = {} if made is None else made.ci95
        values = tuple(
            Value(k.symbol, k.what, unit_text(k.unit), k.before, k.after, _ends(ci95.get(k.symbol)), k.low, k.high)
            for k in knobs_of(nominal, model.vehicle)
        )
        passivity = None if made is None or stand.moved else made.passivity
        verdict, law = ("", "") if passivity is None else (passivity.verdict, passivity.sentence)
        unseen = bool(stand.names) and not stand.moved
        band = prediction_band(model, self.inputs.parts.judged) if unseen else None
        columns = self.rows.columns(model, nominal, band)
        return Fit(stand.names, error, lost, columns, values, verdict, law, unseen, band=band)


def _ends(ci95: tuple[float, float] | None) -> tuple[float, float] | None:
    return None if ci95 is None else (float(ci95[0]), float(ci95[1]))
