"""How often `report` of several runs is right: one boat twice, two boats one effect apart, three versions of a log.

Each boat is a shipped hull with two hidden effects of typical random size, and logs of four minutes at field noise. Of
one boat every number that both runs hold should be the same, by the 95 % intervals in 95 of 100; of a boat with a third
effect, that effect should be told as a difference. `python benchmarks/two_runs.py 30 --kept FOLDER` asks thirty boats,
a minute each; runs that the folder holds are not made again.

`python benchmarks/two_runs.py 7 --versions` asks whether the versions of one log agree: as an autopilot recorded it,
with a fault, with that repaired by `inspect LOG --fix`, which knows no vehicle, and without the fault. The hidden
effects are a weak thruster and less thrust astern, thrusters stand still at 1510 us, and the faults, one a boat, are
those of field logs. Every number of a pair of versions should be the same.

`python benchmarks/two_runs.py --field FOLDER 216 235` asks the same of BlueBoat logs: `raw/rcou_NNN.csv` as exported by
the autopilot, the same with `discover --fix`, and `log_NNN.csv`, which people cleaned. `init` makes the vehicle of the
raw log.
"""

import argparse
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import combinations
from pathlib import Path

import numpy as np
from quality import pwm_boat, with_rest
from study.planting import DEFECTS, Channels, autopilot_log

import undertow
from undertow.measurements.log import Log, read_log
from undertow.measurements.log_options import AS_GUESSED
from undertow.measurements.prepared_logs import write_clean
from undertow.physics.errors import LogError, RequestError
from undertow.physics.vehicle import Vehicle, load_vehicle, vehicle_from_dict
from undertow.physics.worlds.hidden_effects import typical_effect
from undertow.physics.worlds.world import NOISE, simulate_world
from undertow.reports.page.fleet import Relation, SharedNumber, shared_numbers
from undertow.reports.run_contents import RunFolder
from undertow.workflows.inputs import read_inputs
from undertow.workflows.inspect_and_init import look_over
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
VERSIONS = ("raw", "fixed", "sound")
RAW_MAP = Path(__file__).resolve().parent.parent / "examples" / "maps" / "blueboat_raw.yaml"
CLEANED = "pwm_stbd: {from: pwm_stbd, scale: -1.0, offset: 3020.0}\n"
"""Channel map of cleaned BlueBoat logs, whose starboard thruster is wired the other way round about 1510 us."""
MASS = 15.0
"""Of the BlueBoat [kg], as the notes that came with the logs say."""
SECONDS = 240.0
"""Length of a log [s]."""
HIDDEN = ("thruster_asymmetry", "reverse_thrust_loss")
"""What the boat of the versions has, and its file lacks."""


def found(log: Path, vehicle: Vehicle, out: Path, reading: undertow.Reading = AS_GUESSED) -> RunFolder:
    """The run of a log that was searched with a vehicle, or that of before."""
    if (out / "findings.json").exists():
        return read_run(out)
    run = undertow.discover(read_inputs(log, vehicle, reading, progress=None), progress=None)
    return read_run(undertow.write_run(run, out, report=False, progress=None))


def simulated(hull: str, effects: dict[str, float], seed: int, folder: Path) -> RunFolder:
    """The run of a log of a boat, which was searched with the hull's own file."""
    vehicle = load_vehicle(hull)
    folder.mkdir(parents=True, exist_ok=True)
    log = simulate_world(vehicle, effects, duration=SECONDS, seed=seed).write(folder / f"{seed}.csv")
    return found(log, vehicle, folder / str(seed))


def asked(boat: int, folder: Path) -> tuple[list[SharedNumber], list[SharedNumber], set[str]]:
    """Numbers of one boat twice, of two boats, and the symbols of the effect that these are apart."""
    rng, hull = np.random.default_rng(1000 + boat), HULLS[boat % len(HULLS)]
    vehicle = load_vehicle(hull)
    one, two, more = (typical_effect(name, vehicle, rng) for name in rng.choice(EFFECTS, 3, replace=False))
    first, again = (simulated(hull, one | two, 10 * boat + k, folder) for k in (0, 1))
    other = simulated(hull, one | two | more, 10 * boat + 2, folder)
    return shared_numbers([first, again], NAMES), shared_numbers([first, other], NAMES), set(more)


