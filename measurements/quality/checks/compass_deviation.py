"""Check of the compass: its deviation against the course over ground."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ....physics.motion import Motion
from ...compass import Compass, compass_of
from ...preparation.resampling import smooth
from ...statistics.blocks import CI
from ..faults import Size, blocks_of, size_of, squared_held_out
from ..record import About, Check, Found, Record

_SLOW = 0.5
"""Band in which drift is looked for, from nothing to this [Hz]: what is faster is the noise of positions."""
_LEAST = 2.0
"""A deviation is told when it is surely more than this [deg]; the drift of a lively hull passes for less."""


def _deviation(records: Sequence[Record]) -> Found:
    """Fit the deviation of the compass on straight runs; see `compass.compass_of`."""
    having = [r for r in records if "psi" in r.log.channels and {"x", "y", "v"} & set(r.log.channels)]
    if not having:
        return []
    every = [stretch.motion for record in having for stretch in record.stretches]
    whole = 2.0 / _SLOW  # two periods: the ends of a filter are not true
    motions = [smooth(motion, _SLOW) for motion in every if motion.duration > whole]
    compass = compass_of(motions)
    about = About("compass", ("psi",), unit="deg")
    if not np.isfinite(compass.error) or compass.lazy:
        return about.untold(compass.sentence)
    size, error = float(np.degrees(compass.size)), float(np.degrees(compass.error))
    ends = max(0.0, size - CI * error), size + CI * error
    coefficients = {"constant": compass.constant, "sin": compass.sine, "cos": compass.cosine}
    parts = {name: float(np.degrees(value)) for name, value in coefficients.items()}
    measured = replace(about, value=size, ci95=ends)
    beside = _beside_drift(motions, compass)
    if not compass.plain or ends[0] < _LEAST or not (beside.share.warns and beside.weight.warns):
        text = compass.doubt if compass.plain else compass.sentence
        return measured.finding("ok" if compass.sound else "cannot tell", text, parts=parts)
    by = "this curve" if compass.curve_known else "the curve through these headings"
    fast = max(float(np.abs(s.motion.velocity[:, 0]).max()) for record in having for s in record.stretches)
    return measured.finding(
        "defect",
        compass.sentence,
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
