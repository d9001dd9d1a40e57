"""Invariance of an effect over regimes of a log: a cause keeps its size and its force, a stand-in does not.

The coefficient of a cause is the same in both halves of a log, slow and fast, ahead and astern, turning either way
(Peters, Buhlmann and Meinshausen 2016). Each effect gets columns of its own in one region, all others one for the whole
log; the difference of its sizes inside and outside is given with errors of whole blocks. An effect's own force is
tested for a break in time or regime against copies of the noise (Andrews 1993), always on the force balance, since
rollouts know the size of an effect in part of a log badly.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...measurements.statistics.blocks import block_scores, sandwich
from ...physics.motion import Array
from ..balance.weak_form import WeakForm
from ..candidates.candidate import Kind
from ..candidates.linearisation import Linearisation
from ..candidates.unnamed_terms import FINE, onsets, places, rows_of_logs
from ..effect_findings import Part
from ..search.estimation import Interval
from ..search.floating import Search, State
from ..search.gram import RIDGE, GramScores, added_by_noise
from ..search.scoring import MATERIAL
from ..search.surrogates import NoiseCopies
from .unmodelled_forces import FormColumns, ResidualSelection, effective_blocks

LEAST_SHARE = 0.15
"""Share of the tests from which parts are tried, and which they must leave: a few seconds astern say nothing of a
size."""
_TURNING = 0.3
"""Share of the root mean square yaw rate from which a boat turns to a side: one of the cuts that are tried."""
ERRORS = 2.13
"""Standard errors of a 95 % interval, by which two sizes may differ by chance, with the 15 degrees of freedom of 16
blocks."""
ENOUGH_BLOCKS = 5
"""Blocks from which anything can be sure: fewer may all agree by chance in more than one of ten logs, and the errors of
a size that fewer carry are far too small."""
ONE_SIZE = 0.15
"""Relative difference up to which two sizes, beyond their errors, are one, and standard error, as a share of the size,
up to which a part knows it: else it is not heard."""


class Invariance(NamedTuple):
    """An effect's size in the parts of a log.

    Attributes
    ----------
    parts : its numbers in them
    gap : the largest relative difference of a number between two parts, less two standard errors
    scatter : by symbol, half the difference between two parts beyond its error: what widens its interval
    """

    parts: tuple[Part, ...]
    gap: float = 0.0
    scatter: Mapping[str, float] = {}


class Region(NamedTuple):
    """A part of the log and the rest of it, by name, and which tests belong to the one."""

    names: tuple[str, str]
    tests: NDArray[np.bool_]


def invariance(search: Search, state: State, about: tuple[Linearisation, GramScores]) -> dict[str, Invariance]:
    """Test whether each effect of a model has one size in all regions of the log, by key.

    Sizes that a part does not know are left out. Noise on the columns is taken off, as in every fit.

    Parameters
    ----------
    about : columns and scores about the model
    """
    linear, scores = about
    now = [linear.options[key][0] for key in state.active]
    columns = [number.column for option in now for number in option.numbers]
    weight = np.sqrt(scores.weight)[:, None]
    rows = (linear.columns[:, :, [*columns, -1]] * weight).transpose(1, 0, 2).reshape(-1, len(columns) + 1)
    noise = (linear.noise[:, :, :, [*columns, -1]] * weight).transpose(0, 2, 1, 3)
    noise = noise.reshape(noise.shape[0], *rows.shape)
    block = np.tile(search.balance.block, 3)
    first = search.balance.block < (search.balance.blocks + 1) // 2
    cuts = [Region(("in the first half", "in the second half"), first), *regions(search)]
    pool = {c.key: c.effect for c in search.pool}
    result: dict[str, Invariance] = {}
    for option in now:
        own = [columns.index(number.column) for number in option.numbers]
        if option.kind is not Kind.EFFECT or not own or pool[option.key].general:
            continue  # the numbers of a curve are each of a part of the log already
        parts: list[Part] = []
        gaps = [0.0]
        scatter: dict[str, float] = {}
        for region in cuts:
            inside = np.tile(region.tests, 3)
            split = _split(rows, own, inside)
            clear = [_split(copy, own, inside) for copy in noise]
            change, covariance = fitted_by_blocks(split, clear, block)
            for place, (symbol, start, *_) in enumerate(option.numbers):
                pair = [place, len(own) + place]  # in the part, and in the rest
                if min(effective_blocks(split[:, k], block) for k in pair) < ENOUGH_BLOCKS:
                    continue
                null = search.nominal.value(symbol)
                sizes = _Sizes(abs(start - null), change[pair], covariance[np.ix_(pair, pair)])
                if sizes.known:
                    base = start - (null if pool[option.key].added else 0.0)
                    parts += sizes.told(region.names, symbol, base)
                    gaps.append(sizes.relative_gap)
                    scatter[symbol] = max(scatter.get(symbol, 0.0), sizes.excess)
        result[option.key] = Invariance(tuple(parts), max(gaps), scatter)
    return result


class _Sizes(NamedTuple):
    """One number of an effect, in a part and in the rest.

    Attributes
    ----------
    whole : its size in the model, from where the effect is absent
    change, covariance : from there, (2,) and (2, 2)
    """

    whole: float
    change: Array
    covariance: Array

    def told(self, names: tuple[str, str], symbol: str, start: float) -> list[Part]:
        """Both numbers, as the findings report them; `start` is that in the model."""
        values = start + self.change
        reach = ERRORS * np.sqrt(np.diag(self.covariance))
        ends = [Interval(float(v - w), float(v + w)) for v, w in zip(values, reach, strict=True)]
        rows = zip(names, values.tolist(), ends, strict=True)
        return [Part(where=name, symbol=symbol, value=value, ci95=end) for name, value, end in rows]

    @property
    def known(self) -> bool:
        """True when both parts know the number."""
        variance = np.diag(self.covariance)
        return bool(((variance >= 0.0) & (variance < (ONE_SIZE * self.whole) ** 2)).all())

    @property
    def gap(self) -> float:
        """How far both are apart."""
        return abs(float(self.change[0] - self.change[1]))

    @property
    def error(self) -> float:
        """Standard error of that."""
        one, other = self.covariance.diagonal()
        return float(np.sqrt(max(one + other - 2.0 * self.covariance[0, 1], 0.0)))

    @property
    def relative_gap(self) -> float:
        """The gap beyond its error, as a share of the size in the model."""
        return max(self.gap - ERRORS * self.error, 0.0) / max(self.whole, 1e-12)

    @property
    def excess(self) -> float:
        """Half of the gap that its error does not explain."""
        return 0.5 * float(np.sqrt(max(self.gap**2 - (ERRORS * self.error) ** 2, 0.0)))


def _split(rows: Array, own: Sequence[int], inside: NDArray[np.bool_]) -> Array:
    """Rows (n, p + 1) with an effect's columns first, once for a part and once for the rest, then all others."""
    others = [k for k in range(rows.shape[1]) if k not in own]
    return np.hstack([rows[:, own] * inside[:, None], rows[:, own] * ~inside[:, None], rows[:, others]])


