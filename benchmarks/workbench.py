"""How fast and how steady the workbench is, in a real browser against a server of its own.

    python benchmarks/workbench.py [--clicks 200] [--tabs 50] [--hour] [--rows 500000] [--table docs/workbench_speed.md]

First picture: from the start of `undertow app` on the demo to its measured speeds on the screen of a browser that
stands open; a window that is opened meanwhile takes the same two processors for half a second, and is told beside. Add:
from the click to the new number, median over effects added and removed. `--hour` does the same on an hour of log,
`--rows` times zoom and cursor over so many rows, `--tabs` opens and closes the page so often and `--clicks` adds,
removes, undoes and redoes so often; both say what memory the server and its processes gained. Exit code 1 where a limit
is broken.
"""

import argparse
import os
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np
from measured import Figures
from playwright.sync_api import Page, sync_playwright

from undertow.workflows.report import find_browser

EFFECTS = ("Surge quadratic damping", "Yaw quadratic damping", "Munk moment", "Sway lift")
"""Spoken names of effects that every log here can be asked for."""
PATIENCE = 120_000
"""Milliseconds that anything may take."""
WARM = 10
"""Tabs before memory is looked at: the first ones load what the page needs and fill what Python keeps for the next."""
AT_REST = 1500
"""Milliseconds after which a window that was opened does nothing any more."""
NUMBER = "() => document.querySelector('.count')?.innerText"
STAIRS = "() => [...document.querySelectorAll('.stairs .name')].map(e => e.innerText).join('|')"


@contextmanager
def serving(*words: str, told: IO[str] | None = None) -> Iterator[tuple[str, subprocess.Popen[bytes], float]]:
    """A workbench, its address, its process, and when it was started; its errors go to a file, where one is given."""
    with closing(socket.create_server(("127.0.0.1", 0))) as free:
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "undertow", "app", *words, "--no-browser", "--port", str(port)]
    begun = time.perf_counter()
    # As for a user, whose Python keeps what it has compiled.
    env = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=told, start_new_session=True, env=env) as server:
        try:
            while server.poll() is None:
                try:
                    socket.create_connection(("127.0.0.1", port), timeout=1.0).close()
                    break
                except OSError:
                    time.sleep(0.02)
            yield f"http://127.0.0.1:{port}/", server, begun
        finally:
            os.killpg(server.pid, signal.SIGTERM)
            server.wait(20)


def memory(server: subprocess.Popen[bytes]) -> float:
    """What a server and all its processes hold for themselves [MB]."""
    found = 0.0
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if os.getpgid(int(folder.name)) == server.pid:
                rollup = (folder / "smaps_rollup").read_text()
                found += sum(int(line.split()[1]) for line in rollup.splitlines() if line.startswith("Pss:")) / 1024.0
        except (OSError, ProcessLookupError):
            continue
    return found


def processes(server: subprocess.Popen[bytes]) -> int:
    """How many processes a server has."""
    return sum(_of(folder, server.pid) for folder in Path("/proc").glob("[0-9]*"))


def _of(folder: Path, group: int) -> bool:
    try:
        return os.getpgid(int(folder.name)) == group
    except (OSError, ProcessLookupError):
        return False


def first_picture(browser: Any, *, opened: bool) -> float:
    """From the start of the server to the measured speeds of the demo on the screen [s].

    Parameters
    ----------
    opened : the window of the browser stands open and at rest; else it is opened beside the server
    """
    page = _window(browser) if opened else None
    if page is not None:
        page.wait_for_timeout(AT_REST)
    with serving() as (address, _, begun):
        page = page or _window(browser)
        page.goto(address, wait_until="commit")
        page.get_by_role("button", name="Try the demo").click()
        page.wait_for_function("() => document.querySelector('.undertow-time canvas') !== null")
        page.get_by_role("heading", name="Measured against predicted").wait_for()
        took = time.perf_counter() - begun
        page.close()  # else it looks for its server while the next one starts
        return took


