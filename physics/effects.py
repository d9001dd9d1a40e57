"""The catalogue: every physical effect undertow knows, as parameters of the one force equation.

An effect is one entry. Its parameters name the place in the vehicle file, the unit, the null value that means "absent"
and the physical limits; hydrodynamic ones also name the monomial and the axis they multiply. Force forms follow Fossen,
*Handbook of Marine Craft Hydrodynamics and Motion Control* (2nd ed., 2021), chapters 6, 9 and 10.
"""

from dataclasses import dataclass
from difflib import get_close_matches
from typing import Literal

from .errors import RequestError

Section = Literal["top", "added_mass", "damping", "coupling", "thrusters", "environment", "memory"]


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number of the vehicle model that an effect moves.

    Attributes
    ----------
    symbol : name in the literature's notation, unique; `{thruster}_scale` stands for one symbol a thruster
    section : where it lives in the vehicle file
    unit : SI unit
    null : value that means the effect is absent
    axis : the one that it acts on; None where it acts on several, or through something else
    form : for hydrodynamic terms, the monomial that the parameter multiplies
    lower, upper : physical limits of the total (nominal plus found) value
    grid : starting values when the parameter shapes the force non-linearly
    step : finite-difference step for its column of the regression [same unit]
    nonlinear : True when the force is not linear in it, so that its column changes with its value
    stepped : True when the force moves in steps with it, so that no derivative leads to the best value
    attainable : True when a value at a physical limit is nothing unusual, as a flat stretch of a thrust curve is
    """

    symbol: str
    section: Section
    unit: str
    null: float = 0.0
    axis: int | None = None
    form: str = ""
    lower: float = -float("inf")
    upper: float = float("inf")
    grid: tuple[float, ...] = ()
    step: float = 1.0
    nonlinear: bool = False
    stepped: bool = False
    attainable: bool = False


@dataclass(frozen=True, slots=True)
class Effect:
    """One entry of the catalogue.

    Attributes
    ----------
    name : stable name used by the command line and the files
    family : hull, coupling, mass, thruster, environment, memory or trim
    parameters : what it moves, in the order in which values are given on the command line
    equation : the added force, in symbols
    meaning : one sentence for the engineer
    added : True when values are reported as the amount missing from the nominal model, False when absolute
    fixed_amplitude : True when the parameters reshape the command and have no free amplitude (lag, delay, dead zone)
    per_thruster : True when the effect concerns one thruster at a time
    default : a value for each parameter used where the user gives fewer values than parameters
    channels : channels of the log, beside those that every log has, without which it cannot be judged
    requires : keys of the vehicle file, beside those that every file has, without which it has no size
    includes : names of simpler effects that are special cases of it; they are preferred by price, not by correlation
    """

    name: str
    family: str
    parameters: tuple[Parameter, ...]
    equation: str
    meaning: str
    added: bool = True
    fixed_amplitude: bool = False
    per_thruster: bool = False
    default: tuple[float, ...] = ()
    channels: tuple[str, ...] = ()
    requires: tuple[str, ...] = ()
    includes: tuple[str, ...] = ()

    @property
    def general(self) -> bool:
        """True when simpler effects are special cases of it."""
        return bool(self.includes)

    @property
    def timed(self) -> bool:
        """True when its force is one of accelerations or of the past, which channels out of step look like most.

        A force of this very instant is nearly orthogonal to what a small shift adds to it, its derivative.
        """
        return self.family == "mass" or any(p.unit == "s" for p in self.parameters)

    @property
    def symbols(self) -> tuple[str, ...]:
        """Symbols of the effect's parameters."""
        return tuple(p.symbol for p in self.parameters)

    @property
    def amplitudes(self) -> tuple[Parameter, ...]:
        """The parameters in which the force is linear (about the current value)."""
        return tuple(p for p in self.parameters if not p.grid)

    @property
    def shapes(self) -> tuple[Parameter, ...]:
        """The parameters that bend the force non-linearly and are searched over a grid, then refined."""
        return tuple(p for p in self.parameters if p.grid)


