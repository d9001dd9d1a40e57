"""Check of the sides and signs of thrusters: the boat's answer against the names of its commands.

Where nothing is certain, what is likely reversed or misplaced is told, and what to do about it.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ....physics.presentation import listing
from ...canonical import kind_of
from ...statistics.blocks import BY_CHANCE, chance_of_no_more, interval
from ...statistics.signals import LEAST_CORRELATION, band_passed
from ..axes import surveyed
from ..faults import WIDE, Fault, Kind, Size, delayed, misplaced, size_by_model, weaker
from ..quick_motion import neutral_of
from ..record import RATE, STEP, About, Check, Finding, Found, Record, command_names, values_called
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

_REACH, _SHIFTS = 8.0, 33
"""Delays of all commands that are tried in the place of a thruster that is reversed, both ways [s], and how many."""
_WEAKER = (0.0, 0.25, 0.5, 0.75)
"""Shares of its force that are tried, likewise: half steps between what a file of guesses may say of a thruster."""
_LIKELY = 0.025
"""Chance below which an explanation of the log is called likely: on field logs of known wiring it never named a
thruster that was right. Below `BY_CHANCE`, and at great odds, others are ruled out."""


def placed(records: Sequence[Record]) -> dict[str, Answer]:
    """The certain answers to the commands of logs of one boat, whatever these are called.

    Where heading and yaw rate turn opposite ways, no side is.
    """
    if not records:
        return {}
    certain, *_ = _classify(records, expected_of(records, command_names(records)))
    if certain.of_exchanged_speeds:
        return {}
    if _turns_apart(records):
        return {name: replace(answer, yaw_error=np.inf) for name, answer in certain.answers.items()}
    return dict(certain.answers)


def _examine(records: Sequence[Record]) -> Found:
    """Find thrusters that push astern when the command says ahead, and ones on the other side than they should be.

    What should be is what the vehicle file says, and what the names say where there is none. A sign is told where no
    delay of the commands explains the log as well without it; see `response.trials`.

    A finding "direction" where there is a command, and "sides" where there are two.
    """
    expected = expected_of(records, command_names(records))
    if not expected:
        return []
    certain, unsure, likely = _classify(records, expected)
    every = tuple(expected)
    if certain.of_exchanged_speeds:
        text = "u and v may be exchanged, so what the thrusters do to surge is not known"
        return [About(check, every).untold(text) for check in ("direction", "sides")]
    gain = likely and likely.size()
    likely = likely if gain is None or gain.share.warns else None
    size = certain.size()
    small = _too_small(certain, size) if size is not None and not size.likely else None
    reversed_one = None if certain.turned else _reversed_in_vehicle(certain)
    found = [small or reversed_one or (likely and _likely_reversed(likely)) or _direction(certain, unsure, size)]
    if len(expected) < 2:
        return found
    if _turns_apart(records):
        text = "heading and yaw rate turn opposite ways; until one of them is turned, no side can be told"
        return [*found, About("sides", every).untold(text)]
    sides = small and small.model_copy(update={"check": "sides"})
    return [*found, sides or (likely and _likely_swapped(likely)) or _sides(certain, unsure, size)]


@dataclass(frozen=True, slots=True)
class _Answers:
    """The boat's answers to its commands, held against what the commands should do.

    Attributes
    ----------
    records, expected : the logs, and what each command should do
    answers : to the commands of which something is told
    chance : that stretches like these favour the answers so much over others with other signs, though they are no
        better; 0 where the answers are certain
    """

    records: Sequence[Record]
    expected: Mapping[str, Expected]
    answers: Mapping[str, Answer]
    chance: float = 0.0

    @property
    def of_exchanged_speeds(self) -> bool:
        """True when thrusters seem misplaced and u and v may be exchanged, so that what they do is not known."""
        return not as_expected(self.answers, self.expected) and may_be_exchanged(self.records)

    @property
    def turned(self) -> tuple[str, ...]:
        """Commands that push the other way than they should."""
        return tuple(name for name, answer in self.answers.items() if not self.expected[name].ahead_as(answer))

    @property
    def moved(self) -> tuple[str, ...]:
        """Commands that are on the other side than they should be."""
        return tuple(name for name, alike in self._sides.items() if alike < 0)

    @property
    def swapped(self) -> frozenset[str]:
        """The same where each has one that changes names with it; else none."""
        moved = frozenset(self.moved)
        return moved if len(self._sides) > 1 and {other_side(name) for name in moved} == moved else frozenset()

    @property
    def _sides(self) -> dict[str, int]:
        """1 for a command that is on the side where it should be, -1 on the other; not where either is not known."""
        sides = {name: SIDE.get(answer.side, 0) * self.expected[name].side for name, answer in self.answers.items()}
        return {name: alike for name, alike in sides.items() if alike}

    @property
    def sure(self) -> str:
        """How sure likely answers are."""
        return f"{100.0 * (1.0 - self.chance):.0f} % sure, if the commands are in step with the motion"

    def size(self) -> Size | None:
        """How much is explained by thrusters that push another way than they should; None where none does.

        The vehicle tells it with its thrusters turned round, or moved to the other side, against what it says as it is.
        Without a vehicle, commands that push the wrong way are held against ones that push nothing, which is the most
        that they could explain with the sign that they should have.
        """
        turned, moved = frozenset(self.turned), frozenset(self.moved)
        if not turned | moved:
            return None
        explained = trials(self.records)
        late = float(np.median([one.best.seconds for one in explained]))
        size = size_by_model(self.records, misplaced(turned, moved), delayed(late))
        for fitted in [one.best.fitted for one in explained] if size is None else ():
            if fitted is not None and (turned | moved) & set(fitted.names):
                size = fitted.size_beside(fitted.errors(turned, turned | moved))
        return size

    def map_lines(self, names: Collection[str], swapped: Collection[str]) -> str:
        """Lines of a channel map that put commands the right way round, and swapped ones on their side."""
        lines = []
        for name in [name for name in self.expected if name in names]:
            target, source = other_side(name) if name in swapped else name, source_of(self.records, name)
            turned = f"{{from: {source}, {_turned(self.records, name)}}}"
            lines.append(f"'{target}: {turned if name in self.turned else source}'")
        return ", ".join(lines)

    def or_vehicle(self, names: Iterable[str], what: str) -> str:
        """The other cure: log and vehicle file contradict each other, and either may be the one that is wrong."""
        own = [t.name for name in names if (t := self.expected[name].thruster) is not None]
        if not own:
            return ""
        named = listing(list(dict.fromkeys(own)))
        return f", if the log is wrong; if the vehicle file is, change the {what} of {named} there"


def _too_small(told: _Answers, size: Size) -> Finding:
    """The finding that thrusters seem to push another way, which explains too little to be told as a fault."""
    names = tuple(sorted({*told.turned, *told.moved}))
    return About("direction", names).untold(
        f"{listing(names)} may push another way than expected, or sit on the other side; but that explains "
        f"only {size.share} of what is left of surge and yaw without it",
        remedy="drive each thruster alone, ahead and astern, and look at the log again",
    )


def _reversed_in_vehicle(told: _Answers) -> Finding | None:
    """The thruster that the vehicle, not its own command alone, tells to be reversed; None where none is likely.

    A thruster at the bow pushes nothing ahead, and of four that are mixed from three directions none moves alone.
    """
    ahead = {name for name, answer in told.answers.items() if answer.ahead}
    names = [name for name, one in told.expected.items() if one.thruster is not None and name not in ahead]
    late = [one.best.seconds for one in trials(told.records) if one.best.in_step]
    meanwhile = delayed(float(np.median(late))) if late else None
    sizes = {name: size_by_model(told.records, misplaced(frozenset({name}), frozenset()), meanwhile) for name in names}
    # A vehicle that errs by more than the motion itself, its thruster turned round, tells nothing.
    found = {name: size for name, size in sizes.items() if size is not None and size.warns and size.leaves < 1.0}
    if not found:
        return None
    name, size = max(found.items(), key=lambda pair: pair[1].share.value)
    # Commands that are half a period late look reversed, too, and so does one of two that push alike, and too much.
    others = [delayed(seconds) for seconds in np.linspace(-_REACH, _REACH, _SHIFTS)]
    others += [weaker(some, share) for some in (frozenset({name}), frozenset(told.expected)) for share in _WEAKER]
    rivals = [size_by_model(told.records, other, meanwhile) for other in others]
    if max((one.share.value for one in rivals if one is not None), default=0.0) >= size.share.low:
        return None
    line = f"'{name}: {{from: {source_of(told.records, name)}, {_turned(told.records, name)}}}'"
    facts = {
        "told": f"{called(told.records, name)} is reversed: with its thruster turned round, {size.share} of what the "
        "vehicle leaves of surge and yaw is gone",
        "names": name,
        "cure": f"{line}{told.or_vehicle([name], 'curve, the angle or the place')}",
    }
    return Fault(Kind.REVERSED, (name,), size, facts, unit="1").ruled()


def _turns_apart(records: Sequence[Record]) -> bool:
    """True when the gyro goes to port where the heading goes to starboard: one of the two signs is wrong."""
    both = [record for record in records if {"psi", "r"} <= set(record.log.channels)]
    pairs = [
        band_passed(np.column_stack([np.gradient(s.motion.heading, STEP), s.motion.velocity[:, 2]]), STEP, WIDE)
        for record in both
        for s in record.stretches
        if s.motion.time.size > RATE / WIDE[0]
    ]
    if not pairs:
        return False
    heading, rate = np.concatenate(pairs).T
    return bool(heading @ rate < -LEAST_CORRELATION * np.sqrt((heading @ heading) * (rate @ rate)))


def _direction(told: _Answers, unsure: Sequence[Trials], size: Size | None) -> Finding:
    expected, names = told.expected, list(told.expected)
    found = {name: answer for name, answer in told.answers.items() if answer.ahead and expected[name].push}
    if not found:
        text = "the thrusters are not used one by one enough to tell whether one is reversed"
        if unsure:
            text = f"whether a thruster is reversed cannot be told: {_either(unsure)}"
        return About("direction", tuple(names)).untold(text)
    wrong, parts = told.turned, {name: answer.surge for name, answer in found.items()}
    if not wrong or size is None:
        least = min(found.values(), key=lambda answer: abs(answer.surge))
        as_told = "ahead" if all(answer.ahead > 0 for answer in found.values()) else "as the vehicle file says"
        text = f"more command pushes {as_told} on {listing(tuple(found))} ({least.surge:.2g} m/s² or more at the end)"
        untold = [name for name in names if name not in found]
        ends = interval(least.surge, least.surge_error)
        about = About("direction", tuple(names if untold else found), least.surge, "m/s^2", ends, parts)
        return about.untold(f"{text}; of {listing(untold)} the log does not tell") if untold else about.ok(text)
    worst = max((found[name] for name in wrong), key=lambda answer: abs(answer.surge))
    how = [_reversed(told.records, name, expected[name]) for name in wrong]
    # Who turns one round and moves it to the other side must move the other one too.
    swapped = told.swapped
    lines = told.map_lines({*wrong, *(swapped if swapped & set(wrong) else ())}, swapped)
    pushes = "astern" if worst.ahead < 0 else "ahead, and that thruster of the vehicle astern"
    facts = {
        "told": f"{listing(how)}: more command pushes {pushes} ({worst.surge:.2g} m/s² at the end of the range)",
        "names": listing(wrong),
        "cure": f"{lines}{told.or_vehicle(wrong, 'curve or the angle')}",
    }
    ends = interval(worst.surge, worst.surge_error)
    fault = Fault(Kind.REVERSED, wrong, size, facts, worst.surge, ends, parts=parts)
    return fault.in_words("defect" if size.refuses else "warning")


def _sides(told: _Answers, unsure: Sequence[Trials], size: Size | None) -> Finding:
    expected = told.expected
    found = {name: answer for name, answer in told.answers.items() if answer.side}
    if len(found) < 2:
        text = "the boat does not turn by its thrusters enough to tell which side each is on"
        if told.answers and all(answer.turn for answer in told.answers.values()):
            text = "the boat turns by its thrusters, but it is not sure to push ahead, so sides are not either"
        if unsure:
            text = "which side each thruster is on cannot be told: nor can, for sure, which way it pushes"
        return About("sides", tuple(expected)).untold(text)
    lies = "; ".join(_lies(told.records, name, answer, expected[name]) for name, answer in found.items())
    parts: Mapping[str, float | str] = {name: answer.side for name, answer in found.items()}
    wrong, (value, ends) = told.moved, _turn(found, expected)
    if not wrong or size is None:
        known = all(expected[name].side for name in found)
        words = "in the vehicle file" if any(expected[name].thruster for name in found) else "named"
        return About("sides", tuple(found), value, "rad/s^2", ends, parts=parts).finding(
            "ok" if known else "note",
            f"the sides of {listing(tuple(found))} are as {words}" if known else lies,
            remedy="" if known else "name the commands by their sides in a channel map",
        )
    lines = told.map_lines(told.swapped, told.swapped)
    remedy = f"swap them in a channel map: {lines}" if lines else "say in a channel map which is which"
    if all(side_of(name) == found[name].side for name in wrong):
        remedy = f"the names agree with the log, so look at the vehicle file first; or {remedy}"
    logs = [record.log for record in told.records]
    either = "" if surveyed(logs) else "; or say --frame enu if the log's axes are ENU/FLU, which looks alike"
    facts = {"told": lies, "cure": f"{remedy}{told.or_vehicle(wrong, 'sign of y')}{either}"}
    fault = Fault(Kind.SWAPPED, wrong, size, facts, value, ends, parts=parts)
    return fault.in_words("defect" if size.refuses else "warning")


def _either(unsure: Sequence[Trials]) -> str:
    """The remedies that explain the log alike, for commands whose delay is not certain."""
    told = []
    for trial in (unsure[0].best, *unsure[0].contrary[:2]):
        order = "after" if trial.seconds >= 0.0 else "before"
        pushes = {name: ("", "ahead", "astern")[answer.ahead] for name, answer in trial.answers.items()}
        turns = {name: ("", "starboard", "port")[answer.turn] for name, answer in trial.answers.items()}
        signs = [f"{name} pushes {way}" for name, way in pushes.items() if way]
        signs += [f"{name} turns the boat to {way}" for name, way in turns.items() if way and not pushes[name]]
        told.append(f"the boat answers {abs(trial.seconds):.1f} s {order} its commands and {listing(signs)}")
    return f"the log is explained alike if {', or if '.join(told)}"


def _turn(
    found: Mapping[str, Answer], expected: Mapping[str, Expected]
) -> tuple[float | None, tuple[float, float] | None]:
    """Yaw acceleration when every thruster should push the boat to starboard, at full command [rad/s^2]."""
    sided = [(expected[name].side, answer) for name, answer in found.items() if expected[name].side]
    if not sided:
        return None, None
    value = sum(side * answer.ahead * answer.yaw for side, answer in sided)
    return value, interval(value, sum(answer.yaw_error**2 for _, answer in sided) ** 0.5)


def _lies(records: Sequence[Record], name: str, answer: Answer, expected: Expected) -> str:
    text = f"{called(records, name)} is on the {answer.side} side"
    thruster = expected.thruster
    if thruster is None or SIDE[answer.side] * expected.side >= 0:
        return text
    return f"{text}, and thruster {thruster.name} of the vehicle is at y = {thruster.y:+g} m, the other"


def _reversed(records: Sequence[Record], name: str, expected: Expected) -> str:
    low = float(values_called(records, name).min())
    kind = kind_of(name)
    full = f", {low:.0f} us is the most ahead" if kind == "pwm" and expected.push > 0 else ""
    return f"{called(records, name)} is reversed{full}"


def _classify(
    records: Sequence[Record], expected: Mapping[str, Expected]
) -> tuple[_Answers, list[Trials], _Answers | None]:
    """The answers that are certain; the trials that contradict each other; and what is likely if nothing is certain."""
    told = {name: answer for name, answer in answers(records).items() if name in expected}
    unsure, likely = [], None
    for one in trials(records) if len(told) < len(expected) else ():
        best = {name: answer for name, answer in one.best.answers.items() if name in expected}
        if not one.contrary or not best:
            continue
        if one.best.in_step and as_expected(best, expected):
            # Nothing is wrong with the log that explains it best; what would need two faults is not asked for.
            told |= best
        else:
            unsure.append(one)
            chance = _chance(one)
            likely = likely or (_Answers(records, expected, best, chance) if chance < _LIKELY else None)
    return _Answers(records, expected, told), unsure, None if told else likely


def _chance(one: Trials) -> float:
    """The chance that others which need no late clock explain a log no worse; 1 where the best one needs one."""
    if not one.best.in_step:
        return 1.0
    others = [trial for trial in one.contrary if trial.in_step]
    chances = [chance_of_no_more(trial.residual_squares, one.best.residual_squares) for trial in others]
    return max([BY_CHANCE, *chances])


def _turned(records: Sequence[Record], name: str) -> str:
    """Scale and offset that turn a command round about its neutral."""
    if kind_of(name) != "pwm":
        return "scale: -1"
    neutral = neutral_of(records, name)
    return f"scale: -1, offset: {2.0 * (1500.0 if neutral is None else neutral):g}"


def _likely_reversed(likely: _Answers) -> Finding | None:
    """The warning that thrusters are likely reversed; None where only a turn speaks for it, which may be the side."""
    turned = likely.turned
    if not turned:
        return None
    are, names = "are" if len(turned) > 1 else "is", listing([called(likely.records, name) for name in turned])
    return About("direction", turned).warning(
        f"{names} {are} likely reversed ({likely.sure}): more of that command pushes astern, as the motion is "
        "explained best",
        consequence="a model is pushed one way where the boat is pushed the other; no thrust can be fitted",
        remedy=_to_try(likely),
        short=f"{listing(turned)} {are} likely reversed",
    )


def _likely_swapped(likely: _Answers) -> Finding | None:
    """The warning that sides are likely swapped; None where that is not so."""
    moved = _surely_swapped(likely)
    if not moved:
        return None
    short = "port and starboard are likely swapped"
    return About("sides", moved).warning(
        f"{short} ({likely.sure})",
        consequence="every turn is predicted to the wrong side",
        remedy=_to_try(likely),
        short=short,
    )


def _surely_swapped(likely: _Answers) -> tuple[str, ...]:
    """The commands that are swapped, where the side of all is told."""
    return tuple(sorted(likely.swapped)) if all(answer.side for answer in likely.answers.values()) else ()


def _to_try(likely: _Answers) -> str:
    names, moved = likely.turned, _surely_swapped(likely)
    lines, what = likely.map_lines((*names, *moved), moved), "curve, the angle or the place"
    return f"try it in a channel map: {lines}{likely.or_vehicle((*names, *moved), what)}"


SIDES = Check("sides", _examine)
