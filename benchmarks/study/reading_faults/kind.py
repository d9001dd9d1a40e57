"""One kind of fault in a log: how a sound log is spoilt, and the words that must tell the cause.

A sound log is a table of canonical channels and a writer of one format. A kind spoils the table, the file, or both.
What undertow makes of it is either read right, which the driver judges by the table, or must be told by `expect`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

import numpy as np
import pandas as pd

from undertow.physics.vehicle import Vehicle


class Bullet(Enum):
    """The bullets of "Logs as people have them" (parts 1 to 4), a line of the report each."""

    OWN = "fields of other things"
    FRAMES = "frames"
    VALUES = "values"
    MIXES = "mixes of commands"
    TIMES = "time columns"
    TABLES = "tables of other shapes"
    FILES = "files of other kinds"
    STEERING = "steering outputs and power"


@dataclass(frozen=True, slots=True, eq=False)
class Sound:
    """A sound log, before it is written.

    Attributes
    ----------
    name : of its format, such as "wide CSV"
    vehicle : whose log it is; its commands are columns of the table
    table : `t` [s] and canonical channels, NED/FRD and SI, a row per stamp: what a right reading gives again
    free : whether a column of any name goes into the file under that name (tables); DataFlash and ULog have fields of
        their own
    write : writes a table into a folder and gives the log
    """

    name: str
    vehicle: Vehicle
    table: pd.DataFrame
    free: bool
    write: Callable[[pd.DataFrame, Path], Path]

    def written(self, folder: Path, table: pd.DataFrame | None = None) -> "Spoilt":
        """Write a table, or the sound one, as the log of a case."""
        return Spoilt(self.write(self.table if table is None else table, folder))

    @property
    def commands(self) -> list[str]:
        """The columns of commands, port first."""
        return [thruster.channel for thruster in self.vehicle.thrusters if thruster.channel in self.table]


@dataclass(frozen=True, slots=True)
class Spoilt:
    """A spoilt log: its file, and a channel map beside it where its owner has one."""

    log: Path
    channel_map: Path | None = None

    def mapped(self, text: str) -> "Spoilt":
        """The same with a channel map of this text."""
        path = self.log.with_name("map.yaml")
        path.write_text(text)
        return replace(self, channel_map=path)


Spoil = Callable[[Sound, Path, np.random.Generator], Spoilt | None]
"""Write the spoilt log into a folder; None where the fault cannot be in a log of this format."""


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of fault.

    Attributes
    ----------
    name : for the report
    bullet : to which it belongs
    spoil : see `Spoil`
    expect : regular expression (letters of any case) of the right cause, sought in the refusal, in the findings of
        `inspect` and in the notes of the log
    """

    name: str
    bullet: Bullet
    spoil: Spoil
    expect: str


def changed(change: Callable[[pd.DataFrame, np.random.Generator], pd.DataFrame]) -> Spoil:
    """A fault of the table alone, whatever the format."""
    return lambda sound, folder, rng: sound.written(folder, change(sound.table.copy(), rng))


def renamed(change: Callable[[pd.DataFrame, np.random.Generator], pd.DataFrame]) -> Spoil:
    """A fault of the table that needs columns of names of their own."""
    return lambda sound, folder, rng: sound.written(folder, change(sound.table.copy(), rng)) if sound.free else None
