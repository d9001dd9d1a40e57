"""How often the band of a run holds on a second run of the same boat: worlds of our own, and foreign ones.

Of each world a log is written, `discover` finds a model in it and tells a 95 % band about its predictions of 10 s, and
on a second log is counted how many of them end within the band, as `compare` counts them. The second run has other
orders, the same sensors and the same waves. Once it is of the manoeuvres of the first; once it is of others, a zigzag
after a rich or gentle run and the other way round. Predictions far beyond the speeds of the first run are told apart:
there the model may lack a force that the first run never met, and its band says nothing.
The method was chosen on the tuning seeds; the figures of `docs/results.md` are those of the others:

    python benchmarks/bands.py --seeds reporting

asks twelve worlds of each, some minutes on one core. A world that the verb refuses is told, and not counted. With
`--network KIND` the band is that of a network which `train` puts beside the nominal file, in the place of `discover`,
and with `--level 0.9` it is made for that share. Its width is told in that within which this share of the errors lies:
1 is the least that could hold them.
"""

import argparse
import tempfile
import time
from collections.abc import Iterator, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

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
from undertow.physics.motion import Array
from undertow.physics.vehicle import Vehicle
from undertow.physics.worlds.world import Sensors, World
from undertow.residuals import series
from undertow.residuals.models.band_record import QUANTITIES
from undertow.residuals.models.base import Model
from undertow.residuals.models.interval import LEVEL
from undertow.residuals.series import ROOM, errors_and_widths

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


class Held(NamedTuple):
    """What a band holds of a second run.

    Attributes
    ----------
    shares : (4,) of the predictions that end within it, by quantity; NaN where it is told of none
    widths : (4,) median half-width in the quantile of the errors that the level asks for
    beyond : share of the predictions of which it says nothing
    """

    shares: Array
    widths: Array
    beyond: float


def measured(model: Model, log: Inputs, level: float) -> Held:
    """What the band of a model holds of all predictions on a log."""
    assert model.band is not None, "it is asked before"
    error, widths, known = errors_and_widths(model, model.band, log.whole(ALL).parts.judged)
    if not known.any():
        return Held(np.full(4, np.nan), np.full(4, np.nan), 1.0)
    error, widths = error[known], widths[known]
    needed = np.maximum(np.quantile(error, level, axis=0), 1e-12)
    return Held((error <= widths).mean(axis=0), np.median(widths, axis=0) / needed, 1.0 - float(known.mean()))


def held(boat: Boat, folder: Path, room: float, network: str | None, level: float) -> tuple[float, list[Held]]:
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
    model.band = model.band.but(lowest=tuple(low - farther), highest=tuple(high + farther))
    found = []
    for number, write in enumerate(boat.second):
        other = undertow.read_inputs(write(folder / f"second{number}.csv"), boat.vehicle, progress=None)
        found.append(measured(model, other, level))
    return model.band.half_width["position"][-1], found


def asked(boat: Boat, room: float, network: str | None = None, level: float = LEVEL) -> list[Held] | None:
    """What the band of a world holds, with a line about it; None where the world gives no band."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            wide, shares = held(boat, Path(folder), room, network, level)
        except (ArithmeticError, LogError, RequestError) as error:
            print(f"{boat.name}: not counted, {str(error)[:120]}", flush=True)
            return None
    told = "; ".join(f"{run} {told_shares([share])}" for run, share in zip(RUNS, shares, strict=True))
    print(f"{boat.name}: band of {wide:.2f} m; {told}", flush=True)
    return shares


def told_shares(shares: Sequence[Held]) -> str:
    """Mean shares by quantity, and the share of predictions that were beyond the band, in words."""
    counts = [share for share in shares if share.beyond < 1.0]
    beyond = 100.0 * np.mean([share.beyond for share in shares])
    if not counts:
        return f"{beyond:.0f} % beyond"
    means = zip(QUANTITIES, np.mean([share.shares for share in counts], axis=0), strict=True)
    width = np.median([share.widths[0] for share in counts])
    return (
        f"{', '.join(f'{name} {100.0 * mean:.0f} %' for name, mean in means)}, {beyond:.0f} % beyond; "
        f"of the position {width:.2f} times as wide as its errors"
    )


def main() -> None:
    """Count, and print a line a world, then the means."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", choices=("tuning", "reporting"), default="tuning")
    parser.add_argument("--worlds", type=int, default=12, help="of each kind (12)")
    parser.add_argument("--minutes", type=float, default=60.0, help="no world is begun after so many (60)")
    parser.add_argument("--room", type=float, default=ROOM, help=f"beyond the range of each speed ({ROOM:g} of it)")
    parser.add_argument("--level", type=float, default=LEVEL, help=f"share that a band is made to hold ({LEVEL:g})")
    parser.add_argument("--network", help="kind of a network in the place of the discovery")
    given = parser.parse_args()
    if given.level < series.LEAST_LEVEL:
        parser.error(f"--level {given.level:g}: no band is made for less than {series.LEAST_LEVEL:g}")
    until = time.monotonic() + 60.0 * given.minutes
    series.LEVEL = given.level
    found: dict[str, list[list[Held]]] = {"own": [], "foreign": []}
    for boats in zip(*(worlds(given.seeds, given.worlds) for worlds in (own_worlds, foreign_worlds)), strict=True):
        if time.monotonic() > until:
            break
        for shares, boat in zip(found.values(), boats, strict=True):
            shares += [one for one in [asked(boat, given.room, given.network, given.level)] if one is not None]
    for name, shares in found.items():
        for run, some in zip(RUNS, zip(*shares, strict=True), strict=False):
            counts = [share.shares[0] for share in some if share.beyond < 1.0]
            told = f"90 % or more in {sum(share >= 0.9 for share in counts)} of {len(counts)} worlds"
            print(f"{name}, {run}: {told_shares(some)}; the position {told}, the least {100.0 * min(counts):.0f} %")


if __name__ == "__main__":
    main()
