"""The verb `train`: train a network that corrects the vehicle model, or stands in its place."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from ..measurements.log_options import Reading
from ..physics.errors import RequestError
from ..residuals.training.training_settings import TrainingSettings
from .console import interrupted, print_json, progress, prose, say, show, warn
from .options import FORCE, JSON, LOGS, MINUTES, READING, REQUIRED, SEED, VEHICLE, option, read_logs


def train(
    logs: list[Path] = LOGS,
    vehicle: str = VEHICLE,
    out: Path = option("--out -o", "Folder of the network to write.", REQUIRED),
    residual: str | None = option(
        "--residual",
        "Network: mlp, symmetric, lstm (when not given), tcn, transformer, dissipative, port_hamiltonian, trees, gp, "
        "symmetric_gp, ridge, or best: the one that predicts best over parts of the log that it does not know.",
    ),
    start: Path | None = option("--start", "Go on from this network, of another boat or log.", metavar="MODEL"),
    pure: bool = option("--pure", "Learn all of the motion, without the vehicle's physics.", False),
    heading: bool = option("--heading", "Let the network see the heading.", False),
    option: list[str] | None = option("--option", "Of the network, such as units=64.", metavar="NAME=VALUE"),
    epochs: int | None = option("--epochs", "Most epochs to train (150 when not given)."),
    minutes: float | None = MINUTES,
    seed: int = SEED,
    device: str = option("--device", "cpu (auto is the same) or cuda.", "auto"),
    resume: bool = option("--resume", "Go on with an interrupted training in the folder.", False),
    lambda_phys: float | None = option("--lambda-phys", "Weight of the laws of energy (100)."),
    rollout_rows: int | None = option("--rollout-rows", "Train through rollouts of so many rows, too (0)."),
    set_: list[str] | None = option(
        "--set", "Of the recipe, such as learning_rate=0.001, patience=50.", metavar="NAME=VALUE"
    ),
    force: bool = FORCE,
    explain: bool = option("--explain", "Say what of the correction is a named effect, and what is memory.", False),
    reading: Reading = READING,
    as_json: bool = JSON,
) -> None:
    """Train a network that corrects the vehicle model, or stands in its place."""
    from ..workflows import train as trained

    trained.check_folder(out, resume, (logs, vehicle, reading.channel_map), force=force)
    given = {"epochs": epochs, "lambda_phys": lambda_phys, "rollout_rows": rollout_rows, "minutes": minutes}
    settings = settings_with(set_ or [], seed=seed, device=device, **given)
    choice = trained.choice_of(start, residual, parsed_options(option or []), pure=pure, heading=heading)
    inputs = read_logs(logs, vehicle, reading)
    try:
        done = trained.train(inputs, choice, settings=settings, out=out, resume=resume, force=force, progress=progress)
    except trained.NothingToLearnError as end:
        print_json({"schema": trained.TRAIN_SCHEMA, "network": None, "why": str(end)}) if as_json else prose(str(end))
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
    warn(done.inputs.warnings, done.inputs.repairs)
    prose(" ".join(done.sentences))
    show(comparison_table(done.models, done.inputs.parts.judge))
    if done.distilled is not None:
        from ..reports.terminal.laws_and_effects_screen import distilled_table

        show(distilled_table(done.distilled))
    say(f"Network: {out} (model.yaml, weights.safetensors{', distillation.json' * explain})")


_FOR_EXAMPLE = {"--option": "units=64", "--set": "learning_rate=0.001"}


def settings_with(texts: Sequence[str] = (), **given: Any) -> TrainingSettings:
    """The recipe with what was given in place of its defaults; None stands for not given.

    Parameters
    ----------
    texts : settings such as `learning_rate=0.001`, those of `Augmentation` among them

    Raises
    ------
    RequestError
        for an unknown setting, naming the nearest, or a value that cannot be used.
    """
    recipe = TrainingSettings()
    plain = asdict(recipe)
    variants = plain.pop("augmentation")
    known = plain | variants
    chosen = {name: value for name, value in given.items() if value is not None}
    for name, value in _pairs("--set", texts).items():
        if name not in known:
            near = get_close_matches(name, known, n=1, cutoff=0.0)[0]
            raise RequestError(f"--set {name}: did you mean {near!r}? There are: {', '.join(known)}")
        if name in chosen:
            raise RequestError(f"--set {name}: it is given twice; give it once")
        chosen[name] = value if isinstance(known[name], str) else _number(f"--set {name}={value}", value)
    augmentation = replace(recipe.augmentation, **{name: chosen.pop(name) for name in variants if name in chosen})
    return replace(recipe, augmentation=augmentation, **chosen)


def parsed_options(texts: Sequence[str]) -> dict[str, int | float]:
    """Options of a network from texts such as `units=64`.

    Raises
    ------
    RequestError
        for a text of another form, or an option that is given twice.
    """
    return {name: _number(f"--option {name}={value}", value) for name, value in _pairs("--option", texts).items()}


def _pairs(what: str, texts: Sequence[str]) -> dict[str, str]:
    result: dict[str, str] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or not name or not value:
            raise RequestError(f"{what} {text}: expected NAME=VALUE, for example {_FOR_EXAMPLE[what]}")
        if name in result:
            raise RequestError(f"{what} {text}: {name} is given twice; give it once")
        result[name] = value
    return result


def _number(text: str, value: str) -> int | float:
    try:
        number = float(value)
    except ValueError:
        raise RequestError(f"{text}: expected NAME=NUMBER") from None
    return int(number) if number.is_integer() and "." not in value else number
