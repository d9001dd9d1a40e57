"""A trained network and how it came to be: its epochs, the one that was kept, and what the laws cost."""

from dataclasses import asdict, dataclass

from ..models.network_model import NetworkModel
from .history import Epoch
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
    start : name of the network that it went on from
    """

    model: NetworkModel
    epochs: tuple[Epoch, ...]
    more: int
    best_epoch: int
    lawful: bool | None
    stopped: str
    settings: TrainingSettings
    start: str | None = None

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
