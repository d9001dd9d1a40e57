"""Thrusters: from a logged command to a force, with every fault the catalogue knows."""

from collections.abc import Sequence
from operator import attrgetter
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BaseModel, Field, model_validator

from .errors import RequestError
from .motion import Array
from .reading import Number, Positive
from .sampled_series import Switches, first_order_lag, shift, switches

_SIDES = {"port": "port", "left": "port", "stbd": "starboard", "starboard": "starboard", "right": "starboard"}
"""Words in a thruster's name that say on which side it sits."""
_SLIGHT = 0.1
"""Share of a thruster's force, or of its arm, below which its sign says nothing: it is lost in what the file rounds."""
CommandKind = Literal["pwm", "normalized", "rad_s", "newton", "tau"]
_GENERALISED = {"surge": (1.0, 0.0, 0.0), "sway": (0.0, 1.0, 0.0), "yaw": (0.0, 0.0, 1.0)}
"""Columns of B of actuators that are a force ahead, one to starboard, and a moment: generalised forces, as control
papers command them (Fossen 2021, eq. 9.1), whatever makes them."""
_NEUTRAL_PWM, _HALF_RANGE_PWM = 1500.0, 500.0
"""Pulse at rest, and from there to full thrust [us]: servos and speed controllers take 1000 to 2000."""
_MOST_POINTS = 10_000
"""Points of a curve: a command in microseconds has 1,400 steps."""
GAINS = (
    "gain_astern_100",
    "gain_astern_67",
    "gain_astern_33",
    "gain_ahead_33",
    "gain_ahead_67",
    "gain_ahead_100",
)
"""Gains of the command-to-force curve, from full astern to full ahead; the number is where in percent a third ends."""
_PROMPT = ("command", "curve", "reverse_scale", "thrust_exponent", "dead_zone", "lag", *GAINS)
"""What decides the response of a thruster before it is late and wears, beside gain and advance loss."""
_prompt_of = attrgetter(*_PROMPT)
_shape_of = attrgetter(*_PROMPT, "thrust_rate", "delay", "command_offset")


class TableCurve(BaseModel, frozen=True, extra="forbid", allow_inf_nan=False):
    """Command to force [N], piecewise linear between points, constant beyond the ends."""

    kind: Literal["table"]
    command: tuple[Number, ...] = Field(min_length=2, max_length=_MOST_POINTS)
    force: tuple[Number, ...] = Field(min_length=2, max_length=_MOST_POINTS)

    @model_validator(mode="after")
    def _ordered(self) -> "TableCurve":
        if len(self.command) != len(self.force):
            raise ValueError(
                f"command has {len(self.command)} points, force has {len(self.force)}; give one force a command"
            )
        if any(b <= a for a, b in zip(self.command, self.command[1:], strict=False)):
            raise ValueError("command points must increase")
        return self

    def __hash__(self) -> int:
        """Of its ends, for a search looks forces up by the curve of their thruster, thousands of times."""
        return hash((self.command[-1], self.force[-1]))

    def thrust(self, command: Array, kind: CommandKind) -> Array:
        """Force [N] at the given commands."""
        return np.interp(command, self.command, self.force)

    def normalised(self, command: Array, kind: CommandKind) -> Array:
        """Command in -1..1: zero where the table's force is zero, one at its farthest end."""
        neutral = self._neutral(kind)
        reach = max(abs(self.command[0] - neutral), abs(self.command[-1] - neutral))
        reach = reach if self.force[-1] >= self.force[0] else -reach  # a thruster wired the other way round
        return (command - neutral) / reach

    def _neutral(self, kind: CommandKind) -> float:
        ends = self.rest()
        return sum(ends) / 2.0 if ends else _NEUTRAL_PWM if kind == "pwm" else 0.0

    def rest(self) -> tuple[float, float] | None:
        """The commands between which the table pushes neither way; None where it has no such place."""
        force = np.asarray(self.force)
        crossing = np.flatnonzero(force[:-1] * force[1:] < 0)
        at_zero = np.flatnonzero(force == 0)
        if at_zero.size:
            return self.command[at_zero[0]], self.command[at_zero[-1]]
        if crossing.size:
            k = int(crossing[0])
            share = force[k] / (force[k] - force[k + 1])
            zero = float(self.command[k] + share * (self.command[k + 1] - self.command[k]))
            return zero, zero
        return None


