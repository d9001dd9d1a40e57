"""Words for models: the band about their predictions, what there was to learn for a network, and what the laws took."""

from collections.abc import Sequence
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from ..physics.motion import AXES
from ..physics.presentation import counted, listing, number, percent, unit_text

if TYPE_CHECKING:  # the first page of the workbench waits for nothing heavy
    from ..comparison.facts import ComparedModel
    from ..residuals.learnable_residual import LearnableResidual
    from ..residuals.models.band_record import PredictionBand
    from ..residuals.networks.trust import Trust
    from ..residuals.series import HeldPredictions
    from ..residuals.training.best_kind import Candidate
    from ..residuals.training.trained import Trained


BANDS_HELD = (
    "such bands held 96 to 98 % of the positions on second runs of the same manoeuvres and 93 to 96 % on other ones, "
    "and 61 % in the worst world"
)
"""Printed by `benchmarks/bands.py --seeds reporting`, of 24 worlds: means of own and foreign ones, and the least."""


def band_words(band: "PredictionBand | None") -> str:
    """What a band is made to hold, from what it comes, and how often such bands held; empty without a band."""
    if band is None:
        return ""
    radius = number(band.half_width["position"][-1], 2)
    return (
        f"The shaded band is made to hold {percent(band.level)} of predictions: after {band.seconds[-1]:g} s the "
        f"position within {radius} m (median). It comes from {band.predictions} predictions of rows that the model did "
        f"not see. In simulation, {BANDS_HELD}."
    )


def held_words(held: "HeldPredictions | None", name: str) -> str:
    """How many predictions end within the band of the run that a model comes from; empty where none was asked."""
    if held is None or not held.predictions + held.beyond:
        return ""
    text = f"Of {held.predictions} predictions on these rows, {percent(held.position)} end within the band of {name}."
    if not held.beyond:
        return text
    beyond = f"{held.beyond} go far beyond the speeds of its run, where its band says nothing"
    return f"{text[:-1]}; {beyond}." if held.predictions else f"All {beyond}."


_DEAR = 0.1
"""Share of the validation error that the law may cost before it is worth a sentence: neighbouring epochs differ by some
per cent by themselves."""
_SHORT = 0.05
"""By how much the share that an interval holds falls short before it is told."""


def broken_laws(model: "ComparedModel") -> list[str]:
    """Which laws the audit found broken, and where the states are told; nothing where it kept them all."""
    broken = [law.law for law in model.laws if law.outcome == "fail"]
    if not broken:
        return []
    return [f"The audit fails: it breaks {listing(broken)}; 'undertow check' on its folder shows in which states."]


def what_it_holds(model: "ComparedModel") -> list[str]:
    """What its interval holds of the judged rows that are like those of training; nothing where none is."""
    found = model.interval
    if found is None or found.inside.share is None:
        return []
    inside = {axis: found.inside.share.of(axis) for axis in AXES}
    short = [axis for axis, share in inside.items() if share < found.level - _SHORT]
    return [
        f"Of the judged rows within what it has seen, its {percent(found.level)} interval of the acceleration holds "
        f"{listing([f'{percent(share)} in {axis}' for axis, share in inside.items()])}"
        f"{f': less than it claims in {listing(short)}' if short else ''}."
    ]


_SAME = 0.03
"""Share of an error below which a change is no news: predictions begin anywhere, and chance moves it as much."""


def on_judged_rows(vehicle: "ComparedModel", network: "ComparedModel") -> list[str]:
    """How much less or more a network errs than the vehicle; nothing where no rollout fits, or the two err alike."""
    horizon = next((h for h in ("10", "2") if h in vehicle.rollout and h in network.rollout), None)
    if horizon is None:
        return []
    before, after = (model.rollout[horizon].position for model in (vehicle, network))
    change = after / max(before, 1e-12) - 1.0
    if not abs(change) > _SAME:  # nor a number that is none
        return []
    text = f"On the rows that judge, which it did not learn, its position errs {percent(abs(change))} "
    text += f"{'more' if change > 0.0 else 'less'} over {horizon} s than that of the vehicle"
    return [f"{text}: compare it on another log before you use it." if change > 0.0 else f"{text}."]


def trust_in_words(trust: "Trust") -> str:
    """By how much of itself a correction counts, and where it ends, as parts of the log tell that it did not know."""
    gain = trust.gain(np.zeros(()))
    if not trust.weights.any():
        return (
            "Nothing learnt that holds: on parts of the log that it did not know, no share of the correction is "
            "better than none, so it says nothing. Use the vehicle as it is, or train on more varied logs."
        )
    shares = [
        f"{percent(one)} (standard error {percent(error)}) in {axis}"
        for axis, one, error in zip(AXES, gain, trust.error[:, 0], strict=True)
    ]
    far, beyond = trust.reaches[-1], trust.weights[:, -1]
    kept = listing([f"{percent(one)} in {axis}" for axis, one in zip(AXES, beyond, strict=True)])
    left = f"{kept} of it is left, as at the farthest that its log tried" if beyond.any() else "nothing of it is left"
    return (
        f"By parts of the log that it did not know, its correction counts by {listing(shares)}. From {far:.2g} "
        f"standard deviations outside the range of its training inputs on, {left}."
    )


