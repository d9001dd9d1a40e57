"""Whether port is port, and ahead ahead: the sign of the boat's answer against the names of its commands."""

from collections.abc import Mapping, Sequence
from typing import ClassVar, final

from ..channels import command_kind
from .finding import Check, Finding, Reach
from .neutral import neutral_of
from .record import Record
from .response import Answer, answers

_SIDES = {"port": "port", "left": "port", "stbd": "starboard", "starboard": "starboard", "right": "starboard"}
"""Words in a thruster's name that say on which side it sits."""


@final
class Sides(Check):
    """Finds thrusters that push astern when the command says ahead, and ones on the other side than their name says."""

    name: ClassVar[str] = "sides"

    def examine(self, records: Sequence[Record]) -> list[Finding]:
        """See `Check`: a finding "direction" where there is a command, and "sides" where there are two."""
        names = sorted({name for record in records for name in record.commands})
        told = answers(records)
        found = [_direction(records, names, told)] if names else []
        return [*found, _sides(records, names, told)] if len(names) > 1 else found


def _direction(records: Sequence[Record], names: Sequence[str], told: Mapping[str, Answer]) -> Finding:
    found = {name: answer for name, answer in told.items() if answer.ahead}
    if not found:
        text = "the thrusters are not used one by one enough to tell whether one is reversed"
        return Finding("direction", "cannot tell", text, channels=tuple(names))
    wrong = {name: answer for name, answer in found.items() if answer.ahead < 0}
    parts = {name: answer.surge for name, answer in found.items()}
    if not wrong:
        least = min(found.values(), key=lambda answer: answer.surge)
        text = f"more command pushes ahead on {_and(tuple(found))} ({least.surge:.2g} m/s² or more at the end)"
        ends = least.surge - 1.96 * least.surge_error, least.surge + 1.96 * least.surge_error
        untold = [name for name in names if name not in found]
        if untold:
            text = f"{text}; of {_and(untold)} the log does not tell"
            return Finding("direction", "cannot tell", text, least.surge, "m/s^2", ends, tuple(names), parts=parts)
        return Finding("direction", "ok", text, least.surge, "m/s^2", ends, tuple(found), parts=parts)
    worst = min(wrong.values(), key=lambda answer: answer.surge)
    how = [_reversed(records, name) for name in wrong]
    moved = _swapped(names, told)
    # Who turns one round and moves it to the other side must move the other one too.
    listed = [name for name in names if name in wrong or (name in moved and moved & set(wrong))]
    maps = [_line(records, name, told[name], name in moved) for name in listed]
    return Finding(
        "direction",
        "defect",
        f"{_and(how)}: more command pushes astern ({worst.surge:.2g} m/s² at the end of the range)",
        worst.surge,
        "m/s^2",
        (worst.surge - 1.96 * worst.surge_error, worst.surge + 1.96 * worst.surge_error),
        tuple(wrong),
        "a model drives ahead where the boat goes astern; no thrust can be fitted",
        f"turn it round in a channel map: {', '.join(maps)}",
        parts=parts,
        short=f"{_and(tuple(wrong))} {'are' if len(wrong) > 1 else 'is'} reversed",
        reach=Reach.LOG,
    )


def _sides(records: Sequence[Record], names: Sequence[str], told: Mapping[str, Answer]) -> Finding:
    found = {name: answer for name, answer in told.items() if answer.side}
    named = {name: side for name in names if (side := side_of(name))}
    if len(found) < 2:
        text = "the boat does not turn by its thrusters enough to tell which side each is on"
        if told and all(answer.turns for answer in told.values()):
            text = "the boat turns by its thrusters, but it is not sure to push ahead, so sides are not either"
        return Finding("sides", "cannot tell", text, channels=tuple(names))
    lies = [f"{_told(records, name)} is on the {answer.side} side" for name, answer in found.items()]
    parts: Mapping[str, float | str] = {name: answer.side for name, answer in found.items()}
    wrong = [name for name, answer in found.items() if named.get(name, answer.side) != answer.side]
    value, ends = _turn(found, named)
    if not wrong:
        known = set(found) <= set(named)
        text = f"the sides of {_and(tuple(found))} are as named" if known else "; ".join(lies)
        remedy = "" if known else "name the commands by their sides in a channel map"
        verdict = "ok" if known else "note"
        return Finding("sides", verdict, text, value, "rad/s^2", ends, tuple(found), remedy=remedy, parts=parts)
    moved = _swapped(names, told)
    maps = [_line(records, name, found[name], True) for name in names if name in moved]
    remedy = f"swap them in a channel map: {', '.join(maps)}" if maps else "say in a channel map which is which"
    either = "" if _surveyed(records) else "; or say --frame enu if the log's axes are ENU/FLU, which looks alike"
    return Finding(
        "sides",
        "defect",
        f"port and starboard look swapped: {'; '.join(lies)}",
        value,
        "rad/s^2",
        ends,
        tuple(wrong),
        "every turn is predicted to the wrong side",
        f"{remedy}{either}",
        parts=parts,
        short="port and starboard look swapped",
        reach=Reach.LOG,
    )


