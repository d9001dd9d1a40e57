"""Reading of a run folder, whole, with all numbers, texts and lists within bounds, and clear words for an error."""

import hashlib
import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from ...comparison.facts import AuditRecord, Comparison, MadeFrom
from ...discovery.basis import DiscoverySettings
from ...discovery.effect_findings import FoldRecord
from ...discovery.findings import Findings
from ...discovery.run_models import values_of_step
from ...measurements.inspection import Inspections
from ...measurements.log_options import Reading
from ...measurements.prepared_logs import FOLDS, Inputs, PathLike
from ...physics.errors import RequestError, VehicleError, listed, shortened, shown
from ...physics.file_records import Record
from ...physics.folders import finish_move
from ...physics.reading import MOST_TEXT, parse_json, parse_yaml, read_bytes, reason, text_of
from ...physics.stage import Say
from ...physics.vehicle import Vehicle, load_vehicle, vehicle_from_dict
from ...reports.run_contents import ComparisonFolder, RunFolder
from ...reports.terminal.progress import SHOWN
from ...residuals.models.neural import is_network_folder
from .moved_files import UNMOVED, Moved, RunOrigin, logs_now, map_now
from .run_files import RECORD, content_of

if TYPE_CHECKING:
    import pandas as pd


LARGEST = 1e15
"""No quantity of a boat or its log is larger, in SI units; drawings end in overflow far above."""
_LONGEST = 20_000
"""Letters of one text: a page has 3,000 a screen."""
_MOST = 20_000
"""Entries of one list: a year of logs has fewer."""


def check_bounds(content: Any) -> None:
    """Refuse a number, a text or a list of a size that no file of undertow has, wherever in a file it stands.

    Raises
    ------
    ValueError
        naming the place, what was expected there, and what came.
    """
    rest: list[tuple[str, Any]] = [("", content)]
    while rest:
        where, value = rest.pop()
        if isinstance(value, str) and len(value) > _LONGEST:
            raise ValueError(_told(where, f"a text of at most {_LONGEST} letters", value))
        if isinstance(value, int | float) and not (math.isfinite(value) and abs(value) <= LARGEST):
            raise ValueError(_told(where, f"a number of at most {LARGEST:g}", value))
        if isinstance(value, list | dict) and len(value) > _MOST:
            raise ValueError(f"expected at most {_MOST} entries in {where or 'the file'}, got {len(value)}")
        if isinstance(value, list):
            rest += [(f"{where}[{index}]", part) for index, part in enumerate(value)]
        elif isinstance(value, dict):
            rest += [(f"{where}.{shown(key, 60)[1:-1]}".lstrip("."), part) for key, part in value.items()]


def _told(where: str, expected: str, value: object) -> str:
    return f"expected {expected} in {where or 'the file'}, got {shown(value)}"


MEASURED = ("u_dot", "v_dot", "r_dot", "u", "v", "r", "north", "east")
SERIES_COLUMNS = (
    *("time", "log", "part", "psi"),
    *MEASURED,
    *(f"{name}_{model}" for model in ("before", "after") for name in MEASURED),
)
Read = TypeVar("Read", bound=Record)
REMEDY = "run 'undertow discover LOG --vehicle V --out RUN' to write the folder anew"
_MOST_SERIES = 512 * 2**20
"""Bytes of series.csv: two days of one log."""
_MOST_CELLS = 64_000_000
"""Numbers of it: as many as fit into 0.5 GB."""
_LONGEST_HEADER = 65536
"""Bytes within which the first line ends [B]: the columns of a boat with 64 thrusters have 2 kB."""


@dataclass(frozen=True, slots=True)
class RunRecord:
    """Origin of a run, and the findings that a verb that goes on from it must know.

    Attributes
    ----------
    logs, reading : the logs where they are now, and how they were read
    vehicle : the nominal one
    settings : its seed, and whether its search fitted the model's own numbers
    findings : what it found; None where its findings are not there
    """

    logs: Sequence[PathLike]
    reading: Reading
    vehicle: Vehicle
    settings: DiscoverySettings
    findings: Findings | None = None

    @property
    def folds(self) -> tuple[FoldRecord, ...]:
        """The folds that judged it; none where a test part did."""
        return self.findings.folds.models if self.findings and self.findings.folds else ()

    @property
    def judge(self) -> str:
        """The rows on which it was judged, as `read_inputs` takes them."""
        return FOLDS if self.folds else "test"

    def inputs(self, progress: Say | None = SHOWN) -> Inputs:
        """The logs read again, with the rows on which the run was judged.

        Raises
        ------
        LogError, VehicleError, RequestError
            when one cannot be used any more; see `read_inputs`.
        """
        from ..inputs import read_inputs

        return self.searched(read_inputs(self.logs, self.vehicle, self.reading, judge=self.judge, progress=progress))

    def searched(self, inputs: Inputs) -> Inputs:
        """The part of its logs that it searched, where a boat changes; else all of them."""
        if self.findings is None or self.findings.change is None or not self.folds:
            return inputs
        from ...discovery.changed_boat import part_searched

        return part_searched(inputs, self.findings.change)


