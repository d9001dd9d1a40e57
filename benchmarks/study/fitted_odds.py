"""A logistic model of the facts of claims: bounded, cross-validated over causes, and no larger than it has to be.

What speaks for a name may only raise its odds and a doubt only lower them (`judgement.SUPPORT`), so that no weight is a
clever correction of another. Each judge has weights of its own, drawn towards those of all names (partial pooling:
Gelman and Hill 2007, chapter 12): rollouts judge a fifth of the names, and of some doubts they have met none or six.
Whole causes are left out in turn: a cause is never in both halves. What the models say of causes that they have not
seen is calibrated last.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from undertow.discovery.evidence.weighing import CERTAINLY
from undertow.discovery.judgement import SHARE, SUPPORT, calibrated, features

from .records import Record
from .scoring import bare, claims_of, kind_of_world, log_score

Array = NDArray[np.float64]
PRICES = tuple((common, own) for common in (1e-3, 3e-3, 1e-2) for own in (1e-2, 3e-2, 0.1, 0.3))
"""Prices of a squared weight, of features in units of their deviation, and of a squared difference between a judge's
weight and that of all names; cross-validation takes one pair. Ten times the first, or a third of the second, change
its log score by less than 0.001."""
FOLDS = 5
FEATURES = (
    *("rollout_worth", "clear", "unlike", "substitute", "at_limit", "out_of_step"),
    *("unexplained", "remains", "accused", "companions"),
)
"""What the odds are made of: of all features those that stop more than they cost (`ablation.py`). Taken one by one for
what each adds to the log score they change with every hundred names, and leave out what few tuning worlds have."""
LIMITS = {
    "gain": CERTAINLY,
    "identity": 3.0,
    "worth": 0.02,
    "rollout_worth": 0.02,
    "file_value": 1.0,
    "substitute": 0.0,
    "companions": 6.0,
}
"""Limits at which a test alone would stop a name: gain and identity below (log-likelihood; identity e^3 to one), worth
below, a size above (companions: two that are not clear at all); of a test that is not here, half of its whole."""
JUDGES = ("forces", "rollouts")
_HALF = 0.5
_CLOSE = 1e-7
"""Share of the loss by which a last step lowers it: far less than any feature earns."""


@dataclass(frozen=True, slots=True, eq=False)
class Names:
    """Names that stand in models, and what is known of them.

    Attributes
    ----------
    claims, records : of each name
    features : (names, features)
    columns : names of the features
    true : (names,) whether it is true, in part at least
    cause : of each log, by which names are left out together
    world : kind of world
    """

    claims: Sequence[Record]
    records: Sequence[Record]
    features: Array
    columns: tuple[str, ...]
    true: NDArray[np.bool_]
    cause: Sequence[str]
    world: NDArray[np.str_]

    def column(self, names: Sequence[str]) -> Array:
        """Some of the features (names, some)."""
        return self.features[:, [self.columns.index(name) for name in names]]

    def some(self, which: NDArray[np.bool_]) -> "Names":
        """Those of a mask (names,)."""
        at = np.flatnonzero(which).tolist()
        return Names(
            [self.claims[k] for k in at],
            [self.records[k] for k in at],
            self.features[at],
            self.columns,
            self.true[at],
            [self.cause[k] for k in at],
            self.world[at],
        )

    @property
    def judge(self) -> NDArray[np.str_]:
        """What judged each, of `JUDGES`."""
        return np.array([JUDGES[bool(c["claim"]["tests"].get("rolls"))] for c in self.claims])

    @property
    def share(self) -> Array:
        """What is left of the probability of each beside its look-alikes."""
        return self.column([SHARE])[:, 0]

    @property
    def could_be_missing(self) -> NDArray[np.bool_]:
        """Names that high odds would call missing: they stand in the model, and exclude the file's own value."""
        return np.array([c["kept"] and c["claim"]["null_excluded"] for c in self.claims], dtype=bool)


