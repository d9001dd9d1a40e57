"""How far beyond its training a correction is trusted: a probe that knows the calm part of a log tries the lively rest.

A log says little of what comes beyond it, but it says something: whether what is learnt of its calmer half still holds
where the other half leaves that. Where it does not hold so far, the calmer three quarters and the rest try less.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...measurements.preparation.dataset import DataSet
from ...measurements.preparation.split import Split
from ...physics.errors import RequestError
from ...physics.frames import Array
from ...physics.in_words import percent
from ...physics.motion import Motion
from ...physics.vehicle import Vehicle
from ...physics.worded import Worded
from ..models.base import Model, VehicleModel
from ..models.network_inputs import network_inputs
from ..models.network_model import NetworkModel
from ..networks.fade import NARROW, directions
from ..scores import RolloutErrors, rollout_errors
from .holding import least_share
from .training_settings import TrainingSettings

_CALM = (0.5, 0.75)
"""Shares of a training part that a probe knows: of the half the rest tries the most, of three quarters less."""
_FARTHER = 4.0
"""Times the distance that was tried at which nothing is left of a correction. Chosen by seeds from 100 of simulated
worlds and Gazebo, see `docs/decisions.md`: at 8 one of them got worse by a fifth, at 2 less was gained."""
_EPOCHS = 40
"""Epochs of a probe, at most: it is to say how a correction goes on, not to be used."""
_LEAST = 8
"""Stretches that a training part must have, so that its calm part is more than a manoeuvre or two."""
_HORIZON = 10.0
"""Of the rollouts [s]."""
_TRIED = 0.9
"""Quantile of the greatest distances of rollouts that counts as tried: single jumps of a command go farther."""


class Why(Worded):
    """Why a correction fades where it does; the value is the word that files have."""

    sentence: str
    """What is told of it, with the numbers of `Reaching` in braces."""

    HOLDS = (
        "holds",
        "trained on the calmest {calm} of the training part alone, it held up to {tried:.2g} deviations beyond that, "
        "where it left {wide} of the vehicle's error in 10 s positions, and {narrow} with a fade of 0.5",
    )
    HOLDS_NOT = (
        "holds_not",
        "trained on the calmest {calm} of the training part alone, it was not surely better {tried:.2g} deviations "
        "beyond that than with a fade of 0.5",
    )
    UNTRIED = ("untried", "the training part is too short or too even to try how far it holds")
    FAILED = ("failed", "no probe could be trained that would try it")
    BEGUN = ("begun", "a network that goes on from another may have seen what would try it")


@dataclass(frozen=True, slots=True)
class Reaching:
    """Where the correction of a hybrid fades, as its training part says.

    Attributes
    ----------
    fade : distance beyond the training at which nothing is left [standard deviations]
    why : reason
    calm : share of the training part that the probe knew
    tried : distance beyond that at which the probe was judged [standard deviations of that part]
    narrow, wide : root mean square error of the probe's position there, in that of the vehicle alone, with the narrow
        fade and with one that is as wide as `tried` allows; 1 where nothing was tried
    """

    fade: float
    why: Why
    calm: float = 1.0
    tried: float = 0.0
    narrow: float = 1.0
    wide: float = 1.0

    @classmethod
    def of(cls, said: object) -> "Reaching":
        """What `to_dict` wrote.

        Raises
        ------
        RequestError
            where it did not.
        """
        try:
            if not isinstance(said, dict):
                raise TypeError(f"got {said!r}")
            return cls(**{**said, "why": Why(said["why"])})
        except (TypeError, ValueError, KeyError) as error:
            raise RequestError(
                f"training: a checkpoint does not say where its correction fades ({error}); remove it to train anew"
            ) from error

    @property
    def sentence(self) -> str:
        """Where it fades, and why."""
        shares = {"calm": percent(self.calm), "narrow": percent(self.narrow), "wide": percent(self.wide)}
        why = self.why.sentence.format(tried=self.tried, **shares)
        far = f"{self.fade:.2g} standard deviations outside the range of its training inputs"
        return f"Its correction fades to zero {far}: {why}."

    def to_dict(self) -> dict[str, object]:
        """As a model's file has it; nothing of a trial that there was not."""
        said: dict[str, object] = {"fade": self.fade, "why": self.why.value}
        if self.why in (Why.HOLDS, Why.HOLDS_NOT):
            said |= {"calm": self.calm, "tried": self.tried, "narrow": self.narrow, "wide": self.wide}
        return said


def probe_settings(settings: TrainingSettings) -> TrainingSettings:
    """The settings by which a probe is trained: few epochs, and it says everywhere all that it has learnt."""
    return replace(settings, epochs=min(settings.epochs, _EPOCHS), fade=0.0, shrink=False)


