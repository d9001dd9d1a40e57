"""Kinds of faults of parts 2 and 4: times, tables, files, and what a log has beside motion and commands.

Kinds that touch how a text is written are of CSV logs alone; the others of every table.
"""

import gzip
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.io import savemat

from .kind import Bullet, Kind, Sound, Spoil, Spoilt, renamed

_START = pd.Timestamp("2026-05-01T21:59:30.25Z")
"""Before midnight in Central Europe, so that times of day begin anew in every log."""


_NOTHING = "(?!)"
"""Words that nothing holds: nothing is wrong, so that the log must be read right."""


def _is_text(sound: Sound) -> bool:
    return sound.free and "CSV" in sound.name


def _is_wide_text(sound: Sound) -> bool:
    return _is_text(sound) and "long" not in sound.name


# Time columns


def _time(name: str, values: Callable[[pd.Series], pd.Series]) -> Spoil:
    """Another time column in the place of `t`, in every table."""

    def spoil(sound: Sound, folder: Path, rng: np.random.Generator) -> Spoilt | None:
        if not sound.free:
            return None
        path = sound.written(folder).log
        table = read_table(path)
        first = str(table.columns[0])
        own = pd.to_numeric(table[first]) / (1e9 if first.endswith("_ns") else 1.0)
        table = table.rename(columns={first: name})
        table[name] = values(own)
        return Spoilt(write_table(table, path))

    return spoil


def _named(name: str, lines: str = "") -> Spoil:
    """The time in seconds under another name, perhaps with a map."""
    spoil = _time(name, lambda t: t)

    def mapped(sound: Sound, folder: Path, rng: np.random.Generator) -> Spoilt | None:
        found = spoil(sound, folder, rng)
        return found.mapped(lines) if found is not None and lines else found

    return mapped


def _whole(scale: float, since: bool = False) -> Callable[[pd.Series], pd.Series]:
    """Whole numbers of another unit, from the log's start or since 1970."""

    def values(t: pd.Series) -> pd.Series:
        begin = int(_START.timestamp()) if since else 0
        return (np.rint(scale * t)).astype("int64") + int(begin * scale)

    return values


def _instants(form: str, zone: str = "UTC") -> Callable[[pd.Series], pd.Series]:
    def values(t: pd.Series) -> pd.Series:
        instants = (_START + pd.to_timedelta(t, unit="s")).dt.tz_convert(zone)
        return instants.dt.strftime(form)

    return values


def _date_and_time(date: str, time: str) -> Spoil:
    def spoil(sound: Sound, folder: Path, rng: np.random.Generator) -> Spoilt | None:
        if not sound.free:
            return None
        found = _time("Time", lambda t: t)(sound, folder, rng)
        assert found is not None
        table = read_table(found.log)
        seconds = pd.to_numeric(table["Time"])
        table["Time"] = _instants(time)(seconds)
        table.insert(0, "Date", _instants(date)(seconds))
        return Spoilt(write_table(table, found.log))

    return spoil


def read_table(path: Path) -> pd.DataFrame:
    """A table as it is written."""
    return pd.read_parquet(path) if path.suffix == ".parquet" else pd.read_csv(path)


def write_table(table: pd.DataFrame, path: Path) -> Path:
    """Write a table as its ending says."""
    table.to_parquet(path) if path.suffix == ".parquet" else table.to_csv(path, index=False)
    return path


TIMES = (
    ("__time", _named("__time"), "time"),
    ("%time in ns since 1970", _time("%time", _whole(1e9, True)), "time"),
    ("timestamp in s", _named("timestamp"), "time"),
    ("timestamp in ms since 1970", _time("timestamp", _whole(1e3, True)), "time"),
    ("Time (s)", _named("Time (s)"), "time"),
    ("elapsed [us]", _time("elapsed [us]", _whole(1e6)), "time"),
    ("time in ms, said nowhere", _time("time", _whole(1e3)), "unit: ms|scale: 0.001|seconds"),
    ("time in us, said nowhere", _time("time", _whole(1e6)), "unit: us|scale: 1e-06|seconds"),
    ("a name of its own", _named("clk"), "time: clk"),
    ("a name of its own, mapped", _named("clk", "time: clk\n"), "time"),
    ("ISO 8601 with Z", _time("time", _instants("%Y-%m-%dT%H:%M:%S.%fZ")), "ISO 8601"),
    ("ISO 8601 with a zone", _time("timestamp", _instants("%Y-%m-%d %H:%M:%S.%f%z", "Europe/Berlin")), "ISO 8601"),
    ("Date and Time", _date_and_time("%Y-%m-%d", "%H:%M:%S.%f"), "ISO 8601"),
    ("Date and Time with points", _date_and_time("%d.%m.%Y", "%H:%M:%S.%f"), "ISO 8601"),
    ("the time of the day, over midnight", _time("time", _instants("%H:%M:%S.%f", "Europe/Berlin")), "ISO 8601"),
)


