"""A finished main job, before it is written."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...comparison.audit import Audit
from ...comparison.facts import Comparison
from ...discovery.discover import Discovery
from ...discovery.findings import Findings
from ...discovery.settings import DiscoverySettings
from ...measurements.prepared_logs import Inputs
from ...physics.cards import Card
from ...physics.vehicle import Vehicle
from ...residuals.series_table import SeriesTable

if TYPE_CHECKING:
    import pandas as pd

    from ...reports.page.figures.plots import Plots


@dataclass(frozen=True, slots=True, repr=False)
class Run(Card):
    """A finished main job, before it is written.

    `audit` is of the corrected model, `verb` what asked for the run, `calibrated` the nominal model with its own
    numbers fitted, where it could be fitted.
    """

    inputs: Inputs
    discovery: Discovery
    findings: Findings
    comparison: Comparison
    table: SeriesTable
    settings: DiscoverySettings
    audit: Audit
    verb: tuple[str, ...] = ("discover",)
    calibrated: Vehicle | None = None

    @property
    def series(self) -> "pd.DataFrame":
        """Measured and predicted motion, as `series.csv` holds it: SI units, one row per time step (10 Hz)."""
        return self.table.frame()

    @property
    def plot(self) -> "Plots":
        """Plots of the run, as matplotlib axes."""
        from ...reports.page.figures.plots import Plots

        ends = self.discovery.nominal, self.discovery.corrected
        return Plots(self.findings, self.series, *ends, self.comparison.best.horizon)

    def drawings(self) -> Mapping[str, str]:
        """See `Card`."""
        from ...reports.page.notebook_card import of_run

        return of_run(self.findings, self.series, self.discovery.nominal)

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        both = dict.fromkeys([*self.findings.card(), *self.comparison.card()])  # the same warnings once
        return [("logs", self.inputs.log_names), *both]
