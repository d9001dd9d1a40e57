"""The verb `train`: from logs and a vehicle to a trained network, scored beside the nominal model on held-out data."""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, replace
from math import inf, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..comparison.audit import Audit, audit_along
from ..comparison.comparison import Judged, coverage, judge, row
from ..comparison.facts import ComparedModel
from ..measurements.formats.registry import log_digests
from ..measurements.prepared_logs import INPUTS_CURE, Inputs
from ..physics.effects import COMMAND_OFFSET
from ..physics.errors import RequestError, expect
from ..physics.files import real, write_json
from ..physics.folders import hold_folder, recover
from ..physics.forces import at_beginning
from ..physics.presentation import percent
from ..physics.reading import Plain
from ..physics.stage import Say, Stage
from ..physics.vehicle import Vehicle
from ..reports.model_words import (
    alone_errs_less,
    broken_laws,
    kinds_in_words,
    left_elsewhere,
    none_holds_elsewhere,
    on_judged_rows,
    say_learnable,
    trust_in_words,
    what_it_holds,
    what_laws_took,
    why_declined,
)
from ..reports.terminal.progress import SHOWN, epoch_lines, showing
from ..residuals.learnable_residual import LearnableResidual, measure_learnable_residual
from ..residuals.models.base import Model, VehicleModel
from ..residuals.models.model_files import DISTILLATION, NETWORK_FILES, load_network, own_network, save_network
from ..residuals.models.neural import CHECKPOINT, is_network_folder, require_torch
from ..residuals.scores import evaluate
from ..residuals.training.training_settings import Choice, TrainingSettings
from .run_folder.run_files import check_target_folder

if TYPE_CHECKING:
    from ..discovery.distillation import Distilled
    from ..residuals.models.network_model import NetworkModel
    from ..residuals.training.best_kind import Candidate
    from ..residuals.training.epochs import Trained
    from ..residuals.training.history import Epoch

TRAIN_SCHEMA = "undertow.train/1"
_MANY = 0.05
"""Share of the judged rows beyond what a network has seen that is worth a sentence: few rows decide no error."""
BEST = "best"
"""Stands for the kind that is best in predictions of parts of the log that it does not know."""
_BEST_CHOOSES = "train: --residual best chooses; leave out --option, --pure and --heading, or name a kind"


class NothingToLearnError(RequestError):
    """A vehicle leaves nothing that a network could learn for other rows: a good end, which the verbs tell as one."""


