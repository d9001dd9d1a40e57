"""Check of the clocks: compass, gyro, receiver, accelerometer and commands in step."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ....physics.motion import Array
from ...canonical import Channel
from ...kinematics import bend_between_rows, kinematics_of, longest_row, moved_over_ground
from ...statistics.blocks import CI, interval
from ..faults import FEWEST, Fault, Kind, Share, Size, delayed, size_by_model
from ..lags import FOLLOWS, Lag, Response, lag_anywhere, lag_of, quick
from ..quick_motion import centre_of, stands_still
from ..record import (
    QUICK_ROW,
    STEP,
    About,
    Channels,
    Check,
    Finding,
    Fix,
    Found,
    Record,
    Stretch,
    altered,
    command_names,
)
from ..response import COARSE, MADE_GOOD, SLOW, Trials, made_good, row_of, trials

_INSTEP = 0.03
"""Offset up to which records are in step [s]: half a step of the 20 Hz on which they are compared, and rounding."""
_PITCHING = 0.05
"""The same of the accelerometer [s]: a boat that pitches as it speeds up holds it back.
Steady, see `benchmarks/steady_limits.py`."""
_REACH = (-0.6, 1.0)
"""Delays that are tried about the one that explains the commands' answer best [s]."""


@dataclass(frozen=True, slots=True)
class _Comparison:
    """Two records of one quantity: how they are made of a record, and what a delay between them does.

    `grave` has the signs of the delays that make a record of which forces are made tell of another manoeuvre: a
    position that is late is no force's concern, and an accelerometer is not used. Up to `in_step` [s] they are in step.
    """

    late: str
    reference: str
    channels: tuple[str, ...]
    needs: frozenset[str]
    response: Callable[[Record, Stretch], Response]
    consequence: str
    grave: tuple[int, ...] = ()
    in_step: float = _INSTEP


def _turning(record: Record, stretch: Stretch) -> Response:
    motion = stretch.motion
    return Response(motion.velocity[:, 2], np.gradient(motion.heading, STEP)[:, None], np.zeros((motion.time.size, 0)))


def _surging(record: Record, stretch: Stretch) -> Response:
    """The accelerometer tilts with speed, and gravity leaks into it: the trim is allowed for."""
    motion = stretch.motion
    surge, sway, rate = motion.velocity.T
    measured = on_grid(record, "ax", motion.time)
    return Response(measured, (np.gradient(surge, STEP) - sway * rate)[:, None], _trim(surge))


def _trim(surge: Array) -> Array:
    return np.column_stack([surge, surge * np.abs(surge)])


_COMPARISONS = (
    _Comparison(
        "the gyro",
        "the compass",
        ("r",),
        frozenset({"psi", "r"}),
        _turning,
        "yaw rate and heading tell of different instants; a thruster lag of that size is no finding",
        grave=(-1, 1),
    ),
    _Comparison(
        "the surge speed",
        "the position",
        ("u", "v"),
        MADE_GOOD,
        made_good,
        "speeds and positions tell of different instants; a lag of that size is no finding",
        grave=(1,),
    ),
    _Comparison(
        "the accelerometer",
        "the speed over ground",
        ("ax", "ay"),
        frozenset({"psi", "ax"}),
        _surging,
        "an accelerometer that is late makes a lag of the thrusters that is not there",
        in_step=_PITCHING,
    ),
)


def _examine(records: Sequence[Record]) -> Found:
    """Find the delay between records of one quantity, and between commands and what they do.

    One finding for each pair of records that the logs have, and one for the commands.
    """
    found, gyro = [], 0.0
    for pair in _COMPARISONS:
        having = [record for record in records if pair.needs <= set(record.log.channels)]
        if not having:
            continue
        lags = [lag_anywhere([pair.response(record, s) for s in record.stretches], STEP) for record in having]
        every = (pair.response(r, s) for r in having for s in r.stretches)
        lag = lags[0] if len(having) == 1 else lag_anywhere(list(every), STEP)
        known = [one for one in lags if one is not None and _sure(one)]
        row = max(record.log.channels[name].period for record in having for name in pair.needs)
        if row > QUICK_ROW and "ax" in pair.needs:
            lag = None  # speeds in such rows tell of no acceleration
        pair = replace(pair, in_step=max(pair.in_step, bend_between_rows(row)))
        finding = _compared(pair, lag, known, having)
        if pair.channels == ("r",) and finding.fix is not None and lag is not None:
            gyro = lag.seconds
        found.append(finding)
    return [*found, *_commanded(records, gyro)]


