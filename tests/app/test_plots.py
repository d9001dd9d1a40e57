"""What the workbench's plots send to the browser, and what they make of what comes back."""

import asyncio
import hashlib
import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from places import ROOT

pytest.importorskip("nicegui", reason="the workbench needs nicegui")

from nicegui.client import Client
from nicegui.element import Element
from nicegui.events import GenericEventArguments
from nicegui.page import page

from undertow.app.plots.error_map import Cells, ErrorMap, cell_in_words
from undertow.app.plots.level_of_detail import (
    Path,
    joined,
    nearest,
    rounded,
    sent_number,
    thinned_by_length,
    thinned_by_rows,
    within,
)
from undertow.app.plots.time_plots import Line, Panel, TimePlots, Track

TIME = np.arange(0.0, 100.0, 0.1)
PANELS = [
    Panel("Surge speed", "m/s", [Line("u", "measured", "measured"), Line("u_before", "before", "before")]),
    Panel("Turn rate", "rad/s", [Line("r", "measured", "measured")]),
]
COLUMNS = {"u": np.sin(TIME), "u_before": np.cos(TIME), "r": 0.1 * TIME}

Sent = list[tuple[str, Any]]


@pytest.fixture
def sent(monkeypatch: pytest.MonkeyPatch) -> Iterator[Sent]:
    """Messages to the browser, in their order; a page is open meanwhile."""
    messages: Sent = []
    monkeypatch.setattr(Element, "run_method", lambda _, name, *args, **__: messages.append((name, *args)))
    loop = asyncio.new_event_loop()

    async def opened() -> Client:
        return Client(page("/"), request=None)

    client = loop.run_until_complete(opened())
    with client:
        yield messages
    client.delete()
    loop.close()


def happens(element: Element, kind: str, **args: object) -> None:
    """The browser tells that something happened."""
    for listener in list(element._event_listeners.values()):
        if listener.type == kind and listener.handler is not None:
            event = GenericEventArguments(sender=element, client=element.client, args=args)
            handler: Callable[..., Any] = listener.handler
            handler(event) if handler.__code__.co_argcount - hasattr(handler, "__self__") else handler()


def named(sent: Sent, name: str) -> list[Any]:
    return [message[1] for message in sent if message[0] == name]


# Time plots


def test_nothing_is_sent_before_a_browser_is_there_and_everything_then(sent: Sent):
    plots = TimePlots(PANELS)
    plots.show(TIME, COLUMNS)
    plots.mark([(1.0, 2.0)])
    assert sent == []
    happens(plots, "ready", width=2000)
    drawn, divided, marked = sent
    assert divided == ("divide", [])
    assert drawn[0] == "draw"
    np.testing.assert_allclose(drawn[1]["time"], TIME)
    assert set(drawn[1]["columns"]) == set(COLUMNS)
    assert marked == ("mark", [(1.0, 2.0)])


def test_a_browser_that_comes_back_gets_everything_again(sent: Sent):
    plots = TimePlots(PANELS)
    plots.show(TIME, COLUMNS)
    for _ in range(2):
        happens(plots, "ready", width=500)
    assert len(named(sent, "draw")) == 2
    assert all(message["fresh"] for message in named(sent, "draw"))


def test_a_window_is_answered_with_its_rows_alone(sent: Sent):
    plots = TimePlots(PANELS)
    plots.show(TIME, COLUMNS)
    happens(plots, "ready", width=300)
    happens(plots, "window", begin=20.0, end=25.0, width=300, asked=7)
    answer = named(sent, "draw")[-1]
    assert answer["asked"] == 7
    assert answer["window"] == (20.0, 25.0)
    assert 19.8 <= answer["time"].min() <= 20.0 < 25.0 <= answer["time"].max() <= 25.2


def test_changed_columns_keep_the_window(sent: Sent):
    plots = TimePlots(PANELS)
    plots.show(TIME, COLUMNS)
    happens(plots, "ready", width=300)
    happens(plots, "window", begin=20.0, end=25.0, width=300, asked=1)
    plots.change({"u_before": np.zeros_like(TIME)})
    answer = named(sent, "draw")[-1]
    assert answer["moved"]
    assert not answer["fresh"]
    assert answer["window"] == (20.0, 25.0)
    assert not answer["columns"]["u_before"].any()
    assert answer["columns"]["u"].any()


@pytest.mark.parametrize("wrong", [{}, {"begin": 3.0, "end": 2.0}, {"begin": "x", "end": None}, {"begin": math.nan}])
def test_a_window_that_is_none_is_not_answered(sent: Sent, wrong: dict[str, object]):
    plots = TimePlots(PANELS)
    plots.show(TIME, COLUMNS)
    happens(plots, "ready", width=300)
    sent.clear()
    happens(plots, "window", **wrong)
    assert sent == []


