"""Full, small and read-only disks, and folders without permission: the earlier result stays, and a message says why."""

import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .running import file_limit, powerless, undertow
from .trial import VERBS, Attack, Ground, Job, Trial, contents, judged

SIZES = (0, 300, 4_000, 30_000, 150_000)
"""Bytes a file may have: from none to most of the files of a run."""
DISKS = (0, 16, 100, 400)
"""KiB that a small disk has left."""
WRITING = tuple(verb for verb in VERBS if verb != "explain")


def attacks(ground: Ground) -> Iterator[Attack]:
    """The rows: limits, small disks, read-only disks, folders of others, and targets that are no files."""
    jobs = [_limited(ground, verb, size) for verb in WRITING for size in SIZES]
    yield Attack("disks", "files that may not grow (RLIMIT_FSIZE)", jobs)
    root = os.geteuid() == 0
    why = "" if root and _mounts() else "needs root, and leave to mount"
    jobs = [_small(ground, verb, left) for verb in WRITING for left in DISKS]
    yield Attack("disks", "a disk with 0 to 400 KiB left (tmpfs)", jobs * (not why), why)
    yield Attack("disks", "a read-only disk", [_read_only(ground, verb) for verb in WRITING] * (not why), why)
    yield Attack("disks", "folders without permission to write", [_forbidden(ground, verb) for verb in WRITING])
    jobs = [_nowhere(ground, verb, out) for verb in WRITING if "--out" in VERBS[verb] for out in NOWHERE]
    yield Attack("disks", f"--out {', '.join(NOWHERE)}", jobs)


NOWHERE = ("/proc/x.csv", "/dev/full", "/dev/null/x.csv", "missing/x.csv", "boat.yaml/x.csv", ".", "/")
"""Targets that cannot be written; the search must not begin."""


def _mounts() -> bool:
    return subprocess.run(["mount", "--version"], capture_output=True, check=False).returncode == 0 and _can_mount()


def _can_mount() -> bool:
    import tempfile

    with tempfile.TemporaryDirectory() as place:
        if subprocess.run(["mount", "-t", "tmpfs", "none", place], capture_output=True, check=False).returncode:
            return False
        subprocess.run(["umount", place], check=True)
    return True


@contextmanager
def _mounted(place: Path, size: int) -> Iterator[Path]:
    """A disk of so many KiB."""
    place.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}k", "none", str(place)], check=True)
    try:
        yield place
    finally:
        subprocess.run(["umount", "-l", str(place)], check=True)


def _limited(ground: Ground, verb: str, size: int) -> Job:
    def job(folder: Path) -> Trial:
        before = ground.laid(folder)
        end = undertow(*VERBS[verb], cwd=folder, before=file_limit(size))
        return ground.tried(verb, folder, before, end, (0, 1, 2))

    return job


def _small(ground: Ground, verb: str, left: int) -> Job:
    def job(folder: Path) -> Trial:
        with _mounted(folder / "disk", 8192) as disk:
            before = ground.laid(disk)
            fill = os.statvfs(disk)
            room = fill.f_bavail * fill.f_frsize - 1024 * left
            (disk / "fill").write_bytes(b"x" * max(0, room))
            end = undertow(*VERBS[verb], cwd=disk)
            (disk / "fill").unlink()
            return ground.tried(verb, disk, before, end, (0, 1, 2))

    return job


def _read_only(ground: Ground, verb: str) -> Job:
    def job(folder: Path) -> Trial:
        with _mounted(folder / "disk", 8192) as disk:
            before = ground.laid(disk)
            subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
            end = undertow(*VERBS[verb], cwd=disk)
            return ground.tried(verb, disk, before, end, (2,))

    return job


def _forbidden(ground: Ground, verb: str) -> Job:
    def job(folder: Path) -> Trial:
        before = ground.laid(folder)
        for place in (folder, folder / "mon", folder / "net"):
            place.chmod(0o555)
        end = undertow(*VERBS[verb], cwd=folder, before=powerless)
        for place in (folder, folder / "mon", folder / "net"):
            place.chmod(0o755)
        return ground.tried(verb, folder, before, end, (2,))

    return job


def _nowhere(ground: Ground, verb: str, out: str) -> Job:
    def job(folder: Path) -> Trial:
        before = ground.laid(folder)
        words = list(VERBS[verb])
        words[words.index("--out") + 1] = out
        end = undertow(*words, cwd=folder)
        found = judged(contents(folder), before, before)
        wrong = f"left over: {found.left}" if found.left else ""
        if end.code != 2 or not end.err.strip():
            wrong = wrong or f"exit code {end.code}, not 2: {end}"
        elif b"searching" in end.err or b"epoch" in end.err:
            wrong = wrong or f"found only after the work: {end}"
        return Trial(str(end), (end,), found.lost, found.torn, wrong)

    return job
