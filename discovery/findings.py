"""Findings: which effects are missing, how sure that is, and what each is worth, as `findings.json` holds them."""

import re
from collections.abc import Mapping, Sequence
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import BeforeValidator, Field, WrapSerializer, computed_field

from ..physics.effects import COMMAND_OFFSET, canonical
from ..physics.file_records import Flag, Number, Record, Whole, absent
from ..physics.momentum_balance import HYDRODYNAMIC
from ..physics.motion import AXES
from ..physics.presentation import Card, each, from_above, listing, number, percent, unit_text, words
from ..residuals.scores import ByAxis, RolloutRecord, Rollouts
from .effect_findings import EffectFinding, FittedTerm, Folds, rounded_probability
from .identifiability.rehearsal import Identifiability
from .lawful.laws_over import Passivity
from .search.estimation import Interval

if TYPE_CHECKING:
    from ..reports.page.figures.record_plots import FindingsPlots

_IN_PLAY = 3
"""Effects, and terms without a name, of which a card shows numbers though none is sure: a line, not a table, and no
number that decides."""
_WHERE = ("from ", "being ")
"""How a form begins that is constant from a minute on, or in a place."""
NOTHING = 1e-8
"""Rounding of the force at work on an axis that nobody looked at: `search.scoring` puts 1e-9 in the place of none."""
_EMPTY = (
    BeforeValidator(lambda content: content or None),
    WrapSerializer(lambda value, handler: handler(value) or {}),
)
"""What was not asked is an empty object in the file."""


WATER = "water_of_logs"
"""Name of the correction for the currents of several logs: each is judged in its own water."""


class SensorError(Record):
    """An error of a sensor, or of the log's record of one: the vehicle stays as it is.

    Attributes
    ----------
    error : "channel_offset" for commands, speeds or positions that are recorded early or late; the others say what
        they are of: a scale, a bias, a compass deviation, a record through the water, an antenna that is elsewhere
    verdict : "present", "possible" or "no evidence"
    sentence : the finding in words
    confidence : probability that the sensor errs so, in worlds like those of the studies; None where nobody asked
    terms : its numbers
    correction : name of the correction that was made for it, which `Inputs.leaving`, `HiddenErrors.keeping` or
        `Basis.keeping_errors` does without; empty where none was made
    """

    error: Literal[
        "compass_deviation",
        "gyro_scale",
        "gyro_bias",
        "velocity_scale",
        "velocity_latency",
        "antenna_arm",
        "water_speed",
        "channel_offset",
    ]
    verdict: Literal["present", "possible", "no evidence"]
    sentence: str = ""
    confidence: Number | None = absent()
    terms: tuple[FittedTerm, ...] = ()
    correction: str = Field(default="", exclude_if=lambda value: not value)

    @property
    def what(self) -> str:
        """The error, or, of an offset, its number's name: commands, positions and the gyro have one each."""
        return self.terms[0].symbol if self.error == "channel_offset" and self.terms else self.error


class Calibrated(Record):
    """One parameter before and after.

    Attributes
    ----------
    symbol, unit : name and SI unit
    before, after : values
    wanted : what the log alone asks for; differs from `after` where the law of dissipation holds the parameter
    ci95 : 95 % interval about `wanted`, cut at the physical limits; None for a parameter that moves in steps, or that
        the log alone puts at a limit
    at_limit : True where it does
    """

    symbol: str
    before: Number
    after: Number
    wanted: Number
    unit: str
    ci95: Interval | None = None
    at_limit: Flag = False

    @computed_field
    @property
    def held_by_law(self) -> bool:
        """True when the law holds the parameter outside its interval, or, without one, by over 1 %."""
        if self.ci95 is None:
            return not self.at_limit and abs(self.after - self.wanted) > 0.01 * abs(self.wanted)
        return not self.ci95.lower <= self.after <= self.ci95.upper


class NotCalibrated(Record):
    """A parameter that was to be calibrated and stays as it was, and why."""

    symbol: str
    why: str


BY_OTHER_MEANS = "measure one of the look-alikes by other means, and give its value in the vehicle file"
"""What is advised where no manoeuvre would tell."""


class Advice(Record):
    """A manoeuvre that would tell what a log cannot, what it would tell, and the effects of the first such question."""

    manoeuvre: str
    why: str = ""
    effects: tuple[str, ...] = ()


