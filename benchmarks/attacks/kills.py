"""Kill -9 at every change of a name and at random moments: the old result or the new one stays, whole."""

import random
import signal
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from queue import Queue

from undertow.physics.folders import finish_move

from .forge import Forge
from .killing import STRACE, Moment, Watched, kill_after, told
from .running import Ended, Sent, undertow
from .trial import Attack, Contents, Ground, Job, Trial, Verdict, contents, differences, judged, sound

END_TO_END = 0.05
"""Share of the kills that meet whole processes, which take 20 times as long."""


@dataclass(frozen=True, slots=True)
class Scene:
    """A call that replaces an earlier result, or makes a new one.

    Attributes
    ----------
    verb, words : the call
    target : what it makes, for its name
    resumed : words that go on with it, where it was interrupted
    """

    verb: str
    words: tuple[str, ...]
    target: str
    resumed: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        return f"{self.verb} --out {self.target}" if "--out" in self.words else " ".join(self.words)


_BOAT = ("-v", "boat.yaml")
_TRAIN = ("train", "b.csv", *_BOAT, "--residual", "mlp", "--option", "units=4", "--epochs", "3", "--out")
SCENES = (
    Scene("discover", ("discover", "b.csv", *_BOAT, "--no-report", "--out", "mon"), "mon"),
    Scene("discover", ("discover", "b.csv", *_BOAT, "--out", "mon"), "mon"),
    Scene("discover", ("discover", "b.csv", *_BOAT, "--no-report", "--out", "new"), "new"),
    Scene("train", (*_TRAIN, "net"), "net", ("--resume",)),
    Scene("train", (*_TRAIN, "newnet"), "newnet", ("--resume",)),
    Scene("report", ("report", "mon"), "mon/report.html"),
    Scene("report", ("report", "mon", "--out", "page.html"), "page.html"),
    Scene("simulate", ("simulate", *_BOAT, "--duration", "30", "--seed", "3", "--out", "log.csv.gz"), "log.csv.gz"),
    Scene("simulate", ("simulate", *_BOAT, "--duration", "30", "--seed", "3", "--out", "new.csv"), "new.csv"),
    Scene("inspect", ("inspect", "b.csv", *_BOAT, "--map-out", "map.yaml"), "map.yaml"),
    Scene("check", ("check", "mon", "--out", "audit.json"), "audit.json"),
)
"""What is killed; those of the issue first, which share the random moments."""


def lay(ground: Ground, folder: Path) -> Contents:
    """The files that a scene begins with: older results, and files of the user's own."""
    ground.laid(folder)
    for name in OLDER:
        (folder / name).write_bytes((ground.folder / "older" / name).read_bytes())
    return contents(folder)


HOOKED = 25
"""Changes of names at which is killed where strace, which counts them, is missing."""
OLDER = ("log.csv.gz", "audit.json", "page.html", "mon/report.html")
"""Results of earlier calls that are not as the scenes' own."""


def older(ground: Ground) -> None:
    """Make what `lay` takes beside the ground's own files, once."""
    place = ground.folder / "older"
    if place.exists():
        return
    place.mkdir()
    ground.laid(place)
    for words in (
        ("simulate", "-v", "blueboat", "--duration", "30", "--out", "log.csv.gz"),
        ("check", "otter", "--out", "audit.json"),
        ("report", "mon", "--model", "boat.yaml", "--out", "page.html"),
    ):
        sound(undertow(*words, cwd=place))


@dataclass(frozen=True, slots=True)
class Stage:
    """A scene with its state before and after."""

    scene: Scene
    before: Contents
    after: Contents
    seconds: float

    def judged(self, folder: Path) -> Verdict:
        """What is lost and what is half-written, as the next reader finds a folder where the scene was killed."""
        finish_move(folder / Path(self.scene.target).parts[0])
        return judged(contents(folder), self.before, self.after)

    def finished(self, folder: Path) -> str:
        """What is wrong after the next ordinary call."""
        return differences(contents(folder), self.after)


