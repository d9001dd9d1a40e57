"""The first lines of a run, from typed facts: the verdict, what it did to the error, and what it leaves open."""

import re
import shlex
from collections.abc import Sequence
from math import isfinite
from typing import NamedTuple

from ...comparison.facts import BASELINE, CORRECTED, NOMINAL, ComparedModel, Comparison, Grounds
from ...discovery.effect_findings import EffectFinding
from ...discovery.findings import BY_OTHER_MEANS, WATER, Findings, NamelessForce, Step, comes_and_goes
from ...discovery.search.scoring import MOST
from ...physics.effects import EFFECTS
from ...physics.motion import AXES
from ...physics.presentation import listing, number, percent, sentence_case, share_removed, words
from ...physics.vehicle import Vehicle, lacking
from ...residuals.scores import ROLLOUT_UNITS, RolloutRecord
from ..run_contents import difference
from ..sureness import file_numbers, in_order, named, odds, with_odds
from ..wording import CALIBRATED, LEAD, effect_words, pick_horizon, twins

_LEVEL = 0.01
"""Share by which an error must change to be called changed; `residuals.paired` asks for as much."""
_TENTH = 0.1
"""Share of the unseen error from which on nobody can say that nothing is missing while the model changes it."""
_IN_PLAY, _BESIDE = 4, 2
"""Names that a line of those in play has, and beside a force without a name; of more it says how many they are."""
_LEARN = " ('discover --residual best' may learn it)"
_RUN_IN = 1.0
"""Minutes of a log after which `adapt` follows what changes."""
_TITLES = {"missing": "What is missing", "likely": "What is probably missing"}
"""Over the effects of a run, where its verdict is not an open one."""
_WEATHER = ("steady_current", "turning_current", "mean_wind")
"""Effects that are no part of a boat."""
_SETTLED = "Nothing is missing that this log can show."
_CHANCE = {"no difference": ", which may be chance", "too short to tell": ", on too few rows to exclude chance"}
_FIRST_REASON = re.compile(r": | \(|; |\.$")
"""Where the first reason of an advice ends: numbers and further reasons stand under what to record next."""
_SPEEDS = {"surge": "the surge speed u", "sway": "the sway speed v", "yaw": "the yaw rate r"}
"""The channel of each axis whose velocity may be wrong."""


class Line(NamedTuple):
    """A line of an answer or of an opening: what it tells of, and what it says."""

    label: str
    text: str

    @property
    def in_words(self) -> str:
        """Both, as a line of text."""
        return f"{self.label}: {self.text}"


class Hero(NamedTuple):
    """The error that a story leads with: horizon of the predictions [s], quantity, and its size before and after."""

    horizon: str
    metric: str
    before: float
    after: float

    @property
    def unit(self) -> str:
        """Of the error."""
        return ROLLOUT_UNITS[self.metric]

    @property
    def in_words(self) -> str:
        """What error it is."""
        return f"{self.metric} error of {self.horizon} s predictions"


def hero(steps: Sequence[Step], deciding: str = "") -> Hero:
    """The error that a story leads with.

    Parameters
    ----------
    deciding : the horizon that decides which model to trust, see `comparison.facts.Best`; the story leads with it
    """
    horizon = pick_horizon(list(steps[0].rollout_rmse), deciding or LEAD)
    known = [name for name in ROLLOUT_UNITS if any(isfinite(step.rollout(horizon).of(name)) for step in steps)]
    metric = known[0] if known else "position"
    ends = {name: tuple(step.rollout(horizon).of(name) for step in (steps[0], steps[-1])) for name in ROLLOUT_UNITS}
    share = {name: after / before if before > 0.0 else 1.0 for name, (before, after) in ends.items()}
    # Over two seconds a place is mostly the receiver's noise: a speed tells what was done to the model.
    if horizon != LEAD and known and abs(share[metric] - 1.0) <= _LEVEL:
        least = min(known, key=lambda name: share[name])
        metric = least if share[least] < 1.0 - _TENTH else metric
    return Hero(horizon, metric, *ends[metric])


