"""Inputs of every verb: logs read and prepared once for a vehicle.

Logs known to be broken are refused with the cure, or taken as they are with a warning above every result.
"""

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from ..comparison.comparison import Judged
from ..measurements.canonical import command_kind
from ..measurements.formats.registry import find_logs, log_digests
from ..measurements.inspection import Inspection, examine, inspect_log, pool
from ..measurements.kinematics import Kinematics, kinematics_of, longest_row
from ..measurements.log import Log, channels_digest, read_log
from ..measurements.log_options import AS_GUESSED, Reading
from ..measurements.preparation.prepare import PAPER, WEAK, DataSet, prepare
from ..measurements.preparation.split import PARTS, split
from ..measurements.prepared_logs import (
    ALL,
    FOLDS,
    WHOLE,
    Checks,
    Inputs,
    Parts,
    PathLike,
    corrected,
    read_as_wanted,
    repair,
)
from ..measurements.quality.record import Finding, Reach
from ..measurements.statistics.processors import single_threaded
from ..measurements.statistics.signals import LEAST_CORRELATION
from ..physics.errors import LogError, RequestError, expect
from ..physics.motion import Motion
from ..physics.stage import Say, trim_memory
from ..physics.vehicle import Vehicle, load_vehicle
from ..reports.terminal.progress import SHOWN, Pace, megabytes, showing

_PLACES = ("direction", "sides")
"""The checks that tell where thrusters are and which way they push."""
UNPROVEN = (
    "Nothing in the log shows on which side its thrusters are and which way they push: the vehicle file and the "
    "channel map are believed, and if they are wrong, so is what follows. 'undertow inspect' says why."
)
_PUSHED, _SURELY = "2", 0.5
"""Rollouts [s] in which a thruster shows what it does, and share of the error of the best guess without thrusters that
a model of the right ones errs at most: of a boat that is pushed the other way it errs more than the guess."""
_HOW = "--fix does so in memory, inspect --fix in a new file"


def refuse_broken_logs(
    inspections: Sequence[Inspection], together: Sequence[Finding], vehicle: Vehicle, as_is: bool
) -> tuple[str, ...]:
    """Refuse logs whose defects make every finding meaningless, or give these defects as warnings.

    What the logs do not show of the thrusters' sides and directions is a warning, too: all findings rest on it. A
    thruster whose sign or side the vehicle file has, too, is as the file says: the inspections are made for it.

    Parameters
    ----------
    inspections : of all logs, for this vehicle
    together : what the checks say of all logs together; none for one log
    as_is : True to take the logs as they are, and to be warned

    Raises
    ------
    LogError
        which says what was found, how to put it right, and how to go on regardless.
    """
    fatal = defects(inspections, together, vehicle)
    if fatal and not as_is:
        raise LogError(
            f"{'; '.join(fatal)}. Nothing found in such logs is about the boat. 'undertow inspect LOG --map-out "
            "map.yaml' writes the channel map to change; give it back with --map map.yaml. To go on regardless, say "
            "--as-is: every result then carries this as a warning"
        )
    warnings = [f"Taken as it is, so no result can be trusted: {text}." for text in fatal]
    return (*warnings, *_unproven(inspections, together), *_repairable(inspections))


def _unproven(inspections: Sequence[Inspection], together: Sequence[Finding]) -> list[str]:
    """What is likely wrong with the thrusters' places; or a warning where none shows in the logs."""
    known = together or [finding for inspection in inspections for finding in inspection.quality]
    told = [finding for finding in known if finding.check in _PLACES]
    unproven = told and not any(finding.verdict != "cannot tell" or finding.parts for finding in told)
    return likely_misplaced(known) or ([UNPROVEN] if unproven else [])


def still_unproven(warnings: Sequence[str], models: Sequence[Judged], guesses: Sequence[Judged]) -> tuple[str, ...]:
    """Warnings without that of the thrusters' places where a model drives and turns as the boat does.

    None would whose thrusters are elsewhere, or reversed.

    Parameters
    ----------
    models : the model, or several, of the thrusters of one file
    guesses : baselines that know of no thruster
    """
    shown = any(_shows_places(model, guesses) for model in models)
    return tuple(text for text in warnings if text != UNPROVEN or not shown)


