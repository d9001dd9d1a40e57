"""Whether the workbench stays up while somebody works with it: random clicks in a real browser for a given time.

    python benchmarks/steady_workbench.py [--minutes 60] [--seed 0]

Effects are added and taken out, steps undone and redone, sliders moved, plots zoomed, cells picked, other logs opened,
vehicles changed, networks trained and stopped, files taken away, pages loaded anew, and tabs opened and closed, in an
order that the seed draws. A line a minute says what the server holds. A step fails that does not do on the page what
it should, or makes the server write a traceback; what the page refuses with a reason is counted, and told. Exit code 1
where anything fails, or the server keeps more memory or processes than one tab needs.
"""

import argparse
import random
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

from clicks import PATIENCE, SEEN, Clicks, StepFailedError
from measured import Figures
from playwright.sync_api import Error, Page, sync_playwright
from workbench import memory, processes, serving

from undertow.workflows.report import find_browser

WARM = 0.2
"""Share of the time before memory is compared: every library is loaded by then."""
MOST_GAINED = 150.0
"""MB: a reading that is kept holds some 40, and three are kept, whatever order they came in."""


def main() -> int:
    """Click for as long as is asked."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    figures = Figures()
    with tempfile.TemporaryDirectory() as folder, Path(folder, "server.txt").open("w+") as told:
        logs = [_log(Path(folder) / f"otter-{seed}.csv", seed) for seed in (1, 2)]
        with serving(told=told) as (address, server, _), sync_playwright() as driver:
            browser = driver.chromium.launch(executable_path=str(find_browser()), args=["--disable-gpu"])
            context = browser.new_context(viewport={"width": 1280, "height": 900}, accept_downloads=True)
            _click(context.new_page(), address, server, asked, logs, figures)
            browser.close()
        told.seek(0)
        figures.tell("tracebacks of the server", float(told.read().count("Traceback")), 1.0, "")
    return int(figures.broken)


def _click(page: Page, address: str, server: Any, asked: Any, logs: list[Path], figures: Figures) -> None:
    heard: list[str] = []
    page.on("console", lambda line: heard.append(line.text) if line.type == "error" else None)
    page.on("pageerror", lambda error: heard.append(str(error)))
    page.set_default_timeout(PATIENCE)
    page.goto(address)
    clicks = Clicks(page, random.Random(asked.seed), logs)
    clicks.demo()
    done, refused, failed = Counter[str](), Counter[str](), list[str]()
    begun, seconds, lines, warm = time.monotonic(), 60.0 * asked.minutes, 0, (0.0, 0)
    while (so_far := time.monotonic() - begun) < seconds:
        if so_far >= 60.0 * lines:
            lines += 1
            heap = page.evaluate("() => performance.memory.usedJSHeapSize") / 1e6
            held, running = memory(server), processes(server)
            print(f"{so_far / 60.0:5.1f} min: {held:.0f} MB in {running} processes, page {heap:.0f} MB, ", end="")
            print(f"{done.total()} steps, {len(failed)} failed, {refused.total()} refused", flush=True)
        if not warm[1] and so_far > WARM * seconds:
            warm = memory(server), processes(server)
        try:
            done[clicks.step()] += 1
            for alert in page.locator(".trouble[role=alert]:visible").all_inner_texts():
                refused[alert.strip().splitlines()[0]] += 1
        except (StepFailedError, Error, AssertionError) as error:
            seen = " ".join(page.evaluate(SEEN).split())
            told = " ".join(str(error).split())
            told = told if len(told) < 800 else f"{told[:200]} ... {told[-600:]}"  # its end says what was in the way
            failed.append(f"{clicks.doing}: {told}; on the page: {seen[:600]}")
            print(f"failed: {failed[-1]}", flush=True)
            clicks.recover()
    time.sleep(min(70.0, seconds))  # a closed tab is kept for a minute, for a connection that was lost
    print("steps:", ", ".join(f"{count} {name}" for name, count in done.most_common()))
    for text, count in refused.most_common():
        print(f"refused {count} times: {text[:200]}")
    figures.tell("steps", float(done.total()), None, "")
    figures.tell("sessions", float(clicks.sessions), None, "")
    figures.tell("steps that failed", float(len(failed)), 1.0, "")
    figures.tell("faults that the page told", float(sum("fault" in text for text in refused)), 1.0, "")
    figures.tell("errors in the browser's console", float(len(heard)), 1.0, "")
    figures.tell("memory gained by the server", memory(server) - warm[0], MOST_GAINED, "MB")
    figures.tell("processes gained", float(processes(server) - warm[1]), 1.0, "")
    for text in heard[:10]:
        print(f"console: {text[:300]}")


def _log(path: Path, seed: int) -> Path:
    """Two minutes of a boat with a hidden effect."""
    words = ["simulate", "-v", "otter", "--effect=surge_quadratic_damping=-30", "--duration", "120", "--seed"]
    subprocess.run([sys.executable, "-m", "undertow", *words, str(seed), "-o", str(path), "--quiet"], check=True)
    return path


if __name__ == "__main__":
    sys.exit(main())