_MORE = 2
"""Effects that are named of those that are no part of the headline."""


def gets_worse(steps: Sequence[Step], deciding: str = "") -> bool:
    """Whether the error that the story leads with is larger after the last step, or the predictions run away there."""
    led = hero(steps, deciding)
    return len(steps) > 1 and led.before == led.before and not led.after <= led.before * (1.0 + _LEVEL)


def outcome(findings: Findings, comparison: Comparison) -> str:
    """What was added did to the error of the lead horizon, as a sentence; empty where nothing was added.

    Parameters
    ----------
    comparison : its paired difference says what may be chance
    """
    steps = findings.steps
    if len(steps) < 2:
        return ""
    led = hero(steps, comparison.best.horizon)
    before, after = led.before, led.after
    if before != before:
        return ""
    added = [step for step in steps[1:] if step.added != CALIBRATED]
    said = [step for step in added if step.added in (*findings.missing, *findings.likely) or ":" in str(step.added)]
    more = [words(str(step.added)) for step in added if step not in said] if said else []
    every = ["it" if len(said or added) == 1 else "them", *_first(more, _MORE)]
    adding = [f"adding {listing(every)}"] * bool(added)
    done = listing([*["calibrating its parameters"] * bool(findings.calibrated), *adding]) or "what was done"
    what, where = f"the {led.in_words}", "on unseen motion"
    if after != after:
        return f"{sentence_case(done)} makes predictions over {led.horizon} s run away {where}."
    ends = f"{number(before, 2)} to {number(after, 2)} {led.unit}"
    doubt = _chance(findings, comparison)
    if gets_worse(steps, comparison.best.horizon):
        return f"{sentence_case(done)} makes {what} worse {where}, from {ends}{doubt}."
    if after >= before * (1.0 - _LEVEL):
        return f"{sentence_case(done)} leaves {what} as it was {where}, {number(before, 2)} {led.unit}."
    return f"{sentence_case(done)} removes {share_removed(1.0 - after / before)} of {what} {where}{doubt}."


def also_worse(findings: Findings, comparison: Comparison) -> str:
    """Which other errors grew by more than chance, as a sentence; empty where none did."""
    led = hero(findings.steps, comparison.best.horizon)
    grown = [one.in_words for one in comparison.worsened if (one.horizon, one.axis) != led[:2]]
    return f"By more than chance, these errors grow: {listing(grown)}." if grown else ""


def settled(findings: Findings, comparison: Comparison) -> bool:
    """True when nothing is missing: every axis was judged, and the corrected model changes no tenth of the error.

    A tenth of an error that is next to nothing itself, beside that of a guess that knows nothing of the boat, is none.
    """
    whole = findings.verdict == "nothing missing" and not findings.criterion.unjudged
    return whole and _changed(findings.steps, comparison) < _TENTH


def headline(findings: Findings, comparison: Comparison) -> str:
    """The verdict in a sentence, that of the findings where the facts bear it; of a boat that changes, after how.

    Where nothing is missing, what the sensors do wrong is what there is to tell.
    """
    told, change = _verdict(findings, comparison), findings.change
    wrong = [words(one.error) for one in findings.sensors if one.verdict == "present" and one.correction != WATER]
    errs = f" The log's sensors err: {listing(wrong)}." if wrong and findings.verdict == "nothing missing" else ""
    told = told if errs in told else f"{told}{errs}"
    if change is None or change.begins in told:
        return told
    return f"{change.begins} {told}"


