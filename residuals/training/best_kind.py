"""Choice of the network: the one whose probes err least in rollouts of parts of the log that they do not know.

In the time that is given for it, other kinds, sizes and recipes are raced against the best so far: each is asked of the
same parts, and left as soon as it errs more (Maron and Moore 1994; akin to the successive halving of Jamieson and
Talwalkar 2016, with parts of the log for epochs).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import exp, log
from time import perf_counter

from ...measurements.preparation.split import Split
from ...physics.errors import RequestError
from ...physics.vehicle import Vehicle
from ..networks.registry import LARGEST, NETWORKS, default_options, network_named
from .epochs import probe_settings, probes_of
from .preparation import sample
from .probes import HeldOutPart, Probed, held_out_parts, rollout_ratio_of
from .training_settings import MOVED, Choice, TrainingSettings

KINDS = (Choice("symmetric_gp"), Choice("gp"), Choice("gp", heading=True), Choice("ridge", {"filters": 4}))
"""The kinds that are tried, a minute and a half together for a log of five; the last one remembers. See
`docs/decisions.md`."""

_SURE = 2.0
"""Standard errors by which a kind is surely better than the vehicle alone. See `docs/decisions.md`."""
_STEP, _ROLLED = 3.0, 20
"""Times that a move changes a setting of the recipe, and rows of the rollouts that it adds to the loss."""


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A kind that was tried.

    Attributes
    ----------
    choice : the kind
    ratio : error of its rollouts over parts that its probes do not know, in that of the vehicle alone
    error : standard error of the logarithm of `ratio`
    probes : all its probes, of which its gain comes
    recipe : settings that differ from those which were given, by name
    seconds : that its probes took [s]
    """

    choice: Choice
    ratio: float
    error: float
    probes: Probed
    recipe: Mapping[str, float] = field(default_factory=dict)
    seconds: float = 0.0

    def holds(self, *, learnable: bool) -> bool:
        """True where it errs less than the vehicle alone, which is one of the kinds, too.

        Parameters
        ----------
        learnable : whether what the vehicle leaves is surely more than noise; else the parts have to be sure
        """
        return log(self.ratio) < (0.0 if learnable else -_SURE * self.error)

    @property
    def rank(self) -> tuple[float, float]:
        """The least is the best: the ratio and one standard error, then the ratio."""
        return self.ratio * exp(self.error), self.ratio

    @property
    def name(self) -> str:
        """As `train` calls it."""
        return name_of(self.choice, self.recipe)


def name_of(choice: Choice, recipe: Mapping[str, float] | None = None) -> str:
    """A kind, and what of its recipe is its own, as `train` calls it."""
    options = "".join(f" --option {name}={value}" for name, value in (choice.options or {}).items() if value)
    changed = "".join(f" --set {name}={value:.3g}" for name, value in (recipe or {}).items())
    return f"{choice.network}{' --heading' * choice.heading}{options}{changed}"


def candidates(
    split: Split,
    vehicle: Vehicle,
    settings: TrainingSettings,
    kinds: Sequence[Choice] = KINDS,
    progress: Callable[[str], None] | None = None,
    alone: Vehicle | None = None,
    behind: list[str] | None = None,
) -> list[Candidate]:
    """Some kinds, the one of the least ratio and standard error first; what cannot stand beside a vehicle is left out.

    Each is judged on blocks of time and regions of states that its probes do not know, with the gain that the others
    tell.

    Parameters
    ----------
    settings : of the recipe; until its minutes are over, others are tried, too, those of other networks first where
        several kinds are given
    progress : told the name of each kind before it is tried
    alone : the vehicle without a network, where it changes by the minute, of which networks know nothing
    behind : gets the names of those that were left half way, since they erred more or would take too long

    Raises
    ------
    RequestError
        where none could be tried, such as on a log that is too short.
    """
    every, begun = held_out_parts(split.train, vehicle, settings.window), perf_counter()
    race = _Race(split, vehicle, settings, every, alone)
    race.told, race.behind = progress or race.told, behind if behind is not None else []
    found = [one for choice in kinds if (one := race.run(choice)) is not None]
    if not found:
        raise RequestError(
            "train: no kind of network could be tried on blocks of this log that it does not know: it has "
            f"{split.train.seconds:.0f} s to train on; give a longer log, or name the kind (--residual gp) without "
            "--minutes"
        )
    if settings.minutes:
        others = [Choice(name) for name in _by_weights() if len(kinds) > 1]
        found += race.further(found, others, begun + 60.0 * settings.minutes)
    return sorted(found, key=lambda one: one.rank)


def best_of(kinds: Sequence[Candidate], *, learnable: bool) -> Candidate | None:
    """The best kind that holds, see `Candidate.holds`; None where the vehicle alone is as good.

    Parameters
    ----------
    kinds : as `candidates` orders them
    learnable : whether what the vehicle leaves is surely more than noise
    """
    return next((one for one in kinds if one.holds(learnable=learnable)), None)


