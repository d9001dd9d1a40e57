"""Modules that every worker needs, loaded once by the process from which all are forked, which imports this by name."""

from ..physics.stage import collect_seldom, pass_over_what_is_loaded

collect_seldom()

from . import desk  # noqa: E402 (the room that answers)

pass_over_what_is_loaded()
__all__ = ["desk"]