class Rise(Record):
    """An error on held-out data that is larger with something than without it, by more than chance [`unit`].

    `horizon` is that of predictions [s]; None of the acceleration.
    """

    horizon: str | None = None
    axis: str
    before: Number
    after: Number
    unit: str = ""

    @property
    def in_words(self) -> str:
        """The error and its two values, as a part of a sentence."""
        what = "acceleration error" if self.horizon is None else f"error of {self.horizon} s predictions"
        digits = next((n for n in (2, 3, 4) if number(self.before, n) != number(self.after, n)), 4)
        ends = f"from {number(self.before, digits)} to {number(self.after, digits)} {unit_text(self.unit)}"
        return f"the {self.axis} {what} rises {ends}"


class Step(Record):
    """Errors on held-out data after something was added.

    Attributes
    ----------
    added : the effect, or the term; "calibrated" for the calibration; None for the nominal model
    thruster : the one that the effect concerns; None for an effect of all
    acceleration_rmse : root mean square error of the acceleration
    rollout_rmse : of open-loop predictions, by horizon [s]
    rises : which of them are larger than in the step before, by more than chance
    values : what the model after it has in the place of the nominal model's numbers, by symbol
    unseen : the same of the models that were fitted without each fold, in their order
    """

    added: str | None = None
    thruster: str | None = absent()
    acceleration_rmse: ByAxis
    rollout_rmse: Rollouts
    units: Mapping[str, Mapping[str, str]] = {}
    rises: tuple[Rise, ...] = Field(default=(), exclude_if=lambda value: not value)
    values: Mapping[str, Number] = Field(default={}, exclude_if=lambda value: not value)
    unseen: tuple[Mapping[str, Number], ...] = Field(default=(), exclude_if=lambda value: not value)

    def rollout(self, horizon: str) -> RolloutRecord:
        """The errors of one horizon; all NaN where there is none."""
        return self.rollout_rmse.get(horizon) or RolloutRecord()


class Removal(Record):
    """An effect that removes the error of a place, and the share of the squared error there that it removes."""

    effect: str
    share_removed: Number
    sentence: str = ""


class FailingPlace(Record):
    """A place in a log where a model's error gathers.

    Attributes
    ----------
    model : whose error
    where : the place in words
    axis : of the error
    share_of_error, share_of_rows : of the squared error on the axis, and of the rows, that lie there
    rmse : root mean square error there [`unit`]
    rows_of : the part of the log that was looked at
    rmse_after : the same of the corrected model, where that was asked
    removed_by : effects that remove the error
    unlinked : why none is named, although it falls
    """

    model: str = "nominal"
    where: str = ""
    axis: str = ""
    share_of_error: Number
    share_of_rows: Number | None = absent()
    rows: Whole | None = absent()
    rmse: Number | None = absent()
    unit: str = ""
    rows_of: str | None = absent()
    rmse_after: Number | None = absent()
    removed_by: tuple[Removal, ...] = ()
    unlinked: str | None = absent()


class Criterion(Record):
    """The demands on an effect, and the force at work on each axis [`unit`], of which shares are taken."""

    materiality: Number | None = None
    certainty: str = ""
    material: str = ""
    unit: Mapping[str, str] = {}
    force_scale: Mapping[str, Number] = {}
    search: str = ""

    @property
    def unjudged(self) -> tuple[str, ...]:
        """Axes whose velocity may be wrong, so that no force was judged there."""
        return tuple(axis for axis, scale in self.force_scale.items() if scale <= NOTHING)


class Unexplained(Record):
    """Force that the corrected model leaves on an axis, beside what sensor noise alone would leave [`unit`]."""

    force: Number
    noise: Number
    unit: str


class PersistentResidual(Record):
    """Force on an axis that lasts for seconds, is material, and that nothing explains.

    Attributes
    ----------
    axis : its name
    force : root mean square of its means over 5 s [`unit`]
    share : the same as a share of the force at work
    unit : of the force
    """

    axis: str
    force: Number
    share: Number
    unit: str

    @property
    def in_words(self) -> str:
        """The finding, as a part of a sentence."""
        force = f"{number(self.force, 2)} {self.unit} of the {self.axis} force"
        share = f"at work, {100.0 * self.share:.0f} % of it"
        if self.share > 1.0:
            share = f"that is measured, {number(self.share, 2)} times what is at work in the model"
        return f"{force} {share}, last for seconds and are explained by no effect that was looked for"


