"""Trends of the error: with the heading, as of a current, a wind or a compass that errs, and along the log."""

from typing import Self

import numpy as np
from pydantic import SerializerFunctionWrapHandler, model_serializer, model_validator

from ...measurements.statistics.blocks import fisher
from ...physics.file_records import Number, Record
from ...physics.motion import AXES
from ...physics.presentation import number, percent, unit_text
from ...residuals.scores import ACCELERATION_UNITS
from .features import sector
from .rows import Array, Fitted, Scene, finite_mean, fit_with_nuisances, short, static_columns

SECTORS = ("N", "NE", "E", "SE", "S", "SW", "W", "NW")
_SECTOR_SECONDS, _FEWEST_SECTORS = 3.0, 5
"""Time [s] in a sector for it to count as sailed, and sectors that must be."""
_FREE = 0.02
"""Share of a harmonic of the heading that speeds and commands must leave unexplained; a current leaves little, for it
moves the boat along with the heading, and the standard errors know it."""
_CHANCE = 0.002
"""Chance of calling noise a dependence on heading, on one axis."""
_MATERIAL = 0.06
"""Amplitude, as a share of the usual acceleration, below which a dependence does not matter."""
_AGREE = np.radians(45.0)
"""Angle within which surge and sway must point in the same direction of the earth."""
_DEPENDS, _DOES_NOT, _CANNOT = "depends on heading", "does not", "this log cannot tell"
_UNTOLD = f"{_CANNOT}: {{}}"


class Harmonic(Record):
    """First harmonic of the error over the heading: amplitude [`unit`] with its 95 % interval, and direction.

    The direction [degrees from north] is in surge and sway where the boat is pushed to that the model does not know, in
    yaw the heading at which it is turned most to starboard.
    """

    amplitude: Number
    direction: Number
    ci95: tuple[Number, Number]
    unit: str


class Heading(Record):
    """Dependence of the error on one axis on the heading.

    Attributes
    ----------
    sectors, mean, spread : directions, median and half the range of the middle half of modelled minus measured
        acceleration on headings near each; None where the boat was not
    harmonic : None where this log cannot tell
    suspects : what it would point to
    verdict : "depends on heading", "does not", "this log cannot tell"
    sentence : the same in words
    """

    sectors: tuple[str, ...] = SECTORS
    mean: tuple[Number | None, ...]
    spread: tuple[Number | None, ...]
    harmonic: Harmonic | None = None
    suspects: tuple[str, ...] = ()
    verdict: str = _CANNOT
    sentence: str = ""

    @model_validator(mode="after")
    def _one_length(self) -> Self:
        if not len(self.sectors) == len(self.mean) == len(self.spread):
            raise ValueError("as many values of 'mean' and 'spread' as of 'sectors'")
        return self

    @model_serializer(mode="wrap")
    def _in_order(self, handler: SerializerFunctionWrapHandler) -> dict[str, object]:
        """Where the log cannot tell, files have always had the verdict before the suspects."""
        content: dict[str, object] = handler(self)
        late = ("suspects", "sentence") if self.harmonic is None else ()
        return content | {name: content.pop(name) for name in late}


def against_heading(stage: Scene) -> dict[str, Heading]:
    """Estimate how the error depends on the heading, by axis, beside every force of the present motion and commands.

    The measured less the modelled acceleration is fitted by a harmonic of the heading, b cos(psi) + c sin(psi), beside
    what speeds and commands explain, with a block bootstrap. A push that is fixed in the earth shows in surge and sway
    with one direction; a compass error shows in sway alone, in proportion to speed.

    Returns
    -------
    By axis.
    """
    psi = stage.table["psi"]
    near = sector(psi)
    sailed = np.bincount(near, minlength=len(SECTORS)) * stage.step >= _SECTOR_SECONDS
    harmonic = np.column_stack([np.cos(psi), np.sin(psi)])
    beside = static_columns(stage)
    fits = [fit_with_nuisances(stage, -stage.error[:, k], harmonic, beside) for k in range(3)]
    told = {}
    for k, axis in enumerate(AXES):
        ends = [_quartiles(stage.error[near == n, k]) if sailed[n] else None for n in range(len(SECTORS))]
        known = Heading(
            mean=tuple(None if of is None else short(of[1]) for of in ends),
            spread=tuple(None if of is None else short(0.5 * (of[2] - of[0])) for of in ends),
        )
        if sailed.sum() < _FEWEST_SECTORS:
            why = f"the boat sailed in {sailed.sum()} of {len(SECTORS)} directions only"
            told[axis] = known.but(sentence=_UNTOLD.format(why))
        else:
            told[axis] = _heading_of(known, fits[k], float(stage.spread[k]), k)
    return _suspected(told, stage, psi)


