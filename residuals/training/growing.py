"""How networks are found that are grown at once from a table of rows, and not trained by steps."""

from collections.abc import Callable
from typing import Any

from ...physics.motion import Array
from ..networks.base import Network
from ..networks.gaussian_process import GaussianProcess
from ..networks.trees import Trees
from .growing_processes import fit_processes
from .growing_trees import grow_trees

Table = tuple[Array, Array]
"""Standardised inputs (rows, inputs), and target (rows, 3) in units of the output."""

GROWING: dict[type[Network], Callable[[Any, Table, int, int], float]] = {
    GaussianProcess: fit_processes,
    Trees: grow_trees,
}
"""How each network with `Network.grown` is grown from a table, a seed and epochs; gives the mean square of what is
left."""


def grow(network: Network, table: Table, seed: int, epochs: int) -> float:
    """Grow a network from all rows of a table, see `GROWING`.

    Parameters
    ----------
    table : standardised inputs (rows, inputs), and target (rows, 3) in units of the output
    seed : of what is drawn
    epochs : that a network which is not grown would have: for fewer, less is drawn

    Returns
    -------
    float
        mean square of what is left of the target

    Raises
    ------
    RequestError
        when scikit-learn is missing, or is a version whose learner cannot be kept as arrays.
    """
    return GROWING[type(network)](network, table, seed, epochs)
