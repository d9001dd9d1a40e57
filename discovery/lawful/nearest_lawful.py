"""The lawful set of some parameters of a vehicle, and the point of it that is nearest to a guess, in milliseconds.

The set is that of the refit (`affine_laws.py`), and convex. A guess is held to the limits first; only where the proof
then fails, a conic programme is solved, of those orthants of the envelope alone in which it fails. The exchanges of the
last proof are tried first, so that a guess that keeps the laws costs some eigenvalues.
"""

from collections.abc import Mapping

import numpy as np

from ...physics.errors import RequestError
from ...physics.frames import Array
from ...physics.laws.certificate import basis
from ...physics.laws.damping_power import Envelope
from ...physics.vehicle import Vehicle
from ..search.gram import bounded_solve
from .affine_laws import MARGIN, laws_over, least_margin

_HALVINGS = 40
"""Of the way back to the start, where a solver's answer is not lawful: to rounding."""


class LawfulSet:
    """Values of parameters that are within their limits and make a lawful vehicle.

    Parameters
    ----------
    nominal : the vehicle whose other parameters stay; where it breaks a law, no more than it has is asked for
    units : plausible amounts by symbol, in the order of the values
    limits : lower and upper (p,), which hold the nominal values
    envelope : velocities relative to the water

    Raises
    ------
    RequestError
        when a solver fails on the nominal vehicle.
    """

    def __init__(
        self, nominal: Vehicle, units: Mapping[str, float], limits: tuple[Array, Array], envelope: Envelope
    ) -> None:
        self._unit = np.array(list(units.values()))
        self._start = np.array([nominal.value(symbol) for symbol in units]) / self._unit
        self._lower, self._upper = (limit / self._unit for limit in limits)
        laws = laws_over(envelope, nominal, nominal, units, least_margin(nominal))
        self._laws = laws.eased(-MARGIN)
        self._slack = np.zeros((len(laws.power), basis(laws.degree).slack.shape[-1]))
        broken, _ = self._broken(self._start)
        if broken.any():
            self._solved(self._start, np.eye(self._start.size), broken)
            if self._broken(self._start)[0].any():  # the nominal vehicle breaks the law, or is about to
                self._laws = laws.allowing_nominal()

    def nearest(self, values: Array, information: Array) -> Array:
        """The lawful values with the least (x - values)^T information (x - values), (p,)."""
        guess = values / self._unit
        metric = information * np.outer(self._unit, self._unit)
        size = np.sqrt(np.diag(metric))
        inside = bool(((guess >= self._lower) & (guess <= self._upper)).all())
        found = guess
        if not inside:
            scaled = metric / np.outer(size, size)
            limits = self._lower * size, self._upper * size
            found = np.clip(bounded_solve(scaled, scaled @ (guess * size), *limits)[0] / size, self._lower, self._upper)
        used = np.zeros(len(self._slack), dtype=bool)
        for _ in range(len(self._slack) + 1):
            broken, heavy = self._broken(found)
            if not broken.any() and heavy:
                return values if inside and found is guess else found * self._unit
            if not (broken & ~used).any() and used.any():
                break
            used |= broken
            found = self._solved(guess, metric, used)
        return self._between(found) * self._unit

    def _broken(self, x: Array) -> tuple[np.ndarray, bool]:
        """In which orthants the last exchanges prove nothing of x, (orthants,), and whether its mass is positive."""
        damping, mass = self._laws.matrices(x, self._slack)
        # The margin is the solver's to miss; what is not above zero is broken.
        broken = np.linalg.eigvalsh(damping)[..., 0].min(axis=1) < -0.5 * MARGIN
        broken &= self._laws.slope.any()
        return broken, not self._laws.heavy or bool(np.linalg.eigvalsh(mass)[0] >= -1e-9)

    def _solved(self, guess: Array, metric: Array, used: np.ndarray) -> Array:
        """The nearest x that keeps the laws in the used orthants, whose exchanges are kept; the start where none."""
        scaled, orthants = metric / np.trace(metric), np.flatnonzero(used)
        try:
            found = self._laws.minimise(scaled, scaled @ guess, (self._lower, self._upper), orthants.tolist())
        except RequestError:
            return self._start
        if found is None:
            return self._start
        self._slack[orthants] = found.slack
        return np.clip(found.values, self._lower, self._upper)

    def _between(self, x: Array) -> Array:
        """The last lawful point on the way from the start to x: for a solver's answer that breaks a law by rounding."""
        low, high = 0.0, 1.0
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            broken, heavy = self._broken(self._start + middle * (x - self._start))
            low, high = (middle, high) if heavy and not broken.any() else (low, middle)
        return self._start + low * (x - self._start)
