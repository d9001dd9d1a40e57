"""Refusals of the command line: exit code 2, one message on stderr, nothing on stdout, nothing on the disk."""

import gzip
import os
import random
import re
import sys
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from added_run import HIDDEN, write_added
from verbs import SCRIPT, call, files, process, refused

from undertow.physics.vehicle import load_vehicle

TIME = np.arange(0.0, 40.0, 0.1)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a short simulated log and a run of it; tests leave both as they are."""
    folder = tmp_path_factory.mktemp("place")
    write_added(folder, report=False)
    return folder


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def wide(**columns: Any) -> str:
    """A wide log of a boat that circles, 40 s at 10 Hz; columns are replaced, or left out with None."""
    table = {
        "t": TIME,
        "x": np.sin(0.2 * TIME),
        "y": 1.0 - np.cos(0.2 * TIME),
        "psi": (0.2 * TIME + np.pi) % (2.0 * np.pi) - np.pi,
        "u": 0.2 + 0.0 * TIME,
        "v": 0.0 * TIME,
        "r": 0.2 + 0.0 * TIME,
        "newton_port": 5.0 + 0.0 * TIME,
        "newton_stbd": 4.0 + 0.0 * TIME,
        **columns,
    }
    text = StringIO()
    pd.DataFrame({name: column for name, column in table.items() if column is not None}).to_csv(text, index=False)
    return text.getvalue()


RUBBISH = bytes([0, 255, 10, 13, *random.Random(1).randbytes(4000)])
EXPECTED = r"expected a CSV or Parquet table with the header 'time,topic,field,value'"

BAD_LOGS: dict[str, tuple[str, bytes | str, str]] = {
    "empty": ("log.csv", b"", rf"log\.csv: the file is empty; {EXPECTED}"),
    "header alone": ("log.csv", b"t,u,v,r\n", r"log\.csv: a header but no rows; the log is empty"),
    "rubbish": ("log.csv", RUBBISH, rf"log\.csv: got binary content; {EXPECTED}"),
    "rubbish as gzip": ("log.csv.gz", RUBBISH, rf"log\.csv\.gz: got binary content; {EXPECTED}"),
    "rubbish as Parquet": ("log.parquet", RUBBISH, rf"log\.parquet: got binary content; {EXPECTED}"),
    "broken gzip": (
        "log.csv.gz",
        gzip.compress(wide().encode())[:900],
        r"log\.csv\.gz: a broken gzip file .*Copy the log again",
    ),
    "broken Parquet": ("log.parquet", b"PAR1" + RUBBISH, r"log\.parquet: a broken Parquet file .*Copy the log again"),
    "no time": ("log.csv", wide(t=None), r"log\.csv: got the header 'x,y,psi,u,v,r,.*'; expected a CSV or Parquet"),
    "no heading": (
        "log.csv",
        wide(psi=None),
        r"log\.csv: expected a heading \(psi or a quaternion\), got only x y u v",
    ),
    "no command": (
        "log.csv",
        wide(newton_stbd=None),
        r"log\.csv: missing command channel newton_stbd of thruster 'stbd'; commands in the log: newton_port",
    ),
    "time runs back": (
        "log.csv",
        wide(t=np.where(TIME < 20.0, TIME, TIME - 5.0)),
        r"log\.csv: time runs backwards in x \(x\) at row 202: 15\.0+ s after 19\.9\d* s\. Sort the log",
    ),
    "only NaN": (
        "log.csv",
        wide(r=np.nan * TIME),
        r"log\.csv: r \(r\) holds no number in any of its 400 rows.*'r: null' in a channel map",
    ),
    "PWM": (
        "log.csv",
        wide(newton_port=None, pwm_port=np.where(TIME < 3.0, 1500.0, 2201.0)),
        r"pwm_port .* must lie within 800 to 2200 \[us\], got 2201 at t = 3\.000 s",
    ),
    "another kind of command": (
        "log.csv",
        wide(newton_port=None, pwm_port=1500.0 + 0.0 * TIME),
        r"log\.csv: wrong command kind: the vehicle wants newton_port \[N\] for thruster 'port', the log has pwm_port",
    ),
    "too short": (
        "log.csv",
        "\n".join(wide().splitlines()[:191]),
        r"log\.csv: expected at least 20 s of usable log, got 1\d\.\d s .*Record longer",
    ),
}


@pytest.mark.parametrize("case", BAD_LOGS)
def test_bad_logs(case: str, here: Path) -> None:
    name, content, match = BAD_LOGS[case]
    Path(name).write_bytes(content.encode() if isinstance(content, str) else content)
    words = [name, "--vehicle", "blueboat"]
    message = refused("discover", *words, "--out", "run", match=match)
    assert refused("compare", *words, match=match) == message
    assert refused("add", HIDDEN, *words, "--out", "new.yaml", match=match) == message
    assert not Path("run").exists()


@pytest.mark.parametrize("verb", ["inspect", "compare", "discover", "add"])
def test_logs_that_are_no_files(verb: str, here: Path) -> None:
    words = {
        "inspect": [],
        "compare": ["-v", "blueboat"],
        "discover": ["-v", "blueboat", "--out", "run"],
        "add": ["-v", "blueboat"],
    }[verb]
    first = [verb, HIDDEN] if verb == "add" else [verb]
    Path("folder").mkdir()
    refused(*first, "none.csv", *words, match=r"none\.csv: no such file; expected a log .*Check the path")
    refused(*first, "folder", *words, match=r"folder: expected a folder of logs, got no file; expected a CSV")


def test_a_log_given_twice(place: Path, here: Path) -> None:
    Path("log.csv").write_bytes((place / "log.csv").read_bytes())
    again = r"log\.csv is given twice; held-out rows would also be training rows\. Give it once"
    refused("discover", "log.csv", "./log.csv", "-v", "blueboat", "--out", "run", match=again)
    refused("compare", "log.csv", here / "log.csv", "-v", "blueboat", match=again)


def test_a_real_process_refuses_alike(here: Path) -> None:
    ran = process(SCRIPT, "discover", "none.csv", "-v", "blueboat", "--out", "run", cwd=here)
    assert (ran.returncode, ran.stdout, files(here)) == (2, "", {})
    assert (
        ran.stderr
        == "undertow: none.csv: no such file; expected a log (CSV, CSV.gz, Parquet, a bag, ...). Check the path.\n"
    )
    ran = process(sys.executable, "-m", "undertow", "discover", cwd=here)
    assert (ran.returncode, ran.stdout) == (2, "")
    assert "Missing argument 'LOG...'" in ran.stderr


@pytest.mark.skipif(sys.platform in ("win32", "darwin"), reason="file names are text there")
def test_a_log_whose_name_is_no_text(place: Path, here: Path) -> None:
    name = os.fsdecode(b"l\xf6g.csv")
    Path(name).write_bytes((place / "log.csv").read_bytes())
    match = r"'l\\udcf6g\.csv': the file name is not UTF-8, so no report could name it; rename it"
    refused("compare", name, "-v", "blueboat", match=match)


def boat(path: str, value: Any) -> str:
    """The BlueBoat's file with the entry at a dotted path replaced."""
    data = load_vehicle("blueboat").model_dump(mode="json")
    *parents, last = path.split(".")
    part = data
    for key in parents:
        part = part[key]
    part[last] = value
    return yaml.safe_dump(data)


