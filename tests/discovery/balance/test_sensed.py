"""What sensor noise makes of a balance: to first order the same as a noisier log has, louder where drag is strong."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.discovery.balance.shooting import Shooting
from undertow.discovery.balance.weak_form import WeakForm, WeakSettings
from undertow.discovery.search.surrogates import SURROGATES, NoiseCopies
from undertow.measurements.statistics.signals import drawn_noise
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("otter")


def form_of(noise: str = "field", seconds: float = 120.0) -> WeakForm:
    world = simulate_world(HULL, {}, programme="rich", duration=seconds, noise=noise, seed=3)
    return WeakForm([world.motion(0.1)], WeakSettings())


@pytest.mark.parametrize("derived", [(False, False, False), (True, True, False)])
def test_it_is_what_a_noisier_log_has_more(derived: tuple[bool, bool, bool]):
    weak = form_of()
    motion = replace(weak.motions[0], derived=derived)
    weak = WeakForm([motion], WeakSettings())
    found = weak.propagated_noise(HULL, 4, 7)
    drawn = drawn_noise(motion, weak.noise, np.random.default_rng([7, 4]), 4)
    assert found is not None
    assert found.shape == (3, 4, weak.time.size)
    for copy in range(4):
        more = weak.recorded([replace(motion, velocity=motion.velocity + drawn[copy])], HULL) - weak.residual(HULL)
        np.testing.assert_allclose(found[:, copy].T / more.std(axis=0), more / more.std(axis=0), atol=0.2)


def test_drag_lets_more_of_it_through_where_the_boat_is_fast():
    """What is slow of it, for the inertia lets the fast part through everywhere alike."""
    weak = form_of(seconds=300.0)
    found = weak.propagated_noise(HULL, 400, 0)
    assert found is not None
    slow = np.add.reduceat(found[0], np.arange(0, weak.time.size, 50), axis=1)[:, :-1].std(axis=0)
    speed = np.add.reduceat(np.abs(weak.speeds[:, 0]), np.arange(0, weak.time.size, 50))[:-1]
    assert np.corrcoef(slow, speed)[0, 1] > 0.5


def test_a_log_without_noise_and_rollouts_have_none():
    assert form_of("clean").propagated_noise(HULL, 4, 0) is None
    weak = form_of()
    assert Shooting(weak.motions, HULL).propagated_noise(HULL, 4, 0) is None


def test_the_same_draws_are_made_once():
    weak = form_of()
    first = weak.propagated_noise(HULL, 4, 0)
    assert weak.propagated_noise(HULL, 4, 0) is first
    weak.forget()
    again = weak.propagated_noise(HULL, 4, 0)
    assert again is not first
    np.testing.assert_array_equal(again, first)


@pytest.mark.parametrize("loud", [0.0, 3.0])
def test_copies_are_as_loud_as_the_rest(loud: float):
    """Where the noise of sensors is all that is left, it is drawn; what is left beside it has its colour."""
    weak = form_of(seconds=300.0)
    left = weak.residual(HULL)
    slow = np.cumsum(np.random.default_rng(2).standard_normal(left.shape), axis=0)
    left = left + loud * left.std(axis=0) * (slow - slow.mean(axis=0)) / slow.std(axis=0)
    copies = np.concatenate(list(NoiseCopies(weak, HULL, 0).of(left.astype(np.float32))), axis=1)
    assert copies.shape == (3, SURROGATES, weak.time.size)
    np.testing.assert_allclose(copies.std(axis=(1, 2)), left.std(axis=0), rtol=0.12)
    spectrum = np.abs(np.fft.rfft(copies)).mean(axis=1)[:, 1:10].mean(axis=1)
    np.testing.assert_allclose(spectrum, np.abs(np.fft.rfft(left.T))[:, 1:10].mean(axis=1), rtol=0.6)


def test_an_axis_to_which_no_noise_comes_keeps_its_rest():
    weak = form_of()
    left = weak.residual(HULL).astype(np.float32)
    drawn = weak.propagated_noise(HULL, SURROGATES, 0)
    assert drawn is not None
    drawn[1] = 0.0
    copies = np.concatenate(list(NoiseCopies(weak, HULL, 0).of(left)), axis=1)
    assert np.isfinite(copies).all()
    assert copies[1].std() == pytest.approx(left[:, 1].std(), rel=0.2)
