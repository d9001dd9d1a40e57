"""When a message of a bag was true: header stamps, receive times, and clocks that differ."""

from dataclasses import replace

import numpy as np
import pytest
from bags import EPOCH, Message, nanoseconds, recorded, write_mcap, write_ros1, write_ros2
from logged import note

from undertow.measurements.log import read_log
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.workflows.discover_and_add import discover
from undertow.workflows.inputs import read_inputs

TIME = np.arange(0.0, 30.0, 0.1)


def odometry(values=(), late=0.0, header=lambda time: nanoseconds(time), topic="/odometry"):
    """A straight run north at 1 m/s, as odometry; `header` gives the stamp."""
    found = []
    for time in TIME:
        fields = {"pose.pose.position.y": time, "pose.pose.orientation.z": np.sqrt(0.5)}
        fields |= {"pose.pose.orientation.w": np.sqrt(0.5), "twist.twist.linear.x": 1.0, **dict(values)}
        stamp = nanoseconds(time) + round(1e9 * late)
        found.append(Message(topic, "nav_msgs/msg/Odometry", fields, stamp, header(time), "odom"))
    return found


def thrust(offset=0.0):
    return [
        Message(f"/{side}/thrust", "std_msgs/msg/Float64", {"data": 10.0 * time}, nanoseconds(time + offset))
        for time in TIME
        for side in ("left", "right")
    ]


def test_header_stamps_are_preferred_to_receive_times_and_said_where_they_differ(tmp_path):
    log = read_log(write_ros2(tmp_path / "bag", [*thrust(), *odometry(late=0.25)]))
    np.testing.assert_allclose(log.channels["x"].value, log.channels["x"].time, atol=1e-9)
    note(log, "/odometry: received 0.250 s (median)", "which are used")
    punctual = read_log(write_ros2(tmp_path / "other", [*thrust(), *odometry(late=0.001)]))
    assert not any("received" in text for text in punctual.notes)


@pytest.mark.parametrize(
    ("header", "why"),
    [
        (lambda time: 0, "300 of 300 header stamps are zero"),
        (lambda time: nanoseconds(time) if time < 20 else nanoseconds(time - 15), "header stamps run back by 14.900 s"),
        (lambda time: nanoseconds(time if time < 20 else time + 3600), "header stamps stray by 3600"),
    ],
)
def test_header_stamps_that_are_zero_or_go_astray_are_left_for_the_receive_times(tmp_path, header, why):
    log = read_log(write_ros1(tmp_path / "log.bag", [*thrust(), *odometry(header=header)]))
    np.testing.assert_allclose(log.channels["x"].value, log.channels["x"].time, atol=1e-9)
    note(log, f"/odometry: {why}", "receive times used")


def test_messages_that_overtake_each_other_are_put_in_order_of_their_headers(tmp_path):
    messages = odometry()
    swapped = [messages[k ^ 1] for k in range(len(messages))]
    late = [
        Message(m.topic, m.kind, m.values, nanoseconds(time), m.header) for m, time in zip(swapped, TIME, strict=True)
    ]
    log = read_log(write_ros1(tmp_path / "log.bag", late))
    np.testing.assert_allclose(log.channels["x"].value, log.channels["x"].time + log.channels["x"].value[0], atol=1e-9)


def test_commands_without_a_header_are_put_on_the_clock_of_a_simulation(tmp_path):
    # Simulated time starts at 7 s and runs at half the speed of the wall clock, which stamps the receipts.
    def shown(time):
        return round(1e9 * (7.0 + 0.5 * time))

    log = read_log(write_ros2(tmp_path / "bag", [*odometry(header=shown), *thrust()], "mcap"))
    command = log.channels["newton_port"]
    np.testing.assert_allclose(command.time, 0.5 * TIME, atol=1e-6)
    np.testing.assert_allclose(log.channels["x"].time, 0.5 * TIME, atol=1e-9)
    note(log, "header stamps are of another clock", "0.500 times its rate", "by /odometry")


def simulated(time):
    """What the clock of a simulation shows; it runs at four fifths of the wall clock's rate, then at half of it."""
    return round(1e9 * (7.0 + (0.8 * time if time < 15.0 else 12.0 + 0.5 * (time - 15.0))))


def ticks(late):
    """Messages of /clock, each with a latency of its own [s]."""
    every = np.arange(0.0, 30.0, 0.01)
    shown = [divmod(simulated(time), 10**9) for time in every]
    kind = "rosgraph_msgs/msg/Clock"
    return [
        Message("/clock", kind, {"clock.sec": sec, "clock.nanosec": rest}, nanoseconds(time + wait))
        for time, (sec, rest), wait in zip(every, shown, late(every.size), strict=True)
    ]


@pytest.mark.parametrize("write", [write_ros1, lambda path, messages: write_ros2(path, messages, "mcap")])
def test_the_clock_topic_tells_the_time_of_commands_whatever_the_latency_of_the_odometry(tmp_path, write):
    late = odometry(late=0.15, header=simulated)
    jitter = np.random.default_rng(3).exponential(0.01, 3000)
    log = read_log(write(tmp_path / "log.bag", [*late, *ticks(lambda n: jitter[:n]), *thrust()]))
    truth = [simulated(time) / 1e9 - 7.0 for time in TIME]
    assert np.abs(log.channels["newton_port"].time - truth).max() < 0.015
    assert np.abs(np.median(log.channels["newton_port"].time - truth)) < 0.002
    assert log.out_of_step == 0.0
    note(log, "header stamps are of another clock", "put on it by /clock")
    note(log, "/odometry: received 0.", "(median) after its header stamps")


