"""The tables of the neural study, and the sentences that their figures make."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from undertow.physics.frames import AXES

from .cases import Setting

Records = Sequence[Mapping[str, Any]]
BASELINE = "Fossen calibrated"


def values(records: Records, name: str, part: str, *keys: str) -> np.ndarray:
    """A figure of one model over all seeds, by the path of its keys, surge, sway and yaw: (seeds, 3)."""
    found = []
    for record in records:
        if record["name"] != name:
            continue
        inner: Any = record[part]
        for key in keys:
            inner = inner[key]
        found.append([float("nan") if inner[axis] is None else inner[axis] for axis in AXES])
    return np.array(found)


def cell(figures: np.ndarray, digits: int = 3) -> str:
    """Mean and standard deviation over the seeds."""
    if figures.size == 0 or not np.isfinite(figures).all():
        return "-"
    spread = figures.std(ddof=1) if figures.size > 1 else 0.0
    text = f"{figures.mean():.{digits}f}"
    return text if spread < 0.5 * 10.0**-digits else f"{text} ± {spread:.{digits}f}"


def relative(records: Records, name: str, other: str, part: str, *keys: str) -> np.ndarray:
    """By how much a model's errors lie below another's, mean over the axes, for each seed: 0.3 is 30 % less."""
    seeds = [{r["seed"] for r in records if r["name"] == each} for each in (name, other)]
    both = [r for r in records if r["seed"] in seeds[0] & seeds[1]]
    mine, theirs = values(both, name, part, *keys), values(both, other, part, *keys)
    if not mine.size:
        return np.zeros(0)
    return 1.0 - (mine / theirs).mean(axis=1)


def table(records: Records, part: str) -> str:
    """One row a model: one-step and rollout errors by axis, against the calibrated model, and lawfulness."""
    head = (
        "| model | acceleration RMSE: surge, sway [m/s²], yaw [rad/s²] | MAE | R² | against calibrated |"
        " 2 s rollout: surge, sway [m/s], yaw [rad/s] | 10 s rollout | against calibrated | diverged | lawful |"
    )
    lines = [head, "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"]
    for name in dict.fromkeys(r["name"] for r in records):
        mine = [r for r in records if r["name"] == name]
        fewer = len(mine) < max(Counter(r["name"] for r in records).values())
        cells = [f"{name} ({len(mine)} seed{'s' * (len(mine) > 1)})" if fewer else name]
        for key, digits in (("rmse", 3), ("mae", 3), ("r2", 2)):
            found = values(records, name, part, "acceleration", key)
            cells.append(", ".join(cell(column, digits) for column in found.T))
            if key == "r2":
                cells.append(percent(relative(records, name, BASELINE, part, "acceleration", "rmse")))
        for horizon in ("2", "10"):
            cells.append(", ".join(cell(c) for c in values(records, name, part, "rollout", horizon).T))
        cells.append(percent(relative(records, name, BASELINE, part, "rollout", "10")))
        cells.append(str(sum(r[part]["rollout"]["10"]["diverged"] for r in mine)))
        lawful = [r["lawful"] for r in mine if "lawful" in r]
        cells.append(f"{sum(lawful)} of {len(lawful)}" if lawful else "")
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def percent(figures: np.ndarray) -> str:
    """A relative change over the seeds; minus is less error."""
    if figures.size == 0:
        return "-"
    spread = f" ± {100 * figures.std(ddof=1):.0f}" if figures.size > 1 else ""
    return f"{-100 * figures.mean():+.0f}{spread} %".replace("-", "−")


def page(results: Mapping[str, tuple[Setting, Records]]) -> str:
    """Every case as tables, after what they say about the hypotheses."""
    parts = [
        "# Neural corrections: the tables",
        "Written by `benchmarks/neural.py`; what they mean is told in [neural.md](neural.md). Mean ± standard "
        "deviation over the seeds: on Gazebo logs a seed is one of the networks, on simulated boats also one of the "
        "hull, the course and the noise. Errors are those of held-out data; *against calibrated* is the mean over the "
        "axes of the change of the error against the calibrated Fossen model of the same seed. A rollout that diverged "
        "counts with its clipped speeds. *Lawful*: in how many seeds no state of the envelope or of the validation "
        "data gains energy without thrust.",
    ]
    parts += [summary(results)]
    for name, (setting, records) in results.items():
        parts += [f"## {name[0].upper()}{name[1:]}", f"{setting.title}. Whole runs held out:", table(records, "held")]
        if setting.domain == "out":
            parts += ["For comparison, the held-out end of the runs that the models were trained on:"]
            parts += [table(records, "own")]
    return "\n\n".join(parts) + "\n"


def summary(results: Mapping[str, tuple[Setting, Records]]) -> str:
    """What must hold, case by case, and what becomes of the paper's three hypotheses."""
    lines = ["## What must hold", "", "| claim | case | limit | figure | holds |", "| --- | --- | --- | --- | --- |"]
    for claim, case, limit, figures, holds in claims(results):
        lines.append(f"| {claim} | {case} | {limit} | {percent(figures)} | {'yes' if holds else '**no**'} |")
    lines += [
        "",
        "Less error is minus. The better of LSTM and TCN counts in the first two claims; both in the last.",
        "",
    ]
    return "\n".join([*lines, "## The hypotheses", "", *hypotheses(results)])


