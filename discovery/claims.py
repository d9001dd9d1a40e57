"""Claims: the facts of each name that stands in a model, gathered once, none of them a verdict.

What is left unexplained and how much a number changes between parts of the log widen its interval; each test gives its
size, relative to the claim, and what is told of it. `judgement` makes a probability of them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..physics.in_words import words
from ..physics.vehicle import Vehicle
from .candidates.candidate import Candidate, Kind
from .evidence.invariance import Invariance
from .evidence.limits import clearance
from .evidence.other_forms import OtherForms
from .evidence.weighing import Evidence
from .fold_findings import Folds
from .found_effects import Claim, Worth
from .reason import Reason
from .search.bootstrap import Interval

_FAR = 1e3
"""Size from which it does not matter any more how large a doubt is."""
_OF_ONE_LOG = (
    *("substitute", "substituted", "other_form", "lasting_rest", "left", "unexplained", "forms", "structure", "uneven"),
    *("accused", "record", "rolls"),
)
"""Sizes that are of one log."""
Told = Mapping[str, str]
"""By key of an effect, what a test tells of it, as the end of a sentence."""


@dataclass(frozen=True, slots=True, eq=False)
class Tests:
    """What the tests of a discovery found, by key of an effect; what a test does not concern is not there.

    Attributes
    ----------
    limits : whose numbers are a limit's
    record, sensors : what the record of the commands, or an error of the sensors, may explain in its place
    elsewhere : what acts on other axes than its own
    unjudged : rivals that could not be judged
    changes : share of itself by which a force differs in a part of the log, and where
    rests : force left where it acts, as a share of that at work, and in words
    invariant : its size in the parts of the log
    forms : forces without a name beside it and in its place
    folds : in how many folds it came out
    untold : names that join the model without being told from nothing
    names, terms : how many stand in the model
    accused : how many errors of sensors or of the record are told
    structure : whether the model leaves force beyond sensor noise, or predictions beyond theirs
    rolls : whether rollouts judge
    several : whether they judge several logs, each of which was left out once: what is named there holds in all others,
        and the force balance of coloured noise, clocks and headings of one log are no witness against that
    """

    limits: Told = field(default_factory=dict)
    record: Told = field(default_factory=dict)
    sensors: Told = field(default_factory=dict)
    elsewhere: Told = field(default_factory=dict)
    unjudged: Told = field(default_factory=dict)
    changes: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    rests: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    invariant: Mapping[str, Invariance] = field(default_factory=dict)
    forms: OtherForms = field(default_factory=OtherForms)
    folds: Folds | None = None
    untold: Sequence[str] = ()
    names: int = 1
    terms: int = 0
    accused: int = 0
    structure: bool = False
    rolls: bool = False
    several: bool = False

    def told(self, e: Evidence) -> dict[Reason, str]:
        """What each test tells of a name, of those that say more than their own sentence."""
        beside = self.forms.beside.get(e.key)
        same = self.invariant.get(e.key)
        listed = {
            Reason.AT_LIMIT: self.limits.get(e.key, "the log asks for more of it than physics allows"),
            Reason.RECORD: self.record.get(e.key, ""),
            Reason.SENSORS: self.sensors.get(e.key, ""),
            Reason.ELSEWHERE: self.elsewhere.get(e.key, ""),
            Reason.UNJUDGED_RIVAL: self.unjudged.get(e.key, ""),
            Reason.UNEVEN: self._uneven(e.key)[1] or (same.differs if same else ""),
            Reason.LASTING_REST: self.rests.get(e.key, (0.0, "more than sensor noise is left"))[1],
            Reason.OTHER_FORM: beside.told if beside else "",
            Reason.SUBSTITUTE: beside.told if beside and beside.told else "one free force explains this log as well",
            Reason.FOLDS: self.folds.in_few(e.key) if self.folds else "",
            Reason.CROWD: f"{self.names} names" + (f" and {self.terms} terms without one" if self.terms else ""),
            Reason.CHANCE: f"{e.chance.better} of {e.chance.of}" if e.chance else "",
            Reason.OUT_OF_STEP: f"{e.out_of_step:.2f}",
            Reason.LOOK_ALIKES: ", ".join(map(words, e.indistinguishable_from or (e.rival,))),
        }
        return {reason: text for reason, text in listed.items() if text}

    def sizes(self, e: Evidence) -> dict[str, float]:
        """The size of each test of a name, relative to the claim; see `judgement.features`."""
        beside = self.forms.beside.get(e.key)
        own = max(float(e.share.max()), 1e-3)
        sizes = {
            "substitute": beside.margin if beside and beside.margin is not None else 0.0,
            "substituted": float(beside.does) if beside else 0.0,
            "other_form": beside.change if beside else 0.0,
            "at_limit": float(e.at_limit or e.key in self.limits),
            "record": float(e.key in self.record),
            "sensors": float(e.key in self.sensors),
            "out_of_step": e.late,
            "uneven": self._uneven(e.key)[0],
            "lasting_rest": self.rests.get(e.key, (0.0, ""))[0] / own,
            "left": e.left,
            "unjudged_rival": float(e.key in self.unjudged),
            "elsewhere": float(e.key in self.elsewhere),
            "rollouts_object": float(e.rollouts_object),
            "chance": float(e.chance.better) if e.chance else 0.0,
            "folds": self.folds.missed(e.key) if self.folds and e.key in self.folds.named else 0.0,
            "weak": 1.0 - e.confidence,
            "crowd": float(self.names - 1),
            "terms": float(self.terms),
            "forms": float(len(self.forms.found)),
            "accused": float(self.accused),
            "structure": float(self.structure),
            "unexplained": e.unexplained,
            "untold": float(e.key in self.untold),
            "rolls": float(self.rolls),
            "look_alikes": float(len(e.indistinguishable_from)),
        }
        if self.several:
            sizes = {name: size for name, size in sizes.items() if name not in _OF_ONE_LOG}
        rounded = {name: round(float(np.clip(np.nan_to_num(size), -_FAR, _FAR)), 6) for name, size in sizes.items()}
        return {name: size for name, size in rounded.items() if size}

    def _uneven(self, key: str) -> tuple[float, str]:
        """By how much an effect's size differs between parts of the log, and how that is told."""
        same = self.invariant.get(key)
        return max(self.changes.get(key, (0.0, "")), (same.gap, same.differs) if same else (0.0, ""))


