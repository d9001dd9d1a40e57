"""Fit the odds of names to the tuning records of all studies, and say how good they are.

A name is true where it is hidden, or a fair part of the cause. The facts of its claim are those that
`through_the_verb.py` keeps, their features those of `discovery/judgement.py`; the odds are bounded logistic models,
one of each judge, drawn towards that of all names as causes not seen by the fit ask (`study/fitted_odds.py`).

    python benchmarks/odds.py [--studies NAME]... [--write] [--stale] [--folder FOLDER]

`--write` puts the model into `discovery/odds.json`.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from study.fitted_odds import JUDGES, Names, as_odds, fitted, hard_rule, names_of
from study.records import Kept, in_a_table, rounded
from study.scoring import EDGES, ODDS, WORLDS, bare, label, log_score, reliability
from study.studies import FOLDER, STUDIES, stored

from undertow.discovery import claims

UNFITTED = ("field", "several", "worn")
"""Studies that the odds are not fitted to, and are held against: names of several logs would be told no better, and of
single logs more false ones would be likely. Where all numbers of a file are off every name is true: with these (ad hoc)
14 of 1,299 reporting logs more are told, two more get a false name, and the log score falls by 0.012."""
SAID = (0.95, 0.8)
TRIED = {
    "_CLEAR": (1.0, 2.0, 2.5, 3.0, 3.5, 4.0),
    "TRIFLE": (1e-6, 0.01, 0.03, 0.1, 0.3, 1.0),
    "_LEAST": (3e-4, 1e-3, 3e-3, 0.01),
}
"""Values of numbers of `claims` by which companions doubt; where a trifle is nothing each companion counts whole."""
_BEFORE = {"present": 0.9, "possible": 0.3, "no evidence": 0.02}
"""How often sensors err of which these words are told, where no record says it."""
_LEAST_NAMES = 200
"""Names below which no model is fitted: fewer than a dozen for each number."""


def gathered(studies: Sequence[str], purpose: str, folder: Path, stale: bool) -> tuple[Kept, list[str]]:
    """Records of some studies as they were kept, with those of other sources too, and how many of these there are."""
    records, old = [], []
    for study in studies:
        file = stored(study, purpose, folder)
        if file.stale:
            old.append(f"{study}-{purpose} ({len(file.older)})")
        records += [*file.records, *(file.older if stale else ())]
    return records, old


def base_rates(records: Kept) -> dict[str, Any]:
    """How often what has no claim is true: names that nearly earn their price, others, errors of sensors by word."""
    nearly, right, others, missed = 0, 0, 0, 0
    for record in (r for r in records if "unclaimed" in r):
        claimed = [claim["key"] for claim in record["claims"]]
        unclaimed = [name for name in record["true"] if not any(label(key, [name], ()) == "true" for key in claimed)]
        close = [name for name in unclaimed if {name, bare(name)} & {*record["nearly"], *map(bare, record["nearly"])}]
        nearly, right = nearly + len(record["nearly"]), right + len(close)
        others, missed = others + record["unclaimed"] - len(record["nearly"]), missed + len(unclaimed) - len(close)
    words = {"present": "sensors", "possible": "sensors_possible", "no evidence": "sensors_clear"}
    sensors = {word: rate(records, name, _BEFORE[word]) for word, name in words.items()}
    return {
        "unselected": (missed + 0.5) / (others + 10.0),
        "nearly": (right + 0.5) / (nearly + 10.0),
        "sensors": sensors,
    }


def rate(records: Kept, name: str, before: float) -> float:
    """How often a sensor of which this is told errs so; what was thought before counts for ten of them."""
    told = [what in record["sensors_true"] for record in records for what in record.get(name, ())]
    return (sum(told) + 10.0 * before) / (len(told) + 10.0)


def report(names: Names, odds: np.ndarray) -> str:
    """Reliability, log scores and what is said, of odds by models that have not seen the cause of a name."""
    pairs = list(zip(odds.tolist(), names.true.tolist(), strict=True))
    rows = [
        (f"{low:g} to {high:g}", count, f"{told:.3f}", f"{true:.3f}")
        for low, high, count, told, true in reliability(pairs, EDGES)
    ]
    ruled = hard_rule(names)
    constant = np.full(len(odds), names.true.mean())
    known = {"odds": odds, "yes and no of all limits": as_odds(ruled, names), "constant": constant}
    scores = [(word, f"{log_score(values, names.true):.4f}") for word, values in known.items()]
    said = []
    for world in WORLDS:
        true, false = ((names.world == world) & label for label in (names.true, ~names.true))
        if true.any() or false.any():
            counts = [f"{(says & true).sum()}, {(says & false).sum()}" for says in _said(names, odds, ruled)]
            said.append((world, true.sum(), false.sum(), *counts))
    head = ("world", "true names", "false", *(f"from {level:g}: true, false" for level in SAID), "by all limits")
    tables = (
        in_a_table(("told", "names", "mean told", "true"), rows),
        in_a_table(("log score [nats a name]", "cross-validated"), scores),
        in_a_table(head, said),
    )
    return "\n\n".join(tables)


def _said(names: Names, odds: np.ndarray, ruled: np.ndarray) -> list[np.ndarray]:
    """Which names are said: from each probability on, and by all limits together."""
    return [*(names.could_be_missing & (odds >= level) for level in SAID), ruled & names.could_be_missing]


def main(arguments: Sequence[str] | None = None) -> int:
    """Fit the odds, print how good they are, and write them where that is asked; exit code 2 without records enough."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    default = f"may be repeated; default: all but {' and '.join(UNFITTED)}"
    parser.add_argument("--studies", choices=STUDIES, action="append", help=default)
    parser.add_argument("--write", action="store_true", help="put the model into discovery/odds.json")
    parser.add_argument("--stale", action="store_true", help="take what other sources made, too")
    parser.add_argument("--folder", type=Path, default=FOLDER, help="where records are kept")
    parser.add_argument("--into", type=Path, default=ODDS, help="the file of the odds")
    given = parser.parse_args(arguments)
    studies = given.studies or [name for name in STUDIES if name not in UNFITTED]
    records, old = gathered(studies, "tuning", given.folder, given.stale)
    if old:
        print(f"STALE{'' if given.stale else ', left out'}: {', '.join(old)}", file=sys.stderr)
    names = names_of(records)
    if len(names.claims) < _LEAST_NAMES or names.true.all():
        print(f"{len(names.claims)} names: expected {_LEAST_NAMES} or more; run benchmarks/through_the_verb.py first")
        return 2
    found = fitted(names)
    made = f"python benchmarks/odds.py --write: {len(names.claims)} names of {len(records)} logs, "
    made += f"{(names.judge == JUDGES[1]).sum()} of them judged by rollouts, "
    made += f"cross-validated log score {log_score(found.odds, names.true):.4f}"
    models = {word: {"intercept": zero, "weights": weights} for word, (zero, weights) in found.models.items()}
    content = rounded({**models, "calibration": list(found.calibration), **base_rates(records), "made": made})
    print(json.dumps(content, indent=1))
    own = log_score(found.own, names.true)
    common, apart = found.price
    print(
        f"\nprice of weights {common:g}, of differences from them {apart:g}; log score on the fit's names {own:.4f}\n"
    )
    print(report(names, found.odds))
    scores = [("without companions", "", f"{log_score(fitted(names, 'companions').odds, names.true):.4f}")]
    for name, values in TRIED.items():
        for value in values:
            with patch.object(claims, name, value):
                told = names_of(records)
            scores.append((name, f"{value:g}", f"{log_score(fitted(told).odds, told.true):.4f}"))
    print(f"\n{in_a_table(('how companions doubt', 'value', 'log score'), scores)}")
    if given.write:
        given.into.write_text(json.dumps(content) + "\n", encoding="utf-8")
        print(f"wrote {given.into}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
