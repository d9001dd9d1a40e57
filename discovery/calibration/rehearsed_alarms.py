"""How much wider than it is the noise must be taken for the watch to keep its budget: found by rehearsal.

The run-in is driven again and again with its own columns, and what its fit leaves unexplained is put on anew: in
stretches from random places, so that its colour and its tails stay, and with random signs. Nothing happens in these
hours, so that each alarm in them is false. That a block which fits badly counts less is left out, on the safe side.
"""

import numpy as np

from ...physics.frames import Array
from .change_watch import AlarmSettings, Detector, rows_of, scattered

WIDENINGS = tuple(float(1.25**k) for k in range(17))
"""Of the variance of the noise, up to 36 times; a step costs an eighth of the evidence at most."""
_BUDGETS = 4.0
"""How many times the hours of a false alarm are rehearsed."""
_ALLOWED = 0.5
"""False alarms in the hours that may cost one: half of the budget, for a rehearsal is of finite length and of a run-in
that is shorter still."""
_BLOCKS = 300
"""Blocks of a rehearsed run: twenty minutes, in which changes of some minutes ago are thought of."""
_RUNS = (16, 2000)
"""Fewest and most runs that are rehearsed at once."""
_STRETCH = 5
"""Blocks that are drawn together, so that what lasts longer than a block does so in the rehearsal."""
_FEWEST = 4
"""Blocks of a run-in from which something can be drawn."""


class Rehearsal:
    """Runs in which nothing happens, as the rows of some motion make them.

    Parameters
    ----------
    columns, balance : rows that inform, (n, 3, p) and (n, 3), over the noise
    amounts : (p,) plausible changes
    share, stride : what a row counts, and the time between two [s]
    settings : of the watch
    runs : of twenty minutes each; as many as the budget asks for, where nobody says

    Attributes
    ----------
    hours : that are rehearsed
    """

    def __init__(
        self,
        columns: Array,
        balance: Array,
        amounts: Array,
        share: float,
        stride: float,
        settings: AlarmSettings,
        runs: int | None = None,
    ) -> None:
        rows = rows_of(settings, stride)
        blocks, p = len(columns) // rows, amounts.size
        self._amounts, self._threshold = amounts, settings.threshold
        self.runs = runs or int(np.clip(np.ceil(_BUDGETS * settings.threshold / _BLOCKS), *_RUNS))
        self.hours = self.runs * _BLOCKS * settings.block / 3600.0
        moved = (columns * amounts)[: blocks * rows].reshape(blocks, rows * 3, p)
        force = balance[: blocks * rows].reshape(blocks, rows * 3)
        squares = share * np.einsum("bki,bkj->bij", moved, moved)
        level = np.linalg.solve(squares.sum(axis=0) + 0.01 * np.eye(p), share * np.einsum("bki,bk->i", moved, force))
        left = force - moved @ level
        # The degrees of freedom that the fit took are given back.
        left *= np.sqrt(left.size * share / max(left.size * share - p, 1.0))
        kept = scattered(squares, settings.scatter)
        self._scores = share * np.einsum("bij,bkj,ck->bci", kept, moved, left, optimize=True)
        self._information = kept @ squares
        self._drawn = _drawn(np.random.default_rng([settings.seed, 21]), self.runs, blocks)

    def alarms(self, widening: float, most: float = np.inf) -> int:
        """Runs in which an alarm rings, with so much wider a noise; counted until there are more than `most`."""
        detector = Detector(self._amounts, widening, self.runs)
        rung = np.zeros(self.runs, dtype=bool)
        for k, (place, sign) in enumerate(zip(*self._drawn, strict=True)):
            here = k % len(self._information)
            total = detector.take(self._information[here], (self._scores[here, place] * sign[:, None]).T)
            rung |= total >= np.log(self._threshold)
            if rung.sum() > most:
                break
        return int(rung.sum())


def rehearsed_widening(
    columns: Array, balance: Array, amounts: Array, share: float, stride: float, settings: AlarmSettings
) -> float | None:
    """The least widening of the noise's variance that keeps the budget; None of a run-in that tells too little.

    Parameters
    ----------
    columns, balance, amounts, share, stride, settings : see `Rehearsal`
    """
    if len(columns) < _FEWEST * rows_of(settings, stride):
        return None
    rehearsal = Rehearsal(columns, balance, amounts, share, stride, settings)
    allowed = _ALLOWED * rehearsal.hours / settings.hours
    low, high = 0, len(WIDENINGS) - 1
    middle = 0  # most boats need none
    while low < high:
        if rehearsal.alarms(WIDENINGS[middle], allowed) <= allowed:
            high = middle
        else:
            low = middle + 1
        middle = (low + high) // 2
    return WIDENINGS[low]


def _drawn(rng: np.random.Generator, runs: int, blocks: int) -> tuple[np.ndarray, Array]:
    """Which block's noise is put on each block of each run, and with which sign, (blocks of a run, runs) each."""
    stretches = -(-_BLOCKS // _STRETCH)
    starts = rng.integers(0, blocks, (stretches, runs))
    signs = rng.choice([-1.0, 1.0], (stretches, runs))
    place = (np.repeat(starts, _STRETCH, axis=0) + np.tile(np.arange(_STRETCH), stretches)[:, None]) % blocks
    return place[:_BLOCKS], np.repeat(signs, _STRETCH, axis=0)[:_BLOCKS]
