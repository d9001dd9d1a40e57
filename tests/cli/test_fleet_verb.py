"""The verbs `fleet` and `merge` as a user meets them."""

from pathlib import Path

import pytest
from verbs import call, done, refused, strict

import undertow
from undertow.physics.worlds.world import simulate_world

HULL = undertow.load_vehicle("blueboat")


def test_a_fleet_is_made_added_to_and_merged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "ada").mkdir()
    simulate_world(HULL, {}, duration=30.0).write(tmp_path / "ada" / "2026-05-03.csv")
    words = ("--vehicle", "blueboat", "--workers", "1", "--out")
    said = done("fleet", tmp_path / "ada", *words, tmp_path / "fleet")
    assert "1 log of 1 boat, 29 s under way." in said
    assert "1 read, 0 there already, 0 skipped." in said
    (tmp_path / "ada" / "2026-05-04.csv").write_text("t,u\n0,1\n")
    result = call("fleet", tmp_path / "ada", *words, tmp_path / "fleet", "--json")
    assert result.exit_code == 1
    assert "skipped" in result.stderr
    told = strict(result.stdout)
    assert (told["read"], told["kept"], len(told["skipped_now"])) == (0, 1, 1)
    simulate_world(HULL, {}, duration=30.0, seed=1).write(tmp_path / "2026-05-03.csv")
    done("fleet", tmp_path / "2026-05-03.csv", *words, tmp_path / "other", "--follow", "X_u,mass")
    assert undertow.read_fleet(tmp_path / "other").parameters == ("X_u", "mass")
    said = done("merge", tmp_path / "fleet", tmp_path / "other", "--out", tmp_path / "both")
    assert "2 logs of 2 boats, 58 s under way." in said
    assert len(undertow.read_fleet(tmp_path / "both", by="log").estimates) == 2
    monkeypatch.chdir(tmp_path / "both")
    refused("fleet", tmp_path / "ada", *words, tmp_path / "x", "--follow", "X_uuu", match="did you mean 'X_uu'")
