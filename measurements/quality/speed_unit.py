"""The unit of speeds that no position confirms: by the accelerometer, or by what the thrusters do to the vehicle."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...physics.forces import modelled_acceleration
from ...physics.frames import Array
from ...physics.motion import Motion
from ...physics.vehicle import Vehicle
from ..statistics.robust import Fit, robust_fit
from .finding import Finding, Reach
from .record import RATE, Record

_PIECE = 2.0
"""Length of the pieces over which changes of speed are compared [s]: a boat's answer to its thrusters."""
_LEAST_PIECES = 20
"""Pieces that are needed: 40 s, some manoeuvres."""
_CLEARLY = 0.5
"""Error that speeds in their unit leave, at most, of that in metres a second: an effect that the vehicle lacks leaves
more, since it does not divide speed, drag and acceleration alike."""
_FINE = 0.1
"""Share by which a record may differ from a unit: sensors are calibrated to some per cent, and forces known to ten."""
_FOLLOWS = 0.9
"""Share of the changes of speed that thrust and any drag explain where both are the boat's own: field noise and a
hidden effect leave 0.99."""
_CERTAIN = 12.0
"""Times its error that a factor must be: units lie a factor of 1.15 and more apart."""
_BESIDES = 4
"""Columns beside those of the thrusters: drag and turning of the hull, and the wind of the vehicle file."""
_PUSHES = 0.3
"""Share of the strongest push ahead from which a thruster pushes ahead: one across the hull tells nothing."""


def speed_unit(records: Sequence[Record], units: Mapping[float, str]) -> list[Finding]:
    """Tell the unit of speeds that are measured once; one finding, none where the logs have no speeds of their own.

    Parameters
    ----------
    records : logs without positions
    units : metres a second in other units of speed, and their names
    """
    having = [record for record in records if "u" in record.log.channels and record.stretches]
    if not having:
        return []
    channels = ("u", "v") if all("v" in record.log.channels for record in having) else ("u",)
    judged = _by_accelerometer(having), _by_vehicle(having, [1.0, *units]), _by_mass(having)
    for factor, witness in judged:
        if factor is None:
            continue
        unit = next((name for one, name in units.items() if abs(factor / one - 1.0) <= _FINE), "")
        if unit:
            text = f"{' and '.join(channels)} are in {unit}: {witness} moves {factor:.3g} times as fast as they say"
            scale = next(one for one in units if abs(factor / one - 1.0) <= _FINE)
            remedy = f"map them with 'scale: {scale:g}', or mend the vehicle's mass or thrust if speeds are right"
            wrong = "drag and thrust come out wrong by powers of this factor"
            return [
                Finding(
                    check="units",
                    verdict="defect",
                    sentence=text,
                    value=factor,
                    unit="1",
                    channels=channels,
                    consequence=wrong,
                    remedy=remedy,
                    reach=Reach.LOG,
                )
            ]
        if abs(factor - 1.0) <= _FINE:
            return [
                Finding(
                    check="units",
                    verdict="ok",
                    sentence=f"{witness} agrees with speeds in m/s",
                    value=factor,
                    unit="1",
                    channels=channels,
                )
            ]
    top = max(float(np.abs(stretch.motion.velocity[:, 0]).max()) for record in having for stretch in record.stretches)
    return [
        Finding(
            check="units",
            verdict="cannot tell",
            sentence=f"the unit of speed cannot be told: speed was measured once (no positions), and its top is "
            f"{top:.2g} m/s, or {0.514444 * top:.2g} m/s if it is in knots",
            value=top,
            unit="m/s",
            channels=channels,
            consequence="drag and thrust come out wrong by powers of the unit",
            remedy="make sure that speeds are in m/s, or log positions, too",
            short="the unit of speed, which was measured once",
        )
    ]


def _by_accelerometer(records: Sequence[Record]) -> tuple[float | None, str]:
    """Acceleration ahead over the change of the speeds; a tilt by speed is a part of its own."""
    rows = []
    for record in records:
        channel = record.log.channels.get("ax")
        if channel is None:
            continue
        for stretch in record.stretches:
            motion = stretch.motion
            surge, sway, rate = motion.velocity.T
            felt = np.interp(motion.time, channel.time, channel.value)
            rows.append(_changes(surge, [np.ones_like(surge), surge * np.abs(surge)], felt, -sway * rate))
    fit = _fit(rows)
    if fit is None or fit.explained < 0.5 or not fit.certain(0, _CERTAIN):
        return None, ""
    return float(fit.values[0]), "the accelerometer"


