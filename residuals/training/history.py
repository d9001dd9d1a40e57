"""The epochs of a training: how each was judged, which weights are worth keeping, and when no better ones come."""

from dataclasses import dataclass

CANDIDATES = 5
"""Epochs whose weights are kept until the end, when they are put before all laws, the best first."""
_BETTER = 1e-3
"""An epoch counts as better when it lowers the best error by more than this share of it."""


@dataclass(frozen=True, slots=True)
class Epoch:
    """One epoch.

    Attributes
    ----------
    number : 0 is what there is before the first step: of a hybrid the vehicle alone, or what training starts from
    loss : mean over the batches; None for number 0
    rmse : error of the acceleration on the validation part, each axis in units of what is to be learnt in training
    violating : share of the states at which the laws are broken, see `preparation.Judge`
    """

    number: int
    loss: float | None
    rmse: float
    violating: float


def best_epochs(history: list[Epoch], count: int = CANDIDATES, *, lawful: bool = True) -> list[int]:
    """Numbers of the epochs to keep, the best first: by their error, and where laws count by these before it.

    Parameters
    ----------
    lawful : whether those that break the laws stand behind all others. A network that never heard of laws breaks some,
        and the vehicle alone, which is epoch 0, would be the best of its epochs
    """
    ranked = sorted(history, key=lambda epoch: (lawful and epoch.violating > 0.0, epoch.rmse))
    return [epoch.number for epoch in ranked[:count]]


def stale(history: list[Epoch]) -> int:
    """Epochs since the error, of all epochs or of the lawful ones, last fell by a noticeable share."""
    last = 0
    for pool in (history, [epoch for epoch in history if epoch.violating == 0.0]):
        least = float("inf")
        for epoch in pool:
            if epoch.rmse < (1.0 - _BETTER) * least:
                least, last = epoch.rmse, max(last, epoch.number)
    return history[-1].number - last if history else 0
