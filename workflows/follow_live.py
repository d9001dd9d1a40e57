"""Follow parameters of a boat while its log grows: the verb `adapt` as a Python function, an event at a time."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from ..discovery.calibration import following
from ..discovery.calibration.change_watch import AlarmSettings
from ..discovery.calibration.following import Follower, Update
from ..discovery.calibration.forgetting_fit import AdaptSettings
from ..measurements.growing_log import STDIN, GrowingLog, growing_lines
from ..measurements.inspection import examine, inspect_log
from ..measurements.log_options import AS_GUESSED, Reading
from ..measurements.prepared_logs import PathLike
from ..measurements.statistics.processors import single_threaded
from ..physics.effects import COMMAND_OFFSET
from ..physics.errors import LogError, RequestError, listed
from ..physics.motion import Motion
from ..physics.thrusters import Thruster
from ..physics.vehicle import Vehicle
from .inputs import read_motions, refuse_broken_logs
from .whole_answer import NETWORK

if TYPE_CHECKING:
    from ..residuals.models.last_layer import LastLayer
    from ..residuals.models.network_model import NetworkModel

LEAST_RUN_IN = 20.0
"""Shortest run-in [s]: what any verb asks of a log."""
_SLACK = 2.0
"""What gaps and the ends of a log may take off a run-in [s]."""
_QUIET = "the boat was hardly under way, so that its noise and forces are not known: another run-in of as long begins"


@dataclass(frozen=True, slots=True)
class LiveSettings:
    """Settings by which a growing log is followed.

    Attributes
    ----------
    run_in : of the log, from which noise and size of the forces are learned [s]
    follow : wait for more at the end of the file
    idle : end when there was nothing new for so long [s]; None for never
    adapt : how fast it forgets
    alarm : budget of false alarms

    Raises
    ------
    RequestError
        when a number is out of range.
    """

    run_in: float = 60.0
    follow: bool = False
    idle: float | None = None
    adapt: AdaptSettings = field(default_factory=AdaptSettings)
    alarm: AlarmSettings = field(default_factory=AlarmSettings)

    def __post_init__(self) -> None:
        if not LEAST_RUN_IN <= self.run_in < float("inf"):
            raise RequestError(f"adapt: expected a run-in of at least {LEAST_RUN_IN:g} s, got {self.run_in:g} s")
        if self.idle is not None and not self.idle > 0.0:
            raise RequestError(f"adapt: expected an idle time above 0 s, got {self.idle:g} s")
        if self.idle is not None and not self.follow:
            raise RequestError("adapt: --idle says when to end with --follow; give both, or none")


@dataclass(frozen=True, slots=True)
class Note:
    """Something to be told once."""

    text: str


@dataclass(frozen=True, slots=True, eq=False)
class Begun:
    """The run-in is over, and parameters are followed from its beginning.

    Attributes
    ----------
    symbols, units : of what is followed
    start : of those that ring when they change, which are the first, what the file says
    seconds : of motion from which noise and size of the forces are known
    widening : of the variance of the noise, rehearsed for the watch
    network : whose last layer is followed, after the numbers of the vehicle; None for none
    """

    symbols: tuple[str, ...]
    units: tuple[str, ...]
    start: Mapping[str, float]
    seconds: float
    widening: float
    network: "LastLayer | None" = None


@single_threaded
def follow_live(
    log: str,
    vehicle: Vehicle,
    effects: Sequence[str] = (),
    reading: Reading = AS_GUESSED,
    settings: LiveSettings | None = None,
    like: PathLike | None = None,
    network: PathLike | None = None,
) -> Iterator[Note | Begun | Update]:
    """Follow parameters along a CSV log that may still be written, or that comes from standard input (`-`).

    Parameters
    ----------
    effects : see `adapt`; default: the damping that stands in the vehicle, and the scale of each thruster
    like : an earlier log of this boat, from which noise and size of the forces are learned in the place of a run-in
    network : folder of a network that corrects this vehicle, or of a run with one, whose last layer is followed, too

    Yields
    ------
    Note, Begun, Update
        what is to be told, once that parameters are followed, and an update for each test function

    Raises
    ------
    LogError, RequestError
        when the log cannot be read or used, is known to be broken, or ends before the run-in; when effects or a network
        cannot be followed; when the log is to be repaired, which takes all of it.
    """
    if reading.fix:
        raise RequestError("adapt: a log that grows cannot be repaired in memory; 'inspect --fix' repairs a whole one")
    settings, names = settings or LiveSettings(), tuple(effects) or following.followed_by_default(vehicle)
    following.candidates_to_follow(vehicle, names)  # before the log is waited for
    model = None if network is None else _network_of(network, vehicle)
    lines = growing_lines(log, settings.follow, settings.idle)
    growing = GrowingLog("standard input" if log == STDIN else log, vehicle, reading, settings.adapt.weak.stride)
    past = None if like is None else read_motions(like, vehicle, reading)[1]
    follower, begun = None, False
    gathered: list[Motion] = []
    for part in chain(lines, (None,)):  # the latter when there are no more
        growing.table.take(part or [])
        ended = part is None
        if not begun and growing.seconds < (LEAST_RUN_IN if past else settings.run_in) and not ended:
            continue
        if not begun:
            yield from map(Note, growing.begin())
            begun = True
            if growing.log is not None:
                seen = inspect_log(growing.log, vehicle, examination=examine(growing.log, vehicle))
                yield from map(Note, refuse_broken_logs((seen,), (), vehicle, reading.as_is))
        motions = growing.motions(ended)
        yield from map(Note, growing.table.take_notes())
        if follower is None:
            gathered += motions
            seconds = sum(motion.duration for motion in past or gathered)
            if not gathered or (not past and seconds < settings.run_in - _SLACK):
                continue
            made = _made(past or gathered, vehicle, names, settings, model)
            if made is None:
                yield Note(f"t = {gathered[-1].time[-1]:.1f} s: {_QUIET}")
                gathered = []
                continue
            follower, first = made
            yield first
            motions, gathered = gathered, []
        for motion in motions:
            yield from follower.take(motion)
    if follower is None:
        got = max(growing.seconds, sum(motion.duration for motion in gathered))  # a growing log forgets its beginning
        raise LogError(
            f"{growing.table.where}: expected at least {settings.run_in:g} s of log under way for the run-in, got "
            f"{got:.1f} s. Record longer, give --run-in less, or --like an earlier log of this boat."
        )
    if growing.table.skipped > 1:
        yield Note(f"{growing.table.skipped} rows could not be read and were skipped")


def _made(
    motions: Sequence[Motion],
    vehicle: Vehicle,
    names: Sequence[str],
    settings: LiveSettings,
    model: "NetworkModel | None",
) -> tuple[Follower, Begun] | None:
    """A follower that knows what a run-in tells; None where the boat was hardly under way."""
    pool, layer = following.candidates_to_follow(vehicle, names, motions), None
    if model is None:
        known = following.learn_prior(motions, vehicle, pool, settings.adapt)
    else:
        from ..residuals.models.last_layer import LastLayer

        known = following.learn_prior(motions, vehicle, pool, settings.adapt, partial(LastLayer, model, motions))
        layer = known.carried if isinstance(known.carried, LastLayer) else None
    watch = following.rehearsed_watch(motions, known, settings.alarm)
    if watch is None:
        return None
    follower = Follower(known, watch)
    start = dict(zip(known.symbols[: known.watched], known.start.tolist(), strict=False))
    return follower, Begun(follower.symbols, follower.units, start, known.seconds, watch.widening, layer)


def _network_of(folder: PathLike, vehicle: Vehicle) -> "NetworkModel":
    """The network of a folder, or of a run in it, that corrects a vehicle."""
    from ..residuals.models.model_files import load_network
    from ..residuals.models.neural import is_network_folder

    place = Path(folder)
    model = load_network(place if is_network_folder(place) else place / NETWORK)
    own, given = model.vehicle.values, vehicle.values
    apart = [
        s for s in own if s != COMMAND_OFFSET.symbol and own[s] != given.get(s)
    ]  # that is the log's, not the boat's
    apart += [
        t.name for t, other in zip(model.vehicle.thrusters, vehicle.thrusters, strict=False) if not _alike(t, other)
    ]
    if apart:
        raise RequestError(
            f"adapt --network {folder}: expected the vehicle that this network corrects, got {vehicle.name}, which "
            f"differs in {listed(apart)}; give --vehicle the file or the run folder that it was trained with"
        )
    return model


def _alike(one: Thruster, other: Thruster) -> bool:
    """True for thrusters of one place and curve."""
    return all(getattr(one, field) == getattr(other, field) for field in ("channel", "x", "y", "angle", "curve"))
