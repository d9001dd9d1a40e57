"""Forty models that break a law of a hull in water, drawn by seed; twenty do so in under 1 % of what they meet."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from boats import dragged, ends, function, newtons, scaled, sister, window, without_damping

from undertow.physics.laws.damping_power import damping_power
from undertow.physics.laws.energy import full_force
from undertow.physics.momentum_balance import coriolis_matrix, mass_matrix, thruster_matrix
from undertow.physics.motion import Array
from undertow.physics.vehicle import Vehicle
from undertow.residuals.models.base import Model, VehicleModel
from undertow.residuals.models.foreign import FunctionModel

Draw = np.random.Generator
Make = Callable[[Draw], Model | Vehicle]


@dataclass(frozen=True, slots=True)
class Case:
    """A model of the trial; a vehicle goes through a file, anything else is judged as it is."""

    name: str
    make: Make


def slab(axis: int, share: float) -> Make:
    """A window across one velocity, which fills a share of the envelope."""

    def make(rng: Draw) -> Model:
        boat = sister(rng)
        reach = ends(boat)[axis]
        low = rng.uniform(-0.9, 0.85) * reach
        return window(boat, lambda nu, psi, c: (nu[:, axis] > low) & (nu[:, axis] < low + 2.0 * share * reach), "slab")

    return make


def two_slabs(rng: Draw) -> Model:
    """A window in two velocities, half a per cent of the envelope."""
    boat = sister(rng)
    reach, (i, j) = ends(boat), rng.choice(3, 2, replace=False)
    low = rng.uniform(-0.8, 0.6, 2)

    def inside(nu: Array, psi: Array, c: Array) -> np.ndarray:
        x, y = nu[:, i] / reach[i] - low[0], nu[:, j] / reach[j] - low[1]
        return (x > 0.0) & (x < 0.14) & (y > 0.0) & (y < 0.14)

    return window(boat, inside, "two slabs")


def heading(degrees: float) -> Make:
    """A window in the heading."""

    def make(rng: Draw) -> Model:
        boat, middle = sister(rng), rng.uniform(-np.pi, np.pi)
        wide = np.radians(degrees / 2.0)
        return window(boat, lambda nu, psi, c: np.cos(psi - middle) > np.cos(wide), "heading")

    return make


def corner(rng: Draw) -> Model:
    """One corner of the envelope: the outer fifth on each axis."""
    boat = sister(rng)
    reach, sign = ends(boat), rng.choice([-1.0, 1.0], 3)
    return window(boat, lambda nu, psi, c: np.all(nu * sign > 0.8 * reach, axis=1), "corner")


def ridge(rng: Draw) -> Model:
    """A thin sheet oblique to all axes."""
    boat = sister(rng)
    reach, normal, middle = ends(boat), rng.normal(size=3), rng.uniform(-0.3, 0.3)
    normal /= np.linalg.norm(normal)
    return window(boat, lambda nu, psi, c: np.abs(nu / reach @ normal - middle) < 0.005, "ridge")


def sphere(share: float) -> Make:
    """A ball that fills a share of the envelope."""

    def make(rng: Draw) -> Model:
        boat = sister(rng)
        reach = ends(boat)
        radius = (6.0 * share / np.pi) ** (1.0 / 3.0)
        middle = rng.uniform(-1.0 + radius, 1.0 - radius, 3)
        return window(boat, lambda nu, psi, c: (((nu / reach - middle) / radius) ** 2).sum(axis=1) < 1.0, "sphere")

    return make


def one_command(rng: Draw) -> Model:
    """A window of 0.8 % of one command."""
    boat = sister(rng)
    full, k, low = newtons(boat), int(rng.integers(2)), rng.uniform(-0.95, 0.9)
    return window(
        boat, lambda nu, psi, c: (c[:, k] / full[k] > low) & (c[:, k] / full[k] < low + 0.016), "one command", share=1.0
    )


def both_commands(rng: Draw) -> Model:
    """A sway push where both commands are above 86 % of full."""
    boat = sister(rng)
    full, side = newtons(boat), float(rng.choice([-1.0, 1.0]))
    push = np.array([0.0, 0.3 * side * full_force(boat)[1], 0.0])
    return function(boat, lambda nu, psi, c: np.all(c > 0.86 * full, axis=1)[:, None] * push, "both commands")


def command_box(rng: Draw) -> Model:
    """A window of 8 % by 8 % somewhere in the two commands."""
    boat = sister(rng)
    full, low = newtons(boat), rng.uniform(-0.9, 0.7, 2)

    def inside(nu: Array, psi: Array, c: Array) -> np.ndarray:
        return np.all((c / full > low) & (c / full < low + 0.16), axis=1)

    return window(boat, inside, "command box", share=1.0)


def turning_corner(rng: Draw) -> Model:
    """A corner of the commands, one ahead and one astern, with a yaw moment the other way."""
    boat = sister(rng)
    full = newtons(boat)
    sign = np.array([1.0, -1.0]) * rng.choice([-1.0, 1.0])
    push = np.array([0.0, 0.0, -2.5 * np.sign((thruster_matrix(boat) @ sign)[2]) * full_force(boat)[2]])
    return function(boat, lambda nu, psi, c: (c * sign > 0.9 * full).all(axis=1)[:, None] * push, "turning corner")


def fast_and_full(rng: Draw) -> Model:
    """A window at the end of one speed and of one command."""
    boat = sister(rng)
    full, reach = newtons(boat), ends(boat)
    k, axis = int(rng.integers(2)), int(rng.integers(3))
    return window(
        boat, lambda nu, psi, c: (nu[:, axis] > 0.85 * reach[axis]) & (c[:, k] > 0.85 * full[k]), "both ends", share=1.0
    )


def heading_and_command(rng: Draw) -> Model:
    """A window in the heading, for some commands."""
    boat, middle = sister(rng), rng.uniform(-np.pi, np.pi)
    full, low = newtons(boat), rng.uniform(-0.9, 0.7)

    def inside(nu: Array, psi: Array, c: Array) -> np.ndarray:
        return (np.cos(psi - middle) > np.cos(0.15)) & (c[:, 0] / full[0] > low) & (c[:, 0] / full[0] < low + 0.2)

    return window(boat, inside, "heading and command", share=1.0)


def pushed_in_a_heading(rng: Draw) -> Model:
    """A push at rest in two degrees of the heading."""
    boat, middle, axis = sister(rng), rng.uniform(-np.pi, np.pi), int(rng.integers(3))
    push = np.eye(3)[axis] * 0.03 * full_force(boat)

    def force(nu: Array, psi: Array, c: Array) -> Array:
        return (np.cos(psi - middle) > np.cos(np.radians(1.0)))[:, None] * push

    return function(boat, force, "pushed in a heading")


def cone(rng: Draw) -> Model:
    """Motions in a thin cone of directions."""
    boat = sister(rng)
    reach, along = ends(boat), rng.normal(size=3)
    along /= np.linalg.norm(along)

    def inside(nu: Array, psi: Array, c: Array) -> np.ndarray:
        x = nu / reach
        return x @ along > 0.98 * np.linalg.norm(x, axis=1)

    return window(boat, inside, "cone")


def lopsided(share: float) -> Make:
    """A formula with a coupling that creates energy in a share of the envelope."""

    def make(rng: Draw) -> Vehicle:
        boat = sister(rng)
        term = str(rng.choice(["sway:uv", "yaw:ur", "sway:vr", "surge:uuu", "yaw:uv"]))
        states = ends(boat) * rng.uniform(-1.0, 1.0, (20000, 3))
        low, high = 0.0, 1e5
        for _ in range(60):
            middle = 0.5 * (low + high)
            broken = float((damping_power(boat.with_values({term: middle}), states) > 0.0).mean())
            low, high = (middle, high) if broken < share else (low, middle)
        return boat.with_values({term: high})

    return make


THIN = (
    *(Case(f"slab of 0.4 % in {name}", slab(k, 0.004)) for k, name in enumerate(("surge", "sway", "yaw"))),
    Case("two slabs", two_slabs),
    Case("heading of 3 degrees", heading(3.0)),
    Case("heading of 1 degree", heading(1.0)),
    Case("corner of the envelope", corner),
    Case("oblique sheet", ridge),
    Case("ball of 0.1 %", sphere(1e-3)),
    Case("ball of 0.01 %", sphere(1e-4)),
    Case("cone of directions", cone),
    Case("window in one command", one_command),
    Case("both commands above 86 %", both_commands),
    Case("window in both commands", command_box),
    Case("turning corner", turning_corner),
    Case("fast and full", fast_and_full),
    Case("heading and command", heading_and_command),
    Case("push at rest in a heading", pushed_in_a_heading),
    Case("formula, 0.5 %", lopsided(5e-3)),
    Case("formula, 0.05 %", lopsided(5e-4)),
)


def changed(symbol: str, factor: float) -> Make:
    """A vehicle file with one number of the wrong sign or size."""

    def make(rng: Draw) -> Vehicle:
        boat = sister(rng)
        return boat.with_values({symbol: factor * rng.uniform(0.5, 1.5) * boat.value(symbol)})

    return make


def light(symbol: str) -> Make:
    """A vehicle file whose added mass takes more than the mass away."""

    def make(rng: Draw) -> Vehicle:
        boat = sister(rng)
        size = boat.inertia_z if symbol == "N_rdot" else boat.mass
        return boat.with_values({symbol: size * rng.uniform(1.02, 1.5)})

    return make


def pushed(axis: int) -> Make:
    """A push at rest that no file states."""

    def make(rng: Draw) -> Model:
        boat = sister(rng)
        force = np.eye(3)[axis] * rng.choice([-1.0, 1.0]) * rng.uniform(0.015, 0.05) * full_force(boat)
        return function(boat, lambda nu, psi, c: np.tile(force, (len(nu), 1)), "pushed")

    return make


def wrong_coriolis(rng: Draw) -> Model:
    """Code whose Coriolis force has one sign wrong, on a hull with little drag."""
    boat = sister(rng).with_values({"X_u": -2.0, "X_uu": -1.0, "Y_v": -4.0, "Y_vv": 0.0, "N_r": -1.0, "N_rr": -1.0})

    def force(nu: Array, psi: Array, c: Array) -> Array:
        turning = np.einsum("nij,nj->ni", coriolis_matrix(boat, nu), nu)
        return 2.0 * turning * [0.0, 1.0, 0.0]

    return function(boat, force, "wrong Coriolis")


def wrong_mass(rng: Draw) -> Model:
    """Code with a mass matrix that is not positive definite: force ahead moves it astern."""
    boat = sister(rng)
    m = mass_matrix(boat).copy()
    axis = int(rng.choice([0, 2]))
    m[axis, axis] *= -rng.uniform(0.3, 2.0)
    inverse, honest = np.linalg.inv(m) @ mass_matrix(boat), VehicleModel(boat, "hull")
    return FunctionModel(lambda nu, psi, c: honest.settled(nu, psi, c) @ inverse.T, boat, "wrong mass")


def strong(rng: Draw) -> Model:
    """Thrusters several times as strong as the file says."""
    boat, factor = sister(rng), rng.uniform(2.0, 5.0)
    strong = boat.with_values({"thrust_scale": factor * boat.value("thrust_scale")})
    return function(boat, lambda nu, psi, c: 0.0 * nu, "strong", of=strong)


def brake_that_drives(rng: Draw) -> Model:
    """Full astern pushes ahead once the boat is fast."""
    boat = sister(rng)
    full, reach = newtons(boat), ends(boat)
    push = np.array([2.5 * full_force(boat)[0], 0.0, 0.0])

    def force(nu: Array, psi: Array, c: Array) -> Array:
        return ((c.sum(axis=1) < -0.5 * full.sum()) & (nu[:, 0] > 0.5 * reach[0]))[:, None] * push

    return function(boat, force, "brake that drives")


def free(rng: Draw) -> Model:
    """Code without any drag."""
    return dragged(sister(rng), lambda nu: 0.0 * nu, "no drag")


def driven_by_drag(rng: Draw) -> Model:
    """Drag that drives at a tenth of the speeds of one axis."""
    boat, axis, low = sister(rng), int(rng.integers(3)), rng.uniform(0.2, 0.8)
    reach = ends(boat)[axis]
    return window(boat, lambda nu, psi, c: np.abs(nu[:, axis] / reach - low) < 0.1, "drag that drives")


def half_bare(rng: Draw) -> Vehicle:
    """No drag in surge."""
    return sister(rng).with_values({"X_u": 0.0, "X_uu": 0.0})


def drives_when_fast(rng: Draw) -> Vehicle:
    """Quadratic surge drag that drives, from about half the top speed on."""
    boat = sister(rng)
    reach = float(ends(boat)[0])
    return boat.with_values({"X_uu": -rng.uniform(1.5, 3.0) * boat.value("X_u") / reach})


WIDE = (
    *(Case(f"{s} drives", changed(s, -1.0)) for s in ("X_u", "Y_v", "N_r")),
    Case("X_uu drives", drives_when_fast),
    *(Case(f"{s} above the mass", light(s)) for s in ("X_udot", "Y_vdot", "N_rdot")),
    Case("negative mass", lambda rng: sister(rng).with_values({"mass": -rng.uniform(5.0, 50.0)})),
    Case("no damping", lambda rng: without_damping(sister(rng))),
    Case("no damping, a ship", lambda rng: without_damping(scaled(sister(rng), rng.uniform(20.0, 60.0)))),
    Case("no damping in surge", half_bare),
    Case("wake that drives", lambda rng: sister(rng).with_values({"memory_sway": -rng.uniform(200.0, 400.0)})),
    *(Case(f"push at rest in {name}", pushed(k)) for k, name in ((0, "surge"), (2, "yaw"))),
    Case("drag that drives", driven_by_drag),
    Case("wrong Coriolis", wrong_coriolis),
    Case("wrong mass", wrong_mass),
    Case("strong thrusters", strong),
    Case("brake that drives", brake_that_drives),
    Case("code without drag", free),
)
assert (len(THIN), len(WIDE)) == (20, 20)
