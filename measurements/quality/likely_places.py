"""Warnings of thrusters that are likely reversed, or on the other side, in logs that do not show it for sure."""

from collections.abc import Mapping, Sequence

from .expected_answers import Expected, Likely
from .finding import Finding
from .place_remedies import all_of, are, called, map_line, or_vehicle, swapped
from .record import Record


def likely_reversed(records: Sequence[Record], expected: Mapping[str, Expected], likely: Likely) -> Finding | None:
    """The warning that thrusters are likely reversed; None where only a turn speaks for it, which may be the side."""
    turned, moved = _faults(expected, likely)
    if not turned:
        return None
    text = f"{all_of([called(records, name) for name in turned])} {are(turned)} likely reversed ({_sure(likely)})"
    why = "more of that command pushes astern, as the motion is explained best"
    follows = "a model drives ahead where the boat goes astern; no thrust can be fitted"
    cure = _to_try(records, expected, turned, moved)
    return _warned(
        "direction", turned, f"{text}: {why}", follows, cure, f"{all_of(turned)} {are(turned)} likely reversed"
    )


def likely_swapped(records: Sequence[Record], expected: Mapping[str, Expected], likely: Likely) -> Finding | None:
    """The warning that sides are likely swapped; None where that is not so."""
    turned, moved = _faults(expected, likely)
    if not moved:
        return None
    short = "port and starboard are likely swapped"
    cure = _to_try(records, expected, turned, moved)
    return _warned(
        "sides", moved, f"{short} ({_sure(likely)})", "every turn is predicted to the wrong side", cure, short
    )


def _faults(expected: Mapping[str, Expected], likely: Likely) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The commands that likely push the other way, and those that are likely on the other side."""
    turned = tuple(name for name, answer in likely.answers.items() if not expected[name].ahead_as(answer))
    moved = swapped(expected, likely.answers)
    return turned, tuple(sorted(moved)) if all(answer.side for answer in likely.answers.values()) else ()


def _sure(likely: Likely) -> str:
    return f"{100.0 * (1.0 - likely.chance):.0f} % sure, if the commands are in step with the motion"


def _to_try(
    records: Sequence[Record], expected: Mapping[str, Expected], turned: Sequence[str], moved: Sequence[str]
) -> str:
    maps = [map_line(records, name, name in turned, name in moved) for name in expected if name in (*turned, *moved)]
    what = "curve, the angle or the place"
    return f"try it in a channel map: {', '.join(maps)}{or_vehicle((*turned, *moved), expected, what)}"


def _warned(check: str, names: tuple[str, ...], sentence: str, follows: str, cure: str, short: str) -> Finding:
    return Finding(
        check=check,
        verdict="warning",
        sentence=sentence,
        channels=names,
        consequence=follows,
        remedy=cure,
        short=short,
    )
