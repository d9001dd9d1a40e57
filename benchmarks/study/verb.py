"""One log through the verb, from files on, as a user runs it: what is true of it, and the facts of the answer.

Every study draws a `Logged`: a vehicle file, a log that is written to a file, and what is true. `answer` lets the verb
read both and keeps the facts of each name that stood in a model (its claim and the sizes of all tests), so that another
judgement of the same facts is scored in minutes and without running the verb again (`study/records.py`).
"""

import tempfile
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from undertow.discovery.balance.shooting import rollout_squares
from undertow.discovery.effect_findings import EffectFinding, Reason
from undertow.discovery.findings import WATER, Findings
from undertow.discovery.judgement import odds
from undertow.measurements.prepared_logs import Inputs
from undertow.physics.errors import LogError, RequestError
from undertow.physics.vehicle import Vehicle
from undertow.workflows.discover_and_add import discover
from undertow.workflows.inputs import read_inputs
from undertow.workflows.run_folder.write import Run

from .scoring import exact, label

HORIZON = 10.0
"""Length of the rollouts that judge a written model on another run of the same boat [s]."""
Record = dict[str, Any]
Write = Callable[[Path], Path]
"""Writes a log to a path and gives the path."""
Drive = Callable[[Path, int], Path]
"""Writes the log of another day, of which the first is 1, to a path and gives the path."""


@dataclass(frozen=True, slots=True)
class Logged:
    """One log before the verb sees it, and what is true of it.

    Attributes
    ----------
    study, kind, seed, note : where it comes from
    vehicle : the file that the verb is given
    write : writes the log
    fresh : writes another run of the same boat; neither fit nor selection sees that of day 1; None where there is none
    true : keys of the effects that are hidden (`thruster_asymmetry[port]` for one of a thruster)
    part : names of effects that are a fair part of the cause, or an exact equivalent of it
    sensors : errors of sensors or of the record that are the cause
    known : true values of parameters by symbol, in the way of the findings
    nameless : a cause acts that no effect of the catalogue is
    dominant : the hidden effect that makes over half of the nominal model's squared force or rollout error, or nothing
    matters : share by which 10 s rollouts of the file's boat part from the truth
    forces : of a cause without a name, which signals its force follows on which axis, as `surge:u` or `yaw:time`
    tellable : False where a judge who knows the truth could not tell it from another effect; None where nobody asked
    bound : why no such judge could, in words, empty where one could; asked of logs alone that are not answered exactly
    """

    study: str
    kind: str
    seed: int
    vehicle: Vehicle
    write: Write
    fresh: Drive | None = None
    note: str = ""
    true: frozenset[str] = frozenset()
    part: frozenset[str] = frozenset()
    sensors: frozenset[str] = frozenset()
    known: Mapping[str, float] = field(default_factory=dict)
    nameless: bool = False
    dominant: str = ""
    matters: float = 0.0
    forces: frozenset[str] = frozenset()
    tellable: bool | None = None
    bound: Callable[[], str] | None = None


def answer(logged: Logged) -> Record:
    """Let the verb look at a log, and keep what is true and the facts of what it says."""
    record: Record = {
        "study": logged.study,
        "kind": logged.kind,
        "seed": logged.seed,
        "note": logged.note,
        "true": sorted(logged.true),
        "part": sorted(logged.part),
        "sensors_true": sorted(logged.sensors),
        "nameless": logged.nameless,
        "dominant": logged.dominant,
        "matters": float(logged.matters),
        "forces": sorted(logged.forces),
        "tellable": logged.tellable,
    }
    with tempfile.TemporaryDirectory() as folder:
        path = logged.write(Path(folder) / "log.csv")
        begun = time.perf_counter()
        try:
            run = discover(read_inputs(path, logged.vehicle), progress=None)
        except (LogError, RequestError) as error:
            return record | {"verdict": "refused", "told": str(error)[:300]}
        record["seconds"] = round(time.perf_counter() - begun, 2)
        if logged.fresh is not None:
            with suppress(ArithmeticError, ValueError):  # another run may run away, or be refused
                record["fresh"] = errors_on(run, logged.fresh(Path(folder) / "fresh.csv", 1), logged.vehicle)
    return bounded(record | facts(run.findings, logged), logged)


