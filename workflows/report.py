"""The verb `report`: the page of each run or comparison, one page of several runs, models on demand, and PDF.

A PDF is printed by a browser that is there already; only this file starts one.
"""

import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from ..comparison.facts import Comparison
from ..measurements.prepared_logs import PathLike
from ..physics.errors import RequestError, expect
from ..physics.files import at_end, write_bytes, write_json, write_text
from ..physics.folders import PATIENCE, check_folder, hold_folder, replace_folder
from ..physics.stage import Say
from ..reports.page.page import fleet_page
from ..reports.terminal.progress import SHOWN, showing
from .run_folder import run_files
from .run_folder.moved_files import UNMOVED, Moved
from .run_folder.read import read_comparison, read_run
from .run_folder.write import page_of, write_page

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


FLEET = Path("report.html")
COMPARISON = "comparison.json"


@showing
def report(
    runs: Sequence[PathLike] | PathLike,
    *,
    models: Sequence[PathLike] = (),
    pdf: bool = False,
    out: PathLike | None = None,
    moved: Moved = UNMOVED,
    force: bool = False,
    progress: Say | None = SHOWN,
) -> list[Path]:
    """Write the page of each run folder, and of several runs one page for all.

    Parameters
    ----------
    runs : run folders, or one; each gets its `report.html`; or one folder that `compare --page` wrote
    models : to compare with the run's own, on the run's logs, before the page is written; `comparison.json` then has
        them
    pdf : print every page to a PDF file beside it
    moved : where the logs and the map of the runs are now, on which models are compared
    force : replace also pages that undertow did not write, or that were changed since
    out : the page of several runs (report.html in the working folder when None); of one run, a second copy of its page

    Returns
    -------
    list of Path
        The files written, in that order.

    Raises
    ------
    RequestError, VehicleError, LogError
        when a run cannot be read, a model cannot be compared, a file is there that this verb did not write, or
        no browser for `pdf` is there; nothing is written then. When another process replaces a run meanwhile, those
        before it are written.
    """
    given = [runs] if isinstance(runs, str | os.PathLike) or not isinstance(runs, Iterable) else list(runs)
    for run in given:
        expect("report: runs", run, (str, os.PathLike), "undertow.write_run(RUN, FOLDER) writes one, with its page")
    folders = [Path(run) for run in given]
    twice = sorted(
        {str(folder) for k, folder in enumerate(folders) if any(run_files.same_place(folder, o) for o in folders[:k])}
    )
    if twice:
        raise RequestError(f"report: {', '.join(twice)} is given twice; give each run once")
    target = None if out is None and len(folders) == 1 else Path(out or FLEET)
    browser = find_browser() if pdf else None
    new = [run_files.PAGE, *[run_files.PDF] * pdf, *[COMPARISON, run_files.RECORD] * bool(models)]
    seen = {folder: _version(folder) for folder in folders}
    for folder in folders:
        compared = run_files.is_comparison(folder)
        if compared and (models or len(folders) > 1):
            raise RequestError(
                f"{folder} holds a comparison, not a run: expected it alone and without --model; 'undertow compare' "
                "puts more models into one"
            )
        read = read_comparison if compared else read_run
        read(folder)
        with run_files.refused(f"into {folder}"):
            check_folder(folder, new, run_files.own_report, force=force)
    if target is not None:
        if target.suffix.lower() not in (".html", ".htm"):
            raise RequestError(f"--out {target}: expected a name that ends in .html; --pdf writes the PDF beside it")
        printed = target.with_suffix(".pdf") if pdf else None
        files = (("--out", run_files.Kind.PAGE, target), ("--pdf", run_files.Kind.PDF, printed))
        run_files.check_targets(files, (folders, models, moved.logs, moved.channel_map), force=force)
    found = _compared(folders, models, moved, progress)
    for folder in folders:
        if folder in found or browser is not None:
            _replace(folder, seen[folder], found.get(folder), browser, force)
        else:
            _rewrite(folder)
    pages = [folder / run_files.PAGE for folder in folders]
    if target is not None:
        if len(folders) > 1:
            text = fleet_page([read_run(folder) for folder in folders], target.absolute().parent)
        else:
            text = pages[0].read_text("utf-8")
        with run_files.refused(str(target)):
            pages.append(write_text(target, text))
    if browser is None:
        return pages
    if target is not None:
        print_pdf(target, target.with_suffix(".pdf"), browser)
    return [*pages, *(page.with_suffix(".pdf") for page in pages)]


def _version(folder: Path) -> tuple[tuple[int, int], ...]:
    """The findings and the series that are in a folder now: of a run that is written anew they are other files."""
    found = [(folder / name).stat() for name in ("findings.json", "series.csv") if (folder / name).is_file()]
    return tuple((one.st_ino, one.st_mtime_ns) for one in found)


def _rewrite(folder: Path) -> None:
    """Write the page of a run anew; once more where another process has replaced the run meanwhile."""
    with run_files.refused(f"into {folder}"):
        while True:
            seen = _version(folder)
            text = page_of(folder)
            with hold_folder(folder, patience=PATIENCE):
                if _version(folder) == seen:
                    write_text(folder / run_files.PAGE, text)
                    return


def _replace(
    folder: Path,
    seen: tuple[tuple[int, int], ...],
    comparison: Comparison | None,
    browser: Path | None,
    force: bool,
) -> None:
    """Replace a run as a whole by itself with a new page and what changes with it.

    Raises
    ------
    RequestError
        when the folder cannot be written, or holds another run than the one `seen` when the work began.
    """

    def build(work: Path) -> list[str]:
        new = [run_files.PAGE]
        for name in run_files.RUN_FILES:
            if (folder / name).is_file():
                _link(folder / name, work / name)
        if _version(folder) != seen:
            raise RequestError(f"another process has replaced {folder} meanwhile; call report again")
        if comparison is not None:
            write_json(work / COMPARISON, comparison.to_dict())
            new += [COMPARISON, *[run_files.RECORD] * run_files.reseal(work, [COMPARISON])]
        write_page(work)
        if browser is not None:
            print_pdf(work / run_files.PAGE, work / run_files.PDF, browser)
            new.append(run_files.PDF)
        return new

    with run_files.refused(f"into {folder}"):
        replace_folder(folder, build, run_files.own_report, force=force)


def _link(file: Path, there: Path) -> None:
    """Have a file in two places, linked or else copied."""
    try:
        os.link(file, there, follow_symlinks=False)
    except OSError:
        shutil.copy2(file, there, follow_symlinks=False)


def _compared(
    folders: Sequence[Path], models: Sequence[PathLike], moved: Moved, progress: Say | None
) -> dict[Path, Comparison]:
    """The new comparison of each run, before any is written; none without models."""
    if not models:
        if moved != UNMOVED:
            raise RequestError("report: --log and --map are where a --model is compared; give one, or leave them out")
        return {}
    from .compare import compare_run  # reads logs and models, which a page alone does not need

    result = {}
    for folder in folders:
        result[folder] = compare_run(folder, models, replace(moved, of_several=len(folders) > 1), progress=progress)
    return result
