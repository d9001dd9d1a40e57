"""A user's script over the public names, which type checkers read in strict mode; `python user_script.py` runs it."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import undertow
from undertow import DiscoverySettings, Findings, Inputs, Log, LogError, Motion, RequestError, Run, Vehicle

HIDDEN = {"surge_quadratic_damping": -12.0}


def record(folder: Path, boat: Vehicle, seconds: float = 60.0) -> Path:
    world = undertow.simulate_world(boat, HIDDEN, duration=seconds, noise="field", seed=2)
    return world.write(folder / "log.csv")


def look(path: Path) -> Log:
    log = undertow.read_log(path, undertow.Reading(frame=None))
    rates = {name: 1.0 / channel.period for name, channel in log.channels.items() if channel.period}
    print(log, max(rates.values()), undertow.inspect_log(log).plan.missing)
    return log


def first_vehicle(log: Log) -> Vehicle:
    draft = undertow.init(log, undertow.Hull(mass=30.5))
    print([thruster.name for thruster in draft.thrusters], draft.unsettled)
    return draft.vehicle


def fastest(inputs: Inputs) -> NDArray[np.float64]:
    motions: tuple[Motion, ...] = inputs.fitting
    velocities: NDArray[np.float64] = np.vstack([motion.velocity for motion in motions])
    return np.hypot(velocities[:, 0], velocities[:, 1])


def search(path: Path, boat: Vehicle) -> Run:
    inputs: Inputs = undertow.read_inputs([path], boat, progress=None)
    run = undertow.discover(inputs, DiscoverySettings(seed=1), progress=None)
    print(run, run.verb[0].upper(), fastest(inputs).shape, run.discovery.corrected.value("X_uu"))
    return run


def numbers(findings: Findings) -> Iterator[tuple[str, float, float]]:
    for effect in findings.candidates:
        for term in effect.terms if effect.in_model else ():
            low, high = term.ci95 or (term.value, term.value)
            yield f"{effect.effect}: {term.symbol} [{term.unit}]", term.value, high - low


def errors(run: Run) -> list[float]:
    steps = [step.rollout_rmse["10"].position for step in run.findings.steps]
    for model in run.comparison.models:
        print(model.name, model.acceleration.rmse.surge, model.rollout["10"].position, model.audit)
    print(run.comparison.best.sentence)
    return steps


def once_more(run: Run, folder: Path) -> Path:
    more = undertow.add([*run.findings.missing, "sway_lift"], run.inputs, run.settings, run.findings, progress=None)
    written = undertow.write_run(more, folder / "run", report=False, progress=None)
    again = undertow.load_run(written)
    print(again.findings.verdict, again.nominal.name, again.record.seed, again.series.shape[0])
    return written


def draw(run: Run, folder: Path) -> None:
    axes = run.plot.force("surge")
    print(axes.get_xlabel(), run.findings.plot.coefficients().get_title())
    print(run.comparison.plot.errors("surge").get_xlabel(), undertow.load_run(folder).plot.staircase().get_xlabel())


def judge(run: Run, folder: Path) -> bool:
    run.discovery.corrected.save(folder / "model.yaml")
    audit = undertow.check(folder / "model.yaml", progress=None)
    for ruling in audit.violations:
        print(ruling.law, ruling.sentence)
    inputs = undertow.read_inputs(folder / "log.csv", "blueboat", judge="test", progress=None)
    fitted = undertow.fit(inputs, progress=None)
    print(fitted.vehicle.value("X_u"), *fitted.sentences, sep="\n")
    compared = undertow.compare(inputs, [folder / "model.yaml"], progress=None)
    limits = undertow.first_limits(inputs, margin=0.5)
    exported = undertow.export(folder / "model.yaml", "python", folder / "model.py", undertow.Choices(time_step=0.1))
    print([path.name for path in exported.files], compared.models[-1].name)
    return audit.verdict == "pass" and not undertow.ci(inputs, limits).broken


def learn(run: Run, folder: Path) -> float:
    trained = undertow.train(run.inputs, undertow.Choice("mlp"), out=folder / "net", progress=None)
    print(trained.model.parameters, trained.models[-1].rollout["10"].surge)
    distilled = undertow.distil(folder / "net", run.inputs, progress=None)
    print(distilled.sentences)
    steered = undertow.control([folder / "run"], trial=undertow.Trial(tracks=("square",)), progress=None)
    planned = undertow.plan(folder / "run", bounds=undertow.Bounds(), progress=None)
    print(steered, planned)
    return planned.minutes if planned is not None else 0.0


def months(logs: list[Path], boat: Vehicle, folder: Path) -> None:
    undertow.build_fleet(logs, boat, folder / "fleet", engine=undertow.Engine(), progress=None)
    fleet = undertow.read_fleet(folder / "fleet", by="day")
    print([estimate.hours for estimate in fleet.estimates], undertow.diary_of(fleet))
    factors = undertow.compress(logs, boat)
    print(undertow.ensemble(factors, 0.1), undertow.write_factors(factors, folder / "factors").stem)


def main(folder: Path) -> None:
    boat = undertow.load_vehicle("blueboat")
    try:
        path = record(folder, boat)
        run = search(path, boat)
    except (LogError, RequestError) as error:
        raise SystemExit(str(error)) from error
    print(first_vehicle(look(path)).mass, *numbers(run.findings), *errors(run), sep="\n")
    draw(run, once_more(run, folder))
    print(judge(run, folder), undertow.__version__.split("."))


if __name__ == "__main__":
    main(Path())