# Tables of other shapes


def _text(write: Callable[[pd.DataFrame, Path], None], wide: bool = True, lines: str = "") -> Spoil:
    """A table written in another way."""

    def spoil(sound: Sound, folder: Path, rng: np.random.Generator) -> Spoilt | None:
        if not (_is_wide_text(sound) if wide else _is_text(sound)):
            return None
        path = sound.written(folder).log
        table = read_table(path)
        write(table, path)
        if not lines:
            return Spoilt(path)
        numbers = {str(name): k for k, name in enumerate(table.columns, 1)}
        names = "".join(f"{'time' if name == 't' else name}: {k}\n" for name, k in numbers.items())
        return Spoilt(path).mapped(names if lines == "by number" else lines)

    return spoil


def _decimal_comma(separator: str) -> Callable[[pd.DataFrame, Path], None]:
    return lambda table, path: table.to_csv(path, index=False, sep=separator, decimal=",")


def _quoted(table: pd.DataFrame, path: Path) -> None:
    """Commands whose names hold the separator, in quotes."""
    rows = table.rename(columns={name: f"command, {name}" for name in table.columns if "newton_" in str(name)})
    rows.to_csv(path, index=False)


def _blanks(table: pd.DataFrame, path: Path) -> None:
    path.write_text(table.to_string(index=False, float_format=lambda x: f"{x:.9g}"))


def _savetxt(table: pd.DataFrame, path: Path) -> None:
    np.savetxt(path, table.to_numpy(), header=" ".join(map(str, table.columns)))


def _nameless(table: pd.DataFrame, path: Path) -> None:
    table.to_csv(path, index=False, header=False)


def _matrix(ending: str, mapped: bool) -> Spoil:
    """A matrix without names, of MATLAB or NumPy."""

    def spoil(sound: Sound, folder: Path, rng: np.random.Generator) -> Spoilt | None:
        if not _is_wide_text(sound):
            return None
        path = folder / f"log{ending}"
        matrix = sound.table.to_numpy(float)
        savemat(path, {"xout": matrix}) if ending == ".mat" else np.save(path, matrix)
        names = ["time" if name == "t" else name for name in sound.table.columns]
        lines = "".join(f"{name}: {k}\n" for k, name in enumerate(names, 1))
        return Spoilt(path).mapped(lines) if mapped else Spoilt(path)

    return spoil


TABLES = (
    ("decimal commas and semicolons", _text(_decimal_comma(";"), wide=False), "decimal"),
    ("decimal commas and tabs", _text(_decimal_comma("\t"), wide=False), "decimal"),
    (
        "names that hold the separator",
        _text(_quoted, lines="newton_port: 'command, newton_port'\nnewton_stbd: 'command, newton_stbd'\n"),
        "quote",
    ),
    ("columns set apart by blanks", _text(_blanks), "blank"),
    ("a header of numpy.savetxt", _text(_savetxt), "names"),
    ("no names", _text(_nameless), "time: 1"),
    ("no names, mapped by number", _text(_nameless, lines="by number"), "column"),
    ("a matrix of MATLAB", _matrix(".mat", False), "time: 1"),
    ("a matrix of MATLAB, mapped by number", _matrix(".mat", True), "column"),
    ("a matrix of NumPy, mapped by number", _matrix(".npy", True), "column"),
)


# Files of other kinds


def _encoded(encoding: str, packed: bool = False) -> Spoil:
    def spoil(sound: Sound, folder: Path, rng: np.random.Generator) -> Spoilt | None:
        if not _is_text(sound):
            return None
        path = sound.written(folder).log
        text = path.read_text().encode(encoding)
        path.write_bytes(gzip.compress(text) if packed else text)
        return Spoilt(path)

    return spoil


