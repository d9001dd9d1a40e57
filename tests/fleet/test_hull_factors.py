"""What a log says of a hull: values and errors, sums that do not depend on the cut, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

import undertow
from undertow.fleet.hull_factors import MOST_BLOCKS, followed_by_default, from_bytes, hull_factors, to_bytes
from undertow.fleet.parameter_estimates import estimated
from undertow.physics.worlds.world import NOISE, World

HULL = undertow.load_vehicle("blueboat")


def motion(duration: float = 120.0, seed: int = 0, noise: str = "field", vehicle: undertow.Vehicle = HULL):
    return World(vehicle, "rich", duration, seed).run(NOISE[noise]).motion()


def test_values_come_back_and_intervals_hold_them():
    true = {"X_uu": -14.0, "mass": 36.0, "port_scale": 0.8}
    factors = hull_factors([[motion(vehicle=HULL.with_values(true))]], HULL)
    found = estimated(factors)
    names = [column.name for column in factors.parameters]
    assert tuple(names) == followed_by_default(HULL)
    assert "X_uu" in names
    wanted = np.array([true.get(name, HULL.value(name)) for name in names])
    deviation = np.sqrt(np.diag(found.covariance))
    assert np.all(np.abs(found.values - wanted) < 4.0 * deviation)
    assert np.all(deviation < 0.1 * np.abs(wanted))


def test_intervals_of_six_blocks_hold_the_truth():
    """Of a minute, in which hardly anything happens but in two of its blocks: what a fit leaves these is little."""
    rng = np.random.default_rng(6)
    minute = hull_factors([[motion(60.0)]], HULL)
    p, size, rows = len(minute.parameters), minute.gram.shape[-1], 30
    scale = np.array([4.0] * p + [0.0] * (size - p))
    busy = np.array([0.3, 0.3, 0.3, 1.0, 0.3, 2.0])[:, None, None, None]
    held = []
    for _ in range(40):
        columns = busy * scale * rng.standard_normal((6, 3, rows, size))
        columns[..., -1] = rng.standard_normal((6, 3, rows))
        made = replace(
            minute,
            gram=np.einsum("barp,barq->bapq", columns, columns),
            tests=np.full(6, rows),
            noise=0.0 * minute.noise,
            nominal=np.full(p, 0.01),
            settings=dict(minute.settings) | {"stride": minute.settings["half_width"]},
        )
        found = estimated(made)
        held.append(np.abs(found.values - 0.01) < 1.96 * np.sqrt(np.diag(found.covariance)))
    assert 0.9 < np.mean(held) < 0.985


def test_sensor_noise_is_taken_off():
    """Noise on the speeds hides the mass of a boat that hardly accelerates, were it not known how much there is."""
    otter = undertow.load_vehicle("otter")
    sensors = replace(NOISE["rough"], jitter=0.0, dropouts=0.0)
    factors = hull_factors([[World(otter, "gentle", 200.0, 3).run(sensors).motion()]], otter)
    at = [column.name for column in factors.parameters].index("mass")
    blind = estimated(replace(factors, noise=np.zeros_like(factors.noise)))
    assert blind.values[at] < 0.7 * otter.mass
    assert estimated(factors).values[at] == pytest.approx(otter.mass, rel=0.15)


def test_water_that_moves_is_no_drag():
    flowing = HULL.with_values({"current_north": 0.25, "current_east": -0.15})
    found = estimated(factors := hull_factors([[motion(vehicle=flowing)]], HULL))
    assert np.all(np.abs(found.values / factors.nominal - 1.0) < 0.1)


def test_pieces_and_logs_add_whoever_comes_first():
    whole = motion()
    half = whole.time.size // 2
    parts = [whole.slice(0, half), whole.slice(half, whole.time.size)]
    one, two = (hull_factors([[part]], HULL, digest="a") for part in parts)
    other = hull_factors([[motion(60.0, seed=5)]], HULL, digest="b", start=7.0)
    three = [one + (two + other), (other + two) + one]
    assert to_bytes(three[0]) == to_bytes(three[1])
    assert three[0].logs == ("a", "b")
    assert three[0].start[1] == 7.0
    together = estimated(hull_factors([[parts[0]], [parts[1]]], HULL, digest="a"))
    np.testing.assert_allclose(estimated(one + two).values, together.values, rtol=0.02)
    with pytest.raises(undertow.RequestError, match="each stretch of a log once"):
        _ = one + one
    with pytest.raises(undertow.RequestError, match="the same settings"):
        _ = one + replace(other, settings={})


def test_a_long_log_has_no_more_blocks_and_loses_nothing():
    short = motion(60.0)
    long = (replace(short, time=short.time + 60.0 * n, minutes=short.minutes + n) for n in range(40))
    factors = hull_factors(([one] for one in long), HULL)
    assert factors.tests.size <= MOST_BLOCKS
    assert factors.tests.sum() == 40 * hull_factors([[short]], HULL).tests.sum()
    assert factors.hours[0] == pytest.approx(40 / 60.0, rel=0.05)


def test_what_a_log_does_not_show_is_not_told():
    whole = motion(60.0, noise="clean")
    ahead = np.repeat(whole.commands[:, :1], 2, axis=1)  # both thrusters alike: never a turn, never a drift
    straight = replace(whole, velocity=whole.velocity * [1.0, 0.0, 0.0], commands=ahead, heading=0.0 * whole.heading)
    factors = hull_factors([[straight]], HULL)
    told = dict(zip((c.name for c in factors.parameters), estimated(factors).values, strict=True))
    assert all(np.isnan(told[name]) for name in ("Y_v", "Y_vv", "N_r", "N_rr"))


def test_a_boat_at_rest_and_a_log_that_is_too_coarse_say_nothing():
    idle = motion(60.0)
    still = replace(idle, commands=np.zeros_like(idle.commands), run_up=None)
    with pytest.raises(undertow.RequestError, match="expected a boat that is driven"):
        hull_factors([[still]], HULL)
    rows = ("time", "position", "heading", "velocity", "commands", "minutes")
    coarse = replace(idle, run_up=None, **{name: getattr(idle, name)[::20] for name in rows})
    with pytest.raises(undertow.LogError, match="expected motion at 4.5 Hz or more, got 1 Hz"):
        hull_factors([[coarse]], HULL)
    with pytest.raises(undertow.RequestError, match="force is linear, each once, got lag"):
        hull_factors([[idle]], HULL, ("X_u", "lag"))


def test_the_file_gives_back_what_was_written_and_refuses_others():
    factors = hull_factors([[motion(60.0)]], HULL, digest="a", start=1.5e9)
    content = to_bytes(factors)
    assert to_bytes(from_bytes(content, "x.npz")) == content
    for broken in (b"", content[:500], content.replace(b"hull_factors/1", b"hull_factors/9")):
        with pytest.raises(undertow.RequestError, match=r"x\.npz"):
            from_bytes(broken, "x.npz")