def test_no_browser_may_ask_for_more_than_a_screen(sent: Sent):
    plots = TimePlots(PANELS)
    time = np.arange(200_000.0)
    plots.show(time, {"u": time})
    happens(plots, "ready", width=1e9)
    assert len(named(sent, "draw")[0]["time"]) < 20_000


def test_a_brush_comes_as_begin_and_end(sent: Sent):
    plots, heard = TimePlots(PANELS), []
    plots.on_brush(lambda begin, end: heard.append((begin, end)))
    happens(plots, "brush", begin=3.0, end=4.5)
    happens(plots, "brush", begin="3", end=[])
    assert heard == [(3.0, 4.5)]


def test_an_empty_log_is_no_trouble(sent: Sent):
    plots = TimePlots(PANELS)
    plots.show(np.empty(0), {})
    happens(plots, "ready", width=300)
    assert named(sent, "draw") == []


# The track

NORTH, EAST = TIME * np.cos(TIME / 10.0), TIME * np.sin(TIME / 10.0)


def test_the_track_is_sent_when_a_browser_is_there(sent: Sent):
    track = Track()
    track.show(TIME, NORTH, EAST)
    track.predict({"before": [(TIME[:9], NORTH[:9], EAST[:9]), (TIME[9:19], NORTH[9:19], EAST[9:19])]})
    track.path(TIME[:5], measured=(NORTH[:5], EAST[:5]), after=(NORTH[:5], EAST[:5]))
    assert sent == []
    happens(track, "ready")
    assert [message[0] for message in sent] == ["draw", "path", "divide", "mark"]
    assert set(sent[0][1]) == {"measured", "before"}
    assert np.isnan(sent[0][1]["before"]["north"]).sum() == 2, "a gap after every rollout"
    assert set(sent[1][1]) == {"measured", "after"}


def test_a_click_picks_the_time_of_the_nearest_measured_point(sent: Sent):
    track, heard = Track(), []
    track.on_pick(heard.append)
    happens(track, "pick", north=0.0, east=0.0)
    track.show(TIME, NORTH, EAST)
    happens(track, "pick", north=NORTH[500] + 0.01, east=EAST[500])
    happens(track, "pick", north="north", east=None)
    assert heard == [pytest.approx(50.0)]


def test_another_track_forgets_what_was_predicted_for_the_one_before(sent: Sent):
    track = Track()
    happens(track, "ready")
    track.show(TIME, NORTH, EAST)
    track.predict({"after": [(TIME, NORTH, EAST)]})
    assert named(sent, "predict")[-1].keys() == {"after"}
    track.show(TIME, EAST, NORTH)
    assert named(sent, "draw")[-1].keys() == {"measured"}


def test_a_closer_view_brings_more_points_of_less(sent: Sent):
    time = np.arange(0.0, 40_000.0, 0.1)
    track = Track()
    track.show(time, 0.1 * time, np.zeros_like(time))
    happens(track, "ready")
    happens(track, "view", south=100.0, north=110.0, west=-5.0, east=5.0)
    whole, close = named(sent, "draw")[0]["measured"]["north"], named(sent, "detail")[0]["measured"]["north"]
    assert np.median(np.diff(close)) < 0.1 * np.median(np.diff(whole))
    assert 99.9 < close.min() < 100.1 < 109.9 < close.max() < 110.1


# Paths


def test_thinning_keeps_the_ends_of_every_part():
    path = joined([(TIME[k : k + 100], NORTH[k : k + 100], EAST[k : k + 100]) for k in range(0, 1000, 100)])
    for thin in (thinned_by_length(path, 50), thinned_by_rows(path, 50)):
        assert len(thin.time) < 200
        assert np.isnan(thin.north).sum() == 10
        for k in range(0, 1000, 100):
            assert {NORTH[k], NORTH[k + 99]} <= set(thin.north)


def test_a_boat_at_rest_is_a_point():
    thin = thinned_by_length(Path(TIME, 0.0 * TIME, 0.0 * TIME), 10)
    assert len(thin.time) == 2


def test_a_path_that_leaves_a_box_and_comes_back_is_broken_there():
    found = within(Path(TIME, np.sin(TIME / 5.0), 0.0 * TIME), (0.5, 2.0, -1.0, 1.0))
    assert np.isnan(found.north).sum() == 3
    assert np.nanmin(found.north) < 0.5, "one row beyond each end, so that the line reaches the edge"


