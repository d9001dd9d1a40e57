"""How often the band of a run holds on a second run of the same boat: worlds of our own, and foreign ones.

Of each world a log is written, `discover` finds a model in it and tells a 95 % band about its predictions of 10 s, and
on a second log is counted how many of them end within the band, as `compare` counts them. The second run has other
orders, the same sensors and the same waves. Once it is of the manoeuvres of the first; once it is of others, a zigzag
after a rich or gentle run and the other way round. Predictions far beyond the speeds of the first run are told apart:
there the model may lack a force that the first run never met, and its band says nothing.
The method was chosen on the tuning seeds; the figures of `docs/results.md` are those of the others:

    python benchmarks/bands.py --seeds reporting

asks twelve worlds of each, some minutes on one core. A world that the verb refuses is told, and not counted. With
`--network KIND` the band is that of a network which `train` puts beside the nominal file, in the place of `discover`.
"""

import argparse
import tempfile
import time
from collections.abc import Iterator, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from study import foreign_logs
from study.foreign_kinds import KINDS
from study.foreign_world import World as ForeignWorld
from study.hidden_worlds import FRESH
from study.studies import STUDIES
from study.verb import Write
from study.worlds import NOISES, PARTS, SEEDS, draw

import undertow
from undertow.measurements.prepared_logs import ALL, Inputs
from undertow.physics.errors import LogError, RequestError
from undertow.physics.vehicle import Vehicle
from undertow.physics.worlds.world import Sensors, World
from undertow.residuals.models.band_record import QUANTITIES
from undertow.residuals.models.base import Model
from undertow.residuals.series import ROOM, HeldPredictions, held_predictions

GROUPS = ("plant", "file", "no name")
"""Groups of foreign kinds whose boat and whose sensors are the same on another day."""
SECONDS, AFRESH = 240.0, 9_000_000
"""Length of the second run of an own world [s], that of a foreign one is its own; and by how much its seed differs."""
RUNS = ("the same manoeuvres", "other manoeuvres")


@dataclass(frozen=True, slots=True)
class Boat:
    """A world: its name, the vehicle file, and what writes the first log and a second one of each of `RUNS`."""

    name: str
    vehicle: Vehicle
    first: Write
    second: tuple[Write, ...]


def own_worlds(purpose: str, count: int) -> Iterator[Boat]:
    """Worlds of the catalogue, spread over all parts of the study."""
    keys = STUDIES["plain"].keys(purpose)
    start, block = SEEDS[purpose]
    for kind, seed in [keys[k] for k in np.linspace(0, len(keys) - 1, count).astype(int)]:
        case = draw(PARTS[kind], (seed - start) % block, seed)
        sensors = replace(NOISES[case.setting["noise"]], waves=case.setting["waves"])
        programme = case.setting["programme"]
        again = [World(case.log.vehicle, name, SECONDS, seed + AFRESH) for name in (programme, FRESH[programme])]
        second = tuple(partial(_write_own, world, sensors) for world in again)
        yield Boat(f"{kind} {seed}", case.nominal, case.log.write, second)


def _write_own(world: World, sensors: Sensors, path: Path) -> Path:
    return world.run(sensors).write(path)


