"""A tab's work, on a worker of its own: steps, back and forth, and what happens when the worker dies."""

import asyncio
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pandas as pd
import pytest
from places import ROOT
from tabs import DEMO, fit_of, history_of, opened, worker_of
from verbs import done

from undertow.app import worker
from undertow.app.session import Session
from undertow.app.steps import History, Step, same_commands
from undertow.app.views.opening import stored_as
from undertow.app.worker_client import LOST
from undertow.workflows.inspect_and_init import Doubt
from undertow.workflows.log_view import LogView
from undertow.workflows.workbench import Workbench
from undertow.workflows.workbench_facts import OWN_NUMBERS, Card, ModelChoice, Place, Searched, Source, Wire

DEMO_LOG = ROOT / "data" / "gazebo_blueboat.csv.gz"
FIRST, SECOND = "surge_quadratic_damping", "yaw_quadratic_damping"


@pytest.fixture(scope="module", autouse=True)
def prepared() -> None:
    worker.prepare()


def test_steps_are_added_taken_back_and_taken_again():
    async def story() -> None:
        session = await opened()
        try:
            assert session.shown.opened is not None
            before = session.shown.opened.nominal.error["position"]
            await session.add(FIRST)
            first = fit_of(session)
            await session.add(SECOND)
            assert session.shown.stand.names == (FIRST, SECOND)
            assert [stair.names for stair in session.shown.stairs] == [(), (FIRST,), (FIRST, SECOND)]
            assert fit_of(session).error["position"] < before
            assert fit_of(session).verdict == "pass"
            assert {value.symbol for value in fit_of(session).values} == {"X_uu", "N_rr"}
            await session.undo()
            assert fit_of(session).error == first.error
            await session.redo()
            assert session.shown.stand.names == (FIRST, SECOND)
            await session.remove(FIRST)
            assert session.shown.stand.names == (SECOND,)
            await session.move("N_rr", -3.0)
            await session.move("N_rr", -4.0)
            assert fit_of(session).values[0].after == -4.0
            assert not fit_of(session).unseen
            await session.undo()  # one way of a slider is one step
            assert session.shown.stand.moved == ()
            assert history_of(session).can_redo
        finally:
            session.close()
        assert not session.folder.exists()

    asyncio.run(story())


def test_an_effect_that_cannot_be_added_leaves_the_model_as_it_was():
    async def story() -> None:
        session = await opened()
        try:
            await session.add("surge_quadratic_dampin")
            assert "did you mean" in session.errands.trouble
            assert session.shown.stand.names == ()
            assert not history_of(session).can_undo
            await session.add(FIRST)
            assert session.errands.trouble == ""
        finally:
            session.close()

    asyncio.run(story())


def test_the_first_effect_comes_beside_the_own_numbers_that_the_search_fitted():
    async def story() -> None:
        session = await opened()
        try:
            session.shown.searches[DEMO] = Searched("undecided", "", (), (), (), refits=True)
            await session.add(FIRST)
            assert session.shown.stand.names == (OWN_NUMBERS, FIRST)
            assert [stair.names for stair in session.shown.stairs] == [(), (OWN_NUMBERS,), (OWN_NUMBERS, FIRST)]
            await session.remove(OWN_NUMBERS)
            await session.add(SECOND)  # what was taken out stays out
            assert session.shown.stand.names == (FIRST, SECOND)
        finally:
            session.close()

    asyncio.run(story())


def test_what_is_added_by_name_is_weighed_with_every_step():
    async def story() -> None:
        session = await opened()
        try:
            session.shown.searches[DEMO] = Searched("undecided", "", (), (), (Card(FIRST, "", "", "", ""),))
            await session.add(FIRST)
            assert session.shown.by_hand == {}  # the search has weighed it
            await session.add("yaw:u|r|")
            alone = session.shown.by_hand["yaw:u|r|"]
            assert "95 %" in alone.numbers[0]
            assert "rows that" in alone.sentence
            await session.add(SECOND)
            assert set(session.shown.by_hand) == {"yaw:u|r|", SECOND}
            assert session.shown.by_hand["yaw:u|r|"] != alone
        finally:
            session.close()

    asyncio.run(story())


def test_a_killed_worker_is_told_and_another_goes_on():
    async def story() -> None:
        session = await opened()
        try:
            await session.add(FIRST)
            error = fit_of(session).error
            worker_of(session).process.kill()
            worker_of(session).process.join()
            await session.add(SECOND)
            assert session.errands.lost
            assert session.errands.trouble == LOST
            assert session.shown.stand.names == (FIRST,)
            await session.again()
            assert not session.errands.lost
            assert fit_of(session).error == pytest.approx(error)
        finally:
            session.close()

    asyncio.run(story())


