"""What a verb may write over: only what it wrote itself, never what it reads, and nothing before that is sure."""

import gzip
import json
import os
import shutil
import signal
import stat
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pandas as pd
import pytest
from sample_run import edit, write_sample
from verbs import call, done, files, refused

from undertow.comparison.facts import Comparison
from undertow.measurements.log import read_log
from undertow.physics.errors import RequestError
from undertow.physics.files import at_end, in_stamps, on_top, strict_json, try_out, write_bytes, write_text, written_by
from undertow.physics.vehicle import load_vehicle
from undertow.workflows.run_folder.run_files import DATA, Kind, check_target, check_targets, own_run, seal

SIMULATE = "simulate -v blueboat --duration 20 --out"


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run as `discover` writes it, and the log that it was made from."""
    place = tmp_path_factory.mktemp("sample")
    run = write_sample(place / "mon", seconds=30.0)
    for name, schema in (("standardisation", "standardisation"), ("audit", "audit"), ("inspection", "inspections")):
        if not (run / f"{name}.json").is_file():
            (run / f"{name}.json").write_text(json.dumps({"schema": f"undertow.{schema}/1", "logs": [], "laws": []}))
    seal(run, {"schema": "undertow.run/1", "logs": ["log.csv"], "frame": None, "channel_map": None}, DATA)
    (run / "report.html").write_bytes(at_end("report", b"<!doctype html>"))
    done(*SIMULATE.split(), place / "log.csv")
    return place


@pytest.fixture
def here(sample: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a log, a run of it, a vehicle file, a map, a trained network, and other files."""
    shutil.copytree(sample, tmp_path, dirs_exist_ok=True)
    shutil.copy(sample / "mon" / "nominal.yaml", tmp_path / "boat.yaml")
    (tmp_path / "lstm").mkdir()
    (tmp_path / "lstm" / "model.yaml").write_text("schema: undertow.network/1\n")
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "map.yaml").write_text("u: 'odometry:u'\n")
    (tmp_path / "logs").mkdir()
    shutil.copy(tmp_path / "log.csv", tmp_path / "logs" / "a.csv")
    (tmp_path / "link.csv").symlink_to("log.csv")
    os.link(tmp_path / "log.csv", tmp_path / "hard.csv")
    monkeypatch.chdir(tmp_path)
    return tmp_path


# What is read is never written


@pytest.mark.parametrize(
    "command",
    [
        "inspect log.csv --map-out log.csv",
        "inspect log.csv --map-out ./logs/../log.csv",
        "inspect log.csv --map-out link.csv",
        "inspect link.csv --map-out log.csv",
        "inspect log.csv --map-out hard.csv",
        "inspect logs --map-out logs/a.csv",
        "inspect logs/*.csv --map-out logs/a.csv",
        "inspect log.csv -v boat.yaml --map-out boat.yaml",
        "inspect log.csv --map map.yaml --map-out map.yaml",
        "inspect log.csv --fix hard.csv",
        "compare log.csv -v boat.yaml --out log.csv",
        "compare log.csv -v boat.yaml --series boat.yaml",
        "compare log.csv -v blueboat --model boat.yaml --out boat.yaml",
        "compare log.csv -v blueboat --model mon --out mon/comparison.json",
        "check boat.yaml --out boat.yaml",
        "check mon --out log.csv",
        "fit log.csv -v boat.yaml --out boat.yaml",
        "fit log.csv -v boat.yaml --out log.csv",
        "add munk_moment --run mon --out log.csv",
        "add munk_moment --run mon --out mon/nominal.yaml",
        "add munk_moment -v boat.yaml log.csv --out boat.yaml",
        "simulate -v boat.yaml --out boat.yaml",
    ],
)
def test_what_is_read_is_never_written_be_it_forced(command: str, here: Path):
    refused(*command.split(), match="is read by this call; give another name, so that it is not lost")
    refused(*command.split(), "--force", match="is read by this call")


@pytest.mark.parametrize(
    "command",
    [
        "discover logs/a.csv -v blueboat --out logs",
        "discover logs -v blueboat --out .",
        "discover log.csv -v mon/nominal.yaml --out mon",
        "discover log.csv -v blueboat --map map.yaml --out .",
        "discover link.csv -v blueboat --out ../{name}",
        "train logs/a.csv -v blueboat --out logs",
    ],
)
def test_a_folder_of_what_is_read_is_never_replaced(command: str, here: Path):
    words = command.replace("{name}", here.name).split()
    refused(*words, match="which is read; give another folder")
    refused(*words, "--force", match="which is read; give another folder")


