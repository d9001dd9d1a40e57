"""Kill a process at its k-th change of a name in the file system, or after a while; strace holds the knife."""

import os
import re
import shutil
import signal
import subprocess
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

CALLS = (
    *("rename", "renameat", "renameat2", "link", "linkat", "symlink", "symlinkat"),
    *("unlink", "unlinkat", "rmdir", "mkdir", "mkdirat"),
)
"""System calls that change names; what a file holds before it has its name matters to nobody."""
STRACE = shutil.which("strace")
Moment = tuple[str, int] | float
"""The n-th system call of a name, or seconds after the start."""


class Watched:
    """A process under strace, which writes down its changes of names and may kill it at one of them."""

    def __init__(self, pid: int, log: Path, at: tuple[str, int] | None = None) -> None:
        assert STRACE is not None
        self.log = log
        inject = [] if at is None else ["-e", f"inject={at[0]}:signal=KILL:when={at[1]}"]
        words = [STRACE, "-f", "-e", f"trace={','.join(CALLS)}", "-e", "signal=none", *inject]
        self.process = subprocess.Popen(
            [*words, "-o", str(log), "-p", str(pid)], stderr=subprocess.PIPE, text=True, start_new_session=True
        )
        assert self.process.stderr is not None
        line = self.process.stderr.readline()
        if "attached" not in line:
            raise RuntimeError(f"strace cannot hold on to a process: {line.strip()}")

    def changes(self) -> list[tuple[str, int]]:
        """The calls that the process made, each with its number among those of its name; after its end."""
        self.process.wait(10)
        if self.process.stderr is not None:
            self.process.stderr.close()
        counts: Counter[str] = Counter()
        found = []
        for line in self.log.read_text("utf-8", "replace").splitlines():
            called = re.match(r"\d+ +(\w+)\(", line)
            if called and called[1] in CALLS:
                counts[called[1]] += 1
                found.append((called[1], counts[called[1]]))
        return found


def told(at: Moment) -> str:
    """A moment in words."""
    return f"at {at[0]} {at[1]}" if isinstance(at, tuple) else f"after {at:.2f} s"


def kill_after(pid: int, seconds: float) -> None:
    """Kill a process after a while, if it is still there."""
    time.sleep(seconds)
    with suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)
