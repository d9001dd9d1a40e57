"""The door to neural networks, without torch: what is a network's folder, and is torch there."""

import os
import re
from importlib import import_module
from pathlib import Path

from ...physics.errors import RequestError
from ...physics.reading import read_bytes
from ...physics.registry_members import how_to_install

SCHEMA = "undertow.network/1"
SETTINGS, WEIGHTS = "model.yaml", "weights.safetensors"
"""The two files of a network's folder."""
_SCHEMA_LINE = re.compile(r"^schema:\s*['\"]?undertow\.network/", re.MULTILINE)


CHECKPOINT = "checkpoint.safetensors"
"""File in a network's folder that a training under way goes on from."""


def require_torch() -> None:
    """Check that the packages that networks need are there.

    Raises
    ------
    RequestError
        with the command that installs them.
    """
    for package in ("torch", "safetensors"):
        try:
            import_module(package)
        except ImportError as error:
            raise RequestError(
                f"a neural network needs torch and safetensors ({error}): {how_to_install('neural')}"
            ) from None


def is_network_folder(path: str | os.PathLike[str]) -> bool:
    """True when a path is the folder of a network, whole or damaged; a run folder, whose model is a vehicle, is not."""
    folder = Path(path)
    if not folder.is_dir():
        return False
    try:
        said = read_bytes(folder / SETTINGS).decode("utf-8", "replace")
    except (OSError, ValueError):
        said = ""
    return bool(_SCHEMA_LINE.search(said)) or (folder / WEIGHTS).exists()
