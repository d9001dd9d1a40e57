"""The package's source files, and what they import."""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from places import ROOT

NOT_PACKAGES = {"tests", "examples", "benchmarks", "docs", "build", "dist", "runs"}


def source_files() -> list[Path]:
    """Every source file of the package, relative to the root."""
    floors = (
        path for path in ROOT.iterdir() if path.is_dir() and path.name[0] != "." and path.name not in NOT_PACKAGES
    )
    inside = [*ROOT.glob("*.py"), *(path for floor in floors for path in floor.rglob("*.py"))]
    return sorted(path.relative_to(ROOT) for path in inside)


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse((ROOT / path).read_text(encoding="utf-8"), filename=str(path))


def absolute_imports(path: Path) -> Iterator[str]:
    """Dotted names that a file imports absolutely, at any depth, or asks `import_module` for."""
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.module or ""
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "import_module":
            named = [one.value for one in node.args if isinstance(one, ast.Constant) and isinstance(one.value, str)]
            yield from (name for name in named if not name.startswith("."))