def _shows_places(model: Judged, guesses: Sequence[Judged]) -> bool:
    errors = [one.errors.rollout_scores for one in (model, *guesses)]
    if not guesses or any(_PUSHED not in found for found in errors):
        return False
    own, *others = (found[_PUSHED].velocity[[0, 2]] for found in errors)
    return bool((own < _SURELY * np.min(others, axis=0)).all())


def likely_misplaced(findings: Sequence[Finding]) -> list[str]:
    """Likely errors of the thrusters' places and directions, with their odds and the lines to try, once."""
    likely = [finding for finding in findings if finding.check in _PLACES and finding.verdict == "warning"]
    result = []
    for cure in dict.fromkeys(finding.cure for finding in likely):
        first, *others = [finding for finding in likely if finding.cure == cure]
        also = [f"{one.short[0].upper()}{one.short[1:]}, too." for one in others]
        result.append(" ".join([first.told, *also, f"{cure}."]))
    return result


def defects(inspections: Sequence[Inspection], together: Sequence[Finding], vehicle: Vehicle) -> list[str]:
    """Defects of all logs together, then those that single logs have beside them, as sentences without an end.

    Parameters
    ----------
    inspections : of each log
    together : findings on all logs together
    vehicle : for which the logs were prepared
    """
    known = [("all logs together", f) for f in together if _matters(f, vehicle)]
    same = {(f.check, f.channels) for _, f in known}
    own = [(Path(one.path).name, f) for one in inspections for f in one.quality if _matters(f, vehicle)]
    own = [(name, f) for name, f in own if (f.check, f.channels) not in same]
    return [_sentence(name, f) for name, f in (*known, *own)]


def _sentence(name: str, finding: Finding) -> str:
    follows = [text for text in (finding.sentence, finding.consequence, finding.remedy) if text]
    return f"{name}: {'; '.join(follows)}{f' ({_HOW})' if finding.fix else ''}"


def _repairable(inspections: Sequence[Inspection]) -> list[str]:
    """What is wrong with each log, not so much that it is refused, and has a safe repair."""
    result = []
    for inspection in inspections:
        some = [f for f in inspection.quality if f.fix and f.verdict in ("defect", "warning") and not f.refused]
        text = "; ".join(f"{f.short or f.sentence}: {f.fix.sentence}" for f in some if f.fix)
        result += [f"{Path(inspection.path).name} has what a repair would put right: {text} ({_HOW})."] * bool(some)
    return result


def _matters(finding: Finding, vehicle: Vehicle) -> bool:
    """True when a finding is a defect of what this vehicle is driven by or measured with."""
    commands = {name for name in finding.channels if command_kind(name)}
    driven = {thruster.channel for thruster in vehicle.thrusters}
    return finding.refused and (not commands or bool(driven & commands))


_JUDGES = (*PARTS, ALL, FOLDS)


@showing
def read_inputs(
    logs: Iterable[PathLike | Log] | PathLike | Log,
    vehicle: Vehicle | PathLike,
    reading: Reading = AS_GUESSED,
    *,
    judge: str | None = None,
    progress: Say | None = SHOWN,
) -> Inputs:
    """Read and prepare logs for a vehicle.

    Parameters
    ----------
    logs : one path or several: files, folders of logs, or patterns (see `find_logs`), or logs that are in memory (see
        `Log.from_dataframe`); all of them are one data set
    vehicle : a vehicle, the path of its file, or the name of a shipped one
    reading : how the logs are read, whether they are repaired in memory, and whether broken ones are taken as they are
    judge : the part on which models are scored: "test", "validation", "train", "all", or "folds" for all rows, each by
        models that are made without a part of the log around it; None for folds in a discovery, all rows where
        `compare` is given a model that was fitted to other logs, and the test part elsewhere
    progress : called with lines about the work, shown where nothing is said; None for silence

    Raises
    ------
    LogError, VehicleError, RequestError
        when a file cannot be read or used, or is known to be broken; see `Reading.as_is`.
    """
    prepared, checks = read_in_steps(logs, vehicle, reading, judge=judge, progress=progress)
    return prepared.with_checks(checks())


