"""Search for the state in which a model gains most power that it should not; the laws of power share it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...motion import Array
from .base import Witness
from .search import Box, SearchSettings, climb

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
