"""The verb `adapt`: follow parameters of a boat while its log is written."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from ..measurements.log_options import Reading
from .console import complain, prose, say, say_written, tell_replaced
from .options import FORCE, JSON, SEED, UNREPAIRED_READING, VEHICLE, argument, check_files, option

if TYPE_CHECKING:
    from ..discovery.calibration.following import Update
    from ..physics.vehicle import Vehicle
    from ..workflows.follow_live import Begun


def adapt(
    log: str = argument("LOG", "CSV log, complete or still written; - for standard input."),
    vehicle: str = VEHICLE,
    effect: list[str] | None = option(
        "--effect -e", "Follow this; default: damping, and each thruster's scale.", metavar="NAME"
    ),
    follow: bool = option("--follow -f", "Wait for more lines; end with Ctrl-C or --idle.", False),
    idle: float | None = option("--idle", "With --follow, end when nothing came for so long.", metavar="SECONDS"),
    run_in: float = option("--run-in", "Beginning of the log that tells noise and forces.", 60.0, metavar="SECONDS"),
    like: Path | None = option("--like", "Earlier log of this boat that tells them instead.", metavar="LOG"),
    alarm_hours: float = option("--alarm-hours", "Hours under way in which one false alarm may be expected.", 24.0),
    every: float = option("--every", "Time in the log between two rows that are printed.", 1.0, metavar="SECONDS"),
    network: Path | None = option(
        "--network", "Follow the last layer of this network of the vehicle, too.", metavar="FOLDER"
    ),
    out: Path | None = option("--out -o", "Vehicle file to write; with --network, the network's new folder."),
    values: Path | None = option("--values", "CSV of the rows that are printed."),
    force: bool = FORCE,
    seed: int = SEED,
    reading: Reading = UNREPAIRED_READING,
    as_json: bool = JSON,
) -> None:
    """Follow what a boat's parameters are while its log is written, and say when one of them changes."""
    from ..discovery.calibration.change_watch import AlarmSettings
    from ..physics.errors import LogError, RequestError
    from ..physics.stage import collect_and_freeze
    from ..physics.vehicle import load_vehicle
    from ..workflows.follow_live import Begun, LiveSettings, Note, follow_live

    if not every > 0.0:
        raise RequestError(f"adapt: expected --every above 0 s, got {every:g} s")
    settings = LiveSettings(run_in, follow, idle, alarm=AlarmSettings(alarm_hours, seed=seed))
    boat = load_vehicle(vehicle)
    targets = [("--out", "adapt", None if network else out), ("--values", "adapt --values", values)]
    reads = (Path(log), vehicle, reading.channel_map, like)
    if network is not None and out is not None:
        from ..workflows.train import check_folder

        check_folder(out, False, ([Path(log)], vehicle, reading.channel_map, [network, like]), force=force)
    earlier = check_files(targets, (*reads, network), force=force)
    screen: _Screen | None = None
    stopped: KeyboardInterrupt | LogError | None = None
    try:
        for event in follow_live(log, boat, effect or (), reading, settings, like, network):
            if isinstance(event, Note):
                complain(f"  {event.text}")
            elif isinstance(event, Begun):
                screen = _Screen(event, every, as_json, values is not None)
                screen.begin(alarm_hours)
                collect_and_freeze()
            elif screen is not None:
                screen.tell(event)
    except (KeyboardInterrupt, LogError) as error:  # the ways in which a log that has no end is left, or ends badly
        stopped = error
    if screen is not None and screen.last is not None:
        screen.write(log, boat, out, values, force=force)
        tell_replaced(earlier)
        screen.end(out, values)
    if stopped is not None:
        raise stopped


class _Screen:
    """What is printed of a log that is followed, and kept of it for the files."""

    def __init__(self, begun: "Begun", every: float, as_json: bool, keeps: bool) -> None:
        self._begun, self._every, self._json, self._keeps = begun, every, as_json, keeps
        self._next, self._rows, self._alarms = -float("inf"), list[str](), 0
        self._updates = self._excited = 0
        self.last: Update | None = None

    def begin(self, hours: float) -> None:
        from ..reports.hull_diary import heading

        begun = self._begun
        wider = "" if begun.widening == 1.0 else f", taken with {begun.widening:.3g} times its variance"
        complain(
            f"  noise and size of the forces from {begun.seconds:.0f} s under way; one false alarm in {hours:g} h is "
            f"allowed, for noise like that{wider}"
        )
        if not self._json:
            for text in heading(tuple(begun.start), begun.units):
                print(text)

    def tell(self, update: "Update") -> None:
        from ..physics.files import strict_json
        from ..reports.hull_diary import alarm_sentence, followed_row, row, table_row

        self.last, self._updates = update, self._updates + 1
        self._excited += update.excited
        due, alarm = update.time >= self._next, update.alarm
        if due:
            self._next = self._every * (update.time // self._every + 1.0)
            if self._keeps:
                self._rows.append(table_row(update))
        if self._json and (due or alarm):
            print(strict_json(followed_row(update, self._begun.symbols), None), flush=True)
        elif not self._json:
            if due:
                print(row(update, len(self._begun.start)))
            if alarm is not None:
                unit = self._begun.units[self._begun.symbols.index(alarm.symbol)]
                say("")
                prose(f"ALARM {alarm_sentence(alarm, unit)}", "bold red")
            sys.stdout.flush()
        self._alarms += alarm is not None

    def write(self, log: str, boat: "Vehicle", out: Path | None, values: Path | None, *, force: bool) -> None:
        from ..physics.files import on_top, write_text
        from ..physics.presentation import number
        from ..physics.sources import with_sources
        from ..reports.hull_diary import CI, table_heading

        if self.last is None:
            return
        if out is not None:
            layer = self._begun.network
            own = len(self.last.values) - (0 if layer is None else len(layer.symbols))
            now = dict(zip(self._begun.symbols[:own], self.last.values.tolist(), strict=False))
            wide = zip(now, (CI * self.last.deviation).tolist(), strict=False)
            marks = {symbol: f"95 % within {number(half, 2)} of it" for symbol, half in wide}
            found = boat.with_values(now, name=f"{boat.name}, followed")
            found = with_sources(boat, found, "followed by undertow adapt", marks)
            if layer is None:
                found.save(out, by="adapt")
            else:
                from ..residuals.models.model_files import save_network

                logs = {} if log == "-" else {"logs": [Path(log).name]}
                made = layer.adapted(self.last.values[own:], found)
                save_network(made, out, {"by": "undertow adapt", **logs}, force=force)
        if values is not None:
            text = "\n".join([table_heading(self._begun.symbols), *self._rows, ""])
            write_text(values, on_top("adapt --values", text))

    def end(self, out: Path | None, values: Path | None) -> None:
        from ..reports.hull_diary import far_from_start

        if self._json:
            return
        say("")
        ends = "no alarm" if not self._alarms else f"{self._alarms} alarm{'s' * (self._alarms > 1)}"
        say(f"{self._updates} updates, {self._excited} of them under way; {ends}.")
        apart = "" if self.last is None or self._alarms else far_from_start(self.last, self._begun.start)
        if apart:
            prose(
                f"No change was seen, yet far from the vehicle file: {apart}. Then the model lacks something, and "
                "'undertow discover' says what."
            )
        what = "Vehicle" if self._begun.network is None else "Network, with its vehicle,"
        say("No vehicle is written without --out." if out is None else f"{what} as it was followed: {out}")
        say_written({"Values": values})
