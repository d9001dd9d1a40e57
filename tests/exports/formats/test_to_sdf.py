"""The Gazebo model is lawful SDF, and read back as Gazebo's plugins use its numbers it moves as undertow says."""

import ctypes
import re
from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from exported import boat, envelope, facts, needed

from undertow.exports.formats import to_sdf
from undertow.exports.formats.base import Choices, Given
from undertow.physics.errors import RequestError
from undertow.physics.forces import held_acceleration
from undertow.physics.thrusters import TableCurve
from undertow.physics.vehicle import Vehicle, load_vehicle

FLIP = np.array([1.0, -1.0, -1.0])
"""Between x ahead, y to starboard, z down and Gazebo's x ahead, y to port, z up."""
HULLS = {
    "blueboat": {},
    "cross terms": {"Y_ur": -4.0, "N_uv": 7.0, "X_vr": -3.0, "N_ur": -5.0, "Y_r": -6.0, "N_v": 2.0, "Y_rdot": -1.5},
    "off centre": {"x_g": 0.06, "y_g": 0.03, "arm_scale": 1.2, "port_scale": 0.7, "surge:r|v|": -2.0, "sway:ur": 1.0},
    "angled": {},
    "in a current": {"current_north": 0.3, "current_east": -0.2},
}


LIMITS = {"port": (-20.0, 30.0), "stbd": (-35.0, 25.0)}
"""Least and largest force [N] of the thrusters of the hull with angled ones."""


def hull(name: str) -> Vehicle:
    vehicle = load_vehicle("blueboat").with_values(HULLS[name])
    if name != "angled":
        return vehicle
    falling = TableCurve(kind="table", command=(-35.0, 0.0, 35.0), force=(30.0, 0.0, -20.0))
    rising = TableCurve(kind="table", command=(-35.0, 0.0, 35.0), force=(-35.0, 0.0, 25.0))
    port, stbd = vehicle.thrusters
    port = port.model_copy(update={"angle": 0.4, "y": -0.3, "curve": falling})
    stbd = stbd.model_copy(update={"angle": -0.4, "y": 0.2, "curve": rising})
    return vehicle.model_copy(update={"thrusters": (port, stbd)})


def document(vehicle: Vehicle, folder: Path, **choices: str) -> Path:
    given = Given(vehicle, facts("as it is"), Choices(**choices))  # type: ignore[arg-type]
    ((path, content),) = to_sdf.EXPORT.files(given, folder / "model.sdf").items()
    path.write_bytes(content)
    return path


def numbers(text: str | None) -> list[float]:
    return [float(part) for part in (text or "").split()]


class Gazebo:
    """A model in the plane as Gazebo moves it: rigid bodies about their origin, and what `Hydrodynamics.cc` adds."""

    def __init__(self, root: ElementTree.Element) -> None:
        self.mass = np.zeros((3, 3))
        self.added = np.zeros((3, 3))
        self.push: list[np.ndarray] = []
        for link in root.iter("link"):
            pose = numbers(link.findtext("pose", "0 0 0 0 0 0"))
            centre = numbers(link.findtext("inertial/pose", "0 0 0 0 0 0"))
            x, y = pose[0] + centre[0], pose[1] + centre[1]
            m, izz = float(link.findtext("inertial/mass", "")), float(link.findtext("inertial/inertia/izz", ""))
            ixx, iyy = (float(link.findtext(f"inertial/inertia/{name}", "")) for name in ("ixx", "iyy"))
            assert ixx + iyy >= izz > 0.0 < iyy <= ixx + izz
            self.mass += [[m, 0.0, -m * y], [0.0, m, m * x], [-m * y, m * x, izz + m * (x * x + y * y)]]
            if link.find("inertial/fluid_added_mass") is not None:
                moved = {e.tag: float(e.text or "") for e in link.find("inertial/fluid_added_mass") or ()}
                self.added += [[moved["xx"], 0, 0], [0, moved["yy"], moved["yr"]], [0, moved["yr"], moved["rr"]]]
            if link.attrib["name"] != "base_link":
                ahead, aside = np.cos(pose[5]), np.sin(pose[5])
                self.push.append(np.array([ahead, aside, pose[0] * aside - pose[1] * ahead]))
        self.engine_moves_water = bool(self.added.any())
        water = next(p for p in root.iter("plugin") if p.attrib["name"].endswith("Hydrodynamics"))
        self.terms: Mapping[str, str] = {e.tag: e.text or "" for e in water}

    def acceleration(self, velocity: np.ndarray, heading: float, thrust: np.ndarray) -> np.ndarray:
        """Of the link over ground, all in Gazebo's axes; heading from east, to the left."""
        number = {name: float(text) for name, text in self.terms.items() if name not in SAID}
        east, north, _ = numbers(self.terms.get("default_current", "0 0 0"))
        cosine, sine = np.cos(heading), np.sin(heading)
        water = np.array([cosine * east + sine * north, cosine * north - sine * east, 0.0])
        relative = velocity - water
        force = np.sum([push * t for push, t in zip(self.push, thrust, strict=True)], axis=0)
        for i, moment in enumerate("xyn"):
            for j, one in enumerate("UVR"):
                coefficient = number.get(moment + one, 0.0)
                for k, other in enumerate("UVR"):
                    coefficient += number.get(moment + one + other, 0.0) * relative[k]
                    coefficient += number.get(f"{moment}{one}abs{other}", 0.0) * abs(relative[k])
                force[i] += coefficient * relative[j]
        assert self.terms["disable_coriolis"] == "true"
        engine = self.mass + self.added
        added = -np.array([[number.get(f"{m}Dot{s}", 0.0) for s in "UVR"] for m in "xyn"])
        turning = np.array([velocity[2] * water[1], -velocity[2] * water[0], 0.0])  # of the current in the boat's axes
        return np.linalg.solve(engine + added, force - coriolis(engine, velocity) + added @ turning)


