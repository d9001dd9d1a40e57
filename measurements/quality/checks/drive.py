"""Whether what drives the boat is what the log says: commands that stand still, or are of another run, while it moves.

A thruster pushes and turns the boat at once, in one proportion. Where its record stands still, and what the model
leaves of surge and of yaw there are one and the same push of this thruster, as large as a working thruster's, the
thruster moved. Each claim is weighed by what it explains before a log is refused for it, see `fault_size`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, final

import numpy as np
from numpy.typing import NDArray

from ....physics.frames import Array
from ....physics.matrices import mass_matrix, push_of
from ....physics.thrusters import Thruster, command_of, resting_commands
from ...alignment import band_passed
from ..expected_answers import explained_as_expected, side_of
from ..fault_size import WIDE, Share, blocks_of, share_explained, squared_held_out
from ..finding import Check, Finding, Reach
from ..quick_motion import LEAST, QUICK, STEP, Part, parts_of, unexplained
from ..record import RATE, Record

_TOGETHER_LEARNT = 0.85
"""Correlation of surge and yaw from which one thruster drives both, where the thrusters' pushes are learnt from the
rest of the log and not the vehicle's: with a frozen record 0.94 to 1, in logs of boats that lie idle up to 0.5."""
_PART = 0.3
"""Share of the boat's accelerations, in size, that nothing explains, from which it matters there."""
_WORKS = 0.5
"""Size of the push that is left, over what the hardest worked thruster makes in the same band, from which a thruster
worked: frozen records of `benchmarks/spoiling.py` leave 0.64 or more, waves of `benchmarks/sound_logs.py` to 0.37."""
_TOLD = 0.25
"""Share that a push must explain to be told of, as `OVERWHELMING` is for a refusal, for which it must be sure."""
_ELSEWHERE = 0.5
"""Share of the power of that push that may be left where the record moves: what is left all along has another cause."""
_DRIVEN, _TAIL = 0.4, 0.25
"""The same where no command moves, and the share of the log that they must stand still at its end: a boat that lies
idle is pushed about by waves and wind, and logs of field boats end with that."""
_SETTLED, _GAINS = 5, 2.0
"""Seconds after which a boat gains no more speed by a command that stands, and times its fast speed squared, summed
over all gains, from which it was driven: a boat that lies idle gains next to nothing."""
_WAVE = 4.0
"""Time over which speeds are averaged before they are asked for gains [s]: waves seldom last longer."""
_NOISE = 2.0
"""Times their noise that accelerations must have for anything to be said of them: three quarters of their power then is
motion."""
_LAGS = 3.0
"""Delays that are tried, both ways [s]: beyond the 2 s that a thruster may have at most."""
_ANSWERS = 0.12
"""Share of quick accelerations that commands must explain at some delay within 3 s; those of another run explain up to
0.09 by chance, the right ones 0.3 or more."""
_ANSWERS_BESIDE = 0.55
"""The same of what hull forces leave: a boat that drifts and turns freely owes most of its quick motion to its hull.
Where commands explain less than `_ANSWERS` of the whole, the right ones explain 0.6 or more of that, and those of
another run up to 0.5, most of them up to 0.2."""
_SLOW = ((0.02, 0.25), (0.005, 0.1))
"""Bands of the slow motion [Hz]: a ship, and a boat in waves, owe their quick motion to noise and waves. A log that is
shorter than the slowest period of a band does not hold it."""
_ANSWERS_SLOWLY = 0.6
"""Share of the slow accelerations, beyond noise, from which commands are the boat's: the right ones explain 0.91 to 1
of it in `benchmarks/sound_logs.py` (tuning seeds), blocks of a run in another order up to 0.48, most up to 0.2."""
_THRUST = (0.5, 2.0)
"""Times what the vehicle says between which thrust is looked for: what fits another size only is no answer to it."""
_LEAST_ANSWERED = 60.0
"""Motion that is needed [s]: over less, commands of another run explain more by chance."""
_MOST = 0.5
"""Share of the log for which one of a pair is held, from which that is no manoeuvre."""
_ALIKE = 0.1
"""Share of an arm, or of full command, within which two are the same."""


