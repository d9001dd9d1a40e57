"""Steps of a person's work, the commands that do the same, and how the user calls the files that they name."""

import os
import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from shlex import quote

from ..physics.errors import RequestError
from ..physics.presentation import words
from ..workflows.workbench_facts import OWN_NUMBERS, ModelChoice, Source

_OF_A_VERB = re.compile(r"^(init|discover|add|fit|train): ")
"""How messages of the command line begin: with the verb that nobody typed here."""
MOST_UPLOADED = 2 * 1024**3
"""Bytes of an upload at most: an hour of a dense bag; what is larger is opened by its path."""
SESSION = ".json"
"""How the name of a saved session ends."""
_UNSAFE = re.compile(r"[^\w.+-]+")
"""What a file that is taken away may give a meaning: quotes, brackets, colons, commas, spaces."""


class FileNames:
    """The user's names of files in a folder; they are told, and never become a path here."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._names: dict[str, str] = {}

    def call(self, kept: Path, name: str) -> None:
        """Say what the user calls a file of the folder."""
        self._names[kept.name] = name

    def with_user_names(self, text: str) -> str:
        """A text for the page, with the user's names in the place of those under which files are kept.

        Examples
        --------
        >>> names = FileNames(Path("/tmp/x"))
        >>> names.call(Path("/tmp/x/upload-1.csv"), "harbour.csv")
        >>> names.with_user_names("discover: /tmp/x/upload-1.csv is empty")
        'harbour.csv is empty'
        """
        return _OF_A_VERB.sub("", self._put(text, str))

    def in_commands(self, text: str) -> str:
        """Command lines with the user's names, quoted where a shell needs it."""
        return self._put(text, quote)

    def in_file(self, text: str) -> str:
        """The text of a file that is taken away, with the user's names, in which nothing has a meaning for any format.

        Examples
        --------
        >>> names = FileNames(Path("/tmp/x"))
        >>> names.call(Path("/tmp/x/upload-1.csv"), "run: 'one'.csv")
        >>> names.in_file("name: boat of upload-1, from upload-1.csv")
        'name: boat of run_one, from run_one_.csv'
        """
        return self._put(text, _plain)

    def _put(self, text: str, spelt: Callable[[str], str]) -> str:
        """Every name in its place, in one go: a user's name may look like one under which another file is kept."""
        if not self._names:
            return text
        own = dict(self._names)
        for kept, name in self._names.items():  # without their ends, as a vehicle is called that is made of a log
            own[kept.partition(".")[0]] = name.partition(".")[0]
        kept = "|".join(re.escape(one) for one in sorted(own, key=len, reverse=True))
        pattern = re.compile(rf"(?:{re.escape(str(self._folder))}/)?(?<![\w.-])({kept})(?![\w-])")
        return pattern.sub(lambda found: spelt(own[found[1]]), text)


def _plain(name: str) -> str:
    return _UNSAFE.sub("_", name).strip("_").lstrip("_.+-") or "file"


def fleet_in(source: Source | None) -> str:
    """The folder of the fleet that is to be opened; empty where logs are.

    Raises
    ------
    RequestError
        when a vehicle or a map is given with it.
    """
    if source is None or len(source.logs) != 1 or not os.path.isdir(source.logs[0]):
        return ""
    from ..fleet.log_sources import INDEX  # here, because the first page is there before anybody asks for a fleet

    (folder,) = source.logs
    if not os.path.isfile(os.path.join(folder, INDEX)):
        return ""
    if source.vehicle or source.channel_map or source.frame:
        raise RequestError(f"{folder}: a fleet has been read for its vehicles already; leave vehicle, map and axes out")
    return folder


_KEPT = 200
"""Steps back at most."""


@dataclass(frozen=True, slots=True)
class Step:
    """What is open, and the model that is made of it.

    Examples
    --------
    >>> step = Step(Source()).adding("sway_lift").moving({"Y_ur": -3.0})
    >>> step.stand.names, step.stand.moved, step.adding("sway_lift") == step
    (('sway_lift',), (('Y_ur', -3.0),), True)
    """

    source: Source
    stand: ModelChoice = field(default_factory=ModelChoice)

    def adding(self, *names: str) -> "Step":
        """The same with effects that are not yet in the model; numbers that were moved are fitted again."""
        fresh = [name for name in names if name not in self.stand.names]
        return self._with(names=(*self.stand.names, *fresh), moved=()) if fresh else self

    def removing(self, name: str) -> "Step":
        """The same without an effect."""
        return self._with(names=tuple(one for one in self.stand.names if one != name), moved=())

    def moving(self, values: Mapping[str, float]) -> "Step":
        """The same with some numbers set by hand."""
        return self._with(moved=tuple(sorted({**dict(self.stand.moved), **values}.items())))

    def fitting(self) -> "Step":
        """The same with no number set by hand."""
        return self._with(moved=())

    def leaving(self, correction: str) -> "Step":
        """The same on the log without a correction of its sensors."""
        return self._with(left=tuple(sorted({*self.stand.left, correction})), moved=())

    def correcting(self, correction: str) -> "Step":
        """The same on the log with a correction that was left out."""
        return self._with(left=tuple(one for one in self.stand.left if one != correction), moved=())

    def _with(self, **changes: tuple[object, ...]) -> "Step":
        return replace(self, stand=replace(self.stand, **changes))  # type: ignore[arg-type]


