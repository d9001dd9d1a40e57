"""What is typical of a hull of some length, for numbers that nobody has measured yet, each with its formula.

They are of the right size, not right: through a model ship of 1.26 m (CyberShip II) and a catamaran of 2 m (Otter), by
the estimates of T. I. Fossen's model of the Otter (MSS, VESSELS/models/otter.m, see `vehicles/otter.yaml`).
"""

from dataclasses import dataclass
from math import exp

from .assumed_numbers import SURE, TO_REPLACE

LENGTH = 1.2
"""Length that is taken where nobody tells one [m]: that of the small boats that two thrusters drive by hand."""
_DENSITY = 1025.0
"""Of sea water [kg/m^3]."""
_FORCE_PER_MASS = 3.0
"""Full thrust of all thrusters over mass [N/kg]: 2.3 of a BlueBoat in Gazebo, 4.4 of an empty Otter."""
THRUST_SPREAD = 0.46
"""Standard deviation of the logarithm of that: the two lie a factor of 1.9 apart."""
_SURGE_TIME, _SWAY_TIME, _YAW_TIME = 2.0, 1.0, 1.0
"""Times in which drag stops a hull [s]: sway and yaw of otter.m; in surge 1.1 s there, 2.2 s of Gazebo's BlueBoat."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """A number of a vehicle and where it is from."""

    value: float
    source: str


def typical_mass(length: float) -> Estimate:
    """Mass [kg] of a boat of this length [m]."""
    return _typical(14.0 * length**2, "14 kg/m^2 length^2 (CyberShip II 1.26 m, 23.8 kg; Otter 2.0 m, 55 kg)", length)


def typical_spacing(length: float) -> Estimate:
    """Distance between a port and a starboard thruster [m] of a boat of this length [m]."""
    return _typical(0.44 * length, "0.44 length (Otter 0.79 m of 2.0 m; BlueBoat in Gazebo 0.59 m of 1.2 m)", length)


def typical_thrust(mass: float, thrusters: int) -> Estimate:
    """Full thrust of each of some thrusters [N] on a boat of this mass [kg]."""
    words = (
        f"typical of small boats, {TO_REPLACE}: {_FORCE_PER_MASS:g} N/kg mass / {thrusters} (Otter 4.4 N/kg), {SURE} "
        f"{exp(1.96 * THRUST_SPREAD):.1f}"
    )
    return Estimate(_round(_FORCE_PER_MASS * mass / thrusters), words)


def typical_inertia(mass: float, length: float) -> Estimate:
    """Moment of inertia in yaw [kg m^2] of a boat of this mass [kg] and length [m], about its middle."""
    return _typical(mass * (0.25 * length) ** 2, "mass (0.25 length)^2 (otter.m)", length)


def typical_added_mass(mass: float, inertia: float, length: float) -> dict[str, Estimate]:
    """Added masses of a boat of this mass [kg], moment of inertia [kg m^2] and length [m], by symbol.

    In surge by Soeding (1982), as otter.m has it.
    """
    surge = 2.7 * _DENSITY * (mass / _DENSITY) ** (5.0 / 3.0) / length**2
    return {
        "X_udot": _typical(-surge, "-2.7 rho (mass/rho)^(5/3) / length^2, rho 1025 kg/m^3 (Soeding 1982)", length),
        "Y_vdot": _typical(-1.5 * mass, "-1.5 mass (otter.m)", length),
        "N_rdot": _typical(-1.7 * inertia, "-1.7 inertia_z (otter.m)", length),
    }


def typical_damping(inertias: tuple[float, float, float], length: float) -> dict[str, Estimate]:
    """Linear damping of a boat by symbol.

    Parameters
    ----------
    inertias : mass with added mass in surge and sway [kg], moment of inertia with that added in yaw [kg m^2]
    length : [m]
    """
    words = ("(mass - X_udot)", "(mass - Y_vdot)", "(inertia_z - N_rdot)")
    times = (_SURGE_TIME, _SWAY_TIME, _YAW_TIME)
    return {
        symbol: _typical(-inertia / time, f"-{word} / {time:g} s", length)
        for symbol, inertia, word, time in zip(("X_u", "Y_v", "N_r"), inertias, words, times, strict=True)
    }


def _typical(value: float, formula: str, length: float) -> Estimate:
    return Estimate(_round(value), f"typical of a hull of {length:g} m, {TO_REPLACE}: {formula}")


def _round(value: float) -> float:
    """Three digits: what is guessed has no more."""
    return float(f"{value:.3g}")
