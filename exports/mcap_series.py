"""The series as an MCAP file for the user's own viewer: Foxglove, PlotJuggler, or whatever reads MCAP with JSON.

Messages are JSON, their schemas are JSON Schema, embedded: undertow's own, and the well-known ones that Foxglove draws
in 3D. Numbers are those of `series.csv`, in NED/FRD; poses, the
path and the frame `boat` alone are turned to the ENU/FLU axes (z up) in which 3D views draw (ROS REP-103). Stamps are
the log's own, so that the file lies over the log in a viewer.
"""

import json
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from math import isfinite
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ..discovery.candidates.linearisation import FORCES, effect_forces, effects_between
from ..measurements.prepared_logs import Parts
from ..physics.effects import BY_NAME
from ..physics.errors import RequestError, one_line
from ..physics.files import write_bytes
from ..physics.momentum_balance import mass_matrix
from ..physics.motion import FORCE_UNITS, Array, heading_from_enu
from ..physics.reading import Plain
from ..physics.registry_members import how_to_install
from ..physics.vehicle import Vehicle
from ..residuals.models.base import Model, VehicleModel
from ..residuals.series import SeriesTable, in_order, series, stretches

EARTH, BOAT = "map", "boat"
"""The frames of 3D views, both with z up: x east and y north; x ahead and y to port."""
AXES_TOLD = f"numbers: NED/FRD, SI; poses, the path and the frames {EARTH} and {BOAT}: ENU/FLU (z up, REP-103)"
STATE = {
    "x": "north [m]",
    "y": "east [m]",
    "psi": "heading, clockwise from north [rad]",
    "u": "surge speed over ground [m/s]",
    "v": "sway speed over ground, positive to starboard [m/s]",
    "r": "yaw rate, positive to starboard [rad/s]",
}
RATES = {
    "u_dot": "surge acceleration, du/dt [m/s^2]",
    "v_dot": "sway acceleration, dv/dt [m/s^2]",
    "r_dot": "yaw acceleration, dr/dt [rad/s^2]",
}
_FORCE = {
    "X": f"surge force [{FORCE_UNITS[0]}]",
    "Y": f"sway force, positive to starboard [{FORCE_UNITS[1]}]",
    "N": f"yaw moment, positive to starboard [{FORCE_UNITS[2]}]",
}

# Texts, to be filled with a stamp (seconds, nanoseconds) and a place (x, y, and z and w of a quaternion about z)

_STAMP_TEXT = '"timestamp":{"sec":%d,"nsec":%d}'
_TURN_TEXT = '{"x":0.0,"y":0.0,"z":%r,"w":%r}'
_POINT_TEXT = '{"x":%r,"y":%r,"z":0.0}'
POSE_TEXT = f'{{"position":{_POINT_TEXT},"orientation":{_TURN_TEXT}}}'
POSE_IN_FRAME_TEXT = f'{{{_STAMP_TEXT},"frame_id":"{EARTH}","pose":{POSE_TEXT}}}'
PATH_TEXT = f'{{{_STAMP_TEXT},"frame_id":"{EARTH}","poses":[%s]}}'
FRAME_TRANSFORM_TEXT = (
    f'{{{_STAMP_TEXT},"parent_frame_id":"{EARTH}","child_frame_id":"BOAT",'
    f'"transform":{{"translation":{_POINT_TEXT},"rotation":{_TURN_TEXT}}}}}'
)


def _numbers(title: str, told: Mapping[str, str]) -> Plain:
    """A JSON schema of an object of numbers, with what each of them is."""
    properties = {name: {"type": "number", "description": text} for name, text in told.items()}
    return {"title": title, "type": "object", "properties": properties}


def measured_schema(channels: Sequence[str]) -> Plain:
    """The schema of what was measured, commands included."""
    commands = dict.fromkeys(channels, "command, in the unit of its name: pwm [us], normalized, rad_s or newton [N]")
    schema = _numbers("undertow.Measured", STATE | RATES | commands)
    schema["properties"]["part"] = {"type": "string", "description": "train, validation or test"}
    return schema


