"""The section of the report page that plays: a slider for each number that was added, and predictions anew."""

import json
from base64 import b64encode
from collections.abc import Sequence
from hashlib import sha256
from importlib import resources
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pandas as pd

from ....exports.formats.to_javascript import force_equation, vehicle_data
from ....physics.effects import COMMAND_OFFSET, EFFECTS
from ....physics.presentation import unit_text, words
from ....physics.vehicle import Vehicle
from ....residuals.scores import SPACING
from ...run_contents import RunFolder
from ..judged_pieces import JudgedPieces, changed_numbers
from ..markup import Html, details, element, escaped, render
from ..outcome import hero
from .base import Chapter, Section
from .verdict import legend

_BEYOND = 0.6
"""How far a slider goes beyond what is between the values before and after, as a share of that."""
_AT_ONCE = 8
"""Sliders that are seen at once, as high as the drawing beside them; more are folded."""
_DIGITS = {"north": 3, "east": 3, "psi": 5, "u": 4, "v": 4, "r": 5}
"""Decimals of the measurement: what the page's drawings show, with some to spare."""
STATES = {"position": ("north", "east"), "surge": ("u",), "sway": ("v",), "yaw": ("r",)}
"""The states whose error is told, by the name of the error."""


_PLAYER = Html(
    '<button type="button" data-play="run">Play</button>'
    '<input type="range" min="0" max="1" value="0" data-play="cursor" aria-label="time">'
    '<output data-play="clock" aria-live="off"></output>'
    '<label>show <select data-play="span"><option value="20">20 s</option>'
    '<option value="60" selected="">60 s</option><option value="all">all</option></select></label>'
    '<label>speed <select data-play="speed"><option value="1">1\N{MULTIPLICATION SIGN}</option>'
    '<option value="4" selected="">4\N{MULTIPLICATION SIGN}</option>'
    '<option value="16">16\N{MULTIPLICATION SIGN}</option></select></label>'
)
"""What plays the motion, moves the time, and chooses the part of the log that is drawn."""


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
    led = hero(run.findings.steps, run.comparison.best.horizon)
    judged = JudgedPieces.of(run.findings, run.series, run.nominal, run.corrected, float(led.horizon))
    rows, step = judged.rows, judged.step
    # The series does not have the wind that an anemometer measured, which the force equation would ask for.
    blows = any(run.corrected.value(symbol) for symbol in ("wind_x", "wind_y", "wind_n"))
    needed = [*_DIGITS, "time", "log", *(thruster.channel for thruster in run.corrected.thrusters)]
    whole = set(needed) <= set(rows.columns) and bool(np.isfinite(rows[needed].to_numpy(dtype=float)).all())
    if not knobs or blows or not whole:
        return None
    data = {
        "nominal": vehicle_data(run.nominal),
        "boats": [vehicle_data(model) for model in judged.models],
        "changes": [changed_numbers(run.nominal, model) for model in judged.models],
        "knobs": [knob._asdict() | {"unit": unit_text(knob.unit)} for knob in knobs],
        **_measurement(rows, judged, run.corrected),
        "horizon": float(led.horizon),
        "spacing": max(1, round(SPACING / step)),
        "metric": [[list(_DIGITS).index(name), name] for name in STATES[led.metric]],
        "unit": led.unit,
    }
    numbers = json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    stored = element("script", Html(numbers), type="application/json", id="play-data")
    unseen = (
        " Each part of the log is predicted by the model that was fitted without it, and a slider moves the number of "
        "each of these models in proportion."
    ) * (len(judged.models) > 1)
    caption = (
        f"Play, or drag the time, and watch the boat beside its predictions, {led.horizon} s each and open loop from "
        "the measurement. Move a slider and all of them are made anew by the force equation. Their error counts as at "
        f"the top of the page, with a prediction every {SPACING:g} s.{unseen}"
    )
    stage = element(
        "div.stage",
        legend(("measured", "before", "yours")),
        _canvas("track", "The track from above, measured, before and by your values"),
        _canvas("time", "Speeds over time, measured, before and by your values"),
        element("div.window", _PLAYER),
        element("p.where", Html("&nbsp;"), data_play="where"),
    )
    sliders = [*map(_knob, knobs[:_AT_ONCE]), *_folded(knobs[_AT_ONCE:])]
    side = element(
        "div.desk",
        element("div.knobs", _error(f"{led.in_words}{judged.some}"), *sliders),
        element("div.buttons", _button("all-before", "Before"), _button("all-after", "After")),
    )
    box = element("figure.card", element("div.board", side, stage), element("figcaption", caption))
    without = element("p.facts", "Sliders for what was added stand here where scripts may run.", id="play-note")
    shown = element("div", box, id="play", hidden="")
    body = render(shown, without, stored, element("script", Html(script())))
    return Section("Try it", body, "play")


