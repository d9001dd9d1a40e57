"""A fleet folder: what is in it, what is not read again, what is named, and that it does not depend on who worked."""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import undertow
from undertow.fleet.build_fleet import build_fleet
from undertow.fleet.fleet_folder import merge_fleets, read_index
from undertow.fleet.parameter_estimates import read_fleet
from undertow.fleet.workers import Engine
from undertow.physics.worlds.world import simulate_world

HULL = undertow.load_vehicle("blueboat")
ALONE = Engine(workers=1)


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two boats with two logs each, and a broken one."""
    folder = tmp_path_factory.mktemp("logs")
    for n, name in enumerate(("ada/2026-05-03.csv", "ada/2026-05-04.csv", "bo/2026-05-03.csv", "bo/2026-05-03b.csv")):
        (folder / name).parent.mkdir(exist_ok=True)
        simulate_world(HULL, {"surge_quadratic_damping": -6.0 * (n > 1)}, duration=40.0, seed=n).write(folder / name)
    (folder / "bo" / "broken.csv").write_text("time,topic,field,value\n0.0,odometry,u,much\n")
    return folder


def built(logs: Path, out: Path, engine: Engine = ALONE):
    return build_fleet(logs, HULL, out, engine=engine, progress=None)


def content(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.fixture(scope="module")
def fleet(logs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("made") / "fleet"
    done = built(logs, out)
    assert (done.read, done.kept) == (4, 0)
    assert [Path(one.log).name for one in done.skipped] == ["broken.csv"]
    assert "holds no number in any of its 1 rows" in done.skipped[0].problem
    return out


def test_boats_days_and_values_are_told(fleet: Path):
    found = read_fleet(fleet)
    assert found.parameters[-3:] == ("thrusters.port.scale", "thrusters.stbd.scale", "mass")
    told = {(e.boat, int(e.time // 86400) - 20576): len(e.source.split(", ")) for e in found.estimates}
    assert told == {("ada", 0): 1, ("ada", 1): 1, ("bo", 0): 2}
    assert [e.time for e in found.estimates] == sorted(e.time for e in found.estimates)
    assert [e.time % 86400 for e in found.estimates] == pytest.approx([20.0] * 3, abs=3.0)
    at = found.parameters.index("X_uu")
    ada, bo = (next(e for e in found.estimates if e.boat == boat) for boat in ("ada", "bo"))
    for one, true in ((ada, -8.0), (bo, -14.0)):
        assert abs(one.values[at] - true) < 4.0 * np.sqrt(one.covariance[at, at])
    assert bo.hours == pytest.approx(2 * ada.hours, rel=0.1)
    assert len(read_fleet(fleet, by="log").estimates) == 4
    assert [Path(log).name for log in found.missing] == ["broken.csv"]


def test_a_broken_log_changes_nothing_of_the_others(fleet: Path, logs: Path, tmp_path: Path):
    sound = [p for p in sorted(logs.rglob("*.csv")) if p.name != "broken.csv"]
    build_fleet(sound, HULL, tmp_path / "sound", engine=ALONE, progress=None)
    assert read_index(tmp_path / "sound").logs == read_index(fleet).logs
    for one, other in zip(read_fleet(tmp_path / "sound").estimates, read_fleet(fleet).estimates, strict=True):
        assert np.array_equal(one.values, other.values)


def test_workers_and_order_do_not_show(fleet: Path, logs: Path, tmp_path: Path):
    built(logs, tmp_path / "two", Engine(workers=2))
    assert content(tmp_path / "two") == content(fleet)


def test_what_is_there_is_not_read_again(fleet: Path, logs: Path, tmp_path: Path):
    before = content(fleet)
    done = built(logs, fleet)
    assert (done.read, done.kept) == (0, 4)
    assert content(fleet) == before
    one, rest = logs / "ada" / "2026-05-03.csv", logs / "bo"
    build_fleet(one, HULL, tmp_path / "grown", engine=ALONE, progress=None)
    touched = one.stat().st_mtime_ns
    os.utime(one)  # not changed: its bytes tell
    done = build_fleet([one, rest], HULL, tmp_path / "grown", engine=ALONE, progress=None)
    os.utime(one, ns=(touched, touched))
    assert (done.read, done.kept) == (2, 1)
    build_fleet(logs / "ada", HULL, tmp_path / "grown", engine=ALONE, progress=None)
    assert len(read_index(tmp_path / "grown").logs) == 4
    (broken,) = (tmp_path / "grown" / "factors" / f"{key.factors}.npz" for key in read_index(fleet).logs[:1])
    broken.write_bytes(broken.read_bytes()[:5000])
    assert built(logs, tmp_path / "grown").read == 1
    assert {n for n in content(tmp_path / "grown") if "factors" in n} == {n for n in before if "factors" in n}


def test_names_are_those_of_no_working_folder(logs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    for boat in ("ada", "bo"):
        monkeypatch.chdir(logs / boat)
        done = built(Path("2026-05-03.csv"), tmp_path / "fleet")
    assert [(log.boat, log.log) for log in sorted(done.index.logs, key=lambda log: log.boat)] == [
        (boat, str(logs / boat / "2026-05-03.csv")) for boat in ("ada", "bo")
    ]


def test_an_interrupted_call_goes_on(logs: Path, fleet: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    from undertow.fleet import build_fleet as module

    def stops(*words):
        yield next(answers := module_mapped(*words))
        del answers
        raise KeyboardInterrupt

    module_mapped = module.mapped
    with monkeypatch.context() as patch:
        patch.setattr(module, "mapped", stops)
        with pytest.raises(KeyboardInterrupt):
            built(logs, tmp_path / "fleet")
    assert len(list((tmp_path / "fleet" / "factors").iterdir())) == 1
    assert built(logs, tmp_path / "fleet").read == 3
    assert content(tmp_path / "fleet") == content(fleet)


def test_the_same_bytes_count_once_and_a_log_without_a_day_is_named(logs: Path, tmp_path: Path):
    log = (logs / "ada" / "2026-05-03.csv").read_bytes()
    for name in ("one/2026-05-03.csv", "one/2026-05-04.csv", "one/undated.csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(log + b"\n" * ("undated" in name))
    done = built(tmp_path / "one", tmp_path / "fleet")
    assert (done.read, done.kept) == (1, 0)
    assert [one.problem[:38] for one in done.skipped] == [
        "it has the same bytes as " + str(tmp_path)[:13],
        "neither the log, nor its name, nor a m",
    ]
    assert json.loads((tmp_path / "fleet" / "fleet.json").read_text())["schema"] == "undertow.fleet/1"
    (tmp_path / "another").mkdir()
    copy = tmp_path / "another" / "2026-05-03.csv"
    copy.write_bytes(log)
    (twice,) = built(copy, tmp_path / "fleet").skipped  # whichever call it came with
    assert twice.log == str(tmp_path / "one" / "2026-05-03.csv")
    copy.rename(tmp_path / "another" / "2026-05-04.csv")
    (tmp_path / "one" / "2026-05-03.csv").unlink()
    (tmp_path / "one" / "undated.csv").unlink()
    done = built(tmp_path / "another", tmp_path / "fleet")
    assert ([one.boat for one in done.index.logs], done.skipped) == (["another"], ())
    assert not [one.log for one in done.index.skipped if "undated" in one.log]  # it is not there any more


def test_a_vehicle_that_changed_is_told(logs: Path, tmp_path: Path):
    heavier = HULL.with_values({"mass": 35.0})
    first, second = logs / "ada" / "2026-05-03.csv", logs / "ada" / "2026-05-04.csv"
    built(first, tmp_path / "fleet")
    done = build_fleet(second, heavier, tmp_path / "fleet", engine=ALONE, progress=None)
    assert done.index.of_several_vehicles == ("ada",)
    built(logs / "bo", tmp_path / "fleet")
    assert read_fleet(tmp_path / "fleet").nominal[-1] == HULL.mass  # three logs against one, in whatever order
    done = build_fleet(logs / "ada", heavier, tmp_path / "fleet", engine=ALONE, progress=None)
    assert (done.read, done.index.of_several_vehicles) == (1, ())
    before = [log.factors for log in done.index.logs]
    done = build_fleet(logs / "ada", "otter", tmp_path / "fleet", engine=ALONE, progress=None)
    assert [log.factors for log in done.index.logs] == before  # no vehicle of these logs: what they said stays
    assert {"What an earlier call read of it stays" in one.problem for one in done.skipped} == {True}
    assert len(read_fleet(tmp_path / "fleet", by="log").estimates) == 4
    (tmp_path / "m.csv").write_text(f"log,vehicle\n{first},none.yaml\n")
    with pytest.raises(undertow.VehicleError, match="2026-05-03.csv, by the manifest: .*none.yaml"):
        built(tmp_path / "m.csv", tmp_path / "fleet")


def test_fleets_are_merged(fleet: Path, logs: Path, tmp_path: Path):
    for boat in ("ada", "bo"):
        built(logs / boat, tmp_path / boat)
    merge_fleets([tmp_path / "bo", tmp_path / "ada"], tmp_path / "both")
    assert content(tmp_path / "both") == content(fleet)
    with pytest.raises(undertow.RequestError, match="with 2 logs that are in none of the others"):
        merge_fleets([tmp_path / "bo", tmp_path / "bo"], tmp_path / "both")
    build_fleet(logs / "ada", HULL, tmp_path / "other", follow=["X_u"], engine=ALONE, progress=None)
    with pytest.raises(undertow.RequestError, match="got two ways of reading it"):
        merge_fleets([fleet, tmp_path / "other"], tmp_path / "none")
    index = json.loads((tmp_path / "ada" / "fleet.json").read_text())
    index["logs"][0] |= {"sha256": 64 * "0", "factors": 64 * "0"}
    (tmp_path / "other" / "fleet.json").write_text(json.dumps(index))
    with pytest.raises(undertow.RequestError, match="got two with other bytes; where it grew"):
        merge_fleets([fleet, tmp_path / "other"], tmp_path / "none")
    with pytest.raises(undertow.RequestError, match="expected two fleets or more, got 1"):
        merge_fleets([fleet], tmp_path / "none")
    for name, got in (("", "one without fleet.json"), ("none", "no such folder"), ("bo/broken.csv", "a file")):
        with pytest.raises(undertow.RequestError, match=f"expected the folder of a fleet, got {got}; 'undertow fleet"):
            merge_fleets([fleet, logs / name], tmp_path / "none")


def test_nothing_of_the_users_is_lost(fleet: Path, logs: Path, tmp_path: Path):
    (tmp_path / "letters").mkdir()
    (tmp_path / "letters" / "fleet.json").write_text("{}")
    with pytest.raises(undertow.RequestError, match="expected schema .* take it away first"):
        built(logs, tmp_path / "letters")
    with pytest.raises(undertow.RequestError, match="holds .* which is read"):
        built(logs, logs)
    with pytest.raises(undertow.RequestError, match="at least one log that can be read, got 1"):
        built(logs / "bo" / "broken.csv", tmp_path / "none")


def test_a_cluster_gives_the_same_bytes(logs: Path, fleet: Path, tmp_path: Path):
    from distributed import LocalCluster

    made: Any = LocalCluster(n_workers=1, processes=False, protocol="tcp://", host="127.0.0.1", dashboard_address=":0")
    with made as cluster:
        built(logs, tmp_path / "fleet", Engine(scheduler=cluster.scheduler_address))
    assert content(tmp_path / "fleet") == content(fleet)


def test_a_scheduler_that_is_not_there_is_told(logs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("undertow.fleet.workers._PATIENCE", "0.2s")
    with pytest.raises(undertow.RequestError, match="expected one that answers, got none"):
        built(logs, tmp_path / "fleet", Engine(scheduler="tcp://127.0.0.1:9"))