def on_grid(record: Record, name: str, time: Array) -> Array:
    """A channel at other stamps."""
    channel = record.log.channels[name]
    return np.interp(time, channel.time, channel.value)


def _sure(lag: Lag | None) -> bool:
    """True when one record follows the other, at a delay that is known to a row of the commands."""
    return lag is not None and lag.explained >= FOLLOWS and CI * lag.error <= COARSE


def _compared(pair: _Comparison, lag: Lag | None, each: Sequence[Lag], records: Sequence[Record]) -> Finding:
    """The finding on one pair of records; no force is learnt of a boat that a rudder steers, whatever its clocks."""
    names = pair.channels[:1]
    about = About("clocks", names, unit="s")
    if lag is None or not _sure(lag):
        return about.untold(f"too little motion to tell whether {pair.late} is in step with {pair.reference}")
    low, high = lag.ci95
    in_step = low <= pair.in_step and high >= -pair.in_step
    if in_step or not lag.size.share.low > 0.0:
        verdict, text = "ok", f"{pair.late} is in step with {pair.reference} (to {max(abs(lag.seconds), 0.001):.3f} s)"
        if not in_step or max(high, -low) > COARSE:
            verdict = "cannot tell"
            text = f"{pair.late} may be {low:+.2f} to {high:+.2f} s after {pair.reference}: too little motion to tell"
        return about.finding(verdict, text, value=lag.seconds, ci95=lag.ci95)
    over_ground = [_late_over_ground(record) for record in records] if "v" in pair.channels else [0.0]
    seconds = float(np.median(over_ground)) if all(over_ground) else lag.seconds
    spread = [one.seconds for one in each]
    between = f" ({min(spread):.2f} to {max(spread):.2f} s over the logs)" if len(spread) > 1 else ""
    order = "after" if seconds > 0 else "before"
    moved = " and ".join(pair.channels)
    facts = {"late": pair.late, "reference": pair.reference, "order": order, "wrong": pair.consequence, "moved": moved}
    facts |= {"seconds": abs(seconds), "shift": -seconds}
    facts["told"] = (
        f"{pair.late} tells of a motion {abs(seconds):.2f} s {order} {pair.reference} does{between}: moved there, "
        f"they agree in {lag.size.share} of what parts them"
    )
    fix = Fix(f"stamps of {moved} moved by {-seconds:+.3f} s", _move(pair.channels, -seconds))
    if all(over_ground):
        fix = Fix(f"{moved} moved over ground by {-seconds:+.3f} s", _move_over_ground(-seconds))
    fault = Fault(Kind.APART, names, lag.size, facts, seconds, None if all(over_ground) else lag.ci95, fix)
    grave = lag.size.refuses and np.sign(lag.seconds) in pair.grave and not any(record.steered for record in records)
    return fault.in_words("defect" if grave else "warning" if lag.size.share.warns else "note")


