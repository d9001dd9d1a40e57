"""Fit the odds of names to the tuning records of all studies, and say how good they are.

A name is true where it is hidden, or a fair part of the cause. The facts of its claim are those that
`through_the_verb.py` keeps, their features those of `discovery/judgement.py`; the odds are a bounded logistic model
with as few features as earn their place on causes that the fit has not seen (`study/fitted_odds.py`).

    python benchmarks/odds.py [--studies NAME]... [--write] [--stale] [--folder FOLDER]

`--write` puts the model into `discovery/odds.json`.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from study.fitted_odds import Names, applied, as_odds, chosen, cross_validated, fit, hard_rule, names_of
from study.records import Kept, in_a_table
from study.scoring import EDGES, ODDS, WORLDS, bare, label, log_score, reliability
from study.studies import FOLDER, STUDIES, stored

SAID = (0.95, 0.8)
_LEAST_NAMES = 200
"""Names below which no model is fitted: fewer than a dozen for each number."""


def gathered(studies: Sequence[str], purpose: str, folder: Path, stale: bool) -> tuple[Kept, list[str]]:
    """Records of some studies as they were kept, and which of them other sources made."""
    records, old = [], []
    for study in studies:
        file = stored(study, purpose, folder)
        if file.stale:
            old.append(f"{study}-{purpose}")
        if stale or not file.stale:
            records += file.records
    return records, old


def base_rates(records: Kept) -> dict[str, float]:
    """How often a name that stands in no model is true: one that nearly earns its price, and any other."""
    nearly, right, others, missed = 0, 0, 0, 0
    for record in records:
        claimed = [claim["key"] for claim in record.get("claims", ())]
        close = [name for name in record.get("nearly", ()) if name not in claimed]
        unclaimed = [name for name in record["true"] if not any(label(key, [name], ()) == "true" for key in claimed)]
        there = [name for name in unclaimed if name in close or bare(name) in map(bare, close)]
        nearly, right = nearly + len(close), right + len(there)
        others += record.get("unclaimed", 0) - len(close)
        missed += (len(unclaimed) - len(there)) if "unclaimed" in record else 0
    return {"unselected": (missed + 0.5) / (others + 10.0), "nearly": (right + 0.5) / (nearly + 10.0)}


def sensor_rates(records: Kept) -> dict[str, float]:
    """How often an error of a sensor that was told was there, by the word for it."""
    found = {}
    for word, field in (("present", "sensors"), ("possible", "sensors_possible")):
        told = [name in record["sensors_true"] for record in records for name in record.get(field, ())]
        found[word] = (sum(told) + 0.5) / (len(told) + 1.0)
    asked = [record for record in records if "sensors" in record]
    silent = [name for r in asked for name in r["sensors_true"] if name not in (*r["sensors"], *r["sensors_possible"])]
    return found | {"no evidence": (len(silent) + 0.5) / (8.0 * len(asked) + 1.0)}


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
    parser.add_argument("--studies", choices=STUDIES, action="append", help="may be repeated; default: all but field")
    parser.add_argument("--write", action="store_true", help="put the model into discovery/odds.json")
    parser.add_argument("--stale", action="store_true", help="take what other sources made, too")
    parser.add_argument("--folder", type=Path, default=FOLDER, help="where records are kept")
    parser.add_argument("--into", type=Path, default=ODDS, help="the file of the odds")
    given = parser.parse_args(arguments)
    studies = given.studies or [name for name in STUDIES if name != "field"]
    records, old = gathered(studies, "tuning", given.folder, given.stale)
    if old:
        print(f"STALE{'' if given.stale else ', left out'}: {', '.join(old)}", file=sys.stderr)
    names = names_of(records)
    if len(names.claims) < _LEAST_NAMES or names.true.all():
        print(f"{len(names.claims)} names: expected {_LEAST_NAMES} or more; run benchmarks/through_the_verb.py first")
        return 2
    columns, ridge = chosen(names)
    odds = cross_validated(names, columns, ridge)
    weights = fit(columns, names.column(columns), names.true, ridge)
    model = {name: float(f"{weight:.4g}") for name, weight in zip(columns, weights[1:], strict=True) if weight}
    rates = {name: float(f"{rate:.3g}") for name, rate in base_rates(records).items()}
    made = f"python benchmarks/odds.py --write: {len(names.claims)} names of {len(records)} logs, "
    made += f"cross-validated log score {log_score(odds, names.true):.4f}"
    sensors = {word: float(f"{rate:.3g}") for word, rate in sensor_rates(records).items()}
    content = {"intercept": float(f"{weights[0]:.4g}"), "weights": model, **rates, "sensors": sensors, "made": made}
    print(json.dumps(content, indent=1))
    own = log_score(applied(weights, names.column(columns)), names.true)
    print(f"\nprice of weights {ridge:g}; log score on the names of the fit {own:.4f}\n\n{report(names, odds)}")
    if given.write:
        given.into.write_text(json.dumps(content) + "\n", encoding="utf-8")
        print(f"wrote {given.into}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
