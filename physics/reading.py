"""Reading of foreign text, YAML and JSON within bounds: the one door for all three, and what counts as a number there.

Size of the file, depth, number of parts and expansion of aliases are checked before anything is built. Whatever cannot
be read is refused by one `ValueError` that fits on a line.
"""

import json
import math
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, ClassVar

import yaml
from pydantic import AfterValidator, BeforeValidator

from .errors import printable, shortened, shown

MOST_TEXT = 32 * 2**20
"""Bytes of a text: a vehicle has 2 kB, the findings of an hour 100 kB, the inspections of a hundred logs 10 MB."""
BLOCK = 1 << 20
"""Bytes that are read at once from a file that may be long [B]: the call then costs nothing beside the reading."""
_DEEPEST = 64
"""Levels of lists in lists; undertow's own files have 12."""
_MOST_NODES = 500_000
"""Values of a YAML file, those that its aliases repeat among them: the history of a training has some ten thousand."""
_MOST_CONTAINERS = 1_000_000
"""Lists and objects of a JSON file: each takes some 100 bytes, so that they fit into 100 MB."""
_MOST_DIGITS = 300
"""Digits of a whole number: one of more is no float."""


def read_bytes(path: str | os.PathLike[str], most: int = MOST_TEXT) -> bytes:
    """The content of a plain file of at most `most` bytes.

    Raises
    ------
    ValueError
        for a folder, a pipe or a device, which may have no end, and for a larger file.
    OSError
        when there is none, or it cannot be opened.
    """
    source = Path(path)
    source.stat()
    if not source.is_file():
        raise ValueError(f"expected a file, got {'a folder' if source.is_dir() else 'a pipe or a device'}")
    with source.open("rb") as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise ValueError(f"expected at most {most / 1e6:.0f} MB, got {source.stat().st_size / 1e6:.0f} MB")
    return content


def read_text(path: str | os.PathLike[str], most: int = MOST_TEXT) -> str:
    """The UTF-8 text of a plain file; see `read_bytes` and `text_of`."""
    return text_of(read_bytes(path, most))


def text_of(content: bytes) -> str:
    """UTF-8 text without its byte-order mark.

    Raises
    ------
    ValueError
        for other encodings, saying the first byte that is none, and for what is no text.
    """
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise ValueError("expected UTF-8 text, got UTF-16; save it as UTF-8")
    at = content.find(b"\0")
    if at >= 0:
        raise ValueError(f"expected text, got a zero byte in line {content.count(bytes((10,)), 0, at) + 1}")
    try:
        return content.removeprefix(b"\xef\xbb\xbf").decode("utf-8")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise ValueError(f"expected UTF-8 text, got the byte 0x{content[error.start]:02x} in line {line}") from None


Plain = dict[str, Any]
"""What a file holds by name, before it is checked or after everything was said: at the edges only."""
_SAFE: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # ten times as fast, where PyYAML was built with it
_TAG = "tag:yaml.org,2002:"
_NODES: dict[str, type[yaml.Node]] = {
    **{_TAG + kind: yaml.ScalarNode for kind in ("null", "bool", "int", "float", "str", "merge")},
    f"{_TAG}seq": yaml.SequenceNode,
    f"{_TAG}map": yaml.MappingNode,
}
"""The kinds of values that are read, and as what each must stand in the text."""


