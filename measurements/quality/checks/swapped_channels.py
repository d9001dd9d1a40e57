"""Whether surge is surge: u and v under each other's names, by the way made good and by what the thrusters drive."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import ClassVar, final

import numpy as np

from ....physics.frames import Array, body_to_earth
from ....physics.thrusters import push_and_turn, side_named
from ...alignment import band_passed
from ...canonical import Channel, command_kind
from ...statistics.paired import surely_more
from ..finding import Channels, Check, Finding, Fix, Reach
from ..lags import QUICK
from ..record import RATE, Record, Stretch
from ..response import answers, trials

_STEP = 1.0 / RATE
_SPEEDS = ("u", "v")
_WINDOW = 5.0
"""Length of a stretch that counts once [s]: the slowest period in which a boat answers its thrusters."""
_LEAST = 8
"""Stretches that are needed: all of eight agree by chance in 1 of 128 cases."""
_FOLLOWS = 0.5
"""Share of the way that the exchanged speeds must explain: less, and something else is wrong as well."""
_READINGS: dict[str, Callable[[Array, Array], tuple[Array, Array]]] = {
    "as named": lambda u, v: (u, v),
    "exchanged": lambda u, v: (v, u),
    "v turned round": lambda u, v: (u, -v),
    "u turned round": lambda u, v: (-u, v),
    "both turned round": lambda u, v: (-u, -v),
    "a quarter turn to starboard": lambda u, v: (-v, u),
    "a quarter turn to port": lambda u, v: (v, -u),
    "exchanged and turned round": lambda u, v: (-v, -u),
}
"""What u and v may be: every way to lay two axes on two others."""


@final
class Exchanged(Check):
    """Reads u and v under each other's names, and tells it where that explains the log and nothing else does.

    Two records tell: the way made good, if there are positions, and the thrusters, which push ahead and turn the boat
    but do not push it aside. Each may say that the names are right, and then nothing is told.
    """

    name: ClassVar[str] = "exchanged"

    def examine(self, records: Sequence[Record]) -> list[Finding]:
        """See `Check`: nothing where a log does not have both speeds, or no motion."""
        having = [record for record in records if set(_SPEEDS) <= set(record.log.channels) and record.stretches]
        if not having:
            return []
        said = [told for told in (_by_way(having), _surely(_by_thrust(having))) if told is not None]
        if not said:
            text = "too little motion to tell u from v"
            return [Finding(check=self.name, verdict="cannot tell", sentence=text, channels=_SPEEDS)]
        if not any(said):
            return [
                Finding(
                    check=self.name, verdict="ok", sentence="u is ahead and v to starboard, as named", channels=_SPEEDS
                )
            ]
        if not all(said):
            text = (
                "the way made good asks for u and v to be exchanged, and the thrusters ask for the contrary: another "
                "axis is turned, or the heading is a quarter turn off"
            )
            return [Finding(check=self.name, verdict="cannot tell", sentence=text, channels=_SPEEDS)]
        return [
            Finding(
                check=self.name,
                verdict="defect",
                sentence="u and v look exchanged: under each other's names they explain the log, and as they "
                "are they do not",
                channels=_SPEEDS,
                consequence="the boat seems to drive sideways; thrust, drag and sides all come out wrong",
                remedy="exchange them in a channel map (--map)",
                fix=Fix("u and v exchanged", _exchange),
                short="u and v look exchanged",
                reach=Reach.LOG,
            )
        ]


def may_be_exchanged(records: Sequence[Record]) -> bool:
    """Whether the thrusters are explained better by the exchanged speeds, and no position says that it is not so.

    While that is so, the sign of what a thruster does to surge is not known.
    """
    having = [record for record in records if set(_SPEEDS) <= set(record.log.channels) and record.stretches]
    left = _by_thrust(having) if having else None
    return left is not None and left[0].sum() > left[1].sum() and _by_way(having) is not False


def _surely(left: tuple[Array, Array] | None) -> bool | None:
    if left is None:
        return None
    if surely_more(*left):
        return True
    return False if left[0].sum() < left[1].sum() else None


def _by_way(records: Sequence[Record]) -> bool | None:
    """Whether only the exchanged speeds explain the way made good; None where no position tells."""
    parts: dict[str, list[Array]] = {name: [] for name in _READINGS}
    whole: list[Array] = []
    for record in records:
        if not {"x", "y", "psi"} <= set(record.log.channels):
            continue
        for stretch in record.stretches:
            motion, rows = stretch.motion, round(_WINDOW / _STEP)
            count = motion.time.size // rows
            if count < 2:
                continue
            edges = np.arange(count + 1) * rows
            edges[-1] -= edges[-1] == motion.time.size
            way = np.diff(motion.position[edges], axis=0)
            whole.append((way**2).sum(axis=1))
            for name, read in _READINGS.items():
                earth = np.column_stack(body_to_earth(motion.heading, *read(*motion.velocity[:, :2].T)))
                total = np.concatenate([np.zeros((1, 2)), np.cumsum(0.5 * _STEP * (earth[1:] + earth[:-1]), axis=0)])
                made = np.diff(total[edges], axis=0)
                # Speeds may be in knots or through the water: their size, and a current, are not asked here.
                size = float((way * made).sum() / max((made**2).sum(), 1e-300))
                rest = way - max(size, 0.0) * made
                parts[name].append(((rest - np.median(rest, axis=0)) ** 2).sum(axis=1))
    if sum(part.size for part in whole) < _LEAST:
        return None
    left = {name: np.concatenate(found) for name, found in parts.items()}
    best = min(left, key=lambda name: float(left[name].sum()))
    if best == "as named":
        return False
    sure = all(surely_more(other, left[best]) for name, other in left.items() if name != best)
    explains = left[best].sum() < (1.0 - _FOLLOWS) * np.concatenate(whole).sum()
    return True if best == "exchanged" and sure and explains else None


def _by_thrust(records: Sequence[Record]) -> tuple[Array, Array] | None:
    """What the speeds as named, and exchanged, leave of the answer to the thrusters; None where these do not tell."""
    told = answers(records)
    names = [name for name in told if _pushes_ahead(records, name)]
    if len(names) < len(told) or not any(told[name].turn for name in names):
        return None
    lag = round(next(one.best.seconds for one in trials(records) if names[0] in one.best.answers) / _STEP)
    turn = np.array([told[name].yaw for name in names])
    named, exchanged = [], []
    for record in records:
        if not set(names) <= set(record.commands):
            continue
        columns = [record.commands.index(name) for name in names]
        for stretch in record.stretches:
            if stretch.motion.time.size > 2 * round(_WINDOW / _STEP) + abs(lag):
                named.append(_tables(stretch, columns, lag, False))
                exchanged.append(_tables(stretch, columns, lag, True))
    if not named:
        return None
    left, other = _explained(named, turn), _explained(exchanged, turn)
    return (left, other) if left.size >= _LEAST else None


def _pushes_ahead(records: Sequence[Record], name: str) -> bool:
    """Whether a thruster is known to push along the hull: one that pushes aside drives sway itself."""
    own = [t for record in records if record.vehicle for t in record.vehicle.thrusters if t.channel == name]
    return bool(push_and_turn(own[0])[0]) if own else bool(side_named((command_kind(name) or ("", name))[1]))


def _tables(stretch: Stretch, columns: Sequence[int], lag: int, exchange: bool) -> tuple[Array, ...]:
    """Changes of surge and sway, commands, and what else moves surge, and sway, in the band (n, ...)."""
    surge, sway, rate = stretch.motion.velocity.T
    if exchange:
        surge, sway = sway, surge
    commands = stretch.commands[:, columns]
    table = np.column_stack(
        [
            np.gradient(surge, _STEP),
            np.gradient(sway, _STEP),
            *(surge, surge * np.abs(surge), sway * rate),
            *(sway, sway * np.abs(sway), rate, np.abs(surge) * rate, surge * rate),
        ]
    )
    rows = slice(max(lag, 0), table.shape[0] + min(lag, 0))
    moved = commands[max(-lag, 0) : commands.shape[0] - max(lag, 0)]
    table = band_passed(np.column_stack([table[rows], moved]), _STEP, QUICK)
    return table[:, 0], table[:, 1], table[:, 10:], table[:, 2:5], table[:, 5:10]


def _explained(parts: Sequence[tuple[Array, ...]], turn: Array) -> Array:
    """What the equation of surge leaves of its changes, and that of sway of its own, in each stretch [m^2/s^4].

    The thrusters push the hull along, each by itself; they move it aside only by turning it.
    """
    surge, sway, commands, ahead, aside = (np.concatenate([part[k] for part in parts]) for k in range(5))
    count = round(_WINDOW / _STEP)
    number = np.concatenate([np.arange(part[0].size) // count for part in parts])
    begun = np.cumsum([0, *(part[0].size // count + 1 for part in parts[:-1])])
    number = number + np.repeat(begun, [part[0].size for part in parts])
    left = np.zeros(int(number.max()) + 1)
    for changes, columns in ((surge, [commands, ahead]), (sway, [commands @ turn, aside])):
        table = np.column_stack(columns)
        rest = changes - table @ np.linalg.lstsq(table, changes, rcond=None)[0]
        left += np.bincount(number, rest**2, left.size)
    return left[np.bincount(number, minlength=left.size) >= count // 2]


def _exchange(channels: Channels) -> dict[str, Channel]:
    u, v = channels["u"], channels["v"]
    return dict(channels) | {"u": replace(v, name="u"), "v": replace(u, name="v")}
