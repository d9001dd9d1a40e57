"""What is installed from the wheel is the whole package, and works far from any clone."""

import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from bare_venv import BareVenv
from places import ROOT
from type_checkers import by_mypy, by_pyright

BESIDE = (
    "README.md",
    "CHANGELOG.md",
    "LICENSE",
    "Makefile",
    "Containerfile",
    "pyproject.toml",
    "constraints.txt",
    "CONTRIBUTING.md",
    "CODE_OF_CONDUCT.md",
    "SECURITY.md",
    "CITATION.cff",
    "MANIFEST.in",
)
"""What lies in the root and is no part of the package."""
HIDDEN = shutil.ignore_patterns(".*", "__pycache__")


def left(folder: str, names: list[str]) -> set[str]:
    """What is not copied: beside what is never a part of the package, whatever its users have made in the clone."""
    rooms = [path.name for path in ROOT.iterdir() if (path / "__init__.py").is_file()]
    made = {name for name in names if (ROOT / name).is_dir() and name not in (*rooms, "data")}
    return HIDDEN(folder, names) | (made if Path(folder) == ROOT else set())


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built from a copy, for a build leaves its own folders behind."""
    place = tmp_path_factory.mktemp("wheel")
    shutil.copytree(ROOT, place / "source", ignore=left)
    build = f"from setuptools.build_meta import build_wheel; build_wheel({str(place)!r})"
    subprocess.run([sys.executable, "-c", build], cwd=place / "source", capture_output=True, check=True)
    (found,) = place.glob("*.whl")
    return found


def test_the_wheel_holds_every_file_of_the_package_and_no_other(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as held:
        names = {name for name in held.namelist() if ".dist-info/" not in name}
    source = wheel.parent / "source"
    built = {"build", "undertow.egg-info", *BESIDE}
    files = (path.relative_to(source) for path in source.rglob("*") if path.is_file())
    assert names == {f"undertow/{path.as_posix()}" for path in files if path.parts[0] not in built}
    for name in ("py.typed", "data/demo.yaml", "data/gazebo_blueboat.csv.gz", "physics/vehicles/otter.yaml"):
        assert f"undertow/{name}" in names


def test_what_is_installed_works_outside_the_clone(wheel: Path, tmp_path: Path) -> None:
    work = tmp_path / "work"
    work.mkdir()
    home = BareVenv(tmp_path / "installed")
    home.run("python", "-m", "pip", "install", "--no-deps", "--no-index", wheel, cwd=work)
    where = home.run("python", "-c", "import undertow; print(undertow.__file__)", cwd=work).strip()
    assert Path(where).parent == home.packages / "undertow"

    def undertow(*words: str) -> str:
        return home.run("undertow", *words, cwd=work)

    assert "surge quadratic damping" in undertow("demo")
    assert "munk_moment" in undertow("effects")
    assert "Munk" in undertow("effects", "munk_moment")
    undertow("simulate", "-v", "otter", "--effect", "steady_current=0.2,-0.1", "--duration", "60", "-o", "log.csv")
    undertow("init", "log.csv", "--mass", "55", "--length", "2")
    undertow("discover", "log.csv", "-v", "otter", "-o", "run")
    written = {path.name for path in (work / "run").iterdir()}
    assert {"findings.json", "model.yaml", "report.html", "series.csv"} <= written


@pytest.mark.parametrize("checker", [by_pyright, by_mypy])
def test_what_is_installed_is_typed(wheel: Path, tmp_path: Path, checker: Callable[..., list[list[str]]]) -> None:
    home = BareVenv(tmp_path / "installed")
    with zipfile.ZipFile(wheel) as held:
        held.extractall(home.packages)
    script = Path(shutil.copy(ROOT / "tests" / "helpers" / "user_script.py", tmp_path))
    assert checker(script, python=str(home.scripts / "python")) == [[]]
