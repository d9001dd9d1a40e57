"""Apparent wind: its closed form, its channels from simulator to findings, and silence where there is no anemometer."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from undertow.discovery.add_effects import add_effects
from undertow.discovery.basis import DiscoverySettings
from undertow.discovery.discover import find_missing
from undertow.measurements.log import read_log
from undertow.measurements.log_options import Reading
from undertow.measurements.preparation.prepare import prepare
from undertow.physics.errors import LogError, RequestError
from undertow.physics.forces import apparent_wind, modelled_force
from undertow.physics.integration import rollout
from undertow.physics.motion import Motion
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.hidden_effects import apply_effects
from undertow.physics.worlds.world import simulate_world
from undertow.workflows.inputs import read_inputs

HULL = load_vehicle("blueboat")
WINDAGE = {"wind_x": 0.12, "wind_y": 0.3, "wind_n": -0.04}


def still(n: int, velocity: tuple[float, float, float], heading: float, air: tuple[float, float] | None) -> Motion:
    rows = np.zeros((n, 2))
    blown = None if air is None else np.tile(air, (n, 1))
    time = 0.1 * np.arange(n, dtype=float)
    return Motion(time, rows, np.full(n, heading), np.tile(velocity, (n, 1)), rows, ("port", "stbd"), air=blown)


def wind_force(motion: Motion, **more: float) -> np.ndarray:
    base = HULL.with_values(more)
    return (modelled_force(base.with_values(WINDAGE), motion) - modelled_force(base, motion))[0]


def test_wind_from_ahead_and_from_port_in_numbers() -> None:
    """The boat heads east at 1 m/s, the air goes west at 4 and south at 3 m/s: aft at 5 and to starboard at 3."""
    motion = still(5, (1.0, 0.0, 0.2), 0.5 * np.pi, (-3.0, -4.0))
    u, v, _ = motion.velocity[0]
    assert apparent_wind(motion.heading[:1], (u, v), (np.array(-3.0), np.array(-4.0))) == pytest.approx((-5.0, 3.0))
    speed = np.sqrt(34.0)
    np.testing.assert_allclose(wind_force(motion), [-0.12 * 5.0 * speed, 0.3 * 3.0 * speed, -0.04 * -15.0])


def test_only_the_velocity_over_ground_counts() -> None:
    motion = still(5, (1.2, 0.3, 0.1), 0.4, (4.0, -2.0))
    np.testing.assert_allclose(wind_force(motion, current_north=0.5, current_east=-0.3), wind_force(motion), atol=1e-12)
    going_along = still(5, (1.0, 0.0, 0.0), 0.0, (1.0, 0.0))
    np.testing.assert_allclose(wind_force(going_along), 0.0, atol=1e-12)


def test_without_an_anemometer_the_air_is_still() -> None:
    np.testing.assert_allclose(
        wind_force(still(5, (1.2, 0.3, 0.1), 0.4, None)), wind_force(still(5, (1.2, 0.3, 0.1), 0.4, (0.0, 0.0)))
    )
    assert wind_force(still(5, (1.0, 0.0, 0.0), 0.4, None))[0] == pytest.approx(-0.12)


def test_a_boat_without_drag_is_carried_off_as_the_closed_form_says() -> None:
    """m du/dt = W (a - u)^2 from rest: a - u = a / (1 + W a t / m)."""
    light = HULL.with_values({**WINDAGE, **dict.fromkeys(("X_u", "X_uu", "Y_v", "Y_vv"), 0.0), "wind_n": 0.0})
    motion = still(20_001, (0.0, 0.0, 0.0), 0.0, (2.0, 0.0))
    end = rollout(light, motion, np.array([0]), 20_000).states[0, -1]
    assert end[3] == pytest.approx(2.0 - 2.0 / (1.0 + 0.12 * 2.0 * 2000.0 / (HULL.mass + 3.0)), rel=1e-4)


def test_a_world_writes_what_its_anemometer_sees(tmp_path: Path) -> None:
    world = simulate_world(HULL, WINDAGE, duration=60.0, noise="clean", seed=3, wind=(3.0, -4.0))
    path = world.write(tmp_path / "log.csv")
    log = read_log(path)
    assert {"wind_u", "wind_v"} <= set(log.channels)
    motion = prepare(log, HULL).motions[0]
    assert motion.air is not None
    np.testing.assert_allclose(motion.air, np.tile((3.0, -4.0), (motion.time.size, 1)), atol=0.05)
    part = motion.slice(100, 200)
    np.testing.assert_array_equal(part.air, motion.air[100:200])
    assert world.motion(0.1).air == pytest.approx(np.tile((3.0, -4.0), (world.motion(0.1).time.size, 1)), abs=0.05)
    calm = simulate_world(HULL, {}, duration=60.0, noise="clean", seed=3)
    assert calm.wind is None
    assert calm.motion().air is None
    drawn = simulate_world(HULL, WINDAGE, duration=60.0, noise="clean", seed=3).truth.air
    assert drawn is not None
    assert 4.0 <= np.hypot(*drawn[0]) <= 8.0


def test_wind_in_flu_axes_is_converted(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    rows = [f"{0.1 * k:.1f},{0.1 * k:.2f},0,0,1,0,0,-2,3" for k in range(400)]
    path.write_text("\n".join(["t,x,y,psi,u,v,r,wind_u,wind_v", *rows]))
    log = read_log(path, Reading(frame="enu"))
    assert log.channels["wind_u"].value[0] == -2.0
    assert log.channels["wind_v"].value[0] == -3.0


def test_half_an_anemometer_is_not_used_and_said_so(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    rows = [f"{0.1 * k:.1f},{0.1 * k:.2f},0,0,1,0,0,-2" for k in range(400)]
    path.write_text("\n".join(["t,x,y,psi,u,v,r,wind_u", *rows]))
    data = prepare(read_log(path), None)
    assert data.motions[0].air is None
    assert any("only one of them is in the log" in note for note in data.notes)


def test_air_of_another_shape_is_refused() -> None:
    motion = still(5, (1.0, 0.0, 0.0), 0.0, None)
    with pytest.raises(LogError, match=r"expected air of shape \(5, 2\), got \(4, 2\)"):
        replace(motion, air=np.zeros((4, 2)))
    with pytest.raises(LogError, match="air holds values that are not finite"):
        replace(motion, air=np.full((5, 2), np.nan))


def test_the_wind_is_found_through_a_file_beside_a_drag(tmp_path: Path) -> None:
    hidden = apply_effects(HULL, {"apparent_wind": tuple(WINDAGE.values()), "surge_quadratic_damping": -9.0})
    path = simulate_world(hidden, {}, duration=200.0, noise="field", seed=4).write(tmp_path / "log.csv")
    found = find_missing(read_inputs(path, HULL).fitting, HULL)
    assert set(found.findings.missing) == {"apparent_wind", "surge_quadratic_damping"}
    assert found.corrected.value("wind_x") == pytest.approx(0.12, rel=0.1)
    assert found.corrected.value("wind_y") == pytest.approx(0.3, rel=0.1)
    assert found.corrected.value("wind_n") == pytest.approx(-0.04, rel=0.1)


def test_an_anemometer_alone_is_no_finding() -> None:
    log = simulate_world(HULL, {}, duration=200.0, noise="field", seed=5, wind=(6.0, 2.0)).motion()
    findings = find_missing([log], HULL).findings
    assert findings.verdict == "nothing missing"
    assert next(c for c in findings.candidates if c.effect == "apparent_wind").verdict == "no evidence"


def test_a_log_without_an_anemometer_says_what_it_needs() -> None:
    log = simulate_world(HULL, {"mean_wind": (-8.0, 3.0)}, duration=200.0, noise="field", seed=6).motion()
    found = find_missing([log], HULL).findings
    assert found.missing == ("mean_wind",)
    wind = next(c for c in found.candidates if c.effect == "apparent_wind")
    assert (wind.verdict, wind.terms) == ("possible", ())
    assert wind.sentence.startswith("This log cannot tell: it needs the channels wind_u and wind_v.")
    verdicts = [c.verdict for c in found.candidates]
    assert verdicts == sorted(verdicts, key=("missing", "possible", "no evidence").index)
    with pytest.raises(RequestError, match="apparent_wind: expected the channels wind_u and wind_v in every log"):
        add_effects([log], HULL, ["apparent_wind"], DiscoverySettings())
