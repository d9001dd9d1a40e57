"""Forty models with unusual but lawful parameters, drawn by seed: none of them may be accused."""

from collections.abc import Callable

import numpy as np
from boats import dragged, ends, function, scaled, sister, thruster
from planted import Case, Draw, Make

from undertow.physics.laws.energy import full_force
from undertow.physics.momentum_balance import mass_matrix
from undertow.physics.motion import Array
from undertow.physics.vehicle import Vehicle
from undertow.residuals.models.base import Model


def stiff(rate: float, axis: int, formula: bool = False) -> Make:
    """Linear damping of a rate [1/s] on one axis."""

    def make(rng: Draw) -> Model | Vehicle:
        boat = sister(rng)
        symbol = ("X_u", "Y_v", "N_r")[axis]
        boat = boat.with_values({symbol: -rate * mass_matrix(boat)[axis, axis]})
        return boat if formula else function(boat, lambda nu, psi, c: 0.0 * nu, "stiff")

    return make


def stiff_all(rng: Draw) -> Model:
    """Damping of 20 to 50 1/s on all axes, with quadratic drag on top."""
    boat = sister(rng)
    m = np.diag(mass_matrix(boat)) * rng.uniform(20.0, 50.0, 3)
    boat = boat.with_values(dict(zip(("X_u", "Y_v", "N_r"), -m, strict=True)))
    return function(boat, lambda nu, psi, c: 0.0 * nu, "stiff everywhere")


def hump(axis: int) -> Make:
    """Drag that always opposes and falls with speed beyond a hump."""

    def make(rng: Draw) -> Model:
        boat = sister(rng)
        reach = ends(boat)
        top, depth = rng.uniform(0.25, 0.6), rng.uniform(0.3, 0.6)
        full = 0.8 * full_force(boat)

        def drag(nu: Array) -> Array:
            x = nu / reach
            found = -full * np.sign(nu) * np.abs(x) ** 1.2
            y = np.abs(x[:, axis])
            found[:, axis] *= 1.0 - depth / (1.0 + np.exp(-(y - top) / 0.03))
            return found

        return dragged(boat, drag, "hump")

    return make


def hump_formula(rng: Draw) -> Vehicle:
    """The same in a vehicle file: linear and cubic drag, and a quadratic one that drives, all together opposing."""
    boat = sister(rng)
    size, reach = float(full_force(boat)[0]), float(ends(boat)[0])
    a, c = size / reach, size / reach**3
    b = rng.uniform(1.75, 1.9) * np.sqrt(a * c)  # a - b x + c x^2 > 0 for b < 2 sqrt(a c); it falls for b > sqrt(3 a c)
    return boat.with_values({"X_u": -a, "X_uu": b, "surge:u^3": -c})


def shaped(shape: Callable[[Array], Array]) -> Make:
    """Drag of a shape in the share of the top speed on each axis."""

    def make(rng: Draw) -> Model:
        boat = sister(rng)
        reach, full = ends(boat), full_force(boat) * rng.uniform(0.7, 1.0)
        return dragged(boat, lambda nu: -full * np.sign(nu) * shape(np.abs(nu / reach)), "shaped")

    return make


def coupled(rng: Draw) -> Model:
    """Strong linear coupling that still dissipates: a positive definite matrix, and a skew one as large."""
    boat = sister(rng)
    size = np.sqrt(full_force(boat) / ends(boat))
    root, turn = rng.normal(size=(3, 3)), rng.normal(size=(3, 3))
    matrix = (0.3 * root @ root.T + 0.5 * np.eye(3) + turn - turn.T) * np.outer(size, size)
    return dragged(boat, lambda nu: -nu @ matrix.T, "coupled")


def coupled_formula(rng: Draw) -> Vehicle:
    """Couplings of sway and yaw near the most that dissipation allows, and idle ones."""
    boat = sister(rng).with_values({"Y_vv": 0.0, "N_rr": 0.0})
    most = 2.0 * np.sqrt(boat.value("Y_v") * boat.value("N_r"))
    one = rng.uniform(-3.0, 3.0) * most
    idle = rng.uniform(5.0, 20.0)
    other = rng.choice([-0.95, 0.95]) * most - one
    return boat.with_values({"Y_r": one, "N_v": other, "yaw:uv": idle, "sway:ur": -0.4 * idle, "surge:vr": -0.6 * idle})


def one_sided(rng: Draw) -> Model:
    """A hull with other drag ahead than astern and to port than to starboard."""
    boat = sister(rng)
    factor, slope = rng.uniform(2.0, 5.0, 3), full_force(boat) / ends(boat)
    return dragged(boat, lambda nu: -slope * nu * np.where(nu > 0.0, 1.0, factor), "one-sided")


def with_values(draw: Callable[[Draw], dict[str, float]], code: bool = False) -> Make:
    """A vehicle file with unusual numbers, or code made of it."""

    def make(rng: Draw) -> Model | Vehicle:
        boat = sister(rng)
        boat = boat.with_values(draw(rng))
        return function(boat, lambda nu, psi, c: 0.0 * nu, "code") if code else boat

    return make


def stream(rng: Draw) -> dict[str, float]:
    """A current."""
    return {"current_north": float(rng.uniform(-0.8, 0.8)), "current_east": float(rng.uniform(-0.8, 0.8))}


def weather(rng: Draw) -> dict[str, float]:
    """A wind, a trim and a current."""
    wind = {"wind_force_north": float(rng.uniform(-8.0, 8.0)), "wind_force_east": float(rng.uniform(-8.0, 8.0))}
    return {**stream(rng), **wind, "wind_x": 0.5, "wind_y": 0.8, "wind_n": 0.2, "yaw_trim": float(rng.uniform(-3, 3))}


