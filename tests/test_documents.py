"""Every page does what it says: its commands run, its code runs, its files are read, its links lead somewhere."""

import json
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest
import typer.main
from document_blocks import CHEAPER, PLACEHOLDERS, RECORDED, Reader, Shared
from documents import anchors, blocks, code_spans, documents, links, off_site, on_site, prose, words
from places import ROOT
from verbs import done

from undertow.__main__ import app

DOCUMENTS = documents()
ELSEWHERE = {
    "docs/extending.md": ("physics/", "residuals/", "measurements/", "reports/", "exports/"),
}
"""Blocks whose first line names a file below these folders are put into a copy of the package by test_extending.py."""
QUICKSTART = "README.md"
"""Its Python is examples/quickstart.py, which test_examples.py runs, with what it prints."""
LANGUAGES = {"sh", "python", "yaml", "toml", "text", "xml", "math"}
MOST_WORDS = 60_000
"""Of the whole site, docstrings apart: what an engineer could read in a week of evenings."""
MOST_OF_METHOD = 2_600
MOST_OF_DECISIONS = 22_000
"""An evening and a half; the index is a tenth of it."""
VERBS = set(typer.main.get_group(app).commands)


def to_follow(page: str) -> list:
    """The blocks of a page that are followed here."""
    return [
        block
        for block in blocks(page)
        if not (block.file and block.file.startswith(ELSEWHERE.get(page, ("nowhere/",))))
        and not (page == QUICKSTART and block.language in ("python", "text"))
        and block.language not in ("xml", "math")  # of other programs; the tests of exports look at it
    ]


PAGES = [page for page in DOCUMENTS if to_follow(page)]


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Shared:
    return Shared(tmp_path_factory.mktemp("shared"))


