"""A training that was killed goes on to the same bytes, whenever it was killed."""

import random
from collections.abc import Iterator, Sequence
from pathlib import Path

from .killing import STRACE, Moment, told
from .kills import Killing
from .trial import Attack, Contents, Job, Trial, contents, differences, sound

WORDS = (
    *("train", "a.csv", "-v", "boat.yaml", "--residual", "lstm", "--option", "units=4"),
    *("--epochs", "6", "--out", "trained"),
)
KILLED_TWICE = 3
"""One training in so many is killed a second time, as it goes on."""


def attacks(killing: Killing, scratch: Path, tries: int, seed: int) -> Iterator[Attack]:
    """The rows: killed at random moments, and at every change of a name, those of the checkpoint among them."""
    draw = random.Random(seed)
    place = scratch / "uninterrupted"
    place.mkdir()
    killing.ground.laid(place)
    end, changes = killing.played(WORDS, place)
    sound(end)
    after = contents(place)
    moments = [[draw.uniform(0.0, end.seconds) for _ in range(1 + (k % KILLED_TWICE == 0))] for k in range(tries)]
    jobs = [_resumed(killing, after, times) for times in moments]
    yield Attack("resume", "a training killed at random moments, and resumed", jobs)
    jobs = [_resumed(killing, after, [change]) for change in changes]
    why = "" if STRACE else "needs strace"
    yield Attack("resume", "a training killed at every change of a name, and resumed", jobs, why)


def _resumed(killing: Killing, after: Contents, kills: Sequence[Moment]) -> Job:
    def job(folder: Path) -> Trial:
        killing.ground.laid(folder)
        words: tuple[str, ...] = WORDS
        ends = []
        for kill in [*kills, None]:
            ends.append(killing.played(words, folder, kill)[0])
            kept = (folder / "trained" / "checkpoint.safetensors").exists()
            words = (*WORDS, "--resume") if kept else WORDS
        last = ends[-1]
        wrong = "" if last.code == 0 else f"it does not go on: {last}"
        wrong = wrong or differences(contents(folder), after)
        moments = ", ".join(map(told, kills))
        return Trial(f"killed {moments}", tuple(ends), wrong=wrong)

    return job
