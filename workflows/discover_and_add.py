"""The verbs `discover` and `add`: from logs and a vehicle to findings, scores and a falling error."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from types import NoneType

import numpy as np

from ..comparison import comparison as comparing
from ..comparison.comparison import Judged, comparison, judge_all
from ..comparison.facts import BASELINE, CALIBRATED, CORRECTED
from ..comparison.recommendation import Best, best, shares_of_error
from ..discovery.add_effects import add_effects
from ..discovery.basis import Basis, DiscoverySettings, choose_balance
from ..discovery.changed_boat import find_change, part_searched, with_change
from ..discovery.discover import Discovery, find_missing
from ..discovery.evidence.record_errors import sensor_errors
from ..discovery.findings import WATER, Findings, LogFacts, SensorError, Step, Unexplained
from ..discovery.judgement import odds
from ..discovery.run_models import resolve_names, values_of_step
from ..discovery.sensor_error_search import HiddenErrors
from ..discovery.sequential_fit import basis_for
from ..measurements.preparation.prepare import DataSet
from ..measurements.preparation.split import Fold, folds_of
from ..measurements.prepared_logs import FOLDS, INPUTS_CURE, Inputs
from ..measurements.prepared_logs import WHOLE as ALL_ROWS
from ..measurements.statistics.processors import run_in_fork, single_threaded
from ..physics.errors import RequestError, expect
from ..physics.motion import AXES, FORCE_UNITS
from ..physics.sources import WHOLE, with_sources
from ..physics.stage import COMPARING, SCORING, Say, Stage, trim_memory
from ..reports.page.outcome import headline as verdict_in_words
from ..reports.sureness import source_marks
from ..reports.terminal.progress import SHOWN, showing
from ..residuals.models.base import VehicleModel
from ..residuals.scores import Errors, evaluate_all
from ..residuals.series import series
from .inputs import still_unproven
from .run_folder.write import Run

MATERIAL = 0.02
"""Share of the nominal model's error by which another model must err less to be written in its place."""
References = tuple[list[Judged], list[str]]
"""The models that are always compared, the nominal one first, judged, and sentences on how they came to be."""


@showing
@single_threaded
def discover(
    inputs: Inputs,
    settings: DiscoverySettings | None = None,
    *,
    progress: Say | None = SHOWN,
    basis: Basis | None = None,
) -> Run:
    """Name the physical effects that the vehicle model misses in the logs, add them one by one, and score each step.

    Parameters
    ----------
    inputs : logs and nominal vehicle, see `read_inputs`
    settings : of the search, its seed among them
    progress : called with lines about the work, shown where nothing is said; None for silence
    basis : what judges these inputs, where it was chosen ahead, see `chosen_ahead`

    Raises
    ------
    RequestError
        when a log is too short, or a solver fails.
    """
    chosen = settings or DiscoverySettings()
    expect("discover: inputs", inputs, Inputs, INPUTS_CURE)
    expect("discover: settings", chosen, DiscoverySettings, "undertow.DiscoverySettings(...) makes them")
    trim_memory()
    inputs = inputs.whole()
    basis = basis or choose_balance(inputs.fitting, inputs.vehicle, chosen)
    chosen = basis.settings
    # Where one part of the logs judges, another cannot be taken away.
    change = find_change(basis, progress or _quiet) if inputs.parts.judge in ALL_ROWS else None
    if change is not None:
        (progress or _quiet)(change.in_words)
        inputs = part_searched(inputs, change)
        basis = choose_balance(inputs.fitting, inputs.vehicle, settings or DiscoverySettings())
        chosen = basis.settings
    inputs, folds = _in_folds(inputs, basis)
    with run_in_fork(partial(references, inputs, basis, folds)) as known:
        found = find_missing(inputs.fitting, inputs.vehicle, chosen, progress, basis)
        if change is not None:
            found = replace(found, findings=with_change(found.findings, change))
        trim_memory()
        if found.basis.uses_rollouts == basis.uses_rollouts:
            return assess(inputs, found, chosen, known, progress, earned=True)
    with run_in_fork(partial(references, inputs, found.basis, folds)) as known:  # calibrated on rollouts, too
        return assess(inputs, found, chosen, known, progress, earned=True)


