"""Errors by which undertow refuses a log, a vehicle or a request; their remedies; and foreign text made safe to print.

A message says what was expected, what came and what to try. Remedies are written as options of the command line and
turned into arguments where Python called. No byte of foreign text moves a cursor, opens a line or fills a screen.
"""

import json
import re
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any

_ARGUMENTS = (
    (r"--log\b", "Moved(logs=[...])"),
    (r"--as-is\b", "Reading(as_is=True)"),
    (r"--frame (enu|ned)\b", r'Reading(frame="\1")'),
    (r"--frame\b", "Reading(frame=...)"),
    (r"--map ([\w./-]+\.ya?ml)\b", r'Reading(channel_map="\1")'),
    (r"--map\b(?!-)", "Reading(channel_map=...)"),
    (r"--namespace (/[\w/]*\w)", r'Reading(namespace="\1")'),
    (r"--namespace\b", "Reading(namespace=...)"),
    (r"--vehicle V\b", "a vehicle"),
    (r"--force\b", "force=True"),
    (r"--resume\b", "resume=True"),
    (r"--free (\w+)", r'free=["\1"]'),
    (r"--fix (OUT\.csv)\b", r"'undertow inspect LOG --fix \1'"),
    (r"--fix\b(?! OUT)", "Reading(fix=True)"),
    (r"discover --refit\b", "DiscoverySettings(refit=True)"),
    (r"--(length|mass|spacing|thrust)\b", r"Hull(\1=...)"),
    (r"--like\b", "like=..."),
)
"""Options of the command line, and what gives the same in Python."""
_COMMAND = re.compile(r"('undertow [^']*')")
"""A whole command line in a message, which is to be typed wherever it is read."""


def in_python(text: str) -> str:
    """A message for who calls functions.

    Examples
    --------
    >>> print(in_python("Say --frame enu, or --as-is. 'undertow inspect LOG --map-out map.yaml' writes a map"))
    Say Reading(frame="enu"), or Reading(as_is=True). 'undertow inspect LOG --map-out map.yaml' writes a map
    >>> print(in_python("/data/run--force/x.csv: expected a table"))
    /data/run--force/x.csv: expected a table
    """
    parts = _COMMAND.split(text)
    for place in range(0, len(parts), 2):
        for option, argument in _ARGUMENTS:
            parts[place] = re.sub(rf"(?<![\w/.-]){option}", argument, parts[place])
    return "".join(parts)


MOST_SHOWN = 4000
"""Characters of any message: some forty lines, more than anybody reads and less than what scrolls them away."""
_VALUE = 120
"""Characters of a foreign value in a message: one line."""
_ITEMS = 8
"""Parts of a foreign value that are looked at, in each of its levels."""
_DEEPEST = 3
"""Levels of a foreign value that are looked at: with eight parts each, at most 512 values."""

_CONTROLS = "\x00-\x08\x0b-\x1f\x7f-\x9f"
"""C0 without tab and line feed, DEL, C1: escape sequences begin with these."""
_INVISIBLE = "\u061c\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ufeff\ud800-\udfff\ufff9-\ufffb\U000e0000-\U000e007f"
"""Marks of direction, line and paragraph separators, what has no width, tags, and halves of a character, as which
Python holds the bytes of a file name that is not UTF-8. The joiners of letters (U+200C, U+200D) stay."""
_SENTENCE_ENDS = re.compile(r"[.?!](?= ['\"(]?[A-Z]|$)")
"""Full stops after which a sentence begins or the text ends: that of a number or of a file name is none."""
_UNFIT = re.compile(f"[{_CONTROLS}{_INVISIBLE}]")
_UNFIT_IN_LINE = re.compile(f"[\t\n{_CONTROLS}{_INVISIBLE}]")


def printable(text: str) -> str:
    r"""The text with every character that does something but show itself written as an escape; lines stay lines.

    >>> printable("\x1b[31mred\u202e m/s\u00b2")
    '\\x1b[31mred\\u202e m/s²'
    """
    return _UNFIT.sub(_escape, text)


def one_line(text: str) -> str:
    r"""`printable`, and line feeds and tabs as escapes too: a name or a message that must not look like two.

    >>> one_line("log\n0 errors.csv")
    'log\\n0 errors.csv'
    """
    return _UNFIT_IN_LINE.sub(_escape, text)


def escaped_json(text: str) -> str:
    r"""JSON text with the same characters as JSON's own escapes, which read back as what they were.

    >>> escaped_json('{"name": "\u202eyx"}')
    '{"name": "\\u202eyx"}'
    """
    return _UNFIT.sub(lambda found: json.dumps(found[0])[1:-1], text)


def shortened(text: str, most: int = MOST_SHOWN) -> str:
    """The text, or its head and its tail where it has more than `most` characters.

    >>> shortened("0123456789" * 20, 60)
    '012345678901234567 ... 173 characters left out ... 123456789'
    """
    if len(text) <= most:
        return text
    room = most - len(f" ... {len(text)} characters left out ... ")
    tail = room // 3
    told = f" ... {len(text) - room} characters left out ... "
    return f"{text[: room - tail]}{told}{text[len(text) - tail :]}"