_SIDE = re.compile(r"(.*?) ?((?:north|east)\w* of -?[\d.]+ m)")
"""What a force follows that is another one on one side of a line on the water, and the side."""


class NamelessForce(Record):
    """A force on an axis, and what it follows.

    Attributes
    ----------
    axis : its name
    follows : the signals, as the end of "a force that follows"; nothing for a constant one
    """

    axis: str
    follows: str

    @property
    def kind(self) -> str:
        """Force or moment."""
        return "moment" if self.axis == "yaw" else "force"

    @property
    def acts(self) -> str:
        """What it does, as the end of a sentence about it."""
        if not self.follows:
            return "is constant"
        if self.follows.startswith(_WHERE):
            return f"is there {self.follows.removeprefix('being ')}"
        # What the model has of it elsewhere may be as wrong: that the sides differ is known, not which one is right.
        found = _SIDE.fullmatch(self.follows)
        return f"follows {found[1]} differently {found[2]} than elsewhere" if found else f"follows {self.follows}"

    @property
    def in_words(self) -> str:
        """The force, as a part of a sentence."""
        return f"a {self.kind} in {self.axis} that {self.acts}"

    @property
    def sets_in(self) -> tuple[str, str] | None:
        """The signal that it follows from some time on, empty for none, and when, such as "minute 3.0"; else None."""
        found = re.fullmatch(r"(.*?) ?from (minute [\d.]+(?: of .+)?|log .+) on", self.follows)
        return (found[1], found[2]) if found else None

    @property
    def local(self) -> bool:
        """True of a force that acts on one side of a line on the water."""
        return bool(_SIDE.fullmatch(self.follows))

    @property
    def of_state(self) -> bool:
        """True of a force that follows speeds and thrusts alone, so that a network could learn it."""
        return not (self.local or self.sets_in or re.search(r"the (time|place)|heading|from (log|part)", self.follows))


class BoatChange(Record):
    """An effect that has another size from some instant of the logs on.

    Attributes
    ----------
    effect : the effect, with its thruster where it concerns one
    terms : by how much each of its numbers changes
    log, place, logs : the log in which it does, its place among them, from 0, and how many there are
    minute, minutes95 : when, with its 95 % interval [min]; None where it is where the log begins
    alike : effects that would change as well in its place
    since : True where the rows since then were searched, False where those before
    """

    effect: str
    terms: tuple[FittedTerm, ...]
    log: str
    place: Whole = 0
    logs: Whole = 1
    minute: Number | None = None
    minutes95: Interval | None = None
    alike: tuple[str, ...] = ()
    since: Flag = True

    @property
    def when(self) -> str:
        """The instant, such as "minute 2.04 of a.csv"."""
        name = Path(self.log).name
        if self.minute is None:
            return f"log {name}"
        return f"minute {self.minute:.2f}{f' of {name}' if self.logs > 1 else ''}"

    @property
    def what(self) -> str:
        """The effect, and those that would do as well, such as "thruster asymmetry of port"."""
        return listing([words(key) for key in (self.effect, *self.alike)], "or")

    @property
    def begins(self) -> str:
        """How a headline begins that goes on with a verdict on one part of the logs."""
        by = [f"{t.symbol} by {number(t.value, 2)} {unit_text(t.unit)}".strip() for t in self.terms]
        return (
            f"The boat changes at {self.when}: {self.what} ({listing(by)}). {'Since' if self.since else 'Before'} then:"
        )

    @property
    def in_words(self) -> str:
        """The finding in sentences, with what was done about it."""
        ends = self.minutes95 or Interval(0.0, 0.0)
        within = (
            f" (between {ends.lower:.2f} and {ends.upper:.2f})" if f"{ends.lower:.2f}" != f"{ends.upper:.2f}" else ""
        )
        sizes = listing([term.in_words.replace(" = ", " changes by ", 1) for term in self.terms])
        return (
            f"The boat changes at {self.when}{within}: {sizes} ({self.what}). One vehicle file holds one boat, "
            f"so all that follows is of the rows {'since' if self.since else 'before'} then."
        )


class OtherForm(NamelessForce):
    """Force on an axis that follows a signal, and that nothing which was selected explains, or explains as well.

    Attributes
    ----------
    axis, follows : as of any `NamelessForce`
    force : root mean square of what it explains beside the model [`unit`]
    share : the same as a share of the force at work
    unit : of the force
    """

    force: Number
    share: Number
    unit: str


