"""Probes: networks of one kind trained on parts of a log and tried on the others, from which a correction's gain comes.

Parts are held out in time and in the space of states (the lively half, and both ends of the direction along which
stretches differ most), so gains are known at distances from training (Roberts et al. 2017, doi:10.1111/ecog.02881).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...measurements.preparation.prepare import DataSet
from ...measurements.preparation.split import Split
from ...physics.errors import RequestError
from ...physics.motion import Motion
from ...physics.vehicle import Vehicle
from ..models.base import VehicleModel
from ..models.network_inputs import network_inputs
from ..models.network_model import NetworkModel
from ..networks.trust import HeldOutTrial, Trust, stacked
from ..scores import rollout_errors, target_acceleration

WARM_UP = 2.0
"""Rows at the start of a window on which a network with memory is not judged [s]."""
_SUMMED = 2.0
"""Time over which corrections and what they correct are added up [s], see `networks.trust`."""
_LEAST = 8
"""Stretches that a training part must have, so that a third of it is more than a manoeuvre or two."""
_BLOCKS = 3
"""Blocks of time, each held out once."""
_STRETCH = 10.0
"""What happens within so long a stretch of a log tells of itself alone [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class HeldOutPart:
    """Motions that a probe knows, others of the same log that it is asked, and whether these are a block of time."""

    known: DataSet
    held_out: DataSet
    block: bool


def held_out_parts(data: DataSet, vehicle: Vehicle, seconds: float) -> list[HeldOutPart]:
    """The ways in which a training part is parted; none where it is too short.

    Parameters
    ----------
    seconds : length of the stretches of which parts consist; the last of a motion is longer [s]
    """
    rows = [network_inputs(vehicle, motion, False) for motion in data.motions]
    every = np.concatenate(rows)
    mean, scale = every.mean(axis=0), np.maximum(every.std(axis=0), 1e-12)
    size = max(1, round(seconds / data.motions[0].time_step))
    pieces: list[tuple[int, int, int]] = []
    for k, seen in enumerate(rows):
        starts = range(0, len(seen) - size + 1, size)
        pieces += [(k, *ends) for ends in zip(starts, [*starts[1:], len(seen)], strict=False)]  # none of a short one
    if len(pieces) < _LEAST:
        return []
    apart = [(rows[k][start:stop] - mean) / scale for k, start, stop in pieces]
    lively = np.argsort([np.abs(some).max() for some in apart], kind="stable")[len(pieces) // 2 :]
    means = np.array([some.mean(axis=0) for some in apart])
    main = np.linalg.svd(means - means.mean(axis=0), full_matrices=False)[2][0]
    order, third = np.argsort(means @ main, kind="stable"), len(pieces) // _BLOCKS
    blocks = np.array_split(np.arange(len(pieces)), _BLOCKS)
    every_part = [*((part, True) for part in blocks), *((r, False) for r in (lively, order[:third], order[-third:]))]
    return [_parted(data, pieces, set(asked.tolist()), block=block) for asked, block in every_part]


def _parted(data: DataSet, pieces: list[tuple[int, int, int]], asked: set[int], *, block: bool) -> HeldOutPart:
    """The part whose stretches of these numbers are asked; neighbours are joined."""
    both: tuple[list[tuple[int, int, int]], ...] = ([], [])
    for (k, held), group in groupby(range(len(pieces)), lambda n: (pieces[n][0], n in asked)):
        joined = [pieces[n] for n in group]
        both[held].append((k, joined[0][1], joined[-1][2]))

    def cut(motions: tuple[Motion, ...], where: list[tuple[int, int, int]]) -> tuple[Motion, ...]:
        return tuple(motions[k].slice(start, stop) for k, start, stop in where)

    raw = data.unfiltered
    known, held = (
        replace(data, motions=cut(data.motions, where), unfiltered=None if raw is None else cut(raw, where))
        for where in both
    )
    return HeldOutPart(known, held, block)


class Probe(NamedTuple):
    """A network that knows a part of a log, the part, and what it predicts of the rest, stretch by stretch."""

    model: NetworkModel
    part: HeldOutPart
    said: tuple[HeldOutTrial, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Probed:
    """The probes of one kind, one for each part."""

    parts: tuple[Probe, ...] = ()

    @property
    def tried(self) -> tuple[HeldOutTrial, ...]:
        """What all of them predict of what they do not know."""
        return tuple(one for probe in self.parts for one in probe.said)

    def of(self, parts: Sequence[HeldOutPart]) -> "Probed":
        """Those of some parts, in the order of these."""
        return Probed(tuple(probe for part in parts for probe in self.parts if probe.part is part))

    def held_out(self, *, block: bool) -> Iterator[tuple[NetworkModel, DataSet]]:
        """The probes of blocks of time, or of the others, each with its data and the gain that all other parts tell."""
        tried = self.tried
        for model, part, _ in self.parts:
            if part.block is block:
                own = {(m.source, k) for m in part.held_out.motions for k in np.unique(_stretches_of(m)).tolist()}
                others = [one for one in tried if one.stretch not in own]
                model.trust(trusted(model, others or tried))  # a first block has nothing else to tell its gain
                yield model, part.held_out


def train_probes(split: Split, asked: Sequence[HeldOutPart], probe: Callable[[Split], NetworkModel]) -> Probed:
    """Train the probes of one kind, one for each of some parts of the training part of a split.

    Parameters
    ----------
    split : whose training part is parted
    asked : the parts
    probe : trains one network on the training part of a split
    """
    parts = []
    for part in asked:
        try:
            model = probe(replace(split, train=part.known))
            said = predict_held_out(model, part.known, part.held_out)
        except RequestError:  # a loss that is not finite, perhaps, or too few rows for a window: it tells nothing
            continue
        parts.append(Probe(model, part, tuple(said)))
    return Probed(tuple(parts))


def predict_held_out(model: NetworkModel, known: DataSet, asked: DataSet) -> list[HeldOutTrial]:
    """Predict the correction of a network on data that it did not learn, stretch by stretch; its gain is 1 then.

    Parameters
    ----------
    model : the network
    known : data that it learnt
    asked : data that it did not learn
    """
    model.trust(_measure_known(model, known))
    first = round(WARM_UP / model.time_step) if model.remembers else 0
    result = []
    for motion in asked.motions:
        lacking = target_acceleration(model.vehicle, motion, asked, False)
        said, distance = model.correction(motion), model.beyond(motion)
        stretch = _stretches_of(motion)
        for one in np.unique(stretch[first:]).tolist():
            rows = np.flatnonzero(stretch == one)
            rows = rows[rows >= first]
            result.append(HeldOutTrial(lacking[rows], said[rows], distance[rows], (motion.source, one)))
    return result


def _measure_known(model: NetworkModel, known: DataSet) -> Trust:
    """A gain of 1, with distances from what a network learnt."""
    seen = np.concatenate([network_inputs(model.vehicle, motion, model.heading) for motion in known.motions])
    return Trust.within(model.network.known(model.network.scaling.inputs.apply(seen)))


def extend_trust(model: NetworkModel, known: DataSet) -> None:
    """Measure the distances of a gain from all that a network has learnt by now; the gain at a distance stays.

    Parameters
    ----------
    model : the network, with a gain
    known : what it learnt
    """
    gain = model.network.gain
    assert gain is not None, "what is extended was told before"
    ends = _measure_known(model, known)
    model.trust(replace(gain.trust, lower=ends.lower, upper=ends.upper))


def _stretches_of(motion: Motion) -> NDArray[np.int64]:
    """By which stretch of its log each row of a motion (n,) is judged."""
    return (motion.time // _STRETCH).astype(np.int64)


def trust_of(model: NetworkModel, split: Split, found: Probed) -> Trust:
    """Trust region of a trained network, by probes along the training part, and by itself on the validation part.

    Parameters
    ----------
    model : the trained network
    split : with its training and validation part
    found : what the probes predicted
    """
    return trusted(model, (*found.tried, *predict_held_out(model, split.train, split.validation)))


def trusted(model: NetworkModel, tried: Sequence[HeldOutTrial]) -> Trust:
    """The gain of a network that knows its distances, by what was tried."""
    gain = model.network.gain
    assert gain is not None, "`predict_held_out` has measured from where distances are"
    rows = round(_SUMMED / model.time_step)
    reaches, weights, error = stacked(tried, rows, common=model.network.rests_on == "itself")
    return replace(gain.trust, reaches=reaches, weights=weights, error=error)


def rollout_ratio_of(found: Probed, alone: Vehicle | None = None) -> tuple[float, float]:
    """Error of rollouts of probes in that of the vehicle alone, on parts that neither a probe nor its gain knows.

    Geometric mean over parts, horizons of 2 and 10 s, and speeds and position, so that no part counts for more because
    the vehicle errs more there.

    Parameters
    ----------
    found : the probes
    alone : the vehicle that is held against them; None for that beside which they stand

    Returns
    -------
    (ratio, error)
        error is the standard error of the logarithm, by its scatter over the parts; (1, inf) where no rollout fits
    """
    every = []
    for model, asked in (*found.held_out(block=True), *found.held_out(block=False)):
        named = rollout_errors(VehicleModel(alone or model.vehicle, "alone"), asked, (2.0, 10.0))
        ratios = []
        for name, errors in rollout_errors(model, asked, (2.0, 10.0)).items():
            if errors.squares:
                own, its = (np.concatenate(each.squares).mean(axis=0) for each in (errors, named[name]))
                ratios.append(0.5 * np.log(np.maximum(own, 1e-300) / np.maximum(its, 1e-300)))
        if ratios:
            every.append(float(np.mean(ratios)))
    error = float(np.std(every, ddof=1)) / len(every) ** 0.5 if len(every) > 1 else np.inf
    return float(np.exp(np.mean(every))) if every else 1.0, error
