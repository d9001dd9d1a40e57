"""A run works wherever it and its logs were moved, on the very logs that it was made from and no others."""

import json
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from added_run import HIDDEN, write_added
from verbs import done, nearly, refused, strict

import undertow
from undertow.discovery.run_models import resolve_names
from undertow.physics.errors import RequestError
from undertow.workflows.run_folder.moved_files import MadeFile, Moved, logs_now, map_now
from undertow.workflows.run_folder.read import read_run_inputs
from undertow.workflows.run_folder.run_files import inputs_of


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A log and a run of it, made where both names are relative."""
    folder = tmp_path_factory.mktemp("made")
    before = Path.cwd()
    os.chdir(folder)
    write_added(Path(), report=False)
    yield folder
    os.chdir(before)


@pytest.fixture
def trip(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The same, moved as a whole; the working folder is another."""
    shutil.copytree(made, tmp_path / "trip")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    return tmp_path / "trip"


def steps(*words: str | Path) -> object:
    return strict(done("add", HIDDEN, *words, "--json"))["steps"]


def test_a_run_holds_no_path_that_nobody_gave(made: Path) -> None:
    record = json.loads((made / "run" / "run.json").read_text("utf-8"))
    assert record["from_run"] == {"logs": ["../log.csv"], "channel_map": None}
    assert str(made) not in (made / "run" / "run.json").read_text("utf-8")


def test_a_run_that_was_moved_with_its_log_works_from_anywhere(made: Path, trip: Path) -> None:
    assert read_run_inputs("../trip/run").logs == ["../trip/log.csv"]
    written = strict((made / "run" / "findings.json").read_text("utf-8"))["steps"]
    assert nearly(steps("--run", "../trip/run"), written)
    told = strict(done("check", trip / "run", "--json"))
    assert {**told, "model": ""} == {**strict((trip / "run" / "audit.json").read_text("utf-8")), "model": ""}
    done("report", "../trip/run")
    done("report", "../trip/run", "--model", "../trip/run/nominal.yaml")
    models = strict((trip / "run" / "comparison.json").read_text("utf-8"))["models"]
    assert models[-1]["rollout"] == models[0]["rollout"]
    compared = strict(done("compare", "../trip/log.csv", "-v", "blueboat", "--model", "../trip/run", "--json"))
    assert compared["models"][-1]["name"] == "run"


def test_a_run_finds_the_log_that_was_put_beside_it_or_into_it(trip: Path) -> None:
    (trip / "far").mkdir()
    run = (trip / "run").rename(trip / "far" / "run")
    with pytest.raises(RequestError, match="made from 'log.csv', which is not there .* where it is now with Moved"):
        read_run_inputs(run)
    (trip / "log.csv").rename(run / "log.csv")
    assert read_run_inputs(run).logs == [str(run / "log.csv")]
    (run / "log.csv").rename(trip / "far" / "log.csv")
    assert read_run_inputs(run).logs == [str(trip / "far" / "log.csv")]


def test_a_log_that_was_moved_and_renamed_is_pointed_at(trip: Path) -> None:
    (trip / "logs").mkdir()
    moved = (trip / "log.csv").rename(trip / "logs" / "monday.csv")
    refused("add", HIDDEN, "--run", trip / "run", match="which is not there")
    (found,) = strict(done("add", HIDDEN, "--run", trip / "run", "--log", moved, "--json"))["candidates"]
    (own,) = strict((trip / "run" / "findings.json").read_text("utf-8"))["candidates"][:1]
    assert (found["verdict"], found["confidence"]) == (own["verdict"], own["confidence"]), "what the run says of it"
    assert read_run_inputs(trip / "run", Moved((trip / "logs",))).logs == [str(moved)]
    note = strict(done("check", trip / "run", "--json"))["notes"][0]
    assert "Judged without the logs of the run" in note
    assert strict(done("check", trip / "run", "--log", moved, "--json"))["notes"] == []


