"""What the folds of a discovery are found to say: how many give the same names, and what the model without each is."""

from collections.abc import Mapping, Sequence

from pydantic import Field

from ..measurements.preparation.held_out import Fold
from ..physics.errors import RequestError
from ..physics.file_records import Number, Record, Whole, absent
from ..physics.in_words import listing, words


class FoldRecord(Record):
    """A fold, and the numbers of the corrected model that was selected and fitted without it.

    Attributes
    ----------
    stretches : number of the log, begin and end [s] of each stretch of the fold
    values : what differs from the nominal model, by symbol, in the units of the vehicle file
    """

    stretches: tuple[tuple[Whole, Number, Number], ...]
    values: Mapping[str, Number] = {}

    def fold(self, sources: Sequence[str]) -> Fold:
        """The fold of logs by their sources.

        Raises
        ------
        RequestError
            when there are fewer logs.
        """
        if any(number >= len(sources) for number, _, _ in self.stretches):
            raise RequestError(f"a fold is of a log beyond the {len(sources)} of the run; run 'undertow discover' anew")
        return Fold(tuple((sources[number], begin, end) for number, begin, end in self.stretches))


class Folds(Record):
    """In how many folds, each searched anew without it, the same names came out.

    Attributes
    ----------
    count : how many folds there were
    same_names : in how many the very effects came out that the corrected model has; None where somebody chose them
    named : in how many each effect came out (`thruster_asymmetry[port]` for one of a thruster)
    models : the model without each fold; none where a part of the log was kept aside
    """

    count: Whole
    same_names: Whole | None = absent()
    named: Mapping[str, Whole] = {}
    models: tuple[FoldRecord, ...] = Field(default=(), exclude_if=lambda value: not value)

    def doubts(self, kept: Sequence[str]) -> dict[str, str]:
        """Why each effect is not certain that comes out of fewer than half of the folds, by key."""
        return {
            key: f"searched anew without each of {self.count} parts of the log, it comes out of {self.named[key]} only"
            for key in kept
            if 2 * self.named[key] < self.count
        }

    def in_words(self, sure: bool) -> str:
        """The finding as a sentence; empty where nothing was searched for.

        Parameters
        ----------
        sure : anything stands in the corrected model, so that there are names to find again
        """
        if self.same_names is None:
            return ""
        told = f"Searched anew without each of its {self.count} parts, the log"
        if self.same_names == self.count:
            return f"{told} gives the same names every time." if self.named else f"{told} names nothing either."
        if not sure:
            some = listing([f"{words(key)} in {n}" for key, n in self.named.items() if n])
            return f"{told} names {some} of {self.count}." if some else f"{told} names nothing either."
        others = [f"{words(key)} in {n}" for key, n in self.named.items() if n < self.count]
        if self.same_names == 0 and others:
            return f"{told} never gives all of these names and no other: {listing(others)} of {self.count}."
        one_by_one = f" ({listing(others)})" if others else ""
        return f"{told} gives the same names in {self.same_names} of {self.count}{one_by_one}."