def test_two_files_of_one_call_are_two(here: Path):
    for command in (
        "inspect log.csv --map-out new.csv --fix ./new.csv",
        "compare log.csv -v blueboat --out x --series x",
        "compare log.csv -v blueboat --out x --series x --force",
    ):
        refused(*command.split(), match="is the file of (--map-out|--out), too; give each a name of its own")


# What others wrote is not written over


@pytest.mark.parametrize(
    "command",
    [
        f"{SIMULATE} notes.txt",
        f"{SIMULATE} logs/foreign.csv",
        "inspect log.csv --map-out notes.txt",
        "inspect log.csv --map-out boat.yaml",
        "inspect log.csv --map-out map.yaml",
        "inspect logs/a.csv --fix log.csv",
        "compare log.csv -v blueboat --out boat.yaml",
        "compare log.csv -v blueboat --out audit.json",
        "compare log.csv -v blueboat --series boat.yaml",
        "check blueboat --out notes.txt",
        "check blueboat --out comparison.json",
        "fit log.csv -v blueboat --out boat.yaml",
        "fit log.csv -v blueboat --out notes.txt",
        "fit log.csv -v blueboat --out added.yaml",
        "add munk_moment --run mon --out boat.yaml",
        "report mon --out page.html",
    ],
)
def test_what_the_verb_did_not_write_is_not_lost(command: str, here: Path):
    Path("audit.json").write_text('{"schema": "undertow.audit/1"}')
    Path("comparison.json").write_text('{"schema": "undertow.comparison/1"}')
    Path("logs/foreign.csv").write_text("time,topic,field,value\n" + "0.000000,odometry,x,1\n" * 30)
    Path("page.html").write_text("<title>undertow: my own notes</title>")
    load_vehicle("boat.yaml").save("added.yaml", by="add")
    said = refused(*command.split(), match=r"is there, and 'undertow .*' did not write it.*another name, or --force")
    assert len(said) < 250


@pytest.mark.parametrize(
    ("command", "where"),
    [
        ("compare log.csv -v blueboat --out mon/model.yaml", "run folder mon"),
        ("check blueboat --out mon/audit.json", "run folder mon"),
        ("fit log.csv -v blueboat --out mon/model.yaml", "run folder mon"),
        ("fit log.csv -v blueboat --out lstm/weights.safetensors", "network lstm"),
        ("simulate -v blueboat --out mon/series.csv", "run folder mon"),
        ("simulate -v blueboat --out lstm/model.yaml", "network lstm"),
        ("inspect log.csv --map-out mon/report.pdf", "run folder mon"),
    ],
)
def test_a_file_of_a_run_or_a_network_is_not_written_alone(command: str, where: str, here: Path):
    refused(*command.split(), match=f"is in the {where}, whose files belong together; give another name")


@pytest.mark.parametrize(
    "command",
    [
        f"{SIMULATE} FILE.csv",
        f"{SIMULATE} FILE.csv.gz",
        f"{SIMULATE} FILE.parquet",
        "inspect log.csv --map-out FILE.yaml",
        "inspect log.csv --fix FILE.csv.gz",
        "check blueboat --out FILE.json",
    ],
)
def test_what_the_verb_wrote_is_replaced_until_somebody_changes_it(command: str, here: Path):
    words = command.replace("FILE", "file").split()
    path = Path(words[-1])
    assert "replaced" not in call(*words).stderr
    first = path.read_bytes()
    again = call(*words)
    assert again.exit_code == 0, again.stderr
    assert f"  replaced the earlier {path}\n" in again.stderr
    assert path.read_bytes() == first
    middle = len(first) // 2
    path.write_bytes(first[:middle] + bytes([first[middle] ^ 1]) + first[middle + 1 :])
    if path.suffix == ".json":  # JSON shows by its schema whose it is
        assert call(*words).exit_code == 0
    else:
        refused(*words, match="did not write it, or it was changed since")
        assert call(*words, "--force").exit_code == 0
        assert path.read_bytes() == first


def test_a_vehicle_that_fit_wrote_is_replaced_by_fit_alone(here: Path):
    load_vehicle("boat.yaml").save("fitted.yaml", by="fit")
    assert load_vehicle("fitted.yaml") == load_vehicle("boat.yaml")
    assert Kind.FITTED.wrote(Path("fitted.yaml"))
    assert not Kind.ADDED.wrote(Path("fitted.yaml"))
    assert not Kind.FITTED.wrote(Path("boat.yaml"))
    text = Path("fitted.yaml").read_text()
    Path("fitted.yaml").write_text(text.replace("mass:", "mass:  ", 1))
    assert not Kind.FITTED.wrote(Path("fitted.yaml"))


