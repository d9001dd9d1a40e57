"""The verb `export`: a model in the format of another tool, with all that is known about it."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from ..comparison.facts import AuditRecord, Comparison
from ..comparison.models_by_name import MODEL_CURE, load_model
from ..exports.formats.base import Choices, Given, format_named
from ..exports.known_facts import KnownFacts, KnownNumber
from ..measurements.prepared_logs import PathLike
from ..physics.errors import RequestError, expect, one_line
from ..physics.files import at_end, is_device, stream_of, write_bytes
from ..physics.forces import CURRENT
from ..physics.laws.damping_power import Envelope
from ..physics.momentum_balance import amount, values_of
from ..physics.presentation import Card, number
from ..physics.reading import Plain, read_bytes
from ..physics.sources import ALL
from ..physics.vehicle import load_vehicle
from ..reports.sureness import known_intervals, source_marks
from ..residuals.models.base import Model, VehicleModel
from ..residuals.models.foreign import FunctionModel
from .check_and_explain import check
from .run_folder.read import read_findings, read_record
from .run_folder.run_files import Kind, check_targets, own_run

if TYPE_CHECKING:
    from ..residuals.models.network_model import NetworkModel


@dataclass(frozen=True, slots=True, repr=False)
class Exported(Card):
    """A finished export.

    Attributes
    ----------
    files : that were written; the first is the one asked for
    facts : what is known about the model and stands in them
    """

    files: tuple[Path, ...]
    facts: KnownFacts

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        files = ", ".join(map(str, self.files))
        told = (("found", self.facts.found), ("audit", self.facts.audit[0]))
        return [("files", files), *told, ("left out", "; ".join(self.facts.left_out))]


def export(
    model: Model | PathLike, to: str, out: PathLike, choices: Choices | None = None, *, force: bool = False
) -> Exported:
    """Write a model in the format of another tool.

    Parameters
    ----------
    model : vehicle file or run folder, or its model; for casadi and onnx also the folder of a network
    to : name of the format, such as "c", "sdf" or "fmi"
    out : file to write; some formats write another beside it
    choices : of time step and dialect, see `Choices`
    force : write over what undertow did not write

    Raises
    ------
    RequestError, VehicleError
        when the model is no formula, the format is unknown, cannot hold the model or lacks a package, or a file cannot
        be written.
    """
    expect("export: model", model, (Model, str, os.PathLike), MODEL_CURE)
    chosen, target, asked = choices or Choices(), Path(out), format_named(to)
    if not 1e-4 <= chosen.time_step <= 10.0:
        raise RequestError(f"export: expected a time step of 0.0001 to 10 s, got {chosen.time_step:g} s")
    found = model if isinstance(model, Model) else load_model(model)
    network = _network(found) if asked.networks else None
    if network is None and not isinstance(found, VehicleModel):
        raise RequestError(
            f"export: expected a vehicle file or a run folder, whose model is a formula, got {found.name} "
            f"({found.kind}); 'undertow explain' says what of a network is a named effect, and 'undertow add' puts "
            "that into a vehicle; casadi and onnx take a network that undertow trained as it is"
        )
    path = None if isinstance(model, Model) else Path(model)
    check_targets([("--out", Kind.EXPORTED, target)], [path], force=force)
    facts = known_facts(found, path)
    facts = replace(facts, left_out=tuple(asked.left_out(Given(found.vehicle, facts, chosen))))
    written = asked.files(Given(found.vehicle, facts, chosen, network), target)
    if stream_of(target) is not None or is_device(target):
        written = {target: written[target]}  # beside a device or a stream nothing can stand
    others = [("--out", Kind.EXPORTED, each) for each in written if each != target]
    check_targets(others, [path], force=force)
    begin, end = asked.remark
    for each, content in written.items():
        write_bytes(each, at_end("export", content, begin.encode(), end.encode()) if begin else content)
    return Exported(tuple(written), facts)


def named_after(model: PathLike, to: str) -> Path:
    """The file, in the working folder, that an export of a model has where nobody names one.

    Parameters
    ----------
    model : vehicle file, run folder, or name of a shipped vehicle
    to : name of the format

    Raises
    ------
    RequestError
        when the format is unknown.

    Examples
    --------
    >>> str(named_after("runs/otter-run", "c")), str(named_after("runs/otter-run/model.yaml", "sdf"))
    ('otter-run.h', 'otter-run.sdf')
    """
    path = Path(model).absolute()
    name = path.parent.name if path.name == "model.yaml" else path.name.removesuffix(".yaml").removesuffix(".yml")
    named = Path(f"{name or 'model'}{format_named(to).suffix}")
    return named if named.absolute() != path else named.with_stem(f"{named.stem}_{to}")


def _network(model: Model) -> "NetworkModel | None":
    """A network beside a vehicle's physics or in its place; None for any other model."""
    if model.kind not in ("hybrid", "network") or isinstance(model, FunctionModel):
        return None
    from ..residuals.models.network_model import NetworkModel  # with torch, which made it

    return model if isinstance(model, NetworkModel) else None


