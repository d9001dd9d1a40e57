"""Screens of `effects` and `explain`: the catalogue, one effect as a card, and the parts of a correction."""

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Column, Table
from rich.text import Text

from ...discovery.distillation import Distilled
from ...physics.effects import EFFECTS, Effect, Parameter
from ...physics.motion import FORCE_UNITS, Array
from ...physics.presentation import listing, number, percent, unit_text, words
from ...physics.vehicle import Vehicle
from ...physics.worlds.signatures import Signature
from .layout import Prose, bullets, glossary, number_columns, plain_table, section, stacked, text_columns, word_columns

_BLOCKS = "▁▂▃▄▅▆▇█"
_COLUMNS = 60
"""Parts of a manoeuvre that a line of blocks shows."""


def catalogue_table() -> Table:
    """Every effect with its symbols and the force that it adds, family by family."""
    columns = [*word_columns("effect"), *text_columns("symbols"), Column("force")]
    table = plain_table("Effects", "undertow effects NAME shows one of them", columns)
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
    amount = [f"{s} = {number(v)} {unit_text(_unit(effect, vehicle, s))}".strip() for s, v in found.amount.items()]
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
        glossary(said),
        Group(*lines),
        Prose(
            "u_r, v_r: velocity relative to the water; c_i: command of a thruster in -1..1; T_i: its force; t: minutes "
            "since the log began; forces and moments are positive ahead, to starboard, and turning to starboard."
        ),
        Prose(f"Hide it in a log{' once the file states that' * bool(found.assumed)}, and see it found: {line}"),
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
    unit = named[symbol].unit
    return "" if unit == "1" else unit


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
    return (
        f"{found.signal}, {_ends(found.values)} {unit}" if unit else f"{found.signal} (of full), {_ends(found.values)}"
    )


def _ends(values: Array) -> str:
    return f"{number(float(values.min()))} to {number(float(values.max()))}"


def distilled_table(found: Distilled) -> RenderableType:
    """The headline, the share explained by axis, the effects with their values, and what remains in words."""
    parts: list[RenderableType] = [Prose(found.headline, "bold")]
    if any(axis.matters for axis in found.axes):
        parts.append(_shares(found))
    if found.effects or found.unnamed:
        parts.append(_effects(found))
    parts.append(section("What remains", bullets([axis.sentence for axis in found.axes])))
    return stacked(parts)


def _shares(found: Distilled) -> Table:
    traded = "; all axes are fitted at once, and an effect may explain less of one for more of another"
    more = traded if any(axis.traded for axis in found.axes) else ""
    shares = number_columns("correction", "named", "with\npossible", "with\nunnamed", "of the rest:\nmemory")
    caption = f"along {found.seconds:.0f} s of motion{more}"
    table = plain_table("Share of the correction explained", caption, [*word_columns("axis"), *shares])
    for axis in found.axes:
        explained = (axis.named, axis.possible, axis.explained, axis.past and axis.past.memory)
        size = f"{number(axis.correction, 2)} {axis.unit}"
        table.add_row(axis.axis, size, *map(_explained, explained))
    return table


def _explained(share: float | None) -> str:
    return "none" if share is not None and share < 0.0 else percent(share, blank="-")


def _effects(found: Distilled) -> Table:
    columns = [*text_columns("effect"), *word_columns("verdict", "value", "95 % interval")]
    table = plain_table("What it holds", columns=columns)
    rows = [(words(part.effect), part.verdict, part.terms) for part in found.effects]
    rows += [(term.symbol, "unnamed", (term,)) for term in found.unnamed]
    for name, verdict, terms in rows:
        for k, term in enumerate(terms):
            ends = f"{number(term.ci95.lower)} to {number(term.ci95.upper)}" if term.ci95 else ""
            value = f"{term.symbol} {number(term.value)} {unit_text(term.unit)}".rstrip()
            if verdict == "unnamed":
                value = f"{number(term.value)} {unit_text(term.unit)}".rstrip()
            table.add_row(*map(Text, (name if k == 0 else "", verdict if k == 0 else "", value, ends)))
    return table
