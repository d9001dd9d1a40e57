"""The workbench: a log and a model that a person corrects step by step, each step fitted and judged at once."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from ..comparison.facts import ComparedModel, Comparison
from ..discovery.basis import DiscoverySettings
from ..discovery.candidates.candidate import CALIBRATED
from ..discovery.changed_boat import part_searched
from ..discovery.findings import Findings
from ..discovery.sensor_error_search import HiddenErrors
from ..measurements.prepared_logs import Inputs, PathLike
from ..measurements.statistics.processors import single_threaded
from ..physics.errors import RequestError
from ..physics.motion import AXES
from ..physics.presentation import listing, words
from ..physics.sources import WHOLE, with_sources
from ..physics.stage import Say
from ..physics.vehicle import Vehicle
from ..reports.page.outcome import headline, opening, section_title
from ..reports.sureness import source_marks, sure_caption
from .bench_session import BenchSession, effect_cards, sensor_cards, weighed
from .discover_and_add import add, discover
from .log_view import HORIZON, LogView
from .run_folder.write import Run, write_run
from .workbench_facts import OWN_NUMBERS, Card, Fit, ModelChoice, Opened, Rival, Searched, Way

_READINGS = 4
"""Readings of a log that are kept, that of the search among them: with and without a correction or two."""


class Workbench:
    """A log and a nominal model on the bench.

    Parameters
    ----------
    log : the log that was opened
    settings : of the search
    """

    def __init__(self, log: LogView, settings: DiscoverySettings | None = None) -> None:
        self._settings = settings or DiscoverySettings()
        self._run: Run | None = None
        self._findings: Findings | None = None
        self._found: tuple[str, ...] | None = None
        self._hidden: HiddenErrors | None = None
        self._whole = log.whole
        self._weighed: dict[tuple[ModelChoice, str], Card] = {}
        self._readings: dict[tuple[str, ...], BenchSession] = {(): BenchSession(log, self._settings)}

    def opened(self, left: tuple[str, ...] = ()) -> Opened:
        """Facts of what is measured, without some corrections of the sensors, and of the nominal model on it."""
        return self._read(left).log.opened()

    def search(self, progress: Say | None = None) -> Searched:
        """Search for what is missing, as `discover` does; cards for all that was tried."""
        run = self._discover(progress)
        return self._answer(run.findings, run.comparison)

    def recall(self, searched: Searched) -> Searched:
        """Go on from the facts of a search that a file holds, with all that a search tells; see `resume`."""
        assert searched.findings is not None, "a file holds the findings"
        assert searched.comparison is not None, "a file holds the comparison"
        self.resume(searched)
        return self._answer(searched.findings, searched.comparison)

    def _answer(self, findings: Findings, comparison: Comparison) -> Searched:
        """What the page tells of a search, and cards for all that was tried."""
        found, verdict = self._readings[()], headline(findings, comparison)
        return Searched(
            findings.verdict,
            verdict,
            tuple(t for t in opening(findings, comparison, self._whole.vehicle) if t != verdict),
            self._found or (),
            effect_cards(findings, found),
            sensor_cards(findings),
            tuple((one.manoeuvre, one.why) for one in findings.advice),
            tuple(rival(model) for model in comparison.models),
            None if self._hidden is None else (self._hidden.arm_x, self._hidden.arm_y, self._hidden.compass),
            section_title(findings, comparison),
            sure_caption(findings.candidates),
            found.refits,
            findings,
            comparison,
        )

    def resume(self, searched: Searched) -> None:
        """Go on from a search that was made elsewhere; its run is made again when somebody asks for it."""
        if self._found is not None:
            return
        self._found, self._findings = searched.found, searched.findings
        if searched.hidden is not None:
            logs, findings = list(self._whole.starts), searched.findings
            told = HiddenErrors.of_findings(findings.sensors, logs) if findings is not None else None
            self._hidden = HiddenErrors(*searched.hidden, told.flows if told is not None else ())
        if searched.hidden is not None or searched.findings is not None:
            changed = searched.findings is not None and searched.findings.change is not None
            opened = LogView(self.inputs(())) if changed or searched.hidden is not None else self._readings[()].log
            self._readings = {(): BenchSession(opened, self._settings, searched=searched.findings)}

    @single_threaded
    def fit(self, stand: ModelChoice, other: LogView | None = None) -> Fit:
        """A model, fitted and judged, or with some of its numbers moved by hand.

        Parameters
        ----------
        stand : the model
        other : another log, on which it is judged as it is fitted to this one

        Raises
        ------
        RequestError
            for an effect that is unknown, given twice, or cannot be judged on this log; when a solver fails.
        """
        reading = self._read(stand.left)
        fit = reading.fit(stand)
        return fit if other is None else other.fit(fit, reading.model(stand).vehicle)

    @single_threaded
    def weigh(self, stand: ModelChoice, name: str) -> Card:
        """The card of something in a model that no search has weighed, see `weighed`."""
        if (stand, name) not in self._weighed:
            self._weighed[stand, name] = weighed(self._read(stand.left), stand, name)
        return self._weighed[stand, name]

    def way(self, stand: ModelChoice, time: float, other: LogView | None = None) -> Way:
        """See `LogView.way`.

        Parameters
        ----------
        stand : the model
        time : on the common axis [s]
        other : another log, along which it goes
        """
        reading = self._read(stand.left)
        return (other or reading.log).way(reading.model(stand).vehicle, time)

    def no_run(self, stand: ModelChoice) -> str:
        """The reason why no verb makes a run of a model, and what to do; empty where one does."""
        names = stand.names
        if stand.moved:
            return (
                "numbers were moved by hand, and no run holds them; take model.yaml, which has them, or set "
                "the fitted values first"
            )
        if stand.left:
            return (
                f"no run is made of a log whose sensors are not corrected ({listing([words(e) for e in stand.left])}); "
                "take model.yaml, which was fitted to it, or add the correction again"
            )
        if not names and self._found is None:
            return "nothing was searched and no effect is added, so there is no run; search first, or add an effect"
        if names == (OWN_NUMBERS,) and not self._is_found(names):
            return (
                "the model's own numbers alone are no run of effects; take model.yaml, which has them as they are, or "
                "add an effect beside them"
            )
        return ""

    def run(self, stand: ModelChoice, progress: Say | None = None) -> Run:
        """The run of some effects, as `add` makes it; that of the search where they are what it found, or none.

        Raises
        ------
        RequestError
            where no verb makes such a run, see `no_run`.
        """
        refusal = self.no_run(stand)
        if refusal:
            raise RequestError(refusal)
        if self._is_found(stand.names):
            return self._run or self._discover(progress)
        effects = [name for name in stand.names if name != OWN_NUMBERS]
        settings = replace(self._settings, refit=OWN_NUMBERS in stand.names)
        return add(effects, self._whole, settings, self._findings, progress=progress)

    def write(
        self, stand: ModelChoice, folder: PathLike, progress: Say | None = None, called: Callable[[str], str] = str
    ) -> None:
        """Write the run folder of some effects; see `run` and `write_run`.

        Parameters
        ----------
        stand : the model
        folder : of the run
        progress : who is told
        called : the user's name of a file from its name in a tab
        """
        write_run(self.run(stand, progress), folder, progress=progress, called=called)

    def vehicle(self, stand: ModelChoice) -> Vehicle:
        """A model, which says of every number that it changed where that is from."""
        reading = self._read(stand.left)
        vehicle, nominal = reading.model(stand).vehicle, reading.inputs.vehicle
        left = f" without the correction of {listing([words(e) for e in stand.left])}" if stand.left else ""
        by = " and by hand" if stand.moved else ""
        marks = source_marks(self._findings) if self._findings is not None else {}
        sure = {symbol: mark for symbol, mark in marks.items() if symbol not in dict(stand.moved)}
        return with_sources(
            nominal, vehicle, f"identified by undertow from {WHOLE}{reading.inputs.log_names}{left}{by}", sure
        )

    def inputs(self, left: Sequence[str], among: Inputs | None = None) -> Inputs:
        """The logs with the corrections that the search makes of their sensors, but for some that are left.

        Parameters
        ----------
        among : the logs, where another part of them is to judge
        """
        inputs = (among or self._whole).leaving(left)
        inputs = part_searched(inputs, self._findings.change if self._findings is not None else None)
        return inputs if self._hidden is None else inputs.mapped(self._hidden.keeping(left).corrected)

    def _discover(self, progress: Say | None) -> Run:
        """Search, and go on from what was found."""
        self._run = run = discover(self._whole, self._settings, progress=progress)
        self._weighed.clear()
        self._found, self._hidden, self._findings = _found(run), run.discovery.hidden, run.findings
        found = LogView(run.inputs, cut=True)
        self._readings = {(): BenchSession(found, run.settings, basis=run.discovery.basis, searched=run.findings)}
        return run

    def _is_found(self, names: Sequence[str]) -> bool:
        """True when a model is what the search found, or has nothing beside what the search began with."""
        return self._found is not None and (not names or set(names) == set(self._found))

    def _read(self, left: tuple[str, ...]) -> BenchSession:
        result = self._readings.pop(left, None)
        if result is None:
            result = BenchSession(LogView(self.inputs(left)), self._settings, left)
        self._readings[left] = result
        for other in [key for key in self._readings if key][:-_READINGS]:
            del self._readings[other]
        return result


def _found(run: Run) -> tuple[str, ...]:
    """Names of what a search found, as its steps add it: the model's own numbers, where it fitted them, and effects."""
    return tuple(OWN_NUMBERS if label == CALIBRATED else str(label) for label, _ in run.discovery.steps[1:])


def rival(model: ComparedModel) -> Rival:
    """A model of a comparison as the workbench shows it."""
    step, ahead = model.acceleration.rmse, model.rollout.get(f"{HORIZON:g}")
    error = {name: None if ahead is None else ahead.of(name) for name in ("position", *AXES)}
    acceleration = {axis: step.of(axis) for axis in AXES}
    broken = tuple(law.law for law in model.laws if law.outcome == "fail")
    return Rival(model.name, HORIZON, error, acceleration, broken, asked=bool(model.laws))
