"""Check of the excitation: what the boat did, and what the log can therefore identify.

Of a long log it is told of the pieces of it that are looked at.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ....physics import file_records
from ....physics.file_records import Number
from ....physics.motion import Array, Motion
from ..record import About, Check, Found, Record

_ASTERN = -0.05
"""Surge speed below which a boat goes astern [m/s]: beyond what a rough sensor adds (0.04, `worlds.world.NOISE`)."""
_TURNING = 0.05
"""Yaw rate from which a boat turns [rad/s]: three times what a rough sensor adds."""
_SHIP = 0.3
"""Share of its fastest turn from which a ship that turns slowly, but far, is said to turn."""
_FAR = 0.5
"""Turn from which it is far [rad]: 30 degrees are no meander about a course."""


class Excitation(file_records.Record):
    """What the boat did.

    Attributes
    ----------
    seconds : duration of the usable motion [s]
    u, v, r : smallest and largest speed [m/s] and yaw rate [rad/s]
    astern : share of the time with u < -0.05 m/s
    turning_to_starboard, turning_to_port : share of the time with a yaw rate beyond 0.05 rad/s to that side, or
        beyond 30 % of the fastest one of a ship that turns slowly, but through 30 degrees
    sentences : what this log cannot tell, for a person
    """

    seconds: Number
    u: tuple[Number, Number]
    v: tuple[Number, Number]
    r: tuple[Number, Number]
    astern: Number
    turning_to_starboard: Number
    turning_to_port: Number
    sentences: tuple[str, ...]


def excitation_of(motions: Sequence[Motion], weights: Sequence[float] | None = None) -> Excitation:
    """Say how fast the boat went which way, and what motions of that kind cannot tell.

    Parameters
    ----------
    motions : of the log, or of an evenly spread part of a long one
    weights : of each, the seconds of the log that each of its seconds stands for; default: one
    """
    stands_for = [1.0] * len(motions) if weights is None else weights
    velocity = np.concatenate([motion.velocity for motion in motions])
    weight = np.repeat(stands_for, [motion.time.size for motion in motions])
    u, v, r = ((float(column.min()), float(column.max())) for column in velocity.T)
    astern = _share(velocity[:, 0] < _ASTERN, weight)
    turning = _TURNING
    if max(float(np.ptp(motion.heading)) for motion in motions) > _FAR:
        turning = min(_TURNING, _SHIP * float(np.quantile(np.abs(velocity[:, 2]), 0.99)))
    starboard, port = (_share(one, weight) for one in (velocity[:, 2] > turning, velocity[:, 2] < -turning))
    sentences = []
    if astern < 0.02:
        sentences.append("The boat hardly went astern: effects in u|u| and u u, or |u|r and u r, cannot be told apart.")
    if starboard < 0.02 and port < 0.02:
        sentences.append("The boat hardly turned: nothing can be learned about yaw.")
    elif min(starboard, port) < 0.02:
        side = "starboard" if starboard > port else "port"
        sentences.append(f"The boat turned to {side} only: a trim is hard to tell from yaw damping.")
    seconds = float(sum(each * motion.duration for each, motion in zip(stands_for, motions, strict=True)))
    return Excitation(
        seconds=seconds,
        u=u,
        v=v,
        r=r,
        astern=astern,
        turning_to_starboard=starboard,
        turning_to_port=port,
        sentences=tuple(sentences),
    )


def _share(rows: NDArray[np.bool_], weight: Array) -> float:
    return float(weight[rows].sum() / weight.sum())


_LITTLE = 60.0
"""Usable motion below which little can be learned [s]: a few manoeuvres, of which 15 % are held out."""


def _examine(records: Sequence[Record]) -> Found:
    """Say what the log cannot identify, see `excitation_of`.

    One finding for each thing that cannot be told, or one that says that the log has it all.
    """
    stretches = [stretch for record in records for stretch in record.stretches]
    motions = tuple(stretch.motion for stretch in stretches)
    if not motions:
        why = next((record.why_not for record in records if record.why_not), "there is no motion in it")
        return About("excitation", value=0.0, unit="s").untold(f"no motion can be made of the log: {why}")
    seen = excitation_of(motions, [stretch.portion.weight for stretch in stretches])
    parts = {name: getattr(seen, name) for name in ("astern", "turning_to_starboard", "turning_to_port")}
    about = About("excitation", value=seen.seconds, unit="s", parts=parts)
    found = [
        about.note(
            sentence.rstrip("."),
            channels=("u",) if "astern" in sentence else ("r",),
            consequence="what a model fitted to this log says of it is not sure",
            remedy="record it, or give a log in which the boat does it",
        )
        for sentence in seen.sentences
    ]
    if seen.seconds < _LITTLE:
        found.append(
            about.note(
                f"only {seen.seconds:.0f} s of usable motion",
                consequence="few effects can be told apart",
                remedy="give several logs together, or record five minutes",
            )
        )
    return found or [about.ok(f"{seen.seconds:.0f} s ahead and astern, turning to both sides")]


EXCITATION = Check("excitation", _examine)
