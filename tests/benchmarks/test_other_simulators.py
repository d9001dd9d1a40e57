"""Worlds of other people's simulators: their equations are theirs, their files are true, and kinds say what is so."""

import importlib
from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import cos, exp, radians, sin, sqrt
from pathlib import Path
from types import ModuleType
from typing import Any, get_args, get_type_hints

import numpy as np
import pytest
from places import ROOT

from undertow.discovery.findings import SensorError
from undertow.physics.effects import BY_NAME, COMMAND_OFFSET
from undertow.physics.worlds.hidden_effects import apply_effects

WHOLE = ("Otter in the plane", "WAM-V", "CSAD", "Gunnerus", "Nomoto")
PROMISED = "cross_flow_drag"
"""An effect that the catalogue is to have."""


@pytest.fixture(scope="module")
def package() -> Iterator[ModuleType]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "benchmarks"))
        yield importlib.import_module("study.other_simulators")


@pytest.fixture(scope="module")
def worlds(package: ModuleType) -> ModuleType:
    return importlib.import_module("study.other_simulators.worlds")


@pytest.fixture(scope="module")
def kinds(package: ModuleType) -> ModuleType:
    return importlib.import_module("study.other_simulators.kinds")


@pytest.fixture(scope="module")
def craft(package: ModuleType) -> ModuleType:
    return importlib.import_module("study.other_simulators.craft")


@pytest.fixture(scope="module")
def effects(package: ModuleType) -> ModuleType:
    return importlib.import_module("study.other_simulators.effects")


def drawn(kinds: ModuleType, name: str, seed: int = 1) -> Any:
    return kinds.SIMULATORS[name].make(np.random.default_rng(seed))


def held(shares: Sequence[float], boat: Any) -> Any:
    command = boat.command(shares)
    return lambda t, seen: command


def quiet(worlds: ModuleType, world: Any, seconds: float) -> Any:
    """The world under a rich programme and without noise."""
    return replace(world, book=replace(world.book, programme="rich", noise="none", seconds=seconds))


def test_the_otter_is_that_of_the_python_vehicle_simulator(package: ModuleType):
    # from cybergalactic/PythonVehicleSimulator c717e07, dynamics() over one second, which is its derivative
    otter = importlib.import_module("study.other_simulators.otter")
    boat = otter.otter(np.random.default_rng(0), drawn=False)
    state = [
        *(0.0, 0.0, -0.035207796421504345, 0.0319626719119277, 0.018328690600325714, 1.7225816493288058),
        *(-0.4251512229395943, 0.241891328907624, -0.2469408591542398),
        *(-0.16737895305459494, 0.14209078971482808, 0.3612834961776684),
    ]
    pushes = [otter.thrust(n) for n in (67.77667735498449, -5.056250515417759)]
    water = 0.3 * cos(radians(40.0)), 0.3 * sin(radians(40.0))
    own = boat.equations(boat.numbers)(state, (sum(pushes), 0.0, 0.395 * (pushes[0] - pushes[1])), water)
    theirs = (1.6270306177593037, -0.6681040565301314, 4.828281851721581)
    turning = (0.08135182481161601, 1.0679127462049796, -1.0596695550217436)
    np.testing.assert_allclose(own[6:], [*theirs, *turning], atol=1e-12)


def test_vessels_are_those_of_mcsimpython(package: ModuleType):
    # x_dot() of CSADMan3DOF and GunnerusManeuvering3DoF, MCSimPython 0.1.6
    vessels = importlib.import_module("study.other_simulators.vessels")
    boat = vessels.csad(np.random.default_rng(0))
    water = 0.08 * cos(1.1), 0.08 * sin(1.1)
    own = boat.equations(boat.numbers)([0.0, 0.0, 0.3, 0.25, -0.05, 0.04], (5.0, 1.0, 2.0), water)
    there = [0.25361013261446846, 0.026113227209054582, 0.04]
    np.testing.assert_allclose(
        own, [*there, -0.08943998573604107, 0.5097837828143537, -0.06932761807619246], atol=1e-12
    )
    ship = vessels.gunnerus(np.random.default_rng(0))
    loaded = dict(ship.numbers) | {"mass": 574127.69, "inertia_z": 41237080.0}
    water = 0.6 * cos(1.1), 0.6 * sin(1.1)
    own = ship.equations(loaded)([0.0, 0.0, 0.3, 3.0, -0.4, 0.03], (2e4, 1e3, 3e4), water)
    there = [2.984217550041354, 0.5044260243337761, 0.03]
    np.testing.assert_allclose(
        own, [*there, -0.0072402954846766876, -0.028953447838808443, -0.0018142417702687896], atol=1e-12
    )


