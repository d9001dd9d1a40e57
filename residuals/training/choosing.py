"""Which weights are kept: the best that keep all laws, else those that learnt to keep them at states against the laws.

An audit searches where training has only drawn. The states that it meets against the laws are asked in the loss from
then on, for a few epochs more, and the audit searches anew, until it finds nothing, or a few times at most. Chang,
Roohi and Gao (2019), "Neural Lyapunov control", train on counterexamples in this way.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import final

import numpy as np
from torch import Tensor

from ...measurements.preparation.dataset import DataSet
from ...physics.errors import RequestError
from ...physics.motion import Array
from ..models.base import Model, VehicleModel
from ..models.network_model import NetworkModel
from ..scores import rollout_errors
from .checkpoint import cloned
from .history import Epoch, best_epochs

_ROUNDS = 5
"""Times that the states of an audit are learnt at most."""
_ALIKE = 128
"""States as which those of each audit count: the last one meets few, and these are what is left to learn."""

Weights = Mapping[str, Tensor]
Again = Callable[[Array], tuple[int, Weights]]
"""Trains on for some epochs at states u, v, r, heading, commands (n, 4 + thrusters); number and weights of the last."""


@dataclass(frozen=True, slots=True, eq=False)
class Verdict:
    """What an auditor says of a model.

    Attributes
    ----------
    lawful : whether it keeps all laws
    against : states u, v, r, heading and commands (n, 4 + thrusters) that were met against them; none where a law is
        broken of which no state tells
    """

    lawful: bool
    against: Array


Auditor = Callable[[NetworkModel], Verdict]


@dataclass(frozen=True, slots=True)
class Chosen:
    """The weights that are kept.

    Attributes
    ----------
    epoch : of which they are
    lawful : what the auditor says of them; None where there is none
    """

    epoch: int
    lawful: bool | None


@final
class Chooser:
    """Loads weights into a model, and puts it before the laws.

    Parameters
    ----------
    model : that takes the weights
    held_out : validation part, whose rollouts rank the epochs
    auditor : None for one who asks nothing
    lawful : whether epochs that break the laws stand behind the others, see `history.best_epochs`
    """

    def __init__(self, model: NetworkModel, held_out: DataSet, auditor: Auditor | None, lawful: bool) -> None:
        self.model, self.held_out, self.auditor, self.lawful = model, held_out, auditor, lawful
        self._against: list[Array] = []
        self._silent = True

    def best(self, ranked: list[int], kept: Weights) -> Chosen:
        """Load the best weights that the auditor passes, or the best.

        Parameters
        ----------
        ranked : numbers of the best epochs, the best first
        kept : their weights by `number/name`
        """
        asked = ranked if self.lawful else ranked[:1]  # what never heard of laws is not chosen by them
        for number in asked if self.auditor is not None else []:
            self.model.network.load_state_dict(_of(kept, number))
            if self._passes():
                return Chosen(number, True)
        self.model.network.load_state_dict(_of(kept, ranked[0]))
        return Chosen(ranked[0], None if self.auditor is None else False)

    def mended(self, found: Chosen, again: Again) -> Chosen:
        """Where the auditor passed none: train on at the states against the laws until it does, or leave all as it is.

        The weights at the end of a round are put before it, for those of its first epochs have learnt the least.
        """
        if found.lawful is not False:
            return found
        before = cloned(self.model.network.state_dict())
        told = bool(self._against)
        for _ in range(_ROUNDS):
            if not told:
                break
            try:
                number, weights = again(np.concatenate(self._against))
            except RequestError:  # a loss that is not finite: what was found before is as good as it was
                break
            self.model.network.load_state_dict(weights)
            if self._passes():
                return Chosen(number, True)
            told = not self._silent
        self.model.network.load_state_dict(before)
        return found

    def _passes(self) -> bool:
        assert self.auditor is not None
        said = self.auditor(self.model)
        self._silent = not said.against.size
        if not self._silent:
            self._against.append(np.resize(said.against, (_ALIKE, said.against.shape[1])))
        return said.lawful

    def ranked(self, history: list[Epoch], kept: Weights) -> list[int]:
        """The best epochs, those of the least product of both errors first, and those that break the laws last.

        The errors are those of one step and of rollouts; the weights of the best are then loaded.
        """
        told = {epoch.number: epoch for epoch in history}
        best = best_epochs(history, lawful=self.lawful)
        alone = VehicleModel(self.model.vehicle, "alone")
        unit = np.zeros(0) if self.model.pure else np.maximum(_squares(alone, self.held_out), 1e-300)

        def error(number: int) -> tuple[bool, float]:
            self.model.network.load_state_dict(_of(kept, number))
            unlawful = self.lawful and told[number].violating > 0.0
            ratio = float((_squares(self.model, self.held_out) / unit).mean()) if unit.size else 1.0
            return unlawful, told[number].rmse * (np.sqrt(ratio) if np.isfinite(ratio) else np.inf)

        found = sorted(best, key=error)
        self.model.network.load_state_dict(_of(kept, found[0]))
        return found


def _of(kept: Weights, number: int) -> dict[str, Tensor]:
    head = f"{number}/"
    return {label.removeprefix(head): x for label, x in kept.items() if label.startswith(head)}


def _squares(model: Model, data: DataSet) -> Array:
    """Mean square errors of u, v, r and position (4,) of the longest rollouts that fit; none where none does."""
    found = rollout_errors(model, data, (10.0, 2.0))
    longest = max(found, key=float, default=None)
    return np.zeros(0) if longest is None else np.concatenate(found[longest].squares).mean(axis=0)
