"""Thrusters as a log shows them: which there are, on which side, which way round, and how hard they push."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..physics.motion import Array
from ..physics.sampled_series import first_order_lag
from .canonical import Output, command_kind, in_vehicle_file, kind_of
from .quality.checks.sides import placed
from .quality.quick_motion import neutral_of, stands_still
from .quality.record import Record, Stretch
from .quality.response import Answer, other_side, side_of

_PULSES = (1100.0, 1500.0, 1900.0)
"""Full astern, neutral and full ahead of a speed controller [us], where neither the log nor its parameters tell."""
_NEAREST = ("newton", "tau", "rad_s", "pwm", "normalized")
"""Kinds of commands, the nearest to the thrust first: between the others and the water lie curves that nobody knows."""
_POINTS = 8
"""Steps of a bent curve to either side: lines between them keep a square within 0.4 % of full thrust."""
_FAST = 0.9
"""Share of the top speed (its 99th percentile) from which a row shows what drag balances full thrust."""
_PUSHES = 0.02
"""Share of all thrust that a hull is pushed with where it is fastest, at least: the least that tells of its drag."""
_NO_CHANGE = 1e-12
"""Sum of squared changes of speed [m^2/s^2] of a boat that lies still."""
_WINDOW, _GROUPS, _SURE = 2.0, 8, 2.0
"""Window over which speed changes by what pushes [s]; parts of the log that tell the error of a number, left out one by
one; and errors by which a number must exceed zero to be told."""
_LAGS = (0.0, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0)
"""Lags of the thrusters that are tried [s]."""


@dataclass(frozen=True, slots=True)
class DetectedThruster:
    """A thruster as a log shows it.

    Attributes
    ----------
    channel : canonical name of its command, as the log should be read
    read_as : what the command was called when the log was read
    output : neutral and ends of the command, and the shape of thrust over it
    side : "port", "starboard", or empty where neither log nor name tells
    turned : more of the command as it was read pushed astern, so that it is to be read the other way round
    by_log : the log shows its side or which way it pushes; else its name is believed
    rested : neutral is told, by the log's parameters, by the boat at rest, or by the kind of command
    shaped : thrust astern is told, by the log's parameters or by the kind of command
    """

    channel: str
    read_as: str
    output: Output
    side: str
    turned: bool
    by_log: bool
    rested: bool
    shaped: bool

    @property
    def kind(self) -> str:
        """Kind of the command: pwm, normalized, rad_s or newton."""
        return kind_of(self.channel)

    @property
    def name(self) -> str:
        """Name of the thruster."""
        return (command_kind(self.channel) or ("", self.channel))[1]

    def unlike(self, asymmetry: float) -> "DetectedThruster":
        """The same with another full thrust ahead over that astern."""
        return replace(self, output=replace(self.output, asymmetry=asymmetry))

    def share(self, command: Array) -> Array:
        """Share of full thrust ahead, negative astern, that commands (n,) ask for; see `Output.expo`."""
        out = self.output
        span = np.where(command >= out.neutral, out.ahead - out.neutral, max(out.neutral - out.astern, 1e-12))
        part = np.clip((command - out.neutral) / span, -1.0, 1.0)
        size = np.maximum(np.abs(part) - out.least, 0.0) / (1.0 - out.least)
        bent = (1.0 - out.expo) * size + out.expo * size**2
        return np.sign(part) * bent / np.where(part < 0.0, out.asymmetry, 1.0)

    def curve(self, thrust: float) -> tuple[list[float], list[float]]:
        """Points of the curve from command to force [N] of a thruster with this full thrust ahead [N]."""
        out, steps = self.output, 1 if self.output.expo == 0.0 else _POINTS
        parts = np.arange(-steps if out.astern < out.neutral else 0, steps + 1) / steps
        if out.least > 0.0:
            parts = np.union1d(parts, np.array([-out.least, out.least])[int(out.astern >= out.neutral) :])
        command = out.neutral + parts * np.where(parts >= 0.0, out.ahead - out.neutral, out.neutral - out.astern)
        return [float(f"{c:.7g}") for c in command], [float(f"{f:.4g}") for f in thrust * self.share(command)]


@dataclass(frozen=True, slots=True)
class SurgeAnswer:
    """Acceleration by full thrust ahead, and by full thrust astern, each with its standard error; None where not told.

    Both are positive [m/s^2]; `left` is the share of the changes of speed that the fit leaves, 0 where it is exact.
    """

    ahead: tuple[float, float] | None
    astern: tuple[float, float] | None
    left: float = 1.0


def thrusters_in(records: Sequence[Record]) -> list[DetectedThruster]:
    """The thrusters whose commands are in every one of some logs of one boat, port ones first; see `left_out`."""
    still = idle_commands(records)
    names = _nearest_to_thrust([name for name in _in_all(records) if name not in still])
    told = placed(records)
    right = _right_names(names, told)
    found = [_thruster(records, name, right[name], told.get(name)) for name in names]
    return sorted(found, key=lambda one: (("port", "starboard", "").index(one.side), one.channel))


def idle_commands(records: Sequence[Record]) -> list[str]:
    """Commands that never move, so that nothing shows a thruster behind them: a pilot logs every output that it has.

    One that the autopilot's parameters call a thruster's is none of them, nor is any where no command moves.
    """
    names = _in_all(records)
    still = [name for name in names if stands_still(records, name)]
    return [] if still == names else [name for name in still if stated_output(records, name) is None]


def stated_output(records: Sequence[Record], name: str) -> Output | None:
    """What the autopilot's parameters say of a command; None where no log tells."""
    channels = [record.log.channels[name] for record in records]
    return next((channel.output for channel in channels if channel.output is not None), None)


