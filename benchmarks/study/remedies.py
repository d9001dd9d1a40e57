"""Faults whose remedies look alike, planted alone and together, and what must be told of each."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from undertow.measurements.canonical import Channel, command_kind
from undertow.measurements.log import Log
from undertow.measurements.quality.record import Finding

Channels = dict[str, Channel]
ALIKE = ("direction", "sides", "clocks", "exchanged")
"""Checks whose faults look like each other's."""


@dataclass(frozen=True, slots=True)
class Fault:
    """Something wrong with a log of sound channels.

    Attributes
    ----------
    name : for the table
    plant : changes the channels
    told : the checks of `ALIKE` that must accuse; no other of them may
    """

    name: str
    plant: Callable[[Channels], Channels]
    told: tuple[str, ...]

    def of(self, log: Log) -> Log:
        """The log with the fault."""
        return replace(log, channels=self.plant(dict(log.channels)))


def accused(findings: tuple[Finding, ...]) -> set[str]:
    """The checks of `ALIKE` that accuse a log; of clocks, those of the commands."""
    return {
        f.check
        for f in findings
        if f.verdict in ("warning", "defect")
        and f.check in ALIKE
        and (f.check != "clocks" or any(command_kind(name) for name in f.channels))
    }


def _late(seconds: float) -> Callable[[Channels], Channels]:
    def plant(channels: Channels) -> Channels:
        return {n: replace(c, time=c.time + seconds) if command_kind(n) else c for n, c in channels.items()}

    return plant


def _reversed(*sides: str) -> Callable[[Channels], Channels]:
    def plant(channels: Channels) -> Channels:
        return {n: _turned(c) if command_kind(n) and n.endswith(sides) else c for n, c in channels.items()}

    return plant


def _turned(channel: Channel) -> Channel:
    return replace(channel, value=(3000.0 if channel.name.startswith("pwm") else 0.0) - channel.value)


def swapped(channels: Channels) -> Channels:
    """Port and starboard under each other's names."""
    other = {n: n.replace("port", "stbd") if n.endswith("port") else n.replace("stbd", "port") for n in channels}
    return {n: replace(channels[other[n]], name=n) if command_kind(n) else c for n, c in channels.items()}


def exchanged(channels: Channels) -> Channels:
    """Surge and sway under each other's names."""
    u, v = channels["u"], channels["v"]
    return channels | {"u": replace(v, name="u"), "v": replace(u, name="v")}


def _without_positions(channels: Channels) -> Channels:
    return {n: c for n, c in channels.items() if n not in ("x", "y")}


FAULTS = (
    Fault("nothing", dict, ()),
    *(Fault(f"commands {s:g} s late", _late(s), ("clocks",)) for s in (0.2, 0.5, 1.0, 2.0, 3.0)),
    Fault("commands 1 s early", _late(-1.0), ()),
    Fault("commands 3 s early", _late(-3.0), ("clocks",)),
    Fault("port reversed", _reversed("port"), ("direction",)),
    Fault("both reversed", _reversed("port", "stbd"), ("direction",)),
    Fault("sides swapped", swapped, ("sides",)),
    Fault("port reversed, 1 s late", lambda c: _late(1.0)(_reversed("port")(c)), ("clocks", "direction")),
    Fault("sides swapped, 1 s late", lambda c: _late(1.0)(swapped(c)), ("clocks", "sides")),
    Fault("sides swapped, port reversed", lambda c: swapped(_reversed("port")(c)), ("direction", "sides")),
)
"""Faults of a log with or without speeds of its own."""

SPEED_FAULTS = (
    Fault("u and v exchanged", exchanged, ("exchanged",)),
    Fault("u and v exchanged, 1 s late", lambda c: _late(1.0)(exchanged(c)), ("clocks", "exchanged")),
    Fault("u and v exchanged, no positions", lambda c: _without_positions(exchanged(c)), ("exchanged",)),
    Fault("no positions", _without_positions, ()),
)
"""Faults of speeds."""
