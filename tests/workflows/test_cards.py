"""What objects show of themselves in a console and a notebook is short, and says what a person asks first."""

from dataclasses import replace
from pathlib import Path

import pytest

import undertow
from undertow.measurements.quality.record import Finding, Fix
from undertow.physics.presentation import Card, each
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

MOST = 2000
"""Letters of a card: a screen."""


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> dict[str, object]:
    folder = tmp_path_factory.mktemp("cards")
    path = simulate_world(load_vehicle("blueboat"), {"surge_quadratic_damping": -12.0}, duration=60.0, seed=2).write(
        folder / "log<b>.csv"
    )
    inputs = undertow.read_inputs(path, "blueboat")
    run = undertow.discover(inputs)
    return {
        "log": undertow.read_log(path),
        "inputs": inputs,
        "motion": inputs.fitting[0],
        "run": run,
        "findings": run.findings,
        "comparison": run.comparison,
        "audit": run.audit,
        "discovery": run.discovery,
        "fit": undertow.fit(undertow.read_inputs(path, "blueboat", judge="test")),
        "draft": undertow.init(path),
        "inspection": undertow.inspect_log(undertow.read_log(path)),
        "folder": undertow.load_run(Path(undertow.write_run(run, folder / "run", report=False))),
    }


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("log", ("log<b>.csv", "newton_port (10 Hz)", "psi (20 Hz)")),
        ("inputs", ("BlueBoat", "stretch", "test; all rows where models are searched")),
        ("motion", ("rows", "at 20 Hz", "port, stbd", "surge")),
        ("run", ("The file's X_uu (about -20.1, not -8) is off", "X_uu = -1", "trust", "corrected")),
        ("findings", ("missing", "X_uu = -1", "N s²/m²")),
        ("comparison", ("judged on", "nominal", "corrected")),
        ("audit", ("verdict", "dissipation")),
        ("discovery", ("added", "surge_quadratic_damping")),
        ("fit", ("Calibrated", "X_u", "->")),
        ("draft", ("newton_port (port)", "to look at")),
        ("inspection", ("verdict", "newton_port")),
        ("folder", ("run", "surge_quadratic_damping", "trust")),
    ],
)
def test_a_card_is_short_and_says_what_matters(shown: dict[str, object], name: str, words: tuple[str, ...]) -> None:
    card = shown[name]
    text, html = repr(card), card._repr_html_()  # type: ignore[attr-defined]
    assert text == str(card)
    assert len(text) < MOST
    assert text.startswith(type(card).__name__)
    for word in words:
        assert word in text
    assert "Trust" not in text, "the label says it"
    assert "<b>" not in html
    assert html.startswith("<table>")


def test_a_run_shows_its_numbers_over_their_intervals_and_the_force_that_lacks(shown: dict[str, object]) -> None:
    for name in ("run", "folder"):
        html = shown[name]._repr_html_()  # type: ignore[attr-defined]
        assert "N s²/m² (-1" in html, "value, unit, interval"
        assert html.count("<circle") == 1, "one number is missing"
        assert 'aria-label="the surge force that the model lacks' in html
        assert "--after: #0072b2" in html, "its colours come along, for a notebook has not the page's"
        assert "<script" not in html
    for name in ("findings", "discovery"):
        html = shown[name]._repr_html_()  # type: ignore[attr-defined]
        assert (html.count("<circle"), "lacks" in html) == (1, False), "without a series there is no force"
    assert "<circle" not in shown["log"]._repr_html_()  # type: ignore[attr-defined]


LONG = f"First of {'many ' * 60}words. Then of {'more ' * 60}words. Last, eq. 9.4."


class Doubtful(Card):
    """Two notes, of which the first is long."""

    def card(self) -> list[tuple[str, str]]:
        return each("notes", [LONG, "A second."])


def test_a_card_has_a_line_a_note_and_cuts_only_where_a_sentence_ends() -> None:
    _, first, second = repr(Doubtful()).splitlines()
    assert first == f"  notes  First of {'many ' * 60}words. (2 sentences more)"
    assert second == "         A second."
    assert Doubtful()._repr_html_().count("<tr>") == 2


def test_the_card_of_an_inspection_tells_the_remedy(shown: dict[str, object]) -> None:
    cure = Finding(
        check="direction",
        verdict="warning",
        sentence="pwm_stbd is likely reversed",
        consequence="a model drives ahead",
        remedy="turn it round",
        fix=Fix("turned"),
    )
    card = repr(shown["inspection"].but(quality=(cure,)))  # type: ignore[attr-defined]
    assert "warning   pwm_stbd is likely reversed. A model drives ahead.\n" in card
    assert "> Turn it round ('undertow inspect LOG --fix OUT.csv' does it)." in card


def test_what_is_wrong_with_the_log_stands_above_every_result(shown: dict[str, object]) -> None:
    told = ("The starboard thruster is likely reversed.",)
    findings, comparison = (shown[name].but(warnings=told) for name in ("findings", "comparison"))  # type: ignore[attr-defined]
    for card in (findings, comparison):
        assert repr(card).splitlines()[1].split(maxsplit=1) == ["warnings", *told]
    run = replace(shown["run"], findings=findings, comparison=comparison)  # type: ignore[type-var]
    assert repr(run).count(told[0]) == 1
