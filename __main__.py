"""The command line: the verbs of undertow, each loading only what it needs."""

import sys

if __name__ == "__main__" or sys.argv[0].endswith(("undertow", "undertow.exe")):  # not when it is imported
    from .cli.interruption import listen

    listen()  # before anything else: what follows takes a second, in which Ctrl-C is pressed too

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .cli.console import (
    check_here,
    failing_clearly,
    interrupted,
    open_streams,
    print_json,
    progress,
    prose,
    say,
    say_lines,
    sending,
    show,
    tell_replaced,
)
from .physics.effects import EFFECTS

if TYPE_CHECKING:
    from .discovery.findings import FoundEffect, Step
    from .measurements.preparation.prepared_logs import Inputs

app = typer.Typer(
    name="undertow",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

Logs = Annotated[
    list[Path],
    typer.Argument(metavar="LOG...", help="Logs, or folders of them: CSV, Parquet, bags, .bin, .tlog, .ulg, .mat."),
]
VehicleOption = Annotated[str, typer.Option("--vehicle", "-v", help="Vehicle file, or the name of a shipped one.")]
FrameOption = Annotated[str | None, typer.Option("--frame", help="enu or ned, for channels that are not NED/FRD.")]
MapOption = Annotated[Path | None, typer.Option("--map", help="YAML file that maps channels.")]
NamespaceOption = Annotated[
    str | None, typer.Option("--namespace", help="Start of the topics of the vehicle meant, in a log of several.")
]
AsIsOption = Annotated[
    bool, typer.Option("--as-is", help="Take logs that are known to be broken as they are, and be warned.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON for machines instead of tables.")]
ForceOption = Annotated[
    bool, typer.Option("--force", help="Write over what this verb did not write; never over what it reads.")
]
SeedOption = Annotated[
    int, typer.Option("--seed", min=0, help="Seed of everything random; equal seeds give equal files.")
]


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        say(f"undertow {version('undertow')}")
        raise typer.Exit


def _catalogue() -> str:
    """The names of all effects, a paragraph for each family."""
    names: dict[str, list[str]] = {}
    for effect in EFFECTS:
        names.setdefault(effect.family, []).append(effect.name)
    families = (f"{family}: {', '.join(members)}." for family, members in names.items())
    return "\n\n".join(("Effects:", *families, "A term without a name is an axis and a form, such as yaw:u|r|."))


def _amounts() -> str:
    """What the values of `simulate --effect` mean, effect by effect."""
    added, absolute = (", ".join(e.name for e in EFFECTS if e.added is kind) for kind in (True, False))
    return "\n\n".join(
        (
            "Added to the vehicle's own number, so that X_uu=-12 makes -8 to -20 (a term such as yaw:u|r| too): "
            f"{added}.",
            f"Put in the place of the vehicle's own number: {absolute}.",
            "Symbols such as X_uu, lag or port_scale count like their effects; mass, inertia_z and Y_rdot are put in "
            "place. What came of it is printed.",
        )
    )


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and leave.")
    ] = False,
) -> None:
    """Find the physics your boat model is missing."""


@app.command()
def demo(
    out: Annotated[Path, typer.Option("--out", help="Run folder to write.")] = Path("undertow-demo"),
    force: ForceOption = False,
) -> None:
    """Tell the whole story on a log recorded from a Gazebo BlueBoat."""
    from importlib import resources

    with failing_clearly():
        folder = resources.files(__package__ or "undertow") / "data"
        with (
            resources.as_file(folder / "gazebo_blueboat.csv.gz") as log,
            resources.as_file(folder / "demo.yaml") as car,
        ):
            _check_folder(out, force=force)
            say("A log of 4 minutes from a simulated BlueBoat, and a Fossen model with linear drag only.")
            say("")
            _discover(out, partial(_read, [log], str(car), None, None), report=True, seed=0, force=force)