SCHEMAS: dict[str, Plain] = {
    "undertow.Predicted": _numbers("undertow.Predicted", STATE | RATES),
    "undertow.Force": _numbers("undertow.Force", _FORCE),
    **json.loads(Path(__file__).with_name("foxglove_schemas.json").read_text("utf-8")),
}
"""By name, all but that of what was measured, which depends on the commands."""


_IN_TABLE = {"x": "north", "y": "east"}
_SECOND = 1_000_000_000
"""[ns]."""
_PATH_STEP = 10
"""Rows from one place of the drawn path to the next."""
_AT_ONCE = 10_000
"""Rows of which messages are made at once: a quarter of an hour, some MB of text."""
_DIGITS = 9
"""Decimals of forces [N, N m] and quaternions: more is rounding, which differs between machines."""


@dataclass(frozen=True, slots=True)
class Prediction:
    """What one model says along the logs.

    Attributes
    ----------
    name : of its topics
    vehicle : of its mass
    table : a series (see `series.series`) that holds the model
    suffix : of the model's columns: before or after
    effects : forces that lead from the nominal model to this one, by topic (see `effect_forces`)
    """

    name: str
    vehicle: Vehicle
    table: SeriesTable
    suffix: str
    effects: Mapping[str, SeriesTable] = field(default_factory=dict)


def compared(models: Sequence[Model], parts: Parts, channels: Sequence[str]) -> list[Prediction]:
    """What each of several models predicts along all parts of the logs.

    Where the first model and another are vehicles, the effects by which they differ have their forces, under the name
    of the other.
    """
    first = models[0]
    tables = [series(first, model, parts, channels) for model in models[1:] or models]
    told = [Prediction(first.name, first.vehicle, tables[0], "before")]
    for model, table in zip(models[1:], tables, strict=False):
        forces = {}
        if isinstance(first, VehicleModel) and isinstance(model, VehicleModel):
            keys = effects_between(first.vehicle, model.vehicle)
            forces = effect_forces(first.vehicle, model.vehicle, parts, keys)
        named = {f"{_plain(model.name)}/{key}": force for key, force in forces.items()}
        told.append(Prediction(model.name, model.vehicle, table, "after", named))
    return told


def effect_topic(label: str) -> str:
    """The topic of an effect's force, without that of its log.

    >>> effect_topic("thruster_asymmetry[port]")
    '/effects/thruster_asymmetry_port'
    """
    return f"/effects/{'/'.join(map(_plain, label.split('/')))}"


def log_prefixes(logs: Sequence[int]) -> list[str]:
    """How the topics of each log begin, by the numbers of the logs; with nothing where there is one."""
    return [f"/log{log}" if len(logs) > 1 else "" for log in sorted(logs)]


def mcap_installed() -> bool:
    """True when files can be written: the package mcap is there."""
    try:
        import mcap.records  # noqa: F401
    except ImportError:
        return False
    return True


def require_mcap() -> None:
    """Check that files can be written.

    Raises
    ------
    RequestError
        when the package mcap is missing, with the remedy.
    """
    if not mcap_installed():
        raise RequestError(f"a series for viewers needs the package mcap: {how_to_install('logs')}")


