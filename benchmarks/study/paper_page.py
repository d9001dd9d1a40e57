"""The page of the repeated paper: verdicts on its hypotheses, ablations, tables and figures, and the same as CSV."""

import csv
import io
from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np

from undertow.measurements.statistics.blocks import student
from undertow.physics.motion import AXES, Array
from undertow.physics.presentation import MINUS, counted, number
from undertow.reports.page.markup import Html, element, folded, table
from undertow.reports.page.page import document

from .paper_change import Change, Records, relative, values
from .paper_figures import HYBRID, MEASURES, PHYSICS, PURE, STEP, Results, figures_of
from .records import in_a_table

PARTS = {"own": "end of the runs that were trained on", "held": "whole runs that nothing was fitted to"}
ENOUGH = 0.9
"""R² below which the physics alone is called limited: a tenth of the motion is not explained."""


def document_of(results: Results, seeds: int, minutes: float) -> str:
    """The page as HTML."""
    parts = [
        element("h1", "The paper, repeated"),
        element("p", f"{_introduction(seeds)} This call took {minutes:.0f} minutes."),
        element("h2", "What becomes of its hypotheses"),
        *(element("p", sentence) for sentence in verdicts(results)),
        table(HYPOTHESIS_HEAD, hypothesis_rows(results), "lllll"),
        element("h2", "Ablations"),
        element("p", "Each row changes one thing; both models are of the same seeds, on whole runs that are held out."),
        table(ABLATION_HEAD, ablation_rows(results), "lllll"),
        element("h2", "Figures"),
        *figures_of(results),
        element("h2", "Tables"),
    ]
    for case, (setting, records) in results.items():
        for part, words in PARTS.items():
            parts.append(folded(f"{case}: {words}", element("p", f"{setting.title}."), _metrics(records, part)))
    return document("the paper, repeated", "The paper, repeated", parts, verb="benchmarks/paper.py")


def markdown_of(results: Results, seeds: int) -> str:
    """The page in Markdown: verdicts, errors by model and case, hypotheses and ablations."""
    cases = list(results)
    names = list(dict.fromkeys(name for _, records in results.values() for name in names_of(records)))
    errors = {
        what: [(name, *(_against(records, name, keys) for _, records in results.values())) for name in names]
        for what, keys in MEASURES
    }
    parts = [
        "# The paper, repeated",
        _introduction(seeds),
        *(f"- {case}: {setting.title}" for case, (setting, _) in results.items()),
        "## What becomes of its hypotheses",
        *(f"- {sentence}" for sentence in verdicts(results)),
        *(
            part
            for what, rows in errors.items()
            for part in (
                f"## Errors of {what}",
                "Against the calibrated Fossen model, held-out runs, geometric mean of axes and seeds; minus is less.",
                in_a_table(("model", *cases), rows),
            )
        ),
        "## Hypotheses, one by one",
        in_a_table(HYPOTHESIS_HEAD, hypothesis_rows(results), "---"),
        "## Ablations",
        "Each row changes one thing; both models are of the same seeds, on whole runs that are held out.",
        in_a_table(ABLATION_HEAD, ablation_rows(results), "---"),
        "Written by `python benchmarks/paper.py --table`; do not edit.",
    ]
    return "\n\n".join(parts).replace("\n\n- ", "\n- ") + "\n"


def _against(records: Records, name: str, keys: Sequence[str]) -> str:
    return "0 %" if name == PHYSICS else str(Change(relative(records, name, PHYSICS, "held", *keys)))


def _introduction(seeds: int) -> str:
    return (
        "The paper that this project began with compares Fossen's equations, a pure network and a perceptron beside "
        "them, one step ahead, and announces networks with memory. It is not at hand; its preparation (10 Hz, "
        "1.2 Hz, 70/15/15 % in the order of time) and hypotheses are repeated as the project's design tells them, and "
        "figures 2 to 4 show what such figures show, by our choice. Its errors are those of predictions as the model "
        "says them; beside them stand those of predictions that went through the filter of the measurement, which is "
        f"the fair comparison. Over {seeds} seed{'s' * (seeds > 1)}, with 95 % intervals of Student's t; on "
        "Gazebo a seed is one of the networks, of the BlueBoat also which third of the logs is held out. The networks "
        "have a short recipe of 40 epochs, and count whole."
    )


