"""What a trial of models says: how well each steers the same true boat along the same tracks, in the same noise."""

from typing import ClassVar

from ..physics.file_records import Number, Record, Whole
from .figures_of_merit import Merit

PERFECT = "perfect"
"""Name of the model that is the true boat itself: no controller of the kind does much better."""


class Tracking(Record):
    """A model on a track.

    Attributes
    ----------
    model : its name
    track : one of `tracks.TRACKS`
    merit : its figures
    against_first : its RMSE less that of the first model, as a share of that
    """

    model: str
    track: str
    merit: Merit
    against_first: Number


class ControlRecord(Record):
    """All of a trial, as `undertow control --json` prints it.

    Attributes
    ----------
    vehicle : the true boat
    hidden : what it has beside its file, as symbol=value
    controller : that all models had
    speed, turn_rate : the pace of the tracks [m/s, rad/s]
    seed : of gusts, current and sensor noise
    results : track by track, the models in their order, the perfect one last
    """

    SCHEMA: ClassVar[str] = "undertow.control/1"
    vehicle: str
    hidden: tuple[str, ...]
    controller: str
    speed: Number
    turn_rate: Number
    seed: Whole
    results: tuple[Tracking, ...]
