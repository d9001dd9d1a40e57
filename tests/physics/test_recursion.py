"""A recursion in blocks against one row after the other."""

import numpy as np
import pytest

from undertow.physics.sampled_series import recursion


@pytest.mark.parametrize("rows", [1, 2, 31, 32, 33, 1_024, 1_025, 5_000])
@pytest.mark.parametrize("share", [0.0, 1e-9, 0.5, 0.999])
def test_blocks_give_what_single_rows_give(rows: int, share: float):
    driven = np.random.default_rng(rows).normal(size=rows)
    expected, last = np.empty(rows), 0.0
    for k, value in enumerate(driven):
        last = expected[k] = share * last + value
    np.testing.assert_allclose(recursion(share, driven), expected, rtol=1e-12, atol=1e-13)
