"""Ctrl-C, SIGTERM, and readers that leave: a message, an exit code, and no file half-written."""

import random
import signal
from collections.abc import Iterator, Sequence
from pathlib import Path

from .running import UNDERTOW, Sent, undertow
from .trial import CHECKPOINT, VERBS, Attack, Ground, Job, Trial, contents, judged


def attacks(ground: Ground, tries: int, seed: int) -> Iterator[Attack]:
    """The rows: Ctrl-C once and twice, SIGTERM, and streams that are closed."""
    draw = random.Random(seed)
    for name, number, presses in (
        ("Ctrl-C", signal.SIGINT, 1),
        ("Ctrl-C, pressed twice", signal.SIGINT, 2),
        ("SIGTERM", signal.SIGTERM, 1),
    ):
        jobs = []
        for verb in VERBS:
            for share in _spread(draw, tries):
                first = share * ground.seconds[verb]
                again = [first + draw.uniform(0.01, 0.3) for _ in range(presses - 1)]
                jobs.append(_stopped(ground, verb, [Sent(after, number) for after in (first, *again)]))
        yield Attack("signals", name, jobs)
    imports = [draw.uniform(0.0, 0.4) for _ in range(4 * tries)]
    yield Attack("signals", "Ctrl-C while it loads", [_stopped(ground, "inspect", [Sent(after)]) for after in imports])
    for name, shell, codes in (
        ("a reader who leaves: | head -1", '"$@" | head -1; exit "${PIPESTATUS[0]}"', (0, 1)),
        ("a reader who leaves at once: | true", '"$@" | true; exit "${PIPESTATUS[0]}"', (0, 1)),
        ("both streams left: 2>&1 | head -1", '"$@" 2>&1 | head -1; exit "${PIPESTATUS[0]}"', (0, 1)),
        ("a closed output: >&-", '"$@" >&-', (0, 1, 2)),
        ("closed messages: 2>&-", '"$@" 2>&-', (0, 1, 2)),
        ("everything closed: <&- >&- 2>&-", '"$@" <&- >&- 2>&-', (0, 1, 2)),
        ("a full output: > /dev/full", '"$@" > /dev/full', (0, 1, 2)),
        ("full messages: 2> /dev/full", '"$@" 2> /dev/full', (0, 1, 2)),
    ):
        yield Attack("signals", name, [_shell(ground, verb, shell, codes) for verb in VERBS])


def _spread(draw: random.Random, tries: int) -> list[float]:
    """Moments over the whole of a verb, one in each equal part."""
    return [(k + draw.random()) / tries for k in range(tries)]


def _stopped(ground: Ground, verb: str, sent: Sequence[Sent]) -> Job:
    def job(folder: Path) -> Trial:
        before = ground.laid(folder)
        end = undertow(*VERBS[verb], cwd=folder, sent=sent)
        done = contents(folder)
        files = judged(done, before, ground.after[verb])
        left = files.left if len(sent) == 1 else ""  # what a second press leaves, the next call takes away
        wrong = f"left over: {left}" if left else ""
        interrupted = 130 if sent[0].signal == signal.SIGINT else 143
        if end.code == interrupted:
            if b"undertow: " not in end.err:
                wrong = wrong or f"no message: {end}"
            if verb == "train" and any(n.endswith(CHECKPOINT) for n in done) and b"--resume" not in end.err:
                wrong = wrong or f"not a word of --resume: {end}"
        elif end.code not in (0, 1) or not _late(end.seconds, sent):
            wrong = wrong or f"exit code {end.code}, not {interrupted}: {end}"
        moment = ", ".join(f"{each.after:.2f} s" for each in sent)
        return Trial(f"{verb} at {moment}", (end,), files.lost, files.torn, wrong)

    return job


def _late(seconds: float, sent: Sequence[Sent]) -> bool:
    """Whether a process was at its end anyway when the signal came."""
    return seconds - sent[0].after < 0.5


def _shell(ground: Ground, verb: str, shell: str, codes: Sequence[int]) -> Job:
    def job(folder: Path) -> Trial:
        before = ground.laid(folder)
        end = undertow(*VERBS[verb], cwd=folder, start=("bash", "-c", shell, "bash", *UNDERTOW))
        trial = ground.tried(verb, folder, before, end, codes)
        if not trial.wrong and "full" not in shell and contents(folder) != ground.after[verb]:
            return Trial(trial.what, (end,), trial.lost, trial.torn, f"the result is not there: {end}")
        return trial

    return job
