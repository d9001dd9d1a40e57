"""A fleet on the workbench: its hull diary in place of a log, and what is refused."""

import asyncio
from dataclasses import replace
from pathlib import Path

import pytest
from verbs import done

from undertow.app import worker
from undertow.app.session import Session
from undertow.workflows.workbench_facts import Source


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two days of one boat."""
    folder = tmp_path_factory.mktemp("fleet")
    for seed in (1, 2):
        log = folder / "a&b" / f"2026-05-0{seed}.csv"
        log.parent.mkdir(exist_ok=True)
        done("simulate", "-v", "blueboat", "--duration", "30", "--seed", str(seed), "--out", log)
    done("fleet", folder / "a&b", "-v", "blueboat", "--workers", "1", "--out", folder / "harbour")
    return folder / "harbour"


def test_a_fleet_is_shown_by_its_diary_and_left_again(fleet: Path):
    worker.prepare()

    async def story() -> None:
        session = Session()
        try:
            await session.open(Source((str(fleet),)))
            diary = session.shown.diary
            assert diary is not None, session.errands.trouble
            assert diary.fleet == "harbour"
            assert "<svg" in diary.glance
            assert "a&amp;b" in diary.glance
            assert "<a " not in diary.glance  # what it would lead to is on the page that is taken away
            assert Path(diary.page).read_text("utf-8").startswith("<!doctype html>")
            await session.open(replace(Source((str(fleet),)), vehicle="blueboat"))
            assert "leave vehicle, map and axes out" in session.errands.trouble
            assert session.shown.diary is diary
            (fleet / "fleet.json").write_text("{}")
            await session.open(Source((str(fleet),)))
            assert "expected schema" in session.errands.trouble
            session.shown.turn_to_fleet(None)
            assert session.shown.opened is None
        finally:
            session.close()

    asyncio.run(story())
