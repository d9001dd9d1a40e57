"""Mapping of streams to channels: the user's channel map first, then the best guess; and auxiliary channels.

Auxiliary is what a log has beside motion and thruster commands, kept in `Log.auxiliary`: steering outputs, battery,
currents and revolutions of motors, the autopilot's mode and its waypoint. No check looks at them and no vehicle needs
them.
"""

import difflib
import re
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...physics.errors import LogError
from ...physics.motion import Array
from ..canonical import PLACE, QUATERNION, RATES, TRACK, Channel, auxiliary_unit, command_kind, in_vehicle_file, unit_of
from ..formats.autopilots.autopilot import AUTOPILOTS
from ..formats.base import Name, Stream, some
from .channel_map import Entry
from .conversion import Source, channels_of
from .message_types import NOT_MEASURED, PREDICTED, Meaning, colours, is_earth_velocity, others, short_kind, unneeded
from .recognition import is_under, is_vertical_acceleration, recognise, says_command, side_in

_GROUPS = (
    ("x", "y"),
    ("psi",),
    QUATERNION,
    ("u", "v"),
    RATES,
    TRACK,
    ("r",),
    ("ax", "ay"),
    ("wind_u", "wind_v"),
    PLACE,
)


@dataclass(frozen=True, slots=True, eq=False)
class Mapped:
    """What mapping makes of the streams of a file.

    Attributes
    ----------
    channels : by canonical name
    entries : the channel map that gives these channels again, whatever the guess; None for what it leaves out
    unused : names of the streams that became no channel
    notes : every guess and conversion, and every dropped row
    idle : what the channel map leaves out, though nothing in the log would have become it
    """

    channels: dict[str, Channel]
    entries: dict[str, Entry | None]
    unused: tuple[str, ...]
    notes: tuple[str, ...]
    idle: tuple[str, ...] = ()


def map_channels(
    streams: Sequence[Stream],
    frame: str | None,
    entries: Mapping[str, Entry | None],
    where: str,
    unread: Sequence[Name] = (),
    namespace: str | None = None,
    mend: bool = False,
) -> Mapped:
    """Turn streams into canonical channels.

    Parameters
    ----------
    streams : what the reader found
    frame : "ned", "enu" or None, see `read_log`
    entries : the channel map, empty for none
    where : the file, for messages
    unread : what the file holds beside
    namespace : in which the guess looks; None for everywhere. The channel map may name any topic.
    mend : see `Cleaner`

    Raises
    ------
    LogError
        see `read_log`.
    """
    notes: list[str] = []
    ours = [stream for stream in streams if namespace is None or is_under(stream.topic, namespace)]
    sources = _mapped((ours, streams), frame, entries, where, unread)
    mapped, given = tuple(sources), {id(stream) for source in sources.values() for stream in source.streams}
    guessed = _guessed(ours, frame, notes)
    # A command has one name in the log and, where that is a number, another in the vehicle file: both are shown.
    left_out = {in_vehicle_file(name): name for name, entry in entries.items() if entry is None}
    idle = set(left_out) - {in_vehicle_file(source.target) for source in guessed}
    for source in guessed:
        named = command_kind(source.role) is not None and id(source.stream) in given
        taken = named or source.target in sources or _says_heading(source.target) & _says_heading(*mapped)
        if not taken and in_vehicle_file(source.target) not in left_out:
            sources[source.target] = source
    if not sources:
        names = [*(stream.name for stream in streams), *(name.name for name in unread)]
        raise LogError(
            f"{where}: no channel is recognised among {some(names)}; expected names "
            "like x y psi u v r pwm_port newton_stbd, ROS odometry fields, or a channel map (--map channels.yaml)."
        )
    has_speed, moving = "u" in sources and "v" in sources, "x_dot" in sources and "y_dot" in sources
    of_speed = "u and v" if has_speed else "x_dot and y_dot"
    for better, names, why in (
        ("psi" in sources, QUATERNION, "psi is a channel of its own; the quaternion is not used"),
        ({"x", "y"} <= set(sources), PLACE, "x and y are channels of their own; latitude and longitude are not used"),
        (has_speed, RATES, "u and v are channels of their own; velocities in earth axes are not used"),
        (has_speed or moving, TRACK, f"{of_speed} are channels of their own; speed and course are not used"),
    ):
        if better and [name for name in names if sources.pop(name, None)]:
            notes.append(why)
    notes += [f"{name}: {source.how}" for name, source in sources.items() if source.how]
    channels, told = channels_of(sources, where, mend)
    used = {id(stream) for source in sources.values() for stream in source.streams}
    unused = [stream.name for stream in streams if id(stream) not in used] + [name.name for name in unread]
    in_use: dict[str, Entry | None] = {source.role: source.entry for source in sources.values()}
    in_use |= dict.fromkeys(left_out.values())
    unmatched = tuple(name for key, name in left_out.items() if key in idle)
    if unmatched:
        known = some(sorted(source.target for source in guessed))
        notes.append(
            f"the channel map leaves out {', '.join(unmatched)}, but nothing is taken for it; there are {known}"
        )
    return Mapped(channels, in_use, tuple(unused), (*notes, *told), unmatched)


