"""Records are written and read back alike, across versions, and refuse what they do not hold in words."""

import json
import math
from pathlib import Path
from typing import Any

import pytest
from sample_run import compare_many, write_sample

from undertow.comparison.facts import Comparison, MadeFrom, RulingRecord
from undertow.discovery.findings import Advice, Calibrated, Findings, FittedTerm, LogFacts
from undertow.discovery.identifiability.rehearsal import Excitation, Identifiability
from undertow.discovery.lawful.laws_over import Binding, MostPower, Passivity
from undertow.discovery.search.estimation import Interval
from undertow.physics.errors import RequestError
from undertow.physics.file_records import Record
from undertow.physics.files import strict_json
from undertow.physics.laws.damping_power import Envelope

FOUND = Findings(verdict="missing", missing=("yaw_trim",), candidates=())
WHOLE = FOUND.but(
    unnamed=(
        FittedTerm(symbol="yaw:r", value=-1.0, ci95=Interval(-2.0, 0.0), inclusion=0.7),
        FittedTerm(symbol="yaw:u", value=math.nan, ci95=None),
    ),
    calibrated=(
        Calibrated(symbol="X_u", before=-1.0, after=-3.0, wanted=-2.0, unit="N s/m", ci95=Interval(-2.5, -1.5)),
    ),
    identifiability=Identifiability(condition=3.0, excitation={"lag": Excitation(share=0.1, signal_to_noise=math.inf)}),
    passivity=Passivity(
        verdict="pass",
        proof="search",
        envelope=Envelope((-1.0, -1.0, -1.0), (2.0, 1.0, 1.0)),
        price=0.1,
        binding=Binding(state=(2.0, 0.0, 0.0), multiplier=0.2, symbol="X_u", wanted=1.0, allowed=0.0, unit="N s/m"),
        worst=MostPower(value=-1.0, at=(0.1, 0.0, 0.0)),
        sentence="It takes energy out.",
    ),
    advice=(Advice(manoeuvre="a circle", why="would tell"),),
    data=LogFacts(rows=10, seconds=1.0),
)


def written(record: Record) -> dict[str, Any]:
    return json.loads(strict_json(record.to_dict()))


def read_again(record: Record) -> Record:
    return type(record).read(written(record), "file.json", "write it anew")


@pytest.mark.parametrize("record", [FOUND, WHOLE], ids=["least", "whole"])
def test_what_is_read_back_writes_the_same_file(record: Findings):
    assert written(read_again(record)) == written(record)


def test_the_files_of_a_run_are_read_back_whole(tmp_path: Path):
    """The sample's structure is made by the code that discover uses; every field of it comes back."""
    folder = write_sample(tmp_path / "run", seconds=30.0)
    compare_many(folder)
    for name, kind in (("findings", Findings), ("comparison", Comparison)):
        content = json.loads((folder / f"{name}.json").read_text())
        again = written(kind.read(content, name, ""))
        for key in ("steps", "failures", "structure", "differences"):
            assert len(again.get(key, ())) == len(content.get(key, ()))
        if name == "comparison":
            assert again["structure"] == json.loads(strict_json(content["structure"]))


def test_null_stands_for_what_json_cannot_hold():
    content = written(WHOLE)
    assert content["unnamed"][1]["value"] is None
    assert content["identifiability"]["excitation"]["lag"]["signal_to_noise"] is None
    again = Findings.read(content, "", "")
    assert math.isnan(again.unnamed[1].value)
    assert again.identifiability is not None
    assert again.identifiability.excitation["lag"].signal_to_noise == math.inf


def test_fields_of_a_file_stand_in_their_order():
    content = written(WHOLE)
    assert list(content)[:5] == ["schema", "verdict", "warnings", "headline", "reasons"]
    assert list(content["unnamed"][0])[-1] == "inclusion"
    assert list(content["unnamed"][1])[-1] == "in_model"
    assert content["calibrated"][0]["held_by_law"] is True
    assert content["passivity"]["binding"]["at"] == {"u": 2.0, "v": 0.0, "r": 0.0}
    assert written(FOUND)["passivity"] == written(FOUND)["identifiability"] == {}