@final
class Drive(Check):
    """Looks for thrusters that moved while their records stood still, and for commands that move nothing."""

    name: ClassVar[str] = "drive"

    def examine(self, records: Sequence[Record]) -> list[Finding]:
        """See `Check`: one finding for each command that is at fault, or one for all."""
        having, names, parts = parts_of(records)
        if not parts:
            return []
        # A thruster that pushes another way than the vehicle's leaves just what one beyond its record would.
        if all(part.modelled for part in parts) and explained_as_expected(having):
            wide = parts_of(records, WIDE)[2]
            found = [f for name in names if (f := _worked_beyond(having, wide, names, name)) is not None]
        else:
            found = [f for k in range(len(names)) if (f := _moved_as_learnt(having, parts, names, k)) is not None]
        if not any(one.refused for one in found):
            found = _of_another_run(having, parts, names) or _all_stood_still(parts, names) or found
        return found or _held_beside_their_twins(having, parts, names) or [_sound(parts, names)]


@dataclass(frozen=True, slots=True)
class _Push:
    """What the model leaves of some rows, as a push of one thruster.

    Attributes
    ----------
    share : of the squared error of surge and yaw that one push explains, each of the two foretold by the other
    power : mean square of the push that both have in common [N^2]; negative where they contradict each other
    clear : whether surge and yaw are both beyond their noise
    """

    share: Share
    power: float
    clear: bool


def _worked_beyond(records: Sequence[Record], parts: Sequence[Part], names: list[str], name: str) -> Finding | None:
    """The finding that a command stood still while its thruster moved; None where that is not so.

    Parameters
    ----------
    parts : in the band `WIDE`
    """
    place = names.index(name)
    rows = [part.stands[:, place] for part in parts]
    seconds = sum(int(np.count_nonzero(use)) for use in rows) * STEP
    if not _turn(records, name) or seconds < LEAST:
        return None
    thruster, a_newton = _newton(records, name)
    there, elsewhere = _push(parts, rows, a_newton), _push(parts, [~use for use in rows], a_newton)
    sizes = np.sqrt((np.concatenate([part.pushes for part in parts]) ** 2).mean(axis=0))
    newtons = np.array([np.hypot(*_newton(records, other)[1]) for other in names])
    works = float(np.max(np.hypot(*sizes.T) / np.where(newtons > 0.0, newtons, np.inf)))
    push = float(np.sqrt(max(there.power, 0.0)))
    ends = thruster.scale * thruster.curve.thrust(command_of(thruster, np.array([-1.0, 1.0])), thruster.command)
    # No series that stays between two ends strays from its mean by more than half of what is between them (Popoviciu).
    if not there.clear or not _WORKS * works <= push <= 0.5 * abs(float(np.diff(ends)[0])):
        return None
    known = sum(int(np.count_nonzero(~use)) for use in rows) * STEP >= LEAST
    alone = not known or elsewhere.power <= _ELSEWHERE * there.power
    if there.share.value <= _TOLD or not alone:
        return None
    text = (
        f"{name} stands still for {seconds:.0f} s, but the boat moves as if its thruster worked: a push of it of "
        f"{push:.2g} N that comes and goes explains {there.share} of what the vehicle leaves of surge and yaw"
    )
    short = f"the record of {name} stands still while its thruster works"
    return _broken(text, there.share.value, (name,), short, certain=there.share.overwhelming)


def _newton(records: Sequence[Record], name: str) -> tuple[Thruster, Array]:
    """The vehicle's thruster of a command, and the accelerations of surge and yaw (2,) that a newton of it makes."""
    vehicle = next(r.vehicle for r in records if r.vehicle and name in {t.channel for t in r.vehicle.thrusters})
    thruster = next(one for one in vehicle.thrusters if one.channel == name)
    made = np.linalg.solve(mass_matrix(vehicle), np.array(push_of(thruster)))
    return thruster, np.array([float(made[0]), float(made[2])])


def _push(parts: Sequence[Part], rows: Sequence[NDArray[np.bool_]], a_newton: Array) -> _Push:
    """What the model leaves in some rows, as a push of the thruster of which a newton makes `a_newton`."""
    use = np.concatenate(rows)
    left = np.concatenate([part.left for part in parts])[use]
    if not use.any():
        return _Push(Share(0.0, np.inf), 0.0, clear=False)
    surge, yaw = ((left - left.mean(axis=0)) / a_newton).T
    block = blocks_of([part.left.shape[0] for part in parts])[use]
    noise = np.max([part.noise for part in parts], axis=0)
    clear = bool(np.all(np.sqrt((left**2).mean(axis=0)) >= _NOISE * noise))
    return _Push(share_explained(surge**2 + yaw**2, (surge - yaw) ** 2, block), float((surge * yaw).mean()), clear)