def _verdict(findings: Findings, comparison: Comparison) -> str:
    nothing = findings.verdict == "nothing missing"
    if findings.headline and findings.verdict == "undecided" and _own_numbers_do(findings, comparison):
        done = _done_to(hero(findings.steps, comparison.best.horizon))
        instead = f"{_FILE_OFF} {done}."
        if findings.headline.startswith("Nothing") or findings.headline.endswith(instead):
            return findings.headline if findings.headline.endswith(instead) else instead
        own = f" Fitting the file's own numbers {done}."
        return f"{findings.headline.removesuffix(own)}{own}"
    if findings.headline and (not nothing or settled(findings, comparison)):
        return findings.headline
    if not nothing:
        return _names_first(findings)
    unjudged = findings.criterion.unjudged
    if unjudged:
        where = [axis for axis in AXES if axis not in unjudged]
        rest = f" In {listing(where)}, nothing is missing that this log can show." if where else ""
        return f"No force was judged in {listing(unjudged)}: the velocity there may be wrong.{rest}"
    if settled(findings, comparison):
        return _SETTLED
    led = hero(findings.steps, comparison.best.horizon)
    passing = comes_and_goes(findings.passing)
    if findings.calibrated and not findings.added and gets_worse(findings.steps, comparison.best.horizon):
        return findings.headline or f"{_SETTLED} {passing}".strip()  # the numbers that fit this log hold nowhere else
    done = _done_to(led)
    if findings.added:
        return f"No name is sure, and yet model.yaml {done}."
    return f"{_FILE_OFF} {done}. {passing}".strip()


_FILE_OFF = "No new effect is needed: numbers of the vehicle file are off, and putting them right"


def _own_numbers_do(findings: Findings, comparison: Comparison) -> bool:
    """True where the model that is written adds no effect, and its numbers surely remove most of the squared error."""
    if not (findings.steps and findings.calibrated) or findings.added:
        return False
    led = hero(findings.steps, comparison.best.horizon)
    told = difference(comparison.differences, CORRECTED, NOMINAL, "rollout", led.metric, led.horizon)
    return told is not None and told.verdict == "better" and led.after**2 <= (1.0 - MOST) * led.before**2


def section_title(findings: Findings, comparison: Comparison) -> str:
    """The title over the effects of a run, by the surest of them."""
    if findings.verdict in _TITLES:
        return _TITLES[findings.verdict]
    return "Nothing is missing that this log can show" if settled(findings, comparison) else "What may be missing"


def answer(findings: Findings, comparison: Comparison, nominal: Vehicle | None = None) -> tuple[Line, ...]:
    """What an open verdict still says, in three lines: which model predicts best, which names are in play, what to do.

    None where the verdict is not open: something is missing for sure, or nothing is.

    Parameters
    ----------
    nominal : the vehicle as its file has it, which may be what is to be looked at next
    """
    if findings.verdict == "missing" or settled(findings, comparison):
        return ()
    change, play = findings.change, _in_play(findings, comparison)
    if change is not None and not change.since:
        play = f"{change.what}, which changed at {change.when}; before: {play}"
    return (
        Line("Predicts best", _predicts_best(findings, comparison)),
        Line("In play", play),
        Line("Next step", _next_step(findings, nominal)),
    )


def also_likely(findings: Findings) -> str:
    """Beside what is missing, what probably is, too, as a sentence; empty where nothing is."""
    names = [with_odds(item) for item in named(findings, "likely")] if findings.verdict == "missing" else []
    return f"Probably also {listing(names)}." if names else ""


