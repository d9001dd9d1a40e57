"""Errors of a log's record as findings: command timing, clocks, compass and gyro, and what they confound.

Some errors the records tell of each other without any force, and the motions are corrected for them; a delay of the
commands comes from the fit. Each named effect carries the share of its force that such an error may have made.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from ...measurements.compass import Compass
from ...measurements.kinematics import Kinematics, compass_shown, gyro_lateness, turning_of
from ...measurements.prepared_logs import correction_name
from ...measurements.statistics.blocks import CI
from ...physics.effects import BY_NAME, COMMAND_OFFSET
from ...physics.motion import Motion
from ...physics.presentation import listing, words
from ...physics.vehicle import Vehicle
from ..balance.shooting import TRIFLE
from ..candidates.candidate import Candidate, Kind, limit_at
from ..effect_findings import EffectFinding, FittedTerm, Reason, found_terms
from ..findings import Findings, SensorError
from ..search.estimation import Interval
from ..search.scoring import Scoring
from .weighing import Evidence

Verdict = Literal["present", "possible", "no evidence"]
STRAIGHT_RUNS = "compass_on_straight_runs"
"""Name of the correction for a compass deviation that straight runs show: of what is fitted on rollouts alone."""
_MATERIAL = 0.2
"""Share of the time between two records from which an offset is worth a word: less is how the averages fall."""


def record_errors(
    search: Scoring,
    fitted: Vehicle,
    active: tuple[str, ...],
    intervals: Mapping[str, Interval],
    certain: bool = True,
) -> tuple[SensorError, ...]:
    """Findings on the timing of the commands, where a model with the keys `active` has one that is fitted.

    Parameters
    ----------
    fitted : what the log asks for
    intervals : 95 % intervals by symbol
    certain : whether the model is; beside one that is not, an offset is fitted with whatever that model leaves
    """
    found = []
    for candidate in search.pool:
        if candidate.kind is not Kind.SENSOR or candidate.key not in active:
            continue
        terms = found_terms(candidate, search.nominal, fitted, intervals)
        (term,), (parameter,) = terms, candidate.parameters
        sure = term.ci95 is not None and not term.ci95.lower <= 0.0 <= term.ci95.upper
        step, when = f"{parameter.upper:.2g} s", "later" if term.value > 0.0 else "earlier"
        verdict: Verdict = "no evidence"
        sentence = f"The commands act when their record says, as far as its step of {step} tells."
        if limit_at(parameter, term.value) is not None:
            verdict = "possible"
            sentence = (
                f"The commands may act {when} than their record says by more than the {step} from one record to the "
                "next, or something else looks so; 'undertow inspect' compares the clocks."
            )
        elif sure and abs(term.value) >= _MATERIAL * parameter.upper:
            verdict, act = ("present", "act") if certain else ("possible", "may act")
            sentence = (
                f"The commands {act} {abs(term.value):.2g} s {when} than their record says, less than the {step} from "
                "one record to the next. "
            )
            if certain:
                sentence += "No effect was blamed for it; errors of predictions still hold it."
            else:
                sentence += "The model beside which that was fitted is not certain itself."
        found.append(
            SensorError(
                error="channel_offset", verdict=verdict, sentence=sentence, terms=terms, correction=candidate.key
            )
        )
    return tuple(found)


def sensor_findings(motions: Sequence[Motion], rolls: bool) -> tuple[SensorError, ...]:
    """Findings on compass, gyro and their clocks, which the channels of a log tell without any force.

    Parameters
    ----------
    motions : as they are recorded
    rolls : whether rollouts judge, for which a compass that deviates on straight runs was put right
    """
    compass = compass_error(compass_shown(motions)) if rolls else ()
    return (*compass, *clocks(motions), *(() if compass else turning(motions)))


def clocks(motions: Sequence[Motion]) -> tuple[SensorError, ...]:
    """The finding on a gyro and a compass that tell of the same turns at different instants."""
    late = gyro_lateness(motions)
    if abs(late) <= max(motion.time_step for motion in motions):
        return ()
    first, second = ("gyro", "compass") if late > 0.0 else ("compass", "gyro")
    text = (
        f"The {first} tells of turns {abs(late):.2g} s later than the {second} does: it is filtered, or stamped late. "
        "Nothing is corrected for it, and a lag, a delay or an inertia in yaw that it may look like is not certain."
    )
    terms = (FittedTerm(symbol="gyro_latency", value=late, unit="s"),)
    return (SensorError(error="channel_offset", verdict="present", sentence=text, terms=terms),)


_CLOCKS = (COMMAND_OFFSET.symbol, "gyro_latency")


class Misalignment(NamedTuple):
    """Time by which the channels of a log are out of step [s], and its share of a step of the record, at most all."""

    seconds: float = 0.0
    share: float = 0.0


def out_of_step(motions: Sequence[Motion], errors: Sequence[SensorError]) -> Misalignment:
    """Misalignment of the channels of a log, certain or only possible.

    Its commands, its gyro, or what its reader could not tell of its clocks, whichever is more.
    """
    told = (s for s in errors if s.what in _CLOCKS and s.verdict != "no evidence")
    late = max([*(abs(term.value) for s in told for term in s.terms), *(m.out_of_step for m in motions)], default=0.0)
    return Misalignment(late, min(late / max(max(m.command_step, m.time_step) for m in motions), 1.0))


def turning(motions: Sequence[Motion]) -> tuple[SensorError, ...]:
    """Findings on headings that turn faster or slower than the gyro says, of logs that do not tell which of them errs.

    Parameters
    ----------
    motions : as they are recorded
    """
    sources = dict.fromkeys(motion.source for motion in motions)
    found = []
    for source in sources:
        known = turning_of([motion for motion in motions if motion.source == source])
        scale, _ = known.values.get("gyro_scale", (1.0, 0.0))
        if not (known.present or known.beyond) or abs(scale - 1.0) <= TRIFLE:
            continue  # a compass that deviates by 0.02 rad makes up to 0.02
        name = f"{Path(source).name}: " if len(sources) > 1 else ""
        text = (
            f"{name}The heading turns {1.0 / scale:.3g} times as fast as the gyro says: the gyro's scale is wrong, or "
            "the compass deviates; this log turns too little to tell which. Nothing is corrected for it; turn full "
            "circles both ways to tell."
        )
        terms = (FittedTerm(symbol="gyro_scale", value=scale, unit="1"),)
        found.append(SensorError(error="gyro_scale", verdict="possible", sentence=text, terms=terms))
    return tuple(found)


def shares_of_sensor_errors(
    evidence: Sequence[Evidence], pool: Sequence[Candidate], errors: Sequence[SensorError]
) -> dict[str, tuple[float, str]]:
    """Share of what a name explains that an error of the sensors may have made, and which error, by key.

    Errors that are told and that nothing was corrected for. They are of headings and turn rates: what a name explains
    in surge they did not make, unless it goes with the turn rate.

    Parameters
    ----------
    evidence : of all candidates; those selected have a share of force on each axis
    pool : the candidates
    errors : findings on the sensors
    """
    told = listing([words(e.what) for e in errors if e.verdict != "no evidence" and not e.correction])
    if not told:
        return {}
    turns = {c.key for c in pool if any("r" in p.form for p in c.parameters)}
    own = {e.key: np.square(e.share) for e in evidence if e.selected}
    sizes = {key: 1.0 if key in turns else float(s[1:].sum() / max(s.sum(), 1e-300)) for key, s in own.items()}
    return {key: (size, told) for key, size in sizes.items()}


def compass_error(compass: Compass) -> tuple[SensorError, ...]:
    """The finding on a compass whose deviation is plain on straight runs, and for which the motion was corrected."""
    if not compass.plain:
        return ()
    values = {"constant": compass.constant, "sine": compass.sine, "cosine": compass.cosine}
    terms = tuple(FittedTerm(symbol=name, value=float(np.degrees(x)), unit="deg") for name, x in values.items())
    text = f"{compass.sentence[0].upper()}{compass.sentence[1:]}; heading and velocities are corrected for it."
    found = SensorError(error="compass_deviation", verdict="present", sentence=text, terms=terms)
    return (found.but(correction=STRAIGHT_RUNS),)


def add_record_errors(findings: Findings, sensors: tuple[SensorError, ...]) -> Findings:
    """Findings with the errors of the record, and the delay that would look like one as its look-alike."""
    offsets = [s for s in sensors if s.what == COMMAND_OFFSET.symbol]
    late = any(s.verdict != "no evidence" and s.terms[0].value > 0.0 for s in offsets)
    candidates = tuple(
        _alike(c) if late and (c.effect, c.verdict) == ("input_delay", "no evidence") else c
        for c in findings.candidates
    )
    return findings.but(sensors=sensors, candidates=tuple(sorted(candidates, key=lambda c: c.rank)))


def _alike(delay: EffectFinding) -> EffectFinding:
    told = Reason.LOOK_ALIKES.tell(BY_NAME[delay.effect].meaning, "commands that are recorded early")
    alike = (*delay.indistinguishable_from, "channel_offset")
    return delay.but(verdict="possible", reason=Reason.LOOK_ALIKES, sentence=told, indistinguishable_from=alike)


_ERRORS: tuple[tuple[Any, str, tuple[str, ...]], ...] = (
    ("gyro_scale", "1", ("gyro_scale",)),
    ("gyro_bias", "rad/s", ("gyro_bias",)),
    ("compass_deviation", "deg", ("compass_sine", "compass_cosine")),
    ("compass_deviation", "deg", ("misalignment",)),
    ("velocity_scale", "1", ("velocity_scale",)),
    ("velocity_latency", "s", ("velocity_latency",)),
    ("channel_offset", "s", ("position_latency",)),
    ("water_speed", "m/s", ("water_north", "water_east")),
    ("antenna_arm", "m", ("arm_x", "arm_y")),
)
"""Names of the findings, and the numbers of each with their unit; the first names the sentence that tells of it."""


def sensor_errors(sensors: Mapping[str, Kinematics]) -> tuple[SensorError, ...]:
    """A finding for every error that the records of a log can tell of, present or not.

    Parameters
    ----------
    sensors : by the source of the motions
    """
    found = []
    for source, known in sorted(sensors.items()):
        sentences, name = known.sentences, f"{Path(source).name}: " if len(sensors) > 1 else ""
        for error, unit, symbols in _ERRORS:
            terms = tuple(_term(known, symbol, unit) for symbol in symbols if symbol in known.values)
            verdict: Verdict
            correction = ""
            if symbols[0] in sentences:
                verdict, told = "present", f"{sentences[symbols[0]]}; the motion is corrected for it"
                correction = correction_name(symbols[0], source, sensors)
            elif set(symbols) & set(known.beyond):
                verdict, told = "possible", "this is further off than a sensor is: the record is wrong, or its unit"
            elif all(known.sharp(symbol) for symbol in symbols):
                verdict, told = "no evidence", "as it should be"
            else:
                continue
            sentence = f"{name}{told[0].upper()}{told[1:]}."
            found.append(
                SensorError(error=error, verdict=verdict, sentence=sentence, terms=terms, correction=correction)
            )
    return tuple(found)


def _term(known: Kinematics, symbol: str, unit: str) -> FittedTerm:
    value, error = known.values[symbol]
    by = float(np.degrees(1.0)) if unit == "deg" else 1.0
    low, high = (by * (value + side * CI * error) for side in (-1.0, 1.0))
    return FittedTerm(symbol=symbol, value=by * value, unit=unit, ci95=Interval(low, high))
