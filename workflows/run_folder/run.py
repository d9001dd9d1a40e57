"""A finished main job, before it is written."""

from collections.abc import Callable
from dataclasses import dataclass

import pandas as pd

from ...comparison.audit import Audit
from ...comparison.facts import Comparison
from ...discovery.discover import Discovery
from ...discovery.findings import Findings
from ...discovery.settings import DiscoverySettings
from ...measurements.prepared_logs import Inputs
from ...physics.cards import Card

Say = Callable[[str], None]


@dataclass(frozen=True, slots=True, repr=False)
class Run(Card):
    """A finished main job, before it is written; `audit` is of the corrected model, `verb` what asked for the run."""

    inputs: Inputs
    discovery: Discovery
    findings: Findings
    comparison: Comparison
    series: pd.DataFrame
    settings: DiscoverySettings
    audit: Audit
    verb: tuple[str, ...] = ("discover",)

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        return [("logs", self.inputs.log_names), *self.findings.card(), *self.comparison.card()]
