"""Waves: the first-order motion that a boat makes with the sea, on top of the motion that its forces explain.

Low-frequency and wave-frequency motion are added, as is usual for control (Fossen 2021, chapter 10): the boat follows
the orbits of the water and turns with it. The sensors see waves, but no mean force acts, and a model misses nothing.
"""

from dataclasses import replace

import numpy as np

from ..frames import GRAVITY, Array, body_to_earth, earth_to_body
from ..motion import Motion

BAND = (0.3, 0.8)
"""Lowest and highest frequency met [Hz]: of waves of 2.4 to 17 m where the boat lies still, longer than small boats and
too quick for their thrusters."""
PEAK, SHARPNESS = 0.5, 3.3
"""Peak [Hz], of waves of 6 m, and peak enhancement factor (gamma) of the spectrum, the mean of JONSWAP."""
_COMPONENTS = 60
"""Waves that are added, one from each equal part of the band: enough for a sum that is normally distributed."""


def jonswap(frequency: Array) -> Array:
    """Elevation spectrum at frequencies [Hz], in no particular unit (Hasselmann et al. 1973, the JONSWAP formula)."""
    width = np.where(frequency <= PEAK, 0.07, 0.09)
    bump = np.exp(-((frequency - PEAK) ** 2) / (2.0 * width**2 * PEAK**2))
    return frequency**-5.0 * np.exp(-1.25 * (PEAK / frequency) ** 4) * SHARPNESS**bump


def in_waves(motion: Motion, amplitude: float, rng: np.random.Generator) -> Motion:
    """What a boat that follows `motion` in calm water does in long-crested waves of a random direction.

    The water's orbital velocity w(t) = sum a_k cos(omega_k t + e_k) along the waves moves the boat, and its shear turns
    it: a line at an angle beta to the waves turns by sin(beta) cos(beta) sum (kappa_k a_k / omega_k) cos(omega_k t +
    e_k), with the wave number kappa_k = omega_k^2 / g (deep water, waves longer than the boat). Frequencies are those
    met. Position and velocity over ground, heading and yaw rate belong together: one is the derivative of the other.

    Parameters
    ----------
    amplitude : significant amplitude of the orbital velocity, twice its standard deviation [m/s]
    rng : draws the direction, the frequencies and the phases
    """
    direction = rng.uniform(-np.pi, np.pi)
    edges = np.linspace(*BAND, _COMPONENTS + 1)
    frequency = rng.uniform(edges[:-1], edges[1:])
    phase = rng.uniform(0.0, 2.0 * np.pi, _COMPONENTS)
    omega = 2.0 * np.pi * frequency
    size = omega * np.sqrt(jonswap(frequency))
    size *= 0.5 * amplitude / np.sqrt(0.5 * (size**2).sum())
    angle = motion.time[:, None] * omega + phase
    speed, shift = np.cos(angle) @ size, np.sin(angle) @ (size / omega)
    off = motion.heading - direction
    turned = np.sin(off) * np.cos(off) * (np.cos(angle) @ (size * omega / GRAVITY))
    heading = motion.heading + turned
    along = np.array([np.cos(direction), np.sin(direction)])
    north, east = body_to_earth(motion.heading, motion.velocity[:, 0], motion.velocity[:, 1])
    ahead, starboard = earth_to_body(heading, north + along[0] * speed, east + along[1] * speed)
    rate = motion.velocity[:, 2] + np.gradient(turned, motion.time)
    position, velocity = motion.position + shift[:, None] * along, np.column_stack([ahead, starboard, rate])
    return replace(motion, position=position, heading=heading, velocity=velocity)
