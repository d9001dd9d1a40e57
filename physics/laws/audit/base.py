"""The interface of a law: what it sees of a model (`Witness`), and what it says of it (`Ruling`).

A witness answers for velocities relative to the water, without the wind and trim that its vehicle file states: these
are forces from outside, and no model breaks a law by feeling them.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np

from ...errors import RequestError
from ...forces import ForceEquation, calm, relative_velocity, stated_push
from ...integration import Rollouts
from ...momentum_balance import coriolis_matrix, mass_matrix
from ...motion import Array, Motion
from ...reading import Plain
from ...thrusters import neutral_command
from ...vehicle import Vehicle
from ..damping_power import Envelope, state_in_words
from ..energy import CRAWL, TOLERANCE, coasting_power, full_force, full_power
from .search import Box, spiked, spread

Settled = Callable[[Array, Array, Array], Array]
"""Acceleration over ground (n, 3) of lasting velocities over ground (n, 3), headings (n,), commands (n, thrusters)."""

EXACT = 1e-8
"""Share of the boat's own scale that is let pass of a model in closed form: rounding."""
TOLD = 1e-6
"""Share of full thrust's power from which a gain within the tolerance is told; less is single precision."""


@dataclass(frozen=True, slots=True, eq=False)
class Proof:
    """Outcome of a proof of dissipation.

    Attributes
    ----------
    how : its name; None where nothing is proved
    against : a state u, v, r (3,) that breaks the law, where the proof met one
    """

    how: str | None = None
    against: Array | None = None


