"""The documents: their fenced blocks, links and headings, and the cells of their notebooks."""

import json
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from places import ROOT

_FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
_NAMED = re.compile(r"# ([\w./-]+\.(?:py|toml|yaml))\n")


@dataclass(frozen=True, slots=True)
class Block:
    """A fenced block of a page; `file` is the name that its first line gives it, or empty."""

    language: str
    text: str
    line: int

    @property
    def file(self) -> str:
        named = _NAMED.match(self.text)
        return named[1] if named else ""


def documents() -> list[str]:
    """Every page, and every notebook, relative to the root."""
    pages = [
        *(ROOT / f"{name}.md" for name in ("README", "CONTRIBUTING", "CHANGELOG", "SECURITY", "CODE_OF_CONDUCT")),
        *(ROOT / "docs").rglob("*.md"),
        *(ROOT / "docs").rglob("*.ipynb"),
    ]
    return sorted(path.relative_to(ROOT).as_posix() for path in pages)


def blocks(page: str) -> list[Block]:
    """The fenced blocks of a page, or the cells of code of a notebook."""
    text = (ROOT / page).read_text(encoding="utf-8")
    if page.endswith(".ipynb"):
        return [Block("python", "".join(cell["source"]), 0) for cell in json.loads(text)["cells"] if _is_code(cell)]
    return [Block(found[1], found[2], text.count("\n", 0, found.start()) + 1) for found in _FENCE.finditer(text)]


def _is_code(cell: dict[str, object]) -> bool:
    return cell["cell_type"] == "code"


def prose(page: str) -> str:
    """A page without its fenced blocks; of a notebook, its cells of text."""
    text = (ROOT / page).read_text(encoding="utf-8")
    if page.endswith(".ipynb"):
        return "\n\n".join("".join(cell["source"]) for cell in json.loads(text)["cells"] if not _is_code(cell))
    return _FENCE.sub("", text)


def off_site() -> set[str]:
    """The pages that `CONTRIBUTING.md` lists: they are for developers, and not on the site."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    return set(re.findall(r"^- \[[^\]]+\]\((docs/[^)#]+)\)", text, re.MULTILINE))


def on_site() -> list[str]:
    """The pages and notebooks that the site is made of."""
    return [page for page in documents() if page.startswith("docs/") and page not in off_site()]


def words(page: str) -> int:
    """How many words a page has, those in blocks, tables and formulas too, without the targets of links."""
    text = (ROOT / page).read_text(encoding="utf-8")
    if page.endswith(".ipynb"):
        text = "\n".join("".join(cell["source"]) for cell in json.loads(text)["cells"])
    return sum(bool(re.search(r"\w", word)) for word in re.sub(r"\]\([^)]*\)", "]", text).split())


def links(page: str) -> list[str]:
    """Where the links and pictures of a page lead."""
    return _LINK.findall(re.sub(r"`[^`\n]*`", "", prose(page)))


def anchors(page: str) -> set[str]:
    """What a link may name after `#` in a page: its headings in small letters, blanks as dashes."""
    seen: Counter[str] = Counter()
    found = set()
    for heading in re.findall(r"^#+ (.*)$", prose(page), re.MULTILINE):
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").strip().lower()
        slug = re.sub(r"[^\w\- ]", "", words).replace(" ", "-")
        found.add(f"{slug}-{seen[slug]}" if seen[slug] else slug)
        seen[slug] += 1
    return found


def code_spans(page: str) -> Iterator[str]:
    """What stands between backticks in the prose of a page."""
    yield from re.findall(r"`([^`\n]+)`", prose(page))
