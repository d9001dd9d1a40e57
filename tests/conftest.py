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
    "tests/app/test_workbench_in_browser.py",
    "tests/app/test_session.py",
    "tests/workflows/test_sum_of_adds.py",
    "tests/workflows/test_whole_answer.py",
    "tests/comparison/test_overlap.py",
    "tests/test_examples.py",
    "tests/reports/page/test_browser.py",
    "tests/measurements/quality/test_spoilt_logs.py",
    "tests/comparison/test_comparison.py",
    "tests/discovery/evidence/test_own_changes.py",
    "tests/residuals/training/test_training.py",
    "tests/test_documents.py",
    "tests/discovery/evidence/test_record_errors.py",
    "tests/workflows/test_written_model.py",
    "tests/cli/test_train_verb.py",
    "tests/cli/test_command_line.py",
    "tests/workflows/test_repaired_in_memory.py",
    "tests/discovery/candidates/test_command_timing.py",
    "tests/exports/formats/test_to_onnx.py",
    "tests/discovery/evidence/test_unmodelled_forces.py",
    "tests/cli/test_plan_verb.py",
    "tests/workflows/test_broken_logs.py",
    "tests/cli/test_demo_verb.py",
    "tests/app/test_another_log.py",
    "tests/discovery/test_field_logs.py",
    "tests/workflows/test_init.py",
    "tests/discovery/test_parts.py",
    "tests/cli/test_compare_page.py",
    "tests/cli/test_fit_verb.py",
    "tests/cli/test_refusals.py",
    "tests/measurements/formats/test_fuzz.py",
    "tests/discovery/evidence/test_in_place.py",
    "tests/exports/formats/test_to_c.py",
    "tests/benchmarks/test_hidden_effects_study.py",
    "tests/measurements/quality/test_quality.py",
    "tests/workflows/test_sensor_corrections.py",
    "tests/test_layout.py",
    "tests/measurements/quality/test_remedies.py",
    "tests/discovery/lawful/test_refit.py",
    "tests/cli/test_export_verb.py",
    "tests/cli/test_check_verb.py",
    "tests/exports/test_mcap_series.py",
    "tests/benchmarks/test_foreign_causes_study.py",
    "tests/test_typing.py",
    "tests/cli/test_whole_or_not.py",
    "tests/cli/test_report_verb.py",
    "tests/cli/test_robustness.py",
    "tests/workflows/test_reported_faults.py",
    "tests/cli/test_mending_maps.py",
)
"""Modules that compute for five seconds and more of a processor's time, or wait for a browser; the longest first."""

ONLY_WITH_ALL = tuple(Path(__file__).with_name("only_with_all.txt").read_text("utf-8").splitlines())
"""Beginnings of the names (* stands for anything) of tests that take long and have shorter ones or others of their kind
beside them, so that CI ends within ten minutes. `make bench` runs them."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """The options of who has half an hour."""
    parser.addoption("--all", action="store_true", help="run also what takes long and has a shorter test like it")
    parser.addoption("--long", action="store_true", help="run only what takes long: a change of discovery asks for it")


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
        unasked = [item for item in items if (item in long) != config.getoption("--long")]
        items[:] = [item for item in items if (item in long) == config.getoption("--long")]
        config.hook.pytest_deselected(items=unasked)
