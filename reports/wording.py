"""Numbers, units and names as a reader wants to see them, the same on the page, in the figures and on the terminal."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ..comparison.facts import ComparedModel, Held
from ..comparison.failing.failures import Structure
from ..discovery.effect_findings import EffectFinding
from ..discovery.findings import Step
from ..discovery.lawful.laws_over import Passivity
from ..measurements.prepared_logs import FOLDS
from ..physics.motion import AXES
from ..physics.presentation import MINUS, NARROW, finite, listing, number, unit_text, words


def effect_words(candidate: EffectFinding) -> str:
    """The effect of a candidate in words, with the thruster that is meant where it concerns one."""
    name, meant = words(candidate.effect), candidate.thrusters
    return f"{name} ({', '.join(meant)})" if meant else name


def judged_rows(split: str) -> str:
    """The rows that judge, in words."""
    whole = {"all": "all rows", FOLDS: "all rows, each by models that never saw it"}
    return whole.get(split, f"the {split} part")


INTERVAL_HOLDS = (
    "interval holds: share of the rows at which the measured acceleration lies in the model's own 95 % interval "
    "(surge, sway, yaw), within what it was trained on and beyond"
)


def held_shares(found: Held | None) -> str:
    """Shares that an interval holds on the axes; empty where no row asks for it.

    Examples
    --------
    >>> from undertow.residuals.scores import ByAxis
    >>> held_shares(Held(rows=200, share=ByAxis(surge=0.955, sway=0.94, yaw=1.0)))
    '96, 94, 100 %'
    """
    if found is None or found.share is None:
        return ""
    return f"{', '.join(f'{100.0 * found.share.of(axis):.0f}' for axis in AXES)} %"


def twins(candidate: EffectFinding) -> list[str]:
    """What would explain the log as well as the candidate, in words."""
    names = candidate.indistinguishable_from
    return ["another thruster" if name == candidate.effect else words(name) for name in names]


def typeset(value: Any, digits: int = 3, *, blank: str = "n/a") -> str:
    """A number for the page, with a true minus sign."""
    return number(value, digits, minus=MINUS, blank=blank)


def goodness(value: Any) -> str:
    """A coefficient of determination, which never claims to be perfect.

    Examples
    --------
    >>> goodness(0.99966).replace(NARROW, " "), goodness(0.654), goodness(-0.0003), goodness(-18278.0), goodness(None)
    ('> 0.999', '0.654', '0.000', '\N{MINUS SIGN}18278', 'n/a')
    """
    known = finite(value)
    if 0.9995 <= known < 1.0:
        return f">{NARROW}0.999"
    return typeset(value) if math.isnan(known) or abs(known) >= 1.0 else f"{known:z.3f}".replace("-", MINUS)


def trimmed(value: Any) -> str:
    """A coefficient for the page: four significant digits, no trailing zeros.

    Examples
    --------
    >>> trimmed(48.5), trimmed(0.295), trimmed(8.0297588)
    ('48.5', '0.295', '8.03')
    """
    text = typeset(value, 4)
    return text.rstrip("0").rstrip(".") if "." in text and "e" not in text else text


def interval(ends: Any, *, minus: str = MINUS, blank: str = "n/a") -> str:
    """An interval to two significant digits of its half width.

    Examples
    --------
    >>> interval([0.78, 0.83]), interval([-12.0213, -11.9871], minus="-"), interval([-3.0, 40.0]), interval(None)
    ('0.780 to 0.830', '-12.021 to -11.987', '−3 to 40', 'n/a')
    """
    if _half_width(ends) is None:
        return blank
    return " to ".join(within(end, ends, minus=minus) for end in ends)


def within(value: Any, ends: Any, *, minus: str = MINUS) -> str:
    """A value to as many decimals as its interval; to three significant digits without one.

    Examples
    --------
    >>> within(-12.00423, [-12.0213, -11.9871], minus="-"), within(-9.1374, None, minus="-"), within(0.00042, [-3, 4])
    ('-12.004', '-9.14', '0.0')
    """
    known, half = finite(value), _half_width(ends)
    if math.isnan(known) or not half:
        return number(value, minus=minus)
    decimals = 1 - math.floor(math.log10(half))
    rounded = round(known, decimals)
    if rounded == 0.0:
        return f"{0.0:.{min(max(decimals, 0), 9)}f}"
    digits = math.floor(math.log10(abs(rounded))) + 1 + decimals
    return number(rounded, max(digits, 1), minus=minus)


def _half_width(ends: Any) -> float | None:
    """Half the width of an interval; None where it is none."""
    if not isinstance(ends, list | tuple) or len(ends) != 2:
        return None
    half = 0.5 * abs(finite(ends[1]) - finite(ends[0]))
    return None if math.isnan(half) else half


def cut(name: str, most: int) -> str:
    """A name of at most so many letters, with an ellipsis in the place of what goes.

    Examples
    --------
    >>> cut("harbour", 7), cut("harbour patrol", 8)
    ('harbour', 'harbour…')
    """
    return name if len(name) <= most else f"{name[: most - 1]}\N{HORIZONTAL ELLIPSIS}"


def ordinal(count: int) -> str:
    """A number as a place in a row.

    Examples
    --------
    >>> ordinal(2), ordinal(11), ordinal(23)
    ('2nd', '11th', '23rd')
    """
    ending = "th" if count // 10 % 10 == 1 else {1: "st", 2: "nd", 3: "rd"}.get(count % 10, "th")
    return f"{count}{ending}"


LEAD = "10"
"""Horizon [s] that a story leads with where no other decides which model to trust."""


def pick_horizon(rollout: Sequence[str], wanted: str = LEAD) -> str:
    """The key of the rollout horizon [s] nearest to the wanted one; the wanted one when there is none.

    Examples
    --------
    >>> pick_horizon(["2", "10", "30"]), pick_horizon(["5", "20"])
    ('10', '5')
    """
    known = [key for key in rollout if key.replace(".", "", 1).isdigit()]
    return min(known, key=lambda key: (abs(float(key) - float(wanted)), float(key)), default=wanted)


CALIBRATED = "calibrated"
"""The step, in `steps`, at which the parameters of the nominal model were calibrated."""
OWN_NUMBERS = "own numbers fitted"
"""The same for a reader: the model `calibrated` of a comparison has other numbers, with no effect beside them."""


def step_words(step: Step) -> str:
    """What a step of the falling error did, with the thruster that is meant where it concerns one."""
    added = str(step.added)
    which = f" ({step.thruster})" if step.thruster else ""
    return OWN_NUMBERS if added == CALIBRATED else f"+ {words(added)}{which}"


def risen(steps: Sequence[Step], horizon: str, found: EffectFinding | None = None) -> list[str]:
    """What errs more with a step than without it, in the acceleration and in predictions over a horizon [s].

    Parameters
    ----------
    found : the effect of the one step that is asked for, with its thrusters; None for all steps, each by its name
    """
    told = []
    for step in steps:
        worse = [one.in_words for one in step.rises if one.horizon in (None, horizon)]
        if worse and found is None:
            told.append(f"With {step_words(step).removeprefix('+ ')}, {listing(worse)}, by more than chance.")
        elif worse and found is not None and step.added == found.effect and step.thruster in (None, *found.thrusters):
            told.append(f"With it, {listing(worse)}, on rows that no fit saw and by more than chance.")
    return told


STATE_UNITS = {"u": "m/s", "v": "m/s", "r": "rad/s", "psi": "rad", "from": "s", "to": "s"}
"""Of what an audit tells where a law is broken."""


def range_words(ranges: Mapping[str, Sequence[float]], units: Mapping[str, str] = STATE_UNITS) -> str:
    """Ranges of states in words.

    Examples
    --------
    >>> range_words({"u": (-1.0, 2.0), "r": (-0.5, 0.5)})
    'u from -1.00 to 2.00 m/s and r from -0.500 to 0.500 rad/s'
    """
    told = [
        f"{name} from {number(low)} to {number(high)} {unit_text(units.get(name, ''))}"
        for name, (low, high) in ranges.items()
    ]
    return listing(told)


def energy_lines(passivity: Passivity) -> list[str]:
    """How the law of dissipation stands in a model, as sentences: verdict and price, proof, and where it holds."""
    where = range_words(passivity.envelope.to_dict())
    if passivity.proof == "vertex LMI":
        shown = f"Proved for {where}, by matrix inequalities at the corners; a random search of 100 000 states agrees."
    elif passivity.verdict == "pass":
        shown = f"Searched, not proved, for {where}: 100 000 random states show no violation."
    else:
        shown = f"Searched for {where}."
    return [passivity.sentence, shown]


def absorbed_sentence(absorbed: Sequence[str]) -> str:
    """Which effects took no part, because a calibration does the same; empty where all did."""
    names = listing([words(name) for name in absorbed])
    return f"Not judged beside the calibration, which would do the same: {names}." if absorbed else ""


def energy_verdict(passivity: Passivity) -> str:
    """The same in a few words."""
    return "the damping takes energy out" if passivity.verdict == "pass" else "the damping creates energy"


def models_sentence(models: Sequence[ComparedModel], structure: Sequence[Structure]) -> str:
    """The models whose failures are shown, and those that were not looked at, as a sentence; empty where none say."""
    shown = [one.model for one in structure]
    others = [m.name for m in models if m.kind != "baseline" and m.name not in shown]
    if not shown:
        return ""
    return f"Failures of {listing(shown)}{f'; not looked at: {listing(others)}' if others else ''}."