@app.command()
def inspect(
    logs: Annotated[
        list[Path], typer.Argument(metavar="LOG...", help="Logs of one boat, or folders of them; several tell more.")
    ],
    vehicle: Annotated[str | None, typer.Option("--vehicle", "-v", help="Vehicle whose needs are checked.")] = None,
    frame: FrameOption = None,
    channels: MapOption = None,
    namespace: NamespaceOption = None,
    map_out: Annotated[
        Path | None, typer.Option("--map-out", help="YAML file to write the channel map in use to, for --map.")
    ] = None,
    fix: Annotated[
        Path | None, typer.Option("--fix", metavar="OUT.csv", help="Write the log with the safe repairs made.")
    ] = None,
    force: ForceOption = False,
    as_json: JsonOption = False,
) -> None:
    """Say whether logs are sound and what to do about it, and what undertow would do with them.

    Exit code 1 for a log with a defect, or one that cannot be used; with --fix, where the repaired log has one.
    """
    with failing_clearly():
        from .measurements.channels.channel_map import map_text
        from .physics.files import write_text
        from .physics.marks import on_top
        from .physics.vehicle import load_vehicle
        from .reports.terminal.reading_progress import reading_progress
        from .workflows.inspect import look_over

        earlier = _earlier(
            (("--map-out", "inspect --map-out", map_out), ("--fix", "inspect --fix", fix)),
            (logs, vehicle, channels),
            force=force,
        )
        model = None if vehicle is None else load_vehicle(vehicle)
        with reading_progress(progress) as reading:
            found, read = look_over(
                logs, model, frame=frame, channel_map=channels, namespace=namespace, fix=fix, progress=reading
            )
        if map_out is not None:
            write_text(map_out, on_top("inspect --map-out", map_text(read.entries, read.unused)))
        tell_replaced(earlier)
        if as_json:
            print_json(found)
        else:
            from .reports.terminal.inspection_screen import fixed_text, inspection_screen, inspections_screen

            show(inspections_screen(found) if "logs" in found else inspection_screen(found, model), fixed_text(found))
            of = "" if len(logs) == 1 and "logs" not in found else f" for {read.name}"
            say(f"The channel map in use{of}; edit it, and give it back with --map:")
            say_lines(f"\n{map_text(read.entries)}")
        if not found.get("fixed", found)["usable"]:
            raise typer.Exit(1)


@app.command()
def compare(
    logs: Logs,
    vehicle: VehicleOption,
    model: Annotated[
        list[Path] | None,
        typer.Option(
            "--model", help="Vehicle file, run folder, network, ONNX file, or package.module:function (imported)."
        ),
    ] = None,
    judge: Annotated[str, typer.Option("--split", help="Rows to judge on: test, validation, train or all.")] = "test",
    out: Annotated[Path | None, typer.Option("--out", "-o", help="comparison.json to write.")] = None,
    series: Annotated[
        Path | None, typer.Option("--series", help="MCAP file to write, for Foxglove or PlotJuggler.")
    ] = None,
    force: ForceOption = False,
    frame: FrameOption = None,
    channels: MapOption = None,
    namespace: NamespaceOption = None,
    as_is: AsIsOption = False,
    as_json: JsonOption = False,
) -> None:
    """Compare models with measurements on the same rows: which to trust, by how much, and where they fail."""
    with failing_clearly():
        from .physics.files import write_json
        from .workflows.compare import compare as compare_models

        targets = (("--out", "compare", out), ("--series", "compare --series", series))
        earlier = _earlier(targets, (logs, vehicle, channels, model), force=force)
        inputs = _read(logs, vehicle, frame, channels, judge, namespace=namespace, as_is=as_is)
        found = compare_models(inputs, model or [], series)
        if out is not None:
            write_json(out, found.to_dict())
        tell_replaced(earlier)
        if as_json:
            print_json(found.to_dict())
        else:
            from .reports.terminal.comparison_screen import best_text, comparison_table, notes_list
            from .reports.terminal.failures_screen import failures_table, structure_list
            from .reports.wording import told_of

            _warn(found.warnings)
            table = comparison_table(found.models, found.split, found.differences)
            show(best_text(found.best), table, failures_table(found.failures, told_of(found.models, found.structure)))
            show(structure_list(found.structure), notes_list(found))
            if out is not None:
                say(f"Comparison: {out}")
            if series is not None:
                say(f"Series for Foxglove and PlotJuggler: {series}")