def names_of(records: Sequence[Record]) -> Names:
    """Every claim of some records."""
    pairs = [(claim, record) for record in records for claim in record.get("claims", ())]
    facts = [features(claim) for record in records for claim in claims_of(record)]
    columns = tuple(facts[0]) if facts else ()
    return Names(
        [claim for claim, _ in pairs],
        [record for _, record in pairs],
        np.array([[fact[name] for name in columns] for fact in facts]),
        columns,
        np.array([claim["label"] != "false" for claim, _ in pairs], dtype=bool),
        [cause_of(record) for _, record in pairs],
        np.array([kind_of_world(record) for _, record in pairs]),
    )


def cause_of(record: Record) -> str:
    """The cause of a log: its kind where that is one, else what is hidden, the first of several, or nothing."""
    if record["nameless"] or record["sensors_true"] or record["study"] in ("foreign", "others"):
        return record["kind"].removeprefix("a ")
    return bare(record["true"][0]) if record["true"] else f"nothing, {record['kind']}"


def folds_of(cause: Sequence[str], folds: int = FOLDS) -> NDArray[np.int_]:
    """The fold of each name: causes are dealt out, the largest first, to the smallest fold."""
    sizes, of = np.zeros(folds), {}
    for name, count in sorted(Counter(cause).items(), key=lambda item: (-item[1], item[0])):
        of[name] = int(np.argmin(sizes))
        sizes[of[name]] += count
    return np.array([of[name] for name in cause], dtype=int)


def fit(
    columns: Sequence[str],
    features: Array,
    true: NDArray[np.bool_],
    price: float,
    share: Array | float = 1.0,
    *,
    scale: Array | None = None,
    prior: Array | None = None,
) -> Array:
    """Intercept and weights (1 + features,) of least mean log loss, a price on squared weights, signs bounded.

    Parameters
    ----------
    share : what is left of each probability beside look-alikes
    scale : (features,) units of the features; their deviations where they are not given
    prior : (features,) weights from which each squared difference has the price; zero where they are not given
    """
    scale = _deviations(features) if scale is None else scale
    near, middle = np.zeros(len(columns)) if prior is None else prior * scale, features.mean(axis=0)
    design = np.column_stack([np.ones(len(true)), (features - middle) / scale])

    def loss(weights: Array) -> tuple[float, Array]:
        total = design @ weights
        whole = 1.0 / (1.0 + np.exp(np.clip(-total, -500.0, 500.0)))
        left = np.maximum(1.0 - share * whole, 1e-300)
        slope = np.where(true, whole - 1.0, share * whole * (1.0 - whole) / left) / len(true)
        lost = np.where(true, np.logaddexp(0.0, -total) - np.log(share), -np.log(left))
        off = np.concatenate([[0.0], weights[1:] - near])
        return float(lost.mean() + 0.5 * price * off @ off), design.T @ slope + price * off

    bounds = [(None, None), *((0.0, None) if name in SUPPORT else (None, 0.0) for name in columns)]
    found = minimize(loss, np.append(0.0, near), jac=True, method="L-BFGS-B", bounds=bounds, options={"ftol": _CLOSE}).x
    weights = found[1:] / scale
    return np.concatenate([[found[0] - weights @ middle], weights])


def _deviations(features: Array) -> Array:
    """Standard deviation of each feature (features,), one where it is the same of all names."""
    scale = features.std(axis=0)
    return np.where(scale > 1e-12, scale, 1.0)


def applied(weights: Array, features: Array, share: Array | float = 1.0) -> Array:
    """Probabilities of names with these features."""
    return share / (1.0 + np.exp(-np.clip(weights[0] + features @ weights[1:], -30.0, 30.0)))


def fit_judges(names: Names, columns: Sequence[str], price: tuple[float, float]) -> dict[str, Array]:
    """Intercept and weights (1 + features,) of each judge; those of all names where it has judged none.

    Parameters
    ----------
    price : of squared weights of all names, and of squared differences of a judge's from these
    """
    features, judge = names.column(columns), names.judge
    scale = _deviations(features)
    common = fit(columns, features, names.true, price[0], names.share, scale=scale)
    result = {}
    for word in JUDGES:
        own = judge == word
        given = (features[own], names.true[own], price[1], names.share[own])
        result[word] = fit(columns, *given, scale=scale, prior=common[1:]) if own.any() else common
    return result


def probabilities(models: Mapping[str, Array], names: Names, columns: Sequence[str]) -> Array:
    """The odds of names, each by the model of its judge."""
    features, judge, odds = names.column(columns), names.judge, np.zeros(len(names.true))
    for word, weights in models.items():
        own = judge == word
        odds[own] = applied(weights, features[own], names.share[own])
    return odds


