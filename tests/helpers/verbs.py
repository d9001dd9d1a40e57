"""Running the command line in tests."""

import json
import os
import re
import subprocess
import sysconfig
from math import isclose
from pathlib import Path
from typing import Any, NoReturn

from places import ROOT
from typer.testing import CliRunner, Result

from undertow.__main__ import app

SCRIPT = Path(sysconfig.get_path("scripts"), "undertow")
"""The command that users type."""


def call(*words: str | Path) -> Result:
    """Run the command line in this process."""
    return CliRunner().invoke(app, [str(word) for word in words])


def done(*words: str | Path) -> str:
    """Run the command line, expect it to succeed, and give back what it printed."""
    result = call(*words)
    assert (result.exit_code, result.exception) == (0, None), result.stderr
    return result.stdout


def inspected(*words: str | Path) -> str:
    """Run `inspect`, whose exit code says whether the log has a defect, and give back what it printed."""
    result = call(*words)
    assert result.exit_code in (0, 1), result.output
    assert result.exit_code == 0 or isinstance(result.exception, SystemExit), repr(result.exception)
    return result.stdout


def strict(text: str) -> Any:
    """Read JSON as RFC 8259 has it, without NaN and Infinity."""

    def refuse(constant: str) -> NoReturn:
        raise AssertionError(f"{constant} is not JSON")

    return json.loads(text, parse_constant=refuse)


def nearly(one: Any, other: Any) -> bool:
    """Whether two contents of JSON are alike up to where a search began: relatively one in a hundred."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(nearly(one[key], other[key]) for key in one)
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(nearly, one, other))
    if isinstance(one, float) and isinstance(other, float):
        return isclose(one, other, rel_tol=1e-2, abs_tol=1e-3)
    return bool(one == other)


def process(*words: str | Path, cwd: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the command line as users do, in a process of its own."""
    return subprocess.run(
        [str(word) for word in words],
        cwd=cwd,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        encoding="utf-8",
        errors="replace",
        check=False,
    )


def files(folder: Path) -> dict[str, bytes | None]:
    """Everything below a folder, hidden and temporary files too."""
    return {p.relative_to(folder).as_posix(): p.read_bytes() if p.is_file() else None for p in folder.rglob("*")}


def refused(*words: str | Path, match: str) -> str:
    """Run the command line in an unchanged working folder, and expect one clear message."""
    assert Path.cwd() != ROOT, "every file of the repository would be read"
    before = files(Path.cwd())
    result = call(*words)
    assert isinstance(result.exception, SystemExit), repr(result.exception)
    assert (result.exit_code, result.stdout) == (2, ""), result.output
    progress = [line for line in result.stderr.splitlines() if line.startswith("  ")]
    (message,) = [line for line in result.stderr.splitlines() if line not in progress]
    assert message.startswith("undertow: ")
    assert re.search(match, message), message
    assert files(Path.cwd()) == before
    return message
