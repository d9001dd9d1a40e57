"""What a file to be written may replace: only its own kind, and nothing that a run or a network consists of."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

_MCAP = b"\x89MCAP0\r\n"
"""How every MCAP file begins, and ends."""


def check_replaced(out: Path, kind: str) -> None:
    """Refuse to replace a file that is not of the kind that is written.

    Parameters
    ----------
    out : a file that is there
    kind : comparison, audit, series, vehicle, or other: anything outside of runs and networks

    Raises
    ------
    RequestError
        when the file is something else, or belongs to a run folder or a network.
    """
    from ..physics.errors import RequestError

    if not out.stat().st_size:
        return  # nothing is lost, and a script may have asked the system for the file
    wanted, is_one = _KINDS[kind]
    folder = out.absolute().parent
    if kind in ("vehicle", "other") and (folder / "findings.json").is_file():
        raise RequestError(f"{out} is in the run folder {folder.name}, whose files belong together; give another name")
    if not is_one(out):
        raise RequestError(f"{out} is there and is no {wanted}; give another name, so that it is not lost")


def _holds_schema(name: str) -> Callable[[Path], bool]:
    """Whether a file is JSON of a schema of undertow."""
    from ..physics.reading import read_json

    def is_one(path: Path) -> bool:
        try:
            content = read_json(path)
        except (OSError, ValueError):
            return False
        return isinstance(content, dict) and content.get("schema") == f"undertow.{name}/1"

    return is_one


def _is_series(path: Path) -> bool:
    try:
        with path.open("rb") as stream:
            return stream.read(len(_MCAP)) == _MCAP
    except OSError:
        return False


def _is_vehicle(path: Path) -> bool:
    """Whether a file describes a vehicle, be it one that can be used or not."""
    content = _yaml(path)
    return isinstance(content, dict) and {"mass", "thrusters"} <= content.keys()


def _is_outside(path: Path) -> bool:
    """Whether a file is no part of a network."""
    from ..residuals.neural import SETTINGS, WEIGHTS, is_network_folder

    return not (path.name in (SETTINGS, WEIGHTS) and is_network_folder(path.absolute().parent))


def _yaml(path: Path) -> Any:
    from ..physics.reading import read_yaml

    try:
        return read_yaml(path)
    except (OSError, ValueError):
        return None


_KINDS: dict[str, tuple[str, Callable[[Path], bool]]] = {
    "comparison": ("comparison.json", _holds_schema("comparison")),
    "audit": ("audit.json", _holds_schema("audit")),
    "series": ("MCAP file", _is_series),
    "vehicle": ("vehicle file", _is_vehicle),
    "other": ("file of its own", _is_outside),
}