def known_facts(model: Model, path: Path | None) -> KnownFacts:
    """All that is known about a model; of a run folder, what its findings and its audit say."""
    run = path.parent if path is not None and path.name == "model.yaml" else path
    own = own_run(run) if run is not None and run.is_dir() else set()
    intervals: dict[str, tuple[float, float]] = {}
    sure: dict[str, str] = {}
    audit: AuditRecord | None = None
    said: list[str] = []
    if run is not None and {"model.yaml", "findings.json"} <= own:
        findings = read_findings(read_bytes(run / "findings.json"), run / "findings.json")
        nominal = load_vehicle(run / "nominal.yaml") if "nominal.yaml" in own else model.vehicle
        intervals, sure, said = known_intervals(findings, nominal), source_marks(findings), [findings.headline]
    if run is not None and {"model.yaml", "comparison.json"} <= own:
        said.append(read_record(read_bytes(run / "comparison.json"), Comparison, run / "comparison.json").best.sentence)
    if run is not None and {"model.yaml", "audit.json"} <= own:
        audit = read_record(read_bytes(run / "audit.json"), AuditRecord, run / "audit.json")
    if audit is None:
        judged = check(model, progress=None)
        envelope, whence, verdict, laws = judged.envelope, judged.envelope_from, judged.verdict, judged.rulings
    else:
        whence, verdict, laws = audit.envelope_from, audit.verdict, audit.laws
        u, v, r = (audit.envelope[name] for name in "uvr")
        envelope = Envelope((u[0], v[0], r[0]), (u[1], v[1], r[1]))
    broken = [law for law in laws if law.verdict == "fail" and law.counts]
    kept = sum(law.verdict == "pass" for law in laws)
    numbers, notes = _numbers(model, intervals, sure)
    text = f"{verdict}: of {len(laws)} laws of a hull in water {kept} are kept and {len(broken)} broken."
    return KnownFacts(
        name=one_line(model.vehicle.name),
        source=f"{one_line(path.name) if path else model.name} (vehicle {model.vehicle.digest})",
        version=version("undertow"),
        envelope=envelope,
        envelope_from=whence,
        audit=(text, *(f"{law.law}: {law.sentence}" for law in broken)),
        numbers=numbers,
        notes=(*notes, *_learnt(model)),
        found=one_line(" ".join(said)),
    )


def _numbers(
    model: Model, intervals: Mapping[str, tuple[float, float]], sure: Mapping[str, str]
) -> tuple[tuple[KnownNumber, ...], list[str]]:
    """Each number of a model that is not null, with its unit, interval and source; then the sources of sections.

    Of a vehicle whose physics a network replaces, these are the thrusters and the current, which the network sees.
    A section's source may be one text, or one for each symbol or thruster in it.
    """
    vehicle, found, notes = model.vehicle, list[KnownNumber](), list[str]()
    kept = (ALL, "thrusters") if model.kind == "network" else tuple(vehicle.sources)
    sources: Plain = {}
    for key, entry in vehicle.sources.items():
        if key in kept:
            inside = entry if isinstance(entry, Mapping) else {}
            sources |= {name if name in vehicle.values else f"{key}, {name}": text for name, text in inside.items()}
            sources |= {} if inside else {key: entry}
    for symbol in vehicle.values:
        parameter = vehicle.parameter(symbol)
        seen = model.kind != "network" or parameter.section == "thrusters" or symbol in CURRENT[:2]
        if not seen or all(value == parameter.null for value in values_of(vehicle, symbol)):
            continue
        ends = " to ".join(number(end) for end in intervals.get(symbol, ()))
        source, size = one_line(str(sources.pop(symbol, ""))), amount(vehicle, symbol, 9, parameter.unit)
        found.append(KnownNumber(symbol, size, ends, source, sure.get(symbol, "")))
    for thruster in vehicle.thrusters:
        place = f"x {number(thruster.x)} m, y {number(thruster.y)} m, angle {number(thruster.angle)} rad"
        place = "of the whole vessel" if thruster.command == "tau" else place
        notes.append(f"thruster {thruster.name}: {place}, command {thruster.channel}, {thruster.curve.kind} curve")
    whole = sources.pop(ALL, None)
    rest = ([("source", whole)] if whole else []) + [(f"source of {key}", text) for key, text in sources.items()]
    return tuple(found), notes + [f"{what}: {one_line(str(text))}" for what, text in rest]


def _learnt(model: Model) -> list[str]:
    """What a network adds to the numbers."""
    if isinstance(model, VehicleModel):
        return []
    whose = " in the place of the vehicle's physics" * (model.kind == "network")
    return [f"network {model.name}{whose}: {model.parameters} learnt numbers, for rows {model.time_step:g} s apart"]
