"""The verb `effects`: the catalogue, and one effect."""

import numpy as np
from verbs import call, done, strict

from undertow.physics.effects import EFFECTS
from undertow.reports.terminal.laws_and_effects_screen import blocks


def test_the_list_has_every_effect_with_its_symbols() -> None:
    said = done("effects")
    assert all(effect.name in said for effect in EFFECTS)
    assert "X_uu u_r |u_r|" in said
    assert max(map(len, said.splitlines())) <= 80


def test_one_effect_says_all_that_a_person_asks() -> None:
    said = " ".join(done("effects", "munk_moment", "--vehicle", "otter").split())
    for words in ("N += N_uv u_r v_r", "N s²/m", "0 means absent", "on Otter USV", "sway added mass", "zigzag"):
        assert words in said
    assert "undertow simulate --vehicle otter --effect munk_moment=" in said
    assert "█" in said


def test_machines_may_read_it() -> None:
    every = strict(done("effects", "--json"))
    assert (every["schema"], len(every["effects"])) == ("undertow.effects/1", len(EFFECTS))
    (one,) = strict(done("effects", "steady_current", "--vehicle", "otter", "--json"))["effects"]
    assert [p["symbol"] for p in one["parameters"]] == ["current_north", "current_east"]
    assert set(one["typical"]) == {"current_north", "current_east"}


def test_symbols_and_the_tools_own_spellings_are_understood() -> None:
    for name in ("N_uv", "Munk moment", "munk_moment"):
        assert done("effects", name, "--vehicle", "otter").startswith("Munk moment")
    assert done("effects", "thruster_asymmetry[stbd]", "--vehicle", "otter").startswith("thruster asymmetry")


def test_an_unknown_name_is_answered_with_the_nearest() -> None:
    result = call("effects", "munk")
    assert (result.exit_code, result.stdout) == (2, "")
    assert "did you mean 'munk_moment'" in result.stderr


def test_a_line_of_blocks_goes_from_the_least_to_the_largest() -> None:
    assert blocks(np.array([0.0, 1.0, 2.0, 7.0]), 4) == "▁▂▃█"
    assert blocks(np.array([2.0, 2.0]), 2) == "▄▄"