BAD_VEHICLES: dict[str, tuple[bytes | str, str]] = {
    "no mass": (boat("mass", 0.0), r"vehicle file boat\.yaml: mass: expected a number above 0, got 0\.0"),
    "negative mass": (boat("mass", -22.0), r"mass: expected a number above 0, got -22"),
    "negative inertia": (boat("inertia_z", -1.0), r"inertia_z: expected a number above 0, got -1"),
    "M": (
        boat("added_mass.X_udot", 31.0),
        r"the mass matrix M = M_RB \+ M_A is not positive definite: m11=-0\.5, .*X_udot = -2\.6 adds 2\.6 kg",
    ),
    "M off its diagonal": (boat("added_mass.Y_rdot", 40.0), r"M_A is not positive definite: .*m23=-41\.6952"),
    "unknown key": (boat("mas", 3.0), r"unknown key 'mas' in the vehicle file: did you mean 'mass'"),
    "unknown symbol": (boat("damping.X_uuu", -1.0), r"unknown key 'X_uuu' in damping: did you mean 'X_uu'"),
    "infinite": (boat("mass", float("inf")), r"mass: expected a finite number of at most 1e\+18, got inf"),
    "empty": (b"", r"vehicle file boat\.yaml: expected a mapping of vehicle keys \(mass, .*, got NoneType"),
    "rubbish": (RUBBISH, r"vehicle file boat\.yaml: not readable as YAML"),
    "no YAML": (b"mass: [1, 2", r"vehicle file boat\.yaml: not readable as YAML"),
}


@pytest.mark.parametrize("case", BAD_VEHICLES)
def test_bad_vehicles(case: str, place: Path, here: Path) -> None:
    content, match = BAD_VEHICLES[case]
    Path("boat.yaml").write_bytes(content.encode() if isinstance(content, str) else content)
    log = place / "log.csv"
    refused("discover", log, "-v", "boat.yaml", "--out", "run", match=match)
    refused("compare", log, "-v", "blueboat", "--model", "boat.yaml", match=match)
    refused("simulate", "-v", "boat.yaml", "--out", "new.csv", match=match)
    refused("inspect", log, "-v", "boat.yaml", match=match)


