"""The three ways in which undertow refuses: a log, a vehicle, or a request that cannot be used."""

from .printable import MOST_SHOWN, shortened, shown
from .spoken import in_python

MOST_TOLD = MOST_SHOWN - 100
"""Characters of a text, so that "undertow: " and a path can be put before it within what any message may have."""


class _BoundedError(ValueError):
    """A text that fits on a screen, whatever of a broken file it quotes: of a longer one, head and tail are kept.

    It is written with the options of the command line. Python shows it with arguments in their place.
    """

    def __init__(self, text: str = "") -> None:
        super().__init__(shortened(str(text), MOST_TOLD))

    def __str__(self) -> str:
        return in_python(self.typed)

    @property
    def typed(self) -> str:
        """The text for who types commands."""
        return str(self.args[0])


class LogError(_BoundedError):
    """A log that cannot be read or used; the text says what was expected, what came, and what to try.

    Attributes
    ----------
    mends : lines of a channel map with which it can be read, where there are such; `inspect --map-out` writes them
    """

    def __init__(self, text: str = "", mends: str = "") -> None:
        super().__init__(text)
        self.mends = mends


class VehicleError(_BoundedError):
    """A vehicle file or parameter that cannot be used; the text says what was expected, what came, and what to try."""


class RequestError(_BoundedError):
    """A request that cannot be met (unknown effect, unusable option, failed solve); the text says what to try."""


def expect(what: str, given: object, kind: type | tuple[type, ...], cure: str) -> None:
    """Check the type of an argument of a function that users call.

    Parameters
    ----------
    what : the function and the argument, such as "adapt: vehicle"
    cure : how one comes by such an argument

    Raises
    ------
    RequestError
        when it is of another type.
    """
    kinds = kind if isinstance(kind, tuple) else (kind,)
    if not isinstance(given, kinds):
        wanted = " or ".join(k.__name__ for k in kinds)
        came = (
            f"{type(given).__name__} {shown(given)}" if isinstance(given, str | int | float) else type(given).__name__
        )
        raise RequestError(f"{what}: expected {_article(wanted)}, got {_article(came)}; {cure}")


def _article(name: str) -> str:
    return f"{'an' if name[0] in 'AEIOaeio' else 'a'} {name}"
