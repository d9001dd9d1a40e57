"""A folder is replaced as a whole: after a kill the next call finds the old one or the new one, and tidies up."""

import hashlib
import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from undertow.physics.errors import RequestError
from undertow.physics.files import remove, unfinished_beside, write_text
from undertow.physics.folders import check_folder, finish_move, hold_folder, recover, replace_folder

OLD = {"a": "old a", "b": "old b", "page": "old page"}
NEW = {"a": "new a", "b": "new b", "c": "new c"}
MINE = {"notes.txt": "mine", "sub/deep/x.csv": "1,2"}


def own(folder: Path) -> set[str]:
    """The names whose digests stand in the folder's list, as runs have them."""
    try:
        digests = json.loads((folder / "list").read_text())
    except OSError:
        return set()
    told = {n for n, d in digests.items() if (folder / n).is_file() and digest((folder / n).read_text()) == d}
    return told | {"list"}


def digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def builder(content: dict[str, str]) -> Callable[[Path], list[str]]:
    def build(work: Path) -> list[str]:
        for name, text in content.items():
            write_text(work / name, text)
        finish_move(work)  # whoever reads the new files to make others of them does so
        write_text(work / "list", json.dumps({name: digest(text) for name, text in content.items()}))
        return [*content, "list"]

    return build


def told(folder: Path) -> dict[str, str]:
    """All files below a folder but the list."""
    return {
        p.relative_to(folder).as_posix(): p.read_text() for p in folder.rglob("*") if p.is_file() and p.name != "list"
    }


@pytest.fixture
def target(tmp_path: Path) -> Path:
    folder = tmp_path / "place" / "run"
    folder.parent.mkdir()
    replace_folder(folder, builder(OLD), own)
    for name, text in MINE.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


def alone(target: Path) -> bool:
    """Whether nothing is beside or hidden in a folder."""
    hidden = [path.name for path in target.rglob(".*")]
    return os.listdir(target.parent) == [target.name] and not hidden


def killed(target: Path, step: int, setup: Callable[[], None] | None = None) -> bool:
    """Replace a folder in a process that is killed before its step of this number; False when it was done before."""
    child = os.fork()
    if child == 0:
        left = step

        def counted(real: Callable[..., object]) -> Callable[..., object]:
            def call(*words: object, **named: object) -> object:
                nonlocal left
                if left == 0:
                    os.kill(os.getpid(), 9)
                left -= 1
                return real(*words, **named)

            return call

        for name in ("mkdir", "rename", "replace", "unlink", "rmdir", "link", "chmod", "open"):
            setattr(os, name, counted(getattr(os, name)))
        try:
            if setup is not None:
                setup()
            replace_folder(target, builder(NEW), own)
        finally:
            os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -9


@pytest.mark.parametrize("first", [False, True], ids=["over an earlier run", "where there is none"])
def test_after_a_kill_at_any_step_there_is_the_old_or_the_new_folder_whole(first: bool, target: Path):
    outcomes = []
    for step in range(1000):
        for path in [target, *unfinished_beside(target)]:
            remove(path)
        if not first:
            replace_folder(target, builder(OLD), own)
            for name, text in MINE.items():
                (target / name).parent.mkdir(parents=True, exist_ok=True)
                (target / name).write_text(text)
        ended = not killed(target, step)
        if first:  # it appears by one rename
            assert not target.exists() or told(target) == NEW, step
        else:  # what is another's is where it was at any time
            assert MINE.items() <= told(target).items(), step
        finish_move(target)  # as whoever reads it does
        found = told(target) if target.exists() else {}
        found = {name: text for name, text in found.items() if ".undertow-" not in name}
        before, after = ({}, NEW) if first else ({**OLD, **MINE}, {**NEW, **MINE})
        assert found in (before, after), step
        outcomes.append(found == after)
        recover(target)
        assert (told(target) if target.exists() else {}) == found, step
        assert unfinished_beside(target) == [], step
        assert not target.exists() or alone(target), step
        if ended:
            break
    assert outcomes[0] is False
    assert outcomes[-1] is True
    assert outcomes == sorted(outcomes)
    assert len(outcomes) > 15


def test_what_others_put_there_stays_and_what_undertow_left_goes(target: Path):
    notes = (target / "notes.txt").stat()
    replace_folder(target, builder(NEW), own)
    assert told(target) == {**NEW, **MINE}
    assert (target / "notes.txt").stat().st_ino == notes.st_ino
    assert alone(target)


def test_links_and_pipes_of_others_stay(target: Path):
    (target / "link").symlink_to("nowhere")
    replace_folder(target, builder(NEW), own)
    assert os.readlink(target / "link") == "nowhere"
    os.mkfifo(target / "pipe")
    replace_folder(target, builder(OLD), own)
    assert (target / "pipe").is_fifo()
    assert (target / "a").read_text() == "old a"
    assert not (target / "c").exists()


def test_a_file_that_somebody_changed_is_not_replaced(target: Path):
    (target / "b").write_text("tuned by hand")
    before = told(target)
    with pytest.raises(
        RequestError, match=r"run: it holds b, which undertow did not write, or which was changed since"
    ):
        check_folder(target, {"a", "b", "c"}, own)
    with pytest.raises(RequestError, match="it holds b"):
        replace_folder(target, builder(NEW), own)
    assert told(target) == before
    assert alone(target)
    replace_folder(target, builder(NEW), own, force=True)
    assert told(target) == {**NEW, **MINE}
    assert alone(target)


