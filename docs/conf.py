"""How Sphinx makes the site of these pages; `make docs` calls it.

The pages are plain Markdown and are read in the repository as they are. Two things are put in when the site is built:
its contents, which are the lists of `index.md` and `reference.md`, and the docstrings of the names that a page of the
reference lists. Pages for developers, those that `CONTRIBUTING.md` lists, are not on the site.
"""

import re
import shutil
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from reference import docstrings  # noqa: E402  (it lies beside this file)

project = "undertow"
author = "the developers of undertow"
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
root_doc = "index"
CONTRIBUTING = (HERE.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")
DEVELOPERS = re.findall(r"^- \[[^\]]+\]\(docs/([\w/]+\.md)\)", CONTRIBUTING, re.MULTILINE)
exclude_patterns = [*DEVELOPERS]  # extensions add their own
language = "en"

html_theme = "furo"
html_title = "undertow"
html_show_sphinx = False
html_show_copyright = False
html_copy_source = False
html_static_path = ["site"]
html_css_files = ["site.css"]

html_math_renderer = "mathml"  # browsers set it themselves: no script, no network
myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath"]
myst_dmath_allow_labels = False
myst_fence_as_directive = ["math"]
nb_execution_mode = "force"
nb_execution_timeout = 120
nb_execution_raise_on_error = True
nb_output_stderr = "remove"  # progress
nb_execution_in_temp = True  # what a notebook writes is no page

suppress_warnings = ["ref.python"]  # `name` is an attribute of many
default_role = "literal"  # our docstrings quote code with single backticks
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False

NODES, MATHML = (import_module(f"docutils.{name}") for name in ("nodes", "utils.math.latex2mathml"))
"""Sphinx brings docutils; where types are checked there is none."""
DRAWN = HERE.parent / "build" / "drawn"
"""Where `make docs` draws the pictures of the gallery anew."""


def contents(text: str) -> str:
    """The contents of a page that lists others: a caption for each heading, and the pages of the list below it."""
    parts = []
    for section in re.split(r"^## ", text, flags=re.MULTILINE)[1:]:
        caption, _, body = section.partition("\n")
        pages = re.findall(r"^- \[[^\]]+\]\(([^)#]+)\.(?:md|ipynb)\)", body, re.MULTILINE)
        if pages:
            parts += ["```{toctree}", ":hidden:", f":caption: {caption}", "", *pages, "```", ""]
    return "\n".join(parts)


def complete(app: Any, page: str, source: list[str]) -> None:
    """Put contents and docstrings into the pages that have them on the site alone; name pages that are not on it."""
    for name in DEVELOPERS:
        source[0] = re.sub(rf"\[([^\]]+)\]\((?:\.\./)*{name}(?:#[^)]*)?\)", rf"\1 (`docs/{name}`)", source[0])
    if page in ("index", "reference"):
        source[0] += "\n\n" + contents(source[0])
    elif page.startswith("reference/"):
        tables, foot, written = source[0].rpartition("\nWritten by ")
        told = docstrings(page.removeprefix("reference/"))
        source[0] = f"{tables}\n## In full\n\n```{{eval-rst}}\n{told}\n```\n{foot}{written}"


def plain(app: Any, what: str, name: str, thing: object, options: object, lines: list[str]) -> None:
    """Say to Sphinx what our docstrings mean: `name : words` has no type in it, and bars are moduli, |u|."""
    section, told = "", []
    for line, below in zip(lines, [*lines[1:], ""], strict=True):
        section = line.strip() if set(below.strip()) == {"-"} else section
        if section in ("Parameters", "Attributes") and (found := re.fullmatch(r"(\*{0,2}\w[\w, *]*) : (.+)", line)):
            told += [found[1], f"    {found[2]}"]
        else:
            told.append(line)
    quoted = (re.split(r"(`[^`]*`)", line) for line in told)
    lines[:] = ["".join(p if p.startswith("`") else re.sub(r"(?<!\\)\|", r"\\|", p) for p in parts) for parts in quoted]


def set_inline(writer: Any, node: Any) -> None:
    """Set a formula within a line, as MathML."""
    writer.body.append(MATHML.tex2mathml(node.astext()))
    raise NODES.SkipNode


def set_apart(writer: Any, node: Any) -> None:
    """Set a formula on lines of its own, as MathML."""
    writer.body.append(f'<div class="math">{MATHML.tex2mathml(node.astext(), as_block=True)}</div>\n')
    raise NODES.SkipNode


def fresh_pictures(app: Any, error: Exception | None) -> None:
    """Put the pictures that were drawn for this build in the place of those in the repository."""
    if error is None and DRAWN.is_dir():
        for picture in DRAWN.glob("*.svg"):
            target = Path(app.outdir) / "_images" / picture.name
            assert target.is_file(), f"{picture.name} is drawn, and no page shows it"
            shutil.copy(picture, target)


def setup(app: Any) -> None:
    """Connect the above."""
    app.connect("source-read", complete)
    app.connect("autodoc-process-docstring", plain, priority=400)  # before napoleon
    app.connect("build-finished", fresh_pictures)
    app.add_html_math_renderer("mathml", inline_renderers=(set_inline, None), block_renderers=(set_apart, None))
