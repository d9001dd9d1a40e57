"""The verb `fit`: calibrate the parameters that the vehicle model has, under the laws of energy."""

from pathlib import Path

from ..measurements.log_options import Reading
from .console import print_json, progress, prose, say, show, show_steps, tell_replaced, warn
from .options import FORCE, JSON, LOGS, READING, SEED, VEHICLE, VEHICLE_OUT, check_files, one_by_one, option, read_logs


def fit(
    logs: list[Path] = LOGS,
    vehicle: str = VEHICLE,
    out: Path | None = VEHICLE_OUT,
    free: list[str] | None = option("--free", "Calibrate this too, though it has no value.", metavar="SYMBOL"),
    hold: list[str] | None = option("--hold", "Leave this as it is.", metavar="SYMBOL"),
    force: bool = FORCE,
    seed: int = SEED,
    reading: Reading = READING,
    as_json: bool = JSON,
) -> None:
    """Calibrate the parameters that the vehicle model has, under the laws of energy."""
    from ..discovery.basis import DiscoverySettings
    from ..reports.terminal import findings_screen as terminal
    from ..workflows.fit import fit as calibrate

    earlier = check_files((("--out", "fit", out),), (logs, vehicle, reading.channel_map), force=force)
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
    show_steps(done.steps, deciding=f"{done.calibration.horizon:g}")
    show(terminal.energy_text(done.calibration.lawful.passivity))
    say("Nothing is written without --out." if out is None else f"Calibrated vehicle: {out}")
