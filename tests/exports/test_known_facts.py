"""What is known about a model stands in remarks, and no word of it leaves them."""

from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from exported import boat, facts
from networks import learnt
from sample_run import edit, write_sample

from undertow.comparison.models_by_name import load_model
from undertow.exports.formats.base import Given, format_named
from undertow.exports.known_facts import KnownNumber, remarks
from undertow.physics.errors import RequestError
from undertow.workflows.export import export, known_facts
from undertow.workflows.run_folder.run_files import DATA, RUN_SCHEMA, seal

BREAK = "\u2028"
"""What JavaScript holds for the end of a line."""
ILL = replace(
    facts("as it is"),
    name='x"""\nimport os\n"""\\',
    source=f"a{BREAK}b",
    envelope_from="c\rd",
    audit=("pass", f"law{BREAK}alert(1): sentence\u2029alert(2) ---> <evil/>"),
    numbers=(KnownNumber("mass", "1 kg", "1 to\n2", "*/ int a;\x85int b;"),),
)


def text(to: str) -> str:
    return next(iter(format_named(to).files(Given(boat("as it is"), ILL), Path("boat")).values())).decode()


def test_every_text_stays_in_its_line():
    lines = ILL.lines()
    assert [line for line in lines if len(line.splitlines()) > 1 or BREAK in line] == []
    assert any(r"law\u2028alert(1)" in line for line in lines)


@pytest.mark.parametrize("to", ["javascript", "c"])
def test_the_code_is_the_same_whatever_the_audit_says(to: str):
    said = text(to).splitlines()
    plain = next(iter(format_named(to).files(Given(boat("as it is"), facts("as it is")), Path("boat")).values()))
    code = [[line for line in lines if not line.startswith("// ")] for lines in (said, plain.decode().splitlines())]
    assert [line for line in code[0] if line != "//"] == [line for line in code[1] if line != "//"]


def test_a_name_is_not_run():
    said = text("python")
    compile(said, "boat.py", "exec")
    assert "import os" not in [line.strip() for line in said.splitlines()]
    assert '"""The motion of a surface vehicle' in said


def test_the_comment_of_gazebos_file_is_closed_once():
    said = text("sdf")
    begin, comment, rest = said.partition("<!--")
    inside, _, after = comment and rest.partition("-->")
    assert "--" not in inside
    assert "<evil/>" in inside
    assert "-->" not in after
    assert ElementTree.fromstring(begin + after).tag == "sdf"


def test_a_backslash_does_not_make_a_remark_of_the_next_line():
    assert remarks(["of a\\", "of b??/", "of c"], "// ") == "// of a\\.\n// of b??/.\n// of c\n"


@pytest.mark.parametrize("to", ["casadi", "onnx"])
def test_a_network_is_exported_and_other_formats_say_who_takes_one(to: str, tmp_path: Path):
    pytest.importorskip(to, reason="what exports networks: pip install '.[export]'")
    model = learnt("mlp", {"units": 8}, False, True)
    done = export(model, to, tmp_path / f"net{format_named(to).suffix}")
    assert all(path.is_file() for path in done.files)
    with pytest.raises(RequestError, match="casadi and onnx take a network that undertow trained as it is"):
        export(model, "c", tmp_path / "net.h")


def test_of_a_pure_network_only_what_it_sees_of_the_vehicle_is_told():
    model = learnt("mlp", {"units": 8}, False, True)
    told = known_facts(model, None)
    assert {one.symbol for one in told.numbers} == {"lag", "delay", "thrust_rate", "current_north"}
    assert "in the place of the vehicle's physics: 75 learnt numbers" in told.notes[-1]
    assert not [note for note in told.notes if note.startswith("source of damping")]
    beside = known_facts(learnt("mlp", {"units": 8}, False, False), None)
    assert {"mass", "X_u", "lag"} <= {one.symbol for one in beside.numbers}
    assert [note for note in beside.notes if note.startswith("source of damping")]
    assert "in the place" not in beside.notes[-1]


def test_a_number_of_a_run_says_how_sure_it_is_and_its_interval_is_that_of_the_whole_value(tmp_path: Path):
    folder = write_sample(tmp_path / "run", seconds=30.0)

    def own_number(findings: dict[str, Any]) -> None:
        item = findings["candidates"][0] | {"effect": "surge_linear_damping"}
        item["terms"] = [item["terms"][0] | {"symbol": "X_u", "value": -2.0, "ci95": [-3.0, -1.0], "unit": "N s/m"}]
        findings["candidates"][0] = item

    edit(folder / "findings.json", own_number)
    model = (folder / "model.yaml").read_text()
    (folder / "model.yaml").write_text(model.replace("X_u: -15.0", "X_u: -17.0"))
    seal(folder, {"schema": RUN_SCHEMA}, DATA)
    told = {one.symbol: one for one in known_facts(load_model(folder), folder).numbers}
    assert (told["X_u"].amount, told["X_u"].interval, told["X_u"].sure) == (
        *("-17 N s/m", "-18.0 to -16.0"),
        "missing (> 99 %)",
    )
    assert told["Y_vv"].sure == "likely (87 %)"
    assert told["mass"].sure == ""
    assert "95 % interval -77.0 to -71.0; likely (87 %)" in told["Y_vv"].line
