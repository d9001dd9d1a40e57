"""How often a sound log is refused, and how often a sensor, a clock or a record that is right is accused.

A refusal is a claim, too. Nothing is wrong with these logs of random boats: shipped vehicles and their sisters on the
project's programmes, in calm water and in waves; logs that begin at the step from rest; autopilots that ask for full
throttle for minutes; boats of which one thruster rests for long; slow heavy ships between waypoints, recorded at 10 Hz;
and boats whose model lacks an effect, which is no fault of a log. Each log is written to a file and read as every verb
reads it (`read_inputs`), which makes all checks; the discovery itself is not run.

    python benchmarks/sound_logs.py [--logs 420] [--seeds tuning|reporting] [--jobs N] [--tell]
        [--table docs/sound_logs.md]

Exit code 1 where more than 0.3 % of the logs are refused.
"""

import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from boats import scaled, thruster
from quality import pwm_boat
from study.records import Kept, Script, bound, in_a_table
from study.worlds import ALL, DURATION, VEHICLES, WAVES, Part, draw

from undertow.physics.effects import EFFECTS
from undertow.physics.errors import LogError, RequestError
from undertow.physics.frames import Array, body_to_earth
from undertow.physics.matrices import mass_matrix, thruster_matrix
from undertow.physics.thrusters import command_of
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.manoeuvres import COMMAND_STEP, programme, thruster_commands
from undertow.physics.worlds.simulated_log import SimulatedLog
from undertow.physics.worlds.world import NOISE, Orders, Sensors, World, random_hull
from undertow.workflows.inputs import read_inputs

FIRST = {"tuning": 240_000, "reporting": 250_000}
MOST = 0.003
"""Share of sound logs that may be refused."""
PACKAGES = ("physics", "measurements", "workflows")
SHIPS = {
    "noise of 1 cm/s": Sensors(
        speed=0.01, yaw_rate=0.002, heading=0.005, position=0.05, jitter=0.001, odometry_rate=10.0
    ),
    "low noise": Sensors(speed=0.001, yaw_rate=0.0003, heading=0.001, position=0.005, odometry_rate=10.0),
    "no noise": Sensors(odometry_rate=10.0),
}
"""What the sensors of ships do."""
_PUSHED = (0.2, 2.0)
"""Frequencies at which short waves push a small boat [Hz]."""
_LACKS = Part("one effect", 1, 0, ALL, ("field", "clean"))
_ROWS = round(DURATION / COMMAND_STEP) + 1
Drawn = tuple[Vehicle, SimulatedLog, str]
"""A boat, its log, and what is special about it."""


def calm(number: int, seed: int, rng: np.random.Generator) -> Drawn:
    """A sister of a shipped vehicle in calm water, on each programme, with each noise in turn."""
    return _sailed(_sister(number, rng), number, seed, ("field", "rough", "clean"))


def in_waves(number: int, seed: int, rng: np.random.Generator) -> Drawn:
    """The same in waves."""
    boat, log, what = _sailed(_sister(number, rng), number, seed, ("field", "rough"), float(rng.uniform(*WAVES)))
    return (boat, _pushed(log, rng), f"{what}, pushed") if number % 2 else (boat, log, what)


