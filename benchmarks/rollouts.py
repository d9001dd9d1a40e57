"""Rollouts in one batch against a loop over starts, SciPy's solve_ivp, and compiled code where numba is installed.

    python benchmarks/rollouts.py

`speed.py --rollouts` puts the same figures into docs/performance.md. All integrate one model, a boat with linear and
quadratic damping and two thrusters, from the same starts, and the largest difference of a state is told beside the
times. numba is no part of undertow: where it is installed, what it would bring is measured, with a kernel of just this
model, without the effects that undertow's force equation knows.
"""

import importlib
import importlib.util
import time
from collections.abc import Callable

import numpy as np
from measured import Figures
from scipy.integrate import solve_ivp

from undertow.measurements.statistics.processors import single_threaded
from undertow.physics.forces import actuation
from undertow.physics.integration import rollout
from undertow.physics.momentum_balance import coriolis_matrix, damping_matrix, mass_matrix, thruster_matrix
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.hidden_effects import apply_effects
from undertow.physics.worlds.world import simulate_world

HORIZON, SPACING = 10.0, 5.0
"""Length of a rollout and time between starts [s]: those of a comparison."""
HIDDEN = {"surge_quadratic_damping": (-6.0,), "yaw_quadratic_damping": (-3.0,)}


@single_threaded
def against_others(figures: Figures) -> None:
    """Tell the times and the differences."""
    nominal = load_vehicle("blueboat")
    boat = apply_effects(nominal, HIDDEN)
    motion = simulate_world(nominal, HIDDEN, duration=300.0, seed=1).motion(0.05)
    steps = round(HORIZON / motion.time_step)
    starts = np.arange(0, motion.time.size - steps - 1, round(SPACING / motion.time_step))
    what = f"{starts.size} rollouts of {HORIZON:g} s at {1.0 / motion.time_step:g} Hz"

    batch, states = _timed(lambda: rollout(boat, motion, starts, steps).states, 5)
    figures.tell(f"{what} in one batch", 1e3 * batch, None, "ms")
    alone, found = _timed(lambda: np.concatenate([rollout(boat, motion, s, steps).states for s in starts[:, None]]))
    _tell(figures, f"{what}, one after the other", alone / batch, found - states)
    scipy, found = _timed(lambda: np.stack([_by_scipy(boat, motion, int(s), steps) for s in starts]))
    _tell(figures, f"{what}, SciPy's solve_ivp (RK45, 1e-6) of the written model", scipy / batch, found - states)
    if importlib.util.find_spec("numba") is not None:
        compiled = _kernel()
        inputs = _arrays(boat, motion, starts)
        begun = time.perf_counter()
        compiled(*inputs, steps)
        figures.tell("numba: the first call, which compiles", time.perf_counter() - begun, None, "s")
        numba, found = _timed(lambda: compiled(*inputs, steps), 5)
        _tell(figures, f"{what}, compiled by numba for this model alone", numba / batch, found - states)


def _tell(figures: Figures, what: str, ratio: float, difference: np.ndarray) -> None:
    figures.tell(f"{what}: its time over that of the batch", ratio, None, "")
    figures.tell("the same, largest difference of a state", float(np.abs(difference).max()), None, "")


def _timed(work: Callable[[], np.ndarray], times: int = 1) -> tuple[float, np.ndarray]:
    """The best time of some tries [s], and the result."""
    seconds = []
    for _ in range(times):
        begun = time.perf_counter()
        found = work()
        seconds.append(time.perf_counter() - begun)
    return min(seconds), found


def _by_scipy(boat: Vehicle, motion: Motion, start: int, steps: int) -> np.ndarray:
    """One rollout as an engineer writes it down: M nu_dot + C(nu) nu + D(nu) nu = B T, thrust linear between rows."""
    inverse, thrust = np.linalg.inv(mass_matrix(boat)), thruster_matrix(boat) @ actuation(boat, motion).thrust
    rows = motion.time[start : start + steps + 1]

    def rates(now: float, x: np.ndarray) -> np.ndarray:
        pushed = np.array([np.interp(now, rows, side[start : start + steps + 1]) for side in thrust])
        nu, c, s = x[3:], np.cos(x[2]), np.sin(x[2])
        force = pushed - (coriolis_matrix(boat, nu) + damping_matrix(boat, nu)) @ nu
        return np.array([c * nu[0] - s * nu[1], s * nu[0] + c * nu[1], nu[2], *(inverse @ force)])

    first = np.array([*motion.position[start], motion.heading[start], *motion.velocity[start]])
    return solve_ivp(rates, (rows[0], rows[-1]), first, t_eval=rows, rtol=1e-6, atol=1e-9, max_step=1.0).y.T


def _arrays(boat: Vehicle, motion: Motion, starts: np.ndarray) -> tuple[np.ndarray, ...]:
    """What the kernel takes: mass matrix and inverse, damping, forces (3, rows), states (starts, 6), starts, step."""
    mass = mass_matrix(boat)
    linear = np.array([boat.value(s) for s in ("X_u", "Y_v", "N_r")])
    quadratic = np.array([boat.value(s) for s in ("X_uu", "Y_vv", "N_rr")])
    forces = thruster_matrix(boat) @ actuation(boat, motion).thrust
    first = np.column_stack([motion.position, motion.heading, motion.velocity])[starts]
    return mass, np.linalg.inv(mass), linear, quadratic, forces, first, starts, np.array([motion.time_step])


def _kernel() -> Callable[..., np.ndarray]:
    """The model in plain loops, compiled when it is first called."""
    numba = importlib.import_module("numba")  # whose types no checker can ask for

    @numba.njit(fastmath=False)
    def rates(x, force, m, inverse, linear, quadratic):  # type: ignore[no-untyped-def]
        u, v, r = x[3], x[4], x[5]
        c, s = np.cos(x[2]), np.sin(x[2])
        a, b = m[1, 1] * v + m[1, 2] * r, m[0, 0] * u + m[0, 2] * r
        f0 = force[0] + (linear[0] + quadratic[0] * abs(u)) * u + a * r
        f1 = force[1] + (linear[1] + quadratic[1] * abs(v)) * v - b * r
        f2 = force[2] + (linear[2] + quadratic[2] * abs(r)) * r - a * u + b * v
        out = np.empty(6)
        out[0], out[1], out[2] = c * u - s * v, s * u + c * v, r
        for k in range(3):
            out[3 + k] = inverse[k, 0] * f0 + inverse[k, 1] * f1 + inverse[k, 2] * f2
        return out

    @numba.njit(fastmath=False)
    def rolled(m, inverse, linear, quadratic, forces, first, starts, step, steps):  # type: ignore[no-untyped-def]
        h = step[0]
        states = np.empty((starts.size, steps + 1, 6))
        for n in range(starts.size):
            x = first[n].copy()
            states[n, 0] = x
            for k in range(steps):
                begin, end = forces[:, starts[n] + k], forces[:, starts[n] + k + 1]
                middle = 0.5 * (begin + end)
                k1 = rates(x, begin, m, inverse, linear, quadratic)
                k2 = rates(x + 0.5 * h * k1, middle, m, inverse, linear, quadratic)
                k3 = rates(x + 0.5 * h * k2, middle, m, inverse, linear, quadratic)
                k4 = rates(x + h * k3, end, m, inverse, linear, quadratic)
                x = x + (h / 6.0) * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
                states[n, k + 1] = x
        return states

    return rolled


if __name__ == "__main__":
    against_others(Figures())
