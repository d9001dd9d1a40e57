"""Distillation names what a model adds, says how much of it that is, and calls a memory a memory."""

import io
import json
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from rich.console import Console
from scipy.ndimage import gaussian_filter1d

import undertow
from undertow.discovery.distillation import AxisShare, Distilled, distil_model
from undertow.measurements.preparation.resampling import smooth
from undertow.physics.errors import RequestError
from undertow.physics.forces import modelled_acceleration
from undertow.physics.integration import Rollouts
from undertow.physics.momentum_balance import mass_matrix
from undertow.physics.motion import Array, Motion
from undertow.physics.sampled_series import first_order_lag
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.hidden_effects import apply_effects
from undertow.physics.worlds.world import simulate_world
from undertow.reports.terminal.laws_and_effects_screen import distilled_table
from undertow.residuals.models.base import Model, VehicleModel

HULL = load_vehicle("blueboat")
HIDDEN = {"surge_quadratic_damping": -9.0}


@cache
def driven() -> Motion:
    """As the paper's preparation leaves a log with field noise: the velocities are measured ones."""
    return smooth(simulate_world(HULL, {}, duration=180.0, noise="field", seed=1).motion(0.1), 1.2, 4)


class Pushing(Model):
    """A made-up network: the hull, and a force beside it."""

    name, kind, parameters, seconds_to_fit = "network", "hybrid", 0, 0.0

    def __init__(self, force: Callable[[Motion], Array]) -> None:
        self.force = force

    def acceleration(self, motion: Motion) -> Array:
        return modelled_acceleration(HULL, motion) + self.force(motion) @ np.linalg.inv(mass_matrix(HULL))

    def rollout(self, motion: Motion, starts: np.ndarray, steps: int) -> Rollouts:
        raise AssertionError("distillation asks for accelerations only")

    def settled(self, velocity: Array, heading: Array, commands: Array) -> Array:
        raise AssertionError("distillation asks for accelerations along motions only")


def distilled(effects: dict[str, float]) -> Distilled:
    return distil_model(VehicleModel(apply_effects(HULL, effects), "network"), [driven()], HULL)


def values(found: Distilled) -> dict[str, float]:
    return {term.symbol: term.value for part in found.effects for term in part.terms}


def test_a_single_effect_is_named_with_its_coefficient():
    found = distilled(HIDDEN)
    assert [(part.effect, part.verdict) for part in found.effects] == [("surge_quadratic_damping", "named")]
    assert values(found)["X_uu"] == pytest.approx(-9.0, rel=0.02)
    surge, sway, yaw = found.axes
    assert surge.named is not None
    assert surge.named > 0.97
    assert surge.past is None
    assert not sway.matters
    assert not yaw.matters
    assert (
        found.headline
        == "Along this motion, what network adds to BlueBoat (ArduPilot Gazebo) holds surge quadratic damping."
    )
    assert surge.sentence.endswith("named effects explain 100 %; what remains is too small to matter.")
    assert sway.sentence.endswith("is too small to matter.")


def test_two_effects_are_named_and_share_the_axes():
    found = distilled({**HIDDEN, "munk_moment": 15.0})
    assert {part.effect for part in found.effects} == {"surge_quadratic_damping", "munk_moment"}
    assert values(found) == pytest.approx({"X_uu": -9.0, "N_uv": 15.0}, rel=0.02)
    shares = {part.effect: part.share for part in found.effects}
    assert shares["munk_moment"]["yaw"] > 0.97
    assert shares["munk_moment"]["surge"] < 0.01
    assert shares["surge_quadratic_damping"]["surge"] > 0.97


def test_a_changed_mass_is_named_too():
    found = distilled({"surge_added_mass": -8.0})
    assert values(found)["X_udot"] == pytest.approx(-8.0, rel=0.02)
    assert all(axis.named is None or axis.named > 0.97 for axis in found.axes)


def test_the_past_is_called_memory_and_leaves_the_named_part_alone():
    def force(motion: Motion) -> Array:
        u, _, r = motion.velocity.T
        slow = first_order_lag(u, 2.0, motion.time_step)
        return np.column_stack([-12.0 * slow, np.zeros_like(u), -8.0 * r * np.abs(r)])

    found = distil_model(Pushing(force), [driven()], HULL)
    surge, _, yaw = found.axes
    assert yaw.named is not None
    assert yaw.named > 0.97
    assert values(found)["N_rr"] == pytest.approx(-8.0, rel=0.02)
    assert surge.explained is not None
    assert surge.explained < 0.95
    claimed = force(driven())[:, 0]
    damping = sum(values(found).get(s, 0.0) * form for s, form in _drag(driven()).items())
    by_rows = 1.0 - ((claimed - damping) ** 2).mean() / (claimed**2).mean()
    assert surge.explained == pytest.approx(by_rows, abs=0.1)
    assert surge.past is not None
    assert surge.past.memory > 0.4
    assert surge.past.memory + surge.past.present > 0.9
    assert surge.sentence.count("% is memory: it follows from the motion before") == 1


