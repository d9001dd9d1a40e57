"""The thrusters of a vehicle in its form: where each is, where it points, and which command drives it."""

from collections.abc import Awaitable, Callable, Sequence
from math import degrees, radians
from typing import Any

from nicegui import ui

from ...physics.in_words import number
from ...workflows.workbench_facts import Place, Wire
from .words import button, line

_BOXES = ("x ahead [m]", "y to starboard [m]", "pushes to [\N{DEGREE SIGN}]")
_TURNS = "0\N{DEGREE SIGN} pushes ahead, 90\N{DEGREE SIGN} to starboard. y is negative at port."


class ThrusterRows:
    """A row for each thruster, and a button that swaps the commands of two.

    Parameters
    ----------
    places, wires : of each thruster, in the same order
    changed : called after every change
    """

    def __init__(self, places: Sequence[Place], wires: Sequence[Wire], changed: Callable[[], Awaitable[None]]) -> None:
        self._before, self._changed = tuple(places), changed
        self._boxes: list[tuple[ui.number, ui.number, ui.number]] = []
        self._drives: list[tuple[ui.select, ui.checkbox]] = []
        commands = [wire.channel for wire in wires]
        with ui.element("div").classes("flow"):
            line("Thrusters", tag="h3").style("flex: 1")
            if len(places) == 2:
                button("Swap the two commands", self._swap)
        line(_TURNS, "muted small")
        for place, wire in zip(places, wires, strict=True):
            with ui.element("div").classes("numbers-row thruster-row"):
                line(place.name, "mono", "b")
                values = place.x, place.y, degrees(place.angle)
                boxes = [self._box(place.name, told, value) for told, value in zip(_BOXES, values, strict=True)]
                self._boxes.append((boxes[0], boxes[1], boxes[2]))
                drive = ui.select(commands, value=wire.by, label="driven by", on_change=self._change)
                drive.props(f'dense outlined aria-label="{place.name} driven by"').classes("drive")
                turned = ui.checkbox("reversed", value=wire.turned, on_change=self._change)
                self._drives.append((drive, turned.props(f'dense aria-label="{place.name} reversed"')))
        self._wires = tuple(wires)

    @property
    def places(self) -> tuple[Place, ...]:
        """Where the thrusters are; a box that is empty counts for what stood in it."""
        return tuple(
            Place(was.name, _value(x, was.x), _value(y, was.y), _angle(angle, was.angle))
            for was, (x, y, angle) in zip(self._before, self._boxes, strict=True)
        )

    @property
    def moved(self) -> bool:
        """Whether any is elsewhere than before."""
        return self.places != self._before

    @property
    def wires(self) -> tuple[Wire, ...]:
        """What drives each of them."""
        return tuple(
            Wire(wire.channel, str(drive.value), bool(turned.value))
            for wire, (drive, turned) in zip(self._wires, self._drives, strict=True)
        )

    def _box(self, name: str, told: str, value: float) -> ui.number:
        box = ui.number(label=told, value=float(number(value, 6)), on_change=self._change)
        return box.props(f'dense outlined debounce=300 aria-label="{name} {told}"')

    async def _change(self, _: Any) -> None:
        await self._changed()

    def _swap(self) -> None:
        (one, turned), (other, also) = self._drives
        one.value, other.value = other.value, one.value
        turned.value, also.value = also.value, turned.value


def _value(box: ui.number, before: float) -> float:
    """What stands in a box; what was before, to the last digit, where nothing else was typed."""
    typed = before if box.value is None else float(box.value)
    return before if typed == float(number(before, 6)) else typed


def _angle(box: ui.number, before: float) -> float:
    shown = _value(box, degrees(before))
    return before if shown == degrees(before) else radians(shown)
