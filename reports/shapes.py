"""What the JSON files of a run folder hold: the shape of each, and the one check that asks for it.

A shape is `str`, `float` (a number or null), `int` (a number), `bool`, a list of one shape, a tuple of alternatives, or
a mapping from key to shape. A key that ends in `!` must be there; every other one may be missing or null. The key `*`
stands for all keys that are not named. Keys that no shape names are let pass.
"""

import math
from collections.abc import Mapping
from typing import Any

from ..physics.printable import shown

LARGEST = 1e15
"""No quantity of a boat or its log is larger, in SI units; drawings end in overflow far above."""
_LONGEST = 20_000
"""Letters of one text: a page has 3,000 a screen."""
_MOST = 20_000
"""Entries of one list: a year of logs has fewer."""

_BY_AXIS = {"*": float}
_INTERVAL = [float]
_UNITS = {"*": {"*": str}}
_TERM = {"symbol": str, "axis": str, "form": str, "value": float, "unit": str, "ci95": _INTERVAL, "inclusion": float}
_STEP = {"added": str, "thruster": str, "acceleration_rmse!": _BY_AXIS, "rollout_rmse!": {"*": _BY_AXIS}}
_REMOVED = {"effect": str, "share_removed": float, "sentence": str}
_FAILURE = {
    **dict.fromkeys(("model", "where", "axis", "unit", "rows_of", "unlinked", "sentence", "doing"), str),
    **dict.fromkeys(("share_of_error", "share_of_rows", "rows", "rmse", "rmse_after", "log", "from", "to"), float),
    "removed_by": [_REMOVED],
}
_STATE = {"value": float, "unit": str, "at": {"*": (float, str)}, "sentence": str}
_LAW = {
    **dict.fromkeys(("proof", "sentence", "unit"), str),
    "law!": str,
    "verdict!": str,
    "counts": bool,
    "violating_share": float,
    "worst": _STATE,
    "margin": _STATE,
}
_DOMAIN = {"rows": float, "rmse": _BY_AXIS}
_SPEEDS = {"u": _INTERVAL, "v": _INTERVAL, "r": _INTERVAL}
_SUSPECT = {"effect": str, "sentence": str, "share_removed": float}
_TOLD = {"verdict": str, "sentence": str, "unit": str, "ci95": _INTERVAL, "suspects": [(_SUSPECT, str)]}
_STRUCTURE = {
    "model": str,
    "rows_of": str,
    "segments": [_FAILURE],
    "frequency": {
        "*": {
            **_TOLD,
            **{key: [float] for key in ("hz", "error", "measured", "coherence")},
            "coherent_with": str,
            "below_hz": float,
        }
    },
    "lag": {"*": {**_TOLD, "seconds": float, "correlation": float}},
    "heading": {
        "*": {
            **_TOLD,
            "sectors": [str],
            "mean": [float],
            "spread": [float],
            "harmonic": {"amplitude": float, "direction": float, "ci95": _INTERVAL, "unit": str},
        }
    },
    "drift": {"*": {**_TOLD, "per_minute": float, "size_per_minute": float, "size_ci95": _INTERVAL}},
}

