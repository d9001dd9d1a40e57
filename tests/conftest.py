"""What runs: all but what takes the better part of a second and more, unless `--all` asks for these.

Ctrl-C is heard wherever the tests run.
"""

import gc
import re
import signal
from collections.abc import Generator
from pathlib import Path

import pytest

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # begun in the background of a shell: programs would inherit it
    signal.signal(signal.SIGINT, signal.default_int_handler)

ONLY_WITH_ALL = tuple(Path(__file__).with_name("only_with_all.txt").read_text("utf-8").splitlines())
"""Beginnings of the names (* stands for anything) of tests that take long and have shorter ones or others of their kind
beside them, so that CI ends sooner. `make bench` runs them, and the workflow on Linux."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """The options of who has half an hour."""
    parser.addoption("--all", action="store_true", help="run also what takes long and has a shorter test like it")
    parser.addoption("--long", action="store_true", help="run only what takes long: a change of discovery asks for it")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Look for no garbage among what is imported and collected: it stays, and is a third of the time that takes."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out what nobody asked for."""
    begins = {name: re.compile(re.escape(name).replace(r"\*", ".*")).match for name in ONLY_WITH_ALL}
    of_module: dict[str, list[str]] = {}
    for name in ONLY_WITH_ALL:
        of_module.setdefault(name.partition("::")[0], []).append(name)
    left_out: dict[str, list[pytest.Item]] = {name: [] for name in ONLY_WITH_ALL}
    for item in items:
        for name in of_module.get(item.nodeid.partition("::")[0], ()):
            if begins[name](item.nodeid):
                left_out[name].append(item)
    if config.args_source is pytest.Config.ArgsSource.TESTPATHS:
        gone = [name for name, found in left_out.items() if not found]
        if gone:
            raise pytest.UsageError(f"tests/only_with_all.txt: no test begins with {' or '.join(gone)}")
    if not config.getoption("--all") and not any("::" in argument for argument in config.args):
        long = {item for found in left_out.values() for item in found}
        unasked = [item for item in items if (item in long) != config.getoption("--long")]
        items[:] = [item for item in items if (item in long) == config.getoption("--long")]
        config.hook.pytest_deselected(items=unasked)
