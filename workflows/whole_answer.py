"""The whole answer of a discovery: the corrected model, and a network for what has no name where one can be learnt.

The run keeps the network in its folder `network`, with the corrected vehicle; it is compared and checked like any
other, and exported where its kind can be.
"""

import os
from dataclasses import replace
from pathlib import Path

from ..comparison.comparison import judge, row
from ..comparison.facts import CORRECTED
from ..discovery.balance.shooting import TRIFLE
from ..discovery.changed_boat import part_searched
from ..discovery.findings import Findings
from ..physics.effects import COMMAND_OFFSET
from ..physics.files import remove
from ..physics.forces import at_beginning
from ..physics.presentation import percent
from ..physics.stage import Say
from ..physics.vehicle import load_vehicle
from ..reports.terminal.progress import SHOWN, showing
from ..residuals.models.base import Model, VehicleModel
from ..residuals.models.model_files import load_network, own_network
from ..residuals.models.neural import is_network_folder, require_torch
from ..residuals.scores import evaluate
from ..residuals.training.training_settings import TrainingSettings
from .inputs import read_inputs
from .run_folder.write import Run
from .train import BEST, NothingToLearnError, TrainRun, choice_of, train

NETWORK = "network"
"""Folder of the network in that of its run."""
_TRIFLE_IS_LEFT = (
    "Names leave {left} of the nominal model's error of position on rows that they did not see, less than {trifle}: no "
    "network stands beside them, for what is left of one log is not left of another; 'undertow train' with the run as "
    "its --vehicle learns it all the same."
)


@showing
def with_network(
    run: Run,
    kind: str,
    *,
    settings: TrainingSettings | None = None,
    progress: Say | None = SHOWN,
) -> tuple[Run, TrainRun | None]:
    """A run whose comparison has a network beside the corrected model, too, and what came of its training.

    The network learns what the corrected model leaves on the first part of the logs, as `train` does. Its row is that
    of the rows which judge the run; where that is not the last part, it was trained on most, and is marked so. What
    names and network take of the error is told of the last part of the logs, which it never saw.

    Parameters
    ----------
    kind : of network, or `train.BEST`
    settings : of the recipe
    progress : called with lines about the work, shown where nothing is said; None for silence

    Returns
    -------
    (run, training)
        no training, and a note in the run that says why, where the corrected model leaves nothing to learn, or
        nothing that holds on other parts, or, for `train.BEST`, a trifle

    Raises
    ------
    RequestError
        as `train` does, but where it raises `NothingToLearnError`.
    """
    found = run.discovery
    if kind == BEST and (left := names_leave(run.findings)) < TRIFLE:
        return _noting(run, _TRIFLE_IS_LEFT.format(left=percent(left), trifle=percent(TRIFLE))), None
    inputs = read_inputs(list(run.inputs.paths), found.corrected, run.inputs.reading, progress=None)
    inputs = part_searched(inputs, run.findings.change)
    if found.hidden is not None:
        inputs = inputs.mapped(found.hidden.corrected)
    along = inputs.vehicle.with_values({COMMAND_OFFSET.symbol: run.findings.command_offset})
    try:
        done = train(replace(inputs, vehicle=along), choice_of(None, kind), settings=settings, progress=progress)
    except NothingToLearnError as end:
        return _noting(run, str(end)), None
    done.model.name = _name(done.model.network.name)
    judged = row(judge(done.model, run.inputs.parts)).but(fitted_here=run.inputs.parts.judge != "test")
    models = (*run.comparison.models, judged)
    told = _noting(run, _taken(done, VehicleModel(at_beginning(found.nominal), "nominal")))
    return replace(told, comparison=told.comparison.but(models=models)), done


def names_leave(findings: Findings) -> float:
    """Share that names leave of the nominal model's error of position, in rollouts over rows that they did not see.

    All of it where no rollout fits into the log.
    """
    first, last = findings.steps[0].rollout_rmse, findings.steps[-1].rollout_rmse
    horizon = next((h for h in ("10", "2") if h in first and h in last), None)
    if horizon is None:
        return 1.0
    return last[horizon].position / max(first[horizon].position, 1e-12)


def check_kind(kind: str) -> None:
    """Refuse a kind of network that there is not, before the work begins.

    Raises
    ------
    RequestError
        for an unknown kind, naming the nearest, or where torch is missing.
    """
    require_torch()
    from ..residuals.networks.registry import network_named

    if kind != BEST:
        network_named(kind)


def network_of(folder: str | os.PathLike[str]) -> Model | None:
    """The network beside the corrected model of a run folder; None where there is none, or one beside another model."""
    place = Path(folder) / NETWORK
    if not is_network_folder(place):
        return None
    model = load_network(place)
    model.name = _name(model.network.name)
    return model if model.vehicle == at_beginning(load_vehicle(Path(folder) / "model.yaml")) else None


def remove_network(folder: str | os.PathLike[str]) -> None:
    """Remove the network of an earlier run from a run folder that has none now; what others put beside it stays."""
    place = Path(folder) / NETWORK
    if not is_network_folder(place):
        return
    for name in own_network(place):
        remove(place / name)
    if not any(place.iterdir()):
        remove(place)


def _name(kind: str) -> str:
    return f"{CORRECTED} + {kind}"


def _noting(run: Run, sentence: str) -> Run:
    return replace(run, comparison=run.comparison.but(notes=(*run.comparison.notes, sentence)))


def _taken(done: TrainRun, nominal: Model) -> str:
    """What names and the network take of the error of position, on rows that the network has not seen."""
    data = done.inputs.parts.judged
    models = (nominal, VehicleModel(done.model.vehicle, CORRECTED), done.model)
    every = [evaluate(model, data).rollout_scores for model in models]
    horizon = next((h for h in ("10", "2") if all(h in scores for scores in every)), None)
    kind = done.model.network.name
    if horizon is None:
        return f"A network ({kind}) stands beside the corrected model; no rollout fits into the rows that judge it."
    first, named, rest = (scores[horizon].position for scores in every)
    unit = max(first, 1e-12)
    return (
        f"Of the nominal model's error of position over {horizon} s on the last {data.seconds:.0f} s, names "
        f"{_change(1.0 - named / unit)}; a network ({kind}) of what has no name {_change((named - rest) / unit, 's')}."
    )


def _change(share: float, ending: str = "") -> str:
    return f"take{ending} {percent(share)}" if share >= 0.0 else f"add{ending} {percent(-share)}"