def test_engines_of_the_wam_v_follow_their_curve(package: ModuleType):
    thrust = importlib.import_module("study.other_simulators.vessels").logistic_thrust
    grid = np.linspace(-1.0, 1.0, 401)
    forces = np.array([thrust(c) for c in grid.tolist()])
    assert thrust(0.0) == 0.0
    assert np.all(np.diff(forces) >= 0.0)
    assert forces[0] == pytest.approx(-100.0)
    assert forces[-1] == pytest.approx(0.01 + 59.81 / (0.56 + exp(-3.6)) ** (1.0 / 0.38))


@pytest.mark.parametrize("name", ["Otter in the plane", "WAM-V", "CSAD", "Gunnerus", "strips", "Nomoto"])
def test_a_straight_run_ends_where_drag_is_thrust(kinds: ModuleType, craft: ModuleType, name: str):
    boat = drawn(kinds, name)
    shares = [0.0 if unit.angle else 0.6 for unit in boat.file.thrusters]
    course = craft.Plant(boat).run(held(shares, boat), 120.0 * boat.pace, 1.0, 0.4)
    push = sum(law(c) for law, c in zip(boat.laws, boat.command(shares), strict=True))
    p = boat.file.values
    linear, quadratic = -p["X_u"], max(-p["X_uu"], 1e-12)
    speed = 2.0 * push / (linear + sqrt(linear**2 + 4.0 * quadratic * push))
    u, v, r = course.planar[-1, 3:]
    assert u == pytest.approx(speed, rel=2e-3)
    assert abs(v) < 1e-9
    assert abs(r) < 1e-9


@pytest.mark.parametrize("name", ["CSAD", "Nomoto"])
def test_a_steady_turn_is_that_of_the_linear_equations(kinds: ModuleType, craft: ModuleType, name: str):
    boat = drawn(kinds, name)
    shares = [0.0, 0.0, 0.5] if name == "CSAD" else [0.4, -0.4 / 0.7]
    course = craft.Plant(boat).run(held(shares, boat), 100.0 * boat.pace, 1.0, 0.0)
    pushes = [law(c) for law, c in zip(boat.laws, boat.command(shares), strict=True)]
    _, Y, N = np.array(boat.levers).T @ pushes
    p = boat.file.values
    v, r = np.linalg.solve([[p["Y_v"], p["Y_r"]], [p["N_v"], p["N_r"]]], [-Y, -N])
    np.testing.assert_allclose(course.planar[-1, 4:], [v, r], rtol=1e-4, atol=1e-9)


@pytest.mark.parametrize("name", ["Otter in the plane", "WAM-V", "CSAD", "Gunnerus", "strips"])
def test_energy_is_only_lost_where_nothing_pushes(kinds: ModuleType, craft: ModuleType, name: str):
    otter = importlib.import_module("study.other_simulators.otter")
    boat = drawn(kinds, name)
    u, v, r = 0.8 * boat.length**0.5, 0.2 * boat.length**0.5, 0.4 / boat.length**0.5
    rest = list(boat.rest)
    for place, speed in zip(boat.places[3:], (u, v, r), strict=True):
        rest[place] = speed
    course = craft.Plant(replace(boat, rest=tuple(rest))).run(
        held([0.0] * len(boat.laws), boat), 20.0 * boat.pace, 1.0, 0.0
    )
    p = boat.numbers
    if name == "Otter in the plane":
        mass = otter._mass_matrix(p)
        stiff, _ = otter._restoring(p["mass"], p["mass"] / otter.RHO / 0.4, p["z_g"])
        nu, eta = course.states[:, 6:], course.states[:, :6]
        energy = 0.5 * np.einsum("ti,ij,tj->t", nu, mass, nu) + 0.5 * np.einsum("ti,ij,tj->t", eta, stiff, eta)
    else:
        m23 = p["mass"] * p.get("x_g", 0.0) - p.get("Y_rdot", 0.0)
        if "N_vdot" in p:
            m23 = -0.5 * (p["Y_rdot"] + p["N_vdot"])
        u, v, r = course.planar[:, 3:].T
        energy = (p["mass"] - p["X_udot"]) * u**2 + (p["mass"] - p["Y_vdot"]) * v**2
        energy = 0.5 * (energy + (p["inertia_z"] - p["N_rdot"]) * r**2) + m23 * v * r
    assert np.diff(energy).max() < 1e-4 * energy[0]
    assert energy[-1] < 0.5 * energy[0]


