"""The study of rivals: each recovers a small linear world or predicts better than nothing, and the page counts."""

import csv
import importlib
import io
from collections.abc import Callable, Iterator
from functools import cache, partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from places import ROOT
from scipy.linalg import expm
from training_parts import HULL

from undertow.measurements.preparation.prepare import DataSet, Recipe
from undertow.measurements.preparation.split import Split
from undertow.physics.forces import actuation
from undertow.physics.motion import Motion
from undertow.residuals.models.base import ZeroAcceleration
from undertow.residuals.scores import evaluate

STEP, EXACT = 0.1, Recipe(cutoff=None)
DRAG = np.array([[-0.6, 0.0, 0.0], [0.0, -1.2, 0.9], [0.0, 0.2, -0.9]])
PUSH = np.array([[0.02, 0.02], [0.0, 0.0], [0.02, -0.02]])
LINEAR = ("pysindy, scaled", "DMDc", "Koopman (EDMDc)", "subspace (MOESP)")
"""Those that hold a linear world exactly."""
LEARNT = (
    "kinetic prior (Lim and Oh)",
    "physical priors (Fang et al.)",
    "PINN (Xu et al.), its network",
    "Gaussian process",
    "Gaussian process residual",
    "neural ODE",
    "port-Hamiltonian",
)


def linear_motion(rows: int, seed: int) -> Motion:
    """What nu_dot = DRAG nu + PUSH T makes of slow thrusts, whose means over a step act."""
    rng, time = np.random.default_rng(seed), STEP * np.arange(rows, dtype=np.float64)
    waves = [np.sin(np.outer(time, rng.uniform(0.2, 1.5, 4)) + rng.uniform(0.0, 6.0, 4)).sum(axis=1) for _ in range(2)]
    commands, still = 10.0 * np.column_stack(waves), np.zeros((rows, 3))
    names = tuple(thruster.name for thruster in HULL.thrusters)
    motion = Motion(time, still[:, :2], still[:, 0], still, commands, names)
    thrust = actuation(HULL, motion).thrust.T
    step = expm(np.block([[DRAG, PUSH], [np.zeros((2, 5))]]) * STEP)
    for k in range(rows - 1):
        pushed = 0.5 * (thrust[k] + thrust[k + 1])
        still[k + 1] = step[:3, :3] @ still[k] + step[:3, 3:] @ pushed
    heading = STEP * np.concatenate([[0.0], np.cumsum(0.5 * (still[1:, 2] + still[:-1, 2]))])
    return Motion(time, np.zeros((rows, 2)), heading, still, commands, names)