def _in_all(records: Sequence[Record]) -> list[str]:
    return sorted(set.intersection(*(set(record.commands) for record in records)) if records else set())


def _nearest_to_thrust(names: Sequence[str]) -> list[str]:
    """One command of each thruster: a simulator logs a force beside its pulses, an autopilot what it wants as a share.

    >>> _nearest_to_thrust(["newton_port", "normalized_left", "pwm_port", "pwm_stbd"])
    ['newton_port', 'pwm_stbd']
    """
    kinds = {name: command_kind(name) or ("", name) for name in names}
    shares = {kind for kind, _ in kinds.values()} == {"normalized"}
    named = {name: told for name, told in kinds.items() if shares or told[0] != "normalized"}
    nearest: dict[str, str] = {}
    for name in sorted(named, key=lambda name: _NEAREST.index(named[name][0])):
        nearest.setdefault(named[name][1], name)
    return [name for name in names if name in nearest.values()]


def _right_names(names: Sequence[str], told: dict[str, Answer]) -> dict[str, str]:
    """What each command should be called, by the sides that the log shows; as it is where these are not certain."""
    sided = {name: told[name].side for name in names if name in told and told[name].side}
    wrong = [name for name, side in sided.items() if side_of(name) and side_of(name) != side]
    swapped = {name: other_side(name) for name in wrong}
    if wrong and set(swapped.values()) == set(wrong):
        return {name: swapped.get(name, name) for name in names}
    nameless = [name for name in sided if not side_of(name)]
    if len(names) == 2 and len(nameless) == 2 and len(set(sided.values())) == 2:
        word = {"port": "port", "starboard": "stbd"}
        return {name: f"{kind_of(name)}_{word[sided[name]]}" for name in names}
    return {name: in_vehicle_file(name) for name in names}


