"""Checks of the sensors: against each other, the compass against the course over ground, gravity in the accelerometer.

Heading and gyro, positions and speeds tell of one motion; see `kinematics`. A boat that trims with speed tilts its
accelerometer.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np

from ....physics.motion import GRAVITY, Motion
from ...compass import Compass, compass_of
from ...kinematics import Kinematics, kinematics_of, longest_row
from ...preparation.resampling import smooth
from ...statistics.blocks import CI, numbered_on, robust_fit
from ..faults import Size, blocks_of, size_of, squared_held_out
from ..record import RATE, Check, Finding, Found, Record, computed_once
from .clocks import on_grid

_CHANNELS = {"gyro": ("r",), "compass": ("psi",), "misalignment": ("psi",), "velocity": ("u", "v"), "water": ("u", "v")}
"""Channels that an error is of, by the first word of its name; all others are of positions."""


def _sensors(records: Sequence[Record]) -> Found:
    """Compare the sensors of each log with each other."""
    result, known, apart = [], False, False
    for record in records:
        motions = [stretch.motion for stretch in record.stretches]
        channels = record.log.channels
        seen = computed_once([record], "kinematics", lambda m=motions, c=channels: kinematics_of(m, c, longest_row(c)))
        known |= bool(seen.values)
        apart |= bool(seen.beyond) or not seen.agree
        log = f"{record.log.name}: " if len(records) > 1 else ""
        result += [_wrong(seen, name, log + sentence) for name, sentence in seen.sentences.items()]
    if result:
        return result
    text = "the sensors tell of one motion"
    if apart:
        text = "the records contradict each other by more than sensors do: units, signs or axes, or a record"
    elif not known:
        text = "too few records are of one motion, or it turns too little, to hold the sensors to each other"
    return Finding(check="sensors", verdict="ok" if known and not apart else "cannot tell", sentence=text)


def _wrong(seen: Kinematics, name: str, sentence: str) -> Finding:
    return Finding(
        check="sensors",
        verdict="warning" if seen.large(name) else "note",  # what follows is corrected for it
        value=seen.values.get(name, (None, None))[0],
        channels=_CHANNELS.get(name.split("_")[0], ("x", "y")),
        sentence=sentence,
        consequence="forces would be blamed for it; undertow corrects the motion before it judges forces",
        remedy="calibrate or move the sensor, or mend its clock, before the next log",
    )


SENSORS = Check("sensors", _sensors)


_SLOW = 0.5
"""Drift is slower than this [Hz]; what is faster is the noise of positions."""
_SETTLES = 4.0
"""Length from which a motion is looked at [s]: two periods of the slowest filter, whose ends are not true."""
_LEAST = 2.0
"""A deviation is told when it is surely more than this [deg]; the drift of a lively hull passes for less."""


def _deviation(records: Sequence[Record]) -> Found:
    """Fit the deviation of the compass on straight runs; see `compass.compass_of`."""
    having = [r for r in records if "psi" in r.log.channels and {"x", "y", "v"} & set(r.log.channels)]
    if not having:
        return []
    every = [stretch.motion for record in having for stretch in record.stretches]
    motions = [smooth(motion, _SLOW) for motion in every if motion.duration > _SETTLES]
    compass = compass_of(motions)
    finding = partial(Finding, check="compass", unit="deg", channels=("psi",))
    if not np.isfinite(compass.error) or compass.lazy:
        return finding(verdict="cannot tell", sentence=compass.sentence)
    size, error = float(np.degrees(compass.size)), float(np.degrees(compass.error))
    ends = max(0.0, size - CI * error), size + CI * error
    coefficients = {"constant": compass.constant, "sin": compass.sine, "cos": compass.cosine}
    parts = {name: float(np.degrees(value)) for name, value in coefficients.items()}
    measured = partial(finding, value=size, ci95=ends)
    beside = _beside_drift(motions, compass)
    if not compass.plain or ends[0] < _LEAST or not (beside.share.warns and beside.weight.warns):
        text = compass.doubt if compass.plain else compass.sentence
        return measured(verdict="ok" if compass.sound else "cannot tell", sentence=text, parts=parts)
    by = "this curve" if compass.curve_known else "the curve through these headings"
    fast = max(float(np.abs(s.motion.velocity[:, 0]).max()) for record in having for s in record.stretches)
    return measured(
        verdict="defect",
        sentence=compass.sentence,
        consequence=f"false sway of up to {fast * np.sin(compass.size):.2f} m/s at {fast:.1f} m/s; no "
        "force in sway can be learned",
        remedy=f"calibrate the compass; discover corrects the heading by {by} and judges no sway force",
        parts=parts if compass.curve_known else {},
        short=f"the compass deviates by {size:.0f} degrees",
    )


def _beside_drift(motions: Sequence[Motion], compass: Compass) -> Size:
    """What a deviation of the compass explains of the sway beside the hull's drift, held out, over what it would make.

    A ship that turns all the while drifts on all her runs, and on each heading as she turns there; a hull or a thruster
    that pushes aside makes the same drift on every heading, as the constant of a deviation does. A slow ship drifts on
    after her turns: a deviation that stands for that makes far more than what is left beside the drift, so that both
    shares count.
    """
    surge, sway, rate = np.concatenate([motion.velocity for motion in motions]).T
    heading = np.concatenate([motion.heading for motion in motions])
    drift = [rate, surge * rate, rate * np.abs(rate), surge]
    turned = [surge * np.sin(heading), surge * np.cos(heading)]
    block = blocks_of([motion.time.size for motion in motions])
    without, beside = (squared_held_out(sway, np.column_stack(table), block) for table in (drift, [*drift, *turned]))
    made = np.column_stack(turned) @ [compass.sine, compass.cosine]
    return size_of(without, beside, made**2, block)


DEVIATION = Check("compass", _deviation)


_BLOCK = 5.0
"""Length of a stretch that counts once [s]: rows of one manoeuvre err together."""
_SMALL = 0.15
"""Leak up to which the accelerometer shows accelerations [m/s^2]: a degree of trim."""
_MUCH = 0.5
"""Leak from which the accelerometer is of no use as one [m/s^2]."""
_TIMES = 5.0
"""Standard errors from which a leak is certain, as a sign is in `response`."""


def _tilt(records: Sequence[Record]) -> Found:
    """Compare the accelerometer ahead with the change of speed, and look for a part that grows with speed squared."""
    having = [record for record in records if "ax" in record.log.channels]
    if not having:
        return []
    finding = partial(Finding, check="tilt", unit="m/s^2", channels=("ax",))
    stretches = [(record, stretch) for record in having for stretch in record.stretches]
    speeds = [np.abs(stretch.motion.velocity[:, 0]) for _, stretch in stretches]
    fast = float(np.quantile(np.concatenate(speeds), 0.99)) if speeds else 0.0
    if fast < 0.1:
        text = "the boat moves too little to tell whether gravity leaks into the accelerometer"
        return finding(verdict="cannot tell", sentence=text)
    rest, columns, blocks = [], [], []
    for record, stretch in stretches:
        motion = stretch.motion
        surge, sway, rate = motion.velocity.T
        rest.append(on_grid(record, "ax", motion.time) - np.gradient(surge, 1.0 / RATE) + sway * rate)
        columns.append(np.column_stack([surge * np.abs(surge) / fast**2, np.ones_like(surge)]))
        blocks.append(((motion.time - motion.time[0]) // _BLOCK).astype(np.int64))
    fit = robust_fit(np.concatenate(columns), np.concatenate(rest), numbered_on(blocks))
    leak, ends = float(fit.values[0]), fit.interval(0)
    if ends is None:
        text = "the log is too short to tell whether gravity leaks into the accelerometer"
        return finding(verdict="cannot tell", sentence=text)
    parts = {"at_speed": fast, "offset": float(fit.values[1])}
    measured = partial(finding, value=leak, ci95=ends, parts=parts)
    if max(abs(ends[0]), abs(ends[1])) <= _SMALL:
        text = f"the accelerometer shows accelerations only (a leak of {leak:+.2f} m/s² at {fast:.1f} m/s)"
        return measured(verdict="ok", sentence=text)
    if abs(leak) <= _SMALL or not fit.certain(0, _TIMES):
        text = f"too little to tell whether gravity leaks into the accelerometer ({ends[0]:.2f} to {ends[1]:.2f} m/s²)"
        return measured(verdict="cannot tell", sentence=text)
    angle = float(np.degrees(np.arcsin(np.clip(abs(leak) / GRAVITY, 0.0, 1.0))))
    trim = "bow up" if leak > 0.0 else "bow down"
    return measured(
        verdict="warning" if abs(leak) > _MUCH else "note",
        sentence=f"ax holds {leak:+.2g} m/s² of gravity at {fast:.1f} m/s: it trims {trim} by {angle:.0f} degrees",
        consequence="ax is no acceleration at speed; undertow does not use it",
        remedy="take accelerations from speeds, or correct ax for the pitch angle",
        short="gravity leaks into the accelerometer",
    )


TILT = Check("tilt", _tilt)
