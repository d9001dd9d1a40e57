"""Facts and words for hulls that change: the diary of a fleet, and a boat that is followed while its log grows."""

from collections.abc import Mapping, Sequence
from typing import ClassVar

from ..discovery.calibration.change_watch import Alarm
from ..discovery.calibration.following import Update
from ..measurements.statistics.blocks import CI
from ..physics.file_records import DescribedEnum, Flag, Number, Record, Whole
from ..physics.presentation import (
    MINUS,
    NARROW,
    Card,
    counted,
    each,
    listing,
    number,
    percent,
    sentence_case,
    unit_text,
)
from ..physics.reading import Plain


class Cause(DescribedEnum):
    """What happened to a hull; `sentence` says how that shows."""

    FOULING = "fouling", "the drag of the hull grows over weeks, as weed and barnacles make it"
    PROPELLER = "propeller damage", "one thruster pushes less from one day on, as with a blade lost or a line caught"
    PAYLOAD = "payload", "the mass changes at once, and the drag with it, as with another load"
    BATTERY = "battery", "all thrusters push less alike, or more again, as with a battery that is low, then charged"
    CLEANING = "cleaning", "the drag of the hull falls at once, as after a cleaning"
    UNNAMED = "a change without a name", "parameters change as none of the named causes changes them"


class Band(Record):
    """A value with its 95 % interval; all null where nothing is known."""

    value: Number = float("nan")
    low: Number = float("nan")
    high: Number = float("nan")


class Moved(Record):
    """How far a parameter moved with a change, in shares of its nominal value, and what it describes."""

    parameter: str
    part: str
    share: Band


class ChangeRecord(Record):
    """One change of one boat.

    Attributes
    ----------
    causes : what explains it; several where they explain it alike
    thrusters : parameters of the thrusters that the causes concern
    alarm : day after whose logs it was known
    first, earliest, latest : the most likely first logged day with the change, and the 95 % interval of that day
    goes_on : True where it grows from day to day, over `days` until the next change or the last log
    moved : every parameter, in that time where it goes on
    """

    causes: tuple[Cause, ...]
    thrusters: tuple[str, ...] = ()
    alarm: str
    first: str
    earliest: str
    latest: str
    goes_on: Flag = False
    days: Number = 0.0
    moved: tuple[Moved, ...] = ()


class OddDayRecord(Record):
    """A day on which a boat was another for once, as the day after shows, and the parameter that tells it best."""

    day: str
    moved: Moved


class DiaryRow(Record):
    """A day of logs: what they say of one parameter, with the scatter of days in the interval, in its unit."""

    day: str
    seen: Band


class BoatParameter(Record):
    """One parameter of one boat, in its unit: a row a day, and the value since its last change.

    `own` is by the boat's own logs and by the fleet; `differs` says that the boat is not as the others are.
    """

    name: str
    own: Band = Band()
    differs: Flag = False
    rows: tuple[DiaryRow, ...] = ()


class Visible(Record):
    """The least change at once, as a share, that a week of logged days would have shown."""

    part: str
    share: Number


class BoatRecord(Record):
    """What the diary tells of a boat."""

    boat: str
    logs: Whole
    days: Whole
    hours: Number
    first: str
    last: str
    changes: tuple[ChangeRecord, ...] = ()
    odd_days: tuple[OddDayRecord, ...] = ()
    visible: tuple[Visible, ...] = ()
    parameters: tuple[BoatParameter, ...] = ()


class FleetParameter(Record):
    """A parameter over the fleet, in its unit: the mean of boats, and the deviation of boats about it."""

    name: str
    unit: str = ""
    nominal: Number
    mean: Band = Band()
    spread: Band = Band()


