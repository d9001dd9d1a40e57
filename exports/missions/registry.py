"""Every format of a mission: what the files of this folder offer."""

from functools import cache

from ...physics.registry_members import objects_in
from .base import MissionFormat


@cache
def mission_formats() -> tuple[MissionFormat, ...]:
    """All formats, in the order of their files."""
    from .. import missions

    return objects_in(missions, MissionFormat)