def _drag(symbol: str, axis: int, form: str, unit: str) -> Parameter:
    return Parameter(symbol, "damping", unit, axis=axis, form=form, upper=0.0)


def _coupling(symbol: str, axis: int, form: str, unit: str) -> Parameter:
    return Parameter(symbol, "coupling", unit, axis=axis, form=form)


def _gain(symbol: str) -> Parameter:
    return Parameter(symbol, "thrusters", "1", null=1.0, lower=0.0, upper=5.0, attainable=True)


EFFECTS: tuple[Effect, ...] = (
    Effect(
        "surge_linear_damping",
        "hull",
        (_drag("X_u", 0, "u", "N s/m"),),
        "X += X_u u_r",
        "Drag ahead and astern that grows in proportion to speed differs from the model.",
    ),
    Effect(
        "surge_quadratic_damping",
        "hull",
        (_drag("X_uu", 0, "u|u|", "N s^2/m^2"),),
        "X += X_uu u_r |u_r|",
        "Drag ahead and astern grows with the square of speed, and the model lacks it.",
    ),
    Effect(
        "sway_linear_damping",
        "hull",
        (_drag("Y_v", 1, "v", "N s/m"),),
        "Y += Y_v v_r",
        "Resistance to sideways drift in proportion to drift speed differs from the model.",
    ),
    Effect(
        "sway_quadratic_damping",
        "hull",
        (_drag("Y_vv", 1, "v|v|", "N s^2/m^2"),),
        "Y += Y_vv v_r |v_r|",
        "Resistance to sideways drift grows with the square of drift speed (cross-flow drag).",
    ),
    Effect(
        "yaw_linear_damping",
        "hull",
        (_drag("N_r", 2, "r", "N m s/rad"),),
        "N += N_r r",
        "Resistance to turning in proportion to yaw rate differs from the model.",
    ),
    Effect(
        "yaw_quadratic_damping",
        "hull",
        (_drag("N_rr", 2, "r|r|", "N m s^2/rad^2"),),
        "N += N_rr r |r|",
        "Resistance to turning grows with the square of yaw rate, and the model lacks it.",
    ),
    Effect(
        "yaw_speed_damping",
        "hull",
        (_drag("N_ur", 2, "|u|r", "N s^2/rad"),),
        "N += N_ur |u_r| r",
        "The faster the boat goes, the more it resists turning.",
    ),
    Effect(
        "sway_yaw_coupling",
        "coupling",
        (
            Parameter("Y_r", "damping", "N s/rad", axis=1, form="r"),
            Parameter("N_v", "damping", "N s", axis=2, form="v"),
        ),
        "Y += Y_r r;  N += N_v v_r",
        "Turning pushes the hull sideways and drifting turns it, in proportion to rate.",
    ),
    Effect(
        "munk_moment",
        "coupling",
        (_coupling("N_uv", 2, "uv", "N s^2/m"),),
        "N += N_uv u_r v_r",
        "Drifting at speed turns the hull: a Munk moment that differs from the model's.",
    ),
    Effect(
        "sway_lift",
        "coupling",
        (_coupling("Y_ur", 1, "ur", "N s^2/(m rad)"),),
        "Y += Y_ur u_r r",
        "Turning at speed pushes the hull sideways, beyond what the model's Coriolis force does.",
    ),
    Effect(
        "surge_turn_drag",
        "coupling",
        (_coupling("X_vr", 0, "vr", "N s^2/(m rad)"),),
        "X += X_vr v_r r",
        "Drifting in a turn slows or drives the hull, beyond what the model's Coriolis force does.",
    ),
    Effect(
        "surge_added_mass",
        "mass",
        (Parameter("X_udot", "added_mass", "kg", upper=0.0),),
        "X += X_udot du_r/dt, with its Coriolis force",
        "The water that moves with the hull ahead weighs more or less than the model says.",
    ),
    Effect(
        "sway_added_mass",
        "mass",
        (Parameter("Y_vdot", "added_mass", "kg", upper=0.0),),
        "Y += Y_vdot dv_r/dt, with its Coriolis force",
        "The water that moves with the hull sideways weighs more or less than the model says.",
    ),
    Effect(
        "yaw_added_mass",
        "mass",
        (Parameter("N_rdot", "added_mass", "kg m^2", upper=0.0),),
        "N += N_rdot dr/dt",
        "The water that turns with the hull has more or less inertia than the model says.",
    ),
    Effect(
        "cg_offset",
        "mass",
        (Parameter("x_g", "top", "m", lower=-2.0, upper=2.0, step=0.02),),
        "M and C with the centre of gravity x_g ahead of the origin",
        "The centre of gravity is not where the model puts it.",
    ),
    Effect(
        "lateral_cg",
        "mass",
        (Parameter("y_g", "top", "m", lower=-2.0, upper=2.0, step=0.02),),
        "M and C with the centre of gravity y_g to starboard of the origin",
        "The centre of gravity is beside the middle, as with a payload in one hull.",
    ),
    Effect(
        "mass_offset",
        "mass",
        (Parameter("mass", "top", "kg", lower=0.0),),
        "M and C with another mass; inertia_z is held",
        "The boat weighs more or less than the model says.",
    ),
    Effect(
        "thrust_scale",
        "thruster",
        (Parameter("thrust_scale", "thrusters", "1", null=1.0, lower=0.0, upper=3.0),),
        "T_i := thrust_scale T_i for every thruster",
        "All thrusters together push harder or weaker than the model says.",
        added=False,
    ),
    Effect(
        "thruster_asymmetry",
        "thruster",
        (Parameter("{thruster}_scale", "thrusters", "1", null=1.0, lower=0.0, upper=3.0),),
        "T_i := scale_i T_i for one thruster",
        "One thruster pushes harder or weaker than the model says.",
        added=False,
        per_thruster=True,
    ),
    Effect(
        "thruster_arm",
        "thruster",
        (Parameter("arm_scale", "thrusters", "1", null=1.0, lower=0.0, upper=3.0),),
        "N of every thruster := arm_scale N",
        "The thrusters turn the boat more or less than their places in the model say.",
        added=False,
    ),
    Effect(
        "battery_sag",
        "thruster",
        (Parameter("thrust_rate", "thrusters", "1/min", lower=-0.5, upper=0.5, step=0.002, nonlinear=True),),
        "T_i := (1 + thrust_rate t) T_i, t from the beginning of the log",
        "Thrust falls or grows as time goes by, as with the voltage of a battery or the warmth of motors.",
        added=False,
    ),
    Effect(
        "reverse_thrust_loss",
        "thruster",
        (Parameter("reverse_scale", "thrusters", "1", null=1.0, lower=0.0, upper=1.5),),
        "T_i := reverse_scale T_i where the command is astern",
        "Astern thrust is not what the model's curve says.",
        added=False,
    ),
    Effect(
        "thrust_dead_zone",
        "thruster",
        (
            Parameter(
                "dead_zone",
                "thrusters",
                "1",
                lower=0.0,
                upper=0.5,
                grid=(0.03, 0.06, 0.1, 0.15, 0.22, 0.3, 0.38, 0.46),
                nonlinear=True,
                stepped=True,
            ),
        ),
        "T_i := 0 where |c_i| <= dead_zone",
        "Small commands give no thrust.",
        added=False,
        fixed_amplitude=True,
    ),
    Effect(
        "thruster_lag",
        "thruster",
        (
            Parameter(
                "lag",
                "thrusters",
                "s",
                lower=0.0,
                upper=3.0,
                grid=(0.08, 0.16, 0.3, 0.5, 0.8, 1.2, 2.0),
                step=0.01,
                nonlinear=True,
            ),
        ),
        "lag dc/dt = command - c",
        "Thrust follows the command with a first-order lag.",
        added=False,
        fixed_amplitude=True,
    ),
    Effect(
        "input_delay",
        "thruster",
        (
            Parameter(
                "delay",
                "thrusters",
                "s",
                lower=0.0,
                upper=2.0,
                grid=(0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.1, 1.5),
                step=0.01,
                nonlinear=True,
            ),
        ),
        "c(t) = command(t - delay)",
        "Thrust follows the command after a pure delay.",
        added=False,
        fixed_amplitude=True,
    ),
    Effect(
        "advance_loss",
        "thruster",
        (Parameter("advance_loss", "thrusters", "N s/m", lower=0.0),),
        "T_i := T_i - advance_loss |c_i| u_r",
        "Thrust falls as the boat gathers speed.",
        added=False,
    ),
    Effect(
        "thrust_exponent",
        "thruster",
        (Parameter("thrust_exponent", "thrusters", "1", null=1.0, lower=0.3, upper=3.0, step=0.02, nonlinear=True),),
        "T_i := F_i |T_i / F_i|^thrust_exponent with the sign of T_i, F_i its force at full command on the same side",
        "Thrust grows with another power of the command than the model's curve; at full command it is the same.",
        added=False,
    ),
    Effect(
        "thrust_curve",
        "thruster",
        (
            _gain("gain_astern_100"),
            _gain("gain_astern_67"),
            _gain("gain_astern_33"),
            _gain("gain_ahead_33"),
            _gain("gain_ahead_67"),
            _gain("gain_ahead_100"),
        ),
        "dT_i/dc_i := gain dT_i/dc_i, with a gain for each third of the command astern and ahead",
        "Thrust grows with the command along another curve than the model's.",
        added=False,
        includes=("thrust_scale", "reverse_thrust_loss", "thrust_exponent"),
    ),
    Effect(
        "steady_current",
        "environment",
        (
            Parameter("current_north", "environment", "m/s", lower=-3.0, upper=3.0, step=0.02, nonlinear=True),
            Parameter("current_east", "environment", "m/s", lower=-3.0, upper=3.0, step=0.02, nonlinear=True),
        ),
        "nu_r = nu - R(psi)^T current in every hydrodynamic term",
        "The water moves: a steady current.",
        added=False,
    ),
    Effect(
        "turning_current",
        "environment",
        (
            Parameter(
                "current_rate_north", "environment", "m/s/min", lower=-1.0, upper=1.0, step=0.002, nonlinear=True
            ),
            Parameter("current_rate_east", "environment", "m/s/min", lower=-1.0, upper=1.0, step=0.002, nonlinear=True),
        ),
        "current := current + current_rate t, t from the beginning of the log",
        "The current changes as time goes by, as one of the tide does.",
        added=False,
    ),
    Effect(
        "mean_wind",
        "environment",
        (
            Parameter("wind_force_north", "environment", "N"),
            Parameter("wind_force_east", "environment", "N"),
        ),
        "(X, Y) += R(psi)^T wind_force",
        "A force fixed in the earth pushes the boat, as a mean wind does.",
        added=False,
    ),
    Effect(
        "apparent_wind",
        "environment",
        (
            Parameter("wind_x", "environment", "N s^2/m^2", lower=0.0),
            Parameter("wind_y", "environment", "N s^2/m^2", lower=0.0),
            Parameter("wind_n", "environment", "N m s^2/m^2"),
        ),
        "X += wind_x u_a |V_a|;  Y += wind_y v_a |V_a|;  N += wind_n u_a v_a",
        "The wind that the anemometer measures pushes and turns the boat.",
        added=False,
        channels=("wind_u", "wind_v"),
    ),
    Effect(
        "wake_memory",
        "memory",
        (
            Parameter("memory_sway", "memory", "N s/m", lower=0.0),
            Parameter("memory_yaw", "memory", "N m s/rad", lower=0.0),
            Parameter(
                "memory_time",
                "memory",
                "s",
                null=1.0,
                lower=0.2,
                upper=10.0,
                grid=(0.5, 1.0, 2.0, 4.0),
                step=0.02,
                nonlinear=True,
            ),
        ),
        "(Y, N) -= memory q,  memory_time dq/dt = nu_r - q",
        "The water remembers: sway and yaw forces depend on how the hull moved before.",
        added=False,
        default=(10.0, 3.0, 1.0),
    ),
    Effect(
        "hull_fouling",
        "hull",
        (Parameter("fouling_rate", "damping", "1/min", lower=0.0, upper=0.5, step=0.01),),
        "D := (1 + fouling_rate t) D for all damping, t from the beginning of the log",
        "All drag grows as time goes by: weed or a net that is caught, or wind and waves that rise. Growth takes days.",
        added=False,
    ),
    Effect(
        "cross_flow_drag",
        "hull",
        (Parameter("cross_flow", "damping", "1", lower=0.0),),
        "(Y, N) -= cross_flow 1/2 rho T sum (1, x) |w| w dx, w = v_r + x r, over twenty strips of the hull",
        "Water that crosses the hull resists drift and turning strip by strip, and the model lacks it.",
        requires=("hull",),
    ),
    Effect(
        "yaw_trim",
        "trim",
        (Parameter("yaw_trim", "environment", "N m", axis=2),),
        "N += yaw_trim",
        "A constant moment turns the boat, as a bent skeg or an uneven load does.",
    ),
    Effect(
        "surge_trim",
        "trim",
        (Parameter("surge_trim", "environment", "N", axis=0),),
        "X += surge_trim",
        "A constant force fixed in the boat pushes it ahead or astern, as thrusters that creep at neutral do.",
    ),
    Effect(
        "sway_trim",
        "trim",
        (Parameter("sway_trim", "environment", "N", axis=1),),
        "Y += sway_trim",
        "A constant force fixed in the boat pushes it sideways, as a list or a bent keel does.",
    ),
)
"""Every effect of the catalogue."""

