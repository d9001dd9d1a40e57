"""The commands as a table: time, and each command in its own unit under its canonical name."""

from .base import Mission, MissionFormat


def _table(mission: Mission) -> str:
    """A row each 0.1 s; a command is held until the next row."""
    time, commands = mission.series()
    lines = [",".join(["time", *(t.channel for t in mission.thrusters)])]
    rows = zip(time.tolist(), commands.tolist(), strict=True)
    lines += [",".join([f"{t:.1f}", *(f"{c:.10g}" for c in row)]) for t, row in rows]
    return "\n".join(lines) + "\n"


COMMAND_TABLE = MissionFormat("mission.csv", "a table of the commands, for whatever plays one back", _table)