def _commanded(records: Sequence[Record], gyro: float) -> list[Finding]:
    """Whether the boat answers before it is told to; that it answers later is its nature, up to `SLOW`."""
    names = command_names(records)
    if not names:
        return []
    channels, found = tuple(names), trials(records)
    about = About("clocks", channels, unit="s")
    far = [one.best.seconds for one in found if not one.best.in_step]
    if far and not all(one.late for one in found):
        text = f"the boat may answer its commands {_when(far[0])}, or in step: the log is explained alike"
        return [about.untold(text, value=far[0])]
    row = row_of(records, [name for name in names if not stands_still(records, name)])
    pooled = _answer(records, gyro, float(np.median(far)) if far else 0.0, row)
    if pooled is None and far:
        pooled = float(np.median(far)), COARSE
    if pooled is None:
        text = "the commands say too little about the motion to tell whether they are in step with it"
        return [about.untold(text)]
    seconds, error = pooled
    ends = interval(seconds, error)
    if seconds > SLOW and far:
        size = _size_of_delay(records, found, seconds, 0.0)
        if size is None or size.share.warns:
            return [_early(seconds, ends, channels)]
        text = f"the boat may answer its commands {_when(seconds)}, or in step, where the vehicle has it"
        return [about.untold(text, value=seconds)]
    # A command in a row of 0.1 s was given up to 0.1 s before it, half of it on the mean; in longer rows, with which a
    # programme may keep step, all of it.
    before = row if row > 1.5 * COARSE else 0.5 * row
    if ends[1] >= -_INSTEP - before:
        if ends[0] < -COARSE - before:
            between = " to ".join(_when(end, 2) for end in ends)
            text = f"the boat may answer its commands {between}: too little to tell"
            return [about.untold(text, value=seconds, ci95=ends)]
        either = [one for one in found if one.contrary]
        if either:  # the same alternatives as those of `Sides`, which tells which way the thrusters push in each
            told = " or ".join(_when(one.seconds) for one in (either[0].best, *either[0].contrary[:2]))
            text = f"when the boat answers its commands hangs on which way its thrusters push: {told}"
            return [about.untold(text, value=seconds)]
        text = f"the boat answers its commands {_when(seconds, 2)}"
        if seconds < 0.0:
            text = f"the boat answers its commands in the same row of {row:.2g} s"
        return [about.ok(text, value=seconds, ci95=ends)]
    size = _size_of_delay(records, found, seconds, row)
    if size is not None and not size.share.low > 0.0:
        text = (
            f"the boat may answer its commands {_when(seconds, 2)}, but moved there they explain only {size.share} more"
        )
        return [about.untold(text, value=seconds)]
    moved = "" if size is None else f" (moved there, they explain {size.share} of what is left of surge and yaw)"
    none = Share(0.0, np.inf)
    facts = {"seconds": -seconds, "shift": seconds, "size": moved}
    fix = Fix(f"stamps of {', '.join(channels)} moved by {seconds:+.3f} s", _move(channels, seconds))
    fault = Fault(Kind.LATE_COMMANDS, channels, size or Size(none, none), facts, seconds, ends, fix)
    if far and fault.size.refuses:  # in step, for a log in such rows
        return [fault.in_words("defect")]
    return [fault.in_words("warning" if size is None or size.share.warns else "note")]


def _size_of_delay(records: Sequence[Record], found: Sequence[Trials], seconds: float, row: float) -> Size | None:
    """What the motion gains where commands are moved to a delay [s]: by the vehicle, or by the answers fitted there.

    A programme that keeps step with the rows of a log has each command up to a `row` [s] late in it, and a vehicle that
    lacks damping makes the boat seem early: what the vehicle gains in a row is no fault of stamps.
    """
    size = size_by_model(records, delayed(seconds + row), delayed(-row))
    for one in found if size is None else ():
        stepped, best = one.stepped and one.stepped.fitted, one.best.fitted
        if stepped is not None and best is not None and not one.best.in_step:
            size = best.size_beside(stepped.errors())
    return size


def _early(seconds: float, ends: tuple[float, float], channels: tuple[str, ...]) -> Finding:
    """The commands are stamped early, or the boat is slower than any; which of the two, a person knows."""
    return About("clocks", channels, seconds, "s", ends).warning(
        f"the boat answers its commands {seconds:.2f} s after them: no thruster is that slow, the stamps are early",
        consequence=f"no delay beyond {SLOW:.0f} s is looked for, so what is found explains it by something else",
        remedy=f"move the commands by {seconds:+.2f} s or less",
        short=f"the boat answers its commands {seconds:.1f} s after them",
    )


