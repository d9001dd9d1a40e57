"""The house keeps its order: packages, floors, rooms, docstrings, pins."""

import ast
import doctest
import importlib
import json
import re
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path

import pytest
from places import ROOT
from sources import absolute_imports, parsed, source_files

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))

FLOORS = (
    *("physics", "measurements", "residuals", "discovery", "comparison", "exports", "steering", "reports", "workflows"),
    *("fleet", "app", "cli", "__main__"),
)
"""The house from the ground floor up: a file imports its own floor and those below."""
DISCOVERY = (
    *("balance", "factors", "candidates", "search", "identifiability", "lawful", "effect_findings", "findings"),
    *("evidence", "judgement", "claims", "verdicts", "experiment", "basis", "calibration", "selection"),
    *(
        "water_of_logs",
        "changed_boat",
        "sensor_error_search",
        "run_models",
        "discover",
        "sequential_fit",
        "add_effects",
        "distillation",
    ),
)
"""The rooms of discovery, and the files beside them, in the order in which one may use the other."""
OF_ONE_NAME = {"__init__.py", "registry.py", "base.py"}
"""Names that every room may use; any other tells one file of the whole house."""

ROOMS = {
    "cvxpy": ("discovery/lawful/",),
    "clarabel": ("discovery/lawful/",),
    "pysindy": ("discovery/factors.py",),
    "matplotlib": ("reports/page/figures/",),
    "torch": ("residuals/",),
    "safetensors": ("residuals/",),
    "pyarrow": ("measurements/formats/tables/", "physics/worlds/"),
    "rosbags": ("measurements/formats/ros/",),
    "pymavlink": ("measurements/formats/autopilots/",),
    "pyulog": ("measurements/formats/autopilots/",),
    "mcap": ("exports/",),
    "casadi": ("exports/",),
    "onnx": ("exports/",),
    "onnxruntime": ("exports/", "residuals/"),
    "plotly": ("app/",),
    "nicegui": ("app/",),
    "joblib": ("fleet/",),
    "distributed": ("fleet/",),
    "obstore": ("fleet/",),
}


EDGES = ("workflows/run_folder/", "cli/", "physics/reading.py")
"""Where plain data come from or go to: there alone they may be of any kind."""
MOST_UNTYPED = 10
MOST_PARAMETERS = 8


def module_name(path: Path) -> str:
    parts = [part for part in path.with_suffix("").parts if part != "__init__"]
    return ".".join(["undertow", *parts])


def drawn_by(module: ast.Module) -> set[str]:
    """Modules of whose plots a file knows the type alone: `cards.from_above` loads them when somebody asks."""
    named = [n for n in ast.walk(module) if isinstance(n, ast.AnnAssign) and ast.unparse(n.target) == "DRAWN_BY"]
    return {str(ast.literal_eval(node.value)).partition(":")[0] for node in named if node.value is not None}


def relative_imports(path: Path) -> Iterator[tuple[str, ...]]:
    """Paths inside the package that a file imports relatively, as parts below the root."""
    drawers = drawn_by(parsed(path))
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.ImportFrom) and node.level > 0:
            above = path.parts[: len(path.parts) - node.level]
            module = tuple(node.module.split(".")) if node.module else ()
            if ".".join((*above, *module)) in drawers:
                continue
            yield from ((*above, *module, alias.name) for alias in node.names)


def normalised(requirement: str) -> str:
    """Bare distribution name of a requirement, as PEP 503 writes it: "dask" for "Dask[distributed]>=2024"."""
    return re.sub(r"[-_.]+", "-", re.split(r"[^\w.-]", requirement, maxsplit=1)[0]).lower()


SOURCES = source_files()


def of_each(paths: Sequence[Path]) -> Callable[[Callable[[Path], None]], Callable[[], None]]:
    """Ask every file in one test: as a test for each, they would take longer to count than to run."""

    def test_of(check: Callable[[Path], None]) -> Callable[[], None]:
        def test() -> None:
            broken = []
            for path in paths:
                try:
                    check(path)
                except AssertionError as error:
                    broken.append(f"{path}: {error}")
            assert not broken, "\n".join(broken)

        return test

    return test_of


EVERY_SOURCE = of_each(SOURCES)


# The packages


