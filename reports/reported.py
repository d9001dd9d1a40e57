"""The verb `report`: the page of each run, one page of several runs, models compared on demand, and PDF."""

import os
from collections.abc import Callable, Sequence
from pathlib import Path

from ..physics.errors import RequestError
from ..physics.files import write_json, write_text
from .browser import find_browser, print_pdf
from .facts import Comparison
from .fleet_page import fleet_page
from .page import TITLE, write_page
from .run_folder import read_run

PathLike = str | os.PathLike[str]
Say = Callable[[str], None]
FLEET = Path("report.html")


def report(
    runs: Sequence[PathLike],
    *,
    models: Sequence[PathLike] = (),
    pdf: bool = False,
    out: PathLike | None = None,
    progress: Say | None = None,
) -> list[Path]:
    """Write the page of each run folder, and of several runs one page for all.

    Parameters
    ----------
    runs : run folders; each gets its `report.html`
    models : to compare with the run's own, on the run's logs, before the page is written; `comparison.json` then has
        them
    pdf : print every page to a PDF file beside it
    out : the page of several runs (report.html in the working folder when None); of one run, a second copy of its page

    Returns
    -------
    list of Path
        The files written, in that order.

    Raises
    ------
    RequestError, VehicleError, LogError
        when a run cannot be read, a model cannot be compared, `out` holds something else than a page of undertow, or
        no browser for `pdf` is there; nothing is written then.
    """
    folders = [Path(run) for run in runs]
    twice = sorted({str(folder) for folder in folders if folders.count(folder) > 1})
    if twice:
        raise RequestError(f"report: {', '.join(twice)} is given twice; give each run once")
    target = None if out is None and len(folders) == 1 else Path(out or FLEET)
    browser = find_browser() if pdf else None
    if target is not None:
        check_page(target)
    for folder in folders:
        read_run(folder)
        if pdf:
            check_pdf(folder / "report.pdf")
    if target is not None and pdf:
        check_pdf(target.with_suffix(".pdf"))
    for folder, comparison in _compared(folders, models, progress).items():
        write_json(folder / "comparison.json", comparison.to_dict())
    pages = [write_page(folder) for folder in folders]
    if target is not None:
        read = [read_run(folder) for folder in folders]
        text = fleet_page(read, target.absolute().parent) if len(read) > 1 else pages[0].read_text("utf-8")
        pages.append(_written(target, text))
    if browser is None:
        return pages
    return [*pages, *(print_pdf(page, page.with_suffix(".pdf"), browser) for page in pages)]


def _compared(folders: Sequence[Path], models: Sequence[PathLike], progress: Say | None) -> dict[Path, Comparison]:
    """The new comparison of each run, before any is written; none without models."""
    if not models:
        return {}
    from .compare import compare_run  # reads logs and models, which a page alone does not need

    found = {}
    for folder in folders:
        if progress is not None:
            progress(f"comparing models on the logs of {folder}")
        found[folder] = compare_run(folder, models)
    return found


def check_page(path: Path) -> None:
    """Check that a page can be written there without losing anything else.

    Raises
    ------
    RequestError
        when its folder is missing, or there is something that is no page of undertow.
    """
    if path.suffix.lower() not in (".html", ".htm"):
        raise RequestError(f"--out {path}: expected a name that ends in .html; --pdf writes the PDF beside it")
    if not path.absolute().parent.is_dir():
        raise RequestError(f"cannot write {path}: {path.absolute().parent} does not exist; make it")
    if path.exists() and not _begins_with(path, f"<title>{TITLE}".encode()):
        raise RequestError(f"{path} is there and is no page of undertow; give another --out")


def check_pdf(path: Path) -> None:
    """Check that a PDF can be written there.

    Raises
    ------
    RequestError
        when there is something that is no PDF.
    """
    if path.exists() and not _begins_with(path, b"%PDF"):
        raise RequestError(f"{path} is there and is no PDF; move it away")


def _begins_with(path: Path, sign: bytes) -> bool:
    try:
        with path.open("rb") as stream:
            return sign in stream.read(400)
    except OSError:
        return False


def _written(path: Path, text: str) -> Path:
    try:
        return write_text(path, text)
    except OSError as error:
        raise RequestError(f"cannot write {path}: {error.strerror or error}") from None
