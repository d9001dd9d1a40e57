"""Modules that every worker needs, loaded once by the process from which all are forked, which imports this by name."""

from ..physics.stage import collect_seldom, freeze_loaded_objects

collect_seldom()

from . import worker_service  # noqa: E402 (the room that answers)

freeze_loaded_objects()
__all__ = ["worker_service"]