def test_a_log_that_cannot_be_read_is_told_in_the_words_of_the_command_line(tmp_path):
    broken = tmp_path / "log.csv"
    broken.write_bytes(b"\x00\xff\x00 this is no log")

    async def story() -> str:
        session = Session()
        try:
            await session.open(Source(logs=(str(broken),), vehicle="blueboat"))
            assert session.shown.opened is None
            return session.errands.trouble
        finally:
            session.close()

    told = asyncio.run(story())
    assert "log.csv" in told
    assert "expected" in told


def test_a_log_is_repaired_and_opened_again(tmp_path):
    done("simulate", "-v", "blueboat", "--duration", "60", "--out", str(tmp_path / "sound.csv"))
    table = pd.read_csv(tmp_path / "sound.csv", comment="#")
    spoilt = tmp_path / "log.csv"
    table.loc[table["field"] == "psi", "value"] *= 180.0 / np.pi
    table.to_csv(spoilt, index=False)

    async def story() -> None:
        session = await opened()
        try:
            await session.open(Source(logs=(str(spoilt),), vehicle="blueboat"))
            assert "degrees" in session.errands.trouble or "degrees" in str(session.shown.opened)
            await session.repair()
            assert session.shown.source is not None
            assert session.names.with_user_names(session.shown.source.logs[0]).endswith("repaired.csv")
            assert session.shown.opened is not None
            assert session.errands.trouble == ""
            assert session.commands().splitlines()[0] == "undertow inspect log.csv --fix repaired.csv"
            repaired = session.shown.source
            await session.undo()  # to what was refused: it is told why, and the repaired log stays
            assert "degrees" in session.errands.trouble
            assert session.refused == repaired.original
            assert (session.shown.source, history_of(session).now.source) == (repaired, repaired)
        finally:
            session.close()

    asyncio.run(story())


def test_a_repair_is_taken_back_and_made_again(tmp_path):
    done("simulate", "-v", "blueboat", "--duration", "60", "--out", str(tmp_path / "log.csv"))
    table = pd.read_csv(tmp_path / "log.csv", comment="#")
    table.loc[table["field"] == "r", "time"] += 0.4
    table.to_csv(tmp_path / "log.csv", index=False)

    async def story() -> None:
        session = await opened()
        try:
            await session.open(Source(logs=(str(tmp_path / "log.csv"),), vehicle="blueboat", as_is=True))
            assert session.shown.opened is not None
            assert session.errands.trouble == ""
            assert any(check.mends for check in session.shown.opened.checks)
            await session.add(FIRST)
            first, source = fit_of(session), session.shown.source
            await session.repair()
            assert session.errands.trouble == ""
            assert session.shown.source is not None
            assert session.shown.source.original == source
            assert not session.shown.source.as_is
            assert session.shown.stand.names == ()
            repaired = fit_of(session).error
            await session.undo()
            assert session.shown.source == source
            assert session.shown.stand.names == (FIRST,)
            assert fit_of(session).error == first.error
            await session.redo()
            assert session.shown.source.original == source
            assert fit_of(session).error == repaired
            await session.unrepair()
            assert (session.shown.source, session.shown.stand.names) == (source, ())
            await session.undo()
            assert session.shown.source.original == source
        finally:
            session.close()

    asyncio.run(story())


def test_exchanged_and_reversed_thrusters_are_put_right(tmp_path):
    done("simulate", "-v", "blueboat", "--duration", "120", "--out", str(tmp_path / "sound.csv"))
    table = pd.read_csv(tmp_path / "sound.csv", comment="#")
    port, stbd = table["field"] == "newton_port", table["field"] == "newton_stbd"
    table.loc[port, "value"] *= -1.0
    table.loc[port, "field"], table.loc[stbd, "field"] = "newton_stbd", "newton_port"
    spoilt = Source(logs=(str(tmp_path / "log.csv"),), vehicle="blueboat", as_is=True)
    table.to_csv(spoilt.logs[0], index=False)

    async def story() -> None:
        session = await opened()
        try:
            await session.open(replace(spoilt, logs=(str(tmp_path / "sound.csv"),), as_is=False))
            right = fit_of(session).error["position"]
            await session.open(spoilt)
            assert fit_of(session).error["position"] > 2.0 * right
            form = await session.ask("form")
            assert [wire.channel for wire in form.wires] == [wire.by for wire in form.wires]
            one, other = form.wires[0].channel, form.wires[1].channel
            twice = (Wire(one, other), Wire(other, other))
            assert "drives two thrusters" in await session.ask("try_form", {}, form.places, twice)
            elsewhere = (replace(form.places[0], y=-form.places[0].y),)
            assert "on the other side" in await session.ask("try_form", {}, elsewhere, form.wires)
            assert await session.ask("try_form", {}, form.places, form.wires) == ""
            wires = (Wire(one, other, turned=True), Wire(other, one))
            await session.open(replace(spoilt, wires=wires, as_is=False))
            assert session.errands.trouble == ""
            assert fit_of(session).error["position"] == pytest.approx(right, rel=1e-6)
            assert (await session.ask("form")).wires == wires
            assert f"{one} from {other}, turned round" in session.commands()
        finally:
            session.close()

    asyncio.run(story())