BY_NAME: dict[str, Effect] = {effect.name: effect for effect in EFFECTS}

COMMAND_OFFSET = Parameter("command_offset", "thrusters", "s", lower=-2.0, upper=2.0, step=0.01, nonlinear=True)
"""How much earlier than it acted a command was recorded; later where it is negative. An error of a log: no vehicle has
it."""

EXTRA_PARAMETERS: tuple[Parameter, ...] = (
    Parameter("Y_rdot", "added_mass", "kg m"),
    Parameter("inertia_z", "top", "kg m^2"),
)
"""Numbers of the vehicle that no effect moves."""

PARAMETERS: dict[str, Parameter] = {
    p.symbol: p for p in (*(p for effect in EFFECTS for p in effect.parameters), *EXTRA_PARAMETERS)
}


def effect_named(name: str) -> Effect:
    """Look an effect up by name.

    Raises
    ------
    RequestError
        when there is no such effect; the text names the nearest one.
    """
    if name in BY_NAME:
        return BY_NAME[name]
    near = _owners(name) or get_close_matches(name, BY_NAME, n=1, cutoff=0.0)
    raise RequestError(
        f"unknown effect {name!r}: did you mean {near[0]!r}? The catalogue has: {', '.join(sorted(BY_NAME))}"
    )


def _owners(symbol: str) -> list[str]:
    """Effects of which something is a symbol, that of every thruster last.

    Examples
    --------
    >>> _owners("X_uu"), _owners("port_scale"), _owners("drag")
    (['surge_quadratic_damping'], ['thruster_asymmetry'], [])
    """
    exact = [effect.name for effect in EFFECTS if symbol in effect.symbols]
    ends = [(effect.name, one.removeprefix("{thruster}")) for effect in EFFECTS for one in effect.symbols]
    return exact or [name for name, end in ends if end.startswith("_") and symbol.endswith(end)]