def _when(seconds: float, digits: int = 1) -> str:
    return f"{abs(seconds):.{digits}f} s {'after' if seconds >= 0.0 else 'before'} them"


def _answer(records: Sequence[Record], gyro: float, about: float, row: float) -> tuple[float, float] | None:
    """The delay of surge and yaw after the commands near one [s], its standard error [s]; None if neither tells."""
    names = {name for record in records for name in record.commands}
    centre = {name: centre_of(records, name) for name in names}
    lags = []
    every = [_answered(record, s, centre, gyro) for record in records for s in record.stretches if record.commands]
    for responses in zip(*every, strict=True):
        lag = lag_of(responses, STEP, quick, (about + _REACH[0] - max(row - COARSE, 0.0), about + _REACH[1]))
        if lag is not None and lag.stretches >= FEWEST and _sure(lag):
            lags.append(lag)
    if not lags:
        return None
    weight = np.array([1.0 / max(lag.error, 0.005) ** 2 for lag in lags])
    seconds = float(weight @ np.array([lag.seconds for lag in lags]) / weight.sum())
    return seconds, float(1.0 / np.sqrt(weight.sum()))


def _drive(record: Record, stretch: Stretch, centre: Mapping[str, float]) -> Array:
    """Each command ahead and astern of its neutral, linear and quadratic: any thruster's curve is near one of these.

    A command that another log has and this one lacks is silent here.
    """
    known = dict(zip(record.commands, stretch.commands.T, strict=True))
    silent = np.zeros(len(stretch.commands))
    sizes = [known[name] - middle if name in known else silent for name, middle in sorted(centre.items())]
    deviation = np.column_stack(sizes)
    # A command that is silent in this stretch has no size; fmax passes over what is no number without complaint.
    scale = np.fmax.reduce(np.abs(deviation), axis=0, initial=0.0)
    deviation = deviation / np.where(scale > 0.0, scale, 1.0)
    ahead, astern = np.maximum(deviation, 0.0), np.minimum(deviation, 0.0)
    return np.column_stack([ahead, astern, ahead**2, astern**2])


def _answered(record: Record, stretch: Stretch, centre: Mapping[str, float], gyro: float) -> tuple[Response, Response]:
    """Changes of surge, and of yaw by a gyro that is so late [s], with the commands that drive them."""
    motion, commands = stretch.motion, _drive(record, stretch, centre)
    surge, _, rate = motion.velocity.T
    rate = np.interp(motion.time + gyro, motion.time, rate)
    drag = np.column_stack([rate, np.abs(surge) * rate, np.abs(rate) * rate])
    return Response(np.gradient(surge, STEP), commands, _trim(surge)), Response(np.gradient(rate, STEP), commands, drag)


def _move(names: Sequence[str], seconds: float) -> Callable[[Channels], dict[str, Channel]]:
    return partial(altered, names=names, change=lambda c: replace(c, time=c.time + seconds))


def _late_over_ground(record: Record) -> float:
    """How late speeds over ground came [s], 0 where they did not or nothing tells.

    The surge speed alone does not tell: in turns it is part of what was sway.
    """
    if not {"x", "y", "psi", "u", "v"} <= set(record.log.channels):
        return 0.0
    channels = record.log.channels
    seen = kinematics_of([stretch.motion for stretch in record.stretches], channels, longest_row(channels))
    return seen.late_over_ground


def _move_over_ground(seconds: float) -> Callable[[Channels], dict[str, Channel]]:
    """Moves speeds as vectors over ground: the heading at each stamp stays."""

    def apply(channels: Channels) -> dict[str, Channel]:
        psi, u, v = (channels[name] for name in ("psi", "u", "v"))
        heading = np.interp(u.time, psi.time, np.unwrap(psi.value))
        speeds = np.column_stack([u.value, np.interp(u.time, v.time, v.value)])
        ahead, aside = moved_over_ground(u.time, heading, speeds, seconds).T
        return {**channels, "u": replace(u, value=ahead), "v": replace(v, time=u.time, value=aside)}

    return apply


CLOCKS = Check("clocks", _examine)