FINDINGS = {
    "schema!": str,
    "verdict": str,
    "headline": str,
    "warnings": [str],
    "notes": [str],
    "missing!": [str],
    "candidates!": [
        {
            **dict.fromkeys(("sentence", "family", "equation"), str),
            "effect!": str,
            "verdict!": str,
            "confidence": float,
            "error_drop": float,
            "indistinguishable_from": [str],
            "terms": [_TERM],
        }
    ],
    "unnamed": [_TERM],
    "calibrated": [
        {
            "symbol": str,
            "unit": str,
            "at_limit": bool,
            "held_by_law": bool,
            "ci95": _INTERVAL,
            "before": float,
            "after": float,
            "wanted": float,
        }
    ],
    "left": [{"symbol": str, "why": str}],
    "absorbed": [str],
    "steps!": [_STEP],
    "failures": [_FAILURE],
    "advice": [{"manoeuvre": str, "why": str}],
    "identifiability": {
        **{key: [str] for key in ("dormant", "absorbed", "noise_limited", "quiet_axes")},
        "groups": [[str]],
        "condition": float,
        "excitation": {"*": {"share": float, "signal_to_noise": float}},
    },
    "criterion": {
        **dict.fromkeys(("certainty", "material", "rollouts", "search", "text"), str),
        "materiality": float,
        "unit": {"*": str},
        "force_scale": _BY_AXIS,
    },
    "passivity": {
        **dict.fromkeys(("verdict", "proof", "sentence"), str),
        "envelope": _SPEEDS,
        "price": float,
        "binding": {},
        "worst": _STATE,
    },
    "data": {
        "rows": float,
        "seconds": float,
        "split": str,
        "unexplained": {"*": {"force": float, "noise": float, "unit": str}},
        "notes": [str],
    },
}
COMPARISON = {
    "schema!": str,
    "split": str,
    "logs": [str],
    "warnings": [str],
    "notes": [str],
    "best": {"model": str, "sentence": str},
    "models!": [
        {
            "name!": str,
            "kind": str,
            "audit": str,
            "laws": [_LAW],
            "acceleration": {"rmse": _BY_AXIS, "mae": _BY_AXIS, "r2": _BY_AXIS},
            "rollout": {"*": _BY_AXIS},
            "units": _UNITS,
            "domain": {"inside": _DOMAIN, "outside": _DOMAIN},
            "parameters": float,
            "seconds_to_fit": float,
            "seconds_to_evaluate": float,
        }
    ],
    "differences": [
        {
            **dict.fromkeys(("model", "against", "quantity", "horizon", "axis", "unit", "verdict"), str),
            **dict.fromkeys(("difference", "relative", "blocks"), float),
            "ci95": _INTERVAL,
        }
    ],
    "failures": [_FAILURE],
    "structure": [_STRUCTURE],
}
AUDIT = {
    **dict.fromkeys(("model", "kind", "verdict", "envelope_from"), str),
    "schema!": str,
    "envelope": _SPEEDS,
    "units": {"*": str},
    "laws!": [_LAW],
    "notes": [str],
}
INSPECTIONS = {
    "schema!": str,
    "logs!": [
        {
            "path!": str,
            "verdict": str,
            "unused": [str],
            "notes": [str],
            "quality": [
                {
                    **dict.fromkeys(("check", "verdict", "unit", "sentence", "consequence", "remedy"), str),
                    "value": float,
                    "ci95": _INTERVAL,
                    "channels": [str],
                    "parts": {"*": (float, str)},
                }
            ],
            "channels": [
                {
                    **dict.fromkeys(("name", "unit", "origin"), str),
                    **dict.fromkeys(("count", "start", "end", "rate", "gaps", "longest_gap"), float),
                    **dict.fromkeys(("minimum", "maximum", "noise"), float),
                }
            ],
            "alignment": [
                {"first": str, "second": str, "offset": float, "correlation": float, "sentence": str, "verdict": str}
            ],
            "excitation": {
                **dict.fromkeys(("seconds", "astern", "turning_to_starboard", "turning_to_port"), float),
                "u": _INTERVAL,
                "v": _INTERVAL,
                "r": _INTERVAL,
                "sentences": [str],
            },
            "plan": {
                "recipe": {
                    **dict.fromkeys(("rate", "cutoff", "order", "max_gap", "guard"), float),
                    "commands": str,
                    "shares": [float],
                },
                "rate": float,
                "segments": [{"start": float, "end": float, "rows": float}],
                "notes": [str],
                "missing": [str],
            },
            "map": {"*": {"from": str, "frame": str, "scale": float, "offset": float}},
        }
    ],
}
RUN = {
    "schema!": str,
    "logs": [str],
    **dict.fromkeys(("frame", "channel_map", "namespace", "judged_on", "command"), str),
    "as_is": bool,
    "refit": bool,
    "seed": float,
    "versions": {"*": str},
    "log_sha256": [{"path": str, "sha256": str}],
}


def check_shape(value: Any, shape: Any, where: str = "") -> None:
    """Refuse a value that has another shape.

    Parameters
    ----------
    where : the place of the value in the file, such as `steps[0].added`

    Raises
    ------
    ValueError
        naming the place, what was expected there, and what came.
    """
    if isinstance(shape, tuple):
        fitting = [one for one in shape if _is_kind(value, one)]
        if not fitting:
            raise ValueError(_told(where, " or ".join(map(_name, shape)), value))
        shape = fitting[0]
    if not _is_kind(value, shape):
        raise ValueError(_told(where, _name(shape), value))
    if isinstance(shape, list):
        if len(value) > _MOST:
            raise ValueError(f"expected at most {_MOST} entries in {where}, got {len(value)}")
        for index, part in enumerate(value):
            check_shape(part, shape[0], f"{where}[{index}]")
    elif isinstance(shape, Mapping):
        _check_keys(value, shape, where)


def _check_keys(value: Mapping[str, Any], shape: Mapping[str, Any], where: str) -> None:
    named = {key.removesuffix("!"): part for key, part in shape.items()}
    for key in shape:
        if key.endswith("!") and value.get(key[:-1]) is None:
            raise ValueError(f"{where or 'the file'} lacks '{key[:-1]}'")
    if "*" in named and len(value) > _MOST:
        raise ValueError(f"expected at most {_MOST} keys in {where}, got {len(value)}")
    for key, part in value.items():
        inner = named.get(key, named.get("*"))
        if part is not None and inner is not None:
            check_shape(part, inner, f"{where}.{shown(key, 60)[1:-1]}" if where else shown(key, 60)[1:-1])


def _is_kind(value: Any, shape: Any) -> bool:
    if shape in (float, int):
        null = value is None and shape is float
        return null or (isinstance(value, int | float) and not isinstance(value, bool) and _is_sensible(value))
    if shape is str:
        return isinstance(value, str) and len(value) <= _LONGEST
    kind = bool if shape is bool else list if isinstance(shape, list) else dict
    return isinstance(value, kind)


def _is_sensible(value: float) -> bool:
    return math.isfinite(value) and abs(value) <= LARGEST


def _name(shape: Any) -> str:
    if isinstance(shape, list):
        return "a list of objects" if isinstance(shape[0], Mapping) else "a list"
    if isinstance(shape, Mapping):
        return "an object"
    return {str: f"a text of at most {_LONGEST} letters", bool: "true or false"}.get(
        shape, f"a number of at most {LARGEST:g}"
    )


def _told(where: str, expected: str, value: Any) -> str:
    return f"expected {expected} in {where or 'the file'}, got {shown(value)}"
