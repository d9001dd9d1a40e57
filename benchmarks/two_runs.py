"""How often `report` of two runs is right: one boat twice, and two boats that are one effect apart.

Each boat is a shipped hull with two hidden effects of typical random size, and logs of four minutes at field noise. Of
one boat every number that both runs hold should be the same, by the 95 % intervals in 95 of 100; of a boat with a third
effect, that effect should be told as a difference. `python benchmarks/two_runs.py 30` asks thirty boats, some minutes
each ten.
"""

import argparse
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

import undertow
from undertow.physics.errors import RequestError
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.typical_effects import typical_effect
from undertow.physics.worlds.world import simulate_world
from undertow.reports.page.fleet import Relation, SharedNumber, shared_numbers
from undertow.reports.run_contents import RunFolder
from undertow.workflows.inputs import read_inputs
from undertow.workflows.run_folder.read import read_run

HULLS = ("blueboat_paper", "otter", "blueboat")
EFFECTS = (
    *("surge_linear_damping", "surge_quadratic_damping", "sway_linear_damping", "sway_quadratic_damping"),
    *("yaw_linear_damping", "yaw_quadratic_damping", "yaw_speed_damping", "munk_moment", "sway_lift"),
    *("thruster_asymmetry", "thruster_arm", "reverse_thrust_loss", "thrust_dead_zone", "thruster_lag", "input_delay"),
    *("steady_current", "yaw_trim", "cg_offset"),
)
NAMES = ("first", "second")
APART = (Relation.DIFFERS, Relation.ONLY_HERE)


def found(hull: str, effects: dict[str, float], seed: int, folder: Path) -> RunFolder:
    """The run of a log of a boat, which was searched with the hull's own file."""
    vehicle = load_vehicle(hull)
    log = simulate_world(vehicle, effects, duration=240.0, seed=seed).write(folder / f"{seed}.csv")
    run = undertow.discover(read_inputs(log, vehicle, progress=None), progress=None)
    return read_run(undertow.write_run(run, folder / str(seed), report=False, progress=None))


def asked(boat: int, folder: Path) -> tuple[list[SharedNumber], list[SharedNumber], set[str]]:
    """Numbers of one boat twice, of two boats, and the symbols of the effect that these are apart."""
    rng, hull = np.random.default_rng(1000 + boat), HULLS[boat % len(HULLS)]
    vehicle = load_vehicle(hull)
    one, two, more = (typical_effect(name, vehicle, rng) for name in rng.choice(EFFECTS, 3, replace=False))
    first, again = (found(hull, one | two, 10 * boat + k, folder) for k in (0, 1))
    other = found(hull, one | two | more, 10 * boat + 2, folder)
    return shared_numbers([first, again], NAMES), shared_numbers([first, other], NAMES), set(more)


def main() -> None:
    """Count, and print a line a boat."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("boats", type=int, nargs="?", default=30)
    boats = parser.parse_args().boats
    same, named = Counter[str](), Counter[str]()
    with tempfile.TemporaryDirectory() as folder:
        for boat in range(boats):
            try:
                twice, apart, more = asked(boat, Path(folder))
            except RequestError as error:
                print(f"boat {boat}: not drawn, {error}")
                continue
            same.update(one.relation.value for one in twice)
            seen = any(one.symbol in more and one.relation in APART for one in apart)
            named["named" if seen else "not named"] += 1
            told = [f"{one.symbol} {one.told(NAMES)}" for one in (*twice, *apart) if one.relation is not Relation.SAME]
            print(f"boat {boat}: {'; '.join(told)}", flush=True)
    print(f"One boat twice, {same.total()} numbers: {dict(same)}.")
    print(f"Two boats that are one effect apart, {named.total()} pairs: {dict(named)}.")


if __name__ == "__main__":
    main()
