"""The contents of a run folder, or of a comparison, read and checked: all that a page is made of."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from ..comparison.facts import AuditRecord, Comparison, MadeFrom
from ..discovery.basis import DiscoverySettings
from ..discovery.findings import Findings
from ..measurements.inspection import Inspection
from ..measurements.prepared_logs import Inputs
from ..physics.presentation import Card, from_above
from ..physics.vehicle import Vehicle

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
        drawn: Plots = from_above(self.DRAWN_BY)(self)
        return drawn

    def drawings(self) -> Mapping[str, str]:
        """See `Card`."""
        of_run = from_above("reports.page.figures.plots:of_run")
        drawn: dict[str, str] = of_run(self.findings, self.series, self.nominal)
        return drawn

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        both = dict.fromkeys([*self.findings.card(), *self.comparison.card()])  # the same warnings once
        return [("folder", str(self.folder)), *both]
