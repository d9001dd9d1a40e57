"""A ROS 2 node that publishes each thruster's command on a topic of its own, and stops all of them at its end."""

from pathlib import Path

from ..known_facts import filled, remarks
from .base import Mission, MissionFormat


def _node(mission: Mission) -> str:
    rows = [f"    ({begin!r}, {row!r})," for begin, row in mission.held]
    return remarks(mission.about) + filled(
        Path(__file__).with_name("mission_node.py.in"),
        topics=tuple(t.channel for t in mission.thrusters),
        rest=mission.rest,
        rows="\n".join(rows),
        seconds=mission.seconds,
    )


ROS_NODE = MissionFormat("mission_node.py", "a node for ROS 2: python3 mission_node.py publishes the commands", _node)
