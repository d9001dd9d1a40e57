"""Claims: the facts of each name that stands in a model, gathered once, none of them a verdict.

Unexplained force and the scatter of a number between parts of the log widen its interval; a number at its bound,
outside its own interval, or of a hull that cannot be is a limit's and not the log's. Each test contributes its size
relative to the claim. `judgement.py` turns a claim into a probability.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from ..measurements.statistics.blocks import CI
from ..physics.motion import Array
from ..physics.plausibility import find_impossible
from ..physics.presentation import words
from ..physics.vehicle import Vehicle
from .balance.shooting import TRIFLE
from .candidates.candidate import Candidate, Kind, limit_reached
from .effect_findings import Claim, Reason, Worth
from .evidence.invariance import Invariance
from .evidence.omitted_variables import FileError
from .evidence.record_errors import Misalignment
from .evidence.unmodelled_forces import FreeFormRefit, UnmodelledForces
from .evidence.weighing import Evidence
from .search.estimation import Interval
from .search.rival_explanations import redundant_scales

_TOGETHER = (
    "the common scale and every thruster's own are fitted at once, and only their products move a force, so that the "
    "log cannot tell one of them from the others"
)
_SLACK = 0.05
"""Share of an interval's width by which an estimate may lie beyond its end: rounding, and steps of a profile."""
_RIGID_BODY = ("x_g", "y_g", "mass", "inertia_z")
"""What says together whether a hull can be."""
_FARTHEST = 1e4
"""Half-widths from which it does not matter any more how far away a value is."""


def widen_delays(intervals: Mapping[str, Interval], pool: Sequence[Candidate]) -> dict[str, Interval]:
    """Intervals with that of a delay as wide as the log's own stamps leave it: by so much its commands may be off."""
    result = dict(intervals)
    for timing in (c for c in pool if c.kind is Kind.SENSOR):
        (reach,) = (p.upper for p in timing.parameters)
        for other in (c for c in pool if c.key in timing.part_of):
            limits = {p.symbol: (p.lower, p.upper) for p in other.parameters if p.symbol in result}
            for symbol, (low, high) in limits.items():
                lower, upper = result[symbol]
                result[symbol] = Interval(max(lower - reach, low), min(upper + reach, high))
    return result


def at_limits(
    pool: Sequence[Candidate],
    nominal: Vehicle,
    estimate: Vehicle,
    claimed: Sequence[str],
    intervals: Mapping[str, Interval],
) -> dict[str, str]:
    """Effects whose numbers are a limit's and not the log's, by key, and why, as the end of a sentence.

    They stand at a limit, outside their own interval, make a hull that cannot be, or are one freedom too many.

    Parameters
    ----------
    estimate : what the log asks for, under the limits of single parameters
    claimed : keys of the effects in question
    intervals : 95 % intervals of total values by symbol
    """
    together = redundant_scales(nominal, claimed)
    no_hull = why_no_hull(nominal, estimate)
    result = {}
    for candidate in (c for c in pool if c.key in claimed and c.kind is Kind.EFFECT):
        why = "; ".join(
            filter(None, (_of(candidate, symbol, nominal, estimate, intervals) for symbol in candidate.symbols))
        )
        if set(_RIGID_BODY) & set(candidate.symbols):
            why = no_hull or why
        if candidate.key in together:
            why = _TOGETHER
        if why:
            result[candidate.key] = why
    return result


def why_no_hull(nominal: Vehicle, estimate: Vehicle) -> str:
    """Why no hull has the mass, inertia and centre of gravity of an estimate; empty where one can, or the file errs."""
    before, after = (find_impossible(vehicle.values, vehicle.thrusters) for vehicle in (nominal, estimate))
    return "; ".join(after[key] for key in _RIGID_BODY if key in after and key not in before)


