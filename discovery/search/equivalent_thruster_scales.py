"""Descriptions of one and the same model: all thrusters' common scale, and a scale of one of two thrusters."""

from collections.abc import Sequence

import numpy as np

from ...physics.vehicle import Vehicle
from .floating import Search, State

_COMMON, _ONE = "thrust_scale", "thruster_asymmetry"


def same_model(nominal: Vehicle, active: tuple[str, ...], key: str, other: str) -> bool:
    """True when `other` in place of `key` only says the same again, because a third of the kind is in the model.

    With two thrusters, any two of {common scale, scale of the one, scale of the other} give every pair of scales; with
    more of them they do not.
    """
    kind = [k for k in active if _is_scale(k)]
    return len(nominal.thrusters) == 2 and len(kind) == 2 and key in kind and _is_scale(other)


def in_plain_words(search: Search, state: State) -> State:
    """A model of two thrusters' scales, described as a common scale and the weaker one's fault.

    That description is the one an engineer would look for: a battery or a curve that concerns both, and one thruster
    that is fouled. Where either is no candidate, as the common scale beside a calibration, the model stays as it is.
    """
    thrusters = search.nominal.thrusters
    kind = [k for k in state.active if _is_scale(k)]
    if len(thrusters) != 2 or len(kind) != 2:
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


def one_too_many(nominal: Vehicle, active: Sequence[str]) -> tuple[str, ...]:
    """The common scale and all thrusters' own, where all are in a model: their products alone move a force."""
    kind = tuple(k for k in active if _is_scale(k))
    return kind if len(kind) > max(len(nominal.thrusters), 1) else ()


def _is_scale(key: str) -> bool:
    return key == _COMMON or key.startswith(f"{_ONE}[")


def _total(vehicle: Vehicle, thruster: str) -> float:
    return vehicle.value(_COMMON) * vehicle.value(f"{thruster}_scale")