def test_sides_that_a_log_does_not_show_are_told_until_a_person_says_them(tmp_path):
    done("simulate", "-v", "blueboat", "--duration", "120", "--out", str(tmp_path / "log.csv"))
    table = pd.read_csv(tmp_path / "log.csv", comment="#")
    port, stbd = (table["field"] == f"newton_{side}" for side in ("port", "stbd"))
    both = 0.5 * (table.loc[port, "value"].to_numpy() + table.loc[stbd, "value"].to_numpy())
    for rows, name in ((port, "newton_a"), (stbd, "newton_b")):
        table.loc[rows, "value"], table.loc[rows, "field"] = both, name
    table.to_csv(tmp_path / "log.csv", index=False)

    async def story() -> None:
        session = await opened()
        try:
            assert session.shown.opened is not None
            assert session.shown.opened.doubt == ""
            source = Source(logs=(str(tmp_path / "log.csv"),))
            await session.open(source)
            assert session.shown.opened.doubt == Doubt.SIDES.value
            await session.add("surge_linear_damping")
            assert session.shown.opened.doubt == Doubt.SIDES.value
            form = await session.ask("form")
            await session.open(replace(source, places=tuple(replace(p, y=-p.y) for p in form.places)))
            assert session.errands.trouble == ""
            assert session.shown.opened.doubt == ""
            assert (await session.ask("form")).places[0].y == -form.places[0].y
        finally:
            session.close()

    asyncio.run(story())


def test_a_sound_log_needs_no_repair():
    async def story() -> None:
        session = await opened()
        try:
            await session.open(Source(logs=(str(DEMO_LOG),), vehicle=str(ROOT / "data" / "demo.yaml")))
            before = session.shown.opened
            await session.repair()
            assert "nothing" in session.errands.trouble
            assert session.shown.opened is before
        finally:
            session.close()

    asyncio.run(story())