def _unicode_text(sound: Sound, folder: Path, rng: np.random.Generator) -> Spoilt | None:
    """Excel's "Unicode text": UTF-16, tabs, and the ends of lines of Windows."""
    if not _is_text(sound):
        return None
    path = sound.written(folder).log
    path.write_bytes(path.read_text().replace(",", "\t").replace("\n", "\r\n").encode("utf-16"))
    return Spoilt(path)


def _pointer(sound: Sound, folder: Path, rng: np.random.Generator) -> Spoilt:
    """What a clone without Git LFS has in the place of the log."""
    path = sound.written(folder).log
    for file in [path] if path.is_file() else [entry for entry in path.iterdir() if entry.suffix != ".yaml"]:
        size, digest = file.stat().st_size, "4d7a214614ab2935c943f9e0ff69d22eadbb8f32b1258daaa5e2ca24d17e2393"
        file.write_text(f"version https://git-lfs.github.com/spec/v1\noid sha256:{digest}\nsize {size}\n")
    return Spoilt(path)


def _torn(sound: Sound, folder: Path, rng: np.random.Generator) -> Spoilt | None:
    """The first three quarters of the file."""
    path = sound.written(folder).log
    if path.is_dir() or path.suffix == ".parquet":
        return None
    content = path.read_bytes()
    path.write_bytes(content[: 3 * len(content) // 4])
    return Spoilt(path)


def _renamed(ending: str) -> Spoil:
    """Another ending than the format has."""

    def spoil(sound: Sound, folder: Path, rng: np.random.Generator) -> Spoilt | None:
        path = sound.written(folder).log
        return None if path.is_dir() else Spoilt(path.rename(folder / f"renamed{ending}"))

    return spoil


FILES = (
    ("UTF-16", _unicode_text, "UTF-16"),
    ("UTF-8 with a mark", _encoded("utf-8-sig"), "UTF-8"),
    ("packed, though its name does not say so", _encoded("utf-8", packed=True), "gzip"),
    ("a Git LFS pointer", _pointer, "Git LFS pointer"),
    ("cut off", _torn, "breaks off|cut"),
    ("another ending", _renamed(".dat"), "format"),
)


# Steering outputs and power


def _beside(**columns: Callable[[pd.DataFrame, np.random.Generator], np.ndarray]) -> Spoil:
    """Columns beside those of the log, under names as people have them."""

    def spoil(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
        return table.assign(**{name: values(table, rng) for name, values in columns.items()})

    return renamed(spoil)


def _swinging(table: pd.DataFrame, rng: np.random.Generator) -> np.ndarray:
    return 0.3 * np.sin(0.2 * table["t"].to_numpy()) + 0.01 * rng.standard_normal(len(table))


def _voltage(table: pd.DataFrame, rng: np.random.Generator) -> np.ndarray:
    return np.round(16.4 - 0.002 * table["t"].to_numpy(), 1)


def _current(table: pd.DataFrame, rng: np.random.Generator) -> np.ndarray:
    return 2.0 + rng.random(len(table))


def _mode(table: pd.DataFrame, rng: np.random.Generator) -> np.ndarray:
    return np.where(table["t"].to_numpy() < 20.0, 0, 10)


def _revolutions(table: pd.DataFrame, rng: np.random.Generator) -> np.ndarray:
    return 900.0 + 300.0 * np.sin(0.1 * table["t"].to_numpy())


STEERING = (
    ("an outboard's steering beside the thrusters", _beside(outboard_steering=_swinging), "steer"),
    ("the azimuth of an actuator", _beside(thruster_azimuth_angle=_swinging), "azimuth|steer"),
    ("a satellite's azimuth", _beside(gps_satellite_azimuth=_swinging, satellite_elevation=_swinging), _NOTHING),
    ("battery voltage and current", _beside(battery_voltage=_voltage, battery_current=_current), _NOTHING),
    ("a mode", _beside(mode=_mode, waypoint=_mode), _NOTHING),
    ("revolutions beside commands", _beside(rpm_port=_revolutions, rpm_stbd=_revolutions), _NOTHING),
)

KINDS: tuple[Kind, ...] = tuple(
    Kind(name, bullet, spoil, expect)
    for bullet, kinds in (
        (Bullet.TIMES, TIMES),
        (Bullet.TABLES, TABLES),
        (Bullet.FILES, FILES),
        (Bullet.STEERING, STEERING),
    )
    for name, spoil, expect in kinds
)
"""All kinds of parts 2 and 4."""
