"""The auditor: any model before all laws, and what they say of it as `audit.json` has it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from ..discovery.lawful.laws_over import certify
from ..measurements.preparation.split import PARTS
from ..measurements.prepared_logs import Parts
from ..physics.errors import expect
from ..physics.laws import audit as law_files
from ..physics.laws.audit.base import Law, Proof, Ruling, Witness
from ..physics.laws.audit.bounded import possible_commands
from ..physics.laws.audit.mass import PositiveMass
from ..physics.laws.damping_power import Envelope, envelope_of
from ..physics.momentum_balance import coriolis_matrix
from ..physics.motion import Array, Motion
from ..physics.presentation import Card
from ..physics.reading import Plain
from ..physics.registry_members import classes_in
from ..residuals.models.base import Model, VehicleModel
from ..residuals.models.foreign import FunctionModel
from .facts import AuditRecord


def _in_order(kinds: Sequence[Callable[[], Law]]) -> tuple[Law, ...]:
    return tuple(sorted((kind() for kind in kinds), key=lambda law: law.place))


LAWS: tuple[Law, ...] = _in_order(classes_in(law_files, Law))
"""All laws, in the order in which they are told: every `Law` that a file of their folder defines."""
_MOST_COMMANDS = 2000
"""Commands of a log that are kept, evenly spread: a sweep over them costs a model a second or so."""
_DENSE = (2**16, 2**14, 2**13)
"""States that are asked beside the first, evenly and again at the ends: of foreign models, whose violations may fill
any corner, of networks without a memory, and of formulas, which are smooth."""


@dataclass(frozen=True, slots=True, repr=False)
class Audit(Card):
    """Rulings of all laws on a model.

    Attributes
    ----------
    model, kind : its name and kind
    envelope : velocities relative to the water in which it was judged
    envelope_from : where the envelope came from, in words
    rulings : of each law
    notes : what the vehicle file states and the laws took out
    """

    model: str
    kind: str
    envelope: Envelope
    envelope_from: str
    rulings: tuple[Ruling, ...]
    notes: tuple[str, ...] = ()

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        broken = [f"{r.law}: {r.sentence}" for r in self.violations]
        kept = [r.law for r in self.rulings if r.verdict == "pass"]
        return [
            ("model", self.model),
            ("verdict", self.verdict),
            ("broken", "; ".join(broken)),
            ("kept", ", ".join(kept)),
        ]

    @property
    def verdict(self) -> Literal["pass", "fail"]:
        """Fail when a law that counts is broken."""
        return "fail" if self.violations else "pass"

    @property
    def violations(self) -> tuple[Ruling, ...]:
        """The laws that count and are broken."""
        return tuple(r for r in self.rulings if r.counts and r.verdict == "fail")

    @property
    def against(self) -> Array:
        """States u, v, r, heading and commands (n, 4 + thrusters) that were met against laws that count."""
        return np.concatenate([r.against for r in self.violations if r.against is not None] or [np.empty((0, 4))])

    def ruling(self, law: str) -> Ruling:
        """Ruling of one law, by its name."""
        return next(r for r in self.rulings if r.law == law)

    def to_dict(self) -> Plain:
        """As `audit.json` writes it."""
        return {
            "schema": AuditRecord.SCHEMA,
            "model": self.model,
            "kind": self.kind,
            "verdict": self.verdict,
            "envelope": self.envelope.to_dict(),
            "envelope_from": self.envelope_from,
            "units": {"u": "m/s", "v": "m/s", "r": "rad/s", "psi": "rad", "from": "s", "to": "s"},
            "laws": [r.to_dict() for r in self.rulings],
            "notes": list(self.notes),
        }


def audit(
    model: Model,
    envelope: Envelope,
    *,
    motions: Sequence[Motion] = (),
    commands: Array | None = None,
    envelope_from: str = "given",
    seed: int = 0,
    laws: Sequence[Law] = LAWS,
) -> Audit:
    """Judge a model by all laws.

    Parameters
    ----------
    envelope : velocities relative to the water in which it is judged
    motions : measured, for the energy balance along the log
    commands : (m, thrusters) that it may meet; without: those of the motions, else all that the thrusters can take
    envelope_from : where the envelope came from, in words
    seed : of everything random

    Raises
    ------
    RequestError
        when the model does not answer with finite accelerations, or refuses the rate of the motions.
    """
    expect("audit: model", model, Model, "undertow.load_model(PATH) reads one")
    expect("audit: envelope", envelope, Envelope, "undertow.check(MODEL) finds one by itself")
    witness = witness_of(model, envelope, motions=motions, commands=commands, seed=seed)
    rulings: list[Ruling] = []
    for law in laws:
        massless = any(r.law == PositiveMass.name and r.verdict == "fail" for r in rulings)
        rulings.append(law.pass_over("Means nothing without a positive mass.") if massless else law.judge(witness))
    stated = sorted(s.replace("_", " ") for s, value in model.vehicle.environment.items() if value)
    notes = (f"The vehicle file states {', '.join(stated)}; they are forces from outside, and taken out.",)
    return Audit(model.name, model.kind, envelope, envelope_from, tuple(rulings), notes if stated else ())


def witness_of(
    model: Model, envelope: Envelope, *, motions: Sequence[Motion] = (), commands: Array | None = None, seed: int = 0
) -> Witness:
    """A model as the laws see it; see `audit`.

    Parameters
    ----------
    model : to be judged
    envelope : of velocities [m/s, m/s, rad/s]
    motions : of the logs
    commands : (n, thrusters) from which extremes are taken; those of the motions for None
    seed : of the states that are drawn
    """
    formula = isinstance(model, VehicleModel)
    if commands is None and motions:
        commands = np.concatenate([m.commands for m in motions])
        commands = commands[:: -(-commands.shape[0] // _MOST_COMMANDS)]
    return Witness(
        model.vehicle,
        envelope,
        possible_commands(model.vehicle, seed) if commands is None else commands,
        model.settled,
        model.acceleration,
        rollout=None if formula or isinstance(model, FunctionModel) else model.rollout,
        exact=formula,
        own_mass=not (isinstance(model, FunctionModel) or model.kind == "network"),
        proves=partial(_proof, model),
        coriolis=partial(coriolis_matrix, model.vehicle) if formula else None,
        time_step=motions[0].time_step if motions else model.time_step,
        motions=tuple(motions),
        dense=_dense(model),
        seed=seed,
    )


def _dense(model: Model) -> int:
    """How many states more a model is asked; none where each is held for seconds, so that a memory settles."""
    if isinstance(model, FunctionModel):
        return _DENSE[0]
    if isinstance(model, VehicleModel):
        return _DENSE[2]
    return 0 if model.remembers else _DENSE[1]


def _proof(model: Model, envelope: Envelope, limit: float, force: Array) -> Proof:
    """Try to prove that a model without thrust gains at most `limit` [W] and the power of a force over an envelope."""
    if model.rests_on == "nothing":
        return Proof()
    if model.rests_on == "itself":
        return Proof("by construction")
    if model.rests_on == "bounds":
        from ..residuals.models.bounds import bound_power  # with torch
        from ..residuals.models.network_model import NetworkModel

        if not isinstance(model, NetworkModel):
            return Proof()
        found = bound_power(model, envelope, limit, force)
        return Proof("interval bounds" if found.proved else None, found.against)
    remembered = min(model.vehicle.value("memory_sway"), model.vehicle.value("memory_yaw"))
    if remembered < 0.0 or not certify(model.vehicle, envelope).holds:
        return Proof()
    return Proof("vertex LMI" if isinstance(model, VehicleModel) else "by construction")


def audit_along(model: Model, parts: Parts) -> Audit:
    """Judge a model by the laws along all parts of the logs, in the envelope of their speeds."""
    motions = [motion for part in PARTS for motion in parts.data(part).motions]
    envelope = envelope_of(motions, model.vehicle)
    return audit(model, envelope, motions=motions, envelope_from="the speeds of the log")
