"""What a log can show and tell apart about one model: which candidates it excites, and which move alike."""

import math
from collections.abc import Mapping
from typing import Annotated

from pydantic import BeforeValidator, Strict

from ...physics.file_records import Number, Record
from ...physics.presentation import words

Ratio = Annotated[float, BeforeValidator(lambda value: math.inf if value is None else value), Strict()]
"""A ratio that JSON has as null where it is infinite."""


class Excitation(Record):
    """How strongly a log would show one candidate.

    Attributes
    ----------
    share : root mean square force of a plausible amount, over the force scale of the axis on which it is largest
    signal_to_noise : of its clearest column, all axes together; infinite where sensor noise does not enter
    """

    share: Number
    signal_to_noise: Ratio = math.inf


class Identifiability(Record):
    """What a log can show and tell apart about one model.

    Attributes
    ----------
    groups : keys of candidates that move alike, each with a canonical correlation above 0.98 with another of its group;
        without effects of which simpler ones are special cases
    dormant : keys of candidates of which a plausible amount leaves no material force
    absorbed : keys of candidates of which a plausible amount leaves none beside what calibration can explain
    noise_limited : keys of candidates whose columns are hardly more than sensor noise
    quiet_axes : those on which hardly anything but sensor noise is at work
    condition : of the matrix of all other columns, each scaled to length one; None when there are none. All thrusters'
        common scale is left out beside those of each thruster, whose sum it is, and so is the thrust curve.
    excitation : by key of the candidate
    """

    groups: tuple[tuple[str, ...], ...] = ()
    dormant: tuple[str, ...] = ()
    absorbed: tuple[str, ...] = ()
    noise_limited: tuple[str, ...] = ()
    quiet_axes: tuple[str, ...] = ()
    condition: Number | None = None
    excitation: Mapping[str, Excitation] = {}

    def alike(self, key: str) -> tuple[str, ...]:
        """The other candidates in the group of a candidate."""
        return tuple(other for group in self.groups if key in group for other in group if other != key)

    @property
    def sentence(self) -> str:
        """What the log cannot show or tell apart, for a line of progress."""
        blind = [words(key) for key in (*self.dormant, *self.absorbed, *self.noise_limited)]
        groups = [" and ".join(map(words, group)) for group in self.groups]
        told = [f"does not show {', '.join(blind)}"] if blind else []
        told += [f"hardly tells apart {'; '.join(groups)}"] if groups else []
        return (
            f"before the search: this log {', and '.join(told) or 'shows every effect, and no two of them move alike'}"
        )
