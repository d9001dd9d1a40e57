"""Positive damping: near rest drag opposes every motion, and on each axis more speed never means less drag."""

from typing import ClassVar, final

import numpy as np

from ..frames import Array
from .base import Law, Ruling, in_words, let_pass
from .witness import TOLD, Witness

_COUNT = 41
_COARSE, _FINE, _FINEST = 0.05, 1e-6, 1e-10
"""Half of the step of a difference as a share of the reach: for a network, whose kinks are small, for a formula, and
for a formula at rest, where all numbers are small and quadratic drag must not yet show."""


@final
class PositiveDamping(Law):
    """Minus the symmetric part of the Jacobian of the drag force, at rest as a matrix, and along each axis alone.

    At rest the Jacobian is minus the linear damping matrix, and dissipation needs its symmetric part. Elsewhere a
    matrix with a negative eigenvalue is no breach: honest cross-flow drag (N_ur |u| r) has one. There each axis is
    asked alone. Values are scaled by the reach of the envelope, so that all are powers [W].
    """

    name: ClassVar[str] = "positive damping"

    def judge(self, witness: Witness) -> Ruling:
        """See `Law.judge`."""
        reach = witness.reach
        steps = (_FINEST, _FINE) if witness.exact else (_COARSE, _COARSE)
        low, high = np.array(witness.envelope.lower), np.array(witness.envelope.upper)
        rest = np.zeros((1, 4))
        alone = np.zeros((3, _COUNT, 4))
        for axis in range(3):
            alone[axis, :, axis] = np.linspace(low[axis], high[axis], _COUNT)
        states = np.concatenate([rest, alone.reshape(-1, 4)])
        parts = [self._slope(witness, x, h * reach) for x, h in zip((rest, states[1:]), steps, strict=True)]
        slope = np.concatenate(parts) * reach[:, None] * reach
        middle = 0.5 * (slope[0] + slope[0].T)
        own = np.concatenate([slope[1 + k * _COUNT : 1 + (k + 1) * _COUNT, k, k] for k in range(3)])
        values = np.append(own, np.linalg.eigvalsh(middle)[-1])
        limit = witness.tolerance * witness.power_scale
        k = int(np.argmax(values))
        state = rest[0] if k == values.size - 1 else states[1 + k]
        at, worst = witness.place(state), float(values[k])
        axis = "" if k == values.size - 1 else ("surge", "sway", "yaw")[k // _COUNT]
        where = f"The {axis} drag falls with speed at {in_words(at)}" if axis else "Near rest some motion is pushed"
        kept = "Near rest drag opposes every motion, and on no axis does more speed mean less drag."
        if worst > TOLD * witness.power_scale:
            kept = (
                f"{where}, within the tolerance: {worst:.3g} W at the envelope's scale, where {limit:.3g} W, 1 % of "
                "the typical power, is let pass."
            )
        return self.rule(
            value=worst,
            limit=limit,
            unit="W",
            at=at,
            share=float((values > limit).mean()),
            proof="search",
            kept=kept,
            broken=f"{where}: negative damping, {worst:.3g} W at the envelope's scale{let_pass(witness, limit)}.",
        )

    @staticmethod
    def _slope(witness: Witness, states: Array, step: Array) -> Array:
        """Jacobian of the drag force at states (n, 3, 3), by central differences."""
        ahead = states[:, None, :] + np.pad(np.diag(step), ((0, 0), (0, 1)))
        astern = states[:, None, :] - np.pad(np.diag(step), ((0, 0), (0, 1)))
        shape = (states.shape[0], 3, 3)
        pair = [witness.drag(x.reshape(-1, 4)).reshape(shape) for x in (ahead, astern)]
        return np.swapaxes((pair[0] - pair[1]) / (2.0 * step[:, None]), 1, 2)
