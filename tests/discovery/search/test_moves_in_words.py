"""Moves of the search are told as what it tries: a later move may take them back."""

import pytest

from undertow.discovery.search.floating import difference


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ((), ("munk_moment",), "trying with Munk moment"),
        (("wake_memory",), ("yaw_trim",), "trying with yaw trim and without wake memory"),
        (("wake_memory", "thruster_asymmetry[port]"), (), "trying without wake memory and thruster asymmetry of port"),
        (("wake_memory",), ("wake_memory",), "trying other shapes"),
    ],
)
def test_a_move_claims_nothing(before: tuple[str, ...], after: tuple[str, ...], said: str):
    assert difference(before, after) == said
