"""What a try is judged by, and the rows of the table: lost, half-written, tracebacks, hangs, memory, messages."""

import hashlib
import json
import os
import re
import shutil
import tempfile
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from .running import CALM, MEMORY, MESSAGE, Ended, undertow

Contents = dict[str, str]
"""Names below a folder, each with the digest of its file or what else it is."""


@dataclass(frozen=True, slots=True)
class Trial:
    """One try: its processes, and what came of the files; an empty text means that all is well."""

    what: str
    ended: tuple[Ended, ...]
    lost: str = ""
    torn: str = ""
    wrong: str = ""

    @property
    def faults(self) -> list[str]:
        """What must not be, in words."""
        named = (("lost", self.lost), ("half-written", self.torn), ("wrong", self.wrong))
        told = [f"{name}: {text}" for name, text in named if text]
        for end in self.ended:
            told += [f"traceback: {end.told[-1500:]!a}"] * end.traceback + ["hang"] * end.hung
            told += [f"{end.memory / 1e6:.0f} MB"] * (end.memory > MEMORY)
            told += [f"{end.message} characters"] * (end.message > MESSAGE)
        return told


Job = Callable[[Path], Trial]
"""A try, given an empty folder of its own."""


@dataclass(frozen=True, slots=True)
class Attack:
    """A row of the table: its tries are made when their turn comes; `skipped` says why there are none."""

    part: str
    name: str
    jobs: Sequence[Job] = ()
    skipped: str = ""


@dataclass(slots=True)
class Row:
    """The tries of an attack, counted."""

    attack: Attack
    trials: list[Trial] = field(default_factory=list)

    HEAD = "| attack | tries | lost | half-written | tracebacks | hangs | other faults | memory [MB] | message |"

    @property
    def bad(self) -> list[Trial]:
        """The tries that failed."""
        return [trial for trial in self.trials if trial.faults]

    def __str__(self) -> str:
        if self.attack.skipped:
            return f"| {self.attack.name} | not tried: {self.attack.skipped} | | | | | | | |"
        ended = [end for trial in self.trials for end in trial.ended]
        cells = (
            self.attack.name.replace("|", "\\|"),
            len(self.trials),
            sum(bool(trial.lost) for trial in self.trials),
            sum(bool(trial.torn) for trial in self.trials),
            sum(end.traceback for end in ended),
            sum(end.hung for end in ended),
            sum(bool(trial.wrong) for trial in self.trials),
            f"{max((end.memory for end in ended), default=0) / 1e6:.0f}",
            max((end.message for end in ended), default=0),
        )
        return "| " + " | ".join(map(str, cells)) + " |"


_TIMES = re.compile(rb'"seconds_to_\w+": [-+.e\d]+')
"""What differs between two equal comparisons: how long they took."""


def contents(folder: Path) -> Contents:
    """Everything below a folder, hidden and temporary names too."""
    found: Contents = {}
    for place, folders, names in os.walk(os.fsencode(folder)):
        for name in (*folders, *names):
            path = os.path.join(place, name)
            key = os.path.relpath(path, os.fsencode(folder)).decode("utf-8", "backslashreplace")
            if os.path.islink(path):
                found[key] = f"link to {os.readlink(path)!r}"
            elif os.path.isdir(path):
                found[key] = "folder"
            elif os.path.isfile(path):
                with open(path, "rb") as stream:
                    found[key] = hashlib.sha256(_TIMES.sub(b"", stream.read())).hexdigest()
            else:
                found[key] = "special"
    return found


CHECKPOINT = "checkpoint.safetensors"
"""What an interrupted training leaves on purpose."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """What became of the files in a folder: `left` names what nobody asked for and nobody took away."""

    lost: str = ""
    torn: str = ""
    left: str = ""


def judged(now: Contents, before: Contents, after: Contents) -> Verdict:
    """Whether everything at the top of a folder is as it was or as it should become, whole.

    A file that the call does not change is lost when it is gone or changed; so is a result that is there in no version.
    A checkpoint and hidden names are what another call puts right, and an empty folder is no result.
    """
    lost = [name for name in before.keys() & after.keys() if before[name] == after[name] != now.get(name)]
    torn = []
    for top in sorted({name.split("/")[0] for name in before.keys() | after.keys()}):
        here, old, new = (_part(state, top) for state in (now, before, after))
        if here not in (old, new):
            if old and not here:
                lost.append(top)
            else:
                torn.append(f"{top} is neither old ({differences(here, old)}) nor new ({differences(here, new)})")
    left = sorted(now.keys() - before.keys() - after.keys() - {n for n in now if n.endswith(f"/{CHECKPOINT}")})
    folders = [name for name in left if now[name] == "folder" and any(n.startswith(f"{name}/") for n in now)]
    return Verdict(_few(sorted(set(lost))), "; ".join(torn), _few([name for name in left if name not in folders]))


def _part(state: Contents, top: str) -> Contents:
    """A name and what is below it, as `judged` compares it."""
    found = {
        name: digest
        for name, digest in state.items()
        if (name == top or name.startswith(f"{top}/"))
        and not any(part.startswith(".") for part in name.split("/")[1:])
        and not name.endswith(f"/{CHECKPOINT}")
    }
    return {} if set(found.values()) == {"folder"} else found


def differences(found: Contents, wanted: Contents) -> str:
    """What differs between two folders, in words; empty when nothing does."""
    gone, new = sorted(wanted.keys() - found.keys()), sorted(found.keys() - wanted.keys())
    other = sorted(name for name in wanted.keys() & found.keys() if wanted[name] != found[name])
    parts = [f"{what} {_few(names)}" for what, names in (("no", gone), ("unknown", new), ("other", other)) if names]
    return "; ".join(parts)


def _few(names: Sequence[str]) -> str:
    return ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")


def calm(ended: Ended, codes: Collection[int] = CALM) -> str:
    """What is wrong with the way a process ended; empty when nothing is."""
    if ended.hung:
        return ""  # a column of its own
    if ended.code not in codes:
        return f"exit code {ended.code}, not {' or '.join(map(str, codes))}: {ended}"
    if ended.code == 2 and not ended.err.strip():
        return f"exit code 2 without a word: {ended}"
    return ""


def raw(ended: Ended) -> str:
    """What control bytes reached the terminal, other than those of lines and tabs; empty when none did."""
    found = sorted({byte for byte in ended.told if (byte < 32 and byte not in b"\n\r\t") or byte == 127})
    return f"control bytes {bytes(found)!r} were printed: {ended}" if found else ""


NAMES = ("a.csv", "b.csv", "boat.yaml", "map.yaml", "mon", "net")
BYSTANDERS = {"thesis.txt": "mine", "mon/notes.txt": "seen in the harbour", "net/notes.txt": "mine as well"}
"""Files of the user's own, beside a result and inside of its folder."""