@app.command()
def check(
    model: Annotated[
        str,
        typer.Argument(
            metavar="MODEL",
            help="Vehicle file, run folder, network, ONNX file, or package.module:function (imported): "
            "f(velocity (n, 3), heading (n,), commands (n, thrusters)) -> accelerations (n, 3).",
        ),
    ],
    logs: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[LOG]...", help="Logs whose speeds are the envelope; a run folder has its own."),
    ] = None,
    vehicle: Annotated[
        str | None, typer.Option("--vehicle", "-v", help="Vehicle of a model that carries none (ONNX, function).")
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="audit.json to write.")] = None,
    force: ForceOption = False,
    seed: SeedOption = 0,
    frame: FrameOption = None,
    channels: MapOption = None,
    namespace: NamespaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Judge any model by the laws of a hull in water; exit code 1 when it breaks one."""
    with failing_clearly():
        from .physics.files import write_json
        from .reports.terminal.reading_progress import reading_progress
        from .workflows.check import check as judge

        earlier = _earlier((("--out", "check", out),), (model, logs, vehicle, channels), force=force)
        with reading_progress(progress) as reading:
            found = judge(
                model,
                logs or [],
                vehicle,
                frame=frame,
                channel_map=channels,
                namespace=namespace,
                seed=seed,
                reading=reading,
            )
        if out is not None:
            write_json(out, found.to_dict())
        tell_replaced(earlier)
        if as_json:
            print_json(found.to_dict())
        else:
            from .reports.terminal.audit_screen import audit_screen, headline

            prose(headline(found))
            show(*audit_screen(found))
            if out is not None:
                say(f"Audit: {out}")
    if found.verdict == "fail":
        raise typer.Exit(1)


@app.command()
def discover(
    logs: Logs,
    vehicle: VehicleOption,
    out: Annotated[Path, typer.Option("--out", "-o", help="Run folder to write.")],
    no_report: Annotated[bool, typer.Option("--no-report", help="Leave the HTML page out.")] = False,
    force: ForceOption = False,
    refit: Annotated[
        bool, typer.Option("--refit", help="Calibrate the model's own parameters while effects are judged.")
    ] = False,
    seed: SeedOption = 0,
    frame: FrameOption = None,
    channels: MapOption = None,
    namespace: NamespaceOption = None,
    as_is: AsIsOption = False,
    as_json: JsonOption = False,
) -> None:
    """Rank, test and select the physical effects that the vehicle model misses."""
    with failing_clearly():
        _check_folder(out, (logs, vehicle, channels), report=not no_report, force=force)
        read = partial(_read, logs, vehicle, frame, channels, namespace=namespace, as_is=as_is)
        _discover(out, read, report=not no_report, seed=seed, refit=refit, force=force, as_json=as_json)


@app.command()
def fit(
    logs: Logs,
    vehicle: VehicleOption,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Vehicle file to write.")] = None,
    free: Annotated[
        list[str] | None, typer.Option("--free", metavar="SYMBOL", help="Calibrate this too, though it has no value.")
    ] = None,
    hold: Annotated[list[str] | None, typer.Option("--hold", metavar="SYMBOL", help="Leave this as it is.")] = None,
    force: ForceOption = False,
    seed: SeedOption = 0,
    frame: FrameOption = None,
    channels: MapOption = None,
    namespace: NamespaceOption = None,
    as_is: AsIsOption = False,
    as_json: JsonOption = False,
) -> None:
    """Calibrate the parameters that the vehicle model has, under the laws of energy."""
    with failing_clearly():
        from .discovery.settings import DiscoverySettings
        from .reports.terminal import findings_screen as terminal
        from .workflows.fit import fit as calibrate

        earlier = _earlier((("--out", "fit", out),), (logs, vehicle, channels), force=force)
        inputs = _read(logs, vehicle, frame, channels, namespace=namespace, as_is=as_is)
        done = calibrate(inputs, _symbols(free), _symbols(hold), DiscoverySettings(seed=seed), progress=progress)
        if out is not None:
            done.vehicle.save(out, by="fit")
        tell_replaced(earlier)
        if as_json:
            print_json(done.to_dict())
            return
        say("")
        _warn(done.inputs.warnings)
        prose(" ".join(done.sentences))
        show(terminal.calibrated_table(done.calibration.parameters), terminal.left_list(done.left))
        _show_steps(done.steps)
        show(terminal.energy_text(done.calibration.lawful.passivity))
        say("Nothing is written without --out." if out is None else f"Calibrated vehicle: {out}")


@app.command(epilog=_catalogue())
def add(
    effects: Annotated[
        list[str], typer.Argument(metavar="EFFECT...", help="Effects to add; with --vehicle, a LOG last.")
    ],
    run: Annotated[
        Path | None, typer.Option("--run", help="Run folder whose logs and nominal vehicle are used.")
    ] = None,
    vehicle: Annotated[str | None, typer.Option("--vehicle", "-v", help="Nominal vehicle, with a log.")] = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Vehicle file to write.")] = None,
    force: ForceOption = False,
    frame: FrameOption = None,
    channels: MapOption = None,
    namespace: NamespaceOption = None,
    as_is: AsIsOption = False,
    as_json: JsonOption = False,
) -> None:
    """Add effects by name, refit, and print the error before and after."""
    with failing_clearly():
        from .physics.errors import RequestError
        from .workflows.discover_and_add import add as add_named
        from .workflows.run_folder.read import read_run_inputs

        if (run is None) == (vehicle is None):
            raise RequestError("add: expected either --run RUN, or --vehicle V and a LOG after the effects")
        read = (run, effects if run is None else (), vehicle, channels)
        earlier = _earlier((("--out", "add", out),), read, force=force)
        names, paths, nominal = effects, [], vehicle
        if run is not None:
            given = [word for word in effects if _is_log(word)]
            options = (("--frame", frame), ("--map", channels), ("--namespace", namespace))
            given += [name for name, value in options if value is not None]
            if given:
                raise RequestError(
                    f"add: --run takes the logs, and how they are read, from the run; leave out {' '.join(given)}, "
                    "or give --vehicle V in place of --run"
                )
            record = read_run_inputs(run)
            paths, nominal, frame, channels = record.logs, record.vehicle, record.frame, record.channel_map
            namespace, as_is = record.namespace, as_is or record.as_is
        else:
            names, paths = _effects_then_logs(effects)
        if not names:
            raise RequestError("add: expected at least one effect by name, for example surge_quadratic_damping")
        inputs = _read(paths, nominal, frame, channels, namespace=namespace, as_is=as_is)
        found = add_named(names, inputs, progress=progress)
        if out is not None:
            found.discovery.corrected.save(out, by="add")
        tell_replaced(earlier)
        findings = found.findings
        if as_json:
            content = findings.to_dict()
            wanted = {key: content[key] for key in ("warnings", "steps", "candidates", "unnamed")}
            print_json({"schema": "undertow.added/1", **wanted})
            return
        from .reports.terminal.findings_screen import added_table, energy_text, unnamed_table

        say("")
        _warn(findings.warnings)
        prose(findings.headline)
        tables = [added_table(findings.candidates)] if findings.candidates else []
        show(*tables, *[unnamed_table(findings.unnamed)] * bool(findings.unnamed))
        _show_steps(findings.steps, findings.candidates)
        show(energy_text(findings.passivity))
        say("Nothing is written without --out." if out is None else f"Corrected vehicle: {out}")


@app.command()
def train(
    logs: Logs,
    vehicle: VehicleOption,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder of the network to write.")],
    residual: Annotated[
        str, typer.Option("--residual", help="Network: mlp, lstm, tcn, transformer or dissipative.")
    ] = "lstm",
    pure: Annotated[
        bool, typer.Option("--pure", help="Learn all of the motion, without the vehicle's physics.")
    ] = False,
    heading: Annotated[bool, typer.Option("--heading", help="Let the network see the heading.")] = False,
    option: Annotated[
        list[str] | None, typer.Option("--option", metavar="NAME=VALUE", help="Of the network, such as units=64.")
    ] = None,
    epochs: Annotated[int | None, typer.Option("--epochs", help="Most epochs to train (300 when not given).")] = None,
    seed: SeedOption = 0,
    device: Annotated[str, typer.Option("--device", help="auto, cpu or cuda.")] = "auto",
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
    as_json: JsonOption = False,
) -> None:
    """Train a network that corrects the vehicle model, or stands in its place."""
    with failing_clearly():
        from .reports.terminal.training_progress import training_progress
        from .workflows import train as trained

        trained.check_folder(out, resume, (logs, vehicle, channels), force=force)
        given = {"epochs": epochs, "lambda_phys": lambda_phys, "rollout_rows": rollout_rows}
        settings = trained.settings_with(set_ or [], seed=seed, device=device, **given)
        chosen = trained.parsed_options(option or [])
        inputs = _read(logs, vehicle, frame, channels, namespace=namespace, as_is=as_is)
        try:
            with training_progress(settings.epochs, progress) as told:
                done = trained.train(
                    inputs,
                    residual,
                    chosen,
                    pure=pure,
                    heading=heading,
                    settings=settings,
                    out=out,
                    resume=resume,
                    force=force,
                    progress=told,
                )
        except KeyboardInterrupt as error:
            kept = (out / trained.CHECKPOINT).exists()
            how = f"the same command with --resume goes on from {out}" if kept else "no epoch was done, nothing is kept"
            interrupted(error, how)
        if explain:
            done = trained.explained(done, out, progress)
        if as_json:
            print_json(done.to_dict())
            return
        from .reports.terminal.comparison_screen import comparison_table

        say("")
        _warn(done.inputs.warnings)
        prose(" ".join(done.sentences))
        show(comparison_table(done.models, done.inputs.parts.judge))
        if done.distilled is not None:
            from .reports.terminal.distillation_screen import distilled_table

            show(distilled_table(done.distilled))
        say(f"Network: {out} (model.yaml, weights.safetensors{', distillation.json' * explain})")


@app.command()
def explain(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="Folder of a network, run folder or vehicle file.")],
    logs: Logs,
    vehicle: VehicleOption,
    seed: SeedOption = 0,
    frame: FrameOption = None,
    channels: MapOption = None,
    namespace: NamespaceOption = None,
    as_is: AsIsOption = False,
    as_json: JsonOption = False,
) -> None:
    """Say what of a model's correction is a named effect, what has no name, and what is memory."""
    with failing_clearly():
        from .discovery.settings import DiscoverySettings
        from .reports.terminal.distillation_screen import distilled_table
        from .workflows.explain import distil

        inputs = _read(logs, vehicle, frame, channels, namespace=namespace, as_is=as_is)
        found = distil(model, inputs, DiscoverySettings(seed=seed), progress)
        if as_json:
            print_json({**found.to_dict(), "warnings": list(inputs.warnings)})
        else:
            _warn(inputs.warnings)
            show(distilled_table(found))


