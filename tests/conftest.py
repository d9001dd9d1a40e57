"""What runs: all but the longest, unless `--all` asks for these; the long modules first, so that no processor waits.

Ctrl-C is heard wherever the tests run.
"""

import re
import signal
from pathlib import Path

import pytest

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # begun in the background of a shell: programs would inherit it
    signal.signal(signal.SIGINT, signal.default_int_handler)

LONG = (
    "tests/cli/test_command_line.py",
    "tests/test_documents.py",
    "tests/comparison/test_audit.py",
    "tests/comparison/test_planted_and_honest.py",
    "tests/discovery/test_field_logs.py",
    "tests/discovery/test_catalogue.py",
    "tests/discovery/test_gazebo.py",
    "tests/exports/test_mcap_series.py",
    "tests/discovery/calibration/test_calibrate.py",
    "tests/discovery/identifiability/test_identifiable_effects.py",
    "tests/cli/test_train_verb.py",
    "tests/measurements/quality/test_remedies.py",
    "tests/measurements/quality/test_quality.py",
    "tests/cli/test_robustness.py",
    "tests/cli/test_refusals.py",
    "tests/cli/test_whole_or_not.py",
    "tests/comparison/test_comparison.py",
    "tests/cli/test_check_verb.py",
    "tests/test_examples.py",
    "tests/cli/test_report_verb.py",
    "tests/measurements/quality/test_quality_real.py",
    "tests/residuals/training/test_training.py",
    "tests/comparison/failing/test_failures.py",
    "tests/measurements/formats/ros/test_json_messages.py",
    "tests/measurements/quality/test_spoilt_logs.py",
    "tests/test_extending.py",
    "tests/discovery/lawful/test_refit.py",
    "tests/measurements/formats/test_fuzz.py",
    "tests/physics/test_thrust_curve.py",
    "tests/discovery/test_parts.py",
    "tests/discovery/distillation/test_distil.py",
    "tests/cli/test_fit_verb.py",
    "tests/physics/worlds/test_hidden_effects.py",
    "tests/physics/test_apparent_wind.py",
    "tests/cli/test_bag_verbs.py",
    "tests/residuals/models/test_model_files.py",
    "tests/comparison/test_overlap.py",
    "tests/comparison/test_knife_edges.py",
    "tests/discovery/balance/test_shooting.py",
    "tests/workflows/test_main_job_honesty.py",
    "tests/discovery/calibration/test_adapt.py",
)
"""Modules that compute for ten seconds and more, the longest first."""

ONLY_WITH_ALL = tuple(Path(__file__).with_name("only_with_all.txt").read_text("utf-8").splitlines())
"""Beginnings of the names (* stands for anything) of tests that take long and have shorter ones or others of their kind
beside them, so that CI ends within ten minutes. `make bench` runs them."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """The option of who has half an hour."""
    parser.addoption("--all", action="store_true", help="run also what takes long and has a shorter test like it")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Put the long modules first, among equals in the order they have; leave out what nobody asked for."""
    places = {name: place for place, name in enumerate(LONG)}
    items.sort(key=lambda item: places.get(item.nodeid.partition("::")[0], len(places)))
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
        items[:] = [item for item in items if item not in long]
        config.hook.pytest_deselected(items=list(long))
