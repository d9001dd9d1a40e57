"""Choice of the kind of network: the one whose probes err least in rollouts of blocks that they do not know."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ...measurements.preparation.split import Split
from ...physics.errors import RequestError
from ...physics.vehicle import Vehicle
from .epochs import probes_of
from .probes import HeldOutPart, Probed, held_out_parts, rollout_ratio_of
from .training_settings import Choice, TrainingSettings

KINDS = (Choice("gp"), Choice("gp", heading=True), Choice("symmetric"), Choice("mlp"), Choice("lstm"))
"""The kinds that are tried, and on two processors within three minutes for a log of five: those that were best in a
case of `docs/rivals.md`; the others of the registry cost more than all of these."""


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A kind that was tried.

    Attributes
    ----------
    choice : the kind
    ratio : error of its rollouts over blocks that its probes do not know, in that of the vehicle alone; of those that
        were left out by the first block, over that
    probes : those probes, of which its gain comes
    """

    choice: Choice
    ratio: float
    probes: Probed

    @property
    def name(self) -> str:
        """As `train` calls it."""
        return f"{self.choice.network}{' --heading' * self.choice.heading}"


def candidates(
    split: Split,
    vehicle: Vehicle,
    settings: TrainingSettings,
    kinds: Sequence[Choice] = KINDS,
    progress: Callable[[str], None] | None = None,
) -> list[Candidate]:
    """Some kinds, the best first; those that cannot stand beside a vehicle, such as `symmetric`, are left out.

    Successive halving (Jamieson and Talwalkar 2016): all are tried on one block of time, the better half on all of
    them, and what tells how far a correction is trusted is asked of the best alone.

    Parameters
    ----------
    progress : told the name of each kind before it is tried

    Raises
    ------
    RequestError
        where none could be tried, such as on a log that is too short.
    """
    every = held_out_parts(split.train, vehicle, settings.window)
    blocks, regions = ([part for part in every if part.block is block] for block in (True, False))

    def tried(before: Sequence[Candidate], asked: Sequence[HeldOutPart]) -> list[Candidate]:
        found = []
        for one in before:
            if progress is not None:
                progress(one.name)
            probes = one.probes + probes_of(split, vehicle, one.choice, settings, asked)
            if probes.blocks:
                found.append(Candidate(one.choice, rollout_ratio_of(probes), probes))
        return sorted(found, key=lambda one: one.ratio)

    first = tried([Candidate(choice, 1.0, Probed()) for choice in kinds], blocks[:1])
    half = -(-len(first) // 2)
    last = tried(first[:half], blocks[1:])
    if not last:
        raise RequestError(
            "train: no kind of network could be tried on blocks of this log that it does not know: it has "
            f"{split.train.seconds:.0f} s to train on; give a longer log, or name the kind (--residual gp)"
        )
    best = last[0]
    whole = replace(best, probes=best.probes + probes_of(split, vehicle, best.choice, settings, regions))
    return [whole, *last[1:], *first[half:]]
