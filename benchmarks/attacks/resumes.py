"""A training that was killed goes on to the same bytes, whenever it was killed."""

import random
from collections.abc import Iterator, Sequence
from pathlib import Path

from .killing import STRACE, Watched, kill_after
from .kills import Killing, ended
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
    with killing.forge() as forge:
        (pid,) = forge.prepare([WORDS], place)
        watched = Watched(pid, place.with_suffix(".strace")) if STRACE else None
        forge.release()
        (found,) = forge.collect()
    end = sound(ended(WORDS, found))
    after, changes = contents(place), watched.changes() if watched else []
    moments = [[draw.uniform(0.0, end.seconds) for _ in range(1 + (k % KILLED_TWICE == 0))] for k in range(tries)]
    jobs = [_resumed(killing, after, times) for times in moments]
    yield Attack("resume", "a training killed at random moments, and resumed", jobs)
    jobs = [_resumed(killing, after, [change]) for change in changes]
    why = "" if STRACE else "needs strace"
    yield Attack("resume", "a training killed at every change of a name, and resumed", jobs, why)


def _resumed(killing: Killing, after: Contents, kills: Sequence[float | tuple[str, int]]) -> Job:
    def job(folder: Path) -> Trial:
        killing.ground.laid(folder)
        words: tuple[str, ...] = WORDS
        ends = []
        for kill in [*kills, None]:
            with killing.forge() as forge:
                (pid,) = forge.prepare([words], folder)
                held = Watched(pid, folder.with_suffix(".strace"), kill) if isinstance(kill, tuple) else None
                forge.release()
                if isinstance(kill, float):
                    kill_after(pid, kill)
                (found,) = forge.collect()
                if held is not None:
                    held.changes()
            ends.append(ended(words, found))
            kept = (folder / "trained" / "checkpoint.safetensors").exists()
            words = (*WORDS, "--resume") if kept else WORDS
        last = ends[-1]
        wrong = "" if last.code == 0 else f"it does not go on: {last}"
        wrong = wrong or differences(contents(folder), after)
        moments = ", ".join(f"{kill:.2f} s" if isinstance(kill, float) else "{} {}".format(*kill) for kill in kills)
        return Trial(f"killed at {moments}", tuple(ends), wrong=wrong)

    return job
