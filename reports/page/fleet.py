"""Numbers of several runs side by side: which are the same, which differ and by how much, which are of one run only."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from scipy.stats import chi2

from ...discovery.effect_findings import EffectFinding
from ...discovery.evidence.weighing import CERTAINLY
from ...physics.presentation import listing, number, unit_text, words
from ..run_contents import RunFolder
from ..sureness import FileNumber, file_numbers, marked, vehicle_value, verdict_word
from ..wording import effect_words, interval

_FOUND = ("missing", "likely")
"""Verdicts with which an effect counts as found in a run."""
_TWO_SIDED = 1.959964
"""Half width of a 95 % interval, in standard deviations of a normal distribution."""
_CHANCE = 0.05
"""Probability under which a difference between equal numbers is called one: that of a 95 % interval."""
_SEEN = 2.0 * CERTAINLY
"""Log-likelihood that another log must be expected to give an effect so that its absence there says something: twice
what a name needs, for the noise of that log is another. `benchmarks/two_runs.py` measures how often it misleads."""


class Relation(Enum):
    """How a number of several runs stands in them."""

    DIFFERS = "differs"
    ONLY_HERE = "only here"
    SAME = "same"
    CANNOT_TELL = "cannot tell"


@dataclass(frozen=True, slots=True)
class Held:
    """A number as one run has it.

    Attributes
    ----------
    number : value and 95 % interval, as a corrected vehicle file has them
    found : the effect; None for a number that was calibrated
    """

    number: FileNumber
    found: EffectFinding | None = None

    @property
    def effect(self) -> str:
        """The effect in words, with the thruster where it concerns one."""
        return "calibrated" if self.found is None else effect_words(self.found)

    @property
    def verdict(self) -> str:
        """How sure the effect is; or that the number was calibrated, fitted beside the effects."""
        return "calibrated" if self.found is None else marked(self.found)


@dataclass(frozen=True, slots=True)
class Difference:
    """How far a number of several runs is apart: the largest less the smallest.

    Attributes
    ----------
    value, ci95 : of the difference, with its 95 % interval, in the unit of the number
    chance : probability that numbers which are the same scatter by as much
    """

    value: float
    ci95: tuple[float, float]
    chance: float


@dataclass(frozen=True, slots=True)
class SharedNumber:
    """One number over several runs.

    Attributes
    ----------
    symbol, unit : its name and SI unit
    held : of each run; None where its corrected model has the number of its file
    elsewhere : of each run that does not hold it, what it says of the effect; empty for the others
    filed : of each run, the value of its nominal vehicle; NaN where that has none
    relation : how the runs stand to each other
    difference : of two and more; None where fewer have an interval
    why : where the runs cannot tell, what keeps them from it
    """

    symbol: str
    unit: str
    held: tuple[Held | None, ...]
    elsewhere: tuple[str, ...]
    filed: tuple[float, ...]
    relation: Relation
    difference: Difference | None = None
    why: str = ""

    @property
    def holders(self) -> tuple[int, ...]:
        """Indices of the runs that hold it."""
        return tuple(k for k, one in enumerate(self.held) if one is not None)

    @property
    def effect(self) -> str:
        """The effect in words, of the first run that holds it."""
        return next(one.effect for one in self.held if one is not None)

    def told(self, names: Sequence[str]) -> str:
        """How the runs stand to each other, as a phrase.

        Parameters
        ----------
        names : of the runs
        """
        where = listing([names[k] for k in self.holders])
        if self.relation is Relation.ONLY_HERE:
            return f"only in {where}" + ", the same there" * (len(self.holders) > 1)
        if self.relation is Relation.CANNOT_TELL:
            return f"cannot tell: {self.why}"
        some = f" in {where}" if len(self.holders) < len(self.held) else ""
        if self.relation is Relation.SAME or self.difference is None:
            return f"same{some}"
        apart, unit = self.difference, unit_text(self.unit)
        size = f"{number(apart.value)} {unit}".rstrip()
        rare = "< 0.1 %" if apart.chance < 1e-3 else f"{100.0 * apart.chance:.1f} %"
        return f"differs{some} by {size} (95 %: {interval(apart.ci95)}); by chance: {rare}"


def shared_numbers(runs: Sequence[RunFolder], names: Sequence[str]) -> list[SharedNumber]:
    """Every number that some run found or calibrated, sure or not: what differs first, then what is of one run only.

    Parameters
    ----------
    names : of the runs, for reasons
    """
    found = [_numbers(run) for run in runs]
    symbols = dict.fromkeys(symbol for one in found for symbol in one)
    numbers = [_shared(symbol, [one.get(symbol) for one in found], runs, names) for symbol in symbols]
    order = list(Relation)
    return sorted(numbers, key=lambda one: order.index(one.relation))


def common_effects(runs: Sequence[RunFolder]) -> tuple[list[str], list[str]]:
    """The effects that every run misses, and those that each at least probably misses, in words."""
    found = [{effect_words(item): item.verdict for item in run.findings.candidates} for run in runs]
    both = [name for name in found[0] if all(one.get(name) in _FOUND for one in found)]
    sure = [name for name in both if all(one[name] == "missing" for one in found)]
    return sure, [name for name in both if name not in sure]


def difference_of(numbers: Sequence[FileNumber]) -> Difference | None:
    """How far numbers are apart, and the probability of that where they are the same.

    Estimates are normal. Of an interval that is not symmetric, the side towards what the numbers have in common counts.
    The probability is that of Cochran's Q, the weighted sum of squares about the mean (Cochran 1954), which of two
    numbers is the square of their difference in its standard deviations.

    Parameters
    ----------
    numbers : those without an interval are passed over; fewer than two give None

    Examples
    --------
    >>> one, two = (FileNumber("X_uu", "", x, (x - 0.6, x + 0.6)) for x in (-5.8, -5.3))
    >>> found = difference_of([one, two])
    >>> round(found.value, 2), [round(end, 2) for end in found.ci95], round(found.chance, 2)
    (0.5, [-0.35, 1.35], 0.25)
    """
    known = [(one.value, *one.ci95) for one in numbers if one.ci95 is not None]
    if len(known) < 2:
        return None
    value, low, high = np.array(known, float).T
    tiny = 1e-9 * float(np.abs(value).max()) + 1e-300
    deviation = np.maximum(0.5 * (high - low) / _TWO_SIDED, tiny)
    for _ in range(2):
        centre = np.average(value, weights=deviation**-2)
        deviation = np.maximum(np.where(value < centre, high - value, value - low) / _TWO_SIDED, tiny)
    centre = np.average(value, weights=deviation**-2)
    chance = float(chi2.sf(np.sum(((value - centre) / deviation) ** 2), len(known) - 1))
    most, least = int(np.argmax(value)), int(np.argmin(value))
    apart = float(value[most] - value[least])
    half = _TWO_SIDED * float(np.hypot(deviation[most], deviation[least]))
    return Difference(apart, (apart - half, apart + half), chance)


def _numbers(run: RunFolder) -> dict[str, Held]:
    """The numbers of a run by symbol: of its effects that are at least possible, and of a calibration."""
    held = {one.symbol: Held(FileNumber(one.symbol, one.unit, one.after, one.ci95)) for one in run.findings.calibrated}
    for item in run.findings.candidates:
        if item.cannot_tell or (item.verdict == "no evidence" and not item.in_model):
            continue
        for one in file_numbers(item, run.nominal):
            held[one.symbol] = Held(one, item)
    return held


def _shared(symbol: str, held: Sequence[Held | None], runs: Sequence[RunFolder], names: Sequence[str]) -> SharedNumber:
    """A number with how the runs stand to each other."""
    filed = tuple(vehicle_value(run.nominal, symbol) for run in runs)
    known = [one for one in held if one is not None]
    elsewhere = tuple("" if one else _said(run, known[0]) for one, run in zip(held, runs, strict=True))
    difference = difference_of([one.number for one in known])
    why = next(_doubts(held, runs, names), "") if len(known) < len(runs) else ""
    if difference is not None and difference.chance < _CHANCE:
        relation = Relation.DIFFERS
    elif len(known) < len(runs) and not why:
        relation = Relation.ONLY_HERE
    elif difference is not None:
        relation = Relation.SAME
    else:
        relation, why = Relation.CANNOT_TELL, why or "no interval is known"
    return SharedNumber(symbol, known[0].number.unit, tuple(held), elsewhere, filed, relation, difference, why)


def _doubts(held: Sequence[Held | None], runs: Sequence[RunFolder], names: Sequence[str]) -> Iterator[str]:
    """Why a number may yet be in the runs that do not hold it, as far as the first that does can say."""
    here, found = next((k, one.found) for k, one in enumerate(held) if one is not None)
    if found is None:
        yield "the others did not fit it"
    elif found.claim is not None and not found.claim.null_excluded:
        yield f"the interval of {names[here]} holds the value of the file"
    else:
        for one, run, name in zip(held, runs, names, strict=True):
            if one is None and (why := _hides(run, found, runs[here], name)):
                yield why


def _hides(run: RunFolder, found: EffectFinding, here: RunFolder, name: str) -> str:
    """Why a run does not show that an effect which another run found is absent; empty where it does.

    The absence counts where the log was searched for the effect and can show it, no look-alike stands in its place, and
    the effect would have given the search enough: its gain there, in the ratio of the lengths and of the squared forces
    that a plausible amount makes.
    """
    log, own = run.findings, here.findings
    candidate = _candidate(run, found)
    known, seen = log.identifiability, own.identifiability
    if candidate is None:
        return f"{name} was not searched for it"
    if candidate.cannot_tell or (known and found.key in (*known.dormant, *known.absorbed, *known.noise_limited)):
        return f"the log of {name} cannot show it"
    if candidate.verdict != "no evidence":
        other = candidate.thrusters and candidate.key != found.key
        return f"{name} has {effect_words(candidate)} in its place" if other else f"it may be in {name}, too"
    alike = {*found.indistinguishable_from, *(item.split("[")[0] for item in (known.alike(found.key) if known else ()))}
    alike -= {item.effect for item in own.added}
    if instead := [item.effect for item in log.added if item.effect in alike]:
        return f"{name} has {listing(list(map(words, instead)))} in its place"
    if known is None or seen is None or found.claim is None:
        return ""
    there, ours = (which.excitation.get(found.key) for which in (known, seen))
    length = (log.data.seconds or 0.0) / (own.data.seconds or float("inf"))
    if there and ours and found.claim.gain * length * (there.share / max(ours.share, 1e-12)) ** 2 < _SEEN:
        return f"the log of {name} would hardly show it"
    return ""


def _said(run: RunFolder, held: Held) -> str:
    """What a run says of a number that it does not hold."""
    if held.found is None:
        return "not fitted"
    item = _candidate(run, held.found)
    if item is None:
        return "not judged"
    return "no evidence" if item.thrusters and item.key != held.found.key else verdict_word(item)


def _candidate(run: RunFolder, found: EffectFinding) -> EffectFinding | None:
    """What a run says of an effect: of the same thruster, or else of another; None where it did not look for it."""
    items = [item for item in run.findings.candidates if item.effect == found.effect]
    return next((item for item in items if item.key == found.key), items[0] if items else None)