def _moved_as_learnt(records: Sequence[Record], parts: Sequence[Part], names: list[str], place: int) -> Finding | None:
    """The same where no vehicle says what the thrusters do: it is learnt where the command moves."""
    name = names[place]
    turn = _turn(records, name)
    rows = [part.long[:, place] for part in parts]
    learnt = [~use for use in rows]
    seconds, known = (sum(int(np.count_nonzero(use)) for use in which) * STEP for which in (rows, learnt))
    if not turn or min(seconds, known) < LEAST:
        return None
    left = unexplained(parts, rows, learnt, driven=True)
    size = np.sqrt((left**2).mean(axis=0))
    usual = np.sqrt((np.concatenate([part.rates for part in parts]) ** 2).mean(axis=0))
    noise = np.max([part.noise for part in parts], axis=0)
    if np.any(size < _PART * usual) or np.any(size < _NOISE * noise):
        return None
    surge, yaw = ((left - left.mean(axis=0)) / left.std(axis=0)).T
    share = share_explained(
        surge**2 + yaw**2, (surge - turn * yaw) ** 2, blocks_of([r.size for r in rows])[np.concatenate(rows)]
    )
    if share.value < _TOGETHER_LEARNT:
        return None
    text = (
        f"{name} stands still for {seconds:.0f} s, but the boat moves as if its thruster worked: what nothing explains "
        f"of surge and yaw goes together ({share} of it)"
    )
    short = f"the record of {name} stands still while its thruster works"
    return _broken(text, share.value, (name,), short, certain=share.overwhelming)


def _held_beside_their_twins(records: Sequence[Record], parts: Sequence[Part], names: list[str]) -> list[Finding]:
    """The findings that a thruster was held at a push while the one that mirrors it worked, for most of the log.

    The pair's common push then follows from the one that moves, and what it does alone passes for effects. Whether it
    was held the log cannot tell, and that is no reason to refuse it; a command at an end of its range is saturated.
    """
    found = []
    whole = sum(part.rates.shape[0] for part in parts) * STEP
    for place, other in _mirrored(records, names):
        rows = [part.long[:, place] & ~part.long[:, other] for part in parts]
        seconds = sum(int(np.count_nonzero(use)) for use in rows) * STEP
        if seconds < max(_LEAST_ANSWERED, _MOST * whole) or _rests_or_saturates(records, names[place]):
            continue
        text = (
            f"{names[place]} stands still for {seconds:.0f} s at a push, while {names[other]} on the other side moves; "
            "whether its thruster was held, or its record is frozen, the log cannot tell"
        )
        short = f"{names[place]} stands still beside its twin"
        found.append(_broken(text, seconds, (names[place],), short, "s", certain=False))
    return found


def _mirrored(records: Sequence[Record], names: list[str]) -> list[tuple[int, int]]:
    """Places of thrusters that mirror each other about the centre line, either way round."""
    vehicle = next((record.vehicle for record in records if record.vehicle), None)
    known = [(names.index(t.channel), t.x, t.y) for t in (vehicle.thrusters if vehicle else ()) if t.channel in names]
    return [
        (place, other)
        for place, x, y in known
        for other, x2, y2 in known
        if place != other and np.hypot(x - x2, y + y2) < _ALIKE * abs(y)
    ]


def _rests_or_saturates(records: Sequence[Record], name: str) -> bool:
    """Whether the value at which a command stands longest is one of no push, or an end of its range."""
    channels = [r.log.channels[name] for r in records if name in r.log.channels]
    values, places = np.unique(np.concatenate([c.value for c in channels]), return_inverse=True)
    lasting = np.concatenate([np.diff(c.time, append=c.time[-1] + c.period) for c in channels])
    usual = float(values[np.argmax(np.bincount(places, lasting))])
    thruster = next(t for r in records if r.vehicle for t in r.vehicle.thrusters if t.channel == name)
    low, high = resting_commands(thruster) or (np.inf, -np.inf)
    astern, neutral, ahead = command_of(thruster, np.array([-1.0, 0.0, 1.0])).tolist()
    slack = _ALIKE * abs(ahead - neutral)
    least, most = min(astern, ahead) + slack, max(astern, ahead) - slack
    return low - slack <= usual <= high + slack or not least < usual < most


