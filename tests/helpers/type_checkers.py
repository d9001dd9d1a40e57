"""pyright and mypy over a user's script, both as strict as they are."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

PLAIN = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "MYPYPATH")}
"""What this process is told about where modules lie is none of a user's settings."""


def by_pyright(*scripts: Path, python: str = sys.executable, beside: Path | None = None) -> list[list[str]]:
    """What pyright says of each script of a folder in strict mode: its errors, and types that are asked for.

    Parameters
    ----------
    python : whose packages are those of the scripts
    beside : folder that holds the package, where its installation does not tell type checkers of it
    """
    folder, names = scripts[0].parent, [script.name for script in scripts]
    settings = {"typeCheckingMode": "strict", "include": names, "extraPaths": [str(beside)] if beside else []}
    (folder / "pyrightconfig.json").write_text(json.dumps(settings), "utf-8")
    command = (sys.executable, "-m", "pyright", "--pythonpath", python, "--outputjson", "-p", str(folder))
    done = _run(command, folder, {"PYRIGHT_PYTHON_IGNORE_WARNINGS": "1"})
    answer = json.loads(done)
    assert answer["summary"]["filesAnalyzed"] == len(scripts), done
    said = [(Path(one["file"]).name, one["range"]["start"]["line"] + 1, one) for one in answer["generalDiagnostics"]]
    return [[f"{line}: {one['message']}" for file, line, one in said if file == name] for name in names]


def by_mypy(*scripts: Path, python: str = sys.executable, beside: Path | None = None) -> list[list[str]]:
    """What mypy says of each in strict mode, and where an expression of it has the type `Any`; see `by_pyright`."""
    pytest.importorskip("mypy")
    folder, names = scripts[0].parent, [script.name for script in scripts]
    found = f"mypy_path = {beside}\n[mypy-undertow.*]\nfollow_imports = silent\n" if beside else ""
    settings = folder / "mypy.ini"
    settings.write_text(f"[mypy]\nstrict = true\ndisallow_any_expr = true\n{found}", "utf-8")
    options = ("--config-file", str(settings), "--python-executable", python, "--no-error-summary")
    lines = _run((sys.executable, "-m", "mypy", *options, *names), folder, {}).splitlines()
    assert all(line.startswith(tuple(names)) for line in lines), lines
    return [[line for line in lines if line.startswith(name) and ": note:" not in line] for name in names]


def _run(command: tuple[str, ...], folder: Path, more: dict[str, str]) -> str:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=PLAIN | more, check=False)
    assert (done.stderr, done.returncode < 2) == ("", True), done.stdout + done.stderr
    return done.stdout
