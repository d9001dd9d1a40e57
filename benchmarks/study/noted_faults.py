"""Sizes of all faults that checks weigh, told or not: what the limits of the one rule are calibrated by."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from undertow.measurements.quality.faults import Fault


@contextmanager
def noted() -> Iterator[list[Fault]]:
    """The faults that are weighed meanwhile, in their order."""
    found: list[Fault] = []
    before = Fault.ruled, Fault.in_words

    def keeping(method: Callable[..., Any]) -> Callable[..., Any]:
        def kept(self: Fault, *arguments: Any) -> Any:
            found.append(self)
            return method(self, *arguments)

        return kept

    Fault.ruled, Fault.in_words = map(keeping, before)
    try:
        yield found
    finally:
        Fault.ruled, Fault.in_words = before


def likely_sizes(faults: Sequence[Fault]) -> dict[str, float]:
    """By kind, the largest size, the lesser of share and weight, of those that are not doubtful."""
    found: dict[str, float] = {}
    for fault in faults:
        if not (fault.size.share.doubtful or fault.size.weight.doubtful):
            size = min(fault.size.share.value, fault.size.weight.value)
            found[fault.kind.name] = max(found.get(fault.kind.name, 0.0), size)
    return found


def sure_sizes(faults: Sequence[Fault]) -> dict[str, float]:
    """By kind, the largest size that is sure: the lesser of share and weight at the lower end of its interval."""
    found: dict[str, float] = {}
    for fault in faults:
        size = min(fault.size.share.low, fault.size.weight.low)
        found[fault.kind.name] = max(found.get(fault.kind.name, -1.0), size, -1.0)
    return found