def _quiet(text: str) -> None:
    """Say nothing."""


@single_threaded
def chosen_ahead(inputs: Inputs, settings: DiscoverySettings) -> Basis | None:
    """The basis of inputs that are not checked yet; None where there is none, which `discover` says of checked ones.

    A refusal by the checks waits for it, some tenths of a second.
    """
    inputs = inputs.whole()
    try:
        return choose_balance(inputs.fitting, inputs.vehicle, settings)
    except Exception:  # whatever comes of a broken log
        return None


@showing
def add(
    effects: Sequence[str],
    inputs: Inputs,
    settings: DiscoverySettings | None = None,
    findings: Findings | None = None,
    *,
    progress: Say | None = SHOWN,
) -> Run:
    """Add effects by name to the nominal model, fit them together, and score before and after on held-out data.

    Parameters
    ----------
    effects : names of the catalogue (`thruster_asymmetry[port]` chooses the thruster), or terms such as `yaw:u|r|`
    settings : of the run to which they are added, such as `run.settings`: with `refit` the model's own numbers are
        fitted beside the effects
    findings : of that run, such as `run.findings`: what its model has is added with the numbers of the run, so that all
        of it is that model; what they are not certain of is not called missing
    progress : called with lines about the work, shown where nothing is said; None for silence

    Raises
    ------
    RequestError
        for an unknown effect, naming the nearest; for the findings of a run of other logs.
    """
    chosen = settings or DiscoverySettings()
    expect("add: settings", chosen, DiscoverySettings, "give those of a run, as run.settings")
    expect("add: findings", findings, (Findings, NoneType), "give those of a run, as run.findings")
    expect("add: effects", effects, (list, tuple), 'give a list of names, such as ["surge_quadratic_damping"]')
    expect("add: inputs", inputs, Inputs, INPUTS_CURE)
    inputs = inputs.whole()
    change = findings.change if findings is not None and inputs.parts.judge in ALL_ROWS else None
    inputs = part_searched(inputs, change)
    findings = _of_these_logs(findings, inputs)
    hidden = HiddenErrors.of_findings(findings.sensors, list(inputs.starts)) if findings is not None else None
    fitting = [hidden.corrected(motion) for motion in inputs.fitting] if hidden is not None else inputs.fitting
    basis = basis_for(fitting, inputs.vehicle, chosen, findings)
    inputs, folds = _in_folds(inputs, basis)
    names = resolve_names(findings, effects)
    found = add_effects(fitting, inputs.vehicle, names, chosen, basis, findings)
    if hidden is not None:
        told = {sensor.correction for sensor in found.findings.sensors}
        more = [sensor for sensor in hidden.findings if sensor.correction not in told]
        found = replace(found, hidden=hidden, findings=found.findings.but(sensors=(*more, *found.findings.sensors)))
    if change is not None:
        found = replace(found, findings=with_change(found.findings, change))
    run = assess(inputs, found, basis.settings, partial(references, inputs, basis, folds), progress)
    return replace(run, verb=("add", *effects))


def _of_these_logs(findings: Findings | None, inputs: Inputs) -> Findings | None:
    """The findings of a run of these logs; without numbers and sensors where it read them otherwise.

    Raises
    ------
    RequestError
        for the findings of a run of other logs, as far as their content is known.
    """
    if findings is None:
        return None
    own, known = findings.data.log_sha256, [digest for digest in inputs.digests if digest]
    if own and known and sorted(own) != sorted(known):
        raise RequestError(
            f"add: findings: expected those of a run of {inputs.log_names}, got those of a run of other logs (their "
            "SHA-256 differ), whose numbers these logs do not have; leave findings out, and every number is fitted "
            "to these logs"
        )
    rows = sum(part.rows for part in _weak(inputs))
    return findings if findings.data.rows in (None, rows) else findings.but(steps=(), sensors=())


def _in_folds(inputs: Inputs, basis: Basis) -> tuple[Inputs, tuple[Fold, ...]]:
    """The judged rows cut where folds begin and end, and the folds; none where a part of the log judges."""
    if inputs.parts.judge != FOLDS:
        return inputs, ()
    folds = folds_of(basis.forces.motions)
    return inputs.in_folds(folds), folds


