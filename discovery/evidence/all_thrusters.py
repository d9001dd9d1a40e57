"""What the scales of all thrusters say together: a thrust that the file has wrong, and what is left of a difference."""

from collections.abc import Sequence

from ...physics.assumed_numbers import assumed, how_sure
from ...physics.in_words import listing, number
from ...physics.vehicle import Vehicle

ONE = "thruster_asymmetry"


def all_thrusters(nominal: Vehicle, corrected: Vehicle, kept: Sequence[str]) -> str:
    """That all thrusters push harder, or all weaker, than the file says, and how much of it is a difference.

    Empty where a thruster is as the file has it, or pushes the other way from the file than another.

    Parameters
    ----------
    kept : keys of the effects that stand in the corrected model

    Examples
    --------
    >>> from undertow.physics.vehicle import load_vehicle
    >>> boat = load_vehicle("blueboat")
    >>> keys = ["thruster_asymmetry[port]", "thruster_asymmetry[stbd]"]
    >>> for sentence in all_thrusters(boat, boat.with_values({"port_scale": 1.3, "stbd_scale": 1.6}), keys).split(". "):
    ...     print(sentence)
    Both thrusters push harder than the vehicle file says, port 1.30 times and stbd 1.60 times
    Of that, a factor of 1.23 is the difference between the two; the rest is thrust that the file has too low.
    >>> all_thrusters(boat, boat.with_values({"port_scale": 0.9, "stbd_scale": 1.6}), keys)
    ''
    """
    names = [thruster.name for thruster in nominal.thrusters]
    if len(names) < 2 or not {f"{ONE}[{name}]" for name in names} <= set(kept):
        return ""
    times = {name: corrected.value(f"{name}_scale") / (nominal.value(f"{name}_scale") or 1.0) for name in names}
    weak, strong = min(times.values()), max(times.values())
    if not (weak > 1.0 or 0.0 < strong < 1.0) or weak <= 0.0:
        return ""
    how, wrong = ("harder", "low") if weak > 1.0 else ("weaker", "high")
    guess = assumed(nominal).get("thrust_scale")
    sure = f" ({how_sure(guess)})" if guess and how_sure(guess) else ""
    file = "the vehicle file says" if guess is None else f"the vehicle file assumes{sure}"
    every, between = ("Both", "the two") if len(names) == 2 else ("All", "the weakest and the strongest")
    each = listing([f"{name} {number(value)} times" for name, value in times.items()])
    return (
        f"{every} thrusters push {how} than {file}, {each}. Of that, a factor of {number(strong / weak)} is the "
        f"difference between {between}; the rest is thrust that the file has too {wrong}."
    )
