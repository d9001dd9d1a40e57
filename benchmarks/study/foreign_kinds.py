"""The kinds of foreign worlds, and what is true of each: written down before any of them was asked about.

A name counts as true where it is what is hidden, as a fair part where it is an exact equivalent or has a share of the
force for which no smaller name would do; every other name that is called missing is false.
"""

from dataclasses import dataclass
from math import radians

from . import foreign_faults as faults
from . import foreign_plants as plants
from . import foreign_sensors as sensors
from .foreign_effects import SLOW, hide, moved
from .foreign_faults import Make, between, either
from .foreign_world import World


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of foreign world.

    Attributes
    ----------
    group : plant, sensors, changes, file, no name, commands, short, ships or alike
    make : sets what is true of a world
    true : effects that are what is hidden
    part : effects that are a fair part of it, or an exact equivalent
    sensors : errors of sensors or of the record that are the cause; of an offset, which channel's
    honest : why, and what an honest answer would be
    hides : whether every second world has one effect of the catalogue beside it
    refusal : words of a refusal that tells the cause
    """

    group: str
    make: Make
    true: tuple[str, ...] = ()
    part: tuple[str, ...] = ()
    sensors: tuple[str, ...] = ()
    honest: str = ""
    hides: bool = False
    refusal: str = ""


_HULL = "the thrust and the plane are those of the file"
_RIGHT = "the boat is that of the file: nothing is missing but what is hidden, and the sensor is to be told"
_RECORD = "the boat is that of the file: nothing is missing but what is hidden"
_NONE = "no effect of the catalogue: undecided, a term, or nothing"

KINDS: dict[str, Kind] = {
    "boat in six degrees of freedom": Kind(
        "plant",
        plants.six_degrees,
        part=("sway_linear_damping", "sway_yaw_coupling", "sway_added_mass", "cg_offset"),
        honest=f"{_HULL}; a hull that rolls has other drag, inertia and coupling in sway, and pitch moves its weight",
    ),
    "cross-flow of strips": Kind(
        "plant",
        plants.strips,
        true=("cross_flow_drag", "sway_quadratic_damping", "yaw_quadratic_damping"),
        part=("sway_linear_damping",),
        honest="strips give quadratic drag in sway and yaw, and more; linear drag in sway is less than in the file",
    ),
    "propeller in its own advance": Kind(
        "plant",
        plants.propeller,
        true=("advance_loss",),
        part=("yaw_linear_damping", "yaw_speed_damping"),
        honest="thrust falls with speed, in proportion to shaft speed; unequal inflow of two screws resists turning",
    ),
    "explicit Euler, 0.02 s": Kind("plant", plants.euler, honest=_RECORD, hides=True),
    "semi-implicit Euler, 0.02 s": Kind("plant", plants.gazebo, honest=_RECORD, hides=True),
    "Runge and Kutta, 0.05 s": Kind("plant", plants.coarse, honest=_RECORD, hides=True),
    "gyro scale": Kind(
        "sensors",
        faults.sensed(lambda w: sensors.times(1.0 + either(w, 0.03, 0.08), "r")),
        sensors=("gyro_scale",),
        honest=_RIGHT,
        hides=True,
    ),
    "gyro bias": Kind(
        "sensors",
        faults.sensed(lambda w: sensors.off(either(w, 0.01, 0.03), "r")),
        sensors=("gyro_bias",),
        honest=_RIGHT,
        hides=True,
    ),
    "gyro with a low-pass": Kind(
        "sensors",
        faults.sensed(lambda w: sensors.slow(between(w, 0.1, 0.3), "r")),
        sensors=("gyro_latency",),
        honest=_RIGHT,
        hides=True,
    ),
    "gyro bias that wanders": Kind(
        "sensors",
        faults.sensed(lambda w: sensors.drifting(between(w, 0.004, 0.012), 60.0)),
        sensors=("gyro_bias",),
        honest=_RIGHT,
        hides=True,
    ),
    "velocity scale": Kind(
        "sensors",
        faults.sensed(lambda w: sensors.times(1.0 + either(w, 0.04, 0.08), "u", "v")),
        sensors=("velocity_scale",),
        honest=_RIGHT,
        hides=True,
    ),
    "velocity that is late": Kind(
        "sensors",
        faults.sensed(lambda w: sensors.late(between(w, 0.1, 0.4), "u", "v")),
        sensors=("velocity_latency", "position_latency"),
        honest=_RIGHT,
        hides=True,
        refusal="speeds and positions tell of different instants",
    ),
    "antenna off the origin": Kind(
        "sensors",
        faults.sensed(lambda w: sensors.antenna(either(w, 0.2, 0.7), between(w, -0.4, 0.4))),
        sensors=("antenna_arm",),
        honest=_RIGHT,
        hides=True,
    ),
    "compass that deviates": Kind(
        "sensors",
        faults.sensed(lambda w: sensors.deviation(*(radians(either(w, 2.0, 6.0)) for _ in range(3)))),
        sensors=("compass_deviation",),
        honest=_RIGHT,
        hides=True,
    ),
    "speed through moving water": Kind(
        "sensors",
        faults.moving_water,
        part=("steady_current",),
        sensors=("water_speed",),
        honest="the water moves and speeds are through it: the speed log is to be told, or the current",
    ),
    "outliers": Kind(
        "sensors",
        lambda w: w.spoils.append(sensors.spikes),
        honest=_RECORD,
        hides=True,
        refusal="stand far out of their record",
    ),
    "missing stretches": Kind("sensors", lambda w: w.spoils.append(sensors.gaps), honest=_RECORD, hides=True),
    "satellite velocity that is smoothed": Kind(
        "sensors",
        faults.sensed(lambda w: sensors.filtered_fix(between(w, 0.2, 0.6))),
        sensors=("velocity_latency", "position_latency"),
        honest=_RIGHT,
        hides=True,
        refusal="speeds and positions tell of different instants",
    ),
    "current that turns": Kind(
        "changes",
        plants.turning_current,
        part=("steady_current", "turning_current"),
        honest="its mean and its even change are parts; its speed stays and its direction turns",
    ),
    "battery that sags": Kind(
        "changes", plants.battery, true=("battery_sag",), part=("thrust_scale",), honest="it sags faster at the end"
    ),
    "fouling that grows": Kind(
        "changes", plants.fouling, true=("hull_fouling",), honest="evenly, all drag of the hull"
    ),
    "gusts without an anemometer": Kind(
        "changes",
        plants.gusts,
        part=("mean_wind", "surge_linear_damping", "sway_linear_damping"),
        honest="the mean force is fixed to the earth; the square of the apparent wind resists motion in it a little",
    ),
    "payload that shifts": Kind(
        "changes", plants.payload, honest="the centre of gravity of the one axis has another place from then on"
    ),
    "thruster that weakens": Kind(
        "changes", plants.weaker, part=("thruster_asymmetry",), honest="one thruster is weaker from then on"
    ),
    "wind that rises": Kind(
        "changes",
        plants.rising_wind,
        part=("mean_wind", "surge_linear_damping", "sway_linear_damping"),
        honest="as gusts, and it rises",
    ),
    "mass 20 % wrong": Kind(
        "file",
        faults.mass,
        true=("mass_offset",),
        part=("surge_added_mass", "sway_added_mass", "cg_offset"),
        honest="both added masses, with the moment of the mass about the origin, do the same to the last digit",
    ),
    "inertia 20 % wrong": Kind(
        "file", faults.inertia, true=("yaw_added_mass",), honest="only the sum of the two is in M"
    ),
    "arm 5 % wrong": Kind("file", faults.arm, true=("thruster_arm",), honest="the places of the thrusters"),
    "centre of gravity along the hull wrong": Kind(
        "file",
        lambda w: moved(w, "cg_offset", "x_g", either(w, 0.05, 0.12)),
        true=("cg_offset",),
        honest="through M and C",
    ),
    "centre of gravity to a side": Kind(
        "file",
        lambda w: moved(w, "lateral_cg", "y_g", either(w, 0.03, 0.08)),
        true=("lateral_cg",),
        honest="through M and C",
    ),
    "an added mass wrong": Kind("file", faults.added_mass, honest="the one that is wrong"),
    "thrust curve wrong": Kind(
        "file",
        faults.curve,
        true=("thrust_curve",),
        part=("thrust_scale", "reverse_thrust_loss", "thrust_exponent"),
        honest="bent between no command and full, weaker astern: the curve includes the three others",
    ),
    "drag with a kink": Kind("no name", plants.kink, honest=_NONE),
    "drag without a sign": Kind(
        "no name", plants.unsigned, honest="quadratic drag while the boat never goes astern, else no effect"
    ),
    "drag of a power of three": Kind("no name", plants.cubic, honest=_NONE),
    "hump of wave drag": Kind("no name", plants.hump, honest=_NONE),
    "moment of unlike thrusts": Kind("no name", plants.uneven_thrust, honest=_NONE),
    "wash over a skeg": Kind(
        "no name",
        plants.wash,
        part=("yaw_linear_damping",),
        honest="resists turning in proportion to rate and to thrust: its mean is linear drag in yaw",
    ),
    "bank": Kind("no name", plants.bank, honest=_NONE),
    "backlash of the thrusters": Kind("no name", plants.backlash, honest=_NONE),
    "drift in waves": Kind("no name", plants.wave_drift, part=("mean_wind",), honest="its mean is fixed to the earth"),
    "commands switch between records": Kind(
        "commands", faults.switching, sensors=("command_offset",), honest=_RECORD, hides=True
    ),
    "commands at 1 to 50 Hz": Kind("commands", faults.rated, sensors=("command_offset",), honest=_RECORD, hides=True),
    "commands rounded": Kind("commands", faults.rounded, honest=_RECORD, hides=True),
    "commands that act late": Kind(
        "commands",
        faults.acts_late,
        true=("input_delay",),
        sensors=("command_offset",),
        honest="a delay of the input, or of the record: which of the two no log can tell",
    ),
    "commands that are stamped late": Kind(
        "commands",
        faults.stamped_late,
        sensors=("command_offset",),
        honest=_RIGHT,
        hides=True,
        refusal="the motion leads the command",
    ),
    "set points before a slew limit": Kind(
        "commands",
        faults.set_points,
        part=("thruster_lag", "input_delay"),
        honest="thrust follows the set point, evenly",
    ),
    "commands on change alone": Kind("commands", faults.on_change, honest=_RECORD, hides=True),
    "short log": Kind("short", plants.short, honest=_RECORD, hides=True),
    "slow ship": Kind("ships", plants.slow_ship, honest=_RECORD, hides=True),
    "everything heavier by a fifth": Kind(
        "alike", plants.heavier_in_proportion, honest="no motion differs, so that nothing is missing"
    ),
    "heavier on straight runs": Kind(
        "alike",
        plants.heavier_on_straight_runs,
        part=("surge_added_mass",),
        honest="on straight runs mass and added mass ahead are the same: the two are to be named together",
    ),
}
"""Every kind by name."""


def prepare(world: World, kind: Kind) -> None:
    """Make a world of a kind, and note what is true of it."""
    world.true, world.part, world.sensors = set(kind.true), set(kind.part), set(kind.sensors)
    kind.make(world)
    if kind.hides:
        hide(world, SLOW if kind.group == "ships" else tuple(sorted((*SLOW, "thruster_lag", "input_delay"))))
