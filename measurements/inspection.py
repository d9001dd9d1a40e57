"""Inspection of a log before anything is computed from it: channels, all checks of quality, and the plan.

Checks look at one log, or at several logs of one boat together.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pydantic import Field, field_serializer

from ..physics import file_records
from ..physics.errors import LogError
from ..physics.file_records import Flag, Number, Whole, absent
from ..physics.motion import Array, Motion, earth_to_body
from ..physics.presentation import Card, each
from ..physics.registry_members import objects_in
from ..physics.vehicle import Vehicle
from .canonical import Channel, Lost, command_kind
from .channels.channel_map import Entry, map_dict
from .log import Log
from .preparation.needs import problems
from .preparation.prepare import PAPER, WEAK, Recipe, motions_within, native_rate, shortfall, usable_spans
from .preparation.resampling import gap_limit, gaps
from .quality import checks
from .quality.checks.excitation import Excitation, excitation_of
from .quality.record import SEVERITY, Check, Finding, Record
from .quality.record import longest as longest_span
from .statistics.signals import LEAST_CORRELATION, drift_free, noise_level, turning_point

_ORDER = (
    *("vessel", "stamps", "time unit", "resampled", "rates", "gaps", "stuck", "jumps", "spikes", "exchanged", "units"),
    *("held fixes", "late fixes", "commands", "command range", "mixed commands", "sides", "clocks", "neutral", "drive"),
    *("limited", "compass", "sensors", "tilt", "excitation"),
)
"""Names of the checks. Each sees the log as the safe fixes of those before it leave it: units before speeds, fixes
before clocks, and what speaks of PWM as it is in the file before the neutral is moved."""
CHECKS: tuple[Check, ...] = tuple(sorted(objects_in(checks, Check), key=lambda check: _ORDER.index(check.name)))
"""All checks, in that order."""


_WORST = 3
"""Findings that the verdict tells."""


@dataclass(frozen=True, slots=True, eq=False)
class Examination:
    """What the checks say of one log.

    Attributes
    ----------
    findings : of all checks, in their order
    seen : the log as each check saw it, with the safe fixes of the checks before
    repaired : the log with all safe fixes
    """

    findings: tuple[Finding, ...]
    seen: tuple[Record, ...]
    repaired: Record

    @property
    def clean(self) -> Log:
        """The log with all safe fixes, in which nothing is out of order any more."""
        log = self.repaired.log
        return replace(log, channels={name: replace(c, lost=Lost()) for name, c in log.channels.items()})

    @property
    def fixes(self) -> tuple[str, ...]:
        """What was done to `clean`, as sentences."""
        return tuple(finding.fix.sentence for finding in self.findings if finding.fix is not None)

    @property
    def still_wrong(self) -> tuple[str, ...]:
        """What is still wrong with `clean`, as sentences."""
        unfixed = [finding for finding in self.findings if finding.fix is None]
        return tuple(finding.sentence for finding in unfixed if finding.verdict in SEVERITY[:2])


def examine(
    log: Log, vehicle: Vehicle | None = None, *, progress: Callable[[int, int], None] | None = None
) -> Examination:
    """Make all checks on one log.

    Parameters
    ----------
    vehicle : whose thrusters the commands must agree with
    progress : told how many checks are made, and how many there are
    """
    record, findings, seen = Record.of(log, vehicle), [], []
    for done, check in enumerate(CHECKS):
        if progress is not None:
            progress(done, len(CHECKS))
        seen.append(record)
        found = check.examine([record])
        findings += found
        channels = dict(record.log.channels)
        fixes = [finding.fix for finding in found if finding.fix is not None]
        for fix in fixes:
            channels = fix.apply(channels)
        if any(channels[name] is not record.log.channels.get(name) for name in channels):
            record = record.repaired(channels)
    return Examination(tuple(findings), tuple(seen), record)


def pool(examinations: Sequence[Examination], names: Collection[str] = ()) -> tuple[Finding, ...]:
    """Make checks on several logs of one boat together: what one log is too short to tell, all may.

    Parameters
    ----------
    names : of the checks; none for all
    """
    return tuple(
        finding
        for place, check in enumerate(CHECKS)
        if not names or check.name in names
        for finding in check.examine([each.seen[place] for each in examinations])
    )


def is_sound(findings: Sequence[Finding]) -> bool:
    """True when no check found a defect; a warning makes numbers worse, but a log can be used with it."""
    return not any(finding.verdict == "defect" for finding in findings)


def verdict(findings: Sequence[Finding], missing: Sequence[str] = (), curable: bool = False) -> str:
    """Say in one or two sentences whether a log is usable, and what is worst about it.

    Parameters
    ----------
    findings : of the checks
    missing : what keeps the log from being used, empty where nothing does
    curable : whether the safe fixes do away with that
    """
    if missing:
        cure = " --fix OUT.csv writes a log that can be used." if curable else ""
        return f"Not usable as it is: {missing[0]}{cure}"
    worst = sorted((f for f in findings if f.verdict in SEVERITY[:2]), key=lambda f: SEVERITY.index(f.verdict))
    defects = sum(finding.verdict == "defect" for finding in worst)
    if not worst:
        untold = [finding for finding in findings if finding.verdict == "cannot tell"]
        unsure = "; ".join(finding.short for finding in untold if finding.short)
        count = sum(not finding.short for finding in untold)
        things = "one thing" if count == 1 else f"{count} things"
        more = f" It is too short or too calm to tell {things}." if count else ""
        if unsure:
            return f"Usable if this is right, which the log cannot tell: {unsure}. No defect was found.{more}"
        return f"Usable; no defect was found.{more}"
    text = "; ".join(finding.short or finding.sentence for finding in worst[:_WORST])
    more = f"; and {len(worst) - _WORST} more" if len(worst) > _WORST else ""
    refused = " discover refuses it as it is." if any(finding.refused for finding in findings) else ""
    return f"{'Usable after repair' if defects else 'Usable, but mind'}: {text}{more}.{refused}"


_TOLD = 5
"""Findings that a card tells: more is for who asks."""


class ChannelSummary(file_records.Record):
    """One channel in numbers: stamps [s], rate [Hz], gaps [s], values and noise in its unit."""

    name: str
    unit: str
    origin: str
    count: Whole
    start: Number
    end: Number
    rate: Number | None = None
    gaps: Whole
    longest_gap: Number | None = None
    minimum: Number
    maximum: Number
    noise: Number | None = None


class Segment(file_records.Record):
    """A stretch that becomes one motion: its ends [s] and its rows."""

    start: Number
    end: Number
    rows: Whole


class Plan(file_records.Record):
    """What preparation would do: the rate [Hz], the segments, notes on gaps, and what is missing (empty: ready)."""

    recipe: Recipe
    rate: Number
    segments: tuple[Segment, ...] = ()
    notes: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()


class Fixed(file_records.Record):
    """What `inspect --fix` wrote: the file, what was done, what is still wrong, and whether it can be used."""

    path: str
    done: tuple[str, ...]
    left: tuple[str, ...]
    usable: Flag


class Alignment(file_records.Record):
    """How far one record of a quantity is behind another.

    Attributes
    ----------
    first, second : the two records, in words
    offset : how much later the second one shows the same thing [s]; None when the log cannot tell
    correlation : of the two records at that offset; None when one of them never changes
    sentence : the same for a person
    """

    first: str
    second: str
    offset: Number | None = None
    correlation: Number | None = None
    sentence: str


class Inspection(Card, file_records.Record):
    """A log seen from all sides.

    Attributes
    ----------
    verdict : whether it can be used, and what is worst about it, in one or two sentences
    usable : whether it can be used as it is: nothing is missing, and no check found a defect
    quality : what each check found
    map : the channel map in use
    fixed : the repaired log, where one was written
    curable : whether nothing is missing any more once the safe fixes are made; in no file
    """

    SCHEMA: ClassVar[str] = "undertow.inspection/1"

    path: str
    verdict: str = ""
    usable: Flag = True
    quality: tuple[Finding, ...] = ()
    channels: tuple[ChannelSummary, ...] = ()
    unused: tuple[str, ...] = ()
    alignment: tuple[Alignment, ...] = ()
    excitation: Excitation | None = None
    plan: Plan
    notes: tuple[str, ...] = ()
    map: Mapping[str, Mapping[str, str | float | Mapping[str, str | float]]] = {}
    fixed: Fixed | None = absent()
    curable: Flag = Field(default=False, exclude=True)

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        worst = [f for verdict in ("defect", "warning") for f in self.quality if f.verdict == verdict]
        return [
            ("log", self.path),
            ("verdict", self.verdict),
            *(line for one in worst[:_TOLD] for line in each(one.verdict, _sentences(one))),
            ("more", f"{len(worst) - _TOLD} more in .quality" if len(worst) > _TOLD else ""),
            ("channels", ", ".join(channel.name for channel in self.channels)),
            ("missing", "; ".join(self.plan.missing)),
        ]

    @property
    def mends(self) -> dict[str, Entry | None]:
        """Lines of a channel map that put right what the checks found."""
        return {name: entry for finding in self.quality for name, entry in finding.mends.items()}

    @property
    def repaired(self) -> bool:
        """Whether the log can be used once the safe fixes are made: no defect is left, and nothing else is missing."""
        return (self.usable or self.curable) and is_sound([f for f in self.quality if f.fix is None])


class Inspections(Card, file_records.Record):
    """Several logs of one boat, each by itself, and what they show together where they were looked over together.

    Attributes
    ----------
    verdict, quality : of all together
    usable : whether every log can be used as it is, and no check of all together found a defect
    logs : each by itself
    notes : what lies beside the logs and is none
    """

    SCHEMA: ClassVar[str] = "undertow.inspections/1"

    verdict: str | None = absent()
    usable: Flag | None = absent()
    quality: tuple[Finding, ...] | None = absent()
    logs: tuple[Inspection, ...]
    notes: tuple[str, ...] | None = absent()

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        return [("verdict", self.verdict or ""), *((Path(one.path).name, one.verdict) for one in self.logs)]

    @field_serializer("logs")
    def _each_with_its_schema(self, logs: tuple[Inspection, ...]) -> list[Any]:
        return [inspection.to_dict() for inspection in logs]


def _sentences(finding: Finding) -> list[str]:
    """What was found and what follows, and what to do about it."""
    by_itself = " ('undertow inspect LOG --fix OUT.csv' does it)" if finding.fix else ""
    return [finding.told, *([f"> {finding.cure}{by_itself}."] if finding.cure else [])]


def inspect_log(
    log: Log, vehicle: Vehicle | None = None, recipe: Recipe = PAPER, *, examination: Examination | None = None
) -> Inspection:
    """Look a log over: its quality, channels, rates, gaps, noise, excitation, and the plan.

    A log that cannot be prepared is no error here: `plan.missing` says why.

    Parameters
    ----------
    log : the log
    vehicle : whose command channels are wanted, and whose curves say where neutral is; None to leave them out
    recipe : the preparation that the plan describes
    examination : of the log, where it is made already
    """
    motions = _motions(log)
    longest = max(motions, key=lambda motion: motion.duration, default=None)
    plan = _plan(log, vehicle, recipe)
    examination = examination or examine(log, vehicle)
    # Late and held fixes make false speeds; what the boat did is told of the log without them.
    seen = examination.repaired.stretches
    as_it_is = not examination.fixes and not plan.missing
    curable = as_it_is or not _plan(examination.clean, vehicle, recipe).missing
    kept = {channel.origin for channel in log.auxiliary.values()}
    return Inspection(
        path=str(log.path),
        verdict=verdict(examination.findings, plan.missing, curable),
        usable=not plan.missing and is_sound(examination.findings),
        quality=examination.findings,
        channels=tuple(_summary(channel, recipe) for channel in log.channels.values()),
        unused=tuple(name for name in log.unused if name not in kept),
        alignment=_alignment(log, longest) if longest else (),
        excitation=excitation_of([s.motion for s in seen], [s.portion.weight for s in seen]) if seen else None,
        plan=plan,
        notes=(*log.notes, *_sentence_of_part(examination)),
        map=map_dict(log.entries),
        curable=curable,
    )


def inspect_logs(logs: Sequence[Log], vehicle: Vehicle | None = None) -> Inspections:
    """Look several logs of one boat over, each by itself and all together; see `inspect_log`.

    Parameters
    ----------
    logs : of one boat
    vehicle : for which they are meant
    """
    examinations = [examine(log, vehicle) for log in logs]
    each = tuple(inspect_log(log, vehicle, examination=e) for log, e in zip(logs, examinations, strict=True))
    quality = pool(examinations)
    unusable = [inspection for inspection in each if inspection.plan.missing]
    told = verdict(quality)
    if unusable:
        names = ", ".join(inspection.path for inspection in unusable[:3])
        more = f" and {len(unusable) - 3} more" if len(unusable) > 3 else ""
        told = f"{told} {len(unusable)} of {len(each)} logs cannot be used as they are: {names}{more}."
    usable = is_sound(quality) and all(inspection.usable for inspection in each)
    return Inspections(verdict=told, usable=usable, quality=quality, logs=each)


def _sentence_of_part(examination: Examination) -> tuple[str, ...]:
    """Say what part of a long log the checks of motion looked at."""
    record = examination.repaired
    if not any(stretch.portion.cut for stretch in record.stretches):
        return ()
    part = sum(stretch.motion.duration for stretch in record.stretches)
    return (
        f"of {record.seconds / 3600.0:.1f} h of motion, delays, sides, signs, compass and shares of the time are told "
        f"from {part / 60.0:.0f} minutes in {len(record.stretches)} stretches spread over it; gaps, stamps, spikes, "
        "units and stuck sensors from every row",
    )


def _motions(log: Log) -> tuple[Motion, ...]:
    """Make the motions at the native rate, without commands; none when the log cannot be prepared.

    Of a log of over three hours, the middle two hours of the longest.
    """
    try:
        return motions_within(log, WEAK, longest_span)
    except LogError:
        return ()


def _summary(channel: Channel, recipe: Recipe) -> ChannelSummary:
    found = gaps(channel, gap_limit(channel, recipe.max_gap))
    noisy = command_kind(channel.name) is None
    values = channel.unwrapped
    return ChannelSummary(
        name=channel.name,
        unit=channel.unit,
        origin=channel.origin,
        count=channel.time.size,
        start=float(channel.time[0]),
        end=float(channel.time[-1]),
        rate=1.0 / channel.period if channel.period > 0 else None,
        gaps=len(found),
        longest_gap=max((high - low for low, high in found), default=None),
        minimum=float(values.min()),
        maximum=float(values.max()),
        noise=noise_level(values) if noisy else None,
    )


def _alignment(log: Log, motion: Motion) -> tuple[Alignment, ...]:
    """Compare what was measured twice; a derived channel is not a second measurement."""
    step, found = motion.time_step, []
    if "r" in log.channels:
        turning = np.gradient(motion.heading, step)
        found.append(align("the turning of the heading", "the yaw rate r", (turning, motion.velocity[:, 2]), step))
    if {"x", "y", "u"} <= set(log.channels):
        north, east = np.gradient(motion.position, step, axis=0).T
        ahead, starboard = earth_to_body(motion.heading, north, east)
        found.append(align("the speed made good ahead", "the surge speed u", (ahead, motion.velocity[:, 0]), step))
        if "v" in log.channels:
            _, v, r = motion.velocity.T
            # An antenna ahead of the origin goes to the other side in turns, as far as it is ahead of the pivot.
            arm = float((starboard - v) @ r) / max(float(r @ r), 1e-300)
            turned = float(np.square(starboard + v).sum()) < float(np.square(starboard - v - arm * r).sum())
            pair = (starboard if turned else starboard - arm * r, v)
            found.append(align("the speed made good to starboard", "the sway speed v", pair, step))
    return tuple(found)


def align(first: str, second: str, values: tuple[Array, Array], step: float, reach: float = 1.0) -> Alignment:
    """Compare two records (n,) of one quantity on the same even time base.

    Parameters
    ----------
    first, second : what the records are, in words
    values : the two records, in the same unit: speeds or turning rates
    step : of the time base [s]
    reach : largest delay looked for [s]

    Returns
    -------
    Alignment
        The offset is where the cross-correlation peaks, between samples by a parabola through three lags.
    """
    # A heading's noise, differentiated, hides the peak; integrated records found a delay of 0.1 s to 3 ms where rates
    # erred by 50 ms. The band-pass takes away what integration made drift, and moves neither record against the other.
    a, b = (drift_free(series, step) for series in values)
    most = min(round(reach / step), a.size // 4)
    if most < 1 or min(a.std(), b.std()) < 1e-9:
        sentence = f"{first} or {second} never changes; nothing to compare."
        return Alignment(first=first, second=second, sentence=sentence)
    lags = np.arange(-most, most + 1)
    peak = np.array([_correlation(a, b, int(lag)) for lag in lags])
    best = int(np.argmax(peak))
    top = float(peak[best])
    if top < LEAST_CORRELATION or best in (0, lags.size - 1):
        sentence = f"{first} and {second} do not follow each other (correlation {top:.2f}): noise, or other axes."
        if peak.min() < -max(LEAST_CORRELATION, top):
            top = float(peak.min())
            sentence = f"{second} has the opposite sign of {first} (correlation {top:.2f}); check the axes."
        return Alignment(first=first, second=second, correlation=top, sentence=sentence)
    shift = turning_point(float(peak[best - 1]), top, float(peak[best + 1]))
    offset = float((lags[best] + shift) * step)
    sentence = f"{second} is {abs(offset):.3f} s {'later' if offset > 0 else 'earlier'} than {first}."
    if abs(offset) < 0.2 * step:
        sentence = f"{first} and {second} are in step."
    return Alignment(first=first, second=second, offset=offset, correlation=top, sentence=sentence)


def _correlation(a: Array, b: Array, lag: int) -> float:
    """Correlation of a(t) with b(t + lag)."""
    left = a[max(0, -lag) : a.size - max(0, lag)]
    right = b[max(0, lag) : b.size - max(0, -lag)]
    left, right = left - left.mean(), right - right.mean()
    power = float(np.sqrt((left @ left) * (right @ right)))
    return float(left @ right) / power if power > 0 else 0.0


def _plan(log: Log, vehicle: Vehicle | None, recipe: Recipe) -> Plan:
    rate = recipe.rate
    if rate is None:
        rate = native_rate(log) if {"u", "x", "psi"} & set(log.channels) else 0.0
    missing = [*_backward(log), *problems(log, vehicle)]
    if missing:
        return Plan(recipe=recipe, rate=rate, missing=tuple(missing))
    spans, notes = usable_spans(log, vehicle, recipe)
    found = tuple(Segment(start=low, end=high, rows=int((high - low) * rate + 1e-6) + 1) for low, high in spans)
    short = shortfall(log, spans, notes)
    return Plan(recipe=recipe, rate=rate, segments=found, notes=tuple(notes), missing=(short,) if short else ())


def _backward(log: Log) -> list[str]:
    """Time that runs backwards, which reading for inspection alone puts up with."""
    names = [name for name, channel in log.channels.items() if channel.lost.disordered]
    return [f"time runs backwards in {', '.join(names)}; every other verb refuses the log."] if names else []
