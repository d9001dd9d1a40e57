"""What the checks found goes from one process to another, though a fix is a function."""

import pickle

from undertow.measurements.canonical import Channel
from undertow.measurements.quality.record import Channels, Finding, Fix


def test_a_fix_travels_as_words() -> None:
    def apply(channels: Channels) -> dict[str, Channel]:
        return dict(channels)

    fix = pickle.loads(pickle.dumps(Fix("times moved", apply)))
    assert fix.sentence == "times moved"
    assert fix.apply({}) == {}
    finding = Finding(check="clocks", verdict="warning", sentence="late", fix=Fix("times moved", apply))
    assert pickle.loads(pickle.dumps(finding)).fix.sentence == "times moved"