SAID = ("link_name", "disable_coriolis", "disable_added_mass", "default_current")


def coriolis(mass: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """C(nu) nu of a mass matrix in the plane, Fossen (2021), theorem 3.2."""
    u, v, r = velocity
    a, b = mass[0, 0] * u + mass[0, 2] * r, mass[1, 1] * v + mass[1, 2] * r
    return np.array([-b * r, a * r, b * u - a * v])


@pytest.mark.parametrize(
    ("name", "added_mass"),
    # In a current an engine whose water stands still has another force, which the file tells.
    [*((name, "plugin") for name in HULLS), *((name, "inertial") for name in HULLS if name != "in a current")],
)
def test_read_back_it_moves_as_undertow_says(name: str, added_mass: str, tmp_path: Path):
    vehicle = hull(name)
    root = ElementTree.parse(document(vehicle, tmp_path, added_mass=added_mass)).getroot()
    gazebo = Gazebo(root)
    assert gazebo.engine_moves_water is (added_mass == "inertial")
    assert root.attrib["version"] == ("1.10" if added_mass == "inertial" else "1.9")
    rng = np.random.default_rng(4)
    count = 1000
    velocity = rng.uniform(envelope("as it is").lower, envelope("as it is").upper, (count, 3))
    heading, commands = rng.uniform(-np.pi, np.pi, count), rng.uniform(-35.0, 35.0, (count, 2))
    expected = held_acceleration(vehicle, velocity, heading, commands)
    thrust = np.array([t.lasting(commands[:, k])[0] for k, t in enumerate(vehicle.thrusters)]).T
    found = [FLIP * gazebo.acceleration(FLIP * velocity[k], np.pi / 2.0 - heading[k], thrust[k]) for k in range(count)]
    np.testing.assert_allclose(np.array(found), expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_limits_of_a_thruster_are_its_least_and_its_largest_force(tmp_path: Path):
    root = ElementTree.parse(document(hull("angled"), tmp_path)).getroot()
    plugins = [p for p in root.iter("plugin") if p.attrib["name"].endswith("Thruster")]
    assert [p.findtext("joint_name") for p in plugins] == [f"{name}_joint" for name in LIMITS]
    for plugin, ends in zip(plugins, LIMITS.values(), strict=True):
        assert (plugin.findtext("min_thrust_cmd"), plugin.findtext("max_thrust_cmd")) == tuple(map(repr, ends))


def library() -> ctypes.CDLL:
    try:
        return ctypes.CDLL("libsdformat12.so.12")
    except OSError:
        needed("libsdformat12", None, "package libsdformat12-12")
        raise


@pytest.mark.parametrize("gz", ["garden", "fortress"])
@pytest.mark.parametrize("name", HULLS)
def test_libsdformat_finds_no_error_and_prints_the_same_numbers(
    name: str, gz: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
):
    """Its exit code is 0 whatever it finds, so what it prints is read."""
    sdformat, path = library(), document(hull(name), tmp_path, gz=gz)
    assert sdformat.cmdCheck(str(path).encode()) == 0
    sdformat.cmdPrint(str(path).encode())
    ctypes.CDLL(None).fflush(None)
    out, err = capfd.readouterr()
    assert not re.search("Error|Warning", out + err), out + err
    assert out.startswith("Valid.")
    printed = ElementTree.fromstring(out.partition("Valid.")[2].strip())
    written = ElementTree.parse(path).getroot()
    for tag in ("plugin", "inertial"):
        pairs = list(zip(printed.iter(tag), written.iter(tag), strict=True))
        for one, other in pairs:
            for leaf in other.iter():
                if len(leaf) == 0 and leaf is not other:
                    said = [numbers(e.text) if number(e.text) else e.text for e in one.iter(leaf.tag)]
                    wanted = numbers(leaf.text) if number(leaf.text) else leaf.text
                    assert any(same(each, wanted) for each in said), leaf.tag


def test_the_world_of_the_guide_shows_the_boat_and_lets_nothing_pull_it_down(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    sdformat = library()
    monkeypatch.chdir(tmp_path)
    document(hull("blueboat"), tmp_path).rename("blueboat.sdf")
    guide = (Path(__file__).parents[3] / "docs" / "howto" / "export.md").read_text("utf-8")
    Path("sea.sdf").write_text(guide.split("```xml\n")[1].split("```")[0], "utf-8")
    assert sdformat.cmdCheck(b"sea.sdf") == 0
    sdformat.cmdPrint(b"sea.sdf")
    ctypes.CDLL(None).fflush(None)
    out, err = capfd.readouterr()
    assert not re.search("Error|Warning", out + err), out + err
    links = list(ElementTree.fromstring(out.partition("Valid.")[2].strip()).iter("link"))
    assert [link.findtext("gravity") for link in links] == ["false"] * 3
    length, width, height = numbers(links[0].findtext("visual/geometry/box/size"))
    assert length == pytest.approx(1.452, abs=1e-3)
    assert (width, height) == pytest.approx((length / 3.0, length / 3.0), abs=1e-3)
    assert not [one for link in links for one in link.iter("collision")], "of which Gazebo would make a buoyancy"


def number(text: str | None) -> bool:
    return bool(text) and re.fullmatch(r"[-+.\deE\s]+", text or "") is not None


def same(one: list[float] | str | None, other: list[float] | str | None) -> bool:
    if isinstance(one, list) and isinstance(other, list):
        return one == pytest.approx(other, rel=1e-12, abs=1e-15)
    return one == other


def test_libsdformats_exit_code_lies(tmp_path: Path, capfd: pytest.CaptureFixture[str]):
    path = document(hull("blueboat"), tmp_path)
    path.write_text(path.read_text("utf-8").replace('version="1.9"', 'version="7.1"'), "utf-8")
    library().cmdCheck(str(path).encode())
    ctypes.CDLL(None).fflush(None)
    assert "Error" in "".join(capfd.readouterr())


def test_added_mass_with_which_the_plugin_explodes_is_refused(tmp_path: Path):
    otter = load_vehicle("otter")
    with pytest.raises(RequestError, match=r"up to 1\.93 times its own.*--added-mass inertial"):
        document(otter, tmp_path)
    assert document(otter, tmp_path, added_mass="inertial").is_file()
    just = otter.with_values({"Y_vdot": -40.0, "N_rdot": -8.0})
    assert to_sdf.growth(just) < 1.0
    with pytest.raises(RequestError, match="SDF 1.10, which Fortress does not read"):
        document(otter, tmp_path, gz="fortress", added_mass="inertial")


def test_fortress_has_its_own_names_and_signs(tmp_path: Path):
    vehicle = hull("blueboat")
    text = document(vehicle, tmp_path, gz="fortress").read_text("utf-8")
    for line in ("<xUU>-8.0</xUU>", "<xDotU>3.0</xDotU>", "<zDotW>0.0</zDotW>", "ignition::gazebo::systems::Thruster"):
        assert line in text
    assert "absU" not in text
    assert "disable_coriolis" not in text


def test_fortress_is_as_wrong_beside_a_term_of_the_same_form():
    both = []
    for added in ({}, {"surge:vr": -4.0, "yaw:uv": 3.0}):
        given = Given(hull("blueboat").with_values(added), facts("as it is"), Choices(gz="fortress"))
        both += [line.partition("mean")[2] for line in to_sdf.EXPORT.left_out(given) if line.startswith("Coriolis")]
    assert both[0] == both[1] != ""


def test_what_it_cannot_say_is_told_in_newtons():
    lines = "\n".join(to_sdf.EXPORT.left_out(Given(boat("table, everything"), facts("table, everything"))))
    said = ("wake_memory", "thruster_lag", "input_delay", "mean_wind", "apparent_wind", "yaw_trim", "battery_sag")
    said += ("cross_flow_drag",)
    for effect in said:
        assert re.search(rf"{effect}.*\d N", lines), effect
    assert "straight lines to both ends in its place" in lines
    none = to_sdf.EXPORT.left_out(Given(hull("blueboat"), facts("as it is")))
    assert [line.partition(":")[0] for line in none] == ["Heave, roll and pitch"]
    told = to_sdf.EXPORT.left_out(Given(hull("blueboat"), facts("as it is"), Choices(gz="fortress")))
    assert any(re.search(r"Coriolis.*surge [\d.]+ N \(up to", line) for line in told)