HYPOTHESIS_HEAD = ("hypothesis", "case", "measure", "figure", "verdict")


def hypothesis_rows(results: Results) -> list[tuple[str, ...]]:
    """Each hypothesis for each case and measure."""
    rows = [("H1", case, "R², worst axis", f"{w:.2f}".replace("-", MINUS), _limited(w)) for case, w in worst(results)]
    for case, (setting, records) in results.items():
        if setting.domain == "out":
            for name in PURE:
                there = Change(np.log(_leaving(records, name) / _leaving(records, PHYSICS)))
                rows.append(("H2", case, f"{name}, one step, leaving its domain", _times(there), _leaves(there)))
    for case, (_, records) in results.items():
        for what, keys in MEASURES:
            for name in HYBRID:
                both = [
                    Change(relative(records, f"hybrid {name}", other, "held", *keys))
                    for other in (PHYSICS, f"pure {name}")
                ]
                told = f"{both[0]} against Fossen, {both[1]} against the pure one"
                rows.append(("H3", case, f"hybrid {name}, {what}", told, _beats(both)))
    return rows


def worst(results: Results) -> list[tuple[str, float]]:
    """R² of the calibrated vehicle on its worst axis, by case."""
    return [
        (case, float(values(records, PHYSICS, "held", "acceleration", "r2").mean(axis=0).min()))
        for case, (_, records) in results.items()
    ]


def _limited(r2: float) -> str:
    return "holds" if r2 < ENOUGH else "does not hold"


def _leaving(records: Records, name: str) -> Array:
    """Error on held-out runs over that on the end of a model's own, geometric mean of the axes, by seed."""
    ratio = values(records, name, "held", *STEP) / values(records, name, "own", *STEP)
    return np.exp(np.log(ratio).mean(axis=1))


def _times(there: Change) -> str:
    ends = f" ({there.low:.1f} to {there.high:.1f})" if np.isfinite(there.low) else ""
    return f"{there.mean:.1f}{ends} times as much as Fossen's error grows"


def _leaves(there: Change) -> str:
    return {"more error": "holds", "less error": "does not hold"}.get(there.verdict, there.verdict)


def _beats(both: Sequence[Change]) -> str:
    told = {change.verdict for change in both}
    if told & {"one seed", "not run"}:
        return "one seed" if "one seed" in told else "not run"
    if told == {"less error"}:
        return "holds"
    return "does not hold" if "more error" in told else "open"


def verdicts(results: Results) -> Iterator[str]:
    """A sentence on each hypothesis, also where it goes against the paper."""
    rows = hypothesis_rows(results)
    for name, says in (
        ("H1", "physics alone is limited"),
        ("H2", "a pure network does not leave its domain"),
        ("H3", "a hybrid beats the physics and the pure network"),
    ):
        mine = [row for row in rows if row[0] == name]
        holds, fails = (sum(row[-1] == word for row in mine) for word in ("holds", "does not hold"))
        if not mine:
            yield f"{name}, {says}: no case asks for it."
            continue
        rest = len(mine) - holds - fails
        known = {len(mine): "holds", 0: "does not hold" if fails else "open"}
        verdict = known.get(holds, "holds in part")
        against = Counter(row[1] for row in mine if row[-1] == "does not hold")
        cases = "; ".join(f"{case} ({counted(rows, 'row')})" for case, rows in against.items())
        counts = f"{holds} of {len(mine)} rows say so, {fails} the contrary, {rest} neither."
        yield f"{name}, {says}: {verdict}. {counts}{f' Against it: {cases}.' if cases else ''}"