def side_of(name: str) -> str:
    """The side that a command's name speaks of, empty where it speaks of none.

    >>> side_of("pwm_stbd"), side_of("newton_bow")
    ('starboard', '')
    """
    thruster = (command_kind(name) or ("", name))[1]
    sides = {_SIDES[word] for word in thruster.lower().split("_") if word in _SIDES}
    return sides.pop() if len(sides) == 1 else ""


def _turn(found: Mapping[str, Answer], named: Mapping[str, str]) -> tuple[float | None, tuple[float, float] | None]:
    """Yaw acceleration when every thruster pushes the boat to starboard by its name, at full command [rad/s^2]."""
    told = [(named[name], answer) for name, answer in found.items() if name in named]
    if not told:
        return None, None
    turns = [(1.0 if side == "port" else -1.0) * answer.ahead * answer.yaw for side, answer in told]
    value, error = sum(turns), sum(answer.yaw_error**2 for _, answer in told) ** 0.5
    return value, (value - 1.96 * error, value + 1.96 * error)


def _source(records: Sequence[Record], name: str) -> str:
    return next(record.log.channels[name].origin for record in records if name in record.log.channels)


def _told(records: Sequence[Record], name: str) -> str:
    origin = _source(records, name)
    return name if origin == name or origin.endswith(f":{name}") else f"{origin} (read as {name})"


def _reversed(records: Sequence[Record], name: str) -> str:
    values = [record.log.channels[name].value for record in records if name in record.log.channels]
    low = min(float(value.min()) for value in values)
    kind = (command_kind(name) or ("", ""))[0]
    full = f", {low:.0f} us is the most ahead" if kind == "pwm" else ""
    return f"{_told(records, name)} is reversed{full}"


def _turned(records: Sequence[Record], name: str) -> str:
    """Scale and offset that turn a command round about its neutral."""
    if (command_kind(name) or ("", ""))[0] != "pwm":
        return "scale: -1"
    neutral = neutral_of(records, name)
    return f"scale: -1, offset: {2.0 * (1500.0 if neutral is None else neutral):g}"


def _swapped(names: Sequence[str], told: Mapping[str, Answer]) -> frozenset[str]:
    """Commands on the other side than named, where each has one that changes names with it; else none."""
    sided = {name for name in names if name in told and told[name].side and side_of(name)}
    wrong = {name for name in sided if told[name].side != side_of(name)}
    return frozenset(wrong) if len(sided) > 1 and {_renamed(name) for name in wrong} == wrong else frozenset()


def _line(records: Sequence[Record], name: str, answer: Answer, swapped: bool) -> str:
    """The line of a channel map that puts a command the right way round, and on the other side if that is sure."""
    target, source = _renamed(name) if swapped else name, _source(records, name)
    return f"'{target}: {{from: {source}, {_turned(records, name)}}}'" if answer.ahead < 0 else f"'{target}: {source}'"


def _renamed(name: str) -> str:
    """The name of the same command on the other side."""
    other = {"port": "stbd", "left": "right", "stbd": "port", "starboard": "port", "right": "left"}
    kind, thruster = command_kind(name) or ("", name)
    return f"{kind}_{'_'.join(other.get(word, word) for word in thruster.split('_'))}"


def _surveyed(records: Sequence[Record]) -> bool:
    """Whether positions came from latitude and longitude, which fix the handedness of the axes."""
    origins = [record.log.channels["x"].origin.lower() for record in records if "x" in record.log.channels]
    return bool(origins) and all("lat" in origin for origin in origins)


def _and(names: Sequence[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