def _thruster(records: Sequence[Record], name: str, right: str, told: Answer | None) -> DetectedThruster:
    turned = told is not None and told.ahead < 0
    output = _output(records, name)
    if turned:
        twice = 2.0 * output.neutral
        words = f"{output.source}; turned round about {output.neutral:g}"
        output = replace(output, astern=twice - output.ahead, ahead=twice - output.astern, source=words)
    by_log = told is not None and bool(told.side or told.ahead)
    told_by_file = any(record.log.channels[name].output is not None for record in records)
    pulses = kind_of(name) == "pwm"
    rested = not pulses or told_by_file or neutral_of(records, name) is not None
    shaped = output.asymmetry != 1.0 or kind_of(name) in ("newton", "tau") or output.astern >= output.neutral
    return DetectedThruster(right, name, output, side_of(right), turned, by_log, rested, shaped)


def _output(records: Sequence[Record], name: str) -> Output:
    """Neutral, ends and shape of a command: by the log's parameters, else by its values and what is usual."""
    channels = [record.log.channels[name] for record in records]
    stated = stated_output(records, name)
    if stated is not None:
        return stated if stated.expo else replace(stated, expo=1.0)
    kind = kind_of(name)
    low, high = min(float(c.value.min()) for c in channels), max(float(c.value.max()) for c in channels)
    if kind == "normalized":
        return Output(0.0, -1.0, 1.0, "a share of full command by its kind", expo=1.0)
    if kind in ("newton", "tau", "rad_s"):
        reach = max(abs(low), abs(high), 1e-6)
        source = f"the largest command in the log, {reach:.4g}, either way"
        return Output(0.0, -reach, reach, source, expo=1.0 if kind == "rad_s" else 0.0)
    rest = neutral_of(records, name)
    neutral = _PULSES[1] if rest is None else rest
    where = "usual; the boat is never seen at rest" if rest is None else "while the boat lies at rest in the log"
    source = f"neutral {neutral:g} us {where}, ends 1100 and 1900 us usual"
    if low < _PULSES[0] or high > _PULSES[2]:
        source += f", widened to the log's {low:g} to {high:g} us"
    # A speed controller that goes ahead only rests at the lower end of its range.
    astern = neutral if neutral <= _PULSES[0] + 1.0 else min(low, _PULSES[0])
    return Output(neutral, astern, max(high, _PULSES[2]), source, expo=1.0)


def surge_at_full(records: Sequence[Record], thrusters: Sequence[DetectedThruster]) -> SurgeAnswer:
    """Surge acceleration with which the boat answers full thrust of all thrusters, ahead and astern.

    Over windows of a few seconds the change of surge speed is the integral of thrust ahead and astern, of linear and
    quadratic drag, and of the turn's v r; so no speed is differentiated. The thrust has that lag, of some, which leaves
    least.
    """
    tables = [_windows(records, thrusters, lag) for lag in _LAGS]
    if len(tables[0]) < _GROUPS * 4:
        return SurgeAnswer(None, None)
    left = [float(np.linalg.lstsq(t[:, :-1], t[:, -1], rcond=None)[1].sum()) for t in tables]
    table = tables[int(np.argmin(left))]
    part = np.arange(len(table)) * _GROUPS // len(table)
    values = _pushes(table)
    without = np.array([_pushes(table[part != k]) for k in range(_GROUPS)])
    errors = np.sqrt((_GROUPS - 1) / _GROUPS * ((without - without.mean(axis=0)) ** 2).sum(axis=0))
    ahead, astern = (
        (float(value), float(error)) if value > _SURE * error else None
        for value, error in zip(values, errors, strict=True)
    )
    share = float(np.sqrt(min(left) / max((table[:, -1] ** 2).sum(), _NO_CHANGE)))
    return SurgeAnswer(ahead, astern, share)


