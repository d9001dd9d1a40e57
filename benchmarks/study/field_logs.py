"""Logs that no study drew: a BlueBoat on a lake, the same in Gazebo, and logs of other simulators.

What is true of each is what their records tell, written down here; they lie beside the repository, or a study of them
is passed over and says so. They are reported alone: nothing is tuned on them.
"""

import shutil
from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from undertow.physics.vehicle import load_vehicle, vehicle_from_dict

from .records import ROOT
from .verb import Logged, Write

SHARED = ROOT.parent / "shared" / "data"
LAKE, GAZEBO, WITHHELD = "BlueBoat on a lake", "Gazebo", "withheld"
FOLDERS = {LAKE: SHARED / "blueboat", GAZEBO: SHARED / "gazebo", WITHHELD: SHARED / "withheld"}


def absent() -> str:
    """Which logs are not there, in words; empty where all are."""
    gone = [f"{name} ({path})" for name, path in FOLDERS.items() if not path.is_dir()]
    return f"passed over, for they are not there: {', '.join(gone)}" if gone else ""


def keys(purpose: str) -> list[tuple[str, int]]:
    """Kinds, and numbers that stand for the logs; none for tuning."""
    if purpose == "tuning":
        return []
    lake = [(LAKE, int(path.stem[4:])) for path in sorted(FOLDERS[LAKE].glob("log_*.csv"))]
    simulated = [(GAZEBO, n) for n, (run, _) in enumerate(RUNS) if (FOLDERS[GAZEBO] / f"{run}.csv.gz").is_file()]
    others = [(WITHHELD, n) for n, name in enumerate(TRUTHS) if (FOLDERS[WITHHELD] / f"{name}.csv.gz").is_file()]
    return [*lake, *simulated, *others]


def logged(kind: str, number: int) -> Logged:
    """A log of a kind."""
    return {LAKE: lake, GAZEBO: gazebo, WITHHELD: withheld}[kind](number)


# A BlueBoat on a lake: examples/real_blueboat.py says how the file came about, and what careful work finds

_CURVE = {"kind": "propeller", "scale": 70.0, "offset": -1.4, "k_t": 0.085, "rho": 1000.0, "diameter": 0.112}
_FILE = {
    "name": "BlueBoat, linear",
    "mass": 15.0,
    "inertia_z": 3.0,
    "damping": {"X_u": -10.0, "Y_v": -40.0, "N_r": -5.0},
    "thrusters": [
        {"name": "port", "x": -0.45, "y": -0.285, "command": "pwm", "curve": _CURVE},
        {"name": "stbd", "x": -0.45, "y": 0.285, "command": "pwm", "curve": _CURVE},
    ],
}
_NEUTRAL = 1510.0
"""Pulse at which both thrusters stand; starboard turns the other way round about it [us]."""
_FOUND = ("reverse_thrust_loss", "surge_quadratic_damping", "yaw_speed_damping")
"""What is found with whole logs held out."""
_GUESSED = (
    *("surge_linear_damping", "yaw_linear_damping", "thrust_scale", "thrust_curve", "thrust_exponent"),
    *("thrust_dead_zone", "mass_offset", "surge_added_mass", "yaw_added_mass", "thruster_arm", "wake_memory"),
)
"""What the file guesses, and any log may ask for; and the yaw memory that no static term explains. Not supported are
current, lag, delay, thrust lost to speed, anything in sway, and quadratic yaw damping."""

_DEFECTS = (
    *("compass_deviation", "velocity_latency", "position_latency", "gyro_latency", "command_offset", "antenna_arm"),
)
"""What may be told of sensors and of the record: the compass deviates, and channels are out of step."""


def lake(number: int) -> Logged:
    """One of the field logs alone."""

    def write(path: Path) -> Path:
        table = pd.read_csv(FOLDERS[LAKE] / f"log_{number}.csv")
        table["pwm_stbd"] = 2.0 * _NEUTRAL - table["pwm_stbd"]
        table[["t", "x", "y", "psi", "u", "v", "r", "pwm_port", "pwm_stbd"]].to_csv(path, index=False)
        return path

    part = frozenset((*_FOUND, *_GUESSED))
    sensors = frozenset(_DEFECTS)
    return Logged("field", LAKE, number, vehicle_from_dict(_FILE, "field logs"), write, part=part, sensors=sensors)


# Gazebo: what was put into the simulator, and what its plugin does otherwise than a textbook

