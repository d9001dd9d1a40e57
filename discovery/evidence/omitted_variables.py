"""Omitted variables: how far a number of a model may be off because others that it looks like stay as they are.

What a search leaves out is zero, or as the file has it, to the model alone. An effect that fits surely better and is
too small to be told, and the file's own numbers, each of which is a little off, carry their share of every number
that looks like a part of them (Wooldridge 2016, section 3.3).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...physics.motion import Array
from ..candidates.candidate import Kind, calibratable
from ..candidates.linearisation import Linearisation, Option
from ..search.estimation import RESOLVED
from ..search.floating import Search, State
from ..search.gram import RIDGE, GramScores
from ..search.scoring import TELL_APART

_SHARES = np.concatenate([[0.0], np.geomspace(RESOLVED, 1.0, 31)])
"""Deviations by which the numbers of a file may be off, as shares of them, that are tried."""
_SMALL = 1e-12
"""Square of a column, or of a residual, without any."""
_OF_THRUST = ("thrust_scale", "arm_scale")
"""What a file states of its thrusters by their curves and places."""


def omitted_variable_bias(search: Search, state: State, about: tuple[Linearisation, GramScores]) -> dict[str, Array]:
    """Bias (2,) of each number of a model by effects that were left out as immaterial, down and up, by symbol.

    What explains too little of the force to be told may yet fit surely better, and carry its share of a number that
    looks like a part of it (Wooldridge 2016, section 3.3). Each is tried alone beside the model.

    Parameters
    ----------
    about : columns and scores about the model
    """
    linear, scores = about
    now = {key: linear.options[key][0] for key in state.active}
    effects = [c.key for c in search.pool if c.kind is Kind.EFFECT and not c.effect.general and c.key not in now]
    added = [option for key in effects for option in linear.options[key] if option.present]
    fits = search.fits(scores, [[*now.values(), *more] for more in ([], *([option] for option in added))])
    own, *others = (dict(zip(fit.columns.tolist(), fit.change.tolist(), strict=True)) for fit in fits)
    best = search.score(fits[0], list(now.values())) - TELL_APART
    result = {number.symbol: np.zeros(2) for option in now.values() for number in option.numbers}
    for option, fit, changes in zip(added, fits[1:], others, strict=True):
        if search.score(fit, [*now.values(), option]) < best:
            for symbol, _, column, *_ in (number for each in now.values() for number in each.numbers):
                change = changes.get(column, 0.0) - own.get(column, 0.0)
                result[symbol] = np.maximum(result[symbol], [-change, change])
    return result


class FileError(NamedTuple):
    """By how much a number of a model would move beside the true numbers of the file, and a deviation of that."""

    shift: float
    deviation: float


def file_errors(search: Search, state: State, about: tuple[Linearisation, GramScores]) -> dict[str, FileError]:
    """What the file's own numbers, as far as they stand, may make of each number of a model, by symbol.

    Each is off by a share of itself, normal about zero (random effects; Harville 1977,
    doi:10.1080/01621459.1977.10480998). The deviation of the shares is that of the greatest likelihood of the scores,
    which are what the residual has in common with each number's force beside the model: where the file is right, none.
    Given that, the shares are normal about what the scores ask for, and so is the bias of the model's numbers. The mass
    is known, or every force could be larger by the same share; where it is in question, the thrust is.

    Parameters
    ----------
    about : columns and scores about the model
    """
    linear, scores = about
    now = [linear.options[key][0] for key in state.active]
    own = _own_numbers(search, state, about, now)
    size = sum(len(option.numbers) for option in now)
    if not own or not size:
        return {}
    chosen = [*now, *own]
    _, left, right = scores.block_normal(chosen)
    unit = 1.0 / np.sqrt(np.maximum(np.diag(left.sum(axis=0)), _SMALL))
    left, right = left * (unit[:, None] * unit), right * unit
    normal = left.sum(axis=0)
    alike = np.linalg.solve(normal[:size, :size] + RIDGE * np.eye(size), normal[:size, size:])
    project = np.hstack([-alike.T, np.eye(len(own))])
    curve = project @ normal[:, size:]
    score = project @ right.sum(axis=0)
    noise = project @ (scores.meat(chosen, search.balance.independent) * (unit[:, None] * unit)) @ project.T
    if np.trace(noise) <= _SMALL:  # nothing is left of which anything could be made
        return {}
    noise = _regular(noise)
    noise *= _excess(right @ project.T, noise)
    filed = np.array([abs(search.nominal.value(number.symbol)) for option in own for number in option.numbers])
    best, inverse, likelihood = np.zeros_like(curve), np.zeros_like(curve), np.inf
    for share in _SHARES.tolist():
        prior = np.diag((share * filed / unit[size:]) ** 2)
        total = _regular(noise + curve @ prior @ curve)  # of a log without noise, nearly that of the prior alone
        found = float(np.linalg.slogdet(total)[1] + score @ np.linalg.solve(total, score))
        if found < likelihood:
            best, inverse, likelihood = prior, np.linalg.inv(total), found
    gain = best @ curve @ inverse
    off, spread = gain @ score, best - gain @ curve @ best
    shifts = -(alike @ off) * unit[:size]
    deviations = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", alike, spread, alike), 0.0)) * unit[:size]
    symbols = [number.symbol for option in now for number in option.numbers]
    pairs = zip(symbols, shifts.tolist(), deviations.tolist(), strict=True)
    return {symbol: FileError(shift, deviation) for symbol, shift, deviation in pairs}


def _own_numbers(
    search: Search, state: State, about: tuple[Linearisation, GramScores], now: Sequence[Option]
) -> list[Option]:
    """The file's own numbers that stand as they are, each as an option, as far as noise is not most of their force."""
    linear, scores = about
    names = {*calibratable(search.nominal), *_OF_THRUST}
    if any("mass" in option.symbols for option in now):  # thrust alone then tells how large a force is
        names -= {*_OF_THRUST}
    others = [c for c in search.pool if c.kind is Kind.EFFECT and c.key not in state.active and {*c.symbols} <= names]
    own: list[Option] = []
    for option in (next(o for o in linear.options[c.key] if o.present) for c in others if not c.effect.shapes):
        alone = len(option.numbers) == 1 and search.nominal.value(option.symbols[0]) != 0.0
        column = option.numbers[0].column if alone else -1
        if alone and scores.gram[:, :, column, column].any():
            columns, *_ = scores.layout([*now, *own, option])
            own += [option] * (scores.noise_taken(columns) == 1.0)
    return own


def _regular(covariance: Array) -> Array:
    """A covariance whose least eigenvalues are above what rounding makes of the largest."""
    return covariance + RIDGE * np.trace(covariance) / len(covariance) * np.eye(len(covariance))


def _excess(scores: Array, noise: Array) -> float:
    """By how much scores of blocks (blocks, p) scatter more than independent errors would have it, one at least."""
    apart = scores - scores.mean(axis=0)
    scatter = apart.T @ apart * len(apart) / max(len(apart) - 1, 1)
    return max(1.0, float(np.trace(np.linalg.solve(noise, scatter))) / len(noise))
