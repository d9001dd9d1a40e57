"""What logs say of the parameters of a hull: estimates with their covariance, a log each."""

from dataclasses import dataclass

from ..physics.frames import Array


@dataclass(frozen=True, slots=True, eq=False)
class HullEstimate:
    """What one log (or one day of logs) of one boat says.

    Attributes
    ----------
    boat : its name
    time : middle of the log [s since 1970, UTC]
    hours : length of what was read, idle time left out [h]
    values : of the parameters followed (p,), in units of the vehicle file; NaN where the log says nothing
    covariance : of values (p, p)
    source : file, or files
    """

    boat: str
    time: float
    hours: float
    values: Array
    covariance: Array
    source: str


@dataclass(frozen=True, slots=True, eq=False)
class Fleet:
    """Estimates of several boats, in order of time.

    Attributes
    ----------
    parameters : names of the parameters ("X_uu", "thrusters.port.scale"...)
    nominal : their nominal values (p,)
    estimates : in order of time
    missing : logs that were given and are not among them
    """

    parameters: tuple[str, ...]
    nominal: Array
    estimates: tuple[HullEstimate, ...]
    missing: tuple[str, ...] = ()
