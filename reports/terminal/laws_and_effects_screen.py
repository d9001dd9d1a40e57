"""Screens of `check`, `ci`, `effects`, `explain`: laws and limits, the catalogue of effects, parts of a correction."""

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Column, Table
from rich.text import Text

from ...comparison.audit import Audit
from ...comparison.error_limits import HeldLimit, HeldLimits
from ...discovery.distillation import Distilled
from ...physics.effects import EFFECTS, Effect, Parameter
from ...physics.laws.audit.base import Ruling
from ...physics.motion import FORCE_UNITS, Array
from ...physics.presentation import listing, number, percent, unit_text, words
from ...physics.vehicle import Vehicle
from ...physics.worlds.signatures import Signature
from ..wording import STATE_UNITS, range_words
from . import layout

_STYLES = {"pass": layout.GOOD, "fail": layout.BAD, "noted": layout.UNSURE, "n/a": layout.ASIDE}
_SHORT = {"share of full thrust": "full thrust", "of the rigid body's": "rigid body", "times the expected": "expected"}


def audit_screen(audit: Audit) -> list[RenderableType | None]:
    """The table of laws, and the sentences: first what is broken, what does not count, then the rest."""
    broken: dict[bool, list[str]] = {True: [], False: []}
    for r in audit.rulings:
        if r.verdict == "fail":
            often = f" ({percent(r.share)} of what was tried)" if r.share and r.share > 0 else ""
            broken[r.counts].append(f"{r.law}: {r.sentence}{often}")
    return [
        _table(audit),
        layout.section("What is broken", layout.bullets(broken[True])),
        layout.section("Noted, and does not count", layout.bullets(broken[False])),
        layout.section("What holds", layout.bullets(r.sentence for r in audit.rulings if r.verdict == "pass")),
        *map(layout.Prose, audit.notes),
    ]


def headline(audit: Audit) -> str:
    """The verdict in one or two sentences."""
    box = audit.envelope.to_dict()
    where = f"Judged for {range_words({name: box[name] for name in 'uvr'})}, from {audit.envelope_from}."
    if audit.verdict == "pass":
        return f"{audit.model} breaks no law. {where}"
    broken = listing([f"the law '{ruling.law}'" for ruling in audit.violations])
    return f"{audit.model} breaks {broken}. {where}"


def _verdict(ruling: Ruling) -> str:
    if ruling.verdict == "not applicable":
        return "n/a"
    return "noted" if ruling.verdict == "fail" and not ruling.counts else ruling.verdict


def _table(audit: Audit) -> RenderableType:
    loose = any(_verdict(r) == "noted" for r in audit.rulings)
    caption = "margin: how far the worst found is from breaking the law" + "; noted: broken, but does not count" * loose
    columns = [*layout.word_columns("law", "verdict"), *layout.number_columns("margin")]
    columns += layout.word_columns("worst case", "proof")
    rows = []
    for ruling in audit.rulings:
        verdict, proof = _verdict(ruling), "" if ruling.proof == "none" else ruling.proof
        rows.append((ruling.law, Text(verdict, style=_STYLES[verdict]), _margin(ruling), _place(ruling), proof))
    return layout.fitting(f"Laws: {audit.verdict}", caption, columns, rows, [range(5), (0, 1, 2, 4)])


def _margin(ruling: Ruling) -> str:
    if ruling.margin is None:
        return ""
    if ruling.margin < -1e100:
        return "unbounded"
    unit = _SHORT.get(ruling.unit, unit_text(ruling.unit))
    return f"{number(ruling.margin, 2)} {unit}".rstrip()


def _place(ruling: Ruling) -> str:
    found = dict(ruling.at or {})
    if "from" in found:
        return f"{found['from']:.1f} to {found['to']:.1f} s"
    return ", ".join(f"{name} {value:.2f}" for name, value in found.items() if name in STATE_UNITS)


_MOST = 3
"""Broken limits that the first sentence names: the table has all."""


def verdict_text(found: HeldLimits) -> str:
    """Whether the model holds its limits, and which it breaks, the worst first."""
    count, broken = len(found.limits), sorted(found.broken, key=_share, reverse=True)
    if not broken:
        return f"{found.model} holds {'its limit' if count == 1 else f'all {count} limits'}."
    named = [_sentence(one) for one in broken[:_MOST]]
    more = [f"{len(broken) - _MOST} more"] if len(broken) > _MOST else []
    return f"{found.model} breaks {len(broken)} of {count} limits: {listing([*named, *more])}."