def foreign_worlds(purpose: str, count: int) -> Iterator[Boat]:
    """Worlds of another simulator, kinds in turn."""
    keys = [key for key in STUDIES["foreign"].keys(purpose) if KINDS[key[0]].group in GROUPS]
    kinds = len(dict.fromkeys(kind for kind, _ in keys))
    for kind, seed in [keys[k * kinds // count] for k in range(count)]:
        before, world, truth = foreign_logs.driven(kind, seed)
        second = tuple(partial(_write_foreign, before, other) for other in (False, True))
        yield Boat(f"{kind} {seed}", world.file, partial(deepcopy(world).log, truth), second)


def _write_foreign(world: ForeignWorld, other: bool, path: Path) -> Path:
    again = deepcopy(world)
    again.seed = world.seed + AFRESH
    again.programme = FRESH.get(world.programme, world.programme) if other else world.programme
    again.rng = np.random.default_rng([again.seed, 8])
    return again.log(again.drive(), path)


def model_of(log: Inputs, network: str | None, folder: Path) -> Model:
    """The model that `discover` finds in a log, or a network beside its nominal one, as it is read back."""
    if network is None:
        undertow.write_run(undertow.discover(log, progress=None), folder, report=False, progress=None)
    else:
        undertow.train(log, undertow.Choice(network), out=folder, progress=None)
    return undertow.load_model(folder)


def held(boat: Boat, folder: Path, room: float, network: str | None) -> tuple[float, list[HeldPredictions]]:
    """Median half-width of the band of the position after 10 s [m], and what it holds of each second run.

    Parameters
    ----------
    room : by how much it is told beyond the range of each speed, as a share of that
    network : see `model_of`

    Raises
    ------
    RequestError
        where the first log gives no band.
    """
    log = undertow.read_inputs(boat.first(folder / "log.csv"), boat.vehicle, progress=None)
    model = model_of(log, network, folder / "run")
    if model.band is None:
        raise RequestError("too few independent predictions for a band")
    low, high = np.array(model.band.lowest), np.array(model.band.highest)
    farther = (room - ROOM) * (high - low) / (1.0 + 2.0 * ROOM)
    band = model.band.but(lowest=tuple(low - farther), highest=tuple(high + farther))
    found = []
    for number, write in enumerate(boat.second):
        other = undertow.read_inputs(write(folder / f"second{number}.csv"), boat.vehicle, progress=None)
        found.append(held_predictions(model, band, other.whole(ALL).parts.judged))  # as `compare` tells it
    return model.band.half_width["position"][-1], found


def asked(boat: Boat, room: float, network: str | None = None) -> list[HeldPredictions] | None:
    """What the band of a world holds, with a line about it; None where the world gives no band."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            wide, shares = held(boat, Path(folder), room, network)
        except (ArithmeticError, LogError, RequestError) as error:
            print(f"{boat.name}: not counted, {str(error)[:120]}", flush=True)
            return None
    told = "; ".join(f"{run} {told_shares([share])}" for run, share in zip(RUNS, shares, strict=True))
    print(f"{boat.name}: band of {wide:.2f} m; {told}", flush=True)
    return shares


def told_shares(shares: Sequence[HeldPredictions]) -> str:
    """Mean shares by quantity, and the share of predictions that were beyond the band, in words."""
    counts = [share for share in shares if share.predictions]
    beyond = 100.0 * np.mean([share.beyond / (share.predictions + share.beyond) for share in shares])
    if not counts:
        return f"{beyond:.0f} % beyond"
    means = {quantity: np.mean([share.of(quantity) for share in counts]) for quantity in QUANTITIES}
    return f"{', '.join(f'{name} {100.0 * mean:.0f} %' for name, mean in means.items())}, {beyond:.0f} % beyond"


def main() -> None:
    """Count, and print a line a world, then the means."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", choices=("tuning", "reporting"), default="tuning")
    parser.add_argument("--worlds", type=int, default=12, help="of each kind (12)")
    parser.add_argument("--minutes", type=float, default=60.0, help="no world is begun after so many (60)")
    parser.add_argument("--room", type=float, default=ROOM, help=f"beyond the range of each speed ({ROOM:g} of it)")
    parser.add_argument("--network", help="kind of a network in the place of the discovery")
    given = parser.parse_args()
    until = time.monotonic() + 60.0 * given.minutes
    found: dict[str, list[list[HeldPredictions]]] = {"own": [], "foreign": []}
    for boats in zip(*(worlds(given.seeds, given.worlds) for worlds in (own_worlds, foreign_worlds)), strict=True):
        if time.monotonic() > until:
            break
        for shares, boat in zip(found.values(), boats, strict=True):
            shares += [one for one in [asked(boat, given.room, given.network)] if one is not None]
    for name, shares in found.items():
        for run, some in zip(RUNS, zip(*shares, strict=True), strict=False):
            counts = [share.position for share in some if share.predictions]
            told = f"90 % or more in {sum(share >= 0.9 for share in counts)} of {len(counts)} worlds"
            print(f"{name}, {run}: {told_shares(some)}; the position {told}, the least {100.0 * min(counts):.0f} %")


if __name__ == "__main__":
    main()