def test_an_empty_file_loses_nothing_and_a_protected_one_stays(here: Path):
    Path("new").touch()
    assert check_targets([("--out", Kind.FITTED, Path("new"))]) == []
    done(*SIMULATE.split(), "kept.csv")
    Path("kept.csv").chmod(0o444)
    refused(*SIMULATE.split(), "kept.csv", match="is there and write-protected")


def test_force_takes_the_place_of_what_others_wrote(here: Path):
    Path("theirs.csv").write_text("mine")
    done(*SIMULATE.split(), "theirs.csv", "--force")
    assert Path("theirs.csv").read_text().startswith("time,topic,field,value\n")


# Marks


@pytest.mark.parametrize("change", [lambda data: data + b"x", lambda data: data[:-2], lambda data: b" " + data])
def test_a_mark_is_true_for_what_it_was_made_of(change: Callable[[bytes], bytes], tmp_path: Path):
    text = "u: {from: a}\n# \N{DEGREE SIGN}\n"
    rows = "".join(f"{k / 20:.6f},odometry,u,{k}\n" for k in range(40))
    for verb, data in (
        ("inspect --map-out", on_top("inspect --map-out", text).encode()),
        ("report", at_end("report", b"<html>no newline</html>")),
        ("report --pdf", at_end("report --pdf", b"%PDF-1.4\n\0\xff\n%%EOF", b"% ", b"")),
        ("simulate", in_stamps("time,topic,field,value\n" + rows).encode()),
        ("simulate", gzip.compress(in_stamps("time,topic,field,value\n" + rows).encode(), mtime=0)),
    ):
        path = write_bytes(tmp_path / "file", data)
        assert written_by(path) == verb
        assert written_by(write_bytes(path, change(data))) is None


def test_a_mark_breaks_no_reader(here: Path):
    pd.testing.assert_index_equal(pd.read_csv("log.csv").columns, pd.Index(["time", "topic", "field", "value"]))
    done("inspect", "log.csv", "--fix", "fixed.csv")
    log = read_log(Path("fixed.csv"))
    assert log.channels.keys() == read_log(Path("log.csv")).channels.keys()
    assert not any("written by undertow" in note for note in log.notes)
    assert any("repaired by undertow" in note for note in log.notes)
    done("inspect", "log.csv", "--map-out", "own.yaml")
    assert "defect" not in done("inspect", "log.csv", "--map", "own.yaml").splitlines()[0]


@pytest.mark.parametrize(
    "data", [b"", b"\x1f\x8b", b"\x1f\x8b\x08\0broken", b"PAR1", b"PAR1" + b"\xff" * 20, b"\0" * 999]
)
def test_what_is_broken_was_written_by_nobody(data: bytes, tmp_path: Path):
    assert written_by(write_bytes(tmp_path / "file", data)) is None
    assert written_by(tmp_path / "none") is None
    assert written_by(tmp_path) is None


# Run folders


def test_files_that_bear_the_names_of_a_run_are_no_run(here: Path):
    folder = Path("theirs")
    folder.mkdir()
    for name, text in (("findings.json", "{}"), ("model.yaml", "my own"), ("report.html", "my own page")):
        (folder / name).write_text(text)
    refused("discover", "log.csv", "-v", "blueboat", "--out", folder, match="holds other files .*--force")
    refused("demo", "--out", folder, match="the folder holds other files")
    (folder / "run.json").write_text('{"schema": "undertow.run/1", "files": {}}')
    refused("discover", "log.csv", "-v", "blueboat", "--out", folder, match="--force")


@pytest.mark.parametrize("name", ["model.yaml", "findings.json", "series.csv", "report.html", "run.json"])
def test_a_file_of_a_run_that_somebody_changed_is_not_lost(name: str, here: Path):
    check_target("mon")
    assert own_run(Path("mon")) == {path.name for path in Path("mon").iterdir()}
    text = Path("mon", name).read_text()
    changed = text.replace('"logs"', '"Logs"', 1) if name == "run.json" else text.replace("1", "2", 1) + " "
    Path("mon", name).write_text(changed)
    refused(
        "discover", "logs/a.csv", "-v", "blueboat", "--out", "mon", match=f"holds {name}, which undertow did not write"
    )
    check_target("mon", force=True)