ABLATION_HEAD = ("what changes", "case", "one step", "10 s rollouts", "verdict (rollouts)")
CHANGED = {
    "memory: LSTM for MLP": ("hybrid LSTM", "hybrid MLP"),
    "memory: TCN for MLP": ("hybrid TCN", "hybrid MLP"),
    "without the loss of physics": ("hybrid MLP without laws", "hybrid MLP"),
    "heading as cosine and sine": ("hybrid MLP that sees heading", "hybrid MLP"),
    "change of the velocities, as of an IMU": ("hybrid MLP that sees its change", "hybrid MLP"),
    "robust loss (Huber)": ("hybrid MLP, robust loss", "hybrid MLP"),
    "augmentation": ("hybrid MLP, varied", "hybrid MLP"),
    "calibrating the physics first": ("hybrid MLP", "residual MLP"),
}


def ablation_rows(results: Results) -> list[tuple[str, ...]]:
    """What each change of a hybrid does, by case."""
    rows = []
    for what, (mine, other) in CHANGED.items():
        for case, (_, records) in results.items():
            changes = [Change(relative(records, mine, other, "held", *keys)) for _, keys in MEASURES]
            rows.append((what, case, *map(str, changes), changes[1].verdict))
    return rows


def names_of(records: Records) -> list[str]:
    """The models of a case."""
    return list(dict.fromkeys(record["name"] for record in records))


def _metrics(records: Records, part: str) -> Html:
    head = ["model", *(f"{axis}, {how}" for how in ("filtered", "as said") for axis in AXES), "R², filtered, worst"]
    head += ["R², as said, worst", "10 s: surge, sway [m/s], yaw [rad/s]"]
    rows = []
    for name in names_of(records):
        cells = [name]
        for key in ("acceleration", "unfiltered"):
            cells += [_cell(column) for column in values(records, name, part, key, "rmse").T]
        for key in ("acceleration", "unfiltered"):
            cells.append(_cell(values(records, name, part, key, "r2").min(axis=1)))
        cells.append(", ".join(_cell(column) for column in values(records, name, part, "rollout", "10").T))
        rows.append(cells)
    return table(head, rows, caption="acceleration: root mean square error [m/s², m/s², rad/s²]")


def _cell(column: Array) -> str:
    mean, half = _mean(column)
    ends = f" ± {number(half, 2)}" if np.isfinite(half) and half > 0.0 else ""
    return f"{number(mean, 3)}{ends}"


def _mean(column: Array) -> tuple[float, float]:
    """Mean over the seeds and half of its 95 % interval; NaN with one seed."""
    if column.size < 2:
        return float(column.mean()), float("nan")
    return float(column.mean()), float(student(column.size - 1, 0.975) * column.std(ddof=1) / np.sqrt(column.size))


def csv_files(results: Results) -> dict[str, str]:
    """The tables as CSV, by the name of their file."""
    metrics, rollouts = [], []
    for case, (_, records) in results.items():
        for part in PARTS:
            for name in names_of(records):
                for key, how in (("acceleration", "filtered"), ("unfiltered", "as said")):
                    for metric in ("rmse", "mae", "r2"):
                        found = values(records, name, part, key, metric)
                        metrics += [
                            (case, part, name, how, metric, axis, *_mean(column), column.size)
                            for axis, column in zip(AXES, found.T, strict=True)
                        ]
                for horizon in ("2", "10"):
                    found = values(records, name, part, "rollout", horizon)
                    rollouts += [
                        (case, part, name, horizon, axis, *_mean(column), column.size)
                        for axis, column in zip(AXES, found.T, strict=True)
                    ]
    tail = ("mean", "half_ci95", "seeds")
    return {
        "metrics.csv": _csv(("case", "part", "model", "prediction", "metric", "axis", *tail), metrics),
        "rollouts.csv": _csv(("case", "part", "model", "horizon_s", "axis", *tail), rollouts),
        "hypotheses.csv": _csv(HYPOTHESIS_HEAD, hypothesis_rows(results)),
        "ablations.csv": _csv(ABLATION_HEAD, ablation_rows(results)),
    }


def _csv(head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(["" if cell != cell else cell for cell in row] for row in rows)
    return stream.getvalue()
