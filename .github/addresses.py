"""Write the address of the repository into README.md and pyproject.toml, for the page on PyPI.

    python .github/addresses.py REPOSITORY TAG

The sources name no address: links and pictures of the README lead to files beside it, which PyPI does not show. A
release runs this in its own checkout, after it has looked whether tag, version, citation and changelog agree.
"""

import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LINK = re.compile(r"(!?)\[((?:[^\[\]]|!\[[^\]]*\]\([^)]*\))*)\]\((?!\w+:|#)([^)\s]+)\)")
"""A link or a picture that leads to a file of the repository."""


def disagreements(root: Path, tag: str) -> list[str]:
    """What a release of this tag would say wrongly of its version."""
    version = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    cited = re.search(r"^version: (.+)$", (root / "CITATION.cff").read_text(encoding="utf-8"), re.MULTILINE)
    newest = re.search(r"^## (\S+), (.+)$", (root / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    wrong = []
    if tag != f"v{version}":
        wrong.append(f"the tag is {tag}, pyproject.toml says {version}: the tag should be v{version}")
    if not cited or cited[1] != version:
        wrong.append(f"CITATION.cff says {cited and cited[1]}, pyproject.toml {version}")
    if not newest or newest[1] != version or not re.fullmatch(r"\d{4}-\d\d-\d\d", newest[2]):
        wrong.append(f"CHANGELOG.md should begin with '## {version}, YYYY-MM-DD', and has '{newest and newest[0]}'")
    return wrong


def absolute(page: str, repository: str, tag: str) -> str:
    """The page with the whole address of every file that it links to or shows."""

    def whole(found: re.Match[str]) -> str:
        mark, words, path = found.groups()
        return f"{mark}[{words}]({repository}/{'raw' if mark else 'blob'}/{tag}/{path})"

    return LINK.sub(whole, page)


def with_urls(project: str, repository: str) -> str:
    """The text of pyproject.toml with a table of addresses."""
    urls = {
        "Repository": repository,
        "Documentation": f"{repository}/blob/HEAD/docs/index.md",
        "Changelog": f"{repository}/blob/HEAD/CHANGELOG.md",
        "Issues": f"{repository}/issues",
    }
    table = "".join(f'{name} = "{address}"\n' for name, address in urls.items())
    before, scripts, after = project.partition("[project.scripts]\n")
    if not scripts or "[project.urls]" in project:
        raise SystemExit("pyproject.toml should have [project.scripts], and no [project.urls] yet")
    return f"{before}[project.urls]\n{table}\n{scripts}{after}"


def main(root: Path, repository: str, tag: str) -> None:
    """Look, and write both files."""
    if wrong := disagreements(root, tag):
        raise SystemExit("\n".join(wrong))
    for name, change in (
        ("README.md", lambda text: absolute(text, repository, tag)),
        ("pyproject.toml", lambda text: with_urls(text, repository)),
    ):
        path = root / name
        path.write_text(change(path.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main(ROOT, *sys.argv[1:])