Claim = tuple[str, str, str, np.ndarray, bool]


def claims(results: Mapping[str, tuple[Setting, Records]]) -> list[Claim]:
    """Each claim for each case that it is about, with the change of the error and whether it holds in the mean."""
    found: list[Claim] = []

    def best(records: Records, other: Callable[[str], str]) -> np.ndarray:
        pairs = [relative(records, f"hybrid {n}", other(n), "held", "acceleration", "rmse") for n in ("LSTM", "TCN")]
        return max((p for p in pairs if p.size), key=lambda p: float(p.mean()), default=np.zeros(0))

    for name, (_, records) in results.items():
        gain = best(records, lambda network: BASELINE)
        if gain.size:
            found.append(("one step, against calibrated", name, "at least −25 %", gain, gain.mean() >= 0.25))
    for name, (setting, records) in results.items():
        gain = best(records, lambda network: f"pure {network}")
        if gain.size and setting.domain == "out":
            found.append(("one step out of domain, against pure", name, "at least −14 %", gain, gain.mean() >= 0.14))
    for name, clearly in (("memory", True), ("no memory", False)):
        for network in ("LSTM", "TCN") if name in results else ():
            gain = relative(results[name][1], f"hybrid {network}", "hybrid MLP", "held", "rollout", "10")
            limit = "at least −20 %" if clearly else "no more than −5 %"
            holds = bool(gain.mean() >= 0.2 if clearly else gain.mean() <= 0.05)
            found.append((f"10 s rollouts, {network} against MLP", name, limit, gain, holds))
    return found


def hypotheses(results: Mapping[str, tuple[Setting, Records]]) -> list[str]:
    """The paper's hypotheses as sentences with figures."""
    step = ("acceleration", "rmse")
    out = [records for setting, records in results.values() if setting.domain == "out" and records]

    def times(name: str) -> str:
        ratios = [values(r, name, "held", *step) / values(r, name, "own", *step) for r in out]
        return f"{np.median(np.concatenate(ratios)):.1f}"

    def against(name: str, *keys: str) -> str:
        return percent(np.concatenate([relative(r, name, BASELINE, "held", *keys) for r in out]))

    r2 = {c: values(records, BASELINE, "held", "acceleration", "r2") for c, (_, records) in results.items()}
    worst = ", ".join(f"{c} {v.mean(axis=0).min():.2f}" for c, v in r2.items() if v.size)
    lines = [
        f"- **H1, physics alone is limited.** R² of the calibrated Fossen model on its worst axis: {worst}. Its form "
        "lacks what the boat has, and no values of its parameters replace that."
    ]
    if not out:
        return lines
    pure, hybrid = ("pure MLP", "pure LSTM", "pure TCN"), ("hybrid MLP", "hybrid LSTM", "hybrid TCN")
    lines.append(
        "- **H2, pure networks do not leave their domain.** One-step error on hard runs over that on the held-out end "
        "of the gentle runs that they were trained on (median over cases, seeds and axes; hard runs are livelier, so "
        f"that any model has more than 1): {', '.join(f'{n} {times(n)}' for n in pure)}; hybrids and others: "
        f"{', '.join(f'{n} {times(n)}' for n in (*hybrid, BASELINE, 'symbolic'))}."
    )
    for what, keys in (("one-step error", step), ("error of 10 s rollouts", ("rollout", "10"))):
        told = ", ".join(f"{n} {against(n, *keys)}" for n in (*pure, *hybrid, "symbolic"))
        lines.append(
            f"- **H3, hybrids beat both.** Out of domain, {what} against the calibrated model (mean ± standard "
            f"deviation over cases and seeds): {told}."
        )
    return lines
