"""Regimes found from the data: a shallow tree that parts the log by where the squared error is large."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from .features import Feature, merged
from .rows import Array

DEPTH = 3
_CLIP = 0.98
"""Quantile at which squared errors are cut for the tree, so that it looks for regimes and not for single spikes."""

Range = tuple[float, float]


def regimes(
    squares: Array, rows: NDArray[np.bool_], found: Sequence[Feature], least: int
) -> Iterator[tuple[str, NDArray[np.bool_], int]]:
    """Grow a regression tree of the squared error and read every node of it but the root as a place.

    Parameters
    ----------
    squares : (n,) squared error of one axis, finite
    rows : (n,) the rows that the tree may see
    found : quantities of each row
    least : fewest of those rows in a place

    Yields
    ------
    (words, (n,) rows inside, how many quantities the words name); thresholds are those of the words, rounded
    """
    from sklearn.tree import DecisionTreeRegressor  # here, because it takes half a second

    if rows.sum() < 2 * least or not squares[rows].any():
        return
    grown = DecisionTreeRegressor(max_depth=DEPTH, min_samples_leaf=least, random_state=0)
    seen = squares[rows]
    grown.fit(np.column_stack([one.values for one in found])[rows], np.minimum(seen, np.quantile(seen, _CLIP)))
    for ranges in _nodes(grown.tree_, found):
        inside = np.logical_and.reduce([one.inside(*ranges[one.name]) for one in found if one.name in ranges])
        parts = merged(ranges, found)
        yield ", ".join(one.phrase(*ends) for one, ends in parts), inside, len(parts)


def _nodes(tree: object, found: Sequence[Feature]) -> Iterator[dict[str, Range]]:
    """The ranges by name of quantity that lead to every node below the root."""
    left, right, column, threshold = (
        getattr(tree, name) for name in ("children_left", "children_right", "feature", "threshold")
    )
    waiting: list[tuple[int, dict[str, Range]]] = [(0, {})]
    while waiting:
        node, ranges = waiting.pop()
        if ranges:
            yield ranges
        if left[node] < 0:
            continue
        one = found[int(column[node])]
        cut = one.rounded(float(threshold[node]))
        low, high = ranges.get(one.name, (-np.inf, np.inf))
        if low < cut < high:
            waiting += [
                (int(left[node]), {**ranges, one.name: (low, cut)}),
                (int(right[node]), {**ranges, one.name: (cut, high)}),
            ]
