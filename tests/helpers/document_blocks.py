"""Running the blocks of a document in the order of the page, in a folder that looks like a clone."""

import ast
import hashlib
import io
import re
import shlex
import shutil
import tomllib
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
import yaml
from bags import recorded, write_ros2
from documents import Block
from places import ROOT
from typer.main import get_command
from verbs import call, done

from undertow.__main__ import app
from undertow.comparison.error_limits import Limits, load_limits
from undertow.measurements.channels.channel_map import read_channel_map
from undertow.physics.vehicle import Vehicle, load_vehicle, shipped_vehicles, vehicle_from_dict
from undertow.physics.worlds.world import simulate_world

PLACEHOLDERS = {
    "LOG": ("log.csv", "stands for a log of the reader's"),
    "OTHER_LOG": ("other.csv", "stands for another log of the reader's"),
    "run1.csv": ("log.csv", "a log of the reader's boat"),
    "run2.csv": ("other.csv", "another of them"),
    "run3.csv": ("third.csv", "and one to judge on"),
}
"""Words of commands that stand for logs which nobody has but the reader, the simulated logs in their place, and why."""

RECORDED = {"BAG": "bag"}
"""Words of commands that stand for a bag of the reader's, and the bag of a simulated boat in their place."""

CHEAPER = {
    "train": (("--epochs", "1"), "the same command, one epoch in the place of some hundred"),
}
"""Options that verbs get beside those on the page, and why."""

HIDDEN = {"surge_quadratic_damping": -12.0}
"""What that boat has beside its vehicle file: the page says that it is found."""

MAY_FIND = {"inspect", "check"}
"""Verbs whose exit code 1 says that they found something."""

SERVES = {"app"}
"""Verbs that serve until they are ended: their words are parsed, and tests/app drives them in a browser."""

SEEN_TO = {"python", "make", "pip", ".venv/bin/pip", ".", "cd"}
"""Commands that are not run: what they name is looked for."""

NUMBER = re.compile(r"-?\d+\.\d+")


@dataclass
class Shared:
    """Runs of `discover` that pages have in common: made once, and copied where another page asks for the same."""

    folder: Path
    made: dict[str, tuple[Path, str]] = field(default_factory=dict)

    def discover(self, words: list[str]) -> str:
        out = Path(words[words.index("--out") + 1])
        key = "\n".join([*words, *(_digest(Path(word)) for word in words[1:] if Path(word) != out)])
        if key not in self.made:
            said = done(*words)
            kept = self.folder / str(len(self.made))
            shutil.copytree(out, kept)
            self.made[key] = kept, said
        elif not out.exists():
            shutil.copytree(self.made[key][0], out)
        return self.made[key][1]


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""


