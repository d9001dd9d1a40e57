"""Comparison of models on the same rows, as `comparison.json` has it: errors, laws, domain, coverage of intervals."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from ..discovery.basis import Basis
from ..discovery.calibration.calibrate import calibrate_once
from ..discovery.findings import Step
from ..measurements.preparation.prepare import DataSet
from ..measurements.preparation.split import PARTS, Fold, active
from ..measurements.prepared_logs import ALL, WHOLE, Inputs, Parts
from ..measurements.statistics.blocks import MATERIAL
from ..physics.errors import RequestError
from ..physics.motion import AXES, Array, Motion
from ..physics.presentation import listing, percent
from ..physics.vehicle import Vehicle
from ..residuals.models.band_record import PredictionBand
from ..residuals.models.base import Model, VehicleModel, baselines
from ..residuals.models.interval import LEVEL
from ..residuals.models.network_inputs import in_box
from ..residuals.scores import ACCELERATION_UNITS, ROLLOUT_UNITS, Errors, by_axis, evaluate, evaluate_all
from ..residuals.series import SeriesTable, held_predictions, prediction_band, series
from .audit import Audit, audit_along
from .facts import (
    BASELINE,
    CALIBRATED,
    CORRECTED,
    NOMINAL,
    Best,
    ComparedModel,
    Comparison,
    Domain,
    Held,
    IntervalRecord,
    RulingRecord,
    Side,
    differences,
    rises,
)
from .failing.failures import Fails, where_they_fail
from .recommendation import best


def coverage(model: Model, errors: Errors, data: DataSet) -> IntervalRecord | None:
    """Shares of the rows of a data set at which the measured acceleration lies in a model's interval; None without one.

    Parameters
    ----------
    errors : of the model on these data
    """
    margins = [model.margin(motion) for motion in data.motions]
    told = [margin for margin in margins if margin is not None]
    if not told or len(told) < len(margins):
        return None
    margin, error = np.concatenate(told), np.abs(np.concatenate(errors.acceleration))
    inside = np.concatenate([model.beyond(motion) for motion in data.motions]) == 0.0
    return IntervalRecord(
        level=LEVEL, inside=_held(error[inside], margin[inside]), outside=_held(error[~inside], margin[~inside])
    )


def _held(error: Array, margin: Array) -> Held:
    if not len(error):
        return Held()
    return Held(rows=len(error), share=by_axis((error <= margin).mean(axis=0)), margin=by_axis(margin.mean(axis=0)))


_FITTED_TO = ("train", ALL)
"""What judges where a calibration has seen it."""
_FAR_OUT = 0.05
"""Share of the judged rows far from what a network was trained on that is worth a sentence."""
_AT_REST = 0.1
"""Share of the judged rows with nothing commanded that is worth a sentence."""


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """A model, its errors on the judged rows, what the laws say of it, and what its interval holds.

    Baselines are asked for no laws, and vehicles tell no interval. `sure`: what it adds is called missing, so that it
    is no guess beside the nominal model.
    """

    model: Model
    errors: Errors
    audit: Audit | None
    interval: IntervalRecord | None = None
    sure: bool = False

    @property
    def name(self) -> str:
        """Name of the model."""
        return self.model.name

    def called(self, model: Model) -> "Judged":
        """The same of a model that differs by its name and kind alone."""
        audit = None if self.audit is None else replace(self.audit, model=model.name, kind=model.kind)
        return replace(self, model=model, audit=audit)


def judge_all(models: Sequence[Model], parts: Parts) -> list[Judged]:
    """Several models, judged on the same rows."""
    errors = evaluate_all(models, parts.judged)
    return [judge(model, parts, found) for model, found in zip(models, errors, strict=True)]


def judge(model: Model, parts: Parts, errors: Errors | None = None) -> Judged:
    """Evaluate a model on the judged rows, if it was not yet, and judge it by the laws along all parts of the logs.

    Parameters
    ----------
    model : to be judged
    parts : of the logs, and which of them judges
    errors : of the model, where they were evaluated
    """
    found = evaluate(model, parts.judged) if errors is None else errors
    if isinstance(model, VehicleModel):  # the laws are asked of the vehicle that is written
        return Judged(model, found, audit_along(VehicleModel(model.vehicle, model.name, model.kind), parts))
    audit = None if model.kind == BASELINE else audit_along(model, parts)
    return Judged(model, found, audit, coverage(model, found, parts.judged))


def calibrated_model(
    inputs: Inputs, basis: Basis | None = None, folds: Sequence[Fold] = ()
) -> tuple[list[Model], list[str]]:
    """The nominal model with its own parameters fitted, on nothing that is judged; or none, and a sentence why.

    Where all rows are judged there are no others to fit to, and a sentence says so; where folds judge, a vehicle that
    was fitted without it predicts each. The `basis` of a discovery, which fits to the training and the validation
    part, serves where the calibration fits to both as well.

    Parameters
    ----------
    inputs : the prepared logs
    basis : of the discovery, if there was one
    folds : where folds judge
    """
    judged, motions = inputs.parts.judge, inputs.fitting
    if judged == "validation":
        motions, basis = inputs.weak.train.motions, None
    notes = []
    if judged in _FITTED_TO:
        notes = [f"{CALIBRATED} was fitted to rows that are judged here: its errors are too small, and do not count"]
    begun = perf_counter()
    try:
        fitted, symbols = calibrate_once(motions, inputs.vehicle, basis=basis, folds=folds)
    except RequestError as error:
        return [], [f"there is no {CALIBRATED} model: {error.typed.removeprefix('fit: ')}"]
    vehicle, seconds = fitted.lawful.vehicle, perf_counter() - begun
    return [VehicleModel(vehicle, CALIBRATED, "physics", len(symbols), seconds, fitted.unseen)], notes


def reference_models(
    inputs: Inputs, middle: Sequence[Model] = (), basis: Basis | None = None, folds: Sequence[Fold] = ()
) -> tuple[list[Model], list[str]]:
    """The models that are always compared: nominal, calibrated, those of a run (`middle`), and the baselines.

    Parameters
    ----------
    inputs : the prepared logs
    middle : models of a run
    basis : of the discovery, if there was one
    folds : where folds judge
    """
    known, notes = calibrated_model(inputs, basis, folds)
    nominal = VehicleModel(inputs.vehicle, NOMINAL, "physics")
    return [nominal, *known, *middle, *baselines(inputs.vehicle)], notes


def ends(models: Sequence[Model], recommended: str = "") -> tuple[Model, Model]:
    """The two models whose series are drawn and whose failures are told: the nominal one, and what became of it.

    That is the corrected model where there is one, else the `recommended` one where that is neither the nominal one nor
    a baseline, else the last that is no baseline.
    """
    named = [model for model in models if model.kind != BASELINE]
    by_name = {model.name: model for model in named[1:]}
    return named[0], by_name.get(CORRECTED) or by_name.get(recommended) or named[-1]


def where_ends_fail(
    table: SeriesTable, first: Model, after: Model, parts: Parts, fitted: Collection[str] = ()
) -> Fails:
    """Failures of the two models of a series, as `comparison.json` has them; see `comparison` for `fitted`.

    Parameters
    ----------
    table : their series
    first, after : the nominal model, and what became of it
    parts : of the logs
    fitted : see `comparison`
    """
    data = [parts.data(part) for part in PARTS]
    # Calibration mends an error with whatever parameter is near; only added effects are told as what removes it.
    last = after if after is not first else None
    return where_they_fail(table, first, last, data, parts.judge, link=after.name not in (CALIBRATED, *fitted))


def comparison(
    judged: Sequence[Judged],
    inputs: Inputs,
    table: SeriesTable | None = None,
    fails: Fails | None = None,
    *,
    timed: bool = False,
    notes: Sequence[str] = (),
    fitted: Collection[str] = (),
    band: PredictionBand | None = None,
) -> Comparison:
    """Every model on the same rows, as `comparison.json` says it.

    Parameters
    ----------
    judged : the nominal model first
    table : the series of the two models of `ends`; made here where it is None
    fails : where these two fail, see `where_ends_fail`; found here where it is None
    timed : True to tell wall times; equal inputs do not give equal files then
    notes : sentences on how the models came to be
    fitted : names of models that were fitted to rows that are judged, beside the calibrated one; they are marked, and
        none but the nominal one is recommended, save a run on the test part, see `docs/decisions.md`
    band : of the second model of `ends`; see `band_of`, which is asked where it is None
    """
    parts = inputs.parts
    if parts.judge in _FITTED_TO:
        fitted = {*fitted, CALIBRATED}
    # Where all rows judge, no part says what is known.
    inside = None if parts.judge in WHOLE else in_box(inputs.vehicle, parts.known, parts.judged.motions)
    held_out = {found.name for found in judged[1:] if parts.judge == "test" and found.model.kind != "physics"}
    counts = [found for found in judged[1:] if found.name in held_out or found.name not in fitted]
    sure = [found.name for found in counts if found.sure]
    recommended = best([(found.model, found.errors, found.audit) for found in (judged[0], *counts)], sure)
    if inputs.broken:
        text = f"Of a broken log that was taken as it is, no advice: {recommended.sentence}"
        recommended = recommended.but(sentence=text)
    first, after = ends([found.model for found in judged], recommended.model)
    if table is None:
        table = series(first, after, parts, inputs.channels)
    if band is None:
        band = band_of(after, parts, fitted)
    failures, structure = fails or where_ends_fail(table, first, after, parts, fitted)
    apart = differences([(found.model, found.errors) for found in judged], (NOMINAL, CALIBRATED, CORRECTED))
    models = []
    for found in judged:
        own = found.model.band
        held = None if own is None else held_predictions(found.model, own, parts.judged)
        drawn = band if found.model is after else None
        models.append(row(found, inside, timed=timed).but(fitted_here=found.name in fitted, band=drawn, held=held))
    told = [
        *_far_out(judged, parts),
        *_at_rest(parts.judged.motions, inputs.vehicle),
        *_with_noise(recommended, judged),
    ]
    return Comparison(
        split=parts.judge,
        logs=tuple(inputs.paths),
        warnings=tuple(inputs.warnings),
        best=recommended,
        models=tuple(models),
        differences=tuple(apart),
        failures=failures,
        structure=structure,
        notes=(*notes, *told),
        noise=by_axis(np.sqrt(judged[0].errors.noise)),
    )


def row(found: Judged, inside: np.ndarray | None = None, *, timed: bool = False) -> ComparedModel:
    """A row of `comparison.json`: a model's errors, and what the laws say of it.

    Parameters
    ----------
    inside : which of the judged rows lie in the domain of the training part
    timed : True to tell wall times; null stands for those that nobody took
    """
    model, errors = found.model, found.errors
    error = np.concatenate(errors.acceleration)
    known = model.seconds_to_fit > 0.0 or model.parameters == 0
    laws = () if found.audit is None else found.audit.to_dict()["laws"]
    return ComparedModel(
        name=model.name,
        kind=model.kind,
        acceleration=errors.acceleration_score.record,
        rollout={name: score.record for name, score in errors.rollout_scores.items()},
        units={"acceleration": ACCELERATION_UNITS, "rollout": ROLLOUT_UNITS},
        domain=None if inside is None else Domain(inside=_side(error[inside]), outside=_side(error[~inside])),
        interval=found.interval,
        audit="not run" if found.audit is None else found.audit.verdict,
        laws=tuple(RulingRecord.model_validate(law) for law in laws),
        parameters=model.parameters,
        seconds_to_fit=model.seconds_to_fit if timed and known else None,
        seconds_to_evaluate=errors.seconds if timed else None,
    )


def band_of(model: Model, parts: Parts, fitted: Collection[str] = ()) -> PredictionBand | None:
    """The band of the run that a model comes from, else one that the judged rows give, if no fit saw them.

    Parameters
    ----------
    model : that predicts
    parts : of the logs
    fitted : see `comparison`
    """
    seen = model.name in fitted or (model.name == CALIBRATED and parts.judge in _FITTED_TO)
    return model.band or (None if seen else prediction_band([(model, parts.judged)]))


def _side(error: np.ndarray) -> Side:
    return Side(rows=len(error), rmse=by_axis(np.sqrt((error**2).mean(axis=0))) if len(error) else None)


def _far_out(judged: Sequence[Judged], parts: Parts) -> list[str]:
    """Sentences on models that are judged far from what they were trained on."""
    told = []
    for found in judged:
        distance = np.concatenate([found.model.beyond(motion) for motion in parts.judged.motions])
        far = distance >= found.model.far
        if far.mean() > _FAR_OUT:
            why = "its errors there say little of it elsewhere"
            if found.model.fades:
                why = "that is beyond all that its correction knows"
            told.append(
                f"{found.name} is judged far from what it was trained on at {percent(float(far.mean()))} of the rows "
                f"({np.median(distance[far]):.2g} standard deviations beyond it in the median): {why}"
            )
    return told


def _at_rest(motions: Sequence[Motion], vehicle: Vehicle) -> list[str]:
    """A sentence on judged rows of a boat that nobody drives: any model is good there, or only the water is judged."""
    driven = np.concatenate([active(motion, vehicle) for motion in motions])
    idle = 1.0 - float(driven.mean())
    if idle <= _AT_REST:
        return []
    return [
        f"{percent(idle)} of the {sum(m.duration for m in motions):.0f} s that are judged pass with nothing commanded: "
        "errors tell of water and wind there more than of the models"
    ]


def _with_noise(best: Best, judged: Sequence[Judged]) -> list[str]:
    """A sentence where the errors of the table, which hold the noise of the sensors, tell another share than best."""
    if best.saved is None or not best.horizon:
        return []
    errors = {found.name: found.errors for found in judged}
    own, nominal = (errors[name].rollout_scores[best.horizon].velocity for name in (best.model, judged[0].name))
    own, nominal = (np.maximum(error, 1e-12) for error in (own, nominal))  # where nothing ever moves
    share = 1.0 - float(np.exp(np.log(own / nominal).mean()))
    if abs(share - best.saved) < MATERIAL:
        return []
    noise = zip(np.sqrt(judged[0].errors.noise), AXES, strict=True)
    told = listing([f"{size:.2g} {ROLLOUT_UNITS[axis]} in {axis}" for size, axis in noise])
    return [
        f"the noise of the sensors, {told}, stands in every error of the table and not in the verdict: with it "
        f"{best.model} errs {percent(share)} less"
    ]


def score_step(
    errors: Errors, added: str | None = None, thruster: str | None = None, before: Errors | None = None
) -> Step:
    """Held-out errors of one step of the story, what was added in it, and which are larger than `before`.

    Parameters
    ----------
    errors : of the model after the step
    added, thruster : the effect, and the thruster where it concerns one
    before : errors before the step
    """
    return Step(
        added=added,
        thruster=thruster,
        acceleration_rmse=errors.acceleration_score.record.rmse,
        rollout_rmse={name: score.record for name, score in errors.rollout_scores.items()},
        units={"acceleration_rmse": ACCELERATION_UNITS, "rollout_rmse": ROLLOUT_UNITS},
        rises=() if before is None else rises(errors, before),
    )
