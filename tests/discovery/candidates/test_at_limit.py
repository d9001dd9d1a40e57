"""Whether a limit holds a parameter."""

import pytest

from undertow.discovery.candidates.candidate import limit_at
from undertow.physics.effects import PARAMETERS

DRAG = PARAMETERS["X_uu"]
"""At most zero."""


@pytest.mark.parametrize(
    ("value", "start", "limit"),
    [
        (-9e-6, None, 0.0),
        (-2e-5, None, None),
        (-0.009, -10.0, 0.0),
        (-0.011, -10.0, None),
        (0.0, 0.0, None),
    ],
    ids=["to rounding", "beyond rounding", "near", "not near", "where it stood before"],
)
def test_a_limit_holds_what_lies_on_it(value: float, start: float | None, limit: float | None):
    assert limit_at(DRAG, value, start) == limit
