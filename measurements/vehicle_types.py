"""Kinds of vehicle that an autopilot steers, as its log says: a boat, or something that is none."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum


class Craft(Enum):
    """A kind of vehicle; its value is what a sentence calls it."""

    BOAT = "a surface vessel"
    ROVER = "a rover or boat"
    COPTER = "a copter"
    PLANE = "a plane"
    SUBMARINE = "a submarine"
    AIRSHIP = "an airship"
    TRACKER = "an antenna tracker"

    @property
    def floats(self) -> bool:
        """True when it may be a surface vessel; ArduPilot's firmware of boats is that of rovers."""
        return self in (Craft.BOAT, Craft.ROVER)


@dataclass(frozen=True, slots=True)
class CraftEvidence:
    """A kind of vehicle, and the words of the log that tell it."""

    craft: Craft
    source: str

    @property
    def sentence(self) -> str:
        """What the log says, without an end."""
        none = "" if self.craft.floats else ", which is no surface vessel"
        return f"the log is of {self.craft.value}{none} ({self.source})"


_FIRMWARE = re.compile(r"\b(?:Ardu|APM:?|AntennaTracker|Blimp)(Boat|Rover|Copter|Plane|Sub)?", re.IGNORECASE)
_CALLED = {
    "boat": Craft.BOAT,
    "rover": Craft.ROVER,
    "copter": Craft.COPTER,
    "plane": Craft.PLANE,
    "sub": Craft.SUBMARINE,
    "antennatracker": Craft.TRACKER,
    "blimp": Craft.AIRSHIP,
}
"""What ArduPilot's firmware calls itself in its first message (`fwver.fw_string`, AP_FWVersion.h)."""
_MAV_TYPES = {
    Craft.PLANE: (1, 16, 19, 20, 21, 22, 23, 24, 25, 28),
    Craft.COPTER: (2, 3, 4, 13, 14, 15, 29, 35),
    Craft.TRACKER: (5,),
    Craft.AIRSHIP: (7, 8),
    Craft.ROVER: (10,),
    Craft.BOAT: (11,),
    Craft.SUBMARINE: (12,),
}
"""MAV_TYPE of vehicles that steer themselves (MAVLink, minimal.xml); others are ground stations and parts."""
_PX4 = {1: Craft.COPTER, 2: Craft.PLANE, 3: Craft.ROVER, 4: Craft.AIRSHIP}
"""`vehicle_status.vehicle_type` of PX4 (VehicleStatus.msg); 0 is unknown."""


def by_firmware(texts: Iterable[str], where: str) -> CraftEvidence | None:
    """The kind that the first text tells in which an ArduPilot firmware names itself; `where` the texts stand.

    >>> by_firmware(["Frame: UNSUPPORTED", "ArduSub V4.1.0 (f2af3c7e)"], "MSG").craft
    <Craft.SUBMARINE: 'a submarine'>
    """
    for text in texts:
        found = _FIRMWARE.match(text.strip())
        craft = _CALLED.get((found[1] or found[0]).lower()) if found else None
        if craft is not None:
            return CraftEvidence(craft, f"{where}: {' '.join(text.split()[:2])}")
    return None


def by_mav_type(number: int, where: str) -> CraftEvidence | None:
    """The kind of a MAV_TYPE; None for one that says nothing, or is no vehicle's.

    >>> by_mav_type(12, "HEARTBEAT").sentence
    'the log is of a submarine, which is no surface vessel (HEARTBEAT: MAV_TYPE 12)'
    """
    craft = next((craft for craft, numbers in _MAV_TYPES.items() if number in numbers), None)
    return craft and CraftEvidence(craft, f"{where}: MAV_TYPE {number}")


def by_px4_status(number: int) -> CraftEvidence | None:
    """The kind of PX4's `vehicle_status.vehicle_type`; None for one that says nothing."""
    return CraftEvidence(_PX4[number], f"vehicle_status: vehicle_type {number}") if number in _PX4 else None