def cannot(comparison: Comparison, quiet: Sequence[str] = ()) -> str:
    """What a model cannot do, in a sentence: where a guess that knows nothing of the boat errs less.

    The model is the one to trust, or the best where none is. Of the acceleration, a negative R² says so; where half of
    the squared error of the predicted speed is the sensors' noise, that is told beside it. Of predictions over the
    horizon that decides, the baselines that are compared say it. Empty where nothing is worse.

    Parameters
    ----------
    comparison : of all models on the same rows
    quiet : axes that hardly move, on which no model has an acceleration to tell
    """
    by_name = {model.name: model for model in comparison.models}
    best = comparison.best.guess.model if comparison.best.guess else comparison.best.model
    own = next((by_name[name] for name in (best, CORRECTED, NOMINAL) if name in by_name), None)
    if own is None:
        return ""
    horizon = pick_horizon(list(own.rollout), comparison.best.horizon or LEAD)
    told = []
    poor = [(axis, own.acceleration.r2.of(axis)) for axis in AXES]
    known = _at_noise(own, horizon, comparison)
    named = [
        f"{axis} (R² {number(r2, 2)}{_YET * (axis in known)})"
        for axis, r2 in poor
        if isfinite(r2) and r2 < -_LEVEL and axis not in quiet
    ]
    told += [f"in the acceleration of {listing(named)}"] * bool(named)
    guesses = _guesses(comparison, horizon)
    if horizon in own.rollout and guesses:
        mine = own.rollout[horizon]
        least = {axis: min(guess.of(axis) for guess in guesses) for axis in AXES}
        # Of predictions which all run away the error is unknown, and is larger than that of a guess.
        worse = [a for a in AXES if isfinite(least[a]) and not mine.of(a) <= least[a] * (1.0 + _LEVEL)]
        told += [f"in the speeds predicted over {horizon} s of {listing(worse)}"] * bool(worse)
    name = f"The {own.name} model" if own.name in (NOMINAL, CALIBRATED, CORRECTED) else own.name
    return f"{name} errs more than a guess that knows nothing of the boat {' and '.join(told)}." if told else ""


_YET = ", yet it predicts that speed as well as the sensors tell it"


def _at_noise(model: ComparedModel, horizon: str, comparison: Comparison) -> list[str]:
    """The axes on which noise makes half of the squared error of the speed that a model predicts."""
    if comparison.noise is None or horizon not in model.rollout:
        return []
    told = model.rollout[horizon]
    return [axis for axis in AXES if told.of(axis) ** 2 <= 2.0 * comparison.noise.of(axis) ** 2]


def quiet_axes(findings: Findings) -> tuple[str, ...]:
    """The axes on which the log hardly moves beyond sensor noise."""
    return findings.identifiability.quiet_axes if findings.identifiability else ()


def _guesses(comparison: Comparison, horizon: str) -> list[RolloutRecord]:
    """Errors over a horizon of the models that know nothing of the boat."""
    return [m.rollout[horizon] for m in comparison.models if m.kind == BASELINE and horizon in m.rollout]


def recommendation(findings: Findings, comparison: Comparison) -> str:
    """Which model to trust, and why that goes with what is missing."""
    best = comparison.best
    matters = best.grounds not in (None, Grounds.NONE_BETTER)
    if not (findings.missing and best.sentence and best.model == NOMINAL) or matters:
        return f"{best.sentence} {_of_this_day(findings) if best.model == CORRECTED else ''}".strip()
    return f"{best.sentence} What is missing hardly matters on these rows."


def _of_this_day(findings: Findings) -> str:
    """What of the corrected model is the weather of its log and no part of the boat; empty where nothing is."""
    weather = [item for item in findings.added if item.effect in _WEATHER]
    symbols = listing([term.symbol for item in weather for term in item.terms if term.symbol])
    if not weather:
        return ""
    names = listing([effect_words(item) for item in weather])
    verb = "are those" if len(weather) > 1 else "is that"
    return f"{sentence_case(names)} {verb} of this log: for another day set {symbols} to 0 in model.yaml."


def repeated(findings: Findings) -> str:
    """What the search found when it was repeated without parts of the log; empty where it was not."""
    return findings.folds.in_words(bool(findings.added)) if findings.folds else ""


def opening(findings: Findings, comparison: Comparison, nominal: Vehicle | None = None) -> list[str]:
    """How the terminal begins, see `opening_parts`."""
    return [text for _, text in opening_parts(findings, comparison, nominal)]


