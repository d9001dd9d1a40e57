"""Small writer of MCAP files whose messages are JSON: a simulated world as a program without ROS would log it."""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bags import nanoseconds
from mcap.writer import Writer

from undertow.physics.worlds.world import SimulatedLog


@dataclass(frozen=True)
class Text:
    """One message: topic, what stands in it (bytes are written as they are), receipt [ns], and name of its schema."""

    topic: str
    content: Any
    received: int
    kind: str = ""


def write_json(
    path: Path, messages: Iterable[Text], schemas: dict[str, Any] | None = None, chunks: bool = True
) -> Path:
    """Write an MCAP file; a kind that is not in `schemas` has an empty schema, and an empty kind has none.

    Without `chunks` no checksum guards the messages.
    """
    with path.open("wb") as stream:
        writer = Writer(stream, use_chunking=chunks)
        writer.start()
        channels: dict[str, int] = {}
        for message in messages:
            if message.topic not in channels:
                schema = json.dumps((schemas or {}).get(message.kind, {})).encode()
                number = writer.register_schema(message.kind, "jsonschema", schema) if message.kind else 0
                channels[message.topic] = writer.register_channel(message.topic, "json", number)
            raw = message.content if isinstance(message.content, bytes) else json.dumps(message.content).encode()
            writer.add_message(channels[message.topic], message.received, raw, message.received)
        writer.finish()
    return path


def numbers(names: Iterable[str]) -> dict[str, Any]:
    """A JSON Schema of an object of numbers."""
    return {"type": "object", "properties": {name: {"type": "number"} for name in names}}


STATE = ("x", "y", "psi", "u", "v", "r")


def texts_of(world: SimulatedLog, namespace: str = "") -> list[Text]:
    """A world by canonical names: its motion on one topic, its commands on another."""
    channels = [thruster.channel for thruster in world.vehicle.thrusters]
    motion = [
        Text(f"{namespace}/state", dict(zip(STATE, row, strict=True)), nanoseconds(time), "boat.State")
        for time, row in zip(world.odometry_time, world.odometry.tolist(), strict=True)
    ]
    commands = [
        Text(f"{namespace}/thrusters", dict(zip(channels, row, strict=True)), nanoseconds(time), "boat.Thrusters")
        for time, row in zip(world.command_time, world.commands.tolist(), strict=True)
    ]
    return sorted([*motion, *commands], key=lambda message: message.received)
