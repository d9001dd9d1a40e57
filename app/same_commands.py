"""The commands that do on the command line what was done with the mouse."""

import shlex
from collections.abc import Sequence
from pathlib import Path

from ..physics.in_words import words
from ..workflows.workbench_facts import OWN_NUMBERS, Source, Stand


def same_commands(source: Source, stand: Stand, found: Sequence[str]) -> str:
    """A command a line, and a remark for what no command does.

    Parameters
    ----------
    source : what is open
    stand : the present model
    found : names that the search has found
    """
    run = "run" if source.logs else "undertow-demo"
    lines = _discovering(source, run) if source.logs else [["undertow", "demo"]]
    told = [shlex.join(line) for line in lines]
    effects = [name for name in stand.names if name != OWN_NUMBERS]
    if set(stand.names) != set(found) and effects:
        told.append(shlex.join(["undertow", "add", *effects, "--run", run, "--out", "model.yaml"]))
    if OWN_NUMBERS in stand.names and set(stand.names) != set(found):
        told.append("# No command fits the model's own numbers beside these effects.")
    told += _put_right(source)
    if stand.left:
        left = ", ".join(words(name) for name in stand.left)
        told.append(f"# Read without a correction of the sensors, which no command does: {left}")
    if stand.moved:
        moved = ", ".join(f"{symbol} = {value:g}" for symbol, value in stand.moved)
        told.append(f"# Moved by hand, which no command does: {moved}")
    return "\n".join(told)


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
    logs = [Path(path).name for path in source.logs]
    read = [*(["--frame", source.frame] if source.frame else [])]
    own_map = ["--map", Path(source.channel_map).name] if source.channel_map else []
    as_is = ["--as-is"] * source.as_is
    if source.vehicle:
        vehicle = ["--vehicle", Path(source.vehicle).name]
        return [["undertow", "discover", *logs, *vehicle, *own_map, *read, *as_is, "--out", run]]
    hull = [word for name, value in source.hull for word in (f"--{name}", f"{value:g}")]
    like = ["--like", source.like] if source.like else []
    files = ["--out", "vehicle.yaml", "--channels", "channels.yaml"]
    made = ["--vehicle", "vehicle.yaml", "--map", "channels.yaml"]
    return [
        ["undertow", "init", *logs, *hull, *like, *own_map, *read, *files],
        ["undertow", "discover", *logs, *made, *read, *as_is, "--refit", "--out", run],
    ]
