"""Dissipation: without thrust, the power nu^T M nu_dot that goes into the motion is never above zero."""

from dataclasses import replace
from typing import ClassVar, final

import numpy as np

from ...motion import Array
from .base import TOLD, Law, Proof, Ruling, Witness, in_words, let_pass
from .gain import Gains, evaluate_gains, join_gains, search_gains
from .search import rays

_SKIN = 1.0 + 1e-9
"""How far beyond the border a state is moved, as a multiple of its distance: rounding leaves none inside."""


def judge_dissipation(law: Law, witness: Witness, stretch: float, where: str) -> Ruling:
    """The ruling over the envelope or, where it is stretched, between it and the stretched one.

    Parameters
    ----------
    law : that rules
    witness : the model
    stretch : factor on the envelope; 1 for the envelope itself
    where : of the envelope, in the sentence
    """

    def moved(x: Array) -> Array:
        return _pushed_out(witness, x) if stretch > 1.0 else x

    def gained(x: Array) -> Array:
        return witness.power(moved(x))

    def allowed(x: Array) -> Array:
        return witness.allowed(moved(x))

    states, box = witness.states * np.array([*[stretch] * 3, 1.0]), witness.box(stretch)
    if stretch > 1.0:
        states = states[_distance(witness, states) > 1.0]
    known = evaluate_gains(states, gained, allowed) if stretch > 1.0 else Gains(states, witness.powers, allowed(states))
    share = float((known.over > 0.0).mean())
    extra = [rays(states, box, witness.seed), witness.densely(stretch)]
    tried = witness.prove(stretch) if not known.broken else Proof()
    if tried.against is not None:
        extra.append(np.append(tried.against, 0.0)[None])
    known = join_gains(known, evaluate_gains(moved(np.concatenate(extra)), gained, allowed))
    proof = None if known.broken else tried.how
    if proof is None:
        found = search_gains(witness, known, witness.ascended(stretch), gained, allowed)
        known = Gains(moved(found.states), found.gained, found.allowed)
    k, gains = known.worst(witness, TOLD * witness.full_power(known.states))
    value, limit, at = float(known.gained[k]), float(known.allowed[k]), witness.place(known.states[k])
    how = f"proved: {proof}" if proof else f"searched, {known.gained.size} states"
    kept = f"Without thrust the model loses energy everywhere {where} ({how})."
    if gains or proof == "interval bounds":
        kept = f"Without thrust the model gains nowhere {where} more than 1 % of full thrust would give ({how})" + (
            f"; it gains {value:.3g} W at {in_words(at)}, where {limit:.3g} W is let pass." if gains else "."
        )
    ruling = law.rule(
        value=value,
        limit=limit,
        unit="W",
        at=at,
        share=share,
        proof=proof or "search",
        kept=kept,
        broken=f"Without thrust the model gains {value:.3g} W at {in_words(at)}{let_pass(witness, limit)}: "
        "it creates energy.",
    )
    against = known.against
    return replace(ruling, against=np.column_stack([against, np.tile(witness.neutral, (len(against), 1))]))


@final
class Dissipation(Law):
    """Damping takes power out everywhere in the envelope (Fossen 2021, section 6.4)."""

    name: ClassVar[str] = "dissipation"
    place: ClassVar[int] = 20

    def judge(self, witness: Witness) -> Ruling:
        """See `Law.judge`."""
        return judge_dissipation(self, witness, 1.0, "in the envelope")


@final
class Outside(Law):
    """The same beyond the envelope, half as far again; what lies inside is the affair of `Dissipation`.

    It does not count: no data speak there, and discovery keeps the law over the envelope only.
    """

    name: ClassVar[str] = "outside the envelope"
    place: ClassVar[int] = 100
    counts: ClassVar[bool] = False
    stretch: ClassVar[float] = 1.5

    def judge(self, witness: Witness) -> Ruling:
        """See `Law.judge`."""
        return judge_dissipation(self, witness, self.stretch, f"from 1 to {self.stretch:g} times the envelope")


def _distance(witness: Witness, states: Array) -> Array:
    """Multiple of the envelope on whose border states lie (n,)."""
    low, high = (np.array(ends) for ends in (witness.envelope.lower, witness.envelope.upper))
    nu = states[:, :3]
    ends = np.where(nu > 0.0, high, low)
    return np.max(np.divide(nu, ends, out=np.zeros_like(nu), where=ends != 0.0), axis=1)


def _pushed_out(witness: Witness, states: Array) -> Array:
    """States, those inside the envelope moved away from rest to just beyond its border."""
    far = _distance(witness, states)
    factor = np.where(far < _SKIN, _SKIN / np.maximum(far, 1e-9), 1.0)
    result = states.copy()
    result[:, :3] *= factor[:, None]
    return result
