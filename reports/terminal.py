"""The same findings as tables for the terminal: readable at 80 columns, plain when piped."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich import box
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from .wording import ACCELERATION_UNITS, AXES, ROLLOUT_UNITS, number, percent, pick_horizon, unit_text, words

VERDICT_STYLES = {"missing": "bold cyan", "possible": "yellow", "no evidence": "dim"}


def steps_table(findings: Mapping[str, Any]) -> Table:
    """The error falling: one row per added effect, acceleration and rollout error per axis on held-out data.

    Parameters
    ----------
    findings : mapping
        The content of `findings.json`.
    """
    steps = findings["steps"]
    horizon = pick_horizon([key for step in steps for key in step["rollout_rmse"]])
    table = _table(f"Error on held-out data: acceleration (acc.) and {horizon} s predictions")
    table.collapse_padding = True
    table.add_column("effect added", min_width=12)
    for axis in AXES:
        table.add_column(f"{axis}\nacc.\n{unit_text(ACCELERATION_UNITS[axis])}", justify="right", no_wrap=True)
    for axis in (*AXES, "position"):
        heading = f"{axis.replace('position', 'pos.')}\n{horizon} s\n{ROLLOUT_UNITS[axis]}"
        table.add_column(heading, justify="right", no_wrap=True)
    for index, step in enumerate(steps):
        added = step.get("added")
        rollout = step["rollout_rmse"].get(horizon) or {}
        style = "red" if index == 0 else "bold cyan" if index == len(steps) - 1 else ""
        cells = [number(step["acceleration_rmse"].get(axis)) for axis in AXES]
        cells += [number(rollout.get(axis)) for axis in (*AXES, "position")]
        table.add_row(Text(f"+ {words(str(added))}" if added else "nominal model"), *cells, style=style)
    return table


def candidates_table(findings: Mapping[str, Any], *, most: int = 12) -> Table:
    """The `most` best-ranked effects with verdict, value and 95 % interval, error removed and confidence."""
    candidates = findings["candidates"]
    shown = candidates[:most]
    rest = len(candidates) - len(shown)
    table = _table("Effects, best first", caption=f"and {rest} more in findings.json" if rest else "")
    table.add_column("effect", min_width=14)
    table.add_column("verdict", no_wrap=True)
    table.add_column("value (95 %)")
    table.add_column("error\nremoved", justify="right", no_wrap=True)
    table.add_column("sure", justify="right", no_wrap=True)
    for item in shown:
        verdict = str(item["verdict"])
        values = "\n".join(_value(term) for term in item.get("terms") or []) if verdict != "no evidence" else ""
        twins = [words(str(name)) for name in item.get("indistinguishable_from") or []]
        effect = words(str(item["effect"])) + (f"\n(or {', '.join(twins)})" if twins else "")
        style = VERDICT_STYLES.get(verdict, "")
        table.add_row(
            Text(effect),
            Text(verdict, style=style),
            Text(values),
            percent(item.get("error_drop")),
            percent(item.get("confidence")),
        )
    return table


def failures_table(failures: Mapping[str, Any] | Sequence[Mapping[str, Any]]) -> Table:
    """Where the models fail: the content of `comparison.json` (or `findings.json`), or its list of failures."""
    places = (failures.get("failures") or []) if isinstance(failures, Mapping) else failures
    table = _table("Where it fails", caption="" if places else "the error is spread evenly: no regime stands out")
    table.show_header = bool(places)
    table.add_column("model", no_wrap=True)
    table.add_column("where")
    table.add_column("axis", no_wrap=True)
    table.add_column("share of\nerror", justify="right", no_wrap=True)
    table.add_column("share of\ntime", justify="right", no_wrap=True)
    table.add_column("error\nthere", justify="right", no_wrap=True)
    for place in places:
        table.add_row(
            Text(str(place.get("model", "nominal"))),
            Text(str(place.get("where", ""))),
            Text(str(place.get("axis", ""))),
            percent(place.get("share_of_error")),
            percent(place.get("share_of_rows"), blank=""),
            Text(f"{number(place['rmse'], 2)} {unit_text(str(place.get('unit', '')))}" if "rmse" in place else ""),
        )
    return table


def comparison_table(comparison: Mapping[str, Any]) -> Table:
    """All compared models: one column each, acceleration and rollout errors by axis and horizon below one another."""
    models = comparison["models"]
    table = _table(f"Models on the {comparison.get('split', 'held-out')} part", caption="root mean square errors")
    table.add_column("error", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    for model in models:
        table.add_column(Text(str(model["name"])), justify="right")
    for axis in AXES:
        cells = [number(((model.get("acceleration") or {}).get("rmse") or {}).get(axis)) for model in models]
        table.add_row(f"{axis} acceleration", unit_text(ACCELERATION_UNITS[axis]), *cells, end_section=axis == "yaw")
    horizons = sorted({key for model in models for key in model.get("rollout") or {}}, key=float)
    for horizon in horizons:
        errors = [(model.get("rollout") or {}).get(horizon) or {} for model in models]
        for axis in (*AXES, "position"):
            last = axis == "position"
            cells = [number(error.get(axis)) for error in errors]
            table.add_row(f"{horizon} s {axis}", ROLLOUT_UNITS[axis], *cells, end_section=last)
        if any(error.get("diverged") for error in errors):
            cells = [f"{error.get('diverged', 0)} of {error.get('starts', '?')}" for error in errors]
            table.add_row(f"{horizon} s diverged", "", *cells, end_section=True)
    table.add_row("laws of energy", "", *(Text(str(model.get("audit", "not run"))) for model in models))
    return table


def inspection_table(inspection: Mapping[str, Any]) -> RenderableType:
    """An inspection (`Inspection.to_dict()`, or its JSON): channels, other records, then the facts and the plan.

    Parameters
    ----------
    inspection : mapping
        Lists of records become tables, mappings and everything else rows of facts.
    """
    facts = _table("The log, and what undertow would do with it")
    facts.show_header = False
    facts.add_column("", no_wrap=True, style="bold")
    facts.add_column("")
    tables: list[RenderableType] = []
    for name, value in inspection.items():
        if name == "channels" and _is_records(value):
            tables.append(_channels(value))
        elif _is_records(value) and all("sentence" in item for item in value):
            facts.add_row(Text(words(str(name))), Text("\n".join(str(item["sentence"]) for item in value)))
        elif _is_records(value):
            tables.append(_records(words(str(name)), value))
        elif isinstance(value, Mapping):
            for key, inner in value.items():
                facts.add_row(Text(f"{words(str(name))}: {words(str(key))}"), Text(_plain(inner)))
        elif name != "schema" and value not in (None, "", [], ()):
            facts.add_row(Text(words(str(name))), Text(_plain(value)))
    tables += [facts] if facts.rows else []
    return Group(*(part for index, table in enumerate(tables) for part in ([Text(), table] if index else [table])))


def _channels(channels: Sequence[Mapping[str, Any]]) -> Table:
    table = _table("Channels")
    table.add_column("channel", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    for name in ("rows", "rate Hz", "gaps", "longest\ngap s", "smallest", "largest", "noise"):
        table.add_column(name, justify="right", no_wrap=True)
    keys = ("count", "rate", "gaps", "longest_gap", "minimum", "maximum", "noise")
    for channel in channels:
        cells = [number(channel.get(key), blank="") for key in keys]
        table.add_row(Text(str(channel.get("name"))), Text(str(channel.get("unit", ""))), *cells)
    return table


def _is_records(value: Any) -> bool:
    return isinstance(value, list | tuple) and bool(value) and all(isinstance(item, Mapping) for item in value)


def _table(title: str, caption: str = "") -> Table:
    return Table(
        title=Text(title, style="bold"),
        caption=Text(caption, style="dim") if caption else None,
        box=box.SIMPLE_HEAD,
        padding=(0, 1),
        pad_edge=False,
        show_edge=False,
        title_justify="left",
        caption_justify="left",
    )


def _records(title: str, records: Sequence[Mapping[str, Any]]) -> Table:
    table = _table(title)
    names = list(dict.fromkeys(str(name) for record in records for name in record))
    for name in names:
        is_number = all(isinstance(record.get(name), int | float) for record in records)
        table.add_column(Text(words(name)), justify="right" if is_number else "left")
    for record in records:
        table.add_row(*(Text(_plain(record.get(name, ""))) for name in names))
    return table


def _plain(value: Any) -> str:
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: ""}[value]
    if isinstance(value, int | float):
        return number(value, 4)
    if isinstance(value, Mapping):
        return ", ".join(f"{words(str(name))} {_plain(inner)}" for name, inner in value.items())
    if isinstance(value, list | tuple):
        # Sentences stand on lines of their own, names and numbers in one.
        separator = "\n" if any(isinstance(inner, str) and " " in inner for inner in value) else ", "
        return separator.join(map(_plain, value))
    return str(value)


def _value(term: Mapping[str, Any]) -> str:
    ends = term.get("ci95")
    interval = f" ({number(ends[0])} to {number(ends[1])})" if isinstance(ends, list | tuple) and len(ends) == 2 else ""
    return (
        f"{term.get('symbol')} = {number(term.get('value'))} {unit_text(str(term.get('unit') or ''))}".rstrip()
        + interval
    )