def test_a_vehicle_that_is_not_there(place: Path, here: Path) -> None:
    match = r"vehicle file boaty: no such file; give a YAML file or one of blueboat, blueboat_paper, cybership2, otter"
    refused("discover", place / "log.csv", "-v", "boaty", "--out", "run", match=match)
    refused("compare", place / "log.csv", "-v", "blueboat", "--model", "boaty", match=match)


NEAREST = r"unknown effect 'surge_quadratc': did you mean 'surge_quadratic_damping'\? The catalogue has: advance_loss"

BAD_REQUESTS: dict[str, tuple[str, str]] = {
    "frame": ("compare LOG -v blueboat --frame nwu", r"frame 'nwu': expected enu or ned"),
    "frame of inspect": ("inspect LOG --frame ENU", r"frame 'ENU': expected enu or ned"),
    "split": ("compare LOG -v blueboat --split dev", r"split 'dev': expected one of train, validation, test, all"),
    "map": (
        "discover LOG -v blueboat --out new --map none.yaml",
        r"none\.yaml: no such channel map; expected a YAML file of 'channel: topic:field' lines",
    ),
    "model with other thrusters": (
        "compare LOG -v blueboat --model otter",
        r"model otter: expected the commands of the nominal vehicle, newton_port newton_stbd, got rad_s_port",
    ),
    "model twice": ("compare LOG -v blueboat --model RUN --model RUN", r"model .*run is given twice; give it once"),
    "model without a file": (
        "compare LOG -v blueboat --model folder",
        r"folder holds no model\.yaml; give a run folder, a network or a vehicle file",
    ),
    "out in a missing folder": (
        "discover LOG -v blueboat --out none/run",
        r"cannot write none/run: .*none does not exist; make it",
    ),
    "out below a file": (
        "discover LOG -v blueboat --out file/run",
        r"cannot write file/run: .*file is a file; give a folder$",
    ),
    "out is a file": (
        "discover LOG -v blueboat --out file",
        r"cannot write file: it is a file; give a folder that may be made",
    ),
    "out holds other files": (
        "discover LOG -v blueboat --out folder",
        r"cannot write folder: the folder holds other files \(.*\) and nothing that this verb wrote; give a new one",
    ),
    "out of the demo": ("demo --out folder", r"cannot write folder: the folder holds other files"),
    "effect to add": ("add surge_quadratc --run RUN", NEAREST),
    "effect to add to a log": ("add surge_quadratc LOG -v blueboat", NEAREST),
    "thruster to add": (
        "add thruster_asymmetry[aft] --run RUN",
        r"unknown effect 'thruster_asymmetry\[aft\]' for BlueBoat.*: did you mean 'thruster_asymmetry\[stbd\]'",
    ),
    "term to add": ("add yaw:w --run RUN", r"term form 'w': expected a product of one to three of u, v, r"),
    "axis to add": ("add heave:u --run RUN", r"term 'heave:u': expected surge:, sway: or yaw: before the form"),
    "effect added twice": (f"add {HIDDEN} {HIDDEN} --run RUN", r"add: an effect is given twice in .*; give each once"),
    "add without a run or a log": (
        f"add {HIDDEN}",
        r"add: expected either --run RUN, or --vehicle V and a LOG after the effects",
    ),
    "add with both": (f"add {HIDDEN} LOG --run RUN -v blueboat", r"add: expected either --run RUN, or --vehicle V"),
    "add without a log": (
        f"add {HIDDEN} -v blueboat",
        rf"add: expected a LOG after the effects {HIDDEN}, got none",
    ),
    "add without an effect": ("add LOG -v blueboat", r"add: expected at least one effect by name, for example surge"),
    "add a log to a run": (
        f"add {HIDDEN} LOG --run RUN --frame ned",
        r"add: --run takes the logs, .*; leave out .*log\.csv --frame, or give --vehicle V in place of --run",
    ),
    "add to no run": (
        f"add {HIDDEN} --run folder",
        r"folder is not a run folder \(no readable run\.json in it\); write one with 'undertow discover LOG",
    ),
    "add to nothing": (f"add {HIDDEN} --run none", r"none is not a run folder"),
    "add into a missing folder": (
        f"add {HIDDEN} --run RUN --out none/new.yaml",
        r"cannot write none/new\.yaml: the folder none does not exist; create it first",
    ),
    "add into a folder": (
        f"add {HIDDEN} --run RUN --out folder",
        r"cannot write folder: it is a folder; give the name",
    ),
    "report of nothing": ("report none", r"expected a run folder at none, but there is none; run 'undertow discover"),
    "report of no run": ("report folder", r"run folder folder has no findings\.json; run 'undertow discover"),
    "noise": (
        "simulate -v blueboat --out new.csv --noise ruff",
        r"unknown noise 'ruff': did you mean 'rough'\? There are: clean, field, rough",
    ),
    "programme": (
        "simulate -v blueboat --out new.csv --programme zigzg",
        r"unknown programme 'zigzg': did you mean 'zigzag'\? There are: rich, zigzag, gentle",
    ),
    "hidden effect": ("simulate -v blueboat --out new.csv --effect surge_quadratc=-9", NEAREST),
    "hidden effect without a value": (
        f"simulate -v blueboat --out new.csv --effect {HIDDEN}",
        rf"effect '{HIDDEN}': expected name=value, for example surge_quadratic_damping=-9",
    ),
    "hidden effect of words": (
        f"simulate -v blueboat --out new.csv --effect {HIDDEN}=much",
        rf"effect '{HIDDEN}=much': expected a number after {HIDDEN}=, got 'much'",
    ),
    "hidden effect beyond its limits": (
        "simulate -v blueboat --out new.csv --effect thruster_lag=-1",
        r"lag would be -1 s \(the vehicle has 0\); expected at least 0",
    ),
    "hidden effect that breaks the vehicle": (
        "simulate -v blueboat --out new.csv --effect X_udot=40",
        r"X_udot would be 37 kg \(the vehicle has -3\); expected at least -610 and at most 0 kg",
    ),
    "hidden effect twice": (
        f"simulate -v blueboat --out new.csv --effect {HIDDEN}=-9 --effect {HIDDEN}=-4",
        rf"--effect {HIDDEN}=-4: {HIDDEN} is given twice; give each effect once, with all its values",
    ),
    "hidden thruster twice": (
        "simulate -v blueboat --out new.csv --effect thruster_asymmetry=port:0.9 --effect port_scale=0.8",
        r"--effect port_scale=0\.8: port_scale is given twice",
    ),
    "log in a missing folder": (
        "simulate -v blueboat --out none/new.csv",
        r"cannot write none/new\.csv: the folder none does not exist; create it first",
    ),
    "log of another format": (
        "simulate -v blueboat --out new.mat",
        r"cannot write new\.mat: expected a name that ends in \.csv, \.csv\.gz or \.parquet",
    ),
    "log in the place of a folder": ("simulate -v blueboat --out folder", r"cannot write folder: it is a folder; give"),
}