def test_other_files_in_a_run_are_no_hindrance(here: Path):
    Path("mon/notes.txt").write_text("mine")
    Path("mon/again").mkdir()
    before = files(here)
    check_target("mon")
    assert files(here) == before


def test_a_page_with_remarks_of_the_user_is_not_made_again(here: Path):
    edited = Path("mon/report.html").read_text() + "<p>my remarks</p>"
    Path("mon/report.html").write_text(edited)
    refused("report", "mon", match="holds report.html, which undertow did not write, or which was changed since")
    done("report", "mon", "--force")
    assert written_by("mon/report.html") == "report"
    assert own_run(Path("mon")) == {path.name for path in Path("mon").iterdir()}


def test_a_run_compared_anew_is_replaced_whole_and_still_a_run(here: Path, monkeypatch: pytest.MonkeyPatch):
    compared = json.loads(Path("mon/comparison.json").read_text()) | {"notes": ["compared anew"]}
    record = Comparison.read(compared, "comparison.json", "")
    monkeypatch.setattr("undertow.workflows.compare.compare_run", lambda *given, **more: record)
    Path("mon/notes.txt").write_text("mine")
    nominal, compared_before = Path("mon/nominal.yaml").read_bytes(), Path("mon/comparison.json").stat().st_ino
    done("report", "mon", "--model", "blueboat")
    assert json.loads(Path("mon/comparison.json").read_text()) == json.loads(strict_json(record.to_dict()))
    assert Path("mon/comparison.json").stat().st_ino != compared_before
    assert Path("mon/nominal.yaml").read_bytes() == nominal
    assert own_run(Path("mon")) == {path.name for path in Path("mon").iterdir()} - {"notes.txt"}
    assert Path("mon/notes.txt").read_text() == "mine"
    Path("mon/model.yaml").write_text(Path("mon/model.yaml").read_text() + "# tuned\n")
    done("report", "mon", "--model", "blueboat")  # a vehicle that was changed does not become undertow's by that
    assert "model.yaml" not in own_run(Path("mon"))
    edit(Path("mon/comparison.json"), lambda content: content.update(notes=["my own"]))
    refused("report", "mon", "--model", "blueboat", match="holds comparison.json, which undertow did not write")


# Targets are tried first


@pytest.fixture
def unread(monkeypatch: pytest.MonkeyPatch) -> None:
    """No log may be read."""

    def fail(*_: Any, **__: Any) -> NoReturn:
        raise AssertionError("a log was read before the target was tried")

    monkeypatch.setattr("undertow.workflows.inputs.read_log", fail)
    monkeypatch.setattr("undertow.workflows.inspect_and_init.read_log", fail)
    monkeypatch.setattr("undertow.physics.worlds.world.simulate_world", fail)
    monkeypatch.setattr("undertow.workflows.check_and_explain.check", fail)


EVERY_TARGET = [
    "inspect log.csv --map-out TARGET",
    "inspect log.csv --fix TARGET.csv",
    "compare log.csv -v blueboat --out TARGET",
    "compare log.csv -v blueboat --series TARGET",
    "check blueboat --out TARGET",
    "fit log.csv -v blueboat --out TARGET",
    "add munk_moment --run mon --out TARGET",
    "add munk_moment -v blueboat log.csv --out TARGET",
    "simulate -v blueboat --out TARGET",
    "report mon --out TARGET.html",
    "discover log.csv -v blueboat --out TARGET",
    "demo --out TARGET",
    "train log.csv -v blueboat --out TARGET",
]


@pytest.mark.parametrize("command", EVERY_TARGET)
@pytest.mark.usefixtures("unread")
def test_a_place_that_cannot_be_written_is_told_before_the_work(command: str, here: Path):
    refused(*command.replace("TARGET", "/proc/x").split(), match="cannot write /proc/x.*: No such file or directory")
    refused(*command.replace("TARGET", "none/x").split(), match="cannot write none/x.*none does not exist")


@pytest.mark.parametrize("command", EVERY_TARGET)
@pytest.mark.usefixtures("unread")
def test_a_full_disk_is_told_before_the_work(command: str, here: Path, monkeypatch: pytest.MonkeyPatch):
    real = os.fsync

    def full(handle: int) -> None:
        if os.fstat(handle).st_size >= 1 << 16:
            raise OSError(28, "No space left on device")
        real(handle)

    monkeypatch.setattr(os, "fsync", full)
    refused(*command.replace("TARGET", "new").split(), match="cannot write (new|into mon).*: No space left on device")


