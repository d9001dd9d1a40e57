"""What a hull diary tells of a fleet, as its file and its page have it."""

from typing import ClassVar

from ..physics.cards import Card, each
from ..physics.file_records import Flag, Number, Record, Whole
from ..physics.worded import Worded


class Cause(Worded):
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
        told = [
            f"{one.boat}: {' or '.join(c.value for c in change.causes)}, {change.first}"
            for one in self.changed
            for change in one.changes
        ]
        return [("fleet", self.fleet), ("boats", str(len(self.boats))), *each("changes", told)]
