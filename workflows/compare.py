"""The verbs `compare` (models on the same rows, and a run with more models) and `ci` (a vehicle held to limits)."""

import os
from collections.abc import Sequence
from pathlib import Path

from ..comparison.comparison import Judged, comparison, ends, judge, reference_models, row
from ..comparison.error_limits import HeldLimits, Limits, held, load_limits, with_margin
from ..comparison.facts import BASELINE, CORRECTED, NOMINAL, ComparedModel, Comparison
from ..comparison.models_by_name import check_commands, fitted_notes, fitted_numbers, fitted_to, load_model
from ..discovery.findings import WATER
from ..discovery.sensor_error_search import HiddenErrors
from ..exports.mcap_series import compared, require_mcap, write_series
from ..measurements.preparation.split import Fold
from ..measurements.prepared_logs import ALL, INPUTS_CURE, Inputs, PathLike
from ..measurements.statistics.processors import single_threaded
from ..physics.errors import RequestError, expect
from ..physics.stage import Say, Stage
from ..physics.vehicle import Vehicle, load_vehicle
from ..reports.terminal.progress import SHOWN, paced, showing
from ..residuals.models.base import Model, VehicleModel
from ..residuals.scores import HORIZONS, evaluate
from ..residuals.series import series
from .inputs import still_unproven
from .run_folder.moved_files import UNMOVED, Moved
from .run_folder.read import read_findings, read_run_inputs
from .run_folder.run_files import check_page
from .run_folder.write import write_comparison
from .whole_answer import network_of


@showing
def compare(
    inputs: Inputs,
    models: Sequence[PathLike] = (),
    series_file: PathLike | None = None,
    *,
    page: PathLike | None = None,
    force: bool = False,
    progress: Say | None = SHOWN,
) -> Comparison:
    """Models against measurements: nominal, calibrated, two baselines and any others, on the same rows.

    Parameters
    ----------
    inputs : logs and nominal vehicle, with the part to judge on; where none was asked for, logs to which one of the
        `models` was surely not fitted are judged whole
    models : vehicle files, run folders, folders of trained networks, ONNX files, or `package.module:function`
    series_file : MCAP file to write for viewers, with what was measured and what each model but the baselines predicts
    page : folder to write, whole or not at all: `report.html`, and what it is made of, which `report` reads
    force : replace also files in it that undertow did not write, or that were changed since
    progress : called with lines about the work, shown where nothing is said; None for silence

    Returns
    -------
    Comparison
        As `comparison.json` holds it, with wall times.

    Raises
    ------
    RequestError, VehicleError
        when the folder of the page cannot be written or holds a run; when a model cannot be read, takes other commands
        than the nominal vehicle, is given twice, or is a network that was trained at another rate than that of the
        comparison, 10 Hz; when a series is asked for and the package mcap is missing.
    """
    expect("compare: inputs", inputs, Inputs, INPUTS_CURE)
    expect("compare: models", models, (list, tuple), "give a list of paths")
    if series_file is not None:
        require_mcap()
    inputs = inputs.parted("compare", fits=False)
    if page is None:
        return _compared(inputs, (), models, series_file, progress=progress)[0]
    check_page(page, (inputs.paths, inputs.reading.channel_map, models), force=force)
    result, inputs, (first, after) = _compared(inputs, (), models, series_file, progress=progress)
    if progress is not None:
        progress(Stage("writing the page"))
    band = next((model.band for model in result.models if model.band is not None), None)
    table = series(first, after, inputs.parts, inputs.channels, band)
    write_comparison(result, table, inputs, page, force=force)
    return result


