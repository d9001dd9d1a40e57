"""The files of a run folder, and how it shows which of them are undertow's and unchanged: by digests in `run.json`."""

import hashlib
import os
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from ...physics.file_marks import written_by
from ...physics.files import strict_json, write_json
from ...physics.reading import BLOCK, read_json

COMPARE = "compare"
"""The `verb` in the `run.json` of a comparison; that of a run has none."""
RUN_SCHEMA = "undertow.run/1"
RECORD, PAGE, PDF = "run.json", "report.html", "report.pdf"
_SCHEMAS = {
    "findings.json": "findings",
    "comparison.json": "comparison",
    "audit.json": "audit",
    "inspection.json": "inspections",
    "standardisation.json": "standardisation",
    RECORD: "run",
}
_VERSIONS = ("1", "2")
VIEWED = ("series.mcap", "series.foxglove.json", "series.plotjuggler.xml")
"""For viewers: a series, and how each shows it."""
DATA = (*(name for name in _SCHEMAS if name != RECORD), "model.yaml", "nominal.yaml", "series.csv", *VIEWED)
"""What the pages are made of."""
RUN_FILES = (*DATA, RECORD, PAGE, PDF)
"""What a run folder holds; what is for viewers and the pages may be left out."""


def is_run(folder: str | os.PathLike[str]) -> bool:
    """Whether a folder holds a run, be it whole or damaged."""
    return any(_of_schema(Path(folder) / name) for name in (RECORD, "findings.json"))


def is_comparison(folder: str | os.PathLike[str]) -> bool:
    """Whether a folder holds what `compare --page` wrote, and not a run: its `run.json` says so."""
    return _content(Path(folder) / RECORD).get("verb") == COMPARE


def own_run(folder: Path) -> set[str]:
    """Names of the files of a run in a folder that undertow wrote and nobody changed since.

    Those that `run.json` has digests of must agree with them; pages bear their own marks. In a run of an earlier
    version, which has no digests, only JSON shows by its schema whose it is.
    """
    return own_report(folder) if _of_schema(folder / RECORD) else set()


def own_report(folder: Path) -> set[str]:
    """The same of a folder that may lack `run.json`, which a page does not need."""
    record = _content(folder / RECORD)
    pages = {name for name in (PAGE, PDF) if (written_by(folder / name) or "").startswith("report")}
    digests = record.get("files")
    if not isinstance(digests, dict):
        return pages | {name for name in _SCHEMAS if _of_schema(folder / name)}
    held = {name for name in DATA if name in digests and _digest(folder / name) == digests[name]}
    return pages | held | {RECORD} if digests.get(RECORD) == _own_digest(record) else pages | held


def seal(folder: Path, record: Mapping[str, Any], names: Collection[str]) -> None:
    """Write `run.json` with the digests of files in the folder, and of itself without its own digest.

    Parameters
    ----------
    record : what it says else; digests in it stay, but for those of `names`
    names : of the files that are new
    """
    files = {name: digest for name, digest in record.get("files", {}).items() if name not in (RECORD, *names)}
    new = {name: _digest(folder / name) for name in DATA if name in names}
    files = {name: {**files, **new}[name] for name in DATA if {**files, **new}.get(name) is not None}
    sealed = {**record, "files": files}
    write_json(folder / RECORD, {**sealed, "files": {**files, RECORD: _own_digest(sealed)}})


def reseal(folder: Path, names: Collection[str]) -> bool:
    """Bring `run.json` up to date, where it has digests, when files were written anew; True when it was changed."""
    record = _content(folder / RECORD)
    if not isinstance(record.get("files"), dict):
        return False
    seal(folder, record, names)
    return True


def _own_digest(record: Mapping[str, Any]) -> str:
    files = {name: digest for name, digest in record["files"].items() if name != RECORD}
    return hashlib.sha256(strict_json({**record, "files": files}).encode("utf-8")).hexdigest()


def _of_schema(path: Path) -> bool:
    """Whether a file holds what its name says, of this or an earlier version."""
    kind, _, version = str(_content(path).get("schema")).rpartition("/")
    return kind == f"undertow.{_SCHEMAS[path.name]}" and version in _VERSIONS


def _content(path: Path) -> dict[str, Any]:
    """A JSON object, empty for anything else."""
    try:
        content = read_json(path)
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def _digest(path: Path) -> str | None:
    digest = hashlib.sha256()
    try:
        with path.open("rb") as stream:
            while chunk := stream.read(BLOCK):
                digest.update(chunk)
    except OSError:
        return None
    return digest.hexdigest()
