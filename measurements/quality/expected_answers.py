"""Expected answers to commands, by vehicle file or names; thrusters likely reversed or misplaced; and the remedies."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from ...physics.presentation import listing
from ...physics.thrusters import Thruster, push_and_turn, side_named
from ..canonical import command_kind, kind_of
from ..statistics.blocks import BY_CHANCE, chance_of_no_more
from .quick_motion import neutral_of
from .record import Finding, Record, command_names
from .response import Answer, Trials, answers, trials

SIDE = {"port": 1, "starboard": -1}
"""Sign of the yaw moment of a thruster on that side which pushes ahead."""
_LIKELY = 0.025
"""Chance below which an explanation of the log is called likely: on field logs of known wiring it never named a
thruster that was right. Below `BY_CHANCE`, and at great odds, others are ruled out."""


@dataclass(frozen=True, slots=True)
class Expected:
    """What a command should do: push ahead (1) or astern (-1), from port (1) or starboard (-1); 0 where nobody says."""

    push: int
    side: int
    thruster: Thruster | None = None

    def ahead_as(self, answer: Answer) -> bool:
        """True when nothing speaks against the way it pushes."""
        return answer.ahead * self.push >= 0

    def turns_as(self, answer: Answer) -> bool:
        """True when nothing speaks against the way it turns the boat."""
        return answer.turn * self.push * self.side >= 0


@dataclass(frozen=True, slots=True)
class Likely:
    """What explains the log best, which is not what the names say, while others explain it hardly worse.

    Attributes
    ----------
    answers : to each command
    chance : that stretches like these favour it so much over another with other signs, though it is no better
    """

    answers: Mapping[str, Answer]
    chance: float


def expected_of(records: Sequence[Record], names: Sequence[str]) -> dict[str, Expected]:
    """By command; of the vehicle's own where it has some of them, since no other moves its model."""
    thrusters = {t.channel: t for record in records for t in (record.vehicle.thrusters if record.vehicle else ())}
    found = {}
    for name in [name for name in names if name in thrusters]:
        push, turn = push_and_turn(thrusters[name])
        found[name] = Expected(push, push * turn, thrusters[name])
    return found or {name: Expected(1, SIDE.get(side_of(name), 0)) for name in names}


def as_expected(told: Mapping[str, Answer], expected: Mapping[str, Expected]) -> bool:
    """True when no command pushes or turns the boat the other way."""
    pairs = [(answer, expected[name]) for name, answer in told.items() if name in expected]
    return all(e.ahead_as(a) and e.turns_as(a) for a, e in pairs)


def classify_answers(
    records: Sequence[Record], expected: Mapping[str, Expected]
) -> tuple[dict[str, Answer], list[Trials], Likely | None]:
    """The answers that are certain; the trials that contradict each other; and what is likely if nothing is certain."""
    told = {name: answer for name, answer in answers(records).items() if name in expected}
    unsure, likely = [], None
    for one in trials(records) if len(told) < len(expected) else ():
        if not one.contrary or not set(one.best.answers) & set(expected):
            continue
        if one.best.in_step and as_expected(one.best.answers, expected):
            # Nothing is wrong with the log that explains it best; what would need two faults is not asked for.
            told |= {name: answer for name, answer in one.best.answers.items() if name in expected}
        else:
            unsure.append(one)
            likely = likely or _likely(one, expected)
    return told, unsure, None if told else likely


def _likely(one: Trials, expected: Mapping[str, Expected]) -> Likely | None:
    """What explains the log best, where all that explains it about as well, and needs no late clock, is less likely."""
    if not one.best.in_step:
        return None
    others = [trial for trial in one.contrary if trial.in_step]
    chance = max(
        [BY_CHANCE, *(chance_of_no_more(trial.residual_squares, one.best.residual_squares) for trial in others)]
    )
    known = {name: answer for name, answer in one.best.answers.items() if name in expected}
    return Likely(known, chance) if chance < _LIKELY else None


def explained_as_expected(records: Sequence[Record]) -> bool:
    """True when what explains the log best, sure or not, lets every thruster push and turn as it should."""
    expected = expected_of(records, command_names(records))
    return all(as_expected(one.best.answers, expected) for one in trials(records))


def side_of(name: str) -> str:
    """The side that a command's name speaks of, empty where it speaks of none.

    >>> side_of("pwm_stbd"), side_of("newton_bow")
    ('starboard', '')
    """
    return side_named((command_kind(name) or ("", name))[1])


def _source(records: Sequence[Record], name: str) -> str:
    return next(record.log.channels[name].origin for record in records if name in record.log.channels)


def called(records: Sequence[Record], name: str) -> str:
    """A command by its name, with what it was read from where that is called otherwise."""
    origin = _source(records, name)
    return name if origin == name or origin.endswith(f":{name}") else f"{origin} (read as {name})"


def _turned(records: Sequence[Record], name: str) -> str:
    """Scale and offset that turn a command round about its neutral."""
    if kind_of(name) != "pwm":
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
    named = listing(list(dict.fromkeys(t.name for t in own)))
    return f", if the log is wrong; if the vehicle file is, change the {what} of {named} there"


def are(names: Sequence[str]) -> str:
    """The verb that goes with so many names."""
    return "are" if len(names) > 1 else "is"


def likely_reversed(records: Sequence[Record], expected: Mapping[str, Expected], likely: Likely) -> Finding | None:
    """The warning that thrusters are likely reversed; None where only a turn speaks for it, which may be the side."""
    turned, moved = _faults(expected, likely)
    if not turned:
        return None
    text = f"{listing([called(records, name) for name in turned])} {are(turned)} likely reversed ({_sure(likely)})"
    return Finding(
        check="direction",
        verdict="warning",
        sentence=f"{text}: more of that command pushes astern, as the motion is explained best",
        channels=turned,
        consequence="a model drives ahead where the boat goes astern; no thrust can be fitted",
        remedy=_to_try(records, expected, turned, moved),
        short=f"{listing(turned)} {are(turned)} likely reversed",
    )


def likely_swapped(records: Sequence[Record], expected: Mapping[str, Expected], likely: Likely) -> Finding | None:
    """The warning that sides are likely swapped; None where that is not so."""
    turned, moved = _faults(expected, likely)
    if not moved:
        return None
    short = "port and starboard are likely swapped"
    return Finding(
        check="sides",
        verdict="warning",
        sentence=f"{short} ({_sure(likely)})",
        channels=moved,
        consequence="every turn is predicted to the wrong side",
        remedy=_to_try(records, expected, turned, moved),
        short=short,
    )


def _faults(expected: Mapping[str, Expected], likely: Likely) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The commands that likely push the other way, and those that are likely on the other side."""
    turned = tuple(name for name, answer in likely.answers.items() if not expected[name].ahead_as(answer))
    moved = swapped(expected, likely.answers)
    return turned, tuple(sorted(moved)) if all(answer.side for answer in likely.answers.values()) else ()


def _sure(likely: Likely) -> str:
    return f"{100.0 * (1.0 - likely.chance):.0f} % sure, if the commands are in step with the motion"


def _to_try(
    records: Sequence[Record], expected: Mapping[str, Expected], turned: Sequence[str], moved: Sequence[str]
) -> str:
    maps = [map_line(records, name, name in turned, name in moved) for name in expected if name in (*turned, *moved)]
    what = "curve, the angle or the place"
    return f"try it in a channel map: {', '.join(maps)}{or_vehicle((*turned, *moved), expected, what)}"
