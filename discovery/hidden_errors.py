"""Errors of sensors that no other record shows: how large they are, what a motion is without them, and their words."""

from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace

import numpy as np

from ..measurements.kinematic_errors import corrected_for
from ..physics.frames import Array
from ..physics.motion import Motion
from .findings import SensorError
from .found_effects import FoundTerm

_LEAST = (0.05, 0.05, 0.02)
"""Sizes from which an error matters [m, m, rad]."""
ARM, COMPASS = "mount", "compass_constant"
"""Names of the corrections for a lever arm, and for a heading that lacks something."""


@dataclass(frozen=True, slots=True)
class HiddenErrors:
    """Where the sensor of places and speeds is, ahead and to starboard [m], and what a heading lacks [rad]."""

    arm_x: float
    arm_y: float
    compass: float

    @classmethod
    def of(cls, estimate: Array) -> "HiddenErrors":
        """From three numbers, those that do not matter taken for none."""
        ahead, aside, turned = np.where(np.abs(estimate) >= _LEAST, estimate, 0.0).tolist()
        return cls(ahead, aside, turned)

    @classmethod
    def told(cls, sensors: Iterable[SensorError]) -> "HiddenErrors | None":
        """Those that findings tell; None where they tell none."""
        found = {term.symbol: term.value for s in sensors if s.correction in (ARM, COMPASS) for term in s.terms}
        if not found:
            return None
        turned = float(np.radians(found.get("misalignment", 0.0)))
        return cls(found.get("arm_x", 0.0), found.get("arm_y", 0.0), turned)

    @property
    def many(self) -> int:
        """How many of them there are."""
        return int(np.count_nonzero((self.arm_x, self.arm_y, self.compass)))

    def leaving(self, left: Collection[str]) -> "HiddenErrors":
        """The same without some of them, by the names of their corrections: these stay in the motion."""
        arm_x, arm_y = (0.0, 0.0) if ARM in left else (self.arm_x, self.arm_y)
        return replace(self, arm_x=arm_x, arm_y=arm_y, compass=0.0 if COMPASS in left else self.compass)

    def corrected(self, motion: Motion) -> Motion:
        """A motion as it is at the origin, and along the true heading."""
        errors = {"mount_x": self.arm_x, "mount_y": self.arm_y, "compass_constant": self.compass}
        return corrected_for(motion, errors)

    @property
    def findings(self) -> tuple[SensorError, ...]:
        """What is told of them."""
        found = []
        if max(abs(self.arm_x) / _LEAST[0], abs(self.arm_y) / _LEAST[1]) >= 1.0:
            told = (
                f"Places and speeds are measured {self.arm_x:+.2f} m ahead and {self.arm_y:+.2f} m to starboard of the "
                "vehicle's origin, as the forces tell; the motion is corrected for it."
            )
            terms = (
                FoundTerm(symbol="arm_x", value=self.arm_x, unit="m"),
                FoundTerm(symbol="arm_y", value=self.arm_y, unit="m"),
            )
            found.append(
                SensorError(error="antenna_arm", verdict="present", sentence=told, terms=terms, correction=ARM)
            )
        if abs(self.compass) >= _LEAST[2]:
            angle = float(np.degrees(self.compass))
            told = f"The heading lacks {angle:+.1f} degrees, as the forces tell; it and the speeds are corrected."
            terms = (FoundTerm(symbol="misalignment", value=angle, unit="deg"),)
            error = "compass_deviation"
            found.append(SensorError(error=error, verdict="present", sentence=told, terms=terms, correction=COMPASS))
        return tuple(found)


NONE = HiddenErrors(0.0, 0.0, 0.0)
