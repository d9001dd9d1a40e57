"""Check of what drives the boat: commands that stand still, or belong to another run, while it moves.

A thruster pushes and turns the boat in one proportion. Where its record stands still while surge and yaw lack one and
the same push of it, as large as a working thruster's, the thruster moved. Commands that explain nothing of the motion,
at any delay, quick or slow, are not the boat's own.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ....physics.motion import Array
from ....physics.thrusters import command_of, resting_commands
from ...statistics.signals import band_passed
from ..faults import BLOCK, FEWEST, OVERWHELMING, WIDE, Fault, Kind, Share, Size, blocks_of, size_of, squared_held_out
from ..quick_motion import LEAST, QUICK, Part, parts_of, push_range
from ..record import RATE, STEP, About, Check, Finding, Found, Record, channels_called, thruster_of
from ..response import explained_as_expected, side_of

_LAGS = 3.0
"""Delays that are tried, both ways [s]: beyond the 2 s that a thruster may have at most."""
_BANDS = ((0.02, 0.25), QUICK, (0.005, 0.1))
"""Bands in which differentiated speeds are compared with thrust [Hz]: a ship, and a boat in waves, owe their quick
motion to noise and waves. A log that is shorter than the slowest period of a band does not hold it."""
_WAVE = 4.0
"""Length of a piece over which speeds are averaged before they are asked for gains [s]: waves seldom last longer."""
_HELD = "what a thruster does beyond its record would be laid at the door of the hull"


def _examine(records: Sequence[Record]) -> Found:
    """Look for thrusters that moved while their records stood still, and for commands that move nothing.

    One finding for each command that is at fault, or one for all.
    """
    having, names, parts = parts_of(records, WIDE)
    if not parts:
        return []
    found = []
    # A thruster that pushes another way than the vehicle's leaves just what one beyond its record would.
    if all(part.modelled for part in parts) and explained_as_expected(having):
        found = [one for name in names if (one := _frozen(having, parts, names, name)) is not None]
    if not any(one.refused for one in found):
        all_at_once = (_of_another_run(having, parts, names), _all_frozen(having, parts, names))
        found = [one for one in all_at_once if one][:1] or found
    return found or list(_held_of_mirrored_pair(having, parts, names)) or [_sound(parts, names)]


def _frozen(records: Sequence[Record], parts: Sequence[Part], names: list[str], name: str) -> Finding | None:
    """The finding that a command stood still while its thruster moved; None where that is not so.

    One push of that thruster must explain what is left of surge and of yaw where the record stands still, each of the
    two foretold by the other; what is left elsewhere, too, has another cause, and what such a push explains elsewhere,
    as waves make it, that cause explains where the record stands still. Its power is weighed against that of the
    thruster which works hardest.
    """
    place = names.index(name)
    stands = np.concatenate([part.stands[:, place] for part in parts])
    seconds = int(np.count_nonzero(stands)) * STEP
    if not _turns(records, name) or seconds < LEAST:
        return None
    strays, a_newton = push_range(records, name)
    pushes = np.concatenate([part.pushes for part in parts])
    left = _residual_of_scales(np.concatenate([part.residual for part in parts]), pushes)
    surge, yaw = ((left - left[stands].mean(axis=0)) / a_newton).T
    sizes = np.sqrt((pushes**2).mean(axis=0))
    newtons = np.array([np.hypot(*push_range(records, other)[1]) for other in names])
    works = float(np.max(np.hypot(*sizes.T) / np.where(newtons > 0.0, newtons, np.inf)))
    push = float(np.sqrt(max((surge * yaw)[stands].mean(), 0.0)))
    if push > strays:
        return None
    without, one_push = surge**2 + yaw**2, 2.0 * surge * yaw
    elsewhere = -stands.sum() / max((~stands).sum(), 1) if one_push[~stands].sum() > 0.0 else 0.0
    size = size_of(
        *(without, without - np.where(stands, 1.0, elsewhere) * one_push, np.where(stands, 2.0 * works**2, 0.0)),
        blocks_of([part.residual.shape[0] for part in parts]),
    )
    return Fault(Kind.FROZEN, (name,), size, {"seconds": seconds, "push": push}).ruled()


def _residual_of_scales(left: Array, pushes: Array) -> Array:
    """What is left (n, 2) of accelerations if each thruster may push more or less than the vehicle says, (n, c, 2)."""
    size = np.maximum(np.sqrt((left**2).mean(axis=0)), 1e-300)
    table = np.concatenate([pushes[:, :, axis] / size[axis] for axis in range(2)])
    scales = np.linalg.lstsq(table, np.concatenate((left / size).T), rcond=1e-9)[0]
    return np.asarray(left - np.einsum("ncx,c->nx", pushes, scales))


def _held_of_mirrored_pair(records: Sequence[Record], parts: Sequence[Part], names: list[str]) -> Iterator[Finding]:
    """The findings that a thruster was held at a push while the one that mirrors it worked, for most of the log.

    The pair's common push then follows from the one that moves, and what it does alone passes for effects. Whether it
    was held the log cannot tell, and that is no reason to refuse it; a command at an end of its range is saturated.
    """
    whole = sum(part.rates.shape[0] for part in parts) * STEP
    for place, other in _mirrored(records, names):
        rows = [part.long[:, place] & ~part.long[:, other] for part in parts]
        seconds = sum(int(np.count_nonzero(use)) for use in rows) * STEP
        if seconds < max(FEWEST * BLOCK, 0.5 * whole) or _rests_or_saturates(records, names[place]):
            continue
        yield About("drive", (names[place],), seconds, "s").warning(
            f"{names[place]} stands still for {seconds:.0f} s at a push, while {names[other]} on the "
            "other side moves; whether its thruster was held, or its record is frozen, the log cannot tell",
            consequence=_HELD,
            remedy="make sure that this thruster was held, or leave those parts of the log out",
            short=f"{names[place]} stands still beside its twin",
        )


def _mirrored(records: Sequence[Record], names: list[str]) -> list[tuple[int, int]]:
    """Places of thrusters that mirror each other about the centre line, either way round."""
    vehicle = next((record.vehicle for record in records if record.vehicle), None)
    known = [(names.index(t.channel), t.x, t.y) for t in (vehicle.thrusters if vehicle else ()) if t.channel in names]
    return [
        (place, other)
        for place, x, y in known
        for other, x2, y2 in known
        if place != other and np.isclose(x, x2) and np.isclose(y, -y2)
    ]


def _rests_or_saturates(records: Sequence[Record], name: str) -> bool:
    """True when the value at which a command stands longest is one of no push, or an end of its range."""
    channels = channels_called(records, name)
    values, places = np.unique(np.concatenate([c.value for c in channels]), return_inverse=True)
    lasting = np.concatenate([np.diff(c.time, append=c.time[-1] + c.period) for c in channels])
    usual = float(values[np.argmax(np.bincount(places, lasting))])
    thruster = thruster_of(records, name)
    assert thruster is not None  # only those of a vehicle mirror each other
    low, high = resting_commands(thruster) or (np.inf, -np.inf)
    astern, ahead = command_of(thruster, np.array([-1.0, 1.0])).tolist()
    return low <= usual <= high or not min(astern, ahead) < usual < max(astern, ahead)


def _all_frozen(records: Sequence[Record], parts: Sequence[Part], names: list[str]) -> Finding | None:
    """The finding that no command moves, to the end of the log, while the boat gains speed again and again.

    A boat that coasts only loses it: gains are weighed against all changes of its squared speeds, and against speeding
    up once from rest. In between, boats lie idle, with wind and current. What white noise gains on the mean is none: of
    a normal number what is above zero, its standard deviation over the root of 2 pi.
    """
    rows = _to_the_end(parts)
    seconds = sum(int(np.count_nonzero(use)) for use in rows) * STEP
    if seconds < max(FEWEST * BLOCK, OVERWHELMING * sum(part.rates.shape[0] for part in parts) * STEP):
        return None
    wave, fast = round(_WAVE * RATE), np.quantile(np.concatenate([part.speeds for part in parts]) ** 2, 0.95, axis=0)
    calmly = parts_of(records, (1.0 / (FEWEST * BLOCK), 0.5 / _WAVE))[2]
    noise = _WAVE * np.max([part.noise for part in calmly], axis=0) / np.sqrt(2.0 * np.pi)
    changes, by_noise, block = [np.zeros((0, 2))], [np.zeros((0, 2))], [np.zeros(0, dtype=np.int64)]
    for number, (part, use) in enumerate(zip(parts, rows, strict=True)):
        # What is under way when commands come to a stand may still gain.
        speeds = part.speeds[use][round(BLOCK * RATE) :]
        calm = speeds[: speeds.shape[0] // wave * wave].reshape(-1, wave, 2).mean(axis=1)
        changes.append(np.diff(calm**2, axis=0))
        by_noise.append(np.abs(calm[1:] + calm[:-1]) * noise)
        rows_in = np.arange(max(calm.shape[0] - 1, 0), dtype=np.int64) * wave
        block.append(1_000_000 * number + rows_in // round(BLOCK * RATE))
    change, gained, blocks = np.concatenate(changes), np.concatenate(by_noise), np.concatenate(block)
    if not blocks.size or not np.all(fast > 0.0):
        return None
    once = np.full(blocks.size, 1.0 / OVERWHELMING / blocks.size)
    sizes = [
        size_of(np.abs(one), none - np.minimum(one, 0.0), once, blocks)
        for one, none in zip((change / fast).T, (gained / fast).T, strict=True)
    ]
    size = max(sizes, key=lambda one: min(one.share.low, one.weight.low))
    return Fault(Kind.ALL_FROZEN, tuple(names), size, {"seconds": seconds}).ruled()


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


def _of_another_run(records: Sequence[Record], parts: Sequence[Part], names: list[str]) -> Finding | None:
    """The finding that the boat answers no command at any delay, neither quickly nor slowly."""
    whole = sum(part.rates.shape[0] for part in parts) * STEP
    stands = np.concatenate([part.long.all(axis=1) for part in parts])
    # What stands most of the time is not asked.
    if whole < FEWEST * BLOCK or np.count_nonzero(stands) > 0.5 * stands.size:
        return None
    found = None
    for band in _BANDS:
        size = _unanswered(records, band) if whole * band[0] >= 1.0 else None
        if size is not None and (found is None or size.weight.value < found.weight.value):
            found = size
        if found is not None and not found.likely:
            return None
    if found is None:
        return None
    unanswered = Share(0.5 * (1.0 + found.weight.value), 0.5 * found.weight.error)
    if not all("u" in record.log.channels for record in records):  # derived speeds put their noise into the hull's part
        text = (
            f"the boat may not answer {', '.join(names)}: {unanswered} of its motion, beyond noise and hull, has no "
            "cause in them, but speeds that are made of positions cannot tell"
        )
        short = "the commands are of this run and of this boat"
        return About("drive", tuple(names)).untold(text, short=short)
    facts = {"names": ", ".join(names), "reach": _LAGS, "share": unanswered}
    return Fault(Kind.OTHER_RUN, tuple(names), found, facts).ruled()


def _unanswered(records: Sequence[Record], band: tuple[float, float]) -> Size | None:
    """How much more of the accelerations in a band, beyond noise and hull, no command explains than any does.

    It is that of the axis and the delay that answer most. The vehicle says what its hull does, and what each thrust is
    but for its size and sign; without a vehicle both are fitted. None where there is little but noise.
    """
    parts = parts_of(records, band)[2]
    modelled = all(part.modelled for part in parts)
    result = None
    every = [_tables(parts, axis, band, modelled) for axis in range(2)]
    for lag in sorted(range(-round(_LAGS * RATE), round(_LAGS * RATE) + 1, 2), key=abs):
        for axis, (wanted, driven, hull) in enumerate(every):
            kept = [one.size - abs(lag) for one in wanted]
            late, early = max(0, lag), max(0, -lag)
            target, beside = (
                np.concatenate([one[late : late + n] for one, n in zip(many, kept, strict=True)])
                for many in (wanted, hull)
            )
            table = np.concatenate([one[early : early + n] for one, n in zip(driven, kept, strict=True)])
            noise, block = max(float(part.noise[axis]) for part in parts) ** 2, blocks_of(kept)
            power = (target**2 if modelled else squared_held_out(target, beside, block)) - noise
            # Thrust that should make little of the motion, or less than noise, is not missed in it.
            expected = np.inf if not modelled else float((table.sum(axis=1) ** 2).mean())
            if not power.mean() > noise or not expected > max(noise, OVERWHELMING * float(power.mean())):
                continue
            columns = table if modelled else np.column_stack([table, beside])
            left = squared_held_out(target, columns, block) - noise
            size = size_of(left, power - left, power, block)
            result = size if result is None or size.weight.value < result.weight.value else result
            if not result.likely:
                return result
    return result


def _tables(
    parts: Sequence[Part], axis: int, band: tuple[float, float], modelled: bool
) -> tuple[list[Array], list[Array], list[Array]]:
    """Of each part what thrust is to explain (n,), thrust by the vehicle or commands (n, c), and hull states (n, s)."""
    if modelled:
        push = [part.pushes[:, :, axis] for part in parts]
        wanted = [part.residual[:, axis] + one.sum(axis=1) for part, one in zip(parts, push, strict=True)]
        return wanted, push, [part.states[axis] for part in parts]
    signed = [np.column_stack([part.commands, part.commands * np.abs(part.commands)]) for part in parts]
    driven = [band_passed(table, STEP, band) for table in signed]
    return [part.rates[:, axis] for part in parts], driven, [part.states[axis] for part in parts]


def _turns(records: Sequence[Record], name: str) -> bool:
    """True for a thruster on one side, which turns the boat by pushing ahead."""
    thruster = thruster_of(records, name)
    if thruster is None:
        return bool(side_of(name))
    return bool(thruster.y != 0.0 and abs(np.cos(thruster.angle)) > 0.5)


def _sound(parts: Sequence[Part], names: list[str]) -> Finding:
    still = [name for k, name in enumerate(names) if all(part.stands[:, k].all() for part in parts)]
    if still:
        short = f"{' and '.join(still)} never changes"
        return About("drive", tuple(still)).note(
            f"{short}; whether the thruster worked, the log cannot tell",
            consequence=_HELD,
            remedy="make sure that this thruster was idle or held",
            short=short,
        )
    return About("drive", tuple(names)).ok("no thruster works while its record stands still")


DRIVE = Check("drive", _examine)
