"""The verb `explain`: say what of a model's correction is a named effect, what has no name, and what is memory."""

from pathlib import Path
from typing import Annotated

import typer

from ..measurements.log_options import AS_GUESSED
from .console import print_json, progress, show, warn
from .options import JsonOption, Logs, ReadingOptions, SeedOption, VehicleOption, read_logs


def explain(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="Folder of a network, run folder or vehicle file.")],
    logs: Logs,
    vehicle: VehicleOption,
    seed: SeedOption = 0,
    reading: ReadingOptions = AS_GUESSED,
    as_json: JsonOption = False,
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