@showing
def compare_run(
    run: PathLike, models: Sequence[PathLike] = (), moved: Moved = UNMOVED, *, progress: Say | None = SHOWN
) -> Comparison:
    """The models of a run folder and any others, on the rows that the run was judged on; its logs are read again.

    Parameters
    ----------
    run : the run folder
    models : see `compare`
    moved : where the run's logs and map are now
    progress : called with lines about the work, shown where nothing is said; None for silence

    Returns
    -------
    Comparison
        As `comparison.json` holds it, with wall times.

    Raises
    ------
    RequestError, VehicleError, LogError
        when the folder is no run folder, its logs are gone or others, and as `compare` does.
    """
    folder = Path(run)
    record = read_run_inputs(folder, moved)
    made = record.folds
    inputs = record.inputs(progress)
    sources = list(inputs.starts)
    unseen = [(one.fold(sources), inputs.vehicle.with_values(one.values)) for one in made]
    folds = [fold for fold, _ in unseen]
    size = fitted_numbers(folder)
    corrected = VehicleModel(load_vehicle(folder / "model.yaml"), CORRECTED, "symbolic", size, unseen=unseen)
    inputs = inputs.in_folds(folds) if folds else inputs
    found = record.findings
    hidden = None if found is None else HiddenErrors.of_findings(found.sensors, sources)
    inputs = inputs if hidden is None else inputs.mapped(hidden.corrected)  # where the run found them, and was judged
    network = network_of(folder)
    middle = (corrected,) if network is None else (corrected, network)
    return _compared(inputs, middle, models, folds=folds, progress=progress)[0]


@single_threaded
def _compared(
    inputs: Inputs,
    middle: Sequence[Model],
    paths: Sequence[PathLike],
    series_file: PathLike | None = None,
    folds: Sequence[Fold] = (),
    progress: Say | None = None,
) -> tuple[Comparison, Inputs, tuple[Model, Model]]:
    """All models compared, the logs with the rows that judged, and the two models whose failures are told."""
    given = [os.fspath(path) for path in paths]
    for path in given:
        if given.count(path) > 1:
            raise RequestError(f"model {path} is given twice; give it once")
    loaded = [_model(inputs, path) for path in given]  # before the fits, which take seconds
    nominal = VehicleModel(inputs.vehicle, NOMINAL, "physics")
    sources = fitted_to([("", nominal), *zip(given, loaded, strict=True)], inputs.paths)
    if any(one.path and one.known_disjoint for one in sources):
        inputs = inputs.whole(ALL)  # every row of a log that a model has not seen tells what it is worth
    if progress is not None:
        progress(Stage("calibrating the model of the vehicle file, to compare with"))
    found, notes = reference_models(inputs, middle, folds=folds)
    for path, model in zip(given, loaded, strict=True):
        if model.name in [other.name for other in found]:
            model.name = path
        found.append(model)
    named = [model for model in found if model.kind != BASELINE]
    judged = [judge(model, inputs.parts) for model in paced(found, "models judged", progress, even=False)]
    if series_file is not None:
        told = compared(named, inputs.parts, inputs.channels)
        write_series(series_file, told, inputs.channels, inputs.parts, inputs.starts)
    if progress is not None:
        progress(Stage("finding where the models fail"))
    rows = inputs.parts.judge
    wet = [model.name for path, model in zip(given, loaded, strict=True) if _found_in_water(path)]
    water = "was found with each log in its own water, and here its errors hold the current of the log"
    told = [*inputs.repairs, *notes, *fitted_notes(sources, rows), *(f"{name} {water}" for name in wet)]
    fitted = {one.model.name for one in sources if one.saw_judged(rows)}
    if rows != "test":  # a network of the run was trained on most of them
        fitted |= {model.name for model in middle if model.kind == "hybrid"}
    done = comparison(judged, inputs, timed=True, notes=told, fitted=fitted)
    own = [one for one in judged if isinstance(one.model, VehicleModel) and _driven_alike(one.model, inputs.vehicle)]
    guesses = [one for one in judged if one.model.kind == BASELINE]
    done = done.but(warnings=still_unproven(inputs.warnings, own, guesses))
    best = done.best
    if best.model in fitted:
        no_test = (
            f"{best.model} was fitted to these rows, so that they are no test of it: give a log that it has not seen."
        )
        done = done.but(best=best.but(sentence=f"{no_test} {best.sentence}"))
    return done, inputs, ends(found, best.model)


def _driven_alike(model: VehicleModel, vehicle: Vehicle) -> bool:
    """True for a model whose thrusters stand and push where those of a vehicle file do."""
    places = ([(t.x, t.y, t.angle) for t in one.thrusters] for one in (model.vehicle, vehicle))
    return next(places) == next(places)


