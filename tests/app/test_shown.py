"""What is shown while more is asked for: clicks that wait for one another, files taken meanwhile, workers that die."""

import asyncio
import json

import numpy as np
import pytest
from tabs import DEMO, fit_of, history_of, opened, worker_of

from undertow.app import worker
from undertow.physics.vehicle import load_vehicle
from undertow.workflows.workbench_facts import ModelChoice, Searched

FIRST, SECOND = "surge_quadratic_damping", "yaw_quadratic_damping"


@pytest.fixture(scope="module", autouse=True)
def prepared() -> None:
    worker.prepare()


def test_a_file_that_is_taken_while_a_step_is_fitted_is_of_what_is_shown():
    async def story() -> None:
        session = await opened()
        try:
            adding = asyncio.create_task(session.add(FIRST))
            await asyncio.sleep(0.0)
            assert session.shown.stand == ModelChoice()
            taken = await session.take("model")
            assert taken is not None
            assert load_vehicle(taken).value("X_uu") == 0.0
            await adding
            taken = await session.take("model")
            assert taken is not None
            assert load_vehicle(taken).value("X_uu") == fit_of(session).values[0].after != 0.0
        finally:
            session.close()

    asyncio.run(story())


def test_the_way_from_a_place_is_that_of_the_model_that_is_shown():
    async def story() -> None:
        session = await opened()
        try:
            _, way, _ = await asyncio.gather(session.add(FIRST), session.way(60.0), session.add(SECOND))
            assert way is not None
            first, both = [await session.ask("way", ModelChoice(names), 60.0) for names in ((FIRST,), (FIRST, SECOND))]
            np.testing.assert_array_equal(way.after, first.after)
            assert np.abs(way.after - both.after).max() > 0.01
        finally:
            session.close()

    asyncio.run(story())


def test_a_step_that_failed_is_forgotten_by_those_that_waited_behind_it():
    async def story() -> None:
        session = await opened()
        try:
            await asyncio.gather(session.add("surge_quadratic_dampin"), session.add(FIRST), session.add(SECOND))
            assert [step.stand.names for step in history_of(session).steps] == [(), (FIRST,), (FIRST, SECOND)]
            assert fit_of(session).names == (FIRST, SECOND)
            await session.undo()
            assert fit_of(session).names == session.shown.stand.names == (FIRST,)
        finally:
            session.close()

    asyncio.run(story())


def test_what_waits_for_its_turn_is_seen():
    async def story() -> None:
        session = await opened()
        seen: list[int] = []
        session.audience.watch(lambda: seen.append(session.waiting))
        try:
            adding = asyncio.create_task(session.add(FIRST))
            await asyncio.sleep(0.0)
            assert session.waiting == 0
            others = [asyncio.create_task(session.add(SECOND)), asyncio.create_task(session.undo())]
            await asyncio.sleep(0.0)
            assert session.waiting == max(seen) == 2
            others[1].cancel()
            await asyncio.gather(adding, others[0])
            assert session.waiting == 0
            assert fit_of(session).names == (FIRST, SECOND)
        finally:
            session.close()

    asyncio.run(story())


def test_of_a_slider_in_a_hurry_the_last_place_is_shown():
    async def story() -> None:
        session = await opened()
        try:
            await session.add(FIRST)
            await asyncio.gather(*(session.move("X_uu", -3.0 - 0.1 * k) for k in range(8)))
            assert fit_of(session).values[0].after == -3.7
            assert [step.stand.moved for step in history_of(session).steps] == [(), (), (("X_uu", -3.7),)]
            plain, added, moved = session.shown.stairs  # what a hand did is no step of the effect
            assert (plain.names, added.names, added.unseen) == ((), (FIRST,), True)
            assert moved is fit_of(session)
        finally:
            session.close()

    asyncio.run(story())


def test_a_slider_that_is_moved_after_its_fitted_value_was_asked_for_stays_moved():
    async def story() -> None:
        session = await opened()
        try:
            await session.add(FIRST)
            await asyncio.gather(
                session.add(SECOND), session.move("X_uu", -3.0), session.unmove(), session.move("X_uu", -4.0)
            )
            assert session.shown.stand.moved == (("X_uu", -4.0),)
            await session.undo()
            assert session.shown.stand == ModelChoice((FIRST, SECOND))
        finally:
            session.close()

    asyncio.run(story())


def test_nothing_is_taken_of_a_log_that_is_not_shown_any_more():
    async def story() -> None:
        session = await opened()
        try:
            heavier = DEMO.__class__(changed=(("mass", 33.0),))
            changing, taken = await asyncio.gather(session.change(heavier), session.take("model"))
            assert (changing, taken) == (None, None)
            assert "take the file again" in session.errands.trouble
            assert session.shown.source == heavier
        finally:
            session.close()

    asyncio.run(story())


def test_what_a_search_found_is_taken_after_its_worker_was_lost():
    async def story() -> None:
        session = await opened()
        try:
            session.shown.searches[DEMO] = Searched("missing", "", (), (FIRST,), ())
            worker_of(session).process.kill()
            worker_of(session).process.join()
            await session.again()
            taken = await session.take("findings")
            assert session.errands.trouble == ""
            assert taken is not None
            found = json.loads(taken.read_text("utf-8"))
            assert FIRST in found["missing"]
            assert len(found["missing"]) > 1  # it was searched again, and no effect was added by name
        finally:
            session.close()

    asyncio.run(story())