def test_a_clock_topic_that_begins_late_is_continued_at_the_rate_that_it_has_there(tmp_path):
    messages = [*odometry(late=0.15, header=simulated), *ticks(np.zeros)[900:], *thrust()]
    log = read_log(write_mcap(tmp_path / "log.mcap", messages))
    truth = [simulated(time) / 1e9 - 7.0 for time in TIME]
    np.testing.assert_allclose(log.channels["newton_port"].time, truth, atol=0.001)


def test_a_clock_topic_of_another_simulation_is_not_believed(tmp_path):
    other = [replace(m, values=m.values | {"clock.sec": m.values["clock.sec"] + 900}) for m in ticks(np.zeros)]
    log = read_log(write_ros1(tmp_path / "log.bag", [*odometry(header=simulated), *other, *thrust()]))
    note(log, "header stamps are of another clock", "put on it by /odometry")


def imu(late, header):
    values = {"angular_velocity.z": -0.01}
    return [
        Message("/imu", "sensor_msgs/msg/Imu", values, nanoseconds(time + late(k)), header(time))
        for k, time in enumerate(TIME)
    ]


def test_without_a_clock_topic_the_fastest_topic_tells_the_time_and_the_slowest_the_doubt(tmp_path):
    def shown(time):
        return round(1e9 * (7.0 + time))

    # Nine of ten messages of the gyro are slow; the odometry is the fullest topic and slower than any.
    gyro = imu(lambda k: 0.002 if k % 10 == 0 else 0.03, shown)[:280]
    late = odometry({"twist.twist.angular.z": np.nan}, late=0.15, header=shown)
    log = read_log(write_ros2(tmp_path / "bag", [*late, *gyro, *thrust()]))
    np.testing.assert_allclose(log.channels["newton_port"].time, TIME - 0.002, atol=0.003)
    assert log.out_of_step == pytest.approx(0.148, abs=0.002)
    note(log, "may be early by 0.148 s or more", "the latency of /imu, and /odometry, the slowest, comes 0.148 s after")
    alone = read_log(write_ros2(tmp_path / "alone", [*odometry(late=0.15, header=shown), *thrust()]))
    assert alone.out_of_step == 0.1
    note(alone, "may be early by 0.100 s or more, for nothing tells the latency of /odometry: ")


def test_a_delay_that_the_clocks_of_a_bag_may_have_made_is_not_a_finding(tmp_path):
    boat = load_vehicle("blueboat")
    world = simulate_world(boat, {}, duration=120.0, noise="clean", seed=1)
    messages = [replace(m, header=m.header - EPOCH + 35 * 10**9) if m.header else m for m in recorded(world, late=0.15)]
    inputs = read_inputs(write_mcap(tmp_path / "log.mcap", messages), "blueboat")
    assert [motion.out_of_step for motion in inputs.weak.train.motions] == [0.1]
    found = discover(inputs).findings
    assert not {"input_delay", "thruster_lag"} & set(found.missing)
    said = next(c for c in found.candidates if c.effect == "input_delay")
    assert "out of step by about 0.1 s" in said.sentence
    assert any("topics without a header may be early by 0.100 s or more" in text for text in found.data.notes)


def test_one_sensor_with_a_clock_of_its_own_is_moved_to_the_receive_times(tmp_path):
    def imu(rate):
        return [
            Message(
                "/imu",
                "sensor_msgs/msg/Imu",
                {"angular_velocity.z": -0.01 * time},
                nanoseconds(time),
                round(1e9 * (50 + rate * time)),
            )
            for time in TIME
        ]

    values = {"twist.twist.angular.z": np.nan}
    log = read_log(write_ros2(tmp_path / "bag", [*odometry(values), *imu(1.0)]))
    np.testing.assert_allclose(log.channels["r"].value, 0.01 * log.channels["r"].time, atol=1e-9)
    note(log, "/imu: its header stamps are of another clock, moved by 1699999950.000 s")
    drifting = read_log(write_ros2(tmp_path / "other", [*odometry(values), *imu(1.5)]))
    np.testing.assert_allclose(drifting.channels["r"].value, 0.01 * drifting.channels["r"].time, atol=1e-9)
    note(drifting, "/imu", "runs at another rate; receive times used")


def test_a_receive_clock_that_was_set_back_is_refused(tmp_path):
    messages = thrust()
    for k in range(300, 600):
        messages[k] = Message(
            messages[k].topic, messages[k].kind, messages[k].values, messages[k].received - 12 * 10**9
        )
    with pytest.raises(ValueError, match="time runs backwards in newton_port"):
        read_log(write_mcap(tmp_path / "log.mcap", [*odometry(header=lambda time: 0), *messages]))


def test_headers_later_than_the_receipt_are_of_another_clock(tmp_path):
    # A computer whose clock is three seconds ahead: its odometry answers the thrust of the same moment.
    ahead = odometry(late=-3.0)
    log = read_log(write_ros2(tmp_path / "bag", in_order(thrust(-3.0), ahead)))
    np.testing.assert_allclose(log.channels["newton_port"].time, log.channels["u"].time, atol=1e-6)
    note(log, "header stamps are of another clock", "-3.000 s apart")
    beside = odometry(topic="/other")
    mixed = read_log(write_ros2(tmp_path / "mixed", in_order([*beside], odometry(late=-3.0, topic="/ahead"))))
    note(mixed, "/ahead: its header stamps are of another clock, moved by -3.000 s to the receive times")


def in_order(*topics):
    return sorted((message for topic in topics for message in topic), key=lambda message: message.received)