def _found_in_water(path: PathLike) -> bool:
    """True for a run, or its model, whose logs had each a current of its own."""
    file = (Path(path) if Path(path).is_dir() else Path(path).parent) / "findings.json"
    try:
        found = read_findings(file.read_bytes(), file)
    except (OSError, ValueError):
        return False  # no run, or one of which whoever reads it complains
    return any(sensor.correction == WATER for sensor in found.sensors)


MARGIN = 0.2
"""Share of today's errors that first limits leave free: the same log gives the same errors, so the room is for changes
of the vehicle that nobody minds. A guess, to be edited."""
_FIRST = 10.0
"""Horizon of first limits [s]: the one of which all reports speak."""


@single_threaded
def ci(inputs: Inputs, limits: Limits | PathLike, model: PathLike | None = None) -> HeldLimits:
    """Judge a vehicle as it is on logs: its errors, beside the limits of a file; nothing is fitted.

    The errors are those that `compare` tells of the nominal model, on the same rows.

    Parameters
    ----------
    inputs : logs and vehicle, with the part to judge on: "all" where nothing of the logs was fitted
    limits : or the path of their file
    model : to judge in the place of the vehicle: whatever `compare --model` takes

    Raises
    ------
    RequestError, VehicleError
        when the limits cannot be read, the logs have no room for a prediction, or the model cannot be loaded or takes
        other commands.
    """
    expect("ci: inputs", inputs, Inputs, INPUTS_CURE)
    expect("ci: limits", limits, (Limits, str, os.PathLike), "give the path of a limits file")
    wanted = limits if isinstance(limits, Limits) else load_limits(limits)
    judged = _model(inputs, model)
    found = _errors(inputs, judged, wanted.horizons, laws=wanted.laws is not None)
    rows = held(found, wanted)
    return HeldLimits(
        verdict="holds" if all(one.holds for one in rows) else "broken",
        model=inputs.vehicle.name if model is None else judged.name,
        logs=inputs.paths,
        warnings=inputs.warnings,
        limits=rows,
        notes=inputs.notes,
    )


@single_threaded
def first_limits(inputs: Inputs, margin: float = MARGIN, model: PathLike | None = None) -> Limits:
    """Limits from the errors of a vehicle as they are today: accelerations and 10 s predictions, with a margin.

    The laws are among them where the vehicle keeps them today.

    Parameters
    ----------
    inputs, model : see `ci`
    margin : share of the errors that is left free

    Raises
    ------
    RequestError
        when no prediction of any length fits into the logs, or an error is not finite.
    """
    expect("first_limits: inputs", inputs, Inputs, INPUTS_CURE)
    if not 0.0 <= margin < float("inf"):
        raise RequestError(f"margin: expected a share of 0 or more, such as {MARGIN:g}, got {margin:g}")
    found = _errors(inputs, _model(inputs, model), HORIZONS, laws=True)
    if not found.rollout:
        raise RequestError(
            f"no stretch of the logs has room for a prediction of {min(HORIZONS):g} s; give a longer log"
        )
    nearest = min(found.rollout, key=lambda name: abs(float(name) - _FIRST))
    return with_margin(found.acceleration, {nearest: found.rollout[nearest]}, margin, lawful=found.audit == "pass")


def _model(inputs: Inputs, path: PathLike | None) -> Model:
    """A model that takes the commands that the logs were prepared for; the nominal one where none is named."""
    if path is None:
        return VehicleModel(inputs.vehicle, NOMINAL, "physics")
    model = load_model(path, inputs.vehicle)
    check_commands(model, inputs)
    return model


def _errors(inputs: Inputs, model: Model, horizons: tuple[float, ...], *, laws: bool) -> ComparedModel:
    """The row of a comparison, with other horizons, and the laws only where somebody asks."""
    parts = inputs.parted("ci", fits=False).parts
    errors = evaluate(model, parts.judged, horizons)
    return row(judge(model, parts, errors) if laws else Judged(model, errors, None))
