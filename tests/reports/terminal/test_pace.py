"""A step tells how far it is, and what time is left where its pace tells that; a step of a moment tells nothing."""

import pytest

from undertow.reports.terminal import progress as module
from undertow.reports.terminal.progress import Pace, paced


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The time of the step, as its only entry."""
    now = [100.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    return now


def run(pace: Pace, clock: list[float], parts: int, each: float, total: int) -> None:
    for done in range(parts):
        pace.told(done, total)
        clock[0] += each
    pace.told(parts, total)


def test_the_time_left_follows_from_the_pace(clock: list[float]):
    said: list[str] = []
    run(Pace(said.append, "models scored"), clock, 8, 1.5, 8)
    assert said == ["models scored: 2 of 8, about 9 s left", "models scored: 6 of 8, about 3 s left"]
    said.clear()
    run(Pace(said.append, "reading", " MB"), clock, 2, 2.0, 200)
    assert said == ["reading: 1 of 200 MB, about 7 min left"]


def test_uneven_parts_tell_how_many_are_done_and_no_time(clock: list[float]):
    said: list[str] = []
    run(Pace(said.append, "checks of the log", even=False), clock, 20, 1.0, 20)
    assert said == [f"checks of the log: {done} of 20" for done in (2, 7, 12, 17)]


def test_nothing_is_told_before_a_part_is_done_but_how_many_there_are(clock: list[float]):
    said: list[str] = []
    pace = Pace(said.append, "reading")
    clock[0] += 3.0
    pace.told(0, 5)
    assert said == ["reading: 0 of 5"]


def test_a_step_of_a_moment_tells_nothing_and_each_log_has_its_own_pace(clock: list[float]):
    said: list[str] = []
    pace = Pace(said.append, "reading", " MB")
    run(pace, clock, 10, 0.1, 10)
    assert said == []
    clock[0] += 50.0
    run(pace, clock, 4, 1.0, 10)  # the next log
    assert said == ["reading: 2 of 10 MB, about 8 s left"]


def test_items_of_a_step_are_the_items_whoever_listens(clock: list[float]):
    said: list[str] = []
    for item in paced("abcd", "letters", said.append):
        assert item in "abcd"
        clock[0] += 2.0
    assert said == ["letters: 1 of 4, about 6 s left"]
    assert list(paced("abcd", "letters", None)) == list("abcd")
