"""The three ways in which undertow refuses: a log, a vehicle, or a request that cannot be used."""


class LogError(ValueError):
    """A log that cannot be read or used; the text says what was expected, what came, and what to try."""


class VehicleError(ValueError):
    """A vehicle file or parameter that cannot be used; the text says what was expected, what came, and what to try."""


class RequestError(ValueError):
    """A request that cannot be met (unknown effect, unusable option, failed solve); the text says what to try."""