def test_a_file_that_somebody_changed_stays_where_none_of_its_name_is_written(target: Path):
    (target / "page").write_text("with remarks")
    replace_folder(target, builder(NEW), own)
    assert told(target) == {**NEW, **MINE, "page": "with remarks"}


def test_a_folder_of_others_is_refused_and_with_force_written_into(tmp_path: Path):
    place = tmp_path / "thesis"
    place.mkdir()
    (place / "chapter.tex").write_text("mine")
    with pytest.raises(RequestError, match=r"the folder holds other files \(chapter.tex\).*force=True"):
        check_folder(place, NEW, own)
    (place / sorted(NEW)[0]).write_text("mine, too")
    with pytest.raises(RequestError, match=rf"force=True to write beside them and over {sorted(NEW)[0]}$"):
        check_folder(place, NEW, own)
    (place / sorted(NEW)[0]).unlink()
    with pytest.raises(RequestError, match="the folder holds other files"):
        replace_folder(place, builder(NEW), own)
    replace_folder(place, builder(NEW), own, force=True)
    assert told(place) == {**NEW, "chapter.tex": "mine"}
    (place / "c").unlink()
    (place / "c").mkdir()
    with pytest.raises(RequestError, match="it holds a folder c, where a file is to be written"):
        replace_folder(place, builder(NEW), own, force=True)


def test_a_file_that_comes_while_the_folder_is_replaced_is_kept(target: Path, monkeypatch: pytest.MonkeyPatch):
    real = os.rename

    def late(one: Path, other: Path) -> None:
        (target / "late.txt").write_text("just saved")
        real(one, other)

    monkeypatch.setattr(os, "rename", late)
    replace_folder(target, builder(NEW), own)
    assert told(target) == {**NEW, **MINE, "late.txt": "just saved"}
    assert alone(target)


def test_a_move_that_fails_is_ended_by_the_next_call(target: Path, monkeypatch: pytest.MonkeyPatch):
    real = os.replace

    def full(one: Path, other: Path) -> None:
        if Path(other) == target / "c":
            raise OSError(28, "No space left on device")
        real(one, other)

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", full)
        with pytest.raises(OSError, match="No space left"):
            replace_folder(target, builder(NEW), own)
    finish_move(target)
    assert told(target) == {**NEW, **MINE}
    assert alone(target)


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_a_failure_leaves_the_old_folder_and_nothing_else(target: Path, error: BaseException):
    def build(work: Path) -> list[str]:
        write_text(work / "a", "half")
        raise error

    before = told(target)
    with pytest.raises(type(error)):
        replace_folder(target, build, own)
    assert told(target) == before
    assert alone(target)


def test_what_a_living_process_writes_is_left_alone(target: Path):
    seen = []

    def build(work: Path) -> list[str]:
        if os.fork() == 0:  # another process comes to tidy up
            recover(target)
            os._exit(0)
        os.wait()
        seen.append(work.is_dir())
        return builder(NEW)(work)

    replace_folder(target, build, own)
    assert seen == [True]
    assert told(target) == {**NEW, **MINE}


def test_of_several_at_once_one_wins_whole(target: Path):
    contents = [{name: f"{name} of {k}" for name in NEW} for k in range(6)]
    children = []
    for content in contents:
        child = os.fork()
        if child == 0:
            code = 1
            try:
                for _ in range(10):
                    replace_folder(target, builder(content), own)
                code = 0
            finally:
                os._exit(code)
        children.append(child)
    seen = []
    while len(seen) < 200:
        seen.append((target / "a").is_file() or not target.is_dir())
    codes = [os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) for child in children]
    assert codes == [0] * 6
    assert all(seen)
    assert {k: v for k, v in told(target).items() if k not in MINE} in contents
    assert {name: told(target)[name] for name in MINE} == MINE
    recover(target)
    assert alone(target)


def test_a_link_stays_a_link(target: Path):
    link = target.parent / "latest"
    link.symlink_to("run")
    replace_folder(link, builder(NEW), own)
    assert link.is_symlink()
    assert told(target) == {**NEW, **MINE}


def test_the_working_folder_stays_the_same_folder(target: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(target)
    node = target.stat().st_ino
    replace_folder(Path("."), builder(NEW), own)
    assert told(target) == {**NEW, **MINE}
    assert target.stat().st_ino == node
    assert alone(target)


def test_an_empty_folder_keeps_its_mode(tmp_path: Path):
    (tmp_path / "run").mkdir(mode=0o750)
    replace_folder(tmp_path / "run", builder(NEW), own)
    assert (tmp_path / "run").stat().st_mode & 0o777 == 0o750
    replace_folder(tmp_path / "run", builder(OLD), own)
    assert (tmp_path / "run").stat().st_mode & 0o777 == 0o750


def test_a_folder_is_held_by_one_process(target: Path):
    with hold_folder(target, "trains in"):
        child = os.fork()
        if child == 0:
            try:
                with hold_folder(target, "trains in"):
                    os._exit(0)
            except RequestError:
                os._exit(7)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7


def test_a_place_that_cannot_be_written_is_told_at_once(tmp_path: Path):
    with pytest.raises(OSError, match="No such file"):
        check_folder(Path("/proc/run"), NEW, own)
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match="it is a file"):
        check_folder(tmp_path / "file", NEW, own)
    check_folder(tmp_path / "run", NEW, own)
    assert os.listdir(tmp_path) == ["file"]
