"""Dissipation: without thrust, the power nu^T M nu_dot that goes into the motion is never above zero.

The laws of power share the search for the state in which a model gains most power that it should not.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar, final

import numpy as np

from ...motion import Array
from .base import TOLD, Law, Proof, Ruling, Witness, in_words, let_pass
from .search import Box, SearchSettings, climb, rays

_MOVING = 0.05
"""Where nothing is gained, the state told is the closest to a gain at least this share of the envelope from rest: at
rest itself every power is zero, and the closest state would always be that."""

_AGAINST = 128
"""States against a law that are told at most: enough for the windows in which a network breaks it, soon asked again."""

_AGAIN = SearchSettings(starts=12)
"""Of the second search, from the tops of the first."""

Power = Callable[[Array], Array]


@dataclass(frozen=True, slots=True, eq=False)
class Gains:
    """States that were asked (n, d), what is gained and what is allowed there [W], (n,) each."""

    states: Array
    gained: Array
    allowed: Array

    @property
    def over(self) -> Array:
        """Gain beyond what is allowed [W]; positive for a violation."""
        return self.gained - self.allowed

    @property
    def broken(self) -> bool:
        """True when some state gains more than is allowed."""
        return bool((self.over > 0.0).any())

    @property
    def against(self) -> Array:
        """States that gain more than is allowed, the worst first; of many, as many of each size (n, d)."""
        over = self.over
        order = np.argsort(-over, kind="stable")[: int((over > 0.0).sum())]
        return self.states[order[:: max(1, -(-order.size // _AGAINST))]]

    def worst(self, witness: Witness, free: Array) -> tuple[int, bool]:
        """The state to tell of, and whether it gains more than is `free` (n,) [W], which no law minds.

        A violation: the largest. Gains that only the tolerance lets pass: the one that takes up most of it. Else the
        closest to a gain among states that move, since at rest all powers are zero.
        """
        if self.broken:
            return int(np.argmax(self.over)), True
        gains = self.gained > free
        if gains.any():
            return int(np.argmax(np.where(gains, self.gained / self.allowed, -np.inf))), True
        fullness = ((self.states[:, :3] / witness.reach) ** 2).sum(axis=1)
        moving = fullness >= _MOVING**2
        return int(np.argmax(np.where(moving, self.over, -np.inf))), False


def evaluate_gains(states: Array, gained: Power, allowed: Power) -> Gains:
    """Gains at some states.

    Parameters
    ----------
    states : (n, d)
    gained, allowed : functions of states, in W
    """
    return Gains(states, gained(states), allowed(states))


def join_gains(one: Gains, other: Gains) -> Gains:
    """Both together."""
    pairs = ((one.states, other.states), (one.gained, other.gained), (one.allowed, other.allowed))
    return Gains(*(np.concatenate(pair) for pair in pairs))


def search_gains(witness: Witness, known: Gains, box: Box, gained: Power, allowed: Power) -> Gains:
    """The known states, and those to which the search for the worst gain leads from them.

    First by the excess over the squared share of the envelope, else the many watts of fast states would hide slow ones;
    then by the excess itself, where there is one, or by the share of the tolerance that is taken up.

    Parameters
    ----------
    witness : the model
    known : states that were asked
    box : in which is searched
    gained, allowed : functions of states, in W
    """

    def over(x: Array) -> Array:
        return gained(x) - allowed(x)

    def fullness(x: Array) -> Array:
        return ((x[:, :3] / witness.reach) ** 2).sum(axis=1) + 1e-3

    def keen(x: Array) -> Array:
        return over(x) / fullness(x)

    def share(x: Array) -> Array:
        return gained(x) / allowed(x)

    def further(known: Gains, worth: Power, values: Array, settings: SearchSettings | None = None) -> Gains:
        more = evaluate_gains(climb(worth, known.states, values, box, settings, witness.seed), gained, allowed)
        return join_gains(known, more)

    known = further(known, keen, known.over / fullness(known.states))
    if known.broken:
        return further(known, over, known.over, _AGAIN)
    return further(known, share, known.gained / known.allowed, _AGAIN) if not witness.exact else known


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
