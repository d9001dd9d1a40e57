"""The verb `explain`: say what of a model's correction is a named effect, what has no name, and what is memory."""

from pathlib import Path

from ..measurements.log_options import Reading
from .console import print_json, progress, show, warn
from .options import JSON, LOGS, READING, SEED, VEHICLE, argument, read_logs


def explain(
    model: Path = argument("MODEL", "Folder of a network, run folder or vehicle file."),
    logs: list[Path] = LOGS,
    vehicle: str = VEHICLE,
    seed: int = SEED,
    reading: Reading = READING,
    as_json: bool = JSON,
) -> None:
    """Say what of a model's correction is a named effect, what has no name, and what is memory."""
    from ..discovery.basis import DiscoverySettings
    from ..reports.terminal.laws_and_effects_screen import distilled_table
    from ..workflows.check_and_explain import distil

    inputs = read_logs(logs, vehicle, reading)
    found = distil(model, inputs, DiscoverySettings(seed=seed), progress=progress)
    if as_json:
        print_json({**found.to_dict(), "warnings": list(inputs.warnings)})
    else:
        warn(inputs.warnings, inputs.repairs)
        show(distilled_table(found))
