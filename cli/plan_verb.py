"""The verb `plan`: what to drive next, as files for autopilot, ground station, robot and table."""

from pathlib import Path

from .console import print_json, progress, prose, say
from .options import CHANNEL_MAP, FORCE, JSON, RUN_LOGS, argument, option


def plan(
    run: Path = argument("RUN", "Run folder that discover wrote."),
    effects: list[str] | None = argument(
        "[EFFECT...]", "Effects to tell apart; without any, the first open question.", None
    ),
    out: Path | None = option("--out -o", "Folder to write the mission to."),
    speed: float | None = option("--speed", "Highest speed in m/s."),
    space: float = option("--space", "Farthest from where it begins, in m: the fence.", 50.0),
    thrust: float = option("--thrust", "Most thrust, in % of full command.", 100.0),
    seconds: float = option("--seconds", "Longest manoeuvre in s.", 120.0),
    at: str | None = option("--at", "Where it begins, LAT,LON: for mission.waypoints."),
    heading: float | None = option("--heading", "On which it begins, in degrees from north; the log's else."),
    force: bool = FORCE,
    log: list[Path] | None = RUN_LOGS,
    channels: Path | None = CHANNEL_MAP,
    as_json: bool = JSON,
) -> None:
    """Find the shortest manoeuvre that tells look-alikes apart, and write it as a mission."""
    from ..discovery.experiment.optimal_manoeuvre import Bounds
    from ..workflows.plan import check_mission_target, place_at, write_plan
    from ..workflows.plan import plan as planned
    from ..workflows.run_folder.moved_files import Moved

    bounds = Bounds(float("inf") if speed is None else speed, space, thrust / 100.0, seconds)
    place = None if at is None else place_at(at)
    if out is not None:
        check_mission_target(out, (run,), force=force)
    moved = Moved(tuple(log or ()), channels)
    found = planned(run, effects or (), bounds, place=place, heading=heading, moved=moved, progress=progress)
    if found is None:
        say("Nothing is open: the log tells all that was asked. Name effects to have a manoeuvre for them.")
        return
    tells = found.manoeuvre.tells
    if out is not None and tells:
        write_plan(found, out, force=force)
    if as_json:
        print_json(found.record.to_dict())
        return
    say("")
    for sentence in found.sentences:
        prose(sentence)
    if out is None or not tells:
        say("Nothing is written without --out." if out is None else "Nothing is written: it would not tell.")
        return
    say(f"Mission: {', '.join(str(out / name) for name in found.files)}")
    if found.mission.place is None:
        say("No waypoint file: give --at LAT,LON for one.")