def test_pyproject_lists_every_package_once():
    listed = PROJECT["tool"]["setuptools"]["packages"]
    in_folders = [module_name(path) for path in SOURCES if path.name == "__init__.py"]
    assert sorted(listed) == sorted(in_folders)


def test_every_source_lies_in_a_package():
    packages = {path.parent for path in SOURCES if path.name == "__init__.py"}
    assert [str(path) for path in SOURCES if path.parent not in packages] == []


def test_the_root_holds_no_other_module():
    assert {path.name for path in ROOT.glob("*.py")} <= {"__init__.py", "__main__.py"}
    assert not (ROOT / "tests" / "__init__.py").exists(), "pytest would import the tests as part of a package"


def test_package_data_exists_and_is_small():
    data = PROJECT["tool"]["setuptools"]["package-data"]
    total = 0
    for package, patterns in data.items():
        folder = ROOT.joinpath(*package.split(".")[1:])
        for pattern in patterns:
            files = [path for path in folder.glob(pattern) if path.is_file()]
            assert files, f"{package}: nothing matches {pattern!r}"
            total += sum(path.stat().st_size for path in files)
    total += sum((ROOT / path).stat().st_size for path in SOURCES)
    assert total < 5_000_000, f"the package should stay under 5 MB, has {total / 1e6:.1f} MB"


def test_console_scripts_point_at_functions():
    for target in PROJECT["project"]["scripts"].values():
        module, function = target.split(":")
        path = Path(*module.split(".")[1:]).with_suffix(".py")
        assert (ROOT / path).exists(), f"{target}: {path} is missing"
        assert function in {node.name for node in parsed(path).body if isinstance(node, ast.FunctionDef)}


# The floors


def imported_files(path: Path) -> set[Path]:
    """The files of the package that a file imports, at any depth."""
    found = set()
    for target in relative_imports(path):
        whole, above = Path(*target), Path(*target[:-1])
        for module in (whole, above):
            if module.with_suffix(".py") in KNOWN or module / "__init__.py" in KNOWN:
                found.add(module.with_suffix(".py") if module.with_suffix(".py") in KNOWN else module / "__init__.py")
                break
    return found - {path}


KNOWN = set(SOURCES)


@cache
def graph_of_imports() -> dict[Path, set[Path]]:
    """Which files each imports; read when a test asks, for every worker of pytest imports this module."""
    return {path: imported_files(path) for path in SOURCES}


def circles(graph: Mapping[str, set[str]]) -> list[list[str]]:
    """Groups of nodes of which each leads to every other."""
    reached: dict[str, set[str]] = {}
    for node in graph:
        seen, waiting = set(), [node]
        while waiting:
            for other in graph.get(waiting.pop(), set()) - seen:
                seen.add(other)
                waiting.append(other)
        reached[node] = seen
    groups = {frozenset(o for o in seen if node in reached[o]) for node, seen in reached.items() if node in seen}
    return sorted(sorted(group) for group in groups)


def room(path: Path) -> str:
    """The room of a floor that a file lies in, or the file itself where it stands beside the rooms."""
    return "/".join(path.with_suffix("").parts[:2])


@EVERY_SOURCE
def test_imports_run_downstairs(path: Path):
    floor = path.with_suffix("").parts[0]
    if floor == "__init__":
        return  # the root's table of public names may name any floor
    assert floor in FLOORS, f"{floor} is no floor of the house"
    for target in relative_imports(path):
        assert target[0] in FLOORS, f"{path} imports {target[0]!r} from the root, which lies above every floor"
        assert FLOORS.index(target[0]) <= FLOORS.index(floor), f"{path} imports {'.'.join(target)} from upstairs"


@of_each([p for p in SOURCES if p.parts[0] == "discovery" and p.name != "__init__.py"])
def test_the_rooms_of_discovery_keep_the_order_of_the_method(path: Path):
    here = path.with_suffix("").parts[1]
    assert here in DISCOVERY, f"{here} has no place in the order of discovery"
    for target in relative_imports(path):
        if target[0] == "discovery":
            assert DISCOVERY.index(target[1]) <= DISCOVERY.index(here), f"{path} imports {'.'.join(target)}"