def limits_table(found: HeldLimits) -> RenderableType:
    """All limits, a line each."""
    told = any(one.told for one in found.limits)
    columns = [*layout.text_columns("error", "axis"), *layout.number_columns("measured", "limit", "of it")]
    columns += [*layout.word_columns("unit", "holds"), *layout.text_columns(*[""] * told)]
    rows = []
    for one in found.limits:
        sizes = (number(one.measured), number(one.limit), percent(_share(one)) if one.limit > 0.0 else "")
        holds = Text("yes", style=layout.GOOD) if one.holds else Text("NO", style=layout.BAD)
        rows.append((what(one), one.axis, *sizes, unit_text(one.unit), holds, *[one.told] * told))
    return layout.plain_table("", "", columns, rows)


def what(one: HeldLimit) -> str:
    """What is limited, in words."""
    if one.horizon is not None:
        return f"{one.horizon} s prediction"
    return "laws broken" if one.quantity == "laws" else one.quantity


def _share(one: HeldLimit) -> float:
    return one.measured / one.limit if one.limit > 0.0 else float("inf")


def _sentence(one: HeldLimit) -> str:
    if one.quantity == "laws":
        return f"the laws of a hull ({one.told})"
    unit = unit_text(one.unit)
    return f"{what(one)} of {one.axis}, {number(one.measured)} {unit} where {number(one.limit)} {unit} are allowed"


_BLOCKS = "▁▂▃▄▅▆▇█"
_COLUMNS = 60
"""Parts of a manoeuvre that a line of blocks shows."""


def catalogue_table() -> Table:
    """Every effect with its symbols and the force that it adds, family by family."""
    columns = [*layout.word_columns("effect"), *layout.text_columns("symbols"), Column("force")]
    table = layout.plain_table("Effects", "undertow effects NAME shows one of them", columns)
    family = ""
    for effect in EFFECTS:
        if effect.family != family:
            family = effect.family
            table.add_row(Text(family, style="dim"), "", "")
        table.add_row(effect.name, ", ".join(effect.symbols), unit_text(effect.equation))
    return table


def effect_card(found: Signature, vehicle: Vehicle, asked: str) -> list[RenderableType]:
    """What one effect is, where it stands in the vehicle file, where it shows, and what it is taken for.

    Parameters
    ----------
    asked : file or name of the vehicle, for the command that hides the effect in a log
    """
    effect = found.effect
    unit = unit_text(FORCE_UNITS[found.axis])
    amount = [f"{s} = {number(v)} {_unit(effect, vehicle, s)}".strip() for s, v in found.amount.items()]
    reported = "found as the amount that is added to the file's number" if effect.added else "found as its whole value"
    said = [
        ("force", unit_text(effect.equation)),
        ("meaning", effect.meaning),
        ("symbols", "; ".join(_symbol(p) for p in effect.parameters)),
        ("in the file", f"under {_section(effect)}; {reported}"),
        ("typical", f"{', '.join(amount)} on {vehicle.name}{found.assumed and f', of {found.assumed}'}"),
        (
            "shown best by",
            f"{found.trial.text}{_when(effect)}: {number(found.size)} {unit} of {found.axis_name} force (root mean "
            f"square), {100.0 * found.apart:.0f} % of it unlike the force of any other effect",
        ),
        ("taken for", _alike(found)),
        *([("needs", f"the channels {listing(effect.channels)}")] if effect.channels else []),
        *([("needs", f"{listing(effect.requires)} in the vehicle file")] if effect.requires else []),
        *([("includes", listing(effect.includes))] if effect.includes else []),
    ]
    values = ",".join(f"{value:.4g}" for value in found.amount.values())
    line = f"undertow simulate --vehicle {asked} --effect {effect.name}={values} --out log.csv"
    of_it = f"{found.axis_name} force of it in that manoeuvre, {_ends(found.force)} {unit}:"
    lines = [Text(of_it), Text(blocks(found.force))]
    if found.signal != "time":
        lines += [Text(f"{_signal(found)} there:"), Text(blocks(found.values))]
    return [
        Text(words(effect.name), style="bold"),
        layout.glossary(said),
        Group(*lines),
        layout.Prose(
            "u_r, v_r: velocity relative to the water; c_i: command of a thruster in -1..1; T_i: its force; t: minutes "
            "since the log began; forces and moments are positive ahead, to starboard, and turning to starboard."
        ),
        layout.Prose(f"Hide it in a log{' once the file states that' * bool(found.assumed)}, and see it found: {line}"),
    ]