@pytest.fixture(scope="module")
def rivals() -> Iterator[SimpleNamespace]:
    """The modules of the study, with trainings that are a fifth as long."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "benchmarks"))
        names = ("cases", "contenders", "descent", "gaussian", "judged", "literature", "rolled", "stepped")
        found = SimpleNamespace(**{name: importlib.import_module(f"study.rivals.{name}") for name in names})
        found.page = importlib.import_module("study.rivals_page")
        patch.setattr(found.literature, "descend", partial(found.descent.descend, steps=150))
        patch.setattr(found.gaussian, "SAMPLE", 60)
        for name, steps in (("ONE_STEP", 150), ("SHORT", 10), ("LONG", 10)):
            patch.setattr(found.rolled, name, steps)
        yield found


@pytest.fixture(scope="module")
def data(rivals: SimpleNamespace) -> Any:
    """A run of half a minute, a quarter of it to validate, and another one that judges."""
    whole, held = linear_motion(320, 1), linear_motion(240, 2)
    parts = [DataSet((m,), (), EXACT) for m in (whole.slice(0, 240), whole.slice(240, 320), whole, held)]
    return rivals.cases.Data(None, Split(parts[0], parts[1], parts[1]), parts[2], parts[3])


@pytest.fixture(scope="module")
def made(rivals: SimpleNamespace, data: Any) -> Callable[[str], Any]:
    """Makes a model of the run by its name, once."""
    return cache(lambda name: rivals.contenders.CONTENDERS[name].make(data, HULL, name, 0))


def errors(model: Any, data: Any) -> tuple[np.ndarray, np.ndarray]:
    found = evaluate(model, data.held, (2.0,))
    return found.acceleration_score.rmse, found.rollout_scores["2"].velocity


@pytest.mark.parametrize("name", [*LINEAR, *LEARNT])
def test_a_linear_world_is_recovered_or_predicted_better_than_by_nothing(
    made: Callable[[str], Any], data: Any, name: str
) -> None:
    model = made(name)
    nothing = errors(ZeroAcceleration(HULL), data)
    most = 0.05 if name in LINEAR else 0.8
    for mine, none in zip(errors(model, data), nothing, strict=True):
        assert (mine / none).mean() < most, (mine, none)
    state = data.held.motions[0]
    settled = model.settled(state.velocity[:3], state.heading[:3], state.commands[:3])
    assert settled.shape == (3, 3)
    assert np.isfinite(settled).all()


def test_dmdc_finds_the_map_of_a_step(made: Callable[[str], Any]):
    system = made("DMDc").system
    step = expm(np.block([[DRAG, PUSH], [np.zeros((2, 5))]]) * STEP)
    np.testing.assert_allclose(system.A, step[:3, :3], atol=1e-8)
    np.testing.assert_allclose(system.B, step[:3, 3:], atol=1e-8)


def test_a_system_that_runs_away_is_counted(rivals: SimpleNamespace, data: Any):
    system = rivals.stepped.Linear(3.0 * np.eye(3), np.zeros((3, 2)), np.eye(3), lambda velocity: velocity)
    model = rivals.stepped.Stepped(system, HULL, STEP, "explodes")
    score = evaluate(model, data.held, (2.0,)).rollout_scores["2"]
    assert score.diverged > 0.9 * score.starts


def test_a_port_hamiltonian_network_gains_no_energy_without_thrust(made: Callable[[str], Any]):
    model = made("port-Hamiltonian")
    rng = np.random.default_rng(0)
    idle = np.zeros((1, 2))
    velocity = rng.normal(0.0, 0.5, (1, 3))
    speeds = [velocity]
    for _ in range(199):
        rate = model.settled(speeds[-1], np.zeros(1), idle)
        speeds.append(speeds[-1] + 0.02 * rate)
    assert np.linalg.norm(speeds[-1]) < np.linalg.norm(speeds[0])


def test_physical_priors_hold_by_construction(made: Callable[[str], Any]):
    model = made("physical priors (Fang et al.)")
    velocity, commands = np.array([[0.5, 0.2, 0.3], [0.5, -0.2, -0.3]]), np.array([[12.0, -5.0], [-5.0, 12.0]])
    own, other = model.settled(velocity, np.zeros(2), commands)
    np.testing.assert_allclose(own, other * [1.0, -1.0, -1.0], atol=1e-9)
    rest = model.settled(np.zeros((1, 3)), np.zeros(1), np.zeros((1, 2)))
    np.testing.assert_allclose(rest, 0.0, atol=1e-9)


def record(name: str, seed: int, size: float) -> dict[str, Any]:
    axes = dict.fromkeys(("surge", "sway", "yaw"), size)
    rolled = axes | {"position": size, "diverged": int(size > 5.0), "starts": 10}
    return {"name": name, "seed": seed, "acceleration": axes, "2": rolled, "10": rolled, "seconds": 1.0}


def test_the_page_says_who_errs_least_and_what_failed(rivals: SimpleNamespace):
    case = rivals.cases.Case("Runs that were made up", lambda seed: None, False)
    sizes = {"Fossen calibrated": 1.0, "symbolic": 0.1, "undertow mlp": 0.5, "pysindy": 9.0, "Gaussian process": 0.3}
    records = [record(name, seed, size) for name, size in sizes.items() for seed in (0, 1)]
    records.append({"name": "DMDc", "seed": 0, "failed": "no reason"})
    text = rivals.page.page({"made up": (case, records)})
    assert "**made up**: over 10 s symbolic errs least (0.1 m; calibrated 1)." in text
    assert "The best network of ours is mlp (0.5). Better than it: symbolic (0.1) and Gaussian process (0.3)" in text
    assert "Rollouts ran away of pysindy." in text
    assert "| DMDc | - | - | - | - | 0 of 0, 1 failed | - |" in text
    assert "| undertow mlp | 0.5 | −50 % | −50 % | −50 % | 0 of 20 | 1 |" in text
    rows = list(csv.DictReader(io.StringIO(rivals.page.as_csv({"made up": records}))))
    assert len(rows) == 10 * (3 + 4 + 4) + 1
    assert {row["kind"] for row in rows} == {"vehicle", "undertow", "rival"}


def test_what_networks_must_hold_is_counted_from_the_records(rivals: SimpleNamespace):
    case, losses = rivals.cases.Case("Made up", lambda seed: None, False), "LSTM with energy and damping losses"
    sizes = {"Fossen as it is": 4.0, "Fossen calibrated": 1.0, "symbolic": 0.12, losses: 0.6}
    sizes |= {"the whole answer": 0.104, "undertow best": 0.4, "undertow mlp": 1.2}

    def told(**others: object) -> str:
        every = [record(name, 0, size) for name, size in (sizes | others).items() if isinstance(size, float)]
        return rivals.page.limits({"made up": (case, every)})

    text = told()
    assert "| the whole answer, over 10 s | −90 % | −89.6 % | **no** |" in text
    assert "−90 % | −90.1 % | yes |" in told(**{"the whole answer": 0.099})
    assert "| undertow best, over 10 s | −55 % | −60.0 % | yes |" in text
    assert f"| better than {losses}, the least of the literature | 6 of 8 | 1 of 1 | yes |" in text
    assert "3 % | -0.4 % (the whole answer, made up) | yes |" in text
    assert "3 % | 5.0 % (undertow mlp, made up) | **no** |" in text
    failed = {"name": "undertow mlp", "seed": 0, "failed": "no reason"}
    every = [record(name, 0, size) for name, size in sizes.items() if name != "undertow mlp"]
    assert "inf % (undertow mlp, made up) | **no** |" in rivals.page.limits({"made up": (case, [*every, failed])})


def test_what_no_seed_changes_is_made_once(rivals: SimpleNamespace):
    case = rivals.cases.Case("Recorded runs", lambda seed: None, False)
    first, second = (rivals.judged.wanted(case, seed, 0) for seed in (0, 1))
    assert set(first) - set(second) == {n for n, c in rivals.contenders.CONTENDERS.items() if not c.random}
    assert "DMDc" in set(first) - set(second)