@dataclass(frozen=True, slots=True)
class Ground:
    """Sound files that attacks begin with: two logs, a vehicle, a map, a run folder, and a network of the first log.

    Attributes
    ----------
    folder : holds a.csv, b.csv, boat.yaml, map.yaml, mon (a run on a.csv), net (a network trained on a.csv)
    seconds : how long each verb took, calm [s]
    after : what a laid folder holds after each verb
    """

    folder: Path
    seconds: dict[str, float]
    after: dict[str, Contents]

    def laid(self, to: Path, names: Iterable[str] = NAMES) -> Contents:
        """Copy some of it to a folder, with files of the user's own when all is copied; what the folder then holds."""
        for name in names:
            source = self.folder / name
            if source.is_dir():
                shutil.copytree(source, to / name)
            else:
                shutil.copy(source, to / name)
        if names is NAMES:
            for name, text in BYSTANDERS.items():
                (to / name).write_text(text)
        return contents(to)

    def tried(self, verb: str, folder: Path, before: Contents, end: Ended, codes: Collection[int] = CALM) -> Trial:
        """A try that must leave the earlier files or the new ones, nothing else, and end with one of these codes."""
        found = judged(contents(folder), before, self.after[verb])
        return Trial(
            str(end), (end,), found.lost, found.torn, (found.left and f"left over: {found.left}") or calm(end, codes)
        )


VERBS: dict[str, tuple[str, ...]] = {
    "simulate": ("simulate", "-v", "boat.yaml", "--duration", "30", "--out", "out.csv"),
    "inspect": ("inspect", "a.csv", "-v", "boat.yaml", "--map-out", "map.yaml"),
    "check": ("check", "boat.yaml", "--out", "out.json"),
    "discover": ("discover", "b.csv", "-v", "boat.yaml", "--out", "mon"),
    "report": ("report", "mon", "--out", "page.html"),
    "compare": ("compare", "a.csv", "-v", "boat.yaml", "--model", "mon", "--out", "out.json", "--series", "out.mcap"),
    "fit": ("fit", "a.csv", "-v", "boat.yaml", "--out", "fitted.yaml"),
    "add": ("add", "surge_quadratic_damping", "--run", "mon", "--out", "added.yaml"),
    "train": (
        *("train", "b.csv", "-v", "boat.yaml", "--residual", "mlp", "--option", "units=4"),
        *("--epochs", "3", "--out", "net"),
    ),
    "explain": ("explain", "net", "a.csv", "-v", "boat.yaml"),
}
"""An ordinary call of each verb, in a folder laid out by `Ground`."""


def ground(folder: Path) -> Ground:
    """Make the sound files with undertow itself, in an empty folder, or take those that an earlier call made there.

    Raises
    ------
    RuntimeError
        when an ordinary call fails: nothing can be attacked then.
    """
    ready = folder / "ground.json"
    if ready.exists():
        return Ground(folder, **json.loads(ready.read_text()))
    boat = ("-v", "boat.yaml")
    shutil.copy(_shipped("blueboat.yaml"), folder / "boat.yaml")
    made = (
        # 40 s: less than that is too short for discovery's rollouts.
        ("simulate", *boat, "--duration", "40", "--effect", "X_uu=-12", "--out", "a.csv"),
        ("simulate", *boat, "--duration", "40", "--effect", "X_uu=-14", "--seed", "1", "--out", "b.csv"),
        ("inspect", "b.csv", *boat, "--map-out", "map.yaml"),
        ("discover", "a.csv", *boat, "--out", "mon"),
        (*("train", "a.csv", *boat, "--residual", "mlp", "--option", "units=4"), "--epochs", "3", "--out", "net"),
    )
    for words in made:
        sound(undertow(*words, cwd=folder))
    plain = Ground(folder, {}, {})
    seconds, after = {}, {}
    for verb, words in VERBS.items():
        with tempfile.TemporaryDirectory() as place:
            plain.laid(Path(place))
            seconds[verb] = sound(undertow(*words, cwd=Path(place))).seconds
            after[verb] = contents(Path(place))
    ready.write_text(json.dumps({"seconds": seconds, "after": after}))
    return Ground(folder, seconds, after)


def sound(ended: Ended) -> Ended:
    """The same, when it ended as it should.

    Raises
    ------
    RuntimeError
        when it did not.
    """
    if ended.code not in (0, 1):
        raise RuntimeError(f"the calm call failed: {ended}")
    return ended


def _shipped(name: str) -> Path:
    from importlib.util import find_spec

    found = find_spec("undertow.physics")
    (place,) = (found.submodule_search_locations or []) if found else []
    return Path(place) / "vehicles" / name
