"""A Python file that needs NumPy and nothing else, for one motion or many side by side."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import final

from ..known_facts import filled, remarks
from ..program.model_program import Program, program_of
from ..program.printer import Language, calls, wrapped
from ..program.symbols import Function
from .base import Export, Given


@final
class PythonModule(Language):
    """Python functions on arrays."""

    spelling = calls("np.{}", absolute="abs") | {"where": "np.where({}, {}, {})"}
    packed = "_rows({})"
    several = "{}"

    def curve(self, name: str, xs: Sequence[str], ys: Sequence[str]) -> str:
        """See `Language.curve`."""
        points = ["\n".join(f"        {line}" for line in wrapped(p, 100)) for p in (xs, ys)]
        inside = ",\n".join(f"        [\n    {text.replace(chr(10), chr(10) + '    ')}\n        ]" for text in points)
        return f"\n\ndef {name}(x):\n    return np.interp(\n        x,\n{inside},\n    )"

    def define(self, function: Function, body: Sequence[str], results: Sequence[Sequence[str]]) -> str:
        """See `Language.define`."""
        first, *groups = function.description
        text = "\n".join([f'    """{first}', "", *(f"    {line}" for line in groups), '    """'])
        given = "\n".join(f"    {line}" for line in body)
        inside = [f"_rows(\n        {(',' + chr(10) + '        ').join(texts)},\n    )" for texts in results]
        quiet = '@np.errstate(divide="ignore", invalid="ignore")\n' * ("np.where" in given)
        names = ", ".join(group.name for group in function.inputs)
        return f"\n\n{quiet}def {function.name}({names}):\n{text}\n{given}\n    return {', '.join(inside)}"


def module(program: Program) -> str:
    """The file's text without remarks."""
    beside = [group for group in program.step.inputs if group.name in ("air", "minutes")]
    begun = [group.name for group in program.start.inputs if group.name in ("air", "minutes")]
    first = {"air": "air[:, 0]", "minutes": "minutes"}
    later = {"air": "air[:, k + 1]", "minutes": "minutes + k * TIME_STEP / 60.0"}
    return filled(
        Path(__file__).with_name("module.py.in"),
        step=program.time_step,
        command=program.thrust.inputs[0].members,
        state=program.state,
        functions=PythonModule("", program.functions).text(),
        parameters="".join(f", {group.name}" for group in beside),
        started=", ".join(["command[:, 0]", *(first[name] for name in begun)]),
        stepped=", ".join(["command[:, k + 1]", *(later[group.name] for group in beside)]),
        told="".join(f"\n    {group.name}: {group.about}{_SHAPES[group.name]}" for group in beside),
    )


_SHAPES = {"air": ", (2, steps + 1)", "minutes": ", of the first step"}


def _files(given: Given, path: Path) -> Mapping[Path, bytes]:
    text = module(program_of(given.vehicle, given.choices.time_step))
    return {path: (remarks(given.facts.lines()) + text).encode()}


EXPORT = Export("Python file that needs NumPy alone", ".py", _files)
