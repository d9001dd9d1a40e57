"""Online adaptation: weed grows on a hull half-way through a log, and the drag is followed while the log is replayed.

Run it as `python examples/fouling.py [PICTURE]`; without a name it writes `fouling.svg` into the folder in which it is
run. The picture in `docs/` is made this way. Equal inputs give equal bytes.
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

import undertow
from undertow.discovery.calibration.following import Adapted
from undertow.physics.worlds.world import NOISE, World

TRUTH, FOLLOWED, NOMINAL = "#1b2329", "#0072b2", "#d55e00"
INK, MUTED, GRID, BAND, REST = "#1b2329", "#5d6a75", "#dfe4e8", "#bcdcf0", "#eef1f3"
DURATION, FOULED_AT, DRAG = 240.0, 120.0, -16.0  # [s], [s], [N s^2/m^2]
STYLE = Path(__file__).with_name("figures.mplstyle")


def main(picture: Path) -> None:
    hull = undertow.load_vehicle("blueboat")
    fouled = hull.with_values({"X_uu": DRAG})
    world = World(hull, "rich", DURATION, seed=1, becomes=fouled, changes_at=FOULED_AT)
    found = undertow.adapt(world.run(NOISE["field"]).motion(), hull, ["surge_quadratic_damping"])
    value, old = found.values[:, 0], hull.value("X_uu")
    since = found.excitation - found.excitation[np.searchsorted(found.time, FOULED_AT)]
    first = int(np.flatnonzero((found.time > FOULED_AT) & (np.abs(value - DRAG) <= 0.1 * abs(DRAG)))[0])
    print(f"X_uu is {old:g} {found.units[0]} in the model, and {DRAG:g} from {FOULED_AT:g} s on")
    print(f"followed to within 10 % after {since[first]:.0f} s of excitation ({found.time[first] - FOULED_AT:.0f} s)")
    print(f"at the end: {value[-1]:.1f} +- {2.0 * found.deviation[-1, 0]:.1f}")
    with plt.rc_context(fname=STYLE):
        figure = plt.figure(figsize=(10.0, 5.2), facecolor="white")
        axes = figure.add_axes((0.075, 0.125, 0.9, 0.7))
        draw(axes, found, old)
        axes.annotate(
            f"within 10 % after\n{since[first]:.0f} s of excitation",
            (float(found.time[first]), -value[first]),
            (34, -56),
            textcoords="offset points",
            color=FOLLOWED,
            weight="bold",
            arrowprops={"arrowstyle": "-|>", "color": FOLLOWED, "shrinkB": 4},
        )
        head = "Weed doubles the hull's drag half-way; the model follows while the log is replayed"
        figure.text(0.012, 0.945, head, fontsize=13.5, weight="bold", va="center")
        figure.text(0.012, 0.885, "quadratic drag in surge, -X_uu [N s²/m²]", color=MUTED, va="center")
        figure.savefig(picture, metadata={"Date": None, "Creator": "examples/fouling.py"})
        plt.close(figure)
    lines = picture.read_text(encoding="utf-8").splitlines()
    picture.write_text("\n".join(line.rstrip() for line in lines) + "\n", encoding="utf-8")


def draw(axes: Axes, found: Adapted, old: float) -> None:
    """The followed value with twice its deviation, the truth, the model as it was, and where nothing is learnt."""
    time, value, spread = found.time, -found.values[:, 0], 2.0 * found.deviation[:, 0]
    axes.fill_between(time, 0, 1, where=~found.excited, color=REST, linewidth=0, transform=axes.get_xaxis_transform())
    axes.hlines(-old, 0.0, DURATION, NOMINAL, linewidth=1.8)
    axes.plot(
        [0.0, FOULED_AT, FOULED_AT, DURATION], [-old, -old, -DRAG, -DRAG], color=TRUTH, linewidth=1.4, dashes=(4, 3)
    )
    axes.fill_between(time, value - spread, value + spread, color=BAND, linewidth=0)
    axes.plot(time, value, color=FOLLOWED, linewidth=2.4)
    axes.set(xlim=(0.0, DURATION), ylim=(0.0, 1.45 * -DRAG), xlabel="time in the log [s]")
    axes.grid(axis="y", color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(length=0)
    axes.text(FOULED_AT - 3.0, -DRAG, "truth", ha="right", va="center", weight="bold", color=TRUTH)
    axes.text(DURATION - 3.0, -old - 0.5, "the model as it was", ha="right", va="top", weight="bold", color=NOMINAL)
    axes.text(DURATION - 3.0, -DRAG + 1.6, "followed, ± 2 deviations", ha="right", weight="bold", color=FOLLOWED)
    axes.text(2.0, 1.4 * -DRAG, "grey: hardly any motion ahead, nothing is learnt", color=MUTED, va="top", fontsize=9.5)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("fouling.svg"))