class _Plain(_SAFE):
    """The safe loader, of plain data only: no dates, sets or bytes, no key twice, no number without digits."""

    yaml_implicit_resolvers: ClassVar = {
        first: [(tag, pattern) for tag, pattern in rules if tag in _NODES]
        for first, rules in _SAFE.yaml_implicit_resolvers.items()
    }

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        """Refuse what is not plain, and what the safe loader trips over, by its line."""
        if not isinstance(node, _NODES.get(node.tag, ())):
            raise yaml.YAMLError(f"line {node.start_mark.line + 1}: the tag {shown(node.tag)} is not read here")
        if not isinstance(node, yaml.ScalarNode):
            return super().construct_object(node, deep)
        digits = sum(character.isdigit() for character in node.value)
        try:
            if node.tag == f"{_TAG}int" and digits > _MOST_DIGITS:
                raise ValueError
            return super().construct_object(node, deep)
        except (ValueError, IndexError, KeyError, OverflowError):
            kind = {"int": "a whole number", "float": "a number", "bool": "true or false"}.get(
                node.tag.removeprefix(_TAG), "plain"
            )
            raise yaml.YAMLError(f"line {node.start_mark.line + 1}: {shown(node.value)} is not {kind}") from None

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Refuse a key that stands twice, of which the safe loader silently keeps the last."""
        seen: set[str] = set()
        for key in (key.value for key, _ in node.value if isinstance(key, yaml.ScalarNode)):
            if key in seen and key != "<<":
                raise yaml.YAMLError(
                    f"key {shown(key)} stands twice in one mapping, line {node.start_mark.line + 1}; keep one"
                )
            seen.add(key)
        return super().construct_mapping(node, deep)


def parse_yaml(text: str) -> Any:
    """Plain data from YAML text: mappings, lists, texts, numbers, true, false and null. A date stays a text.

    Raises
    ------
    ValueError
        when the text is no such YAML, when a key stands twice in a mapping, or it is more or deeper than any file of
        undertow, its aliases written out.
    """
    try:
        _check_events(text)
        return yaml.load(text, Loader=_Plain)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"line {mark.line + 1}: " if mark is not None else ""
        told = ", ".join(part for part in (error.context, error.problem) if part)
        raise ValueError(f"{where}{shortened(printable(told), 300)}") from None
    except yaml.YAMLError as error:
        told = (str(error).splitlines() or [""])[0].strip() or type(error).__name__
        raise ValueError(shortened(printable(told), 300)) from None


def _check_events(text: str) -> None:
    """Count the parts of a YAML text before any is built; an alias counts as all that it repeats."""
    sizes: dict[str, int] = {}
    open_at: list[tuple[str | None, int]] = []
    count = 0
    for event in yaml.parse(text, Loader=_SAFE):
        line = event.start_mark.line + 1
        if isinstance(event, yaml.AliasEvent):
            if event.anchor not in sizes:
                raise yaml.YAMLError(f"line {line}: the alias *{shown(event.anchor)} stands for nothing, or for itself")
            count += sizes[event.anchor]
        elif isinstance(event, yaml.CollectionStartEvent):
            open_at.append((event.anchor, count))
            count += 1
            if event.anchor is not None:
                sizes.pop(event.anchor, None)
        elif isinstance(event, yaml.CollectionEndEvent):
            anchor, before = open_at.pop()
            if anchor is not None:
                sizes[anchor] = count - before
        elif isinstance(event, yaml.ScalarEvent):
            count += 1
            if event.anchor is not None:
                sizes[event.anchor] = 1
        if len(open_at) > _DEEPEST:
            raise yaml.YAMLError(f"line {line}: lists in lists, more than {_DEEPEST} deep")
        if count > _MOST_NODES:
            raise yaml.YAMLError(f"line {line}: more than {_MOST_NODES} values, those that aliases repeat among them")


def parse_json(text: str | bytes, *, lenient: bool = False) -> Any:
    """Plain data from JSON text.

    Parameters
    ----------
    lenient : for messages of a log, which may hold NaN and numbers without bound; a file of undertow holds neither

    Raises
    ------
    ValueError
        when the text is no JSON, holds a number that is not finite, or is more or deeper than any file of undertow.
    """
    if isinstance(text, bytes):
        text = text.decode(json.detect_encoding(text))
    containers = text.count("[") + text.count("{")  # an upper limit, for a text may hold some
    if containers > _MOST_CONTAINERS:
        raise ValueError(f"more than {_MOST_CONTAINERS} lists and objects")
    try:
        if lenient:
            content = json.loads(text)
        else:
            content = json.loads(text, parse_constant=_refused, parse_float=_finite, parse_int=_whole)
    except RecursionError:
        raise ValueError(f"lists in lists, more than {_DEEPEST} deep") from None
    if containers > _DEEPEST and any(depth > _DEEPEST for depth in _depths(content)):
        raise ValueError(f"lists in lists, more than {_DEEPEST} deep")
    return content


def read_yaml(path: str | os.PathLike[str]) -> Any:
    """Plain data from a YAML file.

    Raises
    ------
    ValueError
        when it is no plain file, too large, no UTF-8 text, or no such YAML as `parse_yaml` reads.
    OSError
        when there is none, or it cannot be opened.
    """
    return parse_yaml(read_text(path))


def read_json(path: str | os.PathLike[str]) -> Any:
    """Plain data from a JSON file; see `read_yaml` and `parse_json`."""
    return parse_json(read_text(path))


def reason(error: Exception) -> str:
    """The reason why a file could not be read, in a few words, without its path."""
    return error.strerror or type(error).__name__ if isinstance(error, OSError) else str(error)


def _refused(constant: str) -> Any:
    raise ValueError(f"{constant} is not JSON")


def _finite(digits: str) -> float:
    number = float(digits)
    if not math.isfinite(number):
        raise ValueError(f"the number {shown(digits)} is too large")
    return number


def _whole(digits: str) -> int:
    if len(digits) > _MOST_DIGITS:
        raise ValueError(f"a whole number of {len(digits)} digits")
    return int(digits)


def _depths(content: Any) -> Iterator[int]:
    """How deep each list and object lies, without going down by recursion."""
    waiting = [(content, 1)]
    while waiting:
        part, depth = waiting.pop()
        if isinstance(part, dict | list):
            yield depth
            parts = part.values() if isinstance(part, dict) else part
            waiting += [(inner, depth + 1) for inner in parts if isinstance(inner, dict | list)]


LARGEST = 1e18
"""Largest amount of a number, in SI units: the largest ship has a moment of inertia of 1e13 kg m^2."""
_LEAST = 1e-12
"""Least amount of what must be positive: a propeller of 1 cm, counted in revolutions a minute, has some 1e-9."""
_MOST_TOLD = 8
"""Complaints about one file that are told: who mends these reads the others next."""
_TOLD = {
    "float_parsing": "expected a number",
    "float_type": "expected a number",
    "string_type": "expected a word",
    "dict_type": "expected lines of 'key: value'",
    "model_type": "expected lines of 'key: value'",
    "tuple_type": "expected a list",
    "too_short": "expected a list of at least {min_length}",
    "too_long": "expected at most {max_length} letters or entries",
    "literal_error": "expected {expected}",
    "greater_than_equal": "expected at least {ge:g}",
    "less_than": "expected less than {lt:g}",
    "union_tag_invalid": "expected {expected_tags}",
    "union_tag_not_found": "{discriminator} missing",
    "string_pattern_mismatch": "expected a letter, then letters, digits and _",
}
"""What pydantic complains about, in words that need no pydantic; anything else is told in its own."""
_NAME = 60
"""Letters of a key that are told, and compared with those that are known."""
_NEAR = 0.4
"""Likeness from which a key may be a misspelling of another: "weight" and "environment" have 0.35."""
_MEANT = {"weight": "mass", "izz": "inertia_z", "iz": "inertia_z", "inertia": "inertia_z", "thruster": "thrusters"}
"""Other people's names of keys."""


