"""A C99 header without dependencies, heap or global state, in double or float, and a test of it with its vectors."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import final

import numpy as np

from ...physics.laws.damping_power import Envelope
from ...physics.motion import Array
from ..known_facts import KnownFacts, filled, remarks
from ..program.model_program import Program, program_of
from ..program.printer import Language, calls, identifier, wrapped
from ..program.symbols import Function, Group
from ..program.vectors import drawn, driven
from .base import Export, Given

_SIGN = """
static inline {prefix}real {prefix}sign({prefix}real x)
{{
    return ({prefix}real)((x > 0) - (x < 0));
}}
"""
_ROWS, _SECONDS = 50, 10.0
"""States, and length of a rollout [s], in the vectors: a file of some 100 kB."""


_SPELLING = calls("UT_FUNCTION({})", absolute="fabs", minimum="fmin", maximum="fmax", power="pow")


@final
class C99(Language):
    """C99 functions that take and fill arrays."""

    literal = "UT_NUMBER({!r})"

    def __init__(self, prefix: str, functions: Sequence[Function]) -> None:
        super().__init__(prefix, functions)
        self._real = f"{prefix}real"
        self.spelling = _SPELLING | {"sign": f"{prefix}sign({{}})", "where": "({} ? {} : {})"}
        self.named = f"const {self._real} {{}} = {{}};"

    def called(self, function: Function, given: Sequence[str], names: Sequence[str]) -> list[str]:
        """See `Language.called`."""
        arguments, inside = [], []
        for group, texts in zip(function.inputs, function.split(given), strict=True):
            arguments.append(texts[0] if group.single else f"{group.name}_")
            if not group.single:
                inside += self._array(f"{group.name}_", texts)
        lines = [
            f"{self._real} {name}[{len(results)}];" for name, (_, results) in zip(names, function.outputs, strict=True)
        ]
        call = f"{self.prefix}{function.name}({', '.join([*arguments, *names])});"
        return [*lines, "{", *(f"    {x}" for x in inside), f"    {call}", "}"]

    def _array(self, name: str, texts: Sequence[str]) -> list[str]:
        first, *more = wrapped(texts)
        lines = [f"const {self._real} {name}[{len(texts)}] = {{{first}", *(f"    {line}" for line in more)]
        return [*lines[:-1], f"{lines[-1]}}};"]

    def curve(self, name: str, xs: Sequence[str], ys: Sequence[str]) -> str:
        """See `Language.curve`."""
        tables = (self._array("xs", xs), self._array("ys", ys))
        text = "".join("    static " + "\n    ".join(lines) + "\n" for lines in tables)
        return f"""
static inline {self._real} {name}({self._real} x)
{{
{text}    int low = 0, high = {len(xs) - 1};
    if (x <= xs[low]) return ys[low];
    if (x >= xs[high]) return ys[high];
    while (high - low > 1) {{
        const int middle = (low + high) / 2;
        if (xs[middle] <= x) low = middle;
        else high = middle;
    }}
    return ys[low] + (ys[high] - ys[low]) / (xs[high] - xs[low]) * (x - xs[low]);
}}"""

    def define(self, function: Function, body: Sequence[str], results: Sequence[Sequence[str]]) -> str:
        """See `Language.define`."""
        inputs = [self._parameter(group, "const ") for group in function.inputs]
        outputs = [self._parameter(group, "") for group, _ in function.outputs]
        lines = [f"    {line}" for line in body]
        for (group, _), texts in zip(function.outputs, results, strict=True):
            pairs = zip(group.members, texts, strict=True)
            lines += [f"    {group.name}[{k}] = {text}; /* {name} */" for k, (name, text) in enumerate(pairs)]
        head = "\n   ".join(function.description)
        return (
            f"\n/* {head} */\nstatic inline void {self.prefix}{function.name}("
            f"{', '.join([*inputs, *outputs])})\n{{\n" + "\n".join(lines) + "\n}"
        )

    def _parameter(self, group: Group, kind: str) -> str:
        return (
            f"{self._real} {group.name}" if group.single else f"{kind}{self._real} {group.name}[{len(group.members)}]"
        )


def header(program: Program, name: str, facts: KnownFacts) -> str:
    """The header's text; a name is what all its names begin with."""
    prefix, upper = f"{name}_", name.upper()
    printed = C99(prefix, program.functions).text()
    sign = _SIGN.format(prefix=prefix) * (f"{prefix}sign(" in printed)
    return remarks(facts.lines(), "// ") + filled(
        Path(__file__).with_name("header.h.in"),
        guard=f"UNDERTOW_{upper}_H",
        upper=upper,
        prefix=prefix,
        step=program.time_step,
        functions=sign + printed,
    )


def test_program(program: Program, name: str, envelope: Envelope, paths: tuple[str, str]) -> str:
    """A C program that compares a header with vectors of undertow's own simulation; paths of the header and of it."""
    states, (rolled,) = drawn(program, envelope, _ROWS), driven(program, envelope, _SECONDS)
    prefix = f"{name}_"
    rows = {
        "drawn": (program.derivatives.inputs, states.inputs),
        "begun": (program.start.inputs, rolled.start[None]),
        "driven": (program.step.inputs[1:], rolled.steps),
    }
    arrays = [
        _array(f"{prefix}real {begin}_{group.name}", values)
        for begin, (groups, given) in rows.items()
        for group, values in zip(groups, _by_group(groups, given), strict=True)
    ]
    for begin, expected in (("drawn", states.expected), ("driven", rolled.expected)):
        sizes = np.abs(expected).max(axis=0, keepdims=True)
        arrays += [
            _array(f"double {begin}_expected", expected),
            _array(f"double {begin}_sizes", np.where(sizes > 0.0, sizes, 1.0)),
        ]
    taken = {
        begin: ", ".join(f"{begin}_{group.name}[{row}]{'[0]' * group.single}" for group in groups)
        for row, (begin, (groups, _)) in zip(("k", "0", "k"), rows.items(), strict=True)
    }
    return filled(
        Path(__file__).with_name("header_test.c.in"),
        header=paths[0],
        test=paths[1],
        upper=name.upper(),
        prefix=prefix,
        arrays="\n".join(arrays),
        rows=_ROWS,
        rates=states.expected.shape[1],
        states=len(program.state),
        steps=len(rolled.steps),
        **taken,
    )


def _by_group(groups: Sequence[Group], rows: Array) -> list[Array]:
    return np.split(rows, np.cumsum([len(group.members) for group in groups])[:-1], axis=1)


def _array(name: str, values: Array) -> str:
    rows = ",\n".join(f"{{{', '.join(map(repr, row))}}}" for row in values.tolist())
    return f"static const {name}[{len(values)}][{values.shape[1]}] = {{\n{rows}\n}};"


def _files(given: Given, path: Path) -> Mapping[Path, bytes]:
    program, name = program_of(given.vehicle, given.choices.time_step), identifier(path.stem)
    beside = path.with_name(f"{path.stem}_test.c")
    test = test_program(program, name, given.facts.envelope, (path.name, beside.name))
    return {path: header(program, name, given.facts).encode(), beside: test.encode()}


EXPORT = Export("C99 header and a test of it, for firmware and controllers", ".h", _files, ("// ", ""))