@app.command(epilog=_amounts())
def simulate(
    vehicle: VehicleOption,
    out: Annotated[Path, typer.Option("--out", "-o", help="Log to write: .csv, .csv.gz or .parquet.")],
    effect: Annotated[
        list[str] | None,
        typer.Option("--effect", help="Hidden effect as name=value[,value], or a symbol=value; see below."),
    ] = None,
    programme: Annotated[str, typer.Option("--programme", help="Manoeuvres: rich, zigzag or gentle.")] = "rich",
    duration: Annotated[
        float, typer.Option("--duration", min=1.0, max=86400.0, help="Length of the log in seconds.")
    ] = 300.0,
    noise: Annotated[str, typer.Option("--noise", help="Sensors: clean, field or rough.")] = "field",
    force: ForceOption = False,
    seed: SeedOption = 0,
) -> None:
    """Write the log of a world with hidden effects."""
    with failing_clearly():
        from .physics.errors import RequestError
        from .physics.vehicle import load_vehicle
        from .physics.worlds.world import parse_effect, simulate_world

        earlier = _earlier((("--out", "simulate", out),), (vehicle,), force=force)
        hidden: dict[str, tuple[float, ...]] = {}
        for text in effect or []:
            name, values = parse_effect(text)
            if name in hidden:
                raise RequestError(
                    f"--effect {text}: {name} is given twice; give each effect once, with all its values"
                )
            hidden[name] = values
        nominal = load_vehicle(vehicle)
        world = simulate_world(nominal, hidden, programme=programme, duration=duration, noise=noise, seed=seed)
        world.write(out)
        tell_replaced(earlier)
        before = {symbol: nominal.value(symbol) for symbol in world.vehicle.values}
        changed = [f"{s} {before[s]:g} -> {v:g}" for s, v in world.vehicle.values.items() if v != before[s]]
        listed = ", ".join(changed) or "nothing"
        say(f"{out}: {duration:g} s, {programme} manoeuvres, {noise} sensors, seed {seed}; hidden: {listed}")


