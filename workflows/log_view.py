"""What is open on the workbench: rows of logs, what any model predicts on them, and the numbers of the vehicle."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..comparison.models_by_name import logs_of, overlap
from ..discovery.basis import DiscoverySettings, subsample_long_log
from ..measurements.formats.registry import log_digests
from ..measurements.preparation.resampling import accelerations
from ..measurements.preparation.split import folds_of
from ..measurements.prepared_logs import ALL, FOLDS, Inputs
from ..measurements.quality.record import SEVERITY
from ..measurements.statistics.processors import single_threaded
from ..physics.effects import EFFECTS
from ..physics.errors import RequestError
from ..physics.integration import rollout
from ..physics.momentum_balance import mass_matrix
from ..physics.motion import AXES, Array
from ..physics.presentation import listing, number, unit_text, words
from ..physics.sources import assumed, how_sure
from ..physics.vehicle import Vehicle, lacking
from ..residuals.models.band_record import PredictionBand
from ..residuals.models.base import VehicleModel
from ..residuals.scores import acceleration_score, rollout_errors
from ..residuals.series import RESTART, Stretch, half_widths, held_predictions, predicted, stretches
from .first_vehicle import wires_of
from .workbench_facts import Assumed, Check, Field, Fit, Form, Opened, Place, Span, Way, Wire

HORIZON = RESTART
"""Seconds of a prediction, as the report page has it."""
FORCES = ("X", "Y", "N")
_STATES = ("north", "east", "psi", "u", "v", "r")
_AHEAD = 30.0
"""Length of a prediction that somebody asks for at a place [s]."""
_GAP = 1.5
"""Steps between rows from which a record is broken there."""


class LogView:
    """Logs and a vehicle, with the judged rows cut where folds begin and end, so that no prediction crosses an edge.

    A log on which a model is only tried is whole and uncut, and judges as `compare` does of one that it has not seen.

    Parameters
    ----------
    inputs : see `read_inputs`; folds judge, or all rows of a log on which a model is tried
    cut : the rows are cut already
    judged : of a log on which a model is tried, which of its rows judge, and whether a fit saw them; see
        `rows_that_judge`

    Attributes
    ----------
    whole : the inputs as they are searched
    inputs : the same with the rows cut
    rows : of `inputs`
    """

    def __init__(self, inputs: Inputs, *, cut: bool = False, judged: str = "") -> None:
        self.judged = judged
        self.whole = self.inputs = inputs.whole(ALL if judged else FOLDS)
        if not cut and not judged:
            motions, _ = subsample_long_log(self.whole.fitting, DiscoverySettings().weak)
            self.inputs = self.whole.in_folds(folds_of(motions))
        self.rows = Rows(sorted(stretches(self.inputs.parts), key=lambda s: (s.log, float(s.motion.time[0]))))

    def opened(self) -> Opened:
        """Facts of what is measured, and of the nominal model on it."""
        inputs = self.inputs
        found = [finding for inspection in inputs.inspections for finding in inspection.quality]
        checks = tuple(
            Check(f.verdict, f.sentence, f.consequence, f.remedy, f.fix.sentence if f.fix else "")
            for f in sorted(found, key=lambda f: SEVERITY.index(f.verdict))
            if f.verdict != "ok"
        )
        nominal = VehicleModel(inputs.vehicle, "nominal", "physics")
        error, lost = self.error(nominal)
        columns = self.rows.columns(nominal, inputs.vehicle)
        return Opened(
            inputs.log_names,
            inputs.vehicle.name,
            self.rows.seconds,
            tuple(inputs.warnings),
            tuple(inputs.notes),
            checks,
            self.rows.measured(inputs.channels),
            inputs.channels,
            HORIZON,
            Fit((), error, lost, columns, unseen=False, acceleration=self._acceleration(nominal)),
            self.rows.logs,
            judged=self.judged,
        )

    @single_threaded
    def fit(self, fitted: Fit, vehicle: Vehicle) -> Fit:
        """A model that was fitted to another log, with its errors on this one.

        Parameters
        ----------
        fitted, vehicle : the model as the bench shows it, and the same as a vehicle
        """
        model = VehicleModel(vehicle, "shown", "physics")
        error, lost = self.error(model)
        columns = self.rows.columns(model, self.inputs.vehicle, fitted.band)
        held = None if fitted.band is None else held_predictions(model, fitted.band, self.inputs.parts.judged)
        acceleration = self._acceleration(model)
        return replace(fitted, error=error, lost=lost, columns=columns, acceleration=acceleration, held=held)

    def _acceleration(self, model: VehicleModel) -> dict[str, float]:
        """Root mean square errors from row to row, by axis, of a log on which a model is tried [m/s^2, rad/s^2]."""
        if not self.judged:
            return {}
        rmse = acceleration_score(model, self.inputs.parts.judged).rmse
        return dict(zip(AXES, rmse.tolist(), strict=True))

    def error(self, model: VehicleModel) -> tuple[dict[str, float], int]:
        """Root mean square errors of predictions, see `Fit`, and how many of them run away."""
        found = rollout_errors(model, self.inputs.parts.judged, (HORIZON,)).get(f"{HORIZON:g}")
        if found is None:
            return {}, 0
        record = found.score.record
        return {name: float(record.of(name)) for name in ("position", *AXES)}, found.diverged

    def way(self, after: Vehicle, time: float) -> Way:
        """Predicted ways of the nominal model and of another from an instant on.

        Raises
        ------
        RequestError
            at the end of a record.
        """
        stretch, row = self.rows.at(time)
        motion = stretch.motion
        steps = min(round(_AHEAD / motion.time_step), motion.time.size - 1 - row)
        if steps < 1:
            raise RequestError("there is no measurement after this place; choose one before it")
        pair = (self.inputs.vehicle, after)
        ways = [rollout(vehicle, motion, np.array([row]), steps).states[0, :, :2] for vehicle in pair]
        clock = time + motion.time_step * np.arange(steps + 1, dtype=float)
        return Way(clock, motion.position[row : row + steps + 1], *ways)


class Rows:
    """The rows of all stretches on one axis of time, with a row of NaN where the record breaks."""

    def __init__(self, along: Sequence[Stretch]) -> None:
        self._along = along
        self._offsets: list[float] = []
        clock, ends, shift, log = [], [], 0.0, None
        for stretch in along:
            time, step = stretch.motion.time, stretch.motion.time_step
            broken = bool(clock) and (stretch.log != log or time[0] + shift - clock[-1][-1] > _GAP * step)
            if stretch.log != log:
                shift = float(clock[-1][-1] + step - time[0]) if clock else -float(time[0])
            log = stretch.log
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

    @property
    def logs(self) -> tuple[Span, ...]:
        """Place of each of several logs on the axis of time; none for one."""
        numbers = sorted({stretch.log for stretch in self._along})
        found = []
        for log in numbers if len(numbers) > 1 else ():
            own = [(s.motion, by) for s, by in zip(self._along, self._offsets, strict=True) if s.log == log]
            (first, shift), (last, _) = own[0], own[-1]
            name = Path(first.source).name
            found.append(Span(name, float(first.time[0] + shift), float(last.time[-1] + shift)))
        return tuple(found)

    def spread(self, values: Array) -> Array:
        """A column (rows,) with its breaks."""
        return np.insert(np.asarray(values, float), self._breaks, np.nan)

    def measured(self, channels: Sequence[str]) -> dict[str, Array]:
        """Measured columns."""
        # One where predictions begin anew from the measurement, see `residuals.series.restarted`.
        anew = [np.arange(s.motion.time.size) % round(RESTART / s.motion.time_step) == 0 for s in self._along]
        time = np.insert(self._clock, self._breaks, self._clock[self._breaks - 1] + 1e-3)
        found = {"time": time, "anew": self.spread(np.concatenate(anew))}
        motions = [s.motion for s in self._along]
        parts = [np.column_stack([m.position, m.heading, m.velocity, accelerations(m)]) for m in motions]
        whole, commands = np.concatenate(parts), np.concatenate([m.commands for m in motions])
        names = (*_STATES, "u_dot", "v_dot", "r_dot")
        found |= {name: self.spread(whole[:, k]) for k, name in enumerate(names)}
        return found | {name: self.spread(commands[:, k]) for k, name in enumerate(channels)}

    def columns(self, model: VehicleModel, nominal: Vehicle, band: PredictionBand | None = None) -> dict[str, Array]:
        """Predictions of a model, the force that it leaves, in the nominal model's mass, and the ends of its band.

        Parameters
        ----------
        model, nominal : the model, and the one whose mass turns acceleration into force
        band : about open-loop predictions; None for none
        """
        said = np.concatenate(predicted([model], self._along)[0])
        measured = np.concatenate([accelerations(s.motion) for s in self._along])
        left = (measured - said[:, :3]) @ mass_matrix(nominal)
        result = {name: self.spread(said[:, 3 + k]) for k, name in enumerate(_STATES)}
        result |= {name: self.spread(left[:, k]) for k, name in enumerate(FORCES)}
        if band is not None:
            widths = np.concatenate(half_widths(model, band, [s.motion for s in self._along]))
            for k, name in enumerate(("u", "v", "r"), start=1):
                half = self.spread(widths[:, k])
                result |= {f"{name}_low": result[name] - half, f"{name}_high": result[name] + half}
        return result

    def at(self, time: float) -> tuple[Stretch, int]:
        """The stretch and its row nearest to an instant of the table."""
        row = int(np.argmin(np.abs(self._clock - time)))
        for stretch in self._along:
            if row < stretch.motion.time.size:
                return stretch, row
            row -= stretch.motion.time.size
        raise RequestError(f"there is no row at {number(time)} s")


UNSEEN = "This log was not used to fit; errors are of all its rows."
"""Which rows judge, where no fit has seen any of them."""


def rows_that_judge(logs: Sequence[tuple[str, str]], fitted: Sequence[str], nominal: Vehicle) -> str:
    """Say which rows of another log judge, and whether a fit saw them.

    Parameters
    ----------
    logs : path of each judged log, and what the user calls it
    fitted : paths of the logs of the bench
    nominal : its sources may name logs to which it was fitted before

    Returns
    -------
    str
        A sentence.
    """
    own = [(str(one["path"]), one["sha256"]) for one in log_digests(fitted)]
    record = [*own, *logs_of("", VehicleModel(nominal, "nominal", "physics"))]
    digests = [one["sha256"] for one in log_digests([path for path, _ in logs])]
    found = overlap(record, [(name, sha) for (_, name), sha in zip(logs, digests, strict=True)])
    if found.same:
        return f"The model was fitted to {listing(list(found.same))}: its errors are too small there."
    if found.alike:
        names = listing(list(found.alike))
        return f"The vehicle file may have been fitted to {names}: its errors may be too small there."
    return UNSEEN


_RIGID_BODY = (
    ("mass", "mass with payload", "kg"),
    ("inertia_z", "inertia about the body origin", unit_text("kg m^2")),
    ("x_g", "centre of gravity, ahead of the origin", "m"),
)
"""What a scale and a drawing tell: symbol, meaning, unit."""
_APART = ("mass", "inertia_z", "x_g", "y_g")
_ELSE = {
    "thrust_scale": "full thrust",
    "arm_scale": "places of the thrusters",
    "mass": "mass",
    "inertia_z": "inertia",
    "all": "what another boat's file has",
}
"""What is assumed beside numbers that stand in a section of the vehicle file."""
_ALWAYS = ("added_mass", "damping")
"""Sections of the vehicle file that are shown whole: what stands at zero there is what may be missing."""


def form_of(vehicle: Vehicle, wires: Sequence[Wire]) -> Form:
    """The numbers of a vehicle that are set or may be missing, and its thrusters with what drives them."""
    meant = {p.symbol: words(effect.name) for effect in reversed(EFFECTS) for p in effect.parameters}
    beyond = {s for effect in EFFECTS if lacking(vehicle, effect) for s in effect.symbols}
    told = list(_RIGID_BODY)
    for symbol, value in vehicle.values.items():
        parameter = vehicle.parameter(symbol)
        shown = value != parameter.null or parameter.section in _ALWAYS
        if shown and symbol not in _APART and symbol not in beyond:
            told.append((symbol, meant.get(symbol, words(symbol)), unit_text(parameter.unit)))
    fields = [Field(s, what, unit, vehicle.value(s), _source(vehicle, s)) for s, what, unit in told]
    thrust = assumed(vehicle).get("thrust_scale")
    if thrust and not any(field.symbol == "thrust_scale" for field in fields):
        value = vehicle.value("thrust_scale")
        fields.insert(0, Field("thrust_scale", "times the thrust of all thrusters", "", value, thrust))
    places = tuple(Place(t.name, t.x, t.y, t.angle) for t in vehicle.thrusters)
    return Form(tuple(fields), places, wires_of(vehicle, wires))


def assumed_of(vehicle: Vehicle, *, placed: bool = False) -> tuple[Assumed, ...]:
    """What a vehicle has that nobody measured or gave, those of a section together.

    Parameters
    ----------
    placed : a person has said where the thrusters are
    """
    found: dict[str, Assumed] = {}
    for symbol, source in assumed(vehicle).items():
        if not (placed and symbol == "arm_scale"):
            what = _ELSE.get(symbol) or words(_section(vehicle, symbol))
            found[what] = Assumed(what, (*(found[what].symbols if what in found else ()), symbol), how_sure(source))
    order = {what: k for k, what in enumerate(_ELSE.values())}
    return tuple(sorted(found.values(), key=lambda one: order.get(one.what, len(order))))


def _source(vehicle: Vehicle, symbol: str) -> str:
    """What the vehicle file says of where a number is from."""
    section = vehicle.sources.get(_section(vehicle, symbol))
    said = section.get(symbol) if isinstance(section, dict) else section
    return str(vehicle.sources.get(symbol) or said or vehicle.sources.get("all") or "")


def _section(vehicle: Vehicle, symbol: str) -> str:
    return symbol if symbol in _APART else vehicle.parameter(symbol).section