def _says_heading(*names: str) -> bool:
    return any(name == "psi" or name in QUATERNION for name in names)


def _mapped(
    streams: tuple[Sequence[Stream], Sequence[Stream]],
    frame: str | None,
    entries: Mapping[str, Entry | None],
    where: str,
    unread: Sequence[Name],
) -> dict[str, Source]:
    sources: dict[str, Source] = {}
    for name, entry in entries.items():
        if entry is None:
            continue
        stream = _find(streams, entry.source, name, where, unread)
        guess = recognise(stream.label, stream.frame)
        own = guess if guess is not None and guess.role == name else None
        if command_kind(name) or name in (*PLACE, *TRACK):
            axes = "ned"
        elif own is not None and own.axes != "log" and (own.axes == "ned" or frame is None):
            axes = entry.frame or ("enu" if own.axes == "ros" else "ned")
        else:
            axes = entry.frame or frame or "ned"
        within = own.within if own else None
        how = f"from {stream.name} by the channel map"
        steering = None
        if entry.steering is not None:
            steering = _find(streams, entry.steering.source, name, where, unread), entry.steering
            how = f"mixed of throttle {stream.name} and steering {steering[0].name} by the channel map (mix: skid)"
        source = Source(name, stream, axes, entry.scale, entry.offset, how, within, steering)
        if source.target in sources:
            raise LogError(f"{where}: the channel map gives {source.target} twice; give x and y the same frame.")
        sources[source.target] = source
    return sources


def _find(
    among: tuple[Sequence[Stream], Sequence[Stream]], wanted: str, name: str, where: str, unread: Sequence[Name]
) -> Stream:
    """The stream of a full name anywhere, or of a field: in the namespace first, then anywhere."""
    streams = among[1]
    found = [stream for stream in streams if stream.name == wanted]
    for part in among:
        found = found or [stream for stream in part if stream.field == wanted]
    if len(found) == 1:
        return found[0]
    if found:
        raise LogError(
            f"{where}: the channel map takes {name} from '{wanted}', which several topics have: "
            f"{some([stream.name for stream in found])}. Write topic:field."
        )
    names = [*(stream.name for stream in streams), *(other.name for other in unread)]
    near = difflib.get_close_matches(wanted, names, n=1, cutoff=0.3)
    hint = f"did you mean '{near[0]}'?" if near else f"there are {some(names)}."
    raise LogError(f"{where}: the channel map takes {name} from '{wanted}', which is not in the log; {hint}")


