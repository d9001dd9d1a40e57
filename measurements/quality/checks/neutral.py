"""The PWM at which the thrusters stand still: what the commands are while the boat lies at rest."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from ....physics.thrusters import resting_commands
from ...canonical import LIMITS, command_kind
from ..finding import Check, Finding
from ..quick_motion import neutral_of
from ..record import Record

USUAL = 1500.0
"""The PWM at which the thruster curves of vehicle files have their zero, unless they say otherwise [us]."""
_OFF = 3.0
"""Distance from the usual neutral from which it matters [us]: one per cent of the thrust command is 4 to 5."""
_AT_END = 0.05
"""Share of the range of the commands within which a neutral is at its end: an ESC that drives one way only."""


@final
class Neutral(Check):
    """Finds the value at which each PWM stays while nothing moves."""

    name: ClassVar[str] = "neutral"

    def examine(self, records: Sequence[Record]) -> list[Finding]:
        """See `Check`: one finding for all PWM channels."""
        names = sorted(
            {name for record in records for name in record.commands if (command_kind(name) or ("",))[0] == "pwm"}
        )
        if not names:
            return []
        found = {name: value for name in names if (value := neutral_of(records, name)) is not None}
        if not found:
            text = "the boat is never at rest with a steady command; the neutral PWM is not known"
            return [Finding(check=self.name, verdict="cannot tell", sentence=text, channels=tuple(names))]
        zeros = _zeros(records, found)
        if zeros:
            return [_compared(found, zeros, _range(records, names))]
        off = {name: value for name, value in found.items() if abs(value - USUAL) >= _OFF}
        told = _listed(found)
        parts = dict(found)
        lows, highs = _range(records, names)
        parts |= {"lowest": lows, "highest": highs}
        value = float(np.median(list((off or found).values())))
        if not off:
            text = f"neutral PWM is {told}, range {lows:.0f} to {highs:.0f}"
            return [
                Finding(
                    check=self.name,
                    verdict="ok",
                    sentence=text,
                    value=value,
                    unit="us",
                    channels=tuple(found),
                    parts=parts,
                )
            ]
        least = min(abs(end - value) for end in (lows, highs))
        curve = f"set the curve's zero in the vehicle file to {value:g}"
        if least <= _AT_END * (highs - lows):
            return [
                Finding(
                    check=self.name,
                    verdict="warning",
                    sentence=f"neutral PWM is {told}, at an end of the range {lows:.0f} to {highs:.0f}",
                    value=value,
                    unit="us",
                    channels=tuple(off),
                    consequence=f"a model with its zero at {USUAL:.0f} takes rest for full thrust",
                    remedy=curve,
                    parts=parts,
                    short=f"neutral PWM is {value:g} us",
                )
            ]
        low, high = LIMITS["pwm"]
        mapped = f", or map each with 'offset: {USUAL - value:+g}'"
        fits = all(low <= lows + USUAL - one and highs + USUAL - one <= high for one in off.values())
        return [
            Finding(
                check=self.name,
                verdict="warning",
                sentence=f"neutral PWM is {told}, not {USUAL:.0f}; range {lows:.0f} to {highs:.0f}",
                value=value,
                unit="us",
                channels=tuple(off),
                consequence=f"a model with its zero at {USUAL:.0f} pushes with "
                f"{100.0 * abs(value - USUAL) / least:.1f} % of the "
                "command at rest, and ahead and astern seem unlike",
                remedy=f"{curve}, as init does{mapped * fits}",
                parts=parts,
                short=f"neutral PWM is {value:g} us",
            )
        ]


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

    @property
    def middle(self) -> float:
        """Its middle."""
        return 0.5 * (self.low + self.high)

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


def _compared(found: Mapping[str, float], zeros: Mapping[str, _Zero], ends: tuple[float, float]) -> Finding:
    """The neutral beside what says where it must be. Nothing is shifted: which of the two is right, a person knows."""
    parts = dict(found) | {"lowest": ends[0], "highest": ends[1]}
    off = {n: value for n, value in found.items() if n in zeros and zeros[n].off(value) >= _OFF}
    name = next(iter(off or zeros))
    value, zero = found[name], zeros[name]
    text = f"neutral PWM is {_listed(found)}, range {ends[0]:.0f} to {ends[1]:.0f}"
    if off:
        moves = ", ".join(f"{n} by 'offset: {zeros[n].middle - v:+.4g}'" for n, v in off.items())
        text = f"neutral PWM is {_listed(off)}, but {zero.words} at {zero}; range {ends[0]:.0f} to {ends[1]:.0f}"
        return Finding(
            check=Neutral.name,
            verdict="warning",
            sentence=text,
            value=value,
            unit="us",
            channels=tuple(off),
            consequence="a model pushes at rest, and ahead and astern seem unlike",
            remedy=f"set the curve's zero in the vehicle file to {value:g}, or map {moves} if the log was not "
            "shifted already",
            parts=parts,
            short=f"neutral PWM is {value:g} us, not {zero}",
        )
    known = zero.by_vehicle or abs(value - USUAL) < _OFF
    remedy = f"set the curve's zero in the vehicle file to {value:g}; --vehicle V tells whether it is"
    return Finding(
        check=Neutral.name,
        verdict="ok" if known else "note",
        sentence=f"{text}; {zero.words} there",
        value=value,
        unit="us",
        channels=tuple(found),
        remedy="" if known else remedy,
        parts=parts,
    )


def _range(records: Sequence[Record], names: Sequence[str]) -> tuple[float, float]:
    values = [record.log.channels[name].value for record in records for name in names if name in record.log.channels]
    return float(min(v.min() for v in values)), float(max(v.max() for v in values))


def _listed(values: Mapping[str, float]) -> str:
    if len(set(values.values())) == 1 and len(values) > 1:
        return f"{next(iter(values.values())):g} us on all {len(values)} thrusters"
    return ", ".join(f"{value:g} us ({name})" for name, value in values.items())
