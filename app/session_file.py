"""A session as a file: the log by its name and digest, the vehicle, the steps with their numbers, and the view."""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field

from ..comparison.facts import Comparison
from ..discovery.findings import Findings
from ..measurements.formats.registry import find_logs, log_digests
from ..physics.errors import RequestError, escaped_json
from ..physics.file_records import Flag, Number, Record, Whole, absent
from ..physics.file_records import shown as short
from ..physics.files import write_text
from ..physics.presentation import listing, number
from ..physics.reading import parse_json, parse_yaml, read_text, reason
from ..physics.vehicle import shipped_vehicles, vehicle_from_dict
from ..workflows.run_folder.read import check_bounds
from ..workflows.workbench_facts import Fit, Searched, Source
from .shown import Interval, Shown, View
from .steps import SESSION, FileNames, Step

_ALIKE = 1e-6
"""Share by which a number may differ from the saved one: less than any log tells, and more than rounding."""
_TOLD = 3
"""Numbers that are told where they are others now; of more it is said how many."""


class SavedFile(Record):
    """A file that the session needs.

    Attributes
    ----------
    name : by which sources call it
    path : where a log was; empty for an upload, of which only the browser knows that
    sha256 : of a log
    text : of a vehicle file or a channel map, which the session holds whole; None for a log
    """

    name: str
    path: str = ""
    sha256: str = ""
    text: str | None = None


class SavedAnswer(Record):
    """What a search found: the facts of its run, names in order, and hidden errors of the sensors, see `Searched`."""

    findings: Findings
    comparison: Comparison
    found: tuple[str, ...] = ()
    hidden: tuple[float, float, float] | None = None


class SavedFit(Record):
    """A model of the falling error: its effects in order, position error [m], and the numbers that it changed."""

    names: tuple[str, ...] = ()
    position: Number = math.nan
    numbers: Mapping[str, float] = {}


class SavedSession(Record):
    """All of a session.

    Attributes
    ----------
    version : of undertow, which wrote it
    files : what sources name
    steps, at : the steps, and which of them is the present one
    vehicle : the nominal model of the present step, as the text of its file
    stairs : the models of the present step
    answer : of the search of the present step; None where nothing was searched
    other : another log on which the model is tried
    on_other : whether the views show it
    view, selected, selected_on_other : what is drawn, and stretches that are marked [s]
    """

    SCHEMA: ClassVar[str] = "undertow.session/1"

    version: str = ""
    files: tuple[SavedFile, ...] = ()
    steps: Annotated[tuple[Step, ...], Field(min_length=1)]
    at: Whole = 0
    vehicle: str = ""
    stairs: tuple[SavedFit, ...] = ()
    answer: SavedAnswer | None = absent()
    other: Source | None = absent()
    on_other: Flag = False
    view: View = View()
    selected: tuple[Interval, ...] = ()
    selected_on_other: tuple[Interval, ...] = ()

    @property
    def searched(self) -> Searched | None:
        """The answer, as far as a file holds it: cards are made again."""
        if self.answer is None:
            return None
        kept = self.answer
        facts = {"hidden": kept.hidden, "findings": kept.findings, "comparison": kept.comparison}
        return Searched(kept.findings.verdict, "", (), kept.found, (), **facts)

    def others_now(self, stairs: Sequence[Fit], vehicle: str) -> str:
        """Say which numbers of the models are others than those that were saved; empty where none is."""
        before, after = _numbers(self.vehicle), _numbers(vehicle)
        pairs = [(symbol, before.get(symbol, 0.0), after.get(symbol, 0.0)) for symbol in {**before, **after}]
        for saved, now in zip(self.stairs, stairs, strict=False):
            held = {value.symbol: value.after for value in now.values}
            pairs += [(symbol, value, held.get(symbol, 0.0)) for symbol, value in saved.numbers.items()]
        told = {
            symbol: f"{symbol} was {number(was, 4)} and is {number(value, 4)}"
            for symbol, was, value in pairs
            if not math.isclose(was, value, rel_tol=_ALIKE, abs_tol=1e-12)
        }
        if not told:
            return ""
        more = f", and {len(told) - _TOLD} more" if len(told) > _TOLD else ""
        by = f" by undertow {self.version}" if self.version != version("undertow") else ""
        return (
            f"This session was saved{by} with other numbers: {'; '.join(list(told.values())[:_TOLD])}{more}. What is "
            "shown is what this version makes of the log; the file still has the numbers that were saved"
        )


