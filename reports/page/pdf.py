"""Pages as PDF, through a browser that is already there; the only place that starts one."""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from ...physics.errors import RequestError
from ...physics.files import at_end, write_bytes

VERB = "report --pdf"
VARIABLE = "CHROME"
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge", "microsoft-edge")
PLACES = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
)
SECONDS = 90.0
"""Time that a browser gets [s]: it prints in seconds, but its first start on a slow machine takes longer."""
HINT = (
    f"install Chromium, Chrome or Edge, or name one in the environment variable {VARIABLE} (or run 'playwright install "
    "chromium' after 'pip install playwright'); or open the HTML page in any browser and print it"
)


def find_browser() -> Path:
    """A browser of the Chromium family: of the variable CHROME, on PATH, at its usual place, or playwright's own.

    Raises
    ------
    RequestError
        when there is none, or the variable names what is not there.
    """
    named = os.environ.get(VARIABLE)
    if named:
        found = shutil.which(named)
        if found is None:
            raise RequestError(f"{VARIABLE}={named}: expected a browser that can be run, found none there; {HINT}")
        return Path(found)
    for name in (*NAMES, *PLACES):
        found = shutil.which(name)
        if found is not None:
            return Path(found)
    own = _of_playwright()
    if own is None:
        raise RequestError(f"--pdf needs a browser and found none; {HINT}")
    return own


def print_pdf(page: Path, target: Path, browser: Path) -> Path:
    """Print an HTML page to a PDF file, with the page's own print style.

    Parameters
    ----------
    page, target : the HTML file, and the PDF file to write, which is replaced
    browser : of the Chromium family

    Raises
    ------
    RequestError
        when the browser fails, takes too long, or writes no PDF; the target is then untouched.
    """
    with tempfile.TemporaryDirectory(prefix="undertow-pdf-", ignore_cleanup_errors=True) as scratch:
        written = Path(scratch, "page.pdf")
        words = [
            str(browser),
            "--headless",
            "--disable-gpu",
            "--no-first-run",
            "--no-default-browser-check",
            "--disable-extensions",
            "--no-pdf-header-footer",
            f"--user-data-dir={Path(scratch, 'profile')}",
            f"--print-to-pdf={written}",
            page.absolute().as_uri(),
        ]
        if getattr(os, "geteuid", lambda: 1)() == 0:
            words.insert(1, "--no-sandbox")  # Chromium does not start for root with it; the page has no script
        try:
            run = subprocess.run(words, capture_output=True, text=True, errors="replace", timeout=SECONDS, check=False)
        except subprocess.TimeoutExpired:
            raise RequestError(f"{browser} did not print {page} within {SECONDS:.0f} s; {HINT}") from None
        except OSError as error:
            raise RequestError(f"{browser} cannot be started ({error.strerror or error}); {HINT}") from None
        content = written.read_bytes() if written.is_file() else b""
        if not content.startswith(b"%PDF"):
            told = (run.stderr.strip().splitlines() or ["it said nothing"])[-1]
            raise RequestError(f"{browser} wrote no PDF of {page} (exit code {run.returncode}: {told}); {HINT}")
    return write_bytes(target, at_end(VERB, content, b"% ", b""))


def _of_playwright() -> Path | None:
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        return None
    with sync_playwright() as driver:
        path = Path(driver.chromium.executable_path)
    return path if path.is_file() else None