class PropellerCurve(BaseModel, frozen=True, extra="forbid", allow_inf_nan=False):
    """Force = k_t rho diameter^4 n|n| [N], n = command scaled (Fossen 2021, eq. 9.4 with constant k_T).

    For `pwm`, n = (command - 1500)/500 * scale + offset; for `normalized`, n = command * scale + offset; for `rad_s`
    the command is n itself, so k_t belongs to the unit of n (the paper's map gives rad/s). A `newton` command is a
    force already and takes a table.
    """

    kind: Literal["propeller"]
    scale: Positive
    offset: Number = 0.0
    k_t: Positive
    rho: Positive
    diameter: Positive

    def __hash__(self) -> int:
        """Of two numbers, see `TableCurve`."""
        return hash((self.scale, self.k_t))

    def thrust(self, command: Array, kind: CommandKind) -> Array:
        """Force [N] at the given commands."""
        if kind in ("pwm", "normalized"):
            speed = self.normalised(command, kind) * self.scale + self.offset
        else:
            speed = command
        return self.k_t * self.rho * self.diameter**4 * speed * np.abs(speed)

    def normalised(self, command: Array, kind: CommandKind) -> Array:
        """Command in -1..1."""
        if kind == "pwm":
            return (command - _NEUTRAL_PWM) / _HALF_RANGE_PWM
        return command if kind == "normalized" else command / self.scale


def _of_the_log(seconds: float) -> float:
    if seconds:
        raise ValueError("this is an error of a log, no property of a thruster; a boat that answers late has a delay")
    return seconds