def session_in(source: Source) -> tuple[str, tuple[str, ...]]:
    """The session file among what is to be opened, and what lies beside it.

    Raises
    ------
    RequestError
        when there are several, or a vehicle, a map or axes are given with one.
    """
    files = [path for path in source.logs if path.lower().endswith(SESSION)]
    if len(files) > 1:
        raise RequestError(f"expected one session, got {len(files)} JSON files; open them one after the other")
    if source.vehicle or source.channel_map or source.frame:
        raise RequestError(
            f"{files[0]}: a session has its vehicle, map and axes; leave these out, or open the log without the session"
        )
    return files[0], tuple(path for path in source.logs if path != files[0])


def saved_session(shown: Shown, vehicle: str, names: FileNames, folder: Path) -> SavedSession:
    """The session that is shown.

    Parameters
    ----------
    vehicle : the nominal model, as the text of a vehicle file
    names : what the user calls the files of the tab
    folder : of the tab; what lies there is gone when the tab is closed

    Raises
    ------
    RequestError
        when a log is gone, so that nobody could know it again.
    """
    assert shown.history is not None, "a log is open"
    found = _Files(names, folder)
    steps = tuple(replace(step, source=found.named(step.source)) for step in shown.history.steps)
    other = None if shown.other_source is None else found.named(shown.other_source)
    searched, fitted = shown.searched, shown.fitted
    answer = None
    if searched is not None and searched.findings is not None and searched.comparison is not None:
        kept = {"findings": searched.findings, "comparison": searched.comparison}
        answer = SavedAnswer(**kept, found=searched.found, hidden=searched.hidden)
    return SavedSession(
        version=version("undertow"),
        files=tuple(found.files.values()),
        steps=steps,
        at=shown.history.at,
        vehicle=vehicle,
        stairs=tuple(_saved_fit(fit) for fit in shown.of_fitted),
        answer=answer,
        other=other,
        on_other=shown.on_other,
        view=shown.view,
        selected=() if fitted is None else fitted.selected,
        selected_on_other=() if shown.other is None else shown.other.selected,
    )


def write_session(session: SavedSession, path: Path, names: FileNames) -> Path:
    """Write a session, with all digits, whole or not at all; what names uploads bears the user's names of them."""
    content = {"schema": session.SCHEMA, **json.loads(session.model_dump_json(by_alias=True))}
    content["vehicle"] = names.in_file(session.vehicle)
    if "answer" in content:
        content["answer"] = json.loads(names.in_file(json.dumps(content["answer"], ensure_ascii=False)))
    text = json.dumps(content, allow_nan=False, indent=1, ensure_ascii=False)
    try:
        return write_text(path, escaped_json(text) + "\n")
    except OSError as error:
        raise RequestError(
            f"the session cannot be written ({reason(error)}); free some space and save it again"
        ) from None


def read_session(path: Path, name: str = "") -> SavedSession:
    """Read a session.

    Parameters
    ----------
    name : what the user calls the file

    Raises
    ------
    RequestError
        when it cannot be read, is none, or is of another version than this one reads.
    """
    name = name or str(path)
    try:
        content = parse_json(read_text(path))
        check_bounds(content)
    except (OSError, ValueError) as error:
        raise RequestError(
            f"{name}: expected a session that the workbench saved, got what cannot be read ({reason(error)}); save it "
            "again under Take away, or open its log"
        ) from None
    by = content.get("version") if isinstance(content, Mapping) else None
    whose = f"undertow {short(by)[1:-1]}" if isinstance(by, str) and by else "the version that saved it"
    saved = SavedSession.read(content, name, f"open it with {whose}, or open its log anew and add the effects again")
    if not 0 <= saved.at < len(saved.steps):
        raise RequestError(f"{name}: expected 'at' below {len(saved.steps)}, the number of steps, got {saved.at}")
    known = {file.name for file in saved.files}
    strange = next((one for one in _used(saved) if one not in known), None)
    if strange is not None:
        raise RequestError(f"{name}: a step names {short(strange)}, which the session does not hold; save it again")
    return saved


def find_files(
    saved: SavedSession, beside: Sequence[str], folder: Path, names: FileNames, *, paths: bool
) -> Mapping[str, str]:
    """Where the files of a session are now, by their names: logs by their content, texts written into a folder.

    Parameters
    ----------
    beside : paths that may be logs, such as files that were dropped with the session; in a folder, files of their names
    folder : private to the tab
    paths : the paths that the file has may be looked at; not where others than the user of this machine open it

    Raises
    ------
    RequestError
        when a log is not where it was, by its name.
    """
    logs = [file.name for file in saved.files if file.text is None]
    near = [str(Path(one) / name) for one in beside if Path(one).is_dir() for name in logs]
    given = [one for one in [*near, *(one for one in beside if not Path(one).is_dir())] if Path(one).exists()]
    digests = {str(one["path"]): one["sha256"] for one in log_digests(list(dict.fromkeys(given)))}
    places = {}
    for k, file in enumerate(saved.files):
        if file.text is None:
            places[file.name] = _place_of(file, digests, paths=paths)
            continue
        kept = folder / f"reopened-{k}.yaml"
        while kept.exists():
            kept = kept.with_stem(f"{kept.stem}-again")
        names.call(write_text(kept, file.text), file.name)
        places[file.name] = str(kept)
    return places


