"""One process under attack: what it was asked, how it ended, how long it took and how much memory it held."""

import ctypes
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Thread
from typing import IO

HANG = 60.0
"""Seconds after which a process counts as hung, as the issue has it."""
MEMORY = 1_500_000_000
"""Bytes that a process may hold at once."""
MESSAGE = 4000
"""Characters that a message may have."""
KEPT = 200_000
"""Bytes of a stream that are kept at either end; a bomb may print more than this machine holds."""
STOPPED = 3 * MEMORY
"""Bytes at which a process is stopped, to save the machine."""
UNHEARD = 2.0
"""Seconds after which a process that has no handler of SIGTERM is taken to have begun."""
TRACEBACK = (b"Traceback (most recent call last)", b"Exception ignored in", b"Fatal Python error")
CALM = (0, 1, 2, 130)
"""Exit codes that the command line has: done, a violation or a reader who left, a clear error, interrupted."""

_PR_CAPBSET_DROP = 24
_PASSING = (1, 2)
"""CAP_DAC_OVERRIDE and CAP_DAC_READ_SEARCH of capabilities(7), by which root passes by the permissions of files."""

Word = str | bytes | Path
UNDERTOW: tuple[Word, ...] = (sys.executable, "-m", "undertow")


@dataclass(frozen=True, slots=True)
class Ended:
    """How a process ended.

    Attributes
    ----------
    code : exit code; negative for the signal that ended it
    out, err : the first and the last bytes of its streams
    message : characters of its message: all of stderr after an error, else the longest line of stderr
    seconds, memory : how long it ran [s], and the most it held at once [bytes]
    hung : stopped after `HANG`
    """

    words: tuple[Word, ...]
    code: int
    out: bytes
    err: bytes
    message: int
    seconds: float
    memory: int
    hung: bool = False

    @property
    def told(self) -> bytes:
        """What the user sees, on either stream."""
        return self.out + self.err

    @property
    def traceback(self) -> bool:
        """Whether the user saw a traceback."""
        return any(sign in self.told for sign in TRACEBACK)

    def __str__(self) -> str:
        words = " ".join(w.decode("utf-8", "backslashreplace") if isinstance(w, bytes) else str(w) for w in self.words)
        shown = words if len(words) < 160 else f"{words[:100]} ... {words[-40:]}"
        tail = self.err[-300:].decode("utf-8", "backslashreplace").replace("\n", " | ")
        return f"{shown!a}: exit {self.code}, {self.seconds:.1f} s, {self.memory / 1e6:.0f} MB, {tail!a}"


@dataclass(frozen=True, slots=True)
class Sent:
    """A signal to the process group, as a terminal sends Ctrl-C, so many seconds after undertow's first line ran.

    Before that Python itself is loading, which ends in its own way; a handler of SIGTERM tells that it is done.
    """

    after: float
    signal: int = signal.SIGINT


class _Reader:
    """The first and the last bytes of a stream, read in a thread so that no pipe fills."""

    def __init__(self, stream: IO[bytes] | None) -> None:
        self.head, self.tail, self.count, self.longest = b"", b"", 0, 0
        self._line = 0
        self._thread = Thread(target=self._read, args=(stream,), daemon=True)
        self._thread.start()

    def _read(self, stream: IO[bytes] | None) -> None:
        while stream is not None and (block := os.read(stream.fileno(), 1 << 16)):
            self.count += len(block)
            for part in block.splitlines(keepends=True):
                self._line += len(part)
                self.longest = max(self.longest, self._line)
                self._line = 0 if part.endswith((b"\n", b"\r")) else self._line
            if len(self.head) < KEPT:
                self.head += block
            else:
                self.tail = (self.tail + block)[-KEPT:]

    def join(self) -> bytes:
        self._thread.join(2.0)  # a grandchild may hold the pipe
        return self.head + self.tail


def undertow(
    *words: Word,
    cwd: Path,
    env: Mapping[str, str | None] | None = None,
    sent: Sequence[Sent] = (),
    before: Callable[[], None] | None = None,
    seconds: float = HANG,
    start: Sequence[Word] = UNDERTOW,
) -> Ended:
    """Run the command line in a process of its own.

    Parameters
    ----------
    env : variables that differ from this process's; None takes one away
    sent : signals, in the order of their times
    before : called in the process before it begins
    seconds : after which it is stopped, and counts as hung [s]
    start : what stands before the words
    """
    begun = time.perf_counter()
    process = subprocess.Popen(
        [*start, *words],
        cwd=cwd,
        env=environment(env or {}),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        preexec_fn=before,
        start_new_session=True,
    )
    out, err = _Reader(process.stdout), _Reader(process.stderr)
    code, memory, hung = watched(process.pid, begun, sent, seconds)
    process.returncode = code  # reaped here, for its memory; subprocess must not look for it
    told, complained = out.join(), err.join()
    for stream in (process.stdout, process.stderr):
        if stream is not None:
            stream.close()
    message = err.count if code else err.longest
    return Ended((*words,), code, told, complained, message, time.perf_counter() - begun, memory, hung)


def environment(changes: Mapping[str, str | None]) -> dict[str, str]:
    """Variables of this process with changes, and one thread, since the machine is shared with other tries."""
    mixed: dict[str, str | None] = {**os.environ, "OMP_NUM_THREADS": "1", **changes}
    return {name: value for name, value in mixed.items() if value is not None}


def watched(pid: int, begun: float, sent: Sequence[Sent], seconds: float) -> tuple[int, int, bool]:
    """Wait for a child, and send signals meanwhile: its exit code, its memory [bytes], and whether it hung."""
    waiting, hung, most, ready = list(sent), False, 0, None
    while True:
        found, status, usage = os.wait4(pid, os.WNOHANG)
        if found:
            # The kernel's figure counts grandchildren, and this process's size at the fork: that is why it is slim.
            return os.waitstatus_to_exitcode(status), max(most, usage.ru_maxrss * 1024), hung
        now = time.perf_counter() - begun
        if ready is None and waiting and (now > UNHEARD or catches(pid, signal.SIGTERM)):
            ready = now
        while waiting and ready is not None and now >= ready + waiting[0].after:
            _send(pid, waiting.pop(0).signal)
        held = peak(pid)
        most = max(most, held)
        if now > seconds or held > STOPPED:
            hung = hung or now > seconds
            _send(pid, signal.SIGKILL)
        time.sleep(0.002 if waiting else 0.01)


def catches(pid: int, number: int) -> bool:
    """Whether a process has a handler for a signal."""
    try:
        text = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return False
    (mask,) = [line.split()[1] for line in text.splitlines() if line.startswith("SigCgt:")] or ["0"]
    return bool(int(mask, 16) >> (number - 1) & 1)


def peak(pid: int) -> int:
    """Most that a process has held at once since its program was loaded [bytes]; 0 when it is gone."""
    try:
        text = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return 0
    found = [line for line in text.splitlines() if line.startswith("VmHWM:")]
    return 1024 * int(found[0].split()[1]) if found else 0


def _send(pid: int, number: int) -> None:
    with suppress(ProcessLookupError):
        os.killpg(pid, number)


def file_limit(size: int) -> Callable[[], None]:
    """For `before`: no file grows beyond so many bytes."""
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


def powerless() -> None:
    """For `before`: go on as a user who must ask for permission, which root does not."""
    for capability in _PASSING:
        ctypes.CDLL(None).prctl(_PR_CAPBSET_DROP, capability, 0, 0, 0)