@dataclass
class Reader:
    """Somebody who does what a page says, block by block, in the working folder."""

    shared: Shared
    known: dict[str, Any] = field(default_factory=lambda: {"__name__": "__main__"})
    said: str = ""
    ran: int = 0

    def follow(self, block: Block) -> None:
        read = {"sh": self._shell, "python": self._python, "yaml": self._yaml, "toml": self._toml, "text": self._output}
        read[block.language](block)
        self.ran += 1

    def _shell(self, block: Block) -> None:
        self.said = ""
        for line in block.text.replace("\\\n", " ").splitlines():
            words = shlex.split(line, comments=True)
            if words:
                self._command([RECORDED.get(word, PLACEHOLDERS.get(word, (word, ""))[0]) for word in words])

    def _command(self, words: list[str]) -> None:
        first = words[0].removeprefix(".venv/bin/")
        if first != "undertow":
            assert words[0] in SEEN_TO or first in SEEN_TO, f"{words[0]} is no command that pages may show"
            look_for(words)
            return
        for name, (stand_in, _) in PLACEHOLDERS.items():
            if stand_in in words and not Path(stand_in).exists():
                seed = str(sorted({s for s, _ in PLACEHOLDERS.values()}).index(stand_in))
                boat = next((word for word in words if word in shipped_vehicles()), "blueboat")
                hidden = ("--effect", "surge_quadratic_damping=-40") if "train" in words else ()  # something to learn
                simulate = ("simulate", "-v", boat, *hidden, "--duration", "60", "--seed", seed, "--out", stand_in)
                assert done(*simulate), name
        for bag in RECORDED.values():
            if bag in words and not Path(bag).exists():
                world = simulate_world(load_vehicle("blueboat_paper"), HIDDEN, duration=90.0, seed=0)
                assert write_ros2(Path(bag), recorded(world, "/boat"), "mcap").is_dir()
        words = words[1:]
        verb = words[0]
        if verb == "discover" and "--out" in words:
            self.said += self.shared.discover(words)
            return
        if verb in SERVES:
            assert get_command(app).commands[verb].make_context(verb, words[1:])  # type: ignore[attr-defined]
            return
        result = call(*words, *CHEAPER.get(verb, ((), ""))[0])
        codes = (0, 1) if verb in MAY_FIND else (0,)
        assert result.exit_code in codes, f"undertow {shlex.join(words)}\n{result.output}"
        assert result.exit_code == 0 or isinstance(result.exception, SystemExit), repr(result.exception)
        self.said += result.stdout

    def _python(self, block: Block) -> None:
        if block.file:
            _put(block)
            return
        told = io.StringIO()
        with redirect_stdout(told):
            exec(compile(block.text, "the page", "exec"), self.known)
        self.said = told.getvalue()

    def _yaml(self, block: Block) -> None:
        data = yaml.safe_load(block.text)
        assert isinstance(data, dict)
        assert data
        keys = set(data)
        if keys <= set(Vehicle.model_fields):
            whole = yaml.safe_load((ROOT / "data" / "demo.yaml").read_text(encoding="utf-8"))
            vehicle_from_dict(data if keys >= {"mass", "inertia_z", "thrusters"} else {**whole, **data}, "the page")
        elif keys <= set(Limits.model_fields):
            target = Path("limits_on_the_page.yaml")
            target.write_text(block.text, encoding="utf-8")
            assert load_limits(target)
        else:
            target = Path("a_map_on_the_page.yaml")
            target.write_text(block.text, encoding="utf-8")
            assert read_channel_map(target)
        if block.file:
            _put(block)

    def _toml(self, block: Block) -> None:
        """Only entries of the catalogue are in TOML; `tests/test_extending.py` puts them there."""
        assert block.file == "physics/effects.toml"
        assert all(entry["parameters"] for entry in tomllib.loads(block.text).values())
        _put(block)

    def _output(self, block: Block) -> None:
        """A block of text shows lines of what the block above it printed, in their order."""
        lines = iter(self.said.splitlines())
        for shown in filter(None, map(str.strip, block.text.splitlines())):
            assert shown == "..." or any(_same(shown, line.strip()) for line in lines), f"was not printed: {shown}"


def _put(block: Block) -> None:
    path = Path(block.file)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(block.text, encoding="utf-8")


def _same(shown: str, line: str) -> bool:
    """The same words, and numbers that differ by no more than another machine's rounding."""
    if NUMBER.sub("#", shown).split() != NUMBER.sub("#", line).split():
        return False
    pairs = zip(NUMBER.findall(shown), NUMBER.findall(line), strict=True)
    return all(float(a) == pytest.approx(float(b), rel=0.02, abs=0.011) for a, b in pairs)


def look_for(words: list[str]) -> None:
    """What a command names that is not run here is there: targets of make, scripts, extras, folders."""
    match words[0].removeprefix(".venv/bin/"), words[1:]:
        case "make", [target, *rest]:
            told = (ROOT / "Makefile").read_text(encoding="utf-8")
            assert re.search(rf"^{re.escape(target)}:", told, re.MULTILINE), f"the Makefile has no target {target}"
            assert not rest
        case "python", [script, *_]:
            assert (ROOT / script).is_file(), f"there is no {script}"
            ast.parse((ROOT / script).read_text(encoding="utf-8"))
        case "pip", ["install", *what]:
            project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
            named = re.findall(r"\[([\w,]+)\]", " ".join(what))
            assert named
            assert {extra for some in named for extra in some.split(",")} <= set(project["optional-dependencies"])
        case ".", [".venv/bin/activate"]:
            pass
        case _:
            raise AssertionError(f"nobody knows how to look for {shlex.join(words)}")