def test_the_sockets_of_nicegui_let_no_other_origin_in_and_the_first_page_waits_for_nothing_heavy():
    """NiceGUI lets every page connect; the attribute that says so is no part of its interface, and may move."""
    code = """
import json, sys
from nicegui import core
from undertow.app.server import _application
assert core.sio.eio.cors_allowed_origins == "*" or isinstance(core.sio.eio.cors_allowed_origins, list)
_application(None, None, ["127.0.0.1:8423"], paths=True)
heavy = {"pandas", "scipy", "undertow.discovery", "undertow.fleet"} & set(sys.modules)
print(json.dumps([core.sio.eio.cors_allowed_origins, sorted(heavy)]))
"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert json.loads(run.stdout) == [["http://127.0.0.1:8423"], []]


def test_two_sessions_know_nothing_of_each_other():
    async def story() -> None:
        one, other = await opened(), Session()
        try:
            await one.add(FIRST)
            assert other.shown.opened is None
            assert other.shown.stand.names == ()
            assert one.folder != other.folder
            assert one.folder.stat().st_mode & 0o077 == 0
        finally:
            one.close()
            other.close()

    asyncio.run(story())


@pytest.mark.parametrize("name", ["../../etc/passwd", "a/b\\c.csv", "x\x00.bin", ".", "", "log.csv.gz", "L" * 5000])
def test_a_name_from_the_browser_never_becomes_a_path(name):
    stored = stored_as(name, 7)
    assert stored.startswith("upload-7")
    assert Path(stored).name == stored
    assert len(stored) < 20


def test_commands_do_the_same():
    session = Session()
    try:
        source = Source(logs=("/tmp/x/my log.bin",), hull=(("mass", 22.0),))
        session.shown.history = History((Step(source),))
        assert session.commands() == (
            "undertow init 'my log.bin' --mass 22 --out vehicle.yaml --channels channels.yaml\n"
            "undertow discover 'my log.bin' --vehicle vehicle.yaml --map channels.yaml --out run"
        )
    finally:
        session.close()


def test_a_training_that_is_stopped_does_not_tell_the_trouble_of_a_step_before(monkeypatch):
    session = Session()

    async def stopped(*given: object) -> None:
        assert given

    try:
        session.shown.history = History((Step(DEMO),))
        session.errands.trouble = "numbers were moved by hand"
        monkeypatch.setattr(session.training, "run", stopped)
        assert asyncio.run(session.train("mlp", 1, print)) is None
        assert session.errands.trouble == ""
    finally:
        session.close()


def test_what_no_command_does_is_said():
    stand = ModelChoice((OWN_NUMBERS, FIRST), (("X_uu", -3.0),))
    told = same_commands(Source(), stand, (SECOND,)).splitlines()
    assert told[:2] == ["undertow demo", f"undertow add {FIRST} --run undertow-demo --refit --out model.yaml"]
    assert "X_uu = -3" in told[2]
    alone = same_commands(Source(), ModelChoice((OWN_NUMBERS,)), (SECOND,)).splitlines()
    assert "undertow fit" in alone[1]
    made = Source(logs=("a.csv",), hull=(("mass", 22.0),))
    assert "--no-refit" in same_commands(made, ModelChoice((FIRST,)), (OWN_NUMBERS, SECOND), refits=True)


def test_another_log_is_compared():
    told = same_commands(Source(), ModelChoice((FIRST,)), (FIRST,), other=Source(("/tmp/x/lake.csv",), frame="enu"))
    vehicle = "--vehicle undertow-demo/nominal.yaml --frame enu"
    assert told.splitlines()[1] == f"undertow compare lake.csv {vehicle} --model undertow-demo"
    made = Source(("a.csv",), hull=(("mass", 22.0),))
    told = same_commands(made, ModelChoice((FIRST,)), (), other=Source(("lake.csv",))).splitlines()
    assert told[-1] == "undertow compare lake.csv --vehicle run/nominal.yaml --map channels.yaml --model model.yaml"
    assert "--model" not in same_commands(made, ModelChoice(), (), other=Source(("lake.csv",))).splitlines()[-1]


def test_what_the_files_must_have_is_said():
    source = Source(("a.csv",), "v.yaml", changed=(("mass", 24.0),), places=(Place("port", -0.4, -0.3, 0.0),))
    told = same_commands(source, ModelChoice(), ()).splitlines()
    assert told[1] == "# The vehicle file must have: mass = 24; port at x = -0.4, y = -0.3, angle = 0"


def test_a_correction_that_no_command_leaves_out_is_said():
    told = same_commands(Source(), ModelChoice((FIRST,), left=("gyro_scale",)), (FIRST,)).splitlines()
    assert told[0] == "undertow demo"
    assert told[1].endswith("which no command does: gyro scale")


def test_a_correction_of_a_sensor_is_taken_out_and_made_again(tmp_path):
    done("simulate", "-v", "blueboat", "--duration", "120", "--out", str(tmp_path / "log.csv"))
    table = pd.read_csv(tmp_path / "log.csv", comment="#")
    table.loc[table["field"] == "r", "value"] *= 0.95
    table.to_csv(tmp_path / "log.csv", index=False)

    async def story() -> None:
        session = await opened()
        try:
            await session.open(Source(logs=(str(tmp_path / "log.csv"),), vehicle="blueboat"))
            assert session.errands.trouble == ""
            await session.add(FIRST)
            corrected, fit = session.shown.opened, fit_of(session)
            assert corrected is not None
            await session.leave("gyro_scale")
            assert session.shown.opened is not None
            np.testing.assert_allclose(session.shown.opened.table["r"], 0.95 * corrected.table["r"], atol=2e-3)
            assert session.shown.stairs[0] is session.shown.opened.nominal
            assert fit_of(session).names == (FIRST,)
            assert fit_of(session).error != fit.error
            worker_of(session).process.kill()
            worker_of(session).process.join()
            await session.add(SECOND)
            assert session.errands.lost
            await session.again()
            assert session.shown.stand.left == ("gyro_scale",)
            np.testing.assert_allclose(session.shown.opened.table["r"], 0.95 * corrected.table["r"], atol=2e-3)
            assert await session.take("page") is None
            assert "gyro scale" in session.errands.trouble
            await session.undo()
            assert session.shown.stand == ModelChoice((FIRST,))
            assert fit_of(session).error == pytest.approx(fit.error)
            np.testing.assert_allclose(session.shown.opened.table["r"], corrected.table["r"])
        finally:
            session.close()

    asyncio.run(story())


def test_no_run_is_written_that_does_not_hold_what_is_shown():
    async def story() -> None:
        session = await opened()
        try:
            await session.add(FIRST)
            await session.move("X_uu", -3.0)
            assert await session.take("page") is None
            assert "moved by hand" in session.errands.trouble
            assert await session.take("model") is not None
            await session.unmove()
            await session.remove(FIRST)
            await session.add(OWN_NUMBERS)
            assert await session.take("run") is None
            assert "own numbers" in session.errands.trouble
        finally:
            session.close()

    asyncio.run(story())


def test_the_workbench_says_the_numbers_that_add_says():
    import undertow

    inputs = undertow.read_inputs(DEMO_LOG, ROOT / "data" / "demo.yaml", progress=None)
    bench, run = Workbench(LogView(inputs)), undertow.add([FIRST, SECOND], inputs, progress=None)
    for names, step in zip(((), (FIRST,), (FIRST, SECOND)), run.findings.steps, strict=True):
        said = bench.fit(ModelChoice(names)).error
        assert said["position"] == pytest.approx(step.rollout("10").position, rel=1e-9)
        assert said["yaw"] == pytest.approx(step.rollout("10").yaw, rel=1e-9)
    model = run.discovery.corrected
    assert bench.vehicle(ModelChoice((FIRST, SECOND))).values == pytest.approx(model.values, rel=1e-9)


def test_rows_of_several_logs_stand_one_after_the_other():
    import undertow

    inputs = undertow.read_inputs(DEMO_LOG, ROOT / "data" / "demo.yaml", progress=None)
    opened = LogView(inputs).opened()
    time = opened.table["time"]
    assert (np.diff(time) > 0.0).all()
    assert {values.size for values in opened.table.values()} == {time.size}
    assert {values.size for values in opened.nominal.columns.values()} == {time.size}
    assert opened.logs == ()


def test_each_of_several_logs_has_its_place_on_the_axis_of_time(tmp_path):
    import undertow

    for name, seconds in (("one", "40"), ("two", "60")):
        done("simulate", "-v", "blueboat", "--duration", seconds, "--out", str(tmp_path / f"{name}.csv"))
    inputs = undertow.read_inputs([tmp_path / "one.csv", tmp_path / "two.csv"], "blueboat", progress=None)
    opened = LogView(inputs).opened()
    one, two = opened.logs
    assert (one.name, two.name) == ("one.csv", "two.csv")
    assert one.begin == opened.table["time"][0]
    assert two.end == opened.table["time"][-1]
    assert 38.0 < one.end - one.begin < 40.0
    assert 58.0 < two.end - two.begin < 60.0
    assert 0.0 < two.begin - one.end < 0.2


def test_the_model_is_taken_for_other_programs():
    async def story() -> None:
        session = await opened()
        try:
            assert {"c", "sdf", "python"} <= set(dict(await session.ask("formats")))
            await session.add(FIRST)
            taken = await session.take("python")
            assert taken is not None
            assert taken.name == "model.py"
            text = taken.read_text("utf-8")
            assert f"X_uu = {fit_of(session).values[0].after:.9g}" in text
            assert "95 % interval" in text
            assert str(session.folder) not in text
            await session.move("X_uu", -3.0)
            taken = await session.take("c")
            assert taken is not None
            assert taken.name == "model-c.zip"
            with ZipFile(taken) as files:
                assert set(files.namelist()) == {"model.h", "model_test.c"}
                assert "X_uu = -3 N" in files.read("model.h").decode()
        finally:
            session.close()

    asyncio.run(story())


def test_a_step_to_another_reading_waits_for_a_search():
    async def story() -> None:
        session = await opened()
        try:
            heavier = replace(DEMO, changed=(("mass", 33.0),))
            await session.change(heavier)
            assert session.shown.source == heavier
            del session.search  # type: ignore[attr-defined]
            searching = asyncio.create_task(session.search())
            while session.errands.work is None:
                await asyncio.sleep(0.01)
            await session.undo()
            await searching
            assert session.errands.trouble == ""
            assert history_of(session).now.source == session.shown.source == DEMO
            assert session.shown.searched is None or session.shown.searched.cards
        finally:
            session.close()

    asyncio.run(story())