class _Race:
    """Kinds that are asked of the same parts, one part after the other, each a block of time or a region in turn."""

    def __init__(
        self,
        split: Split,
        vehicle: Vehicle,
        settings: TrainingSettings,
        parts: Sequence[HeldOutPart],
        alone: Vehicle | None,
    ) -> None:
        self.split, self.vehicle, self.settings, self.alone = split, vehicle, settings, alone
        self.told: Callable[[str], None] = lambda name: None
        self.behind: list[str] = []
        blocks, regions = ([part for part in parts if part.block is block] for block in (True, False))
        self.order, self.parts = parts, [part for pair in zip(blocks, regions, strict=True) for part in pair]
        self.seen: set[tuple[object, ...]] = set()

    def run(
        self,
        choice: Choice,
        recipe: Mapping[str, float] | None = None,
        best: Candidate | None = None,
        until: float = float("inf"),
    ) -> Candidate | None:
        """Try a kind; None where it cannot be, or errs more than the best so far, or would not be trained in time."""
        changed, begun = recipe or {}, perf_counter()
        name = name_of(choice, changed)
        self.seen.add(self._key(choice, changed))
        self.told(name)
        settings = replace(self.settings, **changed)  # type: ignore[arg-type]  # by name
        probes, training = Probed(), len(self.parts) * self._training(choice, settings)
        for count, part in enumerate(self.parts, 1):
            more = probes_of(self.split, self.vehicle, choice, settings, [part])
            probes, now = Probed((*probes.parts, *more.parts)), perf_counter()
            if best is None:
                continue
            if not more.parts:
                return None
            late = now + (len(self.parts) - count + training) * (now - begun) / count > until
            if late or (count % 2 == 0 and self._errs_more(probes, best, self.parts[:count])):
                self.behind.append(name)
                return None
        if not any(probe.part.block for probe in probes.parts):
            return None
        probes = probes.of(self.order)
        return Candidate(choice, *rollout_ratio_of(probes, self.alone), probes, changed, perf_counter() - begun)

    def _errs_more(self, probes: Probed, best: Candidate, parts: Sequence[HeldOutPart]) -> bool:
        return rollout_ratio_of(probes, self.alone)[0] > rollout_ratio_of(best.probes.of(parts), self.alone)[0]

    def further(self, found: Sequence[Candidate], others: Sequence[Choice], until: float) -> Iterator[Candidate]:
        """What is better than the best so far: other networks, then other sizes and recipes of the best one."""
        best, kinds = min(found, key=lambda one: one.rank), [(choice, {}) for choice in others]
        while True:
            asked = [one for one in (*kinds, *_moves(best, self.settings)) if self._key(*one) not in self.seen]
            spent = self._training(best.choice, replace(self.settings, **best.recipe)) * best.seconds
            if not asked or perf_counter() + spent > until:
                return
            one = self.run(*asked[0], best, until)
            if one is not None:
                best = min(best, one, key=lambda each: each.rank)
                yield one

    def _training(self, choice: Choice, settings: TrainingSettings) -> float:
        """How long a training takes, in the time of all probes, of which each knows two thirds of the log."""
        if network_named(choice.network).grown is not None:
            return 1.0
        probe = probe_settings(settings, choice.network).epochs
        return max(1.0, 1.5 * settings.epochs / (max(1, len(self.parts)) * probe))

    def _key(self, choice: Choice, recipe: Mapping[str, float]) -> tuple[object, ...]:
        """What a kind is, however it is called."""
        options = default_options(choice.network) | dict(choice.options or {})
        settings = [f"{float(recipe.get(name, getattr(self.settings, name))):.6g}" for name in MOVED]
        return choice.network, choice.heading, *sorted(options.items()), *settings


def _by_weights() -> list[str]:
    """Networks that stand beside a vehicle, those of the fewest weights first, so that they are the quickest."""
    return sorted(NETWORKS, key=lambda name: sum(p.numel() for p in sample(Choice(name)).parameters()))


def _moves(best: Candidate, settings: TrainingSettings) -> list[tuple[Choice, dict[str, float]]]:
    """What differs from the best kind in its size or in one setting."""
    choice, recipe, network = best.choice, dict(best.recipe), best.choice.network
    options = default_options(network) | dict(choice.options or {})
    sizes = [("units", round(factor * options.get("units", 0))) for factor in (2.0, 0.5)]
    sizes += [("filters", options["filters"] + step) for step in (2, -2) if "filters" in options]
    moves = [
        (replace(choice, options={**(choice.options or {}), name: size}), recipe)
        for name, size in sizes
        if name in options and (1 if name == "units" else 0) <= size <= LARGEST[name]
    ]
    if NETWORKS[network].grown is None:
        moves += [
            (choice, recipe | {name: factor * float(recipe[name] if name in recipe else getattr(settings, name))})
            for name in ("learning_rate", "weight_decay")
            for factor in (1.0 / _STEP, _STEP)
        ]
        moves.append((choice, recipe | {"rollout_rows": 0 if recipe.get("rollout_rows") else _ROLLED}))
    return moves