def _quartiles(error: Array) -> Array | None:
    """Of the finite ones; None where there is none."""
    usable = error[np.isfinite(error)]
    return np.quantile(usable, [0.25, 0.5, 0.75]) if usable.size else None


def _heading_of(known: Heading, fit: Fitted | None, usual: float, axis: int) -> Heading:
    unit = ACCELERATION_UNITS[AXES[axis]]
    if fit is None or fit.free.min() < _FREE:
        return known.but(sentence=_UNTOLD.format("too short" if fit is None else "heading and motion go together"))
    cosine, sine = fit.values
    amplitude = float(np.hypot(cosine, sine))
    # In the earth: a push towards chi gives A cos(psi - chi) ahead and -A sin(psi - chi) to starboard.
    direction = np.arctan2(cosine, -sine) if axis == 1 else np.arctan2(sine, cosine)
    course = float(np.degrees(direction) % 360.0)
    low, high = (float(end) for end in np.quantile(np.hypot(*fit.sample.T), [0.025, 0.975]))
    ends = (short(low), short(high))
    harmonic = Harmonic(amplitude=short(amplitude), direction=round(course, 1), ci95=ends, unit=unit)
    found = known.but(harmonic=harmonic)
    size, most = (f"{number(value, 2)} {unit_text(unit)}" for value in (amplitude, max(high, amplitude)))
    if _is_sure(fit) and amplitude > _MATERIAL * usual:
        towards = f"{number(course, 2)} degrees"
        way = f"most to starboard on heading {towards}" if axis == 2 else f"a push towards {towards}"
        return found.but(verdict=_DEPENDS, sentence=f"the error turns with the heading by {size}: {way}")
    if max(high, amplitude) <= 2.0 * _MATERIAL * usual:
        return found.but(verdict=_DOES_NOT, sentence=f"no more than {most} of the error turns with the heading")
    return found.but(sentence=_UNTOLD.format(f"up to {most} may"))


def _suspected(told: dict[str, Heading], stage: Scene, psi: Array) -> dict[str, Heading]:
    """Name suspects where the directions are plain; nothing where they are not."""
    surge, sway = told["surge"], told["sway"]
    both = surge.verdict == sway.verdict == _DEPENDS
    if both and surge.harmonic is not None and sway.harmonic is not None:
        between = np.radians(surge.harmonic.direction - sway.harmonic.direction)
        if abs((between + np.pi) % (2.0 * np.pi) - np.pi) < _AGREE:
            agree = "; surge and sway agree, which would point to a current or a wind"
            for axis in ("surge", "sway"):
                sentence = told[axis].sentence + agree
                told[axis] = told[axis].but(suspects=("steady_current", "mean_wind"), sentence=sentence)
    elif sway.harmonic is not None and surge.verdict == _DOES_NOT and _follows_speed(stage, psi):
        found = "the error turns with the heading in proportion to speed, in sway alone"
        sentence = f"{found}, which would point to the compass"
        told["sway"] = sway.but(suspects=("compass",), verdict=_DEPENDS, sentence=sentence)
    return told


def _follows_speed(stage: Scene, psi: Array) -> bool:
    """True when the sway error has a harmonic of the heading that grows with the surge speed and turns sign with it.

    A compass that errs makes sway speed out of surge speed, so that sway speed would explain its own error.
    """
    beside = static_columns(stage, sway=False)
    u = np.nan_to_num(stage.table["u"])
    columns = np.column_stack([u * np.cos(psi), u * np.sin(psi)])
    still = np.column_stack([np.cos(psi), np.sin(psi)])
    fit = fit_with_nuisances(stage, -stage.error[:, 1], columns, np.column_stack([beside, still]))
    if fit is None or fit.free.min() < _FREE:
        return False
    size = float(np.hypot(*fit.values)) * float(np.sqrt((u**2).mean()))
    material = size > _MATERIAL * float(stage.spread[1])
    return material and _is_sure(fit)


def _is_sure(fit: Fitted) -> bool:
    """True when the two coefficients of a harmonic are more than noise."""
    test = float(fit.values @ np.linalg.solve(fit.covariance + 1e-300 * np.eye(2), fit.values)) / 2.0
    return test > fisher(2, max(fit.blocks - 2, 3), 1.0 - _CHANCE)


