"""The verb `explain`: say what of a model's correction is a named effect, what has no name, and what is memory."""

from pathlib import Path
from typing import Annotated

import typer

from ..measurements.log_options import Reading
from .console import failing_clearly, print_json, progress, show, tell_repairs, warn
from .options import (
    AsIsOption,
    FixOption,
    FrameOption,
    JsonOption,
    Logs,
    MapOption,
    NamespaceOption,
    SeedOption,
    VehicleOption,
    read_logs,
)


def explain(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="Folder of a network, run folder or vehicle file.")],
    logs: Logs,
    vehicle: VehicleOption,
    seed: SeedOption = 0,
    frame: FrameOption = None,
    channels: MapOption = None,
    namespace: NamespaceOption = None,
    as_is: AsIsOption = False,
    fix: FixOption = False,
    as_json: JsonOption = False,
) -> None:
    """Say what of a model's correction is a named effect, what has no name, and what is memory."""
    with failing_clearly():
        from ..discovery.settings import DiscoverySettings
        from ..reports.terminal.effects_screen import distilled_table
        from ..workflows.explain import distil

        inputs = read_logs(logs, vehicle, Reading(frame, channels, namespace, as_is, fix))
        found = distil(model, inputs, DiscoverySettings(seed=seed), progress=progress)
        if as_json:
            print_json({**found.to_dict(), "warnings": list(inputs.warnings)})
        else:
            warn(inputs.warnings)
            tell_repairs(inputs.repairs)
            show(distilled_table(found))
