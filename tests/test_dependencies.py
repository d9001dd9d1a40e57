"""What the package imports is what pyproject.toml asks for: nothing undeclared, nothing unused."""

import re
import sys
import tomllib
from importlib.metadata import packages_distributions

from places import ROOT
from sources import absolute_imports, source_files

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
STANDARD = sys.stdlib_module_names | {"compression"}
"""Modules of Python itself, of its newer versions too."""
NOT_OURS = {"dev", "docs", "all"}
"""Extras that hold no dependency of the package: tools, what makes the site, and the other extras once more."""


def distribution(name: str) -> str:
    """Bare name of a requirement, as PEP 503 writes it."""
    return re.sub(r"[-_.]+", "-", re.split(r"[^\w.-]", name, maxsplit=1)[0]).lower()


def declared(*left_out: str) -> set[str]:
    extras = (needs for name, needs in PROJECT["optional-dependencies"].items() if name not in left_out)
    return {distribution(need) for needs in (PROJECT["dependencies"], *extras) for need in needs} - {"undertow"}


def imported() -> dict[str, set[str]]:
    """Top-level modules of others that the package imports, and the distributions that hold them."""
    holders = packages_distributions()
    names = {name.partition(".")[0] for path in source_files() for name in absolute_imports(path)}
    names |= {name for path in source_files() for name in re.findall(r'\brequired\("(\w+)"\)', path.read_text("utf-8"))}
    return {name: {distribution(one) for one in holders.get(name, [name])} for name in names - STANDARD}


def test_what_is_imported_is_declared_and_what_is_declared_is_imported():
    found, known = imported(), declared()
    assert {name for name, holders in found.items() if not holders & known} == set()
    assert declared(*NOT_OURS) - set().union(*found.values()) == set()
