"""The verb `discover`: rank, test and select the physical effects that the vehicle model misses."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ..measurements.log_options import Reading
from ..physics.errors import RequestError
from ..physics.stage import freeze_loaded_objects
from .console import print_json, progress, prose, say, show, show_calibrated, show_steps, warn
from .init_verb import offered
from .options import FORCE, JSON, LOGS, MINUTES, READING, REQUIRED, SEED, check_folder, logs_in_steps, option

if TYPE_CHECKING:
    from ..residuals.training.training_settings import TrainingSettings
    from ..workflows.run_folder.write import Run

_FORKED = ("numpy.fft", "numpy.ma", "scipy.special", "mcap.writer")
"""Modules that more than one process of a discovery asks for."""


def discover(
    logs: list[Path] = LOGS,
    out: Path = option("--out -o", "Run folder to write.", REQUIRED),
    vehicle: str | None = option("--vehicle -v", "Vehicle file, or the name of a shipped one; see init."),
    no_report: bool = option("--no-report", "Leave the HTML page out.", False),
    force: bool = FORCE,
    refit: bool | None = option(
        "--refit/--no-refit",
        "Calibrate the model's own parameters while effects are judged; else where the file holds guesses.",
    ),
    residual: str | None = option(
        "--residual", "Network for what has no name: a kind of 'train', or best; in RUN/network."
    ),
    minutes: float | None = MINUTES,
    seed: int = SEED,
    judge: str = option("--split", "Rows to judge on: folds (all, by models that never saw them) or test.", "folds"),
    reading: Reading = READING,
    as_json: bool = JSON,
) -> None:
    """Rank, test and select the physical effects that the vehicle model misses."""
    if judge not in ("folds", "test"):
        raise RequestError(f"--split {judge}: expected folds, or test to keep the last part of each log aside")
    if vehicle is None:
        vehicle, channels = offered(logs, replace(reading, as_is=False, fix=False), out)
        reading = replace(reading, channel_map=channels)
    check = partial(check_folder, out, (logs, vehicle, reading.channel_map), report=not no_report, force=force)
    read = partial(logs_in_steps, logs, vehicle, reading, judge)
    recipe = None
    if residual is not None:
        from ..residuals.training.training_settings import TrainingSettings
        from ..workflows.whole_answer import check_kind

        recipe = TrainingSettings(seed=seed, minutes=minutes or 0.0)
        check_kind(residual)
    elif minutes is not None:
        raise RequestError("--minutes is the time for a network: give --residual best, or a kind, too")
    how = Telling(not no_report, force, "json" if as_json else "whole")
    tell_discovery(out, check, read, how, seed=seed, refit=refit, network=(residual, recipe))


class Telling(NamedTuple):
    """How a discovery is written and told.

    Attributes
    ----------
    report : whether the page is written
    force : replace also files that undertow did not write, or that were changed since
    told : whole; short for what is missing and how the error falls, with the rest left to the files; json for machines
    """

    report: bool = True
    force: bool = False
    told: str = "whole"


def tell_discovery(
    out: Path,
    check: Callable[[], None],
    read: Callable[[], Iterator[Any]],
    how: Telling,
    *,
    seed: int,
    refit: bool | None = None,
    network: "tuple[str | None, TrainingSettings | None]" = (None, None),
) -> None:
    """Read, search, write the run folder, and tell the story; the time told is that of all four.

    Parameters
    ----------
    check : refuses a run folder that cannot be written
    read : gives what is searched, and then what is wrong with it
    how : it is written and told
    network : kind of one for what has no name, or best, None for none; and its recipe
    """
    import time

    report, force, told = how
    residual, recipe = network
    begun = time.perf_counter()
    from ..measurements.statistics.processors import preload_modules, run_steps_in_fork

    with run_steps_in_fork(read) as steps:  # what checks, searches and tells is loaded while the logs are read
        check()
        from ..discovery.basis import DiscoverySettings
        from ..reports.terminal import comparison_screen as screen
        from ..reports.terminal import findings_screen as terminal
        from ..workflows.discover_and_add import chosen_ahead
        from ..workflows.discover_and_add import discover as find
        from ..workflows.run_folder.write import write_run

        preload_modules(_FORKED)
        freeze_loaded_objects()
        settings = DiscoverySettings(seed=seed, refit=refit)
        inputs = next(steps)
        basis = chosen_ahead(inputs, settings)  # while the logs are checked
        inputs = inputs.with_checks(next(steps))
    run = find(inputs, settings, progress=progress, basis=basis)
    trained = None
    if residual is not None:
        from ..workflows.whole_answer import with_network

        run, trained = with_network(run, residual, settings=recipe, progress=progress)
    write_run(run, out, report=report, force=force, progress=progress)
    if trained is not None:
        from ..workflows.train import write_network

        write_network(trained, out / "network", force=force)
    elif residual is not None:
        from ..workflows.whole_answer import remove_network

        remove_network(out)
    findings = run.findings
    if told == "json":
        print_json(findings.to_dict())
        return
    say("")
    warn(findings.warnings, run.inputs.repairs)
    nominal = run.discovery.nominal
    show(*terminal.opening_lines(findings, run.comparison, nominal))
    if told == "short":
        show(terminal.candidates_table(findings.added, nominal, short=True) if findings.added else None)
        show_steps(findings.steps, findings.candidates, run.comparison)
        _tell_files(out, time.perf_counter() - begun, run, report)
        return
    show(screen.failures_table(findings.failures), terminal.candidates_table(findings.candidates, nominal))
    show(terminal.missing_in_words(findings, nominal), terminal.unnamed_table(findings.unnamed))
    show(terminal.sensors_list(findings.sensors))
    show_calibrated(findings)
    show_steps(findings.steps, findings.candidates, run.comparison)
    show(terminal.energy_text(findings.passivity))
    prose(terminal.not_judged(findings.candidates))
    show(terminal.advice_list(findings.advice))
    if residual is not None:
        prose(run.comparison.notes[-1])
    if trained is not None:
        prose(" ".join(trained.sentences))
    _tell_files(out, time.perf_counter() - begun, run, report)
    if trained is not None:
        place = out / "network"
        say(f"Network beside it: {place} ('undertow compare' with --model {out} --model {place} puts both on a log)")
    if (out / "series.mcap").is_file():
        say(f"Series for Foxglove and PlotJuggler: {out / 'series.mcap'}")


def _tell_files(out: Path, seconds: float, run: "Run", report: bool) -> None:
    """Say how long it took, and what lies where; the corrected model is there though another one is to be trusted."""
    from ..comparison.facts import CALIBRATED
    from ..reports.page.outcome import gets_worse
    from ..reports.sureness import in_order, marked
    from ..reports.wording import effect_words

    say(f"Done in {seconds:.1f} s. Findings: {out / 'findings.json'}")
    if len(run.findings.steps) > 1:
        unsure = [item for item in in_order(run.findings.added) if item.verdict != "missing"]
        doubted = [f"{effect_words(item)}: {marked(item)}" for item in unsure]
        beside = f" (not sure of {'; '.join(doubted)})" if doubted else ""
        what = "Corrected vehicle" if run.findings.added else "Vehicle with its own numbers fitted, and nothing added"
        worse = gets_worse(run.findings.steps, run.comparison.best.horizon)
        say(f"{what}: {out / 'model.yaml'}{beside}{', which errs more on unseen rows than the file' * worse}")
    calibrated, written = run.calibrated, run.discovery.corrected
    if run.comparison.best.model == CALIBRATED and calibrated is not None and calibrated.values != written.values:
        say("The calibrated model, which is to be trusted, is what 'undertow fit' writes with the same logs and --out.")
    if report:
        say(f"Report: {out / 'report.html'}")