def opening_parts(findings: Findings, comparison: Comparison, nominal: Vehicle | None = None) -> list[Line]:
    """How the terminal begins: headline, what the model cannot do, why, what changed, which to trust; bad news first.

    Where the verdict is open, the lines of the `answer` stand below the headline.
    """
    answered = [Line("answer", line.in_words) for line in answer(findings, comparison, nominal)]
    done, grown = Line("done", outcome(findings, comparison)), Line("grown", also_worse(findings, comparison))
    begins = [
        Line("headline", headline(findings, comparison)),
        Line("cannot", cannot(comparison, quiet_axes(findings))),
    ]
    why, again = Line("why", " ".join(findings.reasons)), Line("again", repeated(findings))
    trust = Line("trust", recommendation(findings, comparison))
    worse = gets_worse(findings.steps, comparison.best.horizon)
    if answered:
        parts = [*[done] * worse, *begins, *answered, why, grown, again]
    elif worse:
        parts = [done, grown, *begins, Line("likely", also_likely(findings)), why, again, trust]
    else:
        with_likely = Line("done", f"{also_likely(findings)} {done.text}".strip())
        parts = [*begins, why, with_likely, grown, again, trust]
    return [line for line in parts if line.text]


def _names_first(findings: Findings) -> str:
    """The headline that the candidates make."""
    sure, likely, rest = (named(findings, verdict) for verdict in ("missing", "likely", "possible"))
    if sure:
        return f"The model is missing {listing([effect_words(item) for item in sure])}."
    if likely:
        return f"Probably missing: {listing([with_odds(item) for item in likely])}."
    if rest:
        return "Undecided: something is missing, but this log cannot tell what."
    return "Undecided: this log cannot tell whether something is missing."


def _predicts_best(findings: Findings, comparison: Comparison) -> str:
    """Which model errs least on unseen rows, and by how much; where no number says it, what the comparison says."""
    best, steps = comparison.best, findings.steps
    led = hero(steps, best.horizon)
    rollouts = {model.name: model.rollout.get(led.horizon) for model in comparison.models}
    models = {name: error.of(led.metric) for name, error in rollouts.items() if error is not None}
    before, own = models.get(NOMINAL, float("nan")), models.get(best.model, float("nan"))
    if not best.model or not isfinite(before) or not own <= before:
        guess = "a guess that knows nothing of the boat. " * (best.grounds is Grounds.GUESS)
        told = best.sentence.replace(f"Trust {best.model}: ", f"the {best.model} model, for ", 1)
        return f"{guess}{told}" or outcome(findings, comparison) or "only the nominal model was judged."
    what, unit = led.in_words, led.unit
    if best.model != NOMINAL:
        which = f"the {best.model} model{' (model.yaml)' * (best.model == CORRECTED)}"
        less = f"{share_removed(1.0 - own / before)} less than the nominal model's {number(before, 2)} {unit}"
        doubt = _chance(findings, comparison, best.model)
        other, beside = models.get(CORRECTED, float("nan")), ""
        if other < own:
            reaches = f"model.yaml reaches {number(other, 2)} {unit}"
            by_chance = best.grounds is Grounds.CHANCE
            beside = f"; {reaches}, which may be chance" if by_chance else f"; its speeds decide, for {reaches}"
        return f"{which}, with a {what} of {number(own, 2)} {unit} on unseen rows, {less}{doubt}{beside}."
    after = models.get(CORRECTED, float("nan"))
    beside = ""
    if len(steps) > 1 and isfinite(after):
        doubt = _chance(findings, comparison)
        by_chance = best.grounds in (None, Grounds.NONE_BETTER, Grounds.CHANCE) and bool(best.horizon)
        if by_chance and after < before * (1.0 - _LEVEL):
            both = f"{number(before, 2)} {unit} of the nominal model, {number(after, 2)} {unit} of model.yaml"
            return f"none by more than chance in its speeds. The {what} on unseen rows is {both}{doubt}."
        beside = f"; model.yaml reaches {number(after, 2)} {unit}{doubt}"
    return f"the nominal model, with a {what} of {number(before, 2)} {unit} on unseen rows{beside}."