def _windows(records: Sequence[Record], thrusters: Sequence[DetectedThruster], lag: float) -> Array:
    """Integrals over windows (m, 6): thrust ahead, astern, u, u|u|, v r; and the change of surge speed."""
    rows = []
    for record in records:
        for stretch in record.stretches:
            speed, step = stretch.motion.velocity, stretch.motion.time_step
            push = _push(record, stretch, thrusters, np.ones(len(thrusters)) / len(thrusters))
            known = np.isfinite(push)
            push = first_order_lag(np.where(known, push, 0.0), lag, step)
            window = round(_WINDOW / step)
            u, v, r = speed.T
            terms = np.column_stack([np.maximum(push, 0.0), np.minimum(push, 0.0), u, u * np.abs(u), v * r])
            total = np.concatenate([np.zeros((1, 5)), np.cumsum(0.5 * step * (terms[1:] + terms[:-1]), axis=0)])
            rows += [
                [*(total[begin + window] - total[begin]), u[begin + window] - u[begin]]
                for begin in range(0, u.size - window, max(window // 2, 1))
                if known[begin : begin + window].all()
            ]
    return np.array(rows).reshape(-1, 6)


def _pushes(table: Array) -> Array:
    return np.asarray(np.linalg.lstsq(table[:, :-1], table[:, -1], rcond=None)[0][:2], dtype=float)


def _push(record: Record, stretch: Stretch, thrusters: Sequence[DetectedThruster], weights: Array) -> Array:
    """Weighted sum (n,) of the shares of thrust that the commands of a stretch ask for; NaN where one is not known."""
    push = np.zeros(stretch.motion.time.size)
    for one, weight in zip(thrusters, weights, strict=True):
        command = stretch.commands[:, record.commands.index(one.read_as)]
        push += weight * one.share(2.0 * one.output.neutral - command if one.turned else command)
    return push


def drag_at_speed(
    records: Sequence[Record], thrusters: Sequence[DetectedThruster], arms: Sequence[float], axis: int
) -> float | None:
    """Linear drag per newton of full thrust that balances thrust in the log's fastest rows, positive; or None.

    None, too, where thrusters as they are read hardly push there: one is turned round, or something else moves it.

    Parameters
    ----------
    arms : of each thruster to starboard [m]
    axis : 0 for surge [s/m], where rows ahead are looked at; 2 for yaw [m s/rad], where turns to both sides are
    """
    speeds, pushes = [], []
    weights = np.array([_weight(one, arm, axis, thrusters) for one, arm in zip(thrusters, arms, strict=True)])
    for record in records:
        for stretch in record.stretches:
            push = _push(record, stretch, thrusters, weights)
            known = np.isfinite(push)
            speeds.append(stretch.motion.velocity[known, axis])
            pushes.append(push[known])
    speed, push = (np.concatenate(parts) if parts else np.zeros(0) for parts in (speeds, pushes))
    if axis == 2:
        speed, push = np.abs(speed), push * np.sign(speed)
    if not speed.size or (top := float(np.quantile(speed, 0.99))) <= _SLOWEST[axis]:
        return None
    fast = speed >= _FAST * top
    pushed = float(push[fast].mean())
    return pushed / float(speed[fast].mean()) if pushed > _PUSHES * np.abs(weights).sum() else None


def _weight(one: DetectedThruster, arm: float, axis: int, among: Sequence[DetectedThruster]) -> float:
    """What full command does in surge (axis 0) or yaw (2), over the full thrust of the strongest [1 or m]."""
    if one.kind == "tau":
        most = max(other.output.ahead for other in among)
        return one.output.ahead / most if one.name == {0: "surge", 2: "yaw"}[axis] else 0.0
    return 1.0 if axis == 0 else -arm


def top_speed(records: Sequence[Record]) -> float:
    """Speed that logs exceed in a hundredth of their time only [m/s]."""
    speeds = [np.hypot(*stretch.motion.velocity[:, :2].T) for record in records for stretch in record.stretches]
    return float(np.quantile(np.concatenate(speeds), 0.99)) if speeds else 0.0


_SLOWEST = {0: 0.2, 2: 0.1}
"""Top speed [m/s] and yaw rate [rad/s] below which a log says nothing of drag."""
