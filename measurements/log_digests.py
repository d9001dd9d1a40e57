"""Digests of logs, by which it is known later whether a log is the same."""

import hashlib
from collections.abc import Sequence
from pathlib import Path

from ..physics.reading import BLOCK
from .log import Log


def log_digests(paths: Sequence[str]) -> list[dict[str, str | None]]:
    """SHA-256 of each log as it is on disk now; of a folder, over the names and contents of the files in it.

    A log that is no longer there has null.
    """
    return [{"path": path, "sha256": _digest(Path(path))} for path in paths]


def channels_digest(log: Log) -> str:
    """SHA-256 of the channels of a log in memory: their names, stamps and values."""
    digest = hashlib.sha256()
    for name, channel in sorted(log.channels.items()):
        digest.update(f"{name}\0{channel.time.size}\0".encode())
        digest.update(channel.time.tobytes())
        digest.update(channel.value.tobytes())
    return digest.hexdigest()


def _digest(path: Path) -> str | None:
    files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
    digest = hashlib.sha256()
    try:
        for file in files:
            if path.is_dir():
                digest.update(f"{file.relative_to(path).as_posix()}\0{file.stat().st_size}\0".encode())
            with file.open("rb") as stream:
                while chunk := stream.read(BLOCK):
                    digest.update(chunk)
    except OSError:
        return None
    return digest.hexdigest()
