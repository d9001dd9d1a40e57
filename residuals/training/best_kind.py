"""Choice of the kind of network: the one whose probes err least in rollouts of parts that they do not know."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import exp, log

from ...measurements.preparation.split import Split
from ...physics.errors import RequestError
from ...physics.vehicle import Vehicle
from .epochs import probes_of
from .probes import Probed, held_out_parts, rollout_ratio_of
from .training_settings import Choice, TrainingSettings

KINDS = (Choice("symmetric_gp"), Choice("gp"), Choice("gp", heading=True), Choice("ridge", {"filters": 4}))
"""The kinds that are tried, a minute and a half together for a log of five; the last one remembers. See
`docs/decisions.md`."""

_SURE = 2.0
"""Standard errors by which a kind is surely better than the vehicle alone. See `docs/decisions.md`."""


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A kind that was tried.

    Attributes
    ----------
    choice : the kind
    ratio : error of its rollouts over parts that its probes do not know, in that of the vehicle alone
    error : standard error of the logarithm of `ratio`
    probes : all its probes, of which its gain comes
    """

    choice: Choice
    ratio: float
    error: float
    probes: Probed

    def holds(self, *, learnable: bool) -> bool:
        """True where it errs less than the vehicle alone, which is one of the kinds, too.

        Parameters
        ----------
        learnable : whether what the vehicle leaves is surely more than noise; else the parts have to be sure
        """
        return log(self.ratio) < (0.0 if learnable else -_SURE * self.error)

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
    alone: Vehicle | None = None,
) -> list[Candidate]:
    """Some kinds, the one of the least ratio and standard error first; what cannot stand beside a vehicle is left out.

    Each is judged on blocks of time and regions of states that its probes do not know, with the gain that the others
    tell.

    Parameters
    ----------
    progress : told the name of each kind before it is tried
    alone : the vehicle without a network, where it changes by the minute, of which networks know nothing

    Raises
    ------
    RequestError
        where none could be tried, such as on a log that is too short.
    """
    every = held_out_parts(split.train, vehicle, settings.window)
    found = []
    for choice in kinds:
        if progress is not None:
            progress(name_of(choice))
        probes = probes_of(split, vehicle, choice, settings, every)
        if any(part.block for _, part in probes.parts):
            found.append(Candidate(choice, *rollout_ratio_of(probes, alone), probes))
    if not found:
        raise RequestError(
            "train: no kind of network could be tried on blocks of this log that it does not know: it has "
            f"{split.train.seconds:.0f} s to train on; give a longer log, or name the kind (--residual gp)"
        )
    return sorted(found, key=lambda one: (one.ratio * exp(one.error), one.ratio))


def best_of(kinds: Sequence[Candidate], *, learnable: bool) -> Candidate | None:
    """The best kind that holds, see `Candidate.holds`; None where the vehicle alone is as good.

    Parameters
    ----------
    kinds : as `candidates` orders them
    learnable : whether what the vehicle leaves is surely more than noise
    """
    return next((one for one in kinds if one.holds(learnable=learnable)), None)
