"""undertow finds the physics your boat model is missing.

The verbs of the command line are functions here; each is loaded when it is first used.

>>> import undertow
>>> "discover" in dir(undertow)
True
"""

from importlib import import_module
from typing import Any

# Public names and the modules that hold them; after a colon, what they are called there.
_PUBLIC = {
    "AdaptSettings": "discovery.calibration.forgetting_fit",
    "Augmentation": "residuals.training.training_settings",
    "Audit": "comparison.audit",
    "DataSet": "measurements.preparation.dataset",
    "DiscoverySettings": "discovery.settings",
    "EFFECTS": "physics.effects",
    "Engine": "fleet.workers",
    "Ensemble": "discovery.factors.sparse",
    "Factors": "discovery.factors.factors",
    "Bounds": "discovery.experiment.changed_steps",
    "Choices": "exports.formats.base",
    "Choice": "residuals.training.training_settings",
    "Fleet": "fleet.hull_estimates",
    "Findings": "discovery.findings",
    "Hull": "workflows.first_vehicle",
    "HullEstimate": "fleet.hull_estimates",
    "Inputs": "measurements.prepared_logs",
    "WatchSettings": "fleet.hull_changes",
    "Limits": "comparison.error_limits",
    "Log": "measurements.log",
    "LogError": "physics.errors",
    "Motion": "physics.motion",
    "Moved": "workflows.run_folder.moved_files",
    "PAPER": "measurements.preparation.dataset",
    "Reading": "measurements.log_options",
    "Plots": "reports.page.figures.plots",
    "Recipe": "measurements.preparation.dataset",
    "RequestError": "physics.errors",
    "Run": "workflows.run_folder.run",
    "TrainRun": "workflows.train",
    "TrainingSettings": "residuals.training.training_settings",
    "Trial": "workflows.control",
    "Vehicle": "physics.vehicle",
    "VehicleError": "physics.errors",
    "WEAK": "measurements.preparation.dataset",
    "add": "workflows.discover_and_add",
    "adapt": "discovery.calibration.adapt",
    "audit": "comparison.audit",
    "build_fleet": "fleet.build_fleet",
    "check": "workflows.check",
    "ci": "workflows.ci",
    "compare": "workflows.compare",
    "compress": "workflows.compress",
    "control": "workflows.control",
    "diary_of": "fleet.diary",
    "discover": "workflows.discover_and_add",
    "distil": "workflows.explain",
    "export": "workflows.export",
    "ensemble": "discovery.factors.sparse",
    "first_limits": "workflows.ci",
    "fit": "workflows.fit",
    "init": "workflows.init",
    "inspect_log": "measurements.inspection",
    "load_limits": "comparison.error_limits",
    "load_model": "comparison.models_by_name",
    "load_run": "workflows.run_folder.read:read_run",
    "load_vehicle": "physics.vehicle",
    "merge_fleets": "fleet.merging",
    "plan": "workflows.plan",
    "prepare": "measurements.preparation.prepare",
    "read_factors": "discovery.factors.factors_file",
    "read_fleet": "fleet.read_fleet",
    "read_inputs": "workflows.inputs",
    "read_log": "measurements.log",
    "report": "workflows.report",
    "simulate_world": "physics.worlds.world",
    "split": "measurements.preparation.split",
    "train": "workflows.train",
    "write_factors": "discovery.factors.factors_file",
    "write_plan": "workflows.plan",
    "write_run": "workflows.run_folder.write",
}

__all__ = list(_PUBLIC)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module("importlib.metadata").version(__name__)
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, called = _PUBLIC[name].partition(":")
    return getattr(import_module(f".{module}", __name__), called or name)


def __dir__() -> list[str]:
    return sorted(_PUBLIC)
