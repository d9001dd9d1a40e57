"""What a log holds, and what the tool would do with it, before anything is computed from it."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..physics.errors import LogError
from ..physics.frames import earth_to_body
from ..physics.motion import Motion
from ..physics.vehicle import Vehicle
from .alignment import Alignment, align, noise_level
from .channel_map import map_dict
from .channels import Channel, command_kind
from .dataset import PAPER, WEAK, Recipe
from .log import Log
from .needs import problems
from .prepare import native_rate, prepare, shortfall, usable_spans
from .resampling import gap_limit, gaps

SCHEMA = "undertow.inspection/1"

_ASTERN = -0.05
_TURNING = 0.05


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
class Excitation:
    """What the boat did.

    Attributes
    ----------
    seconds : duration of the usable motion [s]
    u, v, r : smallest and largest speed [m/s] and yaw rate [rad/s]
    astern : share of the time with u < -0.05 m/s
    turning_to_starboard, turning_to_port : share of the time with a yaw rate beyond 0.05 rad/s to that side
    sentences : what this log cannot tell, for a person
    """

    seconds: float
    u: tuple[float, float]
    v: tuple[float, float]
    r: tuple[float, float]
    astern: float
    turning_to_starboard: float
    turning_to_port: float
    sentences: tuple[str, ...]


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
    """A log seen from all sides; `map` is the channel map in use, `to_dict` the machine's view of everything."""

    path: str
    channels: tuple[ChannelSummary, ...]
    unused: tuple[str, ...]
    alignment: tuple[Alignment, ...]
    excitation: Excitation | None
    plan: Plan
    notes: tuple[str, ...]
    map: dict[str, dict[str, str | float]]

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain values, fit for strict JSON (no NaN or Infinity)."""
        return {"schema": SCHEMA, **asdict(self)}


def inspect_log(log: Log, vehicle: Vehicle | None = None, recipe: Recipe = PAPER) -> Inspection:
    """Look a log over: channels, rates, gaps, time alignment, noise, excitation, and the plan.

    A log that cannot be prepared is no error here: `plan.missing` says why.

    Parameters
    ----------
    log : the log
    vehicle : whose command channels are wanted; None to leave commands out of the plan
    recipe : the preparation that the plan describes
    """
    motions = _motions(log)
    longest = max(motions, key=lambda motion: motion.duration, default=None)
    return Inspection(
        path=str(log.path),
        channels=tuple(_summary(channel, recipe) for channel in log.channels.values()),
        unused=log.unused,
        alignment=_alignment(log, longest) if longest else (),
        excitation=_excitation(motions) if motions else None,
        plan=_plan(log, vehicle, recipe),
        notes=log.notes,
        map=map_dict(log.entries),
    )


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


def _excitation(motions: tuple[Motion, ...]) -> Excitation:
    velocity = np.concatenate([motion.velocity for motion in motions])
    u, v, r = (_range(column) for column in velocity.T)
    astern = float(np.mean(velocity[:, 0] < _ASTERN))
    starboard, port = float(np.mean(velocity[:, 2] > _TURNING)), float(np.mean(velocity[:, 2] < -_TURNING))
    sentences = []
    if astern < 0.02:
        sentences.append("The boat hardly went astern: effects in u|u| and u u, or |u|r and u r, cannot be told apart.")
    if starboard < 0.02 and port < 0.02:
        sentences.append("The boat hardly turned: nothing can be learned about yaw.")
    elif min(starboard, port) < 0.02:
        side = "starboard" if starboard > port else "port"
        sentences.append(f"The boat turned to {side} only: a trim cannot be told from yaw damping.")
    seconds = float(sum(motion.duration for motion in motions))
    return Excitation(seconds, u, v, r, astern, starboard, port, tuple(sentences))


def _range(values: np.ndarray) -> tuple[float, float]:
    return float(values.min()), float(values.max())


def _plan(log: Log, vehicle: Vehicle | None, recipe: Recipe) -> Plan:
    rate = recipe.rate
    if rate is None:
        rate = native_rate(log) if {"u", "x", "psi"} & set(log.channels) else 0.0
    missing = problems(log, vehicle)
    if missing:
        return Plan(recipe, rate, (), (), tuple(missing))
    spans, notes = usable_spans(log, vehicle, recipe)
    found = tuple(Segment(low, high, int((high - low) * rate + 1e-6) + 1) for low, high in spans)
    short = shortfall(log, spans, notes)
    return Plan(recipe, rate, found, tuple(notes), (short,) if short else ())
