"""The verb `report`: the page of each run or comparison, one page of several runs, models on demand, and PDF."""

import os
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from ..comparison.facts import Comparison
from ..measurements.prepared_logs import PathLike
from ..physics.errors import RequestError, expect
from ..physics.files import write_json, write_text
from ..physics.folders import check_folder, identity, link, lock_settled, replace_folder
from ..physics.stage import Say
from ..reports.page.page import fleet_page
from ..reports.page.pdf import find_browser, print_pdf
from ..reports.terminal.progress import SHOWN, showing
from .run_folder.moved_files import UNMOVED, Moved
from .run_folder.read import read_comparison, read_run
from .run_folder.run_files import (
    PAGE,
    PDF,
    RECORD,
    RUN_FILES,
    Kind,
    check_targets,
    is_comparison,
    own_report,
    refused,
    reseal,
    same_place,
)
from .run_folder.write import page_of, write_page

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
    twice = sorted({str(folder) for k, folder in enumerate(folders) if any(same_place(folder, o) for o in folders[:k])})
    if twice:
        raise RequestError(f"report: {', '.join(twice)} is given twice; give each run once")
    target = None if out is None and len(folders) == 1 else Path(out or FLEET)
    browser = find_browser() if pdf else None
    new = [PAGE, *[PDF] * pdf, *[COMPARISON, RECORD] * bool(models)]
    seen = {folder: identity(folder) for folder in folders}
    for folder in folders:
        compared = is_comparison(folder)
        if compared and (models or len(folders) > 1):
            raise RequestError(
                f"{folder} holds a comparison, not a run: expected it alone and without --model; 'undertow compare' "
                "puts more models into one"
            )
        read = read_comparison if compared else read_run
        read(folder)
        with refused(f"into {folder}"):
            check_folder(folder, new, own_report, force=force)
    if target is not None:
        if target.suffix.lower() not in (".html", ".htm"):
            raise RequestError(f"--out {target}: expected a name that ends in .html; --pdf writes the PDF beside it")
        printed = target.with_suffix(".pdf") if pdf else None
        files = (("--out", Kind.PAGE, target), ("--pdf", Kind.PDF, printed))
        check_targets(files, (folders, models, moved.logs, moved.channel_map), force=force)
    found = _compared(folders, models, moved, progress)
    for folder in folders:
        if folder in found or browser is not None:
            _replace(folder, seen[folder], found.get(folder), browser, force)
        else:
            _rewrite(folder)
    pages = [folder / PAGE for folder in folders]
    if target is not None:
        if len(folders) > 1:
            text = fleet_page([read_run(folder) for folder in folders], target.absolute().parent)
        else:
            text = pages[0].read_text("utf-8")
        with refused(str(target)):
            pages.append(write_text(target, text))
    if browser is None:
        return pages
    if target is not None:
        print_pdf(target, target.with_suffix(".pdf"), browser)
    return [*pages, *(page.with_suffix(".pdf") for page in pages)]


def _rewrite(folder: Path) -> None:
    """Write the page of a run anew; once more where another process has replaced the run meanwhile."""
    with refused(f"into {folder}"):
        while True:
            seen = identity(folder)
            text = page_of(folder)
            with lock_settled(folder):
                if identity(folder) == seen:
                    write_text(folder / PAGE, text)
                    return


def _replace(
    folder: Path, seen: tuple[int, int] | None, comparison: Comparison | None, browser: Path | None, force: bool
) -> None:
    """Replace a run as a whole by itself with a new page and what changes with it.

    Raises
    ------
    RequestError
        when the folder cannot be written, or is another than the one `seen` when the work began.
    """

    def build(work: Path) -> list[str]:
        new = [PAGE]
        for name in RUN_FILES:
            if (folder / name).is_file():
                link(folder / name, work / name)
        if identity(folder) != seen:
            raise RequestError(f"another process has replaced {folder} meanwhile; call report again")
        if comparison is not None:
            write_json(work / COMPARISON, comparison.to_dict())
            new += [COMPARISON, *[RECORD] * reseal(work, [COMPARISON])]
        write_page(work)
        if browser is not None:
            print_pdf(work / PAGE, work / PDF, browser)
            new.append(PDF)
        return new

    with refused(f"into {folder}"):
        replace_folder(folder, build, own_report, force=force)


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