@pytest.mark.parametrize("command", [line for line in EVERY_TARGET if line.endswith(" TARGET")][:8])
@pytest.mark.usefixtures("unread")
def test_a_full_device_is_told_before_the_work(command: str, here: Path):
    refused(*command.replace("TARGET", "/dev/full").split(), match="cannot write /dev/full: No space left on device")


def test_pipes_and_circles_are_refused(here: Path):
    os.mkfifo("pipe")
    Path("circle").symlink_to("circle")
    refused(*SIMULATE.split(), "pipe", match="cannot write pipe: it is a pipe, a socket or a disk")
    refused(*SIMULATE.split(), "circle", match="cannot write circle: its links lead in a circle")
    refused(*SIMULATE.split(), "mon", match="cannot write mon: it is a folder")
    refused("discover", "log.csv", "-v", "blueboat", "--out", "notes.txt", match="notes.txt: it is a file")


def test_a_device_stays_one_and_a_link_too(here: Path):
    done(*SIMULATE.split(), "/dev/null")
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)
    Path("latest.csv").symlink_to("logs/new.csv")
    done(*SIMULATE.split(), "latest.csv")
    assert Path("latest.csv").is_symlink()
    assert np.isfinite(pd.read_csv("logs/new.csv")["value"]).all()
    Path("theirs.csv").symlink_to("notes.txt")
    refused(*SIMULATE.split(), "theirs.csv", match="theirs.csv is there, and 'undertow simulate' did not write it")


# Processes that end early


def verb(*words: str, **settings: Any) -> "subprocess.Popen[str]":
    return subprocess.Popen([sys.executable, "-m", "undertow", *words], stderr=subprocess.PIPE, text=True, **settings)


def test_a_full_output_is_one_message(here: Path):
    for command in (f"{SIMULATE} new.csv", "inspect log.csv --json"):
        with open("/dev/full", "w") as full, verb(*command.split(), stdout=full) as run:
            said = run.communicate()[1]
        assert run.returncode == 2
        assert said.splitlines()[-1] == "undertow: cannot write the output: No space left on device"
        assert "Traceback" not in said


def test_a_file_that_grows_too_large_leaves_the_earlier_one(tmp_path: Path):
    path = write_text(tmp_path / "log.csv", "earlier")
    child = os.fork()
    if child == 0:
        import resource

        resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 17, 1 << 17))
        try:
            try_out(path)
            write_bytes(path, bytes(1 << 18))
        except OSError as error:
            os._exit(7 if str(path) in str(error) else 1)
        os._exit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7
    assert files(tmp_path) == {"log.csv": b"earlier"}


@pytest.mark.parametrize("kind", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_what_a_process_left_beside_a_file_goes(kind: signal.Signals, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def stop(*_: Any) -> None:
        os.kill(os.getpid(), kind)

    path = write_text(tmp_path / "a.yaml", "earlier")
    child = os.fork()
    if child == 0:
        signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
        os.fsync = stop
        try:
            write_text(path, "half")
        except BaseException:
            os._exit(1)
        os._exit(0)
    os.waitpid(child, 0)
    assert path.read_text() == "earlier"
    assert len(os.listdir(tmp_path)) == (2 if kind is signal.SIGKILL else 1)
    write_text(path, "new")
    assert files(tmp_path) == {"a.yaml": b"new"}


def test_what_only_looks_left_over_stays(tmp_path: Path):
    for name in (".a.yaml.undertow-notes", ".b.yaml.undertow-0123abcd", ".a.yaml.swp"):
        (tmp_path / name).write_text("mine")
    write_text(tmp_path / "a.yaml", "new")
    assert sorted(os.listdir(tmp_path)) == [
        ".a.yaml.swp",
        ".a.yaml.undertow-notes",
        ".b.yaml.undertow-0123abcd",
        "a.yaml",
    ]


def test_an_end_that_is_asked_for_takes_what_is_unfinished_away(here: Path):
    with verb("simulate", "-v", "blueboat", "--duration", "3000", "--out", "long.csv", stdout=subprocess.PIPE) as run:
        run.send_signal(signal.SIGTERM) if run.poll() is None else None
        run.communicate()
    assert not [name for name in os.listdir() if "undertow-" in name]
    with pytest.raises(RequestError, match="did not write it"):
        check_targets([("--out", Kind.SIMULATED, Path("notes.txt"))])
