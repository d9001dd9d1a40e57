"""Facts of the workbench: arrays, numbers and sentences that any process may hold."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ..physics.motion import Array

if TYPE_CHECKING:
    from ..comparison.facts import Comparison
    from ..discovery.findings import Findings
    from ..residuals.models.band_record import PredictionBand
    from ..residuals.series import HeldPredictions

OWN_NUMBERS = "own numbers"
"""Among the names of effects: the numbers that the vehicle file has, fitted to the log beside what is added."""


@dataclass(frozen=True, slots=True)
class ModelChoice:
    """A model as a person wants it.

    Attributes
    ----------
    names : of the effects in it, in order
    moved : numbers that were moved by hand
    left : corrections of the sensors that the log is read without, in the order of the alphabet
    """

    names: tuple[str, ...] = ()
    moved: tuple[tuple[str, float], ...] = ()
    left: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Check:
    """Result of a check of the log: "note", "warning", "defect" or "cannot tell", what it means and what to do."""

    verdict: str
    sentence: str
    consequence: str = ""
    remedy: str = ""
    mends: str = ""


@dataclass(frozen=True, slots=True)
class Value:
    """A number of a model: what it is, before and after, its 95 % interval, and how far it may be moved."""

    symbol: str
    what: str
    unit: str
    before: float
    after: float
    ci95: tuple[float, float] | None
    low: float
    high: float


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A model as the workbench shows it.

    Attributes
    ----------
    names : of the effects in it, in order
    error : root mean square errors of predictions over `horizon` seconds: position [m], surge, sway [m/s], yaw [rad/s]
    lost : how many of these predictions run away
    columns : what it predicts, by row of the table: u, v, r, north, east, and the force X, Y, N that it leaves
    values : what differs from the nominal model
    verdict, law : whether it takes energy out of the hull everywhere, in a word and in a sentence
    unseen : every row is predicted by a model that was fitted without it
    acceleration : root mean square errors from row to row by axis [m/s^2, rad/s^2]; of another log alone
    band : 95 % band of its predictions, from rows that it did not see, whose ends are columns, too: u_low, u_high ...;
        None of the nominal model, of one that was moved by hand, and where the log is too short
    held : the predictions of another log that end within it
    """

    names: tuple[str, ...]
    error: Mapping[str, float]
    lost: int
    columns: Mapping[str, Array]
    values: tuple[Value, ...] = ()
    verdict: str = ""
    law: str = ""
    unseen: bool = True
    acceleration: Mapping[str, float] = field(default_factory=dict)
    band: "PredictionBand | None" = None
    held: "HeldPredictions | None" = None


@dataclass(frozen=True, slots=True, eq=False)
class Opened:
    """A log that was read for a vehicle.

    Attributes
    ----------
    log, vehicle : their names
    seconds : length of what is judged [s]
    warnings, notes : sentences on the log
    checks : what every check found, worst first
    table : measured columns by row, 10 Hz: time [s] on one axis for all logs, rows of NaN where the record breaks, and
        1 in "anew" where predictions begin from the measurement
    commands : names of the command columns
    horizon : seconds that a prediction is judged on
    nominal : the model as its file has it
    logs : of several logs the name of each, and where it begins and ends on the axis of time [s]; none for one
    doubt : what of the thrusters' sides and directions the log does not show, in words; empty where it shows them
    assumed : numbers of the vehicle that nobody measured or gave
    judged : of another log than the one that models are fitted to, which rows judge, and whether a fit saw them
    """

    log: str
    vehicle: str
    seconds: float
    warnings: tuple[str, ...]
    notes: tuple[str, ...]
    checks: tuple[Check, ...]
    table: Mapping[str, Array]
    commands: tuple[str, ...]
    horizon: float
    nominal: Fit
    logs: "tuple[Span, ...]" = ()
    doubt: str = ""
    assumed: "tuple[Assumed, ...]" = ()
    judged: str = ""


@dataclass(frozen=True, slots=True)
class Assumed:
    """A number that nobody measured or gave: in words, its symbols, and how sure its source says that it is."""

    what: str
    symbols: tuple[str, ...]
    sure: str = ""


@dataclass(frozen=True, slots=True)
class Span:
    """A log on the common axis of time: its name, begin and end [s]."""

    name: str
    begin: float
    end: float


@dataclass(frozen=True, slots=True)
class Card:
    """An effect that may be missing, or something that the sensors do wrong.

    Attributes
    ----------
    name : as `add` takes it; of a sensor that of its correction, empty where none was made
    title, equation, sentence : the effect, its force, and the finding, in words
    verdict : "missing", "likely", "possible" or "no evidence", of a sensor "present" or "possible", of what
        was added by name "betters unseen rows", "worse on unseen rows" or "cannot tell"
    numbers : its values with intervals, as a corrected file has them; of a number of the file, what that says
    twins : what would explain the log as well
    tell : the manoeuvre that would tell
    picture : drawing of the missing force over the effect's signal, SVG; empty where there is none
    odds : how sure the name is, such as "87 %"; empty where nobody knows
    """

    name: str
    title: str
    equation: str
    sentence: str
    verdict: str
    numbers: tuple[str, ...] = ()
    twins: tuple[str, ...] = ()
    tell: str = ""
    picture: str = ""
    odds: str = ""


