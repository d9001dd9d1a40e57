"""A model of which half is doubted names nothing; one beside a single doubted effect does."""

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
        ("abcd", "acd", True),
        ("abcd", "d", False),
        ("abcd", "", False),
    ],
)
def test_half_of_a_model_must_be_doubted(kept: str, doubted: str, many: bool) -> None:
    told = mostly_doubted(model(*"abcd"), kept, doubted)
    assert bool(told) == many


def test_a_single_doubted_effect_is_no_crowd() -> None:
    assert mostly_doubted(model("a", "b"), "ab", "b") == {}
    assert mostly_doubted(model(*"abcde"), "abcde", "de") == {}
    assert mostly_doubted(model(*"abcd"), "abcd", "cd") == {"a": "c and d", "b": "c and d"}


def test_terms_without_a_name_and_what_was_not_selected_do_not_count() -> None:
    rest = [replace(ONE, key="c", selected=False), replace(ONE, key="yaw:v|v|", kind=Kind.TERM)]
    assert mostly_doubted([*model("a", "b"), *rest], "a", "") == {}


def test_where_axes_are_fitted_apart_those_on_its_own_count() -> None:
    drag = replace(ONE, key="drag", share=np.array([0.3, 0.0, 0.001]))
    others = [replace(ONE, key=key, share=np.array([0.0, 0.0, 0.1])) for key in ("arm", "lift", "coupling")]
    found = [drag, *others]
    assert mostly_doubted(found, ("drag", "arm"), (), 0.007) == {"arm": "lift and coupling"}
    assert set(mostly_doubted(found, ("drag", "arm"), ())) == {"drag", "arm"}
