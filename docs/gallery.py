"""Draw the pictures of gallery.md: what `run.plot` shows of the demo's run, the weak form, and those of examples.

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
import numpy as np
from matplotlib.figure import Figure

import undertow
from undertow.discovery.balance.weak_form import WeakForm, WeakSettings
from undertow.physics.forces import modelled_force
from undertow.physics.momentum_balance import mass_matrix

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
        "plot_weak_form": weak_form().axes[0],
    }
    figures = {name: figure for name, axes in drawn.items() if (figure := axes.get_figure(root=True))}
    for figure in figures.values():
        if figure is figures["plot_weak_form"]:
            continue
        for cloud in (*figure.axes[0].collections, *figure.axes[0].lines[:1]):
            cloud.set_rasterized(len(figure.axes) < 3 and "coefficients" not in figure.axes[0].get_xlabel())
    figures["plot_predictions"].set_size_inches(7.0, 4.6)
    return figures


def weak_form() -> Figure:
    """The force that a simulated log lacks, by differences of the speed and in weak form, beside the true one."""
    nominal = undertow.load_vehicle("blueboat")
    missing = -12.0
    log = undertow.simulate_world(nominal, {"X_uu": missing}, duration=60.0, noise="field", seed=3)
    motion, settings = log.motion(0.05), WeakSettings()
    weak = WeakForm([motion], settings)
    time, speed = motion.time, motion.velocity[:, 0]
    rates = np.gradient(motion.velocity, time, axis=0)
    balance = rates @ mass_matrix(nominal).T - modelled_force(nominal, motion)
    true = missing * np.interp(time, log.truth.time, log.truth.velocity[:, 0] * np.abs(log.truth.velocity[:, 0]))
    figure, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(7.0, 4.4), height_ratios=(1.0, 1.4))
    above.plot(time, speed, ".", color="0.55", markersize=3, label="measured surge speed [m/s]")
    centre, half = 20.0, settings.half_width
    around = np.linspace(centre - half, centre + half, 81)
    bell = (1.0 - ((around - centre) / half) ** 2) ** settings.power
    above.fill_between(around, bell, color="tab:orange", alpha=0.5, label="one test function")
    below.plot(time, balance[:, 0], color="0.75", linewidth=0.7, label="by differences of the speed")
    below.plot(weak.time, weak.residual(nominal)[:, 0], color="tab:orange", label="in weak form")
    below.plot(time, true, color="black", linewidth=1.0, linestyle="--", label="the drag that is missing")
    below.set(xlabel="time [s]", ylabel="surge force [N]", xlim=(5.0, 35.0), ylim=(-45.0, 35.0))
    for axes in (above, below):
        axes.legend(loc="upper right", frameon=False, ncols=3)
    above.set_ylim(top=1.35 * max(float(speed.max()), 1.0))
    figure.tight_layout()
    return figure


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
