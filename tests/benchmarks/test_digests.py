"""Answers frozen and compared: what differs is found and shown, what is the same is not."""

import importlib
from types import ModuleType

import pytest
from places import ROOT


@pytest.fixture
def digests(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    return importlib.import_module("digests")


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        ({"a": [1.0, 2.0]}, {"a": [1.0, 2.0 + 1e-10]}, []),
        ({"a": [1.0, 2.0]}, {"a": [1.0, 2.00001]}, ["/a/1: 2.0 -> 2.00001"]),
        ({"a": [1.0]}, {"a": [1.0, 2.0]}, ["/a: '[1.0]' -> '[1.0, 2.0]'"]),
        ({"a": 1.0}, {"b": 1.0}, ["/a: '1.0' -> 'None'", "/b: 'None' -> '1.0'"]),
        ({"a": "one\ntwo"}, {"a": "one\nthree"}, ["/a, line 2: 'two' -> 'three'"]),
        ({"a": "one\ntwo"}, {"a": "one\ntwo\nthree"}, ["/a, line 3: None -> 'three'"]),
        ({"a": float("nan")}, {"a": float("nan")}, []),
    ],
)
def test_a_difference_is_told_with_its_place(digests, before, after, told):
    assert list(digests.differences(before, after)) == told


def test_of_a_page_the_words_are_compared(digests):
    page = "<style>p { color: red }</style><p>Drag &amp; <b>lift</b></p><script>'no word'</script>"
    assert digests.text_of(page) == "Drag &\nlift"


def test_sixty_logs_and_more_are_asked_about_of_every_kind(digests):
    asked = digests.cases()
    assert len({case.name for case in asked}) == len(asked) >= 53  # and twelve real ones, where they lie there
    assert {case.study for case in asked} >= {"demo", *digests.TUNING}
