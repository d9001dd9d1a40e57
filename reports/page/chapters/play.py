"""The section of the report page that plays: a slider for each number that was added, and predictions anew."""

import json
from base64 import b64encode
from collections.abc import Sequence
from functools import cache
from hashlib import sha256
from importlib import resources
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pandas as pd

from ....exports.javascript import force_equation, vehicle_data
from ....physics.effects import COMMAND_OFFSET, EFFECTS
from ....physics.in_words import unit_text, words
from ....physics.stated_values import values_of
from ....physics.vehicle import Vehicle
from ...run_contents import RunFolder
from ..markup import Html, element, render
from .base import Chapter, Section
from .verdict import legend

_ROWS = 3000
"""Rows that are rolled out, five minutes: more would not follow a slider."""
_FEWEST = 100
"""Rows below which there is nothing to see: a rollout of ten seconds."""
_HORIZON = 10.0
"""After so many seconds a rollout begins anew from the measurement, as in the series of the run."""
_BEYOND = 0.6
"""How far a slider goes beyond what is between the values before and after, as a share of that."""
_AT_ONCE = 8
"""Sliders that are seen at once, as high as the drawing beside them; more are folded."""
_DIGITS = {"north": 3, "east": 3, "psi": 5, "u": 4, "v": 4, "r": 5}
"""Decimals of the measurement: what the page's drawings show, with some to spare."""


_WHAT = f"position error of {_HORIZON:g} s predictions"


class Knob(NamedTuple):
    """A number that a slider moves: its symbol, what it is, and its values before and after with the slider's ends."""

    symbol: str
    what: str
    unit: str
    before: float
    after: float
    low: float
    high: float


def play(run: RunFolder) -> Section | None:
    """Sliders, the error that follows them, and measured and predicted motion; shown by its script alone."""
    knobs = knobs_of(run.nominal, run.corrected)
    rows = _stretch(run.series)
    # The series does not have the wind that an anemometer measured, which the force equation would ask for.
    blows = any(run.corrected.value(symbol) for symbol in ("wind_x", "wind_y", "wind_n"))
    needed = [*_DIGITS, "time", "log", *(thruster.channel for thruster in run.corrected.thrusters)]
    whole = set(needed) <= set(rows.columns) and bool(np.isfinite(rows[needed].to_numpy(dtype=float)).all())
    if not knobs or blows or len(rows) < _FEWEST or not whole:
        return None
    log, step = _log(rows, run.series, run.corrected), float(np.median(np.diff(rows["time"])))
    data = {
        "nominal": vehicle_data(run.nominal),
        "vehicle": vehicle_data(run.corrected),
        "knobs": [knob._asdict() | {"unit": unit_text(knob.unit)} for knob in knobs],
        "log": log,
        "horizon": _HORIZON,
    }
    numbers = json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    stored = element("script", Html(numbers), attributes={"type": "application/json", "id": "play-data"})
    part = "" if len(rows) == len(run.series) else f" They run over {len(rows) * step:.0f} s of the logs."
    caption = (
        f"Move a slider and all predictions are made anew by the force equation, {_HORIZON:g} s each and open loop "
        f"from the measurement.{part} Their error is on rows to which the model was fitted; the one at the top of the "
        "page is of models that never saw them."
    )
    stage = element(
        "div",
        legend(("measured", "before", "yours")),
        _canvas("time", "Speeds over time, measured, before and by your values"),
        element("p", Html("&nbsp;"), cls="where", attributes={"data-play": "where"}),
        element("div", *_window(), cls="window"),
        cls="stage",
    )
    side = element(
        "div",
        element("div", _error(), *map(_knob, knobs[:_AT_ONCE]), *_folded(knobs[_AT_ONCE:]), cls="knobs"),
        element("div", _button("all-before", "Before"), _button("all-after", "After"), cls="buttons"),
        _canvas("track", "The track from above, measured, before and by your values"),
        cls="desk",
    )
    box = element("figure", element("div", side, stage, cls="board"), element("figcaption", caption), cls="card")
    text = "Sliders for what was added stand here where scripts may run."
    without = element("p", text, cls="facts", attributes={"id": "play-note"})
    shown = element("div", box, attributes={"id": "play", "hidden": ""})
    body = render(shown, without, stored, element("script", Html(script())))
    return Section("Try it", body, "play")


@cache
def script() -> str:
    """The only script of the page."""
    player = (resources.files(__package__ or "").joinpath("..", "play.js")).read_text("utf-8")
    return f"{force_equation()}{player}"