def write_series(
    path: str | os.PathLike[str],
    predictions: Sequence[Prediction],
    channels: Sequence[str],
    parts: Parts,
    starts: Mapping[str, int],
    progress: Callable[[int, int], None] | None = None,
    called: Callable[[str], str] = str,
) -> Path:
    """Write what was measured and what each model predicts; equal inputs give equal bytes.

    Parameters
    ----------
    predictions : the first is that of the nominal model; its table gives the measurement
    channels : names of the command columns
    parts : that the series runs along; where they are of several logs, topics begin with `/log0`, `/log1` ...
    starts : stamp of each log at the zero of its motions' time [ns], by their source
    progress : told rows done and rows in all
    called : gives the name by which a reader knows a log

    Raises
    ------
    RequestError
        when the package mcap is missing.
    """
    require_mcap()
    from mcap.writer import Writer

    table = predictions[0].table
    time = in_order([stretch.columns for stretch in stretches(parts)], rounded=False)["time"]
    logs = sorted({stretch.log: stretch.motion.source for stretch in stretches(parts)}.items())
    about = {"schema": "undertow.viewer/1", "axes": AXES_TOLD}
    content = BytesIO()  # the writer asks where it is, which a pipe does not tell
    writer = Writer(content)
    writer.start(library="undertow")
    schemas = {
        name: writer.register_schema(name, "jsonschema", json.dumps(schema).encode())
        for name, schema in (SCHEMAS | {"undertow.Measured": measured_schema(channels)}).items()
    }
    for (log, source), prefix in zip(logs, log_prefixes([log for log, _ in logs]), strict=True):
        (rows,) = np.nonzero(table["log"] == log)  # one after the other
        stamps, shift = _stamps(time[rows], starts[source])
        about[f"log{log}"] = one_line(called(source))
        if starts[source]:
            about[f"log{log}_starts_at_ns"] = str(starts[source])
        if shift:
            about[f"log{log}_stamps_moved_by_s"] = str(shift)
        numbers: list[int] = []
        for begin in range(0, rows.size, _AT_ONCE):  # so that a long log is never in memory as text
            block = slice(begin, begin + _AT_ONCE)
            boat = f"{prefix}/{BOAT}".removeprefix("/")
            topics = _topics(predictions, channels, rows[block], stamps[block], boat)
            if not numbers:
                named = zip(_distinct([topic.name for topic in topics]), topics, strict=True)
                numbers = [
                    writer.register_channel(prefix + name, "json", schemas[topic.schema], dict(topic.about))
                    for name, topic in named
                ]
                way = writer.register_channel(f"{prefix}/measured/path", "json", schemas["foxglove.PosesInFrame"])
                text = _path(_place(table.rows(rows[::_PATH_STEP]), ""), stamps[0])
                writer.add_message(way, int(stamps[0]), text.encode(), int(stamps[0]))
            every = zip(*(topic.texts for topic in topics), strict=True)
            for stamp, texts in zip(stamps[block].tolist(), every, strict=True):
                for number, text in zip(numbers, texts, strict=True):
                    if text:
                        writer.add_message(number, stamp, text.encode(), stamp)
            if progress is not None:
                progress(int(rows[block][-1]) + 1, len(table))
    writer.add_metadata("undertow", about)
    writer.finish()
    return write_bytes(path, content.getvalue())


