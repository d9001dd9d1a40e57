"""Check of u and v under each other's names, by the way made good and by what the thrusters drive."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ....physics.motion import Array
from ....physics.thrusters import push_and_turn
from ...statistics.signals import band_passed
from ..axes import taken_from, track_of
from ..faults import BLOCK, Fault, Kind, Size, blocks_of, size_of
from ..lags import QUICK
from ..record import RATE, STEP, About, Check, Fix, Found, Record, Stretch, thruster_of
from ..response import answers, side_of, trials

_SPEEDS = ("u", "v")


def _examine(records: Sequence[Record]) -> Found:
    """Read u and v under each other's names, and tell it where that explains the log and nothing else does.

    Two records tell: the way made good, if there are positions, and the thrusters, which push ahead and turn the boat
    but do not push it aside. Each may say that the names are right, and then nothing is told.

    Nothing where a log does not have both speeds, or no motion.
    """
    having = [record for record in records if set(_SPEEDS) <= set(record.log.channels) and record.stretches]
    if not having:
        return []
    about = About("exchanged", _SPEEDS)
    way, thrust = _by_way(having), _by_thrust(having)
    u, v = (having[0].log.entries.get(name) for name in _SPEEDS)
    mends = {"u": v, "v": u} if u and v else {}
    fix = Fix("u and v exchanged", taken_from({"u": ("v", 1.0), "v": ("u", 1.0)}))
    said = [size and Fault(Kind.EXCHANGED, _SPEEDS, size, fix=fix, mends=mends).ruled() for size in (way, thrust)]
    if way is None and (thrust is None or (said[1] is None and thrust.share.value > 0.0)):
        return about.untold("too little motion to tell u from v")
    if said[0] is not None and thrust is not None and thrust.share.high < 0.0:
        text = (
            "the way made good asks for u and v to be exchanged, and the thrusters ask for the contrary: another "
            "axis is turned, or the heading is a quarter turn off"
        )
        return about.untold(text)
    told = said[0] if way is not None else said[1]
    return told or about.ok("u is ahead and v to starboard, as named")


def may_be_exchanged(records: Sequence[Record]) -> bool:
    """True when the thrusters are explained better by the exchanged speeds, and no position says that it is not so.

    While that is so, the sign of what a thruster does to surge is not known.
    """
    having = [record for record in records if set(_SPEEDS) <= set(record.log.channels) and record.stretches]
    size = _by_thrust(having) if having and _by_way(having) is None else None
    return size is not None and size.share.value > 0.0


def _by_way(records: Sequence[Record]) -> Size | None:
    """How much exchanged speeds explain of the way made good: nothing where another reading is right; None unknown."""
    track = track_of([record.log for record in records])
    if track is None or not track.certain:
        return None
    exchanged = (track.turn, track.side, track.quarters) == (1, -1, 1)
    none = replace(track.size.share, value=0.0, error=0.0)
    return track.size if exchanged else Size(none, none)


def _by_thrust(records: Sequence[Record]) -> Size | None:
    """How much exchanged speeds explain of the answer to the thrusters; None where these do not tell."""
    told = answers(records)
    names = [name for name in told if _pushes_ahead(records, name)]
    if len(names) < len(told) or not any(told[name].turn for name in names):
        return None
    lag = round(next(one.best.seconds for one in trials(records) if names[0] in one.best.answers) / STEP)
    turn = np.array([told[name].yaw for name in names])
    named, exchanged = [], []
    for record in records:
        if not set(names) <= set(record.commands):
            continue
        columns = [record.commands.index(name) for name in names]
        for stretch in record.stretches:
            if stretch.motion.time.size > BLOCK * RATE + abs(lag):
                named.append(_tables(stretch, columns, lag, False))
                exchanged.append(_tables(stretch, columns, lag, True))
    if not named:
        return None
    block = blocks_of([part[0].size for part in named])
    (left, power), (other, _) = _residual_squares(named, turn), _residual_squares(exchanged, turn)
    return size_of(left, other, power, block)


def _pushes_ahead(records: Sequence[Record], name: str) -> bool:
    """True when a thruster is known to push along the hull: one that pushes aside drives sway itself."""
    own = thruster_of(records, name)
    return bool(side_of(name) if own is None else push_and_turn(own)[0])


def _tables(stretch: Stretch, columns: Sequence[int], lag: int, exchange: bool) -> tuple[Array, ...]:
    """Changes of surge and sway, commands, and what else moves surge, and sway, in the band (n, ...)."""
    surge, sway, rate = stretch.motion.velocity.T
    if exchange:
        surge, sway = sway, surge
    commands = stretch.commands[:, columns]
    table = np.column_stack(
        [
            np.gradient(surge, STEP),
            np.gradient(sway, STEP),
            *(surge, surge * np.abs(surge), sway * rate),
            *(sway, sway * np.abs(sway), rate, np.abs(surge) * rate, surge * rate),
        ]
    )
    rows = slice(max(lag, 0), table.shape[0] + min(lag, 0))
    moved = commands[max(-lag, 0) : commands.shape[0] - max(lag, 0)]
    table = band_passed(np.column_stack([table[rows], moved]), STEP, QUICK)
    return table[:, 0], table[:, 1], table[:, 10:], table[:, 2:5], table[:, 5:10]


def _residual_squares(parts: Sequence[tuple[Array, ...]], turn: Array) -> tuple[Array, Array]:
    """Squared error of the equations of surge and sway, and the power of their changes, (n,) each [m^2/s^4].

    The thrusters push the hull along, each by itself; they move it aside only by turning it.
    """
    surge, sway, commands, ahead, aside = (np.concatenate([part[k] for part in parts]) for k in range(5))
    left = np.zeros(surge.size)
    for changes, columns in ((surge, [commands, ahead]), (sway, [commands @ turn, aside])):
        table = np.column_stack(columns)
        left += (changes - table @ np.linalg.lstsq(table, changes, rcond=None)[0]) ** 2
    return left, surge**2 + sway**2


EXCHANGED = Check("exchanged", _examine)