def claims(
    evidence: Sequence[Evidence],
    pool: Sequence[Candidate],
    nominal: Vehicle,
    intervals: Mapping[str, Interval],
    tests: Tests,
    kept: Sequence[str],
) -> dict[str, Claim]:
    """The claim of each name that a search selected, by key.

    Parameters
    ----------
    evidence : on the candidates; only those that were selected, or join the model untold, are claims
    intervals : 95 % intervals of total values by symbol, widened
    kept : keys of the effects that stand in the model
    """
    known = {candidate.key: candidate for candidate in pool}
    found = {}
    for e in (e for e in evidence if (e.selected or e.key in tests.untold) and e.kind is Kind.EFFECT):
        clear = clearance(known[e.key], nominal, intervals)
        sizes = tests.sizes(e) | {"file_value": 1.0 if clear is None else round(1.0 / max(clear, 1e-6), 6)}
        found[e.key] = Claim(
            gain=e.gain,
            identity=e.identity,
            rival=e.rival,
            worth=Worth(force=float(np.clip(e.worth, 0.0, 1.0)), rollout=e.rollout_worth),
            null_excluded=clear is not None and clear > 1.0,
            stands=e.key in kept,
            tests=sizes,
        )
    return found


def widened(
    intervals: Mapping[str, Interval],
    pool: Sequence[Candidate],
    nominal: Vehicle,
    tests: Tests,
    apart: Sequence[Vehicle],
) -> dict[str, Interval]:
    """Intervals that carry what is left unexplained and the scatter of a number over parts and folds of the log.

    What a number changes by beside forces without a name, half of what it differs by between two parts beyond its
    error, and what the jackknife over folds says beyond the interval are added in squares.

    Parameters
    ----------
    intervals : 95 % intervals of total values by symbol
    apart : the model without each fold; one without the number says nothing of its size
    """
    extra: dict[str, float] = {}
    limits = {p.symbol: (p.lower, p.upper) for candidate in pool for p in candidate.parameters}
    for candidate in pool:
        beside = tests.forms.beside.get(candidate.key)
        same = tests.invariant.get(candidate.key)
        for symbol in candidate.symbols:
            form = abs(beside.by.get(symbol, 0.0)) if beside else 0.0
            parts = same.scatter.get(symbol, 0.0) if same else 0.0
            extra[symbol] = max(extra.get(symbol, 0.0), float(np.hypot(form, parts)))
    found = {}
    for symbol, (lower, upper) in intervals.items():
        middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
        values = [vehicle.value(symbol) for vehicle in apart]
        wide = max(half, _jackknife([value for value in values if value != nominal.value(symbol)]))
        wide = float(np.hypot(wide, extra.get(symbol, 0.0)))
        least, most = limits.get(symbol, (-np.inf, np.inf))
        found[symbol] = Interval(max(middle - wide, min(least, lower)), min(middle + wide, max(most, upper)))
    return found


_TWO_SIDED = 1.96
"""Standard errors of a 95 % interval."""


def _jackknife(values: Sequence[float]) -> float:
    """Half of the 95 % interval that estimates without each of a few parts tell (Efron and Tibshirani 1993, 11.5)."""
    if len(values) < 3:
        return 0.0
    n = len(values)
    return float(_TWO_SIDED * np.sqrt((n - 1) / n * np.sum(np.square(np.asarray(values) - np.mean(values)))))
