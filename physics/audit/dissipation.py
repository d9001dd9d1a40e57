"""Dissipation: without thrust, the power nu^T M nu_dot that goes into the motion is never above zero."""

from typing import ClassVar, final

import numpy as np

from .base import Law, Proof, Ruling, Witness, in_words
from .search import climb, rays

_MOVING = 0.05
"""Where nothing is violated, the least dissipation is told among states at least this far from rest."""


def judge_dissipation(law: Law, witness: Witness, stretch: float, where: str) -> Ruling:
    """The ruling over the stretched envelope; beyond the envelope itself only, where it is stretched."""
    box = witness.box(stretch)
    reach = witness.reach
    states = stretch * witness.states
    states[:, 3] /= stretch
    powers = witness.powers if stretch == 1.0 else witness.power(states)
    limit = witness.tolerance * witness.power_scale

    def fullness(x: np.ndarray) -> np.ndarray:
        return ((x[:, :3] / reach) ** 2).sum(axis=1)

    def keen(x: np.ndarray) -> np.ndarray:
        return (witness.power(x) - limit) / (fullness(x) + 1e-3)

    share = float((powers > limit).mean())
    extra = rays(states, box, witness.seed)
    states, powers = np.concatenate([states, extra]), np.concatenate([powers, witness.power(extra)])
    tried = witness.prove(stretch, limit) if powers.max() <= limit else Proof()
    proof = tried.how
    if tried.against is not None:
        met = np.append(tried.against, 0.0)[None]
        states, powers = np.concatenate([states, met]), np.concatenate([powers, witness.power(met)])
    if proof is None:
        found = [climb(keen, states, (powers - limit) / (fullness(states) + 1e-3), box)]
        if powers.max() > limit:
            found.append(climb(witness.power, states, powers, box))
        more = np.concatenate(found)
        states, powers = np.concatenate([states, more]), np.concatenate([powers, witness.power(more)])
    told = np.ones(powers.size, dtype=bool)
    if powers.max() <= limit:
        told = fullness(states) >= _MOVING**2
        if stretch > 1.0:
            told &= np.abs(states[:, :3] / reach).max(axis=1) > 1.0
    k = int(np.flatnonzero(told)[np.argmax(powers[told])])
    at, worst = witness.place(states[k]), float(powers[k])
    how = f"proved: {proof}" if proof else f"searched, {powers.size} states"
    return law.rule(
        value=worst,
        limit=limit,
        unit="W",
        at=at,
        share=share,
        proof=proof or "search",
        kept=f"Without thrust the model loses energy {where} ({how}).",
        broken=f"Without thrust the model gains {worst:.3g} W at {in_words(at)}: it creates energy.",
    )


@final
class Dissipation(Law):
    """Damping takes power out everywhere in the envelope (Fossen 2021, section 6.4)."""

    name: ClassVar[str] = "dissipation"

    def judge(self, witness: Witness) -> Ruling:
        """See `Law.judge`."""
        return judge_dissipation(self, witness, 1.0, "everywhere in the envelope")


@final
class Outside(Law):
    """The same half as far again beyond the envelope.

    It does not count: no data speak there, and discovery keeps the law over the envelope only.
    """

    name: ClassVar[str] = "outside the envelope"
    counts: ClassVar[bool] = False
    stretch: ClassVar[float] = 1.5

    def judge(self, witness: Witness) -> Ruling:
        """See `Law.judge`."""
        return judge_dissipation(self, witness, self.stretch, f"up to {self.stretch:g} times the envelope, too")
