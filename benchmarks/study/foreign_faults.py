"""Sensors, vehicle files and records of commands that are wrong: each sets what is true of a foreign world."""

from collections.abc import Callable

from .foreign_boats import slewed
from .foreign_effects import moved
from .foreign_orders import boat
from .foreign_sensors import Sense, through_water
from .foreign_world import World, delayed

Make = Callable[[World], None]
"""Sets what is true of a world before its boat is driven."""


def between(world: World, low: float, high: float) -> float:
    return float(world.rng.uniform(low, high))


def either(world: World, low: float, high: float) -> float:
    return float(world.rng.choice([-1.0, 1.0])) * between(world, low, high)


def sensed(make: Callable[[World], Sense]) -> Make:
    return lambda world: world.senses.append(make(world))


def moving_water(world: World) -> None:
    north, east = (float(x) for x in world.rng.uniform(-0.3, 0.3, 2))
    world.current = lambda t: (north, east, 0.0, 0.0)
    world.senses.append(through_water(world.current))
    world.known |= {"current_north": north, "current_east": east}


def mass(world: World) -> None:
    moved(world, "mass_offset", "mass", either(world, 0.2, 0.2) * world.file.values["mass"])


def inertia(world: World) -> None:
    change = either(world, 0.2, 0.2) * world.file.values["inertia_z"]
    world.values["inertia_z"] += change
    world.known["N_rdot"] = -change


def arm(world: World) -> None:
    world.arms = 1.0 + either(world, 0.05, 0.05)
    world.known["arm_scale"] = world.arms


def added_mass(world: World) -> None:
    effect, symbol, share = (
        ("surge_added_mass", "X_udot", 0.25),
        ("sway_added_mass", "Y_vdot", 0.4),
        ("yaw_added_mass", "N_rdot", 0.4),
    )[int(world.rng.integers(3))]
    whole = world.file.values["inertia_z" if symbol == "N_rdot" else "mass"]
    moved(world, effect, symbol, -share * between(world, 0.7, 1.3) * whole)


def curve(world: World) -> None:
    """Forces of middling commands are greater or less than the file says, and astern is weaker."""
    bend, astern = either(world, 0.25, 0.5), between(world, 0.7, 0.95)
    world.pushes.append(
        lambda force, time, share: force * (1.0 + bend * (1.0 - abs(share))) * (1.0 - (1.0 - astern) * (share < 0.0))
    )


def switching(world: World) -> None:
    world.between = True


def rated(world: World) -> None:
    world.record.long, world.record.command_rate = True, float(world.rng.choice((1.0, 2.0, 5.0, 20.0, 50.0)))
    world.between = True


def rounded(world: World) -> None:
    world.new(boat(world.rng, "pwm"))
    world.record.quantum = float(world.rng.choice((10.0, 25.0)))


def acts_late(world: World) -> None:
    delay = round(between(world, 0.05, 0.3), 2)
    world.actuators.append(delayed(delay, world.step))
    world.known["delay"] = delay


def stamped_late(world: World) -> None:
    world.record.late = round(between(world, 0.05, 0.3), 2)


def set_points(world: World) -> None:
    most = world.step / between(world, 0.4, 1.5)
    world.actuators.append(lambda share: slewed(share, most))


def on_change(world: World) -> None:
    world.record.long = world.record.on_change = True
