"""How often each check that can refuse a log refuses a sound one, and how often a sound log is accused.

A refusal is a claim, too. Nothing is wrong with the runs of `study/sound_worlds.py`: our own worlds, a simulator of
other assumptions, simulators of others, and logs from outside (a boat on a lake, Gazebo, others), where they lie beside
the repository. Each run is recorded at 50, 20, 10, 5, 2 and 1 Hz, as far as it holds them, with its commands in the
rows of the motion or at their own instants in turn, with all channels, without positions, or without speeds; each
record is a log. It is written as a file of one of six formats in turn (`study/sound_files.py`) and read as any log is.
All checks are made of it, with its vehicle file; the discovery itself is not run.

    python benchmarks/sound_logs.py [--logs 520] [--seeds tuning|reporting] [--jobs N] [--tell]
        [--table docs/sound_logs.md]

`--logs` counts runs. Exit code 1 where a check refuses 0.1 % of the logs or more, or accuses one that was drawn.
"""

import sys
from collections.abc import Mapping, Sequence
from typing import Any

from study.noted_faults import likely_sizes, noted, sure_sizes
from study.records import Kept, Script, bound, in_a_table
from study.sound_files import FORMATS, through_a_file
from study.sound_worlds import KINDS, Run, drawn, from_outside, outside, recorded

from undertow.measurements.inspection import CHECKS, examine
from undertow.measurements.log import Log
from undertow.measurements.preparation.needs import problems
from undertow.measurements.quality.faults import OVERWHELMING, Kind
from undertow.physics.errors import LogError
from undertow.physics.vehicle import Vehicle

FIRST = {"tuning": 240_000, "reporting": 420_000}
"""First seeds; those from 250,000, 270,000, 300,000, 330,000, 360,000 and 390,000 on were reported before, and mended
by; 400,000 was tuned by, too."""
MOST = 0.001
"""Share of sound logs that a check may refuse."""
PACKAGES = ("physics", "measurements")
_TRUE = {"rates"}
"""What is told of a log of 1 or 2 Hz: that it is one, which is no accusation."""
_READING = "reading"
"""What readers refuse, and what keeps a log from being used."""
REFUSING = tuple(dict.fromkeys([_READING, *(kind.value.check for kind in Kind), *(check.name for check in CHECKS)]))
"""All that can refuse, by the names of the findings: checks whose refusals are weighed by their size first."""


def _outside(purpose: str) -> list[tuple[str, int]]:
    """Logs from outside come first, and are only reported."""
    return from_outside() if purpose == "reporting" else []


def judge(first: int, number: int) -> dict[str, Any]:
    """What is said against the logs of one run."""
    known = _outside(next(purpose for purpose, seed in FIRST.items() if seed == first))
    run = outside(*known[number]) if number < len(known) else drawn(first, number - len(known))
    return judged(run, number)


def judged(run: Run, number: int) -> dict[str, Any]:
    """What is said against a run, recorded at each rate."""
    logs = [
        {"rate": rate, **_said(log, run.vehicle, number + turn)}
        for turn, (rate, log) in enumerate(recorded(run.log, number).items())
    ]
    return {"kind": run.kind, "what": run.what, "logs": logs}


def _said(log: Log, vehicle: Vehicle, turn: int) -> dict[str, Any]:
    """What reading and checks say against one log."""
    try:
        read, vehicle, written = through_a_file(log, vehicle, turn)
    except LogError as error:
        return {
            "format": "",
            "refused": {_READING: error.typed},
            "sizes": {},
            "likely": {},
            "accused": {_READING: error.typed},
        }
    with noted() as faults:
        findings = examine(read, vehicle).findings
    refused = {f.check: f.sentence for f in findings if f.refused}
    if missing := problems(read, vehicle):
        refused[_READING] = missing[0]
    accused = {f.check: f.sentence for f in findings if f.verdict in ("defect", "warning")}
    sizes = {"sizes": sure_sizes(faults), "likely": likely_sizes(faults)}
    return {"format": written, "refused": refused, **sizes, "accused": {**accused, **refused}}


