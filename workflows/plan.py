"""The verb `plan`: what to drive next, optimised on the model, and the folder of mission files.

`mission.json` in that folder says which of its files are undertow's.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import degrees, inf, isfinite, radians
from pathlib import Path
from typing import ClassVar

from ..discovery.basis import choose_balance
from ..discovery.experiment.advice import open_questions
from ..discovery.experiment.optimal_manoeuvre import LEAST_SECONDS, Bounds, Driven, Manoeuvre, find_shortest
from ..discovery.experiment.separation import MOST_RIVALS, OpenQuestion, open_question
from ..discovery.selection import SearchResult
from ..discovery.sensor_error_search import search_with_sensor_errors
from ..exports.missions import MISSION_FORMATS, Mission, MissionFormat, Place
from ..measurements.channels.channel_map import read_channel_map
from ..measurements.prepared_logs import PathLike
from ..measurements.statistics.processors import single_threaded
from ..physics.errors import RequestError, shown
from ..physics.file_records import Flag, Number, Record, absent
from ..physics.files import write_json, write_text
from ..physics.presentation import Card, listing, words
from ..physics.stage import Say
from ..physics.vehicle import Vehicle
from ..reports.terminal.progress import SHOWN, showing
from .inputs import read_inputs
from .run_folder.moved_files import UNMOVED, Moved
from .run_folder.read import read_run_inputs
from .run_folder.run_files import check_target_folder, content_of, unchanged, write_folder

RECORD = "mission.json"


class PlannedDrive(Record):
    """A manoeuvre in a file.

    Attributes
    ----------
    words, seconds : what to drive, and its length [s]
    gains : log-likelihood by which each model that may be true would part from the others, in the order of `effects`
    probability : that it tells them apart, each of the models being as likely
    reach, speed : farthest from where it begins [m], and fastest [m/s]
    """

    words: str
    seconds: Number
    gains: tuple[Number, ...]
    probability: Number
    reach: Number
    speed: Number

    @classmethod
    def of(cls, driven: Driven) -> "PlannedDrive":
        """Record of a manoeuvre as the models drove it."""
        same = {name: getattr(driven, name) for name in cls.model_fields if name != "words"}
        return cls(words=driven.trial.words, **same)


class PlanRecord(Record):
    """The content of `mission.json`.

    Attributes
    ----------
    effects : the question, the first is what the search selected
    tells : whether the manoeuvre is more likely than not to tell them apart within the limits
    binding : limits without which one would
    hopeless : effects that nothing which was tried would tell from the others, were they the true ones
    minutes : on the water, with the rest before and after
    best, fixed : the manoeuvre, and the library's best
    files : SHA-256 of each file, by name
    """

    SCHEMA: ClassVar[str] = "undertow.mission/1"

    effects: tuple[str, ...]
    tells: Flag
    binding: tuple[str, ...] = ()
    hopeless: tuple[str, ...] = ()
    minutes: Number
    heading: Number
    best: PlannedDrive
    fixed: PlannedDrive
    files: dict[str, str] | None = absent()


def forms_of(mission: Mission) -> tuple[MissionFormat, ...]:
    """The formats in which a mission can be written: without a place, all but the waypoints."""
    return tuple(form for form in MISSION_FORMATS if mission.place is not None or not form.needs_place)


def check_mission_target(out: PathLike, reads: Sequence[PathLike], *, force: bool = False) -> Path:
    """The folder of a mission, if it can be written and nothing of the user's be lost.

    Parameters
    ----------
    out : the folder
    reads : files that the verb reads
    force : write over what another made; never over what is read
    """
    names = {form.name for form in MISSION_FORMATS} | {RECORD}
    check_target_folder("--out", Path(out), names, own_mission, reads, force=force)
    return Path(out)


def own_mission(folder: Path) -> set[str]:
    """Names of the files of a mission in a folder that undertow wrote and nobody changed since."""
    held = content_of(folder / RECORD)
    files = held.get("files")
    if held.get("schema") != PlanRecord.SCHEMA:
        return set()
    return {RECORD, *(unchanged(folder, files) if isinstance(files, dict) else ())}


_FENCE_SHARE, _FENCE_LEAST = 1.5, 10.0
"""Where nobody limits the space, the fence stands so many times as far as the models get, and at least so far [m]."""


@dataclass(frozen=True, slots=True, repr=False)
class Plan(Card):
    """A manoeuvre that would settle an open question of a run.

    Attributes
    ----------
    question : what is asked
    manoeuvre : the answer
    mission : the manoeuvre as commands of the run's vehicle
    reads : what it was made from
    left_out : look-alikes that are too many to be looked at together
    """

    question: OpenQuestion
    manoeuvre: Manoeuvre
    mission: Mission
    reads: tuple[PathLike, ...]
    left_out: int = 0

    @property
    def minutes(self) -> float:
        """On the water, with the rest before and after [min]."""
        return self.mission.seconds / 60.0

    @property
    def purpose(self) -> str:
        """The question that it would settle."""
        first, *others = map(words, self.question.effects)
        return f"tell {first} from {listing(others)}" if others else f"tell whether there is {first}"

    @property
    def sentences(self) -> tuple[str, ...]:
        """Sentences on what to drive, what it tells, and how the library compares."""
        best, fixed, bounds = self.manoeuvre.best, self.manoeuvre.fixed, self.manoeuvre.bounds
        if self.manoeuvre.tells:
            size = " and the effect is of a plausible size" if self.question.supposed else ""
            texts = [
                f"To {self.purpose}, drive from rest: {best.trial.words}.",
                f"That is {best.seconds:g} s, {self.minutes:.1f} minutes on the water with the rest before and after. "
                f"The boat gets {best.reach:.0f} m away and up to {best.speed:.1f} m/s fast, as the models have it.",
                f"It tells with a probability of {_percent(best.probability)}, if the sensors are as in the log{size}.",
            ]
        else:
            named = listing([f"{limit.value} ({bounds.in_words(limit)})" for limit in self.manoeuvre.binding])
            why = f"what forbids it is the limit of {named}" if named else "no single limit is what forbids it"
            texts = [
                f"Within the limits no manoeuvre that was tried would {self.purpose}: the best would with a "
                f"probability of {_percent(best.probability)}. As far as was tried, {why}."
            ]
        texts += [
            f"Were it {words(key)}, nothing that was tried would tell it from all the others."
            for key in self.manoeuvre.hopeless
            if len(self.question.effects) > 1
        ]
        often = len(fixed.trial.headings)
        what = f"{fixed.trial.name.replace('_', ' ')}{f', {often} runs' if often > 1 else ''}, {fixed.seconds:.0f} s"
        texts.append(
            f"Of the fixed manoeuvres the best for this is {what}"
            + ("." if fixed.probability > 0.9 else f", with a probability of {_percent(fixed.probability)}.")
        )
        if self.left_out:
            texts.append(f"{self.left_out} more look-alikes are left for the plan after it.")
        return tuple(texts)

    @property
    def files(self) -> tuple[str, ...]:
        """Names of the files that can be made: without a place, all but the waypoints."""
        return tuple(form.name for form in forms_of(self.mission))

    @property
    def record(self) -> PlanRecord:
        """Content of `mission.json`, without the digests of the files."""
        return PlanRecord(
            effects=self.question.effects,
            tells=self.manoeuvre.tells,
            hopeless=self.manoeuvre.hopeless,
            binding=tuple(limit.value for limit in self.manoeuvre.binding),
            minutes=self.minutes,
            heading=degrees(self.question.heading),
            best=PlannedDrive.of(self.manoeuvre.best),
            fixed=PlannedDrive.of(self.manoeuvre.fixed),
        )

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        return [("question", self.purpose), *(("", sentence) for sentence in self.sentences)]


@showing
@single_threaded
def plan(
    run: PathLike,
    effects: Sequence[str] = (),
    bounds: Bounds | None = None,
    *,
    place: tuple[float, float] | None = None,
    heading: float | None = None,
    moved: Moved = UNMOVED,
    progress: Say | None = SHOWN,
) -> Plan | None:
    """The shortest manoeuvre that would settle a question that a run leaves open; None where it leaves none open.

    Parameters
    ----------
    run : folder of a run, whose logs are searched again
    effects : that are to be told apart, by name; without any, what the first advice of the run would tell
    bounds : of speed, space, thrust and time
    place : latitude and longitude where it begins [deg], for the waypoint file
    heading : on which it begins, clockwise from north [deg]; None for that of the log's beginning
    moved : where the logs of the run are now

    Raises
    ------
    RequestError
        for an unknown effect, a limit that is not positive, a time that is too short, a place or heading that is none,
        or a folder that is not a run.
    """
    bounds = _sound(bounds or Bounds())
    if heading is not None and not isfinite(heading):
        raise RequestError(f"plan: expected a heading in degrees from north, got {heading:g}")
    if place is not None and not _on_earth(*place):
        raise RequestError(f"plan: expected a place as latitude and longitude in degrees, got {place}")
    record = read_run_inputs(run, moved)
    inputs = record.searched(read_inputs(record.logs, record.vehicle, record.reading, progress=progress))
    say = progress or (lambda text: None)
    looked, _ = search_with_sensor_errors(choose_balance(inputs.fitting, inputs.vehicle, record.settings), say)
    advised = record.findings.advice[0].effects if record.findings and record.findings.advice else ()
    named = tuple(effects) or advised or first_question(looked, record.findings.missing if record.findings else ())
    if not named:
        return None
    named, left_out = named[: 1 + MOST_RIVALS], len(named[1 + MOST_RIVALS :])
    say(f"looking for the shortest manoeuvre that parts {', '.join(named)}")
    question = question_of(looked, named, None if heading is None else radians(heading))
    manoeuvre = find_shortest(question, bounds, record.settings.seed)
    best = manoeuvre.best
    fence = bounds.space if isfinite(bounds.space) else max(_FENCE_LEAST, _FENCE_SHARE * best.reach)
    at = None if place is None else Place(*place, degrees(question.heading))
    read_as, turned = _read_as(record.reading.channel_map, inputs.vehicle)
    mission = Mission(inputs.vehicle, best.trial.steps, round(fence, 1), bounds.speed, place=at, read_as=read_as)
    found = Plan(question, manoeuvre, mission, (run, *record.logs), left_out)
    about = ("A manoeuvre planned by undertow.", *found.sentences[:3], *turned)
    return replace(found, mission=replace(mission, about=about))


def _read_as(channel_map: PathLike | None, vehicle: Vehicle) -> tuple[dict[str, tuple[float, float]], list[str]]:
    """Scale and offset by which pulses were read, by channel, where a map changes them; and a sentence on each."""
    entries = {} if channel_map is None else read_channel_map(Path(channel_map))
    found, told = {}, []
    for thruster in vehicle.thrusters:
        entry = entries.get(thruster.channel)
        if thruster.command != "pwm" or entry is None or entry.steering is not None:
            continue
        if abs(entry.scale) == 1.0 and (entry.scale, entry.offset) != (1.0, 0.0):  # else the log held no pulses
            found[thruster.channel] = entry.scale, entry.offset
            told.append(
                f"Pulses of {thruster.name} are the boat's own; the vehicle's are {entry.scale:g} times {entry.source} "
                f"{entry.offset:+g} us, by the channel map."
            )
    return found, told


def first_question(looked: SearchResult, missing: Sequence[str]) -> tuple[str, ...]:
    """The first question that a run leaves open: its names and look-alikes, else what it doubts or cannot see.

    Parameters
    ----------
    missing : effects that it called missing
    """
    sure = [e.key for e in looked.evidence if e.key.split("[")[0] in missing]
    questions = open_questions(looked.evidence, sure, looked.known)
    ranked = sorted(questions, key=lambda key: (not questions[key], key not in looked.state.active))
    return (ranked[0], *questions[ranked[0]]) if ranked else ()


def question_of(looked: SearchResult, effects: Sequence[str], heading: float | None = None) -> OpenQuestion:
    """The question which of some effects is there, after a selection; `heading` in rad.

    Parameters
    ----------
    looked : the selection
    effects : keys of the effects in question
    heading : at the start [rad]; None for any
    """
    search, state = looked.forces
    return open_question(search, state, effects, looked.plausible, heading)


def write_plan(plan: Plan, out: PathLike, *, force: bool = False) -> Path:
    """Write a folder with the mission in every format, and `mission.json`; without a place, no waypoint file.

    Parameters
    ----------
    out : made if it is missing; other files in it stay
    force : replace also files that undertow did not write, or that were changed since

    Raises
    ------
    RequestError
        when the folder cannot be written, or something of another's would be lost.
    """
    target = check_mission_target(out, plan.reads, force=force)

    def build(work: Path) -> list[str]:
        texts = {form.name: form.content(plan.mission) for form in forms_of(plan.mission)}
        for name, text in texts.items():
            write_text(work / name, text)
        digests = {name: hashlib.sha256(text.encode()).hexdigest() for name, text in texts.items()}
        write_json(work / RECORD, plan.record.but(files=digests).to_dict())
        return [*digests, RECORD]

    return write_folder("the mission", target, build, own_mission, force=force)


def place_at(text: str) -> tuple[float, float]:
    """Latitude and longitude [deg] of words such as "54.32,10.14".

    Raises
    ------
    RequestError
        when they are not two numbers of the earth.
    """
    try:
        latitude, longitude = (float(word) for word in text.split(","))
    except ValueError:
        latitude = longitude = float("nan")
    if not _on_earth(latitude, longitude):
        raise RequestError(f"--at {shown(text)}: expected LAT,LON in degrees, such as 54.3233,10.1394")
    return latitude, longitude


def _on_earth(latitude: float, longitude: float) -> bool:
    """True when it is a place at which metres to the east are a longitude."""
    return abs(latitude) < 89.0 and abs(longitude) <= 180.0


def _sound(bounds: Bounds) -> Bounds:
    for name, value in (("speed", bounds.speed), ("space", bounds.space)):
        if not value > 0.0:
            raise RequestError(f"plan: expected a limit of {name} above 0, got {value:g}")
    if not LEAST_SECONDS <= bounds.seconds < inf:
        raise RequestError(f"plan: expected a time of {LEAST_SECONDS:g} s or more, got {bounds.seconds:g} s")
    if not 0.05 <= bounds.thrust <= 1.0:
        raise RequestError(f"plan: expected a thrust of 5 to 100 %, got {100.0 * bounds.thrust:g} %")
    return bounds


def _percent(share: float) -> str:
    return f"{100.0 * min(share, 0.99):.0f} %"
