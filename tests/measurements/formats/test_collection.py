"""Folders and patterns of logs are one data set, and what is no log in them is told."""

import os
import shutil
from pathlib import Path

import pytest
from bags import recorded, write_mcap
from dataflash_files import dataflash_of, write
from round_trip import vehicle, world
from verbs import done, inspected, strict

from undertow.measurements.formats.registry import find_logs
from undertow.measurements.log import read_log
from undertow.physics.errors import LogError
from undertow.workflows.inputs import read_inputs


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
    assert inputs.paths == (str(folder / "00000002.BIN"), str(folder / "first.csv.gz"))
    assert any("README.md" in note for note in inputs.notes)


def test_the_verbs_take_folders_and_patterns(folder):
    compared = strict(done("compare", folder, "-v", "blueboat_paper", "--json"))
    assert [Path(name).name for name in compared["logs"]] == ["00000002.BIN", "first.csv.gz"]
    together = strict(inspected("inspect", folder, "--json"))
    assert [Path(log["path"]).name for log in together["logs"]] == ["00000002.BIN", "first.csv.gz"]
    assert "XKF1[1]:u" in inspected("inspect", folder / "*.BIN")


def test_a_folder_with_one_bag_file_among_others_is_a_folder_of_logs(folder, tmp_path):
    write_mcap(tmp_path / "c.mcap", recorded(world()))
    shutil.rmtree(tmp_path / "c")
    shutil.copy(folder / "00000002.BIN", tmp_path / "a.bin")
    shutil.copy(folder / "first.csv.gz", tmp_path / "b.csv.gz")
    assert names(tmp_path) == ["a.bin", "b.csv.gz", "c.mcap"]
    (tmp_path / "metadata.yaml").write_text("boat: otter\n")
    assert names(tmp_path) == ["a.bin", "b.csv.gz", "c.mcap"]


def test_numbered_dives_are_logs_and_splits_are_one_bag(tmp_path):
    for name in ("dive_1.mcap", "dive_2.mcap"):
        write_mcap(tmp_path / name, recorded(world())[:50])
        shutil.rmtree(tmp_path / name.removesuffix(".mcap"))
    assert names(tmp_path) == ["dive_1.mcap", "dive_2.mcap"]
    (tmp_path / "dive_1.mcap").rename(tmp_path / "dive_0.mcap")
    assert find_logs([tmp_path])[0] == (str(tmp_path),)
    shutil.copy(tmp_path / "dive_0.mcap", tmp_path / "dive.mcap")
    assert len(names(tmp_path)) == 3


def names(path):
    """Names of the logs in a folder."""
    return [Path(found).name for found in find_logs([path])[0]]


def test_pipes_and_broken_links_are_told_and_stop_nothing(folder, tmp_path):
    shutil.copy(folder / "first.csv.gz", tmp_path / "a.csv.gz")
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "gone.csv").symlink_to(tmp_path / "nowhere.csv")
    paths, notes = find_logs([tmp_path])
    assert paths == (str(tmp_path / "a.csv.gz"),)
    assert notes == (f"{tmp_path}: 1 logs; not logs, and not read: gone.csv, pipe.csv",)
    with pytest.raises(LogError, match="got a pipe or a device"):
        read_log(tmp_path / "pipe.csv")
    assert find_logs([tmp_path / "*.csv*"])[0] == paths


def test_folders_that_cannot_be_looked_into_are_told(folder, tmp_path, monkeypatch):
    shutil.copy(folder / "first.csv.gz", tmp_path / "a.csv.gz")
    closed = tmp_path / "closed"
    closed.mkdir()
    look, access = Path.iterdir, os.access

    def refused(path):
        if path == closed:
            raise PermissionError(13, "Permission denied")
        return look(path)

    # Permissions do not bind the superuser, as whom tests may run.
    monkeypatch.setattr(Path, "iterdir", refused)
    monkeypatch.setattr(os, "access", lambda path, how: path != closed and access(path, how))
    paths, notes = find_logs([tmp_path])
    assert (paths, notes[0].endswith("not read: closed")) == ((str(tmp_path / "a.csv.gz"),), True)
    with pytest.raises(LogError, match=r"closed: it cannot be opened \(Permission denied\)"):
        find_logs([closed])


def test_a_deep_pattern_follows_no_links(folder, tmp_path, monkeypatch):
    inner = tmp_path / "logs" / "day"
    inner.mkdir(parents=True)
    shutil.copy(folder / "first.csv.gz", inner / "a.csv.gz")
    for k in range(4):
        (inner / f"loop{k}").symlink_to(tmp_path / "logs")
    (tmp_path / "logs" / ".hidden").mkdir()
    shutil.copy(folder / "first.csv.gz", tmp_path / "logs" / ".hidden" / "b.csv.gz")
    assert find_logs([tmp_path / "logs" / "**" / "*.gz"])[0] == (str(inner / "a.csv.gz"),)
    assert find_logs([tmp_path / "logs" / "**"])[0] == (str(inner / "a.csv.gz"),)
    monkeypatch.chdir(tmp_path)
    assert find_logs(["**/*.gz"])[0] == ("logs/day/a.csv.gz",)
