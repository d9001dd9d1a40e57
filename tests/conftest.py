"""What runs: all but the longest, unless `--all` asks for these; the long modules first, so that no processor waits.

Ctrl-C is heard wherever the tests run.
"""

import signal
from fnmatch import fnmatchcase

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
    "tests/benchmarks/test_hidden_effects_study.py::test_discovery_names_what_is_hidden_in_a_slice",
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

ONLY_WITH_ALL = (
    "tests/benchmarks/test_hidden_effects_study.py::test_discovery_names_what_is_hidden_in_a_slice",
    "tests/cli/test_train_verb.py::test_train_as_a_function_pure_with_heading_and_rollouts",
    "tests/cli/test_train_verb.py::test_train_explains_what_was_learnt",
    "tests/comparison/test_audit.py::test_a_violation_in_a_window_is_found_by_every_seed[ball]",
    "tests/comparison/test_audit.py::test_a_violation_in_a_window_is_found_by_every_seed[both full]",
    "tests/comparison/test_audit.py::test_a_violation_in_a_window_is_found_by_every_seed[heading]",
    "tests/comparison/test_audit.py::test_a_violation_in_a_window_is_found_by_every_seed[sheet]",
    "tests/comparison/test_audit.py::test_a_violation_in_a_window_is_found_by_every_seed[speed]",
    "tests/comparison/test_audit.py::test_seeds_agree_on_a_gain_under_few_commands",
    "tests/comparison/test_audit.py::test_stiff_damping_is_no_unbounded_speed[1000.0]",
    "tests/comparison/test_audit.py::test_stiff_damping_is_no_unbounded_speed[50.0]",
    "tests/comparison/test_planted_and_honest.py::test_honest_models_are_not_accused",
    "tests/discovery/balance/test_long_logs.py::test_a_log_of_an_hour_gives_the_answer",
    "tests/discovery/calibration/test_adapt.py::test_two_parameters_are_told_apart",
    "tests/discovery/candidates/test_command_timing.py::test_a_record_that_is_later_than_its_step",
    "tests/discovery/identifiability/test_identifiable_effects.py::test_current_and_wind_on_one_heading_ask_for_several[wind]",
    "tests/discovery/identifiability/test_identifiable_effects.py::test_following_the_advice_names_the_right_look_alike",
    "tests/discovery/search/test_again.py::test_a_crowd_is_met_from_every_effect_of_the_hull",
    "tests/discovery/search/test_again.py::test_a_few_stand_ins_are_exchanged_for_as_many",
    "tests/discovery/search/test_chance.py::test_on_nothing_the_best_effect_is_one_of_the_rehearsed",
    "tests/discovery/test_catalogue.py::test_each_effect_is_recovered_from_minutes_of_field_noise[advance_loss]",
    "tests/discovery/test_catalogue.py::test_each_effect_is_recovered_from_minutes_of_field_noise[mass_offset]",
    "tests/discovery/test_catalogue.py::test_each_effect_is_recovered_from_minutes_of_field_noise[mean_wind]",
    "tests/discovery/test_catalogue.py::test_each_effect_is_recovered_from_minutes_of_field_noise[surge_added_mass]",
    "tests/discovery/test_catalogue.py::test_each_effect_is_recovered_from_minutes_of_field_noise[surge_linear_damping]",
    "tests/discovery/test_catalogue.py::test_each_effect_is_recovered_from_minutes_of_field_noise[surge_turn_drag]",
    "tests/discovery/test_catalogue.py::test_each_effect_is_recovered_from_minutes_of_field_noise[sway_added_mass]",
    "tests/discovery/test_catalogue.py::test_each_effect_is_recovered_from_minutes_of_field_noise[sway_linear_damping]",
    "tests/discovery/test_catalogue.py::test_each_effect_is_recovered_from_minutes_of_field_noise[sway_quadratic_damping]",
    "tests/discovery/test_catalogue.py::test_each_effect_is_recovered_from_minutes_of_field_noise[sway_trim]",
    "tests/discovery/test_catalogue.py::test_each_effect_is_recovered_from_minutes_of_field_noise[thrust_exponent]",
    "tests/discovery/test_catalogue.py::test_each_effect_is_recovered_from_minutes_of_field_noise[thrust_scale]",
    "tests/discovery/test_catalogue.py::test_each_effect_is_recovered_from_minutes_of_field_noise[turning_current]",
    "tests/discovery/test_catalogue.py::test_each_effect_is_recovered_from_minutes_of_field_noise[yaw_linear_damping]",
    "tests/discovery/test_catalogue.py::test_each_effect_is_recovered_from_minutes_of_field_noise[yaw_quadratic_damping]",
    "tests/discovery/test_catalogue.py::test_each_effect_is_recovered_from_minutes_of_field_noise[yaw_trim]",
    "tests/discovery/test_catalogue.py::test_what_remembers_is_recovered_from_a_log_full_of_gaps[thruster_lag",
    "tests/discovery/test_field_logs.py::test_a_compass_deviation_is_not_called_a_current",
    "tests/discovery/test_field_logs.py::test_a_plain_deviation_under_white_noise",
    "tests/discovery/test_field_logs.py::test_coloured_noise_alone_is_no_effect",
    "tests/discovery/test_field_logs.py::test_hidden_effects_are_named_under_coloured_noise_and_held_fixes",
    "tests/discovery/test_gazebo.py::*[B_4]",
    "tests/discovery/test_gazebo.py::*[C_1]",
    "tests/discovery/test_gazebo.py::*[D_1]",
    "tests/discovery/test_gazebo.py::*[E_2]",
    "tests/discovery/test_gazebo.py::*[F_1]",
    "tests/discovery/test_gazebo.py::*[G_2]",
    "tests/discovery/test_hidden_sensors.py::test_an_error_that_only_forces_show_is_found_and_blamed_on_no_effect[ahead",
    "tests/discovery/test_hidden_sensors.py::test_an_error_that_only_forces_show_is_found_and_blamed_on_no_effect[aside",
    "tests/discovery/test_hidden_sensors.py::test_an_error_that_only_forces_show_is_found_and_blamed_on_no_effect[compass-nothing]",
    "tests/measurements/formats/ros/test_json_messages.py::test_discover_finds_in_series_mcap",
    "tests/measurements/formats/test_spoilt_files.py::test_a_spoilt_file_is_refused_clearly_or_read[comparison.json]",
    "tests/measurements/formats/test_spoilt_files.py::test_a_spoilt_file_is_refused_clearly_or_read[nominal.yaml]",
    "tests/measurements/formats/test_spoilt_files.py::test_a_spoilt_file_is_refused_clearly_or_read[run.json]",
    "tests/measurements/quality/test_quality.py::test_the_study_prints_its_table",
    "tests/measurements/quality/test_quality_real.py::test_no_gazebo_log_is_accused",
    "tests/physics/test_changes_in_a_log.py::test_discovery_names_it[field-turning_current]",
    "tests/residuals/training/test_training.py::test_a_network_with_memory_learns_the_boat_and_not_the_noise_of_its_sensors",
    "tests/test_examples.py::test_the_blueboat_example_tells_splits_findings_and_verdicts",
)
"""Beginnings of the names (* stands for anything) of tests that take long and have shorter ones or others of their kind
beside them. `make bench` runs them."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """The option of who has half an hour."""
    parser.addoption("--all", action="store_true", help="run also what takes long and has a shorter test like it")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Put the long modules first, among equals in the order they have; leave out what nobody asked for."""
    places = {name: place for place, name in enumerate(LONG)}
    items.sort(key=lambda item: places.get(item.nodeid.partition("::")[0], len(places)))
    if config.args_source is pytest.Config.ArgsSource.TESTPATHS:
        gone = [name for name in ONLY_WITH_ALL if not any(_begins(item, name) for item in items)]
        if gone:
            raise pytest.UsageError(f"tests/conftest.py: no test begins with {' or '.join(gone)}")
    if not config.getoption("--all") and not any("::" in argument for argument in config.args):
        left_out = [item for item in items if any(_begins(item, name) for name in ONLY_WITH_ALL)]
        items[:] = [item for item in items if item not in left_out]
        config.hook.pytest_deselected(items=left_out)


def _begins(item: pytest.Item, name: str) -> bool:
    return fnmatchcase(item.nodeid, name.replace("[", "[[]") + "*")