_LINEAR = ("A_1", "A_2", "B_2", "B_4", "C_1", "C_2", "D_1", "D_2", "D_3", "E_2", "F_1", "G_2", "H_1")
RUNS = (*((run, "linear") for run in _LINEAR), ("B_2", "full"), ("B_4", "full"))
_LEVEL = ("B_4", "D_3", "F_1", "H_1")
_PLUGIN = {"N_uv": 12.0, "Y_ur": 6.0}
_QUADRATIC = {"X_uu": -8.0, "Y_vv": -80.0, "N_rr": -8.0}
_DRAG = {"surge_quadratic_damping", "sway_quadratic_damping", "yaw_quadratic_damping"}
_OWN: Mapping[str, tuple[set[str], Mapping[str, float]]] = {
    "C": ({"steady_current"}, {"current_north": 0.15, "current_east": 0.25}),
    "D": ({"thruster_asymmetry[stbd]"}, {"stbd_scale": 0.8}),
    "E": ({"sway_yaw_coupling"}, {"Y_r": -6.0, "N_v": -10.0}),
}
_NO_NAME = {"E": "sway:r yaw:r", "F": "surge:u sway:v yaw:r"}
"""What follows the modulus of another speed, or none, and has no name."""


def gazebo(number: int) -> Logged:
    """One run, with a file that has linear drag or all of the simulator's."""
    run, hull = RUNS[number]
    true, known = {"munk_moment", "sway_lift"}, dict(_PLUGIN)
    if hull == "linear" and run[0] not in "AF":  # F drags without a sign, which has no name
        true |= _DRAG
        known |= _QUADRATIC
    more, values = _OWN.get(run[0], (set(), {}))
    folder = FOLDERS[GAZEBO]
    vehicle = load_vehicle(folder / f"vehicle_{hull}{'_level' if run in _LEVEL else ''}.yaml")
    return Logged(
        "field",
        GAZEBO,
        number,
        vehicle,
        _copied(folder / f"{run}.csv.gz"),
        note=f"{run}, {hull} drag in the file",
        true=frozenset(true | more),
        known={**known, **values},
        forces=frozenset(_NO_NAME.get(run[0], "").split()),
    )


def _copied(path: Path) -> Write:
    """Copies a log; nothing of it changes."""

    def write(to: Path) -> Path:
        return Path(shutil.copy(path, to.with_name(path.name)))

    return write


# Logs whose right answer was found once, and not said

_OTTER = ("cross_flow_drag", "sway_quadratic_damping", "yaw_quadratic_damping")
"""Cross-flow drag of strips, which its logs have beside what was hidden, and the parts of it that have names."""
TRUTHS: Mapping[str, tuple[Mapping[str, Mapping[str, float]], tuple[str, ...]]] = {
    "surge_linear_damping": ({"surge_linear_damping": {"X_u": -8.0}}, ()),
    "thrust_scale": ({"thrust_scale": {"thrust_scale": 0.8}}, ()),
    "yaw_linear_damping": ({"yaw_linear_damping": {"N_r": -3.5}}, ()),
    "otter_current_1": (
        {"steady_current": {"current_north": 0.15, "current_east": 0.2}, "surge_trim": {"surge_trim": 7.0}},
        _OTTER,
    ),
    "otter_reverse_0": ({"reverse_thrust_loss": {"reverse_scale": 0.7}, "surge_trim": {"surge_trim": 7.0}}, _OTTER),
    "otter_reverse_1": ({"reverse_thrust_loss": {"reverse_scale": 0.7}, "surge_trim": {"surge_trim": 7.0}}, _OTTER),
    "otter_slow_prop_0": ({"thruster_lag": {"lag": 0.6}, "surge_trim": {"surge_trim": 7.0}}, _OTTER),
    "otter_nrr_doubled_nocf_1": ({"yaw_quadratic_damping": {"N_rr": -426.5}}, ()),
    "csad_lag": ({"thruster_lag": {"lag": 1.5}}, ()),
    "rvg_weak": ({"thruster_asymmetry[port]": {"port_scale": 0.8}}, ()),
}
"""What is hidden in each, its first effect that which makes nearly all of the error, and what is a fair part."""


def withheld(number: int) -> Logged:
    """One of them."""
    name = list(TRUTHS)[number]
    hidden, part = TRUTHS[name]
    folder = FOLDERS[WITHHELD]
    return Logged(
        "field",
        WITHHELD,
        number,
        load_vehicle(folder / f"{name}.yaml"),
        _copied(folder / f"{name}.csv.gz"),
        note=name,
        true=frozenset(hidden),
        part=frozenset(part),
        known={symbol: value for values in hidden.values() for symbol, value in values.items()},
        dominant=next(iter(hidden)),
    )
