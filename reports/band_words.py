"""Words for the band about predictions, for page, terminal and workbench."""

from typing import TYPE_CHECKING

from ..physics.presentation import number, percent

if TYPE_CHECKING:  # the first page of the workbench waits for nothing heavy
    from ..residuals.models.band_record import PredictionBand
    from ..residuals.series import HeldPredictions

BANDS_HELD = (
    "such bands held 96 to 98 % of the positions on second runs of the same manoeuvres and 93 to 96 % on other ones, "
    "and 61 % in the worst world"
)
"""Printed by `benchmarks/bands.py --seeds reporting`, of 24 worlds: means of own and foreign ones, and the least."""


def band_words(band: "PredictionBand | None") -> str:
    """What a band is made to hold, from what it comes, and how often such bands held; empty without a band."""
    if band is None:
        return ""
    radius = number(band.half_width["position"][-1], 2)
    return (
        f"The shaded band is made to hold {percent(band.level)} of predictions: after {band.seconds[-1]:g} s the "
        f"position within {radius} m (median). It comes from {band.predictions} predictions of rows that the model did "
        "not see. "
        f"In simulation, {BANDS_HELD}."
    )


def held_words(held: "HeldPredictions | None", name: str) -> str:
    """How many predictions end within the band of the run that a model comes from; empty where none was asked."""
    if held is None or not held.predictions + held.beyond:
        return ""
    text = f"Of {held.predictions} predictions on these rows, {percent(held.position)} end within the band of {name}."
    if not held.beyond:
        return text
    beyond = f"{held.beyond} go far beyond the speeds of its run, where its band says nothing"
    return f"{text[:-1]}; {beyond}." if held.predictions else f"All {beyond}."
