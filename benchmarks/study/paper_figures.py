"""Figures 2 to 4 of the repeated paper: accelerations along a run, and the errors of all models."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from zoo.cases import Setting

from undertow.physics.motion import AXES
from undertow.reports.page.figures.svg import ROLES, canvas, drawn, panel
from undertow.reports.page.markup import Html, figure

from .paper_change import Change, Records, relative

Results = Mapping[str, tuple[Setting, Records]]
PHYSICS, PURE, HYBRID = "Fossen calibrated", ("pure MLP", "pure LSTM", "pure TCN"), ("MLP", "LSTM", "TCN")
STEP, ROLLED = ("acceleration", "rmse"), ("rollout", "10")
_LEAST, _MOST, _TICKS = 0.05, 20.0, (0.05, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 10.0)
"""Ends of the axis of relative errors, and its ticks."""
MEASURES = (("one step", STEP), ("10 s rollouts", ROLLED))


def figures_of(results: Results) -> list[Html]:
    """Figures 2 to 4: accelerations along a run, errors of all models, errors one step ahead and over 10 s."""
    case, (_, records) = next(iter(results.items()))
    found = []
    series = {record["name"]: record["drawn"] for record in records if "drawn" in record}
    if series:
        caption = f"Figure 2. {case}: acceleration on the held-out run, measured (grey), by Fossen calibrated (orange) "
        found.append(figure([_along(series)], caption + "and by the hybrid MLP (blue)."))
    for which, (what, keys) in enumerate(MEASURES, start=3):
        told = f"Figure {which}. Error of {what} against the calibrated Fossen model on held-out runs, "
        told += "geometric mean of axes and seeds."
        found.append(figure([_bars(results, keys, what)], told))
    return found


def _along(series: Mapping[str, Mapping[str, Any]]) -> Html:
    first = next(iter(series.values()))
    lines = {PHYSICS: "before", "hybrid MLP": "after"}
    with canvas(900, 480) as drawing:
        time = first["step"] * np.arange(len(first["measured"]))
        for k, (axis, unit) in enumerate(zip(AXES, ("m/s²", "m/s²", "rad/s²"), strict=True)):
            axes = panel(drawing, 70, 10 + 150 * k, 810, 125)
            axes.plot(time, np.array(first["measured"])[:, k], color=ROLES["measured"], linewidth=2.0)
            for name, role in lines.items():
                if name in series:
                    axes.plot(time, np.array(series[name]["said"])[:, k], color=ROLES[role], linewidth=1.2)
            axes.set_ylabel(f"{axis} [{unit}]")
        axes.set_xlabel("time [s]")
        return drawn(drawing, "acceleration along a held-out run")


def _bars(results: Results, keys: tuple[str, ...], what: str) -> Html:
    names = [*PURE, "residual MLP", *(f"hybrid {n}" for n in HYBRID)]
    height = 22 * len(names)
    with canvas(900, (height + 45) * len(results) + 50) as drawing:
        for k, (case, (_, records)) in enumerate(results.items()):
            axes = panel(drawing, 160, 25 + (height + 45) * k, 720, height)
            for row, name in enumerate(names):
                change = Change(relative(records, name, PHYSICS, "held", *keys))
                role = "before" if name.startswith("pure") else "after"
                if change.seeds:
                    axes.plot(change.mean, row, "o", color=ROLES[role])
                    if np.isfinite(change.low):
                        ends = np.maximum([change.low, change.high], _LEAST)
                        axes.plot(ends, [row, row], color=ROLES[role])
            axes.axvline(1.0, color=ROLES["muted"], linewidth=1.0)
            axes.set(xscale="log", xlim=(_LEAST, _MOST))
            axes.minorticks_off()
            axes.set_xticks(_TICKS, [f"{tick:g}" for tick in _TICKS])
            axes.set(yticks=range(len(names)), yticklabels=names, ylim=(len(names) - 0.5, -0.5), title=case)
        axes.set_xlabel(f"{what}: error in that of Fossen calibrated, left is better")
        return drawn(drawing, f"{what}: errors of all models")
