"""What each number of discovery decides: the names and their odds with it at half and at twice, and as it is.

A number decides where another name is missing or likely, or one no longer is, or where the odds of one change by 0.05
or more, in any of some logs. What changes less is steady: it says how something is computed, or nothing lies near it.
Numbers are changed in the source before it is imported, some at a time; of those that change something together each
is tried alone on these logs. Of a share between a half and one the distance from one is halved and doubled; a whole
number stays whole. Verdicts are those of `find_missing` on logs that the verb has read, of the tuning seeds.

    python benchmarks/steady_numbers.py [--group 6] [--only NAME]... [--kept FILE]

What was tried is kept, and gone on with. A number that is set anew is tried anew.
"""

import argparse
import ast
import json
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any, ClassVar

ROOT = Path(__file__).resolve().parents[1]
KEPT = ROOT / "benchmarks" / "records" / "steady_numbers.json"
LOGS = (
    *(("plain", "gentle", 770), ("plain", "clean", 220), ("nothing", "waves", 200_008)),
    *(("foreign", "short log", 300_000), ("foreign", "heavier on straight runs", 300_000)),
    *(("foreign", "drag with a kink", 300_000), ("others", "CSAD: two effects", 400_001)),
    *(("others", "WAM-V: one effect", 400_000), ("others", "velocity that is late", 400_000)),
    *(("nameless", "drag without a sign", 9001), ("nameless", "shallow water", 9000)),
)
"""Logs of each simulator: named and nameless causes, forces and rollouts, right sensors and wrong ones."""
FACTORS = (0.5, 2.0)
Change = tuple[str, str, float]
"""Path in the repository, name and factor of a number that is changed."""
Said = dict[str, dict[str, float]]
"""What is said of each log: the odds of names that stand in a model, over one for what is missing or likely."""
MOVED = 0.05
"""Change of odds that counts: what is told within 5 points holds within it."""


def changed(value: Any, factor: float) -> Any:
    """A number, or some, times a factor; a whole one stays whole and at least one, a share near one stays below it."""
    if isinstance(value, tuple):
        return tuple(changed(one, factor) for one in value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value
    if isinstance(value, int):
        return max(1, round(value * factor)) if value else value
    return 1.0 - (1.0 - value) * factor if 0.5 < value < 1.0 else value * factor


class Changing(PathFinder):
    """Finds modules as ever, and those with numbers that are changed with these."""

    changes: ClassVar[dict[str, dict[str, float]]] = {}

    @classmethod
    def find_spec(
        cls, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """See `importlib.abc.MetaPathFinder`."""
        spec = super().find_spec(fullname, path, target)
        origin = str(Path(spec.origin).resolve()) if spec is not None and spec.origin else ""
        if spec is not None and origin in cls.changes:
            spec.loader = ChangedLoader(fullname, origin)
        return spec


class ChangedLoader(SourceFileLoader):
    """Loads a module with numbers changed, from its source and not from what was compiled of it."""

    def get_code(self, fullname: str) -> CodeType:
        """See `importlib.abc.InspectLoader`."""
        tree = ast.parse(Path(self.path).read_text("utf-8"))
        factors = Changing.changes[self.path]
        for node in tree.body:
            if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) in factors:
                factor = ast.Constant(factors[ast.unparse(node.targets[0])])
                own = ast.parse("__import__('sys').modules['__main__'].changed", mode="eval").body
                node.value = ast.Call(own, [node.value, factor], [])
        return compile(ast.fix_missing_locations(tree), self.path, "exec")


def said_of(folder: Path, names: Sequence[str]) -> Said:
    """What `find_missing` says of prepared logs."""
    from undertow.discovery.discover import find_missing

    found = {}
    for name in names:
        motions, vehicle = pickle.loads((folder / name).read_bytes())
        try:
            candidates = find_missing(motions, vehicle).findings.candidates
            found[name] = {c.key: c.confidence + _SAID.get(c.verdict, 0.0) for c in candidates if c.claim}
        except Exception as error:  # a search that falls over is a change, too
            found[name] = {type(error).__name__: 1.0}
    return found


_SAID = {"missing": 2.0, "likely": 1.0}


def asked(folder: Path, names: Sequence[str], changes: Sequence[Change]) -> Said:
    """The same in a process of its own, with numbers changed."""
    given = json.dumps([str(folder), list(names), [list(one) for one in changes]])
    done = subprocess.run([sys.executable, __file__, "--child"], input=given, capture_output=True, text=True)
    if done.returncode:
        return {name: {"crashed": 1.0} for name in names}
    return dict(json.loads(done.stdout.splitlines()[-1]))


def child() -> int:
    """Answer `asked`."""
    folder, names, changes = json.loads(sys.stdin.read())
    for path, name, factor in changes:
        Changing.changes.setdefault(str(ROOT / path), {})[name] = factor
    sys.meta_path[sys.meta_path.index(PathFinder)] = Changing
    print(json.dumps(said_of(Path(folder), names)))
    return 0


def prepared(folder: Path) -> list[str]:
    """Read and prepare each log as the verb does, once; their names."""
    from study.studies import STUDIES

    from undertow.workflows.inputs import read_inputs

    names = []
    for study, kind, seed in LOGS:
        logged = STUDIES[study].logged(kind, seed)
        inputs = read_inputs(logged.write(folder / "log.csv"), logged.vehicle).whole()
        names.append(f"{study}, {kind}, {seed}")
        (folder / names[-1]).write_bytes(pickle.dumps((inputs.fitting, inputs.vehicle)))
    return names


def differing(first: Said, other: Said) -> list[str]:
    """Logs of which something else is said."""
    return [
        name
        for name, told in other.items()
        if any(abs(told.get(key, 0.0) - first[name].get(key, 0.0)) >= MOVED for key in {*told, *first[name]})
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    """Try all numbers that were not tried yet, print what each decides, and keep it."""
    from decisive_numbers import candidates

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--group", type=int, default=6)
    parser.add_argument("--only", action="append", default=[])
    parser.add_argument("--kept", type=Path, default=KEPT)
    given = parser.parse_args(arguments)
    numbers = [n for n in candidates() if not given.only or n.name in given.only]
    kept = json.loads(given.kept.read_text("utf-8")) if given.kept.exists() else {}
    left = [n for n in numbers if kept.get(f"{n.path}: {n.name}", {}).get("value") != n.value or given.only]
    if not left:
        return 0
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        names = prepared(folder)
        first = asked(folder, names, [])
        for at in range(0, len(left), given.group):
            group = left[at : at + given.group]
            decides: dict[str, list[str]] = {f"{n.path}: {n.name}": [] for n in group}
            for factor in FACTORS:
                every = [(n.path, n.name, factor) for n in group]
                logs = differing(first, asked(folder, names, every))
                for one in every if logs else ():
                    own = differing(first, asked(folder, logs, [one]))
                    decides[f"{one[0]}: {one[1]}"] += [f"times {factor:g}: {log}" for log in own]
            for n in group:
                key = f"{n.path}: {n.name}"
                kept[key] = {"value": n.value, "decides": decides[key]}
                print(f"{key} = {n.value}: {'; '.join(decides[key]) or 'steady'}", flush=True)
            given.kept.write_text(json.dumps(dict(sorted(kept.items())), indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(child() if "--child" in sys.argv else main())
