"""How a package of an extra is installed, from wherever this undertow runs."""

import sys
from pathlib import Path

_HOME = Path(__file__).resolve().parents[1]


def how_to_install(extra: str, home: Path = _HOME) -> str:
    """The command that installs an extra: in a clone, with its versions, that of the clone; else that of the package.

    Parameters
    ----------
    extra : such as "logs"
    home : the package's folder; a clone is known by the pyproject.toml in it

    Examples
    --------
    >>> how_to_install("logs", Path("/usr/lib/python3/undertow"))
    "pip install 'undertow[logs]'"
    """
    if not (home / "pyproject.toml").is_file():
        return f"pip install 'undertow[{extra}]'"
    own = home / ".venv"
    pip = ".venv/bin/pip" if Path(sys.prefix).resolve() == own.resolve() and (own / "bin" / "pip").exists() else "pip"
    pinned = " -c constraints.txt" * (home / "constraints.txt").is_file()
    return f"{pip} install -e '.[{extra}]'{pinned} (in {home})"