class Killing:
    """Forges that many tries share, one at a time each."""

    def __init__(self, ground: Ground, scratch: Path, workers: int) -> None:
        older(ground)
        self.ground = ground
        self.forges: Queue[Forge] = Queue()
        for number in range(workers):
            place = scratch / f"forge{number}"
            place.mkdir()
            lay(ground, place)
            self.forges.put(Forge(place, [scene.words for scene in SCENES]))

    @contextmanager
    def forge(self) -> Iterator[Forge]:
        """A forge that nobody else uses."""
        taken = self.forges.get()
        try:
            yield taken
        finally:
            self.forges.put(taken)

    def close(self) -> None:
        """End the forges."""
        while not self.forges.empty():
            self.forges.get().close()

    def played(
        self, words: Sequence[str], folder: Path, at: Moment | None = None
    ) -> tuple[Ended, list[tuple[str, int]]]:
        """A call in a forked process, killed at a moment or not, and the changes of names that strace saw."""
        with self.forge() as forge:
            by_hook = at[1] if isinstance(at, tuple) and not STRACE else None
            (pid,) = forge.prepare([words], folder, by_hook)
            change = at if isinstance(at, tuple) else None
            held = Watched(pid, folder.with_suffix(".strace"), change) if STRACE and not isinstance(at, float) else None
            forge.release()
            if isinstance(at, float):
                kill_after(pid, at)
            (found,) = forge.collect()
            return ended(words, found), held.changes() if held is not None else []

    def stage(self, scene: Scene, folder: Path) -> tuple[Stage, list[tuple[str, int]]]:
        """A scene played to its end, and the changes of names that it makes."""
        before = lay(self.ground, folder)
        end, changes = self.played(scene.words, folder)
        sound(end)
        if not STRACE:
            changes = [("change", number) for number in range(1, HOOKED)]
        return Stage(scene, before, contents(folder), end.seconds), changes

    def killed(self, stage: Stage, folder: Path, at: Moment) -> Trial:
        """Kill a scene at a change of a name, or after seconds, and let the next ordinary call follow."""
        scene = stage.scene
        lay(self.ground, folder)
        first, _ = self.played(scene.words, folder, at)
        files = stage.judged(folder)
        ends, wrong = self.resumed(scene, folder)
        wrong = wrong or stage.finished(folder)
        what = f"{scene.name} killed {told(at)} (exit {first.code})"
        return Trial(what, (first, *ends), files.lost, files.torn, wrong)

    def resumed(self, scene: Scene, folder: Path) -> tuple[tuple[Ended, ...], str]:
        """The next ordinary call, with --resume where it asks for it."""
        end = self.played(scene.words, folder)[0]
        ends: tuple[Ended, ...] = (end,)
        if end.code == 2 and scene.resumed and "--resume" in end.err.decode():
            end = self.played((*scene.words, *scene.resumed), folder)[0]
            ends = (*ends, end)
        return ends, "" if end.code in (0, 1) else f"the next call fails: {end}"


def ended(words: Sequence[str], found: tuple[int, float, int, str, str]) -> Ended:
    """What a forge tells, as of any process."""
    code, seconds, memory, out, err = found
    lines = err.splitlines() or [""]
    message = len(err) if code else max(map(len, lines))
    hung = code == -signal.SIGALRM
    return Ended((*words,), code, out.encode(), err.encode(), message, seconds, memory, hung)


def attacks(killing: Killing, scratch: Path, kills: int, seed: int) -> Iterator[Attack]:
    """The rows: every change of a name, then random moments, then whole processes."""
    draw = random.Random(seed)
    stages: dict[Scene, Stage] = {}
    spent = 0
    for number, scene in enumerate(SCENES):
        place = scratch / f"stage{number}"
        place.mkdir()
        stages[scene], changes = killing.stage(scene, place)
        spent += len(changes)
        jobs = [_at(killing, stages[scene], change) for change in changes]
        yield Attack("kills", f"kill -9 at every change of a name: {scene.name}", jobs)
    whole = max(4, round(END_TO_END * kills))
    shared = [scene for scene in SCENES if scene.verb in ("discover", "train", "report", "simulate")]
    for scene in shared:
        count = max(4, -(-(kills - spent - whole) // len(shared)))
        moments = [draw.uniform(0.0, 1.05 * stages[scene].seconds) for _ in range(count)]
        jobs = [_at(killing, stages[scene], moment) for moment in moments]
        yield Attack("kills", f"kill -9 at random moments: {scene.name}", jobs)
    jobs = [_whole(killing, stages[shared[k % len(shared)]], draw.uniform(0.2, 1.0)) for k in range(whole)]
    yield Attack("kills", "kill -9 of whole processes, at random moments", jobs)


def _at(killing: Killing, stage: Stage, at: Moment) -> Job:
    return lambda folder: killing.killed(stage, folder, at)


def _whole(killing: Killing, stage: Stage, share: float) -> Job:
    """Kill a process from its very start on, after a share of the time that its verb takes."""

    def job(folder: Path) -> Trial:
        scene = stage.scene
        lay(killing.ground, folder)
        after = share * killing.ground.seconds[scene.verb]
        begun = time.perf_counter()
        first = undertow(*scene.words, cwd=folder, sent=[Sent(after, 9)])
        files = stage.judged(folder)
        ends, wrong = killing.resumed(scene, folder)
        took = time.perf_counter() - begun
        wrong = wrong or stage.finished(folder)
        return Trial(
            f"{scene.name} killed after {after:.1f} of {took:.1f} s", (first, *ends), files.lost, files.torn, wrong
        )

    return job
