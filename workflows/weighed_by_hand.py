"""What a person added by name, weighed: its value with an interval, and what it does on rows that no fit saw."""

from dataclasses import replace

from ..comparison.what_decides import what_decides
from ..measurements.statistics.paired import Verdict, paired_ratio
from ..physics.in_words import listing, number, percent, unit_text, words
from ..reports.wording import interval, within
from ..residuals.scores import evaluate_all
from .log_on_bench import LogOnBench
from .workbench_facts import Card, Stand, Value

_TOLD: dict[Verdict, tuple[str, str]] = {
    "better": (
        "betters unseen rows",
        "On rows that the fit did not see, the model errs {by} less in {what} with it than without: more than chance.",
    ),
    "worse": (
        "worse on unseen rows",
        "On rows that the fit did not see, the model errs {by} more in {what} with it than without.",
    ),
    "no difference": (
        "cannot tell",
        "On rows that the fit did not see, the error in {what} differs by {by}, which is nothing or may be chance.",
    ),
    "too short to tell": (
        "cannot tell",
        "The log is too short to judge on rows that the fit did not see.",
    ),
}
"""Verdict on the card, and the sentence, by what the comparison on unseen rows says."""


def weighed(bench: LogOnBench, stand: Stand, name: str) -> Card:
    """The card of something in a model that no search has weighed.

    Parameters
    ----------
    stand : the model; numbers that were moved by hand count as they were fitted
    name : of the term or effect in it

    Raises
    ------
    RequestError
        as `LogOnBench.model` does.
    """
    whole = replace(stand, moved=())
    without = replace(whole, names=tuple(one for one in stand.names if one != name))
    before = {value.symbol: value.after for value in bench.fit(without).values}
    own = [value for value in bench.fit(whole).values if value.symbol == name or value.symbol not in before]
    errors = evaluate_all([bench.model(without), bench.model(whole)], bench.inputs.parts.judged)
    decides = what_decides(errors)
    found = paired_ratio(decides.squares[1], decides.squares[0], decides.shortest)
    verdict, sentence = _TOLD[found.verdict if decides.what else "too short to tell"]
    told = sentence.format(by=percent(abs(found.relative)), what=decides.what)
    unsure = [v for v in own if v.ci95 is not None and v.ci95[0] <= v.before <= v.ci95[1]]
    if unsure:
        inside = listing([f"{number(v.before)} in that of {v.symbol}" for v in unsure])
        verdict = "cannot tell"
        told = f"This log cannot tell: what the model has without it lies in the interval, {inside}. {told}"
    return Card(name, words(name), "", told, verdict, tuple(map(_number, own)))


def _number(value: Value) -> str:
    ends = "" if value.ci95 is None else f" (95 %: {interval(value.ci95)})"
    return f"{value.symbol} = {within(value.after, value.ci95)} {unit_text(value.unit)}".strip() + ends