def cross_validated(names: Names, columns: Sequence[str], price: tuple[float, float]) -> Array:
    """The odds of each name by models that have not seen its cause."""
    fold, odds = folds_of(names.cause), np.zeros(len(names.true))
    for left_out in np.unique(fold):
        train, test = names.some(fold != left_out), names.some(fold == left_out)
        odds[fold == left_out] = probabilities(fit_judges(train, columns, price), test, columns)
    return odds


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """Odds fitted to names.

    Attributes
    ----------
    models : intercept and weights of each judge
    price : of squared weights, one of `PRICES`
    odds : of each name, by a model that has not seen its cause, and a calibration that was fitted to other causes
    own : of each name, by the model that has seen it
    calibration : of the odds, see `judgement.calibrated`
    """

    models: Mapping[str, tuple[float, dict[str, float]]]
    price: tuple[float, float]
    odds: Array
    own: Array
    calibration: tuple[float, float, float]


def calibration_of(odds: Array, true: NDArray[np.bool_], share: Array | float = 1.0) -> tuple[float, float, float]:
    """The shift and the two slopes, none of them falling, of least log loss.

    Parameters
    ----------
    odds : (names,) of each name and its look-alikes together
    share : what each keeps of them
    """

    def loss(weights: Array) -> float:
        return -log_score(share * calibrated(odds, weights.tolist()), true)

    found = minimize(loss, (0.0, 1.0, 1.0), method="L-BFGS-B", bounds=[(None, None), (0.0, None), (0.0, None)]).x
    return float(found[0]), float(found[1]), float(found[2])


def fitted(names: Names, without: str = "") -> Fitted:
    """The odds of each judge, of all features that differ between names, without one of them where that is asked.

    The prices of weights are those by which names of causes that are left out are judged best.
    """
    columns = [name for name in FEATURES if name != without and np.ptp(names.column([name])) > 0.0]
    blind = {price: cross_validated(names, columns, price) for price in PRICES}
    price = max(PRICES, key=lambda one: log_score(blind[one], names.true))
    models = fit_judges(names, columns, price)
    weights = {
        word: (float(one[0]), {name: float(w) for name, w in zip(columns, one[1:], strict=True) if w})
        for word, one in models.items()
    }
    fold, share, unseen = folds_of(names.cause), names.share, blind[price] / names.share
    odds = np.zeros(len(unseen))
    for left_out in np.unique(fold):
        train, test = fold != left_out, fold == left_out
        found = calibration_of(unseen[train], names.true[train], share[train])
        odds[test] = share[test] * calibrated(unseen[test], found)
    calibration = calibration_of(unseen, names.true, share)
    own = share * calibrated(probabilities(models, names, columns) / share, calibration)
    return Fitted(weights, price, odds, own, calibration)


# Rules in the place of odds


def stops(name: str, claim: Record) -> bool:
    """Whether one test alone would stop a name, at its limit."""
    facts = claim["claim"]
    worth = facts["worth"]
    if name in ("gain", "identity"):
        return facts[name] is None or facts[name] < LIMITS[name]
    if name in ("worth", "rollout_worth"):
        size = worth["force"] if name == "worth" else worth["rollout"]
        return size is not None and size < LIMITS[name]
    if name in ("clear", "file_value"):
        return not facts["null_excluded"]
    return (facts["tests"].get(name) or 0.0) > LIMITS.get(name, _HALF)


def hard_rule(names: Names) -> NDArray[np.bool_]:
    """Names that no test stops: what a heap of vetoes would say."""
    return np.array([not any(stops(test, claim) for test in names.columns) for claim in names.claims], dtype=bool)


def as_odds(said: NDArray[np.bool_], names: Names) -> Array:
    """Yes and no as odds: how often each is right among causes that are left out."""
    fold, odds = folds_of(names.cause), np.zeros(len(said))
    for left_out in np.unique(fold):
        train, test = fold != left_out, fold == left_out
        for word in (True, False):
            of = names.true[train & (said == word)]
            odds[test & (said == word)] = (of.sum() + 0.5) / (len(of) + 1.0)
    return odds
