"""Pulses of a plan go out as the boat takes them only where the log held pulses."""

from pathlib import Path

import pytest

from undertow.physics.vehicle import load_vehicle
from undertow.workflows.plan import _read_as

BOAT = load_vehicle("blueboat_paper")


@pytest.mark.parametrize(
    ("line", "sent"),
    [
        ("{from: pwm_1, scale: -1, offset: 3020}", {"pwm_port": (-1.0, 3020.0)}),
        ("{from: throttle_port, scale: 500, offset: 1500}", {}),
        ("{from: throttle_port, scale: 0, offset: 1500}", {}),
    ],
)
def test_a_share_that_became_a_pulse_is_not_sent_to_a_servo(line: str, sent: dict[str, tuple], tmp_path: Path):
    (tmp_path / "map.yaml").write_text(f"pwm_port: {line}\n")
    assert _read_as(tmp_path / "map.yaml", BOAT)[0] == sent
