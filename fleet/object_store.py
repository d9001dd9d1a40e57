"""Logs in object stores (S3, Google, Azure and their like), through obstore."""

import re
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from fnmatch import fnmatchcase
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import Any

from ..physics.errors import LogError, RequestError
from ..physics.extras import how_to_install

_URL = re.compile(r"(?:s3a?|gs|az|abfss?|https?)://[^/]+", re.ASCII)


def is_url(name: str) -> bool:
    """Whether a name is the address of an object store, or of something in one."""
    return _URL.match(name) is not None


def objects_below(url: str, suffixes: Collection[str]) -> list[tuple[str, str]]:
    """Addresses of the logs at or below an address, each with what changes when the object does.

    Parameters
    ----------
    url : an address, or a pattern of addresses: `*` is any part of a name, `**` any folders
    suffixes : usual endings of a log's name; what ends otherwise is passed over, unless it is the address itself

    Raises
    ------
    LogError
        when the store cannot be asked, or nothing is there.
    """
    root, key = _parted(url)
    pattern = "*" in key
    prefix = key.partition("*")[0].rpartition("/")[0] if pattern else key.rstrip("/")
    with _telling(url):
        store = _store(root)
        listed = [one for many in _obstore().list(store, prefix=prefix or None) for one in many]
        # A list with a prefix gives what is below it; the object of that name itself is asked for.
        listed += [] if not key or key.endswith("/") or listed or pattern else [_obstore().head(store, key)]
    known = {one["path"]: f"{one['size']}-{one.get('e_tag')}-{one['last_modified'].isoformat()}" for one in listed}
    endings = tuple(suffixes)
    if pattern:
        found = [p for p in sorted(known) if _meets(p.split("/"), key.split("/"))]
    else:
        found = [p for p in sorted(known) if p == key or p.lower().endswith(endings)]
    if not found:
        told = "meets the pattern" if pattern else "is a log"
        raise LogError(f"{url}: expected logs at this address, got {len(known)} objects and none that {told}")
    return [(f"{root}/{p}", known[p]) for p in found]


def _meets(key: Sequence[str], pattern: Sequence[str]) -> bool:
    """Whether the parts of a key meet those of a pattern, whose `**` stands for any number of parts."""
    if not pattern:
        return not key
    if pattern[0] == "**":
        return any(_meets(key[skipped:], pattern[1:]) for skipped in range(len(key) + 1))
    return bool(key) and fnmatchcase(key[0], pattern[0]) and _meets(key[1:], pattern[1:])


@contextmanager
def fetched(url: str) -> Iterator[Path]:
    """An object as a file of its name, for as long as it is read.

    Raises
    ------
    LogError
        when it cannot be fetched.
    """
    root, key = _parted(url)
    with TemporaryDirectory(prefix="undertow-") as folder:
        path = Path(folder, PurePosixPath(key).name)
        with _telling(url), path.open("wb") as stream:
            for part in _obstore().get(_store(root), key).stream():
                stream.write(part)
        yield path


def _parted(url: str) -> tuple[str, str]:
    root = _URL.match(url)
    assert root is not None, url
    return root[0], url[root.end() :].lstrip("/")


def _store(root: str) -> Any:
    """The store of a bucket; credentials and the endpoint come from the environment, as its own tools have them."""
    from obstore.store import from_url

    return from_url(root)


def _obstore() -> Any:
    try:
        import obstore
    except ImportError:
        raise RequestError(f"logs in object stores need obstore: {how_to_install('cluster')}") from None
    return obstore


@contextmanager
def _telling(url: str) -> Iterator[None]:
    _obstore()
    try:
        yield
    except (LogError, RequestError):
        raise
    except Exception as error:  # obstore has a dozen kinds, of the network, the store and the address
        told = (str(error).strip().splitlines() or [type(error).__name__])[0]
        raise LogError(
            f"{url}: cannot be read ({told[:300]}); look at the address, and at AWS_* or the like in the environment"
        ) from None