def adding(page: Page, times: int) -> list[float]:
    """From the click to the number, of effects that are added and removed in turn [s]."""
    took = []
    for k in range(times):
        name = EFFECTS[k % len(EFFECTS)]
        button = page.locator(f"button[aria-label='Add {name}']")
        if not button.count():
            continue
        if not button.is_visible():
            page.locator("details", has=button).last.locator("> summary").click()
        before = page.evaluate(STAIRS)
        took.append(_click_to(page, f"Add {name}", before))
        _click_to(page, f"Remove {name}", page.evaluate(STAIRS))
    return took


def _click_to(page: Page, name: str, before: str) -> float:
    """From a click to another staircase [s], counted in the page."""
    return float(
        page.evaluate(
            """([name, before]) => new Promise((done, lost) => {
              const told = () => [...document.querySelectorAll('.stairs .name')].map(e => e.innerText).join('|');
              const begun = performance.now();
              const look = () => {
                if (told() !== before) done((performance.now() - begun) / 1000);
                else if (performance.now() - begun > 60000) lost(new Error('nothing changed: ' + name));
                else requestAnimationFrame(look);
              };
              document.querySelector(`button[aria-label='${name}']`).click();
              look();
            })""",
            [name, before],
        )
    )


def _window(browser: Any) -> Page:
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    page.set_default_timeout(PATIENCE)
    return page


def _page(browser: Any, address: str) -> Page:
    page = _window(browser)
    page.goto(address, wait_until="commit")
    return page


def searched(page: Page) -> None:
    """Wait until the cards are there."""
    page.locator("section.cards article").first.wait_for()


def zooming(browser: Any, rows: int) -> tuple[float, float]:
    """Median of a wheel's turn to other lines drawn, and of a move of the cursor to its paint, over many rows [s]."""
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / "many_rows.py"
        script.write_text(_MANY_ROWS.format(rows=rows))
        with closing(socket.create_server(("127.0.0.1", 0))) as free:
            port = free.getsockname()[1]
        with subprocess.Popen([sys.executable, str(script), str(port)], stdout=subprocess.DEVNULL) as server:
            try:
                while True:
                    try:
                        socket.create_connection(("127.0.0.1", port), timeout=1.0).close()
                        break
                    except OSError:
                        time.sleep(0.05)
                page = _page(browser, f"http://127.0.0.1:{port}/")
                page.locator(".undertow-time canvas").first.wait_for()
                page.wait_for_timeout(1500)
                return _felt(page, "wheel"), _felt(page, "move")
            finally:
                server.terminate()


def _felt(page: Page, what: str, times: int = 15) -> float:
    box = page.locator(".undertow-time canvas").first.bounding_box()
    assert box is not None, "the plot is on the screen"
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    page.mouse.move(x, y)
    took = []
    for k in range(times):
        page.evaluate(_WATCH)
        if what == "wheel":
            page.mouse.wheel(0, -240 if k % 2 else 240)
        else:
            page.mouse.move(x + 3.0 * (k + 1), y)
        took.append(float(page.evaluate("() => window.drawn")))
        page.wait_for_timeout(200)
    return statistics.median(took)


_WATCH = """() => {
  window.drawn = new Promise(done => {
    const begun = {at: 0};
    const note = () => { begun.at = begun.at || performance.now(); };
    addEventListener('wheel', note, {once: true, capture: true});
    addEventListener('mousemove', note, {once: true, capture: true});
    const stroke = CanvasRenderingContext2D.prototype.stroke;
    let last = 0;
    CanvasRenderingContext2D.prototype.stroke = function (...given) {
      last = performance.now(); return stroke.apply(this, given);
    };
    setTimeout(() => {
      CanvasRenderingContext2D.prototype.stroke = stroke;
      done(Math.max(0, (last || begun.at + 16) - begun.at) / 1000);
    }, 180);
  });
}"""
_MANY_ROWS = """
import sys
import numpy as np
from nicegui import ui
from undertow.app.plots.time_plots import Line, Panel, TimePlots
from undertow.reports.page.markup import LIGHT

@ui.page("/")
def page():
    ui.add_css(":root {{" + LIGHT + "}}")
    roles = ("measured", "before", "after")
    plots = TimePlots([Panel(n, "m/s", [Line(n + r, r, r) for r in roles]) for n in "uvr"])
    time = 0.1 * np.arange({rows})
    rng = np.random.default_rng(0)
    plots.show(time, {{n + r: np.sin(time / 50 + k) + 0.1 * rng.normal(size=time.size)
                      for k, n in enumerate("uvr") for r in roles}})

ui.run(port=int(sys.argv[1]), host="127.0.0.1", reload=False, show=False, tailwind=False, show_welcome_message=False)
"""


