"""Choice of the kind of network: by rollouts of blocks that its probes do not know, the simplest of the best.

Of the kinds that blocks do not tell apart the simplest is taken, by one standard error of the difference (Hastie,
Tibshirani and Friedman 2009, section 7.10).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...measurements.preparation.split import Split
from ...physics.errors import RequestError
from ...physics.motion import Array
from ...physics.vehicle import Vehicle
from .epochs import probes_of
from .probes import HeldOutPart, Probed, held_out_parts, rollout_ratios
from .training_settings import Choice, TrainingSettings

KINDS = (
    *(Choice("ridge", {"filters": filters}, heading=heading) for filters in (0, 4) for heading in (False, True)),
    *(Choice("gp", heading=heading) for heading in (False, True)),
)
"""The kinds that are tried, the simplest first, three quarters of a minute together for a log of five: those that are
fitted at once. Those that are trained by steps err least of ours in no case of `docs/rivals.md`."""


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A kind that was tried.

    Attributes
    ----------
    choice : the kind
    ratios : (blocks,) error of its rollouts over blocks that its probes do not know, in that of the vehicle alone
    probes : those probes, of which its gain comes
    """

    choice: Choice
    ratios: Array
    probes: Probed

    @property
    def ratio(self) -> float:
        """Geometric mean over blocks; 1 where no rollout fits."""
        return float(np.exp(np.log(self.ratios).mean())) if len(self.ratios) else 1.0

    @property
    def name(self) -> str:
        """As `train` calls it."""
        return name_of(self.choice)


def name_of(choice: Choice) -> str:
    """A kind as `train` calls it."""
    options = "".join(f" --option {name}={value}" for name, value in (choice.options or {}).items() if value)
    return f"{choice.network}{' --heading' * choice.heading}{options}"


def candidates(
    split: Split,
    vehicle: Vehicle,
    settings: TrainingSettings,
    kinds: Sequence[Choice] = KINDS,
    progress: Callable[[str], None] | None = None,
) -> list[Candidate]:
    """Some kinds, the one to take first; those that cannot stand beside a vehicle, such as `symmetric`, are left out.

    All are tried on all blocks of time, the validation part among them; what tells how far a correction is trusted is
    asked of the one that is taken alone.

    Parameters
    ----------
    kinds : the simplest first
    progress : told the name of each kind before it is tried

    Raises
    ------
    RequestError
        where none could be tried, such as on a log that is too short.
    """
    every = held_out_parts(split.train, vehicle, settings.window)
    blocks, regions = ([part for part in every if part.block is block] for block in (True, False))
    last = [HeldOutPart(split.train, split.validation, block=True)]
    found = []
    for choice in kinds:
        if progress is not None:
            progress(name_of(choice))
        probes = probes_of(split, vehicle, choice, settings, blocks)
        if probes.parts:
            both = probes + probes_of(split, vehicle, choice, settings, last)
            found.append(Candidate(choice, rollout_ratios(both), probes))
    if not found:
        raise RequestError(
            "train: no kind of network could be tried on blocks of this log that it does not know: it has "
            f"{split.train.seconds:.0f} s to train on; give a longer log, or name the kind (--residual gp)"
        )
    taken = simplest_of(found)
    others = sorted((one for one in found if one is not taken), key=lambda one: one.ratio)
    return [replace(taken, probes=taken.probes + probes_of(split, vehicle, taken.choice, settings, regions)), *others]


def simplest_of(found: Sequence[Candidate]) -> Candidate:
    """The first whose error exceeds the least by no more than one standard error of the difference over blocks.

    Parameters
    ----------
    found : kinds, the simplest first, each tried on the same blocks; one that lacks a block is not compared
    """
    best = min(found, key=lambda one: one.ratio)
    for one in found:
        if len(one.ratios) == len(best.ratios) > 1:
            more = np.log(one.ratios / best.ratios)
            if more.mean() <= more.std(ddof=1) / np.sqrt(len(more)):
                return one
    return best
