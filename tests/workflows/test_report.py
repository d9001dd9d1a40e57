"""The page of a run belongs to that run, also when another process replaces it meanwhile."""

from pathlib import Path
from types import ModuleType

import pytest

import undertow.workflows.report as module
from undertow.physics.errors import RequestError
from undertow.physics.folders import replace_folder


def written(run: Path, words: str) -> Path:
    """A run that takes the place of an earlier one."""

    def build(work: Path) -> list[str]:
        (work / "findings.json").write_text(words)
        return ["findings.json"]

    replace_folder(run, build, lambda folder: ["findings.json"])
    return run


def replaced_once(module: ModuleType, monkeypatch: pytest.MonkeyPatch, run: Path) -> list[str]:
    """Let the first page that is made see its run replaced; the list tells of what each page was made."""
    made: list[str] = []

    def page_of(folder: Path) -> str:
        words = (folder / "findings.json").read_text()
        if not made:
            written(run, "new")
        made.append(words)
        return f"<!DOCTYPE html>{words}"

    monkeypatch.setattr(module, "page_of", page_of)
    return made


def test_a_page_is_made_again_where_its_run_was_replaced_meanwhile(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = written(tmp_path / "run", "old")
    made = replaced_once(module, monkeypatch, run)
    module._rewrite(run)
    assert made == ["old", "new"]
    assert (run / "report.html").read_text().endswith("new")


def test_a_run_that_was_replaced_meanwhile_is_not_replaced_by_its_forerunner(tmp_path: Path) -> None:
    run = written(tmp_path / "run", "old")
    seen = module._version(run)
    written(run, "new")
    with pytest.raises(RequestError, match="another process has replaced .* meanwhile"):
        module._replace(run, seen, None, None, False)
    assert [path.name for path in run.iterdir()] == ["findings.json"]
    assert (run / "findings.json").read_text() == "new"
