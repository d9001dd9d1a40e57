"""Where the numbers of a vehicle came from, kept true when some of them are identified anew."""

import re
from collections.abc import Mapping
from types import MappingProxyType

from .effects import PARAMETERS
from .printable import one_line
from .vehicle import Vehicle

ALL = "all"
"""The entry that speaks of every number for which no other entry does."""
EARLIER = "before: "
"""Before what a source said of a number that was identified since."""
WHOLE = "all of "
"""Before the names of logs of which no part was kept aside: a model was fitted to every row of them."""
NO_MARKS: Mapping[str, str] = MappingProxyType({})
"""Where nothing is known of how sure numbers are."""
_NOT_ALL = re.compile(r"Not of what undertow identified \(see (.*?)\): ")


def with_sources(before: Vehicle, after: Vehicle, how: str, marks: Mapping[str, str] = NO_MARKS) -> Vehicle:
    """The vehicle `after`, its `sources` saying of each number that is not that of `before` how it was found.

    An entry under a symbol is that symbol's; one under a section of the file (`damping`, `thrusters`, ...) keeps what
    it said, since that is still the source of the section's other numbers, and of these before.

    Parameters
    ----------
    how : such as "identified by undertow from log.csv"
    marks : how sure some numbers are, by symbol, such as "likely (85 %)"; it stands beside the symbol
    """
    how = one_line(how)  # it names logs, whose names may be no text that a file can hold
    sources = dict(after.sources)
    sections: dict[str, list[str]] = {}
    for symbol in [s for s in {**before.values, **after.values} if before.value(s) != after.value(s)]:
        section = _section(symbol)
        entry = sources.get(section)
        if symbol in sources:
            sources[symbol] = f"{_marked(how, symbol, marks)}; {EARLIER}{sources[symbol]}"
        elif isinstance(entry, dict):
            earlier = f"; {EARLIER}{entry[symbol]}" if symbol in entry else ""
            sources[section] = {**entry, symbol: _marked(how, symbol, marks) + earlier}
        elif section == symbol:
            sources[symbol] = _marked(how, symbol, marks)
        else:
            sections.setdefault(section, []).append(symbol)
    for section, symbols in sections.items():
        earlier = f"; the others, and these before: {sources[section]}" if section in sources else ""
        named = [f"{symbol} {marks[symbol]}" if symbol in marks else symbol for symbol in symbols]
        sources[section] = f"{', '.join(named)}: {how}{earlier}"
    moved = [key for key, entry in sources.items() if entry != after.sources.get(key)]
    if ALL in sources and moved:
        said = str(sources[ALL])
        marked = _NOT_ALL.match(said)
        see = dict.fromkeys([*(marked[1].split(", ") if marked else ()), *moved])
        sources[ALL] = f"Not of what undertow identified (see {', '.join(see)}): {_NOT_ALL.sub('', said, count=1)}"
    return after.model_copy(update={"sources": sources})


def _marked(how: str, symbol: str, marks: Mapping[str, str]) -> str:
    """How a number was found, after how sure it is."""
    return f"{marks[symbol]}: {how}" if symbol in marks else how


def _section(symbol: str) -> str:
    """The part of the vehicle file in which a symbol stands."""
    if ":" in symbol:
        return "terms"
    section = PARAMETERS[symbol].section if symbol in PARAMETERS else "thrusters"
    return symbol if section == "top" else section