class Thruster(BaseModel, frozen=True, extra="forbid", allow_inf_nan=False):
    """One thruster: where it sits, how its command becomes force, and what may be wrong with it.

    `x`, `y` [m] in body axes, `angle` [rad] (0 pushes ahead, positive turns the push to starboard). A `tau` command is
    a generalised force: an actuator named `surge`, `sway` or `yaw` is a force [N], or the moment [N m], of the whole
    vessel, with a table and without a place. The faults are the
    parameters of the catalogue's thruster effects, at their null values when absent. `response` says in which order
    they act.

    The exponent bends `curve` between no force and that of full command, on both sides alike (see `powered`).

    `command_offset` [s] belongs to a log and not to the boat: its record of the commands is so much early. No vehicle
    file has it.

    A gain is the slope of the true command-to-force curve over that of `curve`, in one third of the command: 1 leaves
    the curve alone, 0 is a flat stretch, `gain_ahead_67` reigns from 33 to 67 % of full command ahead. No gain is
    negative, so a curve that rises stays one.
    """

    name: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=60)
    x: Number
    y: Number
    angle: Number = 0.0
    command: CommandKind
    curve: Annotated[TableCurve | PropellerCurve, Field(discriminator="kind")]
    scale: Number = Field(default=1.0, ge=0)
    thrust_scale: Number = Field(default=1.0, ge=0)
    arm_scale: Number = Field(default=1.0, ge=0)
    thrust_rate: Number = 0.0
    reverse_scale: Number = Field(default=1.0, ge=0)
    thrust_exponent: Positive = 1.0
    dead_zone: Number = Field(default=0.0, ge=0, lt=1)
    lag: Number = Field(default=0.0, ge=0)
    delay: Number = Field(default=0.0, ge=0)
    advance_loss: Number = 0.0
    command_offset: Annotated[Number, AfterValidator(_of_the_log)] = Field(default=0.0, exclude=True)
    gain_astern_100: Number = Field(default=1.0, ge=0)
    gain_astern_67: Number = Field(default=1.0, ge=0)
    gain_astern_33: Number = Field(default=1.0, ge=0)
    gain_ahead_33: Number = Field(default=1.0, ge=0)
    gain_ahead_67: Number = Field(default=1.0, ge=0)
    gain_ahead_100: Number = Field(default=1.0, ge=0)

    @model_validator(mode="before")
    @classmethod
    def _of_the_whole_vessel(cls, data: Any) -> Any:
        return {"x": 0.0, "y": 0.0, **data} if isinstance(data, dict) and data.get("command") == "tau" else data

    @model_validator(mode="after")
    def _consistent(self) -> "Thruster":
        if self.command == "tau" and self.name not in _GENERALISED:
            raise ValueError(f"a tau command is a force or moment: name it surge, sway or yaw, got {self.name!r}")
        if self.command == "tau" and (self.x, self.y, self.angle) != (0.0, 0.0, 0.0):
            raise ValueError(
                "a tau command acts on the whole vessel: it has no place and no angle; leave x, y, angle out"
            )
        if self.command == "tau" and self.curve.kind == "propeller":
            raise ValueError("a tau command is a force or moment already; give a table curve")
        if self.command == "newton" and self.curve.kind == "propeller":
            raise ValueError("a newton command is a force already; give a table curve, or another kind of command")
        return self

    @property
    def channel(self) -> str:
        """Name of the log channel that carries this thruster's command, for example `pwm_port`."""
        return f"{self.command}_{self.name}"

    @property
    def push(self) -> tuple[float, float, float]:
        """Force ahead, to starboard and moment in yaw of its newton [N, N, N m], its lever arm as the file has it."""
        if self.command == "tau":
            return _GENERALISED[self.name]
        ahead, aside = float(np.cos(self.angle)), float(np.sin(self.angle))
        return ahead, aside, self.x * aside - self.y * ahead

    @property
    def gain(self) -> float:
        """Factor on the force of its shape."""
        return self.scale * self.thrust_scale

    @property
    def unit(self) -> "Thruster":
        """The same shape with a gain and an advance loss of one: `response` is in proportion to each of the two."""
        return self.model_copy(update={"scale": 1.0, "thrust_scale": 1.0, "advance_loss": 1.0})

    @property
    def shape(self) -> tuple[object, ...]:
        """Parameters that decide the response of its `unit`."""
        return _shape_of(self)

    @property
    def prompt_shape(self) -> tuple[object, ...]:
        """Parameters that decide what its `unit` makes of commands before that is late, see `prompt`."""
        return _prompt_of(self)

    @property
    def late(self) -> float:
        """Time by which the force comes after the command on record [s]."""
        return self.delay + self.command_offset

    def response(self, command: Array, time_step: float) -> tuple[Array, Array]:
        """Force at zero speed [N] and its loss per advance speed [N s/m], along a command series.

        In this order: lag, `curve`, exponent, gains, scales, reverse scale, dead zone, offset and delay. Scales
        multiply the bent curve; the dead zone cuts it; the advance loss depends on the command alone and is cut by the
        dead zone too. A row in which a held command switches has the mean of the forces before and after, not the force
        of the mean, unless a lag makes all changes slow.

        Parameters
        ----------
        command : (n,) in the unit of `command`, even steps
        time_step : [s]
        """
        lagged = first_order_lag(command, self.lag, time_step)
        force, load = self.prompt(lagged, switches(lagged))
        return shift(force, self.late, time_step), shift(load, self.late, time_step)

    def prompt(self, lagged: Array, switching: Switches) -> Array:
        """The same before offset and delay act, force and loss (2, n), of a command with its lag and its switches."""
        return switching.between(np.stack(self.lasting(lagged)))

    def lasting(self, command: Array) -> tuple[Array, Array]:
        """Force at zero speed [N] and its loss per advance speed [N s/m] of commands (n,) that have lasted."""
        fraction = self.curve.normalised(command, self.command)
        force = self.bent(self.powered(command)) * self.gain
        if self.reverse_scale != 1.0:
            force = np.where(fraction < 0, force * self.reverse_scale, force)
        load = self.advance_loss * np.abs(fraction)
        if self.dead_zone > 0:
            alive = np.abs(fraction) > self.dead_zone
            force, load = force * alive, load * alive
        return force, load

    def powered(self, command: Array) -> Array:
        """The curve's forces [N] with the exponent applied: F |T / F|^thrust_exponent, and the sign of T.

        F is the force at full command on the same side, which stays; so does no force. An exponent of 0.5 makes a
        straight line of a square law.
        """
        force = self.curve.thrust(command, self.command)
        if self.thrust_exponent == 1.0:
            return force
        ends = self.curve.thrust(command_of(self, np.array([-1.0, 1.0])), self.command)
        full = np.where(force < 0.0, -ends.min(), ends.max())
        full = np.where(full > 0.0, full, np.abs(force))  # a side without any force at its end keeps its forces
        share = np.divide(np.abs(force), full, out=np.zeros_like(full), where=full > 0.0)
        return np.sign(force) * full * share**self.thrust_exponent

    def bent(self, force: Array) -> Array:
        """The curve's forces [N] with the gains applied: each third of the command as much steeper as its gain says.

        The result rises with the force given, and is that force itself at zero command, whatever the gains. Beyond full
        command the outermost gain goes on.
        """
        gains = [getattr(self, name) for name in GAINS]
        if all(gain == 1.0 for gain in gains):
            return force
        ends = self.powered(command_of(self, np.linspace(-1.0, 1.0, 7)))
        if ends[-1] < ends[0]:  # a thruster that was mounted or wired the other way round
            return -self._bent(-force, -ends, gains)
        return self._bent(force, ends, gains)

    @staticmethod
    def _bent(force: Array, ends: Array, gains: Sequence[float]) -> Array:
        """The same for a rising curve, with its forces (7,) where the thirds of the command end."""
        rest = ends[3]
        astern, ahead = np.minimum.accumulate(ends[3::-1])[::-1], np.maximum.accumulate(ends[3:])
        total = np.full_like(force, rest)
        for gain, low, high in zip(gains[:3], (-np.inf, *astern[1:3]), astern[1:], strict=True):
            total = total + gain * (np.clip(force, low, high) - high)
        for gain, low, high in zip(gains[3:], ahead[:3], (*ahead[1:3], np.inf), strict=True):
            total = total + gain * (np.clip(force, low, high) - low)
        return total


