"""Whether results that were kept were made by the sources as they are now."""

import hashlib
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def fingerprint(packages: Iterable[str]) -> str:
    """A hash of the sources that decide the results: all modules and vehicle files in some folders."""
    digest = hashlib.sha256()
    for path in sorted(p for package in packages for p in (ROOT / package).rglob("*") if p.suffix in (".py", ".yaml")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