def test_files_of_earlier_and_later_versions_are_read():
    content = written(WHOLE)
    later = {**content, "moods": ["grey"], "advice": [{"manoeuvre": "a circle", "cost": 3}]}
    assert Findings.read(later, "", "").advice == (Advice(manoeuvre="a circle"),)
    earlier = {key: content[key] for key in ("schema", "verdict", "missing", "candidates")}
    effect = {"effect": "yaw_trim", "verdict": "possible", "confidence": 0.1, "error_drop": None}
    (found,) = Findings.read(earlier | {"candidates": [effect], "advice": None}, "", "").candidates
    assert (found.reason, found.cannot_tell) == (None, False)
    assert Findings.read(earlier | {"candidates": [effect | {"reason": "noise"}]}, "", "").candidates[0].cannot_tell


def test_what_a_law_says_beyond_the_known_is_kept():
    assert RulingRecord.model_validate({"law": "rest", "verdict": "pass", "tried": 3}).to_dict()["tried"] == 3


LAW = written(WHOLE)["passivity"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"verdict": "bad"},
            "expected one of 'missing', 'likely', 'nothing missing' or 'undecided' under 'verdict', got 'bad'",
        ),
        ({"missing": "yaw_trim"}, "expected a list under 'missing', got 'yaw_trim'"),
        ({"missing": [3]}, r"expected a text under 'missing[0]', got 3"),
        ({"candidates": [{"verdict": "possible"}]}, "candidates[0] lacks 'effect', 'confidence', 'error_drop'"),
        ({"unnamed": [{"value": "1"}]}, "expected a number or null under 'unnamed[0].value', got '1'"),
        ({"unnamed": [{"value": 1, "ci95": [0]}]}, "expected a list of two numbers under 'unnamed[0].ci95', got [0]"),
        ({"unnamed": [{"value": 1, "ci95": 5}]}, "expected a list of two numbers under 'unnamed[0].ci95', got 5"),
        ({"data": {"rows": 1.5}}, "expected a whole number under 'data.rows', got 1.5"),
        ({"unnamed": [{"value": 1, "ci95": [0, 1, 2]}]}, "expected a list of two numbers under 'unnamed[0].ci95'"),
        (
            {"passivity": written(WHOLE)["passivity"] | {"envelope": {"u": 3}}},
            "expected [lower, upper] about rest for each of u, v and r under",
        ),
        ({"schema": "undertow.audit/1"}, "expected schema 'undertow.findings/2', got 'undertow.audit/1'"),
    ],
)
def test_what_is_no_record_is_refused_in_words(change: dict[str, Any], message: str):
    with pytest.raises(RequestError) as refused:
        Findings.read(written(FOUND) | change, "run/findings.json", "write it anew")
    told = str(refused.value)
    assert message in told
    assert told.startswith("run/findings.json: ")
    assert told.endswith("; write it anew")
    assert "pydantic" not in told


@pytest.mark.parametrize("value", ["x" * 10**6, ["y" * 10**6] * 100, {"z" * 10**6: {}}], ids=["text", "list", "key"])
def test_a_message_is_short_whatever_the_file_holds(value: object):
    for change in ({"verdict": value}, {"data": {"rows": value}}):
        with pytest.raises(RequestError) as refused:
            Findings.read(written(FOUND) | change, "findings.json", "write it anew")
        assert len(str(refused.value)) < 1000
    with pytest.raises(RequestError) as refused:
        MadeFrom.read({"schema": MadeFrom.SCHEMA, "versions": {"v" * 10**6: 3}}, "run.json", "write it anew")
    assert len(str(refused.value)) < 1000


def test_a_record_cannot_be_changed_but_made_anew():
    with pytest.raises(ValueError, match="frozen"):
        FOUND.headline = "another"
    assert (FOUND.but(headline="another").headline, FOUND.headline) == ("another", "")
    with pytest.raises(ValueError, match="verdict"):
        FOUND.but(verdict="odd")
