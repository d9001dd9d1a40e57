"""undertow finds the physics your boat model is missing.

The verbs of the command line are functions here; each is loaded when it is first used.

>>> import undertow
>>> "discover" in dir(undertow)
True
"""

from importlib import import_module
from typing import Any

_PUBLIC = {
    "AdaptSettings": "discovery.adapt",
    "Augmentation": "residuals.settings",
    "Audit": "reports.audit",
    "DataSet": "measurements.dataset",
    "DiscoverySettings": "discovery.settings",
    "EFFECTS": "physics.effects",
    "Findings": "discovery.findings",
    "Inputs": "reports.inputs",
    "Log": "measurements.log",
    "LogError": "physics.errors",
    "Motion": "physics.motion",
    "PAPER": "measurements.dataset",
    "Recipe": "measurements.dataset",
    "RequestError": "physics.errors",
    "Run": "reports.run",
    "TrainRun": "reports.trained",
    "TrainingSettings": "residuals.settings",
    "Vehicle": "physics.vehicle",
    "VehicleError": "physics.errors",
    "WEAK": "measurements.dataset",
    "add": "reports.run",
    "adapt": "discovery.adapt",
    "audit": "reports.audit",
    "check": "reports.checked",
    "compare": "reports.compare",
    "discover": "reports.run",
    "distil": "reports.distilled",
    "fit": "reports.fitted",
    "inspect_log": "measurements.inspection",
    "load_model": "reports.models",
    "load_vehicle": "physics.vehicle",
    "prepare": "measurements.prepare",
    "read_inputs": "reports.inputs",
    "read_log": "measurements.log",
    "report": "reports.reported",
    "simulate_world": "physics.worlds",
    "split": "measurements.split",
    "train": "reports.trained",
    "write_run": "reports.folder",
}

__all__ = list(_PUBLIC)


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_PUBLIC[name]}", __name__), name)


def __dir__() -> list[str]:
    return sorted(_PUBLIC)
