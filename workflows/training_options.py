"""The recipe of a training and the options of a network, from texts such as `learning_rate=0.001`."""

from collections.abc import Sequence
from dataclasses import fields, replace
from difflib import get_close_matches
from typing import Any

from ..physics.errors import RequestError
from ..residuals.training.training_settings import Augmentation, TrainingSettings

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
    recipe, varied = TrainingSettings(), Augmentation()
    plain = {f.name: getattr(recipe, f.name) for f in fields(recipe) if f.name != "augmentation"}
    variants = {f.name: getattr(varied, f.name) for f in fields(varied)}
    chosen = {name: value for name, value in given.items() if value is not None}
    for name, value in _pairs("--set", texts).items():
        known = plain | variants
        if name not in known:
            near = get_close_matches(name, known, n=1, cutoff=0.0)[0]
            raise RequestError(f"--set {name}: did you mean {near!r}? There are: {', '.join(known)}")
        if name in chosen:
            raise RequestError(f"--set {name}: it is given twice; give it once")
        chosen[name] = value if isinstance(known[name], str) else _number(f"--set {name}={value}", value)
    augmentation = replace(varied, **{name: chosen.pop(name) for name in variants if name in chosen})
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