_HEAD = """# How fast the workbench is

Two processors, a browser without a graphics card.

| what | measured | asked | |
| --- | --- | --- | --- |"""


def main() -> int:
    """Measure what is asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--clicks", type=int, default=40)
    parser.add_argument("--tabs", type=int, default=10)
    parser.add_argument("--hour", action="store_true")
    parser.add_argument("--rows", type=int, default=500_000)
    parser.add_argument("--table", type=Path)
    asked = parser.parse_args()
    figures = Figures()
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=str(find_browser()), args=["--disable-gpu"])
        first = "first picture of the demo"
        figures.tell(first, min(first_picture(browser, opened=True) for _ in range(3)), 3.0, "s")
        beside = min(first_picture(browser, opened=False) for _ in range(3))
        figures.tell(f"{first}, where the window of the browser is opened meanwhile", beside, None, "s")
        with serving() as (address, server, _):
            page = _page(browser, address)
            page.get_by_role("button", name="Try the demo").click()
            searched(page)
            figures.tell("add, median, demo", statistics.median(adding(page, 12)), 0.5, "s")
            before = memory(server)
            for _ in range(max(1, asked.clicks // 4)):
                adding(page, 1)
                for name in ("Undo the last step", "Redo the step"):
                    page.get_by_role("button", name=name).click()
            figures.tell(f"memory gained by {asked.clicks} clicks", memory(server) - before, 60.0, "MB")
            page.close()
        with serving() as (address, server, _):
            for _ in range(WARM):
                _opened_and_closed(browser, address)
            time.sleep(70.0)  # a closed page is kept for a minute, for a connection that was lost
            before, running = memory(server), processes(server)
            for _ in range(asked.tabs):
                _opened_and_closed(browser, address)
            time.sleep(70.0)
            figures.tell(f"memory gained by {asked.tabs} tabs", memory(server) - before, 30.0, "MB")
            figures.tell("processes left of them", float(processes(server) - running), 1.0, "")
        if asked.hour:
            _hour(browser, figures)
        wheel, cursor = zooming(browser, asked.rows)
        figures.tell(f"zoom at {asked.rows:,} rows, median", wheel, 0.05, "s")
        figures.tell(f"cursor at {asked.rows:,} rows, median", cursor, 0.05, "s")
        browser.close()
    if asked.table is not None:
        foot = f"\nWritten by `python benchmarks/workbench.py {' '.join(sys.argv[1:])}`; do not edit."
        lines = [_HEAD, *map(figures.line, figures.rows), foot]
        asked.table.write_text("\n".join(lines) + "\n", "utf-8")
    return int(figures.broken)


def _opened_and_closed(browser: Any, address: str) -> None:
    page = _page(browser, address)
    page.get_by_role("button", name="Try the demo").click()
    page.get_by_role("heading", name="Measured against predicted").wait_for()
    page.close()


def _hour(browser: Any, figures: Figures) -> None:
    """Effects added on an hour of log."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "hour.csv.gz"
        hidden = ["--effect=surge_quadratic_damping=-30", "--effect=yaw_quadratic_damping=-20"]
        words = ["simulate", "-v", "otter", *hidden, "--duration", "3600", "-o", str(log), "--quiet"]
        subprocess.run([sys.executable, "-m", "undertow", *words], check=True)
        with serving(str(log), "--vehicle", "otter") as (address, _, _):
            page = _page(browser, address)
            searched(page)
            figures.tell("add, median, an hour of log", statistics.median(adding(page, 6)), 1.0, "s")


if __name__ == "__main__":
    np.seterr(all="raise", under="ignore")
    sys.exit(main())
