"""What an answer is worth beside the truth, under the judgement that gave it or another of the same facts."""

import json
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import asinh, exp, log, log1p
from pathlib import Path
from typing import Any

import numpy as np

from undertow.discovery.found_effects import LIKELY, MISSING, Claim

from .foreign_kinds import KINDS

Record = Mapping[str, Any]
Bin = tuple[float, float, int, float, float]
MATERIAL = 0.03
"""Share by which 10 s rollouts of the file's boat part from the truth, above which something material is hidden."""
SIGNALS = {
    "thrust": r"thrust|turns of the propellers",
    "time": r"the time|from (minute|part)",
    "heading": r"heading",
    "place": r"place|(north|east)\w* of",
}
"""How a form tells what it follows, beside velocities."""


def features(claim: Claim, context: object = None) -> dict[str, float]:
    """The facts of a claim as the odds take them, each on a scale on which evidence adds up."""
    worth = claim.worth
    found = {
        "gain": log1p(max(claim.gain, 0.0)),
        "identity": asinh(min(max(claim.identity, -20.0), 60.0)),
        "force": _logit(worth.force),
        "rollout": 0.0 if worth.rollout is None else _logit(worth.rollout),
        "rollout_unknown": float(worth.rollout is None),
        "null_excluded": float(claim.null_excluded),
    }
    return found | {name: log1p(max(size, 0.0)) for name, size in claim.tests.items()}


def _logit(share: float) -> float:
    """Log odds of a share, of which the last hundredth tells nothing."""
    inside = min(max(share, 0.01), 0.99)
    return log(inside / (1.0 - inside))


@dataclass(frozen=True, slots=True)
class Odds:
    """A logistic model of the facts of a claim."""

    intercept: float
    weights: Mapping[str, float]
    made: str = ""

    @classmethod
    def read(cls, path: Path) -> "Odds":
        """The odds of a file."""
        return cls(**json.loads(path.read_text("utf-8")))

    def of(self, facts: Mapping[str, float]) -> float:
        """Probability that a name is true."""
        total = self.intercept + sum(weight * facts.get(name, 0.0) for name, weight in self.weights.items())
        return 1.0 / (1.0 + exp(-min(max(total, -50.0), 50.0)))


def facts_of(claimed: Record, record: Record) -> dict[str, float]:
    """The features of one claim of a record."""
    return features(Claim.model_validate(claimed["claim"]), record)


def rescored(record: Record, odds: Odds) -> dict[str, Any]:
    """The record as another judgement of its facts would have answered."""
    claims = [{**c, "odds": odds.of(facts_of(c, record))} for c in record.get("claims", ())]
    if not claims:
        return dict(record)
    claims.sort(key=lambda c: (c["odds"], c["claim"]["worth"]["force"] or 0.0), reverse=True)
    for c in claims:
        sure = c["odds"] >= MISSING and c["claim"]["null_excluded"]
        c["verdict"] = "missing" if sure else "likely" if c["odds"] >= LIKELY else "possible"
    named = {word: [c["key"] for c in claims if c["verdict"] == word] for word in ("missing", "likely")}
    verdict = next((word for word, names in named.items() if names), "undecided")
    return {**record, **named, "claims": claims, "first": claims[0]["key"], "verdict": verdict}


# Names


def bare(name: str) -> str:
    """An effect without its thruster."""
    return name.split("[")[0]


def label(name: str, true: Collection[str], part: Collection[str]) -> str:
    """Whether a name is true, a fair part of the cause, or false."""
    return "true" if {name, bare(name)} & set(true) else "part" if {name, bare(name)} & set(part) else "false"


def names(record: Record, *verdicts: str) -> list[str]:
    """What is named under some verdicts, `missing` where nobody says it; a term without a name is such a name."""
    words = verdicts or ("missing",)
    terms = record.get("unnamed", ()) if "missing" in words else ()
    return [*(name for word in words for name in record.get(word, ())), *terms]


def false_names(record: Record, *verdicts: str) -> list[str]:
    """What is named and is no part of the cause; a term is none where the cause has no name."""
    terms = record.get("unnamed", ()) if record["nameless"] else ()
    said = (name for name in names(record, *verdicts) if name not in terms)
    return [name for name in said if label(name, record["true"], record["part"]) == "false"]


