"""Training a network: windows in, epochs of Adam, and the best weights that keep the laws out."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import replace
from math import cos, isfinite, pi
from pathlib import Path
from time import perf_counter

import torch

from ...measurements.preparation.prepare import DataSet, join_parts
from ...measurements.preparation.split import Split
from ...physics.errors import RequestError
from ...physics.motion import Array
from ...physics.vehicle import Vehicle
from ..models.network_model import NetworkModel, one_thread
from ..models.neural import CHECKPOINT
from ..networks.base import Network
from ..networks.registry import network_named
from ..series import prediction_band
from .checkpoint import Auditor, Checkpoint, CheckpointSelector, cloned, read_checkpoint, write_checkpoint
from .history import Epoch, best_epochs, stale
from .losses import Objective
from .preparation import Prepared, prepare_training, tabulate
from .probes import HeldOutPart, Probed, extend_trust, held_out_parts, train_probes, trust_of
from .tabular_fit import fit_tabular
from .trained import Trained, interval_of
from .training_settings import Choice, TrainingSettings

_FOLLOWED = 0.1
"""Epochs of the first, in which the average follows the weights more closely: a start of zeros is soon forgotten."""
_STEPS = 16
"""Least steps of an epoch: with three, as four minutes in batches of 16 give, no epoch gets far."""
_EPOCHS = 20
"""Epochs of a probe, at most: it is to say how a correction goes on, not to be used. With 10 or 40 the gains were the
same to a few per cent, and so were the errors on another run (ad hoc)."""
_MORE, _GENTLE = 10, 0.1
"""Epochs at states against the laws, after which the average of the weights has left what it was, and the share of the
learning rate by which they move."""

Progress = Callable[[Epoch], None]
"""Told of each epoch."""


def train(
    split: Split,
    vehicle: Vehicle,
    choice: Choice,
    *,
    settings: TrainingSettings | None = None,
    folder: Path | None = None,
    resume: bool = False,
    progress: Progress | None = None,
    auditor: Auditor | None = None,
) -> Trained:
    """Train a network on the training part of a split; the validation part chooses the epoch that is kept.

    A tabular network has none to choose: once its gain, interval and band are known, it is refitted to both parts, and
    what is told of its epoch is that of the fit before.

    The same seed gives the same weights on the same machine, whether training was interrupted and resumed or not.
    Torch's own random state and settings are as before afterwards.

    Parameters
    ----------
    vehicle : the nominal model that is corrected, or whose thrust curves a pure network sees
    choice : the network
    folder : where a checkpoint is written after each epoch; the caller removes it when the model is
        saved. None writes nothing
    resume : go on from the checkpoint in `folder`, where there is one
    progress : called after each epoch
    auditor : says whether a model keeps all laws; the best epochs are put before it, the best first, until one passes.
        Where none does, training goes on at the states that it met against the laws, see `checkpoint`: without a
        checkpoint, so that a training which is resumed does the same again. The sample of states that judges every
        epoch is no proof

    Raises
    ------
    RequestError
        for settings, options or data that cannot be used, a checkpoint that would be lost or does not fit, or a loss
        that is not finite; the last good checkpoint then stays.
    """
    chosen = settings or TrainingSettings()
    begun = perf_counter()
    folder = None if folder is None else Path(folder)
    _check_checkpoint(folder, resume)
    with _reproducible(chosen.seed):
        prepared = prepare_training(split, vehicle, choice, chosen)
        run = _Run(prepared, chosen, folder, begun, progress or (lambda epoch: None))
        run.start(resume)
        while not (why := run.finished()):
            run.epoch()
        model = NetworkModel(vehicle, deepcopy(run.network).cpu(), prepared.time_step, pure=choice.pure)
        chooser = CheckpointSelector(model, split.validation, auditor, run.learns_laws)
        ranked = chooser.ranked(run.history, run.kept)
        probed = Probed()
        if chosen.trust and not choice.pure:
            probed = choice.probes or probes_of(split, vehicle, choice, chosen)
            model.trust(trust_of(model, split, probed))
        learnt, at_once = split.train, run.grown is not None and model.network.gain is not None
        if at_once:
            _calibrate_errors(model, split, probed)
            learnt = join_parts((split.train, split.validation))
            _refit(model, learnt, chosen)
            run.kept = dict.fromkeys(run.kept, cloned(model.network.state_dict()))
        kept = chooser.best(ranked, run.kept)
        whole = len(run.history)
        if run.learns_laws:
            kept = chooser.mended(kept, run.again)
        model.seconds_to_fit = perf_counter() - run.begun
        if not at_once:
            _calibrate_errors(model, split, probed)
    start = None if choice.start is None else choice.start.name
    more = len(run.history) - whole
    told = (model, tuple(run.history), more, kept.epoch, kept.lawful, why, chosen, learnt.seconds, start)
    return Trained(*told, probed=probed)


def _calibrate_errors(model: NetworkModel, split: Split, probed: Probed) -> None:
    """Give a trained network its interval and its band, by rows that it does not know."""
    model.interval = interval_of(model, split)
    if probed.parts:
        near = [*probed.held_out(block=True), (model, split.validation)]
        model.band = prediction_band(near, [*probed.held_out(block=False)])


def _refit(model: NetworkModel, learnt: DataSet, settings: TrainingSettings) -> None:
    """Refit a tabular network to more rows; its gain, interval and band stay as they were calibrated.

    There is no epoch to choose, so that no row need be kept from the last fit (Hastie et al. 2009, section 7.10).
    """
    network = model.network
    table = tabulate(learnt, model.vehicle, network.scaling, pure=model.pure, heading=model.heading)
    fit_tabular(network, table, settings.seed, settings.epochs)
    extend_trust(model, learnt)


def probes_of(
    split: Split,
    vehicle: Vehicle,
    choice: Choice,
    settings: TrainingSettings,
    asked: Sequence[HeldOutPart] | None = None,
) -> Probed:
    """Networks like one to be trained that know parts of the training part alone, and what they say of the rest.

    They begin from fresh weights: a start may have seen what they are to be asked.

    Parameters
    ----------
    asked : the parts; None for all of them
    """
    fresh, few = replace(choice, start=None, probes=None), probe_settings(settings, choice.network)
    every = held_out_parts(split.train, vehicle, few.window) if asked is None else asked
    return train_probes(split, every, lambda part: train(part, vehicle, fresh, settings=few).model)


def probe_settings(settings: TrainingSettings, network: str) -> TrainingSettings:
    """The settings by which a probe is trained: few epochs, and it says everywhere all that it has learnt.

    Parameters
    ----------
    settings : of the network that is probed
    network : its name; of one that is fitted at once, less is drawn
    """
    at_once = network_named(network).grown is not None
    return replace(settings, epochs=1 if at_once else min(settings.epochs, _EPOCHS), trust=False)


def _check_checkpoint(folder: Path | None, resume: bool) -> None:
    """Refuse to lose an interrupted training.

    Raises
    ------
    RequestError
        where it would be lost, or there is no folder for it.
    """
    if folder is None:
        if resume:
            raise RequestError("training: resume needs the folder of the interrupted training")
    elif not resume and (folder / CHECKPOINT).exists():
        raise RequestError(f"{folder} holds an interrupted training; resume it (--resume), or remove {CHECKPOINT}")


def one_pass(
    network: Network,
    objective: Objective,
    optimiser: torch.optim.Optimizer,
    settings: TrainingSettings,
    draw: torch.Generator,
    average: Callable[[], None] | None = None,
) -> float:
    """One epoch of steps over all windows in random order; the mean loss of its batches.

    Parameters
    ----------
    network, objective, optimiser : what is trained, its loss, and the steps
    settings : of the training
    draw : of the order of the windows
    average : called after each step
    """
    order = torch.randperm(objective.count, generator=draw).to(objective.inputs.device)
    parameters = list(network.parameters())
    losses = []
    for index in order.split(_batch(objective.count, settings)):
        optimiser.zero_grad()
        loss = objective(network, index, draw)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(parameters, settings.clip, foreach=True)
        optimiser.step()
        if average is not None:
            average()
        losses.append(loss.detach())
    return float(torch.stack(losses).mean())


def adam(network: Network, settings: TrainingSettings) -> torch.optim.Optimizer:
    """The optimiser of a network: AdamW (Loshchilov and Hutter 2019), all its weights in one kernel."""
    return torch.optim.AdamW(
        network.parameters(), settings.learning_rate, weight_decay=settings.weight_decay, fused=True
    )


def _batch(windows: int, settings: TrainingSettings) -> int:
    """Windows a step: of few windows so few that an epoch still has its steps."""
    return max(1, min(settings.batch, windows // _STEPS))


class _Run:
    """A training under way."""

    def __init__(
        self, prepared: Prepared, settings: TrainingSettings, folder: Path | None, begun: float, progress: Progress
    ) -> None:
        self.prepared, self.settings, self.folder = prepared, settings, folder
        self.begun, self.progress = begun, progress
        self.network = prepared.network
        self.grown = prepared.network.grown
        # Moved there, a copy lies in one piece, as a GPU's recurrence wants it.
        device = prepared.objective.inputs.device
        self.averaged = deepcopy(self.network).to(device) if self._averages else self.network
        self.optimiser = adam(self.network, settings)
        self.draw = torch.Generator().manual_seed(settings.seed)
        self.history: list[Epoch] = []
        self.kept: dict[int, Mapping[str, torch.Tensor]] = {}

    def start(self, resume: bool) -> None:
        """Judge the network as it is, or take up the checkpoint."""
        if self.folder is not None:
            self.folder.mkdir(parents=True, exist_ok=True)
        found = read_checkpoint(self.folder, self.prepared.recipe) if resume and self.folder is not None else None
        if found is None:
            # A hybrid that has learnt nothing is the vehicle; a pure network is nothing, unless it was trained before.
            # How much a network counts that is fitted at once is its gain's to say.
            if self.grown is None and (not self.prepared.pure or "start" in self.prepared.recipe):
                self._judge(None)
            return
        self.network.load_state_dict(found.weights)
        self.averaged.load_state_dict(found.averaged)
        groups = self.optimiser.state_dict()["param_groups"]
        self.optimiser.load_state_dict({"state": dict(found.moments), "param_groups": groups})
        self.draw.set_state(found.draw)
        self.kept = dict(found.kept)
        self.history = list(found.history)
        self.begun -= found.seconds

    @property
    def _averages(self) -> bool:
        return self.settings.averaging > 0.0 and self.grown is None

    @property
    def learns_laws(self) -> bool:
        """True when it has steps, and a loss of the laws."""
        return self.settings.lambda_phys > 0.0 and self.grown is None

    @property
    def _next(self) -> int:
        return self.history[-1].number + 1 if self.history else 1

    def finished(self) -> str:
        """Why training ends here; empty while it goes on."""
        if self.grown is not None and self._next > 1:
            return f"all {self.grown.parts} are {self.grown.how}"
        if stale(self.history) >= self.settings.patience:
            return f"no better validation error for {self.settings.patience} epochs"
        if self._next > self.settings.epochs:
            return f"all {self.settings.epochs} epochs are done"
        return ""

    def epoch(self) -> None:
        """One more epoch, judged, written and told."""
        if self.grown is None:
            self._judge(self._pass(_rate(self.settings, self._next)))
        else:
            self._judge(fit_tabular(self.network, self.prepared.table, self.settings.seed, self.settings.epochs))
        if self.folder is not None:
            write_checkpoint(
                self.folder,
                Checkpoint(
                    self.network.state_dict(),
                    self.averaged.state_dict(),
                    self.kept,
                    self.optimiser.state_dict()["state"],
                    self.draw.get_state(),
                    self.history,
                    perf_counter() - self.begun,
                    self.prepared.recipe,
                ),
            )
        self.progress(self.history[-1])

    def again(self, against: Array) -> tuple[int, dict[str, torch.Tensor]]:
        """Some epochs more at states against the laws, too, see `checkpoint.Again`; none of them is written."""
        self.prepared.objective.met = self.prepared.asked_at(against)
        for _ in range(_MORE):
            self._judge(self._pass(_GENTLE * self.settings.learning_rate))
            self.progress(self.history[-1])
        return self.history[-1].number, self.averaged.state_dict()

    def _pass(self, rate: float) -> float:
        """Steps over all windows; their mean loss."""
        for group in self.optimiser.param_groups:
            group["lr"] = rate
        average = self._average if self._averages else None
        return one_pass(self.network, self.prepared.objective, self.optimiser, self.settings, self.draw, average)

    @torch.no_grad()
    def _average(self) -> None:
        """Move the average towards the weights; in the first epochs it follows them more closely."""
        share = min(self.settings.averaging, self._next / (self._next + _FOLLOWED))
        for mean, now in zip(self.averaged.parameters(), self.network.parameters(), strict=True):
            mean.lerp_(now, 1.0 - share)

    def _judge(self, loss: float | None) -> None:
        number, judge = 0 if loss is None else self._next, self.prepared.judge
        if loss is not None and not isfinite(loss):
            raise self._not_finite(number, f"the loss is {loss}")
        rmse = judge.error(self.averaged)
        if not isfinite(rmse):
            raise self._not_finite(number, "the validation error is not finite")
        self.history.append(Epoch(number, loss, rmse, judge.violating(self.averaged)))
        best = best_epochs(self.history, lawful=self.learns_laws)
        if number in best:
            self.kept[number] = cloned(self.averaged.state_dict())
        self.kept = {n: own for n, own in self.kept.items() if n in best}

    def _not_finite(self, number: int, what: str) -> RequestError:
        text = (
            f"training: {what} in epoch {number}; try a smaller learning rate than {self.settings.learning_rate:g}, a "
            f"smaller clip than {self.settings.clip:g}, or shorter rollouts"
        )
        if self.folder is not None and number > 1:
            text += f". The state after epoch {number - 1} is kept in {self.folder / CHECKPOINT}"
        return RequestError(text)


def _rate(settings: TrainingSettings, number: int) -> float:
    if settings.schedule == "fixed":
        return settings.learning_rate
    share = 0.5 * (1.0 + cos(pi * (number - 1) / max(1, settings.epochs - 1)))
    return settings.learning_rate * (0.01 + 0.99 * share)


@contextmanager
def _reproducible(seed: int) -> Iterator[None]:
    """Seeded weights, deterministic kernels in single precision, and one thread inside; torch as it was outside.

    Networks of this size gain nothing from a second thread, lose much where cores are shared, and with one thread the
    weights do not depend on the number of cores. Kernels of a GPU that round products to ten bits would part its
    weights from those of a processor by a thousandth.
    """
    kernels = torch.backends.cudnn
    before = kernels.deterministic, kernels.allow_tf32
    with torch.random.fork_rng(), one_thread():
        torch.manual_seed(seed)
        kernels.deterministic, kernels.allow_tf32 = True, False
        try:
            yield
        finally:
            kernels.deterministic, kernels.allow_tf32 = before
