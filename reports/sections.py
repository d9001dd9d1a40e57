"""The sections of the report page about errors: verdict, falling error, measured against predicted, where it fails."""

from collections.abc import Mapping, Sequence
from typing import Any

from .figures import regime_bars, speeds, step_bars, track
from .markup import Html, element, figure, lines, render, table
from .plotted import held_out_stretch, regime_rows
from .failing.regimes import regime_table
from .run_folder import RunFolder
from .wording import (
    ACCELERATION_UNITS,
    AXES,
    ROLLOUT_UNITS,
    finite,
    listing,
    percent,
    pick_horizon,
    step_words,
    typeset,
    unit_text,
    words,
)

ARROW = "\N{RIGHTWARDS ARROW}"
LEGEND = (("measured", "measured"), ("before", "before: the nominal model"), ("after", "after: the corrected model"))
LONGEST_NAME = 30  # letters of an effect's name that fit beside the bars


def headline(run: RunFolder) -> Html:
    """The verdict in at most three sentences, and the rollout error before and after as big figures."""
    findings, steps = run.findings, run.findings["steps"]
    horizon, metric = _hero(steps)
    before, after = (finite(step["rollout_rmse"].get(horizon, {}).get(metric)) for step in (steps[0], steps[-1]))
    missing = [words(str(name)) for name in findings["missing"]]
    lacking = f"The model lacks {listing(missing)}." if missing else "Nothing is missing that this log can show."
    sentences = []
    if len(steps) > 1 and after < before:
        added = [f"adding {'it' if len(missing) == 1 else 'them'}"] * bool(missing)
        done = listing([*["calibrating its parameters"] * bool(findings.get("calibrated")), *added]) or "that"
        sentences.append(
            f"{done.capitalize()} removes {percent(1.0 - after / before)} of the {metric} "
            f"error of {horizon} s predictions on motion that the fit never saw."
        )
    for place in (findings.get("failures") or [])[:1]:
        share = f"{percent(place.get('share_of_error'))} of the {place.get('axis')} error"
        sentences.append(f"The nominal model fails most here: {place.get('where')} ({share}).")
    changed = len(steps) > 1
    figures = [_big(before, ROLLOUT_UNITS[metric], "before", "before" if changed else "the nominal model")]
    if changed:
        figures += [element("span", ARROW, cls="arrow"), _big(after, ROLLOUT_UNITS[metric], "after", "after")]
    ends = (steps[0], steps[-1]) if changed else (steps[0],)
    by_axis = []
    for axis in AXES:
        errors = (typeset(step["rollout_rmse"].get(horizon, {}).get(axis), 2) for step in ends)
        by_axis.append(f"{axis} {f' {ARROW} '.join(errors)} {ROLLOUT_UNITS[axis]}")
    what = element(
        "div",
        element("strong", f"{metric} error of {horizon} s predictions"),
        *lines(["root mean square, open loop, on held-out data"]),
        element("div", *(element("span", text) for text in by_axis), cls="axes"),
        cls="what",
    )
    return render(
        element("h1", str(findings.get("headline") or lacking)),
        *[element("p", " ".join(sentences), cls="lead")] * bool(sentences),
        element("div", *figures, what, cls="card numbers"),
    )


def falling_error(run: RunFolder) -> Html:
    """Rollout and acceleration errors after each added effect."""
    steps = run.findings["steps"]
    horizon, _ = _hero(steps)
    names = ["nominal model", *(step_words(step) for step in steps[1:])]
    names = [
        name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 1]}\N{HORIZONTAL ELLIPSIS}" for name in names
    ]

    def rollout(axis: str) -> list[Any]:
        return [step["rollout_rmse"].get(horizon, {}).get(axis) for step in steps]

    def pointwise(axis: str) -> list[Any]:
        return [step["acceleration_rmse"].get(axis) for step in steps]

    top = [step_bars("position", "m", rollout("position"), names)]
    top += [step_bars(axis, ROLLOUT_UNITS[axis], rollout(axis)) for axis in AXES]
    bottom = [step_bars(axis, ACCELERATION_UNITS[axis], pointwise(axis)) for axis in AXES]
    side = element(
        "div",
        element("b", "Acceleration error"),
        *lines(["along the measured motion,", "after the same steps"]),
        cls="side",
    )
    drawing = element(
        "figure",
        element("h3", f"Error of {horizon} s predictions"),
        element("div", *top, cls="plots steps"),
        element("div", side, *bottom, cls="plots steps"),
        element(
            "figcaption",
            "Read downwards: each row adds one effect, and shorter is better. Every column has its own scale. "
            "Predictions run open loop from measured states; all errors are root mean squares on held-out data.",
        ),
        cls="card",
    )
    return render(
        element("h2", "The error, step by step" if len(steps) > 1 else "The error of the nominal model"), drawing
    )


