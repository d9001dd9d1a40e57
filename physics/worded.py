"""Words of a closed list that carry a sentence each: files write the word, people read the sentence."""

from enum import Enum
from typing import Any


class Worded(Enum):
    """A list whose members are given as a word, which is their value, and a sentence."""

    sentence: str

    def __new__(cls, word: str, *_: Any) -> "Worded":
        """A member whose value is the word."""
        member = object.__new__(cls)
        member._value_ = word
        return member

    def __init__(self, _: str, sentence: str) -> None:
        self.sentence = sentence
