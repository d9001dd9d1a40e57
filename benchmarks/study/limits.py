"""What is asked of the studies: each figure beside its limits."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import hypot, inf

import numpy as np

from .records import Record
from .scoring import (
    BINS,
    MATERIAL,
    accused,
    exact,
    false_names,
    force_told,
    kind_of_world,
    label,
    leads,
    leads_rightly,
    log_score,
    named,
    refused_rightly,
    reliability,
)

Records = Mapping[str, Sequence[Record]]
"""Records by study."""
SLOW = 10.0
"""Time within which nine of ten foreign logs are to be answered [s]."""
_WORSE = 0.02
"""Share of the nominal error by which a written model may err more than the best of nominal and calibrated."""


@dataclass(frozen=True, slots=True)
class Figure:
    """What a limit is asked of: a share of so many, or another number."""

    value: float
    of: int
    shown: str


@dataclass(frozen=True, slots=True)
class Row:
    """A figure and its limits; without any it is told for itself."""

    title: str
    figure: Callable[[Records], Figure]
    low: float = -inf
    high: float = inf

    def cells(self, records: Records) -> tuple[str, str, str, str]:
        """What it is, its limit, the figure, and whether it holds."""
        found = self.figure(records)
        bounds = (("at least", self.low), ("at most", self.high))
        limits = ", ".join(f"{word} {100.0 * x:.4g} %" for word, x in bounds if abs(x) < inf)
        if not found.of:
            return self.title, limits, "not run", ""
        holds = "" if not limits else "yes" if self.low <= found.value <= self.high else "**no**"
        return self.title, limits, found.shown, holds


def share(holds: Callable[[Record], bool], some: Sequence[Record]) -> Figure:
    """In how many of some records something holds."""
    hits, of = sum(bool(holds(record)) for record in some), len(some)
    value = hits / of if of else 0.0
    return Figure(value, of, f"{100.0 * value:.1f} % ({hits} of {of})")


def quantile(values: Sequence[float], level: float) -> Figure:
    """The quantile of relative errors."""
    value = float(np.quantile(values, level)) if values else 0.0
    return Figure(value, len(values), f"{100.0 * value:.2f} % ({len(values)} numbers)")


# What is asked of which logs


def _of(records: Records, *studies: str, kinds: Sequence[str] = ()) -> list[Record]:
    return [r for study in studies for r in records.get(study, ()) if not kinds or r["kind"] in kinds]


def _tellable(some: Sequence[Record]) -> list[Record]:
    """Logs that a judge who knows the truth could tell; one that nobody asked about counts among them."""
    return [r for r in some if r.get("tellable") is not False]


def _tellable_or_named(some: Sequence[Record]) -> list[Record]:
    """The same of foreign logs; one that was named is one that could be."""
    return [r for r in some if r.get("tellable") is not False or named(r, "missing", "likely")]


def _exact(*kinds: str, words: Sequence[str] = ("missing",), study: str = "plain") -> Callable[[Records], Figure]:
    return lambda records: share(lambda r: exact(r, *words), _tellable(_of(records, study, kinds=kinds)))


def _first(*kinds: str, study: str = "plain") -> Callable[[Records], Figure]:
    return lambda records: share(
        lambda r: label(r.get("first", ""), r["true"], ()) == "true", _of(records, study, kinds=kinds)
    )


def _false(word: str, *studies: str, kinds: Sequence[str] = ()) -> Callable[[Records], Figure]:
    def figure(records: Records) -> Figure:
        nameless = studies == ("nameless",)
        some = [r for r in _of(records, *studies, kinds=kinds) if r["nameless"] or not nameless]
        return share(lambda r: bool(false_names(r, word)), some)

    return figure


def _catalogued(records: Records, *, sensors: bool) -> list[Record]:
    """Foreign logs whose cause is in the catalogue and matters, but those refused for what is wrong in them."""
    return [
        r
        for r in _of(records, "foreign", "others")
        if r["true"]
        and not 0.0 < r["matters"] < MATERIAL
        and not refused_rightly(r)
        and (sensors or not r["sensors_true"])
    ]


def _mute(records: Records, *, tellable: bool = False) -> Figure:
    some = [r for r in _of(records, "foreign", "others") if r["dominant"] and not refused_rightly(r)]
    some = _tellable_or_named(some) if tellable else some
    return share(lambda r: r["verdict"] not in ("missing", "likely"), some)


def _told_of_the_cause(least: float) -> Callable[[Records], Figure]:
    """Of causes without a name that make so much of the error of their log."""
    return lambda records: share(
        lambda r: named(r, "missing", "likely") or force_told(r),
        [r for r in _of(records, "nameless") if r["nameless"] and r["matters"] >= least],
    )


def _led(records: Records) -> Figure:
    """Of causes without a name whose undecided headline tells first of a force."""
    return share(leads_rightly, [r for r in _of(records, "nameless") if r["nameless"] and leads(r)])


def _led_astray(*studies: str) -> Callable[[Records], Figure]:
    """Of logs whose cause has a name."""
    return lambda records: share(
        lambda r: leads(r) is not None, [r for r in _of(records, *studies) if r["true"] or r["part"]]
    )


def _sound_refused(records: Records) -> Figure:
    some = [r for study in records for r in records[study] if kind_of_world(r) in ("plain", "foreign", "nameless")]
    return share(lambda r: r["verdict"] == "refused", [r for r in some if not refused_rightly(r)])


def _crashed(records: Records) -> Figure:
    return share(lambda r: r["verdict"] == "crashed", [r for some in records.values() for r in some])


def _slow(records: Records) -> Figure:
    return share(lambda r: r["seconds"] < SLOW, [r for r in _of(records, "foreign", "others") if "seconds" in r])


def right_terms(some: Sequence[Record]) -> list[Record]:
    """Numbers of rightly named effects whose true value is known, each with the length by which its error is taken."""
    found = []
    for record in some:
        for claim in record.get("claims", ()):
            if claim["label"] != "true" or claim["verdict"] not in ("missing", "likely"):
                continue
            known = [t for t in claim["terms"] if t["truth"] is not None]
            vector = all(t["symbol"].endswith(("_north", "_east")) for t in known)
            length = hypot(*(t["truth"] for t in known)) if vector and known else 0.0
            found += [{**t, "length": length or abs(t["truth"])} for t in known]
    return found


def _covered(*studies: str, kinds: Sequence[str] = ()) -> Callable[[Records], Figure]:
    def holds(term: Record) -> bool:
        low, high = term["ci95"]
        return (-inf if low is None else low) <= term["truth"] <= (inf if high is None else high)

    return lambda records: share(holds, [t for t in right_terms(_of(records, *studies, kinds=kinds)) if t["ci95"]])


def _errors(level: float, *kinds: str) -> Callable[[Records], Figure]:
    def figure(records: Records) -> Figure:
        terms = right_terms(_of(records, "plain", kinds=kinds))
        return quantile([abs(t["value"] - t["truth"]) / t["length"] for t in terms if t["length"]], level)

    return figure


def worse_on_fresh(record: Record) -> bool:
    """Whether the written model errs more on another run than the best of the others, by 2 % of the nominal error."""
    error = {
        name: inf if None in squares else float(np.sqrt(np.sum(squares))) for name, squares in record["fresh"].items()
    }
    best = min(error["nominal"], error.get("calibrated", inf))
    return error["written"] > best + _WORSE * error["nominal"]


def _fresh(*studies: str) -> Callable[[Records], Figure]:
    return lambda records: share(worse_on_fresh, [r for r in _of(records, *studies) if "fresh" in r])


def claims_of(records: Records) -> list[Record]:
    """The claims of all names that stand in a model; field logs apart, of which not all that is true is known."""
    return [c for study, some in records.items() if study != "field" for r in some for c in r.get("claims", ())]


def judged_names(records: Records) -> list[tuple[float, bool]]:
    """Told odds of every name that stands in a model, and whether it is true, in part at least."""
    return [(c["odds"], c["label"] != "false") for c in claims_of(records)]


def _bin(low: float, high: float) -> Callable[[Records], Figure]:
    def figure(records: Records) -> Figure:
        _, _, count, told, true = reliability(judged_names(records), (low, high))[0]
        few = "; fewer than 100" if count < _ENOUGH else ""
        return Figure(abs(told - true), count, f"told {100 * told:.1f} %, true {100 * true:.1f} % ({count} names{few})")

    return figure


_ENOUGH = 100
"""Names in a bin from which its share says anything."""


def _against_verdicts(records: Records) -> Figure:
    """Log score of the odds less that of yes and no, each taken for as often true as it is in these very logs."""
    pairs = judged_names(records)
    if not pairs:
        return Figure(0.0, 0, "")
    odds, true = (np.array(column) for column in zip(*pairs, strict=True))
    said = np.array([c["verdict"] == "missing" for c in claims_of(records)])
    plain = np.zeros(len(true))
    for word in (True, False):
        if (said == word).any():
            plain[said == word] = true[said == word].mean()
    own, other = log_score(odds, true), log_score(plain, true)
    return Figure(own - other, len(pairs), f"{own:.4f} against {other:.4f} ({len(pairs)} names)")


_ASTRAY = "undecided, and the headline tells first of a force without a name, though the cause has one"
_WRITTEN = "on another run, the written model errs more than the best of the others"
_RICH = ("singles", "rough", "clean")
HIDDEN = (
    Row("one effect, rich, field: exactly it is missing, of those that can be told", _exact("singles"), 0.99),
    Row("one effect, rich, rough: the same", _exact("rough"), 0.96),
    Row("one effect, rich: first-ranked right", _first("singles", "rough"), 0.99),
    Row("two effects: exactly these are missing, of those that can be told", _exact("pairs"), 0.97),
    Row("three effects: the same", _exact("triples"), 0.95),
    Row("one effect, gentle: exactly it is missing or likely", _exact("gentle", words=("missing", "likely")), 0.96),
    Row("one effect, gentle: a false name is missing", _false("missing", "plain", kinds=("gentle",)), high=0.01),
    Row("one effect, zigzag: exactly it is missing or likely", _exact("zigzag", words=("missing", "likely"))),
    Row("nothing hidden in these: a name is missing", _false("missing", "plain", kinds=("nothing", "waves"))),
    Row("error of coefficients, median", _errors(0.5, *_RICH, "pairs", "triples"), high=0.02),
    Row("error of coefficients, 90th percentile", _errors(0.9, *_RICH, "pairs", "triples"), high=0.08),
    Row("95 % intervals hold the truth", _covered("plain"), 0.92, 0.98),
    Row(_WRITTEN, _fresh("plain"), high=0.0),
)
NOTHING = (
    Row("a name is missing", _false("missing", "nothing"), high=1.0 / 3000.0),
    Row("a name is likely", _false("likely", "nothing"), high=0.005),
)
_SAID = ("missing", "likely")
_ALONE = ("waves", "drifting sensors")
SEAS = (
    Row("one effect: exactly it is missing or likely", _exact(*_ALONE, words=_SAID, study="seas")),
    Row("one effect: first-ranked right", _first(*_ALONE, study="seas")),
    Row("a false name is missing", _false("missing", "seas"), high=0.01),
    Row("a false name is likely", _false("likely", "seas"), high=0.03),
    Row("95 % intervals hold the truth", _covered("seas"), 0.92, 0.98),
    Row(_ASTRAY, _led_astray("seas")),
    Row(_WRITTEN, _fresh("seas"), high=0.0),
)
SEVERAL = (
    Row(
        "one effect: exactly it is missing or likely",
        _exact("one effect", words=_SAID, study="several"),
    ),
    Row("three effects: the same", _exact("three effects", words=_SAID, study="several")),
    Row("one effect: first-ranked right", _first("one effect", study="several")),
    Row("a false name is missing", _false("missing", "several"), high=0.01),
    Row("a false name is likely", _false("likely", "several"), high=0.03),
    Row("95 % intervals hold the truth", _covered("several"), 0.92, 0.98),
    Row(_WRITTEN, _fresh("several"), high=0.0),
)
_HIDDEN_IN_TURNING = ("turning", "steered")
TURNING = (
    Row(
        "one effect: exactly it is missing or likely",
        _exact(*_HIDDEN_IN_TURNING, words=_SAID, study="turning"),
    ),
    Row("one effect: first-ranked right", _first(*_HIDDEN_IN_TURNING, study="turning")),
    Row("a false name is missing", _false("missing", "turning"), high=0.01),
    Row("a false name is likely", _false("likely", "turning"), high=0.03),
    Row("95 % intervals hold the truth", _covered("turning"), 0.92, 0.98),
    Row(_WRITTEN, _fresh("turning"), high=0.0),
)
SHORT = (
    Row("a false name is missing", _false("missing", "short"), high=0.01),
    Row("a false name is likely", _false("likely", "short")),
)
FOREIGN = (
    Row(
        "the cause is in the catalogue: it is missing or likely",
        lambda records: share(lambda r: named(r, "missing", "likely"), _catalogued(records, sensors=True)),
        0.88,
    ),
    Row(
        "the same, where no sensor errs",
        lambda records: share(lambda r: named(r, "missing", "likely"), _catalogued(records, sensors=False)),
    ),
    Row(
        "the same, of those that a judge who knows the truth could tell",
        lambda records: share(
            lambda r: named(r, "missing", "likely"), _tellable_or_named(_catalogued(records, sensors=False))
        ),
    ),
    Row("a false name is missing", _false("missing", "foreign", "others"), high=0.008),
    Row("a false name is likely", _false("likely", "foreign", "others"), high=0.03),
    Row("undecided or nothing missing, though one effect makes over half of the error", _mute, high=0.03),
    Row("the same, of those that a judge who knows the truth could tell", lambda r: _mute(r, tellable=True)),
    Row("95 % intervals hold the truth", _covered("foreign", "others"), 0.92, 0.98),
    Row(_WRITTEN, _fresh("foreign", "others"), high=0.0),
    Row(_ASTRAY, _led_astray("foreign", "others")),
    Row("answered within 10 s", _slow, 0.9),
)
NAMELESS = (
    Row("a false name is missing", _false("missing", "nameless"), high=0.005),
    Row("a false name is likely", _false("likely", "nameless"), high=0.04),
    Row("told of the cause in part, or as a force of the right axis and variable", _told_of_the_cause(0.0), 0.92),
    Row("the same, of causes that make a material part of the error of their log", _told_of_the_cause(MATERIAL)),
    Row("an undecided headline that tells first of a force: one of the right axis and variable", _led),
    Row(_WRITTEN, _fresh("nameless"), high=0.0),
)
SENSORS = (
    Row("a false name is missing", _false("missing", "sensors"), high=0.01),
    Row("a false name is likely", _false("likely", "sensors")),
    Row(
        "a sensor that is right is accused",
        lambda records: share(accused, [r for r in _of(records, "sensors") if not r["sensors_true"]]),
    ),
)
FIELD = (
    Row("a false name is missing", _false("missing", "field"), high=0.01),
    Row("a false name is likely", _false("likely", "field")),
    Row(_ASTRAY, _led_astray("field")),
    Row(
        "in Gazebo and what was withheld once: something true is missing or likely",
        lambda records: share(lambda r: named(r, "missing", "likely"), [r for r in _of(records, "field") if r["true"]]),
        0.95,
    ),
)
JUDGEMENT = (
    *(Row(f"told {low:g} to {high:g}: told and true differ by", _bin(low, high), high=0.05) for low, high in BINS),
    Row("log score of the odds less that of yes and no", _against_verdicts, 0.0),
    Row("sound logs refused", _sound_refused, high=0.003),
    Row("the verb fell over", _crashed, high=0.0),
)
