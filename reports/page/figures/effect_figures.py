"""Drawings of effects: the force that the model lacks, how far the log excites effects, their rank and coefficients."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from ....comparison.failing.rows import ACCELERATIONS, COMMAND_KINDS
from ....discovery.effect_findings import EffectFinding
from ....discovery.findings import Findings
from ....discovery.identifiability.rehearsal import Excitation
from ....physics.momentum_balance import mass_matrix
from ....physics.motion import AXES, FORCE_UNITS, Array
from ....physics.presentation import MINUS, number, percent, share_removed, unit_text, words
from ....physics.sampled_series import binned_means, explained_share
from ....physics.vehicle import Vehicle
from ...sureness import BACK, CoefficientRow, comes_back, odds, worth
from ..markup import Html
from .svg import BESIDE, PANEL, ROLES, Look, bare_rows, beside, chart, drawn

SIGNALS = {"u": "m/s", "v": "m/s", "r": "rad/s", "psi": "deg", "u_dot": "m/s^2", "v_dot": "m/s^2", "r_dot": "rad/s^2"}
"""Columns of a series that a force may depend on, beside the commands, and the units in which they are drawn."""
_LAST = ("psi", "u_dot", "v_dot", "r_dot")
"""Signals over which few laws are known by sight, and that make one of noise: forces are measured by accelerations."""
_CLEARLY, _UNSEEN = 0.67, 0.05
"""Share of what better known signals leave untold of a law that another may leave at most to be drawn over, and share
of it that nobody sees to be untold: judgements. The force of a wind over the heading leaves nearly nothing."""
_VELOCITIES: dict[str, str] = dict(zip(AXES, ("u", "v", "r"), strict=True))
_SPOKEN = {"u": "surge speed", "v": "sway speed", "r": "yaw rate", "psi": "heading"} | {
    f"{speed}_dot": f"{axis} acceleration" for axis, speed in _VELOCITIES.items()
}
_LEAST = 5
"""Rows of a part that is drawn."""
_POINTS = 500
"""Rows drawn in a panel."""
_MATTERS = 0.05
"""Share of what lacks on an axis that must have been explained for a drawing of it."""


@dataclass(frozen=True, slots=True, eq=False)
class MissingForce:
    """What the nominal model lacks on an axis, row by row.

    Attributes
    ----------
    axis : 0 surge, 1 sway, 2 yaw
    lacking : measured force less that of the nominal model (n,) [N, N m]
    added : what the corrected model has more (n,) [N, N m]
    signal, values : column of the series, and its values (n,) in the unit of `SIGNALS`
    """

    axis: int
    lacking: Array
    added: Array
    signal: str
    values: Array

    @property
    def told(self) -> float:
        """Share of the means of what lacks that was added: rows of a field log are mostly noise."""
        lacking, added = means(self.values, self.lacking)[1], means(self.values, self.added)[1]
        return 1.0 - float(np.square(lacking - added).sum()) / max(float(np.square(lacking).sum()), 1e-300)

    @property
    def ends(self) -> tuple[float, float]:
        """Least and largest force of a drawing, but for a few rows in a thousand."""
        low, high = np.quantile(np.concatenate([self.lacking, self.added]), (0.002, 0.998))
        return float(low - 0.1 * (high - low)), float(high + 0.1 * (high - low))

    @property
    def label(self) -> str:
        """The signal with its unit."""
        unit = unit_text(SIGNALS.get(self.signal, ""))
        return f"{_SPOKEN.get(self.signal, self.signal)} [{unit}]" if unit else self.signal


def signals(series: Iterable[object]) -> list[str]:
    """Columns that a force may depend on."""
    names = [str(name) for name in series]
    return [*(name for name in SIGNALS if name in names), *(name for name in names if name.startswith(COMMAND_KINDS))]


def missing_force(
    series: pd.DataFrame, nominal: Vehicle, axis: int, signal: str = "", unjudged: Sequence[str] = ()
) -> MissingForce:
    """What the nominal model lacks on an axis, over a signal; default: the one over which what was added is seen best.

    Velocities and accelerations along axes that were not judged tell nothing.
    """
    lacking = series[("X_residual", "Y_residual", "N_residual")[axis]].to_numpy(dtype=float)
    more = np.column_stack([(series[f"{c}_after"] - series[f"{c}_before"]).to_numpy(float) for c in ACCELERATIONS])
    added = (more @ mass_matrix(nominal).T)[:, axis]
    known = np.isfinite(lacking) & np.isfinite(added)
    rows = signal_rows({name: series[name].to_numpy(dtype=float)[known] for name in signals(series)})
    chosen = signal or best_signal(rows, added[known], axis, unjudged)
    return MissingForce(axis, lacking[known], added[known], chosen, rows[chosen])


def best_signal(rows: Mapping[str, Array], law: Array, axis: int, unjudged: Sequence[str] = ()) -> str:
    """The column over which a law (n,) is seen best, among those that it may depend on and that can be trusted.

    That is the speed that tells most of it, of equal ones that along the axis; a command where it tells clearly more,
    and heading or acceleration where these tell clearly more again.

    Parameters
    ----------
    rows : see `signal_rows`
    """
    doubted = [f"{_VELOCITIES[name]}{ending}" for name in unjudged for ending in ("", "_dot")]
    size = max(float(np.square(law).mean()), 1e-300)

    def untold(name: str) -> float:
        return max((1.0 - explained_share(rows[name], law)) * float(law.var()) / size, _UNSEEN)

    speeds = sorted(_VELOCITIES.values(), key=lambda name: name != _VELOCITIES[AXES[axis]])
    commands = [name for name in rows if name.startswith(COMMAND_KINDS)]
    best, least = "", math.inf
    for tier in (speeds, commands, _LAST):
        left = {name: untold(name) for name in tier if name in rows and name not in doubted}
        first = min(left, key=lambda name: left[name], default="")
        if first and left[first] < _CLEARLY * least:
            best, least = first, left[first]
    return best


def signal_rows(columns: Mapping[str, Array]) -> dict[str, Array]:
    """Columns as they are drawn: a heading turns round once, and does not count the turns before."""
    return {name: np.degrees(values) % 360.0 if name == "psi" else values for name, values in columns.items()}


def means(values: Array, force: Array) -> tuple[Array, Array]:
    """Means of a force (m,) over parts of a signal's range that have enough rows, at their middles (m,)."""
    return binned_means(values, force, _LEAST)


