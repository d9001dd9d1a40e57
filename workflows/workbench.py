"""The workbench: a log and a model that a person corrects step by step, each step fitted and judged at once."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..comparison.facts import ComparedModel
from ..discovery.basis import Basis, choose
from ..discovery.by_hand import Bench, ByHand
from ..discovery.findings import Findings
from ..discovery.found_effects import FoundEffect
from ..discovery.settings import DiscoverySettings
from ..measurements.prepared_logs import PathLike
from ..measurements.statistics.single_threaded import single_threaded
from ..physics.effects import BY_NAME
from ..physics.errors import RequestError
from ..physics.frames import AXES
from ..physics.in_words import unit_text, words
from ..physics.simulation import rollout
from ..physics.sources import WHOLE, with_sources
from ..physics.stage import Say
from ..physics.vehicle import Vehicle
from ..reports.page.chapters.play import knobs_of
from ..reports.page.figures.missing_force import MissingForce, best_signal, force_drawings
from ..reports.page.outcome import opening
from ..reports.wording import effect_words, interval, twins, within
from ..residuals.models.base import VehicleModel
from .discover_and_add import add, discover
from .opened_log import FORCES, HORIZON, OpenedLog
from .run_folder.run import Run
from .run_folder.write import write_run
from .workbench_facts import OWN_NUMBERS, Card, Fit, Opened, Rival, Searched, Stand, Value, Way

_AHEAD = 30.0
"""Length of a prediction that somebody asks for at a place [s]."""
_KEPT = 40
"""Models whose predictions are kept, the latest: a slider makes hundreds, each as long as the log."""
_TELLS = 0.05
"""Share of the missing force that an effect must explain by itself for a picture of it to tell anything."""
_DRAWN = 8
"""Effects that get a picture: more would not be looked at, and each takes a tenth of a second."""


class Workbench:
    """A log and a nominal model on the bench.

    Parameters
    ----------
    log : the log that was opened
    refit : fit the model's own numbers while effects are searched, as for a vehicle file made of the log
    """

    def __init__(self, log: OpenedLog, *, refit: bool = False) -> None:
        self._settings = DiscoverySettings(refit=refit)
        self._run: Run | None = None
        self._whole = log.whole
        self._put(log)

    def _put(self, log: OpenedLog, basis: Basis | None = None) -> None:
        """Begin with a log.

        Parameters
        ----------
        basis : what judges it, where a discovery has chosen it; else it is chosen when it is first asked for
        """
        self._log, self._inputs, self._rows = log, log.inputs, log.rows
        self._benches = {} if basis is None else {False: Bench(basis)}
        self._fits: dict[Stand, Fit] = {}

    def opened(self) -> Opened:
        """What is measured, and what the nominal model makes of it."""
        return self._log.opened()

    def search(self, progress: Say | None = None) -> Searched:
        """Search for what is missing, as `discover` does; cards for all that was tried."""
        run = discover(self._whole, self._settings, progress=progress)
        self._run = run
        self._put(OpenedLog(run.inputs, cut=True), run.discovery.basis)
        findings = run.findings
        judged = [c for c in findings.candidates if not c.cannot_tell]
        cards = [self._card(c, findings, drawn=k < _DRAWN) for k, c in enumerate(judged)]
        return Searched(
            findings.verdict,
            findings.headline,
            tuple(opening(findings, run.comparison))[1:],
            _found(run),
            tuple(cards),
            tuple(s.sentence for s in findings.sensors if s.verdict != "no evidence"),
            tuple((one.manoeuvre, one.why) for one in findings.advice),
            tuple(rival(model) for model in run.comparison.models),
            run.discovery.hidden is not None,
        )

    @single_threaded
    def fit(self, stand: Stand) -> Fit:
        """A model, fitted and judged, or with some of its numbers moved by hand.

        Raises
        ------
        RequestError
            for an effect that is unknown, given twice, or cannot be judged on this log; when a solver fails.
        """
        found = self._fits.pop(stand, None) or self._fitted(stand)
        self._fits[stand] = found
        if len(self._fits) > _KEPT:
            del self._fits[next(iter(self._fits))]
        return found

    def way(self, stand: Stand, time: float) -> Way:
        """Where the nominal model and another say that the boat goes from an instant on."""
        stretch, row = self._rows.at(time)
        steps = min(round(_AHEAD / stretch.motion.time_step), stretch.motion.time.size - 1 - row)
        if steps < 1:
            raise RequestError("there is no measurement after this place; choose one before it")
        after = self._model(stand).vehicle
        ways = [
            rollout(vehicle, stretch.motion, np.array([row]), steps).states[0, :, :2]
            for vehicle in (self._inputs.vehicle, after)
        ]
        clock = time + stretch.motion.time_step * np.arange(steps + 1, dtype=float)
        return Way(clock, stretch.motion.position[row : row + steps + 1], *ways)

    def run(self, names: Sequence[str], progress: Say | None = None) -> Run:
        """The run of these effects, as `add` makes it; that of the search where they are what it found, or none.

        Raises
        ------
        RequestError
            when nothing was searched and no effect is asked for; or the model's own numbers are fitted beside effects
            that are not those of the search, of which no verb makes a run.
        """
        found = self._run
        if found is not None and (not names or set(names) == set(_found(found))):
            return found
        if OWN_NUMBERS in names:
            raise RequestError(
                "no run holds the model's own numbers fitted beside effects that are not all that the search found; "
                "take model.yaml, which has them as they are, or leave the own numbers out"
            )
        return add(list(names), self._whole, progress=progress)

    def write(self, names: Sequence[str], folder: PathLike, progress: Say | None = None) -> Path:
        """Write the run folder of these effects; see `run`."""
        return write_run(self.run(names, progress), folder, progress=progress)

    def vehicle(self, stand: Stand) -> Vehicle:
        """A model, which says of every number that it changed where that is from."""
        vehicle, nominal = self._model(stand).vehicle, self._inputs.vehicle
        by = " and by hand" if stand.moved else ""
        return with_sources(nominal, vehicle, f"identified by undertow from {WHOLE}{self._inputs.log_names}{by}")

    def _bench(self, own: bool = False) -> Bench:
        if False not in self._benches:
            basis = choose(self._inputs.fitting, self._inputs.vehicle, self._settings)
            self._benches[False] = Bench(basis)
        if own and True not in self._benches:
            self._benches[True] = Bench(self._benches[False].basis, own=True)
        return self._benches[own]

    def _made(self, names: tuple[str, ...]) -> ByHand | None:
        """The model with these effects; None where there are none."""
        effects = tuple(name for name in names if name != OWN_NUMBERS)
        return self._bench(OWN_NUMBERS in names).with_effects(effects) if names else None

    def _model(self, stand: Stand) -> VehicleModel:
        made = self._made(stand.names)
        if made is None and not stand.moved:
            return VehicleModel(self._inputs.vehicle, "nominal", "physics")
        vehicle = self._inputs.vehicle if made is None else made.vehicle
        if stand.moved:
            return VehicleModel(vehicle.with_values(dict(stand.moved)), "by hand", "symbolic")
        return VehicleModel(vehicle, "corrected", "symbolic", unseen=() if made is None else made.apart)

    def _fitted(self, stand: Stand) -> Fit:
        model, made, nominal = self._model(stand), self._made(stand.names), self._inputs.vehicle
        error, lost = self._log.error(model)
        ci95 = {} if made is None else made.ci95
        values = tuple(
            Value(k.symbol, k.what, unit_text(k.unit), k.before, k.after, _ends(ci95.get(k.symbol)), k.low, k.high)
            for k in knobs_of(nominal, model.vehicle)
        )
        passivity = None if made is None or stand.moved else made.passivity
        verdict, law = ("", "") if passivity is None else (passivity.verdict, passivity.sentence)
        unseen = bool(stand.names) and not stand.moved
        return Fit(stand.names, error, lost, self._rows.columns(model, nominal), values, verdict, law, unseen)

    def _card(self, found: FoundEffect, findings: Findings, *, drawn: bool) -> Card:
        tell = next((one.manoeuvre for one in findings.advice if words(found.effect) in one.why), "")
        numbers = tuple(
            f"{t.symbol} = {within(t.value, t.ci95)} {unit_text(t.unit)}".strip()
            + (f" (95 %: {interval(t.ci95)})" if t.ci95 else "")
            for t in found.terms
        )
        effect = BY_NAME.get(found.effect)
        likely = found.chance is not None and found.chance.none
        return Card(
            found.key,
            effect_words(found).capitalize(),
            found.equation,
            unit_text(found.sentence),
            found.verdict,
            numbers if found.verdict != "no evidence" else (),
            found.chance.in_words if found.chance is not None and likely else "",
            tuple(twins(found)),
            tell,
            self._picture(found) if drawn and effect is not None and found.verdict != "no evidence" else "",
        )

    def _picture(self, found: FoundEffect) -> str:
        """The force that lacks on the axis that the effect explains best, and what it alone adds there."""
        try:
            model = self._model(Stand((found.key,)))
        except RequestError:
            return ""
        table = self._rows.measured(self._inputs.channels)
        left = self._rows.columns(model, self._inputs.vehicle)
        nominal = self._rows.columns(VehicleModel(self._inputs.vehicle, "nominal"), self._inputs.vehicle)
        drawn = []
        for axis, force in enumerate(FORCES):
            known = np.isfinite(nominal[force]) & np.isfinite(left[force])
            lacking, added = nominal[force][known], (nominal[force] - left[force])[known]
            if lacking.size and np.any(added):
                rows = {name: values[known] for name, values in table.items()}
                signal = best_signal(rows, added)
                drawn.append(MissingForce(axis, lacking, added, signal, rows[signal]))
        best = max(drawn, key=lambda one: one.told, default=None)
        return str(force_drawings([best])[0]) if best is not None and best.told >= _TELLS else ""


def _ends(ci95: tuple[float, float] | None) -> tuple[float, float] | None:
    return None if ci95 is None else (float(ci95[0]), float(ci95[1]))


def _found(run: Run) -> tuple[str, ...]:
    """Names of what a search found: the model's own numbers, where it fitted them, and effects."""
    findings = run.findings
    return (*([OWN_NUMBERS] if findings.calibrated else []), *(c.key for c in findings.added))


def rival(model: ComparedModel) -> Rival:
    """A model of a comparison as the workbench shows it."""
    step, ahead = model.acceleration.rmse, model.rollout.get(f"{HORIZON:g}")
    error = {"position": None if ahead is None else ahead.position, **{axis: step.of(axis) for axis in AXES}}
    broken = tuple(law.law for law in model.laws if law.outcome == "fail")
    return Rival(model.name, error, broken, asked=bool(model.laws))