def reaching(split: Split, vehicle: Vehicle, window: float, probe: Callable[[Split], NetworkModel]) -> Reaching:
    """Where a correction should fade, by rollouts along the training part of probes that know the calm part of it.

    The wide fade is as far as a probe was tried, `_FARTHER` times. It is kept where the probe errs less with it than
    with the narrow one by more than a standard error, and takes a tenth off the error of the vehicle alone, see
    `least_share`. No fade is wider than a distance at which the probe of fewer stretches did not hold. Distances are
    told in deviations of what was known, so that they mean the same of the whole.

    Parameters
    ----------
    window : length of the stretches of which the calm ones are known [s]
    probe : trains one on the training part of a split
    """
    found, most = Reaching(NARROW, Why.UNTRIED), np.inf
    for share in _CALM:
        calm = calm_part(split.train, vehicle, window, share)
        if calm is None:
            break
        try:
            model = probe(replace(split, train=calm))
        except RequestError:  # a loss that is not finite, perhaps: the training itself says so
            return found if found.why is Why.HOLDS_NOT else Reaching(NARROW, Why.FAILED)
        tried = _tried(model, calm, split.train, share, most)
        if tried.why is Why.HOLDS:
            return tried
        if tried.why is Why.HOLDS_NOT and found.why is Why.UNTRIED:
            found, most = tried, tried.tried
    return found


def _tried(model: NetworkModel, calm: DataSet, data: DataSet, share: float, most: float) -> Reaching:
    """What the rollouts of a probe along all data say that leave what it knows by so much that a narrow fade is 0."""
    along = replace(data, motions=tuple(m for m in data.motions if m.duration >= _HORIZON), unfiltered=None)
    if not along.motions:
        return Reaching(NARROW, Why.UNTRIED)
    network = model.network
    seen = network.scaling.inputs.apply(_inputs(calm, model.vehicle, model.heading))

    def rolled(one: Model) -> RolloutErrors:
        return rollout_errors(one, along, (_HORIZON,))[f"{_HORIZON:g}"]

    alone = rolled(VehicleModel(model.vehicle, "alone"))
    network.fade_beyond(network.known(seen, NARROW))
    pairs = zip(along.motions, alone.spacing, strict=True)
    distances = np.concatenate([_farthest(model.beyond(motion), motion, every) for motion, every in pairs])
    lively = distances > NARROW
    if not lively.any():
        return Reaching(NARROW, Why.UNTRIED)
    tried = float(np.quantile(distances[lively], _TRIED))
    far = min(_FARTHER * tried, most)
    squares = {0.0: np.concatenate(alone.squares)[lively]}
    for fade in (NARROW, far):
        network.fade_beyond(network.known(seen, fade))
        squares[fade] = np.concatenate(rolled(model).squares)[lively]
    unit = np.maximum(squares[0.0].mean(axis=0), 1e-300)
    errors = {fade: (found / unit).mean(axis=1) for fade, found in squares.items()}
    holds = least_share(errors, max(1.0, lively.mean() * along.seconds / _HORIZON)) == far
    narrow, wide = (float(np.sqrt(squares[fade][:, 3].mean() / unit[3])) for fade in (NARROW, far))
    fade, why = (far, Why.HOLDS) if holds else (NARROW, Why.HOLDS_NOT)
    return Reaching(fade, why, share, tried, narrow, wide)


def calm_part(data: DataSet, vehicle: Vehicle, seconds: float, share: float) -> DataSet | None:
    """The share of the stretches of motions that keeps farthest from the ends of what all of them show.

    A stretch counts by the row that comes nearest to an end of any velocity or thrust, or of the sum or difference of
    two. None where there are too few stretches.

    Parameters
    ----------
    seconds : length of a stretch; the last of a motion is longer [s]
    """
    rows = _inputs(data, vehicle)
    mean, scale = rows.mean(axis=0), np.maximum(rows.std(axis=0), 1e-12)
    turned = directions(rows.shape[1]).T
    along = ((rows - mean) / scale) @ turned
    middle, half = 0.5 * (along.max(axis=0) + along.min(axis=0)), 0.5 * np.maximum(np.ptp(along, axis=0), 1e-12)
    pieces: list[tuple[float, int, int, int]] = []
    for k, motion in enumerate(data.motions):
        size = round(seconds / motion.time_step)
        near = np.abs((((network_inputs(vehicle, motion, False) - mean) / scale) @ turned - middle) / half).max(axis=1)
        starts = range(0, motion.time.size - size + 1, size)
        pieces += [
            (float(near[start:stop].max()), k, start, stop)
            for start, stop in zip(starts, [*starts[1:], motion.time.size], strict=False)  # none where it is too short
        ]
    if len(pieces) < _LEAST:
        return None
    joined: list[tuple[int, int, int]] = []
    for _, k, start, stop in sorted(sorted(pieces)[: round(share * len(pieces))], key=lambda piece: piece[1:]):
        before = joined.pop() if joined and joined[-1][::2] == (k, start) else (k, start, start)
        joined.append((k, before[1], stop))

    def cut(motions: tuple[Motion, ...]) -> tuple[Motion, ...]:
        return tuple(motions[k].slice(start, stop) for k, start, stop in joined)

    raw = None if data.unfiltered is None else cut(data.unfiltered)
    return replace(data, motions=cut(data.motions), unfiltered=raw)


def _inputs(data: DataSet, vehicle: Vehicle, heading: bool = False) -> Array:
    return np.concatenate([network_inputs(vehicle, motion, heading) for motion in data.motions])


def _farthest(beyond: Array, motion: Motion, every: float) -> Array:
    """The greatest of the distances (n,) along each rollout, from starts so far apart [s]."""
    steps = round(_HORIZON / motion.time_step)
    along = np.lib.stride_tricks.sliding_window_view(beyond, steps + 1)
    return along[:: round(every / motion.time_step)].max(axis=1)