def _in_play(findings: Findings, comparison: Comparison) -> str:
    """The names in play with their odds, the surest first, and what may stand in their place."""
    force = findings.nameless
    names = _first([_with_rivals(item) for item in in_order(findings.added)], _BESIDE if force else _IN_PLAY)
    own = [item.symbol for item in findings.calibrated]
    if own:
        names.append(f"the file's own numbers, calibrated ({listing(own)})")
    perhaps = [with_odds(c) for c in in_order(findings.candidates) if c.verdict == "possible" and not c.cannot_tell]
    if force is not None and not findings.unnamed:
        learn = _LEARN * (force.of_state and not _has_network(comparison))
        if names:
            return f"{force.in_words}, which model.yaml lacks{learn}; it has {listing(names)}."
        others = f"perhaps {listing(perhaps[:_BESIDE])}; model.yaml has none of it" if perhaps else "no name"
        return f"{force.in_words}{learn}; {others}."
    if findings.unnamed:
        what = f"a {force.kind} without a name in {force.axis} that {force.acts}" if force else "a force without a name"
        terms = listing([term.form for term in findings.unnamed if force and term.axis == force.axis])
        what += f" (as {terms})" * bool(force and terms != force.follows)
        names.insert(0 if force else len(names), what)
    if names:
        return f"{listing(names)}. model.yaml has {'them' if len(names) > 1 or len(own) > 1 else 'it'}."
    if perhaps:
        return f"perhaps {listing(perhaps[:_IN_PLAY])}; model.yaml has none of it."
    if findings.rests:
        return f"no name; in {listing([rest.axis for rest in findings.rests])} a force lasts that nothing explains."
    if findings.criterion.unjudged:
        return f"nothing in {listing(findings.criterion.unjudged)} was judged."
    return "no name; model.yaml is the nominal model."


def _has_network(comparison: Comparison) -> bool:
    return any(model.kind in ("hybrid", "network") for model in comparison.models)


def _first(names: Sequence[str], most: int) -> list[str]:
    """The first of some names, and how many more there are."""
    return [*names[:most], *[f"{len(names) - most} more"] * (len(names) > most)]


def _with_rivals(item: EffectFinding) -> str:
    """A name with its odds and what the log cannot tell it from."""
    others = listing(twins(item))
    inside = ", ".join(filter(None, (odds(item), f"or {others}" * bool(others))))
    return f"{effect_words(item)} ({inside})" if inside else effect_words(item)


def _next_step(findings: Findings, nominal: Vehicle | None) -> str:
    """The one thing to do that would tell: a channel, a manoeuvre, or a line of the vehicle file or of the map."""
    unjudged = findings.criterion.unjudged
    if unjudged:
        channels = listing([_SPEEDS[axis] for axis in unjudged])
        return f"log {channels} by another sensor, or give positions: what is logged may be wrong, so none was judged."
    if findings.change is not None:
        asked = f"find out what happened at about {findings.change.when}, such as weed, a blow or a payload"
        return f"{asked}; what is told here is of the part {'since' if findings.change.since else 'before'} then."
    if findings.winds:
        return "search each log alone: each has a wind of its own, and the rest of the model is the same."
    force = findings.nameless
    if force is not None and force.sets_in is not None:
        signal, begins = force.sets_in
        what = NamelessForce(axis=force.axis, follows=signal).in_words
        which, _, when = begins.partition(" ")
        if which == "log":
            asked = f"find out what is otherwise from {begins} on, such as a payload, weed or the wind"
            return f"{asked}: {what} is there alone. Or search each log by itself."
        minute, _, log = when.partition(" ")
        place = f"minute {float(minute):g}{f' {log}' * bool(log)}"
        asked = f"find out what happened at about {place}, such as weed, a blow or a payload"
        follow = "; 'undertow adapt' tells which number changes" * (bool(signal) and float(minute) >= _RUN_IN)
        return f"{asked}: {what} sets in there{follow}."
    if force is not None and force.local:
        asked = "drive there and elsewhere once more, for a wall or a shoal may be the cause"
        return f"{asked}: {force.in_words}."
    if nominal is not None and findings.verdict == "undecided" and _drifts(findings):
        unasked = [f"{words(effect.name)} {lacks}" for effect in EFFECTS if (lacks := lacking(nominal, effect))]
        if unasked:
            return f"search again with more in the vehicle file, for {listing(unasked)}."
    for advice in findings.advice[:1]:
        why = f". It {_FIRST_REASON.split(advice.why)[0]}" if advice.why.startswith("would ") else ""
        if advice.manoeuvre == BY_OTHER_MEANS:
            return f"{advice.manoeuvre}{why}."
        asked = shlex.join(("undertow", "plan", "RUN", *advice.effects))
        return f"record this: {advice.manoeuvre.rstrip('.')}{why}. '{asked}' makes a mission of the shortest."
    added = [one for item in findings.added if nominal for one in file_numbers(item, nominal) if one.filed()]
    wrong = [(one.symbol, one.filed(), one.amount()) for one in added]
    moved = sorted(findings.calibrated, key=lambda item: -_apart(item.before, item.after))
    off = [item for item in moved if _apart(item.before, item.after) >= _TENTH]
    wrong += [(item.symbol, number(item.before), number(item.after)) for item in off]
    for symbol, filed, asked in wrong[:1]:
        return f"check {symbol} in the vehicle file: it says {filed}, this log asks for about {asked}."
    for sensor in [one for one in findings.sensors if one.verdict == "present" and one.correction != WATER][:1]:
        return f"put the {words(sensor.error)} right in the channel map, and search again."
    more = "another log" if len(findings.data.log_sha256) > 1 else "a second log"
    return f"record {more} on another day and search them together: what is true comes out again."


