"""The studies of short logs, of nothing hidden and of chance: they judge and tell honestly, and find no wrong name."""

import importlib
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest
from places import ROOT

from undertow.physics.errors import RequestError


@pytest.fixture(scope="module")
def studies() -> Iterator[tuple[ModuleType, ModuleType]]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "benchmarks"))
        yield importlib.import_module("log_lengths"), importlib.import_module("nothing_hidden")


@pytest.mark.parametrize(("number", "length"), [(8, 20.0), (5, 60.0), (11, 45.0)])
def test_what_a_piece_cannot_tell_gets_no_name(
    studies: tuple[ModuleType, ModuleType], number: int, length: float, monkeypatch: pytest.MonkeyPatch
):
    """A stand-in beats the truth by luck, or in one part of the piece: of these logs each piece named one for it."""
    lengths, _ = studies
    found = lengths.find_missing
    rows = round(length / lengths.STEP) + 1

    def this_piece_only(motions, nominal):
        if motions[0].time.size != rows:
            raise RequestError("another piece")
        return found(motions, nominal)

    monkeypatch.setattr(lengths, "find_missing", this_piece_only)
    record = lengths.judge(lengths.FIRST["tuning"], number)
    assert record["answers"][f"{length:g}"]["verdict"] != "refused"
    assert not lengths.wrong(record, length)


def test_a_simple_law_that_a_free_curve_refutes_is_no_name(studies: tuple[ModuleType, ModuleType]):
    """The curve costs more for its many numbers than the law of the power that stood in for it."""
    worlds = importlib.import_module("study.worlds")
    case = worlds.draw(worlds.PARTS["gentle"], 103, 17064)
    pieces = worlds.divided(case, False)
    findings = studies[0].find_missing((*pieces.train.motions, *pieces.validation.motions), case.nominal).findings
    assert set(findings.missing) <= {"thrust_curve"} == set(case.hidden)
    (law,) = [e for e in findings.candidates if e.effect == "thrust_exponent"]
    assert law.indistinguishable_from == ("thrust_curve",)


def test_a_page_counts_what_is_wrong(studies: tuple[ModuleType, ModuleType]):
    lengths, nothing = studies
    record = {
        "seed": 1,
        "vehicle": "otter",
        "programme": "rich",
        "noise": "field",
        "waves": 0.0,
        "hidden": ["sway_lift"],
    }
    named = {"verdict": "missing", "missing": ["munk_moment"], "standing": {"sway_lift": "possible"}}
    right = {"verdict": "missing", "missing": ["sway_lift"], "standing": {"sway_lift": "missing"}}
    answers = {f"{length:g}": right for length in lengths.LENGTHS} | {"20": named}
    told = lengths.page([{**record, "answers": answers}], "this")
    assert "**1 of 6 pieces of 20 to 120 s got a wrong name**: 16.7%" in told
    assert "munk_moment for sway_lift" in told
    empty = {**record, "verdict": "nothing missing", "named": [], "rolls": False, "seconds": 1.0}
    told = nothing.page([empty, {**empty, "named": ["sway_lift"]}], "this")
    assert "**1 of 2 logs got a name**" in told
    assert "seed 1 (otter, rich, field): sway_lift" in told


def test_nothing_is_named_where_nothing_is_hidden(studies: tuple[ModuleType, ModuleType], tmp_path: Path):
    _, nothing = studies
    command = ["--logs", "1", "--seeds", "tuning", "--jobs", "1", "--folder", str(tmp_path)]
    assert nothing.main([*command, "--table", str(tmp_path / "page.md")]) == 0
    page = (tmp_path / "page.md").read_text("utf-8")
    assert "**0 of 1 logs got a name**" in page
    assert nothing.main([*command, "--tell"]) == 0


def test_a_page_tells_how_rare_chance_is(studies: tuple[ModuleType, ModuleType]):
    rare = importlib.import_module("how_rare_chance_is")
    record = {"seed": 1, "part": "field", "gain": -1.0, "rolls": False}
    even = [{**record, "better": n} for n in range(0, 1000, 10)]
    assert "**0 of 14 shares" in rare.page(even, "this")
    often = [{**record, "better": 0, "gain": 2.0}, *even[::2]]
    told = rare.page([*often, *({**r, "part": "waves"} for r in often)], "this")
    assert "**1 of 14 shares" in told  # one log of 51 is among the best of 1,000
    assert "| share p of rehearsals | field (51 logs) | waves (51 logs) |" in told
    assert "| an effect earns its price | 2.0% | 2.0% |" in told


def test_the_best_effect_of_a_log_is_rehearsed(studies: tuple[ModuleType, ModuleType]):
    rare = importlib.import_module("how_rare_chance_is")
    record = rare.judge(rare.FIRST["tuning"], 1)
    assert (record["part"], record["noise"]) == ("rough", "rough")
    assert 0 <= record["better"] <= 999
    assert not record["rolls"]