def page(records: Sequence[Mapping[str, Any]], command: str) -> str:
    """The study as a page in Markdown."""
    logs = [(record, log) for record in records for log in record["logs"]]
    told = [(record, log) for record, log in logs if log["refused"]]
    names = (*REFUSING, *sorted({name for _, log in logs for name in log["refused"]} - set(REFUSING)))
    by_check = []
    for name in names:
        hits, warned = (sum(name in log[what] for _, log in logs) for what in ("refused", "accused"))
        share = f"{hits / max(len(logs), 1):.2%} (< {bound(hits, len(logs), 0.95):.2%})"
        by_check.append((name, hits, share, warned - hits))
    by_kind = []
    for kind in Kind:
        sizes = [
            sorted((log[what][kind.name] for _, log in logs if kind.name in log[what]), reverse=True)
            for what in ("sizes", "likely")
        ]
        tails = [", ".join(f"{size:.2f}" for size in some[:3]) for some in sizes]
        by_kind.append((kind.name.lower().replace("_", " "), kind.value.check, len(sizes[0]), *tails))
    every = [*KINDS, *dict.fromkeys(record["kind"] for record in records if record["kind"] not in KINDS)]
    rows = [
        (
            title,
            len(some),
            sum(bool(log["refused"]) for log in some),
            sum(bool(set(log["accused"]) - _TRUE) for log in some),
        )
        for title, some in [
            *((kind, [log for record, log in logs if record["kind"] == kind]) for kind in every),
            *((f"{rate:g} Hz", [log for _, log in logs if log["rate"] == rate]) for rate in (50, 20, 10, 5, 2, 1)),
            *((name, [log for _, log in logs if log["format"] == name]) for name in FORMATS),
        ]
    ]
    parts = [
        "# Sound logs: how often one is refused",
        "Sound runs, recorded at 1 to 50 Hz, written in one of six formats, read, and sent through all checks. "
        "Refused: the verbs end with exit code 2. Accused: a check calls a defect or a warning, other than "
        "that the log has few rows a second. The boat on the lake has true faults: a compass that deviates and a late "
        "gyro.",
        f"**{len(accused_drawn(records))} of {sum(r['kind'] in KINDS for r, _ in logs)} logs that were drawn were "
        "accused.**",
        f"**{len(told)} of {len(logs)} sound logs of {len(records)} runs were refused** ({len(told) / len(logs):.2%}; "
        f"with 95 % confidence below {bound(len(told), len(logs), 0.95):.2%}, Clopper and Pearson, if logs of one run "
        "were independent). Each check that can refuse:",
        in_a_table(("check", "refused", f"share (at most {MOST:.1%})", "warned"), by_check),
        in_a_table(("logs", "number", "refused", "accused"), rows),
        f"The largest sizes of each kind of fault: what it surely takes away (refused from {OVERWHELMING:g} on), "
        "and what it likely does where it does not perhaps take nothing.",
        in_a_table(("fault", "check", "logs in which it was weighed", "sure", "likely"), by_kind),
        "All accusations:",
        "\n".join(
            f"- number {record['number']} at {log['rate']:g} Hz ({record['kind']}, {record['what']}), "
            f"{name}{' REFUSED' * (name in log['refused'])}: {text}"
            for record, log in logs
            for name, text in log["accused"].items()
            if name not in _TRUE
        )
        or "none.",
        f"Written by `{command}`; do not edit.",
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def accused_drawn(records: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Logs that were drawn, in which nothing is wrong, and that are accused."""
    drawn_logs = [log for record in records if record["kind"] in KINDS for log in record["logs"]]
    return [log for log in drawn_logs if set(log["accused"]) - _TRUE]


def most_refused(records: Sequence[Mapping[str, Any]]) -> float:
    """Share of the logs that the check refuses which refuses most."""
    logs = [log for record in records for log in record["logs"]]
    counts = [sum(name in log["refused"] for log in logs) for name in {n for log in logs for n in log["refused"]}]
    return max(counts, default=0) / max(len(logs), 1)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study and print its page."""
    records = Script("sound_logs", 520, FIRST, judge, _line, page, PACKAGES).carried_out(__doc__, arguments)
    return int(most_refused(records) >= MOST or bool(accused_drawn(records)))


def _line(records: Kept) -> str:
    """What accuses the logs of the last run."""
    last = records[-1]
    return "".join(
        f"{last['number']} at {log['rate']:g} Hz ({last['kind']}, {last['what']}): {name}: {text}\n"
        for log in last["logs"]
        for name, text in log["accused"].items()
        if name not in _TRUE
    ).strip()


if __name__ == "__main__":
    sys.exit(main())
