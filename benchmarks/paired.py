"""How often the intervals of paired differences cover the truth, and how often two equal models are told apart.

Errors of two models are simulated: a common part and one of their own, each a first-order process with the given
memory at 10 Hz, so that the truth is known. For rollouts, squared errors are averaged over the horizon from starts
0.5 s apart, as scores do. Prints a line for each case, and exits 1 when an interval covers less than 90 % or more than
98.5 %, or equal models are told apart in more than 7 % of the cases.
"""

import sys
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from undertow.measurements.statistics.blocks import paired_difference

RATE, SPACING = 10, 5
"""Rows a second, and rows between the starts of rollouts."""
LEAST, MOST, WINS = 0.90, 0.985, 0.07


@dataclass(frozen=True, slots=True)
class Case:
    """Seconds of judged rows, memory of the errors [s], true ratio of the models' errors, horizon [s] (0: one step)."""

    seconds: float
    memory: float
    ratio: float = 1.0
    horizon: float = 0.0


CASES = (
    *(Case(s, m, r) for s in (36.0, 135.0, 540.0) for m in (0.0, 0.3, 1.0, 3.0) for r in (1.0, 0.7)),
    *(
        Case(s, 1.0, r, h)
        for s, h in ((36, 2), (36, 10), (45, 10), (90, 10), (100, 30), (135, 30), (540, 30))
        for r in (1.0, 0.7)
    ),
)


@dataclass(frozen=True, slots=True)
class Outcome:
    """Shares of the trials: told anything at all; of those, interval covers, and a difference is claimed; blocks."""

    told: float
    covers: float
    claims: float
    blocks: float


def simulate(case: Case, trials: int, seed: int = 0) -> Outcome:
    """Compare two simulated models many times."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(trials):
        common, one, other = (process(rng, round(case.seconds * RATE), case.memory) for _ in range(3))
        squares = [(case.ratio * (common + one)) ** 2, (common + other) ** 2]
        shortest = 1
        if case.horizon:
            window = round(case.horizon * RATE)
            mean = np.full(window, 1.0 / window)
            squares = [np.convolve(x, mean, "valid")[::SPACING] for x in squares]
            shortest = window // SPACING
        done = paired_difference(squares[0], squares[1], shortest)
        if done.ci95 is not None:
            low, high = (x / np.sqrt(squares[1].mean()) for x in done.ci95)
            found.append((low <= case.ratio - 1.0 <= high, done.verdict in ("better", "worse"), done.blocks))
    if not found:
        return Outcome(0.0, np.nan, np.nan, np.nan)
    covers, claims, blocks = np.mean(found, axis=0)
    return Outcome(len(found) / trials, float(covers), float(claims), float(blocks))


def process(rng: np.random.Generator, rows: int, memory: float) -> np.ndarray:
    """A first-order process of unit variance."""
    keep = np.exp(-1.0 / (RATE * memory)) if memory else 0.0
    run_in = 10 * int(RATE * memory)
    noise = rng.normal(size=rows + run_in + 1) * np.sqrt(1.0 - keep**2)
    noise[0] /= np.sqrt(1.0 - keep**2)
    return np.asarray(lfilter([1.0], [1.0, -keep], noise))[run_in + 1 :]


def main(trials: int) -> bool:
    """Print every case, and tell whether all limits hold."""
    print("seconds  memory  horizon  ratio    told  blocks  covers  claims")
    sound = True
    for case in CASES:
        done = simulate(case, trials)
        holds = not done.told or (LEAST <= done.covers <= MOST and (case.ratio != 1.0 or done.claims <= WINS))
        sound &= holds
        print(
            f"{case.seconds:7.0f}  {case.memory:6.1f}  {case.horizon:7.0f}  {case.ratio:5.1f}  {done.told:5.0%}  "
            f"{done.blocks:6.1f}  {done.covers:6.1%}  {done.claims:6.1%}{'' if holds else '  BROKEN'}"
        )
    return sound


if __name__ == "__main__":
    sys.exit(0 if main(int(sys.argv[1]) if len(sys.argv) > 1 else 2000) else 1)
