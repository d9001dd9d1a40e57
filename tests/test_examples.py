"""Every example runs, and what the README shows is what the examples say today."""

import re
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from places import ROOT, shared

from undertow.measurements.preparation.prepare import WEAK, prepare
from undertow.physics.integration import simulate_motion
from undertow.physics.motion import Motion
from undertow.physics.vehicle import vehicle_from_dict

EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
PICTURES = ("falling_error", "fouling")
NUMBER = re.compile(r"-?\d+\.\d+")


def run(script: Path, folder: Path, *arguments: str, exits: int = 0) -> str:
    command = [sys.executable, "-W", "error", str(script), *arguments]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == exits, done.stdout + done.stderr
    return done.stdout


def blocks(document: str, language: str) -> list[str]:
    """The fenced blocks of a document that are marked with a language."""
    text = (ROOT / document).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)


def assert_says_the_same(shown: str, said: str, cure: str):
    """The same words, and numbers that differ by no more than another machine's rounding."""
    assert NUMBER.sub("#", shown) == NUMBER.sub("#", said), cure
    numbers = [[float(text) for text in NUMBER.findall(part)] for part in (shown, said)]
    assert numbers[0] == pytest.approx(numbers[1], rel=0.02, abs=0.011), cure


def labels(picture: Path) -> str:
    """The texts of a picture that matplotlib drew with glyphs as paths; it leaves each text in a comment."""
    return "\n".join(re.findall(r"<!-- (.*?) -->", picture.read_text(encoding="utf-8"))).replace("−", "-")


def test_the_readme_shows_the_quickstart_and_its_output(tmp_path: Path):
    script = ROOT / "examples" / "quickstart.py"
    assert blocks("README.md", "python")[0] == script.read_text(encoding="utf-8")
    said = run(script, tmp_path)
    assert (tmp_path / "blueboat-run" / "report.html").is_file()
    assert_says_the_same(blocks("README.md", "text")[0], said, "copy the output of examples/quickstart.py to README.md")


@pytest.mark.parametrize("name", PICTURES)
def test_the_picture_is_up_to_date(name: str, tmp_path: Path):
    run(ROOT / "examples" / f"{name}.py", tmp_path, "picture.svg")
    shown = labels(ROOT / "docs" / f"{name}.svg")
    assert_says_the_same(shown, labels(tmp_path / "picture.svg"), f"run python examples/{name}.py docs/{name}.svg")


@pytest.mark.parametrize(
    "script", [p for p in EXAMPLES if p.stem not in ("quickstart", *PICTURES)], ids=lambda path: path.stem
)
def test_the_example_runs(script: Path, tmp_path: Path):
    assert run(script, tmp_path).strip()


def write_blueboat_log(path: Path, start: dict[str, object], seed: int) -> None:
    """60 s of a simulated linear BlueBoat under random steps, in the columns and the wiring of the field logs."""
    rng = np.random.default_rng(seed)
    time = 0.1 * np.arange(600, dtype=float)
    pwm = 1510.0 + np.repeat(rng.uniform(-250.0, 300.0, size=(15, 2)), 40, axis=0)
    nothing = np.zeros((time.size, 2)), np.zeros(time.size), np.zeros((time.size, 3))
    motion = simulate_motion(vehicle_from_dict(start, "boat"), Motion(time, *nothing, pwm, ("port", "stbd")))
    velocity = motion.velocity + rng.standard_normal((time.size, 3)) * [0.01, 0.01, 0.004]
    commands = np.column_stack([pwm[:, 0], 3020.0 - pwm[:, 1]])
    table = np.column_stack([time, motion.position, motion.heading, velocity, commands])
    np.savetxt(path, table, fmt="%.6f", delimiter=",", header="t,x,y,psi,u,v,r,pwm_port,pwm_stbd", comments="")


def test_the_blueboat_example_tells_splits_findings_and_verdicts_and_exits_with_them(tmp_path: Path):
    script = ROOT / "examples" / "real_blueboat.py"
    start = runpy.run_path(str(script))["START"]
    for seed in range(3):
        write_blueboat_log(tmp_path / f"log_{seed:03}.csv", start, seed)
    said = run(script, tmp_path, str(tmp_path), "1", exits=1).splitlines()
    assert said[0].startswith("split 1, held out log_00")
    (found,) = (line.removeprefix("  found: ") for line in said if line.startswith("  found: "))
    fitted = {"surge_linear_damping", "yaw_linear_damping", "thrust_scale"}
    assert set(found.split(", ")) <= {"nothing", *fitted}, "what was fitted before may be off, and nothing else"
    of_all = {line.split(":")[0].strip() for line in said if re.match(r"  \w+: (missing|likely);", line)}
    assert of_all <= fitted
    verdicts = [line for line in said if line.startswith(("holds: ", "FAILS: "))]
    assert verdicts == said[-5:]
    failed = [line for line in verdicts if line.startswith("FAILS")]
    assert [line[:24] for line in failed] == ["FAILS: more likely than n"], "nothing is hidden"


def test_logs_of_a_real_boat_name_what_it_did_where_others_are_held_out():
    """The first split of the example: rules that one log may need must not take the names of several."""
    logs = shared("blueboat")
    example = runpy.run_path(str(ROOT / "examples" / "real_blueboat.py"))
    start = vehicle_from_dict(example["START"], "start")
    fitting = {log.name: prepare(log, start, WEAK).motions for log in example["read"](logs)}
    (held_out,) = example["divisions"](list(fitting), 1)
    known = [motions for name, motions in fitting.items() if name not in held_out]
    train = [m for motions in known for m in motions]
    named = example["found_names"](example["model"](train, start)[1])
    assert {"reverse_thrust_loss", "yaw_speed_damping"} <= named
    assert not named & example["UNWANTED"]


def test_the_blueboat_example_passes_only_when_every_limit_holds(capsys: pytest.CaptureFixture[str]):
    example = runpy.run_path(str(ROOT / "examples" / "real_blueboat.py"))
    conclude, wanted = example["conclude"], example["WANTED"]
    small, large = [np.full((4, 3), 0.01**2)], [np.full((4, 3), 0.15**2)]
    assert conclude(small, 0, wanted)
    assert "FAILS" not in capsys.readouterr().out
    for squares, diverged, missing in (
        (large, 0, wanted),
        (small, 1, wanted),
        (small, 0, set()),
        (small, 0, wanted | {"steady_current"}),
    ):
        assert not conclude(squares, diverged, missing)
        assert capsys.readouterr().out.count("FAILS") == 1


def test_prose_on_networks_is_wrapped_and_keeps_code_on_one_line():
    text = re.sub(r"```.*?```", "", (ROOT / "docs" / "neural.md").read_text(encoding="utf-8"), flags=re.DOTALL)
    prose = [line for line in text.splitlines() if not line.startswith(("|", "    "))]
    assert max(map(len, prose)) <= 120
    assert [line for line in prose if line.count("`") % 2] == []
