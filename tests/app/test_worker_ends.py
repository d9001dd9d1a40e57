"""The end of a worker: whoever listens to it has ended before its pipe goes, so that nothing is said on a terminal."""

import threading

import pytest

from undertow.app.worker import Worker, prepare


@pytest.mark.parametrize("asked", [False, True])
def test_nobody_listens_to_a_worker_that_is_closed(asked: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[object] = []
    monkeypatch.setattr(threading, "excepthook", said.append)
    prepare()
    before = set(threading.enumerate())
    worker = Worker()
    answer = worker.begin("no such thing") if asked else None
    worker.close()
    assert not worker.alive
    for listener in set(threading.enumerate()) - before:
        listener.join(60.0)  # its process may only now begin, and finds its pipe closed
        assert not listener.is_alive()
    assert answer is None or answer.cancelled()
    assert not said
