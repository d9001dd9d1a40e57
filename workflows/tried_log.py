"""Another log of the same boat on the bench, to which nothing is fitted: what each model makes of all its rows."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

from ..comparison.overlap import logs_of, overlap
from ..measurements.log_digests import log_digests
from ..measurements.prepared_logs import ALL, Inputs
from ..measurements.statistics.single_threaded import single_threaded
from ..physics.frames import AXES
from ..physics.in_words import listing
from ..physics.vehicle import Vehicle
from ..residuals.models.base import VehicleModel
from ..residuals.prediction_band import held_predictions
from ..residuals.scores import acceleration_score
from .opened_log import OpenedLog
from .workbench_facts import Fit, Opened, Way

UNSEEN = "This log was not used to fit; errors are of all its rows."
"""Which rows judge, where no fit has seen any of them."""


class TriedLog:
    """A log that judges the models of the bench, whole and uncut, as `compare` judges one that a model has not seen.

    Parameters
    ----------
    inputs : the log, read for the nominal vehicle of the bench
    judged : which of its rows judge, and whether a fit saw them, in a sentence; see `rows_that_judge`
    """

    def __init__(self, inputs: Inputs, judged: str) -> None:
        self.inputs, self.judged = inputs, judged
        self._log = OpenedLog(inputs.whole(ALL), cut=True)

    @cached_property
    def opened(self) -> Opened:
        """What is measured, and what the nominal model makes of it."""
        opened = self._log.opened()
        acceleration = self._acceleration(VehicleModel(self.inputs.vehicle, "nominal", "physics"))
        return replace(opened, nominal=replace(opened.nominal, acceleration=acceleration), judged=self.judged)

    @single_threaded
    def fit(self, fitted: Fit, vehicle: Vehicle) -> Fit:
        """A model that was fitted to the log of the bench, with its errors on this one.

        Parameters
        ----------
        fitted : the model as the bench shows it
        vehicle : the same as a vehicle
        """
        model = VehicleModel(vehicle, "shown", "physics")
        error, lost = self._log.error(model)
        band, judged = fitted.band, self._log.inputs.parts.judged
        columns = self._log.rows.columns(model, self.inputs.vehicle, band)
        held = None if band is None else held_predictions(model, band, judged)
        acceleration = self._acceleration(model)
        return replace(fitted, error=error, lost=lost, columns=columns, acceleration=acceleration, held=held)

    def _acceleration(self, model: VehicleModel) -> dict[str, float]:
        """Root mean square errors from row to row, by axis [m/s^2, rad/s^2]."""
        rmse = acceleration_score(model, self._log.inputs.parts.judged).rmse
        return dict(zip(AXES, rmse.tolist(), strict=True))

    def way(self, vehicle: Vehicle, time: float) -> Way:
        """See `OpenedLog.way`."""
        return self._log.way(vehicle, time)


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
        return (
            f"The vehicle file may have been fitted to {listing(list(found.alike))}: its errors may be too small there."
        )
    return UNSEEN