def leading_force(
    terms: Sequence[tuple[str, str]], forms: Sequence[tuple[str, str, float]], lasting: Sequence[str], *, rollouts: bool
) -> NamelessForce | None:
    """The force without a name that an open verdict tells of: terms of the model, else what its rest follows.

    A law of the hull is none, nor is a trim. Where rollouts judge, waves and sensors that drift move sway and yaw about
    as much as forces do, and the rest of the force balance follows them: there a form must be in surge, or of a force
    that lasts. A product of speeds bends to what it happens to go along with, a thrust, a place, a time or a kink: one
    of these on its axis, half as large and more, is told first.

    Parameters
    ----------
    terms : axis and form of each term without a name, the best first
    forms : axis, form and share of the force at work of each force that the rest follows, the best first
    lasting : axes on which a force lasts that nothing explains, the largest first
    rollouts : whether these judge
    """
    laws = {(AXES[axis], canonical(form.factors)) for _, axis, form in HYDRODYNAMIC} | {(axis, "") for axis in AXES}
    seen = [one for one in forms if one[:2] not in laws and (not rollouts or one[0] in ("surge", *lasting))]
    if terms:
        axis, least = terms[0][0], 0.0
        follows = listing([form for where, form in terms if where == axis])
    elif seen:
        axis, follows, share = min(seen, key=lambda one: one[0] not in lasting[:1])
        least = 0.5 * share if _PRODUCT.fullmatch(follows) else inf
    else:
        return None
    plainer = [one for one in seen if one[0] == axis and one[2] >= least and not _PRODUCT.fullmatch(one[1])]
    best = max(plainer, key=lambda one: one[2], default=None)
    return NamelessForce(axis=axis, follows=follows if best is None else best[1])


_PRODUCT = re.compile(r"[uvr|^0-9.]+")
"""A product of speeds and their sizes, as forms are written."""


def comes_and_goes(passing: Mapping[str, float]) -> str:
    """What passes within seconds on the axis where most does, as a sentence; empty where nothing does."""
    if not passing:
        return ""
    axis, share = next(iter(passing.items()))
    many = percent(min(share, 1.0))
    return f"{many} of the force at work in {axis} comes and goes within seconds, as in waves and gusts."


class LogFacts(Record):
    """Facts of the log: rows, length [s], how it was split, what stays unexplained by axis, notes, and SHA-256."""

    rows: Whole | None = None
    seconds: Number | None = None
    split: str = ""
    unexplained: Mapping[str, Unexplained] = Field(default={}, exclude_if=lambda value: not value)
    notes: tuple[str, ...] = ()
    log_sha256: tuple[str, ...] = Field(default=(), exclude_if=lambda value: not value)