def null_distance(candidate: Candidate, nominal: Vehicle, intervals: Mapping[str, Interval]) -> float | None:
    """Distance of the file's value from the middle of an interval, in half-widths; None for an effect without any.

    More than 1 is outside. Of an effect of several numbers the one that is farthest out counts.

    Parameters
    ----------
    candidate : the effect
    nominal : the vehicle with the file's values
    intervals : 95 % intervals of total values, by symbol
    """
    sizes = [p.symbol for p in candidate.parameters if not p.grid] or candidate.symbols
    known = [(intervals[symbol], nominal.value(symbol)) for symbol in sizes if symbol in intervals]
    return max((_halves(interval, value) for interval, value in known), default=None)


def _halves(interval: Interval, value: float) -> float:
    """Distance of a value from the end of an interval on its side, in half-widths, counted from the middle."""
    half = max(0.5 * (interval.upper - interval.lower), 1e-12)
    return min(abs(value - 0.5 * (interval.lower + interval.upper)) / half, _FARTHEST)


def _of(
    candidate: Candidate, symbol: str, nominal: Vehicle, estimate: Vehicle, intervals: Mapping[str, Interval]
) -> str:
    parameter = next(p for p in candidate.parameters if p.symbol == symbol)
    value = estimate.value(symbol)
    limit = limit_reached(parameter, value, nominal.value(symbol))
    if limit is not None:
        return f"{symbol} stands at its physical limit, {limit:g} in all: its size is the limit's, not the log's"
    interval = intervals.get(symbol)
    if interval is not None:
        slack = _SLACK * (interval.upper - interval.lower) + 1e-6 * abs(value)
        if not interval.lower - slack <= value <= interval.upper + slack:
            return (
                f"the estimate of {symbol} lies outside its own interval, so that the blocks of the log disagree on it"
            )
    return ""


_FAR = 1e3
"""Size from which it does not matter any more how large a doubt is."""
_OF_ONE_LOG = ("substitute", "unexplained", "accused", "out_of_step", "rolls")
"""Sizes that are of one log."""
_LEFT = (
    "the model leaves {:.0f} % of the force that the file's leaves, and {:.0f} % of the error of rollouts without it"
)

_COMPANIONS = "companions"
_LEAST = 1e-3
"""Share of an error that is not told from none: from 0.0003 to 0.003 the log score of unseen causes differs by 0.0005
(`benchmarks/odds.py`)."""
_CLEAR = 3.0
"""E-folds of half-widths of its interval by which a name is so far from the file's value that it raises no doubt about
others: from 2 to 4 the log score of unseen causes differs by 0.004 (`benchmarks/odds.py`), without them by 0.009."""
_ACCUSED = "the log's own sensors err ({}), and it may stand in for what that leaves"
Told = Mapping[str, str]
"""By key of an effect, what a test tells of it, as the end of a sentence."""


