"""How much wider than it is the noise must be taken for the watch to keep its budget: found by rehearsal.

The run-in is driven again and again with its own columns, and what its fit leaves unexplained is put on anew: in
stretches from random places, so that its colour and its tails stay, and with random signs. Nothing happens in these
hours, so that each alarm in them is false.
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


def rehearsed_widening(
    columns: Array, balance: Array, amounts: Array, share: float, stride: float, settings: AlarmSettings
) -> float:
    """The least widening of the noise's variance that keeps the budget; the most of a run-in that tells too little.

    Parameters
    ----------
    columns, balance : rows of the run-in that inform, (n, 3, p) and (n, 3), over the noise
    amounts : (p,) plausible changes
    share, stride : what a row counts, and the time between two [s]
    """
    rows = rows_of(settings, stride)
    blocks = len(columns) // rows
    if blocks < _FEWEST:
        return WIDENINGS[-1]
    moved = (columns * amounts)[: blocks * rows].reshape(blocks, rows * 3, -1)
    force = balance[: blocks * rows].reshape(blocks, rows * 3)
    p = moved.shape[2]
    information = share * np.einsum("bki,bkj->bij", moved, moved)
    whole = information.sum(axis=0) + 0.01 * np.eye(p)
    level = np.linalg.solve(whole, share * np.einsum("bki,bk->i", moved, force))
    left = force - moved @ level
    # The degrees of freedom that the fit took are given back.
    left *= np.sqrt(left.size * share / max(left.size * share - p, 1.0))
    kept = scattered(information, settings.scatter)
    scores = share * np.einsum("bij,bkj,ck->bci", kept, moved, left, optimize=True)
    information = kept @ information
    runs = int(np.clip(np.ceil(_BUDGETS * settings.threshold / _BLOCKS), *_RUNS))
    allowed = _ALLOWED * runs * _BLOCKS / settings.threshold
    rng = np.random.default_rng([settings.seed, 21])
    drawn = _drawn(rng, runs, blocks)

    def within(widening: float) -> bool:
        detector, count = Detector(amounts, widening, runs), 0
        rung = np.zeros(runs, dtype=bool)
        for k in range(_BLOCKS):
            place, sign = drawn[0][k], drawn[1][k]
            here = k % blocks
            total = detector.take(information[here], (scores[here, place] * sign[:, None]).T)
            now = (total >= np.log(settings.threshold)) & ~rung
            rung |= now
            count += int(now.sum())
            if count > allowed:
                return False
        return True

    low, high = 0, len(WIDENINGS) - 1
    while low < high:
        middle = (low + high) // 2
        if within(WIDENINGS[middle]):
            high = middle
        else:
            low = middle + 1
    return WIDENINGS[low]


def _drawn(rng: np.random.Generator, runs: int, blocks: int) -> tuple[np.ndarray, Array]:
    """Which block's noise is put on each block of each run, and with which sign, (blocks of a run, runs) each."""
    stretches = -(-_BLOCKS // _STRETCH)
    starts = rng.integers(0, blocks, (stretches, runs))
    signs = rng.choice([-1.0, 1.0], (stretches, runs))
    place = (np.repeat(starts, _STRETCH, axis=0) + np.tile(np.arange(_STRETCH), stretches)[:, None]) % blocks
    return place[:_BLOCKS], np.repeat(signs, _STRETCH, axis=0)[:_BLOCKS]
