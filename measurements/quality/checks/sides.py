"""Check of the sides and signs of thrusters: the boat's answer against the names of its commands.

Where nothing is certain, what is likely reversed or misplaced is told, and what to do about it.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ....physics.presentation import listing
from ...canonical import kind_of
from ...statistics.blocks import BY_CHANCE, CI, chance_of_no_more
from ...statistics.signals import LEAST_CORRELATION, band_passed
from ..axes import surveyed
from ..faults import Fault, Kind, Size, delayed, misplaced, size_by_model
from ..quick_motion import neutral_of
from ..record import RATE, STEP, Check, Finding, Found, Record, channels_called, command_names
from ..response import (
    SIDE,
    Answer,
    Expected,
    Trials,
    answers,
    as_expected,
    called,
    expected_of,
    other_side,
    side_of,
    source_of,
    trials,
)
from .swapped_channels import may_be_exchanged

_TURNING = (0.05, 1.0)
"""The band in which differentiated headings and yaw rates are compared [Hz]: slower is drift, faster is noise."""


_LIKELY = 0.025
"""Chance below which an explanation of the log is called likely: on field logs of known wiring it never named a
thruster that was right. Below `BY_CHANCE`, and at great odds, others are ruled out."""


@dataclass(frozen=True, slots=True)
class Placed:
    """What a log shows of a command for certain: 1 where more of it pushes ahead, -1 astern, 0 unknown; and its side.

    The side is "port", "starboard" or empty.
    """

    ahead: int
    side: str


def placed(records: Sequence[Record]) -> dict[str, Placed]:
    """What logs of one boat show of their commands, whatever the commands are called; only what is certain."""
    expected = expected_of(records, command_names(records))
    told = classify_answers(records, expected)[0] if records else {}
    if told and not as_expected(told, expected) and may_be_exchanged(records):
        return {}
    apart = _turns_apart(records)
    return {name: Placed(answer.ahead, "" if apart else answer.side) for name, answer in told.items()}


def _examine(records: Sequence[Record]) -> Found:
    """Find thrusters that push astern when the command says ahead, and ones on the other side than they should be.

    What should be is what the vehicle file says, and what the names say where there is none. A sign is told where no
    delay of the commands explains the log as well without it; see `response.trials`.

    A finding "direction" where there is a command, and "sides" where there are two.
    """
    names = command_names(records)
    expected = expected_of(records, names)
    names = list(expected)
    if not names:
        return []
    told, unsure, likely = classify_answers(records, expected)
    if told and not as_expected(told, expected) and may_be_exchanged(records):
        text = "u and v may be exchanged, so what the thrusters do to surge is not known"
        return [
            Finding(check=check, verdict="cannot tell", sentence=text, channels=tuple(names))
            for check in ("direction", "sides")
        ]
    gain = _size(records, expected, likely.answers) if likely else None
    likely = likely if gain is None or gain.share.warns else None
    turned, moved = (likely and one(records, expected, likely) for one in (likely_reversed, likely_swapped))
    size = _size(records, expected, told)
    small = _too_small(expected, told, size) if size is not None and not size.likely else None
    found = [small or turned or _direction(records, expected, told, unsure, size)]
    if len(names) > 1 and _turns_apart(records):
        text = "heading and yaw rate turn opposite ways; until one of them is turned, no side can be told"
        return [*found, Finding(check="sides", verdict="cannot tell", sentence=text, channels=tuple(names))]
    sides = small and small.model_copy(update={"check": "sides"})
    return [*found, sides or moved or _sides(records, expected, told, unsure, size)] if len(names) > 1 else found


def _misplaced(expected: Mapping[str, Expected], told: Mapping[str, Answer]) -> tuple[frozenset[str], frozenset[str]]:
    """Commands that push the other way than they should, and those that are on the other side."""
    turned = frozenset(n for n, a in told.items() if not expected[n].ahead_as(a))
    moved = frozenset(n for n, a in told.items() if a.side and SIDE[a.side] * expected[n].side < 0)
    return turned, moved


def _size(records: Sequence[Record], expected: Mapping[str, Expected], told: Mapping[str, Answer]) -> Size | None:
    """How much is explained by thrusters that push another way than they should; None where none does.

    The vehicle tells it with its thrusters turned round, or moved to the other side, against what it says as it is.
    Without a vehicle, commands that push the wrong way are held against ones that push nothing, which is the most that
    they could explain with the sign that they should have.
    """
    turned, moved = _misplaced(expected, told)
    if not turned | moved:
        return None
    explained = trials(records)
    late = float(np.median([one.best.seconds for one in explained]))
    size = size_by_model(records, misplaced(turned, moved), delayed(late))
    for one in explained if size is None else ():
        fitted = one.best.fitted
        if fitted is not None and (turned | moved) & set(fitted.names):
            size = fitted.size_beside(fitted.errors(turned, turned | moved))
    return size


def _too_small(expected: Mapping[str, Expected], told: Mapping[str, Answer], size: Size) -> Finding:
    """The finding that thrusters seem to push another way, which explains too little to be told as a fault."""
    names = tuple(sorted(frozenset.union(*_misplaced(expected, told))))
    text = (
        f"{listing(names)} may push another way than expected, or sit on the other side; but that explains only "
        f"{size.share} of what is left of surge and yaw without it"
    )
    remedy = "drive each thruster alone, ahead and astern, and look at the log again"
    return Finding(check="direction", verdict="cannot tell", sentence=text, channels=names, remedy=remedy)


def _turns_apart(records: Sequence[Record]) -> bool:
    """True when the gyro goes to port where the heading goes to starboard: one of the two signs is wrong."""
    both = [record for record in records if {"psi", "r"} <= set(record.log.channels)]
    pairs = [
        band_passed(np.column_stack([np.gradient(s.motion.heading, STEP), s.motion.velocity[:, 2]]), STEP, _TURNING)
        for record in both
        for s in record.stretches
        if s.motion.time.size > RATE / _TURNING[0]
    ]
    if not pairs:
        return False
    heading, rate = np.concatenate(pairs).T
    return bool(heading @ rate < -LEAST_CORRELATION * np.sqrt((heading @ heading) * (rate @ rate)))


def _direction(
    records: Sequence[Record],
    expected: Mapping[str, Expected],
    told: Mapping[str, Answer],
    unsure: Sequence[Trials],
    size: Size | None,
) -> Finding:
    names = list(expected)
    finding = partial(Finding, check="direction")
    found = {name: answer for name, answer in told.items() if answer.ahead and expected[name].push}
    wrong = {name: answer for name, answer in found.items() if answer.ahead != expected[name].push}
    if not found:
        text = "the thrusters are not used one by one enough to tell whether one is reversed"
        if unsure:
            text = f"whether a thruster is reversed cannot be told: {_either(unsure)}"
        return finding(verdict="cannot tell", sentence=text, channels=tuple(names))
    parts = {name: answer.surge for name, answer in found.items()}
    if not wrong or size is None:
        least = min(found.values(), key=lambda answer: abs(answer.surge))
        as_told = "ahead" if all(answer.ahead > 0 for answer in found.values()) else "as the vehicle file says"
        text = f"more command pushes {as_told} on {listing(tuple(found))} ({least.surge:.2g} m/s² or more at the end)"
        ends = least.surge - CI * least.surge_error, least.surge + CI * least.surge_error
        untold = [name for name in names if name not in found]
        return finding(
            verdict="cannot tell" if untold else "ok",
            sentence=f"{text}; of {listing(untold)} the log does not tell" if untold else text,
            value=least.surge,
            unit="m/s^2",
            ci95=ends,
            channels=tuple(names) if untold else tuple(found),
            parts=parts,
        )
    worst = max(wrong.values(), key=lambda answer: abs(answer.surge))
    how = [_reversed(records, name, expected[name]) for name in wrong]
    moved = swapped(expected, told)
    # Who turns one round and moves it to the other side must move the other one too.
    listed = [name for name in names if name in wrong or (name in moved and moved & set(wrong))]
    maps = [map_line(records, name, name in wrong, name in moved) for name in listed]
    pushes = "astern" if worst.ahead < 0 else "ahead, and that thruster of the vehicle astern"
    facts = {
        "told": f"{listing(how)}: more command pushes {pushes} ({worst.surge:.2g} m/s² at the end of the range)",
        "names": listing(tuple(wrong)),
        "cure": f"{', '.join(maps)}{or_vehicle(wrong, expected, 'curve or the angle')}",
    }
    ends = worst.surge - CI * worst.surge_error, worst.surge + CI * worst.surge_error
    fault = Fault(Kind.REVERSED, tuple(wrong), size, facts, worst.surge, ends, parts=parts)
    return fault.in_words("defect" if size.refuses else "warning")


def _sides(
    records: Sequence[Record],
    expected: Mapping[str, Expected],
    told: Mapping[str, Answer],
    unsure: Sequence[Trials],
    size: Size | None,
) -> Finding:
    names = list(expected)
    found = {name: answer for name, answer in told.items() if answer.side}
    if len(found) < 2:
        text = "the boat does not turn by its thrusters enough to tell which side each is on"
        if told and all(answer.turn for answer in told.values()):
            text = "the boat turns by its thrusters, but it is not sure to push ahead, so sides are not either"
        if unsure:
            text = "which side each thruster is on cannot be told: nor can, for sure, which way it pushes"
        return Finding(check="sides", verdict="cannot tell", sentence=text, channels=tuple(names))
    lies = [_lies(records, name, answer, expected[name]) for name, answer in found.items()]
    parts: Mapping[str, float | str] = {name: answer.side for name, answer in found.items()}
    wrong = [name for name, answer in found.items() if SIDE[answer.side] * expected[name].side < 0]
    value, ends = _turn(found, expected)
    if not wrong or size is None:
        known = all(expected[name].side for name in found)
        words = "in the vehicle file" if any(expected[name].thruster for name in found) else "named"
        text = f"the sides of {listing(tuple(found))} are as {words}" if known else "; ".join(lies)
        return Finding(
            check="sides",
            verdict="ok" if known else "note",
            sentence=text,
            value=value,
            unit="rad/s^2",
            ci95=ends,
            channels=tuple(found),
            remedy="" if known else "name the commands by their sides in a channel map",
            parts=parts,
        )
    moved = swapped(expected, told)
    maps = [map_line(records, name, found[name].ahead != expected[name].push, True) for name in names if name in moved]
    remedy = f"swap them in a channel map: {', '.join(maps)}" if maps else "say in a channel map which is which"
    if all(side_of(name) == found[name].side for name in wrong):
        remedy = f"the names agree with the log, so look at the vehicle file first; or {remedy}"
    logs = [record.log for record in records]
    either = "" if surveyed(logs) else "; or say --frame enu if the log's axes are ENU/FLU, which looks alike"
    cure = f"{remedy}{or_vehicle(wrong, expected, 'sign of y')}{either}"
    fault = Fault(Kind.SWAPPED, tuple(wrong), size, {"told": "; ".join(lies), "cure": cure}, value, ends, parts=parts)
    return fault.in_words("defect" if size.refuses else "warning")


def _either(unsure: Sequence[Trials]) -> str:
    """The remedies that explain the log alike, for commands whose delay is not certain."""
    told = []
    for trial in (unsure[0].best, *unsure[0].contrary[:2]):
        order = "after" if trial.seconds >= 0.0 else "before"
        signs = [
            f"{name} {'pushes ahead' if answer.ahead > 0 else 'pushes astern'}"
            for name, answer in trial.answers.items()
            if answer.ahead
        ] + [
            f"{name} turns the boat to {'starboard' if answer.turn > 0 else 'port'}"
            for name, answer in trial.answers.items()
            if answer.turn and not answer.ahead
        ]
        told.append(f"the boat answers {abs(trial.seconds):.1f} s {order} its commands and {listing(signs)}")
    return f"the log is explained alike if {', or if '.join(told)}"


def _turn(
    found: Mapping[str, Answer], expected: Mapping[str, Expected]
) -> tuple[float | None, tuple[float, float] | None]:
    """Yaw acceleration when every thruster should push the boat to starboard, at full command [rad/s^2]."""
    told = [(expected[name].side, answer) for name, answer in found.items() if expected[name].side]
    if not told:
        return None, None
    value = sum(side * answer.ahead * answer.yaw for side, answer in told)
    error = sum(answer.yaw_error**2 for _, answer in told) ** 0.5
    return value, (value - CI * error, value + CI * error)


def _lies(records: Sequence[Record], name: str, answer: Answer, expected: Expected) -> str:
    text = f"{called(records, name)} is on the {answer.side} side"
    thruster = expected.thruster
    if thruster is None or SIDE[answer.side] * expected.side >= 0:
        return text
    return f"{text}, and thruster {thruster.name} of the vehicle is at y = {thruster.y:+g} m, the other"


def _reversed(records: Sequence[Record], name: str, expected: Expected) -> str:
    values = [channel.value for channel in channels_called(records, name)]
    low = min(float(value.min()) for value in values)
    kind = kind_of(name)
    full = f", {low:.0f} us is the most ahead" if kind == "pwm" and expected.push > 0 else ""
    return f"{called(records, name)} is reversed{full}"


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
    target, source = other_side(name) if swapped else name, source_of(records, name)
    return f"'{target}: {{from: {source}, {_turned(records, name)}}}'" if turned else f"'{target}: {source}'"


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


SIDES = Check("sides", _examine)
