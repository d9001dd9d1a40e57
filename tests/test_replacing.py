"""What a verb may write over: a file of its own kind, and nothing that a run or a network consists of."""

import shutil
from pathlib import Path

import pytest
from sample_run import write_sample
from verbs import call, refused

from undertow.physics.errors import RequestError
from undertow.reports.replacing import check_replaced


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_sample(tmp_path_factory.mktemp("sample") / "mon", seconds=30.0)


@pytest.fixture
def here(sample: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a run, a vehicle file and a trained network."""
    shutil.copytree(sample, tmp_path / "mon")
    shutil.copy(sample / "nominal.yaml", tmp_path / "boat.yaml")
    (tmp_path / "lstm").mkdir()
    (tmp_path / "lstm" / "model.yaml").write_text("schema: undertow.network/1\n")
    (tmp_path / "notes.txt").write_text("mine")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("command", "why"),
    [
        ("compare log.csv -v blueboat --out mon/model.yaml", "mon/model.yaml is there and is no comparison.json"),
        ("compare log.csv -v blueboat --out mon/findings.json", "is no comparison.json"),
        ("compare log.csv -v blueboat --series boat.yaml", "is no MCAP file"),
        ("check blueboat --out mon/model.yaml", "is no audit.json"),
        ("check blueboat --out mon/comparison.json", "is no audit.json"),
        ("fit log.csv -v blueboat --out mon/model.yaml", "is in the run folder mon"),
        ("fit log.csv -v blueboat --out lstm/model.yaml", "is no vehicle file"),
        ("fit log.csv -v blueboat --out notes.txt", "is no vehicle file"),
        ("add munk_moment --run mon --out mon/nominal.yaml", "is in the run folder mon"),
        ("simulate -v blueboat --out mon/series.csv", "is in the run folder mon"),
        ("simulate -v blueboat --out lstm/model.yaml", "is no file of its own"),
        ("inspect log.csv --map-out mon/model.yaml", "is in the run folder mon"),
    ],
)
def test_no_verb_destroys_what_is_of_another_kind(command: str, why: str, here: Path):
    refused(*command.split(), match=why)


def test_a_file_of_the_same_kind_is_replaced(here: Path):
    assert call("check", "blueboat", "--out", "audit.json").exit_code == 0
    assert "replaced the earlier audit.json" in call("check", "blueboat", "--out", "audit.json").stderr
    for name, kind in (("mon/comparison.json", "comparison"), ("boat.yaml", "vehicle"), ("notes.txt", "other")):
        check_replaced(here / name, kind)


def test_an_empty_file_loses_nothing(here: Path):
    (here / "new").touch()
    check_replaced(here / "new", "vehicle")
    (here / "new").write_text("a")
    with pytest.raises(RequestError, match="new is there and is no vehicle file"):
        check_replaced(here / "new", "vehicle")