def convincing(findings: Findings, series: pd.DataFrame, nominal: Vehicle) -> list[MissingForce]:
    """What lacks on each axis for which something was added that explains a good part of it, most first."""
    if not findings.added or "X_residual" not in series:
        return []
    unjudged = findings.criterion.unjudged
    every = [missing_force(series, nominal, axis, "", unjudged) for axis in range(3) if AXES[axis] not in unjudged]
    return sorted((one for one in every if one.told >= _MATTERS), key=lambda one: -one.told)


def force_drawing(found: MissingForce) -> Html:
    """Measured force less the nominal model's, its means, and what was added, over the signal."""
    stride = max(1, found.values.size // _POINTS)
    with chart(PANEL, simplify=False) as axes:
        axes.axhline(0.0, color=ROLES["muted"], linewidth=1.0, dashes=(4, 3))
        axes.plot(found.values[::stride], found.lacking[::stride], ".", color=ROLES["measured"], ms=3.5)
        axes.plot(*means(found.values, found.lacking), "o", color=ROLES["before"], ms=6)
        axes.plot(*means(found.values, found.added), "-", color=ROLES["after"], lw=2.5)
        unit, axis = unit_text(FORCE_UNITS[found.axis]), AXES[found.axis]
        axes.set(ylim=found.ends, xlabel=found.label, ylabel=f"{axis} [{unit}]")
        axes.set_title(f"{axis}: {share_removed(found.told)} explained")
        axes.locator_params(nbins=5)
        return drawn(axes, f"the {axis} force that the model lacks over {found.label}, and what was added")


FULL = 0.5  # bars end here: half of the force at work is plenty


def excitation(told: Mapping[str, Excitation]) -> Html:
    """One bar an effect, the least excited on top; bars of the well excited are cut at half of the force at work.

    Parameters
    ----------
    told : by effect
    """
    shares = {name: item.share for name, item in told.items()}
    order = sorted(shares, key=lambda name: (shares[name] != shares[name], shares[name]))
    with chart((460, 12 + 17 * len(order)), (208, 4, 62, 4)) as axes:
        values = np.nan_to_num(np.array([shares[name] for name in order]))
        fill = [ROLES["before"] if value < 0.02 else ROLES["between"] for value in values]
        axes.barh(np.arange(len(order)), np.minimum(values, FULL), height=0.62, color=fill)
        for row, name in enumerate(order):
            beside(axes, words(name), row, -8, ha="right", size=10.5)
            axes.annotate(percent(shares[name]), (min(values[row], FULL), row), (6, 0), **BESIDE, size=10.5)
        bare_rows(axes, len(order), (0.0, FULL))
        return drawn(axes, "how far the log excites each effect")


_MOST = 12
"""Effects in the ranking: the others have next to no evidence."""


def ranked_effects(candidates: Sequence[EffectFinding]) -> Html:
    """The best-ranked effects that the log can judge, by the share of the unseen error that comes back without each.

    A missing effect is strong blue, a likely one faint, a possible one in the corrected model has a rim alone.
    """
    shown = sorted([item for item in candidates if not item.cannot_tell][:_MOST], key=worth, reverse=True)
    width, height = 460, 34 + 24 * len(shown)
    drops = np.nan_to_num([worth(item) for item in shown])
    with chart((width, height), (190, 30, 122, 4)) as axes:
        fill, rim = zip(*map(_bar_colours, shown), strict=True) if shown else ((), ())
        bars = np.arange(len(shown)), np.maximum(drops, 0.0)
        axes.barh(*bars, height=0.56, color=fill, edgecolor=rim, linewidth=1.6)
        for index, item in enumerate(shown):
            weight = "bold" if item.in_model else "normal"
            beside(axes, words(item.effect), index, -8, ha="right", weight=weight)
            beside(axes, comes_back(item), index, 58, right=True, ha="right", weight=weight)
            beside(axes, odds(item), index, 120, right=True, ha="right", color=ROLES["muted"])
        bare_rows(axes, len(shown), (0.0, max(drops.max(initial=0.0), 1e-9)))
        for place, text in ((-64, BACK), (-2, "sure")):
            axes.figure.text(1 + place / width, 1 - 18 / height, text, ha="right", color=ROLES["muted"], size=11)
        return drawn(axes, "effects by the unseen force error that comes back without them, and how sure they are")


def _bar_colours(item: EffectFinding) -> tuple[str, str]:
    """Filling and rim of a bar."""
    if item.verdict in ("missing", "likely"):
        colour = ROLES["after" if item.verdict == "missing" else "likely"]
        return colour, colour
    plain = ROLES["between" if item.verdict == "possible" else "grid"]
    return (ROLES["surface"], ROLES["after"]) if item.in_model else (plain, plain)


def coefficients(rows: Sequence[CoefficientRow]) -> Html:
    """Coefficients before and after, with 95 % intervals of the value after; each row on its own scale from zero."""
    with chart((460, 8 + 52 * len(rows)), (2, 4, 2, 4)) as axes:
        lowest = highest = 0.0
        for index, row in enumerate(rows):
            reach = max(abs(value) for value in (row.before, row.after, *row.interval)) or 1.0
            before, after, band = row.before / reach, row.after / reach, np.array(row.interval) / reach
            lowest, highest = min(lowest, before, after, *band), max(highest, before, after, *band)
            axes.plot([before, after], [index, index], color=ROLES["muted"], lw=1.0)
            axes.plot(band, [index, index], color=ROLES["after"], lw=7, alpha=0.4)
            axes.plot(before, index, "o", color=ROLES["surface"], mec=ROLES["before"], mew=2.0, ms=8)
            axes.plot(after, index, "o", color=ROLES["after"], ms=8)
            edge: Look = {"xycoords": axes.get_yaxis_transform()}
            change = f"{number(row.before, minus=MINUS)} \N{RIGHTWARDS ARROW} {number(row.after, minus=MINUS)}"
            axes.annotate(row.symbol, (0, index), (2, 20), **BESIDE | edge, weight="bold")
            axes.annotate(f"{change} {unit_text(row.unit)}", (1, index), (-2, 20), **BESIDE | edge, ha="right")
        axes.axvline(0.0, color=ROLES["grid"], lw=1.2, zorder=0)
        margin = 0.05 * (highest - lowest)
        bare_rows(axes, len(rows), (lowest - margin, highest + margin))
        axes.set_ylim(len(rows) - 0.65, -0.65)
        axes.spines[:].set_visible(False)
        return drawn(axes, "coefficients before and after with 95 % intervals")
