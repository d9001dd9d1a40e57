"""What an answer is worth beside the truth, under the judgement that gave it or another of the same facts."""

import re
from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, get_args

import numpy as np

from undertow.discovery.balance.shooting import TRIFLE
from undertow.discovery.claims import with_companions
from undertow.discovery.effect_findings import Claim, Verdict
from undertow.discovery.findings import NamelessForce, leading_force
from undertow.discovery.judgement import Odds, verdict
from undertow.discovery.search.scoring import MATERIAL as AT_WORK
from undertow.discovery.verdicts import PROBABLE

from .foreign_kinds import KINDS
from .records import ROOT

Record = Mapping[str, Any]
WORLDS = ("plain", "foreign", "nameless", "sensors", "field")
EDGES = (0.0, 0.2, 0.5, 0.8, 0.95, 1.0)
BINS = tuple(pairwise(EDGES))
"""Bins of told odds in which they are held against what is true."""
PAIR = "two effects of the catalogue"
"""The kind of nameless worlds whose causes have names."""
ODDS = ROOT / "discovery" / "odds.json"
_RANKS = get_args(Verdict)
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


def read_odds(path: Path = ODDS) -> Odds:
    """The odds of a file; `benchmarks/odds.py` writes it."""
    return Odds.read(path)


def claims_of(record: Record) -> list[Claim]:
    """The claims of a record, with the doubt that they raise about each other as it is counted today."""
    return with_companions([_claim_of(one) for one in record.get("claims", ())])


def _claim_of(claimed: Record) -> Claim:
    """One claim of a record; the first records list its look-alikes beside the claim alone."""
    alike = {"look_alikes": float(len(claimed["alike"]))} if claimed.get("alike") else {}
    facts = claimed["claim"]
    return Claim.model_validate({**facts, "tests": {**alike, **facts["tests"]}})


def rescored(record: Record, odds: Odds) -> dict[str, Any]:
    """The record as another judgement of its facts would have answered."""
    claims = []
    for c, claim in zip(record.get("claims", ()), claims_of(record), strict=True):
        chance = odds.probability(claim)
        claims.append({**c, "odds": chance, "verdict": verdict(claim, chance) if c["kept"] else "possible"})
    if not claims:
        return dict(record)
    claims.sort(key=lambda c: (_RANKS.index(c["verdict"]), -c["odds"]))
    named = {word: [c["key"] for c in claims if c["verdict"] == word] for word in ("missing", "likely")}
    else_ = record["verdict"] if record["verdict"] not in named else "undecided"
    said = next((word for word, names in named.items() if names), else_)
    return {**record, **named, "claims": claims, "first": claims[0]["key"], "verdict": said}


# Names


def bare(name: str) -> str:
    """An effect without its thruster."""
    return name.split("[")[0]


def label(name: str, true: Collection[str], part: Collection[str]) -> str:
    """Whether a name is true, a fair part of the cause, or false."""
    return "true" if {name, bare(name)} & set(true) else "part" if {name, bare(name)} & set(part) else "false"


def names(record: Record, *verdicts: str) -> list[str]:
    """What is named under some verdicts, `missing` where nobody says it.

    A term without a name is such a name in worlds that the catalogue describes; elsewhere it is an honest answer. What
    has changed is missing on one side of that.
    """
    words = verdicts or ("missing",)
    surely = "missing" in words
    terms = record.get("unnamed", ()) if surely and kind_of_world(record) == "plain" else ()
    changed = [record["changed"]] if surely and record.get("changed") else []
    return list(dict.fromkeys([*(name for word in words for name in record.get(word, ())), *changed, *terms]))


def false_names(record: Record, *verdicts: str) -> list[str]:
    """What is named and is no part of the cause."""
    return [name for name in names(record, *verdicts) if label(name, record["true"], record["part"]) == "false"]


