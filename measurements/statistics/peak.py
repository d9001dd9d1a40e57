"""Where a sampled curve turns, between its samples."""


def turning_point(before: float, here: float, after: float) -> float:
    """Steps from the middle of three values to where the parabola through them turns; none where they lie in a line.

    >>> turning_point(4.0, 1.0, 0.0)  # (x - 1)^2 at -1, 0, 1
    1.0
    """
    bend = before - 2.0 * here + after
    return 0.5 * (before - after) / bend if abs(bend) > 0.0 else 0.0
