"""pyright and mypy over a user's script, both as strict as they are."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

PLAIN = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "MYPYPATH")}
"""What this process is told about where modules lie is none of a user's settings."""


def by_pyright(script: Path, python: str = sys.executable, beside: Path | None = None) -> list[str]:
    """What pyright says of a script in strict mode: its errors, and types that are asked for.

    Parameters
    ----------
    python : whose packages are those of the script
    beside : folder that holds the package, where its installation does not tell type checkers of it
    """
    settings = {"typeCheckingMode": "strict", "include": [script.name], "extraPaths": [str(beside)] if beside else []}
    (script.parent / "pyrightconfig.json").write_text(json.dumps(settings), "utf-8")
    command = (sys.executable, "-m", "pyright", "--pythonpath", python, "--outputjson", "-p", str(script.parent))
    done = _run(command, script.parent, {"PYRIGHT_PYTHON_IGNORE_WARNINGS": "1"})
    answer = json.loads(done)
    assert answer["summary"]["filesAnalyzed"] == 1, done
    return [f"{one['range']['start']['line'] + 1}: {one['message']}" for one in answer["generalDiagnostics"]]


def by_mypy(script: Path, python: str = sys.executable, beside: Path | None = None) -> list[str]:
    """What mypy says of a script in strict mode, and where an expression of it has the type `Any`; see `by_pyright`."""
    pytest.importorskip("mypy")
    settings = script.parent / "mypy.ini"
    found = f"mypy_path = {beside}\n[mypy-undertow.*]\nfollow_imports = silent\n" if beside else ""
    settings.write_text(f"[mypy]\nstrict = true\ndisallow_any_expr = true\n{found}", "utf-8")
    options = ("--config-file", str(settings), "--python-executable", python, "--no-error-summary")
    done = _run((sys.executable, "-m", "mypy", *options, script.name), script.parent, {})
    return [line for line in done.splitlines() if ": note:" not in line]


def _run(command: tuple[str, ...], folder: Path, more: dict[str, str]) -> str:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=PLAIN | more, check=False)
    assert (done.stderr, done.returncode < 2) == ("", True), done.stdout + done.stderr
    return done.stdout
