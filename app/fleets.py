"""A fleet on the workbench: whether one is meant, and its hull diary."""

import os
from collections.abc import Callable
from pathlib import Path

from ..physics.errors import RequestError
from ..physics.files import write_text
from ..workflows.workbench_facts import HullDiary, Source


def fleet_in(source: Source | None) -> str:
    """The folder of the fleet that is to be opened; empty where logs are.

    Raises
    ------
    RequestError
        when a vehicle or a map is given with it.
    """
    if source is None or len(source.logs) != 1 or not os.path.isdir(source.logs[0]):
        return ""
    from ..fleet.log_sources import INDEX  # here, because the first page is there before anybody asks for a fleet

    (folder,) = source.logs
    if not os.path.isfile(os.path.join(folder, INDEX)):
        return ""
    if source.vehicle or source.channel_map or source.frame:
        raise RequestError(f"{folder}: a fleet has been read for its vehicles already; leave vehicle, map and axes out")
    return folder


def hull_diary(fleet: str, folder: str, say: Callable[[str], None] | None = None) -> HullDiary:
    """The diary of a fleet, with its page in a folder."""
    from ..fleet.diary import diary_of
    from ..fleet.parameter_estimates import read_fleet
    from ..reports.page.fleet_page import diary_page, glance

    tell = say or (lambda line: None)
    found = read_fleet(fleet)
    tell(f"watching the hulls of {len({one.boat for one in found.estimates})} boats")
    facts = diary_of(found, Path(fleet).absolute().name)
    tell("drawing their days")
    page = write_text(Path(folder) / "diary.html", diary_page(facts))
    return HullDiary(facts.fleet, glance(facts), str(page))
