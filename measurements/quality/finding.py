"""A finding of a check: a verdict, a number with its unit, what follows from it, and what to do."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, PlainSerializer

from ...physics import file_records
from ...physics.file_records import Number
from ..canonical import Channel, is_canonical
from ..channels.channel_map import Entry
from .record import Record

Verdict = Literal["ok", "note", "warning", "defect", "cannot tell"]
SEVERITY: tuple[Verdict, ...] = ("defect", "warning", "cannot tell", "note", "ok")
"""The verdicts, worst first. A defect makes results wrong; a warning makes them worse; a note is good to know."""

Channels = Mapping[str, Channel]


def altered(channels: Channels, names: Collection[str], change: Callable[[Channel], Channel]) -> dict[str, Channel]:
    """All channels of a log, those of some names changed; for `Fix`."""
    return {name: change(channel) if name in names else channel for name, channel in channels.items()}


class Reach(Enum):
    """How much of what is found in a log a defect makes wrong."""

    NUMBERS = "numbers come out worse; what is named stays right"
    SECONDS = "false motion in some seconds; the rest of the log is sound"
    LOG = "nothing found in the log is about the boat, so that it is refused"


@dataclass(frozen=True, slots=True)
class Fix:
    """A safe remedy: what it does, in words, and the function that does it to the channels of a log.

    Of a file, and of what another process found, only the words are known, and nothing is done.
    """

    sentence: str
    apply: Callable[[Channels], dict[str, Channel]] = dict

    def __reduce__(self) -> tuple[type, tuple[str]]:
        return Fix, (self.sentence,)


FixInWords = Annotated[
    Fix,
    BeforeValidator(lambda fix: Fix(fix) if isinstance(fix, str) else fix),
    PlainSerializer(lambda fix: fix.sentence, return_type=str),
]


class Finding(file_records.Record):
    """One result of one check.

    Attributes
    ----------
    check : name of the check
    verdict : see `SEVERITY`
    value, unit : the number; None where there is nothing to measure
    ci95 : its 95 % interval, None where none can be given
    channels : canonical channels concerned
    sentence : what was found, with its number
    consequence : what goes wrong if it stays
    remedy : what to do about it
    fix : what `--fix` does about it; None where only a person should
    parts : further numbers by name, such as the coefficients of a curve
    short : the sentence in a few words, for the verdict on the log; empty for the sentence itself; in no file
    reach : how much a defect makes wrong; in no file
    mends : lines of a channel map that put it right, None to leave a channel out; in no file, for `inspect --map-out`
        writes them into one
    """

    check: str
    verdict: Verdict
    value: Number | None = None
    unit: str = ""
    ci95: tuple[Number, Number] | None = None
    channels: tuple[str, ...] = ()
    sentence: str
    consequence: str = ""
    remedy: str = ""
    fix: FixInWords | None = None
    parts: Mapping[str, float | str] = {}
    short: str = Field(default="", exclude=True)
    reach: Reach = Field(default=Reach.NUMBERS, exclude=True)
    mends: Mapping[str, Entry | None] = Field(default_factory=dict, exclude=True)

    @property
    def refused(self) -> bool:
        """True when a log with this finding is refused by whoever computes with it."""
        return self.verdict == "defect" and self.reach is Reach.LOG

    @property
    def told(self) -> str:
        """What was found and what follows, as whole sentences."""
        return " ".join(f"{_capital(text)}." for text in (self.sentence, self.consequence) if text)

    @property
    def cure(self) -> str:
        """The remedy as a sentence without its end; empty where there is none."""
        return _capital(self.remedy)


def _capital(text: str) -> str:
    """Text with a capital letter, but not where it opens with the name of a channel.

    Examples
    --------
    >>> _capital("the gyro is late"), _capital("r is in degrees"), _capital("RCOU.C1 is reversed")
    ('The gyro is late', 'r is in degrees', 'RCOU.C1 is reversed')
    """
    word = text.split(" ")[0]
    return text if is_canonical(word) or not word.islower() else text[:1].upper() + text[1:]


@dataclass(frozen=True, slots=True)
class Check:
    """One question about the quality of logs of one boat.

    Attributes
    ----------
    name : of the question
    examine : answers it for one log, or for several logs together, as the checks before this one left them: at least
        one finding, "cannot tell" where the logs do not show it, none where the question makes no sense. A `Fix` is
        asked for only where there is one record
    """

    name: str
    examine: Callable[[Sequence[Record]], list[Finding]]
