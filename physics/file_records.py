"""Records: facts of files as types, defined where the fact is made, and closed lists of words with a sentence each."""

import math
from collections.abc import Mapping
from enum import Enum
from functools import cache
from reprlib import Repr
from typing import Annotated, Any, ClassVar, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, Strict, ValidationError, model_validator

from .errors import RequestError
from .reading import Plain

_MOST_LETTERS = 60
"""Letters of a value or a name in a message: enough to know it again, whatever somebody put there."""
_EXPECTED = {
    "string_type": "a text",
    "float_type": "a number or null",
    **dict.fromkeys(("int_type", "int_from_float"), "a whole number"),
    **dict.fromkeys(("bool_type", "bool_parsing"), "true or false"),
    **dict.fromkeys(("tuple_type", "list_type"), "a list"),
    "named_tuple_type": "a list of two numbers",
    **dict.fromkeys(("model_type", "model_attributes_type", "dict_type", "mapping_type"), "an object"),
}
"""What a field takes, in words, by the kind of pydantic's error."""

Number = Annotated[float, BeforeValidator(lambda value: math.nan if value is None else value), Strict()]
"""A float that JSON has as null where it is not finite."""
Whole = Annotated[int, Strict()]
Flag = Annotated[bool, Strict()]


def absent() -> Any:
    """The default of a field that a file does not have where there is nothing to say."""
    return Field(default=None, exclude_if=lambda value: value is None)


@cache
def _needed(record: type[BaseModel]) -> frozenset[str]:
    """The fields without a default."""
    return frozenset(name for name, field in record.model_fields.items() if field.is_required())


class Record(BaseModel):
    """One fact of a file, or all of it.

    Fields that a file has beyond these are passed over, so that a file of a later version is read; a field that a file
    of an earlier version lacks, or has as null, takes its default. The fields are written in their order here.
    """

    model_config: ClassVar[ConfigDict] = ConfigDict(
        frozen=True, extra="ignore", validate_by_name=True, validate_by_alias=True, defer_build=True
    )

    SCHEMA: ClassVar[str] = ""
    """What the file says that it holds; empty for a part of a file."""
    FORMER: ClassVar[tuple[str, ...]] = ()
    """Schemas of earlier versions that are read, too."""

    @model_validator(mode="before")
    @classmethod
    def _null_is_absent(cls, content: Any) -> Any:
        if not isinstance(content, Mapping):
            return content
        return {key: value for key, value in content.items() if value is not None or key in _needed(cls)}

    def but(self, **changes: Any) -> Self:
        """The same with other values in some fields, checked."""
        return type(self).model_validate({**dict(self), **changes})

    def __getitem__(self, name: str) -> Any:
        """A field as JSON has it, by its name there: `step["rollout_rmse"]["10"]["position"]`."""
        return self.to_dict()[name]

    def to_dict(self) -> Plain:
        """As JSON has it."""
        content = self.model_dump(mode="json", by_alias=True)
        return {"schema": self.SCHEMA, **content} if self.SCHEMA else content

    @classmethod
    def read(cls, content: object, source: object, remedy: str) -> Self:
        """The record that a file holds.

        Parameters
        ----------
        content : of the file, as JSON gives it
        source : the file, as messages name it
        remedy : what to do where it does not hold one

        Raises
        ------
        RequestError
            when the content is of another schema, or lacks a field, or has another kind of value in one.
        """
        if not isinstance(content, Mapping):
            raise RequestError(f"{source}: expected a JSON object, got a {type(content).__name__}; {remedy}")
        if cls.SCHEMA and content.get("schema") not in (cls.SCHEMA, *cls.FORMER):
            came = shown(content.get("schema"))
            raise RequestError(f"{source}: expected schema {cls.SCHEMA!r}, got {came}; {remedy}")
        try:
            return cls.model_validate(content)
        except ValidationError as error:
            raise RequestError(f"{source}: {_in_words(error)}; {remedy}") from None


def shown(value: object) -> str:
    """A value of a file for a message, cut where it is long."""
    short = Repr()
    short.maxstring = short.maxother = short.maxlong = _MOST_LETTERS
    text = short.repr(value)
    return text if len(text) <= 2 * _MOST_LETTERS else f"{text[: 2 * _MOST_LETTERS]}..."


def _in_words(error: ValidationError) -> str:
    """The first thing that is wrong: the place, what was expected there, and what came."""
    found = error.errors(include_url=False)
    first = found[0]
    place, context = first["loc"], first.get("ctx", {})
    if first["type"] == "too_long" or (first["type"] == "missing" and isinstance(place[-1], int)):
        ends = place[:-1] if first["type"] == "missing" else place
        return f"expected {_EXPECTED['named_tuple_type']} under {_place(ends)!r}, got {shown(first['input'])}"
    if first["type"] == "missing":
        lacking = [repr(one["loc"][-1]) for one in found if one["type"] == "missing" and one["loc"][:-1] == place[:-1]]
        return f"{_place(place[:-1]) or 'the file'} lacks {', '.join(lacking)}"
    if first["type"] in ("literal_error", "enum"):
        expected = f"one of {context['expected']}"
    elif first["type"] == "value_error":
        expected = str(context["error"])
    else:
        expected = _EXPECTED.get(first["type"], "another kind of value")
    return f"expected {expected} under {_place(place)!r}, got {shown(first['input'])}"


def _place(names: tuple[str | int, ...]) -> str:
    """Where a value stands in a file, such as `candidates[0].terms`.

    Examples
    --------
    >>> _place(("candidates", 0, "terms"))
    'candidates[0].terms'
    """
    text = ""
    for name in names:
        if isinstance(name, int):
            text += f"[{name}]"
            continue
        short = name if len(name) <= _MOST_LETTERS else f"{name[:_MOST_LETTERS]}..."
        text += f".{short}" if text else short
    return text


class DescribedEnum(Enum):
    """A list whose members are given as a word, which is their value, and a sentence."""

    sentence: str

    def __new__(cls, word: str, *_: Any) -> "DescribedEnum":
        """A member whose value is the word."""
        member = object.__new__(cls)
        member._value_ = word
        return member

    def __init__(self, _: str, sentence: str) -> None:
        self.sentence = sentence
