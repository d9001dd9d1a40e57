"""Findings as cards of the workbench: effects, and what the sensors do wrong."""

from collections.abc import Sequence

import numpy as np

from ..discovery.findings import Findings, SensorError
from ..discovery.found_effects import FoundEffect, FoundTerm
from ..physics.effects import BY_NAME, COMMAND_OFFSET
from ..physics.errors import RequestError
from ..physics.in_words import unit_text, words
from ..reports.page.figures.missing_force import MissingForce, best_signal, force_drawings, signal_rows
from ..reports.sureness import file_numbers, in_order, odds
from ..reports.wording import effect_words, interval, risen, twins, within
from ..residuals.models.base import VehicleModel
from .log_on_bench import LogOnBench
from .opened_log import FORCES, HORIZON
from .workbench_facts import Card, Stand

_TELLS = 0.05
"""Share of the missing force that an effect must explain by itself for a picture of it to tell anything."""
_DRAWN = 8
"""Effects that get a picture: more would not be looked at, and each takes a tenth of a second."""


def effect_cards(findings: Findings, bench: LogOnBench) -> tuple[Card, ...]:
    """A card for every effect that could be judged, the most valuable first."""
    judged = [c for c in in_order(findings.candidates) if not c.cannot_tell]
    return tuple(_effect(c, findings, bench, drawn=k < _DRAWN) for k, c in enumerate(judged))


def sensor_cards(findings: Findings) -> tuple[Card, ...]:
    """A card for everything that the sensors or their record do wrong, by the name of its correction."""
    return tuple(_sensor(s, findings) for s in findings.sensors if s.verdict != "no evidence")


def numbers_of(terms: Sequence[FoundTerm]) -> tuple[str, ...]:
    """Values with their intervals."""
    return tuple(
        f"{t.symbol} = {within(t.value, t.ci95)} {unit_text(t.unit)}".strip()
        + (f" (95 %: {interval(t.ci95)})" if t.ci95 else "")
        for t in terms
    )


def _sensor(found: SensorError, findings: Findings) -> Card:
    of_commands = found.what in (found.error, COMMAND_OFFSET.symbol)  # of no other record is a delay the twin
    alike = [effect_words(c) for c in findings.candidates if of_commands and found.error in c.indistinguishable_from]
    title = words(found.error).capitalize()
    return Card(found.correction, title, "", found.sentence, found.verdict, numbers_of(found.terms), twins=tuple(alike))


def _effect(found: FoundEffect, findings: Findings, bench: LogOnBench, *, drawn: bool) -> Card:
    tell = next((one.manoeuvre for one in findings.advice if words(found.effect) in one.why), "")
    effect = BY_NAME.get(found.effect)
    numbers = file_numbers(found, bench.inputs.vehicle) if found.verdict != "no evidence" else ()
    shown = bench if drawn and effect is not None and found.verdict != "no evidence" else None
    return Card(
        found.key,
        effect_words(found).capitalize(),
        found.equation,
        " ".join([unit_text(found.sentence), *risen(findings.steps, f"{HORIZON:g}", found)]),
        found.verdict,
        tuple(one.told() for one in numbers),
        tuple(twins(found)),
        tell,
        _picture(found, shown) if shown is not None else "",
        odds(found),
    )


def _picture(found: FoundEffect, bench: LogOnBench) -> str:
    """The force that lacks on the axis that the effect explains best, and what it alone adds there."""
    vehicle = bench.inputs.vehicle
    try:
        model = bench.model(Stand((found.key,)))
    except RequestError:
        return ""
    table = bench.rows.measured(bench.inputs.channels)
    left = bench.rows.columns(model, vehicle)
    nominal = bench.rows.columns(VehicleModel(vehicle, "nominal"), vehicle)
    drawn = []
    for axis, force in enumerate(FORCES):
        known = np.isfinite(nominal[force]) & np.isfinite(left[force])
        lacking, added = nominal[force][known], (nominal[force] - left[force])[known]
        if lacking.size and np.any(added):
            rows = signal_rows({name: values[known] for name, values in table.items()})
            signal = best_signal(rows, added, axis)
            drawn.append(MissingForce(axis, lacking, added, signal, rows[signal]))
    best = max(drawn, key=lambda one: one.told, default=None)
    return str(force_drawings([best])[0]) if best is not None and best.told >= _TELLS else ""
