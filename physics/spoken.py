"""How a remedy is said: as the option that somebody types, or as the argument that somebody gives in Python.

Messages are written with options, and in one place made arguments of Python's functions, where they are read in Python.
"""

import re

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