def bounded(record: Record, logged: Logged) -> Record:
    """The record, and whether a judge who knows what is hidden could tell it, where it was not answered exactly."""
    if logged.bound is None or exact(record):
        return record
    why = logged.bound()
    return record | {"tellable": not why, "bound": why}


def facts(findings: Findings, logged: Logged) -> Record:
    """What the findings say, the claims of all names that stood in a model among it."""
    return {
        "verdict": findings.verdict,
        "headline": findings.headline[:200],
        "missing": [c.key for c in findings.candidates if c.verdict == "missing"],
        "likely": [c.key for c in findings.candidates if c.verdict == "likely"],
        "changed": changed(findings, logged),
        "first": next((c.key for c in findings.candidates if c.verdict != "no evidence"), ""),
        "unnamed": [t.symbol or f"{t.axis}:{t.form}" for t in findings.unnamed],
        "sensors": sorted({s.what for s in findings.sensors if s.verdict == "present" and s.correction != WATER}),
        "sensors_possible": sorted({s.what for s in findings.sensors if s.verdict == "possible"}),
        "sensors_clear": sorted({s.what for s in findings.sensors if s.verdict == "no evidence"}),
        "rests": [(rest.axis, rest.share) for rest in findings.rests],
        "passing": [(axis, share) for axis, share in findings.passing.items()],
        "forms": [(form.axis, form.follows, form.share) for form in findings.other_forms],
        "claims": [claimed(c, logged) for c in findings.candidates if c.claim is not None],
        # Of the names that stand in no model: how many there are, and which nearly earn their price.
        "unclaimed": sum(c.claim is None and not c.cannot_tell for c in findings.candidates),
        "nearly": [
            c.key
            for c in findings.candidates
            if c.claim is None and c.reason is not Reason.FAINT and c.confidence > odds().unselected
        ],
        "reasons": {
            c.key: c.reason.value
            for c in findings.candidates
            if c.reason is not None
            and (c.verdict != "no evidence" or label(c.key, logged.true, logged.part) != "false")
        },
    }


def changed(findings: Findings, logged: Logged) -> str:
    """The effect of which it is told that it has changed, or one of its look-alikes that is true; empty where none."""
    told = (findings.change.effect, *findings.change.alike) if findings.change is not None else ("",)
    return next((key for key in told if label(key, logged.true, logged.part) != "false"), told[0])


def claimed(effect: EffectFinding, logged: Logged) -> Record:
    """The facts of one claim, and whether it is true."""
    assert effect.claim is not None
    return {
        "key": effect.key,
        "label": label(effect.key, logged.true, logged.part),
        "verdict": effect.verdict,
        "kept": effect.claim.stands,
        "reason": effect.reason.value if effect.reason else "",
        "odds": effect.confidence,
        "alike": list(effect.indistinguishable_from),
        "claim": effect.claim.model_dump(mode="json"),
        "terms": [
            {"symbol": t.symbol, "value": t.value, "ci95": list(t.ci95) if t.ci95 else None, "truth": truth}
            for t in effect.terms
            for truth in [logged.known.get(t.symbol)]
        ],
    }


def errors_on(run: Run, path: Path, vehicle: Vehicle) -> Record:
    """Mean squared 10 s rollout errors on another run, by model, of each speed in units of its own mean square."""
    fresh: Inputs = read_inputs(path, vehicle)
    motions = [motion for part in (fresh.weak.train, fresh.weak.validation, fresh.weak.test) for motion in part.motions]
    models = {"nominal": run.discovery.nominal, "written": run.discovery.corrected}
    if run.calibrated is not None:
        models["calibrated"] = run.calibrated
    found = {name: np.mean(rollout_squares(motions, model, HORIZON), axis=0) for name, model in models.items()}
    scale = np.maximum(np.mean(np.concatenate([motion.velocity**2 for motion in motions]), axis=0), 1e-12)
    return {name: (squares / scale).tolist() for name, squares in found.items()}
