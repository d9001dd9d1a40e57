"""What `discover` makes of worlds that break its assumptions: a study with a simulator of its own, from log files on.

Each world has a boat of another simulator (`study/foreign_boats.py`), a sensor that errs, a boat that changes, a
vehicle file that is wrong, a cause without a name, a record of commands that is not what acted, or too short a log.
What is true of each kind, and what is a fair part of it, is written down in `study/foreign_kinds.py`; any other name
that is called missing is false. Results are kept in a folder, so that a study which was stopped goes on where it was;
they count only for the undertow that made them.

    python benchmarks/foreign_worlds.py [--logs 600] [--seeds tuning|reporting] [--jobs N] [--tell]
        [--table docs/foreign_worlds.md]
    python benchmarks/foreign_worlds.py --one "drag with a kink" 300000

The second form tells of one world alone, and writes its log and vehicle file where `--into FOLDER` at its end says.

Exit code 1 where more than one in a hundred logs got a false name.
"""

import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from study.foreign_kinds import KINDS, prepare
from study.foreign_orders import DRAWN, boat
from study.foreign_sensors import NOISES
from study.foreign_world import World
from study.resumed import Study, bound, carried_out, in_a_table, times_told

from undertow.discovery.findings import Findings
from undertow.physics.errors import LogError, RequestError, VehicleError
from undertow.workflows.discover_and_add import discover
from undertow.workflows.inputs import read_inputs

Record = dict[str, Any]
FIRST = {"tuning": 300_000, "reporting": 350_000}
"""Seeds from 310,000 to 310,004, 320,000 to 320,007, 330,000 to 330,011 and 340,000 to 340,011 were reported once, and
tuned on since."""
ROOMS = ("physics", "measurements", "discovery", "residuals", "comparison", "workflows")
LOGS, MOST, _DRAWS = 600, 0.01, 50
_MATERIAL = 0.03
"""Share by which 10 s rollouts of the file's boat part from the truth, above which something material is hidden."""
OUTCOMES = ("false", "true", "part", "sensor told", "a term", "undecided", "passed by", "refused")
INTRODUCTION = f"""Each log has random hull, programme, noise and size of the cause. False: an effect was called missing
that is neither hidden nor a fair part of what is. True: all that is hidden was called missing, or nothing material is
hidden and nothing was. Part: what was called missing is a part of it. Sensor told: nothing was called missing, and the
sensor or the record is told, if need be by a refusal that says what of it is wrong. A term: only terms without a name.
Undecided; the cause listed: of these, the cause is among what may be there. Passed by: nothing missing, though rollouts
of 10 s part by {_MATERIAL:.0%} and more. Refused: the log was taken for a broken one, for another reason than its own.
Accused, whatever the answer: a sensor or a record was told that is right."""
NAMES = tuple(KINDS)


def world_of(name: str, seed: int) -> World:
    """A world of a kind, not driven yet."""
    rng = np.random.default_rng([seed, *name.encode()])
    programme, noise = str(rng.choice(DRAWN)), str(rng.choice(tuple(NOISES)))
    world = World(seed, rng, boat(rng), programme, noise)
    prepare(world, KINDS[name])
    return world