def relocated(source: Source, places: Mapping[str, str]) -> Source:
    """A source with its files where they are now; a shipped vehicle, and one that is made of the log, stay so."""
    return replace(
        source,
        logs=tuple(places[log] for log in source.logs),
        vehicle=places.get(source.vehicle, source.vehicle),
        channel_map=places.get(source.channel_map, source.channel_map),
        original=None if source.original is None else relocated(source.original, places),
    )


class _Files:
    """The files that sources name, each under a name of its own."""

    def __init__(self, names: FileNames, folder: Path) -> None:
        self._names, self._folder = names, folder
        self.files: dict[str, SavedFile] = {}

    def named(self, source: Source) -> Source:
        """A source that calls its files by their names; a repaired log is made again from what it was."""
        logs = () if source.original is not None or not source.logs else find_logs(source.logs)[0]
        original = None if source.original is None else self.named(source.original)
        return replace(
            source,
            logs=tuple(self._name(path) for path in logs),
            vehicle=self._name(source.vehicle, text=True),
            channel_map=self._name(source.channel_map, text=True),
            original=original,
        )

    def _name(self, path: str, *, text: bool = False) -> str:
        """The name of a file, which is held from now on; a shipped vehicle has its own."""
        if not path or (text and path in shipped_vehicles()):
            return path
        if path in self.files:
            return self.files[path].name
        name = Path(self._names.with_user_names(path)).name
        taken = {file.name for file in self.files.values()}
        name = next(one for one in (name, *(f"{k} {name}" for k in range(2, len(taken) + 3))) if one not in taken)
        self.files[path] = self._text(path, name) if text else self._log(path, name)
        return name

    def _text(self, path: str, name: str) -> SavedFile:
        try:
            return SavedFile(name=name, text=read_text(path))
        except (OSError, ValueError) as error:
            raise RequestError(
                f"{path}: expected the file, which a session holds whole, got {reason(error)}; put it back"
            ) from None

    def _log(self, path: str, name: str) -> SavedFile:
        (found,) = log_digests([path])
        if found["sha256"] is None:
            raise RequestError(
                f"{path}: expected the log, by whose content a session finds it again, got no such file; put it back"
            )
        uploaded = Path(path).is_relative_to(self._folder)
        return SavedFile(name=name, path="" if uploaded else str(Path(path).absolute()), sha256=found["sha256"])


def _place_of(file: SavedFile, digests: Mapping[str, str | None], *, paths: bool) -> str:
    """Where a log is now."""
    same = [path for path, digest in digests.items() if digest == file.sha256]
    if same:
        return same[0]
    came = "no file there" if file.path else "none (it was dropped on the page)"
    if paths and file.path:
        (there,) = log_digests([file.path])
        if there["sha256"] == file.sha256:
            return file.path
        came = came if there["sha256"] is None else "a file with another content"
    where = f" at {file.path}" if file.path and paths else ""
    given = f", and other content in {listing([Path(path).name for path in digests])} beside it" if digests else ""
    raise RequestError(
        f"{file.name}: expected the log of this session{where}, got {came}{given}; drop {file.name} beside the session "
        f"and open both (its SHA-256 begins with {file.sha256[:12]})"
    )


def _used(saved: SavedSession) -> Iterator[str]:
    """All that sources name."""
    sources = [step.source for step in saved.steps] + ([] if saved.other is None else [saved.other])
    for source in sources:
        one: Source | None = source
        while one is not None:
            shipped = (name for name in (one.vehicle, one.like) if name not in shipped_vehicles())
            yield from filter(None, (*one.logs, *shipped, one.channel_map))
            one = one.original


def _saved_fit(fit: Fit) -> SavedFit:
    position = fit.error.get("position", math.nan)
    return SavedFit(names=fit.names, position=position, numbers={value.symbol: value.after for value in fit.values})


def _numbers(vehicle: str) -> Mapping[str, float]:
    """The numbers of a vehicle file; none where it is none of this version."""
    try:
        return vehicle_from_dict(parse_yaml(vehicle), "the session", judged=True).values if vehicle else {}
    except ValueError:
        return {}
