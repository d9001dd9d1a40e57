"""Frames and files of the ground floor: axes turned by hand, files whole or not at all."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest

from undertow.physics import files
from undertow.physics.motion import body_to_earth, earth_to_body, heading_from_enu, heading_from_quaternion, wrap_angle


def test_north_is_to_port_of_a_boat_that_heads_east() -> None:
    ahead, starboard = earth_to_body(np.array(np.pi / 2), 1.0, 0.0)
    np.testing.assert_allclose([ahead, starboard], [0.0, -1.0], atol=1e-15)


def test_body_and_earth_are_inverse() -> None:
    rng = np.random.default_rng(1)
    heading, north, east = rng.uniform(-4, 4, (3, 50))
    back = body_to_earth(heading, *earth_to_body(heading, north, east))
    np.testing.assert_allclose(back, [north, east], atol=1e-14)


def test_east_in_enu_is_a_heading_of_ninety_degrees() -> None:
    np.testing.assert_allclose(heading_from_enu(np.array([0.0, np.pi / 2])), [np.pi / 2, 0.0])


@pytest.mark.parametrize("scale", [1.0, -3.0])
def test_heading_of_a_quaternion_whatever_its_scale(scale: float) -> None:
    yaw = np.linspace(-3, 3, 13)
    zero = np.zeros_like(yaw)
    found = heading_from_quaternion(zero, zero, scale * np.sin(yaw / 2), scale * np.cos(yaw / 2))
    np.testing.assert_allclose(found, yaw, atol=1e-12)


def test_wrapped_angles_lie_in_one_turn() -> None:
    angle = np.linspace(-20, 20, 101)
    wrapped = wrap_angle(angle)
    assert wrapped.min() >= -np.pi
    assert wrapped.max() < np.pi
    np.testing.assert_allclose(np.exp(1j * wrapped), np.exp(1j * angle), atol=1e-12)


def test_json_is_strict_and_rounded() -> None:
    assert files.strict_json({"a": math.nan, "b": [1 / 3, True, None]}) == (
        '{\n "a": null,\n "b": [\n  0.333333333,\n  true,\n  null\n ]\n}'
    )


def test_json_of_the_largest_number_is_not_rounded_to_infinity() -> None:
    largest = sys.float_info.max
    assert files.strict_json([largest, -largest]) == "[\n 1.79769313e+308,\n -1.79769313e+308\n]"


def test_a_failed_write_leaves_the_old_file_and_no_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = files.write_text(tmp_path / "a.txt", "old\n")

    def refuse(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(files.os, "replace", refuse)
    with pytest.raises(OSError, match="disk full"):
        files.write_text(target, "new\n")
    assert target.read_text("utf-8") == "old\n"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]