@dataclass(frozen=True, slots=True, repr=False)
class TrainRun:
    """A finished training, scored.

    Attributes
    ----------
    inputs : logs and nominal vehicle
    trained : the network and how it came to be
    left : what the vehicle leaves unexplained, beside the noise of the sensors; None of a pure network
    models : errors of the nominal model and of the network on held-out data, as in `comparison.json`
    distilled : what of the correction is a named effect; None where that was not asked for
    kinds : that were tried, the best first, where the best was asked for
    left_behind : names of those that were left half way: they erred more on the same parts, or would take too long
    elsewhere : error that networks of this kind leave of the vehicle's over parts of the logs that they did not know,
        and the standard error of its logarithm, see `rollout_ratio_of`; (1, inf) where nothing was tried
    """

    inputs: Inputs
    trained: "Trained"
    left: LearnableResidual | None
    models: tuple[ComparedModel, ...]
    distilled: "Distilled | None" = None
    kinds: "tuple[Candidate, ...]" = ()
    left_behind: tuple[str, ...] = ()
    elsewhere: tuple[float, float] = (1.0, inf)

    def __repr__(self) -> str:
        return f"TrainRun({' '.join(self.sentences)})"

    @property
    def model(self) -> "NetworkModel":
        """The trained network."""
        return self.trained.model

    @property
    def sentences(self) -> list[str]:
        """Sentences on what was trained, on what, and what to think of it."""
        found = self.trained
        model, logs = found.model, len(self.inputs.paths)
        where = f"{'in the place of' if model.pure else 'beside'} the physics of '{model.vehicle.name}'"
        told = [
            f"Trained the network {model.network.name} ({model.parameters} weights) {where} "
            f"with {found.seconds:.0f} s of {logs} log{'s' * (logs > 1)}; it took {model.seconds_to_fit:.0f} s.",
            *(
                []
                if model.network.grown
                else [f"Kept epoch {found.best_epoch} of {found.epochs[-1].number}: {found.stopped}."]
            ),
            *([] if self.left is None else [f"Without it, {say_learnable(self.left)}."]),
            *(
                [kinds_in_words(self.kinds, self.left_behind), *alone_errs_less(self.elsewhere[0])]
                if self.kinds
                else left_elsewhere(model.network.name, *self.elsewhere)
            ),
        ]
        if found.best_epoch == 0:
            than = "the vehicle alone" if found.start is None else f"the network {found.start} as it was"
            told.append(f"No epoch was better than {than}, so the network is as it began.")
        elif model.network.gain is not None:
            told.append(trust_in_words(model.network.gain.trust))
        told += on_judged_rows(*self.models)
        told += [*self._beyond(), *what_it_holds(self.models[-1])]
        told += what_laws_took(found)
        return [*told, *broken_laws(self.models[-1])]

    def _beyond(self) -> list[str]:
        """How many of the judged rows are farther than was tried; nothing where few are, or it has no gain."""
        if not self.model.fades:
            return []
        distance = np.concatenate([self.model.beyond(motion) for motion in self.inputs.parts.judged.motions])
        share = float((distance >= self.model.far).mean())
        if share < _MANY:
            return []
        return [
            f"{percent(share)} of the judged rows lie farther from what it has seen than its log could try: train on "
            "logs of such motion, too."
        ]

    def to_dict(self) -> Plain:
        """As `train --json` prints it (schema `undertow.train/1`)."""
        found, split = self.trained, self.inputs.parts.split
        model = found.model
        return {
            "schema": TRAIN_SCHEMA,
            "warnings": list(self.inputs.warnings),
            "network": model.network.name,
            "options": dict(model.network.options),
            "pure": model.pure,
            "heading": model.heading,
            "logs": list(self.inputs.paths),
            "split": self.inputs.parts.judge,
            "left": None if self.left is None else self.left.to_dict(),
            "kinds": {kind.name: kind.ratio for kind in self.kinds},
            "left_behind": list(self.left_behind),
            "elsewhere": self.elsewhere[0] if isfinite(self.elsewhere[1]) else None,
            "models": [model.to_dict() for model in self.models],
            "training": found.to_dict(),
            "distillation": None if self.distilled is None else self.distilled.to_dict(),
            "data": {
                "rows": sum(part.rows for part in (split.train, split.validation, split.test)),
                "train_seconds": found.seconds,
                "notes": list(self.inputs.notes),
            },
        }


def _left(inputs: Inputs, vehicle: Vehicle, *, decline: bool) -> LearnableResidual:
    """What there is to learn beside the vehicle on the rows that do not judge.

    Raises
    ------
    NothingToLearnError
        where nothing is, and that is a reason to decline.
    """
    split = inputs.parts.split
    left = measure_learnable_residual(vehicle, (split.train, split.validation))
    if decline and not left.worth_it:
        raise NothingToLearnError(
            f"Nothing is left for a network to learn beside a vehicle {why_declined(left)}: {say_learnable(left)}. Use "
            "the vehicle as it is; 'undertow train' with --set decline=0 trains all the same"
        )
    return left


