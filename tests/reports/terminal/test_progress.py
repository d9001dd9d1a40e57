"""Progress of work: a bar on a terminal that goes when the work ends, lines elsewhere, nothing for who wants none."""

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest

import undertow
from undertow.physics.stage import COMPARING, SCORING, SEARCHING, WEIGHING, WRITING, Say, Stage
from undertow.reports.terminal import progress as module
from undertow.reports.terminal.progress import SHOWN, Pace, Progress, showing

Clock = list[float]


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """The time, as its only entry."""
    now = [100.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    return now


@pytest.fixture
def screen(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[[], list[str]]:
    """A terminal of 80 columns without colours; what was drawn on its last line since it was asked."""
    monkeypatch.setattr(module, "on_terminal", lambda: True)
    for name, value in (("NO_COLOR", "1"), ("COLUMNS", "80")):
        monkeypatch.setenv(name, value)
    return lambda: capsys.readouterr().err.split("\r\x1b[K")


def test_a_terminal_sees_a_bar_that_goes_when_the_work_ends(clock: Clock, screen: Callable[[], list[str]]) -> None:
    told = Progress()
    clock[0] += 3.0
    told(Stage("searching the catalogue of effects", SEARCHING))
    assert screen() == ["", "  ━━━━━━────────────── 3 s, about 7 s left  searching the catalogue of effects"]
    clock[0] += 1.0
    told(Stage("+ sway_lift"))
    told("the log says little")
    told.close()
    drawn = screen()
    assert drawn[1] == "  ━━━━━━━━──────────── 4 s, about 6 s left  searching the catalogue of effec..."
    assert drawn[2] == "  the log says little [4 s]\n"
    assert drawn[-1] == ""
    assert all(len(line) < 80 for line in drawn)


def test_a_bar_waits_at_the_mark_of_the_next_stage(clock: Clock, screen: Callable[[], list[str]]) -> None:
    told = Progress()
    clock[0] += 3.0
    told(Stage("searching", SEARCHING))
    clock[0] += 57.0
    told(Stage("+ sway_lift"))
    assert screen()[-1].startswith("  ━━━━━━━━━━━━──────── 60 s, about 40 s left")
    told(Stage("weighing", WEIGHING))
    assert screen()[-1] == "  ━━━━━━━━━━━━──────── 60 s, about 40 s left  weighing"


def test_counted_parts_are_told_beside_the_stage_that_holds_them(clock: Clock, screen: Callable[[], list[str]]) -> None:
    told = Progress()
    pace = Pace(told, "models judged")
    pace.told(0, 4)
    clock[0] += 5.0
    pace.told(1, 4)
    assert screen()[-1] == "  5 s, about 15 s left  models judged: 1 of 4"
    told(Stage("writing the run folder", 0.5))
    clock[0] += 1.0
    pace.told(2, 4)
    assert screen()[-1] == "  ━━━━━━━━━━━━──────── 6 s, about 4 s left  writing the run folder: models j..."


def test_a_bar_never_runs_backwards(clock: Clock, screen: Callable[[], list[str]]) -> None:
    """A log is read and checked, and a discovery searches twice and scores twice."""
    told = Progress()
    for step in ("reading", "checks of the log"):
        pace = Pace(told, step)
        for done in range(5):
            clock[0] += 0.5
            pace.told(done, 4)
    for behind in (SEARCHING, WEIGHING, SCORING, SEARCHING, WEIGHING, SCORING, COMPARING, SCORING, COMPARING, WRITING):
        told(Stage("at work", behind))
        for _ in range(8):
            clock[0] += 0.5
            told(Stage("a detail"))
    cells = [line.count("━") for line in screen()[1:]]
    assert cells == sorted(cells)
    assert cells[0] == 0
    assert cells[-1] == 20


def test_the_time_left_of_a_second_search_is_that_of_the_first(clock: Clock, screen: Callable[[], list[str]]) -> None:
    told = Progress()
    for behind, seconds in ((SEARCHING, 3.0), (SCORING, 4.5), (SEARCHING, 0.0)):
        clock[0] += seconds
        told(Stage("at work", behind))
    assert [line.split("  ")[-2].split(", ")[-1] for line in screen()[1:]] == [
        "about 7 s left",
        "about 2 s left",
        "about 7 s left",
    ]


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="this system has no timer")
def test_the_clock_of_a_bar_goes_on_and_its_timer_goes_with_it(screen: Callable[[], list[str]]) -> None:
    told = Progress(ticks=True)
    told(Stage("at work"))
    until = time.monotonic() + 1.4
    while time.monotonic() < until:
        time.sleep(0.05)
    drawn = screen()
    assert drawn[1] == "  0 s  at work"
    assert drawn[-1] == "  1 s  at work"
    told.close()
    assert signal.getsignal(signal.SIGALRM) == signal.SIG_DFL
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
def test_a_forked_process_leaves_the_bar_to_its_parent(
    screen: Callable[[], list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    told = Progress()
    told(Stage("at work"))
    screen()
    monkeypatch.setattr(module.os, "getpid", lambda: -1)
    told(Stage("beside it"))
    assert screen() == [""]


def test_a_dumb_terminal_and_a_file_get_lines(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    monkeypatch.setenv("TERM", "dumb")
    told = Progress()
    told(Stage("searching", SEARCHING))
    told.close()
    assert capsys.readouterr().err == "  searching\n"
    told = Progress(quiet=True)
    told(Stage("searching", SEARCHING))
    Pace(told, "rows").told(1, 2)
    told.close()
    assert capsys.readouterr().err == ""


def test_a_function_shows_its_progress_unless_it_is_told_otherwise(capsys: pytest.CaptureFixture[str]) -> None:
    @showing
    def work(*, progress: Say | None = SHOWN) -> None:
        if progress is not None:
            progress("at work")

    work()
    assert capsys.readouterr().err == "  at work\n"
    said: list[str] = []
    work(progress=said.append)
    work(progress=None)
    assert (said, capsys.readouterr().err) == (["at work"], "")


def test_a_calibration_in_python_shows_its_stages(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    boat = undertow.load_vehicle("blueboat")
    undertow.simulate_world(boat, {"surge_quadratic_damping": -10.0}, duration=40.0, noise="clean").write(
        tmp_path / "log.csv"
    )
    inputs = undertow.read_inputs(tmp_path / "log.csv", boat)
    undertow.fit(inputs)
    assert "calibrating X_u" in capsys.readouterr().err
    undertow.fit(inputs, progress=None)
    assert capsys.readouterr() == ("", "")