class Findings(Card, Record):
    """Conclusions of a discovery from a log.

    Attributes
    ----------
    verdict : "missing", "likely", "nothing missing" or "undecided"
    warnings : what is wrong with the log itself, to be read before the headline
    headline : the verdict in a sentence
    reasons : why, and what speaks against it, a sentence each
    missing, likely : names of effects of that verdict, the most valuable first
    candidates : every effect of the catalogue, best first
    unnamed : terms that nobody has named but the log asks for
    sensors : what the sensors and their record do wrong
    rests : force that lasts and that nothing explains, by axis, or to the north or east where none lasts on an axis
    change : an effect that has another size from some instant on; then all else is of one part of the logs
    winds : of several logs that ask for a wind each, its force to the north and east, the log as `form`
    passing : where rollouts judge, shares of the force at work that come and go within seconds, by axis, largest first
    other_forms : what the rest of the model follows; and last, of an undecided log, what explains more in the place of
        a doubtful effect
    nameless : the force without a name that an undecided log tells of before names, none of which is likely
    calibrated : parameters of the nominal model that were calibrated while effects were judged (`discover --refit`)
    left : others that were not
    absorbed : effects that cannot be judged beside the calibration, which would do the same
    steps : errors after each addition, on held-out data only
    folds : in how many parts of the log, each searched anew without it, the same names came out
    failures : where the nominal model fails
    advice : manoeuvres that would tell what this log cannot
    identifiability : what the log can show and tell apart; None where that was not asked
    criterion : what an effect had to satisfy
    passivity : whether the corrected model dissipates over the envelope of the log, and what that cost
    data : rows, seconds, split and notes
    """

    SCHEMA: ClassVar[str] = "undertow.findings/2"
    FORMER: ClassVar[tuple[str, ...]] = ("undertow.findings/1",)
    DRAWN_BY: ClassVar[str] = "reports.page.figures.record_plots:FindingsPlots"

    verdict: Literal["missing", "likely", "nothing missing", "undecided"]
    warnings: tuple[str, ...] = ()
    headline: str = ""
    reasons: tuple[str, ...] = ()
    missing: tuple[str, ...]
    likely: tuple[str, ...] = ()
    candidates: tuple[EffectFinding, ...]
    unnamed: tuple[FittedTerm, ...] = ()
    sensors: tuple[SensorError, ...] = ()
    rests: tuple[PersistentResidual, ...] = ()
    change: BoatChange | None = absent()
    winds: tuple[FittedTerm, ...] = Field(default=(), exclude_if=lambda value: not value)
    passing: Mapping[str, Number] = Field(default={}, exclude_if=lambda value: not value)
    other_forms: tuple[OtherForm, ...] = ()
    nameless: NamelessForce | None = absent()
    calibrated: tuple[Calibrated, ...] = ()
    left: tuple[NotCalibrated, ...] = ()
    absorbed: tuple[str, ...] = ()
    steps: tuple[Step, ...] = ()
    folds: Folds | None = absent()
    failures: tuple[FailingPlace, ...] = ()
    advice: tuple[Advice, ...] = ()
    identifiability: Annotated[Identifiability | None, *_EMPTY] = None
    criterion: Criterion = Criterion()
    passivity: Annotated[Passivity | None, *_EMPTY] = None
    data: LogFacts = LogFacts()

    @property
    def added(self) -> tuple[EffectFinding, ...]:
        """The effects that stand in the corrected model, sure or not."""
        return tuple(c for c in self.candidates if c.in_model)

    @property
    def command_offset(self) -> float:
        """Time by which the commands act later than the log's record of them says, as far as it was fitted [s]."""
        terms = (t for sensor in self.sensors for t in sensor.terms if t.symbol == COMMAND_OFFSET.symbol)
        return next((t.value for t in terms), 0.0)

    @property
    def plot(self) -> "FindingsPlots":
        """Plots of it, as matplotlib axes."""
        drawn: FindingsPlots = from_above(self.DRAWN_BY)(self)
        return drawn

    @property
    def in_play(self) -> tuple[str, list[tuple[FittedTerm, float]]]:
        """The numbers that a card shows, each with the value at which nothing is missing, and their label.

        They are those of what is missing or likely. In an undecided log they are those of the corrected model, whose
        terms without a name are among them, or else of the best of what is possible.
        """
        label, effects = "values", [c for c in self.candidates if c.verdict in ("missing", "likely")]
        unnamed: tuple[FittedTerm, ...] = ()
        if not effects and self.verdict == "undecided":
            possible = [c for c in self.candidates if c.verdict == "possible" and c.terms and not c.cannot_tell]
            label, effects = "in play", list(self.added) or possible[:_IN_PLAY]
            unnamed = self.unnamed[:_IN_PLAY]
        named = [pair for effect in effects for pair in zip(effect.terms, effect.nulls, strict=True)]
        return label, [*named, *((term, 0.0) for term in unnamed)]

    def drawings(self) -> Mapping[str, str]:
        """See `Card`."""
        drawn: dict[str, str] = from_above("reports.page.figures.plots:of_findings")(self)
        return drawn

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        label, terms = self.in_play
        likely = [
            f"{c.effect} ({percent(rounded_probability(c.confidence))})"
            for c in self.candidates
            if c.verdict == "likely"
        ]
        possible = [c.effect for c in self.candidates if c.verdict == "possible" and not c.cannot_tell]
        return [
            *each("warnings", self.warnings),
            ("verdict", self.verdict),
            ("headline", self.headline),
            ("missing", ", ".join(self.missing)),
            ("likely", ", ".join(likely)),
            (label, "; ".join(term.in_words for term, _ in terms)),
            ("possible", ", ".join(possible)),
            ("sensors", "; ".join(e.sentence for e in self.sensors if e.verdict == "present")),
        ]
