"""Write effects.md, the catalogue with a picture of each effect, from what the catalogue and the simulator say.

Run `python docs/effects.py` after an effect has been added or changed; a test compares the page with the code. Pictures
lie in `effects/`: the force of a typical amount of the effect on Gazebo's BlueBoat, along the manoeuvre that shows it
best.
"""

import re
import sys
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
import numpy as np

from undertow.physics.effects import EFFECTS, Parameter
from undertow.physics.motion import FORCE_UNITS
from undertow.physics.presentation import listing, number, unit_text, words
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.signatures import Signature, signatures

DOCS = Path(__file__).resolve().parent
BOAT = "blueboat"
POINTS = 160
"""Points of a line: two in each pixel show nothing more."""
UNITS = {"u": "m/s", "v": "m/s", "r": "rad/s", "du/dt": "m/s²", "dr/dt": "rad/s²", "heading": "rad"}
BLUE, GREY, ORANGE = "#1f5fa8", "#8a8f98", "#c8641b"
STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "undertow",
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": GREY,
    "axes.labelcolor": GREY,
    "xtick.color": GREY,
    "ytick.color": GREY,
    "axes.titlesize": 9.0,
    "axes.titlecolor": GREY,
}
FAMILIES = {
    "hull": "Drag of the hull",
    "coupling": "Coupling between the axes",
    "mass": "Mass and its place",
    "thruster": "Thrusters",
    "environment": "Water and wind",
    "memory": "Memory",
    "trim": "Constant forces",
}


def picture(found: Signature) -> None:
    """Draw the force over time, and over the signal that tells most of it."""
    every = max(1, found.time.size // POINTS)
    time, force, values = (series[::every] for series in (found.time, found.force, found.values))
    unit = unit_text(FORCE_UNITS[found.axis])
    with plt.rc_context(STYLE):
        figure, (left, right) = plt.subplots(1, 2, figsize=(7.0, 1.7), width_ratios=(2, 1), layout="constrained")
        left.axhline(0.0, color=GREY, lw=0.5)
        left.plot(time, force, color=BLUE, lw=1.2)
        left.set(xlabel="time [s]", ylabel=f"{found.axis_name} [{unit}]", title="its force along the manoeuvre")
        if found.signal == "time":
            right.axis("off")
        else:
            signal = UNITS.get(found.signal)
            right.scatter(values, force, s=3, color=ORANGE, lw=0)
            right.set(xlabel=f"{found.signal} [{signal or 'of full'}]", title="over what tells most of it")
        figure.savefig(
            DOCS / "effects" / f"{found.effect.name}.svg", metadata={"Date": None, "Creator": "docs/effects.py"}
        )
        plt.close(figure)


def chapter(found: Signature, boat: Vehicle) -> str:
    """An effect in words."""
    effect = found.effect
    units = {p.symbol.replace("{thruster}", t.name): p.unit for p in effect.parameters for t in boat.thrusters}
    assumed = f", of {found.assumed}" if found.assumed else ""
    amount = ", ".join(
        f"`{s} = {number(v)}` {unit_text(units[s]) if units[s] != '1' else ''}".strip() for s, v in found.amount.items()
    )
    symbols = "; ".join(map(symbol, effect.parameters))
    alike = listing([f"[{name}](#{name}) ({cosine:.2f})" for name, cosine in found.alike]) or "nothing else"
    size = f"{number(found.size)} {unit_text(FORCE_UNITS[found.axis])}"
    reported = "the amount added to the number in the file" if effect.added else "its whole value"
    shown = f"{size} of {found.axis_name} force, {100 * found.apart:.0f} % of it unlike any other effect's"
    later = (
        " at the beginning of a log and five minutes later, as drawn"
        if any("min" in p.unit for p in effect.parameters)
        else ""
    )
    lines = [
        f"### {effect.name}",
        effect.meaning,
        "",
        f"- **Force**: `{effect.equation}`. Reported as {reported}.",
        f"- **Symbols**: {symbols}.",
        f"- **Typical**: {amount}{assumed}.",
        f"- **Shown best by** {found.trial.text}{later}: {shown}.",
        f"- **Taken for**, in gentle driving: {alike}.",
        *([f"- **Needs** the channels {listing([f'`{c}`' for c in effect.channels])}."] if effect.channels else []),
        *([f"- **Needs** {listing([f'`{k}`' for k in effect.requires])} in the vehicle file."] * bool(effect.requires)),
        *(
            [f"- **Includes** {listing([f'[{name}](#{name})' for name in effect.includes])}."]
            if effect.includes
            else []
        ),
        "",
        f"![Force of {words(effect.name)} along the manoeuvre](effects/{effect.name}.svg)",
        "",
    ]
    return "\n".join(lines)


def symbol(parameter: Parameter) -> str:
    """A parameter with its unit, its null value and its limits."""
    unit = f" [{unit_text(parameter.unit)}]" if parameter.unit != "1" else ""
    return f"`{parameter.symbol}`{unit}, {parameter.null:g} when absent{limits(parameter)}"


def limits(parameter: Parameter) -> str:
    """The physical limits of a parameter in words."""
    low, high = parameter.lower, parameter.upper
    if np.isfinite(low) and np.isfinite(high):
        return f", {low:g} to {high:g}"
    return f", at least {low:g}" if np.isfinite(low) else f", at most {high:g}" if np.isfinite(high) else ""


def page(found: dict[str, Signature], boat: Vehicle) -> str:
    """The whole catalogue."""
    parts = [
        "# Effects\n",
        f"The {len(EFFECTS)} effects that undertow looks for, each with the force that it adds to the right-hand side "
        f"of the force equation, a typical amount of it on {boat.name}, the manoeuvre that shows it best, and its "
        "look-alikes. Numbers in brackets are cosines between the forces of two effects along gentle driving: at 0.9 "
        "and more a gentle log hardly tells them apart, and the findings name them together. Forces are root mean "
        "squares. `undertow effects NAME --vehicle V` says the same of another boat.\n",
        "`c_i` is the command of a thruster in -1..1, `T_i` its force, `u_r`, `v_r` the velocity relative to the water "
        "([conventions.md](conventions.md)). A drag, a coupling or a term that no effect names is found as an axis and "
        "a form, such as `yaw:u|r|`. Errors of sensors are told under `sensors` in the findings "
        "([method.md](method.md)).\n",
    ]
    for family, title in FAMILIES.items():
        members = [effect.name for effect in EFFECTS if effect.family == family]
        parts.append(f"## {title}\n\n" + "\n".join(chapter(found[name], boat) for name in members))
    assert set(FAMILIES) == {effect.family for effect in EFFECTS}, "docs/effects.py: a family has no title"
    parts.append("Written by `python docs/effects.py`; do not edit.\n")
    return re.sub(r"\n{3,}", "\n\n", "\n".join(parts))


def main(text_only: bool) -> str:
    """Write page and pictures; or give the page alone."""
    boat = load_vehicle(BOAT)
    found = {each.effect.name: each for each in signatures(boat)}
    text = page(found, boat)
    if not text_only:
        (DOCS / "effects").mkdir(exist_ok=True)
        for each in found.values():
            picture(each)
        (DOCS / "effects.md").write_text(text, encoding="utf-8")
        print(f"docs/effects.md and {len(found)} pictures written")
    return text


if __name__ == "__main__":
    main("--text" in sys.argv)