@dataclass(frozen=True, eq=False)
class Witness:
    """A model as the laws see it.

    Attributes
    ----------
    vehicle : whose mass, thrusters, water, wind and trim are taken as stated
    envelope : velocities relative to the water over which the model is judged
    commands : (m, thrusters) commands that it may meet
    settled : acceleration over ground in states that have lasted
    along : acceleration over ground along a motion
    rollout : open-loop rollouts along a motion, of a model that knows one rate; None where `settled` is integrated
    exact : whether the model is a formula, judged to rounding
    own_mass : whether the mass is the model's, or only that of the vehicle by which its power is counted
    proves : tries to prove that over an envelope no more than a power [W] is gained, and a force (3,) for each speed
    coriolis : its Coriolis matrix; None where that cannot be told from other forces
    time_step : of rollouts [s]
    motions : measured
    dense : states more that are asked, for a model that answers fast
    seed : of the search
    samples : states of the search
    """

    vehicle: Vehicle
    envelope: Envelope
    commands: Array
    settled: Settled
    along: Callable[[Motion], Array]
    rollout: Callable[[Motion, np.ndarray, int], Rollouts] | None
    exact: bool
    own_mass: bool
    proves: Callable[[Envelope, float, Array], Proof]
    coriolis: Callable[[Array], Array] | None
    time_step: float
    motions: tuple[Motion, ...]
    dense: int
    seed: int
    samples: int = 8192

    @cached_property
    def mass(self) -> Array:
        """Mass matrix of the vehicle (3, 3)."""
        return mass_matrix(self.vehicle)

    @property
    def tolerance(self) -> float:
        """Share of the boat's own scale that is no violation."""
        return EXACT if self.exact else TOLERANCE

    @cached_property
    def reach(self) -> Array:
        """Fastest motion of the envelope on each axis (3,)."""
        return np.maximum(-np.array(self.envelope.lower), np.array(self.envelope.upper))

    @cached_property
    def states(self) -> Array:
        """Quasi-random states u, v, r, psi of the envelope (samples, 4)."""
        return spread(self.box(), self.samples, self.seed)

    @cached_property
    def coasting(self) -> Array:
        """Acceleration without thrust at `states` (samples, 3)."""
        return self.relative(self.states)

    @cached_property
    def powers(self) -> Array:
        """Power without thrust at `states` [W]."""
        return coasting_power(self.mass, self.states[:, :3], self.coasting)

    @cached_property
    def turns(self) -> bool:
        """True when the answer depends on the heading, as some of `states` tell; all of them, of a fast model."""
        some = self.states.copy() if self.dense else self.states[:256].copy()
        some[:, 3] += 0.5 * np.pi
        gap = np.abs(self.relative(some) - self.coasting[: some.shape[0]]).max()
        return bool(gap > 1e-9 * max(float(np.abs(self.coasting).max()), 1e-9))

    @cached_property
    def power_scale(self) -> float:
        """Typical power without thrust [W]: the median of its size, which a violation in a corner does not move."""
        return max(float(np.median(np.abs(self.powers))), 1e-9)

    @cached_property
    def full_force(self) -> Array:
        """Force of full thrust on each axis (3,) [N, N, N m], see `energy.full_force`."""
        return full_force(self.vehicle)

    @cached_property
    def neutral(self) -> Array:
        """The command of each thruster at which it does not push (thrusters,)."""
        return np.array([neutral_command(t) for t in self.vehicle.thrusters])

    def full_power(self, states: Array) -> Array:
        """Power of full thrust along all axes at the velocities of states (n, >= 3) [W]."""
        return full_power(self.full_force, states[:, :3])

    def allowed(self, states: Array) -> Array:
        """Gain [W] without thrust that is no violation at states, see `energy.let_pass`; of a formula, rounding."""
        return self.tolerance * self.full_power(states)

    def ascended(self, stretch: float = 1.0) -> Box:
        """The box of ascent: `box`, with one heading only where the answer does not depend on it."""
        found = self.box(stretch)
        return found if self.turns else Box(np.append(found.low[:3], 0.0), np.append(found.high[:3], 0.0))

    def box(self, stretch: float = 1.0) -> Box:
        """The envelope, stretched, and all headings."""
        low, high = (stretch * np.array(ends) for ends in (self.envelope.lower, self.envelope.upper))
        return Box(np.append(low, -np.pi), np.append(high, np.pi))

    def densely(self, stretch: float = 1.0, commands: Box | None = None) -> Array:
        """States (n, 4 [+ thrusters]) more of the stretched envelope: half evenly, half at its ends and at rest.

        Parameters
        ----------
        commands : their box, where they are part of the state
        """
        box, neutral = self.box(stretch), np.array([0.0, 0.0, 0.0, np.nan])
        if commands is not None:
            box = Box(np.append(box.low, commands.low), np.append(box.high, commands.high))
            neutral = np.append(neutral, np.clip(self.neutral, commands.low, commands.high))
        if not self.dense:
            return np.empty((0, neutral.size))
        return np.concatenate([spread(box, self.dense, self.seed + 1), spiked(box, neutral, self.dense, self.seed + 2)])

    def prove(self, stretch: float = 1.0) -> Proof:
        """Try to prove that over the stretched envelope at most what is `allowed` is gained without thrust."""
        low, high = (tuple(stretch * x for x in ends) for ends in (self.envelope.lower, self.envelope.upper))
        force = self.tolerance * self.full_force
        return self.proves(Envelope(low, high), CRAWL * float(force[0]), force)  # type: ignore[arg-type]

    def relative(self, states: Array, commands: Array | None = None) -> Array:
        """Acceleration relative to the water (n, 3) at states (n, 4), stated wind and trim taken out.

        Parameters
        ----------
        commands : (n, thrusters); without: no thrust

        Raises
        ------
        RequestError
            when the model answers with numbers that are not finite, or too few.
        """
        nu, psi = states[:, :3], states[:, 3]
        still = ForceEquation(self.vehicle)
        drift = np.stack(relative_velocity(self.vehicle, psi, (0.0 * psi, 0.0 * psi, 0.0 * psi)), axis=-1)
        velocity = nu - drift
        asked = np.broadcast_to(self.neutral, (psi.size, self.neutral.size)) if commands is None else commands
        said = np.asarray(self.settled(velocity, psi, asked), dtype=float)
        if said.shape != nu.shape:
            raise RequestError(f"model: expected accelerations of shape {nu.shape}, got {said.shape}")
        if not np.isfinite(said).all():
            k = int(np.flatnonzero(~np.isfinite(said).all(axis=1))[0])
            u, v, r = (float(x) for x in nu[k])
            raise RequestError(
                f"model: expected finite accelerations, got {said[k].tolist()} at {state_in_words((u, v, r))}"
            )
        nothing = (0.0 * psi, 0.0 * psi, 0.0 * psi)
        turn = np.stack(still.acceleration(nothing, tuple(nu.T), tuple(velocity.T), psi), axis=-1)
        if calm(self.vehicle) == self.vehicle:
            return said - turn
        push = stated_push(self.vehicle, psi, tuple(nu.T))
        return said - turn - push @ np.linalg.inv(self.mass).T

    def power(self, states: Array) -> Array:
        """Power nu^T M nu_dot [W] that the model puts into the motion without thrust, (n,)."""
        return coasting_power(self.mass, states[:, :3], self.relative(states))

    def drag(self, states: Array) -> Array:
        """Force without thrust and without the vehicle's Coriolis force (n, 3) [N, N, N m]."""
        nu = states[:, :3]
        turning = np.einsum("nij,nj->ni", coriolis_matrix(self.vehicle, nu), nu)
        return self.relative(states) @ self.mass.T + turning

    def place(self, state: Array) -> dict[str, float]:
        """A state by name; the heading only where the answer depends on it."""
        result = {name: float(x) for name, x in zip("uvr", state, strict=False)}
        turned = np.repeat(state[None], 4, axis=0)
        turned[:, 3] += np.arange(4) * np.pi / 2
        said = self.relative(turned)
        if np.ptp(said, axis=0).max() > 1e-6 * max(float(np.abs(said).max()), 1e-9):
            result["psi"] = float(state[3])
        return result