def test_nothing_is_near_where_nothing_is():
    gone = np.full(3, np.nan)
    assert nearest(Path(TIME[:3], gone, gone), 0.0, 0.0) is None


# The map of failure


def cells(value: np.ndarray) -> Cells:
    return Cells(
        np.array([0.0, 1.0, 2.0]),
        np.array([-0.5, 0.0, 0.5, 1.0]),
        *("surge speed, m/s", "turn rate, rad/s"),
        value,
        np.full((2, 3), 12.0),
        *("m/s", 0.6),
    )


VALUE = np.array([[0.05, np.nan, 0.61], [0.3, 0.2, 0.1]])


def test_the_map_sends_the_cells_that_have_rows(sent: Sent):
    heat = ErrorMap()
    heat.show(cells(VALUE))
    assert sent == []
    happens(heat, "ready")
    drawn = named(sent, "draw")[0]
    assert [(cell["i"], cell["j"], cell["level"]) for cell in drawn["cells"]] == [
        (0, 0, 1),
        (0, 2, 6),
        *((1, 0, 4), (1, 1, 3), (1, 2, 2)),
    ]


def test_a_cell_tells_its_ranges_its_error_and_its_seconds():
    words = cell_in_words(cells(VALUE), 0, 0)
    assert words == "surge speed, m/s 0 to 1.0, turn rate, rad/s −0.50 to 0: error 0.050 m/s, 12 s"


def test_picked_cells_come_as_a_list_and_stay_picked(sent: Sent):
    heat, heard = ErrorMap(), []
    heat.on_pick(heard.append)
    heat.show(cells(VALUE))
    happens(heat, "pick", cells=[[0, 0], [1, 2]])
    happens(heat, "pick", cells=[[0, 9], ["x", 1], [0, 2], [True, 0], 7])
    happens(heat, "pick", cells="all")
    assert heard == [[(0, 0), (1, 2)], [(0, 2)], []]
    happens(heat, "pick", cells=[[1, 1]])
    heat.show(cells(0.5 * VALUE))
    happens(heat, "ready")
    assert named(sent, "pick")[-1] == [(1, 1)]
    heat.unpick()
    assert named(sent, "pick")[-1] == []


# Messages


def test_numbers_are_short_and_gaps_stay():
    short = rounded(np.array([123.456789, -0.000123, np.nan, np.inf]))
    np.testing.assert_array_equal(short, [123.46, -0.0, np.nan, np.inf])
    np.testing.assert_array_equal(rounded(np.zeros(2)), np.zeros(2))


@pytest.mark.parametrize("value", [None, "3", True, math.inf, [1.0], {}])
def test_what_is_no_number_is_not_taken_for_one(value: object):
    assert sent_number({"x": value}, "x") is None
    assert sent_number({}, "x") is None
    assert sent_number({"x": 3}, "x") == 3.0


# What comes with them


def test_uplot_is_the_release_that_its_note_tells():
    folder = ROOT / "app" / "plots" / "uplot"
    assert "1.6.32" in (folder / "README.md").read_text("utf-8")
    assert "The MIT License" in (folder / "LICENSE").read_text("utf-8")
    script = (folder / "uPlot.iife.min.js").read_bytes()
    assert b"(v1.6.32)" in script[:100]
    assert hashlib.sha256(script).hexdigest() == "19c8d4c6ad88929a79f4ae49d6f7161566dfd0ba3d15cc495e974f787eb78f1f"


@pytest.mark.parametrize("name", sorted(path.name for path in (ROOT / "app" / "plots").glob("*.js")))
def test_our_scripts_fetch_nothing_from_anywhere(name: str):
    text = (ROOT / "app" / "plots" / name).read_text("utf-8")
    assert "http" not in text.replace("http://www.w3.org/2000/svg", "")
    assert "innerHTML" not in text


@pytest.mark.parametrize("made", [lambda: TimePlots(PANELS), Track], ids=["time plots", "track"])
def test_which_log_is_where_is_told_to_a_browser_that_comes_later(sent: Sent, made: Callable[[], Any]):
    view = made()
    view.divide([("one.csv", 0.0, 9.9), ("two.csv", 10.0, 19.9)])
    assert sent == []
    happens(view, "ready", width=100)
    assert ("divide", [("one.csv", 0.0, 9.9), ("two.csv", 10.0, 19.9)]) in sent


def test_plots_that_are_hidden_hear_that_the_browser_has_built_them(sent: Sent):
    plots = TimePlots(PANELS)
    plots.show(TIME, COLUMNS)
    plots.set_visibility(visible=False)
    assert not plots.is_ignoring_events
    happens(plots, "ready", width=100)
    assert named(sent, "draw")
