"""The contents of a run folder, read and checked: all that a page is made of."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import pandas as pd

from ..comparison.facts import AuditRecord, Comparison, MadeFrom
from ..discovery.findings import Findings
from ..measurements.inspection import Inspection
from ..physics.cards import Card, Drawn
from ..physics.vehicle import Vehicle


@dataclass(frozen=True, slots=True, repr=False)
class RunFolder(Card, Drawn):
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
    """

    DRAWN_BY: ClassVar[str] = "reports.page.figures.plots:of_folder"

    folder: Path
    findings: Findings
    comparison: Comparison
    nominal: Vehicle
    corrected: Vehicle
    series: pd.DataFrame
    inspections: tuple[Inspection, ...]
    audit: AuditRecord | None
    record: MadeFrom
    digests: dict[str, str]

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        both = dict.fromkeys([*self.findings.card(), *self.comparison.card()])  # the same warnings once
        return [("folder", str(self.folder)), *both]
