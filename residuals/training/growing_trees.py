"""Growing boosted trees on the rows of a training part: scikit-learn finds them, and plain arrays keep them."""

from typing import Any

import numpy as np
import torch

from ...physics.errors import RequestError
from ...physics.motion import Array
from ...physics.registry_members import how_to_install
from ..networks.trees import Nodes, Trees

_RATE, _DEPTH = 0.15, 6
"""Share of each tree that counts, and its depth. With 0.1 and no limit, as scikit-learn has them, and 100 trees the
errors on Gazebo's tuning runs are the same, and an answer takes five times as long."""
_SAME = 1e-3
"""By how much the arrays may say something else than the learner, in units of the output: inputs in single precision
fall on the other side of a threshold now and then."""
_ALIKE = 0.99
"""Share of the rows of which that must hold."""


def grow_trees(network: Trees, table: tuple[Array, Array], seed: int, epochs: int) -> float:
    """Grow the trees of each axis by scikit-learn's HistGradientBoostingRegressor, see `growing.grow`."""
    del epochs
    rows, wanted = table[0].astype(np.float32), table[1]
    learners = [_learner(network.options, seed).fit(rows, column) for column in wanted.T]
    try:
        nodes = _nodes(learners, network.feature.shape)
        network.plant(nodes, np.array([learner._baseline_prediction.item() for learner in learners]))
    except (AttributeError, KeyError, IndexError, ValueError, RuntimeError) as error:
        raise RequestError(
            f"trees: this scikit-learn keeps its trees in another form ({error}); train another network"
        ) from error
    told = np.column_stack([learner.predict(rows) for learner in learners])
    asked = torch.as_tensor(rows).to(network.threshold)
    ours = network.correct(asked, asked, None)[0].double().cpu().numpy()
    if (np.abs(ours - told).max(axis=1) <= _SAME).mean() < _ALIKE:
        raise RequestError(
            "trees: this version of scikit-learn means something else by its trees; train another network"
        )
    return float(((ours - wanted) ** 2).mean())


def _learner(options: dict[str, int | float], seed: int) -> Any:
    try:
        from sklearn.ensemble import HistGradientBoostingRegressor
    except ImportError as error:
        raise RequestError(f"trees need scikit-learn ({error}): {how_to_install('neural')}") from None
    made: Any = HistGradientBoostingRegressor  # its annotations are guessed from its defaults
    return made(
        learning_rate=_RATE,
        max_depth=_DEPTH,
        max_iter=int(options["units"]),
        max_leaf_nodes=int(options["leaves"]),
        early_stopping=False,
        random_state=seed,
    )


def _nodes(learners: list[Any], shape: tuple[int, ...]) -> Nodes:
    """The trees of all learners; those with fewer nodes are filled up with leaves that nothing reaches."""
    here = np.broadcast_to(np.arange(shape[-1]), shape)
    found = Nodes(np.zeros(shape, int), np.zeros(shape), here.copy(), here.copy(), np.zeros(shape))
    for axis, learner in enumerate(learners):
        for k, (tree,) in enumerate(learner._predictors):
            nodes = tree.nodes
            inner, size = nodes["is_leaf"] == 0, nodes.shape[0]
            where = (axis, k, np.flatnonzero(inner))
            found.feature[where] = nodes["feature_idx"][inner]
            found.threshold[where] = nodes["num_threshold"][inner]
            found.left[where], found.right[where] = nodes["left"][inner], nodes["right"][inner]
            found.value[axis, k, :size] = np.where(inner, 0.0, nodes["value"])
    return found
