"""The workbench in a real browser: the whole story once, and what a stranger gets."""

import os
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
import zipfile
from collections.abc import Iterator
from contextlib import closing

import pytest
from keyboard import nameless, tab_through
from places import ROOT, slowness
from verbs import done

from undertow.physics.errors import RequestError
from undertow.workflows.report import find_browser

pytest.importorskip("nicegui", reason="the workbench needs nicegui: pip install '.[app]'")
driver = pytest.importorskip("playwright.sync_api", reason="playwright drives the browser: pip install '.[dev]'")

PATIENCE = 90_000
"""Milliseconds that are waited for what is computed, on a machine that does other things too."""
LIMIT = 1.0
"""Seconds from the press to the errors of another log of five minutes, on a machine that does nothing else."""
PRESSED = """([name, told]) => new Promise(done => {
    const begun = performance.now();
    new MutationObserver((_, seen) => {
        if (!document.querySelector('.hero').innerText.includes(told)) return;
        seen.disconnect();
        done(performance.now() - begun);
    }).observe(document.body, {subtree: true, childList: true, characterData: true});
    document.querySelector(`button[aria-label='${name}']`).click();
})"""
"""Milliseconds from the press of a button until the top of the bench tells something."""
PEACE = 400
"""Milliseconds after which what was sent is drawn."""


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A workbench that serves, in a process of its own."""
    with closing(socket.create_server(("127.0.0.1", 0))) as free:
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "undertow", "app", "--no-browser", "--port", str(port)]
    told_to = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    with subprocess.Popen(command, start_new_session=True, **told_to) as server:
        try:
            for _ in range(300):
                if _status(f"http://127.0.0.1:{port}/") == 200:
                    break
                assert server.poll() is None, server.stdout.read()  # type: ignore[union-attr]
                time.sleep(0.1)
            yield f"http://127.0.0.1:{port}/"
        finally:
            os.killpg(server.pid, signal.SIGINT)  # as Ctrl-C: all its processes hear it
            told = server.communicate(timeout=20)[0]
    assert "Traceback" not in told, told
    assert "has been deleted" not in told, told


def _status(address: str, **headers: str) -> int:
    try:
        with urllib.request.urlopen(urllib.request.Request(address, headers=headers), timeout=10) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        return error.code
    except OSError:
        return 0


@pytest.fixture(scope="module")
def browser():
    try:
        executable = find_browser()
    except RequestError as error:
        pytest.skip(f"no browser to look with: {error}")
    with driver.sync_playwright() as started:
        opened = started.chromium.launch(executable_path=str(executable), args=["--disable-gpu"])
        yield opened
        opened.close()


@pytest.fixture
def tab(browser, address):
    """A tab; what the page complains of, and what it asks of others, is kept in `heard`."""
    context = browser.new_context(viewport={"width": 1280, "height": 900}, accept_downloads=True)
    page = context.new_page()
    page.heard = []
    page.on("console", lambda told: page.heard.append(told.text) if told.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: page.heard.append(str(error)))
    local = (address, "data:", "blob:", address.replace("http", "ws"))
    page.on("request", lambda asked: None if asked.url.startswith(local) else page.heard.append(asked.url))
    page.set_default_timeout(PATIENCE)
    page.goto(address)
    yield page
    context.close()


def press(page, name: str) -> None:
    """Press a button by its spoken name."""
    page.get_by_role("button", name=name, exact=True).click()


def now(page) -> float:
    """The error of the present model [m]."""
    return float(page.locator(".count .now").inner_text().split()[0])


def steps(page, count: int) -> list[str]:
    """The numbers of the staircase, as soon as there are so many."""
    page.wait_for_function("n => document.querySelectorAll('.stairs .num').length === n", arg=count)
    page.wait_for_timeout(PEACE)
    return page.locator(".stairs .num").all_inner_texts()


def test_the_whole_story(tab, tmp_path):
    press(tab, "Try the demo: a boat recorded in Gazebo")
    tab.get_by_role("heading", name="Measured against predicted").wait_for()
    headline = tab.get_by_role("heading", level=1)
    add = tab.get_by_role("button", name="Add Surge quadratic damping")
    add.wait_for()
    assert headline.inner_text().startswith("The model is missing")
    # What is pressed shows at once that it is at work, and the headline tells of the model that is shown.
    busy = add.evaluate(
        "one => new Promise(told => { new MutationObserver(() => one.ariaBusy && told(true))"
        ".observe(one, {attributes: true}); one.click() })"
    )
    assert busy
    tab.locator(".count .now").wait_for()
    assert headline.inner_text().startswith("With surge quadratic damping, 10 s predictions err by")
    assert tab.get_by_text("The search: The model is missing").count() == 1
    tab.locator("button[aria-busy]").wait_for(state="hidden")
    first = steps(tab, 2)
    press(tab, "Add all effects that were found")
    last = steps(tab, 6)
    assert last[:2] == first
    assert now(tab) < 0.2
    press(tab, "Undo the last step")
    assert steps(tab, 2) == first
    press(tab, "Redo the step")
    assert steps(tab, 6) == last
    press(tab, "Remove Sway lift")
    steps(tab, 5)
    # A region that fails is clicked, and selects the same rows everywhere.
    cell, clear = tab.locator("[aria-label='Where it fails'] svg [role=button]").nth(20), "Clear selection"
    cell.click()
    press(tab, clear)
    tab.get_by_role("button", name=clear).wait_for(state="hidden")
    cell.click()  # the map has let go of it, too: it is picked again
    tab.get_by_role("button", name=clear).wait_for()
    # A slider predicts anew, on the keyboard too.
    fitted = now(tab)
    tab.get_by_label("Move X_uu").focus()
    tab.keyboard.press("End")
    tab.get_by_role("button", name="Set all numbers to their fitted values").wait_for()
    tab.wait_for_timeout(2 * PEACE)
    assert now(tab) > fitted
    press(tab, "Set all numbers to their fitted values")
    tab.wait_for_function("m => parseFloat(document.querySelector('.count .now').innerText) === m", arg=fitted)
    # Loaded again, everything is as it was.
    tab.reload()
    tab.locator(".count .now").wait_for()
    assert now(tab) == fitted
    for text, name in (("The report page", "report.html"), ("model.yaml", "model.yaml"), ("The run folder", ".zip")):
        press(tab, "Take away")
        with tab.expect_download() as got:
            tab.get_by_text(text, exact=True).click()
        assert got.value.suggested_filename.endswith(name)
        got.value.save_as(tmp_path / got.value.suggested_filename)
    assert "munk" in (tmp_path / "report.html").read_text("utf-8").lower()
    assert "X_uu" in (tmp_path / "model.yaml").read_text("utf-8")
    with zipfile.ZipFile(next(tmp_path.glob("*.zip"))) as run:
        assert "findings.json" in run.namelist()
    # A network is trained, and stopped.
    tab.get_by_role("combobox", name="network").click()
    tab.get_by_role("option", name="LSTM: with memory").click()
    tab.get_by_label("epochs").fill("500")
    press(tab, "Train a network")
    tab.get_by_text(re.compile(r"^epoch [1-9]")).wait_for()
    press(tab, "Stop training")
    tab.get_by_text("Stopped. Nothing was kept.").wait_for()
    assert tab.heard == []


@pytest.mark.parametrize(("scheme", "width"), [("light", 1280), ("dark", 390)])
def test_the_tab_key_comes_to_everything_and_shows_where_it_is(browser, address, scheme, width):
    """On the opening, on the bench and in a dialog: an outline that differs from what is behind it by 3 to 1."""
    context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
    tab = context.new_page()
    tab.set_default_timeout(PATIENCE)
    tab.goto(address)

    def gone_through(least: int) -> None:
        tab.wait_for_timeout(2 * PEACE)
        tab.evaluate("() => document.querySelectorAll('details').forEach(one => one.open = true)")
        found, missed = tab_through(tab)
        assert len(found) >= least
        assert missed == []
        assert [one for one in found if one.contrast < 3.0 or not one.seen] == []
        assert nameless(tab) == []

    tab.get_by_role("button", name="Try the demo: a boat recorded in Gazebo").wait_for()
    gone_through(8)
    press(tab, "Try the demo: a boat recorded in Gazebo")
    press(tab, "Add all effects that were found")
    steps(tab, 6)
    gone_through(60)
    press(tab, "Look at the numbers of the vehicle")
    gone_through(15)
    context.close()


def test_another_log_is_tried_and_the_session_goes_on_in_another_tab(tab, browser, address, tmp_path):
    path = tmp_path / "lake.csv"
    done("simulate", "-v", str(ROOT / "data" / "demo.yaml"), "--duration", "300", "--out", str(path))
    press(tab, "Try the demo: a boat recorded in Gazebo")
    tab.get_by_role("button", name="Add Surge quadratic damping").click()
    tab.locator(".count .now").wait_for()
    fitted = now(tab)
    told, took, limit = "This log was not used to fit; errors are of all its rows.", [], 1000.0 * LIMIT * slowness()
    for _ in range(3):  # the quickest counts, on a machine that does other things too
        press(tab, "Try the model on another log")
        tab.locator("input[type=file]").set_input_files(path)
        tab.get_by_text("lake.csv: a log").wait_for()
        took.append(tab.evaluate(PRESSED, ["Predict the other log", told]))
        if took[-1] < limit:
            break
        press(tab, "Put the other log away")
        tab.get_by_text(told).first.wait_for(state="hidden")
    assert min(took) < limit, (took, limit)
    tab.get_by_role("heading", name="With surge quadratic damping").wait_for()
    tab.wait_for_timeout(PEACE)
    tried = now(tab)
    assert tried != fitted
    assert tab.get_by_text("lake.csv with ").count() == 1
    press(tab, "gazebo_blueboat.csv.gz (fitted)")
    tab.get_by_text(told).first.wait_for(state="hidden")
    assert now(tab) == fitted
    press(tab, "lake.csv (tried)")
    tab.get_by_text(told).first.wait_for()
    press(tab, "Missing force")
    press(tab, "Take away")
    with tab.expect_download() as got:
        tab.get_by_text("The session", exact=True).click()
    saved = tmp_path / got.value.suggested_filename
    assert saved.name == "gazebo_blueboat.session.json"
    got.value.save_as(saved)
    other = browser.new_context().new_page()
    other.set_default_timeout(PATIENCE)
    other.goto(address)
    other.locator("input[type=file]").set_input_files([saved])
    other.get_by_text("gazebo_blueboat.session.json: a session").wait_for()
    press(other, "Open the log")
    other.get_by_role("status").filter(has_text="drop lake.csv beside the session").wait_for()
    other.locator("input[type=file]").set_input_files([path])
    other.get_by_text("lake.csv: a log").wait_for()
    press(other, "Open the log")
    other.get_by_text(told).first.wait_for()
    other.wait_for_timeout(PEACE)
    assert now(other) == tried
    assert other.get_by_role("button", name="Missing force").get_attribute("aria-pressed") == "true"
    other.context.close()
    assert tab.heard == []


def test_two_tabs_do_not_see_each_other(tab, browser, address):
    press(tab, "Try the demo: a boat recorded in Gazebo")
    tab.get_by_role("heading", name="Measured against predicted").wait_for()
    other = tab.context.new_page()
    other.goto(address)
    other.get_by_role("button", name="Try the demo: a boat recorded in Gazebo").wait_for()
    assert other.get_by_text("Measured against predicted").count() == 0
    other.close()
    tab.get_by_role("button", name="Look at the numbers of the vehicle").dblclick()
    tab.get_by_role("heading", name="The vehicle").first.wait_for()
    tab.wait_for_timeout(PEACE)
    assert tab.get_by_role("heading", name="The vehicle").count() == 1, "a double click opens one form"


def test_what_cannot_be_read_is_told_and_the_page_lives(tab, tmp_path):
    broken = tmp_path / "broken.csv"
    broken.write_text("no,log\nat,all\n", "utf-8")
    tab.locator("input[type=file]").set_input_files(broken)
    tab.get_by_text("broken.csv: a log").wait_for()
    press(tab, "Open the log")
    tab.get_by_role("alert").filter(has_text="expected").first.wait_for()
    press(tab, "Take broken.csv out")
    done("simulate", "-v", "blueboat", "--duration", "60", "--out", str(tmp_path / "sound.csv"))
    tab.locator("input[type=file]").set_input_files(tmp_path / "sound.csv")
    tab.get_by_text("sound.csv: a log").wait_for()
    press(tab, "Open the log")
    # What the vehicle is made of is told, and what is pressed while the log is searched comes when that has ended.
    tab.get_by_text("Assumed, not measured: places of the thrusters, mass").wait_for()
    press(tab, "Put in what is known of the vehicle")
    tab.get_by_text("; what you asked for waits for it").wait_for()
    tab.get_by_role("heading", name="The vehicle").wait_for()


def test_a_small_screen_needs_no_sideways_scrolling(browser, address):
    context = browser.new_context(viewport={"width": 390, "height": 844}, color_scheme="dark")
    page = context.new_page()
    page.goto(address)
    press(page, "Try the demo: a boat recorded in Gazebo")
    page.get_by_role("heading", name="Measured against predicted").wait_for(timeout=PATIENCE)
    page.wait_for_timeout(2 * PEACE)
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    context.close()


def test_a_finger_selects_a_stretch_of_time(browser, address):
    context = browser.new_context(viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    page = context.new_page()
    page.set_default_timeout(PATIENCE)
    page.goto(address)
    press(page, "Try the demo: a boat recorded in Gazebo")
    switch = page.get_by_role("button", name="A drag zooms").first
    switch.wait_for()
    page.wait_for_timeout(PEACE)
    switch.scroll_into_view_if_needed()
    switch.tap()
    assert page.get_by_role("button", name="A drag selects").get_attribute("aria-pressed") == "true"
    box = page.locator(".undertow-time .u-over").nth(2).bounding_box()
    finger = context.new_cdp_session(page)
    places = [{"x": box["x"] + share * box["width"], "y": box["y"] + 40.0} for share in (0.3, 0.4, 0.5, 0.6)]
    for kind, points in (("Start", places[:1]), *(("Move", [place]) for place in places[1:]), ("End", [])):
        finger.send("Input.dispatchTouchEvent", {"type": f"touch{kind}", "touchPoints": points})
    page.get_by_role("button", name="Clear selection").wait_for()
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    # What was selected is no zoom: all of the log is still shown.
    assert page.get_by_text("showing").count() == 0
    context.close()


@pytest.mark.parametrize(
    "headers", [{"Host": "evil.example"}, {"Origin": "http://evil.example"}, {"Host": "127.0.0.1:1"}]
)
@pytest.mark.parametrize("path", ["", "_nicegui_ws/socket.io/?EIO=4&transport=polling"])
def test_a_stranger_gets_400_on_pages_and_sockets(address, headers, path):
    assert _status(address + path, **headers) == 400
