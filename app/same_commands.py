"""The commands that do on the command line what was done with the mouse."""

import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ..physics.in_words import words
from ..workflows.workbench_facts import OWN_NUMBERS, Source, Stand


def same_commands(
    source: Source, stand: Stand, found: Sequence[str], *, refits: bool = False, other: Source | None = None
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
    as_is = ["--as-is"] * source.as_is
    if source.vehicle:
        vehicle = ["--vehicle", Path(source.vehicle).name]
        return [["undertow", "discover", *logs, *vehicle, *reading, *as_is, "--out", run]]
    hull = [word for name, value in source.hull for word in (f"--{name}", f"{value:g}")]
    like = ["--like", source.like] if source.like else []
    files = ["--out", "vehicle.yaml", "--channels", "channels.yaml"]
    frame = ["--frame", source.frame] if source.frame else []
    made = ["--vehicle", "vehicle.yaml", "--map", "channels.yaml"]
    return [
        ["undertow", "init", *logs, *hull, *like, *reading, *files],
        ["undertow", "discover", *logs, *made, *frame, *as_is, "--out", run],
    ]


def _names(logs: Sequence[str]) -> list[str]:
    return [Path(path).name for path in logs]


def _reading(source: Source) -> list[str]:
    """How logs are read."""
    own_map = ["--map", Path(source.channel_map).name] if source.channel_map else []
    return [*own_map, *(["--frame", source.frame] if source.frame else [])]
