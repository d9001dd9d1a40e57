"""The verb `fit`: calibrate the parameters that the vehicle model has, under the laws of energy."""

from typing import Annotated

import typer

from ..measurements.log_options import AS_GUESSED
from .console import print_json, progress, prose, say, show, show_steps, tell_replaced, warn
from .options import (
    ForceOption,
    JsonOption,
    Logs,
    ReadingOptions,
    SeedOption,
    VehicleOption,
    VehicleOut,
    earlier_files,
    one_by_one,
    read_logs,
)


def fit(
    logs: Logs,
    vehicle: VehicleOption,
    out: VehicleOut = None,
    free: Annotated[
        list[str] | None, typer.Option("--free", metavar="SYMBOL", help="Calibrate this too, though it has no value.")
    ] = None,
    hold: Annotated[list[str] | None, typer.Option("--hold", metavar="SYMBOL", help="Leave this as it is.")] = None,
    force: ForceOption = False,
    seed: SeedOption = 0,
    reading: ReadingOptions = AS_GUESSED,
    as_json: JsonOption = False,
) -> None:
    """Calibrate the parameters that the vehicle model has, under the laws of energy."""
    from ..discovery.basis import DiscoverySettings
    from ..reports.terminal import findings_screen as terminal
    from ..workflows.fit import fit as calibrate

    earlier = earlier_files((("--out", "fit", out),), (logs, vehicle, reading.channel_map), force=force)
    inputs = read_logs(logs, vehicle, reading)
    done = calibrate(inputs, one_by_one(free), one_by_one(hold), DiscoverySettings(seed=seed), progress=progress)
    if out is not None:
        done.vehicle.save(out, by="fit")
    tell_replaced(earlier)
    if as_json:
        print_json(done.to_dict())
        return
    say("")
    warn(done.inputs.warnings, done.inputs.repairs)
    prose(" ".join(done.sentences))
    show(terminal.calibrated_table(done.calibration.parameters), terminal.not_calibrated_list(done.left))
    show_steps(done.steps)
    show(terminal.energy_text(done.calibration.lawful.passivity))
    say("Nothing is written without --out." if out is None else f"Calibrated vehicle: {out}")