def read_run(folder: PathLike, moved: Moved = UNMOVED) -> RunFolder:
    """Read a run folder.

    Parameters
    ----------
    moved : where its logs and its map are now; they are read when somebody asks for `inputs`

    Raises
    ------
    RequestError
        When a file is missing, cannot be read, or is not of the expected schema.
    """
    folder = Path(folder)
    finish_move(folder)
    if not folder.is_dir():
        raise RequestError(f"expected a run folder at {folder}, but there is none; {REMEDY}")
    if is_network_folder(folder):
        raise RequestError(
            f"{folder} is the folder of a trained network, not of a run, and a page tells of a run; give a folder that "
            f"'undertow discover' wrote, with --model {folder} to put the network beside the run's own models"
        )
    files = _Files(folder, REMEDY)
    findings = read_findings(files.content("findings.json"), folder / "findings.json")
    if not findings.steps:
        path = folder / "findings.json"
        raise RequestError(f"{path}: expected at least one entry in 'steps' (the nominal model), got none; {REMEDY}")
    return RunFolder(
        folder=folder,
        findings=findings,
        comparison=files.record("comparison.json", Comparison),
        inspections=(files.if_there("inspection.json", Inspections) or Inspections(logs=())).logs,
        audit=files.if_there("audit.json", AuditRecord),
        record=files.if_there("run.json", MadeFrom) or MadeFrom(),
        nominal=files.vehicle("nominal.yaml"),
        corrected=files.vehicle("model.yaml"),
        series=files.series(),
        digests=files.digests,
        read_inputs=cache(lambda: read_run_inputs(folder, moved).inputs()),
    )


def read_comparison(folder: PathLike) -> ComparisonFolder:
    """Read the folder of a comparison.

    Parameters
    ----------
    folder : that `compare --page` wrote, see `is_comparison`

    Raises
    ------
    RequestError
        When a file is missing, cannot be read, or is not of the expected schema.
    """
    remedy = "run 'undertow compare LOG --vehicle V --page FOLDER' to write the folder anew"
    files = _Files(Path(folder), remedy)
    comparison = files.record("comparison.json", Comparison)
    if not comparison.models:
        path = files.folder / "comparison.json"
        raise RequestError(f"{path}: expected at least one entry in 'models', got none; {remedy}")
    return ComparisonFolder(comparison, files.series())


class _Files:
    """The files of a folder, of which each is read and checked.

    Attributes
    ----------
    folder, remedy : the folder, and the end of the message of an error
    digests : first digits of the SHA-256 of each file that was read
    """

    def __init__(self, folder: Path, remedy: str) -> None:
        self.folder, self.remedy = folder, remedy
        self.digests: dict[str, str] = {}

    def content(self, name: str, most: int = MOST_TEXT) -> bytes:
        """A file with at most so many bytes."""
        try:
            content = read_bytes(self.folder / name, most)
        except FileNotFoundError:
            raise RequestError(f"run folder {self.folder} has no {name}; {self.remedy}") from None
        except (OSError, ValueError) as error:
            raise RequestError(f"{self.folder / name} cannot be read ({reason(error)}); {self.remedy}") from None
        self.digests[name] = hashlib.sha256(content).hexdigest()[:12]
        return content

    def record(self, name: str, kind: type[Read]) -> Read:
        """The record in a JSON file."""
        return read_record(self.content(name), kind, self.folder / name, self.remedy)

    def if_there(self, name: str, kind: type[Read]) -> Read | None:
        """The same; None where there is no such file."""
        return self.record(name, kind) if (self.folder / name).exists() else None

    def vehicle(self, name: str) -> Vehicle:
        """The vehicle in a YAML file."""
        path = self.folder / name
        content = self.content(name)
        try:
            return vehicle_from_dict(parse_yaml(text_of(content)), str(path))
        except VehicleError as error:
            raise RequestError(f"{error.typed}; {self.remedy}") from None
        except ValueError as error:
            raise RequestError(f"{path} is not valid YAML ({error}); {self.remedy}") from None

    def series(self) -> "pd.DataFrame":
        """The table of `series.csv`."""
        path = self.folder / "series.csv"
        return _series(self.content(path.name, _MOST_SERIES), path, self.remedy)


def read_record(content: bytes, kind: type[Read], path: Path, remedy: str = REMEDY) -> Read:
    """The record that a JSON file of a run folder holds; `remedy` ends the message of the error.

    Parameters
    ----------
    content : of the file
    kind : type of the record
    path, remedy : for the message of an error

    Raises
    ------
    RequestError
        When it holds none.
    """
    return kind.read(_bounded(content, path, remedy), path, remedy)


