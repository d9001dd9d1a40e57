"""The layouts name nothing that `series.mcap` does not hold, and show what there is to see."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from verbs import done

import undertow
from undertow.exports.viewer_layouts import FOXGLOVE, PLOTJUGGLER, plotjuggler_layout, views
from undertow.residuals.series import SeriesTable

EFFECTS = ["surge_quadratic_damping", "thruster_asymmetry"]


@pytest.fixture(scope="module", params=[1, 2], ids=["one log", "two logs"])
def run(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of as many logs."""
    pytest.importorskip("mcap", reason="layouts are written with the series: pip install '.[logs]'")
    folder = tmp_path_factory.mktemp("layouts")
    words = ("--effect", "surge_quadratic_damping=-12", "--effect", "port_scale=0.8", "--duration", "60")
    logs = [folder / f"{number}.csv" for number in range(request.param)]
    for number, log in enumerate(logs):
        done("simulate", "-v", "blueboat", *words, "--seed", str(number), "--out", log)
    return undertow.write_run(
        undertow.add(EFFECTS, undertow.read_inputs(logs, "blueboat")), folder / "run", report=False
    )


@pytest.fixture
def held(run: Path) -> dict[str, Mapping[str, Any]]:
    """The schema of each topic of the series."""
    from mcap.reader import make_reader

    with (run / "series.mcap").open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    return {one.topic: json.loads(summary.schemas[one.schema_id].data) for one in summary.channels.values()}


def is_number(schema: Mapping[str, Any], field: str) -> bool:
    return schema["properties"].get(field, {}).get("type") == "number"


def parts(tree: Any, panels: Mapping[str, Any]) -> Iterator[str]:
    """The panels of an arrangement, those of tabs among them."""
    if isinstance(tree, str):
        yield tree
        for tab in panels[tree].get("tabs", ()):
            yield from parts(tab["layout"], panels)
        return
    assert tree["direction"] in ("row", "column")
    assert 0.0 < tree["splitPercentage"] < 100.0
    for half in ("first", "second"):
        yield from parts(tree[half], panels)


def test_every_path_of_foxglove_is_a_number_of_the_series(run: Path, held: Mapping[str, Mapping[str, Any]]) -> None:
    layout = json.loads((run / FOXGLOVE).read_text("utf-8"))
    panels = layout["configById"]
    shown = list(parts(layout["layout"], panels))
    assert sorted(shown) == sorted(panels)
    paths = [path["value"] for panel in panels.values() for path in panel.get("paths", ())]
    assert len(paths) == len(set(paths))
    for path in paths:
        topic, field = path.rsplit(".", 1)
        assert is_number(held[topic], field), path
    drawn = [topic for panel in panels.values() for topic in panel.get("topics", ())]
    assert drawn
    assert all(held[topic]["title"].startswith("foxglove.Pose") for topic in drawn)
    told = {path.rsplit(".", 1)[0].removeprefix("/log0").removeprefix("/log1") for path in paths}
    assert {"/effects/surge_quadratic_damping", "/effects/thruster_asymmetry_port"} <= told


def test_every_curve_of_plotjuggler_is_a_number_of_the_series(run: Path, held: Mapping[str, Mapping[str, Any]]) -> None:
    root = ElementTree.parse(run / PLOTJUGGLER).getroot()
    assert root.attrib == {"version": "2.3.8"}  # without which PlotJuggler asks whether to go on
    curves = [curve.attrib["name"] for curve in root.iter("curve")]
    for name in curves:
        topic, field = name.rsplit("/", 1)
        assert is_number(held[topic], field), name
    assert {area.attrib["count"] for area in root.iter("DockSplitter")} == {"3", "4"}
    (file,) = root.iter("fileInfo")
    assert (run / file.attrib["filename"]).is_file()
    (asked,) = file.iterfind("plugin/parameters")  # with these PlotJuggler opens the file, and asks nothing
    topics = asked.attrib["selected_topics"].split(";")
    assert set(topics) == {name.rsplit("/", 1)[0] for name in curves} <= set(held)
    assert all(asked.attrib[name].isdecimal() for name in set(asked.attrib) - {"selected_topics"})
    logs = {topic.split("/")[1] for topic in held if topic.startswith("/log")}
    assert len(list(root.iter("Tab"))) == 2 * max(1, len(logs))


def test_both_show_the_same_and_are_small(run: Path) -> None:
    panels = json.loads((run / FOXGLOVE).read_text("utf-8"))["configById"].values()
    foxglove = sorted(path["value"].replace(".", "/") for panel in panels for path in panel.get("paths", ()))
    curves = sorted(one.attrib["name"] for one in ElementTree.parse(run / PLOTJUGGLER).getroot().iter("curve"))
    assert foxglove == curves
    assert (run / FOXGLOVE).stat().st_size + (run / PLOTJUGGLER).stat().st_size < 40_000
    assert {FOXGLOVE, PLOTJUGGLER} <= set(json.loads((run / "run.json").read_text("utf-8"))["files"])


def test_an_axis_on_which_an_effect_does_nothing_does_not_show_it() -> None:
    force = SeriesTable({"X": np.array([0.0, 2.0]), "Y": np.zeros(2), "N": np.array([0.0, np.nan])})
    (view,) = views([0], ["newton_port"], {"surge & <drag>": force})
    assert [len(plot.curves) for plot in view.forces] == [3, 2, 2]
    assert ElementTree.fromstring(plotjuggler_layout([view], "a & b.mcap")) is not None
    assert len(views(range(40), [], {})) == 12