@dataclass(frozen=True, slots=True)
class Searched:
    """Result of a search for what is missing.

    Attributes
    ----------
    verdict : "missing", "likely", "nothing missing" or "undecided"
    headline : the same in a sentence
    told : what it does to the error, and which model to trust; of an open verdict, the three lines of its answer
    title : over the cards, such as "What is missing"
    sure : what the odds of a card are, in a phrase
    found : names of what was found, in order
    cards : effects, the most valuable first
    sensors : what the sensors and their record do wrong
    advice : what to drive, and what it would tell
    rivals : all models on the same rows: nominal, calibrated, corrected, and motion that goes on as it is
    hidden : errors of the sensors of which only forces tell, and for which the motion was corrected, so that what was
        opened is another: where places and speeds are measured, ahead and to starboard [m], what a heading lacks [rad]
    refits : the model's own numbers were fitted in all that was searched
    findings : of the search, with the models of its steps; None where nobody kept them
    comparison : of its models; None where nobody kept it
    """

    verdict: str
    headline: str
    told: tuple[str, ...]
    found: tuple[str, ...]
    cards: tuple[Card, ...]
    sensors: tuple[Card, ...] = ()
    advice: tuple[tuple[str, str], ...] = ()
    rivals: "tuple[Rival, ...]" = ()
    hidden: tuple[float, float, float] | None = None
    title: str = "What is missing"
    sure: str = ""
    refits: bool = False
    findings: "Findings | None" = None
    comparison: "Comparison | None" = None


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """A prediction from a row on: time [s], and the way measured and of two models, (n, 2) north, east [m]."""

    time: Array
    measured: Array
    before: Array
    after: Array


@dataclass(frozen=True, slots=True)
class Place:
    """Place of a thruster: its name, x ahead and y to starboard [m], and its angle [rad], 0 where it pushes ahead."""

    name: str
    x: float
    y: float
    angle: float


@dataclass(frozen=True, slots=True)
class Wire:
    """Drive of a thruster: its own channel, that of the command by which it is driven, and that turned round."""

    channel: str
    by: str
    turned: bool = False


@dataclass(frozen=True, slots=True)
class HullDiary:
    """The hull diary of a fleet: its name, the top of its page as HTML, and the file of the page."""

    fleet: str
    glance: str
    page: str


@dataclass(frozen=True, slots=True)
class Source:
    """Files that are to be opened.

    Attributes
    ----------
    logs : paths; none for the demo
    vehicle : path or shipped name; empty for one made of the log
    hull : what is known of the boat where the vehicle is made: length [m], mass [kg], spacing [m], thrust [N]
    like : shipped vehicle whose hull is taken where one is made
    changed : numbers of the vehicle that the user has put right, by symbol
    places, wires : thrusters that the user has put right: where they are, and what drives them
    channel_map : path of one; empty for none
    frame : "enu", "ned", or empty for what the log says
    as_is : take a log that is known to be broken as it is
    original : of a log that was repaired, what it was before
    """

    logs: tuple[str, ...] = ()
    vehicle: str = ""
    hull: tuple[tuple[str, float], ...] = ()
    like: str = ""
    changed: tuple[tuple[str, float], ...] = ()
    places: tuple[Place, ...] = ()
    wires: tuple[Wire, ...] = ()
    channel_map: str = ""
    frame: str = ""
    as_is: bool = False
    original: "Source | None" = None


@dataclass(frozen=True, slots=True)
class Field:
    """A number of the vehicle file: its symbol, meaning, unit, value, and what the file says of where it is from."""

    symbol: str
    what: str
    unit: str
    value: float
    source: str


@dataclass(frozen=True, slots=True)
class Form:
    """The vehicle as a form: its numbers, its thrusters, and what drives each of them, in the same order."""

    numbers: tuple[Field, ...]
    places: tuple[Place, ...]
    wires: tuple[Wire, ...]


@dataclass(frozen=True, slots=True)
class Rival:
    """A model beside others on the same rows.

    Attributes
    ----------
    name : of the model
    horizon : seconds that a prediction is judged on
    error : of predictions, as `Fit` has it; None where the log is too short
    acceleration : root mean square errors by axis [m/s^2, rad/s^2]
    broken : laws that it breaks
    asked : whether laws were asked; they are not of motion that goes on as it is
    """

    name: str
    horizon: float
    error: Mapping[str, float | None]
    acceleration: Mapping[str, float]
    broken: tuple[str, ...]
    asked: bool = True


@dataclass(frozen=True, slots=True)
class Trained:
    """A trained network: what to think of it, and it beside the model that it corrects, which is that of a stand."""

    told: str
    rivals: tuple[Rival, ...]
    stand: ModelChoice
