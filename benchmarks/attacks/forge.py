"""A process that has loaded undertow and searched once, and forks a verb whenever it is asked: a try costs 0.2 s.

    python benchmarks/attacks/forge.py < requests > answers

`Forge` starts it and speaks with it, a line of JSON at a time. A forked verb waits for a word before it begins, so that
the attacker can hold on to it first, or let several begin at once. What discovery finds in a log is kept: only reading,
judging and writing are done again.
"""

import json
import os
import signal
import subprocess
import sys
import time
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

_ANY_TRACER = 0x59616D61
"""PR_SET_PTRACER of prctl(2): strace is no ancestor of the verb, which some kernels ask for."""

_CHANGES = ("os.rename", "os.link", "os.symlink", "os.remove", "os.rmdir", "os.mkdir")
"""Python's audit events for changes of names."""


class Forge:
    """Verbs forked from a warm process, one group at a time."""

    def __init__(self, folder: Path, warm: Sequence[Sequence[str]]) -> None:
        self.folder = folder
        self.process = subprocess.Popen(
            [sys.executable, "-P", __file__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )
        self._ask({"cwd": str(folder), "warm": [list(words) for words in warm]})

    def _say(self, asked: Any) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps(asked) + "\n")
        self.process.stdin.flush()

    def _hear(self) -> Any:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        if not line:
            raise RuntimeError("the forge has ended")
        return json.loads(line)

    def _ask(self, asked: Any) -> Any:
        self._say(asked)
        return self._hear()

    def prepare(
        self,
        calls: Sequence[Sequence[str]],
        cwd: Path,
        kill_at: int | None = None,
        where: str = "",
        delays: Sequence[float] | None = None,
    ) -> list[int]:
        """Fork a process for each call, which waits; their numbers.

        Parameters
        ----------
        kill_at : number of the change of a name at which they kill themselves, where strace is missing
        where : how the names that count end
        delays : seconds that each waits longer
        """
        plain = [list(words) for words in calls]
        waits = list(delays or [0.0] * len(plain))
        return self._ask({"cwd": str(cwd), "calls": plain, "kill_at": kill_at, "where": where, "delays": waits})

    def release(self) -> None:
        """Let them begin."""
        self._say("go")

    def collect(self) -> list[tuple[int, float, int, str, str]]:
        """Wait for all: exit code (negative for a signal), seconds, memory [bytes], stdout and stderr of each."""
        return [tuple(item) for item in self._hear()]

    def close(self) -> None:
        """End the process."""
        for stream in (self.process.stdin, self.process.stdout):
            if stream is not None:
                stream.close()
        self.process.wait(60)


def _serve() -> None:
    import undertow.__main__ as command_line
    from undertow.workflows import discover_and_add as running

    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    found: dict[tuple[str, ...], Any] = {}
    search = running.discover

    def kept(inputs: Any, *settings: Any, **named: Any) -> Any:
        key = (*map(str, inputs.paths),)
        if key not in found:
            found[key] = search(inputs, *settings, **named)
        return found[key]

    running.discover = kept

    def answer(content: Any) -> None:
        answers.write(json.dumps(content) + "\n")
        answers.flush()

    for line in sys.stdin:
        asked = json.loads(line)
        os.chdir(asked["cwd"])
        if "warm" in asked:
            for words in asked["warm"]:
                _warm(command_line.main, words)
            answer("warm")
        else:
            _forked(command_line.main, asked, answer)


def _warm(main: Any, words: list[str]) -> None:
    sys.argv = ["undertow", *words]
    with open(os.devnull, "w") as nowhere:
        sys.stdout = sys.stderr = nowhere
        try:
            main()
        except SystemExit as ended:
            if ended.code not in (0, 1, None):
                raise RuntimeError(f"{words}: {ended.code}") from None
        finally:
            sys.stdout, sys.stderr = sys.__stdout__, sys.__stderr__


def _forked(main: Any, asked: dict[str, Any], answer: Any) -> None:
    children = []
    wait, go = os.pipe()
    for words, delay in zip(asked["calls"], asked["delays"], strict=True):
        streams = [os.memfd_create("stdout"), os.memfd_create("stderr")]
        pid = os.fork()
        if not pid:
            os.close(go)
            _verb(main, words, wait, streams, asked, delay)
        children.append((pid, streams))
    os.close(wait)
    answer([pid for pid, _ in children])
    sys.stdin.readline()
    begun = time.perf_counter()
    os.close(go)
    ended = []
    for pid, streams in children:
        _, status, usage = os.wait4(pid, 0)
        texts = [os.pread(stream, 100_000, 0).decode("utf-8", "replace") for stream in streams]
        for stream in streams:
            os.close(stream)
        code = os.waitstatus_to_exitcode(status)
        ended.append((code, time.perf_counter() - begun, usage.ru_maxrss * 1024, *texts))
    answer(ended)


def _verb(main: Any, words: list[str], wait: int, streams: list[int], asked: dict[str, Any], delay: float) -> NoReturn:
    """The forked side: what a fresh interpreter would do with these words, and its end."""
    import ctypes

    os.setpgid(0, 0)
    ctypes.CDLL(None).prctl(_ANY_TRACER, ctypes.c_ulong(-1), 0, 0, 0)
    for number, stream in enumerate(streams, start=1):
        os.dup2(stream, number)
    sys.stdout, sys.stderr = (os.fdopen(os.dup(number), "w", encoding="utf-8") for number in (1, 2))
    sys.argv = ["undertow", *words]
    signal.set_wakeup_fd(-1)
    os.read(wait, 1)
    time.sleep(delay)
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.alarm(60)  # a verb that hangs ends by this signal, which `kills.ended` tells
    if asked["kill_at"] is not None:
        _kill_at(asked["kill_at"], asked["where"])
    code: Any = 0
    try:
        main()
    except SystemExit as ended:
        code = ended.code or 0
    except BaseException:
        traceback.print_exc()
        code = 1
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code if isinstance(code, int) else 1)


def _kill_at(number: int, where: str) -> None:
    """Kill this process at its n-th change of a name that Python's own functions make; ctypes is not seen."""
    left = number

    def hook(event: str, named: Any) -> None:
        nonlocal left
        if event in _CHANGES and any(str(name).endswith(where) for name in named):
            left -= 1
            if not left:
                os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(hook)


if __name__ == "__main__":
    _serve()
