"""Ctrl-C, closed streams, odd terminals and kills end well: the fast slice of benchmarks/robustness.py."""

import importlib
import os
import shutil
import signal
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from places import ROOT
from verbs import done

from undertow.cli.console import open_streams

BENCHMARKS = ROOT / "benchmarks"
LONG = ("simulate", "-v", "blueboat", "--duration", "80000", "--out", "log.csv")
"""A call that takes a minute, and writes at its end."""
_EVEN_SO = ("--set", "decline=0")
"""Trains beside the very boat that was simulated, where nothing is left to learn."""
LINUX = pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="processes are watched through /proc")


@pytest.fixture(scope="module")
def attacks() -> Iterator[Any]:
    """The benchmark's modules by name."""
    names = ("running", "trial", "signals", "kills", "resumes", "killing")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCHMARKS))
        yield SimpleNamespace(**{name: importlib.import_module(f"attacks.{name}") for name in names})


@pytest.fixture(scope="module")
def script() -> Iterator[ModuleType]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCHMARKS))
        yield importlib.import_module("robustness")


@LINUX
@pytest.mark.parametrize(
    ("number", "code", "word"),
    [(signal.SIGINT, 130, b"interrupted"), (signal.SIGTERM, 143, b"terminated")],
)
@pytest.mark.parametrize("after", [0.0, 0.15, 2.0], ids=["at once", "while it loads", "in the work"])
def test_a_signal_ends_with_one_line(
    number: int, code: int, word: bytes, after: float, attacks: Any, tmp_path: Path
) -> None:
    end = attacks.running.undertow(*LONG, cwd=tmp_path, sent=[attacks.running.Sent(after, number)])
    assert (end.code, end.out) == (code, b"")
    assert end.err.strip().startswith(b"undertow: ")
    assert word in end.err
    assert len(end.err.split(b"\n")) == 3
    assert not list(tmp_path.iterdir())


@LINUX
def test_a_second_press_ends_it_too(attacks: Any, tmp_path: Path) -> None:
    sent = [attacks.running.Sent(after) for after in (1.0, 1.001, 1.002)]
    end = attacks.running.undertow(*LONG, cwd=tmp_path, sent=sent)
    assert (end.code, end.traceback) == (130, False)


def told_of(code: str) -> subprocess.CompletedProcess[str]:
    """A process that listens, and runs this code."""
    begin = "import os, signal, sys, time\nfrom undertow.cli import interruption\ninterruption.listen()\n"
    return subprocess.run(
        [sys.executable, "-c", begin + textwrap.dedent(code)], capture_output=True, text=True, check=False, timeout=50
    )


def test_an_interruption_that_a_finalizer_passes_over_is_raised_again() -> None:
    ran = told_of(
        """
        class Passing:
            def __del__(self):
                os.kill(os.getpid(), signal.SIGINT)
                time.sleep(0.01)
        try:
            with interruption.interruptible():
                passing = Passing()
                del passing
                time.sleep(20)
                print("it went on")
        except KeyboardInterrupt as error:
            print(interruption.exit_message(error))
        """
    )
    assert (ran.stdout, ran.stderr) == ("('interrupted', 130)\n", "")


def test_an_interruption_that_a_library_catches_ends_the_process() -> None:
    ran = told_of(
        """
        interruption._PATIENCE = 0.1
        with interruption.interruptible():
            try:
                os.kill(os.getpid(), signal.SIGTERM)
                time.sleep(1)
            except BaseException:
                pass
            time.sleep(20)
        """
    )
    assert (ran.returncode, ran.stderr) == (143, "\nundertow: terminated\n")


