"""Positive damping: near rest drag opposes every motion, and along each axis it opposes the speed it meets."""

from typing import ClassVar, final

import numpy as np

from ...motion import AXES, Array
from .base import TOLD, Law, Ruling, Witness, in_words, let_pass

_COUNT = 201
"""Speeds on each axis: steps of half a per cent of the envelope."""
_COARSE, _FINEST = 0.05, 1e-10
"""Half of the step of the difference at rest as a share of the reach: for a network, whose kinks are small, and for a
formula, whose quadratic drag must not yet show. Along an axis nothing nearer to rest is asked."""


@final
class PositiveDamping(Law):
    """The damping coefficient, drag over speed: at rest as a matrix, and along each axis alone.

    At rest that is minus the Jacobian of the drag force, and dissipation needs its symmetric part. Along an axis drag
    must oppose the motion, so drag over speed is asked and not the slope: drag that falls with speed beyond a hump, as
    of a hull that begins to plane, is honest as long as it opposes. Drag is what comes with speed: the push at rest is
    the affair of another law. Values are scaled by the reach of the envelope, so that all are powers [W].
    """

    name: ClassVar[str] = "positive damping"
    place: ClassVar[int] = 30

    def judge(self, witness: Witness) -> Ruling:
        """See `Law.judge`."""
        reach = witness.reach
        low, high = np.array(witness.envelope.lower), np.array(witness.envelope.upper)
        rest = np.zeros((1, 4))
        alone = np.zeros((3, _COUNT, 4))
        for axis in range(3):
            alone[axis, :, axis] = np.linspace(low[axis], high[axis], _COUNT)
        alone = alone.reshape(-1, 4)
        axes = np.repeat(np.arange(3), _COUNT)
        speed = alone[np.arange(len(alone)), axes]
        kept = np.abs(speed) >= _COARSE * reach[axes]
        alone, axes, speed = alone[kept], axes[kept], speed[kept]
        slope = self._slope(witness, (_FINEST if witness.exact else _COARSE) * reach) * reach[:, None] * reach
        gained = (witness.drag(alone) - witness.drag(rest))[np.arange(len(alone)), axes]
        values = np.append(gained / speed * reach[axes] ** 2, np.linalg.eigvalsh(0.5 * (slope + slope.T))[-1])
        limit = witness.tolerance * witness.power_scale
        k = int(np.argmax(values))
        state = rest[0] if k == values.size - 1 else alone[k]
        at, worst = witness.place(state), float(values[k])
        axis = "" if k == values.size - 1 else AXES[axes[k]]
        where = f"The {axis} drag drives the motion at {in_words(at)}" if axis else "Near rest some motion is pushed"
        kept_words = "Near rest drag opposes every motion, and along each axis it opposes the speed it meets."
        if worst > TOLD * witness.power_scale:
            kept_words = (
                f"{where}, within the tolerance: {worst:.3g} W at the envelope's scale, where {limit:.3g} W, 1 % of "
                "the typical power, is let pass."
            )
        return self.rule(
            value=worst,
            limit=limit,
            at=at,
            share=float((values > limit).mean()),
            kept=kept_words,
            broken=f"{where}: negative damping, {worst:.3g} W at the envelope's scale{let_pass(witness, limit)}.",
        )

    @staticmethod
    def _slope(witness: Witness, step: Array) -> Array:
        """Jacobian of the drag force at rest (3, 3), by central differences."""
        aside = np.pad(np.diag(step), ((0, 0), (0, 1)))
        return ((witness.drag(aside) - witness.drag(-aside)) / (2.0 * step[:, None])).T
