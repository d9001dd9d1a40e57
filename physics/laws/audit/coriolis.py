"""Coriolis forces turn a motion and do no work."""

from itertools import product
from typing import ClassVar, final

import numpy as np

from .base import Law, Ruling, Witness, in_words, let_pass

_FEW = 256
"""States that a black box is asked at, in eight ways each: 2048 answers, as many as a network gives at once."""


@final
class CoriolisWork(Law):
    """nu^T C(nu) nu = 0 (Fossen 2021, theorem 3.2).

    A black box does not tell its Coriolis force from its drag. What its force does in a turn tells: the part of the
    power that changes sign with each of u, v and r is that of products u v r, where a wrong Coriolis force does its
    work. Lawful lift and drag have such a part too, and it is paid for by the drag of the same motions. So of a black
    box just that is asked: that turning gains no more than the mean drag over the eight signs takes.
    """

    name: ClassVar[str] = "Coriolis does no work"
    place: ClassVar[int] = 80

    def judge(self, witness: Witness) -> Ruling:
        """See `Law.judge`."""
        if witness.coriolis is None:
            return self._turned(witness)
        nu = witness.states[:, :3]
        matrix = witness.coriolis(nu)
        power = np.abs(np.einsum("ni,nij,nj->n", nu, matrix, nu))
        k = int(np.argmax(power))
        limit = 1e-9 * max(float(np.abs(np.einsum("nij,nj->ni", matrix, nu) * nu).sum(axis=1).max()), 1e-9)
        at, value = witness.place(witness.states[k]), float(power[k])
        skew = bool((matrix == -np.swapaxes(matrix, 1, 2)).all())
        return self.rule(
            value=value,
            limit=limit,
            at=at,
            share=float((power > limit).mean()),
            proof="by construction" if skew else "search",
            kept="Coriolis forces do no work.",
            broken=f"The Coriolis force does work: {value:.3g} W at {in_words(at)}.",
        )

    def _turned(self, witness: Witness) -> Ruling:
        """The ruling on a black box, at states whose mirror images lie in the envelope too."""
        ends = np.minimum(-np.array(witness.envelope.lower), np.array(witness.envelope.upper))
        far = witness.states[:_FEW].copy()
        far[:, :3] = np.abs(far[:, :3]) / witness.reach * ends
        far[: _FEW // 4, :3] = ends * np.linspace(0.1, 1.0, _FEW // 4)[:, None]
        ways = np.array([[*way, 1.0] for way in product((-1.0, 1.0), repeat=3)])
        power = witness.power((far[:, None] * ways).reshape(-1, 4)).reshape(-1, 8)
        turning, drag = power @ ways[:, :3].prod(axis=1) / 8.0, -power.mean(axis=1)
        limits = witness.tolerance * witness.full_power(far)
        over = np.abs(turning) - np.maximum(drag, 0.0)
        k = int(np.argmax(over - limits))
        state = far[k] * np.array([1.0, 1.0, np.sign(turning[k]) or 1.0, 1.0])
        at, value, limit = witness.place(state), float(over[k]), float(limits[k])
        kept = "What turning gains, drag takes: at no state do products of the three velocities do more work."
        return self.rule(
            value=value,
            limit=limit,
            at=at,
            share=float((over > limits).mean()),
            kept=f"{kept} More cannot be told of a model without a Coriolis matrix.",
            broken=f"Turning does work: {abs(float(turning[k])):.3g} W at {in_words(at)}, where drag takes "
            f"{float(drag[k]):.3g} W{let_pass(witness, limit)}; a Coriolis force does none.",
        )
