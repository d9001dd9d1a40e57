"""What stands beside the equations wherever they are shown: letters, what acts within factors, thrust curves."""

from ..physics.cross_flow import DENSITY, STRIPS
from ..physics.forces import CURRENT
from ..physics.in_words import listing
from ..physics.momentum_balance import balances, beside_the_balance
from ..physics.stated_values import stated
from ..physics.thrusters import Thruster
from ..physics.vehicle import Vehicle, hull_of
from .known_facts import KnownFacts

UNITS = {"surge": "N", "sway": "N", "yaw": "N m"}
WIDE = 3
"""Terms of an equation in a line."""
_COMMANDS = {"pwm": " in us", "normalized": "", "rad_s": " in rad/s", "newton": " in N", "tau": " in N or N m"}
"""Units of commands."""
_DIGITS = 12
"""Of a number: of forces of some hundred newtons, well under a micronewton is lost."""


def exact(value: float) -> tuple[str, int]:
    """Mantissa and power of ten of a number, to twelve digits.

    >>> exact(33.5), exact(-2.5e-13)
    (('33.5', 0), ('-2.5', -13))
    """
    mantissa, _, exponent = f"{value:.{_DIGITS}g}".partition("e")
    return mantissa, int(exponent or 0)


def letters(vehicle: Vehicle) -> str:
    """What the letters of the balances mean, as far as they stand there."""
    factors = {name for line in balances(vehicle) for term in line.force for name in term.factors}
    moving = any(vehicle.value(symbol) for symbol in CURRENT)
    told = ["u, v: surge and sway speed" + " relative to the water" * bool(moving) + " [m/s]", "r: yaw rate [rad/s]"]
    if any(name.startswith("T:") for name in factors):
        told.append("T: force of a thruster [N]")
    if any(name.endswith("psi") for name in factors):
        told.append("\N{GREEK SMALL LETTER PSI}: heading [rad]")
    if "t" in factors:
        told.append("t: time since the beginning of the log [min]")
    if factors & {"u_a", "v_a"}:
        told.append("u_a, v_a, V_a: apparent wind [m/s]")
    if factors & {"q_v", "q_r"}:
        told.append("q: a velocity as the water remembers it")
    if factors & {"F_Y", "F_N"}:
        hull = hull_of(vehicle)
        told.append(
            f"F_Y, F_N: half of {DENSITY:g} kg/m^3 times the draught of {hull.draught:.12g} m, times |w| w dx, and x "
            f"|w| w dx, with w = v + x r, summed over {STRIPS} strips of the length of {hull.length:.12g} m, each of "
            "width dx, at their middles x [N, N m]"
        )
    return f"{'; '.join(told)}. Coefficients are in SI units."


def within_factors(vehicle: Vehicle) -> str:
    """What acts within a factor: on the thrust, the water, or the memory; empty where nothing does."""
    symbols = beside_the_balance(vehicle)
    found = [stated(vehicle, symbol, _DIGITS, vehicle.parameter(symbol).unit) for symbol in symbols]
    return f"Within the factors act {listing(found)}." if found else ""


def judged(facts: KnownFacts) -> str:
    """Envelope and audit in a line."""
    return f"{facts.envelope_told} Audit: {' '.join(facts.audit)}"


def thrust_curve(thruster: Thruster) -> str:
    """How the command of a thruster becomes its force, with every number."""
    curve, unit = thruster.curve, _COMMANDS[thruster.command]
    if curve.kind == "table":
        points = [f"{y:.12g} at {x:.12g}" for x, y in zip(curve.command, curve.force, strict=True)]
        return f"force of {thruster.name} in N at its command{unit}, straight between: {', '.join(points)}"
    speed = {"pwm": "(command - 1500)/500 scale + offset", "normalized": "command scale + offset"}
    parts = [f"{name} = {getattr(curve, name):.12g}" for name in ("k_t", "rho", "diameter", "scale", "offset")]
    law = f"k_t rho diameter^4 n|n| N with n = {speed.get(thruster.command, 'command')}"
    return f"force of {thruster.name} at its command{unit}: {law}; {', '.join(parts)}"
