"""Simulated fleets at the level of what their logs say: estimates with covariance, day scatter, and what happens."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from undertow.fleet.parameter_estimates import Fleet, HullEstimate

PARAMETERS = (
    *("X_u", "X_uu", "Y_v", "Y_vv", "N_r", "N_rr"),
    *("thrusters.port.scale", "thrusters.stbd.scale", "mass"),
)
NOMINAL = np.array([-15.0, -8.0, -40.0, -80.0, -6.0, -8.0, 1.0, 1.0, 30.5])  # the shipped BlueBoat
DAY = 86400.0  # [s]
START = 20000 * DAY
LOG_DEVIATION = np.array([0.003, 0.004, 0.006, 0.008, 0.004, 0.005, 0.001, 0.001, 0.002])
"""Of ten minutes of the rich programme under field noise, in shares (`--real` measures it)."""
PAIRS = ((0, 1, -0.84), (2, 3, -0.91), (4, 5, -0.97), (6, 7, 0.7), (6, 8, 0.56), (7, 8, 0.59))
"""Correlations within such a log."""
BOATS_APART = np.array([0.10, 0.10, 0.08, 0.08, 0.08, 0.08, 0.04, 0.04, 0.05])
"""Deviation of boats of one type about their mean, in shares."""


@dataclass(frozen=True)
class Scatter:
    """What days do beside the noise of a log, deviations in shares; `tails`: degrees of freedom of Student's t."""

    load: float = 0.03
    battery: float = 0.03
    waves: float = 0.06
    own: float = 0.02
    tails: float = np.inf
    memory: float = 0.0

    def factors(self) -> np.ndarray:
        """Columns that a standard normal number each makes the scatter of a day, (p, k)."""
        load = self.load * np.array([0.3, 0.3, 0.1, 0.1, 0.1, 0.1, 0.0, 0.0, 1.0])
        battery = self.battery * np.array([0.0] * 6 + [1.0, 1.0, 0.0])
        waves = self.waves * np.array([1.0, 0.2, 0.7, 0.2, 0.7, 0.2, 0.0, 0.0, 0.0])
        split = self.waves * np.array([0.7, -0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
        return np.column_stack([load, battery, waves, split, self.own * np.eye(9)])


@dataclass(frozen=True)
class Happening:
    """What happens to a boat: shares of the parameters at once from `day` on, or a day from then on, until `ends`."""

    kind: str
    day: float
    at_once: np.ndarray = field(default_factory=lambda: np.zeros(9))
    a_day: np.ndarray = field(default_factory=lambda: np.zeros(9))
    ends: float = np.inf

    def share(self, day: float) -> np.ndarray:
        since = day - self.day
        on = since >= 0.0 and day < self.ends
        return (self.at_once + self.a_day * max(since, 0.0)) * on


def happening(kind: str, rng: np.random.Generator, day: float) -> Happening:
    """A fault of a usual size."""
    zero = np.zeros(9)
    match kind:
        case "fouling":  # drag ahead grows by a half in 50 to 150 days, aside by less
            rate = 0.5 / rng.uniform(50.0, 150.0)
            aside = rng.uniform(0.2, 0.8)
            return Happening(kind, day, zero, rate * np.array([1.0, 1.0, *[aside] * 4, 0.0, 0.0, 0.0]))
        case "propeller damage":  # a blade of three
            lost = zero.copy()
            lost[rng.integers(6, 8)] = -rng.uniform(0.2, 0.4)
            return Happening(kind, day, lost)
        case "payload":
            load = rng.uniform(0.15, 0.35)
            drag = load * rng.uniform(0.2, 0.7)
            return Happening(kind, day, np.array([drag, drag, *[0.4 * drag] * 4, 0.0, 0.0, load]))
        case "battery":  # falls, and comes back after some days
            fall = rng.uniform(0.12, 0.25)
            ends = day + rng.uniform(3.0, 20.0)
            return Happening(kind, day, np.array([0.0] * 6 + [-fall, -fall, 0.0]), ends=ends)
        case "cleaning":
            drop = rng.uniform(0.15, 0.35)
            aside = rng.uniform(0.2, 0.8)
            return Happening(kind, day, -drop * np.array([1.0, 1.0, *[aside] * 4, 0.0, 0.0, 0.0]))
        case "another":  # nothing that has a name: the turning damping alone, or sway alone, at once
            what = zero.copy()
            what[[4, 5] if rng.random() < 0.5 else [2, 3]] = rng.choice([-1.0, 1.0]) * rng.uniform(0.2, 0.4)
            return Happening(kind, day, what)
    raise ValueError(kind)


def simulated(
    boats: int,
    days: int,
    rng: np.random.Generator,
    happens: Mapping[int, Happening] | None = None,
    scatter: Scatter = Scatter(),
    apart: float = 1.0,
    logged: float = 0.7,
) -> tuple[Fleet, np.ndarray, np.ndarray]:
    """A fleet, the parameters of its boats (boats, p) before anything happens, and factors of scatter (boats,).

    A boat logs on a share `logged` of its days, one to three logs a day of 5 to 30 minutes that say more or less, and
    lies in harbour for some weeks; its scatter is its own by a quarter. `apart` scales how far boats differ.
    """
    happens = happens or {}
    own = np.array([1.0 + apart * BOATS_APART * rng.standard_normal(9) for _ in range(boats)])
    correlation = np.eye(9)
    for i, j, value in PAIRS:
        correlation[i, j] = correlation[j, i] = value
    correlation = 0.9 * correlation + 0.1 * np.eye(9)
    columns = scatter.factors()
    estimates = []
    noisy = np.exp(0.25 * rng.standard_normal(boats))
    for boat in range(boats):
        away = rng.uniform(0, days) if days > 60 else days
        before = rng.standard_normal(columns.shape[1])
        for day in range(days):
            fresh = rng.standard_normal(columns.shape[1])
            before = scatter.memory * before + np.sqrt(1.0 - scatter.memory**2) * fresh
            if rng.random() > logged or away <= day < away + 21.0:
                continue
            tail = 1.0 if np.isinf(scatter.tails) else np.sqrt((scatter.tails - 2.0) / rng.chisquare(scatter.tails))
            weather = noisy[boat] * tail * columns @ before
            for hour in np.sort(rng.uniform(6.0, 18.0, rng.integers(1, 4))):
                minutes = rng.uniform(5.0, 30.0)
                poor = np.exp(rng.uniform(0.0, np.log(6.0)))  # gentle manoeuvres say less than rich ones
                deviation = LOG_DEVIATION * poor * np.sqrt(10.0 / minutes)
                covariance = correlation * np.outer(deviation, deviation)
                when = day + hour / 24.0
                change = happens[boat].share(when) if boat in happens else 0.0
                true = own[boat] * (1.0 + weather + change)
                seen = true + np.linalg.cholesky(covariance) @ rng.standard_normal(9)
                estimates.append(
                    HullEstimate(
                        f"boat-{boat + 1:02d}",
                        START + when * DAY,
                        minutes / 60.0,
                        seen * NOMINAL,
                        covariance * np.outer(NOMINAL, NOMINAL),
                        f"boat-{boat + 1:02d}/{day:03d}-{hour:05.2f}.csv",
                    )
                )
    estimates.sort(key=lambda estimate: estimate.time)
    return Fleet(PARAMETERS, NOMINAL.copy(), tuple(estimates)), own, noisy**2
