"""Thrusters: from a logged command to a force, with every fault the catalogue knows."""

from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator
from scipy.signal import lfilter

from .frames import Array

CommandKind = Literal["pwm", "normalized", "rad_s", "newton"]
_NEUTRAL_PWM, _HALF_RANGE_PWM = 1500.0, 500.0


class TableCurve(BaseModel):
    """Command to force [N], piecewise linear between points, constant beyond the ends."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
    kind: Literal["table"]
    command: tuple[float, ...] = Field(min_length=2)
    force: tuple[float, ...] = Field(min_length=2)

    @model_validator(mode="after")
    def _ordered(self) -> "TableCurve":
        if len(self.command) != len(self.force):
            raise ValueError(
                f"command has {len(self.command)} points, force has {len(self.force)}; give one force a command"
            )
        if any(b <= a for a, b in zip(self.command, self.command[1:], strict=False)):
            raise ValueError("command points must increase")
        return self

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
        force = np.asarray(self.force)
        crossing = np.flatnonzero((force[:-1] < 0) & (force[1:] > 0))
        at_zero = np.flatnonzero(force == 0)
        if at_zero.size:
            return float(np.mean([self.command[at_zero[0]], self.command[at_zero[-1]]]))
        if crossing.size:
            k = int(crossing[0])
            return float(np.interp(0.0, force[k : k + 2], self.command[k : k + 2]))
        return _NEUTRAL_PWM if kind == "pwm" else 0.0


class PropellerCurve(BaseModel):
    """Force = k_t rho diameter^4 n|n| [N], n = command scaled (Fossen 2021, eq. 9.4 with constant k_T).

    For `pwm`, n = (command - 1500)/500 * scale + offset; for `normalized`, n = command * scale + offset; for `rad_s`
    the command is n itself, so k_t belongs to the unit of n (the paper's map gives rad/s). A `newton` command is a
    force already and takes a table.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
    kind: Literal["propeller"]
    scale: float = Field(gt=0)
    offset: float = 0.0
    k_t: float = Field(gt=0)
    rho: float = Field(gt=0)
    diameter: float = Field(gt=0)

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


class Thruster(BaseModel):
    """One thruster: where it sits, how its command becomes force, and what may be wrong with it.

    `x`, `y` [m] in body axes, `angle` [rad] (0 pushes ahead, positive turns the push to starboard); the faults are the
    parameters of the catalogue's thruster effects, at their null values when absent.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
    name: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")
    x: float
    y: float
    angle: float = 0.0
    command: CommandKind
    curve: Annotated[TableCurve | PropellerCurve, Field(discriminator="kind")]
    scale: float = Field(default=1.0, ge=0)
    thrust_scale: float = Field(default=1.0, ge=0)
    reverse_scale: float = Field(default=1.0, ge=0)
    dead_zone: float = Field(default=0.0, ge=0, lt=1)
    lag: float = Field(default=0.0, ge=0)
    delay: float = Field(default=0.0, ge=0)
    advance_loss: float = 0.0

    @model_validator(mode="after")
    def _consistent(self) -> "Thruster":
        if self.command == "newton" and self.curve.kind == "propeller":
            raise ValueError("a newton command is a force already; give a table curve, or another kind of command")
        return self

    @property
    def channel(self) -> str:
        """Name of the log channel that carries this thruster's command, for example `pwm_port`."""
        return f"{self.command}_{self.name}"

    def response(self, command: Array, time_step: float) -> tuple[Array, Array]:
        """Force at zero speed [N] and its loss per advance speed [N s/m], along a command series.

        Parameters
        ----------
        command : (n,) in the unit of `command`, even steps
        time_step : [s]
        """
        delayed = shift(command, self.delay, time_step)
        lagged = first_order_lag(delayed, self.lag, time_step)
        fraction = self.curve.normalised(lagged, self.command)
        force = self.curve.thrust(lagged, self.command) * (self.scale * self.thrust_scale)
        if self.reverse_scale != 1.0:
            force = np.where(fraction < 0, force * self.reverse_scale, force)
        load = self.advance_loss * np.abs(fraction)
        if self.dead_zone > 0:
            alive = np.abs(fraction) > self.dead_zone
            force, load = force * alive, load * alive
        return force, load


def shift(series: Array, delay: float, time_step: float) -> Array:
    """Delay a series by `delay` [s], any real number of samples; the ends hold their value."""
    if delay == 0.0:
        return series
    index = np.arange(series.size, dtype=float)
    return np.interp(index - delay / time_step, index, series)


def first_order_lag(series: Array, time_constant: float, time_step: float) -> Array:
    """Response of `T y' = x - y` to a series that is linear between samples, starting at rest (y = x at the start).

    Exact (first-order hold): y[k+1] = a y[k] + b0 x[k] + b1 x[k+1], a = exp(-h/T).
    """
    if time_constant < 1e-6 * time_step or time_constant <= 0:
        return series
    ratio = time_step / time_constant
    a = np.exp(-ratio)
    slope = (1.0 - a) / ratio
    b0, b1 = slope - a, 1.0 - slope
    start = np.array([series[0] * (b0 + a)])
    filtered, _ = lfilter([b1, b0], [1.0, -a], series, zi=start)
    return np.asarray(filtered, dtype=float)
