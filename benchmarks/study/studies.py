"""Every study by its name: which logs it has, and what is kept of them."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import isclose, sqrt
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed

from . import field_logs, foreign_logs, hidden_worlds, other_simulators, several_logs, wrong_sensors
from .records import CRASHED, ROOT, File, Kept, Record, opened, resumed, rounded, without_source
from .scoring import Odds, exact, rescored
from .verb import Logged, answer

FOLDER = ROOT / "benchmarks" / "records"
_OTHER_LOGS = 300
Key = tuple[str, int]


@dataclass(frozen=True, slots=True)
class Study:
    """Logs of a kind each.

    Attributes
    ----------
    keys : kinds and seeds, for tuning or for reporting
    logged : draws the log of a kind and a seed
    absent : why some of it cannot be run here; empty where all of it can
    """

    keys: Callable[[str], Sequence[Key]]
    logged: Callable[[str, int], Logged]
    absent: Callable[[], str] = lambda: ""


def _other_keys(purpose: str) -> list[Key]:
    kinds, first = tuple(other_simulators.KINDS), other_simulators.FIRST[purpose]
    return [(kinds[n % len(kinds)], first + n // len(kinds)) for n in range(_OTHER_LOGS)]


def _sea_keys(purpose: str) -> list[Key]:
    own = hidden_worlds.sea_keys(purpose)
    first, logs = hidden_worlds.SEA[purpose]
    return own + [(foreign_logs.IN_WAVES, first + 10_000 + n) for n in range(logs)]


def _sea(kind: str, seed: int) -> Logged:
    return foreign_logs.nameless_in_waves(seed) if kind == foreign_logs.IN_WAVES else hidden_worlds.sea(kind, seed)


STUDIES = {
    "plain": Study(hidden_worlds.plain_keys, hidden_worlds.plain),
    "nothing": Study(hidden_worlds.empty_keys, hidden_worlds.empty),
    "short": Study(hidden_worlds.short_keys, hidden_worlds.short),
    "seas": Study(_sea_keys, _sea),
    "worn": Study(hidden_worlds.worn_keys, hidden_worlds.worn),
    "turning": Study(hidden_worlds.turning_keys, hidden_worlds.turning),
    "several": Study(several_logs.keys, several_logs.several),
    "foreign": Study(foreign_logs.keys, foreign_logs.foreign),
    "nameless": Study(foreign_logs.nameless_keys, foreign_logs.nameless),
    "sensors": Study(wrong_sensors.keys, wrong_sensors.logged),
    "field": Study(field_logs.keys, field_logs.logged, field_logs.absent),
    "others": Study(_other_keys, other_simulators.logged),
}


def judged(study: str, key: Key) -> Record:
    """The record of one log; a verb that falls over is told, and does not end a study of hours."""
    kind, seed = key
    try:
        return answer(STUDIES[study].logged(kind, seed))
    except Exception as error:  # whatever it is, it is a fault of the verb or of the study
        told = f"{type(error).__name__}: {error}"[:300]
        blank = {
            "note": "",
            "true": [],
            "part": [],
            "sensors_true": [],
            "nameless": False,
            "dominant": "",
            "matters": 0.0,
        }
        return {"study": study, "kind": kind, "seed": seed, **blank, "forces": [], "verdict": CRASHED, "told": told}


def key_of(record: Record) -> Key:
    """Its kind and its seed."""
    return record["kind"], record["seed"]


def stored(study: str, purpose: str, folder: Path = FOLDER) -> File:
    """The records of a study."""
    return opened(folder / f"{study}-{purpose}.jsonl.gz")


def told(file: File, keys: Sequence[Key], odds: Odds) -> Kept:
    """What is kept of some logs, whoever made it, in their order, as the judgement of today would have answered."""
    kept = {key_of(record): record for record in (*file.older, *file.records)}
    return [rescored(kept[key], odds) for key in keys if key in kept]


def run(study: str, file: File, keys: Sequence[Key], jobs: int) -> Iterator[Kept]:
    """What is kept of some logs, each time the verb has answered one more.

    Records that other sources made are kept where these answer a sample of the logs with the same facts.
    """
    ask = partial(judged, study)
    return resumed(carried(file, keys, ask, jobs) if file.stale else file, keys, ask, jobs, key_of)


_SAMPLED = 20
"""Logs of a study at least, and one in how many of it, that are answered anew before its records are carried over."""
_ALIKE = 1e-3
"""Relative difference of two facts that are the same but for rounding: a hundredth of what any odds would notice."""
_CLOSE = 0.005
"""Difference of two errors on another run that are the same, as a share of the nominal error: a quarter of that by
which a written model counts as worse."""
_JUDGED = ("seconds", "headline", "missing", "likely", "first", "reasons", "reason", "odds", "told")
"""What is no fact: time, and what the judgement makes of the facts and says of them."""


def carried(file: File, keys: Sequence[Key], ask: Callable[[Key], Record], jobs: int) -> File:
    """The file with what others made as made by the sources as they are now, where these answer a sample of it alike.

    Else that sample is made anew, and the rest stays as it is.
    """
    older = [without_source(record) for record in file.older if key_of(record) in keys]
    records = [record for record in older if record["verdict"] != CRASHED]
    count = min(max(_SAMPLED, len(records) // _SAMPLED), len(records))
    sample = [records[len(records) * n // count] for n in range(count)]
    asked = [rounded(record) for record in Parallel(n_jobs=jobs)(delayed(ask)(key_of(record)) for record in sample)]
    other = [key_of(was) for was, now in zip(sample, asked, strict=True) if not alike(was, now)]
    print(f"{file.path.name}: {len(other)} of {count} logs have other facts now {other or ''}", flush=True)
    made = asked if other else records
    known = {key_of(record) for record in made}
    file.save([*file.records, *made], [record for record in file.older if key_of(record) not in known])
    return opened(file.path)


def errors_alike(was: Mapping[str, Any], now: Mapping[str, Any]) -> bool:
    """Whether the errors of models on another run are the same, as far as anything is told of them."""
    if was.keys() != now.keys():
        return False
    pairs = [[None if None in of[name] else sqrt(sum(of[name])) for of in (was, now)] for name in was]
    limit = _CLOSE * sqrt(sum(square or 0.0 for square in was["nominal"]))
    return all(one == two or (one is not None and two is not None and abs(one - two) <= limit) for one, two in pairs)


def alike(was: Any, now: Any) -> bool:
    """Whether two records hold the same facts, whatever is judged of them; what was not kept yet is as none of it."""
    if was in (None, []) and now in (None, []):
        return True
    if isinstance(was, dict) and isinstance(now, dict):
        keys = {*was, *now} - {*_JUDGED, "verdict", "tellable", "bound"}
        if was.get("fresh") and now.get("fresh"):
            close = errors_alike(was["fresh"], now["fresh"])
            return close and all(alike(was.get(key), now.get(key)) for key in keys - {"fresh"})
        return all(alike(was.get(key), now.get(key)) for key in keys)
    if isinstance(was, list) and isinstance(now, list):
        if was and isinstance(was[0], dict):
            was, now = (sorted(some, key=lambda one: str(one.get("key"))) for some in (was, now))
        return len(was) == len(now) and all(map(alike, was, now))
    if isinstance(was, float | int) and isinstance(now, float | int):
        return isclose(was, now, rel_tol=_ALIKE, abs_tol=_ALIKE**2)
    return bool(was == now)


def with_bounds(study: str, file: File, records: Kept, jobs: int) -> None:
    """Keep whether a judge who knows the truth could tell what another judgement of kept facts answers less exactly."""
    asked = [key_of(r) for r in records if r["true"] and r.get("tellable") is None and not exact(r)]
    reasons = dict(zip(asked, Parallel(n_jobs=jobs)(delayed(_why)(study, key) for key in asked), strict=True))
    more = {key: {"tellable": not why, "bound": why} for key, why in reasons.items() if why is not None}
    if more:
        kept, older = ([r | more.get(key_of(r), {}) for r in some] for some in (file.records, file.older))
        file.save(kept, older)


def _why(study: str, key: Key) -> str | None:
    """Why no judge could tell a log, None where that is not asked of its study."""
    logged = STUDIES[study].logged(*key)
    return None if logged.bound is None else logged.bound()
