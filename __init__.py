"""undertow finds the physics your boat model is missing.

The verbs of the command line are functions here; each is loaded when it is first used.

>>> import undertow
>>> "discover" in dir(undertow)
True
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # what editors and type checkers see of the names below, each written twice to be exported
    from .comparison.audit import Audit as Audit
    from .comparison.audit import audit as audit
    from .comparison.error_limits import Limits as Limits
    from .comparison.error_limits import load_limits as load_limits
    from .comparison.models_by_name import load_model as load_model
    from .discovery.basis import DiscoverySettings as DiscoverySettings
    from .discovery.calibration.following import adapt as adapt
    from .discovery.calibration.forgetting_fit import AdaptSettings as AdaptSettings
    from .discovery.experiment.optimal_manoeuvre import Bounds as Bounds
    from .discovery.factors import Ensemble as Ensemble
    from .discovery.factors import Factors as Factors
    from .discovery.factors import ensemble as ensemble
    from .discovery.factors import read_factors as read_factors
    from .discovery.factors import write_factors as write_factors
    from .discovery.findings import Findings as Findings
    from .exports.formats.base import Choices as Choices
    from .fleet.build_fleet import build_fleet as build_fleet
    from .fleet.diary import diary_of as diary_of
    from .fleet.fleet_folder import merge_fleets as merge_fleets
    from .fleet.hull_changes import WatchSettings as WatchSettings
    from .fleet.parameter_estimates import Fleet as Fleet
    from .fleet.parameter_estimates import HullEstimate as HullEstimate
    from .fleet.parameter_estimates import read_fleet as read_fleet
    from .fleet.workers import Engine as Engine
    from .measurements.inspection import inspect_log as inspect_log
    from .measurements.log import Log as Log
    from .measurements.log import read_log as read_log
    from .measurements.log_options import Reading as Reading
    from .measurements.preparation.prepare import PAPER as PAPER
    from .measurements.preparation.prepare import WEAK as WEAK
    from .measurements.preparation.prepare import DataSet as DataSet
    from .measurements.preparation.prepare import Recipe as Recipe
    from .measurements.preparation.prepare import prepare as prepare
    from .measurements.preparation.split import split as split
    from .measurements.prepared_logs import Inputs as Inputs
    from .physics.effects import EFFECTS as EFFECTS
    from .physics.errors import LogError as LogError
    from .physics.errors import RequestError as RequestError
    from .physics.errors import VehicleError as VehicleError
    from .physics.motion import Motion as Motion
    from .physics.vehicle import Vehicle as Vehicle
    from .physics.vehicle import load_vehicle as load_vehicle
    from .physics.worlds.world import simulate_world as simulate_world
    from .reports.page.figures.plots import Plots as Plots
    from .residuals.training.training_settings import Augmentation as Augmentation
    from .residuals.training.training_settings import Choice as Choice
    from .residuals.training.training_settings import TrainingSettings as TrainingSettings
    from .workflows.check_and_explain import check as check
    from .workflows.check_and_explain import distil as distil
    from .workflows.compare import ci as ci
    from .workflows.compare import compare as compare
    from .workflows.compare import first_limits as first_limits
    from .workflows.compress import compress as compress
    from .workflows.control import Trial as Trial
    from .workflows.control import control as control
    from .workflows.discover_and_add import add as add
    from .workflows.discover_and_add import discover as discover
    from .workflows.export import export as export
    from .workflows.first_vehicle import Hull as Hull
    from .workflows.fit import fit as fit
    from .workflows.inputs import read_inputs as read_inputs
    from .workflows.inspect_and_init import init as init
    from .workflows.plan import plan as plan
    from .workflows.plan import write_plan as write_plan
    from .workflows.report import report as report
    from .workflows.run_folder.moved_files import Moved as Moved
    from .workflows.run_folder.read import read_run
    from .workflows.run_folder.write import Run as Run
    from .workflows.run_folder.write import write_run as write_run
    from .workflows.train import TrainRun as TrainRun
    from .workflows.train import train as train

    load_run = read_run
    __version__: str

# Public names and the modules that hold them; after a colon, what they are called there.
_PUBLIC = {
    "AdaptSettings": "discovery.calibration.forgetting_fit",
    "Augmentation": "residuals.training.training_settings",
    "Audit": "comparison.audit",
    "DataSet": "measurements.preparation.prepare",
    "DiscoverySettings": "discovery.basis",
    "EFFECTS": "physics.effects",
    "Engine": "fleet.workers",
    "Ensemble": "discovery.factors",
    "Factors": "discovery.factors",
    "Bounds": "discovery.experiment.optimal_manoeuvre",
    "Choices": "exports.formats.base",
    "Choice": "residuals.training.training_settings",
    "Fleet": "fleet.parameter_estimates",
    "Findings": "discovery.findings",
    "Hull": "workflows.first_vehicle",
    "HullEstimate": "fleet.parameter_estimates",
    "Inputs": "measurements.prepared_logs",
    "WatchSettings": "fleet.hull_changes",
    "Limits": "comparison.error_limits",
    "Log": "measurements.log",
    "LogError": "physics.errors",
    "Motion": "physics.motion",
    "Moved": "workflows.run_folder.moved_files",
    "PAPER": "measurements.preparation.prepare",
    "Reading": "measurements.log_options",
    "Plots": "reports.page.figures.plots",
    "Recipe": "measurements.preparation.prepare",
    "RequestError": "physics.errors",
    "Run": "workflows.run_folder.write",
    "TrainRun": "workflows.train",
    "TrainingSettings": "residuals.training.training_settings",
    "Trial": "workflows.control",
    "Vehicle": "physics.vehicle",
    "VehicleError": "physics.errors",
    "WEAK": "measurements.preparation.prepare",
    "add": "workflows.discover_and_add",
    "adapt": "discovery.calibration.following",
    "audit": "comparison.audit",
    "build_fleet": "fleet.build_fleet",
    "check": "workflows.check_and_explain",
    "ci": "workflows.compare",
    "compare": "workflows.compare",
    "compress": "workflows.compress",
    "control": "workflows.control",
    "diary_of": "fleet.diary",
    "discover": "workflows.discover_and_add",
    "distil": "workflows.check_and_explain",
    "export": "workflows.export",
    "ensemble": "discovery.factors",
    "first_limits": "workflows.compare",
    "fit": "workflows.fit",
    "init": "workflows.inspect_and_init",
    "inspect_log": "measurements.inspection",
    "load_limits": "comparison.error_limits",
    "load_model": "comparison.models_by_name",
    "load_run": "workflows.run_folder.read:read_run",
    "load_vehicle": "physics.vehicle",
    "merge_fleets": "fleet.fleet_folder",
    "plan": "workflows.plan",
    "prepare": "measurements.preparation.prepare",
    "read_factors": "discovery.factors",
    "read_fleet": "fleet.parameter_estimates",
    "read_inputs": "workflows.inputs",
    "read_log": "measurements.log",
    "report": "workflows.report",
    "simulate_world": "physics.worlds.world",
    "split": "measurements.preparation.split",
    "train": "workflows.train",
    "write_factors": "discovery.factors",
    "write_plan": "workflows.plan",
    "write_run": "workflows.run_folder.write",
}

__all__ = list(_PUBLIC)  # pyright: ignore[reportUnsupportedDunderAll]

if not TYPE_CHECKING:  # with a __getattr__, type checkers would take any name for one of these

    def __getattr__(name: str) -> object:
        if name == "__version__":
            return import_module("importlib.metadata").version(__name__)
        if name not in _PUBLIC:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        module, _, called = _PUBLIC[name].partition(":")
        return getattr(import_module(f".{module}", __name__), called or name)


def __dir__() -> list[str]:
    return sorted(_PUBLIC)
