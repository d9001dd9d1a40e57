"""The tables of the neural study, and the sentences that their figures make."""

from collections.abc import Mapping, Sequence
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
    mine, theirs = values(records, name, part, *keys), values(records, other, part, *keys)
    if not mine.size or not theirs.size:
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
        cells = [name]
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
    """One row a case: what the limits of the paper ask."""
    lines = [
        "| case | hybrid LSTM against calibrated, one step | hybrid TCN | hybrid LSTM against pure LSTM, one step |"
        " hybrid TCN against pure TCN | LSTM against MLP, 10 s rollouts | TCN against MLP |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    step, rolled = ("acceleration", "rmse"), ("rollout", "10")
    for name, (_, records) in results.items():
        pairs = (
            ("hybrid LSTM", BASELINE, step),
            ("hybrid TCN", BASELINE, step),
            ("hybrid LSTM", "pure LSTM", step),
            ("hybrid TCN", "pure TCN", step),
            ("hybrid LSTM", "hybrid MLP", rolled),
            ("hybrid TCN", "hybrid MLP", rolled),
        )
        cells = [percent(relative(records, a, b, "held", *keys)) for a, b, keys in pairs]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)