class DiaryFacts(Card, Record):
    """The hull diary of a fleet.

    Attributes
    ----------
    budget : false alarms that are expected at most, a boat and year, over all parameters together
    widening : by which the covariance of the days' scatter was taken wider, so that rehearsals kept the budget
    parameters : over the fleet
    boats : by name
    missing : logs that were given to the fleet and are not in it
    """

    SCHEMA: ClassVar[str] = "undertow.diary/1"

    fleet: str
    budget: Number
    widening: Number
    parameters: tuple[FleetParameter, ...]
    boats: tuple[BoatRecord, ...]
    missing: tuple[str, ...] = ()

    @property
    def changed(self) -> tuple[BoatRecord, ...]:
        """The boats of which a change is told."""
        return tuple(boat for boat in self.boats if boat.changes)

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        texts = [
            f"{one.boat}: {' or '.join(c.value for c in change.causes)}, {change.first}"
            for one in self.changed
            for change in one.changes
        ]
        return [("fleet", self.fleet), ("boats", str(len(self.boats))), *each("changes", texts)]


PART = {Cause.FOULING: "drag ahead", Cause.CLEANING: "drag ahead", Cause.PAYLOAD: "mass", Cause.BATTERY: "thrust"}
"""The part of a boat of which a cause is told."""
PLAIN = {"X_u": "linear drag ahead", "X_uu": "quadratic drag ahead", "Y_v": "linear drag in sway"} | {
    "Y_vv": "quadratic drag in sway", "N_r": "linear drag in yaw", "N_rr": "quadratic drag in yaw", "mass": "mass"
}  # fmt: skip


def plain(parameter: str) -> str:
    """A parameter in words.

    Examples
    --------
    >>> plain("thrusters.port.scale"), plain("X_uu"), plain("Y_vdot")
    ('thrust of port', 'quadratic drag ahead', 'Y_vdot')
    """
    if parameter.startswith("net_"):
        return f"the network's force in {parameter.removeprefix('net_')}"
    if parameter.endswith("scale"):
        name = parameter.removesuffix("scale").strip("._").removeprefix("thrusters.")
        return f"thrust of {name}" if name else "thrust"
    return PLAIN.get(parameter, parameter)


def causes_words(change: ChangeRecord) -> str:
    """The causes of a change, with their thrusters; several where they explain it alike."""
    return " or ".join(
        f"{cause.value} ({listing([plain(t).removeprefix('thrust of ') for t in change.thrusters])})"
        if cause is Cause.PROPELLER and change.thrusters
        else cause.value
        for cause in change.causes
    )


def telling(change: ChangeRecord) -> Moved:
    """The parameter that tells a change best: of the part that its first cause concerns, else of all."""
    cause = change.causes[0]
    meant = [m for m in change.moved if m.part == PART.get(cause)]
    if cause is Cause.PROPELLER:
        meant = [m for m in change.moved if m.parameter in change.thrusters]
    return max(meant or change.moved, key=lambda m: abs(m.share.value) / max(m.share.high - m.share.low, 1e-12))


def change_sentence(change: ChangeRecord) -> str:
    """What changed, by how much, when, and how sure that is."""
    what, size, more, span = _sized(telling(change))
    span_of_days = f" ({change.earliest} to {change.latest})" if change.earliest != change.latest else ""
    first = f"{change.first}{span_of_days}"
    known = f"known on {change.alarm}"
    if change.goes_on:
        went = f"{'grew' if more == 'more' else 'fell'} to {size} {more} ({span})"
        text = f"{what} {went} in {round(change.days)} days, from about {first} on; {known}"
    else:
        text = f"{what} {size} {more} ({span}) from {first} on; {known}"
    both = " The logs do not tell these apart." if len(change.causes) > 1 else ""
    return f"{text[0].upper()}{text[1:]}.{both}"


def _sized(moved: Moved) -> tuple[str, str, str, str]:
    """A parameter, how far it moved, whether that is more or less, and from where to where it may be."""
    share = moved.share
    ends = (share.low, share.high) if share.value > 0.0 else (-share.high, -share.low)
    low, high = (number(100.0 * end, 2) for end in ends)
    if low == high:
        low, high = (number(100.0 * end, 3) for end in ends)
    span = f"{low} to {high}{NARROW}%"
    return plain(moved.parameter), _percent(abs(share.value)), "more" if share.value > 0.0 else "less", span


