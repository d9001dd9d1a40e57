"""The long modules start first, so that no processor waits at the end; and Ctrl-C is heard wherever the tests run."""

import signal
from collections.abc import Generator
from typing import Any

import pytest

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # begun in the background of a shell: programs would inherit it
    signal.signal(signal.SIGINT, signal.default_int_handler)

LONG = (
    "tests/cli/test_command_line.py",
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
    "tests/benchmarks/test_hidden_effects_study.py",
    "tests/physics/test_apparent_wind.py",
    "tests/cli/test_bag_verbs.py",
    "tests/residuals/models/test_model_files.py",
    "tests/comparison/test_overlap.py",
    "tests/comparison/test_knife_edges.py",
    "tests/discovery/balance/test_shooting.py",
    "tests/workflows/test_main_job_honesty.py",
    "tests/discovery/calibration/test_adapt.py",
)
"""Modules that compute for ten seconds and more, the longest first. Tracing their lines would take half as long
again, and the demo and the shorter tests run nearly all of the same lines."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the long modules first; among equals the order stays."""
    places = {name: place for place, name in enumerate(LONG)}
    items.sort(key=lambda item: places.get(item.nodeid.partition("::")[0], len(places)))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Trace no line of a long module, nor of what its fixtures make."""
    plugin: Any = item.config.pluginmanager.getplugin("_cov")
    coverage = plugin and plugin.cov_controller
    if not coverage or item.nodeid.partition("::")[0] not in LONG:
        return (yield)
    coverage.pause()
    try:
        return (yield)
    finally:
        coverage.resume()
