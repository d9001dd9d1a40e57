"""The figures of the study, and the page that tells them beside what must hold."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from undertow.discovery.evidence.weighing import CERTAINLY

from .worlds import BY_FILE, PARTS, SEEDS, WAVES

WEIGHT = 0.03
"""Share by which 10 s rollouts along the log must change without an effect, or it does not matter beside the others."""


def exact(record: Mapping[str, Any]) -> bool:
    """True when what is named is what is hidden, and nothing else."""
    return set(record["missing"]) == set(record["hidden"]) and not record["unnamed"]


def wrong(record: Mapping[str, Any]) -> list[str]:
    """What is named and not hidden, terms without a name included."""
    return [name for name in record["missing"] if name not in record["hidden"]] + record["unnamed"]


def told_by_no_judge(record: Mapping[str, Any]) -> str:
    """Why a judge who knows what is hidden could not name it from this log, in words; empty where one could.

    An effect that hardly changes rollouts beside the others is immaterial to anybody; and a rival that the truth beats
    by less than 10.6 is right in more than one of 1,000 logs like this one, whatever the method.
    """
    light = [name for name, share in record["matters"].items() if share < WEIGHT]
    rival = record["scores"].get("rival")
    told = [f"without {name}, 10 s rollouts change by {100.0 * record['matters'][name]:.1f} %" for name in light]
    if rival is not None and rival["worse"] < CERTAINLY:
        told.append(f"{' and '.join(rival['by'])} in place of {rival['of']}: {rival['worse']:+.1f}")
    return "; ".join(told)


def summary(records: Sequence[Mapping[str, Any]]) -> dict[str, float | None]:
    """The figures of a set of logs; None where there is nothing to measure."""
    terms = [term for record in records for term in record["terms"]]
    errors = [term["error"] for term in terms]
    rolled = [r for r in records if r["rollout"] is not None and r["noise"] != "clean"]
    ratios = [r["rollout"] for r in rolled]
    hiding = [r for r in records if r["hidden"]]

    def share(hits: Sequence[float]) -> float | None:
        return float(np.mean(hits)) if hits else None

    return {
        "logs": len(records),
        "first": share([r["first"] in r["hidden"] and r["standing"][r["first"]] != "no evidence" for r in hiding]),
        "exact": share([exact(r) for r in records]),
        "weighty": share([exact(r) for r in hiding if min(r["matters"].values()) >= WEIGHT]),
        "false": share([len(wrong(r)) for r in records]),
        "wrong": share([bool(wrong(r)) for r in records]),
        "known": share([s in ("missing", "alias") for r in hiding for s in r["standing"].values()]),
        "open": share([s != "no evidence" for r in hiding for s in r["standing"].values()]),
        "median": float(np.median(errors)) if errors else None,
        "p90": float(np.quantile(errors, 0.9)) if errors else None,
        "covered": share([term["covered"] for term in terms if term["told"]]),
        "untold": share([not term["told"] for term in terms]),
        "rollout": float(np.median(ratios)) if ratios else None,
        "near": share([ratio <= 1.1 for ratio in ratios]),
        "lawful": share([r["rollout"] <= 1.1 for r in rolled if r["lawful"]]),
        "seconds": float(np.median([r["seconds"] for r in records])),
    }


COLUMNS = (
    ("logs", "logs", "{:.0f}"),
    ("first", "first right", "{:.1%}"),
    ("exact", "exact set", "{:.1%}"),
    ("weighty", "exact where each effect matters", "{:.1%}"),
    ("wrong", "wrongly certain", "{:.1%}"),
    ("false", "false discoveries a log", "{:.2f}"),
    ("known", "hidden effect named or in its alias group", "{:.1%}"),
    ("open", "or called possible", "{:.1%}"),
    ("median", "coefficient error, median", "{:.1%}"),
    ("p90", "90 %", "{:.1%}"),
    ("covered", "95 % intervals cover", "{:.1%}"),
    ("untold", "parameters without an interval", "{:.1%}"),
    ("rollout", "rollout error over the true model's, median", "{:.3f}"),
    ("near", "within 10 %", "{:.1%}"),
    ("lawful", "the same, true model lawful", "{:.1%}"),
    ("seconds", "time [s]", "{:.1f}"),
)
LIMITS = (
    ("one effect, field: first-ranked right", ("singles",), "first", 0.99, None),
    ("one effect, field: exact set", ("singles",), "exact", 0.97, None),
    ("one effect, rough: first-ranked right", ("rough",), "first", 0.97, None),
    ("one effect, rough: exact set", ("rough",), "exact", 0.92, None),
    ("two effects: exact set", ("pairs",), "exact", 0.95, None),
    ("three effects: exact set", ("triples",), "exact", 0.97, None),
    ("nothing hidden, waves included: anything named", ("nothing", "waves"), "wrong", None, 0.02),
    ("gentle: wrongly certain", ("gentle",), "wrong", None, 0.03),
    ("gentle: right effect missing or in its alias group", ("gentle",), "known", 0.90, None),
    ("coefficient error, median", ("singles", "pairs", "triples"), "median", None, 0.02),
    ("coefficient error, 90th percentile", ("singles", "pairs", "triples"), "p90", None, 0.08),
    ("95 % intervals cover the truth, field", ("singles", "pairs", "triples"), "covered", 0.92, 0.98),
    ("95 % intervals cover the truth, rough", ("rough",), "covered", 0.92, 0.98),
    ("95 % intervals cover the truth, gentle", ("gentle",), "covered", 0.92, 0.98),
    ("95 % intervals cover the truth, zigzag", ("zigzag",), "covered", 0.92, 0.98),
    ("rollouts within 10 % of the true model's: share of logs", ("singles", "pairs", "triples"), "near", 0.95, None),
    ("the same where the true model dissipates", ("singles", "pairs", "triples"), "lawful", 0.95, None),
)


INTRODUCTION = f"""
Each log is 300 s of a random sister of `blueboat`, `otter` or `blueboat_paper` (masses, added masses and damping each
varied by up to a third), with random effects of the catalogue hidden in it. Their size is random too, but large enough
that each alone changes 10 s rollouts by 3 %. A free thrust curve is never hidden beside a scale of all or of astern
thrust, which are special cases of it, nor another mass beside added mass where the centre of gravity is the origin:
there only their sums act. Odometry comes at 20 Hz, commands at 10 Hz. Field noise is 0.015 m/s and
0.006 rad/s, rough noise 0.04 m/s and 0.015 rad/s (standard deviations), with noise on heading and position, jitter of
the time stamps and 1 % dropouts. Waves are a JONSWAP band of 0.3 to 0.8 Hz with a significant orbital velocity of
{WAVES[0]:g} to {WAVES[1]:g} m/s, which the sensors see and no force of the model makes.