@cache
def script_digest() -> str:
    """The script as a policy of a page allows it, by the SHA-256 of its text."""
    return f"sha256-{b64encode(sha256(script().encode()).digest()).decode()}"


def knobs_of(nominal: Vehicle, corrected: Vehicle) -> list[Knob]:
    """The numbers that differ between two vehicles, each with ends that leave room on both sides."""
    named = {p.symbol: words(effect.name) for effect in reversed(EFFECTS) for p in effect.parameters}
    found = []
    for symbol, after in corrected.values.items():
        before = nominal.value(symbol)
        if before == after or symbol == COMMAND_OFFSET.symbol or _apart(nominal, symbol) or _apart(corrected, symbol):
            continue
        parameter, room = corrected.parameter(symbol), _BEYOND * abs(after - before)
        low, high = (
            float(np.clip(end, min(parameter.lower, before, after), max(parameter.upper, before, after)))
            for end in (min(before, after) - room, max(before, after) + room)
        )
        what = named.get(symbol, words(symbol) if symbol.endswith("_scale") else "a term without a name")
        found.append(Knob(symbol, what, parameter.unit, before, after, low, high))
    return found


def _apart(vehicle: Vehicle, symbol: str) -> bool:
    """Whether thrusters differ in what all share as a rule: no single slider moves that."""
    return len(values_of(vehicle, symbol)) > 1


def _stretch(series: pd.DataFrame) -> pd.DataFrame:
    """The longest stretch of one log without a gap, or its beginning."""
    time, log = series["time"].to_numpy(), series["log"].to_numpy()
    step = float(np.median(np.diff(time))) if time.size > 1 else 0.0
    breaks = np.flatnonzero((np.diff(log) != 0) | (np.abs(np.diff(time) - step) > 0.5 * step)) + 1
    edges = [0, *breaks.tolist(), time.size]
    begin, end = max(pairwise(edges), key=lambda pair: pair[1] - pair[0])
    return series.iloc[begin : min(end, begin + _ROWS)]


def _log(rows: pd.DataFrame, series: pd.DataFrame, vehicle: Vehicle) -> dict[str, object]:
    """The measurement as the script takes it."""
    time = rows["time"].to_numpy()
    first = series.loc[series["log"] == rows["log"].iloc[0], "time"].iloc[0]
    columns = {name: rows[name].round(digits).tolist() for name, digits in _DIGITS.items()}
    commands = [[float(f"{x:.6g}") for x in rows[thruster.channel]] for thruster in vehicle.thrusters]
    return {
        "start": round(float(time[0]), 3),
        "step": round(float(np.median(np.diff(time))), 6),
        "begin": float(time[0] - first) / 60.0,
        **columns,
        "commands": commands,
    }


def _error() -> Html:
    """The error of the predictions that the sliders make."""
    bar = element("div", element("i", attributes={"data-play": "bar"}), cls="meter", attributes={"role": "img"})
    return element(
        "div",
        element("b", attributes={"data-play": "told"}),
        element("small", _WHAT),
        bar,
        cls="error",
    )


def _knob(knob: Knob) -> Html:
    label = element("span", element("b", knob.symbol), f" {knob.what}")
    slider = Html('<input type="range">')
    marks = element("span", element("i", cls="before"), element("i", cls="after"), cls="ends")
    return element("label", element("span", label, element("output"), cls="name"), slider, marks, cls="knob")


def _folded(knobs: Sequence[Knob]) -> list[Html]:
    """The sliders for which there is no room, behind a line that opens them."""
    told = f"{len(knobs)} more: {', '.join(knob.symbol for knob in knobs)}"
    return [element("details", element("summary", told), *map(_knob, knobs))] if knobs else []


def _canvas(name: str, told: str) -> Html:
    return element("canvas", attributes={"data-play": name, "role": "img", "aria-label": told})


def _button(name: str, text: str) -> Html:
    return element("button", text, attributes={"type": "button", "data-play": name})


def _window() -> tuple[Html, Html]:
    """What chooses the part of the log that is drawn."""
    options = [("20", "20 s"), ("60", "60 s"), ("all", "all")]
    chosen = [
        element("option", text, attributes={"value": value} | ({"selected": ""} if value == "60" else {}))
        for value, text in options
    ]
    span = element("select", *chosen, attributes={"data-play": "span"})
    where = 'data-play="from" aria-label="begin of what is shown"'
    slider = Html(f'<input type="range" min="0" max="1000" value="0" {where}>')
    return element("label", "show ", span), element("label", "from ", slider)


PLAY = Chapter(40, play)