def _guessed(streams: Sequence[Stream], frame: str | None, notes: list[str]) -> list[Source]:
    found = _candidates(streams, notes)
    upside_down = {
        stream.topic
        for stream in streams
        if is_vertical_acceleration(stream.label) and np.nanmean(_finite(stream.value)) < 0
    }
    bearers = Counter(stream.topic for named in found.values() for guess, stream in named if guess.rank == 0)
    foreign = others([stream for named in found.values() for _, stream in named])
    sources = []
    passed: dict[tuple[str, ...], list[str]] = defaultdict(list)
    for roles in (*_GROUPS, *((role,) for role in sorted(found) if command_kind(role))):
        group = _best_group(roles, found, foreign)
        for role in roles:
            candidates = [(guess, stream) for guess, stream in found.get(role, []) if guess.group == group]
            if not candidates:
                continue
            guess, stream = min(candidates, key=lambda one: (one[1].topic in foreign, _behind(role, one[1], bearers)))
            rivals = [other for _, other in found[role] if other is not stream]
            if rivals and all(other.field == stream.field == role for other in rivals):
                passed[(stream.topic, *sorted(other.topic for other in rivals))].append(role)
            elif rivals:
                notes.append(f"{role}: taken from {stream.name}, not from {some([other.name for other in rivals])}")
            sources.append(_placed(guess, stream, frame, stream.topic in upside_down, notes))
    notes += [
        f"{' '.join(roles)}: taken from {topic}, not from {some(rest)}" for (topic, *rest), roles in passed.items()
    ]
    return _own(sources, foreign, notes)


def _own(sources: list[Source], foreign: Mapping[str, str], notes: list[str]) -> list[Source]:
    """The sources without what other things say of themselves, where the boat's own messages say enough."""
    own = {source.role for source in sources if source.stream.topic not in foreign}
    theirs = {source.role for source in sources} - own
    left = unneeded(own, theirs)
    for topic, why in foreign.items():
        roles = [source.role for source in sources if source.stream.topic == topic]
        for verb, more, needless in (
            ("not taken", "", True),
            ("taken", ", because no other message tells them", False),
        ):
            part = [role for role in roles if (role in left) is needless]
            if part:
                notes.append(f"{' '.join(part)} of {topic} {verb}{more}: by {why} it is of another thing than the boat")
    return [source for source in sources if source.role not in left]


def _behind(role: str, stream: Stream, bearers: Mapping[str, int]) -> tuple[bool, int, str]:
    """Order of the topics that bear one canonical name: measured before wanted or predicted, the fullest, by name.

    A command may well come from a topic of commands.
    """
    marks = PREDICTED if command_kind(role) else NOT_MEASURED
    return marks.search(stream.topic.lower()) is not None, -bearers[stream.topic], stream.name


def _candidates(streams: Sequence[Stream], notes: list[str]) -> dict[str, list[tuple[Meaning, Stream]]]:
    """What every stream may be, by role; a stream of a known type that never says anything is no candidate."""
    result: dict[str, list[tuple[Meaning, Stream]]] = defaultdict(list)
    silent: dict[str, list[str]] = defaultdict(list)
    coloured = colours(streams)
    if coloured:
        topics = sorted({stream.topic or stream.name for stream in streams if id(stream) in coloured})
        notes.append(f"{some(topics)}: r, g and b together are a colour; this r is no yaw rate")
    for stream in streams:
        guess = None if id(stream) in coloured else recognise(stream.label, stream.frame)
        if guess is None:
            if stream.kind and stream.field.endswith("linear.x") and is_earth_velocity(stream.label, stream.frame):
                notes.append(
                    f"{stream.topic}: its velocity is in the frame '{stream.frame}', of the earth, not of the body; "
                    "it is not used"
                )
            continue
        value = stream.value
        if guess.within is not None:
            value = value[(value >= guess.within[0]) & (value <= guess.within[1])]
        unset = stream.kind and guess.role in QUATERNION[3:] and not np.any(_finite(value))
        if stream.kind and (unset or not np.isfinite(value).any()):
            silent[stream.topic].append(stream.field)
            continue
        result[guess.role].append((guess, stream))
    notes += [f"{topic}: no value in {some(fields)}" for topic, fields in silent.items()]
    return result


