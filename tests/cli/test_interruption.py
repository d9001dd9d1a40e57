"""An interruption that a library swallows is not forgotten."""

import subprocess
import sys

import pytest

SWALLOWED = """
import os, signal
from undertow.cli.interruption import interruptible, listen
listen()
try:
    with interruptible():
        try:
            os.kill(os.getpid(), signal.SIGINT)
        except BaseException:
            {after}
        print("went on")
except KeyboardInterrupt as error:
    print("told", error.args[0] == signal.SIGINT)
"""


@pytest.mark.parametrize(
    ("after", "told"),
    [("pass", "went on\ntold True\n"), ("raise ValueError", "told True\n"), ("raise", "told True\n")],
    ids=["passed over", "made another error", "raised again"],
)
def test_an_interruption_that_a_library_swallows_is_told_at_the_end(after: str, told: str):
    done = subprocess.run(
        [sys.executable, "-c", SWALLOWED.format(after=after)], capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stdout == told


def test_work_that_nobody_interrupts_ends_as_it_ends():
    code = SWALLOWED.replace("os.kill(os.getpid(), signal.SIGINT)", "pass").format(after="pass")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == "went on\n"