@pytest.mark.parametrize("case", BAD_REQUESTS)
def test_bad_requests(case: str, place: Path, here: Path) -> None:
    Path("file").write_text("mine")
    Path("folder").mkdir()
    Path("folder", "notes.txt").write_text("mine")
    command, match = BAD_REQUESTS[case]
    named = {"LOG": place / "log.csv", "RUN": place / "run"}
    before = files(place)
    refused(*(named.get(word, word) for word in command.split()), match=match)
    assert files(place) == before


@pytest.mark.parametrize(
    ("command", "option"),
    [
        ("discover LOG -v blueboat --out run --seed -1", "--seed"),
        ("discover LOG -v blueboat --out run --seed one", "--seed"),
        ("discover LOG --out run", "--vehicle"),
        ("discover LOG -v blueboat", "--out"),
        ("simulate -v blueboat --out new.csv --seed -1", "--seed"),
        ("simulate -v blueboat --out new.csv --duration 0", "--duration"),
        ("simulate -v blueboat --out new.csv --duration 1e12", "--duration"),
        ("simulate -v blueboat --out new.csv --duration nan", "--duration"),
        ("simulate -v blueboat --out new.csv --durations 3", "--duration"),
        ("add --run run", "EFFECT"),
        ("report", "RUN"),
        ("discovr", "discover"),
    ],
)
def test_wrong_usage(command: str, option: str, place: Path, here: Path) -> None:
    result = call(*(place / "log.csv" if word == "LOG" else word for word in command.split()))
    assert (result.exit_code, result.stdout, files(here)) == (2, "", {})
    assert isinstance(result.exception, SystemExit)
    assert option in result.stderr
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize("command", ["simulate -v blueboat --out new.csv WORD", "WORD", "--WORD", "inspect a --WORD=3"])
@pytest.mark.parametrize("word", ["\x1b[2J\x9b\u202egnp\u2066", "y" * 8000])
def test_mistyped_words_are_quoted_harmlessly(command: str, word: str, here: Path) -> None:
    result = call(*command.replace("WORD", word).split())
    assert result.exit_code == 2
    assert len(result.stderr) <= 4000
    assert word not in result.stderr
    assert not re.search("[\x00-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]", result.stderr)