def predictions(run: RunFolder) -> Html:
    """Measured against predicted: speeds over time, the track, and the table of all compared models."""
    stretch = held_out_stretch(run.series)
    seconds = stretch["time"].iloc[-1] - stretch["time"].iloc[0]
    over_time = figure(
        [speeds(stretch)],
        f"{typeset(float(seconds), 2)} s of motion that the fit never saw. At each dotted line the predictions start "
        "again from the measured state and then run open loop: the farther a coloured line strays before the next one, "
        "the worse the model. Lines that leave the frame go on outside it.",
        cls="wide",
    )
    from_above = figure(
        [track(stretch)],
        "The same motion from above. Every branch that leaves the measured track is one prediction; circles mark "
        "the starts.",
    )
    beside = element("div", from_above, element("div", *_compared(run.comparison), cls="card"), cls="columns")
    return render(element("h2", "Measured against predicted"), legend(), over_time, beside)


def where_it_fails(run: RunFolder) -> Html:
    """The error by regime before and after, and the worst places in words."""
    rows, held_out = regime_rows(run.series)
    drawings = regime_bars(regime_table(rows, "before"), regime_table(rows, "after"))
    source = (
        "held-out data" if held_out else "all parts of the log, because the held-out part alone is too short for a map"
    )
    places = run.comparison.get("failures") or run.findings.get("failures") or []
    worst = [
        (
            words(str(place.get("model", "nominal"))),
            render(*lines([str(place.get("where"))])),
            str(place.get("axis")),
            percent(place.get("share_of_error")),
            percent(place["share_of_rows"]) if "share_of_rows" in place else f"{place.get('rows', '')} rows",
            f"{typeset(place['rmse'], 2)} {unit_text(str(place.get('unit', '')))}" if "rmse" in place else "",
        )
        for place in places
    ]
    head = ("model", "where its error gathers", "axis", "share of the error", "share of the time", "error there")
    return render(
        element("h2", "Where it fails"),
        legend(("before", "after")),
        figure(
            drawings,
            f"Root-mean-square acceleration error by regime, on {source}. A tall orange bar beside a short blue one "
            "is a regime that the missing effects explain; two tall bars are a regime that still waits for its reason. "
            "The percentage under each bin is its share of the time.",
            cls="pair",
        ),
        *[element("div", table(head, worst, "lll"), cls="card")] * bool(worst),
    )


def legend(roles: Sequence[str] = ("measured", "before", "after")) -> Html:
    """What the colours mean."""
    return element(
        "div", *(element("span", element("i"), text, cls=role) for role, text in LEGEND if role in roles), cls="key"
    )


def _hero(steps: Sequence[Mapping[str, Any]]) -> tuple[str, str]:
    """The rollout horizon [s] and the quantity that the page leads with."""
    rollout = steps[0]["rollout_rmse"]
    horizon = pick_horizon(list(rollout))
    return horizon, next((name for name in ROLLOUT_UNITS if name in rollout.get(horizon, {})), "position")


def _big(value: float, unit: str, cls: str, label: str) -> Html:
    return element("div", element("b", f"{typeset(value, 2)} {unit}"), element("small", label), cls=f"big {cls}")


def _compared(comparison: Mapping[str, Any]) -> list[Html]:
    """One column per model, one row per error."""
    models = comparison["models"]
    rows: list[list[str]] = []
    for seconds in sorted({key for model in models for key in model.get("rollout") or {}}, key=float):
        errors = [(model.get("rollout") or {}).get(seconds) or {} for model in models]
        rows.append([f"position, {seconds} s prediction", *(typeset(error.get("position")) for error in errors), "m"])
    for axis in AXES:
        errors = [(model.get("acceleration") or {}).get("rmse") or {} for model in models]
        rows.append(
            [
                f"{axis} acceleration",
                *(typeset(error.get(axis)) for error in errors),
                unit_text(ACCELERATION_UNITS[axis]),
            ]
        )
    rows.append(["parameters", *(typeset(model.get("parameters")) for model in models), ""])
    rows.append(["laws of a hull", *(str(model.get("audit", "not run")) for model in models), ""])
    head = ["", *(words(str(model["name"])) for model in models), ""]
    note = element("p", f"Root-mean-square errors on the {comparison.get('split', 'held-out')} part.", cls="facts")
    return [element("h3", "Models compared"), table(head, rows, "l" + "r" * len(models) + "l"), note]