_TOLD = 5
"""Kinds that are told, the best first."""


def kinds_in_words(kinds: "Sequence[Candidate]", left_behind: Sequence[str] = ()) -> str:
    """Which kind was chosen, by what the probes of each left of the vehicle's error, and which did worse half way."""
    told = listing(
        [f"{one.name} {percent(one.ratio)} (standard error {percent(one.ratio * one.error)})" for one in kinds[:_TOLD]]
    )
    told += f"; {counted(len(kinds) - _TOLD, 'other')} left more" * (len(kinds) > _TOLD)
    return (
        "In predictions of 2 and 10 s over parts of the log that they did not know, this is what kinds of network "
        f"leave of the vehicle's error: {told}."
        + f" Left half way, since they erred more or would take too long: {listing(left_behind)}."
        * bool(left_behind)
    )


def left_elsewhere(network: str, ratio: float, error: float) -> list[str]:
    """What networks of a kind leave of the vehicle's error on parts of the log that they do not know; none untried."""
    if not isfinite(error):
        return []
    return [
        f"In predictions of 2 and 10 s over parts of the log that they did not know, networks of the kind {network} "
        f"leave {percent(ratio)} of the vehicle's error (standard error {percent(ratio * error)}).",
        *alone_errs_less(ratio),
    ]


def alone_errs_less(ratio: float) -> list[str]:
    """Whether a network is worth nothing on parts of the log that it does not know, by what it leaves of the error."""
    return ["The vehicle alone errs less there: prefer it, or more logs."] if ratio > 1.0 else []


def none_holds_elsewhere(
    kinds: "Sequence[Candidate]", left: "LearnableResidual", left_behind: Sequence[str] = ()
) -> str:
    """Why none of the kinds that were tried is used: the vehicle alone is one of them, too."""
    return (
        "On parts of this log that it was not fitted to, no kind of network errs less than the vehicle alone"
        f"{' by more than chance' * any(one.ratio < 1.0 for one in kinds)}. {kinds_in_words(kinds, left_behind)} "
        f"Without one, {say_learnable(left)}. Use the vehicle as it is; 'undertow train' with --set decline=0 trains "
        "all the same"
    )


def what_laws_took(found: "Trained") -> list[str]:
    """Whether it keeps the laws, what that took, and its price."""
    asked = "that 'undertow check' asks over these logs"
    after = f"{counted(found.more, 'epoch')} more at the states where they broke them"
    price = f"the validation error is then {100.0 * found.price:.1f} % above the least"
    if found.lawful and not found.more:
        return [f"It keeps every law {asked}.", *_price_of_the_law(found)]
    if found.lawful:
        return [f"Its best epochs did not keep every law {asked}. It does after {after}; {price}."]
    tried = f" and did not after {after}; {price}" if found.more else ", nor did the epochs next best"
    hears = found.model.network.grown is None and found.settings.lambda_phys > 0.0
    what = "a larger --lambda-phys" if hears else "a network and --lambda-phys that hear of the laws"
    return [
        f"It does not keep the laws {asked}{tried}: try {what}, or a network that creates no energy (--residual "
        "dissipative or port_hamiltonian)."
    ]


def _price_of_the_law(found: "Trained") -> list[str]:
    """What the kept epoch gives away against the best one that breaks the laws, where that is much."""
    kept, best = found.epochs[found.best_epoch - found.epochs[0].number], min(found.epochs, key=lambda e: e.rmse)
    if best.rmse > (1.0 - _DEAR) * kept.rmse:
        return []
    return [
        f"Epoch {best.number} had a validation error of {best.rmse:.3g} and not {kept.rmse:.3g}, but breaks the laws: "
        "try a larger --lambda-phys, or other physics under it."
    ]


def why_declined(left: "LearnableResidual") -> str:
    """Of a vehicle that is not worth a network, what decides so; see `Left.worth_it`."""
    if not left.learnable.any():
        return "that errs on no axis by more than noise and the preparation of the log"
    return f"of which a perfect network could not halve the error over {left.horizon:g} s that is not noise"


def say_learnable(left: "LearnableResidual") -> str:
    """What a vehicle leaves to learn on each axis and in rollouts, and how much of that no model explains."""
    from ..residuals.scores import ACCELERATION_UNITS

    told = []
    for axis, error, floor, learnable in zip(AXES, left.error, left.floor, left.learnable, strict=True):
        unit = unit_text(ACCELERATION_UNITS[axis])
        what = "more than" if learnable else "no more than"
        told.append(f"in {axis} the vehicle errs by {error:.2g} {unit}, {what} noise and preparation ({floor:.2g})")
    if left.horizon:
        told.append(
            f"over {left.horizon:g} s it is off by {left.position:.2g} m, where noise and preparation alone make "
            f"{left.position_floor:.2g} m"
        )
    return "; ".join(told)
