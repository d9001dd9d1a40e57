"""Online adaptation of a whole log: named parameters followed as it is replayed, without looking ahead."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ...measurements.statistics.single_threaded import single_threaded
from ...physics.errors import expect
from ...physics.frames import Array
from ...physics.motion import Motion
from ...physics.vehicle import Vehicle
from .followed_effects import followed
from .following import Follower, known_beforehand
from .forgetting_fit import AdaptSettings

_MOTIONS = "undertow.prepare(undertow.read_log(LOG), vehicle, undertow.WEAK).motions are some"


@dataclass(frozen=True, slots=True, eq=False)
class Adapted:
    """Parameters along a replayed log.

    Attributes
    ----------
    symbols, units : of the parameters
    time : (n,) end of each test function, the instant at which its row was known [s]
    values : (n, p) total values of the parameters after each row, in their units
    deviation : (n, p) their standard deviations
    excited : (n,) True where the row counted
    delay : by which values lag behind `time`: a test function that ends now is centred so long ago [s]
    step : time between rows [s]
    error_before, error_after : (3,) root mean square force that the vehicle as it was, and as it was followed up to the
        row before, leaves unexplained [N, N, N m]
    """

    symbols: tuple[str, ...]
    units: tuple[str, ...]
    time: Array
    values: Array
    deviation: Array
    excited: np.ndarray
    delay: float
    step: float
    error_before: Array
    error_after: Array

    @property
    def excitation(self) -> Array:
        """Seconds of excitation up to and with each row, (n,) [s]."""
        return self.step * np.cumsum(self.excited)


@single_threaded
def adapt(
    motions: Sequence[Motion] | Motion, vehicle: Vehicle, effects: Sequence[str], settings: AdaptSettings | None = None
) -> Adapted:
    """Follow the parameters of effects along a log as it is replayed, without looking ahead.

    Noise and size of the forces are taken from the log as a whole; `undertow adapt` follows a log that grows, and takes
    them from its beginning.

    Parameters
    ----------
    motions : gap-free stretches in the order of time, unfiltered
    vehicle : the model at the start
    effects : names of the catalogue; `thruster_asymmetry[port]` chooses a thruster. The force must be linear in the
        parameters: damping, couplings, added mass, scales of thrust, wind and trim

    Raises
    ------
    RequestError
        for an unknown effect, one that is not linear in its parameters or needs channels that the log lacks, none or
        one twice, or a log that is too short.
    """
    settings = settings or AdaptSettings()
    expect("adapt: motions", motions, (Motion, Iterable), _MOTIONS)
    runs = [motions] if isinstance(motions, Motion | str) else list(motions)
    for motion in runs:
        expect("adapt: motions", motion, Motion, _MOTIONS)
    expect("adapt: vehicle", vehicle, Vehicle, "undertow.load_vehicle(PATH) reads one")
    expect("adapt: effects", effects, (list, tuple), 'give a list of names, such as ["surge_quadratic_damping"]')
    expect("adapt: settings", settings, AdaptSettings, "undertow.AdaptSettings(...) makes them")
    pool = followed(vehicle, effects, runs)
    follower = Follower(vehicle, pool, known_beforehand(runs, vehicle, pool, settings), settings)
    updates = [update for motion in runs for update in follower.take(motion)]
    return Adapted(
        follower.symbols,
        follower.units,
        np.array([update.time for update in updates]),
        np.array([update.values for update in updates]),
        np.array([update.deviation for update in updates]),
        np.array([update.excited for update in updates]),
        settings.weak.half_width,
        settings.weak.stride,
        np.sqrt(np.mean([update.before**2 for update in updates], axis=0)),
        np.sqrt(np.mean([update.error**2 for update in updates], axis=0)),
    )