def blocks(values: Array, columns: int = _COLUMNS) -> str:
    """A series (n,) as a line of blocks, from its least to its largest value."""
    means = np.array([part.mean() for part in np.array_split(values, min(columns, values.size))])
    low, high = float(means.min()), float(means.max())
    if high - low <= 1e-9 * max(abs(low), abs(high), 1e-300):
        return _BLOCKS[3] * means.size
    return "".join(_BLOCKS[int(part)] for part in np.rint((means - low) / (high - low) * (len(_BLOCKS) - 1)))


def _unit(effect: Effect, vehicle: Vehicle, symbol: str) -> str:
    named = {p.symbol.replace("{thruster}", t.name): p for p in effect.parameters for t in vehicle.thrusters}
    return unit_text(named[symbol].unit)


def _symbol(parameter: Parameter) -> str:
    unit = f" [{unit_text(parameter.unit)}]" if parameter.unit != "1" else ""
    limits = ""
    if np.isfinite(parameter.upper) or np.isfinite(parameter.lower):
        low, high = (f"{x:g}" if np.isfinite(x) else "" for x in (parameter.lower, parameter.upper))
        limits = f", {low} to {high}" if low and high else f", at least {low}" if low else f", at most {high}"
    return f"{parameter.symbol}{unit}: {parameter.null:g} means absent{limits}"


def _section(effect: Effect) -> str:
    places = dict.fromkeys(p.section if p.section != "top" else p.symbol for p in effect.parameters)
    return listing([place if place != "thrusters" else "each of thrusters" for place in places])


def _alike(found: Signature) -> str:
    if not found.alike:
        return "nothing else, even in gentle driving"
    texts = [f"{name.replace('_', ' ')} ({cosine:.2f})" for name, cosine in found.alike]
    return f"{listing(texts)}: cosine between the forces in gentle driving, where only a manoeuvre tells them apart"


def _when(effect: Effect) -> str:
    """When it is driven, of an effect that grows by the minute."""
    grows = any("min" in p.unit for p in effect.parameters)
    return ", at the beginning of a log and again five minutes later, as drawn here" if grows else ""


def _signal(found: Signature) -> str:
    units = {"u": "m/s", "v": "m/s", "r": "rad/s", "du/dt": "m/s²", "dr/dt": "rad/s²", "heading": "rad"}
    unit = units.get(found.signal)
    full, unit = ("", f" {unit}") if unit else (" (of full)", "")
    return f"{found.signal}{full}, {_ends(found.values)}{unit}"


def _ends(values: Array) -> str:
    return f"{number(float(values.min()))} to {number(float(values.max()))}"


def distilled_table(found: Distilled) -> RenderableType:
    """The headline, the share explained by axis, the effects with their values, and what remains in words."""
    parts = [
        layout.Prose(found.headline, "bold"),
        _shares(found) if any(axis.matters for axis in found.axes) else None,
        _effects(found) if found.effects or found.unnamed else None,
        layout.section("What remains", layout.bullets(axis.sentence for axis in found.axes)),
    ]
    return layout.stacked(parts)


def _shares(found: Distilled) -> Table:
    traded = "; all axes are fitted at once, and an effect may explain less of one for more of another"
    more = traded if any(axis.traded for axis in found.axes) else ""
    shares = layout.number_columns("correction", "named", "with\npossible", "with\nunnamed", "of the rest:\nmemory")
    caption = f"along {found.seconds:.0f} s of motion{more}"
    rows = []
    for axis in found.axes:
        explained = (axis.named, axis.possible, axis.explained, axis.past and axis.past.memory)
        rows.append((axis.axis, f"{number(axis.correction, 2)} {axis.unit}", *map(_explained, explained)))
    columns = [*layout.word_columns("axis"), *shares]
    return layout.plain_table("Share of the correction explained", caption, columns, rows)


def _explained(share: float | None) -> str:
    return "none" if share is not None and share < 0.0 else percent(share, blank="-")


def _effects(found: Distilled) -> Table:
    columns = [*layout.text_columns("effect"), *layout.word_columns("verdict", "value", "95 % interval")]
    held = [(words(part.effect), part.verdict, part.terms) for part in found.effects]
    held += [(term.symbol, "unnamed", (term,)) for term in found.unnamed]
    rows = []
    for name, verdict, terms in held:
        for k, term in enumerate(terms):
            ends = f"{number(term.ci95.lower)} to {number(term.ci95.upper)}" if term.ci95 else ""
            amount = f"{number(term.value)} {unit_text(term.unit)}".rstrip()
            value = amount if verdict == "unnamed" else f"{term.symbol} {amount}"
            rows.append((name * (k == 0), verdict * (k == 0), value, ends))
    return layout.plain_table("What it holds", "", columns, rows)
