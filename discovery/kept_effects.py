"""What is made of a selection: the kept effects alone, polished where rollouts judge, and the steps to them."""

from collections.abc import Sequence
from functools import partial

from ..measurements.statistics.second_processor import shared
from ..physics.effects import COMMAND_OFFSET
from ..physics.possible_hulls import impossible
from ..physics.vehicle import Vehicle
from .balance.shooting import ShootingSettings
from .candidates.at_limit import limit_at
from .candidates.candidate import Kind
from .findings import Findings
from .search.floating import Search, State
from .search.output_error import polish
from .selected import base

ENOUGH_BLOCKS = 5
"""Blocks of rollouts from which anything can be sure: fewer may all agree by chance in more than one of ten logs."""
TOO_SHORT = "Undecided: this log is too short to be sure of anything."
WHY_TOO_SHORT = (
    "Rollouts with commands fill {blocks} independent blocks of it, and to be sure of anything takes {enough}; give a "
    "longer log, or several together."
)


def too_short(findings: Findings, blocks: int) -> Findings:
    """Findings of rollouts that do not say that nothing is missing where a log has too few blocks to be sure of it."""
    if findings.verdict != "nothing missing" or blocks >= ENOUGH_BLOCKS:
        return findings
    why = WHY_TOO_SHORT.format(blocks=blocks, enough=ENOUGH_BLOCKS)
    return findings.but(verdict="undecided", headline=TOO_SHORT, reasons=(why,))


def settle(search: Search, state: State, kept: Sequence[str], shooting: ShootingSettings) -> State:
    """The model with the kept effects alone, polished where rollouts judge."""
    return on_rollouts(search, search.restrict(state, kept), kept, shooting)


def with_untold(search: Search, final: State, untold: Sequence[str], shooting: ShootingSettings) -> State:
    """The kept effects with those beside them that the log cannot tell from nothing, where its unseen parts gain by it.

    What is named needs certainty, what predicts only the better guess. Where nothing is kept nothing joins it, nor does
    what stands at a limit, or what makes a hull impossible.
    """
    if not search.named(final.active):
        return final
    best = final
    for key in (key for key in untold if key not in final.active):
        active = (*best.active, key)
        more = on_rollouts(search, search.evaluate(best.vehicle, active), active, shooting)
        if more.score < best.score and _possible(search, best, more, key):
            best = more
    return best


def _possible(search: Search, before: State, after: State, key: str) -> bool:
    """Whether an effect that joins a model is one that a hull can have."""
    (candidate,) = (c for c in search.pool if c.key == key)
    nominal, found = search.nominal, after.vehicle
    if any(limit_at(p, found.value(p.symbol), nominal.value(p.symbol)) is not None for p in candidate.parameters):
        return False
    known, now = (impossible(vehicle.values, vehicle.thrusters) for vehicle in (before.vehicle, found))
    return set(now) <= set(known)


def on_rollouts(search: Search, state: State, kept: Sequence[str], shooting: ShootingSettings) -> State:
    """A model polished on its rollouts, where that betters its score; the same on the force balance."""
    form = search.balance
    symbols = [s for c in search.pool if c.fitted(kept) for s in c.symbols]
    if not symbols or form.forces:
        return state
    limits = {p.symbol: (p.lower, p.upper) for c in search.pool for p in c.parameters}
    polished = polish(form.motions, state.vehicle, symbols, shooting, blind=form.blind, limits=limits).vehicle
    return min((state, search.evaluate(polished, kept)), key=lambda s: s.score)


def steps(search: Search, final: State, corrected: Vehicle, calibrated: str) -> tuple[tuple[str | None, Vehicle], ...]:
    """Calibrate, where that is wanted, and add the kept effects one by one, the most valuable first, refitted.

    Parameters
    ----------
    final : the model with the kept effects
    corrected : the vehicle that is written, for the last step
    calibrated : name of the step that only calibrates
    """
    found: list[tuple[str | None, Vehicle]] = [(None, search.nominal)]
    effects: Sequence[str] = search.named(final.active)
    if search.of_kind(search.nuisances, Kind.NUISANCE):
        found.append((calibrated, base(search, final) if effects else corrected))
    chosen: tuple[str, ...] = ()
    while len(chosen) < len(effects) - 1:
        rest = [key for key in effects if key not in chosen]
        more = partial(_with_one_more, search, final, chosen)
        # On the force balance a model is fitted before a process would be forked.
        trials = [more(key) for key in rest] if search.balance.forces else shared(more, rest)
        best, key = min(zip(trials, rest, strict=True), key=lambda pair: pair[0].score)
        chosen = (*chosen, key)
        found.append((key, best.vehicle))
    found += [(key, corrected) for key in effects if key not in chosen]
    return tuple((label, without_offset(vehicle)) for label, vehicle in found)


def _with_one_more(search: Search, final: State, chosen: tuple[str, ...], key: str) -> State:
    return search.restrict(final, (*chosen, key))


def without_offset(vehicle: Vehicle) -> Vehicle:
    """A vehicle without what the record of the commands does wrong: the model's, not the log's."""
    return vehicle.with_values({COMMAND_OFFSET.symbol: 0.0})
