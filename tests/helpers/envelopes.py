"""Whether velocities lie in an envelope."""

import numpy as np

from undertow.physics.laws.damping_power import Envelope


def encloses(envelope: Envelope, velocity: np.ndarray, slack: float = 1e-9) -> bool:
    """True when all velocities (..., 3) lie in the envelope."""
    low, high = np.array(envelope.lower) - slack, np.array(envelope.upper) + slack
    return bool(((velocity >= low) & (velocity <= high)).all())