@app.command()
def report(
    runs: Annotated[
        list[Path], typer.Argument(metavar="RUN...", help="Run folders; several give a page for all, too.")
    ],
    model: Annotated[
        list[str] | None, typer.Option("--model", help="Model to compare with the run's own; as in compare.")
    ] = None,
    pdf: Annotated[
        bool, typer.Option("--pdf", help="Print every page to a PDF, through a browser that is there.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Page of several runs (./report.html), or a copy of the one.")
    ] = None,
    force: ForceOption = False,
) -> None:
    """Write the HTML page of run folders, one page of several, and PDF."""
    with failing_clearly():
        from .workflows.report import report as report_runs

        for path in report_runs(runs, models=model or [], pdf=pdf, out=out, force=force, progress=progress):
            say(f"{path}")


def main() -> None:
    """Run the command line; exit code 0 done, 1 a check found violations, 2 wrong usage or unreadable input.

    130 when interrupted (Ctrl-C), 143 when terminated.
    """
    from .cli.interruption import finish

    open_streams()
    check_here()
    try:
        with sending():
            app()
    finally:
        finish()


def _discover(
    out: Path,
    read: Callable[[], "Inputs"],
    *,
    report: bool,
    seed: int,
    refit: bool = False,
    force: bool = False,
    as_json: bool = False,
) -> None:
    """Read, search, write the run folder, and tell the story; the time told is that of all four."""
    import time

    begun = time.perf_counter()
    from .discovery.settings import DiscoverySettings
    from .reports.page.outcome import opening
    from .reports.terminal import failures_screen as screen
    from .reports.terminal import findings_screen as terminal
    from .workflows.discover_and_add import discover as find
    from .workflows.run_folder.write import write_run

    run = find(read(), DiscoverySettings(seed=seed, refit=refit), progress=progress)
    write_run(run, out, report=report, force=force, progress=progress)
    findings = run.findings
    if as_json:
        print_json(findings.to_dict())
        return
    say("")
    _warn(findings.warnings)
    for text in opening(findings, run.comparison):
        prose(text)
    show(screen.failures_table(findings.failures), terminal.candidates_table(findings.candidates))
    show(terminal.missing_in_words(findings.candidates))
    if findings.unnamed:
        show(terminal.unnamed_table(findings.unnamed))
    if findings.calibrated:
        show(terminal.calibrated_table(findings.calibrated), terminal.left_list(findings.left, findings.absorbed))
    _show_steps(findings.steps, findings.candidates)
    show(terminal.energy_text(findings.passivity))
    prose(terminal.not_judged(findings.candidates))
    show(terminal.advice_list(findings.advice))
    say(f"Done in {time.perf_counter() - begun:.1f} s. Findings: {out / 'findings.json'}")
    if len(run.findings.steps) > 1:
        say(f"Corrected vehicle: {out / 'model.yaml'}")
    if report:
        say(f"Report: {out / 'report.html'}")
    if (out / "series.mcap").is_file():
        say(f"Series for Foxglove and PlotJuggler: {out / 'series.mcap'}")


