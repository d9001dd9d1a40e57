"""A MATLAB or Octave class folder in one file: functions of the model in the style of Fossen's MSS."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import final

from ...physics.errors import RequestError, shown
from ..known_facts import filled, remarks
from ..program.model_program import program_of
from ..program.printer import Language, calls, wrapped
from ..program.symbols import COMPARED, INFIX, Function
from .base import Export, Given

_TAKEN = """
break case catch classdef continue do else elseif end endfunction endif endwhile enumeration events for function global
if methods otherwise parfor persistent properties return spmd switch try unwind_protect until while
abs cellfun cos max min pick rows sign sin size sqrt struct sum zeros
thrust rates derivatives start step
"""
"""What the language keeps for itself, and what the file calls."""


@final
class Matlab(Language):
    """MATLAB functions on columns, side by side where there are several boats."""

    spelling = calls("{}", absolute="abs", minimum="min", maximum="max")
    spelling |= {"power": "({}) .^ ({})", "where": "pick({}, {}, {})"}
    infix = INFIX | COMPARED | {"multiply": ".*", "divide": "./"}
    item = "{}({}, :)"
    between = "; "
    named = "{} = {};"
    first = 1

    def curve(self, name: str, xs: Sequence[str], ys: Sequence[str]) -> str:
        """See `Language.curve`."""
        points = [" ...\n    ".join(wrapped(line, 100)) for line in (xs, ys)]
        return (
            f"\nfunction y = {name}(x)\nxs = [{points[0]}];\nys = [{points[1]}];\n"
            "x = min(max(x, xs(1)), xs(end));\nk = sum(x >= xs(1:end-1)', 1);\n"
            "y = ys(k) + (ys(k + 1) - ys(k)) ./ (xs(k + 1) - xs(k)) .* (x - xs(k));\nend"
        )

    def pack(self, texts: Sequence[str], apart: str = " ") -> str:
        """See `Language.pack`; a number that all boats share is repeated."""
        shared = any(re.fullmatch(r"-?[\d.]+(e[-+]?\d+)?", text) for text in texts)
        return f"rows({f',{apart}'.join(texts)})" if shared else f"[{f';{apart}'.join(texts)}]"

    def define(self, function: Function, body: Sequence[str], results: Sequence[Sequence[str]]) -> str:
        """See `Language.define`."""
        outputs = ", ".join(group.name for group, _ in function.outputs)
        inputs = ", ".join(group.name for group in function.inputs)
        lines = [*(f"% {line}" for line in function.description), *body]
        for (group, _), texts in zip(function.outputs, results, strict=True):
            lines.append(f"{group.name} = {self.pack(texts, ' ...' + chr(10) + '    ')};")
        return f"\nfunction [{outputs}] = {function.name}({inputs})\n" + "\n".join(lines) + "\nend"


_ROWS = """
function y = rows(varargin)
y = zeros(nargin, max(cellfun('size', varargin, 2)));
for k = 1:nargin
    y(k, :) = varargin{k};
end
end
"""
_PICK = """
function y = pick(chosen, a, b)
whole = zeros(size(chosen + a + b));
chosen = chosen + whole > 0;
a = a + whole;
y = b + whole;
y(chosen) = a(chosen);
end
"""


def _named(path: Path) -> str:
    """The function's name, which is the file's: by that MATLAB calls it."""
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,62}", path.stem) or path.stem in _TAKEN.split():
        raise RequestError(
            f"export --to matlab: expected a file name that is the name of a function, got {shown(path.stem)}, by "
            "which MATLAB cannot call it; letters, digits and underscores after a letter can, such as my_boat.m"
        )
    return path.stem


def _files(given: Given, path: Path) -> Mapping[Path, bytes]:
    program, name = program_of(given.vehicle, given.choices.time_step), _named(path)
    text = Matlab("", program.functions).text()
    rest, begun = (
        "".join(f", {group.name}" for group in function.inputs if group.name in ("air", "minutes"))
        for function in (program.step, program.start)
    )
    content = filled(
        Path(__file__).with_name("model.m.in"),
        name=name,
        NAME=name.upper(),
        rest=rest,
        begun=begun,
        step=program.time_step,
        state=" ".join(program.derivatives.inputs[0].members),
        command=" ".join(program.thrust.inputs[0].members),
        facts=remarks(["", *given.facts.lines()], "% "),
        commands=", ".join(f"'{member}'" for member in program.thrust.inputs[0].members),
        states=", ".join(f"'{member}'" for member in program.state),
        functions=text + "\n" + _ROWS * ("rows(" in text) + _PICK * ("pick(" in text),
    )
    return {path: content.encode()}


EXPORT = Export("MATLAB and Octave functions in the style of MSS", ".m", _files, ("% ", ""))