def judge(first: int, number: int) -> Record:
    """Draw a world, write its log, and let the verb look at it; so many logs in turn have each kind."""
    return judged(NAMES[number % len(NAMES)], first + number // len(NAMES))


def judged(name: str, seed: int, into: Path | None = None) -> Record:
    """What the verb says of one world, beside what is true."""
    for draw in range(_DRAWS):
        try:
            world = world_of(name, seed + 1_000_000 * draw)
            truth = world.drive()
            break
        except (ArithmeticError, VehicleError):  # no sound world: another
            continue
    else:
        raise RuntimeError(f"{name}, seed {seed}: no sound world in {_DRAWS} draws")
    record: Record = {
        "kind": name,
        "seed": seed,
        "programme": world.programme,
        "noise": world.noise,
        "note": world.note,
        "seconds_of_log": world.seconds,
        "true": sorted(world.true),
        "part": sorted(world.part),
        "cause": sorted(world.sensors),
        "matters": world.matters(truth),
    }
    with tempfile.TemporaryDirectory() as folder:
        path = world.log(truth, (into or Path(folder)) / "log.csv")
        if into is not None:
            world.file.save(into / "vehicle.yaml")
        begun = time.perf_counter()
        try:
            findings = discover(read_inputs(path, world.file), progress=None).findings
        except (LogError, RequestError) as error:
            return record | {"verdict": "refused", "told": str(error)[:300]}
        return record | {"seconds": time.perf_counter() - begun} | said(findings, world)


def said(findings: Findings, world: World) -> Record:
    """What is told of a world."""
    fair = world.true | world.part
    missing = [c for c in findings.candidates if c.verdict == "missing"]
    possible = {c.effect for c in findings.candidates if c.verdict == "possible" and not c.cannot_tell}
    possible |= {other for c in findings.candidates for other in c.indistinguishable_from}
    terms = [t for c in missing if c.effect in fair for t in c.terms if t.symbol in world.known]
    doubted = {s.what for s in findings.sensors if s.verdict == "possible"}
    return {
        "verdict": findings.verdict,
        "missing": [c.effect for c in missing],
        "false": [c.effect for c in missing if c.effect not in fair],
        "unnamed": [t.symbol for t in findings.unnamed],
        "sensors": sorted({s.what for s in findings.sensors if s.verdict == "present"}),
        "listed": sorted(possible & fair) + sorted((possible | doubted) & world.sensors),
        "possible": sorted(possible),
        "headline": findings.headline[:300],
        "terms": [
            {
                "symbol": t.symbol,
                "value": t.value,
                "truth": float(world.known[t.symbol]),
                "covered": bool(t.ci95.lower <= world.known[t.symbol] <= t.ci95.upper),
            }
            for t in terms
            if t.ci95 is not None
        ],
    }


def outcome(record: Record) -> str:
    """In a word, what a log was answered."""
    if record["verdict"] == "refused":
        words = KINDS[record["kind"]].refusal
        return "sensor told" if words and words in record["told"] else "refused"
    if record["false"]:
        return "false"
    if record["missing"]:
        return "true" if record["true"] and set(record["true"]) <= set(record["missing"]) else "part"
    if set(record["sensors"]) & set(record["cause"]):
        return "sensor told"
    if record["unnamed"]:
        return "a term"
    if record["verdict"] == "undecided":
        return "undecided"
    return "passed by" if record["matters"] >= _MATERIAL else "true"


def accused(record: Record) -> bool:
    """Whether a sensor, or the record of commands, is told that is right."""
    return bool(set(record.get("sensors", ())) - set(record["cause"]))


def honest(record: Record) -> bool:
    """Whether the cause is named, in part at least, or its sensor, or it is among what the log cannot tell."""
    word = outcome(record)
    if word == "undecided":
        nameless = not (record["true"] or record["part"] or record["cause"] or record["note"] == "nothing hidden")
        return bool(record["listed"]) or nameless
    return word in ("true", "part", "sensor told", "a term")


def page(records: Sequence[Record], command: str) -> str:
    """The study as a page in Markdown."""
    words = [outcome(r) for r in records]
    false, rows = words.count("false"), []
    for name, kind in KINDS.items():
        of = [(r, word) for r, word in zip(records, words, strict=True) if r["kind"] == name]
        if of:
            answers = [word for _, word in of]
            listed = sum(word == "undecided" and bool(r["listed"]) for r, word in of)
            counts = [answers.count(word) for word in OUTCOMES]
            accusing = sum(accused(r) for r, _ in of)
            rows.append((f"{kind.group}: {name}", len(of), *counts[:6], listed, *counts[6:], accusing))
    total = max(len(records), 1)
    terms = [t for r in records for t in r.get("terms", ())]
    covered = sum(t["covered"] for t in terms)
    told = sum(map(honest, records)) / total
    shares = ", ".join(f"{word} {words.count(word) / total:.1%}" for word in OUTCOMES)
    head = ("kind", "logs", *OUTCOMES[:6], "the cause listed", *OUTCOMES[6:], "accused")
    parts = [
        "# Foreign worlds",
        f"Written by `{command}`; do not edit. {INTRODUCTION}",
        f"**{false} of {len(records)} logs got a false name** ({false / total:.1%}; at most {MOST:.0%} is asked); with "
        f"95 % confidence it is below {bound(false, total, 0.95):.1%}. In all: {shares}. {told:.1%} "
        "were told of the cause (at least 90 % is asked): it is named, in part at least, or its sensor, or a term, or, "
        "where it has a name, it is among what the log cannot tell. "
        f"In {sum(accused(r) for r in records)} a sensor or a record that is right was accused.",
        in_a_table(head, rows),
        "\n".join(
            f"- {r['kind']}, seed {r['seed']} ({r['programme']}, {r['noise']}{r['note'] and ', '}{r['note']}): "
            f"{', '.join(r['false'])}"
            for r, word in zip(records, words, strict=True)
            if word == "false"
        ),
        f"Of the {len(terms)} intervals of right names whose true value is known {covered} hold it "
        f"({covered / max(len(terms), 1):.1%}; 92 to 98 % is asked).",
        times_told(records),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _line(records: Sequence[Record]) -> str:
    """What came of the last log."""
    r = records[-1]
    told = f"{r.get('missing', '')} {r.get('unnamed', '')} {r.get('sensors', r.get('told', ''))}"
    where = f"{r['kind']} {r['seed']} {r['programme']} {r['noise']} {r['note']}"
    return f"{where} matters {r['matters']:.2f} | {outcome(r)} | {told} | {r.get('seconds', 0.0):.0f} s"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study and print its page, or tell of one world."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if given[:1] == ["--one"]:
        into = Path(given[4]) if given[3:4] == ["--into"] else None
        record = judged(given[1], int(given[2]), into)
        for key, value in record.items():
            print(f"{key}: {value}")
        print(outcome(record))
        return int(outcome(record) == "false")
    records = carried_out(Study("foreign_worlds", LOGS, FIRST, judge, _line, page, ROOMS), __doc__, given)
    return int(sum(outcome(r) == "false" for r in records) > MOST * len(records))


if __name__ == "__main__":
    sys.exit(main())