def read_findings(content: bytes, path: Path) -> Findings:
    """The findings that a file holds; of an earlier version nobody knows how sure they are.

    What stands there as confidence is a share of resamples, which says nothing of the odds of a name.

    Raises
    ------
    RequestError
        as `read_record` does.
    """
    plain = _bounded(content, path)
    findings = Findings.read(plain, path, REMEDY)
    if plain.get("schema") not in Findings.FORMER:
        return findings
    return findings.but(candidates=tuple(item.but(confidence=math.nan) for item in findings.candidates))


def _bounded(content: bytes, path: Path, remedy: str = REMEDY) -> Any:
    try:
        result = parse_json(text_of(content))
    except ValueError as error:
        raise RequestError(f"{path} is not valid JSON ({error}); {remedy}") from None
    try:
        check_bounds(result)
    except ValueError as error:
        raise RequestError(f"{path}: {error}; {remedy}") from None
    return result


def _series(content: bytes, path: Path, remedy: str) -> "pd.DataFrame":
    import pandas as pd

    if content.count(b",") > _MOST_CELLS or content.find(b"\n", 0, _LONGEST_HEADER) < 0 < len(content):
        raise RequestError(f"{path}: expected at most {_MOST_CELLS} numbers in lines, got another table; {remedy}")
    del content  # of a long log, more than the numbers in it
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", pd.errors.DtypeWarning)  # what is no number is refused below
            series = pd.read_csv(path)
    except (pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeDecodeError) as error:
        raise RequestError(f"{path} is not a readable CSV ({shortened(str(error), 300)}); {remedy}") from None
    lacking = [name for name in SERIES_COLUMNS if name not in series.columns]
    if lacking:
        raise RequestError(f"{path} lacks the column {', '.join(lacking)}; {remedy}")
    if series.empty:
        raise RequestError(f"{path} has no rows; {remedy}")

    def sound(values: pd.Series) -> bool:
        return pd.api.types.is_numeric_dtype(values) and bool((values.abs().fillna(0) < LARGEST).all())

    broken = [name for name, values in series.drop(columns="part").items() if not sound(values)]
    if broken:
        raise RequestError(f"{path}: expected numbers in the column {listed(broken)}; {remedy}")
    return series


def read_run_inputs(run: PathLike, moved: Moved = UNMOVED) -> RunRecord:
    """Read what a run folder was made from.

    Parameters
    ----------
    run : the run folder, wherever it was moved
    moved : where its logs and its map are now, where they are found nowhere by themselves

    Raises
    ------
    RequestError
        when the folder is not a run folder, or its logs are nowhere, or not the same files.
    VehicleError
        when its nominal vehicle cannot be read.
    """
    folder = Path(run)
    finish_move(folder)
    if is_network_folder(folder):
        raise RequestError(
            f"{folder} is the folder of a trained network, not of a run: effects are added to a vehicle; give a folder "
            "that 'undertow discover' wrote, or --vehicle V and the LOG after the effects. 'undertow explain' says "
            "what of the network is a named effect"
        )
    path = folder / RECORD
    content = content_of(path)
    if not {"logs", "frame", "channel_map"} <= content.keys():
        raise RequestError(
            f"{folder} is not a run folder (no readable run.json in it); write one with "
            "'undertow discover LOG --vehicle V --out RUN'"
        )
    try:
        made = RunOrigin.read({"schema": RunOrigin.SCHEMA, **content}, path, REMEDY)  # the first runs name none
    except RequestError:
        paths, *how = (shown(content.get(name)) for name in ("logs", "frame", "channel_map", "namespace"))
        raise RequestError(
            f"{path}: expected paths under 'logs', a text or null under 'frame', 'channel_map' and "
            f"'namespace', got {paths}, {', '.join(how)}; run 'undertow discover' to write the folder anew"
        ) from None
    there = logs_now(folder, made.made_logs, moved)
    mapped = map_now(folder, made.made_map, moved.channel_map)
    reading = Reading(made.frame, mapped, made.namespace, made.as_is, made.fix)
    settings = DiscoverySettings(seed=made.seed or 0, refit=made.refit)
    nominal = load_vehicle(folder / "nominal.yaml")
    return RunRecord(there, reading, nominal, settings, _found(folder, nominal))


def _found(folder: Path, nominal: Vehicle) -> Findings | None:
    """What a run found, its last step with every digit of the model that it wrote; None where that is not there."""
    path = folder / "findings.json"
    try:
        result = read_findings(read_bytes(path, MOST_TEXT), path)
    except (OSError, ValueError):
        return None
    if not result.steps or not result.steps[-1].values:
        return result
    try:
        values = values_of_step(load_vehicle(folder / "model.yaml"), nominal)
    except (OSError, ValueError):
        return result  # with the digits of findings.json
    return result.but(steps=(*result.steps[:-1], result.steps[-1].but(values=values)))