def thrusters(count: str, code: bool = True) -> Make:
    """A boat with other thrusters: one astern, four on the corners, or two and one across the bow."""

    def make(rng: Draw) -> Model | Vehicle:
        boat, force = sister(rng), rng.uniform(20.0, 60.0)
        found = {
            "one": [thruster("stern", -0.8, 0.0, 0.0, force)],
            "four": [
                thruster(f"t{k}", x, y, a, force)
                for k, (x, y, a) in enumerate(((0.5, -0.4, 45), (0.5, 0.4, -45), (-0.5, -0.4, -45), (-0.5, 0.4, 45)))
            ],
            "bow": [thruster("aft", -0.8, 0.0, 0.0, force), thruster("bow", 0.8, 0.0, 90.0, 0.3 * force)],
        }[count]
        boat = boat.model_copy(update={"thrusters": tuple(found)})
        return function(boat, lambda nu, psi, c: 0.0 * nu, "code") if code else boat

    return make


def sized(low: float, high: float, code: bool = False) -> Make:
    """A far larger or smaller sister."""

    def make(rng: Draw) -> Model | Vehicle:
        boat = scaled(sister(rng), float(np.exp(rng.uniform(np.log(low), np.log(high)))))
        return function(boat, lambda nu, psi, c: 0.0 * nu, "code") if code else boat

    return make


def faint(rng: Draw) -> Vehicle:
    """A twentieth of the usual damping."""
    boat = sister(rng)
    return boat.with_values({s: 0.05 * boat.value(s) for s in boat.damping})


def linear_only(rng: Draw) -> Vehicle:
    """Hardly any damping, and none of it quadratic: 60 s are too short to see the speeds settle."""
    boat = sister(rng)
    rates = rng.uniform(0.005, 0.02, 3) * np.diag(mass_matrix(boat))
    none = dict.fromkeys(("X_uu", "Y_vv", "N_rr"), 0.0)
    return boat.with_values({**none, "X_u": -rates[0], "Y_v": -20 * rates[1], "N_r": -20 * rates[2]})


def other_thrust(factor: float) -> Make:
    """Thrusters stronger or weaker than the file says, as a learnt model may find."""

    def make(rng: Draw) -> Model:
        boat = sister(rng)
        other = boat.with_values({"thrust_scale": factor * boat.value("thrust_scale")})
        return function(boat, lambda nu, psi, c: 0.0 * nu, "other thrust", of=other)

    return make


HONEST = (
    *(
        Case(f"{rate:g} 1/s in {axis}, code", stiff(rate, k))
        for rate, k, axis in ((12.0, 0, "surge"), (25.0, 2, "yaw"))
    ),
    Case("50 1/s in sway, code", stiff(50.0, 1)),
    Case("20 to 50 1/s on all axes, code", stiff_all),
    Case("12 1/s in surge, formula", stiff(12.0, 0, True)),
    Case("50 1/s in yaw, formula", stiff(50.0, 2, True)),
    *(Case(f"hump in {axis}, code", hump(k)) for k, axis in enumerate(("surge", "sway", "yaw"))),
    Case("hump, formula", hump_formula),
    Case("cubic drag, code", shaped(lambda x: x**3 + 0.01 * x)),
    Case("dry friction, code", shaped(lambda x: 0.5 + 0.5 * x)),
    Case("drag of the root, code", shaped(np.sqrt)),
    Case("planing: drag that drops at once", shaped(lambda x: np.where(x > 0.5, 0.6, 1.2) * x)),
    Case("coupled, code", coupled),
    Case("coupled, formula", coupled_formula),
    Case("one-sided hull, code", one_sided),
    Case("dead zone", with_values(lambda rng: {"dead_zone": rng.uniform(0.1, 0.4)}, True)),
    Case("lag and delay", with_values(lambda rng: {"lag": rng.uniform(0.5, 3.0), "delay": rng.uniform(0.2, 1.0)})),
    Case("wake", with_values(lambda rng: {"memory_sway": 60.0, "memory_yaw": 8.0, "memory_time": rng.uniform(0.5, 8)})),
    Case("current", with_values(stream)),
    Case("current, code", with_values(stream, True)),
    Case("current, wind and trim", with_values(weather)),
    Case("current, wind and trim, code", with_values(weather, True)),
    Case("a ship", sized(20.0, 80.0)),
    Case("a ship, code", sized(20.0, 80.0, True)),
    Case("a toy", sized(0.03, 0.1)),
    Case("a toy, code", sized(0.03, 0.1, True)),
    Case("faint damping", faint),
    Case("faint linear damping", linear_only),
    Case("advance loss", with_values(lambda rng: {"advance_loss": rng.uniform(5.0, 20.0)})),
    Case("advance loss, code", with_values(lambda rng: {"advance_loss": rng.uniform(5.0, 20.0)}, True)),
    Case("one thruster", thrusters("one", False)),
    Case("one thruster, code", thrusters("one")),
    Case("four thrusters, code", thrusters("four")),
    Case("a bow thruster, code", thrusters("bow")),
    Case("weak port thruster, code", with_values(lambda rng: {"port_scale": rng.uniform(0.1, 0.6)}, True)),
    Case(
        "bent thrust curve", with_values(lambda rng: {"thrust_exponent": rng.uniform(0.5, 2.5), "reverse_scale": 0.4})
    ),
    Case("stronger thrusters, code", other_thrust(1.4)),
    Case("weaker thrusters, code", other_thrust(0.3)),
)
assert len(HONEST) == 40, len(HONEST)
