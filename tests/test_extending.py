"""Every addition that docs/extending.md shows is one file, and works in a copy of the package."""

import json
import re
import shutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest
from sample_run import write_sample

ROOT = Path(__file__).resolve().parents[1]
OTHERS = (".*", "tests", "examples", "benchmarks", "docs", "build", "dist", "runs", "*.egg-info")
"""What lies in the root beside the package."""
PLACED = re.compile(r"^```\w+\n# (\S+/\S+\.\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
"""A block of code whose first line says in which file it stands."""
BLOCKS = dict(PLACED.findall((ROOT / "docs" / "extending.md").read_text(encoding="utf-8")))


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A folder with a copy of the package in it."""
    shutil.copytree(ROOT, tmp_path / "undertow", ignore=shutil.ignore_patterns(*OTHERS))
    return tmp_path


def add(place: Path, path: str) -> None:
    """Put the document's block into the file that it names: a new one, or the catalogue."""
    file = place / "undertow" / path
    if path != "physics/effects.toml":
        assert not file.exists()
        file.write_text(BLOCKS[path], encoding="utf-8")
        return
    file.write_text(file.read_text(encoding="utf-8") + BLOCKS[path], encoding="utf-8")


def python(place: Path, *arguments: str, exits: int = 0) -> str:
    done = subprocess.run([sys.executable, *arguments], cwd=place, capture_output=True, text=True, check=False)
    assert done.returncode == exits, done.stdout + done.stderr
    return done.stdout


def undertow(place: Path, *arguments: str) -> str:
    return python(place, "-m", "undertow", *arguments)


def small_log(place: Path, vehicle: str, *more: str) -> Path:
    log = place / "log.csv"
    undertow(place, "simulate", "--vehicle", vehicle, "--duration", "60", "--noise", "clean", *more, "--out", str(log))
    return log


def test_every_kind_of_addition_is_tried():
    assert sorted(BLOCKS) == [
        "exports/formats/to_octave_script.py",
        "measurements/formats/tables/json_lines.py",
        "physics/effects.toml",
        "physics/laws/audit/launch.py",
        "physics/vehicles/skiff.yaml",
        "reports/page/chapters/top_speed.py",
        "residuals/networks/gru.py",
    ]
    assert all(len(block.splitlines()) <= 25 for block in BLOCKS.values())


def test_an_effect_is_in_the_catalogue_simulated_and_found(place: Path):
    add(place, "physics/effects.toml")
    assert "yaw_drift_damping" in undertow(place, "add", "--help")
    log = small_log(place, "otter", "--effect", "yaw_drift_damping=-60")
    undertow(place, "add", "yaw_drift_damping", "--vehicle", "otter", str(log), "--out", "found.yaml")
    found = re.search(r"N_vr: (-\d+\.?\d*)", (place / "found.yaml").read_text("utf-8"))
    assert found
    assert float(found[1]) == pytest.approx(-60.0, rel=0.1)


def test_a_law_gives_a_verdict(place: Path):
    add(place, "physics/laws/audit/launch.py")
    told = json.loads(undertow(place, "check", "blueboat", "--json"))["laws"][-1]
    assert told["law"] == "no jump"
    assert told["verdict"] == "pass"
    assert 0.1 < told["worst"]["value"] < 9.81


def test_a_network_trains(place: Path):
    add(place, "residuals/networks/gru.py")
    log = small_log(place, "blueboat", "--effect", "surge_quadratic_damping=-12")
    options = ("--residual", "gru", "--option", "units=8", "--epochs", "1", "--device", "cpu", "--out", "net")
    undertow(place, "train", str(log), "--vehicle", "blueboat", *options)
    assert "gru" in (place / "net" / "model.yaml").read_text("utf-8")


def test_a_log_format_is_read(place: Path):
    add(place, "measurements/formats/tables/json_lines.py")
    rows = [{"t": 0.1 * k, "u": 1.0, "v": 0.0, "r": 0.01 * k, "psi": 0.0, "newton_port": 5.0} for k in range(300)]
    (place / "log.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows), "utf-8")
    code = "import undertow; print(*sorted(undertow.read_log('log.jsonl').channels))"
    assert python(place, "-c", code).split() == ["newton_port", "psi", "r", "u", "v"]


def test_a_chapter_stands_on_the_page(place: Path):
    add(place, "reports/page/chapters/top_speed.py")
    folder = write_sample(place / "run", seconds=60.0)
    undertow(place, "report", str(folder))
    page = (folder / "report.html").read_text("utf-8")
    assert page.index(">Top speed</h2>") < page.index(">How this was made</h2>")


def test_an_export_writes_its_file(place: Path):
    add(place, "exports/formats/to_octave_script.py")
    undertow(place, "export", "otter", "--to", "octave_script", "--out", "otter.m")
    lines = (place / "otter.m").read_text("utf-8").splitlines()
    assert lines[0] == "M = ["
    assert lines[4] == "D = ["
    assert float(lines[1].split()[0]) == pytest.approx(80.0 + 5.2815)


def test_a_vehicle_is_found_by_its_name(place: Path):
    add(place, "physics/vehicles/skiff.yaml")
    code = "import undertow; print(undertow.load_vehicle('skiff').value('X_u'))"
    assert float(python(place, "-c", code)) == -20.0


@pytest.mark.parametrize("document", ["README.md", *(f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md"))])
def test_what_a_document_names_exists(document: str):
    text = (ROOT / document).read_text(encoding="utf-8")
    ours = {path.name for path in ROOT.iterdir()}
    named = [path for path in re.findall(r"`([a-z_]+/[\w/]*(?:\.py|/))`", text) if path.split("/")[0] in ours]
    assert [path for path in named if not (ROOT / path).exists()] == []
    for module, name in re.findall(r"`from (undertow[\w.]+) import (\w+)`", text):
        assert hasattr(import_module(module), name), f"{module} has no {name}"
