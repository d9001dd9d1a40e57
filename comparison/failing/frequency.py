"""Dynamics of the error: its spectrum and coherence with commands and speeds, and a lag of the model."""

from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from ...measurements.statistics.signals import turning_point
from ...physics.file_records import Number, Record
from ...physics.motion import AXES
from ...physics.presentation import NARROW, number, percent
from ...physics.sampled_series import first_order_lag
from .rows import Array, Scene, contiguous, draws, earth_columns, mean_square, shorter, span, static_columns

NOISE = ("like noise", "negligible")
"""Verdicts by which an error is no more than its sensors make."""
_LENGTHS = (25.6, 12.8, 6.4)
"""Lengths of a spectrum's windows [s]; the first that gives `_FEWEST` of them is taken."""
_FEWEST = 8
"""Windows for a spectrum: the power in each band is then known to about a third."""
_SHARE = 0.8
"""Share of the error's power below the frequency that is told."""
_SLOW = 0.4
"""Frequency [Hz] below which a boat's forces live, and above which the noise of differentiated speeds does."""
_COHERENT = 0.3
"""Mean coherence from which the error is said to move with a signal."""
_CLEAR = 4.5
"""Standard deviations above what independent signals would show."""
_NEVER = 0.8
"""Coherence by chance from which a log is too short: hardly any signal would show more."""
_NEGLIGIBLE = 0.03
"""Error, as a share of the usual acceleration, of which there is nothing to tell."""
_HANN = 1.056
"""Windows that overlap by half count for so many times fewer (Welch 1967, eq. 13, for a Hann window)."""
_HIGHEST = 2.0
"""Frequency [Hz] up to which spectra are told: preparation leaves nothing above it."""


class Frequency(Record):
    """Spectra of the error on one axis, and what it moves with.

    Attributes
    ----------
    hz, error, measured, unit : frequencies, and power spectral densities of the error and of what was measured
    coherence, coherent_with : with the signal of the largest one; None where the error follows none
    below_hz : 80 % of the error's power lies below
    verdict : "slow force", "answer to commands", "slow, of unknown origin", "like noise", "negligible", "this log
        cannot tell"
    sentence : the same in words
    """

    hz: tuple[Number, ...] = ()
    error: tuple[Number, ...] = ()
    measured: tuple[Number, ...] = ()
    unit: str = ""
    coherence: tuple[Number, ...] = ()
    coherent_with: str | None = None
    below_hz: Number | None = None
    verdict: str
    sentence: str

    @model_validator(mode="after")
    def _one_length(self) -> Self:
        if not len(self.hz) == len(self.error) == len(self.measured):
            raise ValueError("as many values of 'error' and 'measured' as of 'hz'")
        return self


def against_frequency(stage: Scene) -> dict[str, Frequency]:
    """Spectra of error and measured acceleration by axis, and the coherence of the error with what it follows best.

    Welch's method (1967) over all gap-free stretches together: windows of 6 to 26 s that overlap by half.

    Returns
    -------
    By axis.
    """
    windows = _windows(stage)
    if windows is None:
        return {axis: Frequency(verdict="this log cannot tell", sentence="too short for a spectrum") for axis in AXES}
    signals = _signals(stage)
    hz = np.asarray(np.fft.rfftfreq(windows.shape[1], stage.step), dtype=float)
    error, measured = (_transformed(np.nan_to_num(values), windows) for values in (stage.error, stage.measured))
    others = _transformed(np.column_stack(list(signals.values())), windows)
    shown = (hz > 0.0) & (hz <= _HIGHEST)
    scale = 2.0 * stage.step / (_taper(windows.shape[1]) ** 2).sum()
    names, chance_of_one = list(signals), _HANN / windows.shape[0]
    told = {}
    for k, axis in enumerate(AXES):
        power, spread = ((np.abs(values[..., k]) ** 2).mean(axis=0) for values in (error, measured))
        found = Frequency(
            hz=shorter(hz[shown], 4),
            error=shorter(scale * power[shown], 4),
            measured=shorter(scale * spread[shown], 4),
            unit="(m/s^2)^2/Hz" if k < 2 else "(rad/s^2)^2/Hz",
            coherence=(0.0,) * int(shown.sum()),
            verdict="negligible",
            sentence="there is no error to speak of",
        )
        told[axis] = found
        total = power[shown].sum()
        if mean_square(stage.error)[k] < (_NEGLIGIBLE * stage.spread[k]) ** 2 or total <= 0.0:
            continue
        cross = (np.conj(error[..., k, None]) * others).mean(axis=0)
        energy = (np.abs(others) ** 2).mean(axis=0)
        coherence = np.abs(cross) ** 2 / np.maximum(power[:, None] * energy, 1e-300)
        below = float(hz[shown][np.searchsorted(np.cumsum(power[shown]) / total, _SHARE)])
        weight = power * (shown & (hz <= below))
        weight /= weight.sum()
        # Speeds bear the same noise as the error where they are fast; only commands are free of it there.
        allowed = np.array([below <= _SLOW or "command" in name for name in names])
        mean = np.where(allowed, weight @ coherence, -1.0)
        chance = (1.0 + _CLEAR * np.sqrt(1.5 * (weight**2).sum())) * chance_of_one
        best = int(np.argmax(mean))
        follows = names[best] if mean[best] > max(_COHERENT, chance) else None
        verdict, sentence = _verdict(below, follows, float(chance))
        told[axis] = found.but(
            coherence=shorter(coherence[shown, best], 3),
            coherent_with=follows,
            below_hz=round(below, 4),
            verdict=verdict,
            sentence=sentence,
        )
    return told


