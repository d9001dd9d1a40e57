"""The long modules start first, so that no processor waits at the end; and Ctrl-C is heard wherever the tests run."""

import signal

import pytest

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # begun in the background of a shell: programs would inherit it
    signal.signal(signal.SIGINT, signal.default_int_handler)

LONG = (
    "tests/discovery/test_catalogue.py",
    "tests/comparison/test_audit.py",
    "tests/discovery/test_gazebo.py",
    "tests/discovery/test_field_logs.py",
    "tests/discovery/test_parts.py",
    "tests/discovery/calibration/test_calibrate.py",
    "tests/residuals/training/test_training.py",
    "tests/comparison/failing/test_failures.py",
)
"""Modules that compute for long, each in one process. Tracing their lines would take half as long again, and the demo
and the shorter tests run nearly all of the same lines."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the long modules first; among equals the order stays."""
    places = {name: place for place, name in enumerate(("tests/cli/test_command_line.py", *LONG))}
    for item in items:
        if item.nodeid.partition("::")[0] in LONG:
            item.add_marker("no_cover")
    items.sort(key=lambda item: places.get(item.nodeid.partition("::")[0], len(places)))
