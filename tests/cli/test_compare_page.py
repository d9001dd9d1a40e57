"""`compare --page`: a folder that is written whole, never over a run, and that `report` reads again."""

import json
import re
from pathlib import Path

import pytest
from added_run import write_added
from sample_run import edit
from verbs import call, done, files, refused

from undertow.workflows.compare import compare
from undertow.workflows.inputs import read_inputs

NAMES = {"comparison.json", "report.html", "run.json", "series.csv"}


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log, a run of it, a second log, and the page of the run's model on it."""
    folder = tmp_path_factory.mktemp("place")
    write_added(folder, report=False)
    done("simulate", "-v", "blueboat", "--duration", "60", "--seed", "9", "--out", folder / "second.csv")
    done(*words(folder), "--page", folder / "page", "--out", folder / "comparison.json")
    return folder


def words(place: Path) -> tuple[str | Path, ...]:
    return ("compare", place / "second.csv", "-v", "blueboat", "--model", place / "run")


@pytest.fixture
def page(place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the page's folder, in an empty working folder."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "page"
    folder.mkdir()
    for path in (place / "page").iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    return folder


def test_the_folder_holds_a_page_and_what_it_is_made_of(place: Path):
    assert set(files(place / "page")) == NAMES
    content = json.loads((place / "page" / "comparison.json").read_text())
    assert content == json.loads((place / "comparison.json").read_text())
    assert content["split"] == "all"
    text = (place / "page" / "report.html").read_text()
    verdict = content["best"]["sentence"].partition(":")[0]
    assert f"<h1>{verdict}.</h1>" in text.replace("\n", "")
    assert "Judged on all rows of second.csv. Marked, because fitted to rows that are judged: calibrated." in text
    labels = re.findall(r'aria-label="([^"]+)"', text)
    wanted = (
        "prediction error and laws",
        "position error of each model",
        "speeds and the error of the position over time",
        "predicted track",
    )
    assert all(any(name in label for label in labels) for name in wanted)
    assert "after: the run model" in text
    assert len(text) < 1_500_000


def test_report_writes_the_page_again(page: Path):
    before = (page / "report.html").read_bytes()
    (page / "report.html").unlink()
    assert done("report", page).split() == [str(page / "report.html")]
    assert (page / "report.html").read_bytes() == before


def test_a_page_is_replaced_and_other_files_stay(place: Path, page: Path):
    (page / "notes.txt").write_text("mine")
    compare(read_inputs(place / "second.csv", "blueboat"), [place / "run"], page=page, progress=None)
    assert set(files(page)) == {*NAMES, "notes.txt"}


@pytest.mark.usefixtures("page")
def test_a_run_is_never_written_over(place: Path):
    before = files(place / "run")
    refused(*words(place), "--page", place / "run", "--force", match=r"--page .*run holds a run, which would be lost")
    assert files(place / "run") == before


@pytest.mark.parametrize("name", ["comparison.json", "series.csv"])
def test_what_is_missing_is_told_with_what_to_do(page: Path, name: str):
    (page / name).unlink()
    refused("report", page, match=f"has no {name}; run 'undertow compare LOG --vehicle V --page FOLDER'")


def test_a_comparison_without_models_is_refused(page: Path):
    edit(page / "comparison.json", lambda content: content.update(models=[]))
    refused("report", page, match=r"expected at least one entry in 'models', got none")


def test_a_comparison_is_no_run(place: Path, page: Path):
    told = r"page holds a comparison, not a run: expected it alone and without --model"
    refused("report", page, place / "run", match=told)
    refused("report", page, "--model", place / "run", match=told)
    assert call(*words(place), "--model", page).exit_code == 2


def test_a_change_of_the_users_is_not_lost(place: Path, page: Path):
    (page / "series.csv").write_text("mine")
    refused(
        *words(place), "--page", page, match=r"series\.csv, which undertow did not write, or which was changed since"
    )
