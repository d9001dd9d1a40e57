"""Type checkers know every public name: a user's script has no `Any` in it, here as in the wheel."""

import ast
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from places import ROOT
from type_checkers import by_mypy, by_pyright

import undertow

SCRIPT = ROOT / "tests" / "helpers" / "user_script.py"


def typed_names() -> dict[str, str]:
    """Public names for type checkers, and what each is imported from."""
    tree = ast.parse((ROOT / "__init__.py").read_text("utf-8"))
    block = next(node for node in tree.body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING")
    names, under = {}, {}
    for node in block.body:
        match node:
            case ast.ImportFrom(module=str(module), names=[ast.alias(name=name, asname=told)], level=1):
                (names if told == name else under)[name] = module
            case ast.Assign(targets=[ast.Name(id=name)], value=ast.Name(id=called)):
                names[name] = f"{under[called]}:{called}"
    return names


@pytest.fixture
def beside(tmp_path: Path) -> Path:
    """A folder as the Makefile's .venv/typing: it holds the repository root under its package name."""
    folder = tmp_path / "typing"
    folder.mkdir()
    (folder / "undertow").symlink_to(ROOT)
    return folder


@pytest.fixture
def script(tmp_path: Path) -> Path:
    """A user's script."""
    return Path(shutil.copy(SCRIPT, tmp_path))


@pytest.fixture
def leaks(tmp_path: Path) -> Path:
    """The beginning of one that will use what has no type, or is not there."""
    path = tmp_path / "leaks.py"
    path.write_text("import undertow\n\nrun = undertow.discover(undertow.read_inputs('log.csv', 'boat.yaml'))\n")
    return path


def test_type_checkers_see_the_names_that_are_loaded() -> None:
    assert typed_names() == undertow._PUBLIC


def test_pyright_knows_every_public_name_and_no_other_and_finds_no_any_in_a_users_script(
    tmp_path: Path, beside: Path, script: Path, leaks: Path
) -> None:
    names = [*undertow._PUBLIC, "__version__"]
    asked = tmp_path / "asked.py"
    asked.write_text("\n".join(["import undertow", *(f"reveal_type(undertow.{n})" for n in names), "undertow.discovr"]))
    leaks.write_text(f"{leaks.read_text()}run.plot.forse()\nprint(run.findings.missing[0].uper())\n")
    answers, clean, leaked = by_pyright(asked, script, leaks, beside=beside)  # in one go: it reads the package once
    *told, unknown = [line for line in answers if "Expression value is unused" not in line]
    assert '"discovr" is not a known attribute of module "undertow"' in "\n".join([*told[-1:], unknown])
    types = {line.split('"')[1].removeprefix("undertow."): line.split('" is "')[1] for line in told if '" is "' in line}
    assert list(types) == names
    assert [n for n, t in types.items() if "Unknown" in t or "Any" in t.replace("tuple[Any, ...]", "")] == []
    assert "-> Run" in types["discover"], "a decorator keeps the signature"
    assert clean == []
    assert "forse" in "".join(leaked)


def test_mypy_finds_no_any_in_a_users_script(beside: Path, script: Path, leaks: Path) -> None:
    leaks.write_text(f"{leaks.read_text()}verdict = run.findings['verdict']\n")
    clean, leaked = by_mypy(script, leaks, beside=beside)
    assert clean == []
    assert 'has type "Any"' in "".join(leaked), "JSON has no other type, and a leak is found"


def test_the_users_script_runs(tmp_path: Path) -> None:
    command = [sys.executable, "-W", "error", str(SCRIPT)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "surge_quadratic_damping: X_uu [N s^2/m^2]" in done.stdout
