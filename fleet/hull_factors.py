"""Factors of hulls: sums over blocks of time that add to those of other logs, and their bytes in a file.

Rows are those of the weak form: columns of the parameters followed against the force that the vehicle leaves. The
products of each block and axis are all that least squares, its sandwich covariance and a block bootstrap ask for; what
sensor noise adds to them is kept too (errors in variables; Carroll et al. 2006, chapter 5).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ..discovery.balance.weak_form import WeakForm, WeakSettings
from ..discovery.candidates.candidate import nuisance_candidates
from ..discovery.candidates.linearisation import Linearisation
from ..discovery.factors import Column, packed, unpacked
from ..measurements.preparation.split import IDLE, active
from ..measurements.statistics.processors import single_threaded
from ..physics.errors import LogError, RequestError
from ..physics.file_records import Record
from ..physics.motion import Array, Motion
from ..physics.vehicle import Vehicle

BLOCK = 10.0
"""Seconds of a block: longer than waves and manoeuvres stay alike, so that blocks err alone; a minute has six."""
MOST_BLOCKS = 128
"""Blocks of a log, beyond which each two become one: enough for a covariance of a dozen parameters."""
NUISANCES = ("current_north", "current_east")
"""What is another in each log, and would be taken for drag: fitted beside the parameters, and not told."""
CURRENT = 0.3
"""Usual speed of the water on each axis [m/s], the deviation of its prior: more is rare where small boats work."""
LEAST_FORCE = 1e-6
"""Force that stands for none [N, N m], so that an axis on which nothing happens has a weight, too."""
LEAST_RATE = 4.5
"""Rate of a log from which its test functions are summed well [Hz]: four rows in half of one, and some jitter. With
three, clean logs gave values 1 to 2 % wrong, with two 10 %, and at 1 Hz anything."""
_HULL = ("X_u", "X_uu", "Y_v", "Y_vv", "N_r", "N_rr")
"""What fouling, damage and loads of a hull change."""
_WEAK = WeakSettings(copies=1)
"""One noisier copy: what noise adds to products is a sum over a whole log."""
_OF_BLOCKS = ("gram", "tests", "begin", "end")
"""Arrays with an entry a block, in the order in which `_Blocks` has them."""


def followed_by_default(vehicle: Vehicle) -> tuple[str, ...]:
    """Damping that the vehicle has, the scale of each thruster, and the mass."""
    damping = (symbol for symbol in _HULL if vehicle.value(symbol))
    return (*damping, *(f"{t.name}_scale" for t in vehicle.thrusters), "mass")


@dataclass(frozen=True, slots=True, eq=False)
class HullFactors:
    """Products of the rows of logs, block by block.

    Attributes
    ----------
    parameters, nuisances : what is followed, and what is fitted beside it in each log
    nominal : (p,) values of the parameters about which the columns were taken
    gram : (blocks, 3, k, k) products of the rows in surge, sway and yaw: parameters, nuisances, and the force that the
        vehicle leaves unexplained [N, N, N m]
    tests : (blocks,) rows of each axis
    begin, end : (blocks,) centre of the first and of the last row of each block, in the log's own time [s]
    log : (blocks,) index of the log that each comes from
    logs : SHA-256 of the bytes of each log
    noise : (logs, 3, k, k) what sensor noise adds to the sum of the products of each log
    start : (logs,) zero of the log's own time [s since 1970]; NaN where the log does not say
    hours : (logs,) in which the boat was driven [h]
    settings : how the rows were made; what is made otherwise does not add
    """

    parameters: tuple[Column, ...]
    nuisances: tuple[Column, ...]
    nominal: Array
    gram: Array
    tests: np.ndarray
    begin: Array
    end: Array
    log: np.ndarray
    logs: tuple[str, ...]
    noise: Array
    start: Array
    hours: Array
    settings: Mapping[str, float | str]

    def __add__(self, other: "HullFactors") -> "HullFactors":
        """The factors of both: logs in the order of their digests, blocks in that of time, whoever comes first.

        Pieces of one log add to that log.

        Raises
        ------
        RequestError
            when rows were made in another way, or the same stretch of a log is in both.
        """
        for what in ("parameters", "nuisances", "settings"):
            if getattr(self, what) != getattr(other, what):
                raise RequestError(
                    f"factors: expected the same {what} in both, got others; make both with one vehicle, and follow "
                    "the same parameters"
                )
        logs = tuple(sorted({*self.logs, *other.logs}))
        place = [np.array([logs.index(digest) for digest in one.logs]) for one in (self, other)]
        noise, hours = np.zeros((len(logs), *self.noise.shape[1:])), np.zeros(len(logs))
        start = np.full(len(logs), np.nan)
        for one, at in zip((self, other), place, strict=True):
            noise[at] += one.noise
            hours[at] += one.hours
            start[at] = np.fmin(start[at], one.start)
        log = np.concatenate([at[one.log] for one, at in zip((self, other), place, strict=True)])
        joined = {name: np.concatenate([getattr(self, name), getattr(other, name)]) for name in _OF_BLOCKS}
        order = np.lexsort((joined["begin"], log))
        log, joined = log[order], {name: column[order] for name, column in joined.items()}
        begin, end = joined["begin"], joined["end"]
        twice = np.flatnonzero((log[1:] == log[:-1]) & (begin[1:] <= end[:-1]))
        if twice.size:
            raise RequestError(
                f"factors: expected each stretch of a log once, got that of {begin[twice[0]]:g} s of the log with "
                f"SHA-256 {logs[log[twice[0]]]} in both; leave one out"
            )
        return replace(self, log=log, logs=logs, noise=noise, start=start, hours=hours, **joined)


@single_threaded
def hull_factors(
    pieces: Iterable[Sequence[Motion]],
    vehicle: Vehicle,
    follow: Sequence[str] = (),
    *,
    digest: str = "",
    start: float = float("nan"),
) -> HullFactors:
    """One pass over a log, a piece at a time: no more than one is in memory.

    Parameters
    ----------
    pieces : gap-free stretches, unfiltered, in the order of time; each piece at least ten seconds
    vehicle : about which the columns are taken
    follow : symbols of the parameters; default: see `followed_by_default`
    digest : SHA-256 of the bytes of the log
    start : zero of the log's own time [s since 1970]

    Raises
    ------
    RequestError
        for an unknown symbol, one in which the force is not linear, or a log in which nobody drives the boat.
    LogError
        for a log that is sampled too seldom.
    """
    symbols = tuple(follow) or followed_by_default(vehicle)
    bent = [s for s in symbols if vehicle.parameter(s).nonlinear or vehicle.parameter(s).grid]
    if bent or len(set(symbols)) < len(symbols):
        raise RequestError(
            f"follow: expected parameters in which the force is linear, each once, got {', '.join(bent or symbols)}; "
            "damping, couplings, masses and scales of thrust are some"
        )
    every = (*symbols, *NUISANCES)
    blocks, noise, seconds = _Blocks(), np.zeros(()), 0.0
    for piece in pieces:
        if (slowest := 1.0 / max(motion.time_step for motion in piece)) < LEAST_RATE:
            raise LogError(
                f"expected motion at {LEAST_RATE:g} Hz or more, got {slowest:.3g} Hz: what a hull does between two "
                "rows is not seen, and its numbers would be wrong by tenths and look sure; record at 10 Hz or more"
            )
        weak = WeakForm(piece, _WEAK)
        on = [active(motion, vehicle) for motion in piece]
        seconds += sum(float(rows.mean()) * m.duration for rows, m in zip(on, piece, strict=True))
        number, begin, _ = weak.reach
        driven = np.zeros(number.size, bool)
        for k, motion in enumerate(piece):
            own = number == k
            centre = (begin[own] + _WEAK.half_width - motion.time[0]) / motion.time_step
            driven[own] = on[k][np.clip(np.round(centre).astype(int), 0, on[k].size - 1)]
        if not driven.any():
            continue
        rows, _ = _rows(weak, vehicle, every, dict.fromkeys(NUISANCES, 0.0), driven)
        # The force is not linear in the current: columns are taken anew about the one that was found.
        rows, added = _rows(weak, vehicle, every, _current(rows, vehicle), driven)
        noise = noise + sum(np.einsum("tai,taj->aij", one, one) for one in added) / max(len(added), 1)
        blocks.add(weak.time[driven], rows)
        weak.forget()
    if not blocks.known:
        raise RequestError(
            f"expected a boat that is driven, got no command for longer than {IDLE:g} s in all of the log; nothing is "
            "learnt from a boat at rest"
        )
    parameters, nuisances = (
        tuple(Column(name=s, unit=vehicle.parameter(s).unit) for s in some) for some in (symbols, NUISANCES)
    )
    return HullFactors(
        parameters,
        nuisances,
        nominal=np.array([vehicle.value(symbol) for symbol in symbols]),
        **blocks.whole(),
        log=np.zeros(len(blocks.known), dtype=int),
        logs=(digest,),
        noise=np.broadcast_to(noise, (3, len(every) + 1, len(every) + 1))[None].copy(),
        start=np.array([start]),
        hours=np.array([seconds / 3600.0]),
        settings=settings_of(vehicle),
    )


def settings_of(vehicle: Vehicle) -> dict[str, float | str]:
    """How rows are made for a vehicle."""
    rows = {name: getattr(_WEAK, name) for name in ("half_width", "stride", "power")}
    return {**rows, "block": BLOCK, "idle": IDLE, "vehicle": vehicle.digest}


def _rows(
    weak: WeakForm, vehicle: Vehicle, symbols: Sequence[str], current: Mapping[str, float], driven: np.ndarray
) -> tuple[Array, Array]:
    """Columns and balance of the tests in which the boat is driven, and what noise adds to them: (.., tests, 3, k).

    Columns are taken about a current, and what it makes of the balance is put back: the last column is what the vehicle
    leaves unexplained without one.
    """
    about = vehicle.with_values(current)
    linear = Linearisation(weak, about, about, nuisance_candidates(about, symbols), ())
    columns = [linear.options[f"calibrated {symbol}"][1].free[0] for symbol in symbols]
    rows = linear.columns[driven][:, :, [*columns, -1]]
    added = linear.noise[:, driven][:, :, :, [*columns, -1]]
    put_back = np.array([current.get(symbol, 0.0) for symbol in symbols])
    for one in (rows, added):
        one[..., -1] += one[..., :-1] @ put_back
    return rows, added


def _current(rows: Array, vehicle: Vehicle) -> dict[str, float]:
    """The current that rows tell of beside all parameters, axes weighted by what the vehicle leaves of them."""
    left = np.maximum((rows[..., -1] ** 2).mean(axis=0), LEAST_FORCE**2)
    normal = np.einsum("tai,taj,a->ij", rows, rows, 1.0 / left)
    held = np.diag(np.append(np.zeros(normal.shape[0] - 1 - len(NUISANCES)), np.full(len(NUISANCES), CURRENT**-2.0)))
    found = np.linalg.lstsq(normal[:-1, :-1] + held, normal[:-1, -1], rcond=1e-9)[0][-len(NUISANCES) :]
    limits = [vehicle.parameter(symbol) for symbol in NUISANCES]
    return {p.symbol: float(np.clip(v, p.lower, p.upper)) for p, v in zip(limits, found, strict=True)}


class _Blocks:
    """Products by block of time, of which there are never many: where they become too many, each two become one."""

    def __init__(self) -> None:
        self._length = BLOCK
        self.known: dict[int, tuple[Array, int, float, float]] = {}

    def add(self, time: Array, rows: Array) -> None:
        """Add rows (n, 3, k), each with its time [s], later than those before."""
        number = (time // self._length).astype(int)
        edges = np.flatnonzero(np.diff(number, prepend=number[0] - 1))
        for first, last in zip(edges, [*edges[1:], number.size], strict=True):
            axes = rows[first:last].transpose(1, 0, 2)
            gram = axes.transpose(0, 2, 1) @ axes
            self._put(int(number[first]), gram, int(last - first), float(time[first]), float(time[last - 1]))
        while len(self.known) > MOST_BLOCKS:
            known, self.known, self._length = self.known, {}, 2.0 * self._length
            for number in sorted(known):
                self._put(number // 2, *known[number])

    def whole(self) -> dict[str, np.ndarray]:
        """Products, rows, begin and end of the blocks, in the order of time, by their names."""
        columns = zip(*(self.known[n] for n in sorted(self.known)), strict=True)
        return {name: np.array(column) for name, column in zip(_OF_BLOCKS, columns, strict=True)}

    def _put(self, number: int, gram: Array, tests: int, begin: float, end: float) -> None:
        if number in self.known:
            before, count, first, _ = self.known[number]
            gram, tests, begin = before + gram, count + tests, first
        self.known[number] = gram, tests, begin, end


_KINDS = dict.fromkeys(("nominal", "gram", "begin", "end", "noise", "start", "hours"), "f") | {"tests": "i", "log": "i"}
"""What numbers each array holds, as numpy names their kinds."""
_REMEDY = "take the file away, and run 'undertow fleet' again"


class HullFactorsAbout(Record):
    """What the arrays are."""

    SCHEMA: ClassVar[str] = "undertow.hull_factors/1"
    parameters: tuple[Column, ...]
    nuisances: tuple[Column, ...]
    logs: tuple[str, ...]
    settings: Mapping[str, float | str]


def to_bytes(factors: HullFactors) -> bytes:
    """Factors as the content of a file."""
    about = HullFactorsAbout(**{name: getattr(factors, name) for name in HullFactorsAbout.model_fields})
    return packed({"about": about, **{name: getattr(factors, name) for name in _KINDS}})


def from_bytes(content: bytes, source: object) -> HullFactors:
    """Factors that `to_bytes` made.

    Parameters
    ----------
    source : where they were, for messages

    Raises
    ------
    RequestError
        when the bytes are none of these, broken, of another version, or do not hold what they say.
    """
    about, found = unpacked(content, HullFactorsAbout, _KINDS, (source, "factors of a hull", _REMEDY))
    factors = HullFactors(about.parameters, about.nuisances, logs=about.logs, settings=about.settings, **found)
    blocks, logs, p = factors.tests.size, len(factors.logs), len(factors.parameters)
    size = p + len(factors.nuisances) + 1
    wanted = {
        "nominal": (p,),
        "gram": (blocks, 3, size, size),
        "noise": (logs, 3, size, size),
        **dict.fromkeys(("tests", "begin", "end", "log"), (blocks,)),
        **dict.fromkeys(("start", "hours"), (logs,)),
    }
    for name, shape in wanted.items():
        array = getattr(factors, name)
        if array.shape != shape or not (name == "start" or np.isfinite(array).all()):
            raise RequestError(f"{source}: expected {name} of shape {shape} in finite numbers, got others; {_REMEDY}")
    if not blocks or (factors.log < 0).any() or (factors.log >= logs).any():
        raise RequestError(f"{source}: expected blocks of logs that are listed, got others; {_REMEDY}")
    return factors
