"""How often Python looks for cycles of objects that nobody needs any more, while a verb runs."""

import gc

_PACE = 50_000
"""New objects from one look to the next, with Python 700 or 2000: loading and searching make hundreds of thousands that
stay, and hardly a cycle; to look for them takes a twentieth of an answer's time."""


def collect_seldom() -> None:
    """Look less often."""
    gc.set_threshold(_PACE)


def pass_over_what_is_loaded() -> None:
    """Look no more at what there is now, modules most of all; nor does a look then copy their pages in a fork."""
    gc.freeze()


def clear_up() -> None:
    """Take away the cycles that there are, and look no more at what is left.

    Who must answer within milliseconds does so before: a look at all that is loaded takes 50 to 150 of them.
    """
    gc.collect()
    gc.freeze()
