"""Boats that are steered: random hulls with hidden effects that matter to a controller, or with nothing hidden."""

import tempfile
import time
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import undertow
from undertow.physics.effects import EFFECTS, effect_named
from undertow.physics.errors import RequestError
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.hidden_effects import apply_effects, random_hull, typical_effect, with_hull
from undertow.physics.worlds.world import simulate_world
from undertow.residuals.models.base import Model, VehicleModel
from undertow.steering.closed_loop import PERFECT, Surroundings, drive, merit
from undertow.steering.known_model import known_model
from undertow.steering.tracks import TRACKS, pace_of, track_named

from .worlds import merged

STEERED = {
    "hidden": {"los": tuple(TRACKS), "nmpc": ("square", "transients")},
    "nothing": {"los": ("square", "transients"), "nmpc": ("square",)},
}
"""Tracks by kind of world and controller: a plan takes ten times as long as a formula, so it has fewer of them."""
SCREENS = {"los": ("square", "transients"), "nmpc": ("square",)}
"""Tracks on which it is seen whether hidden effects are worth anything, in gusts and noise of another seed."""
HIDDEN = 3
"""Effects that are hidden together, of typical size: one alone is seldom worth much to a controller with feedback."""
WORTH = 0.6
"""Share of the nominal error that the perfect model has at most where hidden effects are worth it: then there is a
reason to ask for three tenths less. The corrected model has no part in it."""
_UNFELT = ("apparent_wind",)
"""Effects that are not hidden: the air of a trial is still."""
_SCREEN_SEED = 10_000
"""By how much the seed of a screening differs from that of the trial."""
VEHICLES = ("blueboat", "otter")
DURATION = 300.0
"""Length of the log from which models are made [s]."""
EPOCHS = 60
"""Most epochs of a network: half a minute."""


@dataclass(frozen=True, slots=True)
class Steered:
    """A world: the nominal hull, the true boat, and what was hidden, by effect."""

    nominal: Vehicle
    true: Vehicle
    hidden: Mapping[str, Mapping[str, float]]
    drawn: int


def world(kind: str, seed: int, drawn: int = 0) -> Steered:
    """A world of kind "hidden", whose effects are worth it to both controllers, or "nothing".

    Parameters
    ----------
    drawn : which draw was taken, where that is known
    """
    rng = np.random.default_rng([seed, 11])
    for attempt in range(1, 200):
        sister = random_hull(load_vehicle(VEHICLES[seed % len(VEHICLES)]), rng, 0.25)
        nominal = with_hull(sister, np.random.default_rng([seed, 12]))
        if kind == "nothing":
            return Steered(nominal, nominal, {}, attempt)
        names = [str(n) for n in rng.choice([e.name for e in EFFECTS if e.name not in _UNFELT], HIDDEN, replace=False)]
        if any(other in effect_named(name).includes for name in names for other in names):
            continue
        try:
            hidden = {name: typical_effect(name, nominal, rng) for name in names}
            true = apply_effects(nominal, merged(hidden))
        except RequestError:
            continue
        if attempt < drawn:
            continue
        if drawn or all(_worth(nominal, true, controller, seed + _SCREEN_SEED) for controller in SCREENS):
            return Steered(nominal, true, hidden, attempt)
    raise RequestError(f"seed {seed}: no world in two hundred draws")


def _worth(nominal: Vehicle, true: Vehicle, controller: str, seed: int) -> bool:
    errors = []
    for vehicle in (nominal, true):
        rows = passages(VehicleModel(vehicle, "screen"), controller, true, nominal, seed, SCREENS[controller])
        if vehicle is true and any(row["lost"] or row["at_limit"] > 0.2 for row in rows):
            return False  # a boat that cannot follow the track, whoever steers
        errors.append(mean_error(rows))
    return errors[1] <= WORTH * errors[0]


def passages(
    model: Model, controller: str, true: Vehicle, nominal: Vehicle, seed: int, tracks: Iterable[str]
) -> list[dict[str, Any]]:
    """Figures of a model on tracks that suit the nominal hull."""
    known, pace = known_model(model), pace_of(nominal)
    found = []
    for name in tracks:
        done = merit(drive(known, controller, true, Surroundings(), track_named(name, pace), seed))
        found.append({"model": model.name, "controller": controller, "track": name, **done.to_dict()})
    return found


def mean_error(rows: Sequence[Mapping[str, Any]]) -> float:
    """Geometric mean of the errors of several tracks [m]."""
    return float(np.exp(np.mean([np.log(row["rmse"]) for row in rows])))


def models(
    case: Steered, seed: int, networks: Sequence[str], done: Collection[str]
) -> Iterable[tuple[Model, dict[str, Any]]]:
    """The models that are not done, with what is to be told of each; they are made from one log of the true boat."""
    for vehicle, name in ((case.nominal, "nominal"), (case.true, PERFECT)):
        if name not in done:
            yield VehicleModel(vehicle, name), {}
    with tempfile.TemporaryDirectory() as scratch:
        log = simulate_world(case.true, {}, duration=DURATION, seed=seed).write(Path(scratch) / "log.csv")
        inputs = undertow.read_inputs(log, case.nominal, progress=None)
        if "corrected" not in done:
            begun = time.perf_counter()
            run = undertow.discover(inputs, progress=None)
            told = {"missing": list(run.findings.missing), "seconds": time.perf_counter() - begun}
            yield VehicleModel(run.discovery.corrected, "corrected"), told
        if "calibrated" not in done:
            begun = time.perf_counter()
            fitted = undertow.fit(inputs, progress=None)
            yield VehicleModel(fitted.vehicle, "calibrated"), {"seconds": time.perf_counter() - begun}
        for name in (name for name in networks if f"hybrid {name}" not in done):
            begun = time.perf_counter()
            settings = undertow.TrainingSettings(epochs=EPOCHS, patience=15, seed=seed, decline=False)
            trained = undertow.train(inputs, undertow.Choice(name), settings=settings, progress=None)
            model = trained.model
            model.name = f"hybrid {name}"
            yield model, {"seconds": time.perf_counter() - begun, "epoch": trained.trained.best_epoch}
