"""The kinds of worlds of other simulators, and what is true of each: written down before any of them was asked about.

A name is true where it is what is hidden, and a fair part where it is an exact equivalent or has a share of the force
for which no smaller name would do; every other name is false. What a simulator has by itself and its file has not is
part of every kind of that simulator.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import radians

import numpy as np

from ..foreign_sensors import Sense, antenna, deviation, late, off, slow, times
from .craft import Craft
from .effects import Sizes
from .nameless import NAMELESS
from .otter import otter
from .vessels import csad, gunnerus, nomoto, strip_boat, wam_v

FIRST = {"tuning": 400_000, "reporting": 450_000}
"""First seeds: what is chosen is chosen on the first, and reported on the second."""
Make = Callable[[np.random.Generator], Craft]
Sensor = Callable[[Craft, Sizes, np.random.Generator], Sense]
CROSS_FLOW = (
    *("cross_flow_drag", "sway_quadratic_damping", "yaw_quadratic_damping"),
    *("sway_linear_damping", "yaw_linear_damping"),
)
"""A file that has strips as quadratic drag in sway and yaw is right in pure sway and pure turning alone; in drift and
turn together strips add about |r| v and |v| r, whose means are linear drag in sway and yaw."""


@dataclass(frozen=True, slots=True)
class Simulator:
    """A simulator: who makes its boats, names that are a fair part of what its file cannot hold, and the reason.

    `nameless` says what acts in all of its boats that no file can hold; with it rollouts of 10 s part by a tenth and
    more. What other files cannot hold makes less than a hundredth.
    """

    make: Make
    part: tuple[str, ...] = ()
    why: str = ""
    nameless: str = ""


_STRIPS = "strips are no quadratic drag in drift and turn together"
_WEIGHT = (
    "the payload's weight acts as a constant force ahead, which is surge_trim, and aside as the hull rolls in turns"
)
_ROLLED = ("sway_added_mass", "sway_lift", "mass_offset", "sway_yaw_coupling")
"""The hull rolls with its acceleration to a side, v' + u r, so that weight aside is like a mass in both terms."""
SIMULATORS: dict[str, Simulator] = {
    "Otter": Simulator(
        otter, (*CROSS_FLOW, *_ROLLED), f"{_WEIGHT}; {_STRIPS}", "cross-flow of strips, and weight of a hull that rolls"
    ),
    "Otter with a payload": Simulator(
        partial(otter, cross_flow=False), _ROLLED, _WEIGHT, "weight of a hull that rolls"
    ),
    "Otter in the plane": Simulator(
        partial(otter, cross_flow=False, statics=False), (), "roll, pitch and heave are left out"
    ),
    "WAM-V": Simulator(wam_v),
    "CSAD": Simulator(csad, (), "its model does not turn the rigid body's momentum with a current"),
    "Gunnerus": Simulator(gunnerus, (), "its added mass is not symmetric"),
    "strips": Simulator(strip_boat, CROSS_FLOW, _STRIPS, "cross-flow of strips"),
    "Nomoto": Simulator(nomoto),
}


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of world.

    Attributes
    ----------
    group : nothing, one, two, crowd, sensors, record or no name
    simulators : by whose boats; the seed draws one of them
    effects : how many effects of the catalogue are hidden, drawn among those that the simulator can make
    sometimes : whether that many are hidden in every second world alone
    true : effects that are hidden beside those that are drawn
    part : effects that are a fair part of the cause, beside those of the simulator
    sensors : errors of sensors or of the record that are the cause
    sensor : makes the sensor err
    nameless : cause outside the catalogue, of `NAMELESS` or of the simulator itself
    sampled : commands are recorded at a tenth of the rate at which they act
    why : reason of what is true; honest : what an honest answer is
    make : another maker of boats than the simulator's
    """

    group: str
    simulators: tuple[str, ...]
    why: str
    honest: str
    effects: int = 0
    sometimes: bool = False
    true: tuple[str, ...] = ()
    part: tuple[str, ...] = ()
    sensors: tuple[str, ...] = ()
    sensor: Sensor | None = None
    nameless: str = ""
    sampled: bool = False
    make: Make | None = None


def _either(rng: np.random.Generator, low: float, high: float) -> float:
    return float(rng.choice([-1.0, 1.0]) * rng.uniform(low, high))


def _slow(craft: Craft) -> float:
    return min(craft.pace, 3.0)


EVERYWHERE = ("Otter in the plane", "WAM-V", "CSAD", "Gunnerus", "Nomoto")
"""Simulators whose files hold them whole, for kinds that are about something else."""
MOVABLE = tuple(name for name in EVERYWHERE if name != "WAM-V")
"""Of these, those whose water can move."""
_HIDDEN = "what is drawn is put into the simulator's own equations or into the loads that it is given"
_RIGHT = "the boat is that of the file but for what is drawn; the sensor is wrong"
_NO_NAME = "no effect of the catalogue is what acts: a part of it, a term, undecided, or nothing"


def _by_simulator() -> dict[str, Kind]:
    found: dict[str, Kind] = {}
    for name, simulator in SIMULATORS.items():
        rest = f"; {simulator.why}" if simulator.why else ""
        one, beside = (name,), simulator.nameless
        found[f"{name}: nothing hidden"] = Kind(
            "nothing",
            one,
            f"the file is the simulator's own numbers{rest}",
            "nothing missing, or what the file cannot hold",
        )
        found[f"{name}: one effect"] = Kind(
            "one", one, f"{_HIDDEN}{rest}", "its name, or the names it looks like", 1, nameless=beside
        )
        found[f"{name}: two effects"] = Kind(
            "two", one, f"{_HIDDEN}{rest}", "both names, or one and a rest", 2, nameless=beside
        )
        found[f"{name}: crowd of three"] = Kind(
            "crowd", one, f"{_HIDDEN}{rest}", "the largest of them, and a rest", 3, nameless=beside
        )
    return found


def _sensor(error: str, sensor: Sensor, *others: str) -> Kind:
    return Kind(
        "sensors", EVERYWHERE, _RIGHT, "the sensor's error, and the hidden effect if there is one", 1, True,
        sensors=(error, *others), sensor=sensor,
    )  # fmt: skip


_SENSORS: dict[str, Kind] = {
    "gyro bias": _sensor("gyro_bias", lambda c, s, g: off(_either(g, 0.05, 0.15) * min(s.speed[2], 0.2), "r")),
    "gyro scale": _sensor("gyro_scale", lambda c, s, g: times(1.0 + _either(g, 0.03, 0.08), "r")),
    "gyro with a low-pass": _sensor("gyro_latency", lambda c, s, g: slow(float(g.uniform(0.1, 0.3)) * _slow(c), "r")),
    "compass constant": _sensor(
        "compass_deviation", lambda c, s, g: deviation(radians(_either(g, 2.0, 6.0)), 0.0, 0.0)
    ),
    "compass that deviates": _sensor(
        "compass_deviation", lambda c, s, g: deviation(*(radians(_either(g, 2.0, 6.0)) for _ in range(3)))
    ),
    "velocity scale": _sensor("velocity_scale", lambda c, s, g: times(1.0 + _either(g, 0.04, 0.08), "u", "v")),
    "velocity that is late": _sensor(
        *("velocity_latency", lambda c, s, g: late(float(g.uniform(0.1, 0.4)) * _slow(c), "u", "v"), "position_latency")
    ),
    "antenna off the origin": _sensor(
        "antenna_arm", lambda c, s, g: antenna(_either(g, 0.1, 0.35) * c.length, _either(g, 0.0, 0.15) * c.length)
    ),
}


def _no_name(cause: str) -> Kind:
    return Kind(
        "no name", MOVABLE if cause == "wake behind a wall" else EVERYWHERE, f"{cause}: nothing of the catalogue",
        _NO_NAME, 1, True, nameless=cause,
    )  # fmt: skip


KINDS: dict[str, Kind] = {
    **_by_simulator(),
    **_SENSORS,
    "commands sampled at a tenth": Kind(
        *("record", EVERYWHERE, "the record of the commands holds one in ten of those that acted"),
        *("the record, or nothing: late by half a sample on average", 1, True),
        sensors=("command_offset",),
        part=("input_delay",),
        sampled=True,
    ),
    **{cause: _no_name(cause) for cause in NAMELESS},
    "strips that the file has not": Kind(
        *(
            "no name",
            ("strips",),
            "the file has linear drag alone; strips in pure sway and pure turning are quadratic drag",
        ),
        *(_NO_NAME, 1, True),
        part=("yaw_speed_damping",),
        nameless="cross-flow of strips",
        make=partial(strip_boat, told=False),
    ),
}
"""Every kind by name."""
_HULLS = {
    f"{name} with the hull in the file": Kind(
        *("one", (name,), "the file has the hull's length and draught; its strips are the catalogue's cross-flow drag"),
        "cross_flow_drag with its coefficient",
        true=("cross_flow_drag",),
        make=make,
    )
    for name, make in (
        ("strips", partial(strip_boat, told=False, hull=True)),
        ("Otter", partial(otter, statics=False, hull=True)),
    )
}


def with_hulls() -> dict[str, Kind]:
    """All kinds and those whose vehicle file has `hull: {length, draught}`, for a product that reads such files."""
    return {**KINDS, **_HULLS}