Plant = Callable[[Channels, np.random.Generator], Channels]
"""Puts a fault into the channels of a log."""


def planted(name: str, size: float) -> Plant:
    """A fault of the study of checks, of one size."""
    defect = next(one for one in DEFECTS if one.name == name)
    return lambda channels, rng: defect.plant(channels, size, rng)


def with_spikes(channels: Channels, rng: np.random.Generator) -> Channels:
    """Three values of positions and gyro far out of their record."""
    spiked = {}
    for name, size in (("x", 30.0), ("y", 30.0), ("r", 3.0)):
        value = channels[name].value.copy()
        value[rng.choice(value.size, 3, replace=False)] += size
        spiked[name] = replace(channels[name], value=value)
    return channels | spiked


def with_gaps(channels: Channels, rng: np.random.Generator) -> Channels:
    """Four pauses of the logger of one to three seconds."""
    time = channels["x"].time
    starts, lengths = rng.uniform(time[0] + 5.0, time[-1] - 8.0, 4), rng.uniform(1.0, 3.0, 4)
    keep = ~((time[:, None] > starts) & (time[:, None] < starts + lengths)).any(axis=1)
    return {name: replace(c, time=c.time[keep], value=c.value[keep]) for name, c in channels.items()}


def with_slow_commands(channels: Channels, rng: np.random.Generator) -> Channels:
    """Commands that are recorded twice a second, motion ten times."""
    slow = {name: c for name, c in channels.items() if name.startswith("pwm")}
    return channels | {name: replace(c, time=c.time[::5], value=c.value[::5]) for name, c in slow.items()}


FAULTS: dict[str, Sequence[Plant]] = {
    "a field log": [planted("fixes a row late", 0.2), planted("gyro late", 0.12), planted("commands late", 0.15)],
    "spikes": [with_spikes],
    "gaps": [with_gaps],
    "slow commands": [with_slow_commands],
    "late commands": [planted("commands late", 0.25)],
    "late gyro": [planted("gyro late", 0.25)],
    "held fixes": [planted("fixes held over two rows", 1.0)],
}
"""By name, what is done to a sound log; its raw version is refused where the boat answers before it is told to."""


def faulty(log: Log, fault: str, seed: int) -> Log:
    """A sound log with a fault."""
    rng, channels = np.random.default_rng(seed), dict(log.channels)
    for plant in FAULTS[fault]:
        channels = plant(channels, rng)
    return replace(log, channels=channels)


def at_1510(log: Log) -> Log:
    """A log of a boat whose thrusters stand still at 1500 us, as that of one whose stand still at 1510 us."""
    pwm = {name: replace(c, value=c.value + 10.0) for name, c in log.channels.items() if name.startswith("pwm")}
    return replace(log, channels=log.channels | pwm)


def boat_at_1510() -> Vehicle:
    """The vehicle file of such a boat."""
    content = pwm_boat().to_dict()
    for thruster in content["thrusters"]:
        thruster["curve"]["command"] = [1110.0, 1510.0, 1910.0]
    return vehicle_from_dict(content, "stands still at 1510 us")


def versions(boat: int, folder: Path, seconds: float = SECONDS) -> dict[str, RunFolder]:
    """The runs of a log with a fault, with that repaired, and without it, as far as they are not refused."""
    fault, hull, rng = list(FAULTS)[boat % len(FAULTS)], pwm_boat(), np.random.default_rng(500 + boat)
    first, second = (typical_effect(name, hull, rng) for name in HIDDEN)
    folder.mkdir(parents=True, exist_ok=True)
    written = read_log(simulate_world(hull, first | second, duration=seconds, seed=boat).write(folder / "world.csv"))
    sound = at_1510(autopilot_log(with_rest(written, NOISE["field"]), boat))
    logs = {"raw": faulty(sound, fault, boat), "sound": sound}
    paths = {name: write_clean(log, [], [], folder / f"{name}.csv") for name, log in logs.items()}
    paths["fixed"] = folder / "fixed.csv"
    look_over([paths["raw"]], fix=paths["fixed"], progress=None)
    return all_found({name: (paths[name], AS_GUESSED) for name in VERSIONS}, boat_at_1510(), folder)


