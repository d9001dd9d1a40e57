"""Two processes at once on one --out: one whole result, no mixture, and both end with a clear word."""

import random
from collections.abc import Iterator
from pathlib import Path

from .kills import Killing, ended, lay
from .running import Ended
from .trial import Attack, Contents, Job, Trial, calm, contents, differences, judged

_BOAT = ("-v", "boat.yaml")
_TRAIN = ("--residual", "mlp", "--option", "units=4", "--epochs", "3")
PAIRS = {
    "discover": [("discover", f"{log}.csv", *_BOAT, "--out", "OUT") for log in "ab"],
    "discover --no-report": [("discover", f"{log}.csv", *_BOAT, "--no-report", "--out", "OUT") for log in "ab"],
    "train": [("train", f"{log}.csv", *_BOAT, *_TRAIN, "--out", "OUT") for log in "ab"],
    "simulate": [
        ("simulate", *_BOAT, "--duration", "30", "--seed", seed, "--out", "log.csv.gz") for seed in ("5", "6")
    ],
    "report": [("report", "mon"), ("report", "mon")],
    "discover and report": [("discover", "b.csv", *_BOAT, "--out", "mon"), ("report", "mon")],
}
TOGETHER = 0.1
"""Seconds within which the second begins, half of the time; else anywhere in the first."""


def attacks(killing: Killing, scratch: Path, tries: int, seed: int) -> Iterator[Attack]:
    """A row for each verb; OUT is an earlier result, or a new name."""
    draw = random.Random(seed)
    for name, calls in PAIRS.items():
        for out in ("mon", "new") if name.startswith("discover -") else ("net", "new") if name == "train" else ("mon",):
            words = [tuple(out if word == "OUT" else word for word in call) for call in calls]
            alone = []
            seconds = 0.0
            for number, each in enumerate(words):
                place = scratch / f"alone {name} {out} {number}"
                place.mkdir()
                before = lay(killing.ground, place)
                seconds = max(seconds, killing.played(each, place)[0].seconds)
                alone.append(contents(place))
            delays = [draw.uniform(0.0, TOGETHER if k % 2 else seconds) for k in range(tries)]
            jobs = [_pair(killing, words, before, alone, delay) for delay in delays]
            yield Attack("pairs", f"two at once: {name}, {'a new' if out == 'new' else 'an earlier'} result", jobs)


def _pair(killing: Killing, words: list[tuple[str, ...]], before: Contents, alone: list[Contents], delay: float) -> Job:
    def job(folder: Path) -> Trial:
        lay(killing.ground, folder)
        with killing.forge() as forge:
            forge.prepare(words, folder, delays=[0.0, delay])
            forge.release()
            ends: tuple[Ended, ...] = tuple(map(ended, words, forge.collect()))
        now = contents(folder)
        verdicts = [judged(now, before, after) for after in alone]
        wrong = "; ".join(filter(None, (calm(end, (0, 2)) for end in ends)))
        if not any(end.code == 0 for end in ends):
            wrong = wrong or f"neither made it: {ends[0]}; {ends[1]}"
        if now not in alone:
            wrong = wrong or f"neither result is there: {' / '.join(differences(now, after) for after in alone)}"
        whole = [verdict for verdict in verdicts if not verdict.torn]
        lost = "" if any(not verdict.lost for verdict in verdicts) else verdicts[0].lost
        return Trial(f"{words[0][0]} {delay:.2f} s apart", ends, lost, "" if whole else verdicts[0].torn, wrong)

    return job
