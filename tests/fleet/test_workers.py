"""Who works: a worker that dies, a cluster, and what is refused."""

from pathlib import Path

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
