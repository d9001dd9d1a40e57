"""A JavaScript module without any library, for a browser or node.

The page that plays has another one (`exports/javascript.py`): there every number can be changed while it runs.
"""

from collections.abc import Mapping, Sequence
from json import dumps
from pathlib import Path
from typing import final

from ..known_facts import filled, remarks
from ..program.model_program import program_of
from ..program.printer import ArrayLanguage, identifier, wrapped
from ..program.symbols import Function
from .base import Export, Given

_TAKEN = """
arguments await break case catch class const continue debugger default delete do else enum eval export extends false
finally for function if implements import in instanceof interface let new null package private protected public return
static super switch this throw true try typeof undefined var void while with yield
exports module require document location top window
thrust rates derivatives start step
"""
"""What the language, node or a browser keeps for itself, and the functions of the module."""
_SPELLING = {
    **{name: f"Math.{name}({{}})" for name in ("sqrt", "cos", "sin", "abs", "sign")},
    **{name: f"Math.{name}({{}}, {{}})" for name in ("min", "max", "pow")},
    "select": "({} ? {} : {})",
}


@final
class JavaScript(ArrayLanguage):
    """JavaScript functions on arrays."""

    spelling = _SPELLING
    named = "const {} = {};"

    def curve(self, name: str, xs: Sequence[float], ys: Sequence[float]) -> str:
        """See `Language.curve`."""
        points = ["\n    ".join(wrapped([repr(x) for x in line], 100)) for line in (xs, ys)]
        return f"""
function {name}(x) {{
  const xs = [{points[0]}];
  const ys = [{points[1]}];
  if (x <= xs[0]) return ys[0];
  let k = 1;
  while (k < xs.length && xs[k] < x) k++;
  if (k === xs.length) return ys[k - 1];
  return ys[k - 1] + ((ys[k] - ys[k - 1]) / (xs[k] - xs[k - 1])) * (x - xs[k - 1]);
}}"""

    def define(self, function: Function, body: Sequence[str], results: Sequence[Sequence[str]]) -> str:
        """See `Language.define`."""
        text = "\n".join(f"// {line}" for line in function.description)
        inputs = ", ".join(group.name for group in function.inputs)
        groups = [f"[\n    {(',' + chr(10) + '    ').join(texts)},\n  ]" for texts in results]
        found = groups[0] if len(groups) == 1 else f"[{', '.join(groups)}]"
        lines = [*body, f"return {found};"]
        return f"\n{text}\nfunction {function.name}({inputs}) {{\n" + "\n".join(f"  {x}" for x in lines) + "\n}"


def _files(given: Given, path: Path) -> Mapping[Path, bytes]:
    program = program_of(given.vehicle, given.choices.time_step)
    name = identifier(path.stem)
    text = filled(
        Path(__file__).with_name("module.js.in"),
        name=f"{name}_model" if name in _TAKEN.split() else name,
        step=program.time_step,
        command=dumps(program.thrust.inputs[0].members),
        state=dumps(program.state),
        functions=JavaScript("", program.functions).text(),
    )
    return {path: (remarks(given.facts.lines(), "// ") + text).encode()}


EXPORT = Export("JavaScript module without any library", ".js", _files, ("// ", ""))
