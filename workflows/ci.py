"""The verb `ci`: whether a vehicle is still the boat of its logs, by limits that a file says."""

import os

from ..comparison.comparison import Judged, judge, row
from ..comparison.error_limits import Limits, load_limits, with_margin
from ..comparison.facts import NOMINAL, ComparedModel
from ..comparison.held_limits import HeldLimits, held
from ..comparison.models_by_name import check_commands, load_model
from ..measurements.prepared_logs import INPUTS_CURE, Inputs, PathLike
from ..measurements.statistics.single_threaded import single_threaded
from ..physics.errors import RequestError, expect
from ..residuals.models.base import Model, VehicleModel
from ..residuals.scores import HORIZONS, evaluate

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