_SHORTEST = 60.0
"""Span of time [s] over which a drift can be told."""
_CLEAR, _CLEARLY_GROWN = 3.5, 5.0
"""Standard errors from which a trend of the error, and of its size, is told; the size changes with all that is done."""
_MATERIAL_DRIFT, _GROWTH = 0.1, 0.3
"""Change over the log, as a share of the usual acceleration, and of the size of the error, that matters."""
_FREE_TIME = 0.1
"""Share of a column that the others must leave free: with less, its error is over three times that of one alone."""


class Drift(Record):
    """The trend of the error on one axis along the log, at equal motion and commands.

    Attributes
    ----------
    per_minute, ci95 : of the error, modelled minus measured [`unit`]; None, as the next, where this log cannot tell
    size_per_minute, size_ci95 : of its size, as shares of the mean size
    verdict : "drifts", "grows", "shrinks", "steady", "this log cannot tell"
    sentence : the same in words
    """

    per_minute: Number | None = None
    ci95: tuple[Number, Number] | None = None
    size_per_minute: Number | None = None
    size_ci95: tuple[Number, Number] | None = None
    unit: str
    verdict: str = _CANNOT
    sentence: str


def over_time(stage: Scene) -> dict[str, Drift]:
    """The trend of the error and of its size along each log, by axis, at equal motion and commands.

    Linear fits beside what the present speeds and commands explain (for the size: beside how much the boat moved),
    with errors that are robust to the autocorrelation within and between blocks.

    Returns
    -------
    By axis.
    """
    time, span = _minutes(stage)
    logs, static = (stage.log[:, None] == np.unique(stage.log)).astype(float), static_columns(stage)[:, 1:]
    moved = np.abs(static[:, :11])
    told = {}
    for k, axis in enumerate(AXES):
        error, size = stage.error[:, k], np.abs(stage.error[:, k])
        mean = fit_with_nuisances(stage, error, time[:, None], np.column_stack([logs, static]))
        beside = np.column_stack([logs, moved, np.abs(stage.measured[:, k])])
        grown = fit_with_nuisances(stage, size, time[:, None], beside)
        unit, usual = ACCELERATION_UNITS[axis], float(stage.spread[k])
        told[axis] = Drift(unit=unit, sentence=_UNTOLD.format("too short for a drift"))
        if mean is None or 60.0 * span < _SHORTEST:
            continue
        if grown is None or min(mean.free[0], grown.free[0]) < _FREE_TIME:
            told[axis] = told[axis].but(sentence=_UNTOLD.format("what the boat did changed along with the time"))
        else:
            told[axis] = _drift_of(mean, grown, span, unit, (usual, float(finite_mean(size))))
    return told


def _drift_of(mean: Fitted, grown: Fitted, span: float, unit: str, sizes: tuple[float, float]) -> Drift:
    """The trend by a fit of the error and one of its size.

    Parameters
    ----------
    mean, grown : the two fits
    span : of the longest log [min]
    unit : of the error
    sizes : of the usual acceleration, and of the error
    """
    usual, size = sizes
    slope, growth = float(mean.values[0]), float(grown.values[0]) / max(size, 1e-300)
    (low, high), (least, most) = mean.interval(0), np.array(grown.interval(0)) / max(size, 1e-300)
    found = Drift(
        per_minute=short(slope),
        ci95=(short(low), short(high)),
        size_per_minute=short(growth),
        size_ci95=(short(least), short(most)),
        unit=unit,
        sentence="",
    )
    if abs(slope) > _CLEAR * mean.errors[0] and abs(slope) * span > _MATERIAL_DRIFT * usual:
        sentence = f"the error drifts by {number(slope, 2)} {unit_text(unit)} a minute at equal speeds and commands"
        return found.but(verdict="drifts", sentence=sentence)
    grows = abs(grown.values[0]) > _CLEARLY_GROWN * grown.errors[0] and abs(growth) * span > _GROWTH
    if grows and size > _MATERIAL_DRIFT * usual:
        verdict = "grows" if growth > 0.0 else "shrinks"
        return found.but(verdict=verdict, sentence=f"the error {verdict} by {percent(abs(growth))} a minute")
    reach = max(abs(low), abs(high)) * span
    bound = f"{number(reach, 2)} {unit_text(unit)}"
    if reach > 2.0 * max(_MATERIAL_DRIFT * usual, size):
        return found.but(sentence=_UNTOLD.format(f"the error may drift by {bound} over the log"))
    return found.but(verdict="steady", sentence=f"no drift: less than {bound} over the log")


def _minutes(stage: Scene) -> tuple[Array, float]:
    """Time since the beginning of each log, and the longest log [min]."""
    time = stage.table["time"] / 60.0
    since = time.copy()
    for log in np.unique(stage.log):
        since[stage.log == log] -= time[stage.log == log].min()
    return since, float(since.max())
