"""What a check says: a verdict, a number with its unit, what follows from it, and what to do."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, ClassVar, Literal

from ..canonical import Channel
from .record import Record

Verdict = Literal["ok", "note", "warning", "defect", "cannot tell"]
SEVERITY: tuple[Verdict, ...] = ("defect", "warning", "cannot tell", "note", "ok")
"""The verdicts, worst first. A defect makes results wrong; a warning makes them worse; a note is good to know."""

Channels = Mapping[str, Channel]


class Reach(Enum):
    """How much of what is found in a log a defect makes wrong."""

    NUMBERS = "numbers come out worse; what is named stays right"
    SECONDS = "false motion in some seconds; the rest of the log is sound"
    LOG = "nothing found in the log is about the boat, so that it is refused"


@dataclass(frozen=True, slots=True)
class Fix:
    """A safe remedy: what it does, in words, and the function that does it to the channels of a log."""

    sentence: str
    apply: Callable[[Channels], dict[str, Channel]]


@dataclass(frozen=True, slots=True)
class Finding:
    """One result of one check.

    Attributes
    ----------
    check : name of the check
    verdict : see `SEVERITY`
    sentence : what was found, with its number
    value, unit : the number; None where there is nothing to measure
    ci95 : its 95 % interval, None where none can be given
    channels : canonical channels concerned
    consequence : what goes wrong if it stays
    remedy : what to do about it
    fix : what `--fix` does about it; None where only a person should
    parts : further numbers by name, such as the coefficients of a curve
    short : the sentence in a few words, for the verdict on the log; empty for the sentence itself
    reach : how much a defect makes wrong
    """

    check: str
    verdict: Verdict
    sentence: str
    value: float | None = None
    unit: str = ""
    ci95: tuple[float, float] | None = None
    channels: tuple[str, ...] = ()
    consequence: str = ""
    remedy: str = ""
    fix: Fix | None = None
    parts: Mapping[str, float | str] = field(default_factory=dict)
    short: str = ""
    reach: Reach = Reach.NUMBERS

    @property
    def refused(self) -> bool:
        """Whether a log with this finding is refused by whoever computes with it."""
        return self.verdict == "defect" and self.reach is Reach.LOG

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain values, fit for strict JSON."""
        return {
            "check": self.check,
            "verdict": self.verdict,
            "value": self.value,
            "unit": self.unit,
            "ci95": None if self.ci95 is None else list(self.ci95),
            "channels": list(self.channels),
            "sentence": self.sentence,
            "consequence": self.consequence,
            "remedy": self.remedy,
            "fix": None if self.fix is None else self.fix.sentence,
            "parts": dict(self.parts),
        }


class Check(ABC):
    """One question about the quality of logs of one boat."""

    name: ClassVar[str]

    @abstractmethod
    def examine(self, records: Sequence[Record]) -> list[Finding]:
        """Answer for one log, or for several logs together.

        Parameters
        ----------
        records : as the checks before this one left them; a `Fix` is asked for only where there is one record

        Returns
        -------
        list of Finding
            At least one; "cannot tell" where the logs do not show it, none where the question makes no sense.
        """
