"""A session saved and opened again: the same state, wherever its log is now, or a sentence on why not."""

import asyncio
import json
import shutil
from pathlib import Path

import pytest
from places import ROOT
from tabs import fit_of, history_of, opened
from verbs import done

from undertow.app import worker
from undertow.app.session import Session
from undertow.app.session_file import read_session, saved_session
from undertow.app.shown import View
from undertow.physics.errors import RequestError
from undertow.workflows.workbench_facts import Source

DEMO_LOG, NOMINAL = ROOT / "data" / "gazebo_blueboat.csv.gz", ROOT / "data" / "demo.yaml"
FIRST, SECOND = "surge_quadratic_damping", "yaw_quadratic_damping"


@pytest.fixture(scope="module", autouse=True)
def prepared() -> None:
    worker.prepare()


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A log, and another of the same boat."""
    folder = tmp_path_factory.mktemp("logs")
    both = folder / "harbour.csv", folder / "lake.csv"
    for k, path in enumerate(both):
        drag = ("--effect", "X_uu=-20", "--effect", "N_rr=-20", "--seed", str(k))
        done("simulate", "-v", str(NOMINAL), *drag, "--duration", "60", "--out", str(path))
    return both


def unsearched() -> Session:
    """A session that searches nothing, which is what takes long."""
    session = Session()

    async def nothing() -> None:
        """Instead of a search."""

    session.search = nothing  # type: ignore[method-assign]
    return session


async def state_of(session: Session) -> str:
    """All that a session is, in a text."""
    vehicle = await session.ask("nominal")
    return saved_session(session.shown, vehicle, session.names, session.folder).model_dump_json(by_alias=True)


async def saved_at(session: Session, path: Path) -> Path:
    """The session in a file beside the tab."""
    found = await session.save()
    assert session.errands.trouble == ""
    assert found is not None
    return Path(shutil.copy(found, path))


async def worked_on(log: Path) -> Session:
    """A session with some steps."""
    session = unsearched()
    await session.open(Source((str(log),), str(NOMINAL)))
    await session.add(FIRST)
    await session.add(SECOND)
    await session.move("N_rr", -12.3456789012345)
    await session.add("sway_lift")
    await session.undo()
    assert session.errands.trouble == ""
    return session


def saved_once(log: Path, path: Path) -> dict:
    """The content of the file of a session."""

    async def story() -> None:
        session = await worked_on(log)
        try:
            await saved_at(session, path)
        finally:
            session.close()

    asyncio.run(story())
    return json.loads(path.read_text("utf-8"))


@pytest.fixture(scope="module")
def content(logs: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> dict:
    """The content of the file of a session with some steps."""
    return saved_once(logs[0], tmp_path_factory.mktemp("saved") / "a.session.json")


def told_of(path: Path, *beside: Path, paths: bool = True) -> str:
    """What is told of a session that is opened; empty where it opens as it was."""

    async def story() -> str:
        session = unsearched()
        session._paths = paths
        try:
            await session.open(Source((str(path), *map(str, beside))))
            return session.names.with_user_names(session.errands.trouble)
        finally:
            session.close()

    return asyncio.run(story())


def test_a_session_is_saved_and_opened_again_as_it_was(logs, tmp_path):
    async def story() -> None:
        session, again = await worked_on(logs[0]), unsearched()
        try:
            await session.try_on(Source((str(logs[1]),)))
            session.shown.select(((5.0, 9.5),))
            session.shown.look_at(other=False)
            session.shown.select(((1.0, 2.0), (3.0, 4.0)))
            session.shown.view = View("forces", "N", "command")
            session.shown.look_at(other=True)
            path = await saved_at(session, tmp_path / "harbour.session.json")
            await again.open(Source((str(path),)))
            assert again.errands.trouble == ""
            assert await state_of(again) == await state_of(session)
            for one, other in ((session.shown.fitted, again.shown.fitted), (session.shown.other, again.shown.other)):
                assert one is not None
                assert other is not None
                assert other.fit.error == one.fit.error
                assert other.fit.values == one.fit.values
                assert [fit.error for fit in other.stairs] == [fit.error for fit in one.stairs]
            assert again.shown.on_other
            assert again.shown.selected == ((5.0, 9.5),)
            assert history_of(again).can_redo
            assert again.commands() == session.commands()
            await again.redo()
            assert again.shown.stand.names == (FIRST, SECOND, "sway_lift")
        finally:
            session.close()
            again.close()

    asyncio.run(story())


def test_what_a_search_found_is_there_again_without_a_search(tmp_path):
    async def story() -> None:
        session, again = await opened(), unsearched()
        try:
            del session.search  # type: ignore[attr-defined]
            await session.search()
            searched = session.shown.searched
            assert searched is not None
            await session.add(*searched.found[:2])
            path = await saved_at(session, tmp_path / "demo.session.json")
            await again.open(Source((str(path),)))
            assert again.errands.trouble == ""
            found = again.shown.searched
            assert found is not None
            for name in (
                "verdict",
                "headline",
                "told",
                "found",
                "sensors",
                "advice",
                "rivals",
                "title",
                "sure",
                "refits",
            ):
                assert repr(getattr(found, name)) == repr(getattr(searched, name)), name
            assert [card.name for card in found.cards] == [card.name for card in searched.cards]
            assert [card.numbers for card in found.cards] == [card.numbers for card in searched.cards]
            assert any(card.picture for card in found.cards)
            assert fit_of(again).error == pytest.approx(fit_of(session).error, rel=1e-9)
            assert await state_of(again) == await state_of(session)
        finally:
            session.close()
            again.close()

    asyncio.run(story())


def test_a_session_of_uploads_asks_for_its_log_and_its_vehicle_is_in_it(logs, tmp_path):
    async def story() -> None:
        session, again = unsearched(), unsearched()
        try:
            log, boat = session.folder / "upload-1.csv", session.folder / "upload-2.yaml"
            shutil.copy(logs[0], log)
            shutil.copy(NOMINAL, boat)
            session.names.call(log, "my harbour.csv")
            session.names.call(boat, "my boat.yaml")
            await session.open(Source((str(log),), str(boat)))
            await session.add(FIRST)
            path = await saved_at(session, tmp_path / "a.json")
            assert str(session.folder) not in path.read_text("utf-8")
            await again.open(Source((str(path),)))
            assert "my harbour.csv: expected the log of this session, got none" in again.errands.trouble
            assert "drop my harbour.csv beside the session" in again.errands.trouble
            assert again.shown.history is None
            dropped = again.folder / "upload-9.csv"
            shutil.copy(logs[0], dropped)
            again.names.call(dropped, "my harbour.csv")
            await again.open(Source((str(path), str(dropped))))
            assert again.errands.trouble == ""
            assert await state_of(again) == await state_of(session)
            assert again.commands() == session.commands()
        finally:
            session.close()
            again.close()

    asyncio.run(story())


def test_a_log_is_found_by_its_content_and_asked_for_by_its_name(logs, tmp_path):
    was, path = tmp_path / "was" / "harbour.csv", tmp_path / "a.session.json"
    was.parent.mkdir()
    shutil.copy(logs[0], was)
    saved_once(was, path)
    assert told_of(path) == ""
    assert "expected the log of this session, got" in told_of(path, paths=False)  # a stranger names no path here
    moved = was.rename(tmp_path / "renamed.csv")
    gone = told_of(path)
    assert gone.startswith(f"harbour.csv: expected the log of this session at {was}, got no file there")
    assert told_of(path, moved) == ""
    shutil.copy(logs[1], was)
    other = told_of(path)
    assert "got a file with another content" in other
    was.unlink()
    moved.rename(tmp_path / "harbour.csv")  # as it is sent: beside the session
    assert told_of(path) == ""


def test_a_repaired_log_is_repaired_again(logs, tmp_path):
    import pandas as pd

    table = pd.read_csv(logs[0], comment="#")
    table.loc[table["field"] == "r", "time"] += 0.4
    table.to_csv(tmp_path / "late.csv", index=False)

    async def story() -> None:
        session, again = unsearched(), unsearched()
        try:
            await session.open(Source((str(tmp_path / "late.csv"),), str(NOMINAL), as_is=True))
            await session.repair()
            await session.add(FIRST)
            path = await saved_at(session, tmp_path / "late.session.json")
            await again.open(Source((str(path),)))
            assert again.errands.trouble == ""
            assert await state_of(again) == await state_of(session)
            assert fit_of(again).error == fit_of(session).error
            assert again.commands() == session.commands()
        finally:
            session.close()
            again.close()

    asyncio.run(story())


def test_a_session_of_another_version_opens_or_says_why_not(content, tmp_path):
    path = tmp_path / "a.session.json"

    def written(**changes: object) -> Path:
        path.write_text(json.dumps({**content, **changes}), "utf-8")
        return path

    assert told_of(written(version="0.0.7", moods=["grey"])) == ""  # the same numbers come out, and more is passed over
    stairs = [dict(stair) for stair in content["stairs"]]
    stairs[-1] = {**stairs[-1], "numbers": {**stairs[-1]["numbers"], "X_uu": -1.0}}
    told = told_of(written(version="0.0.7", stairs=stairs))
    assert told.startswith("This session was saved by undertow 0.0.7 with other numbers: X_uu was -1.000 and is -")
    for schema in ("undertow.session/0", "undertow.session/2", "undertow.run/1", None):
        told = told_of(written(schema=schema, version="9.9"))
        assert f"expected schema 'undertow.session/1', got {schema!r}" in told
        assert told.endswith("open it with undertow 9.9, or open its log anew and add the effects again")
    lacking = {key: value for key, value in content.items() if key != "steps"}
    path.write_text(json.dumps(lacking), "utf-8")
    assert "lacks 'steps'" in told_of(path)


def test_what_is_no_session_is_refused(logs, content, tmp_path):
    path = tmp_path / "a.session.json"
    path.write_text(json.dumps(content), "utf-8")
    broken = tmp_path / "broken.json"
    broken.write_text("{", "utf-8")
    with pytest.raises(RequestError, match="expected a session that the workbench saved"):
        read_session(broken)
    broken.write_text(json.dumps({**content, "at": 99}), "utf-8")
    with pytest.raises(RequestError, match="expected 'at' below"):
        read_session(broken)
    broken.write_text(json.dumps({**content, "view": {"axis": "Z"}}), "utf-8")
    with pytest.raises(RequestError, match="expected one of 'X', 'Y' or 'N'"):
        read_session(broken)
    for field in ("vehicle", "like", "channel_map"):
        step = content["steps"][0]
        stranger = {**step, "source": {**step["source"], field: "/etc/passwd"}}
        broken.write_text(json.dumps({**content, "steps": [stranger], "at": 0}), "utf-8")
        with pytest.raises(RequestError, match="which the session does not hold"):
            read_session(broken)
    assert "one session, got 2" in told_of(path, broken)

    async def story() -> None:
        session = await worked_on(logs[0])
        try:
            before = session.shown.fitted, session.shown.history
            await session.open(Source((str(path),), "blueboat"))
            assert "a session has its vehicle" in session.errands.trouble
            assert (session.shown.fitted, session.shown.history) == before  # what was open stays
        finally:
            session.close()

    asyncio.run(story())


def test_a_session_whose_log_is_gone_is_not_saved(logs, tmp_path):
    log = Path(shutil.copy(logs[0], tmp_path / "harbour.csv"))

    async def story() -> None:
        session = await worked_on(log)
        try:
            log.unlink()
            assert await session.save() is None
            assert "by whose content a session finds it again" in session.errands.trouble
        finally:
            session.close()

    asyncio.run(story())
