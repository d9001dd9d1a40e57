"""Work beside a process: the same results, and nothing left behind, whatever happens to either process."""

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from undertow.measurements.statistics import processors as second_processor
from undertow.measurements.statistics.processors import parallel_map, run_in_fork, run_steps_in_fork
from undertow.physics.errors import RequestError

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="other systems do not fork here")


@pytest.fixture(autouse=True)
def two_processors(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if the machine had two, and the test runner little memory and no threads of its own."""
    count = threading.active_count
    others = count() - 1
    monkeypatch.setattr(threading, "active_count", lambda: count() - others)
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {0, 1})
    monkeypatch.setattr(second_processor, "_LARGE", 10**9)


def test_work_is_done_in_another_process_that_sees_what_is_at_hand() -> None:
    rows = np.arange(5.0)
    with run_in_fork(lambda: (os.getpid(), rows * 2.0)) as result:
        rows = rows + 100.0
        process, found = result()
    assert process != os.getpid()
    np.testing.assert_array_equal(found, [0.0, 2.0, 4.0, 6.0, 8.0])


def test_an_error_is_raised_where_the_result_is_asked_for() -> None:
    def refuse() -> None:
        raise RequestError("expected one, got none")

    with run_in_fork(refuse) as result, pytest.raises(RequestError, match="expected one, got none"):
        result()


def test_a_result_that_is_larger_than_a_pipe_arrives() -> None:
    with run_in_fork(lambda: np.ones(1_000_000)) as result:
        assert result().sum() == 1e6


def test_who_leaves_without_the_result_ends_the_work() -> None:
    begun, before = time.monotonic(), set(multiprocessing.active_children())
    with pytest.raises(KeyboardInterrupt), run_in_fork(partial(time.sleep, 60.0)):
        raise KeyboardInterrupt
    assert time.monotonic() - begun < 30.0
    assert set(multiprocessing.active_children()) <= before


def test_work_that_was_ended_from_outside_is_done_here() -> None:
    ours = os.getpid()

    def ended() -> int:
        if os.getpid() != ours:
            os.kill(os.getpid(), signal.SIGKILL)
        return os.getpid()

    with run_in_fork(ended) as result:
        assert result() == ours


def test_ctrl_c_is_left_to_who_waits() -> None:
    def interrupted() -> str:
        os.kill(os.getpid(), signal.SIGINT)
        return "done all the same"

    with run_in_fork(interrupted) as result:
        assert result() == "done all the same"


@pytest.mark.parametrize("reason", ["one processor", "a thread", "a large process", "a forked process"])
def test_work_is_done_here_where_no_fork_is_safe(reason: str, monkeypatch: pytest.MonkeyPatch) -> None:
    go_on = threading.Event()
    if reason == "one processor":
        monkeypatch.setattr(os, "sched_getaffinity", lambda process: {0})
    if reason == "a large process":
        monkeypatch.setattr(second_processor, "_LARGE", 1)
    if reason == "a thread":
        threading.Thread(target=go_on.wait, daemon=True).start()

    def nested() -> bool:
        with run_in_fork(os.getpid) as result:
            return result() == os.getpid()

    try:
        if reason == "a forked process":
            with run_in_fork(nested) as result:
                assert result()
        else:
            assert nested()
    finally:
        go_on.set()


@pytest.mark.parametrize("count", [0, 1, 2, 5])
def test_shared_work_keeps_its_order(count: int) -> None:
    found = parallel_map(lambda item: (item, os.getpid()), list(range(count)))
    assert [item for item, _ in found] == list(range(count))
    assert len({process for _, process in found}) == min(count, 2)


def test_a_result_that_is_cut_off_is_made_here() -> None:
    with run_in_fork(lambda: np.full(1_000_000, os.getpid())) as result:
        (process,) = multiprocessing.active_children()
        time.sleep(0.5)  # it waits for the pipe to be read
        process.kill()
        process.join()
        assert (result() == os.getpid()).all()


@pytest.mark.parametrize("end", ["os._exit(3)", "os.kill(os.getpid(), signal.SIGKILL)"])
def test_nothing_goes_on_after_a_process_that_ends_at_once(end: str) -> None:
    code = (
        "import multiprocessing, os, signal, time\n"
        "from undertow.measurements.statistics.processors import run_in_fork\n"
        "os.sched_getaffinity = lambda process: {0, 1}\n"
        "with run_in_fork(lambda: time.sleep(600.0)):\n"
        "    time.sleep(0.3)\n"
        "    print(multiprocessing.active_children()[0].pid, flush=True)\n"
        f"    {end}\n"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=60.0)
    left = Path(f"/proc/{int(ended.stdout)}")
    for _ in range(50):
        if not left.exists() or "State:\tZ" in (left / "status").read_text():
            return
        time.sleep(0.1)
    pytest.fail("the forked process goes on")


def test_work_is_done_here_where_no_process_can_be_had(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse() -> int:
        raise BlockingIOError("Resource temporarily unavailable")

    monkeypatch.setattr(os, "fork", refuse)
    with run_in_fork(os.getpid) as result:
        assert result() == os.getpid()


def test_steps_are_handed_back_one_by_one() -> None:
    def steps() -> Iterator[tuple[str, int]]:
        yield "prepared", os.getpid()
        time.sleep(0.5)
        yield "checked", os.getpid()

    with run_steps_in_fork(steps) as found:
        begun = time.monotonic()
        first, process = next(found)
        assert time.monotonic() - begun < 0.4
        assert (first, next(found)) == ("prepared", ("checked", process))
        assert process != os.getpid()
        assert next(found, None) is None


def test_an_error_comes_with_its_step() -> None:
    def steps() -> Iterator[int]:
        yield 1
        raise RequestError("the second step refuses")

    with run_steps_in_fork(steps) as found:
        assert next(found) == 1
        with pytest.raises(RequestError, match="the second step refuses"):
            next(found)


def test_steps_that_were_not_come_to_are_done_here() -> None:
    ours = os.getpid()

    def steps() -> Iterator[tuple[int, bool]]:
        yield 1, os.getpid() == ours
        if os.getpid() != ours:
            os.kill(os.getpid(), signal.SIGKILL)
        yield 2, os.getpid() == ours

    with run_steps_in_fork(steps) as found:
        assert list(found) == [(1, False), (2, True)]


def test_what_cannot_be_handed_back_is_an_error() -> None:
    with run_in_fork(threading.Lock) as result, pytest.raises(TypeError, match="pickle"):
        result()