def whole_sentences(text: str, most: int) -> str:
    """The text, or of prose with more than `most` characters the sentences that fit, one at least; else as `shortened`.

    >>> whole_sentences("The gyro is late. Move it by 0.1 s. Then look again.", 40)
    'The gyro is late. Move it by 0.1 s. (1 sentence more)'
    """
    if len(text) <= most or not text.endswith("."):
        return shortened(text, most)
    ends = [found.end() for found in _SENTENCE_ENDS.finditer(text)]
    end = max([end for end in ends if end <= most] or ends[:1])
    left = sum(1 for other in ends if other > end)
    return shortened(text[:end] + (f" ({left} sentence{'s' * (left > 1)} more)" if left else ""))


def shown(value: Any, most: int = _VALUE) -> str:
    """A foreign value as Python writes it, on one line of at most `most` characters, whatever it holds.

    >>> shown({"mass": [1, 2]})
    "{'mass': [1, 2]}"
    """
    return shortened(one_line(_repr(value, 0)), most)


def listed(names: Any, most: int = _ITEMS) -> str:
    """The first names of a collection, each shortened, and how many more there are.

    >>> listed(["a", "b", "c"], 2)
    'a, b and 1 more'
    """
    found = [shortened(one_line(str(name)), _VALUE) for name in list(names)[:most]]
    more = len(names) - len(found)
    return ", ".join(found) + (f" and {more} more" if more else "")


def nearest(name: str, known: Iterable[str]) -> str:
    """The known name that one which is not known was most likely meant to be.

    >>> nearest("zig-zag", ["rich", "zigzag", "gentle"])
    'zigzag'
    """
    return get_close_matches(name, list(known), n=1, cutoff=0.0)[0]


def _escape(found: re.Match[str]) -> str:
    return found[0].encode("unicode_escape").decode("ascii")


def _repr(value: Any, depth: int) -> str:
    """`repr` that looks at a few parts of a collection only, for a collection may be a bomb of aliases."""
    if isinstance(value, dict | list | tuple | set | frozenset):
        if depth >= _DEEPEST:
            return "..."
        more = ["..."] * (len(value) > _ITEMS)
        first = [part for _, part in zip(range(_ITEMS), value, strict=False)]
        if isinstance(value, dict):
            return "{" + ", ".join([f"{_repr(k, depth + 1)}: {_repr(value[k], depth + 1)}" for k in first] + more) + "}"
        inside = ", ".join([_repr(part, depth + 1) for part in first] + more)
        return f"[{inside}]" if isinstance(value, list) else f"({inside})"
    if isinstance(value, str | bytes):
        return repr(value if len(value) <= 2 * _VALUE else value[: 2 * _VALUE])
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) >= 10**_VALUE:
        return "a number of very many digits"
    return repr(value)


MOST_TOLD = MOST_SHOWN - 100
"""Characters of a text, so that "undertow: " and a path can be put before it within what any message may have."""


class _BoundedError(ValueError):
    """A text that fits on a screen, whatever of a broken file it quotes: of a longer one, head and tail are kept.

    It is written with the options of the command line. Python shows it with arguments in their place.
    """

    def __init__(self, text: str = "") -> None:
        super().__init__(shortened(str(text), MOST_TOLD))

    def __str__(self) -> str:
        return in_python(self.typed)

    @property
    def typed(self) -> str:
        """The text for who types commands."""
        return str(self.args[0])


class LogError(_BoundedError):
    """A log that cannot be read or used; the text says what was expected, what came, and what to try.

    Attributes
    ----------
    mends : lines of a channel map with which it can be read, where there are such; `inspect --map-out` writes them
    """

    def __init__(self, text: str = "", mends: str = "") -> None:
        super().__init__(text)
        self.mends = mends


class VehicleError(_BoundedError):
    """A vehicle file or parameter that cannot be used; the text says what was expected, what came, and what to try."""


class RequestError(_BoundedError):
    """A request that cannot be met (unknown effect, unusable option, failed solve); the text says what to try."""


def expect(what: str, given: object, kind: type | tuple[type, ...], cure: str) -> None:
    """Check the type of an argument of a function that users call.

    Parameters
    ----------
    what : the function and the argument, such as "adapt: vehicle"
    cure : how one comes by such an argument

    Raises
    ------
    RequestError
        when it is of another type.
    """
    kinds = kind if isinstance(kind, tuple) else (kind,)
    if not isinstance(given, kinds):
        wanted = " or ".join(k.__name__ for k in kinds)
        came = (
            f"{type(given).__name__} {shown(given)}" if isinstance(given, str | int | float) else type(given).__name__
        )
        raise RequestError(f"{what}: expected {_article(wanted)}, got {_article(came)}; {cure}")


def _article(name: str) -> str:
    return f"{'an' if name[0] in 'AEIOaeio' else 'a'} {name}"