@showing
def train(
    inputs: Inputs,
    choice: Choice | None = None,
    *,
    settings: TrainingSettings | None = None,
    out: str | os.PathLike[str] | None = None,
    resume: bool = False,
    force: bool = False,
    progress: Say | None = SHOWN,
    watch: "Callable[[Epoch], None] | None" = None,
) -> TrainRun:
    """Train a network on all but the last part of the logs, and score it beside the nominal model there.

    Parameters
    ----------
    inputs : logs and nominal vehicle, see `read_inputs`; a `command_offset` that its thrusters were given, such as
        `findings.command_offset`, is that of the logs and not the boat's, so the network does not learn it
    choice : the network, by a name of `train --residual` or `BEST`, its options, whether it learns all of the motion
        without the vehicle's physics, and whether it sees the heading; None for an LSTM beside the physics
    settings : of the recipe
    out : folder for the network, and for the checkpoint of a training under way; None writes nothing
    resume : go on with the training that was interrupted in `out`
    force : replace also files in `out` that undertow did not write, or that were changed since
    progress : called with lines about the work, shown where nothing is said; None for silence
    watch : called after each epoch

    Raises
    ------
    RequestError
        when torch is missing, the folder cannot be used, or training fails; see `residuals.training.epochs.train`.
    NothingToLearnError
        where nothing is left to learn beside the vehicle, or nothing that holds in another part of the logs, see
        `TrainingSettings.decline`.
    """
    chosen = choice or Choice("lstm")
    expect("train: inputs", inputs, Inputs, INPUTS_CURE)
    inputs = inputs.parted("train")
    if inputs.parts.judge != "test":
        raise RequestError(
            f"train: expected the last part of the logs to judge (test), got {inputs.parts.judge}, which the network "
            "learns; leave judge out in read_inputs"
        )
    expect("train: choice", chosen, Choice, 'undertow.Choice("lstm") names a network')
    require_torch()
    if chosen.network == BEST and (chosen.options or chosen.pure or chosen.heading):
        raise RequestError(_BEST_CHOOSES)
    recipe, alone = settings or TrainingSettings(), inputs.vehicle
    if recipe.minutes:
        _check_search(chosen)
    from ..residuals.networks.registry import NETWORKS
    from ..residuals.training.best_kind import best_of
    from ..residuals.training.checkpoint import Verdict, interrupted
    from ..residuals.training.epochs import train as train_network
    from ..residuals.training.probes import rollout_ratio_of

    audits: list[Audit] = []
    along = at_beginning(alone)  # a network knows no time
    inputs = replace(inputs, vehicle=inputs.vehicle.with_values({COMMAND_OFFSET.symbol: 0.0}))

    def each(epoch: "Epoch") -> None:
        told(epoch)
        if watch is not None:
            watch(epoch)

    def judged(model: Model) -> Verdict:
        audits.append(audit_along(model, inputs.parts))
        return Verdict(audits[-1].verdict == "pass", audits[-1].against)

    left = None if chosen.pure else _left(inputs, along, decline=recipe.decline and chosen.network != BEST)
    kinds: tuple[Candidate, ...] = ()
    behind: list[str] = []
    best: Candidate | None = None
    searched = chosen.network == BEST or recipe.minutes > 0.0
    before = interrupted(Path(out), recipe) if searched and resume and out is not None else None
    if before is not None:
        chosen, recipe = before
    elif left is not None and searched:
        kinds = _tried(inputs, alone, chosen, recipe, _trying(progress), behind)
        best = best_of(kinds, learnable=left.worth_it)
        if best is None and recipe.decline and chosen.network == BEST:
            raise NothingToLearnError(none_holds_elsewhere(kinds, left, behind))
        best = best or kinds[0]
        chosen, recipe = replace(best.choice, probes=best.probes), replace(recipe, **best.recipe)
    grown = chosen.network in NETWORKS and NETWORKS[chosen.network].grown is not None
    told = epoch_lines(1 if grown else recipe.epochs, progress)
    target = None if out is None else check_folder(out, resume, (inputs.paths, inputs.reading.channel_map), force=force)
    with nullcontext() if target is None else _at_work(target):
        found = train_network(
            inputs.parts.split,
            along,
            chosen,
            settings=recipe,
            folder=target,
            resume=resume,
            progress=each,
            auditor=judged,
        )
    found.model.vehicle = at_beginning(inputs.vehicle)
    nominal = judge(VehicleModel(inputs.vehicle, "nominal", "physics"), inputs.parts)
    kept = audits[-1 if found.lawful else 0]  # where none passed, the best epoch is kept, which was asked first
    errors = evaluate(found.model, inputs.parts.judged)
    network = Judged(found.model, errors, kept, coverage(found.model, errors, inputs.parts.judged))
    elsewhere = (best.ratio, best.error) if best is not None else rollout_ratio_of(found.probed, alone)
    told_of = {"kinds": kinds, "left_behind": tuple(behind), "elsewhere": elsewhere}
    done = TrainRun(inputs, found, left, (row(nominal), row(network)), **told_of)
    if target is not None:
        write_network(done, target, force=force)
    return done


def write_network(run: TrainRun, target: Path, *, force: bool = False) -> None:
    """Write the folder of a trained network, see `save_network`.

    Parameters
    ----------
    run : the finished training
    target : the folder
    force : write over what another made; never over what is read
    """
    inputs = run.inputs
    logs = [Path(path).name for path in inputs.paths]
    warned = {"warnings": list(inputs.warnings)} if inputs.warnings else {}
    digests = [{**item, "path": name} for item, name in zip(log_digests(inputs.paths), logs, strict=True)]
    training = {"logs": logs, "log_sha256": digests, **warned, **run.trained.to_dict()}
    save_network(run.model, target, training, force=force)


def _check_search(choice: Choice) -> None:
    """Refuse to search beside a network that is not judged on parts of the logs.

    Raises
    ------
    RequestError
        for a pure network, or a start.
    """
    if choice.pure or choice.start is not None:
        what = "--pure" if choice.pure else "--start"
        raise RequestError(
            f"train: --minutes searches among hybrids with fresh weights, so it cannot be with {what}; leave one out"
        )


