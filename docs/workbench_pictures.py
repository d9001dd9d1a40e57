"""Pictures of the workbench on the demo, taken in a browser: the opening, the bench, and a small screen in the dark.

python docs/workbench_pictures.py [docs/workbench]
"""

import io
import socket
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, sync_playwright

from undertow.workflows.report import find_browser

PATIENCE = 120_000
"""Milliseconds that the search may take."""
QUALITY = 82
"""Of the pictures: text stays sharp, and three take less than 300 kB."""


def main(folder: Path) -> None:
    """Serve, look, and write the pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    with closing(socket.create_server(("127.0.0.1", 0))) as free:
        port = free.getsockname()[1]
    with subprocess.Popen([sys.executable, "-m", "undertow", "app", "--no-browser", "--port", str(port)]) as server:
        try:
            _until_served(port)
            with sync_playwright() as driver:
                browser = driver.chromium.launch(executable_path=str(find_browser()), args=["--disable-gpu"])
                page = browser.new_page(viewport={"width": 1280, "height": 900}, device_scale_factor=1.5)
                _bench(page, port)
                _keep(page, folder / "found.webp")
                page.get_by_role("button", name="Add all effects that were found").click()
                page.wait_for_function("() => document.querySelectorAll('.stairs .num').length > 4")
                page.wait_for_timeout(1500)
                _keep(page, folder / "added.webp")
                small = browser.new_page(
                    viewport={"width": 390, "height": 844}, color_scheme="dark", device_scale_factor=2.0
                )
                _bench(small, port)
                _keep(small, folder / "small.webp")
                browser.close()
        finally:
            server.terminate()


def _until_served(port: int) -> None:
    while True:
        try:
            socket.create_connection(("127.0.0.1", port), timeout=1.0).close()
            return
        except OSError:
            time.sleep(0.1)


def _bench(page: Page, port: int) -> None:
    page.set_default_timeout(PATIENCE)
    page.goto(f"http://127.0.0.1:{port}/")
    page.get_by_role("button", name="Try the demo").click()
    page.get_by_role("button", name="Add Surge quadratic damping").click()
    page.locator(".count .now").wait_for()
    page.wait_for_timeout(1500)


def _keep(page: Page, path: Path) -> None:
    Image.open(io.BytesIO(page.screenshot())).save(path, quality=QUALITY)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/workbench"))
