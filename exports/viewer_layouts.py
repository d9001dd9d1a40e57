"""Layouts that show `series.mcap` at once, of the topics that it has: panels for Foxglove, tabs for PlotJuggler."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from ..discovery.candidates.linearisation import FORCES
from ..physics.files import write_json, write_text
from ..physics.motion import AXES, FORCE_UNITS
from ..physics.reading import Plain
from ..residuals.series import SeriesTable
from .elements import xml_node
from .mcap_series import EARTH, effect_topic, log_prefixes

FOXGLOVE, PLOTJUGGLER = "series.foxglove.json", "series.plotjuggler.xml"
_SPEEDS = {"u": "surge speed [m/s]", "v": "sway speed [m/s]", "r": "yaw rate [rad/s]"}
_MODELS = ("before", "after")
_MOST_LOGS = 12
"""Logs that have tabs of their own: more do not fit on a screen, and their topics are in the file all the same."""
_COLOURS = ("#1a1a1a", "#d9822b", "#1f77b4", "#2ca02c", "#9467bd", "#8c564b", "#e377c2", "#17becf", "#bcbd22")
"""Of the curves of a plot, in turn: measured dark, before orange, after blue as on the page, then effects."""
_MCAP = {"use_timestamp": "0", "use_mcap_log_time": "1", "clamp_large_arrays": "1", "max_array_size": "500"}
"""How PlotJuggler reads an MCAP file; without these it asks, for these and for topics."""
_LAYOUT_VERSION = "2.3.8"
"""Of PlotJuggler's layouts since 2.3.8; it warns of one without it, as of an obsolete layout (`mainwindow.cpp`)."""
_SIDE = 35.0
"""Per cent of the window for the track and the commands."""


@dataclass(frozen=True, slots=True)
class Curve:
    """A number of a topic, and what the legend calls it."""

    topic: str
    field: str
    label: str


@dataclass(frozen=True, slots=True)
class Plot:
    """Curves over time that belong together."""

    title: str
    curves: tuple[Curve, ...]


@dataclass(frozen=True, slots=True)
class View:
    """What is shown of one log: speeds beside predictions, forces beside effects, commands, and the track."""

    prefix: str
    speeds: tuple[Plot, ...]
    forces: tuple[Plot, ...]
    commands: Plot

    @property
    def poses(self) -> tuple[str, ...]:
        """Topics of a 3D view."""
        drawn = ("measured/path", "measured/pose", *(f"predicted/{model}/pose" for model in _MODELS))
        return tuple(f"{self.prefix}/{name}" for name in drawn)


def views(logs: Sequence[int], channels: Sequence[str], effects: Mapping[str, SeriesTable]) -> list[View]:
    """What is shown of each log of a run.

    Parameters
    ----------
    logs : numbers of the logs in the series
    channels : names of the command columns
    effects : forces by label, see `Prediction.effects`; an axis on which one has no force does not show it
    """
    return [_view(prefix, channels, effects) for prefix in log_prefixes(logs)[:_MOST_LOGS]]


def _view(prefix: str, channels: Sequence[str], effects: Mapping[str, SeriesTable]) -> View:
    speeds = [
        Plot(title, (
            Curve(f"{prefix}/measured", name, "measured"),
            *(Curve(f"{prefix}/predicted/{model}", name, f"predicted {model}") for model in _MODELS),
        ))
        for name, title in _SPEEDS.items()
    ]  # fmt: skip
    forces = []
    for name, axis, unit in zip(FORCES, AXES, FORCE_UNITS, strict=True):
        left = [Curve(f"{prefix}/residual/{model}", name, f"unexplained {model}") for model in _MODELS]
        acting = {effect_topic(label): label for label, force in effects.items() if (np.abs(force[name]) > 0.0).any()}
        found = [Curve(f"{prefix}{topic}", name, label) for topic, label in acting.items()]
        what = "moment" if axis == "yaw" else "force"
        forces.append(Plot(f"{axis} {what} that the model lacks [{unit}]", (*left, *found)))
    commands = Plot("commands", tuple(Curve(f"{prefix}/measured", name, name) for name in channels))
    return View(prefix, tuple(speeds), tuple(forces), commands)


def write_layouts(folder: Path, series: str, shown: Sequence[View]) -> None:
    """Write both layouts beside a series; `series` is the name of its file."""
    write_json(folder / FOXGLOVE, foxglove_layout(shown))
    write_text(folder / PLOTJUGGLER, plotjuggler_layout(shown, series))


# Foxglove: panels by id, and a tree of halves


def foxglove_layout(shown: Sequence[View]) -> Plain:
    """The layout that Foxglove imports; of several logs, a tab each."""
    panels: Plain = {}
    trees = [_panels_of(view, str(number), panels) for number, view in enumerate(shown)]
    tree: Plain | str = trees[0]
    if len(shown) > 1:
        tabs = [{"title": view.prefix.strip("/"), "layout": one} for view, one in zip(shown, trees, strict=True)]
        tree = "Tab!logs"
        panels[tree] = {"activeTabIdx": 0, "tabs": tabs}
    return {
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": tree,
    }


