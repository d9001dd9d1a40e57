"""A model that is mostly made of doubted effects names nothing; one beside a doubted one or two does."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.discovery.candidates.candidate import Kind
from undertow.discovery.evidence.mostly_doubted import mostly_doubted
from undertow.discovery.evidence.weighing import Evidence

ONE = Evidence("sway_lift", Kind.EFFECT, True, 20.0, np.zeros(3), 0.5, 1.0, (), rollouts_object=False)


def model(*keys: str) -> list[Evidence]:
    return [replace(ONE, key=key) for key in keys]


@pytest.mark.parametrize(
    ("kept", "doubted", "many"),
    [
        ("abcd", "bcd", True),
        ("ab", "b", True),  # c and d were selected and are not sure
        ("abcd", "cd", False),  # as many are certain
        ("abcd", "", False),
    ],
)
def test_most_of_a_model_must_be_doubted(kept: str, doubted: str, many: bool) -> None:
    told = mostly_doubted(model(*"abcd"), kept, doubted)
    assert told == ("b, c and d" if many else "")


def test_one_or_two_doubted_effects_are_no_crowd() -> None:
    assert mostly_doubted(model("a", "b", "c"), "abc", "bc") == ""


def test_terms_without_a_name_and_what_was_not_selected_do_not_count() -> None:
    rest = [replace(ONE, key="c", selected=False), replace(ONE, key="yaw:v|v|", kind=Kind.TERM)]
    assert mostly_doubted([*model("a", "b"), *rest], "a", "") == ""