@dataclass(frozen=True, slots=True, eq=False)
class Tests:
    """Results of the tests of a discovery, by key of an effect; what a test does not concern is not there.

    Attributes
    ----------
    limits : whose numbers are a limit's
    invariant : its size in the parts of the log
    changes : where, and by how much of itself, its force differs in a part of the log, as a sentence
    forms : forces without a name beside it and in its place
    out_of_step : misalignment of the log's channels, certain or only possible, a doubt on names that it looks like
    accused : what share of it an error of the sensors may have made that is told and not corrected for, and which
    rolls : whether rollouts judge
    several : whether they judge several logs, each of which was left out once: what is named there holds in all others,
        and the force balance of coloured noise, clocks and headings of one log are no witness against that
    """

    limits: Told = field(default_factory=dict)
    invariant: Mapping[str, Invariance] = field(default_factory=dict)
    changes: Told = field(default_factory=dict)
    forms: UnmodelledForces = field(default_factory=UnmodelledForces)
    accused: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    out_of_step: Misalignment = field(default_factory=Misalignment)
    rolls: bool = False
    several: bool = False

    def explanations(self, e: Evidence) -> dict[Reason, str]:
        """Sentence of each test on a name, of those that say more than their own reason."""
        beside = self.forms.refits.get(e.key)
        listed = {
            Reason.AT_LIMIT: self.limits.get(e.key, "the log asks for more of it than physics allows"),
            Reason.SENSORS: _ACCUSED.format(self.accused.get(e.key, (0.0, "a sensor"))[1]),
            Reason.LASTING_REST: _LEFT.format(100.0 * e.unexplained, 100.0 * e.remains),
            Reason.SUBSTITUTE: (beside or FreeFormRefit()).sentence,
            Reason.OUT_OF_STEP: f"{self.out_of_step.seconds:.2g}",
            Reason.LOOK_ALIKES: ", ".join(map(words, e.indistinguishable_from or (e.rival,))),
        }
        return {reason: text for reason, text in listed.items() if text}

    def sizes(self, e: Evidence, *, timed: bool) -> dict[str, float]:
        """The size of each test of a name, relative to the claim; see `judgement.features`.

        Parameters
        ----------
        e : the evidence on the name
        timed : whether channels out of step look like it, see `Effect.timed`
        """
        beside = self.forms.refits.get(e.key)
        sizes = {
            "substitute": beside.margin if beside and beside.margin is not None else 0.0,
            "at_limit": float(e.at_limit or e.key in self.limits),
            "out_of_step": self.out_of_step.share if timed else 0.0,
            "accused": self.accused.get(e.key, (0.0, ""))[0],
            "unexplained": e.unexplained,
            "remains": e.remains,
            "rolls": float(self.rolls),
            "look_alikes": float(len(e.indistinguishable_from)),
        }
        if self.several:
            sizes = {name: size for name, size in sizes.items() if name not in _OF_ONE_LOG}
        rounded = {name: round(float(np.clip(np.nan_to_num(size), -_FAR, _FAR)), 6) for name, size in sizes.items()}
        return {name: size for name, size in rounded.items() if size}


def gather_claims(
    evidence: Sequence[Evidence],
    pool: Sequence[Candidate],
    nominal: Vehicle,
    intervals: Mapping[str, Interval],
    tests: Tests,
    kept: Sequence[str],
    narrow: Mapping[str, Interval] | None = None,
) -> dict[str, Claim]:
    """The claim of each name that a search selected or that stands in the model, by key.

    Parameters
    ----------
    evidence : on the candidates; only those that were selected, or stand in the model, are claims
    intervals : 95 % intervals of total values by symbol, widened
    kept : keys of the effects that stand in the model
    narrow : the same intervals without what is left unexplained, which is a size of its own and would count twice, and
        without effects that were left out as immaterial; as `intervals` where they are not known
    """
    own = intervals if narrow is None else narrow
    known = {candidate.key: candidate for candidate in pool}
    result = {}
    for e in (e for e in evidence if (e.selected or e.key in kept) and e.kind is Kind.EFFECT):
        clear, alone = (null_distance(known[e.key], nominal, some) for some in (intervals, own))
        near = {"file_value": 1.0 if alone is None else round(1.0 / max(alone, 1e-6), 6)}
        result[e.key] = Claim(
            gain=e.log_likelihood_gain,
            identity=e.identity,
            rival=e.rival,
            worth=Worth(force=float(np.clip(e.worth, 0.0, 1.0)), rollout=e.rollout_worth),
            null_excluded=clear is not None and clear > 1.0,
            stands=e.key in kept,
            tests=tests.sizes(e, timed=known[e.key].effect.timed) | near,
        )
    return dict(zip(result, with_companions(list(result.values())), strict=True))


def with_companions(claims: Sequence[Claim]) -> list[Claim]:
    """The claims of one model, each with the doubt that the others raise, at a limit or near the file's value.

    Other names that remove a trifle of what this one removes are no crowd: each counts by its share of that trifle.
    """
    return [_with_companions(claim, [other for other in claims if other is not claim]) for claim in claims]


