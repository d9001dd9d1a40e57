"""What each test and each doubt is worth: what it would stop alone, at what cost, and what the odds lose without it.

    python benchmarks/ablation.py [--seeds tuning|reporting] [--table] [--stale] [--folder FOLDER]

From the records of `through_the_verb.py`, without running the verb. With `--table` the page is `docs/judgement.md`.
"""

import argparse
import json
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

from odds import gathered, report
from study.fitted_odds import FEATURES, JUDGES, LIMITS, Fitted, Names, fitted, names_of, stops
from study.limits import JUDGEMENT
from study.records import ROOT, Kept, Record, in_a_table
from study.scoring import ODDS, WORLDS, kind_of_world, label, log_score, read_odds, rescored
from study.studies import FOLDER, STUDIES
from study.tables import must_hold

from undertow.discovery.effect_findings import MISSING, Reason
from undertow.discovery.judgement import Odds

PAGE = ROOT / "docs" / "judgement.md"
INTRODUCTION = """A name that stands in a model is a claim: its gain, its identity, what it is worth, and the sizes of
some tests. A logistic model for each judge, the force balance and rollouts, makes a probability of them
(`discovery/judgement.py`), fitted to worlds of which the truth is known, its weights drawn towards those of all names
as far as unseen causes ask; a name is true where it is hidden, or a fair part of what is."""
ALONE = """Each feature of the judgement, and its limit: what a rule of it alone would stop of all names that stand in a
model, false and true, by kind of world; then what the odds lose that are fitted without it, all other features kept, on
causes that the fit has not seen: log score [thousandths of a nat a name], and true and false names said at 95 %."""
DOUBTS = """Each doubt that findings may tell of a name, and of how many false and true names it is the largest one, by
kind of world; names that stand in no model, and are true or have a doubt all the same, are among them."""


def by_world(some: Sequence[tuple[str, bool]]) -> list[str]:
    """False and true names, by kind of world."""
    counts = Counter(some)
    return [f"{counts[(world, False)]}, {counts[(world, True)]}" for world in WORLDS]


def alone(names: Names, test: str) -> list[str]:
    """What a rule of one test alone would stop: false and true names, by kind of world."""
    rows = zip(names.claims, names.world.tolist(), names.true.tolist(), strict=True)
    return by_world([(world, true) for claim, world, true in rows if stops(test, claim)])


def without(names: Names, whole: Fitted) -> Callable[[str], tuple[str, str]]:
    """What odds that are fitted without a feature lose."""
    could = names.could_be_missing

    def figures(found: Fitted) -> tuple[float, int, int]:
        said = could & (found.odds >= MISSING)
        return log_score(found.odds, names.true), int((said & names.true).sum()), int((said & ~names.true).sum())

    before = figures(whole)

    def lost(test: str) -> tuple[str, str]:
        if test not in FEATURES:
            return "not in the odds", ""
        score, true, false = figures(fitted(names, test))
        return f"{1e3 * (before[0] - score):.2f}", f"{true - before[1]:+d}, {false - before[2]:+d}"

    return lost


def doubts(records: Sequence[Record]) -> list[tuple[object, ...]]:
    """A row for each reason: false and true names of which it is the largest doubt, by kind of world."""
    found: dict[Reason, list[tuple[str, bool]]] = {reason: [] for reason in Reason}
    for record in records:
        for name, word in record.get("reasons", {}).items():
            true = label(name, record["true"], record["part"]) != "false"
            found[Reason(word)].append((kind_of_world(record), true))
    return [(reason.value, *by_world(names)) for reason, names in found.items()]


def page(tuning: Kept, reporting: Kept, odds: Odds, made: str) -> str:
    """The page in Markdown, of tuning records, and of reporting ones where there are any."""
    names, every = names_of([r for r in tuning if r["study"] != "field"]), names_of(tuning)
    head = [f"{world}: false, true" for world in WORLDS]
    parts = [
        "# Judgement: what makes a name sure",
        INTRODUCTION,
    ]
    if reporting:
        by_study: dict[str, Kept] = {}
        for record in reporting:
            by_study.setdefault(record["study"], []).append(rescored(record, odds))
        parts += ["## What must hold", must_hold(JUDGEMENT, by_study)]
    parts += ["## The odds", f"`discovery/odds.json` ({made}).", in_a_table(("feature", *JUDGES), _weights(odds))]
    shift, low, high = odds.calibration
    parts.append(
        f"Where they say p, 1 / (1 + (1 - p)^{high:.3g} / (e^{shift:.3g} p^{low:.3g})) is told: their calibration."
    )
    if len(names.claims) and 0 < names.true.sum() < len(names.true):
        validated = fitted(names)
        lost = without(names, validated)
        rows = [(test, _limit(test), *alone(every, test), *lost(test)) for test in names.columns]
        total = ("all names", "", *by_world(list(zip(every.world.tolist(), every.true.tolist(), strict=True))), "", "")
        parts += [
            "With its features, fitted anew without each cause:",
            report(names, validated.odds),
            "## Each test alone",
            ALONE,
            in_a_table(("feature", "limit", *head, "log score lost", "said: true, false"), [total, *rows]),
        ]
    parts += ["## Each doubt", DOUBTS, in_a_table(("doubt", *head), doubts(tuning))]
    parts += ["Written by `python benchmarks/ablation.py --table`; do not edit."]
    return "\n\n".join(parts) + "\n"


def _weights(odds: Odds) -> list[tuple[str, ...]]:
    """A row for each feature: its weight for either judge."""
    judges = (odds.forces, odds.rollouts)
    rows = [(name, *(f"{one.weights.get(name, 0.0):+.3g}" for one in judges)) for name in FEATURES]
    return [("intercept", *(f"{one.intercept:+.3g}" for one in judges)), *rows]


def _limit(test: str) -> str:
    """The limit of a test, in words."""
    if test == "clear":
        return "the interval holds the file's value"
    size = LIMITS.get(test, 0.5)
    return f"{'below' if test in ('gain', 'identity', 'worth', 'rollout_worth') else 'above'} {size:.3g}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the page, or write it; exit code 2 without records."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", choices=("tuning", "reporting"), default="tuning", help="of the names in question")
    parser.add_argument("--table", nargs="?", const=PAGE, type=Path, help=f"page to write ({PAGE.name})")
    parser.add_argument("--stale", action="store_true", help="take what other sources made, too")
    parser.add_argument("--folder", type=Path, default=FOLDER, help="where records are kept")
    given = parser.parse_args(arguments)
    field, old_field = gathered(["field"], "reporting", given.folder, given.stale)
    others = [study for study in STUDIES if study != "field"]
    records, old = gathered(others, given.seeds, given.folder, given.stale)
    reporting, _ = gathered(others, "reporting", given.folder, given.stale)
    if old or old_field:
        print(f"STALE{'' if given.stale else ', left out'}: {', '.join(old + old_field)}", file=sys.stderr)
    if not records:
        print("no records: run benchmarks/through_the_verb.py first")
        return 2
    text = page(
        [*records, *field],
        [*reporting, *field] if reporting else [],
        read_odds(),
        json.loads(ODDS.read_text("utf-8"))["made"],
    )
    if given.table is not None:
        given.table.write_text(text, encoding="utf-8")
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
