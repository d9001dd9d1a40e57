"""Ways of spoiling a good log: what is done to its table, and which check must say so."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from undertow.physics.motion import Array

Plant = Callable[[pd.DataFrame, np.random.Generator], pd.DataFrame]
PLACE, SPEED = ["x", "y"], ["u", "v"]
KNOTS = 1.94384


@dataclass(frozen=True, slots=True)
class Spoil:
    """A way of spoiling a log.

    Attributes
    ----------
    name : for the table
    plant : makes the spoilt table of a sound one, a row per stamp
    causes : (check, words of its sentence) of the findings that tell the cause, one of which must be made; none for a
        log that is still sound
    """

    name: str
    plant: Plant
    causes: tuple[tuple[str, str], ...] = ()


def commands(table: pd.DataFrame) -> list[str]:
    """The columns of commands, port first."""
    return sorted(name for name in table.columns if name.startswith(("newton_", "pwm_")))


def _changed(**rules: Callable[[Array], Array]) -> Plant:
    def plant(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
        return table.assign(**{name: rule(table[name].to_numpy(float)) for name, rule in rules.items()})

    return plant


def _with(change: Callable[[pd.DataFrame, np.random.Generator], None]) -> Plant:
    """A change made in place, on a copy."""

    def plant(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
        found = table.copy()
        change(found, rng)
        return found

    return plant


def _middle(table: pd.DataFrame) -> int:
    return len(table) // 2


def _frozen(table: pd.DataFrame, names: list[str], first: int) -> None:
    for name in names:
        table.loc[first:, name] = table[name].iloc[first]


def _busy(table: pd.DataFrame, name: str) -> int:
    """A row in the first half at which a command is away from its neutral."""
    value = table[name].to_numpy(float)
    off = np.abs(value - value[0]) > 0.3 * np.abs(value - value[0]).max()
    rows = np.flatnonzero(off[: _middle(table)])
    return int(rows[rows.size // 2]) if rows.size else 0


def _clock_set(by: float) -> Plant:
    def change(table: pd.DataFrame, rng: np.random.Generator) -> None:
        table.loc[_middle(table) :, "t"] += by

    return _with(change)


def _stray(value: float) -> Plant:
    def change(table: pd.DataFrame, rng: np.random.Generator) -> None:
        table.loc[int(rng.integers(100, len(table) - 100)), "t"] = value

    return _with(change)


def _milliseconds(table: pd.DataFrame, rng: np.random.Generator) -> None:
    table.loc[_middle(table) :, "t"] *= 1000.0


def _port_frozen(table: pd.DataFrame, rng: np.random.Generator) -> None:
    _frozen(table, commands(table)[:1], _busy(table, commands(table)[0]))


def _port_constant(table: pd.DataFrame, rng: np.random.Generator) -> None:
    name = commands(table)[0]
    table[name] = table[name].iloc[_busy(table, name)]


def _both_frozen(table: pd.DataFrame, rng: np.random.Generator) -> None:
    _frozen(table, commands(table), _busy(table, commands(table)[0]))


def _both_constant(table: pd.DataFrame, rng: np.random.Generator) -> None:
    for name in commands(table):
        table[name] = table[name].iloc[_busy(table, name)]


def _exchanged(first: str, second: str) -> Plant:
    def plant(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
        return table.assign(**{first: table[second], second: table[first]})

    return plant


def _sides(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    return _exchanged(*commands(table)[:2])(table, rng)


def _turned(names: int) -> Plant:
    def change(table: pd.DataFrame, rng: np.random.Generator) -> None:
        for name in commands(table)[:names]:
            table[name] = (3000.0 if name.startswith("pwm") else 0.0) - table[name]

    return _with(change)


def _late(names: Callable[[pd.DataFrame], list[str]], seconds: float) -> Plant:
    def change(table: pd.DataFrame, rng: np.random.Generator) -> None:
        t = table["t"].to_numpy()
        rows = np.clip(np.searchsorted(t, t - seconds, "right") - 1, 0, None)
        for name in names(table):
            table[name] = table[name].to_numpy()[rows]

    return _with(change)


def _foreign(table: pd.DataFrame, rng: np.random.Generator) -> None:
    """Commands of another run: the blocks of 15 s of this one in another order."""
    blocks = np.array_split(np.arange(len(table)), max(4, int(np.ptp(table["t"]) / 15.0)))
    order = np.concatenate([blocks[k] for k in np.roll(rng.permutation(len(blocks)), 1)])
    for name in commands(table):
        table[name] = table[name].to_numpy()[order]


def _dropouts(table: pd.DataFrame, rng: np.random.Generator) -> None:
    t = table["t"].to_numpy()
    for start in rng.uniform(20.0, t[-1] - 20.0, 6):
        rows = np.flatnonzero((t >= start) & (t < start + rng.uniform(3.0, 8.0)))
        table.loc[rows, PLACE] = table.loc[rows[0], PLACE].to_numpy()


def _spikes(names: list[str]) -> Plant:
    def change(table: pd.DataFrame, rng: np.random.Generator) -> None:
        for name in names:
            rows = rng.choice(len(table), max(8, len(table) // 100), replace=False)
            table.loc[rows, name] += rng.choice([-1.0, 1.0], rows.size) * 5.0 * table[name].abs().max()

    return _with(change)


def _wrapped(table: pd.DataFrame, rng: np.random.Generator) -> None:
    """Positions in a counter that is too short: they jump by its range."""
    size = 0.4 * float(np.ptp(table["x"]))
    table["x"] = (table["x"] + 0.5 * size) % size - 0.5 * size


def _twice(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    again = rng.choice(len(table), len(table) // 10, replace=False)
    return table.iloc[np.sort(np.concatenate([np.arange(len(table)), again]))].reset_index(drop=True)


def _disordered(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    order = np.argsort(np.arange(len(table)) + rng.uniform(0.0, 5.0, len(table)))
    return table.iloc[order].reset_index(drop=True)


def _hole(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    n = len(table)
    return table.drop(table.index[n // 4 : 3 * n // 4]).reset_index(drop=True)


def _concatenated(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """The second half as a log of its own, that begins at zero again, behind the first."""
    k = _middle(table)
    second = table.iloc[k:].assign(t=table["t"].iloc[k:] - table["t"].iloc[k])
    return pd.concat([table.iloc[:k], second], ignore_index=True)


def _clipped(table: pd.DataFrame, rng: np.random.Generator) -> None:
    for name in commands(table):
        middle = 1500.0 if name.startswith("pwm") else 0.0
        off = table[name] - middle
        table[name] = middle + off.clip(-0.35 * off.abs().max(), 0.35 * off.abs().max())


def _coarse(table: pd.DataFrame, rng: np.random.Generator) -> None:
    for name in commands(table):
        step = float(np.ptp(table[name])) / 30.0
        table[name] = (table[name] / step).round() * step


def _resampled(held: bool) -> Plant:
    def plant(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
        t = table["t"].to_numpy()
        grid = np.arange(t[0], t[-1], 0.005)
        row = np.clip(np.searchsorted(t, grid, "right") - 1, 0, None)
        found = {"t": grid}
        for name in table.columns[1:]:
            value = table[name].to_numpy(float)
            value = np.unwrap(value) if name == "psi" else value
            found[name] = value[row] if held else np.interp(grid, t, value)
        return pd.DataFrame(found)

    return plant


def _slower(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    return table.iloc[::2].reset_index(drop=True)


def _without(*names: str, then: Plant | None = None) -> Plant:
    def plant(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
        found = table.drop(columns=list(names))
        return found if then is None else then(found, rng)

    return plant


def _enu(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    return table.assign(x=table["y"], y=table["x"], psi=0.5 * np.pi - table["psi"], v=-table["v"], r=-table["r"])


def _zero(values: Array) -> Array:
    return 0.0 * values


SOUND = (
    Spoil("untouched", lambda table, rng: table),
    Spoil("interpolated to 200 Hz", _resampled(False)),
    Spoil("held to 200 Hz", _resampled(True)),
    Spoil("every second row", _slower),
    Spoil("commands rounded to a thirtieth", _with(_coarse)),
    Spoil("without speeds", _without("u", "v")),
    Spoil("without positions", _without("x", "y")),
)
"""What may be done to a log without making it wrong."""

SPOILS = (
    Spoil("clock set forward by 1.7e9 s", _clock_set(1.7e9), (("stamps", "set"),)),
    Spoil("clock set back by 50 s", _clock_set(-50.0), (("stamps", "set back"),)),
    Spoil("one stamp of 1.7e9 s", _stray(1.7e9), (("stamps", "astray"),)),
    Spoil("one stamp of -3 s", _stray(-3.0), (("stamps", "astray"), ("stamps", "backwards"))),
    Spoil("milliseconds from the middle", _with(_milliseconds), (("stamps", "fast"), ("stamps", "set"))),
    Spoil("time in tenths", _changed(t=lambda t: 10.0 * t), (("time unit", "stamps"),)),
    Spoil("port command frozen", _with(_port_frozen), (("drive", "port"),)),
    Spoil("port command constant", _with(_port_constant), (("drive", "port"),)),
    Spoil("both commands frozen", _with(_both_frozen), (("drive", ""),)),
    Spoil("both commands constant", _with(_both_constant), (("drive", ""),)),
    Spoil("sway 0", _changed(v=_zero), (("stuck", "v "),)),
    Spoil("speeds 0", _changed(u=_zero, v=_zero), (("stuck", "u"),)),
    Spoil("x and y exchanged", _exchanged("x", "y"), (("units", "x and y"),)),
    Spoil("u and v exchanged", _exchanged("u", "v"), (("units", "u and v"), ("exchanged", "u and v"))),
    Spoil("sway reversed", _changed(v=np.negative), (("units", "v "),)),
    Spoil("y reversed", _changed(y=np.negative), (("units", "y "),)),
    Spoil("speeds in knots", _changed(u=lambda u: KNOTS * u, v=lambda v: KNOTS * v), (("units", "knots"),)),
    Spoil(
        "knots without positions",
        _without("x", "y", then=_changed(u=lambda u: KNOTS * u, v=lambda v: KNOTS * v)),
        (("units", "knots"), ("units", "once")),
    ),
    Spoil("psi in degrees", _changed(psi=np.degrees), (("units", "psi is in degrees"),)),
    Spoil("r in deg/s", _changed(r=np.degrees), (("units", "degrees per second"),)),
    Spoil("heading reversed", _changed(psi=np.negative), (("units", "opposite"),)),
    Spoil("heading off by 90 degrees", _changed(psi=lambda psi: psi + 0.5 * np.pi), (("units", "90"),)),
    Spoil("ENU taken for NED", _enu, (("sides", "enu"), ("sides", "swapped"))),
    Spoil("gyro 0.8", _changed(r=lambda r: 0.8 * r), (("units", "r "),)),
    Spoil("commands 1 s late", _late(commands, 1.0), (("clocks", "command"), ("clocks", "lead"))),
    Spoil("port reversed", _turned(1), (("direction", "port"),)),
    Spoil("both reversed about neutral", _turned(2), (("direction", ""),)),
    Spoil("sides exchanged", _sides, (("sides", "swapped"),)),
    Spoil("commands of another run", _with(_foreign), (("drive", "another"),)),
    Spoil("speeds 0.5 s late", _late(lambda table: SPEED, 0.5), (("clocks", "u"), ("clocks", "speed"))),
    Spoil("positions held in dropouts", _with(_dropouts), (("stuck", "x and y"),)),
    Spoil("spikes in the speeds", _spikes(["u", "v", "r"]), (("spikes", "u"),)),
    Spoil("spikes in the positions", _spikes(["x", "y"]), (("spikes", "x"),)),
    Spoil("positions wrapped", _with(_wrapped), (("spikes", "x"),)),
    Spoil("rows twice", _twice, (("stamps", "repeat"),)),
    Spoil("rows out of order", _disordered, (("stamps", "backwards"),)),
    Spoil("half the log missing", _hole, (("gaps", "gap"),)),
    Spoil("two logs in one", _concatenated, (("stamps", "set back"),)),
    Spoil("commands clipped", _with(_clipped), (("limited", "cut at a limit"),)),
)
"""Ways of making it wrong."""
