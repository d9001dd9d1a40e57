"""The PWM at which the thrusters stand still: what the commands are while the boat lies at rest."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ....physics.thrusters import resting_commands
from ...canonical import LIMITS, kind_of
from ..quick_motion import neutral_of
from ..record import About, Check, Finding, Found, Record, command_names, values_called

USUAL = 1500.0
"""The PWM at which the thruster curves of vehicle files have their zero, unless they say otherwise [us]."""
_OFF = 3.0
"""Distance from the usual neutral from which it matters [us]: one per cent of the thrust command is 4 to 5."""
_AT_END = 0.05
"""Share of the range of the commands within which a neutral is at its end: an ESC that drives one way only."""


def _neutral(records: Sequence[Record]) -> Found:
    """Find the value at which each PWM stays while nothing moves.

    One finding for all PWM channels.
    """
    names = [name for name in command_names(records) if kind_of(name) == "pwm"]
    if not names:
        return []
    found = {name: value for name in names if (value := neutral_of(records, name)) is not None}
    if not found:
        text = "the boat is never at rest with a steady command; the neutral PWM is not known"
        return About("neutral", tuple(names)).untold(text)
    values = np.concatenate([values_called(records, name) for name in names])
    lows, highs = float(values.min()), float(values.max())
    about = About("neutral", unit="us", parts={**found, "lowest": lows, "highest": highs})
    zeros = _zeros(records, found)
    if zeros:
        return _compared(about, found, zeros, f"range {lows:.0f} to {highs:.0f}")
    off = {name: value for name, value in found.items() if abs(value - USUAL) >= _OFF}
    told = _listed(found)
    value = float(np.median(list((off or found).values())))
    about = replace(about, value=value, channels=tuple(off or found))
    if not off:
        return about.ok(f"neutral PWM is {told}, range {lows:.0f} to {highs:.0f}")
    least = min(abs(end - value) for end in (lows, highs))
    curve, short = f"set the curve's zero in the vehicle file to {value:g}", f"neutral PWM is {value:g} us"
    if least <= _AT_END * (highs - lows):
        return about.warning(
            f"neutral PWM is {told}, at an end of the range {lows:.0f} to {highs:.0f}",
            consequence=f"a model with its zero at {USUAL:.0f} takes rest for full thrust",
            remedy=curve,
            short=short,
        )
    low, high = LIMITS["pwm"]
    mapped = f", or map each with 'offset: {USUAL - value:+g}'"
    fits = all(low <= lows + USUAL - one and highs + USUAL - one <= high for one in off.values())
    return about.warning(
        f"neutral PWM is {told}, not {USUAL:.0f}; range {lows:.0f} to {highs:.0f}",
        consequence=f"a model with its zero at {USUAL:.0f} pushes with "
        f"{100.0 * abs(value - USUAL) / least:.1f} % of the command at rest, and ahead and astern seem unlike",
        remedy=f"{curve}, as init does{mapped * fits}",
        short=short,
    )


@dataclass(frozen=True, slots=True)
class _Zero:
    """Where neutral should be: between two values of a channel, in which words, and whether the vehicle says so."""

    low: float
    high: float
    words: str
    by_vehicle: bool

    def off(self, value: float) -> float:
        """How far a neutral is beside it."""
        return max(self.low - value, value - self.high)

    def __str__(self) -> str:
        return f"{self.low:.4g}" if self.low == self.high else f"{self.low:.4g} to {self.high:.4g}"


def _zeros(records: Sequence[Record], found: Mapping[str, float]) -> dict[str, _Zero]:
    """What says where neutral is, by channel: the vehicle's curve, or else the log's parameters."""
    zeros: dict[str, _Zero] = {}
    for record in records:
        own = {t.channel: resting_commands(t) for t in record.vehicle.thrusters} if record.vehicle else {}
        for name in found:
            stated = record.log.channels[name].output if name in record.log.channels else None
            ends = own.get(name)
            if ends is not None:
                zeros[name] = _Zero(*ends, "the vehicle's curve has its zero", True)
            elif stated is not None:
                zeros.setdefault(name, _Zero(stated.neutral, stated.neutral, "the log's parameters have it", False))
    return zeros


def _compared(about: About, found: Mapping[str, float], zeros: Mapping[str, _Zero], reach: str) -> Finding:
    """The neutral beside what says where it must be. Nothing is shifted: which of the two is right, a person knows."""
    off = {n: value for n, value in found.items() if n in zeros and zeros[n].off(value) >= _OFF}
    name = next(iter(off or zeros))
    value, zero = found[name], zeros[name]
    about = replace(about, value=value, channels=tuple(off or found))
    curve = f"set the curve's zero in the vehicle file to {value:g}"
    if off:
        middle = {n: 0.5 * (zeros[n].low + zeros[n].high) for n in off}
        moves = ", ".join(f"{n} by 'offset: {middle[n] - v:+.4g}'" for n, v in off.items())
        return about.warning(
            f"neutral PWM is {_listed(off)}, but {zero.words} at {zero}; {reach}",
            consequence="a model pushes at rest, and ahead and astern seem unlike",
            remedy=f"{curve}, or map {moves} if the log was not shifted already",
            short=f"neutral PWM is {value:g} us, not {zero}",
        )
    known = zero.by_vehicle or abs(value - USUAL) < _OFF
    return about.finding(
        "ok" if known else "note",
        f"neutral PWM is {_listed(found)}, {reach}; {zero.words} there",
        remedy="" if known else f"{curve}; --vehicle V tells whether it is",
    )


def _listed(values: Mapping[str, float]) -> str:
    if len(set(values.values())) == 1 and len(values) > 1:
        return f"{next(iter(values.values())):g} us on all {len(values)} thrusters"
    return ", ".join(f"{value:g} us ({name})" for name, value in values.items())


NEUTRAL = Check("neutral", _neutral)
