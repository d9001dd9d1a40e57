"""Remedies of thrusters that are not where or as they should be: lines of a channel map, changes of a vehicle file."""

from collections.abc import Iterable, Mapping, Sequence

from ..canonical import command_kind
from .expected_answers import SIDE, Expected
from .record import Record
from .response import Answer
from .resting import neutral_of


def _source(records: Sequence[Record], name: str) -> str:
    return next(record.log.channels[name].origin for record in records if name in record.log.channels)


def called(records: Sequence[Record], name: str) -> str:
    """A command by its name, with what it was read from where that is called otherwise."""
    origin = _source(records, name)
    return name if origin == name or origin.endswith(f":{name}") else f"{origin} (read as {name})"


def _turned(records: Sequence[Record], name: str) -> str:
    """Scale and offset that turn a command round about its neutral."""
    if (command_kind(name) or ("", ""))[0] != "pwm":
        return "scale: -1"
    neutral = neutral_of(records, name)
    return f"scale: -1, offset: {2.0 * (1500.0 if neutral is None else neutral):g}"


def swapped(expected: Mapping[str, Expected], told: Mapping[str, Answer]) -> frozenset[str]:
    """Commands on the other side than expected, where each has one that changes names with it; else none."""
    sided = {name for name in expected if name in told and told[name].side and expected[name].side}
    wrong = {name for name in sided if SIDE[told[name].side] != expected[name].side}
    return frozenset(wrong) if len(sided) > 1 and {other_side(name) for name in wrong} == wrong else frozenset()


def map_line(records: Sequence[Record], name: str, turned: bool, swapped: bool) -> str:
    """The line of a channel map that puts a command the right way round, and on the other side if that is sure."""
    target, source = other_side(name) if swapped else name, _source(records, name)
    return f"'{target}: {{from: {source}, {_turned(records, name)}}}'" if turned else f"'{target}: {source}'"


def other_side(name: str) -> str:
    """The name of the same command on the other side."""
    other = {"port": "stbd", "left": "right", "stbd": "port", "starboard": "port", "right": "left"}
    kind, thruster = command_kind(name) or ("", name)
    return f"{kind}_{'_'.join(other.get(word, word) for word in thruster.split('_'))}"


def or_vehicle(names: Iterable[str], expected: Mapping[str, Expected], what: str) -> str:
    """The other cure: log and vehicle file contradict each other, and either may be the one that is wrong."""
    own = [t for name in names if (t := expected[name].thruster) is not None]
    if not own:
        return ""
    named = all_of(list(dict.fromkeys(t.name for t in own)))
    return f", if the log is wrong; if the vehicle file is, change the {what} of {named} there"


def all_of(names: Sequence[str]) -> str:
    """Names in a sentence, with "and" before the last."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def are(names: Sequence[str]) -> str:
    """The verb that goes with so many names."""
    return "are" if len(names) > 1 else "is"
