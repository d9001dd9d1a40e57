"""The verb `train`: train a network that corrects the vehicle model, or stands in its place."""

from pathlib import Path
from typing import Annotated

import typer

from ..measurements.log_options import Reading
from .console import failing_clearly, interrupted, print_json, progress, prose, say, show, tell_repairs, warn
from .options import (
    AsIsOption,
    FixOption,
    ForceOption,
    FrameOption,
    JsonOption,
    Logs,
    MapOption,
    NamespaceOption,
    SeedOption,
    VehicleOption,
    read_logs,
)


def train(
    logs: Logs,
    vehicle: VehicleOption,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder of the network to write.")],
    residual: Annotated[
        str | None,
        typer.Option(
            "--residual",
            help="Network: mlp, symmetric, lstm (when not given), tcn, transformer, dissipative, port_hamiltonian, "
            "trees, gp, ridge, or best: the one that predicts best over blocks of the log that it does not know.",
        ),
    ] = None,
    start: Annotated[
        Path | None, typer.Option("--start", metavar="MODEL", help="Go on from this network, of another boat or log.")
    ] = None,
    pure: Annotated[
        bool, typer.Option("--pure", help="Learn all of the motion, without the vehicle's physics.")
    ] = False,
    heading: Annotated[bool, typer.Option("--heading", help="Let the network see the heading.")] = False,
    option: Annotated[
        list[str] | None, typer.Option("--option", metavar="NAME=VALUE", help="Of the network, such as units=64.")
    ] = None,
    epochs: Annotated[int | None, typer.Option("--epochs", help="Most epochs to train (150 when not given).")] = None,
    seed: SeedOption = 0,
    device: Annotated[str, typer.Option("--device", help="cpu (auto is the same) or cuda.")] = "auto",
    resume: Annotated[bool, typer.Option("--resume", help="Go on with an interrupted training in the folder.")] = False,
    lambda_phys: Annotated[
        float | None, typer.Option("--lambda-phys", help="Weight of the laws of energy (100).")
    ] = None,
    rollout_rows: Annotated[
        int | None, typer.Option("--rollout-rows", help="Train through rollouts of so many rows, too (0).")
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Of the recipe, such as learning_rate=0.001, patience=50."),
    ] = None,
    force: ForceOption = False,
    explain: Annotated[
        bool, typer.Option("--explain", help="Say what of the correction is a named effect, and what is memory.")
    ] = False,
    frame: FrameOption = None,
    channels: MapOption = None,
    namespace: NamespaceOption = None,
    as_is: AsIsOption = False,
    fix: FixOption = False,
    as_json: JsonOption = False,
) -> None:
    """Train a network that corrects the vehicle model, or stands in its place."""
    with failing_clearly():
        from ..workflows import train as trained
        from ..workflows.training_options import parsed_options, settings_with

        trained.check_folder(out, resume, (logs, vehicle, channels), force=force)
        given = {"epochs": epochs, "lambda_phys": lambda_phys, "rollout_rows": rollout_rows}
        settings = settings_with(set_ or [], seed=seed, device=device, **given)
        choice = trained.choice_of(start, residual, parsed_options(option or []), pure=pure, heading=heading)
        inputs = read_logs(logs, vehicle, Reading(frame, channels, namespace, as_is, fix))
        try:
            done = trained.train(
                inputs, choice, settings=settings, out=out, resume=resume, force=force, progress=progress
            )
        except trained.NothingToLearnError as end:
            print_json({"schema": trained.TRAIN_SCHEMA, "network": None, "why": str(end)}) if as_json else prose(
                str(end)
            )
            return
        except KeyboardInterrupt as error:
            kept = (out / trained.CHECKPOINT).exists()
            how = f"the same command with --resume goes on from {out}" if kept else "no epoch was done, nothing is kept"
            interrupted(error, how)
        if explain:
            done = trained.explained(done, out, progress=progress)
        if as_json:
            print_json(done.to_dict())
            return
        from ..reports.terminal.comparison_screen import comparison_table

        say("")
        warn(done.inputs.warnings)
        tell_repairs(done.inputs.repairs)
        prose(" ".join(done.sentences))
        show(comparison_table(done.models, done.inputs.parts.judge))
        if done.distilled is not None:
            from ..reports.terminal.effects_screen import distilled_table

            show(distilled_table(done.distilled))
        say(f"Network: {out} (model.yaml, weights.safetensors{', distillation.json' * explain})")
