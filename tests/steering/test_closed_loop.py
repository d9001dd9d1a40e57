"""The true boat is undertow's own simulation, its controller sees sensors alone, and a right model helps."""

import numpy as np
import pytest
from exported import boat

from undertow.physics.integration import rollout
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.hidden_effects import apply_effects
from undertow.physics.worlds.world import FINE_STEP
from undertow.residuals.models.base import VehicleModel
from undertow.steering.closed_loop import CONTROLLERS, Passage, Surroundings, TrueBoat, drive, merit
from undertow.steering.known_model import PERIOD, KnownModel, Observer, known_model
from undertow.steering.tracks import Leg, Track, drawn, pace_of

pytest.importorskip("casadi", reason="what controllers plan with: pip install '.[export]'")
NOMINAL = load_vehicle("blueboat")
HEAVY = apply_effects(NOMINAL, {"surge_linear_damping": -12.0, "thruster_asymmetry": 0.75})
LEGS = (Leg(3.0), Leg(3.0), Leg(0.0, turn=90.0), Leg(3.0))


def knows(vehicle: Vehicle) -> KnownModel:
    return known_model(VehicleModel(vehicle, "it"))


def short() -> Track:
    return drawn("square", [*LEGS, Leg(8.0)], pace_of(NOMINAL))


def driven(model: Vehicle, controller: str = "los", true: Vehicle = HEAVY, *, calm: bool = False) -> Passage:
    around = Surroundings().calm if calm else Surroundings()
    return drive(knows(model), controller, true, around, short(), seed=3)


@pytest.mark.parametrize("name", ["as it is", "table, everything", "delay of whole steps", "lag alone"])
def test_the_true_boat_is_undertows_own_simulation(name: str):
    vehicle = boat(name).with_values({"wind_x": 0.0, "wind_y": 0.0, "wind_n": 0.0})
    periods, fine = 40, round(PERIOD / FINE_STEP)
    true = TrueBoat(vehicle, Surroundings().calm, periods * PERIOD, seed=0)
    full = [float(t.curve.command[-1]) if t.curve.kind == "table" else 1.0 for t in vehicle.thrusters]
    asked = np.random.default_rng(4).uniform(-1.0, 1.0, (periods, len(full))) * full
    found = [true.motion]
    for command in asked:
        true.advance(command)
        found.append(true.motion)
    time = FINE_STEP * np.arange(periods * fine + 1, dtype=float)
    knots = np.vstack([np.zeros(len(full)), asked])
    commands = np.column_stack([np.interp(time, PERIOD * np.arange(periods + 1), column) for column in knots.T])
    rows = time.size
    still = Motion(
        time,
        np.zeros((rows, 2)),
        np.zeros(rows),
        np.zeros((rows, 3)),
        commands,
        tuple(t.name for t in vehicle.thrusters),
    )
    expected = rollout(vehicle, still, np.array([0]), rows - 1).states[0, ::fine]
    np.testing.assert_allclose(np.array(found), expected, atol=1e-9)


def test_a_boat_with_a_wake_in_a_changing_current_starts_in_the_water_of_the_first_minute():
    both = NOMINAL.with_values({"current_rate_east": 0.05, "memory_yaw": 0.4, "memory_time": 1.7})
    boats = both, both.with_values({"current_rate_east": 0.0})
    turning, lasting = (knows(boat).start(np.zeros(6), np.zeros(2)).full() for boat in boats)
    assert np.array_equal(turning, lasting)


def test_in_calm_water_a_perfect_observer_knows_the_boat():
    passage = driven(HEAVY, true=HEAVY, calm=True)
    observer = Observer(knows(HEAVY), passage.motion[0])
    inverse = knows(HEAVY).inverse
    for command, truth in zip(passage.command[1:], passage.motion[1:], strict=True):
        belief = observer.learn(inverse.at_rest(command), truth)
    np.testing.assert_allclose(belief.state[:6], passage.motion[-1], atol=1e-4)
    assert np.abs(belief.push).max() < 1e-4


def test_what_the_boat_lacks_is_learnt_as_a_push():
    weaker = apply_effects(NOMINAL, {"surge_trim": -3.0})
    observer, boat_at_rest = Observer(knows(NOMINAL), np.zeros(6)), TrueBoat(weaker, Surroundings().calm, 60.0, seed=0)
    for _ in range(300):
        boat_at_rest.advance(np.zeros(2))
        belief = observer.learn(np.zeros(2), boat_at_rest.measured())
    assert belief.push[0] == pytest.approx(-3.0 / (NOMINAL.mass + 3.0), rel=0.1)


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_a_right_model_keeps_nearer_to_the_track(controller: str):
    wrong, right = (merit(driven(model, controller)) for model in (NOMINAL, HEAVY))
    assert right.rmse < 0.7 * wrong.rmse
    assert right.rmse < 0.3
    assert not right.lost
    assert right.unsolved == 0


def test_a_plan_keeps_to_the_thrusters_and_their_quickness():
    passage = driven(HEAVY, "nmpc")
    assert np.abs(passage.command).max() <= 35.0 + 1e-6
    quickest = np.abs(np.diff(passage.command, axis=0)).max()
    assert quickest <= 35.0 * PERIOD / 0.4 / 0.75 + 0.1, (
        "port's curve is weaker by a quarter, so its command goes farther"
    )


def test_the_noise_is_the_same_whoever_steers():
    one, other = (TrueBoat(HEAVY, Surroundings(), 2.0, seed=5) for _ in range(2))
    np.testing.assert_array_equal(one.measured(), other.measured())
    assert np.abs(one.measured()).max() > 0.0
    assert np.abs(TrueBoat(HEAVY, Surroundings(), 2.0, seed=6).measured() - one.measured()).max() > 0.0


def test_a_model_with_every_effect_steers():
    everything = boat("table, everything").with_values({"current_north": 0.0, "current_rate_east": 0.0})
    track = drawn("square", [Leg(4.0), Leg(4.0), Leg(8.0)], pace_of(load_vehicle("otter")))
    for controller in CONTROLLERS:
        passage = drive(knows(everything), controller, everything, Surroundings().calm, track, seed=0)
        assert not passage.lost
        assert merit(passage).rmse < 1.0


def test_a_plan_with_a_hull_too_quick_for_its_steps_ends():
    """As a calibration made one: without shorter steps the model overflows, and the solver does not come back."""
    hull = load_vehicle("otter")
    quick = hull.with_values({"N_rr": -900.0, "N_rdot": -10.0})
    track = drawn("square", [Leg(3.0), Leg(2.0), Leg(0.0, turn=45.0), Leg(8.0)], pace_of(hull))
    passage = drive(knows(quick), "nmpc", hull, Surroundings(), track, seed=0)
    assert knows(quick).program.time_step < knows(NOMINAL).program.time_step == PERIOD
    assert not passage.lost
    assert passage.unsolved == 0


def test_a_boat_that_runs_away_is_lost():
    turned = NOMINAL.with_values({})
    crossed = tuple(t.model_copy(update={"y": -t.y, "x": t.x}) for t in turned.thrusters)
    true = turned.model_copy(update={"thrusters": crossed})  # each motor where the other's wires go
    track = drawn("square", [Leg(3.0), Leg(60.0), Leg(8.0)], pace_of(NOMINAL))
    passage = drive(knows(NOMINAL), "los", true, Surroundings(), track, seed=0)
    assert merit(passage).lost
    assert len(passage.seconds) < len(passage.motion) - 1