def _percent(share: float, minus: str = "-") -> str:
    """A change as a whole percentage: a drag that doubles is 100 % more, which `percent` does not say of a share."""
    return percent(round(share, 2) or share, minus=minus)


def odd_sentence(boat: BoatRecord) -> str:
    """The days on which a boat was another for once; empty where there are none."""
    told = []
    for odd in boat.odd_days:
        what, size, more, _ = _sized(odd.moved)
        told.append(f"On {odd.day} alone, {what} was {size} {more}.")
    return " ".join(told)


def unchanged_sentence(boat: BoatRecord) -> str:
    """That nothing changed, and what a week of logs would have shown."""
    days = "only day" if boat.days == 1 else f"{boat.days} days"
    seen = [f"{v.part} by {_percent(v.share)}" for v in boat.visible]
    if not seen:
        return f"Nothing changed on the {days} that it logged; that is too little to say what would have shown."
    return f"Nothing changed on the {days} that it logged; a week would have shown a change of {listing(seen)}."


def differs_sentence(boat: BoatRecord) -> str:
    """In what a boat is not as the others; empty where it is."""
    names = [plain(one.name) for one in boat.parameters if one.differs]
    return f"It differs from the other boats in {listing(names)}." if names else ""


def boat_sentences(boat: BoatRecord) -> str:
    """All that the diary says of a boat, in a line."""
    told = [f"{sentence_case(causes_words(c))}. {change_sentence(c)}" for c in boat.changes]
    return " ".join(filter(None, [*(told or [unchanged_sentence(boat)]), odd_sentence(boat), differs_sentence(boat)]))


def verdict(diary: DiaryFacts) -> str:
    """What the diary says of the fleet, in a sentence."""
    count, boats = len(diary.changed), len(diary.boats)
    whole = "One boat" if boats == 1 else f"{boats} boats"
    if not count:
        return f"{whole}, and nothing changed."
    return f"{count} of {whole.lower()} changed." if boats > 1 else "The boat changed."


def caution(diary: DiaryFacts) -> str:
    """Under which budget alarms were raised, how scatter was taken, and which logs say nothing."""
    wider = "" if diary.widening == 1.0 else (
        f" Its variance is taken {number(diary.widening, 2)} times larger, as rehearsals with it asked for."
    )  # fmt: skip
    count = len(diary.missing)
    lacks = "" if not count else (
        f" {counted(count, 'log')} given to this fleet {'is' if count == 1 else 'are'} not in it: "
        "its fleet.json says why."
    )  # fmt: skip
    return (
        f"Alarms are set for at most {diary.budget:g} false a boat and year, over all parameters together, with the "
        f"scatter that this fleet's days have.{wider} Intervals are at 95{NARROW}%.{lacks}"
    )


def signed(share: float) -> str:
    """A share with its sign, as a percentage.

    Examples
    --------
    >>> signed(0.31), signed(-0.31)
    ('+31\N{NO-BREAK SPACE}%', '−31\N{NO-BREAK SPACE}%')
    """
    return f"{'+' if share > 0 else ''}{_percent(share, MINUS)}"


def in_telling_order(boats: Sequence[BoatRecord]) -> list[BoatRecord]:
    """Boats with changes first, the latest on top; then the others by name."""
    changed = sorted((b for b in boats if b.changes), key=lambda b: b.changes[-1].alarm, reverse=True)
    return [*changed, *(b for b in boats if not b.changes)]


_WIDE, _TIME = 13, 9
"""Widths of a column and of the time: a value of three digits and its interval of two, eight of them in 120 columns."""


