"""Error against lag: whether the model answers too early or too late."""

import numpy as np

from ...measurements.statistics.peak import turning_point
from ...physics.delays_and_lags import first_order_lag
from ...physics.file_records import Number, Record
from ...physics.frames import AXES
from ...physics.in_words import number, percent
from .block_fit import contiguous, draws, earth_columns, span, static_columns
from .rows import Array, Scene

_REACH = (-0.6, 1.5)
"""Lags [s] that are tried; positive where the boat answers after the model."""
_GAIN = 0.05
"""Share of the squared error by which the lag must lower it to be told."""
_MATERIAL = 0.05
"""Error that the lag makes, as a share of the usual acceleration."""
_FEWEST = 8
"""Blocks for an interval of the lag: a resample of fewer has too few that differ from the log."""
_SUSPECTS = ("thruster_lag", "input_delay")
_CANNOT = "this log cannot tell"


class Lag(Record):
    """By how much the boat answers its thrusters after the model, on one axis.

    Attributes
    ----------
    seconds, ci95 : positive where the boat answers later than the model; None where this log cannot tell
    correlation : of the error with the error that this lag would make, both beside the present motion and commands
    suspects : what it would point to
    verdict : "early" (the model is), "late", "in step", "this log cannot tell"
    sentence : the same in words
    """

    seconds: Number | None = None
    ci95: tuple[Number, Number] | None = None
    correlation: Number | None = None
    suspects: tuple[str, ...] = ()
    verdict: str = _CANNOT
    sentence: str = "this log cannot tell: the commands change too little to time the answer"


def against_lag(stage: Scene, thrust: Array) -> dict[str, Lag]:
    """By how much the boat answers its thrusters after the model, by axis.

    The acceleration that the thrusters give is delayed, or lags (whichever fits better), with its size fixed; what
    speeds, commands and heading of the moment explain of the remaining error is taken out, so that a missing damping, a
    wrong thrust or a current is no lag. The lag with the least squares wins; its interval comes from a bootstrap of
    blocks.

    Parameters
    ----------
    thrust : (n, 3) the part of the modelled acceleration that the thrusters give

    Returns
    -------
    By axis.
    """
    lags = np.arange(round(_REACH[0] / stage.step), round(_REACH[1] / stage.step) + 1)
    delays = lags[lags >= 0]
    rows = np.concatenate([part[lags[-1] : part.size + lags[0]] for part in contiguous(stage)])
    usable = rows[np.isfinite(stage.error[rows]).all(axis=1)]
    blocks = np.unique(stage.block[usable], return_inverse=True)[1]
    if not usable.size or blocks.max() + 1 < _FEWEST:
        return dict.fromkeys(AXES, Lag())
    beside = np.column_stack([static_columns(stage), earth_columns(stage)])[usable]
    base = span(beside / np.maximum(np.linalg.norm(beside, axis=0), 1e-12))
    pushed = np.sqrt((thrust[usable] ** 2).mean(axis=0)) > _MATERIAL * stage.spread
    told = {}
    for k, axis in enumerate(AXES):
        if not pushed[k]:
            told[axis] = Lag(sentence="the thrusters hardly push on this axis")
            continue
        now = thrust[usable, k]
        delayed = np.column_stack([thrust[usable - lag, k] for lag in lags])
        lagged = _lagged(thrust[:, k], np.asarray(delays * stage.step, dtype=float), stage)[usable]
        fits = []
        for shape, tried in ((delayed, lags), (lagged, delays)):
            left = -stage.error[usable, k, None] + now[:, None] - shape
            left = left - base @ (base.T @ left)
            squares = np.column_stack([np.bincount(blocks, column) for column in np.square(left).T])
            fits.append((squares, left, tried))
        squares, left, tried = min(fits, key=lambda fit: float(fit[0].sum(axis=0).min()))
        told[axis] = _judged(squares, left, tried, stage, k)
    return told


def _lagged(thrust: Array, constants: Array, stage: Scene) -> Array:
    """A column under first-order lags [s], (n, constants), each stretch from its own first value."""
    found = np.empty((thrust.size, constants.size))
    for k, constant in enumerate(constants):
        for number_of in np.unique(stage.stretch):
            rows = stage.stretch == number_of
            found[rows, k] = first_order_lag(thrust[rows], float(constant), stage.step)
    return found


def _judged(squares: Array, left: Array, lags: Array, stage: Scene, axis: int) -> Lag:
    now = int(np.flatnonzero(lags == 0)[0])
    sums = squares.sum(axis=0)
    if sums[now] <= 1e-18:
        return Lag(seconds=0.0, verdict="in step", sentence="there is no error to speak of")
    best = _lowest(sums, lags)
    drawn = np.sort([_lowest(row, lags) for row in draws(squares.shape[0])[:399] @ squares])
    low, high = (float(drawn[k]) * stage.step for k in (round(0.025 * 398), round(0.975 * 398)))
    seconds = best * stage.step
    chosen = int(np.clip(round(best), lags[0], lags[-1])) - int(lags[0])
    made = left[:, now] - left[:, chosen]
    gain = 1.0 - sums[chosen] / sums[now]
    size = float(np.sqrt((made**2).mean()))
    correlation = float(made @ left[:, now] / max(np.linalg.norm(made) * np.linalg.norm(left[:, now]), 1e-300))
    ends = bool(best in (lags[0], lags[-1]))
    # A boat may answer late, but hardly early: less than a row early is the filter's and the noise's.
    early = -stage.step < seconds <= 0.0
    clear = not low <= 0.0 <= high and not early and gain > _GAIN and size > _MATERIAL * stage.spread[axis] and not ends
    found = Lag(seconds=round(seconds, 3), ci95=(round(low, 3), round(high, 3)), correlation=round(correlation, 3))
    if clear and seconds > 0.0:
        return found.but(
            verdict="early",
            suspects=_SUSPECTS,
            sentence=f"the model answers {number(seconds, 2)} s before the boat, which makes {percent(gain)} of the "
            "squared error that the present speeds and commands leave: would point to thruster lag, input delay, or "
            "channels out of step",
        )
    if clear:
        return found.but(
            verdict="late",
            sentence=f"the model answers {number(-seconds, 2)} s after the boat, which no boat does: "
            "look for channels that are out of step",
        )
    if high - low > 0.5 or ends:
        return Lag(ci95=found.ci95, correlation=found.correlation)
    return found.but(
        verdict="in step",
        sentence=f"the model is in step to {number(max(abs(low), abs(high), stage.step / 2), 1)} s",
    )


def _lowest(sums: Array, lags: Array) -> float:
    """The lag of the least sum, between the rows by a parabola."""
    k = int(np.argmin(sums))
    if k in (0, sums.size - 1):
        return float(lags[k])
    return float(lags[k] + turning_point(*sums[k - 1 : k + 2].tolist()))
