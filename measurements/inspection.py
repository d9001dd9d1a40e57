"""What a log holds, and what the tool would do with it, before anything is computed from it."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from ..physics.errors import LogError
from ..physics.frames import earth_to_body
from ..physics.motion import Motion
from ..physics.vehicle import Vehicle
from .activity import Excitation, excitation_of
from .alignment import Alignment, align
from .canonical import Channel, Lost, command_kind
from .channels.channel_map import map_dict
from .log import Log
from .preparation.dataset import PAPER, WEAK, Recipe
from .preparation.needs import problems
from .preparation.prepare import native_rate, prepare, shortfall, usable_spans
from .preparation.resampling import gap_limit, gaps
from .quality.examination import Examination, examine, is_sound, pool, verdict
from .quality.finding import Finding
from .quality.record import Record
from .statistics.white_noise import noise_level

SCHEMA = "undertow.inspection/1"
SCHEMA_OF_SEVERAL = "undertow.inspections/1"


@dataclass(frozen=True, slots=True)
class ChannelSummary:
    """One channel in numbers: stamps [s], rate [Hz], gaps [s], values and noise in its unit."""

    name: str
    unit: str
    origin: str
    count: int
    start: float
    end: float
    rate: float | None
    gaps: int
    longest_gap: float | None
    minimum: float
    maximum: float
    noise: float | None


@dataclass(frozen=True, slots=True)
class Segment:
    """A stretch that becomes one motion: its ends [s] and its rows."""

    start: float
    end: float
    rows: int


@dataclass(frozen=True, slots=True)
class Plan:
    """What preparation would do: the rate [Hz], the segments, notes on gaps, and what is missing (empty: ready)."""

    recipe: Recipe
    rate: float
    segments: tuple[Segment, ...]
    notes: tuple[str, ...]
    missing: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Inspection:
    """A log seen from all sides; `to_dict` is the machine's view of it.

    Attributes
    ----------
    verdict : whether it can be used, and what is worst about it, in one or two sentences
    quality : what each check found
    examination : the same with the log as repaired
    map : the channel map in use
    curable : whether nothing is missing any more once the safe fixes are made
    """

    path: str
    verdict: str
    channels: tuple[ChannelSummary, ...]
    unused: tuple[str, ...]
    alignment: tuple[Alignment, ...]
    excitation: Excitation | None
    plan: Plan
    notes: tuple[str, ...]
    examination: Examination
    map: dict[str, dict[str, str | float]]
    curable: bool

    @property
    def quality(self) -> tuple[Finding, ...]:
        """What each check found."""
        return self.examination.findings

    @property
    def usable(self) -> bool:
        """Whether the log can be used as it is: nothing is missing, and no check found a defect."""
        return not self.plan.missing and is_sound(self.quality)

    @property
    def repaired(self) -> bool:
        """Whether the log can be used once the safe fixes are made: no defect is left, and nothing else is missing."""
        return (self.usable or self.curable) and is_sound([f for f in self.quality if f.fix is None])

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain values, fit for strict JSON (no NaN or Infinity)."""
        return {
            "schema": SCHEMA,
            "path": self.path,
            "verdict": self.verdict,
            "usable": self.usable,
            "quality": [finding.to_dict() for finding in self.quality],
            "channels": [asdict(channel) for channel in self.channels],
            "unused": list(self.unused),
            "alignment": [asdict(alignment) for alignment in self.alignment],
            "excitation": None if self.excitation is None else asdict(self.excitation),
            "plan": asdict(self.plan),
            "notes": list(self.notes),
            "map": self.map,
        }


