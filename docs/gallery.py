"""Draw the pictures of gallery.md: what `run.plot` shows of the demo's run, and those that examples draw.

Run `python docs/gallery.py` to draw them into `gallery/`; `make docs` calls `python docs/gallery.py FOLDER`, and the
site shows what was drawn then.
"""

import runpy
import sys
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
from matplotlib.figure import Figure

import undertow

HERE = Path(__file__).resolve().parent
EXAMPLES = ("falling_error", "fouling")
"""Scripts of `examples/` that draw a picture, which lies beside this file."""
STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "undertow",
    "font.size": 9.0,
    "figure.figsize": (7.0, 3.2),
    "savefig.dpi": 120,
    "axes.spines.top": False,
    "axes.spines.right": False,
}


def plots() -> dict[str, Figure]:
    """Every plot of a run, on the log that comes with the package."""
    data = Path(undertow.__file__).parent / "data"
    inputs = undertow.read_inputs(data / "gazebo_blueboat.csv.gz", data / "demo.yaml", progress=None)
    run = undertow.discover(inputs, progress=None)
    drawn = {
        "plot_staircase": run.plot.staircase(),
        "plot_predictions": run.plot.predictions()[0],
        "plot_force": run.plot.force(),
        "plot_force_sway": run.plot.force("sway_quadratic_damping", "v"),
        "plot_coefficients": run.plot.coefficients(),
        "plot_failures": run.plot.failures("yaw"),
        "plot_places": run.findings.plot.failures(),
        "plot_models": run.comparison.plot.errors(),
    }
    figures = {name: figure for name, axes in drawn.items() if (figure := axes.get_figure(root=True))}
    for figure in figures.values():
        for cloud in (*figure.axes[0].collections, *figure.axes[0].lines[:1]):
            cloud.set_rasterized(len(figure.axes) < 3 and "coefficients" not in figure.axes[0].get_xlabel())
    figures["plot_predictions"].set_size_inches(7.0, 4.6)
    return figures


def draw(folder: Path) -> None:
    """Write the pictures of the plots."""
    folder.mkdir(parents=True, exist_ok=True)
    with plt.rc_context(STYLE):
        for name, figure in plots().items():
            figure.savefig(folder / f"{name}.svg", metadata={"Date": None, "Creator": "docs/gallery.py"})
        plt.close("all")


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "gallery"
    draw(target)
    if len(sys.argv) > 1:
        for example in EXAMPLES:
            runpy.run_path(str(HERE.parent / "examples" / f"{example}.py"))["main"](target / f"{example}.svg")
    print(f"{len(list(target.glob('*.svg')))} pictures drawn into {target}")
