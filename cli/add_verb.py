"""The verb `add`: add effects by name, refit, and print the error before and after."""

from dataclasses import replace
from pathlib import Path

from ..measurements.log_options import Reading
from ..physics.effects import EFFECTS
from .console import print_json, progress, prose, say, show, show_calibrated, show_steps, tell_replaced, warn
from .options import FORCE, JSON, READING, RUN_LOGS, VEHICLE_OUT, argument, check_files, option, read_logs


def catalogue() -> str:
    """The names of all effects, a paragraph for each family."""
    names: dict[str, list[str]] = {}
    for effect in EFFECTS:
        names.setdefault(effect.family, []).append(effect.name)
    families = (f"{family}: {', '.join(members)}." for family, members in names.items())
    return "\n\n".join(("Effects:", *families, "A term without a name is an axis and a form, such as yaw:u|r|."))


def add(
    effects: list[str] = argument("EFFECT...", "Effects to add; with --vehicle, a LOG last."),
    run: Path | None = option("--run", "Run folder whose logs, nominal vehicle and thrusters are used."),
    vehicle: str | None = option("--vehicle -v", "Nominal vehicle, with a log."),
    log: list[Path] | None = RUN_LOGS,
    out: Path | None = VEHICLE_OUT,
    refit: bool | None = option(
        "--refit/--no-refit",
        "Calibrate the model's own parameters beside them; else as the run, or where the file holds guesses.",
    ),
    force: bool = FORCE,
    reading: Reading = READING,
    as_json: bool = JSON,
) -> None:
    """Add effects by name, refit, and print the error before and after."""
    from ..discovery.basis import DiscoverySettings
    from ..physics.errors import RequestError
    from ..workflows.discover_and_add import add as add_named
    from ..workflows.run_folder.moved_files import Moved
    from ..workflows.run_folder.read import read_run_inputs

    if (run is None) == (vehicle is None):
        raise RequestError("add: expected either --run RUN, or --vehicle V and a LOG after the effects")
    if run is None and log:
        raise RequestError("add: --log says where a log of --run is now; with --vehicle, logs follow the effects")
    read = (run, effects if run is None else (), vehicle, reading.channel_map, log)
    earlier = check_files((("--out", "add", out),), read, force=force)
    searched, judge = None, None
    if run is None:
        names, paths = _effects_then_logs(effects)
        nominal = vehicle
    else:
        given = [word for word in effects if _is_log(word)]
        options = (("--frame", reading.frame), ("--namespace", reading.namespace))
        given += [name for name, value in options if value is not None] + ["--fix"] * reading.fix
        if given:
            raise RequestError(
                f"add: --run takes the logs, and how they are read, from the run; leave out {' '.join(given)}, "
                "or give --vehicle V in place of --run. Where they were moved, --log LOG and --map MAP say where to"
            )
        record = read_run_inputs(run, Moved(tuple(log or ()), reading.channel_map))
        names, paths, nominal = effects, record.logs, record.vehicle
        reading = replace(record.reading, as_is=reading.as_is or record.reading.as_is)
        refit, searched = record.settings.refit if refit is None else refit, record.findings
        judge = record.judge
    if not names:
        raise RequestError("add: expected at least one effect by name, for example surge_quadratic_damping")
    inputs = read_logs(paths, nominal, reading, judge)
    found = add_named(names, inputs, DiscoverySettings(refit=refit), searched, progress=progress)
    if out is not None:
        found.discovery.corrected.save(out, by="add")
    tell_replaced(earlier)
    findings = found.findings
    if as_json:
        content = findings.to_dict()
        wanted = {key: content[key] for key in ("warnings", "steps", "candidates", "unnamed")}
        print_json({"schema": "undertow.added/1", **wanted})
        return
    from ..reports.page.outcome import also_worse
    from ..reports.terminal.findings_screen import added_table, energy_text, unnamed_table
    from ..reports.terminal.layout import UNSURE

    say("")
    warn(findings.warnings, found.inputs.repairs)
    prose(" ".join([findings.headline, *findings.reasons]))
    show_calibrated(findings)
    added = added_table(findings.candidates, found.discovery.nominal) if findings.candidates else None
    show(added, unnamed_table(findings.unnamed))
    show_steps(findings.steps, findings.candidates, found.comparison)
    prose(also_worse(findings, found.comparison), UNSURE)
    show(energy_text(findings.passivity))
    say("Nothing is written without --out." if out is None else f"Corrected vehicle: {out}")


def _effects_then_logs(words: list[str]) -> tuple[list[str], list[str]]:
    """Effects come first, then the logs."""
    for k, word in enumerate(words):
        if _is_log(word):
            return words[:k], words[k:]
    from ..physics.errors import RequestError

    raise RequestError(f"add: expected a LOG after the effects {' '.join(words)}, got none")


def _is_log(word: str) -> bool:
    """True when a word names an existing file or folder, or looks like a log or a pattern."""
    from ..measurements.formats.registry import SUFFIXES, is_pattern

    return Path(word).exists() or Path(word).suffix.lower() in SUFFIXES or is_pattern(word)
