"""Errors of sensors that the records of a log tell of each other, as findings; the motions are corrected for them."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ...measurements.kinematic_errors import Kinematics
from ...measurements.prepared_logs import correction_name
from ...measurements.statistics.robust import CI
from ..findings import SensorError
from ..found_effects import FoundTerm
from ..search.bootstrap import Interval

_ERRORS: tuple[tuple[Any, str, Sequence[tuple[str, str]]], ...] = (
    ("gyro_scale", "gyro_scale", (("gyro_scale", "1"),)),
    ("gyro_bias", "gyro_bias", (("gyro_bias", "rad/s"),)),
    ("compass_deviation", "compass_sine", (("compass_sine", "deg"), ("compass_cosine", "deg"))),
    ("compass_deviation", "misalignment", (("misalignment", "deg"),)),
    ("velocity_scale", "velocity_scale", (("velocity_scale", "1"),)),
    ("velocity_latency", "velocity_latency", (("velocity_latency", "s"),)),
    ("channel_offset", "position_latency", (("position_latency", "s"),)),
    ("water_speed", "water_north", (("water_north", "m/s"), ("water_east", "m/s"))),
    ("antenna_arm", "arm_x", (("arm_x", "m"), ("arm_y", "m"))),
)
"""Names of the findings, the sentence that tells of each, and the numbers with their units."""
Verdict = Literal["present", "possible", "no evidence"]


def sensor_errors(sensors: Mapping[str, Kinematics]) -> tuple[SensorError, ...]:
    """A finding for every error that the records of a log can tell of, present or not.

    Parameters
    ----------
    sensors : by the source of the motions
    """
    found = []
    for source, known in sorted(sensors.items()):
        sentences, name = known.sentences, f"{Path(source).name}: " if len(sensors) > 1 else ""
        for error, key, numbers in _ERRORS:
            terms = tuple(_term(known, symbol, unit) for symbol, unit in numbers if symbol in known.values)
            symbols = [symbol for symbol, _ in numbers]
            verdict: Verdict
            correction = ""
            if key in sentences:
                verdict, told = "present", f"{sentences[key]}; the motion is corrected for it"
                correction = correction_name(key, source, sensors)
            elif set(symbols) & set(known.beyond):
                verdict, told = (
                    "possible",
                    "this is further off than a sensor is: the record is wrong, or its unit",
                )
            elif all(known.sharp(symbol) for symbol in symbols):
                verdict, told = "no evidence", "as it should be"
            else:
                continue
            sentence = f"{name}{told[0].upper()}{told[1:]}."
            found.append(
                SensorError(error=error, verdict=verdict, sentence=sentence, terms=terms, correction=correction)
            )
    return tuple(found)


def _term(known: Kinematics, symbol: str, unit: str) -> FoundTerm:
    value, error = known.values[symbol]
    by = float(np.degrees(1.0)) if unit == "deg" else 1.0
    low, high = (by * (value + side * CI * error) for side in (-1.0, 1.0))
    return FoundTerm(symbol=symbol, value=by * value, unit=unit, ci95=Interval(low, high))