def test_another_log_of_the_same_name_is_refused(trip: Path) -> None:
    (trip / "log.csv").write_text("t,u\n0,1\n", "utf-8")
    expected = r"trip/run was made from 'log\.csv' with SHA-256 [0-9a-f]{12}\.\.\., and .*trip/log\.csv has SHA-256 "
    match = expected + r"[0-9a-f]{12}\.\.\.: another file, or one that was changed since.* with --log, or make a run"
    refused("add", HIDDEN, "--run", trip / "run", match=match)
    refused("add", HIDDEN, "--run", trip / "run", "--log", trip / "log.csv", match=match)
    refused("check", trip / "run", "--log", trip / "log.csv", match=match)
    refused("report", trip / "run", "--model", "otter", "--log", trip / "log.csv", match=match)


def test_another_log_in_the_working_folder_is_passed_over(trip: Path) -> None:
    Path("log.csv").write_text("t,u\n0,1\n", "utf-8")
    assert read_run_inputs(trip / "run").logs == [str(trip / "log.csv")]


def test_a_log_is_never_written_over_wherever_it_is_now(trip: Path) -> None:
    refused("add", HIDDEN, "--run", trip / "run", "--out", trip / "log.csv", match="is read by this call")


@pytest.mark.parametrize(
    ("words", "match"),
    [
        (("add", HIDDEN, "log.csv", "-v", "otter", "--log", "log.csv"), "--log says where a log of --run is now"),
        (("check", "otter", "--log", "log.csv"), "give a run folder, and no LOG"),
        (("report", "run", "--log", "log.csv"), "--log and --map are where a --model is compared"),
        (("add", HIDDEN, "--run", "run", "--log", "none.csv"), "none.csv is not there; give the place where log.csv"),
        (("add", HIDDEN, "--run", "run", "--map", "map.yaml"), "run was made without a channel map"),
    ],
)
def test_places_of_what_is_not_read_are_refused(words: tuple[str, ...], match: str, trip: Path) -> None:
    os.chdir(trip)
    if "none.csv" in words:
        os.rename("log.csv", "away.csv")
    refused(*words, match=match)


def test_several_logs_are_known_by_their_content(tmp_path: Path) -> None:
    from undertow.measurements.formats.registry import log_digests

    for name in "ab":
        (tmp_path / f"{name}.csv").write_text(f"t,u\n0,{ord(name)}\n", "utf-8")
    digests = [log_digests([str(tmp_path / f"{name}.csv")])[0]["sha256"] for name in "ab"]
    made = [MadeFile(f"gone/{name}.csv", None, digest) for name, digest in zip("ab", digests, strict=True)]
    there = [str(tmp_path / f"{name}.csv") for name in "ab"]
    assert logs_now(tmp_path / "run", made, Moved(tuple(reversed(there)))) == there
    assert logs_now(tmp_path / "run", made, Moved((tmp_path,))) == there
    (tmp_path / "c.csv").write_text("t,u\n0,1\n", "utf-8")
    here = [MadeFile(path, None, digest) for path, digest in zip(there, digests, strict=True)]
    with pytest.raises(RequestError, match=r"c\.csv is none of the logs that .* is of"):
        logs_now(tmp_path / "run", here, Moved((tmp_path / "c.csv",)))
    assert logs_now(tmp_path / "run", here, Moved((tmp_path / "c.csv",), of_several=True)) == there
    unknown = [MadeFile("gone/a.csv"), MadeFile("gone/b.csv")]
    assert logs_now(tmp_path / "run", unknown, Moved(tuple(reversed(there)))) == there


