"""Coriolis forces turn a motion and do no work."""

from typing import ClassVar, final

import numpy as np

from .base import Law, Ruling, in_words
from .witness import Witness


@final
class CoriolisWork(Law):
    """nu^T C(nu) nu = 0 (Fossen 2021, theorem 3.2). A black box does not tell its Coriolis force from its drag."""

    name: ClassVar[str] = "Coriolis does no work"

    def judge(self, witness: Witness) -> Ruling:
        """See `Law.judge`."""
        if witness.coriolis is None:
            return self.pass_over("Coriolis forces cannot be told from others in this model.")
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
            unit="W",
            at=at,
            share=float((power > limit).mean()),
            proof="by construction" if skew else "search",
            kept="Coriolis forces do no work.",
            broken=f"The Coriolis force does work: {value:.3g} W at {in_words(at)}.",
        )