def references(inputs: Inputs, basis: Basis, folds: Sequence[Fold] = ()) -> References:
    """The nominal and the calibrated model and the baselines on the judged rows, and before the laws of a hull.

    Parameters
    ----------
    inputs : the prepared logs, and the part that judges
    basis : what judges the discovery
    folds : parts of the logs without each of which the calibrated model is fitted too
    """
    models, notes = comparing.reference_models(inputs, basis=basis, folds=folds)
    return judge_all(models, inputs.parts), notes


@single_threaded
def assess(
    inputs: Inputs,
    found: Discovery,
    settings: DiscoverySettings,
    known: Callable[[], References],
    progress: Say | None = None,
    *,
    earned: bool = False,
) -> Run:
    """Score every step of a discovery on held-out data, and find where the models fail.

    Parameters
    ----------
    known : gives the nominal and the calibrated model and the baselines, judged
    earned : the model is written that errs least on rows that it did not see, be it the nominal or the calibrated one
    """
    given, taken, before = inputs, found, known
    if found.hidden is not None:  # a vehicle that was found at the origin is judged there
        inputs = inputs.mapped(found.hidden.corrected)
        known = partial(references, inputs, found.basis, _folds(inputs, found))
    how = f"identified by undertow from {WHOLE if _folds(inputs, found) else ''}{inputs.log_names}"
    found = replace(found, corrected=with_sources(found.nominal, found.corrected, how, source_marks(found.findings)))
    if progress is not None:
        progress(Stage("scoring every step on held-out data", SCORING))
    models = _models(found, _folds(inputs, found))
    last = models[-1] if len(models) > 1 else VehicleModel(models[0].vehicle, CORRECTED, "symbolic")
    corrects = [] if last.vehicle == inputs.vehicle else [last]
    between = [model for model in models[1:] if model not in corrects]
    here, there = between[::2], between[1::2]

    def apart() -> tuple[list[Judged], list[Errors]]:
        return judge_all(corrects, inputs.parts), evaluate_all(there, inputs.parts.judged)

    with run_in_fork(apart) as judged_apart:
        band = comparing.band_of(models[-1], inputs.parts)
        table = series(models[0], models[-1], inputs.parts, inputs.channels, band)
        fails = comparing.where_ends_fail(table, models[0], last, inputs.parts)
        errors = dict(zip(here, evaluate_all(here, inputs.parts.judged), strict=True))
        own, found_there = judged_apart()
    errors |= zip(there, found_there, strict=True)
    trim_memory()
    if progress is not None:
        what = "comparing with the calibrated model and baselines, and judging by the laws of a hull"
        progress(Stage(what, COMPARING))
    (nominal, *others), notes = known()
    trim_memory()
    named = bool(found.findings.missing or found.findings.likely)
    better = _predicts_better(next(iter(own), None), nominal, others, inputs, named) if earned else None
    if better is not None:
        again = before if found.hidden is not None else lambda: ([nominal, *others], notes)
        return assess(given, _writing(taken, better), settings, again, progress)
    sure = any(effect.verdict == "missing" for effect in found.findings.added)
    corrected = replace(own[0] if own else nominal.called(last), sure=sure)
    assert corrected.audit is not None, "the laws judge all models but baselines"
    errors |= {models[0]: nominal.errors} | dict.fromkeys(corrects, corrected.errors)
    scored = [errors[model] for model in models]
    told = zip(found.steps, scored, (None, *scored[:-1]), strict=True)
    scored_steps = [comparing.score_step(now, *_added(label), earlier) for (label, _), now, earlier in told]
    steps = (scored_steps[0], *(_with_models(step, found, k) for k, step in enumerate(scored_steps[1:], start=1)))
    baselines = [other for other in others if other.model.kind == BASELINE]
    judged = [nominal, *(other for other in others if other not in baselines), corrected, *baselines]
    compared = comparison(judged, inputs, table, fails, notes=notes, band=band)
    compared = compared.but(warnings=still_unproven(inputs.warnings, [corrected], baselines))
    data = LogFacts(
        rows=sum(part.rows for part in _weak(inputs)),
        seconds=sum(part.seconds for part in _weak(inputs)),
        split=_split_of(inputs, found),
        unexplained=_unexplained(found),
        notes=(*inputs.notes, *found.notes, *_leftovers(found)),
        log_sha256=tuple(digest for digest in inputs.digests if digest),
    )
    folds = found.findings.folds
    if folds is not None and _folds(inputs, found):
        folds = folds.but(models=found.unseen.recorded(found.nominal, list(inputs.starts)))
    sensors = _sensors(found.findings.sensors, inputs)
    headline = verdict_in_words(found.findings.but(steps=steps, sensors=sensors), compared)
    if found.findings.missing and compared.best.horizon and not compared.best.model:
        headline = f"{headline.removesuffix('.')}; yet no model here predicts these rows better than a guess."
    findings = found.findings.but(
        folds=folds,
        steps=steps,
        failures=tuple(place for place in compared.failures if place.model == models[0].name),
        data=data,
        headline=f"From a broken log: {headline}" if inputs.broken else headline,
        warnings=compared.warnings,
        sensors=sensors,
    )
    fitted = next((j.model for j in others if j.name == CALIBRATED and isinstance(j.model, VehicleModel)), None)
    vehicle = fitted.vehicle if fitted else None
    return Run(inputs, found, findings, compared, table, settings, corrected.audit, calibrated=vehicle)


