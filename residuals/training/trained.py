"""A trained network: its epochs, the one kept, the cost of the laws, and the interval of its errors."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from typing import NamedTuple

import numpy as np

from ...measurements.preparation.prepare import DataSet
from ...measurements.preparation.split import Split
from ...physics.motion import Array
from ..models.base import VehicleModel
from ..models.interval import LEVEL, Interval, calibrated, least_known, sizes, widening
from ..models.network_model import NetworkModel
from ..scores import acceleration_errors
from .history import Epoch
from .probes import Probed
from .training_settings import TrainingSettings


@dataclass(frozen=True, slots=True)
class Trained:
    """A trained network and how it came to be.

    Attributes
    ----------
    model : with the weights of the best epoch
    epochs : the history
    more : epochs at the end of it that were trained at states against the laws, too
    best_epoch : the one whose weights were kept: the best that the auditor passed, or the best where it passed none
    lawful : what the auditor says of those weights; None where there was no auditor
    stopped : why training ended
    settings : of the recipe
    seconds : of motion that the kept weights know [s]
    start : name of the network that it went on from
    probed : networks like it that know parts of the log alone
    """

    model: NetworkModel
    epochs: tuple[Epoch, ...]
    more: int
    best_epoch: int
    lawful: bool | None
    stopped: str
    settings: TrainingSettings
    seconds: float
    start: str | None = None
    probed: Probed = field(default_factory=Probed)

    @property
    def violating(self) -> float:
        """Share of the states with and without thrust at which the kept epoch breaks the laws, in training's sample."""
        return self._kept.violating

    @property
    def price(self) -> float:
        """By what share the validation error of the kept epoch, or the last one tried, exceeds the least of all."""
        tried = self.epochs[-1] if self.more else self._kept
        return tried.rmse / min(epoch.rmse for epoch in self.epochs) - 1.0

    @property
    def _kept(self) -> Epoch:
        return next(epoch for epoch in self.epochs if epoch.number == self.best_epoch)

    def to_dict(self) -> dict[str, object]:
        """The training log that a model's file keeps."""
        return {
            "settings": self.settings.to_dict(),
            **({} if self.start is None else {"start": self.start}),
            "best_epoch": self.best_epoch,
            "more": self.more,
            "price": self.price,
            "lawful": self.lawful,
            "violating": self.violating,
            "stopped": self.stopped,
            "epochs": [asdict(epoch) for epoch in self.epochs],
        }


_FEW = 20
"""Rows that are too few to tell a quantile of one in twenty."""


class _Rows(NamedTuple):
    """Rows of a part: sizes, errors of a model and its vehicle alone (n, 3), `least_known` weight and distance (n,)."""

    found: Array
    error: Array
    alone: Array
    weight: Array
    beyond: Array

    def where(self, kept: np.ndarray) -> "_Rows":
        return _Rows(*(values[kept] for values in self))

    @property
    def near(self) -> "_Rows":
        """Those within the training, or all where these are too few."""
        found = self.where(self.beyond == 0.0)
        return self if len(found.found) < _FEW else found


def _joined(parts: Iterable[_Rows]) -> _Rows:
    return _Rows(*(np.concatenate(values) for values in zip(*parts, strict=True)))


def interval_of(model: NetworkModel, split: Split) -> Interval:
    """Margins of a network: proportions from training, how large from validation, both within what it has seen.

    The vehicle alone learnt of neither part, so both say how large its margins are. Validation rows beyond the training
    say how much wider the margin must be there.
    """
    learnt, unseen = _rows(model, split.train), _rows(model, split.validation)
    known, near, both = learnt.near, unseen.near, _joined([learnt, unseen])
    result = Interval(
        level=LEVEL,
        learnt=calibrated(known.found, known.error, near.found, near.error),
        alone=calibrated(learnt.found, learnt.alone, both.found, both.alone),
        wider=(1.0, 1.0, 1.0),
    )
    far = unseen.where(unseen.beyond > 0.0)
    if len(far.found) < _FEW:
        return result
    wider = widening(far.error, result.margin(far.found, far.weight, far.beyond))
    return result.model_copy(update={"wider": tuple(wider.tolist())})


def _rows(model: NetworkModel, data: DataSet) -> _Rows:
    own, base = (acceleration_errors(one, data)[1] for one in (model, VehicleModel(model.vehicle, "alone")))
    return _joined(
        _Rows(
            sizes(model.vehicle, motion, model.acceleration(motion)),
            error,
            alone,
            *least_known(motion, model.weight(motion), model.beyond(motion)),
        )
        for motion, error, alone in zip(data.motions, own, base, strict=True)
    )
