"""Changes of a model during the search: which neighbours it has, and what setting or removing an effect does."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ...physics.presentation import listing, words
from ...physics.vehicle import Vehicle
from ..candidates.linearisation import Linearisation, Option
from .gram import Fit, GramScores

_SPLIT = 6
"""Additions that are tried first, and beside each of them second, in the place of one effect."""
_PROMISING = 12
"""Additions scored in full for each set of dropped effects."""


def changes(
    linear: Linearisation,
    scores: GramScores,
    now: dict[str, Option],
    kept_always: Sequence[str] = (),
) -> Iterator[dict[str, Option]]:
    """Neighbouring models worth a score: one effect added, dropped, reshaped or swapped.

    For each set of dropped effects, only the most promising additions by in-sample error are given.

    Parameters
    ----------
    kept_always : keys that are never dropped
    """
    others = [key for key in linear.options if key not in now and key not in kept_always]
    new = [option for key in others for option in linear.options[key][1:]]
    loose = [key for key in now if key not in kept_always]
    for drop in (None, *loose):
        # A dropped effect leaves its offset behind: the columns were taken with it in place.
        kept = dict(now) if drop is None else {key: o for key, o in now.items() if key != drop}
        if drop is not None:
            kept[drop] = linear.options[drop][1]
            yield kept
        gains = scores.screen(list(kept.values()), new)
        for n in np.argsort(-gains, kind="stable")[:_PROMISING]:
            yield {**kept, new[n].key: new[n]}
    for key in now:
        for option in linear.options[key][2:]:
            yield {**now, key: option}


def split_effects(
    linear: Linearisation, scores: GramScores, now: dict[str, Option], kept_always: Sequence[str] = ()
) -> Iterator[dict[str, Option]]:
    """Neighbouring models in which two others stand in the place of one effect: it may be the mean of both.

    No addition, drop or swap leads there where neither of the two alone betters the model. See `changes`.

    Parameters
    ----------
    linear : options of all candidates
    scores : of the columns
    now : the option of each effect in the model, by key
    kept_always : keys that stay, nuisances
    """
    others = [key for key in linear.options if key not in now and key not in kept_always]
    new = [option for key in others for option in linear.options[key][1:]]
    for gone in (key for key in now if key not in kept_always):
        kept = {key: option for key, option in now.items() if key != gone} | {gone: linear.options[gone][1]}
        for one in _promising(scores, kept, new)[:_SPLIT]:
            for other in _promising(scores, {**kept, one.key: one}, new)[:_SPLIT]:
                if one.key != other.key:
                    yield {**kept, one.key: one, other.key: other}


def _promising(scores: GramScores, kept: Mapping[str, Option], new: Sequence[Option]) -> list[Option]:
    """Additions to a model, those of the largest gain by in-sample error first."""
    return [new[n] for n in np.argsort(-scores.screen(list(kept.values()), new), kind="stable")]


def present_keys(change: dict[str, Option]) -> tuple[str, ...]:
    """Keys of what a changed model holds: a dropped effect stays in it as absent."""
    return tuple(key for key, option in change.items() if option.present)


def reset(vehicle: Vehicle, nominal: Vehicle, now: dict[str, Option], change: dict[str, Option]) -> Vehicle:
    """The vehicle with everything that a change drops set back to nominal.

    Parameters
    ----------
    vehicle, nominal : the model, and the one without effects
    now, change : options by key, before the change and after it
    """
    gone = [option for key, option in now.items() if key not in present_keys(change)]
    return vehicle.with_values({s: nominal.value(s) for option in gone for s in option.symbols})


def apply_fit(vehicle: Vehicle, chosen: Sequence[Option], fit: Fit) -> Vehicle:
    """The vehicle with the fitted parameters set.

    Parameters
    ----------
    vehicle : about which the columns are
    chosen : an option for each effect of the model
    fit : change of each free column
    """
    by_column = dict(zip(fit.columns.tolist(), fit.change.tolist(), strict=True))
    values = {}
    for option in chosen:
        for symbol, start, index in zip(
            option.symbols, option.start, option.free or (-1,) * len(option.symbols), strict=True
        ):
            values[symbol] = start + by_column.get(index, 0.0)
    return vehicle.with_values(values)


def has_converged(before: Vehicle, after: Vehicle, chosen: Sequence[Option]) -> bool:
    """True when a Gauss-Newton step hardly moved any parameter.

    Parameters
    ----------
    before, after : the model before and after the step
    chosen : options whose parameters were free
    """
    pairs = [(before.value(s), after.value(s)) for option in chosen for s in option.symbols]
    return all(abs(a - b) <= 1e-4 * (abs(a) + 1e-3) for a, b in pairs)


def difference(before: Sequence[str], after: Sequence[str]) -> str:
    """A change in words for the progress lines: a move of the search, which later moves may take back."""
    gone = [words(key) for key in before if key not in after]
    come = [words(key) for key in after if key not in before]
    moves = [f"with {listing(come)}"] * bool(come) + [f"without {listing(gone)}"] * bool(gone)
    return f"trying {' and '.join(moves) or 'other shapes'}"
