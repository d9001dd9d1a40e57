"""Who lacks an extra is told the command that installs it where the package lies."""

import re
import sys
from pathlib import Path

import pytest
from places import ROOT
from sources import source_files

from undertow.physics.registry_members import how_to_install


def test_from_a_wheel_the_package_is_named(tmp_path: Path) -> None:
    assert how_to_install("neural", tmp_path) == "pip install 'undertow[neural]'"


def test_in_a_clone_the_clone_is_installed_with_its_versions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "pyproject.toml").touch()
    assert how_to_install("logs", tmp_path) == f"pip install -e '.[logs]' (in {tmp_path})"
    (tmp_path / "constraints.txt").touch()
    assert how_to_install("logs", tmp_path) == f"pip install -e '.[logs]' -c constraints.txt (in {tmp_path})"
    (tmp_path / ".venv" / "bin").mkdir(parents=True)
    (tmp_path / ".venv" / "bin" / "pip").touch()
    monkeypatch.setattr(sys, "prefix", str(tmp_path / ".venv"))
    assert how_to_install("logs", tmp_path).startswith(".venv/bin/pip install -e '.[logs]' -c constraints.txt")


def test_here_is_a_clone() -> None:
    assert "-e '.[logs]' -c constraints.txt" in how_to_install("logs")


def test_no_other_file_says_how_to_install_an_extra() -> None:
    saying = {str(p) for p in source_files() if re.search(r"undertow\[\w+\]'", (ROOT / p).read_text("utf-8"))}
    assert saying == {"physics/registry_members.py"}
