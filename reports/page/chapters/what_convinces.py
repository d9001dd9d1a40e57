"""The section of the report page that shows the missing force itself, and the law that was added for it."""

from ...run_contents import RunFolder
from ..figures.effect_figures import convincing, force_drawings
from ..markup import figure
from .base import Chapter, Section


def what_convinces(run: RunFolder) -> Section | None:
    """The force that the nominal model lacks over what it depends on, and what was added, axis by axis."""
    found = convincing(run.findings, run.series, run.nominal)
    if not found:
        return None
    caption = (
        "Grey: the measured force less that of the nominal model, a dot a row; discs: its means. Line: what was added "
        "to the model, averaged over the same rows. Where the line runs through the discs, the model has what it "
        "lacked. Each is drawn over the signal over which that is seen best; what depends on several scatters."
    )
    title = "The force that is missing" if run.findings.missing else "The force that the nominal model lacks"
    return Section(title, figure(force_drawings(found), caption, cls="three"))


WHAT_CONVINCES = Chapter(15, what_convinces)