def test_no_files_import_each_other_in_a_circle():
    assert circles({str(a): {str(b) for b in bs} for a, bs in graph_of_imports().items()}) == []


def test_no_rooms_import_each_other_in_a_circle():
    rooms: dict[str, set[str]] = {}
    for path, targets in graph_of_imports().items():
        rooms.setdefault(room(path), set()).update({room(target) for target in targets} - {room(path)})
    assert circles(rooms) == []


def test_a_file_name_tells_which_file_is_meant():
    named: dict[str, list[str]] = {}
    for path in SOURCES:
        named.setdefault(path.name, []).append(str(path))
    assert {n: paths for n, paths in named.items() if len(paths) > 1 and n not in OF_ONE_NAME} == {}


def test_the_tests_lie_where_the_rooms_lie():
    folders = {path.relative_to(ROOT / "tests").parent for path in (ROOT / "tests").rglob("test_*.py")}
    rooms = {path.parent for path in SOURCES} | {Path("benchmarks")}
    assert folders - rooms == set(), "a folder of tests that no room of the package has"


def test_the_registry_of_verbs_is_nothing_else():
    assert len((ROOT / "__main__.py").read_text(encoding="utf-8").splitlines()) < 100


@EVERY_SOURCE
def test_the_package_imports_itself_relatively(path: Path):
    assert [name for name in absolute_imports(path) if name.split(".")[0] in {"undertow", *FLOORS}] == []


@EVERY_SOURCE
def test_heavy_packages_stay_in_their_room(path: Path):
    for name in absolute_imports(path):
        rooms = ROOMS.get(name.split(".")[0], ("",))
        assert path.as_posix().startswith(rooms), f"{path} imports {name}, which belongs in {' or '.join(rooms)}"


@pytest.mark.parametrize(
    ("module", "heavy"),
    [
        ("undertow", {"numpy", "scipy", "pandas", "pydantic", "yaml", "typer", "rich"}),
        ("undertow.__main__", {"scipy", "pandas", "sklearn"}),
    ],
)
def test_loads_nothing_heavy(module: str, heavy: set[str], tmp_path: Path):
    code = f"import json, sys, {module}; print(json.dumps(sorted(sys.modules)))"
    run = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert (heavy | set(ROOMS)) & set(json.loads(run.stdout)) == set()


@pytest.mark.parametrize("module", ["workflows.discover_and_add", "measurements.inspection"])
def test_what_few_logs_need_is_loaded_where_it_is_needed(module: str, tmp_path: Path):
    """A solver, trees, SciPy and pictures take longer to load than many an answer takes."""
    code = f"import json, sys, undertow.{module}; print(json.dumps(sorted(sys.modules)))"
    run = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    seldom = {"cvxpy", "sklearn", "scipy", "matplotlib", "torch", "pysindy"}
    assert seldom & set(json.loads(run.stdout)) == set()


# The signatures


def test_facts_have_types():
    untyped = {
        str(path): count
        for path in SOURCES
        if not path.as_posix().startswith(EDGES)
        and (count := len(re.findall(r"(?:dict|Mapping)\[str, Any\]", (ROOT / path).read_text(encoding="utf-8"))))
    }
    assert sum(untyped.values()) <= MOST_UNTYPED, untyped


@EVERY_SOURCE
def test_no_function_but_a_verb_has_many_parameters(path: Path):
    crowded = set()
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            given = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
            if len([one for one in given if one.arg not in ("self", "cls")]) > MOST_PARAMETERS:
                crowded.add((path.as_posix(), node.name))
    verb = (path.as_posix(), path.stem.removesuffix("_verb"))
    assert crowded <= ({verb} if path.parts[0] == "cli" else set())


# The words


@EVERY_SOURCE
def test_every_public_module_says_what_it_is_for(path: Path):
    if path.stem.startswith("_") and not path.stem.startswith("__"):
        return
    assert (ast.get_docstring(parsed(path)) or "").strip(), f"{path} has no docstring"


@of_each([p for p in SOURCES if ">>> " in (ROOT / p).read_text(encoding="utf-8")])
def test_the_doctests_of(path: Path):
    # pytest --doctest-modules would load the package a second time, under the name of the checkout's folder.
    failed, attempted = doctest.testmod(importlib.import_module(module_name(path)))
    assert attempted > 0
    assert failed == 0, "see the captured output"