def _panels_of(view: View, number: str, panels: Plain) -> Plain:
    """Put the panels of a log among the others, and give their arrangement."""
    track, commands = f"3D!track{number}", f"Plot!commands{number}"
    panels[track] = {
        "foxglovePanelTitle": "track, north up",
        "followTf": EARTH,
        "followMode": "follow-none",
        "cameraState": {"perspective": False, "phi": 0, "thetaOffset": 0, "distance": 60},
        "topics": {topic: {"visible": True} for topic in view.poses},
        "layers": {"grid": {"layerId": "foxglove.Grid", "instanceId": "grid", "visible": True, "frameId": EARTH}},
    }
    panels[commands] = _plot_panel(view.commands)
    columns = []
    for kind, plots in (("speed", view.speeds), ("force", view.forces)):
        names = [f"Plot!{kind}{number}{axis}" for axis in AXES]
        panels.update(zip(names, map(_plot_panel, plots), strict=True))
        columns.append(_split("column", names[0], _split("column", names[1], names[2], 50.0), 100.0 / 3.0))
    side = _split("column", track, commands, 70.0)
    return _split("row", side, _split("row", columns[0], columns[1], 50.0), _SIDE)


def _split(direction: str, first: Plain | str, second: Plain | str, percent: float) -> Plain:
    return {"direction": direction, "first": first, "second": second, "splitPercentage": percent}


def _plot_panel(plot: Plot) -> Plain:
    paths = [
        {
            "value": f"{curve.topic}.{curve.field}",
            "label": curve.label,
            "enabled": True,
            "timestampMethod": "receiveTime",
            "color": colour,
        }
        for curve, colour in _coloured(plot)
    ]
    return {
        "foxglovePanelTitle": plot.title,
        "paths": paths,
        "showXAxisLabels": True,
        "showYAxisLabels": True,
        "showLegend": True,
        "legendDisplay": "floating",
        "showPlotValuesInLegend": False,
        "isSynced": True,
        "xAxisVal": "timestamp",
        "sidebarDimension": 240,
    }


# PlotJuggler: tabs of plots one below the other


def plotjuggler_layout(shown: Sequence[View], series: str) -> str:
    """The layout that PlotJuggler loads, XML; it opens the series, whose path is seen from the layout."""
    tabs = []
    for view in shown:
        log = f"{view.prefix.strip('/')} " if view.prefix else ""
        tabs += [_tab(f"{log}speeds", (*view.speeds, view.commands)), _tab(f"{log}forces", view.forces)]
    plots = [plot for view in shown for plot in (*view.speeds, *view.forces, view.commands)]
    topics = dict.fromkeys(curve.topic for plot in plots for curve in plot.curves)
    parameters = xml_node("parameters", **_MCAP, selected_topics=";".join(topics))
    plugin = xml_node("plugin", parameters, ID="DataLoad MCAP")
    tabs.append(xml_node("currentTabIndex", index="0"))
    widget = xml_node("tabbed_widget", *tabs, parent="main_window", name="Main Window")
    root = xml_node(
        "root",
        widget,
        xml_node("use_relative_time_offset", enabled="1"),
        xml_node("Plugins"),
        xml_node("previouslyLoaded_Datafiles", xml_node("fileInfo", plugin, filename=series, prefix="")),
        xml_node("customMathEquations"),
        xml_node("snippets"),
        version=_LAYOUT_VERSION,
    )
    ElementTree.indent(root, " ")
    return f"<?xml version='1.0' encoding='UTF-8'?>\n{ElementTree.tostring(root, encoding='unicode')}\n"


def _tab(name: str, plots: Sequence[Plot]) -> ElementTree.Element:
    sizes = ";".join([f"{1.0 / len(plots):.6f}"] * len(plots))
    splitter = xml_node("DockSplitter", *map(_area, plots), orientation="-", sizes=sizes, count=str(len(plots)))
    return xml_node("Tab", xml_node("Container", splitter), tab_name=name, containers="1")


def _area(plot: Plot) -> ElementTree.Element:
    curves = [xml_node("curve", name=f"{curve.topic}/{curve.field}", color=colour) for curve, colour in _coloured(plot)]
    kind = {"mode": "TimeSeries", "style": "Lines", "flip_x": "false", "flip_y": "false"}
    return xml_node("DockArea", xml_node("plot", xml_node("limitY"), *curves, **kind), name=plot.title)


def _coloured(plot: Plot) -> list[tuple[Curve, str]]:
    """Curves with their colours; what is not measured begins with the second."""
    first = 0 if plot.curves and plot.curves[0].topic.endswith("/measured") else 1
    return [(curve, _COLOURS[(first + k) % len(_COLOURS)]) for k, curve in enumerate(plot.curves)]
