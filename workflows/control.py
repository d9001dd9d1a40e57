"""The verb `control`: models steer the same true boat along tracks, and each shows what it is worth to a controller."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path

from ..comparison.models_by_name import load_model
from ..measurements.prepared_logs import PathLike
from ..physics.errors import RequestError, expect
from ..physics.files import at_end, write_bytes
from ..physics.presentation import Card
from ..physics.stage import Say
from ..physics.vehicle import Vehicle, load_vehicle
from ..physics.worlds.hidden_effects import Values, apply_effects
from ..reports.page.figures.model_figures import track_figure
from ..reports.terminal.progress import SHOWN, showing
from ..residuals.models.base import Model, VehicleModel
from ..steering.closed_loop import CONTROLLERS, PERFECT, ControlRecord, Passage, Surroundings, Tracking, drive, merit
from ..steering.known_model import known_model
from ..steering.tracks import pace_of, track_named
from .run_folder.run_files import Kind, check_targets


@dataclass(frozen=True, slots=True)
class Trial:
    """Conditions under which models are tried.

    Attributes
    ----------
    tracks : names of `steering.tracks.TRACKS`; each is steered once
    controller : "los" or "nmpc"
    around : gusts, current and sensors, of which no model knows
    seed : of what is random in them
    """

    tracks: tuple[str, ...] = ("square",)
    controller: str = "los"
    around: Surroundings = field(default_factory=Surroundings)
    seed: int = 0


@dataclass(frozen=True, slots=True, repr=False)
class ControlRun(Card):
    """A finished trial.

    Attributes
    ----------
    record : its figures
    passages : by track and model
    """

    record: ControlRecord
    passages: Mapping[tuple[str, str], Passage]

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        texts = [f"{r.model} on {r.track}: {r.merit.rmse:.2f} m" for r in self.record.results]
        return [("true boat", self.record.vehicle), ("controller", self.record.controller), ("error", "; ".join(texts))]

    def draw(self, out: PathLike, *, force: bool = False) -> Path:
        """Write the figure: the tracks of all models over each other.

        Raises
        ------
        RequestError
            when the path does not end in .svg, or cannot be written.
        """
        path = Path(out)
        check_figure(path, force=force)
        write_bytes(path, at_end("control", track_figure(self.record, self.passages).encode()))
        return path


def check_figure(path: Path, reads: Sequence[object] = (), *, force: bool = False) -> list[Path]:
    """Check that a figure may be written, before the work on it begins; see `check_targets`.

    Parameters
    ----------
    path : the figure
    reads : files that the verb reads
    force : write over what another made; never over what is read
    """
    if path.suffix != ".svg":
        raise RequestError(f"--out {path}: expected a name that ends in .svg, which every browser shows")
    return check_targets([("--out", Kind.TRACKS, path)], reads, force=force)


@showing
def control(
    models: Sequence[Model | PathLike],
    true: Vehicle | PathLike | None = None,
    effects: Mapping[str, Values] | None = None,
    trial: Trial | None = None,
    *,
    progress: Say | None = SHOWN,
) -> ControlRun:
    """Steer one true boat with each model in turn, and with the truth itself as a model.

    The controller is the same for all, and so are gusts, current and sensor noise. It sees measurements of the boat
    alone. Speed and turns of the tracks suit the first model.

    Parameters
    ----------
    models : vehicle files, run folders or networks beside physics, or what they hold; all are told
        against the first
    true : the true boat; default: the vehicle of the first model
    effects : that the true boat has beside, as `simulate_world` takes them
    trial : tracks, controller and surroundings
    progress : called with lines about the work, shown where nothing is said; None for silence

    Raises
    ------
    RequestError, VehicleError
        when CasADi is missing, a model cannot be planned with, or tracks, controller or effects are not known.
    """
    chosen = trial or Trial()
    expect("control: models", models, (list, tuple), 'give a list, such as ["boat.yaml", "run"]')
    if not models:
        raise RequestError("control: expected a model; give a vehicle file, a run folder or a network")
    if chosen.controller not in CONTROLLERS:
        near = get_close_matches(chosen.controller, CONTROLLERS, n=1, cutoff=0.0)
        raise RequestError(f"unknown controller {chosen.controller!r}: did you mean {near[0]!r}?")
    steering = _named([m if isinstance(m, Model) else load_model(m) for m in models])
    base = steering[0].vehicle if true is None else true if isinstance(true, Vehicle) else load_vehicle(true)
    boat = apply_effects(base, effects or {})
    _check_thrusters(boat, steering)
    pace = pace_of(steering[0].vehicle)
    tracks = {name: track_named(name, pace) for name in chosen.tracks}
    known = [known_model(model) for model in (*steering, VehicleModel(boat, PERFECT))]
    passages: dict[tuple[str, str], Passage] = {}
    results: list[Tracking] = []
    for name, track in tracks.items():
        first = 0.0
        for each in known:
            if progress is not None:
                progress(f"{name}: {each.name} steers")
            done = passages[name, each.name] = drive(each, chosen.controller, boat, chosen.around, track, chosen.seed)
            found = merit(done)
            first = first or found.rmse
            results.append(Tracking(model=each.name, track=name, merit=found, against_first=found.rmse / first - 1.0))
    record = ControlRecord(
        vehicle=boat.name,
        hidden=tuple(f"{s}={v:g}" for s, v in boat.values.items() if base.values.get(s) != v),
        controller=chosen.controller,
        speed=pace.speed,
        turn_rate=pace.turn_rate,
        seed=chosen.seed,
        results=tuple(results),
    )
    return ControlRun(record, passages)


def _named(models: Sequence[Model]) -> list[Model]:
    """Models under names of their own."""
    names = [model.name for model in models]
    twice = next((name for name in names if names.count(name) > 1 or name == PERFECT), None)
    if twice is not None:
        raise RequestError(
            f"control: two models are called {twice!r}; rename a file, so that the table tells them apart"
        )
    return list(models)


def _check_thrusters(boat: Vehicle, models: Sequence[Model]) -> None:
    wanted = " ".join(t.channel for t in boat.thrusters)
    for model in models:
        found = " ".join(t.channel for t in model.vehicle.thrusters)
        if found != wanted:
            raise RequestError(f"model {model.name}: expected the true boat's thrusters, {wanted}, got {found}")