@dataclass(frozen=True, slots=True)
class Inspections:
    """Several logs of one boat, each by itself, and what they show together.

    Attributes
    ----------
    logs : each by itself
    verdict, quality : of all together
    """

    logs: tuple[Inspection, ...]
    verdict: str
    quality: tuple[Finding, ...]

    @property
    def usable(self) -> bool:
        """Whether every log can be used as it is, and no check of all together found a defect."""
        return is_sound(self.quality) and all(inspection.usable for inspection in self.logs)

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain values, fit for strict JSON."""
        return {
            "schema": SCHEMA_OF_SEVERAL,
            "verdict": self.verdict,
            "usable": self.usable,
            "quality": [finding.to_dict() for finding in self.quality],
            "logs": [inspection.to_dict() for inspection in self.logs],
        }


def inspect_log(log: Log, vehicle: Vehicle | None = None, recipe: Recipe = PAPER) -> Inspection:
    """Look a log over: its quality, channels, rates, gaps, noise, excitation, and the plan.

    A log that cannot be prepared is no error here: `plan.missing` says why.

    Parameters
    ----------
    log : the log
    vehicle : whose command channels are wanted, and whose curves say where neutral is; None to leave them out
    recipe : the preparation that the plan describes
    """
    motions = _motions(log)
    longest = max(motions, key=lambda motion: motion.duration, default=None)
    plan = _plan(log, vehicle, recipe)
    examination = examine(log, vehicle)
    # Late and held fixes make false speeds; what the boat did is told of the log without them.
    seen = [stretch.motion for stretch in Record.of(examination.clean).stretches]
    curable = not _plan(_mended(examination.clean), vehicle, recipe).missing
    return Inspection(
        path=str(log.path),
        verdict=verdict(examination.findings, plan.missing, curable),
        channels=tuple(_summary(channel, recipe) for channel in log.channels.values()),
        unused=log.unused,
        alignment=_alignment(log, longest) if longest else (),
        excitation=excitation_of(seen) if seen else None,
        plan=plan,
        notes=log.notes,
        examination=examination,
        map=map_dict(log.entries),
        curable=curable,
    )


def inspect_logs(logs: Sequence[Log], vehicle: Vehicle | None = None, recipe: Recipe = PAPER) -> Inspections:
    """Look several logs of one boat over, each by itself and all together; see `inspect_log`."""
    each = tuple(inspect_log(log, vehicle, recipe) for log in logs)
    quality = pool([inspection.examination for inspection in each])
    unusable = [inspection for inspection in each if inspection.plan.missing]
    told = verdict(quality)
    if unusable:
        names = ", ".join(inspection.path for inspection in unusable[:3])
        more = f" and {len(unusable) - 3} more" if len(unusable) > 3 else ""
        told = f"{told} {len(unusable)} of {len(each)} logs cannot be used as they are: {names}{more}."
    return Inspections(each, told, quality)


def _mended(log: Log) -> Log:
    """The log as it will be read back: what was sorted is in order."""
    return replace(log, channels={name: replace(c, lost=Lost()) for name, c in log.channels.items()})


def _motions(log: Log) -> tuple[Motion, ...]:
    """Make the motions at the native rate, without commands; none when the log cannot be prepared."""
    try:
        return prepare(log, None, WEAK).motions
    except LogError:
        return ()


def _summary(channel: Channel, recipe: Recipe) -> ChannelSummary:
    found = gaps(channel, gap_limit(channel, recipe.max_gap))
    noisy = command_kind(channel.name) is None
    values = np.unwrap(channel.value) if channel.name == "psi" else channel.value
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
            pair = (starboard, motion.velocity[:, 1])
            found.append(align("the speed made good to starboard", "the sway speed v", pair, step))
    return tuple(found)


def _plan(log: Log, vehicle: Vehicle | None, recipe: Recipe) -> Plan:
    rate = recipe.rate
    if rate is None:
        rate = native_rate(log) if {"u", "x", "psi"} & set(log.channels) else 0.0
    missing = [*_backward(log), *problems(log, vehicle)]
    if missing:
        return Plan(recipe, rate, (), (), tuple(missing))
    spans, notes = usable_spans(log, vehicle, recipe)
    found = tuple(Segment(low, high, int((high - low) * rate + 1e-6) + 1) for low, high in spans)
    short = shortfall(log, spans, notes)
    return Plan(recipe, rate, found, tuple(notes), (short,) if short else ())


def _backward(log: Log) -> list[str]:
    """Time that runs backwards, which reading for inspection alone puts up with."""
    names = [name for name, channel in log.channels.items() if channel.lost.disordered]
    return [f"time runs backwards in {', '.join(names)}; every other verb refuses the log."] if names else []
