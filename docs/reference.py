"""Write reference.md: what `import undertow` offers, and the files that people extend, each with its first sentence.

Run `python docs/reference.py` after a public name has been added; a test compares the page with the code. The site puts
the whole docstrings below it (`conf.py`).
"""

import ast
import inspect
import sys
from importlib import import_module
from itertools import pairwise
from pathlib import Path

import undertow

PAGE = Path(__file__).with_name("reference.md")
PACKAGES = (
    "physics.effects",
    "physics.laws.audit.base",
    "residuals.models.base",
    "residuals.networks.base",
    "measurements.formats.base",
    "measurements.quality.finding",
    "reports.page.chapters.base",
    "physics.worlds.world",
)
"""Files beside which, or in which, people add something of their own; see extending.md."""


def public_names() -> tuple[str, ...]:
    """What the root of the package offers, functions first."""
    return tuple(sorted(undertow.__all__, key=lambda name: (_kind(name) != "function", _kind(name) == "data", name)))


def directive(name: str) -> str:
    """What autodoc is asked for a public name."""
    kind = _kind(name)
    more = "\n   :no-value:" if kind == "data" else "\n   :members:" if kind == "class" else ""
    return f".. auto{kind}:: undertow.{name}{more}"


def _kind(name: str) -> str:
    thing = getattr(undertow, name)
    return "class" if inspect.isclass(thing) else "function" if callable(thing) else "data"


def told(name: str) -> str:
    """The first paragraph of a name's docstring, on one line."""
    thing = getattr(undertow, name)
    text = (inspect.getdoc(thing) or "") if _kind(name) != "data" else below_assignment(name)
    return " ".join(text.split("\n\n")[0].split()).replace("|", "\\|")


def below_assignment(name: str) -> str:
    """The text that stands below a constant."""
    home = undertow._PUBLIC[name].partition(":")[0]
    body = ast.parse(Path(import_module(f"undertow.{home}").__file__ or "").read_text(encoding="utf-8")).body
    for node, after in pairwise(body):
        named = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        if any(isinstance(one, ast.Name) and one.id == name for one in named):
            match after:
                case ast.Expr(value=ast.Constant(value=str() as text)):
                    return text
    return ""


def page() -> str:
    """The whole page."""
    rows = [f"| `undertow.{name}` | {told(name)} |" for name in public_names()]
    files = {name.replace(".", "/") + ".py": import_module(f"undertow.{name}") for name in PACKAGES}
    more = [f"| [`{path}`](../{path}) | {(module.__doc__ or '').splitlines()[0]} |" for path, module in files.items()]
    return "\n".join(
        [
            "# Reference",
            "Written by `python docs/reference.py` from the docstrings; do not edit. `help(undertow.discover)` shows",
            "one of them whole, `make docs` all of them below these tables.",
            "",
            "## What `import undertow` offers",
            "| name | what it is |",
            "| --- | --- |",
            *rows,
            "",
            "## Where people extend it",
            "[extending.md](extending.md) adds one thing of each kind.",
            "",
            "| file | what it is |",
            "| --- | --- |",
            *more,
            "",
        ]
    )


if __name__ == "__main__":
    if "--text" in sys.argv:
        print(page(), end="")
    else:
        PAGE.write_text(page(), encoding="utf-8")
        print("docs/reference.md written")