@pytest.mark.parametrize("name", WHOLE)
def test_a_file_predicts_its_simulator_where_nothing_is_hidden(worlds: ModuleType, kinds: ModuleType, name: str):
    world, _ = worlds.world_of("n", kinds.KINDS[f"{name}: nothing hidden"], 3)
    world = quiet(worlds, world, 60.0 * world.craft.pace)
    apart = worlds.shares(world, world.driven())
    assert apart.matters < 0.012
    assert apart.dominant == ""


@pytest.mark.parametrize(
    ("name", "effect"),
    [
        *((("WAM-V", effect)) for effect in ("mass_offset", "cg_offset", "lateral_cg", "yaw_added_mass", "mean_wind")),
        *((("WAM-V", effect)) for effect in ("thrust_dead_zone", "thrust_exponent", "input_delay", "advance_loss")),
        *((("CSAD", effect)) for effect in ("thruster_lag", "thruster_asymmetry", "thruster_arm", "yaw_trim")),
        *((("Gunnerus", effect)) for effect in ("steady_current", "sway_added_mass", "battery_sag")),
        *((("Nomoto", effect)) for effect in ("sway_yaw_coupling", "yaw_speed_damping", "reverse_thrust_loss")),
        *((("Otter in the plane", effect)) for effect in ("surge_added_mass", "sway_quadratic_damping")),
    ],
)
def test_what_is_known_of_an_effect_mends_the_file(
    worlds: ModuleType, kinds: ModuleType, effects: ModuleType, name: str, effect: str
):
    kind = kinds.KINDS[f"{name}: nothing hidden"]
    world, sizes = worlds.world_of("n", kind, 5)
    hidden = effects.effect(effect, world.craft, sizes, np.random.default_rng(4))
    world = quiet(worlds, replace(world, hidden=(hidden,)), 60.0 * world.craft.pace)
    course = world.driven()
    apart = worlds.shares(world, course)
    mended = worlds.shares(world, course, apply_effects(world.craft.file, dict(hidden.known)))
    assert mended.matters < 0.02
    assert mended.matters < 0.4 * apart.matters
    assert apart.dominant == hidden.key


def test_a_lag_and_a_delay_act_as_in_the_catalogue(kinds: ModuleType, craft: ModuleType):
    boat = drawn(kinds, "CSAD")
    plant = craft.Plant(boat)
    plant.lag, plant.delay, h = 0.5, 0.2, boat.step
    act = craft._Actuators(plant)
    found = np.array([act.pushes(k * h, [8.0, 0.0, 0.0])[0] for k in range(40)])
    middle = (np.arange(40) + 0.5) * h - 0.2
    np.testing.assert_allclose(found, 8.0 * np.where(middle > 0.0, 1.0 - np.exp(-middle / 0.5), 0.0), atol=1e-9)


def test_every_simulator_hides_what_it_says_it_can(kinds: ModuleType, effects: ModuleType, craft: ModuleType):
    for name in kinds.SIMULATORS:
        boat = drawn(kinds, name)
        assert boat.exact <= set(BY_NAME), name
        sizes = effects.Sizes((1.0, 0.1, 0.1), (10.0, 10.0, 10.0), 50.0, 20.0)
        for key in sorted(boat.exact):
            hidden, plant = effects.effect(key, boat, sizes, np.random.default_rng(2)), craft.Plant(boat)
            hidden.change(plant)
            assert plant != craft.Plant(boat), (name, key)
            symbols = {s.format(thruster=unit.name) for s in BY_NAME[key].symbols for unit in boat.file.thrusters}
            assert hidden.known.keys() <= symbols, (name, key)