def command_of(thruster: Thruster, fraction: Array) -> Array:
    """The command in the thruster's own unit whose normalised value is `fraction`; the inverse of `curve.normalised`.

    A table is not left: where it ends before the fraction does, its end is commanded.

    Raises
    ------
    RequestError
        when the thruster's curve does not tell commands apart.
    """
    at_zero, at_one = (float(thruster.curve.normalised(np.array(c), thruster.command)) for c in (0.0, 1.0))
    if at_one == at_zero:
        raise RequestError(f"thruster {thruster.name}: its curve gives every command the same normalised value")
    command = (np.asarray(fraction, dtype=float) - at_zero) / (at_one - at_zero)
    if isinstance(thruster.curve, TableCurve):
        command = np.clip(command, thruster.curve.command[0], thruster.curve.command[-1])
    return command


def neutral_command(thruster: Thruster) -> float:
    """The command at which a thruster does not push; a propeller curve with an offset has it beside zero."""
    curve = thruster.curve
    fraction = -curve.offset / curve.scale if isinstance(curve, PropellerCurve) else 0.0
    if isinstance(curve, PropellerCurve) and thruster.command == "rad_s":
        return 0.0
    return float(command_of(thruster, np.array(fraction)))


def resting_commands(thruster: Thruster) -> tuple[float, float] | None:
    """The commands between which a thruster does not push: the zero of its curve, and its dead zone about that.

    None where no command stops it, as a table without a zero has it.
    """
    curve = thruster.curve
    alone = neutral_command(thruster)
    zero = curve.rest() if isinstance(curve, TableCurve) else (alone, alone)
    if zero is None or thruster.dead_zone == 0.0:
        return zero
    dead = command_of(thruster, np.array([-thruster.dead_zone, thruster.dead_zone])).tolist()
    return min(*zero, *dead), max(*zero, *dead)


def side_named(name: str) -> str:
    """The side that a thruster's name speaks of, `port` or `starboard`; empty where it speaks of none.

    >>> side_named("stbd"), side_named("bow")
    ('starboard', '')
    """
    sides = {_SIDES[word] for word in name.lower().split("_") if word in _SIDES}
    return sides.pop() if len(sides) == 1 else ""


def push_and_turn(thruster: Thruster) -> tuple[int, int]:
    """Direction in which more command pushes (1 ahead, -1 astern) and turns the boat (1 to starboard, -1 to port).

    0 where it does so with less than a tenth of its force, or of its lever arm.
    """
    ends = np.sort(command_of(thruster, np.array([-1.0, 1.0])))
    low, high = thruster.curve.thrust(ends, thruster.command).tolist()
    ahead, _, arm = thruster.push
    turns = abs(arm) > _SLIGHT * np.hypot(thruster.x, thruster.y)
    rises = int(np.sign(high - low))
    return rises * int(np.sign(ahead) if abs(ahead) > _SLIGHT else 0), rises * int(np.sign(arm) if turns else 0)
