"""A ROS 2 node that publishes each thruster's command on a topic of its own, and stops all of them at its end."""

from .base import Mission, MissionFormat

_NODE = '''\
import signal
from time import sleep

import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Float64

TOPICS = {topics!r}
REST = {rest!r}
HELD = (  # from when [s], and the command of each topic in its own unit
{rows}
)
SECONDS = {seconds!r}
PERIOD = 0.05
LAST = 10  # times that rest is sent at the end, half a second


class Mission(Node):
    """Publishes the commands of one manoeuvre, at 20 Hz, by the clock of the node."""

    def __init__(self):
        super().__init__("undertow_mission")
        self.senders = [self.create_publisher(Float64, topic, 10) for topic in TOPICS]
        self.begun = None
        self.done = False
        self.create_timer(PERIOD, self.tick)

    def tick(self):
        """Send what is held now; at the end, rest."""
        now = self.get_clock().now().nanoseconds * 1e-9
        if self.begun is None:
            self.begun = now
        time = now - self.begun
        if time >= SECONDS:
            self.done = True
        self.send(REST if self.done else [row for begin, row in HELD if begin <= time + 1e-3][-1])

    def send(self, commands):
        """Publish one command a topic."""
        for sender, command in zip(self.senders, commands):
            message = Float64()
            message.data = float(command)
            sender.publish(message)


ENDS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


def broken_off(number, frame):
    """End the manoeuvre, whoever asks for it."""
    raise KeyboardInterrupt


def main():
    """Drive the manoeuvre once; Ctrl-C, a closed terminal and kill stop the boat."""
    # With its own handlers rclpy would close the topics before the last command is out.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = Mission()
    try:
        for number in ENDS:
            signal.signal(number, broken_off)
        while rclpy.ok() and not node.done:
            rclpy.spin_once(node, timeout_sec=PERIOD)
    except KeyboardInterrupt:
        node.get_logger().info("broken off: all thrusters at rest")
    finally:
        for number in ENDS:
            signal.signal(number, signal.SIG_IGN)
        for _ in range(LAST):
            node.send(REST)
            sleep(PERIOD)
        node.destroy_node()
        rclpy.shutdown()


if __name__ == "__main__":
    main()
'''


def _node(mission: Mission) -> str:
    rows = [f"    ({begin!r}, {row!r})," for begin, row in mission.held]
    about = "".join(f"# {line}\n" if line else "#\n" for line in mission.about)
    return about + _NODE.format(
        topics=tuple(t.channel for t in mission.thrusters),
        rest=mission.rest,
        rows="\n".join(rows),
        seconds=mission.seconds,
    )


ROS_NODE = MissionFormat("mission_node.py", "a node for ROS 2: python3 mission_node.py publishes the commands", _node)