def _number(value: Any) -> Any:
    """Refuse true and false, which Python counts as 1 and 0, and what overflows; what vanishes is 0."""
    if isinstance(value, bool):
        raise ValueError("expected a number")
    try:
        amount = abs(float(value))
    except (TypeError, ValueError, OverflowError):
        amount = LARGEST * 10 if isinstance(value, int) else 0.0  # words are for pydantic to refuse
    if amount > LARGEST or amount != amount:
        raise ValueError(f"expected a finite number of at most {LARGEST:g}")
    return 0.0 if 0.0 < amount < sys.float_info.min else value


def positive(value: float) -> float:
    """Refuse what a calculation cannot divide by."""
    if value <= 0.0:
        raise ValueError("expected a number above 0")
    if value < _LEAST:
        raise ValueError(f"expected at least {_LEAST:g}")
    return value


Number = Annotated[float, BeforeValidator(_number)]
"""A finite number of an amount that a vehicle may have; true and false are none."""
Positive = Annotated[Number, AfterValidator(positive)]
"""A `Number` above zero, by which a calculation may divide."""


def complaints(items: Sequence[Any], tell: Callable[[Any], str]) -> str:
    """Complaints of pydantic, in a sentence for each of the first few.

    Parameters
    ----------
    items : as `ValidationError.errors()` gives them
    tell : one of them as a sentence
    """
    more = len(items) - _MOST_TOLD
    return "; ".join([*map(tell, items[:_MOST_TOLD]), *([f"and {more} more of the kind"] if more > 0 else [])])


def complaint(item: Any, parts: Sequence[Any], meant: str = "") -> str:
    """One of pydantic's complaints as `key: what was expected, got what came`, or `key missing, what it is`.

    Parameters
    ----------
    item, parts : the complaint, and where in the file it is
    meant : what should stand there, in words
    """
    where, kind = location(parts), item["type"]
    if kind == "missing":
        return f"{where} missing{', ' * bool(meant)}{meant}"
    known = _TOLD.get(kind)
    message = item["msg"].removeprefix("Value error, ") if known is None else known.format(**item.get("ctx", {}))
    came = "" if isinstance(item["input"], dict) else f", got {shown(item['input'])}"
    return f"{where}: {message}{came}" if where else f"{message}"


def location(parts: Sequence[Any]) -> str:
    """Place in a file, with dots: `thrusters.0.curve`."""
    return ".".join(shortened(str(part), _NAME) for part in parts)


def unknown_key(key: Any, known: Iterable[str], where: str = "") -> str:
    """Say that a key is not known, and which known one is nearest.

    Parameters
    ----------
    key : that came
    known : keys that there are
    where : the place, in words
    """
    names = sorted(k for k in known if "{" not in k)
    meant = _MEANT.get(str(key).lower(), str(key))
    near = [meant] if meant in names else get_close_matches(meant[:_NAME], names, n=1, cutoff=_NEAR)
    text = f"unknown key {shown(key, _NAME)}{where and ' in '}{where}"
    return f"{text}: did you mean {near[0]!r}?" if near else f"{text}; there are {shortened(', '.join(names))}"