def _drifts(findings: Findings) -> bool:
    """Whether what is left open first acts in sway or yaw: a force without a name, damping in play, or a rest."""
    if findings.nameless is not None:
        return findings.nameless.axis in ("sway", "yaw")
    open_ones = [c for c in in_order(findings.candidates) if c.verdict in ("likely", "possible") and not c.cannot_tell]
    for first in open_ones[:1]:
        return first.family in ("hull", "coupling") and any(term.axis in ("sway", "yaw") for term in first.terms)
    return any(rest.axis in ("sway", "yaw") for rest in findings.rests)


def _apart(one: float, other: float) -> float:
    """How far two numbers are apart, as a share of the larger."""
    return abs(one - other) / max(abs(one), abs(other), 1e-300)


def _done_to(led: Hero) -> str:
    """What was done to the error that the story leads with, as the end of a sentence; it may be others that change."""
    if led.after < led.before * (1.0 - _LEVEL):
        return f"removes {share_removed(1.0 - led.after / led.before)} of the {led.in_words}"
    if led.before * (1.0 + _LEVEL) < led.after < float("inf"):
        return f"adds {percent(led.after / led.before - 1.0)} to the {led.in_words}"
    return f"changes errors of {led.horizon} s predictions"


def _changed(steps: Sequence[Step], comparison: Comparison) -> float:
    """Share by which the last step changed an error of the lead horizon, the largest of all; 1 where it runs away.

    What changes by less than a hundredth of what a guess errs does not count.
    """
    if len(steps) < 2:
        return 0.0
    horizon = hero(steps, comparison.best.horizon).horizon
    guesses = _guesses(comparison, horizon)
    shares = [0.0]
    for name in ROLLOUT_UNITS:
        before, after = steps[0].rollout(horizon).of(name), steps[-1].rollout(horizon).of(name)
        if not (isfinite(before) and before > 0.0):
            continue
        least = min((g.of(name) for g in guesses if isfinite(g.of(name))), default=0.0)
        if not abs(before - after) < _LEVEL * least:
            shares.append(abs(1.0 - after / before) if isfinite(after) else 1.0)
    return max(shares)


def _chance(findings: Findings, comparison: Comparison, model: str = CORRECTED) -> str:
    """Why the change of the lead error may be nothing, as an added clause; empty where it is more than chance."""
    led = hero(findings.steps, comparison.best.horizon)
    told = difference(comparison.differences, model, NOMINAL, "rollout", led.metric, led.horizon)
    return _CHANCE.get("" if told is None else told.verdict, "")