def heading(symbols: Sequence[str], units: Sequence[str]) -> tuple[str, str]:
    """The lines above the rows: what is followed, and its units."""
    told = [unit_text(unit) for unit in units[: len(symbols)]]
    return f"{'t':>{_TIME}}" + _cells(symbols), f"{'s':>{_TIME}}" + _cells(told)


def row(update: Update, count: int) -> str:
    """The first `count` values of an update, each with half of its 95 % interval; a mark where the row told nothing."""
    pairs = zip(update.values[:count].tolist(), update.deviation[:count].tolist(), strict=True)
    cells = _cells([f"{number(value)}±{number(CI * wide, 2)}" for value, wide in pairs])
    return f"{update.time:>{_TIME}.1f}{cells}" + ("" if update.excited else "  at rest")


_FAR = 0.25
"""Share of what the file says from which a number is far from it, beyond its interval: twice what files are off by in
`benchmarks/following.py`, and more."""


def far_from_start(update: Update, start: Mapping[str, float]) -> str:
    """The numbers that are far from where they began, each with what that was; empty where none is.

    Parameters
    ----------
    update : the last one
    start : the numbers that are watched, which come first, with their values in the file
    """
    rows = zip(start.items(), update.values.tolist(), update.deviation.tolist(), strict=False)
    far = [
        f"{symbol} {number(value)} (file: {number(began)})"
        for (symbol, began), value, wide in rows
        if abs(value - began) > max(CI * wide, _FAR * abs(began))
    ]
    return listing(far)


def _cells(texts: Sequence[str]) -> str:
    return "".join(f" {text:>{_WIDE - 1}}" for text in texts)


def alarm_sentence(alarm: Alarm, unit: str) -> str:
    """Which parameter changed, since when, by how much, and what else may have been it."""
    unit = f" {unit_text(unit)}".rstrip()
    when = f"t = {alarm.since:.1f} s"
    if alarm.earliest < alarm.latest:
        when += f" ({alarm.earliest:.1f} to {alarm.latest:.1f} s)"
    text = (
        f"{plain(alarm.symbol)} ({alarm.symbol}) went from {number(alarm.before)} to {number(alarm.after)}{unit} "
        f"(± {number(alarm.half, 2)}), since {when}; known at t = {alarm.time:.1f} s"
    )
    if alarm.alike:
        others = listing([f"{plain(symbol)} ({symbol})" for symbol in alarm.alike])
        text += f". The rows so far tell no less of {others}"
    return f"{text}."


def table_row(update: Update) -> str:
    """A row of the CSV of values: time, then value and ends of the 95 % interval of each, and whether it counted."""
    pairs = zip(update.values.tolist(), update.deviation.tolist(), strict=True)
    cells = [f"{x:.9g},{x - CI * d:.9g},{x + CI * d:.9g}" for x, d in pairs]
    return ",".join([f"{update.time:.3f}", *cells, str(int(update.excited))])


def table_heading(symbols: Sequence[str]) -> str:
    """The header of that CSV."""
    return ",".join(["t", *(f"{s},{s}_low,{s}_high" for s in symbols), "excited"])


def followed_row(update: Update, symbols: tuple[str, ...]) -> Plain:
    """A line of the output: time in the log [s], whether the row told something, values by symbol, and an alarm."""
    pairs = zip(symbols, update.values.tolist(), (CI * update.deviation).tolist(), strict=True)
    return {
        "schema": "undertow.following/1",
        "time": update.time,
        "excited": bool(update.excited),
        "values": {symbol: {"value": x, "ci95": [x - half, x + half]} for symbol, x, half in pairs},
        "alarm": None if update.alarm is None else _told(update.alarm),
    }


def _told(alarm: Alarm) -> Plain:
    """A change that was noticed, under the names of the output."""
    told: Plain = {"parameter": alarm.symbol, "alike": list(alarm.alike), "known": alarm.time, "since": alarm.since}
    told["between"] = [alarm.earliest, alarm.latest]
    return told | {"before": alarm.before, "after": alarm.after, "half_width": alarm.half}
