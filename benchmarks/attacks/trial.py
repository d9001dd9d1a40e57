"""What a try is judged by, and the rows of the table: lost, half-written, tracebacks, hangs, memory, messages."""

import hashlib
import json
import os
import shutil
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
            told += ["traceback"] * end.traceback + ["hang"] * end.hung
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

    HEAD = (
        "| attack | tries | lost | half-written | tracebacks | hangs | other faults | peak memory [MB] | longest message |"
    )

    @property
    def bad(self) -> list[Trial]:
        """The tries that failed."""
        return [trial for trial in self.trials if trial.faults]

    def __str__(self) -> str:
        if self.attack.skipped:
            return f"| {self.attack.name} | not tried: {self.attack.skipped} | | | | | | | |"
        ended = [end for trial in self.trials for end in trial.ended]
        cells = (
            self.attack.name,
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
                    found[key] = hashlib.file_digest(stream, "sha256").hexdigest()
            else:
                found[key] = "special"
    return found


def below(found: Contents, top: str) -> Contents:
    """What of a folder lies below one of its names, that name itself included."""
    return {name: digest for name, digest in found.items() if name == top or name.startswith(f"{top}/")}


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
    found = sorted({byte for byte in ended.told if byte < 32 and byte not in b"\n\r\t" or byte == 127})
    return f"control bytes {bytes(found)!r} were printed: {ended}" if found else ""


@dataclass(frozen=True, slots=True)
class Ground:
    """Sound files that attacks begin with: two logs, a vehicle, a map, a run folder, and a network of either log.

    Attributes
    ----------
    folder : holds a.csv, b.csv, boat.yaml, map.yaml, mon (a run on a.csv) and net (a network trained on a.csv)
    seconds : how long each verb took, calm [s]
    """

    folder: Path
    seconds: dict[str, float]

    def laid(self, to: Path, names: Iterable[str] = ("a.csv", "b.csv", "boat.yaml", "map.yaml", "mon", "net")) -> Path:
        """Copy some of it to a folder."""
        for name in names:
            source = self.folder / name
            if source.is_dir():
                shutil.copytree(source, to / name)
            else:
                shutil.copy(source, to / name)
        return to


VERBS: dict[str, tuple[str, ...]] = {
    "simulate": ("simulate", "-v", "boat.yaml", "--duration", "30", "--out", "out.csv"),
    "inspect": ("inspect", "a.csv", "-v", "boat.yaml", "--map-out", "out.yaml"),
    "check": ("check", "boat.yaml", "--out", "out.json"),
    "discover": ("discover", "a.csv", "-v", "boat.yaml", "--out", "out"),
    "report": ("report", "mon"),
    "compare": ("compare", "a.csv", "-v", "boat.yaml", "--model", "mon", "--out", "told.json", "--series", "out.mcap"),
    "fit": ("fit", "a.csv", "-v", "boat.yaml", "--out", "fitted.yaml"),
    "add": ("add", "surge_quadratic_damping", "--run", "mon", "--out", "added.yaml"),
    "train": (
        *("train", "a.csv", "-v", "boat.yaml", "--residual", "mlp", "--option", "units=4"),
        *("--epochs", "3", "--out", "outnet"),
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
    ready = folder / "seconds.json"
    if ready.exists():
        return Ground(folder, json.loads(ready.read_text()))
    boat = ("-v", "boat.yaml")
    shutil.copy(_shipped("blueboat.yaml"), folder / "boat.yaml")
    # 40 s: less than that is too short for discovery's rollouts.
    made = {
        "a": ("simulate", *boat, "--duration", "40", "--effect", "X_uu=-12", "--out", "a.csv"),
        "b": ("simulate", *boat, "--duration", "40", "--effect", "X_uu=-14", "--seed", "1", "--out", "b.csv"),
        "map": ("inspect", "a.csv", *boat, "--map-out", "map.yaml"),
        "mon": ("discover", "a.csv", *boat, "--out", "mon"),
        "net": (*VERBS["train"][:-1], "net"),
    }
    seconds = {}
    for name, words in (*made.items(), *VERBS.items()):
        ended = undertow(*words, cwd=folder)
        if ended.code not in (0, 1):
            raise RuntimeError(f"the calm call failed: {ended}")
        seconds[name] = ended.seconds
    for name in ("out", "outnet", "out.csv", "out.yaml", "out.json", "told.json", "out.mcap", "fitted.yaml", "added.yaml"):
        path = folder / name
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    ready.write_text(json.dumps({verb: seconds[verb] for verb in VERBS}))
    return ground(folder)


def _shipped(name: str) -> Path:
    from importlib.util import find_spec

    found = find_spec("undertow.physics")
    (place,) = (found.submodule_search_locations or []) if found else []
    return Path(place) / "vehicles" / name
