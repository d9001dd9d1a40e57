"""Findings that an earlier version wrote: they open everywhere, and nobody claims to know how sure they are."""

import io
import json
import shutil
from pathlib import Path

import pytest
from rich.console import Console
from sample_run import as_first_version, write_sample

from undertow.physics.presentation import NARROW
from undertow.reports.page.page import fleet_page, page
from undertow.reports.run_contents import RunFolder
from undertow.reports.sureness import SURE, UNCALIBRATED, odds
from undertow.reports.terminal.findings_screen import candidates_table, missing_in_words, opening_lines
from undertow.workflows.report import report
from undertow.workflows.run_folder.read import read_run


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A run of an earlier version, and one of today."""
    home = tmp_path_factory.mktemp("versions")
    new = write_sample(home / "new", seconds=30.0)
    return as_first_version(Path(shutil.copytree(new, home / "old"))), new


@pytest.fixture(scope="module")
def old(folders: tuple[Path, Path]) -> RunFolder:
    return read_run(folders[0])


def screen(run: RunFolder) -> str:
    stream = io.StringIO()
    console = Console(file=stream, width=120)
    for part in (
        *opening_lines(run.findings, run.comparison, run.nominal),
        candidates_table(run.findings.candidates, run.nominal),
        missing_in_words(run.findings, run.nominal),
    ):
        console.print(part or "")
    return " ".join(stream.getvalue().replace(NARROW, " ").split())


def test_the_terminal_has_its_names_and_values_and_no_odds(old: RunFolder):
    text = screen(old)
    assert "surge quadratic damping missing X_uu = -7.80 N s²/m² (-8.11 to -7.49)" in text
    assert f"sure: {UNCALIBRATED}" in text
    assert "> 99 %" not in text
    assert all(odds(item) == "" for item in old.findings.candidates)


def test_the_page_has_them_too(old: RunFolder):
    text = page(old).replace(NARROW, " ")
    assert "What is missing</h2>" in text
    assert UNCALIBRATED in text
    assert SURE not in text
    assert '<span class="tag missing">The model is missing this</span>' in text
    assert "99.9 %" not in text


def test_runs_of_both_versions_stand_side_by_side(folders: tuple[Path, Path]):
    text = fleet_page([read_run(folder) for folder in folders], folders[0].parent).replace(NARROW, " ")
    assert "Both runs lack surge quadratic damping, thruster asymmetry (stbd) and yaw quadratic damping, and " in text
    assert "and probably sway quadratic damping." in text
    assert "likely (87 %)" in text
    assert "probably sway quadratic damping (87 %)" in text


def test_the_report_of_two_runs_is_written_and_leaves_the_findings_as_they_are(
    folders: tuple[Path, Path], tmp_path: Path
):
    before = [(folder / "findings.json").read_bytes() for folder in folders]
    assert json.loads(before[0])["schema"] == "undertow.findings/1"
    report(list(folders), out=tmp_path / "fleet.html", progress=None)
    assert (folders[0] / "report.html").read_text().count("What is missing</h2>") == 2  # on paper as well
    assert "Both runs lack" in (tmp_path / "fleet.html").read_text()
    assert [(folder / "findings.json").read_bytes() for folder in folders] == before
