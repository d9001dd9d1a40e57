"""Columns that look like what a search needs and a table does not name: said with the lines that would map them."""

import re
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from ..canonical import LIMITS, command_kind
from ..formats.base import Stream
from .recognition import like_a_command, side_in

_MOTION = {
    "psi": re.compile(r"heading|hdg|yaw(?!.?rate)|compass", re.IGNORECASE),
    "x": re.compile(r"north", re.IGNORECASE),
    "y": re.compile(r"east", re.IGNORECASE),
    "u": re.compile(r"surge|forward|ahead", re.IGNORECASE),
    "v": re.compile(r"sway|starboard|lateral", re.IGNORECASE),
}
"""Words of columns that may be channels of motion."""
_TURN = 2.0 * np.pi + 0.01
"""Angle that a heading in radians which is not unwrapped stays below; one in degrees goes up to 360."""
_MOST = 6
"""Columns that are named."""


def lacks(have: Collection[str], streams: Sequence[Stream]) -> list[str]:
    """What a search needs and a table does not have, as sentences with the lines of a channel map to try.

    Parameters
    ----------
    have : canonical channels of the log
    streams : those that became no channel
    """
    moving = [s for s in streams if np.isfinite(s.value).any() and np.nanmin(s.value) < np.nanmax(s.value)]
    found = []
    if "psi" not in have:
        found.append(f"A search needs the heading, psi [rad].{_to_try(_of_motion(('psi',), moving))}")
    # Speeds may be left out where a position is there, and the other way round.
    if not {"u", "v"} <= set(have) and not {"x", "y"} <= set(have):
        lines = _of_motion([name for name in ("x", "y", "u", "v") if name not in have], moving)
        found.append(f"A search needs a position, x and y [m], or speeds, u and v [m/s].{_to_try(lines)}")
    if not any(command_kind(name) for name in have):
        kinds = "pwm_port [us], newton_port [N] or normalized_port [-1 to 1]"
        found.append(f"A search needs the command of each thruster, such as {kinds}.{_to_try(_of_commands(moving))}")
    return found


def _to_try(lines: Mapping[str, str]) -> str:
    listed = ", ".join(f"{name!r}: {line}" for name, line in lines.items())
    return f" By names and ranges, try channel_map={{{listed}}}." if lines else ""


def _of_motion(wanted: Sequence[str], streams: Sequence[Stream]) -> dict[str, str]:
    """Lines for the first column of each name that may be wanted."""
    found = {}
    for name in wanted:
        stream = next((s for s in streams if _MOTION[name].search(s.name)), None)
        if stream is not None:
            degrees = name == "psi" and np.nanmax(np.abs(stream.value)) > _TURN
            found[name] = f"{{'from': {stream.name!r}, 'unit': 'deg'}}" if degrees else repr(stream.name)
    return found


def _of_commands(streams: Sequence[Stream]) -> dict[str, str]:
    """Lines for columns that may be commands: those that name a side, or where none does, all."""
    like = [stream for stream in streams if like_a_command(stream.name)]
    sided = [stream for stream in like if side_in(stream.name)] or like
    found: dict[str, str] = {}
    for stream in sided[:_MOST]:
        thruster = side_in(stream.name) or re.sub(r"\W", "_", stream.name)
        found.setdefault(f"{_kind(stream)}_{thruster}", repr(stream.name))
    return found


def _kind(stream: Stream) -> str:
    """The kind of command that has values in the range of a stream."""
    ends = float(np.nanmin(stream.value)), float(np.nanmax(stream.value))
    fits = [kind for kind in ("pwm", "normalized") if LIMITS[kind][0] <= ends[0] and ends[1] <= LIMITS[kind][1]]
    return fits[0] if fits else "newton"
