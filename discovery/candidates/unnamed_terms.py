"""Monomials of velocity along a log, and the sparse shortlist of terms that nobody has named.

Sparse selection is forward orthogonal regression on the factors of the weak form, see `factors`.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ...physics.effects import Effect, Parameter
from ...physics.forces import through_water
from ...physics.momentum_balance import HYDRODYNAMIC
from ...physics.motion import AXES, Array
from ...physics.terms import Form, monomials
from ...physics.vehicle import Vehicle
from ..balance.weak_form import WeakForm
from ..factors.factors import Column, Factors, forward, triangular
from .candidate import Candidate, Kind

_ALIAS = 0.9995
"""Correlation from which two monomials are one: what is left of one beside the other is 3 % of it."""
_TWIN = 0.9
"""Correlation from which a monomial could stand for another: four fifths of its square are the other's."""


def _unit(form: Form) -> str:
    rates = sum(factor.strip("|") == "r" for factor in form.factors)
    powers = (("m/s", form.degree - rates), ("rad/s", rates))
    return " ".join(f"({unit})^{power}" if power > 1 else unit for unit, power in powers if power)


def _same(form: Form) -> tuple[tuple[int, ...], tuple[int, ...]]:
    power = tuple(sum(f.strip("|") == name for f in form.factors) for name in "uvr")
    sign = tuple(sum(f == name for f in form.factors) % 2 for name in "uvr")
    return power, sign


_NAMED_KEYS = {(axis, _same(form)) for _, axis, form in HYDRODYNAMIC}


def term_candidate(symbol: str, vehicle: Vehicle) -> Candidate:
    """An unnamed term (`axis:form`) as a candidate like any effect of the catalogue."""
    axis, form = symbol.split(":", 1)
    parameter = vehicle.parameter(symbol)
    letter = "XYN"[AXES.index(axis)]
    effect = Effect(
        symbol,
        "unnamed",
        (Parameter(symbol, "coupling", parameter.unit, axis=parameter.axis, form=form),),
        f"{letter} += c {form}",
        f"A force in {axis} in proportion to {form}, which the catalogue does not name.",
    )
    return Candidate(symbol, effect, effect.parameters, Kind.TERM)


def shortlist(weak: WeakForm, vehicle: Vehicle, most: int = 8, degree: int = 3) -> tuple[str, ...]:
    """Unnamed terms that may explain the balance of a vehicle: at most `most` an axis, as `axis:form` symbols.

    Terms of the catalogue compete in the selection, so that an unnamed term enters only beside or before them, and
    columns that this log cannot tell apart (correlation above 0.9995) enter once, the named and the simplest first.
    """
    factors = term_factors(weak, vehicle, degree)
    forms = monomials(degree)
    columns = factors.whole[:, : len(forms)]
    found: list[str] = []
    for axis, name in enumerate(AXES):
        order = sorted(
            range(len(forms)), key=lambda k: ((axis, _same(forms[k])) not in _NAMED_KEYS, forms[k].degree, k)
        )
        keep = _distinct(columns, order)
        if not np.any(factors.whole[:, len(forms) + axis]):
            continue
        for k in forward(factors.only(keep), axis, most):
            if (axis, _same(forms[keep[k]])) not in _NAMED_KEYS:
                found.append(f"{name}:{forms[keep[k]].text}")
    return tuple(found)


def twins(weak: WeakForm, vehicle: Vehicle, symbols: Sequence[str], most: int = 3, degree: int = 3) -> tuple[str, ...]:
    """Unnamed terms that move nearly as given ones do on this log: at most `most` each, the closest first.

    Their tested columns correlate by more than 0.9 in modulus. Terms of the catalogue are left out: they are tried
    anyway.
    """
    if not symbols:
        return ()
    forms = monomials(degree)
    features = term_factors(weak, vehicle, degree).whole[:, : len(forms)]
    names = [form.text for form in forms]
    norms = np.maximum(np.sqrt((features**2).sum(axis=0)), 1e-300)
    found: list[str] = []
    for symbol in symbols:
        axis, text = symbol.split(":", 1)
        k = names.index(text)
        alike = np.abs(features.T @ features[:, k]) / (norms * norms[k])
        near = [n for n in np.argsort(-alike, kind="stable") if n != k and alike[n] > _TWIN]
        named = [(AXES.index(axis), _same(forms[n])) in _NAMED_KEYS for n in near]
        found += [f"{axis}:{names[n]}" for n, known in zip(near, named, strict=True) if not known][:most]
    return tuple(dict.fromkeys(s for s in found if s not in symbols))


def term_factors(weak: WeakForm, vehicle: Vehicle, degree: int, logs: Sequence[str] = ("",)) -> Factors:
    """Monomials of velocity and the balance of a vehicle on three axes, as factors of the blocks of a weak form.

    Parameters
    ----------
    logs : SHA-256 of the log that the weak form tests
    """
    forms, features = features_along(weak, vehicle, degree)
    rows = np.column_stack([features, weak.balance(vehicle)])
    edges = np.searchsorted(weak.block, np.arange(weak.blocks + 1))
    columns = tuple(Column(name=form.text, unit=_unit(form)) for form in forms)
    targets = tuple(Column(name=axis, unit=unit) for axis, unit in zip(AXES, weak.unit, strict=True))
    r = np.stack([triangular(rows[a:b]) for a, b in pairwise(edges)])
    settings = {
        "half_width": weak.settings.half_width,
        "stride": weak.settings.stride,
        "power": weak.settings.power,
        "degree": degree,
        "vehicle": vehicle.digest,
    }
    return Factors(columns, targets, r, np.diff(edges), np.zeros(weak.blocks, dtype=int), tuple(logs), settings)


def features_along(weak: WeakForm, vehicle: Vehicle, degree: int) -> tuple[tuple[Form, ...], Array]:
    """Monomials of the velocity through the water along the log, averaged by the test functions, (tests, forms)."""
    forms = monomials(degree)
    states = [through_water(vehicle, motion) for motion in weak.motions]
    return forms, weak.average([np.stack([form(*state) for form in forms], axis=-1) for state in states])


def _distinct(features: Array, order: Sequence[int]) -> list[int]:
    """Indices of columns, in order of preference, that are alive and not aliases of an earlier one."""
    norms = np.sqrt((features**2).sum(axis=0))
    keep: list[int] = []
    for k in order:
        if norms[k] <= 1e-9 * norms.max():
            continue
        if keep:
            kept = features[:, keep]
            if np.abs(kept.T @ features[:, k] / (norms[keep] * norms[k])).max() > _ALIAS:
                continue
        keep.append(k)
    return keep