def _stamps(time: Array, start: int) -> tuple[np.ndarray, int]:
    """Stamps [ns] of times [s] after a stamp, and by how many seconds they were moved: MCAP has none below zero."""
    whole = np.floor(time).astype(np.int64)
    stamps = start + whole * _SECOND + np.round((time - whole) * _SECOND).astype(np.int64)
    shift = max(0, -((start + int(whole[0]) * _SECOND) // _SECOND))
    return stamps + shift * _SECOND, shift


def _distinct(names: Sequence[str]) -> list[str]:
    """Names of which none is twice: those of two models may differ in no letter."""
    result: list[str] = []
    for name in names:
        while name in result:
            name += "_"
        result.append(name)
    return result


# Topics


class _Topic(NamedTuple):
    """A message, JSON text, at each of the log's stamps; none where it is empty."""

    name: str
    schema: str
    texts: Iterator[str]
    about: Mapping[str, str] = MappingProxyType({})


def _topics(
    predictions: Sequence[Prediction], channels: Sequence[str], rows: np.ndarray, stamps: np.ndarray, boat: str
) -> list[_Topic]:
    """Everything along some rows of one log but its whole way; `boat` is the name of its frame."""
    table = predictions[0].table.rows(rows)
    names = (*STATE, *RATES, *channels)
    flat = _flat(names, table[[_IN_TABLE.get(name, name) for name in names]])
    parts = (f'{text[:-1]},"part":"{part}"}}' for text, part in zip(flat, table["part"], strict=True))
    place = _place(table, "")
    result = [
        _Topic("/measured", "undertow.Measured", parts),
        _Topic("/measured/pose", "foxglove.PoseInFrame", _stamped(POSE_IN_FRAME_TEXT, place, stamps)),
        _Topic("/tf", "foxglove.FrameTransform", _stamped(FRAME_TRANSFORM_TEXT.replace("BOAT", boat), place, stamps)),
    ]
    for model in predictions:
        table, name = model.table.rows(rows), _plain(model.name)
        columns = [f"{_IN_TABLE.get(field, field)}_{model.suffix}" for field in (*STATE, *RATES)]
        states = _flat((*STATE, *RATES), table[columns])
        pose = _stamped(POSE_IN_FRAME_TEXT, _place(table, f"_{model.suffix}"), stamps)
        left = _flat(FORCES, _residual(model, table))
        result += [
            _Topic(f"/predicted/{name}", "undertow.Predicted", states),
            _Topic(f"/predicted/{name}/pose", "foxglove.PoseInFrame", pose),
            _Topic(f"/residual/{name}", "undertow.Force", left),
        ]
        for topic, forces in model.effects.items():
            effect = BY_NAME.get(topic.split("/")[-1].split("[")[0])
            about = {} if effect is None else {"equation": effect.equation, "meaning": effect.meaning}
            told = {key: one_line(text) for key, text in about.items()}
            texts = _flat(FORCES, forces.rows(rows)[FORCES])
            result.append(_Topic(effect_topic(topic), "undertow.Force", texts, told))
    return result


def _residual(model: Prediction, table: SeriesTable) -> Array:
    """Force that a model leaves unexplained, (n, 3): M (measured - modelled), which the series has for the first."""
    own = [f"{name}_residual" for name in FORCES]
    if model.suffix == "before" and set(own) <= set(table.columns):
        return table[own]
    modelled = table[[f"{name}_{model.suffix}" for name in RATES]]
    return ((table[list(RATES)] - modelled) @ mass_matrix(model.vehicle)).round(_DIGITS)


def _plain(name: str) -> str:
    """A name in letters, digits and underscores, which need no quotes in a viewer: yaw:u|r| is yaw_u_abs_r.

    >>> _plain("yaw:u|r|"), _plain("thruster_asymmetry[port]")
    ('yaw_u_abs_r', 'thruster_asymmetry_port')
    """
    return re.sub(r"\W+", "_", re.sub(r"\|(\w)\|", r" abs_\1 ", name)).strip("_")


def _flat(names: Sequence[str], values: Array) -> Iterator[str]:
    """A JSON object a row; a number that is not finite is left out."""
    keys = [f'"{name}":' for name in names]
    whole = "{" + ",".join(f"{key}%r" for key in keys) + "}"
    for row, sound in zip(values.tolist(), _sound(values).tolist(), strict=True):
        if sound:
            yield whole % tuple(row)
        else:
            yield "{" + ",".join(f"{key}{x!r}" for key, x in zip(keys, row, strict=True) if isfinite(x)) + "}"


def _sound(values: Array) -> np.ndarray:
    """True for the rows in which every number is finite, (n,)."""
    return np.atleast_1d(np.isfinite(values).all(axis=1))


def _place(table: SeriesTable, suffix: str) -> Array:
    """Where a boat is in the frame of 3D views: x east, y north [m], z and w of its quaternion (n, 4)."""
    north, east, psi = (table[f"{name}{suffix}"] for name in ("north", "east", "psi"))
    half = 0.5 * heading_from_enu(psi)  # the turn between compass heading and ENU yaw is its own inverse
    return np.column_stack([east, north, np.sin(half).round(_DIGITS), np.cos(half).round(_DIGITS)])


def _stamped(text: str, place: Array, stamps: np.ndarray) -> Iterator[str]:
    """A message a row: `text` with its stamp and place; none where a place is not finite."""
    seconds, nanos = np.divmod(stamps, _SECOND)
    each = zip(seconds.tolist(), nanos.tolist(), place.tolist(), _sound(place).tolist(), strict=True)
    return (text % (sec, nsec, *row) if sound else "" for sec, nsec, row, sound in each)


def _path(place: Array, stamp: int) -> str:
    """One message with the whole way, of a place a second."""
    poses = ",".join(POSE_TEXT % tuple(row) for row in place.tolist())
    return PATH_TEXT % (*divmod(stamp, _SECOND), poses)
