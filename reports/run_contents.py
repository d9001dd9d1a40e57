"""The contents of a run folder or comparison, read and checked: all that a page is made of; and models side by side."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from ..comparison.facts import AuditRecord, ComparedModel, Comparison, MadeFrom, PairedRecord, RulingRecord
from ..discovery.basis import DiscoverySettings
from ..discovery.findings import Findings
from ..measurements.inspection import Inspection
from ..measurements.prepared_logs import Inputs
from ..physics.presentation import Card, from_above
from ..physics.vehicle import Vehicle
from ..residuals.scores import RolloutRecord
from .wording import LEAD, pick_horizon

if TYPE_CHECKING:
    import pandas as pd

    from .page.figures.plots import Plots


@dataclass(frozen=True, slots=True)
class ComparisonFolder:
    """The files that `compare --page` wrote, read and checked.

    Attributes
    ----------
    comparison : Comparison
    series : DataFrame
        `series.csv` of the two models of which it tells where they fail, SI units, one row per time step (10 Hz).
    """

    comparison: Comparison
    series: "pd.DataFrame"


@dataclass(frozen=True, slots=True, repr=False)
class RunFolder(Card):
    """The files that `discover` wrote, read and checked.

    Attributes
    ----------
    folder : Path
    findings : Findings
    comparison : Comparison
    nominal, corrected : Vehicle
        The vehicle before (`nominal.yaml`) and after (`model.yaml`).
    series : DataFrame
        `series.csv`, SI units, one row per time step (10 Hz).
    inspections : tuple of Inspection
        One of each log; none where `inspection.json` was not written.
    audit : AuditRecord
        None where `audit.json` was not written.
    record : MadeFrom
        As in `run.json`, what the run was made from; empty where that was not written.
    digests : dict
        The first 12 hexadecimal digits of each file's SHA-256.
    read_inputs : callable
        Reads the logs again; see `inputs`.
    """

    DRAWN_BY: ClassVar[str] = "reports.page.figures.plots:of_folder"

    folder: Path
    findings: Findings
    comparison: Comparison
    nominal: Vehicle
    corrected: Vehicle
    series: "pd.DataFrame"
    inspections: tuple[Inspection, ...]
    audit: AuditRecord | None
    record: MadeFrom
    digests: dict[str, str]
    read_inputs: Callable[[], Inputs]

    @property
    def inputs(self) -> Inputs:
        """The run's logs and its nominal vehicle, to go on with: read when they are first asked for.

        Raises
        ------
        LogError, VehicleError, RequestError
            when a log is gone, or another than the one that the run was made from.
        """
        return self.read_inputs()

    @property
    def settings(self) -> DiscoverySettings:
        """The seed of the run, and whether it fitted the model's own numbers beside the effects."""
        return DiscoverySettings(seed=self.record.seed or 0, refit=self.record.refit)

    @property
    def plot(self) -> "Plots":
        """Plots of it, as matplotlib axes."""
        return from_above(self.DRAWN_BY)(self)

    def drawings(self) -> Mapping[str, str]:
        """See `Card`."""
        return from_above("reports.page.figures.plots:of_run")(self.findings, self.series, self.nominal)

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        both = dict.fromkeys([*self.findings.card(), *self.comparison.card()])  # the same warnings once
        return [("folder", str(self.folder)), *both]


MARKS = {"better": "\N{DOWNWARDS ARROW}", "worse": "\N{UPWARDS ARROW}", "no difference": "=", "too short to tell": "?"}
"""Signs of a paired difference; one is never told by its colour alone."""


@dataclass(frozen=True, slots=True)
class Rival:
    """A model in the picture.

    Attributes
    ----------
    model : as the comparison has it
    score : of its predictions, NaN where they diverged
    interval : of their position error [m], from the paired 95 % interval of its difference to the reference
    laws : verdict by law: pass, fail, noted, not applicable; empty when no law was asked
    """

    model: ComparedModel
    score: RolloutRecord
    interval: tuple[float, float] | None
    laws: dict[str, str]


def rivals(comparison: Comparison, audit: AuditRecord | None = None) -> list[Rival]:
    """Every compared model, the smallest prediction error first, those that ran away last."""
    horizon, reference = hero_horizon(comparison), reference_of(comparison)
    scores = {model.name: model.rollout.get(horizon) or RolloutRecord() for model in comparison.models}
    base = scores[reference].position if reference in scores else float("nan")
    found = []
    for model in comparison.models:
        apart = _paired(comparison.differences, model.name, reference, horizon) if base == base else None
        interval = (max(base + apart[0], 0.0), max(base + apart[1], 0.0)) if apart else None
        laws = {law.law: law.outcome for law in laws_of(model, audit)}
        found.append(Rival(model, scores[model.name], interval, laws))
    return sorted(found, key=lambda one: (one.score.position != one.score.position, one.score.position))


def laws_of(model: ComparedModel, audit: AuditRecord | None) -> Sequence[RulingRecord]:
    """The laws of a compared model, from the comparison, or for the corrected one from the audit beside it."""
    return model.laws or (audit.laws if audit is not None and model.name == "corrected" else ())


def hero_horizon(comparison: Comparison) -> str:
    """The horizon [s] by which the models are drawn: the one that decides which to trust, else 10 s."""
    known = [key for model in comparison.models for key in model.rollout]
    return pick_horizon(known, comparison.best.horizon or LEAD)


def reference_of(comparison: Comparison) -> str:
    """The model against which the others are told: the corrected one where there is one, else the first.

    None that was fitted to the judged rows, whose errors are too small.
    """
    names = [model.name for model in comparison.models]
    paired = {name for item in comparison.differences for name in (item.model, item.against)}
    paired -= {model.name for model in comparison.models if model.fitted_here}
    return next((name for name in ("corrected", "calibrated", "nominal") if name in paired), names[0] if names else "")


def _paired(
    differences: Sequence[PairedRecord], model: str, reference: str, horizon: str
) -> tuple[float, float] | None:
    """The 95 % interval of the difference in position error to the reference [m], told either way; None without."""
    for name, against, turned in ((model, reference, False), (reference, model, True)):
        told = difference(differences, name, against, "rollout", "position", horizon)
        low, high = (told and told.ci95) or (float("nan"), float("nan"))
        if low <= high:
            return (-high, -low) if turned else (low, high)
    return None


def difference(
    differences: Sequence[PairedRecord], model: str, against: str, quantity: str, axis: str, horizon: str | None = None
) -> PairedRecord | None:
    """The paired difference of a model to another in one error; None where it was not told."""
    wanted = (model, against, quantity, axis, horizon)
    return next((d for d in differences if (d.model, d.against, d.quantity, d.axis, d.horizon) == wanted), None)
