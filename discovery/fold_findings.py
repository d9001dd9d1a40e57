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

    def in_words(self, sure: bool) -> str:
        """The finding as a sentence; empty where nothing was searched for.

        Parameters
        ----------
        sure : anything stands in the corrected model, so that there are names to find again
        """
        if self.same_names is None:
            return ""
        told = f"The search was repeated {self.count} times, each time with a different part of the log left out:"
        if self.same_names == self.count and self.named:
            return f"Repeated {self.count} times without a part of the log, the search found the same names."
        some = [f"{words(key)} {_times(n)}" for key, n in self.named.items() if n]
        if not sure:
            return f"{told} it found {listing(some) or 'nothing'}."
        others = [f"{words(key)} {_times(n)}" for key, n in self.named.items() if n < self.count]
        one_by_one = f" ({listing(others)})" if others else ""
        how_often = f"found just these names {_times(self.same_names)}"
        found = how_often if self.same_names else "never found just these names"
        return f"{told} it {found}{one_by_one}. A name that hangs on one part of the log is less sure."


def _times(count: int) -> str:
    """How often.

    >>> [_times(count) for count in (0, 1, 2, 3)]
    ['never', 'once', 'twice', '3 times']
    """
    return {0: "never", 1: "once", 2: "twice"}.get(count, f"{count} times")
