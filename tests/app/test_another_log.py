"""A second log on the bench: predicted by the model that is there, whole, nothing fitted; and back without a loss."""

import asyncio
import shutil
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from places import ROOT, slowness
from tabs import DEMO, fit_of, opened, worker_of
from verbs import done

import undertow
from undertow.app import worker
from undertow.app.shown import OnLog
from undertow.app.steps import FileNames
from undertow.app.views import words as says
from undertow.app.worker_service import WorkerService
from undertow.workflows.log_view import UNSEEN
from undertow.workflows.workbench_facts import ModelChoice, Searched, Source

DEMO_LOG, NOMINAL = ROOT / "data" / "gazebo_blueboat.csv.gz", ROOT / "data" / "demo.yaml"
FIRST, SECOND = "surge_quadratic_damping", "yaw_quadratic_damping"
NAMES = FileNames(Path("/nowhere"))
LIMIT = 1.0
"""Seconds in which a log of five minutes is read, checked and predicted, on a machine that does nothing else."""


@pytest.fixture(scope="module", autouse=True)
def prepared() -> None:
    worker.prepare()


@pytest.fixture(scope="module")
def second(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five minutes of a boat whose drag the demo's model misses."""
    path = tmp_path_factory.mktemp("second") / "second.csv"
    drag = ("--effect", "X_uu=-20", "--effect", "N_rr=-20")
    done("simulate", "-v", str(NOMINAL), *drag, "--duration", "300", "--out", str(path))
    return path


def on_fitted(session) -> OnLog:
    assert session.shown.fitted is not None
    return session.shown.fitted


def on_other(session) -> OnLog:
    assert session.shown.other is not None
    return session.shown.other


def test_a_second_log_is_predicted_as_compare_does(second: Path, tmp_path: Path):
    desk, stand = WorkerService(), ModelChoice((FIRST, SECOND))
    desk.open(DEMO, str(tmp_path))
    desk.fit(stand)
    opened, fit = desk.try_on(Source((str(second),)), stand, NAMES)
    model = desk.take("model", stand, str(tmp_path), NAMES)
    inputs = undertow.read_inputs(second, NOMINAL, progress=None)
    found = {one.name: one for one in undertow.compare(inputs, [model], progress=None).models}
    for said, name in ((opened.nominal, "nominal"), (fit, str(model))):
        one = next(model for key, model in found.items() if key in (name, Path(name).stem, Path(name).name))
        ahead = one.rollout["10"]
        assert said.error["position"] == pytest.approx(ahead.position, rel=1e-6)
        assert said.error["yaw"] == pytest.approx(ahead.yaw, rel=1e-6)
        assert said.acceleration["surge"] == pytest.approx(one.acceleration.rmse.surge, rel=1e-6)
    assert opened.judged == UNSEEN
    assert opened.table["time"].size == fit.columns["u"].size
    assert opened.seconds == pytest.approx(300.0, abs=2.0)  # no row was kept for a fit
    # The band is that of the log to which the model was fitted.
    assert fit.band == desk.fit(stand).band is not None
    assert fit.held is not None
    assert fit.held.predictions > 200
    assert fit.held.predictions + fit.held.beyond > 250  # those far from the speeds of the run have no band
    known = np.isfinite(fit.columns["u_low"])
    assert (fit.columns["u_low"] <= fit.columns["u"])[known].all()
    assert (fit.columns["u"] <= fit.columns["u_high"])[known].all()
    assert desk.fit(ModelChoice((FIRST,), moved=(("X_uu", -5.0),))).band is None  # by hand: no rows tell its errors


def test_five_minutes_are_read_and_predicted_within_a_second(second: Path, tmp_path: Path):
    desk, stand = WorkerService(), ModelChoice((FIRST, SECOND))
    desk.open(DEMO, str(tmp_path))
    desk.fit(stand)
    took = []
    for _ in range(3):
        begun = time.perf_counter()
        desk.try_on(Source((str(second),)), stand, NAMES)
        took.append(time.perf_counter() - begun)
    assert min(took) < LIMIT * slowness(), took


def test_all_views_show_the_second_log_and_the_first_comes_back_as_it_was(second: Path):
    async def story() -> None:
        session = await opened()
        try:
            await session.add(FIRST)
            session.shown.select(((1.0, 2.0),))
            before, history = on_fitted(session), session.shown.history
            await session.try_on(Source((str(second),)))
            assert session.errands.trouble == ""
            shown = session.shown
            assert shown.on_other
            assert shown.opened is not None
            assert shown.opened.log == "second.csv"
            assert shown.selected == ()
            assert [fit.names for fit in shown.stairs] == [(), (FIRST,)]
            assert fit_of(session).error["position"] < shown.opened.nominal.error["position"]
            assert fit_of(session).values == before.fit.values  # nothing was fitted
            assert says.how_well(shown).endswith(UNSEEN)
            shown.select(((3.0, 4.0),))
            way = await session.way(100.0)
            assert way is not None
            at = int(np.argmin(np.abs(shown.opened.table["time"] - 100.0)))
            north = shown.opened.table["north"][at]
            assert way.measured[0, 0] == pytest.approx(north)
            shown.look_at(other=False)
            assert shown.fitted is before
            assert shown.history is history
            assert (shown.fit, shown.opened, shown.selected) == (before.fit, before.opened, ((1.0, 2.0),))
            shown.look_at(other=True)
            assert shown.selected == ((3.0, 4.0),)
            await session.put_away()
            assert shown.other is shown.other_source is None
            assert shown.fitted is before
        finally:
            session.close()

    asyncio.run(story())


def test_steps_are_taken_while_the_second_log_is_shown(second: Path):
    async def story() -> None:
        session = await opened()
        try:
            await session.try_on(Source((str(second),)))
            nominal = fit_of(session)
            assert nominal is on_other(session).opened.nominal
            await session.add(FIRST)
            first = fit_of(session)
            await session.add(SECOND)
            both = fit_of(session)
            assert both.error["position"] < first.error["position"] < nominal.error["position"]
            assert [fit.names for fit in session.shown.stairs] == [(), (FIRST,), (FIRST, SECOND)]
            assert on_fitted(session).fit.names == (FIRST, SECOND)
            await session.move("X_uu", -3.0)
            assert fit_of(session).error["surge"] != both.error["surge"]
            for _ in range(3):
                await session.undo()
            assert fit_of(session) is on_other(session).opened.nominal
            assert session.shown.on_other
            heavier = replace(DEMO, changed=(("mass", 33.0),))
            await session.change(heavier)  # another vehicle predicts both logs
            assert session.shown.on_other
            assert fit_of(session).error["position"] != nominal.error["position"]
            worker_of(session).process.kill()
            worker_of(session).process.join()
            await session.add(FIRST)
            assert session.errands.lost
            await session.again()
            assert session.shown.on_other
            await session.open(DEMO)
            assert session.shown.other is None
            assert not session.shown.on_other
        finally:
            session.close()

    asyncio.run(story())


def test_a_second_log_that_cannot_be_read_leaves_all_as_it_was(second: Path, tmp_path: Path):
    broken = tmp_path / "broken.csv"
    broken.write_text("no,log\nat,all\n", "utf-8")

    async def story() -> None:
        session = await opened()
        try:
            await session.try_on(Source((str(second),)))
            before = on_other(session)
            await session.try_on(Source((str(broken),)))
            assert "broken.csv" in session.errands.trouble
            assert session.shown.other is before
            await session.open(Source((str(broken),)))
            assert "broken.csv" in session.errands.trouble
            await session.add(FIRST)
            assert session.errands.trouble == ""
            assert fit_of(session).columns["u"].size == before.opened.table["time"].size
        finally:
            session.close()

    asyncio.run(story())


def test_a_log_that_a_fit_has_seen_is_told_whatever_it_is_called(tmp_path: Path):
    desk = WorkerService()
    desk.open(Source((str(DEMO_LOG),), str(NOMINAL)), str(tmp_path))
    copy = shutil.copy(DEMO_LOG, tmp_path / "upload-9.csv.gz")
    names = FileNames(tmp_path)
    names.call(Path(copy), "harbour.csv.gz")
    opened, _ = desk.try_on(Source((str(copy),)), ModelChoice(), names)
    assert opened.judged == "The model was fitted to harbour.csv.gz: its errors are too small there."


def test_a_vehicle_file_that_was_fitted_to_the_second_log_is_told(second: Path, tmp_path: Path):
    desk = WorkerService()
    desk.open(Source((str(second),), str(NOMINAL)), str(tmp_path))
    model = desk.take("model", ModelChoice((FIRST,)), str(tmp_path), NAMES)
    desk.open(Source((str(DEMO_LOG),), model), str(tmp_path))
    opened, _ = desk.try_on(Source((str(second),)), ModelChoice(), NAMES)
    assert opened.judged.startswith("The vehicle file may have been fitted to second.csv")


def test_the_headline_tells_of_the_log_that_is_shown(second: Path):
    async def story() -> None:
        session = await opened()
        try:
            session.shown.searches[DEMO] = Searched("missing", "The model is missing drag.", ("Much.",), (), ())
            await session.try_on(Source((str(second),)))
            shown = session.shown
            assert says.headline(shown).startswith("second.csv: measured")
            assert says.how_well(shown) == UNSEEN
            assert says.search_sentence(shown) == "The search of gazebo_blueboat.csv.gz: The model is missing drag."
            hidden = replace(shown.searches[DEMO], hidden=(0.1, 0.0, 0.0))
            shown.searches[DEMO] = hidden
            assert "not corrected" in says.how_well(shown)
        finally:
            session.close()

    asyncio.run(story())
