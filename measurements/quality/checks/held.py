"""Check of held positions: a receiver of 5 Hz on a grid of 10 Hz repeats itself."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ..record import About, Check, Fix, Found, Record
from .late import LEAST, at_fixes, fixes_of


def _held(records: Sequence[Record]) -> Found:
    """Count how often a position is new."""
    if not any({"x", "y"} <= set(record.log.channels) for record in records):
        return []
    about = About("held fixes", ("x", "y"))
    every = [fixes_of(record.log.channels) for record in records]
    found = [fixes for fixes in every if fixes is not None and np.count_nonzero(fixes.moving) >= LEAST]
    if not found:
        return about.untold("the boat moves too little to tell how often its position is measured")
    digit = max(fixes.digit for fixes in found)
    if digit > 0.0:
        text = f"positions are rounded to {digit:.2g} m, as far as the boat goes from one new position to the next"
        return about.note(
            f"{text}: how often they are measured cannot be told",
            value=digit,
            unit="m",
            consequence="a speed made of them is as coarse",
            remedy="log positions to the centimetre, or log speeds",
        )
    beat, step, rows = np.median([(fixes.beat, fixes.step, fixes.rows) for fixes in found], axis=0).tolist()
    about = replace(about, value=1.0 / beat, unit="Hz")
    if rows < 2:
        return about.ok(f"positions are new in every row, {1.0 / beat:.3g} a second")
    return about.warning(
        f"positions are measured {1.0 / beat:.3g} times a second and held in between, over "
        f"{rows:.0f} rows of {step:.3g} s",
        consequence="a speed taken from row to row is zero, then too large",
        remedy="use a position only where it is new",
        fix=Fix("rows that repeat a position dropped from x and y", partial(at_fixes, taken=lambda fixes: fixes.time)),
        short=f"positions are held over {rows:.0f} rows",
    )


HELD_FIXES = Check("held fixes", _held)
