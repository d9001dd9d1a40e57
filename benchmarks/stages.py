"""What each stage of a discovery is worth: the same logs answered with the stage left out, and as it is.

A stage is worth what the answers lose without it: true names that are missing or likely, false ones, nameless causes
told, the error of the written model on another run of the boat, and time. Logs are of tuning seeds, and of the field,
through the verb.

    python benchmarks/stages.py [--stage NAME]... [--jobs N] [--kept FILE] [--tell]

What was asked is kept, and gone on with; a change of the sources wants another file.
"""

import argparse
import importlib
import json
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
DRAWN = {"plain": 10, "short": 6, "foreign": 12, "others": 10, "nameless": 10, "seas": 5, "sensors": 4, "field": 8}
"""Logs of each study: kinds evenly through it, or logs where it has fewer kinds."""
SLOW = (
    *("compass that deviates", "gusts without an anemometer", "Otter with a payload: one effect"),
    *("a cargo that goes overboard", "propellers that draw air"),
)
"""Kinds that take over 20 s a log: left out, or a stage would take twice as long."""
Log = tuple[str, str, int]
Answers = dict[Log, dict[str, Any]]


def gives(value: Any) -> Callable[[Any], Any]:
    """Something that gives a value, whatever it is asked."""
    return lambda was: lambda *given, **more: value


def gives_back(place: int) -> Callable[[Any], Any]:
    """Something that gives back one of what it is given."""
    return lambda was: lambda *given, **more: given[place]


def no_forms(was: Any) -> Any:
    """No force without a name."""
    return lambda *given: importlib.import_module("undertow.discovery.evidence.unmodelled_forces").UnmodelledForces()


def no_chance(was: Any) -> Any:
    """A name that no rehearsal of nothing reaches."""
    chance = importlib.import_module("undertow.discovery.search.surrogates").Chance
    return lambda self, key: chance(better=0, of=999, of_noise=True)


def noise_alone(was: Any) -> Any:
    """Structure by the noise of sensors, whatever the record of commands."""
    return lambda search, state: search.has_residual_structure(state.fit.held_out)


STAGES: Mapping[str, Sequence[tuple[str, str, Callable[[Any], Any]]]] = {
    "as it is": (),
    "two effects for one": (("search.floating", "split_effects", gives(())),),
    "twins of terms": (("selection", "find_twins", gives([])),),
    "coarse records": tuple((room, "has_residual_structure", noise_alone) for room in ("selection", "basis")),
    "general laws as rivals": (("evidence.weighing", "_general_instead", gives({})),),
    "pairs as rivals": (("evidence.weighing", "_pairs", gives({})),),
    "rivals in every part": (("evidence.weighing", "_in_every_part", gives(True)),),
    "rivals beside the model": (("evidence.weighing", "_with_both", lambda was: lambda model, key: model.state),),
    "common scale": (("selection", "as_common_scale", gives_back(1)),),
    "search without what is at a limit": (("selection", "at_limit", gives(False)),),
    "what no hull has": (
        ("search.floating", "beyond_any_hull", gives(False)),
        ("evidence.weighing", "beyond_any_hull", gives(False)),
    ),
    "simpler than general": (("search.floating", "Search._simplest", gives_back(1)),),
    "pruning": (("search.floating", "Search._prune", gives_back(1)),),
    "inclusion of terms": (("discover", "inclusion", gives({})),),
    "rounds of rollouts": (("selection", "_ROUNDS", lambda was: 1),),
    "lasting rests": (("discover", "find_persistent_residuals", gives(())),),
    "passing rests": (("discover", "find_passing_residuals", gives({})),),
    "invariance": (("discover", "invariance", gives({})),),
    "changes within the log": (("discover", "find_changing_forces", gives({})),),
    "forces without a name": (("discover", "fit_unmodelled_forces", no_forms),),
    "rehearsals of nothing": (("search.surrogates", "SurrogateTest.chance", no_chance),),
    "straight runs": (("basis", "_DEVIATES", lambda was: ""),),
    "what moves a quiet axis": (("selection", "add_faint_structure", gives_back(3)),),
    "effects beside the kept": (("discover", "add_subthreshold", gives_back(1)),),
    "weak effects pruned": (("selection", "prune_weak", gives_back(1)),),
    "trials too small to matter": (("search.floating", "Search._worth_a_try", gives(True)),),
    "wider intervals": (("discover", "widen_intervals", lambda was: lambda found, *more: dict(found)),),
}
"""For each stage where it is called under `discovery`, and what stands in its place, made of what stood there."""