def _by_mass(records: Sequence[Record]) -> tuple[float | None, str]:
    """How much slower thrust changes the speeds than it should, by the vehicle's mass, whatever its drag may be.

    Each thruster that pushes ahead is asked, for one of them may be weak; the strongest that can tell is heard.
    """
    rows, length = [], round(_PIECE * RATE)
    for vehicle, motion in _driven(records):
        still = replace(motion, velocity=np.zeros_like(motion.velocity))
        scales = [f"{thruster.name}_scale" for thruster in vehicle.thrusters]
        without = vehicle.with_values(dict.fromkeys(scales, 0.0))
        weather = modelled_acceleration(without, still)[:, 0]
        alone = [without.with_values({s: vehicle.value(s)}) for s in scales]
        push = [modelled_acceleration(one, still)[:, 0] - weather for one in alone]
        surge, sway, rate = motion.velocity.T
        besides = np.column_stack([*push, surge, surge * np.abs(surge), sway * rate, weather])
        total = np.concatenate([np.zeros((1, besides.shape[1])), np.cumsum(besides, axis=0) / RATE])[:-1]
        rows.append((np.diff(surge[::length]), np.diff(total[::length], axis=0)))
    fit = _fit(rows)
    if fit is None or fit.explained < _FOLLOWS:
        return None, ""
    size = np.sqrt((np.concatenate([columns for _, columns in rows]) ** 2).mean(axis=0))[:-_BESIDES]
    told = [float(fit.values[k]) for k in np.flatnonzero(size > _PUSHES * size.max()) if fit.certain(int(k), _CERTAIN)]
    if not told or max(told) <= 0.0:
        return None, ""
    return 1.0 / max(told), "the vehicle's mass, as its thrusters push it,"


def _changes(surge: Array, besides: Sequence[Array], felt: Array, turning: Array) -> tuple[Array, Array]:
    """What was felt over each piece, and what speeds say, with what comes besides."""
    step = 1.0 / RATE
    rows = np.arange(0, surge.size, round(_PIECE * RATE))
    total = np.concatenate(
        ([[0.0] * (2 + len(besides))], np.cumsum(np.column_stack([felt, turning, *besides]), axis=0))
    )
    part = step * np.diff(total[rows], axis=0)
    return part[:, 0], np.column_stack([np.diff(surge[rows]) + part[:, 1], part[:, 2:]])


def _fit(rows: Sequence[tuple[Array, Array]]) -> Fit | None:
    target, columns = (np.concatenate([row[k] for row in rows]) if rows else np.zeros(0) for k in range(2))
    if target.shape[0] < _LEAST_PIECES:
        return None
    return robust_fit(columns, target, np.arange(target.shape[0]))


def _driven(records: Sequence[Record]) -> list[tuple[Vehicle, Motion]]:
    """Every stretch with commands, and the vehicle that they drive."""
    return [
        (record.vehicle, motion)
        for record in records
        for stretch in record.stretches
        if record.vehicle is not None and (motion := record.driven(stretch)) is not None
    ]


def _by_vehicle(records: Sequence[Record], factors: Sequence[float]) -> tuple[float | None, str]:
    """The factor with which speeds follow the vehicle's thrust and drag best; None where no other is clearly worse."""
    motions = _driven(records)
    if sum(motion.duration for _, motion in motions) < _LEAST_PIECES * _PIECE:
        return None, ""
    errors = {factor: _error(motions, factor) for factor in factors}
    best, second = sorted(errors, key=lambda factor: errors[factor])[:2]
    told = errors[best] < _CLEARLY and errors[best] < _CLEARLY * errors[1.0 if best != 1.0 else second]
    return (best if told else None), "the vehicle, as its thrusters push it,"


def _error(motions: Sequence[tuple[Vehicle, Motion]], factor: float) -> float:
    """Share of the changes of speed over pieces that the vehicle does not explain, with speeds times a factor."""
    left = size = 0.0
    rows = round(_PIECE * RATE)
    for vehicle, motion in motions:
        scaled = replace(motion, velocity=motion.velocity * np.array([factor, factor, 1.0]))
        due = np.concatenate(([0.0], np.cumsum(modelled_acceleration(vehicle, scaled)[:, 0]) / RATE))[:-1]
        change, wanted = (np.diff(series[::rows]) for series in (scaled.velocity[:, 0], due))
        left += float(((change - wanted) ** 2).sum())
        size += float((change**2).sum())
    return float(np.sqrt(left / size)) if size > 0.0 else np.inf
