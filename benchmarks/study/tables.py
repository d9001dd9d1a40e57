"""The pages that tell of the studies, from their records."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .limits import FIELD, FOREIGN, HIDDEN, NAMELESS, NOTHING, SEAS, SENSORS, SEVERAL, SHORT, TURNING, Records, Row
from .records import Record, bound, in_a_table
from .scoring import OUTCOMES, accused, exact, false_names, outcome


@dataclass(frozen=True, slots=True)
class Page:
    """A page of `docs/`: what it is of, in words, its studies, and what must hold."""

    title: str
    about: str
    studies: tuple[str, ...]
    rows: tuple[Row, ...]


_WORDS = """*False*: a name is called missing that is neither hidden nor a fair part of what is. *Exact*: all that is
hidden is called missing, and nothing else, or nothing is where nothing material is hidden. *Part*: a part of the cause
is missing. *Likely*: it is likely alone. *Sensor told*: the sensor, or the record, if need be by a refusal that says
what is wrong with it. *A force*: a term without a name, or a force of the right axis and variable. *Passed by*:
nothing is said to be missing, though rollouts of 10 s part by 3 % and more. *Refused*: for another reason than its
own. *Accused*: a sensor or a record is told that is right."""
PAGES = {
    "hidden_effects": Page(
        "Hidden effects: how often discovery is right",
        "Each log is 300 s of a random sister of `blueboat`, `otter` or `blueboat_paper` (masses, added masses and "
        "damping each varied by up to a third), with random effects of the catalogue hidden in it, each large enough "
        "to change 10 s rollouts by 3 %. Field noise is 0.015 m/s and 0.006 rad/s, rough noise 0.04 m/s and 0.015 "
        "rad/s (standard deviations), with noise on heading and position, jitter of the time stamps and 1 % dropouts."
        " A log cannot be told where an effect changes 10 s rollouts by less than 3 % beside the others, or where "
        "others in its place are worse by less than 10.6 log-likelihood: more than one in 1,000 such names is wrong, "
        "whatever the method.",
        ("plain",),
        HIDDEN,
    ),
    "nothing_hidden": Page(
        "Nothing hidden: how often anything is named",
        "Logs of 300 s of random sisters of the shipped vehicles, driven by the very model that discovery gets, over "
        "every programme, with field, rough, low and no noise, one in ten in waves and two in ten steered by an "
        "autopilot at 10 Hz that follows what the log's sensors say. Whatever is called missing, an unnamed term "
        "included, is false.",
        ("nothing",),
        NOTHING,
    ),
    "log_lengths": Page(
        "Short logs: what they can tell",
        "Random sisters of the shipped vehicles with one hidden effect (each of the catalogue in turn) or none, field"
        " noise, rich, zigzag and gentle programmes. Each log is of five minutes; discovery gets a piece of it, from "
        "a random moment on, or the whole.",
        ("short",),
        SHORT,
    ),
    "seas": Page(
        "Waves, and noise that lasts",
        "Logs of 300 s as those of hidden effects, with one effect, two or none, but measured in waves (0.05 to 0.2 m/s"
        " of orbital velocity, which is no force and no noise of any sensor), or with noise that lasts for seconds, as "
        "that of a filter which merges a receiver, a compass and a gyro. Most are judged by rollouts.",
        ("seas",),
        SEAS,
    ),
    "turning_hulls": Page(
        "Hulls that turn by themselves",
        "Logs of 300 s of random sisters of the shipped vehicles whose Munk moment is larger than what damping holds: "
        "at 60 % of top speed a small turn of the file's hull grows e-fold in 0.8 to 3.3 s. One effect or none, field, "
        "low or rough noise, under the programmes of the other studies or steered for waypoints by an autopilot at "
        "10 Hz.",
        ("turning",),
        TURNING,
    ),
    "several_logs": Page(
        "Several logs at once",
        "Three to six logs of 90 s of one boat, as a day on the water leaves them, with one effect, three, six (a file "
        "of guesses), none, or a force that has no name: other programmes, other noise, and of every other boat "
        "another current of up to 0.1 m/s. The noise of the receiver lasts for seconds, so that mostly rollouts judge.",
        ("several",),
        SEVERAL,
    ),
    "foreign_worlds": Page(
        "Foreign worlds",
        "Each log has a boat of another simulator, a sensor that errs, a boat that changes, a vehicle file that is "
        "wrong, a cause without a name, a record of commands that is not what acted, or is too short, with random "
        "hull, programme, noise and size of the cause. What is true of each kind was written down before any was "
        "asked about. Below are logs of other people's simulators, of Gazebo and of a real boat.",
        ("foreign", "others", "field"),
        (*FOREIGN, *FIELD),
    ),
    "foreign_causes": Page(
        "Causes without a name",
        "Random hulls, 240 s, noise and programmes mixed, one force more that the catalogue does not hold, or two "
        "effects that it does.",
        ("nameless",),
        NAMELESS,
    ),
    "sensor_errors": Page(
        "Sensors that are wrong",
        "Random hulls, 240 s at 20 Hz, nothing hidden or one effect, one error of a sensor at a time, or none.",
        ("sensors",),
        SENSORS,
    ),
}


def must_hold(rows: Sequence[Row], records: Records) -> str:
    """Limits and figures as a table."""
    return in_a_table(("", "limit", "figure", "holds"), [row.cells(records) for row in rows])


def by_kind(some: Sequence[Record]) -> str:
    """What logs of each kind were answered, as a table."""
    rows = []
    for kind in dict.fromkeys(r["kind"] for r in some):
        logs = [r for r in some if r["kind"] == kind]
        words = [outcome(r) for r in logs]
        likely = sum(bool(false_names(r, "likely")) for r in logs)
        seconds = float(np.median([r["seconds"] for r in logs if "seconds" in r] or [0.0]))
        counts = (words.count(word) for word in OUTCOMES)
        rows.append((kind, len(logs), *counts, likely, sum(map(accused, logs)), f"{seconds:.1f}"))
    return in_a_table(("kind", "logs", *OUTCOMES, "false likely", "accused", "time [s]"), rows)


def page(name: str, records: Records, command: str) -> str:
    """A page in Markdown."""
    this = PAGES[name]
    some = [r for study in this.studies for r in records.get(study, ())]
    false = sum(bool(false_names(r)) for r in some)
    parts = [
        f"# {this.title}",
        this.about,
        f"**{false} of {len(some)} logs got a false name**; with 95 % confidence it is below "
        f"{100.0 * bound(false, max(len(some), 1), 0.95):.2f} % (Clopper and Pearson).",
        "## What must hold",
        must_hold(this.rows, records),
        "## Kinds",
        _WORDS,
        *(by_kind(records[study]) for study in this.studies if records.get(study)),
        "## Every log that went wrong",
        "\n".join(map(_told, filter(_wrong, some))) or "None.",
        times(some),
        f"Written by `{command}`; do not edit.",
    ]
    return "\n\n".join(parts) + "\n"


def _wrong(record: Record) -> bool:
    """Whether a log has a false name, or one whose effects drive richly is not told exactly."""
    certain = record["study"] == "plain" and record["kind"] not in ("gentle", "zigzag")
    return bool(false_names(record, "missing", "likely")) or (certain and not exact(record))


def _told(record: Record) -> str:
    """A log that went wrong, in a line of a list."""
    said = [", ".join(record.get(word, ())) for word in ("missing", "likely", "unnamed")]
    words = [f"{word} {text}" for word, text in zip(("missing", "likely", "term"), said, strict=True) if text]
    hidden, why = ", ".join(record["true"]) or "no effect", record.get("bound") or record.get("told", "")
    told = "; ".join(words).replace("|", r"\|") or record["verdict"]
    return f"- {record['kind']}, seed {record['seed']} ({record['note']}): {told}, for {hidden}{why and f' ({why})'}"


def times(some: Sequence[Record]) -> str:
    """How long answers took, in words."""
    seconds = [r["seconds"] for r in some if "seconds" in r] or [0.0]
    median, most = np.percentile(seconds, (50.0, 90.0))
    return (
        f"An answer took {median:.1f} s in the median, nine of ten at most {most:.1f} s, the longest "
        f"{max(seconds):.0f} s."
    )