def all_found(
    logs: Mapping[str, tuple[Path, undertow.Reading]], vehicle: Vehicle, folder: Path
) -> dict[str, RunFolder]:
    """The runs of versions of a log that are not refused."""
    runs = {}
    for name, (log, reading) in logs.items():
        try:
            runs[name] = found(log, vehicle, folder / name, reading)
        except LogError as error:
            print(f"{folder.name}: {name} is refused, {str(error)[:100]} ...")
    return runs


def field_versions(number: str, logs: Path, folder: Path) -> dict[str, RunFolder]:
    """The runs of a field log as it was exported, repaired in memory, and cleaned by people."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "cleaned.yaml").write_text(CLEANED, encoding="utf-8")
    raw, cleaned = (str(path) for path in (RAW_MAP, folder / "cleaned.yaml"))
    exported = logs / "raw" / f"rcou_{number}.csv"
    draft = undertow.init(exported, undertow.Hull(mass=MASS), reading=undertow.Reading(channel_map=raw), progress=None)
    versions_of = {
        "raw": (exported, undertow.Reading(channel_map=raw)),
        "fixed": (exported, undertow.Reading(channel_map=raw, fix=True)),
        "sound": (logs / f"log_{number}.csv", undertow.Reading(channel_map=cleaned)),
    }
    return all_found(versions_of, draft.vehicle, folder)


def told_of_versions(logs: Mapping[str, Callable[[], Mapping[str, RunFolder]]]) -> None:
    """Count how often numbers of two versions of a log are the same, and print what differs.

    Parameters
    ----------
    logs : by name, what gives the runs of the versions
    """
    counts = {pair: Counter[str]() for pair in combinations(VERSIONS, 2)}
    for log, runs_of in logs.items():
        runs, told = runs_of(), []
        for pair in [pair for pair in counts if set(pair) <= set(runs)]:
            numbers = shared_numbers([runs[name] for name in pair], pair)
            counts[pair].update(one.relation.value for one in numbers)
            told += [f"{one.symbol} {one.told(pair)}" for one in numbers if one.relation in APART]
        print(f"{log}: {'; '.join(told) or 'the same'}", flush=True)
    for (one, other), count in counts.items():
        print(f"{one} and {other}, {count.total()} numbers: {dict(count)}.")


def main() -> None:
    """Count, and print a line a boat."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("numbers", nargs="*", default=["30"], help="how many boats; with --field, numbers of logs")
    parser.add_argument("--versions", action="store_true")
    parser.add_argument("--field", type=Path, metavar="FOLDER", help="BlueBoat logs")
    parser.add_argument("--kept", type=Path, help="folder of the runs, which are not made again")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = given.kept or Path(scratch)
        if given.field is not None:
            told_of_versions({n: partial(field_versions, n, given.field, folder / f"log {n}") for n in given.numbers})
        elif given.versions:
            boats = range(int(given.numbers[0]))
            names = [f"boat {boat}, {list(FAULTS)[boat % len(FAULTS)]}" for boat in boats]
            made = [partial(versions, boat, folder / f"versions {boat}") for boat in boats]
            told_of_versions(dict(zip(names, made, strict=True)))
        else:
            told_of_boats(int(given.numbers[0]), folder)


def told_of_boats(boats: int, folder: Path) -> None:
    """Count how often one boat is told as the same, and two as apart."""
    same, named = Counter[str](), Counter[str]()
    for boat in range(boats):
        try:
            twice, apart, more = asked(boat, folder)
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
