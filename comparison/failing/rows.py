"""Rows that are judged: stretches without a gap, blocks, commands; and fits whose errors count blocks, not rows."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...measurements.statistics.blocks import block_draws, block_scores, sandwich, student
from ...measurements.statistics.signals import running_mean
from ...residuals.series import SeriesTable

Array = NDArray[np.float64]
COMMAND_KINDS = ("pwm_", "normalized_", "rad_s_", "newton_")
PWM_NEUTRAL = 1500.0
"""Middle of the usual range of 1000 to 2000 us."""
IDLE_SHARE = 0.08
"""Share of the largest command in the log below which a thruster counts as idle: trim, and a stick at neutral."""
SLOW = 0.1
"""Speed [m/s] below which thrust cannot be said to oppose the motion: that of noise and waves."""
ACCELERATIONS = ("u_dot", "v_dot", "r_dot")
BLOCK = 5.0
"""Length of the blocks [s] that are drawn, left out and counted as one: the error forgets itself within one."""
STEP = 0.1
"""Time step [s] of rows that bear no time."""
EDGE = 0.8
"""Time [s] at both ends of a stretch of which nothing is said: the filter has no motion to go on there, and errs."""
_SMOOTH = 1.0
"""Length of the means [s] that leave what is slow."""
_CHANGE = 0.05
"""Share of the largest command by which a command changes from row to row when it is said to change."""
_LONG_AGO = 10.0
"""Time since a command change [s] beyond which it does not matter how long ago it was."""
ENOUGH_SECONDS = 60.0
"""Held-out motion [s] below which the regimes are not filled: a dozen blocks of 5 s."""


def command_columns(series: SeriesTable) -> list[str]:
    """The command channels of a series, one per thruster, known by their prefix (`newton_port`, `pwm_stbd`, ...)."""
    return [name for name in series.columns if name.startswith(COMMAND_KINDS)]


def scaled_commands(series: SeriesTable) -> NDArray[np.float64]:
    """The commands from neutral, (rows, thrusters), as shares of the largest one in the rows."""
    names = command_columns(series)
    neutral = np.array([PWM_NEUTRAL if name.startswith("pwm_") else 0.0 for name in names])
    command = np.nan_to_num(series[names] - neutral)
    return command / max(float(np.abs(command).max(initial=0.0)), 1e-12)


@dataclass(frozen=True, slots=True)
class Scene:
    """Rows of the series of one model.

    Attributes
    ----------
    table : the rows of `series.csv`
    step : time between them [s]
    measured, error : (n, 3) acceleration, and modelled minus measured [m/s^2, m/s^2, rad/s^2]; NaN where missing, and
        the error within `EDGE` of the ends of a stretch
    stretch : (n,) number of the gap-free stretch
    block : (n,) number of the block of about `BLOCK` seconds, no block in two stretches
    log : (n,) number of the log
    held_out : (n,) whether the row belongs to the test part
    commands : (n, thrusters) from neutral, as shares of the largest
    since : (n,) time since the last command change [s], at most 10
    """

    table: SeriesTable
    step: float
    measured: Array
    error: Array
    stretch: NDArray[np.intp]
    block: NDArray[np.intp]
    log: NDArray[np.intp]
    held_out: NDArray[np.bool_]
    commands: Array
    since: Array

    @property
    def spread(self) -> Array:
        """Standard deviation of the measured acceleration by axis, (3,)."""
        return np.sqrt(mean_square(self.measured - finite_mean(self.measured)))

    def slow(self) -> tuple[Array, Array]:
        """Error (n, 3), and usual size (3,) of the measured acceleration, both as means over a second.

        What a missing force makes is slow and stays; most of the noise of differentiated velocities goes. A mean that
        reaches into the next stretch does no harm to what is told of many seconds.
        """
        rows = max(1, round(_SMOOTH / self.step))
        error = running_mean(np.nan_to_num(self.error), rows)
        measured = running_mean(np.nan_to_num(self.measured - finite_mean(self.measured)), rows)
        return error, np.sqrt(mean_square(measured))

    @property
    def common(self) -> Array:
        """Mean command, (n,)."""
        return self.commands.mean(axis=1) if self.commands.shape[1] else np.zeros(len(self.table))

    @property
    def command_spread(self) -> Array:
        """Largest less smallest command, (n,)."""
        return np.ptp(self.commands, axis=1) if self.commands.shape[1] else np.zeros(len(self.table))

    @property
    def opposed(self) -> NDArray[np.bool_]:
        """True when the thrust works against the motion, (n,)."""
        speed = self.table["u"]
        return (self.common * speed < 0.0) & (np.abs(speed) > SLOW) & (np.abs(self.common) > IDLE_SHARE)


def scene(table: SeriesTable, model: str = "before") -> Scene:
    """Rows of `series.csv` with the error of its first ("before") or last ("after") model."""
    n = len(table)
    time = table["time"] if "time" in table else STEP * np.arange(n)
    step = float(np.median(np.diff(time))) if n > 1 else STEP
    log = table["log"].astype(np.intp, copy=False) if "log" in table else np.zeros(n, np.intp)
    breaks = np.zeros(n, bool)
    breaks[1:] = (np.abs(np.diff(time) - step) > 0.5 * step) | (np.diff(log) != 0)
    stretch = np.cumsum(breaks).astype(np.intp)
    measured = table[ACCELERATIONS]
    error = acceleration_error(table, model)
    error[_ends(stretch, round(EDGE / step))] = np.nan
    held_out = table["part"] == "test" if "part" in table else np.zeros(n, bool)
    commands, blocks = scaled_commands(table), _blocks(stretch, step)
    since = _since(commands, breaks, step)
    return Scene(table, step, measured, error, stretch, blocks, log, held_out, commands, since)


def acceleration_error(series: SeriesTable, model: str = "before") -> Array:
    """Modelled minus measured acceleration, shape (rows, 3) [m/s^2, m/s^2, rad/s^2], NaN where either is missing."""
    return np.column_stack([series[f"{name}_{model}"] - series[name] for name in ACCELERATIONS])


def mean_square(values: Array) -> Array:
    """Mean square over the finite rows, by column; zero where there is none."""
    return finite_mean(np.square(values))


def squared(values: Array) -> Array:
    """Squares of finite values, and zero in the place of others."""
    return np.square(np.where(np.isfinite(values), values, 0.0))


def short(value: float, digits: int = 5) -> float:
    """A number for a file, to some significant digits."""
    return float(f"{value:.{digits}g}")


def shorter(values: Any, digits: int = 5) -> tuple[float, ...]:
    """Numbers for a file, to some significant digits."""
    return tuple(short(value, digits) for value in np.asarray(values, dtype=float))


def finite_mean(values: Array) -> Any:
    """Mean over the finite rows, by column; zero where there is none."""
    usable = np.isfinite(values)
    return np.where(usable, values, 0.0).sum(0) / np.maximum(usable.sum(0), 1)


def _ends(stretch: NDArray[np.intp], rows: int) -> NDArray[np.bool_]:
    """The first and last rows of every stretch, so many at each end."""
    place = np.arange(stretch.size)
    first = np.searchsorted(stretch, stretch, "left")
    last = np.searchsorted(stretch, stretch, "right")
    return (place - first < rows) | (last - 1 - place < rows)


def _blocks(stretch: NDArray[np.intp], step: float) -> NDArray[np.intp]:
    """Cut every stretch into blocks of equal length, about `BLOCK` seconds each."""
    result, first = np.zeros(stretch.size, np.intp), 0
    for length in np.bincount(stretch) if stretch.size else []:
        pieces = max(1, round(length * step / BLOCK))
        done = int(result[first - 1]) + 1 if first else 0
        result[first : first + length] = done + np.arange(length) * pieces // length
        first += int(length)
    return result


def _since(commands: Array, breaks: NDArray[np.bool_], step: float) -> Array:
    """Time since the last change of a command [s]; long ago at the beginning of a stretch."""
    n = commands.shape[0]
    changed = np.zeros(n, bool)
    if commands.shape[1]:
        changed[1:] = np.abs(np.diff(commands, axis=0)).max(axis=1) > _CHANGE
    row = np.arange(n)
    began = np.maximum.accumulate(np.where(breaks, row, 0))
    last = np.maximum.accumulate(np.where(changed & ~breaks, row, -n - round(_LONG_AGO / step)))
    return np.where(last > began, np.minimum((row - last) * step, _LONG_AGO), _LONG_AGO)


_DRAWS = 999
"""Resamples: with the estimate a thousand, so that the ends of 95 % are whole numbers of them."""
_RIDGE = 1e-9
"""Added to squares of columns of length one: two that are one can be solved, and no other is moved."""


def draws(blocks: int) -> Array:
    """Number of times each block is drawn in each bootstrap resample, (resamples, blocks); the same at every call."""
    return _counts(blocks).astype(float)


@lru_cache(maxsize=64)
def _counts(blocks: int) -> NDArray[np.uint16]:
    """The same in whole numbers, which are kept in a quarter of the memory: a long log has thousands of blocks."""
    return block_draws(blocks, _DRAWS, (0, blocks)).astype(np.uint16)


def lower_end(stage: Scene, part: Array, whole: Array, blocks: NDArray[np.intp]) -> float:
    """Lower end of the 95 % interval of a ratio of two sums of rows (n,), from a bootstrap of some blocks."""
    sums = np.array([np.bincount(stage.block, column) for column in (part, whole)]).T[blocks]
    drawn = draws(blocks.size) @ sums
    return float(np.quantile(drawn[:, 0] / np.maximum(drawn[:, 1], 1e-300), 0.025))


@dataclass(frozen=True, slots=True)
class Fitted:
    """A linear fit to rows that come in blocks.

    Attributes
    ----------
    values : (k,) coefficients of the columns that are asked for
    covariance : (k, k) of them, robust to whatever goes on within blocks and between neighbours
    sample : (resamples, k) of a block bootstrap, one step from the fit
    blocks : how many
    free : share of each column that the others do not explain, (k,)
    residual : (n,) what the whole fit leaves; zero on rows that took no part
    """

    values: Array
    covariance: Array
    sample: Array
    blocks: int
    free: Array
    residual: Array

    @property
    def errors(self) -> Array:
        """Standard errors, (k,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def interval(self, k: int) -> tuple[float, float]:
        """The 95 % interval of a coefficient."""
        reach = student(max(self.blocks - 2, 2), 0.975) * self.errors[k]
        return float(self.values[k] - reach), float(self.values[k] + reach)


def fit_with_nuisances(stage: Scene, target: Array, asked: Array, beside: Array) -> Fitted | None:
    """Fit a target to columns of interest beside others, with errors that are robust to autocorrelation.

    Blocks that follow each other in time may err alike, too. The bootstrap draws the blocks' scores (Kline and Santos
    2012), which costs one product of matrices.

    Parameters
    ----------
    target : (n,), NaN where missing
    asked : (n, k) columns whose coefficients are wanted
    beside : (n, m) columns that explain what is not asked for

    Returns
    -------
    None when there are too few blocks for the number of columns.
    """
    rows = np.isfinite(target)
    columns = np.column_stack([asked, beside])
    columns = np.where(rows[:, None], np.nan_to_num(columns), 0.0)
    scale = np.sqrt((columns**2).sum(axis=0))
    used = scale > 1e-12
    k = asked.shape[1]
    if not used[:k].all():
        return None
    kept = columns[:, used] / scale[used]
    beside_alone = span(kept[:, k:])
    inside = kept[:, :k] - beside_alone @ (beside_alone.T @ kept[:, :k])
    free = (inside**2).sum(axis=0)
    wanted = np.where(rows, target, 0.0)
    wanted = wanted - beside_alone @ (beside_alone.T @ wanted)
    gram = inside.T @ inside + _RIDGE * np.eye(k)
    blocks = np.unique(stage.block[rows])
    spare = blocks.size - k - beside_alone.shape[1] // 2
    if spare < 4:
        return None
    values = np.linalg.solve(gram, inside.T @ wanted)
    residual = np.where(rows, wanted - inside @ values, 0.0)
    scores = block_scores(inside, residual, stage.block)[blocks]
    inverse = np.linalg.inv(gram)
    covariance = sandwich(inverse, scores, spare, np.diff(blocks) == 1)
    wild = (draws(blocks.size) - 1.0) @ scores @ inverse * np.sqrt(blocks.size / spare)
    unit = scale[used][:k]
    return Fitted(values / unit, covariance / np.outer(unit, unit), (values + wild) / unit, blocks.size, free, residual)


def span(columns: Array) -> Array:
    """An orthonormal basis of some columns, (n, rank)."""
    if not columns.shape[1]:
        return columns
    base, triangle = np.linalg.qr(columns)  # a third of the time of the singular vectors of all rows
    left, size, _ = np.linalg.svd(triangle)
    return np.asarray(base @ left[:, size > 1e-8 * size[0]])


def static_columns(stage: Scene, *, sway: bool = True) -> Array:
    """Columns of a force that depends on the present motion and commands alone, (n, m).

    A constant, speeds, their products and moduli, commands and their squares with sign: everything that this explains
    is no lag, no heading dependence and no drift. `sway` is False where sway speed itself is in doubt.
    """
    u, v, r = (np.nan_to_num(stage.table[name]) for name in ("u", "v", "r"))
    moving = [np.ones_like(u), u, r, u * abs(u), r * abs(r), u * r, abs(u) * r]
    if sway:
        moving += [v, v * abs(v), u * v, v * r, abs(u) * v]
    pushed = [term for c in stage.commands.T for term in (c, c * abs(c), c * abs(u))]
    return np.column_stack([*moving, *pushed])


def earth_columns(stage: Scene) -> Array:
    """Columns that a current or a wind adds to that, (n, 8): harmonics of the heading, alone and times each speed."""
    psi = stage.table["psi"]
    turned = np.column_stack([np.cos(psi), np.sin(psi)])
    speeds = [np.nan_to_num(stage.table[name])[:, None] for name in ("u", "v", "r")]
    return np.column_stack([turned, *(speed * turned for speed in speeds)])


def contiguous(stage: Scene) -> list[NDArray[np.intp]]:
    """The rows of each gap-free stretch, in order, without the edges of which nothing is said."""
    ends = np.flatnonzero(np.diff(stage.stretch)) + 1
    edge = round(EDGE / stage.step)
    return [rows[edge : rows.size - edge] for rows in np.split(np.arange(stage.stretch.size), ends)]
