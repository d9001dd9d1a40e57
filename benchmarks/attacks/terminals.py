"""Terminals, languages, homes and working folders that are not as usual."""

import os
import shutil
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from .running import UNDERTOW, powerless, undertow
from .trial import VERBS, Attack, Ground, Job, Trial, contents

Environment = Mapping[str, str | None]
ODD: dict[str, list[Environment]] = {
    "TERM=dumb, NO_COLOR, FORCE_COLOR": [
        {"TERM": "dumb"},
        {"TERM": None},
        {"TERM": "no such terminal"},
        {"NO_COLOR": "1"},
        {"FORCE_COLOR": "1"},
        {"CI": "1", "GITHUB_ACTIONS": "true"},
    ],
    "LANG=C and other languages": [
        {"LANG": "C", "LC_ALL": "C"},
        {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"},
        {"LC_ALL": "xx_XX.nothing"},
        {"PYTHONIOENCODING": "ascii"},
        {"PYTHONIOENCODING": "ascii:strict"},
        {"PYTHONIOENCODING": "latin-1"},
        {"PYTHONIOENCODING": "utf-16"},
    ],
    "20 columns, none, and absurd ones": [
        {"COLUMNS": columns, "LINES": lines}
        for columns, lines in (
            *(("20", "5"), ("1", "1"), ("0", "0"), ("-5", "-5"), ("x", "x"), ("7", "25")),
            *(("100000", "3"), ("9" * 30, "9" * 30), ("", "")),
        )
    ],
    "no HOME, a read-only HOME, no place for temporary files": [
        {"HOME": None, "XDG_CACHE_HOME": None, "XDG_CONFIG_HOME": None},
        {"HOME": "/nonexistent"},
        {"HOME": "/dev/null"},
        {"HOME": "/proc", "MPLCONFIGDIR": "/proc/x", "XDG_CACHE_HOME": "/proc"},
        {"TMPDIR": "/nonexistent"},
        {"PATH": ""},
        {"TZ": "nowhere/at all", "OMP_NUM_THREADS": "many", "PYTHONWARNINGS": "always"},
        {"PYTHONOPTIMIZE": "2"},
        {"PYTHONWARNINGS": "error"},
        {"PYTHONDEVMODE": "1"},
    ],
}
"""Environments by row, each met by the verbs that print most."""
PRINTING = ("inspect", "discover", "compare", "check")
HELP = ((), ("--help",), ("discover", "--help"), ("simulate", "--help"), ("--version",))


def attacks(ground: Ground) -> Iterator[Attack]:
    """The rows: environments, then working folders."""
    for name, environments in ODD.items():
        # The fullest screens meet every environment; the others meet the first one of a row.
        jobs = [_job(ground, verb, odd) for odd in environments for verb in PRINTING]
        jobs += [_job(ground, verb, environments[0]) for verb in VERBS if verb not in PRINTING]
        jobs += [_help(words, odd) for odd in environments for words in HELP[: 2 if len(environments) > 6 else 5]]
        yield Attack("terminals", name, jobs)
    yield Attack("terminals", "a terminal of 20 columns (script)", *_in_terminals(ground))
    yield Attack("terminals", "a working folder that was removed", [_removed(ground, verb) for verb in VERBS])
    yield Attack("terminals", "a working folder that cannot be written", _unwritable(ground))


def _job(ground: Ground, verb: str, odd: Environment) -> Job:
    def job(folder: Path) -> Trial:
        before = ground.laid(folder)
        end = undertow(*VERBS[verb], cwd=folder, env=odd)
        return _named(ground.tried(verb, folder, before, end, (0, 1)), odd)

    return job


def _named(trial: Trial, odd: Environment) -> Trial:
    told = " ".join(f"{name}={value}" if value is not None else f"no {name}" for name, value in odd.items())
    return Trial(f"{told[:120]}: {trial.what}", trial.ended, trial.lost, trial.torn, trial.wrong)


def _help(words: tuple[str, ...], odd: Environment) -> Job:
    def job(folder: Path) -> Trial:
        end = undertow(*words, cwd=folder, env=odd)
        expected = 0 if words else 2  # without a verb the help is what one should have asked for
        wrong = "" if end.code == expected and end.told.strip() else f"exit code {end.code}, not {expected}: {end}"
        return _named(Trial(str(end), (end,), wrong=wrong), odd)

    return job


def _in_terminals(ground: Ground) -> tuple[list[Job], str]:
    """Under `script`, which gives a process a terminal of its own: bars and colours are drawn then."""
    if shutil.which("script") is None:
        return [], "needs the program script"

    def job_of(verb: str, columns: int) -> Job:
        def job(folder: Path) -> Trial:
            before = ground.laid(folder)
            words = " ".join(f"'{word}'" for word in (*UNDERTOW, *VERBS[verb]))
            shell = f"stty cols {columns} rows 5; exec {words}"
            end = undertow("-qec", shell, "/dev/null", cwd=folder, start=("script",), env={"TERM": "xterm-256color"})
            return ground.tried(verb, folder, before, end, (0, 1))

        return job

    return [job_of(verb, columns) for verb in VERBS for columns in (20, 1)], ""


def _removed(ground: Ground, verb: str) -> Job:
    def job(folder: Path) -> Trial:
        place = folder / "gone"
        place.mkdir()
        end = undertow(*VERBS[verb], cwd=folder, before=_leave(place))
        wrong = "" if end.code == 2 and b"undertow: " in end.err else f"exit code {end.code}, not 2: {end}"
        left = contents(folder)
        return Trial(str(end), (end,), wrong=wrong or (f"left over: {sorted(left)}" if left else ""))

    return job


def _leave(place: Path) -> Callable[[], None]:
    def before() -> None:
        os.chdir(place)
        os.rmdir(place)

    return before


def _unwritable(ground: Ground) -> list[Job]:
    def job_of(verb: str) -> Job:
        def job(folder: Path) -> Trial:
            ground.laid(folder)
            (folder / "mine").mkdir()
            folder.chmod(0o555)
            words = [f"mine/{word}" if word.startswith(("out.", "fitted", "added")) else word for word in VERBS[verb]]
            end = undertow(*words, cwd=folder, before=powerless, env={"HOME": str(folder)})
            folder.chmod(0o755)
            wrong = "" if end.code in (0, 1) else f"exit code {end.code}: {end}"
            return Trial(str(end), (end,), wrong=wrong)

        return job

    return [job_of(verb) for verb in ("simulate", "check", "compare", "fit", "add", "explain")]