# The numbers


def is_number(value: ast.expr | None) -> bool:
    """Whether an expression is a number, or numbers in a tuple, a table or an array, that nothing else explains."""
    match value:
        case ast.Constant():
            return isinstance(value.value, int | float) and not isinstance(value.value, bool)
        case ast.UnaryOp():
            return is_number(value.operand)
        case ast.BinOp():  # 1 / RATE and pi / 180 tell their reason
            known = [side for side in (value.left, value.right) if isinstance(side, ast.Name | ast.Attribute)]
            plain = [side for side in (value.left, value.right) if is_number(side)]
            return bool(plain) and not (known and ast.unparse(value) in DERIVED)
        case ast.Tuple() | ast.List():
            return any(is_number(part) for part in value.elts)
        case ast.Dict():
            return any(is_number(part) for part in value.values)
        case ast.Call(func=ast.Attribute(value=ast.Name(id="np" | "math"))) | ast.Call(func=ast.Name(id="float")):
            return any(is_number(part) for part in value.args)
    return False


DERIVED = {"1.0 / RATE", "np.pi / 180.0", "math.pi / 180.0"}


def unreasoned(module: ast.Module, lines: Sequence[str]) -> list[str]:
    """Constants of a module that are numbers and have neither a remark nor a text below them, or below the next one."""
    blocks: list[list[list[str]]] = [[]]  # assignments that follow each other, line by line, with the numbers of each
    last = 0
    for node in module.body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            if node.lineno != last + 1:
                blocks.append([])
            last = node.end_lineno or node.lineno
            named = node.targets if isinstance(node, ast.Assign) else [node.target]
            names = [name.id for target in named for name in ast.walk(target) if isinstance(name, ast.Name)]
            constant = all(re.fullmatch(r"_?[A-Z][A-Z0-9_]*", name) for name in names) and is_number(node.value)
            blocks[-1].append(names if constant and "  # " not in lines[last - 1] else [])
            continue
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and node.lineno == last + 1:
            del blocks[-1][-2:]  # what a text stands below: one assignment, or a pair
        blocks.append([])
    return [name for block in blocks for names in block for name in names]


@EVERY_SOURCE
def test_every_number_has_a_reason(path: Path):
    assert unreasoned(parsed(path), (ROOT / path).read_text(encoding="utf-8").splitlines()) == []


def test_a_number_without_a_reason_is_found():
    text = """
A = 1
'Why.'
B = 2
C = 3  # why

D = 3
E, F = 4, 5
G = -6.0
'Why E, F and G.'
_H = {"a": 1}
I = 1.0 / RATE
J = 2 * B
"""
    assert unreasoned(ast.parse(text), text.splitlines()) == ["B", "D", "_H", "J"]


# The pins


def pins() -> dict[str, str]:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    return dict(line.split("==") for line in lines if line and not line.startswith("#"))


def test_constraints_are_plain_pins():
    for name, version in pins().items():
        assert name == normalised(name), f"{name} should be written {normalised(name)}"
        assert re.fullmatch(r"[0-9][0-9a-z.]*", version), f"{name}=={version} is not a plain version"


def test_constraints_cover_every_dependency():
    project = PROJECT["project"]
    wanted = {normalised(r) for r in project["dependencies"]}
    for extra in project["optional-dependencies"].values():
        wanted |= {normalised(r) for r in extra} - {"undertow"}  # an extra that is made of others
    assert wanted - set(pins()) == set()
    assert pins()["torch"] == "2.13.0"


@pytest.mark.parametrize("name", ["constraints.txt", "pyproject.toml", "Makefile", ".ci/run"])
def test_no_registry_address(name: str):
    text = (ROOT / name).read_text(encoding="utf-8")
    assert re.findall(r"index-url|find-links|trusted-host|file://|https?://\S*(?:simple|pypi|npmjs)\S*", text) == []


@pytest.mark.parametrize(
    "question", tomllib.loads((ROOT / "tests/questions.toml").read_text("utf-8"))["question"], ids=str
)
def test_what_a_newcomer_is_asked_stands_where_the_answers_say(question: dict[str, str]):
    assert question["holds"] in (ROOT / question["file"]).read_text("utf-8"), question["ask"]
