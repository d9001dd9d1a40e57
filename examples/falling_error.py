"""The README's picture: the main job on the embedded log, and how far each added effect brings the error down.

Run it as `python examples/falling_error.py [PICTURE]`; without a name it writes `docs/falling_error.svg`. Equal inputs
give equal bytes.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import undertow

MEASURED, BEFORE, BETWEEN, AFTER = "#b3bec7", "#d55e00", "#a9bccb", "#0072b2"
INK, MUTED, GRID = "#1b2329", "#5d6a75", "#dfe4e8"
COLUMNS = (("position", "m"), ("surge", "m/s"), ("sway", "m/s"), ("yaw", "rad/s"))
WIDTH, HEIGHT = 10.0, 5.8  # inches, 72 points each
STYLE = Path(__file__).with_name("figures.mplstyle")


def main(picture: Path) -> None:
    data = Path(undertow.__file__).parent / "data"
    run = undertow.discover(undertow.read_inputs(data / "gazebo_blueboat.csv.gz", data / "demo.yaml"))
    errors = pd.DataFrame([step.rollout_rmse["10"].to_dict() for step in run.findings.steps])
    added = [step.added for step in run.findings.steps]
    names = [f"+ {effect.replace('_', ' ')}" if effect else "nominal model" for effect in added]
    with plt.rc_context({"lines.solid_capstyle": "round"}, STYLE):
        figure = plt.figure(figsize=(WIDTH, HEIGHT), facecolor="white")
        draw_steps(figure, errors, names)
        draw_yaw_rate(figure, run.series[run.series["part"] == "test"])
        figure.savefig(picture, metadata={"Date": None, "Creator": "examples/falling_error.py"})
        plt.close(figure)
    lines = picture.read_text(encoding="utf-8").splitlines()
    picture.write_text("\n".join(line.rstrip() for line in lines) + "\n", encoding="utf-8")


def draw_steps(figure: Figure, errors: pd.DataFrame, names: Sequence[str]) -> None:
    """Rollout errors as bars, a row for each step and a column for each quantity."""
    rows = np.arange(len(names))
    colours = [BEFORE, *[BETWEEN] * (len(names) - 2), AFTER]
    title(figure, 0.965, "Error of 10 s predictions on held-out data, as missing effects are added")
    lefts, widths = (0.25, 0.53, 0.69, 0.85), (0.2, 0.08, 0.08, 0.08)
    for (quantity, unit), left, width in zip(COLUMNS, lefts, widths, strict=True):
        axes = figure.add_axes((left, 0.515, width, 0.365))
        values = errors[quantity].to_numpy()
        axes.barh(rows, values, height=0.62, color=colours)
        axes.set(xlim=(0, values.max()), ylim=(len(names) - 0.5, -0.5), xticks=[], yticks=[])
        axes.spines[["bottom", "left"]].set_visible(False)
        axes.axvline(0.0, color=GRID, linewidth=1.6)
        axes.set_title(f"{quantity} [{unit}]", loc="left", fontsize=11, color=MUTED, pad=6)
        for row, value in enumerate(values):
            label(axes, row, value, f"{value:.2f}" if value >= 0.095 else f"{value:.3f}", row in (0, len(names) - 1))
    first = figure.axes[0]
    for row, name in enumerate(names):
        weight = "bold" if row in (0, len(names) - 1) else "normal"
        first.annotate(name, (0, row), (-10, 0), textcoords="offset points", ha="right", va="center", weight=weight)


def label(axes: Axes, row: int, value: float, text: str, strong: bool) -> None:
    weight = "bold" if strong else "normal"
    axes.annotate(text, (value, row), (5, 0), textcoords="offset points", va="center", weight=weight)


def draw_yaw_rate(figure: Figure, series: pd.DataFrame) -> None:
    """Measured and predicted yaw rate; predictions run on the commands alone and start anew every 10 s."""
    axes = figure.add_axes((0.06, 0.095, 0.925, 0.265))
    time = series["time"].to_numpy()
    title(figure, 0.43, "Yaw rate on held-out data, predicted from the commands alone, 10 s at a time")
    restarts = time[::100]
    axes.plot(time, series["r"], color=MEASURED, linewidth=5.0)
    for name, colour in (("r_before", BEFORE), ("r_after", AFTER)):
        predicted = series[name].to_numpy().copy()
        broken = np.insert(predicted, np.arange(100, time.size, 100), np.nan)
        axes.plot(np.insert(time, np.arange(100, time.size, 100), restarts[1:]), broken, color=colour, linewidth=1.6)
    axes.vlines(restarts[1:], 0, 1, MUTED, (0, (1, 3)), transform=axes.get_xaxis_transform(), linewidth=0.9)
    axes.set(xlim=(time[0], time[-1]), xlabel="time in the log [s]", ylabel="yaw rate [rad/s]")
    axes.locator_params(axis="y", nbins=5)
    axes.grid(axis="y", color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(length=0)
    keys = ((0.012, "measured", MUTED), (0.115, "nominal model", BEFORE), (0.258, "with the missing effects", AFTER))
    for place, text, colour in keys:
        figure.text(place, 0.385, text, color=colour, weight="bold", fontsize=10.5, va="center")


def title(figure: Figure, height: float, text: str) -> None:
    figure.text(0.012, height, text, fontsize=12.5, weight="bold", va="center")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[1] / "docs" / "falling_error.svg")