def _finite(values: Array) -> Array:
    finite = values[np.isfinite(values)]
    return finite if finite.size else np.zeros(1)


def _best_group(
    roles: tuple[str, ...], found: Mapping[str, list[tuple[Meaning, Stream]]], foreign: Mapping[str, str]
) -> str:
    """Choose the boat's own message, then the one that has most of the roles, then the best rank, then a full one.

    Sparse is one with less than half of the fullest's numbers; then odometry goes first. What is still equal goes by
    name, so that the logs of one boat give the same choice; commands that say so go before those that do not.
    """
    has: dict[str, set[str]] = defaultdict(set)
    rank: dict[str, int] = {}
    own: set[str] = set()
    count: Counter[str] = Counter()
    for role in roles:
        for guess, stream in found.get(role, []):
            has[guess.group].add(role)
            rank[guess.group] = guess.rank
            own |= {guess.group} if stream.topic not in foreign else set()
            count[guess.group] = max(count[guess.group], int(np.count_nonzero(np.isfinite(stream.value))))
    fullest = max(count.values(), default=0)
    command = any(command_kind(role) for role in roles)

    def order(group: str) -> tuple[bool, int, int, bool, bool, bool, str]:
        sparse, unsaid = 2 * count[group] < fullest, command and not says_command(group)
        return group not in own, -len(has[group]), rank[group], sparse, unsaid, "odom" not in group, group

    return min(rank, key=order, default="")


def _placed(guess: Meaning, stream: Stream, frame: str | None, upside_down: bool, notes: list[str]) -> Source:
    kind, thruster = command_kind(guess.role) or ("", "")
    if thruster.isdigit() and guess.rank > 0:
        how = (
            f"output {thruster} by number [{unit_of(guess.role)}]; if it drives port, map {kind}_port: '{stream.name}'"
        )
        return Source(guess.role, stream, "ned", guess.scale, how=how, within=guess.within)
    if kind:
        measured = guess.axes == "ned" and guess.role.startswith("rad_s")
        what = "the measured speed of" if measured else "guessed from the name"
        how = "" if guess.rank == 0 else f"{what} {stream.name}, taken in [{unit_of(guess.role)}]"
        if how and guess.role.startswith("newton") and 0.0 < np.abs(_finite(stream.value)).max() <= 1.0:
            how += "; never above 1, so is it normalized?"
        return Source(guess.role, stream, "ned", guess.scale, how=how, within=guess.within)
    if guess.axes == "ned":
        how = f"from {stream.name}" if guess.rank == 3 else ""
        return Source(guess.role, stream, "ned", guess.scale, how=how)
    if guess.axes == "log":
        if guess.role in TRACK:
            return Source(guess.role, stream, "ned", how=f"{stream.name} taken in [{unit_of(guess.role)}]")
        return Source(guess.role, stream, frame or "ned")
    if guess.rank == 2 and upside_down and frame is None and guess.role in ("r", "ax", "ay"):
        how = f"from {stream.name}, axes taken as FRD because its vertical acceleration is negative at rest"
        return Source(guess.role, stream, "ned", how=how)
    return Source(guess.role, stream, frame or "enu")


