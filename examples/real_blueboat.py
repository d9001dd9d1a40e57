"""A real BlueBoat: from a linear model with a textbook propeller to what its field logs ask for, whole logs held out.

Run it as `python examples/real_blueboat.py FOLDER [SPLITS]` on `log_NNN.csv` files with t, x, y, psi, u, v, r,
pwm_port and pwm_stbd. Each split holds a third of the logs out; the linear model is fitted to the others first, so that
it has every chance, and discovery names what it lacks. Errors are told for the rows with a command in the last 8 s,
which is the hard part, and for all rows; the limits are asked of the former. It exits with 1 when one of them fails.
"""

import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from undertow.discovery.balance.shooting import ShootingSettings
from undertow.discovery.basis import correct_compass
from undertow.discovery.discover import Discovery, find_missing
from undertow.discovery.search.estimation import polish
from undertow.measurements.log import Log, read_log
from undertow.measurements.log_options import Reading
from undertow.measurements.preparation.prepare import PAPER, WEAK, prepare
from undertow.physics.integration import SPEED_LIMIT, rollout
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, vehicle_from_dict

CHANNELS = """
pwm_stbd: {from: pwm_stbd, scale: -1.0, offset: 3020.0}   # wired the other way round about its neutral of 1510 us
"""
CURVE = {"kind": "propeller", "scale": 70.0, "offset": -1.4, "k_t": 0.085, "rho": 1000.0, "diameter": 0.112}
START = {
    "name": "BlueBoat, linear",
    "mass": 15.0,
    "inertia_z": 3.0,
    "damping": {"X_u": -10.0, "Y_v": -40.0, "N_r": -5.0},
    "thrusters": [
        {"name": "port", "x": -0.45, "y": -0.285, "command": "pwm", "curve": CURVE},
        {"name": "stbd", "x": -0.45, "y": 0.285, "command": "pwm", "curve": CURVE},
    ],
    "sources": {
        "mass": "about 15 kg and an arm of about 0.285 m, as the notes that came with the logs say; not weighed by us",
        "thrusters": "the shape of the paper's curve, PWM to shaft speed, squared, about the neutral of 1510 us that "
        "the logs show, in fresh water; k_t makes 40 N full ahead, a guess that is fitted (thrust_scale)",
        "other": "a first guess, fitted before discovery; sway cannot be learnt from these logs",
    },
}
FITTED = ("X_u", "N_r", "thrust_scale")
WANTED = {"reverse_thrust_loss", "surge_quadratic_damping", "yaw_speed_damping"}
UNWANTED = {
    "steady_current",
    "thruster_lag",
    "input_delay",
    "sway_linear_damping",
    "sway_quadratic_damping",
    "sway_yaw_coupling",
    "sway_lift",
    "sway_added_mass",
}
LIMITS = {"surge": (0, 0.20, "m/s"), "yaw rate": (2, 0.11, "rad/s")}
IDLE = 8.0  # s
NEUTRAL, ALIVE = 1510.0, 12.0  # us
HORIZONS = (10.0, 30.0)  # s


def main(folder: Path, splits: int) -> bool:
    """True when every limit holds."""
    logs = read(folder)
    start = vehicle_from_dict(START, "start")
    fitting = {log.name: prepare(log, start, WEAK).motions for log in logs}
    judging = {log.name: prepare(log, start, PAPER).motions for log in logs}
    totals: dict[tuple[str, float, str], list[np.ndarray]] = {}
    diverged = 0
    for number, held_out in enumerate(divisions(list(fitting), splits), start=1):
        train = [m for name, motions in fitting.items() if name not in held_out for m in motions]
        test = [m for name in held_out for m in judging[name]]
        linear, found = model(train, start)
        print(f"split {number}, held out {', '.join(held_out)}")
        named = found_names(found)
        print(f"  found: {', '.join(sorted(named)) or 'nothing'}")
        for horizon in HORIZONS:
            for label, vehicle in (("linear", linear), ("corrected", found.corrected)):
                squares, driven, lost = errors(vehicle, test, horizon)
                diverged += lost if label == "corrected" and horizon == HORIZONS[-1] else 0
                totals.setdefault((label, horizon, "driven"), []).append(squares[driven])
                totals.setdefault((label, horizon, "all"), []).append(squares)
                print(f"  {horizon:3g} s, {label:9}: {told(squares[driven])}, {lost} diverged")
    print("all splits")
    for (label, horizon, rows), squares in totals.items():
        print(f"  {horizon:3g} s, {label:9}, {rows:6} rows: {told(np.concatenate(squares))}")
    linear, found = model([m for motions in fitting.values() for m in motions], start)
    tell(found)
    named = found_names(found)
    return conclude(totals[("corrected", HORIZONS[0], "driven")], diverged, named)


def found_names(found: Discovery) -> set[str]:
    """Names that are more likely there than not: where logs differ in more than any name says, few are surer."""
    return {effect.effect for effect in found.findings.added if effect.confidence > 0.5}


