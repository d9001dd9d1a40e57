"""Folders and patterns of logs are one data set, and what is no log in them is told."""

import shutil
from pathlib import Path

import pytest
from dataflash_files import dataflash_of, write
from round_trip import vehicle, world
from verbs import done, strict

from undertow.measurements.collection import find_logs
from undertow.physics.errors import LogError
from undertow.reports.inputs import read_inputs


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two logs of one boat in two formats, and a text beside them."""
    folder = tmp_path_factory.mktemp("trials")
    write(folder / "00000002.BIN", dataflash_of(world()))
    world().write(folder / "first.csv.gz")
    (folder / "README.md").write_text("# Sea trials\nNothing to see.\n")
    (folder / ".hidden").write_text("t,u\n0,1\n")
    return folder


def test_a_folder_is_its_logs_by_name_and_tells_the_rest(folder):
    paths, notes = find_logs([folder])
    assert paths == (str(folder / "00000002.BIN"), str(folder / "first.csv.gz"))
    assert notes == (f"{folder}: 2 logs; not logs, and not read: README.md",)


def test_a_pattern_is_what_it_meets(folder):
    assert find_logs([folder / "*.BIN"]) == ((str(folder / "00000002.BIN"),), ())
    assert find_logs([folder / "**" / "f*.gz"])[0] == (str(folder / "first.csv.gz"),)
    with pytest.raises(LogError, match="no file or bag meets this pattern"):
        find_logs([folder / "*.tlog"])


def test_a_file_whose_name_looks_like_a_pattern_is_that_file(folder, tmp_path):
    path = tmp_path / "run[1].bin"
    shutil.copy(folder / "00000002.BIN", path)
    assert find_logs([path]) == ((str(path),), ())


def test_a_missing_file_is_left_for_its_reader(tmp_path):
    assert find_logs([tmp_path / "no.bin"]) == ((str(tmp_path / "no.bin"),), ())


def test_a_folder_without_logs_is_refused(tmp_path):
    with pytest.raises(LogError, match="expected a folder of logs, got no file"):
        find_logs([tmp_path])
    (tmp_path / "notes.txt").write_text("wind 3 m/s\n")
    with pytest.raises(LogError, match=r"got 1 files, none of them a log: notes\.txt"):
        find_logs([tmp_path])


def test_a_folder_is_one_data_set_whose_logs_are_remembered_by_name(folder):
    inputs = read_inputs(folder, vehicle())
    assert len(inputs.logs) == 2
    assert inputs.paths == (str(folder / "00000002.BIN"), str(folder / "first.csv.gz"))
    assert any("README.md" in note for note in inputs.notes)


def test_the_verbs_take_folders_and_patterns(folder):
    compared = strict(done("compare", folder, "-v", "blueboat_paper", "--json"))
    assert [Path(name).name for name in compared["logs"]] == ["00000002.BIN", "first.csv.gz"]
    together = strict(done("inspect", folder, "--json"))
    assert [Path(log["path"]).name for log in together["logs"]] == ["00000002.BIN", "first.csv.gz"]
    assert "XKF1[1]:u" in done("inspect", folder / "*.BIN")