def _verdict(below: float, follows: str | None, chance: float) -> tuple[str, str]:
    """What an error is, in a word and in a sentence.

    Parameters
    ----------
    below : frequency below which most of it lies [Hz]
    follows : the signal that it moves with
    chance : coherence that independent signals may show
    """
    most = f"{_SHARE * 100:.0f}{NARROW}% of the error lies below {number(below, 2)} Hz"
    reaches = f"the error reaches up to {number(below, 2)} Hz and moves with"
    if follows and below <= _SLOW:
        return "slow force", f"{most} and moves with the {follows}: a slow force is missing, not noise"
    if follows:
        return "answer to commands", f"{reaches} the {follows}, so it is not noise"
    if chance > _NEVER:
        return "this log cannot tell", f"{most}; too short to say what it moves with"
    if below <= _SLOW:
        unknown = "so it is not white noise, but it moves with no command or speed in proportion"
        return "slow, of unknown origin", f"{most}, {unknown}"
    return "like noise", f"{reaches} no command, as sensor noise does"


def _windows(stage: Scene) -> NDArray[np.intp] | None:
    """Rows of each window, (windows, length), of the longest length of which there are enough."""
    stretches = contiguous(stage)
    for seconds in _LENGTHS:
        length = round(seconds / stage.step)
        starts = [rows[k] for rows in stretches for k in range(0, rows.size - length + 1, length // 2)]
        if len(starts) >= _FEWEST:
            return np.array(starts)[:, None] + np.arange(length)
    return None


def _signals(stage: Scene) -> dict[str, Array]:
    found = {"surge speed": stage.table["u"], "sway speed": stage.table["v"], "yaw rate": stage.table["r"]}
    if stage.commands.shape[1]:
        found["mean command"] = stage.common
    if stage.commands.shape[1] > 1:
        found["difference of the commands"] = stage.commands[:, 0] - stage.commands[:, -1]
    return {name: np.nan_to_num(values) for name, values in found.items()}


def _transformed(values: Array, windows: NDArray[np.intp]) -> NDArray[np.complex128]:
    """Fourier transforms of every window, (windows, frequencies, columns)."""
    taper = _taper(windows.shape[1])[None, :, None]
    return np.fft.rfft((values[windows] - values[windows].mean(axis=1, keepdims=True)) * taper, axis=1)


def _taper(rows: int) -> Array:
    """A Hann window of whole periods, (rows,)."""
    return np.hanning(rows + 1)[:-1]


_REACH = (-0.6, 1.5)
"""Lags [s] that are tried; positive where the boat answers after the model."""
_GAIN = 0.05
"""Share of the squared error by which the lag must lower it to be told."""
_MATERIAL = 0.05
"""Error that the lag makes, as a share of the usual acceleration."""
_FEWEST_BLOCKS = 8
"""Blocks for an interval of the lag: a resample of fewer has too few that differ from the log."""
_SUSPECTS = ("thruster_lag", "input_delay")
_CANNOT = "this log cannot tell"


class Lag(Record):
    """Lag of the boat behind the model on one axis.

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
    """Estimate by how much the boat answers its thrusters after the model, by axis.

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
    if not usable.size or blocks.max() + 1 < _FEWEST_BLOCKS:
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
    result = np.empty((thrust.size, constants.size))
    for k, constant in enumerate(constants):
        for number_of in np.unique(stage.stretch):
            rows = stage.stretch == number_of
            result[rows, k] = first_order_lag(thrust[rows], float(constant), stage.step)
    return result


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
        sentence = (
            f"the model answers {number(seconds, 2)} s before the boat, which makes {percent(gain)} of the squared "
            "error that the present speeds and commands leave: would point to thruster lag, input delay, or channels "
            "out of step"
        )
        return found.but(verdict="early", suspects=_SUSPECTS, sentence=sentence)
    if clear:
        late = f"the model answers {number(-seconds, 2)} s after the boat, which no boat does"
        return found.but(verdict="late", sentence=f"{late}: look for channels that are out of step")
    if high - low > 0.5 or ends:
        return Lag(ci95=found.ci95, correlation=found.correlation)
    reach = number(max(abs(low), abs(high), stage.step / 2), 1)
    return found.but(verdict="in step", sentence=f"the model is in step to {reach} s")


def _lowest(sums: Array, lags: Array) -> float:
    """The lag of the least sum, between the rows by a parabola."""
    k = int(np.argmin(sums))
    if k in (0, sums.size - 1):
        return float(lags[k])
    return float(lags[k] + turning_point(*sums[k - 1 : k + 2].tolist()))
