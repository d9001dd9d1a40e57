"""The container file says what it can: its steps are read, and run in a folder, for no container can be built here."""

import json
import os
import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest
from bare_venv import BareVenv
from places import ROOT

STEPS = tuple(
    tuple(line.split(" ", 1))
    for line in (ROOT / "Containerfile").read_text("utf-8").splitlines()
    if line and not line.startswith("#")
)
"""Instructions with what follows them."""
LEFT_OUT = [line for line in (ROOT / ".dockerignore").read_text("utf-8").splitlines() if not line.startswith("#")]


def step(name: str) -> str:
    """What follows an instruction that stands once."""
    (found,) = [rest for instruction, rest in STEPS if instruction == name]
    return found


def test_the_steps_are_those_of_a_container() -> None:
    assert [name for name, _ in STEPS] == ["FROM", "ARG", "COPY", "RUN", "ENV", "WORKDIR", "ENTRYPOINT", "CMD"]
    python = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["requires-python"]
    assert step("FROM") == f"python:{python.removeprefix('>=')}-slim"
    assert [*json.loads(step("ENTRYPOINT")), *json.loads(step("CMD"))] == ["undertow", "demo"]


def test_what_stays_out_of_the_image_is_nothing_of_the_package() -> None:
    packages = {name.split(".")[1] for name in _packages() if "." in name}
    assert packages.isdisjoint(LEFT_OUT)
    for name in ("data", "pyproject.toml", "constraints.txt", "README.md", "LICENSE"):
        assert name not in LEFT_OUT


def _packages() -> list[str]:
    return tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["setuptools"]["packages"]


@pytest.mark.skipif(os.name == "nt", reason="a container has a POSIX shell")
def test_its_steps_make_the_demo_run(tmp_path: Path) -> None:
    source, destination = step("COPY").split()
    inside = {destination: str(tmp_path / "opt"), step("WORKDIR"): str(tmp_path / "work")}
    shutil.copytree(
        ROOT / source, inside[destination], ignore=shutil.ignore_patterns(*(n.split("/")[-1] for n in LEFT_OUT))
    )
    home, work = BareVenv(tmp_path / "image"), Path(inside[step("WORKDIR")])
    work.mkdir()
    words = re.sub(re.escape(destination), inside[destination], step("RUN"))
    # No index: the dependencies are there already, setuptools among them.
    pip = {"PIP_NO_DEPS": "1", "PIP_NO_INDEX": "1", "PIP_NO_BUILD_ISOLATION": "0"}
    path = f"{home.scripts}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["sh", "-ec", words], cwd=tmp_path, env={**os.environ, **pip, "PATH": path, "EXTRAS": ""},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert "surge quadratic damping" in home.run(*json.loads(step("ENTRYPOINT")), *json.loads(step("CMD")), cwd=work)
    assert (work / "undertow-demo" / "report.html").is_file()


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
def test_make_shell_has_the_command(tmp_path: Path) -> None:
    """In a folder whose venv is set up, without a file of make's newer than it."""
    shutil.copy(ROOT / "Makefile", tmp_path)
    (tmp_path / ".venv" / "bin").mkdir(parents=True)
    stamps = (".venv/undertow-venv", ".venv/undertow-runs")
    for name in ("pyproject.toml", "constraints.txt", *stamps, ".venv/bin/undertow"):
        (tmp_path / name).touch()
    (tmp_path / ".venv" / "bin" / "undertow").chmod(0o755)
    words, env = ["make", "--no-print-directory", "shell"], {**os.environ, "SHELL": "/bin/sh"}
    ran = subprocess.run(
        words, cwd=tmp_path, env=env, input="command -v undertow\nexit 3\n", capture_output=True, text=True, check=True
    )
    told = ran.stdout.splitlines()
    assert "'undertow' is a command here" in told[0]
    assert told[-1] == str(tmp_path / ".venv" / "bin" / "undertow")