def _tried(
    inputs: Inputs,
    vehicle: Vehicle,
    choice: Choice,
    recipe: TrainingSettings,
    told: Callable[[str], None] | None,
    behind: list[str],
) -> "tuple[Candidate, ...]":
    """The kinds of network that were tried beside a vehicle, the best first; `behind` gets those left half way.

    Raises
    ------
    NothingToLearnError
        where none could be, and nothing is left to learn.
    """
    from ..residuals.training.best_kind import KINDS, candidates

    kinds, along = KINDS if choice.network == BEST else (choice,), at_beginning(vehicle)
    try:
        return tuple(candidates(inputs.parts.split, along, recipe, kinds, told, vehicle, behind))
    except RequestError:  # such as of a log that is too short to be parted
        _left(inputs, along, decline=recipe.decline)
        raise


def _trying(progress: Say | None) -> Callable[[str], None] | None:
    return None if progress is None else lambda kind: progress(Stage(f"trying a network of the kind {kind}"))


@showing
def explained(run: TrainRun, out: str | os.PathLike[str] | None = None, *, progress: Say | None = SHOWN) -> TrainRun:
    """The training with its correction distilled, see `undertow.distil`; `out` also gets `distillation.json`.

    Parameters
    ----------
    run : the finished training
    out : its folder, where there is one
    progress : who is told
    """
    from .check_and_explain import distil

    found = distil(run.trained.model, run.inputs, progress=progress)
    if out is not None:
        write_json(Path(out) / DISTILLATION, found.to_dict())
    return replace(run, distilled=found)


def choice_of(
    start: str | os.PathLike[str] | None,
    network: str | None = None,
    options: Mapping[str, int | float] | None = None,
    *,
    pure: bool = False,
    heading: bool = False,
) -> Choice:
    """Choose what to train: the network of these words, an LSTM where none is named, or one that goes on from another.

    Parameters
    ----------
    start : folder of a trained network that is trained on
    network : kind of a new one
    options : sizes of that kind, by name
    pure : in the place of the physics
    heading : with the heading among the inputs

    Raises
    ------
    RequestError
        when a start is given with a kind of its own, or is no network that can go on learning.
    """
    if start is None:
        if network == BEST and (options or pure or heading):
            raise RequestError(_BEST_CHOOSES)
        return Choice(network or "lstm", options, pure, heading)
    if network or options or pure or heading:
        raise RequestError(
            f"train: {start} says which network it is; leave out --residual, --option, --pure and --heading, or --start"
        )
    require_torch()
    from ..residuals.training.preparation import going_on_from

    return going_on_from(load_network(start))


@contextmanager
def _at_work(target: Path) -> Iterator[None]:
    """Keep the folder to this training, which writes its checkpoints there; one that was made for none goes again."""
    place = real(target)
    place.mkdir(exist_ok=True)
    try:
        with hold_folder(place, "trains in"):
            yield
    except BaseException:
        with suppress(OSError):
            place.rmdir()  # only where it is empty
        raise


def check_folder(out: str | os.PathLike[str], resume: bool, reads: Iterable[Any] = (), *, force: bool = False) -> Path:
    """The folder of a network, if it can be written and nothing of the user's be lost.

    Parameters
    ----------
    reads : logs, vehicle, map: what the network is trained on
    force : replace also what undertow did not write

    Raises
    ------
    RequestError
        see `run_files.check_target_folder`; or when an interrupted training would be lost, there is none to resume, or
        another is at work there.
    """
    target = Path(out)
    if target.is_dir():
        recover(target)
        with hold_folder(real(target), "trains in"):
            pass
    interrupted = (target / CHECKPOINT).exists()
    if interrupted and not resume:
        raise RequestError(
            f"{target} holds an interrupted training; go on with it (--resume), or remove {CHECKPOINT} to train anew"
        )
    if resume and not interrupted and is_network_folder(target):
        raise RequestError(f"nothing to resume: the training in {target} is done; leave --resume out to train anew")
    if resume and not interrupted:
        what = "holds none" if target.is_dir() else "does not exist"
        raise RequestError(
            f"nothing to resume: expected a folder with the {CHECKPOINT} of an interrupted training, but {target} "
            f"{what}; give the folder of that training, or leave --resume out to train anew"
        )
    check_target_folder("--out", target, NETWORK_FILES, own_network, reads, force=force)
    return target
