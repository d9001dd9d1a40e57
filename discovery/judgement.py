"""Judgement: from the facts of a claim to the probability that its name is true, and to its verdict.

A logistic model takes a claim's gain, identity, worth, distance from the file's own value, and the sizes of the tests
that `Reason` lists: one of names that the force balance judges, one of those that rollouts do. Both are fitted to
worlds of many simulators, with causes inside and outside the catalogue, drawn towards each other, and calibrated last
(`benchmarks/odds.py`), so the probability is that of worlds like those. A doubt lowers it by its size; no test takes an
answer back.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from math import asinh, exp, log, sqrt
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .effect_findings import LIKELY, MISSING, Claim, Reason, Verdict
from .search.scoring import SLIGHT, TELL_APART

SHARE = "share"
"""What is left of the probability of a name that has look-alikes, see `share`: it multiplies the odds of the rest."""
SUPPORT = ("gain", "identity", "worth", "rollout_worth", "clear", "unlike")
"""Features that speak for a name; all others are doubts, nothing where there is none."""
REASONS = {
    "identity": Reason.LOOK_ALIKES,
    "clear": Reason.FILE_VALUE,
    "gain": Reason.WEAK,
    "worth": Reason.WEAK,
    "rollout_worth": Reason.WEAK,
    "unlike": Reason.WEAK,
    "substitute": Reason.SUBSTITUTE,
    "at_limit": Reason.AT_LIMIT,
    "out_of_step": Reason.OUT_OF_STEP,
    "companions": Reason.WEAK,
    "accused": Reason.SENSORS,
    "unexplained": Reason.LASTING_REST,
    "remains": Reason.LASTING_REST,
}
"""The doubt that each feature is."""
_PLENTY = {"gain": 5.0, "identity": 0.88, "worth": 0.0, "rollout_worth": 0.0, "clear": 2.0, "unlike": 5.0}
"""What each feature that speaks for a name is where nothing is to be wished for: what is less is a doubt."""
_LEAST_CHANCE = 1e-9
"""Nearest to none and to all that a probability is before its logarithm is taken: odds are told in whole per cent."""


@dataclass(frozen=True, slots=True)
class Logistic:
    """A logistic model: an intercept, and a weight for each feature."""

    intercept: float
    weights: Mapping[str, float]

    def alone(self, feature: Mapping[str, float]) -> float:
        """The probability of a name with these features and of its look-alikes together."""
        total = self.intercept + sum(weight * feature[name] for name, weight in self.weights.items())
        return 1.0 / (1.0 + exp(-max(min(total, 30.0), -30.0)))

    def probability(self, feature: Mapping[str, float]) -> float:
        """The probability that a name with these features is true, before it is calibrated."""
        return feature.get(SHARE, 1.0) * self.alone(feature)

    def largest_doubt(self, feature: Mapping[str, float]) -> Reason:
        """The doubt that lowers the odds most."""
        costs = {name: weight * (_PLENTY.get(name, 0.0) - feature[name]) for name, weight in self.weights.items()}
        by_reason: dict[Reason, float] = {}
        if feature.get(SHARE, 1.0) < 1.0:
            left, alone = self.probability(feature), self.alone(feature)
            costs["identity"] = costs.get("identity", 0.0) + log(alone / (1.0 - alone) * (1.0 - left) / left)
        for name, cost in costs.items():
            by_reason[REASONS[name]] = by_reason.get(REASONS[name], 0.0) + cost
        return max(by_reason, key=lambda reason: by_reason[reason], default=Reason.WEAK)


@dataclass(frozen=True, slots=True)
class Odds:
    """The odds of names that the force balance judges, and of those that rollouts do.

    `calibration` maps what the models say of causes that they have not seen to how often that is true (`calibrated`).
    `unselected` is how often a name that no search selected was true all the same, `nearly` how often one that would
    earn its price in half of the resamples, and `sensors` how often an error of a sensor that is told was there, by the
    word for it.
    """

    forces: Logistic
    rollouts: Logistic
    unselected: float
    nearly: float
    sensors: Mapping[str, float]
    calibration: tuple[float, float, float] = (0.0, 1.0, 1.0)

    @classmethod
    def read(cls, path: Path) -> "Odds":
        """The odds of a file, as `benchmarks/odds.py` writes it."""
        content = json.loads(path.read_text(encoding="utf-8"))
        judges = {judge: Logistic(**content.pop(judge)) for judge in ("forces", "rollouts")}
        rates = {name: content[name] for name in ("unselected", "nearly", "sensors")}
        return cls(**judges, **rates, calibration=tuple(content["calibration"]))

    def of(self, claim: Claim) -> Logistic:
        """The model for a claim, by what judged it."""
        return self.rollouts if claim.tests.get("rolls") else self.forces

    def probability(self, claim: Claim) -> float:
        """The probability that the name of a claim is true."""
        feature = features(claim)
        return feature[SHARE] * float(calibrated(self.of(claim).alone(feature), self.calibration))


def calibrated(chance: ArrayLike, calibration: Sequence[float]) -> NDArray[np.float64]:
    """Probabilities that are as often true as they say: beta calibration.

    1 / (1 + (1 - p)^b / (e^c p^a)), where a logistic model has tails of one shape on both sides (Kull, Silva Filho and
    Flach, 2017, Beta calibration, AISTATS).

    Parameters
    ----------
    chance : probabilities p, of any shape
    calibration : c, a and b: the shift, and the slopes of what is unlikely and of what is likely; 0, 1, 1 changes none
    """
    chance = np.clip(chance, _LEAST_CHANCE, 1.0 - _LEAST_CHANCE)
    shift, low, high = calibration
    return 1.0 / (1.0 + np.exp(high * np.log1p(-chance) - low * np.log(chance) - shift))


@cache
def odds() -> Odds:
    """The model that `benchmarks/odds.py` fitted."""
    return Odds.read(Path(__file__).parent / "odds.json")


def features(claim: Claim) -> dict[str, float]:
    """Features of the odds by name: the four numbers and the sizes of the tests, on scales of like size."""
    size = claim.tests
    clear = -log(max(size.get("file_value", 1.0), 1e-3))
    rollout = claim.worth.rollout
    return {
        "gain": log(1.0 + max(claim.gain, 0.0)),
        "identity": asinh(min(claim.identity / TELL_APART, 1.0)),
        "worth": log(max(claim.worth.force, SLIGHT)),
        "rollout_worth": log(max(claim.worth.force if rollout is None else rollout, SLIGHT)),
        "clear": clear,
        "unlike": 0.0 if size.get("rolls") else _unlike(size.get("substitute")),
        "substitute": max(min(size.get("substitute", 0.0) / max(claim.gain, 1.0), 1.0), -1.0),
        "at_limit": size.get("at_limit", 0.0),
        "out_of_step": size.get("out_of_step", 0.0),
        "companions": log(1.0 + size.get("companions", 0.0)),
        "remains": size.get("remains", 0.0),
        "accused": size.get("accused", 0.0),
        "unexplained": log(1.0 + 10.0 * _unexplained(claim)),
        SHARE: share(claim),
    }


def _unlike(margin: float | None) -> float:
    """How little one free force does in the place of a name, on a log scale; plenty where that was not asked."""
    return _PLENTY["unlike"] if margin is None else log(1.0 + max(-margin, 0.0))


def _unexplained(claim: Claim) -> float:
    """Force that the model leaves beyond noise, as a multiple of what the name explains."""
    return claim.tests.get("unexplained", 0.0) / sqrt(max(claim.worth.force, 1e-12))


def share(claim: Claim) -> float:
    """The part of its probability that a name has beside its best look-alike: half where both do as well, all without.

    By the log-likelihood between them, tempered: one model is told from another by 5 of it.
    """
    if not claim.tests.get("look_alikes"):
        return 1.0
    return 1.0 / (1.0 + exp(-max(min(claim.identity, 200.0), 0.0) / TELL_APART))


def probability(claim: Claim) -> float:
    """The probability that a name is true: of worlds like those of the studies."""
    return odds().probability(claim)


def verdict(claim: Claim, chance: float) -> Verdict:
    """The word for a claim: what the file's own value could be is neither missing nor likely."""
    if not claim.null_excluded:
        return "possible"
    return "missing" if chance >= MISSING else "likely" if chance >= LIKELY else "possible"


def largest_doubt(claim: Claim) -> Reason:
    """The doubt that lowers the odds of a name most."""
    return odds().of(claim).largest_doubt(features(claim)) if claim.null_excluded else Reason.FILE_VALUE
