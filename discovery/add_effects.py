"""Effects that somebody chose by name, added in the order given, fitted together and judged like those found."""

from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches

import numpy as np

from ..measurements.preparation.held_out import folds_of
from ..measurements.statistics.single_threaded import single_threaded
from ..physics.effects import BY_NAME, effect_named
from ..physics.errors import RequestError
from ..physics.motion import Motion
from ..physics.vehicle import Vehicle
from .balance.rollout_test import rollouts_object
from .basis import Basis, choose
from .candidates.candidate import Candidate, candidates, measurable, part_by_sight
from .candidates.nuisance import command_timing
from .candidates.unnamed_terms import term_candidate
from .discover import Discovery
from .evidence.disagreements import disagreements
from .evidence.record_errors import record_errors
from .evidence.verdicts import Grounds, conclude
from .evidence.weighing import modest, weigh
from .fold_findings import Folds
from .fold_models import models_of_given
from .kept_effects import on_rollouts, without_offset
from .lawful.passivity import lawful_model
from .search.bootstrap import intervals
from .search.floating import Search, State
from .selection import slender
from .settings import DiscoverySettings

_KEPT = "the nominal model's own parameters stay as its file has them: none is calibrated beside the effects"


@single_threaded
def add_effects(
    motions: Sequence[Motion],
    nominal: Vehicle,
    names: Sequence[str],
    settings: DiscoverySettings,
    basis: Basis | None = None,
) -> Discovery:
    """Add effects in the order given, all fitted together under their physical limits and the law of dissipation.

    Where the force balance errs by more than white noise, they are fitted to open-loop rollouts, as in discovery. The
    nominal model's own parameters stay as they are, whatever `settings.refit` says.

    Parameters
    ----------
    names : effects of the catalogue, `effect[thruster]` to choose a thruster, or unnamed terms `axis:form`
    basis : what judges these motions of this model under these settings, where it was chosen before

    Raises
    ------
    RequestError
        for an unknown effect or thruster, an effect given twice, one whose channels a log lacks, one that a field log
        cannot show because its compass is not trusted, or none at all.
    """
    if not names:
        raise RequestError("add: expected at least one effect by name, for example surge_quadratic_damping")
    for name in names:
        effect = BY_NAME.get(name)
        if effect is not None and effect not in measurable(motions):
            raise RequestError(f"add {name}: expected the channels {' and '.join(effect.channels)} in every log")
    groups = [_candidates(name, nominal) for name in names]
    if len(set(names)) < len(names):
        raise RequestError(f"add: an effect is given twice in {', '.join(names)}; give each once")
    basis = basis or choose(motions, nominal, settings)
    return _add(basis, _visible(basis, names, groups) if basis.rolls else groups)


def _visible(basis: Basis, names: Sequence[str], groups: Sequence[list[Candidate]]) -> list[list[Candidate]]:
    """The candidates of each name, as rollouts can judge them."""
    seen = []
    for name, group in zip(names, groups, strict=True):
        visible, unseen = part_by_sight(slender(group, basis.nominal), basis.blind)
        if unseen:
            raise RequestError(
                f"add {name}: expected a log that shows forces in sway, but {'; '.join(basis.notes)}; leave {name} "
                "out, or give logs with straight runs on several headings and a compass that is right"
            )
        seen.append(visible)
    return seen


def _add(basis: Basis, groups: Sequence[list[Candidate]]) -> Discovery:
    """Fit the effects in the order given, then together, then under the laws."""
    nominal, settings, motions, form = basis.nominal, basis.settings, basis.motions, basis.balance()
    notes = (*basis.told, _KEPT)
    pool = list(dict.fromkeys(candidate for group in groups for candidate in group))
    if not basis.forces.claimed:
        pool.insert(0, command_timing(motions))
    search = Search(form, nominal, pool, replace(settings.search, refinements=6))
    state = search.evaluate(nominal, ())
    steps: list[tuple[str | None, Vehicle]] = [(None, nominal)]
    for group in groups:
        state = min((_with(search, state, candidate) for candidate in group), key=lambda s: s.score)
        steps.append((state.active[-1], without_offset(state.vehicle)))
    state = search.reshape(state)
    if basis.rolls:
        form = form.refreshed(state.vehicle)
        search = Search(form, nominal, pool, search.settings)
        state = search.evaluate(state.vehicle, state.active)
        state = search.reshape(on_rollouts(search, state, state.active, settings.shooting))
    evidence = weigh(search, state, settings.seed)
    linear, scores = search.linearise(state.vehicle, state.active, state.fit.in_sample)
    chosen = [linear.options[key][0] for key in state.active]
    lawful = lawful_model(motions, scores, chosen, nominal, f"{nominal.name}, corrected")
    corrected = lawful.vehicle
    steps[-1] = (steps[-1][0], corrected)
    error, noise, by = np.sqrt(state.fit.held_out), search.noise_error, ""
    if basis.rolls:
        weak = basis.cleared_forces()
        error = np.sqrt((weak.balance(corrected) ** 2).mean(axis=0))
        noise, by = Search(weak, nominal, (), settings.search).noise_error, ", fitted to open-loop rollouts"
        evidence = modest(evidence, form)
        notes = (*notes, *disagreements(form, nominal, corrected))
        if rollouts_object(form.squares(nominal), form.squares(corrected), form.overlap):
            notes = (*notes, "open-loop rollouts get worse with these effects than they are without any")
    told = intervals(form, scores, pool, chosen, state.vehicle, settings.seed)
    order = [label for label, _ in steps[1:]]
    added = [e for e in evidence if e.selected]
    sure = [e.key for e in added if e.sure]
    findings = conclude(Grounds(search, lawful, corrected, added, told, sure, order))
    sensors = record_errors(search, state.vehicle, state.active, told)
    unseen = models_of_given(search, folds_of(basis.forces.motions), steps, lawful.passivity.envelope)
    findings = findings.but(folds=Folds(count=len(unseen.folds)))
    findings = findings.but(headline=f"Added by name: {', '.join(str(label) for label in order)}{by}.", sensors=sensors)
    return Discovery(nominal, corrected, tuple(steps), findings, error, noise, basis, unseen, notes)


def _with(search: Search, state: State, candidate: Candidate) -> State:
    """The state with a candidate added in its best shape."""
    linear, scores = search.linearise(state.vehicle, state.active, state.fit.in_sample)
    now = {key: linear.options[key][0] for key in state.active}
    present = [option for option in linear.options[candidate.key] if option.present]
    best = min(present, key=lambda option: search.quick(scores, {**now, candidate.key: option}))
    return search.apply(state, now, {**now, candidate.key: best}, scores)


def _candidates(name: str, vehicle: Vehicle) -> list[Candidate]:
    """The candidates that a name means: one, or one for each thruster."""
    if ":" in name:
        axis = name.split(":", 1)[0]
        if axis not in ("surge", "sway", "yaw"):
            raise RequestError(f"term {name!r}: expected surge:, sway: or yaw: before the form, for example yaw:u|r|")
        return [term_candidate(name, vehicle)]
    effect = effect_named(name.split("[")[0])
    found = [c for c in candidates(vehicle) if c.effect is effect and ("[" not in name or c.key == name)]
    if not found:
        keys = [c.key for c in candidates(vehicle)]
        near = get_close_matches(name, keys, n=1, cutoff=0.0)
        raise RequestError(f"unknown effect {name!r} for {vehicle.name}: did you mean {near[0]!r}?")
    return found
