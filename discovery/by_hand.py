"""Effects added and removed while somebody watches: a fit begins where an earlier one ended; none is made twice."""

from collections.abc import Sequence
from dataclasses import dataclass

from ..measurements.preparation.held_out import Fold, folds_of
from ..measurements.statistics.single_threaded import single_threaded
from ..physics.vehicle import Vehicle
from .basis import Basis
from .findings import Findings
from .in_order import Ordered, fit_named, own_numbers
from .lawful.passivity import Passivity
from .search.bootstrap import Interval


@dataclass(frozen=True, slots=True, eq=False)
class ByHand:
    """A model with effects that somebody chose.

    Attributes
    ----------
    names : of the effects, in the order in which they were added
    vehicle : the model under the laws
    apart : the folds of the log, each with the model that was fitted without it
    ci95 : 95 % intervals of the fitted numbers, by symbol
    passivity : how the law stands in the model; None for a model to which nothing was added
    """

    names: tuple[str, ...]
    vehicle: Vehicle
    apart: tuple[tuple[Fold, Vehicle], ...]
    ci95: dict[str, Interval]
    passivity: Passivity | None = None


class Bench:
    """A log and a nominal model, to which effects are added and from which they are taken again.

    Parameters
    ----------
    basis : what judges the log, see `choose`
    own : the numbers that the vehicle file has are fitted beside the effects, as far as the log identifies them
    searched : findings of a search of this log: what its model has is added with its numbers
    """

    def __init__(self, basis: Basis, *, own: bool = False, searched: Findings | None = None) -> None:
        self.basis, self._searched = basis, searched
        self._free = own_numbers(basis) if own else None
        self.folds = folds_of(basis.forces.motions)
        self._ordered: dict[tuple[str, ...], Ordered] = {}
        self._known: dict[tuple[str, ...], ByHand] = {}

    @property
    def frees(self) -> bool:
        """Whether any of the model's own numbers are fitted."""
        return self._free is not None and bool(self._free.symbols)

    @single_threaded
    def with_effects(self, names: Sequence[str]) -> ByHand:
        """The model with these effects and no other, fitted together under the laws.

        Raises
        ------
        RequestError
            for an effect that is unknown, given twice, or cannot be judged on this log; when a solver fails.
        """
        asked = tuple(names)
        if asked not in self._known:
            same = not asked and self._free is None
            self._known[asked] = ByHand((), self.basis.nominal, (), {}) if same else self._fitted(asked)
        return self._known[asked]

    def _fitted(self, names: tuple[str, ...]) -> ByHand:
        fitted = fit_named(self.basis, names, self._free, self._begun(names), self._searched)
        self._ordered[names] = fitted.ordered
        unseen = fitted.unseen(last=True)
        apart = tuple(zip(unseen.folds, unseen.steps[0], strict=True))
        return ByHand(names, fitted.lawful.vehicle, apart, fitted.intervals, fitted.lawful.passivity)

    def _begun(self, names: tuple[str, ...]) -> Ordered | None:
        """The longest beginning of the names that was fitted before."""
        longest = next((n for n in range(len(names) - 1, 0, -1) if names[:n] in self._ordered), 0)
        return self._ordered[names[:longest]] if longest else None