@single_threaded
def read_in_steps(
    logs: Iterable[PathLike | Log] | PathLike | Log,
    vehicle: Vehicle | PathLike,
    reading: Reading = AS_GUESSED,
    *,
    judge: str | None = None,
    progress: Say | None = None,
) -> tuple[Inputs, Callable[[], Checks]]:
    """Prepared logs, on which work may begin, and what tells all that is wrong with them; see `read_inputs`.

    Parameters
    ----------
    logs, vehicle, reading, judge, progress : as in `read_inputs`

    Raises
    ------
    LogError, VehicleError, RequestError
        when a file cannot be read or used; the checks raise where logs are known to be broken, and what was begun with
        them is of no use then.
    """
    expect("read_inputs: logs", logs, (str, os.PathLike, Log, Iterable), "give paths of logs, or logs")
    expect("read_inputs: vehicle", vehicle, (Vehicle, str, os.PathLike), "undertow.load_vehicle(PATH) reads one")
    expect("read_inputs: reading", reading, Reading, "undertow.Reading(frame=..., as_is=...) says how")
    given = [logs] if isinstance(logs, str | os.PathLike | Log) else list(logs)
    for one in given:
        expect("read_inputs: logs", one, (str, os.PathLike, Log), "give paths of logs, or logs")
    paths = [one for one in given if not isinstance(one, Log)]
    ready = [one for one in given if isinstance(one, Log)]
    if ready and not paths and (reading.frame, reading.channel_map, reading.namespace) != (None, None, None):
        raise RequestError(
            "read_inputs: reading: expected as_is and fix alone, for a log in memory is read already; give frame and "
            "channel_map to Log.from_dataframe or Log.from_arrays"
        )
    if judge is not None and judge not in _JUDGES:
        raise RequestError(f"split {judge!r}: expected one of {', '.join(_JUDGES)}")
    model = vehicle if isinstance(vehicle, Vehicle) else load_vehicle(vehicle)
    found, told = find_logs(paths) if paths or not ready else ([], ())
    names = tuple(_utf8(path) for path in found)
    if ready:
        _check_names([*names, *(str(log.path) for log in ready)])
    if reading.channel_map is not None:
        reading = replace(reading, channel_map=_utf8(reading.channel_map))
    told_bytes = megabytes(progress)
    digests = (*(one["sha256"] for one in log_digests(names)), *map(channels_digest, ready))
    read = (*(read_log(name, reading, progress=told_bytes, mend=reading.fix) for name in names), *ready)
    trim_memory()
    read, repairs = _repaired(read, model, progress) if reading.fix else (read, ())
    checks = partial(_checked, read, model, reading, progress)
    try:
        prepared = _prepared(read, model, reading, judge)
    except Exception:
        checks()  # what is wrong with a log is told before what keeps it from being used
        raise
    return replace(prepared, notes=(*told, *prepared.notes), repairs=repairs, digests=digests), checks


def _repaired(read: Sequence[Log], model: Vehicle, progress: Say | None) -> tuple[tuple[Log, ...], tuple[str, ...]]:
    """Logs with their safe repairs made, and what was done to each of them."""
    pace = Pace(progress, "repairs of the log", even=False).told
    done = [repair(log, model, progress=pace) for log in read]
    return tuple(log for log, _ in done), tuple(f"repaired in memory, {log.name}: {what}" for log, what in done)


@single_threaded
def _checked(read: Sequence[Log], model: Vehicle, reading: Reading, progress: Say | None) -> Checks:
    """What is wrong with logs, which are refused where it is too much."""
    checked = Pace(progress, "checks of the log", even=False).told
    examinations = [examine(log, model, progress=checked) for log in read]
    inspections = tuple(inspect_log(log, model, examination=made) for log, made in zip(read, examinations, strict=True))
    if any(inspection.plan.missing for inspection in inspections):
        prepare(read, model, WEAK)  # what is missing is told before what is wrong with the rest
    told_of = [_alignment_notes(inspection, reading.as_is) for inspection in inspections]
    opposed = [text for _, texts in told_of for text in texts]
    together = pool(examinations) if len(read) > 1 else ()
    return Checks(
        notes=tuple(note for notes, _ in told_of for note in notes),
        warnings=(*opposed, *refuse_broken_logs(inspections, together, model, reading.as_is)),
        broken=bool(defects(inspections, together, model)),
        inspections=inspections,
    )


