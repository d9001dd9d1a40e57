"""Who works: a worker that dies, a cluster, and what is refused."""

import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from deadly import squared

import undertow
from undertow.fleet.workers import Engine, WorkerLost, mapped


def test_a_worker_that_dies_takes_nothing_with_it(tmp_path: Path):
    tasks = [(str(tmp_path), n) for n in range(8)]
    found = dict(mapped(squared, tasks, Engine(workers=2)))
    assert isinstance(found.pop(3), WorkerLost)
    assert found == {n: n * n for n in range(8) if n != 3}


def test_wrong_engines_are_refused():
    with pytest.raises(undertow.RequestError, match="expected at least 1, got 0"):
        Engine(workers=0)
    with pytest.raises(undertow.RequestError, match="got both"):
        Engine(workers=2, scheduler="tcp://127.0.0.1:1")


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (None, "the scheduler went away .* the same call again"),
        (ImportError("no undertow"), "ImportError: no undertow"),
    ],
)
def test_a_cluster_that_goes_away_is_told(error: Exception | None, told: str, monkeypatch: pytest.MonkeyPatch):
    class Gone(Executor):
        def submit(self, *words: Any) -> Future[Any]:  # type: ignore[override]
            future: Future[Any] = Future()
            if error is None:
                future.cancel()
                future.set_running_or_notify_cancel()
            else:
                future.set_exception(error)
            return future

    @contextmanager
    def pool(*words: Any) -> Iterator[tuple[Executor, int]]:
        yield Gone(), 1

    monkeypatch.setattr("undertow.fleet.workers._pool", pool)
    with pytest.raises(undertow.RequestError, match=told):
        list(mapped(abs, [1], Engine(scheduler="tcp://127.0.0.1:1")))


def test_workers_end_with_their_parent():
    """Without a signal: as when the system has killed it for its memory."""
    code = """
import os
from undertow.fleet import workers
workers._LOOK = 0.05
child = os.fork()
if child == 0:
    parent = os.getpid()
    if os.fork() == 0:
        workers.end_with(parent)
        import time; time.sleep(20); os.write(1, b"still there")
        os._exit(0)
    os._exit(0)
os.waitpid(child, 0)
"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=10, check=True)
    assert run.stdout == ""  # and it came before the twenty seconds: who is there still holds the pipe open