def script() -> str:
    """The only script of the page."""
    player = (resources.files(__package__ or "").joinpath("..", "play.js")).read_text("utf-8")
    return f"{force_equation()}{player}"


def script_digest() -> str:
    """The script as a policy of a page allows it, by the SHA-256 of its text."""
    return f"sha256-{b64encode(sha256(script().encode()).digest()).decode()}"


def knobs_of(nominal: Vehicle, corrected: Vehicle) -> list[Knob]:
    """The numbers that differ between two vehicles, each with ends that leave room on both sides."""
    named = {p.symbol: words(effect.name) for effect in reversed(EFFECTS) for p in effect.parameters}
    result = []
    for symbol, before, after in changed_numbers(nominal, corrected):
        if symbol == COMMAND_OFFSET.symbol:
            continue
        parameter, room = corrected.parameter(symbol), _BEYOND * abs(after - before)
        low, high = (
            float(np.clip(end, min(parameter.lower, before, after), max(parameter.upper, before, after)))
            for end in (min(before, after) - room, max(before, after) + room)
        )
        what = named.get(symbol, words(symbol) if symbol.endswith("_scale") else "a term without a name")
        result.append(Knob(symbol, what, parameter.unit, before, after, low, high))
    return result


def _measurement(rows: pd.DataFrame, judged: JudgedPieces, corrected: Vehicle) -> dict[str, object]:
    """The measurement as the script takes it: of each column its unit and its steps from row to row in that."""
    columns = {}
    for name, digits in _DIGITS.items():
        whole = np.round(rows[name].to_numpy() * 10.0**digits).astype(int)
        columns[name] = [10.0**-digits, np.diff(whole, prepend=0).tolist()]
    edges = np.cumsum([0, *(len(piece.rows) for piece in judged.pieces)]).tolist()
    told = []
    for (first, last), piece in zip(pairwise(edges), judged.pieces, strict=True):
        start = round(float(piece.rows["time"].iloc[0]), 3)
        told.append({"first": first, "last": last, "start": start, "begin": piece.begins, "boat": piece.model})
    commands = [[float(f"{x:.6g}") for x in rows[thruster.channel]] for thruster in corrected.thrusters]
    return {"step": round(judged.step, 6), "columns": columns, "commands": commands, "pieces": told}


def _error(what: str) -> Html:
    """The error of the predictions that the sliders make."""
    bar = element("div.meter", element("i", data_play="bar"), role="img")
    told = element("b", Html("&nbsp;"), data_play="told")
    return element("div.error", told, element("small", what), bar)


def _knob(knob: Knob) -> Html:
    label = element("span", element("b", knob.symbol), f" {knob.what}")
    slider = Html(f'<input type="range" aria-label="{escaped(f"{knob.symbol}, {knob.what}")}">')
    marks = element("span.ends", element("i.before"), element("i.after"))
    return element("label.knob", element("span.name", label, element("output")), slider, marks)


def _folded(knobs: Sequence[Knob]) -> list[Html]:
    """The sliders for which there is no room, behind a line that opens them."""
    text = f"{len(knobs)} more: {', '.join(knob.symbol for knob in knobs)}"
    return [details(text, *map(_knob, knobs))] if knobs else []


def _canvas(name: str, told: str) -> Html:
    return element("canvas", data_play=name, role="img", aria_label=told)


def _button(name: str, text: str) -> Html:
    return element("button", text, type="button", data_play=name)


PLAY = Chapter(40, play)