def read(folder: Path) -> list[Log]:
    """All logs of a folder, by name."""
    paths = sorted(folder.glob("log_*.csv"))
    if not paths:
        sys.exit(f"{folder}: no log_*.csv here")
    with tempfile.TemporaryDirectory() as scratch:
        channels = Path(scratch) / "channels.yaml"
        channels.write_text(CHANNELS, encoding="utf-8")
        return [read_log(path, Reading(channel_map=channels)) for path in paths]


def divisions(names: Sequence[str], splits: int) -> list[list[str]]:
    """Names of the logs held out in each split: thirds of a shuffled list, and when it is used up of another one."""
    rng = np.random.default_rng(0)
    found: list[list[str]] = []
    while len(found) < splits:
        order: list[str] = [names[int(k)] for k in rng.permutation(len(names))]
        found += [sorted(order[k::3]) for k in range(3)]
    return found[:splits]


def model(train: Sequence[Motion], start: Vehicle) -> tuple[Vehicle, Discovery]:
    """The linear model fitted to rollouts, and what discovery makes of it."""
    linear = fitted(train, start)
    return linear, find_missing(train, linear)


def fitted(train: Sequence[Motion], start: Vehicle) -> Vehicle:
    """The linear model fitted to rollouts."""
    clear = correct_compass(train)
    return polish(clear.motions, start, FITTED, ShootingSettings(turned=clear.turned)).vehicle


def errors(vehicle: Vehicle, motions: Sequence[Motion], horizon: float) -> tuple[np.ndarray, np.ndarray, int]:
    """Squared errors along rollouts from every 0.5 s (rows, 4), which rows are driven, how many rollouts diverged.

    Errors are those of u, v, r, and the distance of places.
    """
    found, driven, lost = [np.zeros((0, 4))], [np.zeros(0, dtype=bool)], 0
    for motion in motions:
        steps = round(horizon / motion.time_step)
        starts = np.arange(0, motion.time.size - steps, max(1, round(0.5 / motion.time_step)))
        if starts.size:
            rolled = rollout(vehicle, motion, starts, steps).states[:, 1:]
            states, rows = rolled[..., 3:], starts[:, None] + np.arange(1, steps + 1)
            apart = ((rolled[..., :2] - motion.position[rows]) ** 2).sum(axis=-1, keepdims=True)
            found.append(np.concatenate([(states - motion.velocity[rows]) ** 2, apart], axis=-1).reshape(-1, 4))
            driven.append(active(motion)[rows].ravel())
            lost += int((np.abs(states).max(axis=(1, 2)) >= SPEED_LIMIT).sum())
    return np.concatenate(found), np.concatenate(driven), lost


def active(motion: Motion) -> np.ndarray:
    """True on rows with a command within the last 8 s."""
    row = np.arange(motion.time.size)
    on = np.abs(motion.commands - NEUTRAL).max(axis=1) > ALIVE
    return row - np.maximum.accumulate(np.where(on, row, -np.inf)) <= IDLE / motion.time_step


def told(squares: np.ndarray) -> str:
    surge, sway, yaw, place = np.sqrt(squares.mean(axis=0))
    return f"surge {surge:.3f} m/s, sway {sway:.3f} m/s, yaw {yaw:.3f} rad/s, place {place:.2f} m"


def tell(found: Discovery) -> None:
    findings = found.findings
    print(f"all logs: {findings.headline}")
    for effect in findings.candidates:
        terms = ", ".join(f"{t.symbol} {t.value:.3g} {t.unit}{interval(t.ci95)}" for t in effect.terms)
        if effect.verdict == "missing" or terms:
            print(f"  {effect.effect}: {effect.verdict}; {terms}")
    for note in found.notes:
        print(f"  note: {note}")
    if findings.passivity is not None:
        print(f"  {findings.passivity.sentence}")


def interval(ci95: object) -> str:
    return f" [{ci95.lower:.3g}, {ci95.upper:.3g}]" if ci95 is not None else ""  # type: ignore[attr-defined]


def conclude(squares: Sequence[np.ndarray], diverged: int, missing: set[str]) -> bool:
    """Print which limits hold, and tell whether all do."""
    root = np.sqrt(np.concatenate(squares).mean(axis=0))
    verdicts: Mapping[str, bool] = {
        **{
            f"10 s {name} {root[k]:.3f} <= {most:g} {unit}": root[k] <= most for name, (k, most, unit) in LIMITS.items()
        },
        f"{diverged} of the 30 s rollouts diverge": diverged == 0,
        f"more likely than not: {', '.join(sorted(WANTED))}": missing >= WANTED,
        f"findings claim no current, lag, delay or sway effect{claims(missing & UNWANTED)}": not missing & UNWANTED,
    }
    for text, holds in verdicts.items():
        print(f"{'holds' if holds else 'FAILS'}: {text}")
    return all(verdicts.values())


def claims(wrong: set[str]) -> str:
    return f" (it claims {', '.join(sorted(wrong))})" if wrong else ""


if __name__ == "__main__":
    if len(sys.argv) < 2:
        print(__doc__)
    else:
        sys.exit(0 if main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 3) else 1)