def exact(record: Record, *verdicts: str) -> bool:
    """Whether all that is hidden is named, and nothing else."""
    said = names(record, *verdicts)
    here = all(any(label(name, [one], ()) == "true" for name in said) for one in record["true"])
    return here and all(label(name, record["true"], ()) == "true" for name in said)


def named(record: Record, *verdicts: str) -> bool:
    """Whether the cause is named, in part at least."""
    return any(label(name, record["true"], record["part"]) != "false" for name in names(record, *verdicts))


# Logs


def refused_rightly(record: Record) -> bool:
    """Whether a log was refused with the words that tell its cause."""
    words = KINDS[record["kind"]].refusal if record["kind"] in KINDS else ""
    return record["verdict"] == "refused" and bool(words) and words in record.get("told", "")


def sensor_told(record: Record) -> bool:
    """Whether the sensor that is the cause, or the record, is told."""
    return refused_rightly(record) or bool(set(record.get("sensors", ())) & set(record["sensors_true"]))


def accused(record: Record) -> bool:
    """Whether a sensor, or the record of commands, is told that is right."""
    return bool(set(record.get("sensors", ())) - set(record["sensors_true"]))


def follows(text: str) -> set[str]:
    """What a form follows: velocities u, v, r, thrust, time, heading or place."""
    found = {name for name, words in SIGNALS.items() if re.search(words, text)}
    speeds = re.sub(r"\b(?![uvr\d^|]+\b)[A-Za-z]\w*", " ", text.replace("m/s", " ").replace("rad/s", " "))
    return found | (set(speeds) & set("uvr"))


def force_told(record: Record) -> bool:
    """Whether a force without a name is told on the right axis, as one that follows the right signal."""
    told = [(axis, text) for axis, text, *_ in record.get("forms", ())]
    told += [(axis, text) for axis, _, text in (term.partition(":") for term in record.get("unnamed", ()))]
    return any(f"{axis}:{signal}" in record["forces"] for axis, text in told for signal in follows(text))


OUTCOMES = (
    *("false", "exact", "part", "likely", "sensor told", "a force", "undecided", "passed by", "refused", "crashed"),
)
"""What a log may be answered. False: a name that is neither hidden nor a fair part of it. Exact: all that is hidden and
nothing else, or nothing where nothing material is. Part: a part of the cause is missing. Likely: it is likely alone."""


def outcome(record: Record) -> str:
    """In a word, what a log was answered."""
    verdict = record["verdict"]
    if verdict in ("refused", "crashed"):
        return "sensor told" if refused_rightly(record) else verdict
    if false_names(record):
        return "false"
    if names(record) and record["true"] and exact(record):
        return "exact"
    rules = (
        ("part", bool(record.get("missing"))),
        ("likely", named(record, "likely")),
        ("sensor told", sensor_told(record)),
        ("a force", force_told(record) or bool(record.get("unnamed"))),
        ("undecided", verdict != "nothing missing"),
        ("passed by", bool(record["true"] or record["nameless"]) and record["matters"] >= MATERIAL),
    )
    return next((word for word, holds in rules if holds), "exact")


def reliability(pairs: Sequence[tuple[float, bool]], edges: Sequence[float]) -> list[Bin]:
    """For each bin of told odds: its edges, how many names, their mean odds, and the share that is true."""
    told, true = (np.array(column, dtype=float) for column in (list(zip(*pairs, strict=True)) or [(), ()]))
    rows = []
    for low, high in pairwise(edges):
        here = (told >= low) & ((told < high) | (high == edges[-1]))
        means = (float(told[here].mean()), float(true[here].mean())) if here.any() else (float("nan"), float("nan"))
        rows.append((low, high, int(here.sum()), *means))
    return rows


def log_score(odds: np.ndarray, true: np.ndarray) -> float:
    """Mean log probability of what is true [nats a name]; 0 is perfect."""
    inside = np.clip(odds, 1e-6, 1.0 - 1e-6)
    return float(np.mean(np.where(true, np.log(inside), np.log1p(-inside))))
