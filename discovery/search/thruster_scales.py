"""Scales of thrusters: equivalent descriptions of one model, and a thrust that the file gives wrongly for all of them.

All thrusters' common scale and a scale of each describe the same forces; the description with fewest faults is told.
"""

from collections.abc import Sequence

import numpy as np

from ...physics.presentation import listing, number
from ...physics.sources import assumed, how_sure
from ...physics.vehicle import Vehicle
from .floating import Search, State

_COMMON, _ONE = "thrust_scale", "thruster_asymmetry"


def is_equivalent(nominal: Vehicle, active: tuple[str, ...], key: str, other: str) -> bool:
    """True when `other` in place of `key` only says the same again, because a third of the kind is in the model.

    With two thrusters, any two of {common scale, scale of the one, scale of the other} give every pair of scales; with
    more of them they do not.

    Parameters
    ----------
    nominal : whose thrusters they are
    active : keys of the effects in the model
    key, other : keys of the scale in the model and of the one in its place
    """
    kind = [k for k in active if _is_scale(k)]
    return len(nominal.thrusters) == 2 and len(kind) == 2 and key in kind and _is_scale(other)


def as_common_scale(search: Search, state: State) -> State:
    """A model of two thrusters' scales, described as a common scale and the weaker one's fault.

    Three scales of two thrusters are one too many: only their products move a force. Told is what an engineer would
    look for: a battery or a curve that concerns both, and one thruster that is fouled. Where either is no candidate, as
    the common scale beside a calibration, the model stays as it is.
    """
    thrusters = search.nominal.thrusters
    kind = [k for k in state.active if _is_scale(k)]
    if len(thrusters) != 2 or len(kind) < 2:
        return state
    names = [t.name for t in thrusters]
    ratio = np.array([_total(state.vehicle, n) / max(_total(search.nominal, n), 1e-12) for n in names])
    weak, strong = (names[int(k)] for k in np.argsort(ratio))
    plain = {_COMMON, f"{_ONE}[{weak}]"}
    if set(kind) == plain or not plain <= {candidate.key for candidate in search.pool}:
        return state
    common = search.nominal.value(_COMMON) * float(ratio.max())
    values = {
        _COMMON: common,
        f"{strong}_scale": search.nominal.value(f"{strong}_scale"),
        f"{weak}_scale": search.nominal.value(f"{weak}_scale") * float(ratio.min() / ratio.max()),
    }
    rest = [k for k in state.active if k not in kind]
    return search.evaluate(state.vehicle.with_values(values), (*rest, _COMMON, f"{_ONE}[{weak}]"))


def redundant_scales(nominal: Vehicle, active: Sequence[str]) -> tuple[str, ...]:
    """The common scale and all thrusters' own, where all are in a model: their products alone move a force."""
    kind = tuple(k for k in active if _is_scale(k))
    return kind if len(kind) > max(len(nominal.thrusters), 1) else ()


def _is_scale(key: str) -> bool:
    return key == _COMMON or key.startswith(f"{_ONE}[")


def _total(vehicle: Vehicle, thruster: str) -> float:
    return vehicle.value(_COMMON) * vehicle.value(f"{thruster}_scale")


ONE = "thruster_asymmetry"


def all_thrusters(nominal: Vehicle, corrected: Vehicle, kept: Sequence[str]) -> str:
    """Sentence that all thrusters push harder, or all weaker, than the file says, and how much of it is a difference.

    Empty where a thruster is as the file has it, or pushes the other way from the file than another.

    Parameters
    ----------
    kept : keys of the effects that stand in the corrected model

    Examples
    --------
    >>> from undertow.physics.vehicle import load_vehicle
    >>> boat = load_vehicle("blueboat")
    >>> keys = ["thruster_asymmetry[port]", "thruster_asymmetry[stbd]"]
    >>> for sentence in all_thrusters(boat, boat.with_values({"port_scale": 1.3, "stbd_scale": 1.6}), keys).split(". "):
    ...     print(sentence)
    Both thrusters push harder than the vehicle file says, port 1.30 times and stbd 1.60 times
    Of that, a factor of 1.23 is the difference between the two; the rest is thrust that the file has too low.
    >>> all_thrusters(boat, boat.with_values({"port_scale": 0.9, "stbd_scale": 1.6}), keys)
    ''
    """
    names = [thruster.name for thruster in nominal.thrusters]
    if len(names) < 2 or not {f"{ONE}[{name}]" for name in names} <= set(kept):
        return ""
    times = {name: corrected.value(f"{name}_scale") / (nominal.value(f"{name}_scale") or 1.0) for name in names}
    weak, strong = min(times.values()), max(times.values())
    if not (weak > 1.0 or 0.0 < strong < 1.0) or weak <= 0.0:
        return ""
    how, wrong = ("harder", "low") if weak > 1.0 else ("weaker", "high")
    guess = assumed(nominal).get("thrust_scale")
    sure = f" ({how_sure(guess)})" if guess and how_sure(guess) else ""
    file = "the vehicle file says" if guess is None else f"the vehicle file assumes{sure}"
    every, between = ("Both", "the two") if len(names) == 2 else ("All", "the weakest and the strongest")
    each = listing([f"{name} {number(value)} times" for name, value in times.items()])
    return (
        f"{every} thrusters push {how} than {file}, {each}. Of that, a factor of {number(strong / weak)} is the "
        f"difference between {between}; the rest is thrust that the file has too {wrong}."
    )