def fitted_by_blocks(rows: Array, noise: Sequence[Array], block: NDArray[np.int64]) -> tuple[Array, Array]:
    """Least squares of the last column on the others, cleared of noise: change, and covariance by whole blocks."""
    gram = rows.T @ rows
    if noise:
        gram = gram - added_by_noise(rows[:, None], np.stack(noise)[:, :, None], np.array([0, len(rows)]))[0, 0]
    size = np.sqrt(np.diag(rows.T @ rows)[:-1])
    size = np.where(size > 0.0, size, 1.0)
    curve = gram[:-1, :-1] / (size[:, None] * size) + RIDGE * np.eye(size.size)
    inverse = np.linalg.inv(curve) / (size[:, None] * size)
    change = inverse @ gram[:-1, -1]
    left = rows[:, -1] - rows[:, :-1] @ change
    return change, sandwich(inverse, block_scores(rows[:, :-1], left, block))


def regions(search: Search) -> Iterator[Region]:
    """The parts of a log that are told apart by the motion, those that hold enough of it and leave enough."""
    balance = search.balance
    u, v, r = balance.speeds.T
    turning = _TURNING * float(np.sqrt((r**2).mean()))
    pushed = _pushed(search)
    for region in (
        Region(("slow", "fast"), np.abs(u) < np.median(np.abs(u))),
        Region(("astern", "ahead"), u < 0.0),
        Region(("drifting slowly", "drifting fast"), np.abs(v) < np.median(np.abs(v))),
        Region(("turning slowly", "turning fast"), np.abs(r) < np.median(np.abs(r))),
        Region(("pushed weakly", "pushed strongly"), pushed < np.median(pushed)),
        Region(("turning to port", "elsewhere"), r < -turning),
        Region(("turning to starboard", "elsewhere"), r > turning),
    ):
        if LEAST_SHARE <= region.tests.mean() <= 1.0 - LEAST_SHARE:
            yield region


def _pushed(search: Search) -> Array:
    """How much all thrusters push at each test, (tests,) [N]; nothing where rollouts are tests: each has all of it."""
    weak = search.balance
    if not isinstance(weak, WeakForm):
        return np.zeros_like(weak.time)
    return weak.passed(np.sum(np.abs(weak.signals(search.nominal)[1]), axis=0))


def find_changing_forces(search: Search, state: State, kept: Sequence[str], seed: int) -> dict[str, str]:
    """In which part of the log each effect's force differs, and by how much, as a sentence; those that keep it, not.

    Parameters
    ----------
    search : on the force balance
    state : the model with everything that was selected, sure or not
    kept : effects in question
    seed : of the copies of the noise
    """
    seen = ~search.quiet
    asked = {c.key for c in search.pool if c.kind is Kind.EFFECT and not c.effect.general}
    names, parts = zip(*_parts(search), strict=True)
    there = [key for key in kept if key in state.active and key in asked]
    if not there or not seen.any():
        return {}
    rest = ResidualSelection(FormColumns(search, state, seen))
    copies, tests = NoiseCopies(search.balance, state.vehicle, seed), np.stack(parts)
    found = {}
    for key in there:
        change = rest.own_change(key, tests, MATERIAL, copies)
        if change is not None and change.worth > change.chance:
            where, more = names[change.part], "more" if change.share > 0.0 else "less"
            found[key] = f"{where[0].upper()}{where[1:]} it is {100.0 * abs(change.share):.0f} % {more} than elsewhere."
    return found


def _parts(search: Search) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """Parts of a log, each as the beginning of a sentence, and which tests belong to it.

    What begins at some time, sides of the water, and the parts that are told apart by the motion.
    """
    weak = search.balance
    assert isinstance(weak, WeakForm), "an effect's own force is that on the force balance"
    minutes = weak.average([m.minutes[:, None] for m in weak.motions])[:, 0]
    logs, names = rows_of_logs(weak)
    first = np.cumsum([0, *(m.time.size for m in weak.motions)])[:-1]
    yield from onsets(minutes, logs[first][weak.reach[0]], names, FINE)
    if len(names) == 1:
        yield from places(weak.average([m.position for m in weak.motions]).T)
    for region in regions(search):
        yield f"where the boat is {region.names[0]}", region.tests