def _drag(motion: Motion) -> dict[str, Array]:
    u = motion.velocity[:, 0]
    return {"X_u": u, "X_uu": u * np.abs(u)}


def test_a_bend_of_the_present_state_is_no_memory():
    def force(motion: Motion) -> Array:
        thrust = motion.commands @ np.array([0.02, -0.02])
        return np.column_stack([np.zeros_like(thrust), 3.0 * np.tanh(thrust), np.zeros_like(thrust)])

    found = distil_model(Pushing(force), [driven()], HULL)
    sway = found.axes[1]
    assert sway.explained is not None
    assert sway.explained < 0.5
    assert sway.past is not None
    assert sway.past.present > 0.5 > 0.2 > sway.past.memory
    assert "in no form that has a name" in sway.sentence


def test_a_model_that_adds_nothing_leaves_nothing_to_distil():
    found = distilled({"surge_quadratic_damping": -1e-3})
    assert found.effects == found.unnamed == ()
    assert found.headline.startswith("Nothing to distil: what network adds to BlueBoat")
    assert not any(axis.matters for axis in found.axes)


@pytest.mark.parametrize("seconds", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("seed", range(4))
def test_random_forces_are_given_no_name(seconds: float, seed: int):
    def force(motion: Motion) -> Array:
        rng = np.random.default_rng(seed)
        slow = gaussian_filter1d(rng.standard_normal(motion.velocity.shape), seconds / motion.time_step, axis=0)
        return slow / slow.std(axis=0) * [3.0, 3.0, 1.0]

    found = distil_model(Pushing(force), [driven()], HULL)
    assert all(axis.matters for axis in found.axes)
    assert [part.effect for part in found.effects if part.verdict == "named"] == []
    assert max(axis.named for axis in found.axes if axis.named is not None) < 0.05
    assert found.headline.startswith("No named effect is found for sure")


def test_accelerations_that_are_not_finite_are_refused():
    broken = Pushing(lambda motion: np.full_like(motion.velocity, np.nan))
    with pytest.raises(RequestError, match="distil network: expected finite accelerations"):
        distil_model(broken, [driven()], HULL)


def test_the_function_on_a_log_its_file_and_its_table(tmp_path, capsys: pytest.CaptureFixture[str]):
    log = simulate_world(HULL, {}, duration=120.0, noise="field", seed=2).write(tmp_path / "log.csv")
    inputs = undertow.read_inputs(log, HULL)
    lines: list[str] = []
    network = VehicleModel(apply_effects(HULL, {**HIDDEN, "yaw_trim": 0.7}), "network")
    found = undertow.distil(network, inputs, progress=lines.append)
    assert values(found) == pytest.approx({"X_uu": -9.0, "yaw_trim": 0.7}, rel=0.02)
    assert found.seconds == pytest.approx(0.85 * 120.0, abs=4.0), "the test part takes no part"
    assert "asking what remains for memory" in lines
    told = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert told["schema"] == "undertow.distillation/1"
    assert [axis["unit"] for axis in told["axes"]] == ["N", "N", "N m"]
    assert told["axes"][1]["share"] == {"named": None, "with_possible": None, "with_unnamed": None}
    assert told["effects"][0]["terms"][0]["ci95"][0] <= told["effects"][0]["terms"][0]["value"]
    Console(width=80).print(distilled_table(found))
    shown = capsys.readouterr().out
    assert "X_uu -9.00 N s²/m²" in shown
    assert "What remains" in shown
    assert max(map(len, shown.splitlines())) <= 80


def test_a_share_that_an_effect_gives_away_for_another_axis_is_explained():
    traded = AxisShare(
        axis="sway", unit="N", correction=2.0, at_work=10.0, named=-0.09, possible=0.88, explained=0.79, remainder=0.9
    )
    assert "named effects explain nothing, with effects that are not sure 88 %" in traded.sentence
    assert "79 % (all axes are fitted at once, and some effects explain less here for more" in traded.sentence
    plain = AxisShare(
        axis="yaw", unit="N m", correction=2.0, at_work=10.0, named=0.5, possible=0.8, explained=0.9, remainder=0.6
    )
    assert "fitted at once" not in plain.sentence
    paper = io.StringIO()
    console = Console(file=paper, width=100)
    console.print(
        distilled_table(
            Distilled(model="net", nominal="hull", axes=(traded, plain), effects=(), unnamed=(), seconds=60.0)
        )
    )
    shown = " ".join(paper.getvalue().split())
    assert "none 88" in shown
    assert "-9" not in shown
    assert "less of one for more of another" in shown
