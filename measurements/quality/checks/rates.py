"""Check of the sampling: rates of the channels, their jitter, and gaps."""

from collections.abc import Sequence

import numpy as np

from ....physics.presentation import counted, number
from ...canonical import MOTION, Channel, command_kind
from ...preparation.resampling import gap_limit, gaps, is_logged_on_change
from ..record import About, Check, Found, Record, Verdict

_SLOW, _TOO_SLOW = 4.5, 1.0
"""Rates below which motion is coarse, and below which it is not seen [Hz]."""
_JITTER = 0.3
"""Share of its period by which a channel's stamps may stray before it matters."""
_MUCH = 0.05
"""Share of the time without data from which gaps are a loss."""


def _rates(records: Sequence[Record]) -> Found:
    """Say how often the motion is sampled."""
    rates: dict[str, float] = {}
    jitter: dict[str, float] = {}
    for channel in _motion(records):
        if channel.period > 0.0:
            rates[channel.name] = min(rates.get(channel.name, np.inf), 1.0 / channel.period)
            jitter[channel.name] = max(jitter.get(channel.name, 0.0), _strays(channel))
    if not rates:
        return About("rates", unit="Hz").untold("no channel of motion has two samples")
    slowest, fastest = min(rates, key=lambda n: rates[n]), max(rates, key=lambda n: rates[n])
    value = float(rates[slowest])
    told = f"motion is sampled at {value:.3g} Hz"
    if rates[fastest] > 1.05 * value:
        told += f" ({slowest}) to {rates[fastest]:.3g} Hz ({fastest})"
    shaky = max(jitter, key=lambda n: jitter[n])
    verdict: Verdict = "ok"
    channels, wrong, remedy = tuple(rates), "", ""
    if value < _SLOW:
        verdict, channels = "defect" if value < _TOO_SLOW else "warning", (slowest,)
        wrong = f"turns and onsets of thrust that last less than {2.0 / value:.2g} s are not seen"
        remedy = "record at 10 Hz or more"
    elif jitter[shaky] > _JITTER:
        verdict, channels = "note", (shaky,)
        told = f"{told}, but stamps of {shaky} stray by {100.0 * jitter[shaky]:.0f} % of their step"
        wrong = "speeds derived from positions, and accelerations, are noisier than the sensor"
        remedy = "log the stamp of the measurement and not that of its arrival"
    return About("rates", channels, value, "Hz", parts={name: float(rate) for name, rate in rates.items()}).finding(
        verdict, told, consequence=wrong, remedy=remedy
    )


def _gaps(records: Sequence[Record]) -> Found:
    """Count the stretches without data."""
    holes: dict[str, list[tuple[float, float]]] = {}
    lost, whole, count = 0.0, 0.0, 0
    for record in records:
        here: list[tuple[float, float]] = []
        for channel in record.log.channels.values():
            if command_kind(channel.name) and is_logged_on_change(channel):
                continue
            found = gaps(channel, gap_limit(channel, None))
            holes.setdefault(channel.name, []).extend(found)
            here += found
        length, pieces = _union(here)
        lost, count = lost + length, count + pieces
        whole += max((c.time[-1] - c.time[0] for c in record.log.channels.values()), default=0.0)
    about = About("gaps", unit="1")
    names = tuple(name for name, found in holes.items() if found)
    if not names:
        return about.ok("no gaps", value=0.0)
    share = lost / whole if whole > 0.0 else 1.0
    longest = max(high - low for found in holes.values() for low, high in found)
    gaps_in = f"{counted(count, 'gap')} in {', '.join(names)}"
    text = f"{gaps_in}, the longest {longest:.2g} s: {number(100.0 * share, 2)} % of the time"
    return about.finding(
        "warning" if share > _MUCH else "note",
        text,
        value=share,
        channels=names,
        consequence="the log falls into stretches there; those under 5 s are lost",
        remedy="find out what stopped the logger; nothing is interpolated across a gap",
        parts={"longest": longest},
    )


def _motion(records: Sequence[Record]) -> list[Channel]:
    return [r.log.channels[name] for r in records for name in MOTION if name in r.log.channels]


def _strays(channel: Channel) -> float:
    """How far the usual step strays from the period, as a share of it; dropped samples do not count."""
    steps = np.diff(channel.time)
    usual = steps[(steps < 1.5 * channel.period) & (steps > 0.0)]
    return float(np.std(usual) / channel.period) if usual.size else 0.0


def _union(spans: list[tuple[float, float]]) -> tuple[float, int]:
    """Length of the union of spans [s], and of how many pieces it is."""
    total, pieces, end = 0.0, 0, -np.inf
    for low, high in sorted(spans):
        total += max(0.0, high - max(low, end))
        pieces += low > end
        end = max(end, high)
    return total, pieces


RATES = Check("rates", _rates)


GAPS = Check("gaps", _gaps)
