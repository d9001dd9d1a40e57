"""How much of what a hybrid has learnt holds: the share of its correction whose rollouts of held-out rows err least."""

from collections.abc import Mapping
from copy import deepcopy

import numpy as np

from ...measurements.preparation.dataset import DataSet
from ...physics.frames import Array
from ..models.base import Model, VehicleModel
from ..models.network_model import NetworkModel
from ..scores import rollout_errors

_SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Shares that are tried: a quarter more or less changes the error of a rollout by less than its own chance."""
_GAIN = 0.9
"""Most of the error that may be left: 2 % less on the end of its own run was 10 % more on another hull (Gazebo B)."""
_NOTHING = 1e-6
"""Least square of a rollout's error, in the mean square of the vehicle alone: no network is asked for less."""
_HORIZONS = (10.0, 2.0)
"""Of the rollouts, the longest that fits into the motions [s]."""


def share_that_holds(model: NetworkModel, data: DataSet) -> float:
    """The least share of a correction, from 0 to 1, by which rollouts of held-out motions err no more than by the best.

    No more is less than one standard error of the difference more (the rule of Breiman et al. 1984): half a minute
    tells little, and what it does not tell is not claimed. See `least_share`. 1 of a pure network, and where no rollout
    fits.
    """
    alone = None if model.pure else _squares(VehicleModel(model.vehicle, "alone"), data)
    if alone is None:
        return 1.0
    squares, horizon = alone
    unit = np.maximum(squares.mean(axis=0), 1e-300)
    errors = {0.0: (squares / unit).mean(axis=1)}
    for share in _SHARES[1:]:
        found = _squares(_with(model, share), data)
        errors[share] = np.full(len(squares), np.inf) if found is None else (found[0] / unit).mean(axis=1)
    return least_share(errors, max(1.0, data.seconds / horizon))


def least_share(errors: Mapping[float, Array], independent: float) -> float:
    """The least share whose rollouts err no more than those of the best, by the logarithms of their errors.

    Of squares the rollout that errs most would decide how much is gained and how sure that is; of logarithms alone,
    many that hardly err would outweigh it. So a share must also gain a tenth in the root mean square.

    Parameters
    ----------
    errors : mean square of each rollout (starts,), in that of the vehicle alone, by share
    independent : how many of the rollouts tell of themselves
    """
    enough = {share: squares for share, squares in errors.items() if squares.mean() <= _GAIN**2 * errors[0.0].mean()}
    told = {share: np.log(np.maximum(squares, _NOTHING)) for share, squares in ({0.0: errors[0.0]} | enough).items()}
    best = told[min(told, key=lambda share: told[share].mean())]
    for share in sorted(told):
        worse = told[share] - best
        if np.isfinite(worse).all() and worse.mean() <= worse.std() / np.sqrt(independent):
            return share
    return 0.0


def rollout_ratio(model: NetworkModel, data: DataSet) -> float:
    """Error of rollouts in that of the vehicle alone; 1 of a pure network, and where none fits."""
    alone = None if model.pure else _squares(VehicleModel(model.vehicle, "alone"), data)
    mine = None if alone is None else _squares(model, data)
    if alone is None or mine is None:
        return 1.0
    ratio = float(np.sqrt((mine[0].mean(axis=0) / np.maximum(alone[0].mean(axis=0), 1e-300)).mean()))
    return ratio if np.isfinite(ratio) else float("inf")


def _with(model: NetworkModel, share: float) -> NetworkModel:
    """The same model with a share of its correction."""
    network = deepcopy(model.network)
    network.shrink(share)
    return NetworkModel(model.vehicle, network, model.time_step)


def _squares(model: Model, data: DataSet) -> tuple[Array, float] | None:
    """Mean square errors of u, v, r and position by rollout (starts, 4), and the horizon [s]; None where none fits."""
    found = rollout_errors(model, data, _HORIZONS)
    longest = next((h for h in _HORIZONS if f"{h:g}" in found), None)
    return None if longest is None else (np.concatenate(found[f"{longest:g}"].squares), longest)
