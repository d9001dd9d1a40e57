"""What objects show of themselves in a console and a notebook is short, and says what a person asks first."""

from pathlib import Path

import pytest

import undertow
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
        "folder": undertow.load_run(Path(undertow.write_run(run, folder / "run", report=False))),
    }


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("log", ("log<b>.csv", "newton_port (10 Hz)", "psi (20 Hz)")),
        ("inputs", ("BlueBoat", "stretch", "test; all rows where models are searched")),
        ("motion", ("rows", "at 20 Hz", "port, stbd", "surge")),
        ("run", ("The model is missing surge quadratic damping", "X_uu = -1", "trust", "corrected")),
        ("findings", ("missing", "X_uu = -1", "N s²/m²")),
        ("comparison", ("judged on", "nominal", "corrected")),
        ("audit", ("verdict", "dissipation")),
        ("discovery", ("added", "surge_quadratic_damping")),
        ("fit", ("Calibrated", "X_u", "->")),
        ("draft", ("newton_port (port)", "to look at")),
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
    assert "<b>" not in html
    assert html.startswith("<table>")