@pytest.mark.parametrize("page", PAGES)
def test_what_a_page_says_can_be_done(
    page: str, shared: Shared, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    for name in ("data", "examples"):
        (tmp_path / name).symlink_to(ROOT / name)
    reader = Reader(shared)
    for block in to_follow(page):
        reader.follow(block)
    assert reader.ran == len(to_follow(page)) > 0


def test_the_pages_that_people_follow_are_among_these():
    followed = {"README.md", "docs/start.md", "docs/command_line.md", "docs/formats.md", "docs/extending.md"}
    assert followed <= set(PAGES)
    assert len([page for page in PAGES if page.startswith("docs/tutorials/")]) >= 6
    assert len([page for page in PAGES if page.startswith("docs/howto/")]) >= 4


@pytest.mark.parametrize("page", DOCUMENTS)
def test_every_block_says_what_it_is(page: str):
    assert {block.language for block in blocks(page)} <= LANGUAGES
    text = (ROOT / page).read_text(encoding="utf-8")
    assert text.count("\n```") % 2 == 0, "a block that is not closed"


def test_every_stand_in_is_needed():
    words = " ".join(block.text for page in DOCUMENTS for block in blocks(page) if block.language == "sh").split()
    assert [word for word in (*PLACEHOLDERS, *RECORDED, *CHEAPER) if word not in words] == []


def test_a_command_that_is_not_there_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    reader = Reader(Shared(tmp_path))
    (block,) = [one for one in blocks("README.md") if "make demo" in one.text]
    reader.follow(block)
    for wrong in ("make nothing", "python examples/nothing.py", "undertow nothing", "pip install 'undertow[nothing]'"):
        with pytest.raises(AssertionError):
            reader.follow(type(block)("sh", wrong + "\n", 1))
    reader.said = "position 5.34 m\nyaw 0.10"
    reader.follow(type(block)("text", "position 5.33 m\n", 1))
    with pytest.raises(AssertionError, match="was not printed"):
        reader.follow(type(block)("text", "position 6.34 m\n", 1))


# Links


@pytest.mark.parametrize("page", DOCUMENTS)
def test_links_lead_somewhere(page: str):
    for target in links(page):
        place, _, anchor = target.partition("#")
        if re.match(r"\w+:", target):
            assert re.fullmatch(r"https?://[\w-]+(\.[\w-]+)+(/[\w./~%+-]*)?(#[\w-]+)?", target), target
            continue
        path = ((ROOT / page).parent / place).resolve() if place else ROOT / page
        assert path.exists(), f"{page} links to {target}, which is not there"
        assert path.is_relative_to(ROOT), f"{page} links to {target}, outside of the repository"
        if anchor:
            assert anchor in anchors(path.relative_to(ROOT).as_posix()), f"{page} links to {target}: no such heading"


def test_every_decision_has_a_row_with_its_status():
    text = (ROOT / "docs" / "decisions.md").read_text(encoding="utf-8")
    index, *themes = re.split(r"^## ", text, flags=re.MULTILINE)[1:]
    rows = dict(re.findall(r"^- \[(.+?)\]\(#[\w-]+\): (.+)$", index, re.MULTILINE))
    gone = dict(re.findall(r"^- ([^\[].*?): (replaced|withdrawn)\b", index, re.MULTILINE))
    assert list(rows) == re.findall(r"^### (.+)$", "\n".join(themes), re.MULTILINE)
    assert re.findall(r"^\*\*(.+)\*\*$", index, re.MULTILINE) == [theme.split("\n", 1)[0] for theme in themes]
    assert [row for row, status in rows.items() if not re.match(r"holds\b|holds in part: ", status)] == []
    assert len(rows) + len(gone) == len(re.findall(r"^- ", index, re.MULTILINE))
    assert len(text.split()) < MOST_OF_DECISIONS, "shorten an entry, or take out one that is replaced"


def test_there_are_links_to_check():
    assert sum(len(links(page)) for page in DOCUMENTS) > 200
    assert any("#" in link for page in DOCUMENTS for link in links(page))


def test_every_page_of_the_site_can_be_reached_from_the_index():
    lists = ("docs/index.md", "docs/reference.md")
    listed = {((ROOT / page).parent / link).resolve() for page in lists for link in links(page)}
    assert {page for page in on_site() if (ROOT / page).resolve() not in listed} == {"docs/index.md"}
    assert "docs/index.md" in links("README.md")


def test_pages_for_developers_are_not_on_the_site():
    assert {"docs/decisions.md", "docs/history.md", "docs/architecture.md"} <= off_site() <= set(DOCUMENTS)
    assert not {f"docs/{link}" for link in links("docs/index.md")} & off_site()
    assert "CONTRIBUTING.md" in links("README.md")
    settings = (ROOT / "docs" / "conf.py").read_text(encoding="utf-8")
    pattern = re.search(r'DEVELOPERS = re.findall\(r"(.+?)", CONTRIBUTING', settings)
    assert pattern, "docs/conf.py leaves out what CONTRIBUTING.md lists"
    told = re.findall(pattern[1], (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert {f"docs/{name}" for name in told} == off_site()


def test_the_site_can_be_read():
    counted = {page: words(page) for page in on_site()}
    longest = sorted(counted, key=lambda page: -counted[page])[:5]
    assert sum(counted.values()) < MOST_WORDS, f"shorten a page, or list it in CONTRIBUTING.md; the longest: {longest}"
    assert counted["docs/method.md"] < MOST_OF_METHOD


@pytest.mark.parametrize("page", DOCUMENTS)
def test_notes_on_who_wrote_a_page_stand_at_its_foot(page: str):
    lines = (ROOT / page).read_text(encoding="utf-8").rstrip("\n").splitlines()
    assert not [line for line in lines[:-1] if line.startswith("Written by") and "do not edit" in line]


# What README must say


def test_the_readme_fits_a_screen_and_a_half_and_says_what_it_cannot():
    readme, limits = prose("README.md"), prose("docs/limits.md")
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 90
    for figure in ("four of 1,299 fresh logs", "no rudders"):
        assert figure in readme
    for figure in ("four of 1,299 fresh logs", "two rudders", "94 of 100"):
        assert figure in limits


# Verbs


@pytest.mark.parametrize("page", DOCUMENTS)
def test_every_verb_that_is_named_is_there(page: str):
    shown = [block.text for block in blocks(page) if block.language == "sh"]
    named = {verb for text in (*shown, *code_spans(page)) for verb in re.findall(r"\bundertow ([a-z]+)\b", text)}
    assert named <= VERBS


def test_every_verb_has_its_help_and_its_line_on_the_page_of_commands():
    told = prose("docs/command_line.md")
    assert len(VERBS) > 10
    for verb in VERBS:
        assert f"| `{verb}` |" in told, f"docs/command_line.md has no line for {verb}"
        assert "--help" in done(verb, "--help")


# What scripts write


def test_the_reference_lists_what_the_package_offers():
    told = runpy.run_path(str(ROOT / "docs" / "reference.py"))["pages"]()
    assert set(told) == {"reference.md", *(f"reference/{path.name}" for path in (ROOT / "docs/reference").glob("*"))}
    for path, text in told.items():
        assert text == (ROOT / "docs" / path).read_text(encoding="utf-8"), "run python docs/reference.py"
        assert "| |" not in text


def test_notebooks_are_kept_without_what_they_print():
    notebooks = [page for page in DOCUMENTS if page.endswith(".ipynb")]
    assert notebooks
    for page in notebooks:
        for cell in json.loads((ROOT / page).read_text(encoding="utf-8"))["cells"]:
            assert cell.get("outputs", []) == []
            assert cell.get("execution_count") is None


def test_the_gallery_shows_what_is_drawn_today(tmp_path: Path):
    command = [sys.executable, str(ROOT / "docs" / "gallery.py"), str(tmp_path)]
    subprocess.run(command, check=True, capture_output=True, cwd=tmp_path)
    drawn = {path.name for path in tmp_path.glob("plot_*.svg")}
    assert drawn == {path.name for path in (ROOT / "docs" / "gallery").glob("*.svg")} != set()
    for name in drawn:
        shown, today = (lettering(folder / name) for folder in (ROOT / "docs" / "gallery", tmp_path))
        assert shown == today, "run python docs/gallery.py"
        assert f"gallery/{name}" in links("docs/gallery.md")


def lettering(picture: Path) -> list[str]:
    """The words in a picture, without its numbers."""
    texts = re.findall(r">([^<>]+)</text>", picture.read_text(encoding="utf-8"))
    return [words for text in texts if (words := re.sub(r"[-−]?\d+\.?\d*", "#", text).strip()) != "#"]