def _all_stood_still(parts: Sequence[Part], names: list[str]) -> list[Finding]:
    """The finding that no command moves while the boat does."""
    rows = _to_the_end(parts)
    seconds = sum(int(np.count_nonzero(use)) for use in rows) * STEP
    whole = sum(part.rates.shape[0] for part in parts) * STEP
    if seconds < max(LEAST, _TAIL * whole):
        return []
    rates = np.concatenate([part.rates[use] for part, use in zip(parts, rows, strict=True)])
    others = [part.rates[~use] for part, use in zip(parts, rows, strict=True)]
    usual = np.sqrt((np.concatenate(others) ** 2).mean(axis=0)) if seconds < 0.8 * whole else np.zeros(2)
    left = unexplained([replace(part, left=part.rates) for part in parts], rows, rows, driven=False)
    size = np.sqrt((left**2).mean(axis=0))
    noise = np.max([part.noise for part in parts], axis=0)
    moved = np.sqrt((rates**2).mean(axis=0))
    driven = size >= np.maximum(_NOISE * noise, _DRIVEN * np.maximum(usual, moved))
    if not np.any(driven & _gains(parts, rows)):
        return []
    text = f"all commands stand still for {seconds:.0f} s, but the boat is driven and turned all the while"
    return [
        _broken(text, seconds, tuple(names), "the records of the commands stand still while the boat is driven", "s")
    ]