Verdict = Literal["pass", "fail", "not applicable"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Ruling:
    """Ruling of one law on a model.

    Attributes
    ----------
    law : its name
    verdict : pass, fail, or not applicable
    counts : whether a failure makes the audit fail
    value, limit, unit : worst value found, and the largest that is allowed; None where there is none
    at : the state of the worst value, by name
    share : of quasi-random states, windows or rollouts that break the law
    proof : what the verdict rests on
    sentence : the same in plain words
    against : states u, v, r, heading and commands (n, 4 + thrusters) that were met against it; None of a law of which
        no state tells
    """

    law: str
    verdict: Verdict
    proof: str
    sentence: str
    counts: bool = True
    value: float | None = None
    limit: float | None = None
    unit: str = ""
    at: dict[str, float] | None = None
    share: float | None = None
    against: Array | None = field(default=None, compare=False, repr=False)

    @property
    def margin(self) -> float | None:
        """Distance of the worst value below the limit; negative for a violation."""
        return None if self.value is None or self.limit is None else self.limit - self.value

    def to_dict(self) -> Plain:
        """As `audit.json` writes it."""
        worst = None if self.value is None else {"value": self.value, "unit": self.unit, "at": self.at or {}}
        margin = None if self.margin is None else {"value": self.margin, "unit": self.unit}
        return {
            "law": self.law,
            "verdict": self.verdict,
            "counts": self.counts,
            "violating_share": self.share,
            "proof": self.proof,
            "worst": worst,
            "margin": margin,
            "sentence": self.sentence,
        }


class Law(ABC):
    """A law.

    Attributes
    ----------
    name : as tables and files call it
    place : where it is told, low numbers first; the mass is first, since nothing else means much without it
    counts : whether a model that breaks it fails the audit
    """

    name: ClassVar[str]
    place: ClassVar[int] = 1000
    counts: ClassVar[bool] = True

    @abstractmethod
    def judge(self, witness: Witness) -> Ruling:
        """Say whether the model keeps the law."""

    def rule(
        self,
        *,
        value: float,
        limit: float,
        kept: str,
        broken: str,
        unit: str = "W",
        at: dict[str, float] | None = None,
        share: float | None = None,
        proof: str = "search",
    ) -> Ruling:
        """The ruling on a worst value, with the sentence for either case.

        Parameters
        ----------
        value, limit, unit : the worst value, what the law allows, and the unit of both
        kept, broken : the sentence for either case
        at : the state of the worst value
        share : of quasi-random states, windows or rollouts that break the law
        proof : what the verdict rests on
        """
        holds = value <= limit
        return Ruling(
            law=self.name,
            counts=self.counts,
            verdict="pass" if holds else "fail",
            value=value,
            limit=limit,
            unit=unit,
            at=at,
            share=share,
            proof=proof,
            sentence=kept if holds else broken,
        )

    def pass_over(self, why: str) -> Ruling:
        """The ruling where the law cannot be asked."""
        return Ruling(law=self.name, counts=self.counts, verdict="not applicable", proof="none", sentence=why)


_UNBOUNDED = 1e12
"""What stands for a ratio without bound: far above any that is bounded, and within what a run folder may hold."""


def in_words(at: dict[str, float]) -> str:
    """A state in words.

    >>> in_words({"u": 0.5, "v": -0.1, "r": 0.0, "psi": 1.0})
    'u = 0.50 m/s, v = -0.10 m/s, r = 0.00 rad/s, heading 57 degrees'
    """
    text = state_in_words((at["u"], at["v"], at["r"]))
    return text + (f", heading {np.degrees(at['psi']):.0f} degrees" if "psi" in at else "")


def let_pass(witness: Witness, limit: float) -> str:
    """Tolerance in words, behind what was found; nothing for a formula, which is held to rounding."""
    return "" if witness.exact else f", where {limit:.3g} W is let pass"


def finite(value: float) -> float:
    """The value, or in the place of what grew without bound a number that a file can hold, margins included."""
    return max(-_UNBOUNDED, min(value, _UNBOUNDED)) if value == value else _UNBOUNDED
