"""Check of the sensors against each other: heading and gyro, positions and speeds; see `kinematics`."""

from collections.abc import Sequence

from ...kinematics import Kinematics, kinematics_of, longest_row
from ..record import About, Check, Finding, Found, Record, computed_once

_CHANNELS = {"gyro": ("r",), "compass": ("psi",), "misalignment": ("psi",), "velocity": ("u", "v"), "water": ("u", "v")}
"""Channels that an error is of, by the first word of its name; all others are of positions."""


def _sensors(records: Sequence[Record]) -> Found:
    """Compare the sensors of each log with each other."""
    result, known, apart = [], False, False
    for record in records:
        motions = [stretch.motion for stretch in record.stretches]
        channels = record.log.channels
        seen = computed_once([record], "kinematics", lambda m=motions, c=channels: kinematics_of(m, c, longest_row(c)))
        known |= bool(seen.values)
        apart |= bool(seen.beyond) or not seen.agree
        log = f"{record.log.name}: " if len(records) > 1 else ""
        result += [_wrong(seen, name, log + sentence) for name, sentence in seen.sentences.items()]
    if result:
        return result
    text = "the sensors tell of one motion"
    if apart:
        text = "the records contradict each other by more than sensors do: units, signs or axes, or a record"
    elif not known:
        text = "too few records are of one motion, or it turns too little, to hold the sensors to each other"
    return About("sensors").finding("ok" if known and not apart else "cannot tell", text)


def _wrong(seen: Kinematics, name: str, sentence: str) -> Finding:
    channels = _CHANNELS.get(name.split("_")[0], ("x", "y"))
    return About("sensors", channels, seen.values.get(name, (None, None))[0]).finding(
        "warning" if seen.large(name) else "note",  # what follows is corrected for it
        sentence,
        consequence="forces would be blamed for it; undertow corrects the motion before it judges forces",
        remedy="calibrate or move the sensor, or mend its clock, before the next log",
    )


SENSORS = Check("sensors", _sensors)