def exact(record: Record, *verdicts: str) -> bool:
    """Whether all that is hidden is named, and nothing else."""
    said = names(record, *verdicts)
    here = all(any(label(name, [one], ()) == "true" for name in said) for one in record["true"])
    return here and all(label(name, record["true"], ()) == "true" for name in said)


def named(record: Record, *verdicts: str) -> bool:
    """Whether the cause is named, in part at least."""
    return any(label(name, record["true"], record["part"]) != "false" for name in names(record, *verdicts))


# Logs

_PLAIN = ("plain", "nothing", "short", "seas", "several", "worn")
"""Studies whose causes the catalogue describes, where they have a name."""


def kind_of_world(record: Record) -> str:
    """Where a log is from: plain, foreign, nameless, sensors or field."""
    if record["study"] == "field":
        return "field"
    if record["nameless"]:
        return "nameless"
    if record["sensors_true"] or record["study"] == "sensors":
        return "sensors"
    return "plain" if record["study"] in _PLAIN or record["kind"] == PAIR else "foreign"


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


def terms_of(record: Record) -> list[tuple[str, str]]:
    """Axis and form of each term without a name."""
    return [(axis, form) for axis, _, form in (term.partition(":") for term in record.get("unnamed", ()))]


def force_told(record: Record) -> bool:
    """Whether a force without a name is told on the right axis, as one that follows the right signal."""
    told = [(axis, text) for axis, text, *_ in record.get("forms", ())] + terms_of(record)
    # The headline says on which axis most comes and goes where nothing is missing, or nothing else is known of a rest.
    if record["verdict"] == "nothing missing" or not (told or record.get("claims")):
        told += [(axis, "the time") for axis in _passing(record)[:1]]
    return any(_is_right(record, *one) for one in told)


def leads(record: Record) -> NamelessForce | None:
    """The force without a name of which an undecided headline tells first; see `discovery.findings.leading_force`."""
    in_play = [c for c in record.get("claims", ()) if max(_worth(c)) >= TRIFLE]
    in_play = [c for c in in_play if c["kept"]] or in_play
    if record["verdict"] != "undecided" or (in_play and in_play[0]["odds"] >= PROBABLE):
        return None
    return leading_force(
        terms_of(record),
        [(axis, text, share) for axis, text, share in record.get("forms", ())],
        [axis for axis, _ in record.get("rests", ())],
        rollouts=bool(record.get("passing")) or any(c["claim"]["tests"].get("rolls") for c in record.get("claims", ())),
    )


def leads_rightly(record: Record) -> bool:
    """Whether that force is of the right axis and signal."""
    force = leads(record)
    return force is not None and _is_right(record, force.axis, force.follows)


def _worth(claim: Record) -> tuple[float, float]:
    worth = claim["claim"]["worth"]
    return worth["force"], worth["rollout"] or 0.0


def _is_right(record: Record, axis: str, text: str) -> bool:
    return any(f"{axis}:{signal}" in record["forces"] for signal in follows(text))


def _passing(record: Record) -> list[str]:
    """Axes on which a material part of the force comes and goes within seconds, without what lasts, the most first."""
    lasts, passing = dict(record.get("rests", ())), dict(record.get("passing") or ())
    alone = {axis: share**2 - lasts.get(axis, 0.0) ** 2 for axis, share in passing.items()}
    return [axis for axis in sorted(alone, key=lambda axis: -alone[axis]) if alone[axis] > AT_WORK**2]


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
        ("part", bool(record.get("missing") or record.get("changed"))),
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
        here = (told >= low) & ((told < high) | (high == 1.0))
        means = (float(told[here].mean()), float(true[here].mean())) if here.any() else (float("nan"), float("nan"))
        rows.append((low, high, int(here.sum()), *means))
    return rows


def log_score(odds: np.ndarray, true: np.ndarray) -> float:
    """Mean log probability of what is true [nats a name]; 0 is perfect."""
    inside = np.clip(odds, 1e-6, 1.0 - 1e-6)
    return float(np.mean(np.where(true, np.log(inside), np.log1p(-inside))))