def test_a_map_is_found_and_checked_like_a_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from undertow.measurements.formats.registry import log_digests

    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    mapped, other = tmp_path / "channels.yaml", tmp_path / "other.yaml"
    mapped.write_text("channels: {}\n", "utf-8")
    other.write_text("channels: {u: {field: v}}\n", "utf-8")
    made = MadeFile("channels.yaml", "../channels.yaml", log_digests([str(mapped)])[0]["sha256"])
    assert map_now(tmp_path / "run", made) == str(mapped)
    Path("channels.yaml").write_text("channels: {psi: {field: v}}\n", "utf-8")
    assert map_now(tmp_path / "run", made) == str(mapped), "that of the working folder is another"
    moved = mapped.rename(tmp_path / "here" / "mine.yaml")
    assert map_now(tmp_path / "run", made, moved) == str(moved)
    with pytest.raises(RequestError, match=r"other\.yaml has SHA-256 .* with Reading\(channel_map=\.\.\.\)"):
        map_now(tmp_path / "run", made, other)
    assert map_now(tmp_path / "run", None) is None


def test_a_run_is_compared_where_its_log_is(trip: Path) -> None:
    from undertow.workflows.compare import compare_run

    found = compare_run(trip / "run", (), Moved((trip / "log.csv",)))
    assert found.logs == (str(trip / "log.csv"),)
    with pytest.raises(undertow.RequestError, match="another file"):
        compare_run(trip / "run", (), Moved((trip / "run" / "series.csv",)))


def test_a_run_that_names_itself_as_its_log_is_no_circle(trip: Path) -> None:
    record = json.loads((trip / "run" / "run.json").read_text("utf-8"))
    record |= {"logs": ["."], "from_run": {"logs": ["."], "channel_map": None}}
    (trip / "run" / "run.json").write_text(json.dumps(record), "utf-8")
    assert trip / "run" / "model.yaml" in list(inputs_of([trip / "run"]))


def test_an_effect_of_a_thruster_is_added_where_the_run_found_it(trip: Path) -> None:
    path = trip / "run" / "findings.json"
    told = json.loads(path.read_text("utf-8"))
    told["steps"] += [told["steps"][-1] | {"added": "thruster_asymmetry", "thruster": "stbd"}]
    path.write_text(json.dumps(told))
    found = read_run_inputs(trip / "run").findings
    assert resolve_names(found, ["thruster_asymmetry", HIDDEN]) == ["thruster_asymmetry[stbd]", HIDDEN]
    assert resolve_names(found, ["thruster_asymmetry[port]", "yaw:u|r|"]) == ["thruster_asymmetry[port]", "yaw:u|r|"]
    path.unlink()
    assert resolve_names(read_run_inputs(trip / "run").findings, ["thruster_asymmetry"]) == ["thruster_asymmetry"]


def test_a_run_that_was_read_back_goes_on_where_it_ended(made: Path, trip: Path) -> None:
    run = undertow.load_run(trip / "run")
    assert run.settings == undertow.DiscoverySettings(refit=False)
    assert run.inputs is run.inputs, "read once"
    again = undertow.add([HIDDEN], run.inputs, run.settings, progress=None).findings.steps
    ends = [steps[-1].rollout_rmse["10"].position for steps in (again, run.findings.steps)]
    assert ends[0] == pytest.approx(ends[1])
    moved = (trip / "log.csv").rename(trip / "far.csv")
    gone = undertow.load_run(trip / "run")
    with pytest.raises(RequestError, match=r"which is not there .* where it is now with Moved\(logs=\[\.\.\.\]\)"):
        _ = gone.inputs
    assert undertow.load_run(trip / "run", Moved((moved,))).inputs.paths == (str(moved),)
    record = json.loads((trip / "run" / "run.json").read_text("utf-8"))
    (trip / "run" / "run.json").write_text(json.dumps(record | {"log_sha256": [], "refit": True, "seed": 3}), "utf-8")
    of_table = undertow.load_run(trip / "run")
    assert (of_table.settings.seed, of_table.settings.refit) == (3, True)
    assert read_run_inputs(trip / "run", Moved((moved,))).settings == of_table.settings
    with pytest.raises(RequestError, match=r"a log that was in memory is given again, to read_inputs"):
        _ = of_table.inputs