def _weak(inputs: Inputs) -> tuple[DataSet, ...]:
    """What was looked at: all of the logs that may be fitted, and what is kept aside."""
    return inputs.weak.train, inputs.weak.validation, inputs.weak.test


def _predicts_better(
    corrected: Judged | None, nominal: Judged, others: Sequence[Judged], inputs: Inputs, named: bool
) -> Judged | None:
    """The model that adds nothing and is to be written in the place of the corrected one, if any is.

    What is named has to be worse on rows that no model saw, materially and by more than chance. What has no sure name
    has to be materially better, and to keep the laws that the nominal model keeps, or it only follows this log: of
    models that predict as well the one with fewer guesses holds elsewhere. So do the numbers of the file, unless others
    are better, materially and by more than chance. Material is what part of the nominal model's error it is: a ratio of
    two errors near nothing says nothing.

    Parameters
    ----------
    corrected : None for one that is the nominal model itself
    named : an effect of the corrected model is missing or likely
    """
    velocity = np.concatenate([motion.velocity for motion in inputs.parts.judged.motions])
    motion = (velocity**2).mean(axis=0)
    adding_nothing = [nominal, *(other for other in others if other.name == CALIBRATED)]
    every = adding_nothing if corrected is None else [*adding_nothing, corrected]
    shares = np.sqrt(shares_of_error([judged.errors for judged in every], motion)).tolist()
    least = min(shares[: len(adding_nothing)])
    if corrected is not None and named:
        rival = adding_nothing[shares.index(least)]
        margins = _of((corrected, rival)).margins  # none where the rows are too few to be sure
        surely = not margins or np.isinf(shares[-1]) or margins[0].verdict == "better"
        return rival if surely and shares[-1] > least + MATERIAL else None
    if corrected is not None and shares[-1] <= least - MATERIAL and not _breaks(corrected, nominal):
        return None
    surest = _of(adding_nothing)
    if surest.model == CALIBRATED and shares[1] <= shares[0] - MATERIAL:
        return adding_nothing[1]
    return None if corrected is None else nominal


def _of(models: Sequence[Judged]) -> Best:
    """Which of some models to trust, and how the others compare with the first."""
    return best([(one.model, one.errors, one.audit) for one in models])


def _breaks(model: Judged, nominal: Judged) -> set[str]:
    """The laws that a model breaks and the nominal one keeps."""
    broken, known = ({r.law for r in one.audit.violations} if one.audit else set() for one in (model, nominal))
    return broken - known


