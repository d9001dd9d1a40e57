"""The workbench: a log and a model that a person corrects step by step, each step fitted and judged at once."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ..discovery.balance.long_logs import digest
from ..discovery.basis import Basis, choose
from ..discovery.by_hand import Bench, ByHand
from ..discovery.findings import Findings
from ..discovery.found_effects import FoundEffect
from ..discovery.settings import DiscoverySettings
from ..measurements.preparation.derive import accelerations
from ..measurements.preparation.held_out import folds_of
from ..measurements.prepared_logs import Inputs, PathLike
from ..measurements.quality.finding import SEVERITY
from ..measurements.statistics.single_threaded import single_threaded
from ..physics.effects import BY_NAME
from ..physics.errors import RequestError
from ..physics.frames import AXES, Array
from ..physics.in_words import number, unit_text, words
from ..physics.matrices import mass_matrix
from ..physics.simulation import rollout
from ..physics.stage import Say
from ..physics.vehicle import Vehicle
from ..reports.page.chapters.play import knobs_of
from ..reports.page.figures.missing_force import MissingForce, best_signal, force_drawings
from ..reports.page.outcome import opening
from ..reports.wording import effect_words, interval, twins, within
from ..residuals.models.base import VehicleModel
from ..residuals.scores import rollout_errors
from ..residuals.series import RESTART, Stretch, predicted, stretches
from .discover_and_add import add, discover
from .run_folder.run import Run
from .run_folder.write import write_run
from .workbench_facts import Card, Check, Fit, Opened, Searched, Value, Way

OWN_NUMBERS = "own numbers"
"""Among the names of effects: the numbers that the vehicle file has, fitted to the log, before anything is added."""
HORIZON = RESTART
"""Seconds of a prediction, as the report page has it."""
_FORCES = ("X", "Y", "N")
_STATES = ("north", "east", "psi", "u", "v", "r")
_GAP = 1.5
"""Steps between rows from which a record is broken there."""
_AHEAD = 30.0
"""Length of a prediction that somebody asks for at a place [s]."""
_DRAWN = 8
"""Effects that get a picture: more would not be looked at, and each takes a tenth of a second."""


class Workbench:
    """A log and a nominal model on the bench.

    Parameters
    ----------
    inputs : logs and vehicle, see `read_inputs`; folds judge
    refit : fit the model's own numbers while effects are searched, as for a vehicle file made of the log
    """

    def __init__(self, inputs: Inputs, *, refit: bool = False) -> None:
        self._settings = DiscoverySettings(refit=refit)
        self._run: Run | None = None
        self._whole = inputs.whole()
        motions, _ = digest(self._whole.fitting, self._settings.weak)
        self._put(self._whole.in_folds(folds_of(motions)))

    def _put(self, inputs: Inputs, basis: Basis | None = None) -> None:
        """Begin with inputs whose judged rows are cut where folds begin and end, so that no prediction crosses one.

        Parameters
        ----------
        basis : what judges them, where a discovery has chosen it; else it is chosen when it is first asked for
        """
        self._inputs = inputs
        self._benches = {} if basis is None else {False: Bench(basis)}
        self._fits: dict[tuple[tuple[str, ...], tuple[tuple[str, float], ...]], Fit] = {}
        self._rows = _Rows(sorted(stretches(inputs.parts), key=lambda s: (s.log, float(s.motion.time[0]))))

    def opened(self) -> Opened:
        """What is measured, and what the nominal model makes of it."""
        inputs = self._inputs
        inspections = inputs.inspections
        found = [finding for inspection in inspections for finding in inspection.quality]
        checks = tuple(
            Check(f.verdict, f.sentence, f.consequence, f.remedy, f.fix.sentence if f.fix else "")
            for f in sorted(found, key=lambda f: SEVERITY.index(f.verdict))
            if f.verdict != "ok"
        )
        nominal = VehicleModel(inputs.vehicle, "nominal", "physics")
        return Opened(
            inputs.log_names,
            inputs.vehicle.name,
            self._rows.seconds,
            tuple(inputs.warnings),
            tuple(inputs.notes),
            checks,
            self._rows.measured(inputs.channels),
            inputs.channels,
            HORIZON,
            self._judged((), nominal),
        )

    def search(self, progress: Say | None = None) -> Searched:
        """Search for what is missing, as `discover` does; cards for all that was tried."""
        run = discover(self._whole, self._settings, progress=progress)
        self._run = run
        self._put(run.inputs, run.discovery.basis)
        findings = run.findings
        judged = [c for c in findings.candidates if not c.cannot_tell]
        cards = [self._card(c, findings, drawn=k < _DRAWN) for k, c in enumerate(judged)]
        own = (OWN_NUMBERS,) if findings.calibrated else ()
        return Searched(
            findings.verdict,
            findings.headline,
            tuple(opening(findings, run.comparison))[1:],
            (*own, *(_key(c) for c in findings.added)),
            tuple(cards),
            tuple(s.sentence for s in findings.sensors if s.verdict != "no evidence"),
            tuple((one.manoeuvre, one.why) for one in findings.advice),
            run.discovery.hidden is not None,
        )

    @single_threaded
    def fit(self, names: Sequence[str], moved: Mapping[str, float] | None = None) -> Fit:
        """The model with these effects, fitted and judged, or with some of its numbers `moved` by hand.

        Raises
        ------
        RequestError
            for an effect that is unknown, given twice, or cannot be judged on this log; when a solver fails.
        """
        asked = tuple(names), tuple(sorted((moved or {}).items()))
        if asked not in self._fits:
            self._fits[asked] = self._fitted(*asked)
        return self._fits[asked]

    def way(self, names: Sequence[str], time: float, moved: Mapping[str, float] | None = None) -> Way:
        """Where the nominal model and the one with these effects say that the boat goes from an instant on."""
        stretch, row = self._rows.at(time)
        steps = min(round(_AHEAD / stretch.motion.time_step), stretch.motion.time.size - 1 - row)
        if steps < 1:
            raise RequestError("there is no measurement after this place; choose one before it")
        after = self._model(tuple(names), tuple((moved or {}).items())).vehicle
        ways = [
            rollout(vehicle, stretch.motion, np.array([row]), steps).states[0, :, :2]
            for vehicle in (self._inputs.vehicle, after)
        ]
        clock = time + stretch.motion.time_step * np.arange(steps + 1, dtype=float)
        return Way(clock, stretch.motion.position[row : row + steps + 1], *ways)

    def run(self, names: Sequence[str], progress: Say | None = None) -> Run:
        """The run of these effects, as `add` makes it; that of the search where they are what it found.

        Raises
        ------
        RequestError
            when nothing was searched and no effect is asked for.
        """
        found = self._run
        added = [name for name in names if name != OWN_NUMBERS]
        if found is not None and (not names or set(names) == {_key(c) for c in found.findings.added}):
            return found
        if found is not None and OWN_NUMBERS in names and found.findings.calibrated:
            return found
        return add(added, self._whole, progress=progress)

    def write(self, names: Sequence[str], folder: PathLike, progress: Say | None = None) -> Path:
        """Write the run folder of these effects; see `run`."""
        return write_run(self.run(names, progress), folder, progress=progress)

    def vehicle(self, names: Sequence[str], moved: Mapping[str, float] | None = None) -> Vehicle:
        """The model with these effects."""
        return self._model(tuple(names), tuple((moved or {}).items())).vehicle

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

    def _model(self, names: tuple[str, ...], moved: tuple[tuple[str, float], ...]) -> VehicleModel:
        made = self._made(names)
        if made is None and not moved:
            return VehicleModel(self._inputs.vehicle, "nominal", "physics")
        vehicle = self._inputs.vehicle if made is None else made.vehicle
        if moved:
            return VehicleModel(vehicle.with_values(dict(moved)), "by hand", "symbolic")
        return VehicleModel(vehicle, "corrected", "symbolic", unseen=() if made is None else made.apart)

    def _fitted(self, names: tuple[str, ...], moved: tuple[tuple[str, float], ...]) -> Fit:
        model = self._model(names, moved)
        return self._judged(names, model, moved=bool(moved))

    def _judged(self, names: tuple[str, ...], model: VehicleModel, *, moved: bool = False) -> Fit:
        """A model on the rows that judge."""
        found = rollout_errors(model, self._inputs.parts.judged, (HORIZON,)).get(f"{HORIZON:g}")
        error = {} if found is None else found.score.record.model_dump()
        made = self._made(names)
        ci95 = {} if made is None else made.ci95
        values = tuple(
            Value(k.symbol, k.what, unit_text(k.unit), k.before, k.after, _ends(ci95.get(k.symbol)), k.low, k.high)
            for k in knobs_of(self._inputs.vehicle, model.vehicle)
        )
        passivity = None if made is None or moved else made.passivity
        verdict, law = ("", "") if passivity is None else (passivity.verdict, passivity.sentence)
        columns = self._rows.columns(model, self._inputs.vehicle)
        error = {name: float(error[name]) for name in ("position", *AXES) if name in error}
        return Fit(
            names,
            error,
            0 if found is None else found.diverged,
            columns,
            values,
            verdict,
            law,
            unseen=bool(names) and not moved,
        )

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
            _key(found),
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
            model = self._model((_key(found),), ())
        except RequestError:
            return ""
        table = self._rows.measured(self._inputs.channels)
        left = self._rows.columns(model, self._inputs.vehicle)
        nominal = self._rows.columns(VehicleModel(self._inputs.vehicle, "nominal"), self._inputs.vehicle)
        drawn = []
        for axis, force in enumerate(_FORCES):
            known = np.isfinite(nominal[force]) & np.isfinite(left[force])
            lacking, added = nominal[force][known], (nominal[force] - left[force])[known]
            if lacking.size and np.any(added):
                rows = {name: values[known] for name, values in table.items()}
                signal = best_signal(rows, added)
                drawn.append(MissingForce(axis, lacking, added, signal, rows[signal]))
        best = max(drawn, key=lambda one: one.told, default=None)
        return str(force_drawings([best])[0]) if best is not None else ""


class _Rows:
    """The rows of all stretches on one axis of time, with a row of NaN where the record breaks."""

    def __init__(self, along: Sequence[Stretch]) -> None:
        self._along = along
        self._offsets: list[float] = []
        clock, ends, shift, log = [], [], 0.0, None
        for stretch in along:
            time, step = stretch.motion.time, stretch.motion.time_step
            if stretch.log != log:
                last = clock[-1][-1] if clock else -step
                shift, log = float(last + step - time[0]) if clock else -float(time[0]), stretch.log
                broken = bool(clock)
            else:
                broken = bool(time[0] + shift - clock[-1][-1] > _GAP * step)
            self._offsets.append(shift)
            if broken:
                ends.append(sum(part.size for part in clock))
            clock.append(time + shift)
        self._breaks = np.array(ends, int)
        self._clock = np.concatenate(clock)

    @property
    def seconds(self) -> float:
        """Length of all stretches [s]."""
        return sum(stretch.motion.duration for stretch in self._along)

    def spread(self, values: Array) -> Array:
        """A column (rows,) with its breaks."""
        return np.insert(np.asarray(values, float), self._breaks, np.nan) if self._breaks.size else values

    def measured(self, channels: Sequence[str]) -> dict[str, Array]:
        """What was measured."""
        at = np.insert(self._clock, self._breaks, self._clock[self._breaks - 1] + 1e-3) if self._breaks.size else None
        found = {"time": self._clock if at is None else at, "anew": self.spread(np.concatenate(self._anew()))}
        parts = [
            np.column_stack([s.motion.position, s.motion.heading, s.motion.velocity, accelerations(s.motion)])
            for s in self._along
        ]
        whole, commands = np.concatenate(parts), np.concatenate([s.motion.commands for s in self._along])
        names = (*_STATES, "u_dot", "v_dot", "r_dot")
        found |= {name: self.spread(whole[:, k]) for k, name in enumerate(names)}
        return found | {name: self.spread(commands[:, k]) for k, name in enumerate(channels)}

    def _anew(self) -> list[Array]:
        """One where predictions begin anew from the measurement, by stretch; see `residuals.series.restarted`."""
        every = [round(RESTART / s.motion.time_step) for s in self._along]
        rows = [np.arange(s.motion.time.size) for s in self._along]
        return [(row % n == 0).astype(float) for row, n in zip(rows, every, strict=True)]

    def columns(self, model: VehicleModel, nominal: Vehicle) -> dict[str, Array]:
        """What a model predicts, and the force that it leaves, in the nominal model's mass."""
        said = np.concatenate(predicted(model, self._along))
        measured = np.concatenate([accelerations(s.motion) for s in self._along])
        left = (measured - said[:, :3]) @ mass_matrix(nominal)
        names = ("north", "east", "psi", "u", "v", "r")
        found = {name: self.spread(said[:, 3 + k]) for k, name in enumerate(names)}
        return found | {name: self.spread(left[:, k]) for k, name in enumerate(_FORCES)}

    def at(self, time: float) -> tuple[Stretch, int]:
        """The stretch and its row nearest to an instant of the table."""
        row = int(np.argmin(np.abs(self._clock - time)))
        for stretch in self._along:
            if row < stretch.motion.time.size:
                return stretch, row
            row -= stretch.motion.time.size
        raise RequestError(f"there is no row at {number(time)} s")


def _key(found: FoundEffect) -> str:
    """The name of an effect as `add` takes it, with its thruster."""
    effect = BY_NAME.get(found.effect)
    if effect is None or not effect.per_thruster or not found.terms:
        return found.effect
    thruster = found.terms[0].symbol.removesuffix(effect.symbols[0].replace("{thruster}", ""))
    return f"{found.effect}[{thruster}]"


def _ends(ci95: tuple[float, float] | None) -> tuple[float, float] | None:
    return None if ci95 is None else (float(ci95[0]), float(ci95[1]))