def drawn() -> list[Log]:
    """The logs."""
    from study.studies import STUDIES

    found: list[Log] = []
    for study, count in DRAWN.items():
        keys = list(STUDIES[study].keys("tuning") or STUDIES[study].keys("reporting"))  # field logs are what they are
        kinds = list(dict.fromkeys(kind for kind, _ in keys))
        if len(kinds) < count:
            found += [(study, *keys[len(keys) * number // count]) for number in range(count)]
            continue
        for number in range(count):
            kind = kinds[len(kinds) * number // count]
            seeds = [seed for other, seed in keys if other == kind]
            found.append((study, kind, seeds[(3 + number) % len(seeds)]))
    return [log for log in found if log[1] not in SLOW]


def child() -> int:
    """Answer one log with a stage left out."""
    from dataclasses import replace

    from study.scoring import false_names, force_told, label, outcome, sensor_told
    from study.studies import STUDIES
    from study.verb import answer

    stage, study, kind, seed = json.loads(sys.stdin.read())
    for room, name, made in STAGES[stage]:
        owner: Any = importlib.import_module(f"undertow.discovery.{room}")
        *outer, last = name.split(".")
        for one in outer:
            owner = getattr(owner, one)
        setattr(owner, last, made(getattr(owner, last)))
    record = answer(replace(STUDIES[study].logged(kind, seed), bound=None))
    said = [*record.get("missing", ()), *record.get("likely", ())]
    fresh = record.get("fresh", {})
    found = {
        "outcome": outcome(record),
        "true": sorted(key for key in said if label(key, record["true"], record["part"]) != "false"),
        "false": sorted(false_names(record, "missing", "likely")),
        "told": bool(record["nameless"] and (force_told(record) or sensor_told(record))),
        "seconds": record.get("seconds", 0.0),
        "error": sum(fresh["written"]) if "written" in fresh else None,
        "odds": {claim["key"]: claim["odds"] for claim in record.get("claims", ())},
    }
    print(json.dumps(found))
    return 0


def asked(stage: str, log: Log) -> dict[str, Any]:
    """The same in a process of its own."""
    given = json.dumps([stage, *log])
    done = subprocess.run([sys.executable, __file__, "--child"], input=given, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{stage}, {log}: {done.stderr[-2000:]}")
    return dict(json.loads(done.stdout.splitlines()[-1]))


def told(stage: str, here: Answers, base: Answers) -> str:
    """What a stage is worth, in a line, and the logs that are answered otherwise without it."""

    def counted(some: Answers) -> str:
        true, false = (sum(len(answer[word]) for answer in some.values()) for word in ("true", "false"))
        causes, seconds = (sum(answer[word] for answer in some.values()) for word in ("told", "seconds"))
        return f"{true} true, {false} false, {causes} nameless told, {seconds:.0f} s"

    pairs = [(here[log]["error"], base[log]["error"]) for log in here]
    ratios = [max(one, 1e-9) / max(other, 1e-9) for one, other in pairs if one is not None and other is not None]
    otherwise = [
        log for log in here if any(here[log][word] != base[log][word] for word in ("true", "false", "outcome"))
    ]
    moved = sum(
        any(abs(here[log]["odds"].get(key, 0.0) - base[log]["odds"].get(key, 0.0)) > 0.05 for key in base[log]["odds"])
        for log in here
    )
    error = float(np.exp(np.mean(np.log(ratios)))) if ratios else 1.0
    head = (
        f"without {stage}: {len(here)} logs, {counted(here)} (as it is {counted(base)}); the written model errs "
        f"{error:.3f} times as much; {len(otherwise)} answered otherwise, odds move in {moved}"
    )
    lines = [f"    {log}: {base[log]['outcome']} -> {here[log]['outcome']} {here[log]['false']}" for log in otherwise]
    return "\n".join([head, *lines])


def main(arguments: Sequence[str] | None = None) -> int:
    """Ask what is not kept, and print what each stage is worth."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stage", action="append", choices=STAGES, default=[])
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--kept", type=Path, default=ROOT / "runs" / "stages.jsonl")
    parser.add_argument("--tell", action="store_true", help="run nothing, only tell what is kept")
    given = parser.parse_args(arguments)
    logs, kept = drawn(), {}
    if given.kept.exists():
        for stage, log, answer in map(json.loads, given.kept.read_text("utf-8").splitlines()):
            kept[stage, tuple(log)] = answer
    given.kept.parent.mkdir(parents=True, exist_ok=True)
    for stage in dict.fromkeys(("as it is", *(given.stage or STAGES))):
        todo = [] if given.tell else [log for log in logs if (stage, log) not in kept]
        with ThreadPoolExecutor(given.jobs) as pool, given.kept.open("a", encoding="utf-8") as file:
            for log, answer in zip(todo, pool.map(lambda log, stage=stage: asked(stage, log), todo), strict=True):
                kept[stage, log] = answer
                file.write(f"{json.dumps([stage, log, answer])}\n")
                file.flush()
        both = [log for log in logs if (stage, log) in kept and ("as it is", log) in kept]
        print(told(stage, {log: kept[stage, log] for log in both}, {log: kept["as it is", log] for log in both}))
    return 0


if __name__ == "__main__":
    sys.exit(child() if "--child" in sys.argv else main())
