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
from numpy.typing import NDArray

from ....exports.javascript import force_equation, vehicle_data
from ....physics.effects import COMMAND_OFFSET, EFFECTS
from ....physics.in_words import unit_text, words
from ....physics.stated_values import values_of
from ....physics.vehicle import Vehicle
from ....residuals.scores import SPACING
from ...run_contents import RunFolder
from ..figures.figure_data import held_out_rows
from ..markup import Html, element, escaped, render
from .base import Chapter, Section
from .verdict import hero_errors, legend

_ROWS = 3000
"""Rows that are predicted, five minutes: more would not follow a slider."""
_BEYOND = 0.6
"""How far a slider goes beyond what is between the values before and after, as a share of that."""
_AT_ONCE = 8
"""Sliders that are seen at once, as high as the drawing beside them; more are folded."""
_DIGITS = {"north": 3, "east": 3, "psi": 5, "u": 4, "v": 4, "r": 5}
"""Decimals of the measurement: what the page's drawings show, with some to spare."""
_STATES = {"position": ("north", "east"), "surge": ("u",), "sway": ("v",), "yaw": ("r",)}
"""The states whose error is told, by the name of the error."""


class Piece(NamedTuple):
    """A stretch of rows without a gap, and the number of the model that predicts it."""

    rows: pd.DataFrame
    model: int


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
    """Sliders, the error that follows them, and measured and predicted motion over time; shown by its script alone.

    The error is the one that the page leads with, counted alike on the same rows by the same models.
    """
    knobs = knobs_of(run.nominal, run.corrected)
    _, _, horizon, metric, unit = hero_errors(run)
    models, judged = _models(run), held_out_rows(run.series)[0]
    step = _step(judged)
    pieces = _pieces(judged, run, float(horizon), step)
    rows = pd.concat([piece.rows for piece in pieces]) if pieces else judged[:0]
    # The series does not have the wind that an anemometer measured, which the force equation would ask for.
    blows = any(run.corrected.value(symbol) for symbol in ("wind_x", "wind_y", "wind_n"))
    needed = [*_DIGITS, "time", "log", *(thruster.channel for thruster in run.corrected.thrusters)]
    whole = set(needed) <= set(rows.columns) and bool(np.isfinite(rows[needed].to_numpy(dtype=float)).all())
    if not knobs or blows or not pieces or not whole:
        return None
    part = "" if len(rows) == len(judged) else f" over {len(rows) * step:.0f} of {len(judged) * step:.0f} s"
    what = f"{metric} error of {horizon} s predictions{part}"
    data = {
        "nominal": vehicle_data(run.nominal),
        "boats": [vehicle_data(model) for model in models],
        "changes": [_changes(run.nominal, model) for model in models],
        "knobs": [knob._asdict() | {"unit": unit_text(knob.unit)} for knob in knobs],
        **_measurement(rows, pieces, run, step),
        "horizon": float(horizon),
        "spacing": max(1, round(SPACING / step)),
        "metric": [[list(_DIGITS).index(name), name] for name in _STATES[metric]],
        "unit": unit,
    }
    numbers = json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    stored = element("script", Html(numbers), attributes={"type": "application/json", "id": "play-data"})
    unseen = (
        " Each part of the log is predicted by the model that was fitted without it, and a slider moves the number of "
        "each of these models in proportion."
    ) * (len(models) > 1)
    caption = (
        f"Play, or drag the time, and watch the boat beside its predictions, {horizon} s each and open loop from the "
        "measurement. Move a slider and all of them are made anew by the force equation. Their error counts as at the "
        f"top of the page, with a prediction every {SPACING:g} s.{unseen}"
    )
    stage = element(
        "div",
        legend(("measured", "before", "yours")),
        _canvas("track", "The track from above, measured, before and by your values"),
        _canvas("time", "Speeds over time, measured, before and by your values"),
        element("div", *_player(), cls="window"),
        element("p", Html("&nbsp;"), cls="where", attributes={"data-play": "where"}),
        cls="stage",
    )
    side = element(
        "div",
        element("div", _error(what), *map(_knob, knobs[:_AT_ONCE]), *_folded(knobs[_AT_ONCE:]), cls="knobs"),
        element("div", _button("all-before", "Before"), _button("all-after", "After"), cls="buttons"),
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


def _models(run: RunFolder) -> list[Vehicle]:
    """The models that judge: one fitted without each fold, or the corrected one where a part was kept aside."""
    changed = {symbol: run.nominal.value(symbol) for symbol in run.corrected.values if ":" in symbol}
    folds = run.findings.folds.models if run.findings.folds else ()
    return [run.nominal.with_values(changed | dict(fold.values)) for fold in folds] or [run.corrected]


def _changes(nominal: Vehicle, model: Vehicle) -> list[tuple[str, float, float]]:
    """What a model changes: symbol, value before and after."""
    both = ((symbol, nominal.value(symbol), after) for symbol, after in model.values.items())
    return [one for one in both if one[1] != one[2] and not _apart(nominal, one[0]) and not _apart(model, one[0])]


def _step(rows: pd.DataFrame) -> float:
    """Time between rows [s]."""
    return float(np.median(np.diff(rows["time"]))) if len(rows) > 1 else 1.0


def _pieces(judged: pd.DataFrame, run: RunFolder, horizon: float, step: float) -> list[Piece]:
    """The judged stretches without a gap, each with its model, as many as are followed; none shorter than a horizon."""
    time, log, model = judged["time"].to_numpy(), judged["log"].to_numpy(), _model_of_rows(judged, run)
    apart = (np.diff(log) != 0) | (np.diff(model) != 0) | (np.abs(np.diff(time) - step) > 0.5 * step)
    found, left = [], _ROWS
    for begin, end in pairwise([0, *(np.flatnonzero(apart) + 1).tolist(), time.size]):
        last = min(end, begin + left)
        if last - begin > round(horizon / step) and model[begin] >= 0:
            found.append(Piece(judged.iloc[begin:last], int(model[begin])))
            left -= last - begin
    return found


def _model_of_rows(judged: pd.DataFrame, run: RunFolder) -> NDArray[np.intp]:
    """The number of the model that was fitted without each row; -1 where every model saw it."""
    folds = run.findings.folds.models if run.findings.folds else ()
    found = np.full(len(judged), -1 if folds else 0, dtype=np.intp)
    for k, fold in enumerate(folds):
        for log, begin, end in fold.stretches:
            found[(judged["log"] == log) & judged["time"].between(begin, end)] = k
    return found


def _measurement(rows: pd.DataFrame, pieces: Sequence[Piece], run: RunFolder, step: float) -> dict[str, object]:
    """The measurement as the script takes it: of each column its unit and its steps from row to row in that."""
    columns = {}
    for name, digits in _DIGITS.items():
        whole = np.round(rows[name].to_numpy() * 10.0**digits).astype(int)
        columns[name] = [10.0**-digits, np.diff(whole, prepend=0).tolist()]
    begun = run.series.groupby("log")["time"].min()
    edges = np.cumsum([0, *(len(piece.rows) for piece in pieces)]).tolist()
    told = []
    for (first, last), piece in zip(pairwise(edges), pieces, strict=True):
        start, log = float(piece.rows["time"].iloc[0]), piece.rows["log"].iloc[0]
        begin = (start - float(begun[log])) / 60.0
        told.append({"first": first, "last": last, "start": round(start, 3), "begin": begin, "boat": piece.model})
    commands = [[float(f"{x:.6g}") for x in rows[thruster.channel]] for thruster in run.corrected.thrusters]
    return {"step": round(step, 6), "columns": columns, "commands": commands, "pieces": told}


def _error(what: str) -> Html:
    """The error of the predictions that the sliders make."""
    bar = element("div", element("i", attributes={"data-play": "bar"}), cls="meter", attributes={"role": "img"})
    told = element("b", Html("&nbsp;"), attributes={"data-play": "told"})
    return element("div", told, element("small", what), bar, cls="error")


def _knob(knob: Knob) -> Html:
    label = element("span", element("b", knob.symbol), f" {knob.what}")
    slider = Html(f'<input type="range" aria-label="{escaped(f"{knob.symbol}, {knob.what}")}">')
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


def _player() -> list[Html]:
    """What plays the motion, moves the time, and chooses the part of the log that is drawn."""
    cursor = Html('<input type="range" min="0" max="1" value="0" data-play="cursor" aria-label="time">')
    shown = _select("span", (("20", "20 s"), ("60", "60 s"), ("all", "all")), "60")
    speed = _select(
        "speed",
        (("1", "1\N{MULTIPLICATION SIGN}"), ("4", "4\N{MULTIPLICATION SIGN}"), ("16", "16\N{MULTIPLICATION SIGN}")),
        "4",
    )
    return [
        _button("run", "Play"),
        cursor,
        element("output", attributes={"data-play": "clock", "aria-live": "off"}),
        element("label", "show ", shown),
        element("label", "speed ", speed),
    ]


def _select(name: str, options: Sequence[tuple[str, str]], chosen: str) -> Html:
    found = [
        element("option", text, attributes={"value": value} | ({"selected": ""} if value == chosen else {}))
        for value, text in options
    ]
    return element("select", *found, attributes={"data-play": name})


PLAY = Chapter(40, play)
