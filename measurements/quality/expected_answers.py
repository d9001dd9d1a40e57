"""What commands should do by the vehicle file or their names, and whether the boat surely or likely answers them so."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...physics.thrusters import Thruster, push_and_turn, side_named
from ..canonical import command_kind
from ..statistics.blocks import BY_CHANCE, chance_of_no_more
from .record import Record
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
        """Whether nothing speaks against the way it pushes."""
        return answer.ahead * self.push >= 0

    def turns_as(self, answer: Answer) -> bool:
        """Whether nothing speaks against the way it turns the boat."""
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
    """Whether no command pushes or turns the boat the other way."""
    pairs = [(answer, expected[name]) for name, answer in told.items() if name in expected]
    return all(e.ahead_as(a) and e.turns_as(a) for a, e in pairs)


def told_of(
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
    chance = max([BY_CHANCE, *(chance_of_no_more(trial.left, one.best.left) for trial in others)])
    known = {name: answer for name, answer in one.best.answers.items() if name in expected}
    return Likely(known, chance) if chance < _LIKELY else None


def explained_as_expected(records: Sequence[Record]) -> bool:
    """Whether what explains the log best, sure or not, lets every thruster push and turn as it should."""
    expected = expected_of(records, sorted({name for record in records for name in record.commands}))
    return all(as_expected(one.best.answers, expected) for one in trials(records))


def side_of(name: str) -> str:
    """The side that a command's name speaks of, empty where it speaks of none.

    >>> side_of("pwm_stbd"), side_of("newton_bow")
    ('starboard', '')
    """
    return side_named((command_kind(name) or ("", name))[1])