@dataclass(frozen=True, slots=True)
class History:
    """Steps, the first one first, and which of them is the present one.

    Examples
    --------
    >>> first = Step(Source())
    >>> history = History((first,)).then(first.adding("sway_lift"))
    >>> history.back().now == first, history.back().forth() == history, history.can_redo
    (True, True, False)
    """

    steps: tuple[Step, ...]
    at: int = 0

    @property
    def now(self) -> Step:
        """The present step."""
        return self.steps[self.at]

    @property
    def can_undo(self) -> bool:
        """True when there is a step before this one."""
        return self.at > 0

    @property
    def can_redo(self) -> bool:
        """True when a step was taken back."""
        return self.at + 1 < len(self.steps)

    def then(self, step: Step) -> "History":
        """A step more, if it is one; those that were taken back are forgotten, and the eldest of too many."""
        if step == self.now:
            return self
        kept = (*self.steps[: self.at + 1], step)[-_KEPT:]
        return History(kept, len(kept) - 1)

    def moving(self, values: Mapping[str, float]) -> "History":
        """Some numbers set by hand: a step, or another last one where the same were moved already."""
        step = self.now.moving(values)
        along = values.keys() <= dict(self.now.stand.moved).keys() and not self.can_redo
        return replace(self, steps=(*self.steps[:-1], step)) if along else self.then(step)

    def back(self) -> "History":
        """One step back, or the same at the first."""
        return replace(self, at=max(self.at - 1, 0))

    def forth(self) -> "History":
        """The step again that was taken back, or the same at the last."""
        return replace(self, at=min(self.at + 1, len(self.steps) - 1))


def same_commands(
    source: Source, stand: ModelChoice, found: Sequence[str], *, refits: bool = False, other: Source | None = None
) -> str:
    """A command a line, and a remark for what no command does.

    Parameters
    ----------
    source : what is open
    stand : the present model
    found : names that the search has found
    refits : the search fits the model's own numbers
    other : another log on which the model is tried
    """
    run = "run" if source.logs else "undertow-demo"
    lines = _discovering(source, run) if source.logs else [["undertow", "demo"]]
    if source.original is not None:
        before, (fixed,) = source.original, _names(source.logs)
        lines.insert(0, ["undertow", "inspect", *_names(before.logs), *_reading(before), "--fix", fixed])
    told = [shlex.join(line) for line in lines]
    effects = [name for name in stand.names if name != OWN_NUMBERS]
    if set(stand.names) != set(found) and effects:
        own = OWN_NUMBERS in stand.names
        refit = [] if own == refits else ["--refit" if own else "--no-refit"]
        told.append(shlex.join(["undertow", "add", *effects, "--run", run, *refit, "--out", "model.yaml"]))
    elif OWN_NUMBERS in stand.names and set(stand.names) != set(found):
        told.append("# No command adds the model's own numbers alone; undertow fit calibrates them.")
    if other is not None:
        added = [] if not effects else ["--model", run if set(stand.names) == set(found) else "model.yaml"]
        told.append(shlex.join(["undertow", "compare", *_names(other.logs), *_of_the_boat(source, other, run), *added]))
    told += _put_right(source)
    if stand.left:
        left = ", ".join(words(name) for name in stand.left)
        told.append(f"# Read without a correction of the sensors, which no command does: {left}")
    if stand.moved:
        moved = ", ".join(f"{symbol} = {value:g}" for symbol, value in stand.moved)
        told.append(f"# Moved by hand, which no command does: {moved}")
    return "\n".join(told)


def _of_the_boat(source: Source, other: Source, run: str) -> list[str]:
    """With what another log is read: the vehicle of the run, and the map of the first log where it has none."""
    made = "" if source.vehicle or not source.logs else "channels.yaml"
    mapped = other.channel_map or source.channel_map or made
    reading = _reading(replace(other, channel_map=mapped))
    return ["--vehicle", f"{run}/nominal.yaml", *reading, *["--as-is"] * other.as_is]


def _put_right(source: Source) -> list[str]:
    """What the files must say beside what they do."""
    told = []
    values = [f"{symbol} = {value:g}" for symbol, value in source.changed]
    values += [f"{p.name} at x = {p.x:g}, y = {p.y:g}, angle = {p.angle:.4g}" for p in source.places]
    if values:
        told.append(f"# The vehicle file must have: {'; '.join(values)}")
    wires = [f"{wire.channel} from {wire.by}{', turned round' * wire.turned}" for wire in source.wires]
    if wires:
        told.append(f"# The channel map (undertow inspect LOG --map-out, discover --map) must have: {'; '.join(wires)}")
    return told


def _discovering(source: Source, run: str) -> list[list[str]]:
    """From logs to a run."""
    logs, reading = _names(source.logs), _reading(source)
    if source.vehicle:
        vehicle = ["--vehicle", Path(source.vehicle).name]
        return [["undertow", "discover", *logs, *vehicle, *reading, *["--as-is"] * source.as_is, "--out", run]]
    hull = [word for name, value in source.hull for word in (f"--{name}", f"{value:g}")]
    like = ["--like", source.like] if source.like else []
    files = ["--out", "vehicle.yaml", "--channels", "channels.yaml"]
    made = replace(source, vehicle="vehicle.yaml", channel_map="channels.yaml")
    return [["undertow", "init", *logs, *hull, *like, *reading, *files], *_discovering(made, run)]


def _names(logs: Sequence[str]) -> list[str]:
    return [Path(path).name for path in logs]


def _reading(source: Source) -> list[str]:
    """How logs are read."""
    own_map = ["--map", Path(source.channel_map).name] if source.channel_map else []
    return [*own_map, *(["--frame", source.frame] if source.frame else [])]
