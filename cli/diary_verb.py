"""The verb `diary`: how the hulls of a fleet change over months, on one page."""

from pathlib import Path

from .console import print_json, prose, say, tell_replaced
from .options import FORCE, JSON, SEED, argument, check_files, option


def diary(
    fleet: Path = argument("FLEET", "Folder that `undertow fleet` made."),
    out: Path | None = option("--out -o", "Page to write; without one, sentences only."),
    budget: float = option("--false-alarms", "Most false alarms expected of a boat in a year, over everything.", 1.0),
    seed: int = SEED,
    force: bool = FORCE,
    as_json: bool = JSON,
) -> None:
    """Say how each hull of a fleet changes: what, since when, and how sure; and draw its days."""
    from ..fleet.diary import diary_of
    from ..fleet.hull_changes import WatchSettings
    from ..fleet.parameter_estimates import read_fleet
    from ..physics.files import write_text
    from ..reports.hull_diary import boat_sentences, caution, in_telling_order, verdict

    settings = WatchSettings(budget, seed)
    earlier = check_files((("--out", "diary", out),), (fleet,), force=force)
    facts = diary_of(read_fleet(fleet), fleet.absolute().name, settings)
    if out is not None:
        from ..reports.page.page import diary_page

        write_text(out, diary_page(facts))
    tell_replaced(earlier)
    if as_json:
        print_json(facts.to_dict())
        return
    prose(verdict(facts))
    for boat in in_telling_order(facts.boats):
        prose(f"{boat.boat}: {boat_sentences(boat)}")
    prose(caution(facts))
    if out is not None:
        say(f"{out}")
