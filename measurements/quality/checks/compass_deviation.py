"""Whether the compass points where the boat goes: its deviation against the course over ground."""

from collections.abc import Sequence
from typing import ClassVar, final

import numpy as np

from ...compass import FAST, STRAIGHT, compass_of
from ...preparation.derive import smooth
from ..finding import Check, Finding
from ..record import RATE, Record

_LEAST = 2.0
"""A deviation is told when it is surely more than this [deg]; the drift of a lively hull passes for less."""
_SLOW = 0.5
"""Drift is slower than this [Hz]; what is faster is the noise of positions."""
_SETTLES = 4.0
"""Length from which a motion is looked at [s]: two periods of the slowest filter, whose ends are not true."""
_LAZY = 0.02, 0.2
"""Of a ship whose fastest turns lie between these [rad/s], no run is straight by the measure of `compass_of`."""
_SECTORS, _MOST_SECTORS = 12, 7
"""Sectors of the compass, and those on which the boat must have run straight before the curve is told."""


@final
class Deviation(Check):
    """Fits the deviation of the compass on straight runs; see `compass.compass_of`."""

    name: ClassVar[str] = "compass"

    def examine(self, records: Sequence[Record]) -> list[Finding]:
        """See `Check`."""
        having = [r for r in records if "psi" in r.log.channels and {"x", "y", "v"} & set(r.log.channels)]
        if not having:
            return []
        motions = [stretch.motion for record in having for stretch in record.stretches]
        compass = compass_of([smooth(motion, _SLOW) for motion in motions if motion.duration > _SETTLES])
        channels = ("psi",)
        if not np.isfinite(compass.error):
            return [
                Finding(
                    check=self.name, verdict="cannot tell", sentence=compass.sentence, unit="deg", channels=channels
                )
            ]
        if _LAZY[0] < _fastest_turn(having) < _LAZY[1]:
            text = "the boat turns too slowly for its drift in a turn to be told from a deviation of the compass"
            return [Finding(check=self.name, verdict="cannot tell", sentence=text, unit="deg", channels=channels)]
        size, error = float(np.degrees(compass.size)), float(np.degrees(compass.error))
        ends = max(0.0, size - 1.96 * error), size + 1.96 * error
        names = ("constant", "sin", "cos")
        values = (compass.constant, compass.sine, compass.cosine)
        parts = {name: float(np.degrees(value)) for name, value in zip(names, values, strict=True)}
        if not compass.plain or ends[0] < _LEAST:
            verdict = "ok" if compass.sound else "cannot tell"
            told = compass.sentence
            if compass.deviates:
                told = (
                    f"the straight runs ask for a deviation of {size:.1f} +- {error:.1f} degrees, which may as well be "
                    "the drift of the hull"
                )
            return [
                Finding(
                    check=self.name,
                    verdict=verdict,
                    sentence=told,
                    value=size,
                    unit="deg",
                    ci95=ends,
                    channels=channels,
                    parts=parts,
                )
            ]
        told = compass.sentence
        if _sectors(having) < _MOST_SECTORS:
            told = (
                f"on the headings of its straight runs, the boat goes {size:.1f} degrees beside its heading; they are "
                "too few to tell the curve"
            )
            parts = {}
        fast = max(float(np.abs(s.motion.velocity[:, 0]).max()) for record in having for s in record.stretches)
        return [
            Finding(
                check=self.name,
                verdict="defect",
                sentence=told,
                value=size,
                unit="deg",
                ci95=ends,
                channels=channels,
                consequence=f"false sway of up to {fast * np.sin(compass.size):.2f} m/s at {fast:.1f} m/s; no "
                "force in sway can be learned",
                remedy="calibrate the compass; discover corrects the heading by this curve and judges no sway force",
                parts=parts,
                short=f"the compass deviates by {size:.0f} degrees",
            )
        ]


def _fastest_turn(records: Sequence[Record]) -> float:
    rates = [np.abs(stretch.motion.velocity[:, 2]) for record in records for stretch in record.stretches]
    return float(np.quantile(np.concatenate(rates), 0.99)) if rates else 0.0


def _sectors(records: Sequence[Record]) -> int:
    """In how many sectors the boat ran straight for a second or more."""
    motions = [stretch.motion for record in records for stretch in record.stretches]
    fast = max(float(np.abs(motion.velocity[:, 0]).max()) for motion in motions)
    headings = [
        motion.heading[(np.abs(motion.velocity[:, 2]) < STRAIGHT) & (np.abs(motion.velocity[:, 0]) > FAST * fast)]
        for motion in motions
    ]
    place = (np.concatenate(headings) % (2.0 * np.pi)) / (2.0 * np.pi) * _SECTORS
    counts = np.bincount(np.minimum(place.astype(int), _SECTORS - 1), minlength=_SECTORS)
    return int(np.count_nonzero(counts >= RATE))