def test_what_ignores_a_signal_goes_on_ignoring_it() -> None:
    ran = subprocess.run(
        [
            sys.executable,
            "-c",
            "import os, signal\nfrom undertow.cli.interruption import listen\n"
            "signal.signal(signal.SIGHUP, signal.SIG_IGN)\nlisten()\nos.kill(os.getpid(), signal.SIGHUP)\nprint('on')",
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, "on\n", "")


@pytest.mark.parametrize(
    ("shell", "codes"),
    [
        ('"$@" >&-', {0}),
        ('"$@" 2>&-', {0}),
        ('"$@" <&- >&- 2>&-', {0}),
        ('"$@" 2>/dev/full', {0}),
        ('"$@" >/dev/full', {2}),
        ('"$@" 2>&1 | true; exit ${PIPESTATUS[0]}', {0, 1}),
    ],
)
def test_a_result_is_written_whoever_listens(shell: str, codes: set[int], attacks: Any, tmp_path: Path) -> None:
    words = ("simulate", "-v", "blueboat", "--duration", "20", "--out", "log.csv")
    start = ("bash", "-c", shell, "bash", *attacks.running.UNDERTOW)
    end = attacks.running.undertow(*words, cwd=tmp_path, start=start)
    assert end.code in codes
    assert not end.traceback
    assert [path.name for path in tmp_path.iterdir()] == ["log.csv"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_help_on_a_full_disk_is_a_clear_error(attacks: Any, tmp_path: Path) -> None:
    start = ("bash", "-c", '"$@" >/dev/full', "bash", *attacks.running.UNDERTOW)
    end = attacks.running.undertow("--help", cwd=tmp_path, start=start)
    assert (end.code, end.traceback) == (2, False)


@pytest.mark.parametrize("columns", ["0", "1", "-5", "x", "9" * 30, "9" * 5000])
def test_absurd_widths_are_not_believed(columns: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    open_streams()
    assert "COLUMNS" not in os.environ


def test_help_at_no_width_at_all(attacks: Any, tmp_path: Path) -> None:
    end = attacks.running.undertow("--help", cwd=tmp_path, env={"COLUMNS": "9" * 30})
    assert (end.code, end.traceback) == (0, False)


def test_a_working_folder_that_was_removed(attacks: Any, tmp_path: Path) -> None:
    place = tmp_path / "gone"
    place.mkdir()

    def leave() -> None:
        os.chdir(place)
        place.rmdir()

    end = attacks.running.undertow("check", "blueboat", cwd=tmp_path, before=leave)
    assert (end.code, end.traceback) == (2, False)
    assert end.err.startswith(b"undertow: the current folder cannot be used")


def test_twenty_columns_hold_every_word(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "20")
    narrow = done("check", "blueboat")
    monkeypatch.setenv("COLUMNS", "5")
    assert done("check", "blueboat") == narrow
    assert "breaks no" in " ".join(narrow.split())


@pytest.fixture(scope="module")
def killing(attacks: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A warm process that forks verbs, on a ground that has logs and a vehicle."""
    folder = tmp_path_factory.mktemp("ground")
    boat = ROOT / "physics" / "vehicles" / "blueboat.yaml"
    shutil.copy(boat, folder / "boat.yaml")
    done("simulate", "-v", "blueboat", "--duration", "40", "--out", folder / "a.csv")
    warm = ("train", "a.csv", "-v", "boat.yaml", "--epochs", "1", "--option", "units=4", *_EVEN_SO, "--out", "warm")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCHMARKS))
        forge = importlib.import_module("attacks.forge").Forge(folder, [warm])
    yield SimpleNamespace(folder=folder, forge=forge)
    forge.close()


def test_a_killed_training_goes_on_to_the_same_bytes(killing: Any, tmp_path: Path) -> None:
    words = ("train", "a.csv", "-v", "boat.yaml", "--epochs", "3", "--option", "units=4", *_EVEN_SO, "--out", "net")

    def run(folder: Path, *more: str, kill_at: int | None = None) -> int:
        killing.forge.prepare([(*words, *more)], folder, kill_at, "/checkpoint.safetensors")
        killing.forge.release()
        return killing.forge.collect()[0][0]

    def laid(name: str) -> Path:
        (tmp_path / name).mkdir()
        for each in ("a.csv", "boat.yaml"):
            shutil.copy(killing.folder / each, tmp_path / name / each)
        return tmp_path / name

    whole = laid("whole")
    assert run(whole) == 0
    # In the instant before the checkpoint of the first, the second and the third epoch has its name.
    for kill_at, kept in ((1, False), (2, True), (3, True)):
        folder = laid(f"killed at {kill_at}")
        assert run(folder, kill_at=kill_at) == -signal.SIGKILL
        assert (folder / "net" / "checkpoint.safetensors").exists() == kept
        assert run(folder, *["--resume"] * kept) == 0
        assert sorted(os.listdir(folder / "net")) == sorted(os.listdir(whole / "net"))
        for name in os.listdir(whole / "net"):
            assert (folder / "net" / name).read_bytes() == (whole / "net" / name).read_bytes()


def test_the_table_tells_of_every_fault(attacks: Any, script: ModuleType) -> None:
    running, trial = attacks.running, attacks.trial
    good = running.Ended(("check", "x"), 0, b"", b"", 0, 1.0, 100_000_000)
    loud = running.Ended(("check", "y"), 2, b"", b"Traceback (most recent call last):", 5000, 1.0, 2_000_000_000)
    hung = running.Ended(("check", "z"), -9, b"", b"", 0, 60.0, 1, hung=True)
    row = trial.Row(trial.Attack("bombs", "a bomb"))
    row.trials += [trial.Trial("1", (good,)), trial.Trial("2", (loud,), "notes.txt"), trial.Trial("3", (hung,))]
    assert str(row) == "| a bomb | 3 | 1 | 0 | 1 | 1 | 0 | 2000 | 5000 |"
    assert row.trials[1].faults == [
        "lost: notes.txt",
        "traceback: b'Traceback (most recent call last):'",
        "2000 MB",
        "5000 characters",
    ]
    page = script.page([row], [], 60.0, 0)
    assert "**2 of 3 tries failed.**" in page
    assert str(row) in page


def test_a_part_that_is_tried_again_takes_its_rows_in_the_table(
    attacks: Any, script: ModuleType, tmp_path: Path
) -> None:
    running, trial = attacks.running, attacks.trial
    ends = [running.Ended(("x",), code, b"", b"", 0, 1.0, 1_000_000) for code in (0, 1)]
    first, second, other = (trial.Row(trial.Attack("names", name)) for name in ("a | pipe", "a | pipe", "a bomb"))
    first.trials += [trial.Trial("1", (ends[0],), "lost.txt"), trial.Trial("2", (ends[0],))]
    other.trials += [trial.Trial("1", (ends[0],), "lost.txt")]
    table = tmp_path / "table.md"
    table.write_text(script.page([first, other], [], 60.0, 0), "utf-8")
    assert len(script.lines_of(table)) == 2
    second.trials += [trial.Trial("1", (ends[1],))]
    page = script.page([second], script.lines_of(table), 60.0, 0)
    assert str(second) in page
    assert str(first) not in page
    assert "**1 of 2 tries failed.**" in page
    assert "1 of its 2 rows were tried again" in page


@pytest.mark.parametrize(
    ("now", "verdict"),
    [
        ({"run": "folder", "run/a": "1", "run/b": "1", "mine": "m"}, ("", "", "")),
        ({"run": "folder", "run/a": "2", "run/b": "2", "mine": "m"}, ("", "", "")),
        ({"run": "folder", "run/a": "2", "run/b": "1", "mine": "m"}, ("", "run is neither", "")),
        ({"run": "folder", "run/a": "1", "mine": "m"}, ("", "run is neither", "")),
        ({"mine": "m"}, ("run", "", "")),
        ({"run": "folder", "run/a": "1", "run/b": "1"}, ("mine", "", "")),
        ({"run": "folder", "run/a": "1", "run/b": "1", "mine": "m", ".x": "?"}, ("", "", ".x")),
    ],
)
def test_old_or_new_and_nothing_else(now: dict[str, str], verdict: tuple[str, str, str], attacks: Any) -> None:
    before = {"run": "folder", "run/a": "1", "run/b": "1", "mine": "m"}
    after = {"run": "folder", "run/a": "2", "run/b": "2", "mine": "m"}
    found = attacks.trial.judged(now, before, after)
    assert (found.lost, found.torn[: len("run is neither")], found.left) == verdict