def _show_steps(steps: "Sequence[Step]", candidates: "Sequence[FoundEffect]" = ()) -> None:
    from .reports.terminal.findings_screen import error_left, steps_table

    show(steps_table(steps, candidates))
    prose(error_left(steps))


def _read(
    logs: list[Path] | list[str],
    vehicle: Any,
    frame: str | None,
    channels: Path | None,
    judge: str = "test",
    namespace: str | None = None,
    as_is: bool = False,
) -> "Inputs":
    from .reports.terminal.reading_progress import reading_progress
    from .workflows.inputs import read_inputs

    with reading_progress(progress) as reading:
        return read_inputs(
            logs,
            vehicle,
            frame=frame,
            channel_map=channels,
            namespace=namespace,
            judge=judge,
            as_is=as_is,
            reading=reading,
        )


def _warn(warnings: Iterable[str]) -> None:
    """What is wrong with the logs, above everything else."""
    for text in warnings:
        prose(f"Warning: {text}")


def _symbols(given: list[str] | None) -> list[str]:
    """Symbols given one by one or with commas."""
    return [symbol.strip() for text in given or [] for symbol in text.split(",")]


def _effects_then_logs(words: list[str]) -> tuple[list[str], list[str]]:
    """Effects come first, then the logs."""
    for k, word in enumerate(words):
        if _is_log(word):
            return words[:k], words[k:]
    from .physics.errors import RequestError

    raise RequestError(f"add: expected a LOG after the effects {' '.join(words)}, got none")


def _is_log(word: str) -> bool:
    """Whether a word names an existing file or folder, or looks like a log or a pattern."""
    from .measurements.collection import is_pattern
    from .measurements.formats.registry import SUFFIXES

    return Path(word).exists() or Path(word).suffix.lower() in SUFFIXES or is_pattern(word)


def _check_folder(out: Path, reads: Iterable[Any] = (), *, report: bool = True, force: bool = False) -> None:
    from .workflows.run_folder.write import check_target

    check_target(out, reads, report=report, force=force)


def _earlier(
    targets: Iterable[tuple[str, str, Path | None]], reads: Iterable[Any], *, force: bool = False
) -> list[Path]:
    """Check the files to be written, each with its option and what writes it; give those that are there already."""
    from .workflows.run_folder.targets import Kind, check_targets

    return check_targets([(option, Kind(by), path) for option, by, path in targets], reads, force=force)


if __name__ == "__main__":
    main()
