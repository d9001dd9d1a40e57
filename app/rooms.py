"""What every worker needs, loaded once by the process that all of them are forked from; it loads this by its name."""

from ..physics.stage import collect_seldom, pass_over_what_is_loaded

collect_seldom()

from . import desk  # noqa: E402 (the room that answers)

pass_over_what_is_loaded()
__all__ = ["desk"]