_TYPES = {
    ("sensor_msgs/BatteryState", "voltage"): ("battery_voltage", 1.0),
    ("sensor_msgs/BatteryState", "current"): ("battery_current", -1.0),
    ("mavros_msgs/WaypointList", "current_seq"): ("waypoint", 1.0),
}
"""Fields of ROS messages: the channel and its scale; by sensor_msgs/BatteryState a discharge is negative."""
_BATTERY = {"battery", "batt", "bat"}
_VOLTAGE, _CURRENT = {"voltage", "volt", "volts"}, {"current", "curr", "amps", "amperes"}
_STEER = {"steer", "steering", "rudder", "helm", "outboard"}
_ACTUATOR = {"thruster", "thrusters", "thrust", "motor", "pod", "propeller", "outboard", "actuator", "engine", "esc"}
_ACTUATOR |= {"fin"}
_ANGLE = {"azimuth", "angle", "azimuthing", "pos"}
"""`/wamv/thrusters/left/pos` turns an azimuth thruster of VRX."""
_ELSEWHERE = {"satellite", "sat", "gps", "gnss", "sun", "antenna", "lidar", "radar", "sonar", "camera", "gimbal"}
_STICK = {"rc", "stick", "joystick", "joy", "pilot", "operator", "remote", "transmitter"}
"""In the name of a field, what a hand moves on shore: it steers by the thrusters, too."""
_PLAIN = {"mode": "mode", "flight_mode": "mode", "nav_state": "mode", "waypoint": "waypoint", "wp_seq": "waypoint"}
"""Whole names of columns that count something."""
_LEFT_OUT = {"cmd", "command", "data", "raw", "output", "value", "position", "state", "deg", "rad", *_ANGLE}
"""Words that tell nothing of which one it is."""


def auxiliary_of(name: Name) -> tuple[str, float] | None:
    """The auxiliary channel that a stream is by its type or name, and its scale; None where it is none.

    >>> auxiliary_of(Name("", "thruster_azimuth_angle")), auxiliary_of(Name("", "gps_satellite_azimuth"))
    (('steering_thruster', 1.0), None)
    """
    if auxiliary_unit(name.field) is not None:
        return name.field, 1.0
    if name.kind.startswith(AUTOPILOTS):
        return None  # their readers know the messages
    known = _TYPES.get((short_kind(name.kind), name.field))
    if known is not None or recognise(name) is not None:
        return known
    if not name.topic and name.field.lower() in _PLAIN:
        return _PLAIN[name.field.lower()], 1.0
    role = _by_words(_words(name.name), moved_on_shore=bool(_STICK & {*_words(name.field)}))
    return None if role is None else (role, 1.0)


def _words(name: str) -> list[str]:
    """The words of a name, in small letters."""
    return [word for word in re.split(r"[^a-z0-9]+", re.sub(r"([a-z])([A-Z])", r"\1_\2", name).lower()) if word]


def _by_words(words: list[str], *, moved_on_shore: bool) -> str | None:
    """What the words of a name say together; what steers on shore is nothing of the boat."""
    has = set(words)
    if has & _ELSEWHERE:
        return None
    if has & _BATTERY and has & (_VOLTAGE | _CURRENT):
        return "battery_voltage" if has & _VOLTAGE else "battery_current"
    if has & _STEER or (has & _ACTUATOR and has & _ANGLE):
        return None if moved_on_shore else _which("steering", words, {"steer", "steering"})
    if "rpm" in has:
        return _which("rpm", words, {"rpm"})
    return _which("motor_current", words, _CURRENT | {"motor"}) if has & _CURRENT and has & _ACTUATOR else None


def _which(kind: str, words: list[str], of_kind: set[str]) -> str:
    """The kind with the side or the words that tell one from another."""
    which = side_in(" ".join(words)) or "_".join(word for word in words if word not in _LEFT_OUT | of_kind)
    return f"{kind}_{which}" if which else kind


def auxiliary_channels(streams: Sequence[Stream]) -> dict[str, Channel]:
    """The auxiliary channels among streams: finite values at rising stamps, the first stream of each name."""
    result: dict[str, Channel] = {}
    for stream in streams:
        told = auxiliary_of(stream.label)
        if told is None or told[0] in result:
            continue
        known = np.isfinite(stream.value) & np.isfinite(stream.time)
        time, last = np.unique(stream.time[known][::-1], return_index=True)
        if time.size:
            value = told[1] * stream.value[known][::-1][last]
            result[told[0]] = Channel(told[0], time, value, stream.name)
    return result