Discovery gets the first 85 % of a log; one log in {BY_FILE} goes through a file and the reader, as a user's would.
Seeds {SEEDS["tuning"][0]} to {len(PARTS) * SEEDS["tuning"][1] - 1} are for tuning, seeds from {SEEDS["reporting"][0]}
for reporting only.
"""
EXPLANATION = """
*First right*: the best-ranked effect is hidden. *Exact set*: all that is hidden is called missing, and nothing else.
*Matters*: 10 s rollouts along the log change by 3 % or more without the effect and with the others. *Wrongly certain*:
an effect or an unnamed term is called missing that is not hidden. *Possible*: the findings say that this log cannot
tell. Errors and intervals are of all parameters of rightly named effects; a log gives no interval to a parameter of
which it says nothing, such as the thrust of a command that it never holds. Errors are relative to the true value, of
earth-fixed vectors to their length. Rollouts last 10 s, on the last 15 % of the log, all axes together. *Lawful*: the
hull with its hidden effects dissipates over the box of velocities in its log. A random coupling often does not, at
corners that the boat never visits; corrected models always do.
"""


def table(results: Mapping[str, Sequence[Mapping[str, Any]]], seeds: str) -> str:
    """The study as a page in Markdown."""
    total, full = sum(map(len, results.values())), sum(part.full for part in PARTS.values())
    lines = [
        "# Hidden effects: how often discovery is right",
        f"Written by `benchmarks/hidden_effects.py` ({seeds} seeds, {total} logs of the full study's "
        f"{full}); not by hand.",
        INTRODUCTION,
        "## Figures",
        f"| hidden, programme, noise | {' | '.join(title for _, title, _ in COLUMNS)} |",
        f"| --- |{' ---: |' * len(COLUMNS)}",
    ]
    for part, records in results.items():
        figures = summary(records)
        cells = ("" if (x := figures[key]) is None else form.format(x) for key, _, form in COLUMNS)
        lines.append(f"| {PARTS[part].title} | {' | '.join(cells)} |")
    lines += [EXPLANATION, "## What must hold", "| | limit | figure | holds |", "| --- | ---: | ---: | --- |"]
    for title, parts, key, low, high in LIMITS:
        measured = [r for part in parts for r in results.get(part, ())]
        figure = summary(measured)[key] if measured else None
        bounds = " to ".join(f"{x:.0%}" for x in (low, high) if x is not None)
        sign = "" if None not in (low, high) else "at least " if high is None else "at most "
        holds = figure is not None and (low is None or figure >= low) and (high is None or figure <= high)
        shown = ("not run", "") if figure is None else (f"{figure:.1%}", "yes" if holds else "**no**")
        lines.append(f"| {title} | {sign}{bounds} | {shown[0]} | {shown[1]} |")
    lines += ["", *informed(results.get("triples", ())), "## Every log that went wrong", *failures(results)]
    return "\n".join(lines) + "\n"


def informed(triples: Sequence[Mapping[str, Any]]) -> list[str]:
    """What a judge who knows what is hidden would name of the logs with three effects."""
    beyond = sum(bool(told_by_no_judge(r)) for r in triples if not exact(r))
    could = f"{len(triples) - beyond} of {len(triples)} ({(len(triples) - beyond) / max(len(triples), 1):.1%})"
    told = f"Three effects: a judge who knows what is hidden could name it exactly in {could}; the bounds stand below."
    return [told, ""] if beyond else []


def failures(results: Mapping[str, Sequence[Mapping[str, Any]]]) -> list[str]:
    """A row for each log that was not exact; of gentle and zigzag logs only those that were wrongly certain."""
    rows = []
    for part, records in results.items():
        for r in records:
            if exact(r) or (part in ("gentle", "zigzag") and not wrong(r)):
                continue
            gap = r["scores"]["selected"]
            scores = "" if gap is None else f"{r['scores']['truth'] - gap:+.1f}"
            named = (r["hidden"], [*r["missing"], *(term.replace("|", r"\|") for term in r["unnamed"])])
            words = [", ".join(names) or "nothing" for names in named]
            where = f"{r['seed']} ({r['vehicle']}, {r['programme']}, {r['noise']})"
            why = told_by_no_judge(r)
            rows.append(f"| {part} | {where} | {' | '.join(words)} | {', '.join(r['possible'])} | {scores} | {why} |")
    if not rows:
        return ["None."]
    head = [
        "Score: of the true set less that of the selected one; below zero the search missed a better model, above zero",
        "the criterion prefers what was selected. Gentle and zigzag logs are listed where a wrong effect was named.",
        "Bound: why a judge who knows what is hidden could not name it from this log: an effect that changes 10 s",
        f"rollouts by less than {100.0 * WEIGHT:.0f} % beside the others, or what is worse in its place by less than",
        f"{CERTAINLY:.1f} log-likelihood (ln 40/0.001, docs/decisions.md): more than one in 1,000 such names is wrong.",
        "",
        "| part | seed | hidden | named | selected, not sure | score | bound |",
        "| --- | --- | --- | --- | --- | ---: | --- |",
    ]
    return head + rows