def _writing(found: Discovery, better: Judged) -> Discovery:
    """The same discovery that writes another model."""
    model = better.model
    assert isinstance(model, VehicleModel), "the nominal and the calibrated model are vehicles"
    nominal = model.vehicle == found.nominal
    what = "nominal model" if nominal else "file's model with its own numbers fitted"
    told = "On rows that no model saw, nothing lawful that was tried predicts speeds materially better than"
    why = f"{told} the {what}, and by more than chance."
    return found.writing(model.vehicle, () if nominal else [vehicle for _, vehicle in model.without_folds], why)


def _split_of(inputs: Inputs, found: Discovery) -> str:
    """How the log was divided, in words."""
    if not _folds(inputs, found):
        return f"chronological {'/'.join(f'{100 * s:.0f}' for s in inputs.weak.train.recipe.shares)}"
    return f"{len(found.unseen.folds)} folds, each judged by models that were searched and fitted without it"


def _sensors(own: Sequence[SensorError], inputs: Inputs) -> tuple[SensorError, ...]:
    """What the forces tell of the sensors, and what the records do that does not contradict it."""
    told = {sensor.what for sensor in own if sensor.verdict == "present"}
    known = {(sensor.what, sensor.sentence) for sensor in own}  # of a search to which something is added
    compared = [sensor for sensor in sensor_errors(inputs.sensors) if (sensor.what, sensor.sentence) not in known]
    found = (*own, *(s for s in compared if s.verdict != "no evidence" or s.what not in told))
    return tuple(s if s.correction == WATER else s.but(confidence=odds().sensors[s.verdict]) for s in found)


def _added(label: str | None) -> tuple[str | None, str | None]:
    """What a step added, and to which thruster where it concerns one: "thruster_asymmetry[port]" is two facts."""
    effect, _, thruster = ("", "", "") if label is None else label.rstrip("]").partition("[")
    return effect or None, thruster or None


def _with_models(step: Step, found: Discovery, number: int) -> Step:
    """A step with the numbers of its models, from which they can be made again."""
    nominal, vehicle = found.nominal, found.steps[number][1]
    apart = found.unseen.steps[number - 1] if found.unseen.steps else ()
    unseen = tuple(values_of_step(one, nominal) for one in apart)
    return step.but(values=values_of_step(vehicle, nominal), unseen=unseen)


def _unexplained(found: Discovery) -> dict[str, Unexplained]:
    """Force that the corrected model leaves on each axis, beside what sensor noise alone would leave."""
    rows = zip(AXES, found.force_error, found.noise_error, FORCE_UNITS, strict=True)
    return {axis: Unexplained(force=float(f), noise=float(n), unit=unit) for axis, f, n, unit in rows}


def _leftovers(found: Discovery) -> list[str]:
    """Sentences on the axes where much more force is left than sensor noise and the material share explain."""
    scale = found.findings.criterion.force_scale
    if found.findings.criterion.unit[AXES[0]] != FORCE_UNITS[0]:
        return []  # judged on rollouts; the notes tell what the force balance leaves
    return [
        f"{axis}: {f:.2g} {unit} (root mean square) stay unexplained, {n:.2g} {unit} of it sensor noise"
        for axis, f, n, unit in zip(AXES, found.force_error, found.noise_error, FORCE_UNITS, strict=True)
        if f > max(2.0 * n, 0.05 * scale[axis])
    ]


def _folds(inputs: Inputs, found: Discovery) -> tuple[Fold, ...]:
    """The folds that judge; none where a part of the log does."""
    return found.unseen.folds if inputs.parts.judge == FOLDS else ()


def _models(found: Discovery, folds: Sequence[Fold]) -> list[VehicleModel]:
    """The vehicle after each step as a model: nominal, the ones between, corrected, with those that saw no fold."""
    last = len(found.steps) - 1
    terms = [term for c in found.findings.candidates for term in c.terms if term.in_model is not None]
    fitted = len(terms) + len(found.findings.unnamed) + len(found.findings.calibrated)
    models = [VehicleModel(found.nominal, "nominal", "physics")]
    for k, (label, vehicle) in enumerate(found.steps[1:], start=1):
        apart = tuple(zip(folds, found.unseen.steps[k - 1], strict=True)) if folds else ()
        name, size = (CORRECTED, fitted) if k == last else (f"+ {label}", 0)
        models.append(VehicleModel(vehicle, name, "symbolic", size, unseen=apart))
    return models
