"""Chapter on how the page was made: demands on an effect, versions, command, and digests of its sources."""

from ....physics.presentation import words
from ...run_contents import RunFolder
from ..markup import Html, element, render, table
from .base import Chapter, Section
from .parameters import bullets, plain

STORY = (
    "The measured force is compared with the force of the nominal model. Every effect of the catalogue competes to "
    "explain the difference, effects are selected together, and each must lower the error on data it was not fitted "
    "to. This page is made only from the files below."
)


def made(run: RunFolder) -> Section:
    """What was demanded of an effect, how to make the run again, and the files with their digests."""
    demands = [f"{words(name)}: {plain(value)}" for name, value in run.findings.criterion.to_dict().items() if value]
    record = run.record
    facts: list[tuple[str, Html]] = []
    if record.command:
        facts.append(("made again, in the run folder, by", element("code", record.command)))
    if record.seed is not None:
        facts.append(("seed", render(plain(record.seed))))
    if record.versions:
        facts.append(("versions", render(", ".join(f"{name} {number}" for name, number in record.versions.items()))))
    logs = [
        (element("code", item.path), element("code", item.sha256 or "not there any more")) for item in record.log_sha256
    ]
    files = [(element("code", name), element("code", digest)) for name, digest in sorted(run.digests.items())]
    parts = [element("p", STORY)]
    parts += [table(("", ""), facts, "ll")] * bool(facts)
    parts += [table(("log", "SHA-256"), logs, "ll")] * bool(logs)
    if demands:
        parts += [element("p", element("b", "Demanded of an effect")), *bullets(demands)]
    summary = element("summary", "files and the start of their SHA-256")
    parts.append(element("details", summary, table(("file", "digest"), files, "ll")))
    return Section("How this was made", element("footer", *parts, cls="card"))


MADE = Chapter(150, made, folded=True)