def _prepared(read: Sequence[Log], model: Vehicle, reading: Reading, judge: str | None) -> Inputs:
    """Logs prepared for a vehicle, and corrected for what their records say of their sensors."""
    # The filter comes after the cut into parts, so that it never looks across a boundary.
    weak, even = recorded = prepare(read, model, WEAK), prepare(read, model, replace(PAPER, cutoff=None))
    sensors = {} if reading.as_is else _sensors(read, weak)
    weak, even = corrected(recorded, sensors)
    part = None if judge in WHOLE else judge
    found = Inputs(
        paths=tuple(str(log.path) for log in read),
        starts={str(log.path): log.start_ns for log in read},
        vehicle=model,
        weak=split(weak),
        parts=Parts(split(even, PAPER), part or "test"),
        notes=(*weak.notes, *_sensor_notes(sensors)),
        reading=reading,
        sensors=sensors,
        undivided=(weak, even) if part is None else None,
        recorded=recorded,
    )
    return found.whole(judge) if judge in WHOLE else found


def read_motions(log: PathLike, vehicle: Vehicle, reading: Reading = AS_GUESSED) -> tuple[Log, tuple[Motion, ...]]:
    """One log, and its motions as `read_inputs` has them for the weak form, whole and unchecked.

    What is wrong with the log is not looked for, which takes most of the time of reading a short one.

    Parameters
    ----------
    log : path of the log
    vehicle : for which it is prepared
    reading : how it is read

    Raises
    ------
    LogError, VehicleError
        when the log cannot be read or used.
    """
    read = read_as_wanted(_utf8(log), reading, vehicle)
    data = prepare(read, vehicle, WEAK)
    return read, corrected((data, data), {} if reading.as_is else _sensors([read], data))[0].motions


def _sensors(logs: Iterable[Log], data: DataSet) -> dict[str, Kinematics]:
    """What the records of each log say of its sensors, by the source of its motions."""
    channels = {str(log.path): log.channels for log in logs}
    found = {}
    for source in dict.fromkeys(motion.source for motion in data.motions):
        own, motions = channels.get(source, {}), [m for m in data.motions if m.source == source]
        found[source] = kinematics_of(motions, own, longest_row(own))
    return found


def _sensor_notes(sensors: Mapping[str, Kinematics]) -> list[str]:
    """What the sensors of the logs do wrong, and that it is mended."""
    told = [(source, text) for source, found in sorted(sensors.items()) for text in found.sentences.values()]
    names = {source: f"{Path(source).name}: " if len(sensors) > 1 else "" for source in sensors}
    return [f"{names[source]}{text}; what follows is corrected for it" for source, text in told]


def _check_names(names: Sequence[str]) -> None:
    """Refuse logs in memory that could not be told apart."""
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise RequestError(
            f"two logs are called {twice[0]!r}; give each a name: Log.from_dataframe(..., name='monday')"
        )


def _utf8(path: PathLike) -> str:
    """The path as text that a file can hold."""
    text = os.fspath(path)
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        raise RequestError(f"{text!r}: the file name is not UTF-8, so no report could name it; rename it") from None
    return text


def _alignment_notes(inspection: Inspection, as_is: bool) -> tuple[list[str], list[str]]:
    """What is wrong or out of step in a log, and which records contradict each other where it is taken as it is.

    Raises
    ------
    LogError
        when two records of one quantity have opposite signs: every finding would be about the axes.
    """
    name, broken, notes = Path(inspection.path).name, [], []
    for finding in inspection.quality:
        biased = finding.check == "neutral" and finding.verdict == "warning"  # where thrusters stand still
        if biased or (finding.verdict == "defect" and finding.reach is Reach.SECONDS):
            notes.append(f"{name}: {finding.sentence}; see 'undertow inspect'")
    for record in inspection.alignment:
        if record.offset is None and record.correlation is not None and record.correlation < -LEAST_CORRELATION:
            if not as_is:
                raise LogError(
                    f"{inspection.path}: {record.sentence} Say --frame enu if the log is ENU/FLU, or turn the channel "
                    "with --map (scale: -1). To go on regardless, say --as-is: every result then carries this as a "
                    "warning"
                )
            broken.append(f"Taken as it is, so no result can be trusted: {name}: {record.sentence}")
        if record.offset is not None and not record.sentence.endswith("in step."):
            notes.append(f"{name}: {record.sentence}")
    return notes, broken