def test_kinds_speak_of_effects_and_sensors_that_there_are(package: ModuleType, kinds: ModuleType):
    offsets = (COMMAND_OFFSET.symbol, "gyro_latency", "position_latency")
    errors = (*get_args(get_type_hints(SensorError)["error"]), *offsets)
    nameless = importlib.import_module("study.other_simulators.nameless").NAMELESS
    for name, kind in kinds.with_hulls().items():
        assert {*kind.true, *kind.part} <= {*BY_NAME, PROMISED}, name
        assert set(kind.sensors) <= set(errors), name
        assert kind.honest, name
        assert kind.why, name
        assert set(kind.simulators) <= set(kinds.SIMULATORS), name
    assert {kind.nameless for kind in package.KINDS.values()} >= set(nameless)
    for simulator in kinds.SIMULATORS.values():
        assert set(simulator.part) <= {*BY_NAME, PROMISED}


def test_every_cause_without_a_name_moves_the_boat(kinds: ModuleType, effects: ModuleType, craft: ModuleType):
    nameless = importlib.import_module("study.other_simulators.nameless").NAMELESS
    pilots = importlib.import_module("study.other_simulators.pilots")
    boat = drawn(kinds, "CSAD")
    sizes = effects.sizes_of(boat, 1)
    seconds = 80.0 * boat.pace

    def driven(plant: Any) -> Any:
        pilot = pilots.pilot_of("rich", boat, seconds, (0.0,) * 4, np.random.default_rng(5))
        return plant.run(pilot, seconds, 0.1, 0.0).planar[:, 3:]

    bare = driven(craft.Plant(boat))
    scale = np.sqrt((bare**2).mean(axis=0))
    for name, make in nameless.items():
        plant, hidden = craft.Plant(boat), make(boat, sizes, np.random.default_rng(6))
        assert hidden.key == name
        assert set(hidden.part) <= set(BY_NAME), name
        hidden.change(plant)
        apart = np.sqrt(((driven(plant) - bare) ** 2).mean(axis=0)) / scale
        assert 0.01 < apart.max() < 20.0, (name, apart)


@pytest.mark.parametrize("programme", ["lawn-mower", "waypoints"])
def test_an_autopilot_follows_its_track(kinds: ModuleType, craft: ModuleType, programme: str):
    pilots = importlib.import_module("study.other_simulators.pilots")
    boat = drawn(kinds, "WAM-V")
    pilot = pilots.pilot_of(programme, boat, 400.0, (0.0,) * 4, np.random.default_rng(5))
    course = craft.Plant(boat).run(pilot, 400.0, 0.1, 0.0)
    sight = pilot.__closure__
    assert sight is not None
    legs = next(cell.cell_contents.leg for cell in sight if hasattr(cell.cell_contents, "leg"))
    assert legs >= 4
    assert np.ptp(course.commands, axis=0).min() > 0.2


def test_the_same_seed_gives_the_same_log_and_another_run(package: ModuleType, tmp_path: Path):
    kind = "CSAD: one effect"
    first, second = (package.logged(kind, 400_003) for _ in range(2))
    texts = [log.write(tmp_path / f"{k}.csv").read_text() for k, log in enumerate((first, second))]
    assert texts[0] == texts[1]
    assert texts[0].startswith("t,x,y,psi,u,v,r,newton_port,newton_stbd,newton_bow\n")
    assert len(first.true) == 1
    assert first.dominant in {*first.true, ""}
    assert not first.nameless
    fresh = [log.fresh(tmp_path / f"fresh{k}.csv", 1).read_text() for k, log in enumerate((first, second))]
    assert fresh[0] == fresh[1]
    assert fresh[0] != texts[0]
    other = package.logged(kind, 400_004)
    assert (other.note, other.seed) != (first.note, first.seed)


def test_a_wrong_sensor_is_in_the_log_and_not_in_the_truth(worlds: ModuleType, kinds: ModuleType, tmp_path: Path):
    world, _ = worlds.world_of("gyro scale", kinds.KINDS["gyro scale"], 400_001)
    world = quiet(worlds, world, 60.0)
    course = world.driven()
    rows = np.loadtxt(world.written(course, tmp_path / "log.csv"), delimiter=",", skiprows=1)
    logged, real = rows[:, 6], np.interp(rows[:, 0], course.time, course.planar[:, 5])
    scale = float(logged @ real / (real @ real))
    assert 0.02 < abs(scale - 1.0) < 0.09
    np.testing.assert_allclose(rows[:, 4], np.interp(rows[:, 0], course.time, course.planar[:, 3]), atol=1e-5)
