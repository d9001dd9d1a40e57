"""The corrected model under the law, over the envelope of the data: what it keeps, what that costs, and in words."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...physics.laws.damping_power import Envelope, envelope_of, state_in_words, worst_dissipation
from ...physics.motion import Motion
from ...physics.vehicle import Vehicle
from ..balance.shooting import predicts_worse
from ..candidates.candidate import Kind
from ..candidates.linearisation import Option
from ..search.gram import GramScores
from .certify import certify
from .price_of_law import MostPower, Passivity, percent
from .refit import LawfulFit, passive_refit


@dataclass(frozen=True, slots=True)
class Lawful:
    """A corrected model.

    Attributes
    ----------
    vehicle : the model to be written
    unconstrained : what the data alone ask for, under the limits of single parameters
    passivity : how the law stands in `vehicle`
    """

    vehicle: Vehicle
    unconstrained: Vehicle
    passivity: Passivity


def lawful_model(
    motions: Sequence[Motion], scores: GramScores, chosen: Sequence[Option], nominal: Vehicle, name: str
) -> Lawful:
    """Fit the chosen options under the laws over the envelope of the motions.

    The law wins over the data for effects of the catalogue. A term that nobody has named may be the trace of something
    that does create energy (a drag law with a wrong sign in a simulator); where the law makes 10 s rollouts
    significantly worse than the estimate, the estimate is kept and the verdict is "fail".

    Parameters
    ----------
    name : of the corrected vehicle

    Raises
    ------
    RequestError
        when a solver fails, or a returned number breaks a constraint.
    """
    if all(option.kind is Kind.SENSOR for option in chosen):
        envelope = envelope_of(motions, nominal)
        return Lawful(nominal, nominal, judge_passivity(nominal, envelope))
    start = {s: v for option in chosen for s, v in zip(option.symbols, option.start, strict=True)}
    envelope = envelope_of(motions, nominal.with_values(start))
    fit = passive_refit(scores, chosen, nominal, envelope)
    grown = _union(envelope, envelope_of(motions, nominal.with_values(fit.values)))
    if grown != envelope:  # the current, and with it the velocity relative to the water, has moved
        envelope, fit = grown, passive_refit(scores, chosen, nominal, grown)
    vehicle, free = (nominal.with_values(v, name=name) for v in (fit.values, fit.free))
    unnamed = [option.key for option in chosen if option.kind is Kind.TERM]
    if unnamed and fit.binding is not None and predicts_worse(motions, free, vehicle):
        return Lawful(free.checked(), free, judge_passivity(free, envelope, fit, unnamed))
    return Lawful(vehicle.checked(), free, judge_passivity(vehicle, envelope, fit))


def judge_passivity(
    vehicle: Vehicle, envelope: Envelope, fit: LawfulFit | None = None, against: Sequence[str] = ()
) -> Passivity:
    """The verdict on a model, checked by a proof and independently by a random search of 1e5 states.

    Parameters
    ----------
    fit : the refit from which the model comes; None for a model that was not fitted
    against : terms that are kept although the law speaks against them
    """
    proved = certify(vehicle, envelope).holds
    worst = worst_dissipation(vehicle, envelope)
    verdict = "pass" if proved or worst.power <= 0.0 else "fail"
    proof = "vertex LMI" if proved else "search"
    price, binding = (0.0, None) if fit is None else (fit.price, fit.binding)
    found = f"up to {worst.power:.3g} W, at {state_in_words(worst.state)}"
    if against:
        sentence = (
            f"The log asks for a force that creates energy ({', '.join(against)}). Under the law the misfit would "
            f"rise by {percent(price)} and predictions would get worse, so the force is kept as it was found: this "
            f"model puts energy into the hull ({found}) and is not to be trusted beyond the log."
        )
    elif fit is not None:
        sentence = fit.sentence
    elif verdict == "pass":
        sentence = "The model's damping takes energy out of the hull everywhere in the envelope."
    else:
        sentence = "The model's damping creates energy in a part of the envelope."
    if verdict == "fail" and not against:
        sentence += f" A random search finds {found}."
    elif not proved and not against:
        sentence += (
            " There is no proof for the corrected model, but a random search of 100 000 states finds no violation."
        )
    return Passivity(
        verdict=verdict,
        proof=proof,
        envelope=envelope,
        price=price,
        binding=binding,
        worst=MostPower(value=worst.power, at=worst.state),
        sentence=sentence,
    )


def _union(a: Envelope, b: Envelope) -> Envelope:
    low, high = np.minimum(a.lower, b.lower).tolist(), np.maximum(a.upper, b.upper).tolist()
    return Envelope((low[0], low[1], low[2]), (high[0], high[1], high[2]))
