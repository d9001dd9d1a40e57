"""Run folders and files under attack: what was tampered with is refused, and what is written is whole or not at all."""

import json
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NoReturn

import pytest
from added_run import HIDDEN, write_added
from verbs import call, done, files, refused

import undertow


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for a short simulated log and a run of it; tests leave both as they are."""
    return tmp_path_factory.mktemp("place")


@pytest.fixture(scope="module", autouse=True)
def found(place: Path) -> undertow.Run:
    """The run, in the folder and as the Python functions give it."""
    return write_added(place, report=True)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


# Runs that are broken, or whose log is gone


@pytest.fixture
def copy(place: Path, here: Path) -> Path:
    """A copy of the run folder, to be spoilt."""
    folder = here / "run"
    folder.mkdir()
    for name, data in files(place / "run").items():
        (folder / name).write_bytes(data or b"")
    return folder


def spoil(path: Path, *keys: str | int, value: Any) -> None:
    """Replace one entry of a JSON file."""
    content = json.loads(path.read_text("utf-8"))
    part = content
    for key in keys[:-1]:
        part = part[key]
    part[keys[-1]] = value
    path.write_text(json.dumps(content), "utf-8")


@pytest.mark.parametrize(
    ("name", "keys", "value", "match"),
    [
        (
            "findings",
            ["schema"],
            "undertow.findings/9",
            r"expected schema 'undertow.findings/2', got 'undertow.findings/9",
        ),
        ("findings", ["candidates"], "all", r"expected a list under 'candidates', got 'all'"),
        (
            "findings",
            ["candidates", 0, "terms"],
            ["X_uu"],
            r"expected an object under 'candidates\[0\]\.terms\[0\]'",
        ),
        ("findings", ["candidates", 0], {}, r"candidates\[0\] lacks 'effect', 'verdict', 'confidence', 'error_drop'"),
        ("findings", ["unnamed"], 5, r"expected a list under 'unnamed', got 5"),
        ("findings", ["failures"], [1], r"expected an object under 'failures\[0\]', got 1"),
        ("findings", ["advice"], {}, r"expected a list under 'advice', got \{\}"),
        ("findings", ["steps"], [], r"expected at least one entry in 'steps'"),
        (
            "findings",
            ["steps", 1, "rollout_rmse"],
            None,
            r"expected an object under 'steps\[1\]\.rollout_rmse'",
        ),
        ("findings", ["steps", 1, "rollout_rmse", "soon"], {}, r"expected errors by axis, and by horizon in seconds"),
        ("findings", ["data"], "much", r"expected an object under 'data', got 'much'"),
        ("findings", ["criterion"], [1], r"expected an object under 'criterion', got \[1\]"),
        (
            "findings",
            ["candidates", 0, "confidence"],
            float("nan"),
            r"findings\.json is not valid JSON \(NaN is not JSON",
        ),
        ("comparison", ["models"], {}, r"expected a list under 'models', got \{\}"),
        ("comparison", ["models", 0, "acceleration"], 5, r"expected an object under 'models\[0\].acceleration', got 5"),
        ("comparison", ["models", 0, "rollout"], [5], r"expected an object under 'models\[0\].rollout', got \[5\]"),
        ("comparison", ["failures"], "many", r"expected a list under 'failures', got 'many'"),
        ("comparison", ["logs"], 3, r"expected a list under 'logs', got 3"),
    ],
)
def test_a_tampered_run_gets_no_page(name: str, keys: list[str | int], value: Any, match: str, copy: Path) -> None:
    spoil(copy / f"{name}.json", *keys, value=value)
    message = refused("report", "run", match=match)
    assert f"run/{name}.json" in message
    assert "run 'undertow discover LOG --vehicle V --out RUN' to write the folder anew" in message


def test_a_run_without_its_files_gets_no_page(copy: Path) -> None:
    (copy / "series.csv").unlink()
    refused("report", "run", match=r"run folder run has no series\.csv; run 'undertow discover")


@pytest.mark.parametrize(
    ("key", "value"), [("logs", "log.csv"), ("logs", []), ("logs", [1]), ("frame", 3), ("channel_map", ["a"])]
)
def test_a_tampered_record_of_a_run(key: str, value: Any, copy: Path) -> None:
    spoil(copy / "run.json", key, value=value)
    refused("add", HIDDEN, "--run", "run", match=r"run/run\.json: expected paths under 'logs', a text or null under")


def test_a_network_is_no_run_to_add_to(here: Path) -> None:
    Path("lstm").mkdir()
    Path("lstm", "model.yaml").write_text("schema: undertow.network/1\n", "utf-8")
    match = r"lstm is the folder of a trained network, not of a run: .* 'undertow discover' wrote, or --vehicle V and"
    refused("add", HIDDEN, "--run", "lstm", match=match)


def test_a_run_whose_log_is_gone(copy: Path) -> None:
    spoil(copy / "run.json", "logs", value=["gone.csv"])
    spoil(copy / "run.json", "from_run", value=None)
    match = r"run was made from 'gone\.csv', which is not there \(seen from .*\); put it beside .* now with --log"
    refused("add", HIDDEN, "--run", "run", match=match)


def test_a_run_whose_log_has_a_name_too_long_for_any_file(copy: Path) -> None:
    spoil(copy / "run.json", "logs", value=["x" * 5000])
    spoil(copy / "run.json", "from_run", value=None)
    refused("add", HIDDEN, "--run", "run", match=r"run was made from 'xxxx.*', which is not there")


# Writing: whole or not at all


def failing(error: BaseException) -> Callable[..., NoReturn]:
    def fail(*_: Any, **__: Any) -> NoReturn:
        raise error

    return fail


def full_disk() -> OSError:
    return OSError(28, "No space left on device")


@pytest.fixture(params=["new", "earlier"])
def target(request: pytest.FixtureRequest, place: Path, here: Path) -> Iterator[Path]:
    """A run folder to be written, once where there is none and once over an earlier run; in the end it is as before."""
    folder = here / "run"
    if request.param == "earlier":
        shutil.copytree(place / "run", folder)
        (folder / "notes.txt").write_text("mine")
    before = files(here)
    yield folder
    assert files(here) == before


@pytest.mark.parametrize(
    "step", ["undertow.workflows.run_folder.write.write_json", "undertow.workflows.run_folder.write.write_page"]
)
@pytest.mark.parametrize("error", [full_disk(), KeyboardInterrupt()], ids=["full disk", "interrupted"])
def test_a_write_that_fails_leaves_nothing(
    step: str, error: BaseException, target: Path, found: undertow.Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(step, failing(error))
    match = r"cannot write the run to .*run: No space left on device" if isinstance(error, OSError) else None
    with pytest.raises((undertow.RequestError, KeyboardInterrupt), match=match):
        undertow.write_run(found, target)


def test_an_earlier_run_is_replaced_and_other_files_stay(place: Path, here: Path, found: undertow.Run) -> None:
    folder = here / "run"
    shutil.copytree(place / "run", folder)
    (folder / "notes.txt").write_text("mine")
    undertow.write_run(found, "run", report=False)
    new = {name: data for name, data in files(place / "run").items() if name != "report.html"}
    assert files(folder) == {**new, "notes.txt": b"mine"}


@pytest.mark.parametrize(
    "command",
    [
        "simulate -v blueboat --duration 20 --out FILE",
        "check blueboat --out FILE --json",
        "compare LOG -v blueboat --series FILE",
    ],
)
def test_a_file_that_is_replaced_is_named(command: str, place: Path, here: Path) -> None:
    words = command.replace("LOG", str(place / "log.csv")).replace("FILE", "file").split()
    first = call(*words)
    second = call(*words)
    assert (first.exit_code, second.exit_code) == (0, 0), second.stderr
    assert "replaced" not in first.stderr
    assert "  replaced the earlier file\n" in second.stderr
    assert "replaced" not in second.stdout


def test_bad_input_leaves_an_earlier_run_alone(copy: Path) -> None:
    refused("discover", "none.csv", "-v", "blueboat", "--out", "run", match="none.csv: no such file")


@pytest.mark.parametrize(
    "command",
    [
        "simulate -v blueboat --duration 20 --out new.csv",
        "simulate -v blueboat --duration 20 --out earlier.csv",
        f"add {HIDDEN} --run RUN --out boat.yaml",
        "discover LOG -v blueboat --out new",
        "compare LOG -v blueboat --page new",
        "report run",
    ],
)
def test_a_verb_that_cannot_write_leaves_what_was_there(
    command: str, place: Path, copy: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done("simulate", "-v", "blueboat", "--duration", "20", "--seed", "3", "--out", "earlier.csv")
    undertow.load_vehicle(place / "run" / "model.yaml").save("boat.yaml", by="add")
    monkeypatch.setattr(os, "replace", failing(full_disk()))
    named = {"LOG": place / "log.csv", "RUN": place / "run"}
    refused(*(named.get(word, word) for word in command.split()), match="No space left on device")