def _with_companions(claim: Claim, others: Sequence[Claim]) -> Claim:
    total = 0.0
    for other in others:
        near = 1.0 if other.tests.get("at_limit") else other.tests.get("file_value", 1.0)
        counts = min(_removes(other) / (TRIFLE * _removes(claim)), 1.0)
        total += counts * float(np.clip(_CLEAR + np.log(near), 0.0, _CLEAR))
    tests = {name: size for name, size in claim.tests.items() if name != _COMPANIONS}
    return claim.but(tests=tests | ({_COMPANIONS: round(total, 6)} if total else {}))


def _removes(claim: Claim) -> float:
    """Share of the error that a name removes: of rollouts where they were asked, else of forces; `_LEAST` at least."""
    worth = claim.worth
    return max(worth.force if worth.rollout is None else worth.rollout, _LEAST)


def widen_intervals(
    intervals: Mapping[str, Interval],
    pool: Sequence[Candidate],
    nominal: Vehicle,
    tests: Tests,
    apart: Sequence[Vehicle],
    left: Mapping[str, float] = MappingProxyType({}),
    biased: Mapping[str, Array] = MappingProxyType({}),
    filed: Mapping[str, FileError] = MappingProxyType({}),
) -> dict[str, Interval]:
    """Intervals that carry what is left unexplained and the scatter of a number over parts and folds of the log.

    Half of what a number differs by between two parts beyond its error, what the jackknife over folds says beyond the
    interval, and what it would change by were all that is left along its own column, are added in squares. Beside
    forces without a name, or an effect that was left out as immaterial, it is another number: to that side, and to no
    other, it reaches as far (extreme bounds span the estimates of all models; Leamer 1985).

    Parameters
    ----------
    intervals : 95 % intervals of total values by symbol
    apart : the model without each fold; one without the number says nothing of its size
    left : by key, force that stays unexplained where an effect acts, as a multiple of its own
    biased : by symbol, how far it would lie down and up (2,) beside what was left out, see `omitted_variable_bias`
    filed : by symbol, what the file's other numbers may make of it, see `file_errors`; it reaches as far
    """
    forms: dict[str, float] = {}
    parts: dict[str, float] = {}
    along: dict[str, float] = {}
    limits = {p.symbol: (p.lower, p.upper) for candidate in pool for p in candidate.parameters}
    for candidate in pool:
        beside = tests.forms.refits.get(candidate.key)
        same = tests.invariant.get(candidate.key)
        for symbol in candidate.symbols:
            forms[symbol] = max(forms.get(symbol, 0.0), beside.by.get(symbol, 0.0) if beside else 0.0, key=abs)
            parts[symbol] = max(parts.get(symbol, 0.0), same.scatter.get(symbol, 0.0) if same else 0.0)
            along[symbol] = max(along.get(symbol, 0.0), left.get(candidate.key, 0.0))
    result = {}
    for symbol, (lower, upper) in intervals.items():
        middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
        values = [vehicle.value(symbol) for vehicle in apart]
        wide = max(half, _jackknife([value for value in values if value != nominal.value(symbol)]))
        wide = np.linalg.norm([wide, parts.get(symbol, 0.0), along.get(symbol, 0.0) * (middle - nominal.value(symbol))])
        reach = np.maximum(biased.get(symbol, np.zeros(2)), [-forms.get(symbol, 0.0), forms.get(symbol, 0.0)])
        shift, deviation = filed.get(symbol, (0.0, 0.0))
        beside = np.hypot(wide, CI * deviation) + np.array([-shift, shift])
        down, up = np.maximum(np.hypot(wide, np.maximum(reach, 0.0)), beside).tolist()
        least, most = limits.get(symbol, (-np.inf, np.inf))
        result[symbol] = Interval(max(middle - down, min(least, lower)), min(middle + up, max(most, upper)))
    return result


def _jackknife(values: Sequence[float]) -> float:
    """Half of the 95 % interval that estimates without each of a few parts tell (Efron and Tibshirani 1993, 11.5)."""
    if len(values) < 3:
        return 0.0
    n = len(values)
    return float(CI * np.sqrt((n - 1) / n * np.sum(np.square(np.asarray(values) - np.mean(values)))))