def from_the_step(number: int, seed: int, rng: np.random.Generator) -> Drawn:
    """A log whose first row is the first row of a command: the boat lies still, and is pushed from then on."""
    boat = _sister(number, rng)
    kind = ALL[number % len(ALL)]
    held = programme(boat, kind, DURATION + 1.0, seed)[round(1.0 / COMMAND_STEP) :]
    noise = ("field", "clean")[number // len(ALL) % 2]
    return boat, _driven(boat, held, rng, seed, NOISE[noise]), f"{kind}, {noise}"


def full_throttle(number: int, seed: int, rng: np.random.Generator) -> Drawn:
    """An autopilot at full throttle: one side stands at its limit for minutes, and the other steers."""
    boat = _sister(number, rng)
    turns = np.repeat(rng.uniform(0.0, 0.35, _ROWS), rng.integers(30, 200, _ROWS))[:_ROWS]
    long = rng.uniform(0.6, 0.95)
    turns[round(long * _ROWS) :] *= -1.0
    common = np.minimum(1.0, np.arange(_ROWS) / rng.uniform(1.0, 60.0))
    # One side is saturated where the turn adds to the throttle: a command beyond its range is cut at it.
    held = thruster_commands(boat, common, _smooth(turns, rng.uniform(0.2, 3.0)))
    noise = ("field", "clean")[number % 2]
    return boat, _driven(boat, held, rng, seed, NOISE[noise]), noise


def resting_thruster(number: int, seed: int, rng: np.random.Generator) -> Drawn:
    """A boat of which one thruster rests for long stretches while the other works, half of the logs in waves."""
    boat = pwm_boat() if number % 2 else _sister(number, rng)
    boat = random_hull(boat, rng)
    kind = ALL[number % len(ALL)]
    held = programme(boat, kind, DURATION, seed)
    one, neutral = int(rng.integers(2)), command_of(boat.thrusters[0], np.zeros(1))[0]
    for begin in np.cumsum(rng.uniform(20.0, 60.0, 4) + np.array([0.0, 60.0, 60.0, 60.0])):
        first = round(begin / COMMAND_STEP)
        held[first : first + round(rng.uniform(20.0, 60.0) / COMMAND_STEP), one] = neutral
    noise, sea = ("field", "rough")[number // 4 % 2], ("calm", "waves", "pushed by waves")[number // 2 % 3]
    waves = float(rng.uniform(*WAVES)) if sea == "waves" else 0.0
    log = _driven(boat, held, rng, seed, replace(NOISE[noise], waves=waves))
    return boat, _pushed(log, rng) if sea == "pushed by waves" else log, f"{kind}, {noise}, {sea}"


def ship(number: int, seed: int, rng: np.random.Generator) -> Drawn:
    """A slow heavy hull in newtons that an autopilot steers from waypoint to waypoint, at 10 Hz."""
    boat = _slow_hull(rng)
    noise = list(SHIPS)[number % len(SHIPS)]
    seconds = float(rng.uniform(400.0, 900.0))
    return boat, _driven(boat, _waypoints(boat, seconds, rng), rng, seed, SHIPS[noise]), noise


def lacking(number: int, seed: int, rng: np.random.Generator) -> Drawn:
    """A boat with an effect of the catalogue that its model lacks: what the verbs are for."""
    turn = number + number // len(EFFECTS)
    case = draw(_LACKS, turn, seed)
    return case.nominal, case.log, f"{case.setting['programme']}, {case.setting['noise']}, {', '.join(case.hidden)}"


KINDS: dict[str, Callable[[int, int, np.random.Generator], Drawn]] = {
    "calm": calm,
    "in waves": in_waves,
    "from the step": from_the_step,
    "full throttle": full_throttle,
    "one thruster rests": resting_thruster,
    "slow ship at 10 Hz": ship,
    "an effect is missing": lacking,
}


def judge(first: int, number: int) -> dict[str, Any]:
    """What is said against one sound log."""
    seed, kinds = first + number, list(KINDS)
    kind = kinds[number % len(kinds)]
    rng = np.random.default_rng([seed, 8])
    for _ in range(20):
        try:
            boat, log, what = KINDS[kind](number // len(kinds), seed, rng)
            break
        except RequestError:
            continue  # no sound vehicle, or one that diverges: another
    else:
        raise RequestError(f"seed {seed}: no sound {kind} in twenty draws")
    told = {"seed": seed, "kind": kind, "what": what, "refused": "", "accused": [], "corrected": []}
    with tempfile.TemporaryDirectory() as scratch:
        path = log.write(Path(scratch) / "log.csv")
        try:
            inputs = read_inputs(path, boat, progress=None)
        except LogError as error:
            return {**told, "refused": str(error).split("log.csv: ", 1)[-1].split("Nothing found")[0][:300]}
    findings = [f for inspection in inputs.inspected[1] for f in inspection.quality] if inputs.inspected else []
    return {
        **told,
        "accused": [f"{f.check}: {f.sentence}" for f in findings if f.verdict in ("defect", "warning")],
        "corrected": [text for found in inputs.sensors.values() for text in found.sentences.values()],
    }


def page(records: Sequence[Mapping[str, Any]], command: str) -> str:
    """The study as a page in Markdown."""
    refused = [r for r in records if r["refused"]]
    share = len(refused) / max(len(records), 1)
    rows = []
    for name in KINDS:
        some = [r for r in records if r["kind"] == name]
        counts = [sum(bool(r[what]) for r in some) for what in ("refused", "accused", "corrected")]
        rows.append((name, len(some), *counts))
    told = [
        f"- seed {r['seed']} ({r['kind']}, {r['what']}), {what}: {text}"
        for what in ("refused", "accused", "corrected")
        for r in records
        for text in ([r[what]] if isinstance(r[what], str) else r[what])
        if text
    ]
    parts = [
        "# Sound logs: how often one is refused",
        "Random sound logs through files and the checks of every verb. Refused: the verbs end with exit code 2. "
        "Accused: a check calls a defect or a warning. Corrected: a sensor that is right is said to be wrong, and its "
        "record is changed.",
        f"**{len(refused)} of {len(records)} sound logs were refused**: {share:.2%} (at most {MOST:.1%}); with 95 % "
        f"confidence it is below {bound(len(refused), len(records), 0.95):.2%} (Clopper and Pearson).",
        in_a_table(("logs", "number", "refused", "accused", "corrected"), rows),
        "\n".join(told),
        f"Written by `{command}`; do not edit.",
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _sister(number: int, rng: np.random.Generator) -> Vehicle:
    return random_hull(load_vehicle(VEHICLES[number % len(VEHICLES)]), rng)


def _sailed(boat: Vehicle, number: int, seed: int, noises: Sequence[str], waves: float = 0.0) -> Drawn:
    kind, noise = ALL[number % len(ALL)], noises[number // len(ALL) % len(noises)]
    log = World(boat, kind, DURATION, seed).run(replace(NOISE[noise], waves=waves))
    return boat, log, f"{kind}, {noise}{f', waves of {waves:.2f} m/s' * bool(waves)}"


def _driven(boat: Vehicle, held: Array, rng: np.random.Generator, seed: int, sensors: Sensors) -> SimulatedLog:
    orders = Orders(held, float(rng.uniform(-np.pi, np.pi)))
    return World(boat, duration=COMMAND_STEP * (held.shape[0] - 1), seed=seed, orders=orders).run(sensors)


def _pushed(log: SimulatedLog, rng: np.random.Generator) -> SimulatedLog:
    """The log of a boat that short waves push, too: surge, sway and yaw go up and down together, at 0.2 to 2 Hz."""
    time, omega = log.odometry_time, 2.0 * np.pi * rng.uniform(*_PUSHED, 80)
    phase = np.exp(1j * (np.outer(time, omega) + rng.uniform(0.0, 2.0 * np.pi, 80)))
    mixed = rng.standard_normal((80, 3)) + rng.uniform(0.0, 2.0) * rng.standard_normal(80)[:, None] * [1.0, 0.5, 1.0]
    size = float(rng.uniform(0.02, 0.12)) * np.array([1.0, 1.0, 0.6]) / np.sqrt(0.5 * (mixed**2).sum(axis=0))
    speed, way = (np.real(phase / (1j * omega) ** k @ (size * mixed)) for k in (1, 2))
    heading = log.odometry[:, 2] + way[:, 2]
    north, east = body_to_earth(log.odometry[:, 2], way[:, 0], way[:, 1])
    place = log.odometry[:, :2] + np.column_stack([north, east])
    return replace(log, odometry=np.column_stack([place, heading, log.odometry[:, 3:] + speed]))


def _smooth(series: Array, seconds: float) -> Array:
    """A series (n,) after a first-order lag, as an autopilot changes its mind."""
    share, found, now = min(1.0, COMMAND_STEP / seconds), np.empty_like(series), 0.0
    for k, wanted in enumerate(series.tolist()):
        now += share * (wanted - now)
        found[k] = now
    return found


def _slow_hull(rng: np.random.Generator) -> Vehicle:
    """A hull of 0.8 to 4 m that takes 10 to 60 s to answer, with two thrusters in newtons."""
    boat = scaled(random_hull(load_vehicle("blueboat"), rng), float(rng.uniform(0.8, 3.0)))
    heavier = float(rng.uniform(1.5, 6.0))
    boat = boat.with_values(
        {s: heavier * boat.value(s) for s in ("mass", "inertia_z", *boat.added_mass) if boat.value(s)}
    )
    inertia = np.diag(mass_matrix(boat))
    times, top = rng.uniform(10.0, 60.0), float(rng.uniform(0.15, 0.8))
    slow = {"X_u": -inertia[0] / times, "Y_v": -3.0 * inertia[1] / times, "N_r": -3.0 * inertia[2] / times}
    boat = boat.with_values({**dict.fromkeys(boat.damping, 0.0), **slow})
    newton = round(-0.5 * slow["X_u"] * top, 2)
    arm = max(0.2 * abs(boat.thrusters[0].x), 0.5 * abs(boat.thrusters[0].y))
    pair = tuple(thruster(n, boat.thrusters[0].x, y, 0.0, newton) for n, y in (("port", -arm), ("stbd", arm)))
    return boat.model_copy(update={"thrusters": pair, "name": "slow ship"}).checked()


def _waypoints(boat: Vehicle, seconds: float, rng: np.random.Generator) -> Array:
    """Commands of an autopilot that steers new headings, by a rough model of how the boat turns."""
    inertia, damping = float(mass_matrix(boat)[2, 2]), -boat.value("N_r")
    moment = float(np.abs(thruster_matrix(boat)[2] * [t.curve.force[-1] for t in boat.thrusters]).sum())  # type: ignore[union-attr]
    rows = round(seconds / COMMAND_STEP) + 1
    turn, heading, rate, wanted, until = np.zeros(rows), 0.0, 0.0, 0.0, 0.0
    common = float(rng.uniform(0.4, 1.0))
    throttle = np.full(rows, common)
    for k in range(rows):
        if COMMAND_STEP * k >= until:
            wanted += float(rng.uniform(-2.0, 2.0))
            until += float(rng.uniform(40.0, 150.0))
            common = float(np.clip(common + rng.uniform(-0.2, 0.2), 0.3, 1.0))
        throttle[k] = common
        turn[k] = np.clip(0.8 * (wanted - heading) - 8.0 * rate, -1.0, 1.0)
        rate += COMMAND_STEP * (moment * turn[k] - damping * rate) / inertia
        heading += COMMAND_STEP * rate
    return thruster_commands(boat, throttle, turn)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study and print its page."""
    records = Script("sound_logs", 420, FIRST, judge, _line, page, PACKAGES).carried_out(__doc__, arguments)
    return int(sum(bool(r["refused"]) for r in records) > MOST * len(records))


def _line(records: Kept) -> str:
    """What was said against the last log."""
    last = records[-1]
    told = [f"REFUSED {last['refused']}"] if last["refused"] else [*last["accused"], *last["corrected"]]
    return f"{last['seed']} {last['kind']} ({last['what']}): {'; '.join(told)}" if told else ""


if __name__ == "__main__":
    sys.exit(main())