def _gains(parts: Sequence[Part], rows: Sequence[NDArray[np.bool_]]) -> NDArray[np.bool_]:
    """Whether the boat gains speed, ahead and in turning, again and again, (2,); one that coasts only loses it."""
    wave = round(_WAVE * RATE)
    fast = np.quantile(np.concatenate([part.speeds for part in parts]) ** 2, 0.95, axis=0)
    gained = np.zeros(2)
    for part, use in zip(parts, rows, strict=True):
        # What is under way when the commands come to a stand may still be gaining.
        speeds = part.speeds[use][round(_SETTLED * RATE) :]
        calm = speeds[: speeds.shape[0] // wave * wave].reshape(-1, wave, 2).mean(axis=1)
        gained += np.diff(calm**2, axis=0).clip(min=0.0).sum(axis=0)
    return np.asarray(gained > _GAINS * fast)


def _to_the_end(parts: Sequence[Part]) -> list[NDArray[np.bool_]]:
    """The rows of a stand that lasts to the end of a stretch; boats lie idle in between, with wind and current."""
    found, lasts = [], True
    for part in reversed(parts):
        still = np.asarray(part.long.all(axis=1))
        rows, moving = np.zeros_like(still), np.flatnonzero(~still)
        if lasts or not part.cut:
            rows[int(moving[-1]) + 1 if moving.size else 0 :] = True
        lasts = bool(rows.all())
        found.append(rows)
    return found[::-1]


def _of_another_run(records: Sequence[Record], parts: Sequence[Part], names: list[str]) -> list[Finding]:
    """The finding that the boat answers no command at any delay, neither quickly nor slowly."""
    whole = sum(part.rates.shape[0] for part in parts) * STEP
    rates = np.concatenate([part.rates for part in parts])
    noise = np.max([part.noise for part in parts], axis=0)
    if whole < _LEAST_ANSWERED or np.any(np.sqrt((rates**2).mean(axis=0)) <= _NOISE * noise):
        return []
    if all(part.long.all(axis=1).mean() > 0.5 for part in parts):
        return []
    driven = [band_passed(_both(part), STEP, QUICK) for part in parts]
    lags = range(-round(_LAGS * RATE), round(_LAGS * RATE) + 1, 2)
    explained = 0.0
    for lag in sorted(lags, key=abs):  # a boat that answers does so within a moment, and one delay is enough
        explained = max(explained, _answered(parts, driven, lag))
        if explained > _ANSWERS:
            return []
    if max(_answered(parts, driven, lag, beside_hull=True) for lag in lags) > _ANSWERS_BESIDE:
        return []
    held = [band for band in _SLOW if whole * band[0] >= 1.0]
    slowly = [one for band in held if (one := _answered_slowly(records, band, lags)) is not None]
    if any(one.value >= _ANSWERS_SLOWLY for one in slowly):
        return []
    text = (
        f"the boat does not answer {', '.join(names)} at any delay within {_LAGS:g} s: they explain "
        f"{100.0 * explained:.0f} % of its quick motion"
    )
    if slowly:
        text = f"{text} and {max(slowly, key=lambda one: one.value)} of its slow motion"
    certain = not slowly or min(one.high for one in slowly) < _ANSWERS_SLOWLY
    text = f"{text}; they {'are' if certain else 'may be'} of another run, or of another boat"
    return [_broken(text, explained, tuple(names), "the boat does not answer its commands", certain=certain)]


def _both(part: Part) -> Array:
    """Commands, and their squares with their signs, (n, 2 c)."""
    return np.column_stack([part.commands, part.commands * np.abs(part.commands)])


def _answered_slowly(records: Sequence[Record], band: tuple[float, float], lags: Sequence[int]) -> Share | None:
    """The share of the accelerations in a band, beyond their noise, that thrust explains where it is not fitted.

    It is that of the axis and the delay with the most. The vehicle says what its hull does, and what thrust is but for
    its size; without a vehicle both are fitted. None where there is little but noise.
    """
    parts = parts_of(records, band)[2]
    found = None
    for axis in range(2):
        noise = max(float(part.noise[axis]) for part in parts)
        modelled = all(part.modelled for part in parts)
        wanted = [p.left[:, axis] + p.pushes[:, :, axis].sum(axis=1) if modelled else p.rates[:, axis] for p in parts]
        if np.sqrt((np.concatenate(wanted) ** 2).mean()) <= _NOISE * noise:
            continue
        driven = [
            p.pushes[:, :, axis].sum(axis=1, keepdims=True) if modelled else band_passed(_both(p), STEP, band)
            for p in parts
        ]
        for lag in lags:
            kept = [one.size - abs(lag) for one in wanted]
            late, early = max(0, lag), max(0, -lag)
            target = np.concatenate([one[late : late + n] for one, n in zip(wanted, kept, strict=True)])
            table = np.concatenate([one[early : early + n] for one, n in zip(driven, kept, strict=True)])
            block = blocks_of(kept)
            left = squared_held_out(target, table, block, _THRUST if modelled else (-np.inf, np.inf))
            share = share_explained(target**2 - noise**2, left - noise**2, block)
            found = share if found is None or share.value > found.value else found
    return found


def _answered(parts: Sequence[Part], driven: Sequence[Array], lag: int, *, beside_hull: bool = False) -> float:
    """Share of the quick accelerations, of the axis that answers more, that commands explain at a delay in rows.

    Parameters
    ----------
    driven : of each part, its commands and their squares in the band (n, 2 c)
    beside_hull : the share of what hull forces leave, and by what they leave of the commands
    """
    kept = [part.rates.shape[0] - abs(lag) for part in parts]
    table = np.concatenate([one[max(0, -lag) : max(0, -lag) + n] for one, n in zip(driven, kept, strict=True)])
    ends = [(part, slice(max(0, lag), max(0, lag) + n)) for part, n in zip(parts, kept, strict=True)]
    shares = []
    for axis in range(2):
        wanted, columns = np.concatenate([part.rates[rows, axis] for part, rows in ends]), table
        if beside_hull:
            hull = np.linalg.qr(np.concatenate([part.states[axis][rows] for part, rows in ends]))[0]
            wanted, columns = wanted - hull @ (hull.T @ wanted), table - hull @ (hull.T @ table)
        left = wanted - columns @ np.linalg.lstsq(columns, wanted, rcond=1e-9)[0]
        shares.append(1.0 - float(left @ left) / float(wanted @ wanted))
    return max(shares)


def _turn(records: Sequence[Record], name: str) -> int:
    """1 for a thruster at port, which turns the boat to starboard by pushing ahead, -1 at starboard, else 0."""
    for record in records:
        for thruster in record.vehicle.thrusters if record.vehicle else ():
            if thruster.channel == name:
                return -int(np.sign(thruster.y)) if abs(np.cos(thruster.angle)) > 0.5 else 0
    return {"port": 1, "starboard": -1}.get(side_of(name), 0)


def _broken(
    text: str, value: float, names: tuple[str, ...], short: str, unit: str = "1", *, certain: bool = True
) -> Finding:
    """A defect for which the log is refused, or a warning where what it explains is not overwhelming."""
    return Finding(
        check="drive",
        verdict="defect" if certain else "warning",
        sentence=text,
        value=value,
        unit=unit,
        channels=names,
        consequence="what a thruster does beyond its record would be laid at the door of the hull",
        remedy="find out what became of the record, and leave those parts of the log out",
        short=short,
        reach=Reach.LOG,
    )


def _sound(parts: Sequence[Part], names: list[str]) -> Finding:
    still = [name for k, name in enumerate(names) if all(part.stands[:, k].all() for part in parts)]
    if still:
        text = f"{' and '.join(still)} never changes; whether the thruster worked, the log cannot tell"
        wrong = "what a thruster does beyond its record would be laid at the door of the hull"
        remedy = "make sure that this thruster was idle or held"
        short = f"{' and '.join(still)} never changes"
        return Finding(
            check="drive",
            verdict="warning",
            sentence=text,
            channels=tuple(still),
            consequence=wrong,
            remedy=remedy,
            short=short,
        )
    return Finding(
        check="drive", verdict="ok", sentence="no thruster works while its record stands still", channels=tuple(names)
    )
