"""The numbers of a card in a notebook: discs on their intervals, and what is in play where nothing is decided."""

import re

import pytest

from undertow.discovery.effect_findings import EffectFinding, FittedTerm
from undertow.discovery.findings import Findings
from undertow.discovery.search.estimation import Interval
from undertow.reports.page.figures.plots import interval_bar, of_findings


def effect(name: str, verdict: str, term: FittedTerm) -> EffectFinding:
    content = {"effect": name, "verdict": verdict, "confidence": 0.5, "error_drop": 0.2, "terms": (term,)}
    return EffectFinding.model_validate(content)


DRAG = FittedTerm(symbol="X_uu", value=-8.0, unit="N s^2/m^2", ci95=Interval(-10.0, -6.0))
SCALE = FittedTerm(symbol="thrust_scale", value=0.9, unit="1", ci95=Interval(0.8, 1.1))
UNNAMED = FittedTerm(axis="yaw", form="u|r|", value=-1.2, ci95=Interval(-1.5, -0.9))


def undecided(*candidates: EffectFinding, unnamed: tuple[FittedTerm, ...] = ()) -> Findings:
    return Findings(verdict="undecided", missing=(), candidates=candidates, unnamed=unnamed)


def test_an_undecided_card_shows_the_numbers_that_are_in_play() -> None:
    in_model = effect("surge_quadratic_damping", "possible", DRAG.but(in_model=-8.0))
    possible = effect("thrust_scale", "possible", SCALE)
    both = undecided(possible, in_model, unnamed=(UNNAMED,))
    said = "in play   X_uu = -8.00 N s²/m² (-10.0 to -6.00); yaw u|r| = -1.20 (-1.50 to -0.900)"
    assert said in str(both), "what stands in the model, and nothing else"
    assert "in play   thrust_scale = 0.900 (0.800 to 1.10)" in str(undecided(possible))
    assert "in play" not in str(undecided(effect("thrust_scale", "no evidence", SCALE)))
    assert "in play" not in str(undecided(possible).but(verdict="nothing missing"))


def test_the_numbers_of_a_sure_name_are_its_values() -> None:
    sure = effect("surge_quadratic_damping", "missing", DRAG)
    found = Findings(
        verdict="missing", missing=(sure.effect,), candidates=(sure, effect("thrust_scale", "possible", SCALE))
    )
    assert "values    X_uu = -8.00 N s²/m² (-10.0 to -6.00)" in str(found)
    assert list(of_findings(found)) == ["values"]
    assert "thrust_scale" not in of_findings(found)["values"]


def places(drawn: str) -> tuple[float, ...]:
    """Of the disc, the interval's ends and the tick [px]."""
    disc, ends = re.search(r'cx="([^"]+)"', drawn), re.findall(r'x1="([^"]+)" x2="([^"]+)"', drawn)
    assert disc
    (tick, _), (low, high) = ends
    return float(disc[1]), float(low), float(high), float(tick)


@pytest.mark.parametrize(
    ("term", "null", "expected"),
    [
        (DRAG, 0.0, (39.6, 6.0, 73.2, 174.0)),  # 0 lies outside its interval
        (SCALE, 1.0, (62.0, 6.0, 174.0, 118.0)),  # 1 within it: two thirds of the way
    ],
)
def test_a_bar_is_to_scale(term: FittedTerm, null: float, expected: tuple[float, ...]) -> None:
    assert places(interval_bar(term, null)) == pytest.approx(expected)


def test_a_scale_is_drawn_against_one_and_what_is_added_against_nothing() -> None:
    one = effect("thrust_scale", "likely", SCALE)
    added = effect("surge_quadratic_damping", "likely", DRAG)
    assert (one.nulls, added.nulls) == ((1.0,), (0.0,))
    assert interval_bar(SCALE, *one.nulls) in of_findings(undecided(one).but(verdict="likely"))["values"]


def test_a_number_that_is_none_has_no_bar() -> None:
    assert interval_bar(DRAG.but(value=float("nan")), 0.0) == ""
