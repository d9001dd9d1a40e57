"""Several runs side by side: which effects they share, which are of one boat, and whether their values agree."""

from collections.abc import Sequence
from dataclasses import dataclass

from ...discovery.found_effects import FoundEffect
from ..run_contents import RunFolder
from ..sureness import odds, verdict_word
from ..wording import effect_words
from .coefficients import CoefficientRow, coefficient_rows

_FOUND = ("missing", "likely")
"""Verdicts with which an effect counts as found in a run."""


@dataclass(frozen=True, slots=True)
class Shared:
    """One effect over several runs.

    Attributes
    ----------
    effect : its name in words, with the thruster where it concerns one
    values : of each run, the coefficients of the corrected vehicle where the effect is missing or likely; else none
    verdicts : of each run: missing, likely, possible, cannot tell, no evidence, or not judged
    odds : of each run, how sure that is, such as "87 %"; empty where nobody knows
    """

    effect: str
    values: tuple[tuple[CoefficientRow, ...], ...]
    verdicts: tuple[str, ...]
    odds: tuple[str, ...]

    @property
    def found_in(self) -> tuple[int, ...]:
        """Indices of the runs that miss it, or probably do."""
        return tuple(k for k, verdict in enumerate(self.verdicts) if verdict in _FOUND)

    @property
    def sure(self) -> bool:
        """Whether it is missing wherever it was found, and nowhere merely likely."""
        return all(self.verdicts[k] == "missing" for k in self.found_in)

    @property
    def symbols(self) -> tuple[str, ...]:
        """Its coefficients, in the order in which they were found."""
        return tuple(dict.fromkeys(row.symbol for rows in self.values for row in rows))

    def of(self, symbol: str) -> tuple[CoefficientRow | None, ...]:
        """A coefficient in each run."""
        return tuple(next((row for row in rows if row.symbol == symbol), None) for rows in self.values)

    def agree(self, symbol: str) -> bool | None:
        """True when the 95 % intervals of the coefficient have a value in common; None with fewer than two."""
        known = [row.interval for row in self.of(symbol) if row is not None]
        if len(known) < 2:
            return None
        return max(low for low, _ in known) <= min(high for _, high in known)


def shared_effects(runs: Sequence[RunFolder]) -> list[Shared]:
    """Every effect that some run misses or probably misses, those of most runs first, of these the sure ones."""
    found = [{effect_words(item): item for item in run.findings.candidates if item.verdict in _FOUND} for run in runs]
    names = {name: item.effect for one in found for name, item in one.items()}
    effects = [
        Shared(
            name,
            tuple(_values(one.get(name), run) for one, run in zip(found, runs, strict=True)),
            tuple(
                one[name].verdict if name in one else _verdict(run, name, effect)
                for one, run in zip(found, runs, strict=True)
            ),
            tuple(odds(one[name]) if name in one else "" for one in found),
        )
        for name, effect in names.items()
    ]
    return sorted(effects, key=lambda effect: (-len(effect.found_in), not effect.sure))


def told(effect: Shared, names: Sequence[str]) -> str:
    """Whether the runs agree about an effect, as a sentence."""
    holders = [names[k] for k in effect.found_in]
    if len(holders) == 1:
        return f"only {holders[0]}"
    both = "both runs" if len(names) == 2 else "all runs"
    whole = both if len(holders) == len(names) else f"{len(holders)} of {len(names)} runs"
    answers = {symbol: effect.agree(symbol) for symbol in effect.symbols}
    apart = [symbol for symbol, answer in answers.items() if answer is False]
    if apart:
        return f"{whole}; the 95 % intervals of {', '.join(apart)} do not overlap"
    return f"{whole}; the 95 % intervals overlap" if any(answers.values()) else whole


def _values(item: FoundEffect | None, run: RunFolder) -> tuple[CoefficientRow, ...]:
    """The coefficients of an effect that a run misses; none where it does not."""
    return () if item is None else tuple(coefficient_rows([item], [item.effect], run.nominal, run.corrected))


def _verdict(run: RunFolder, name: str, effect: str) -> str:
    """What a run says of an effect that it does not miss, or misses on another thruster."""
    items = [item for item in run.findings.candidates if item.effect == effect]
    item = next((item for item in items if effect_words(item) == name), items[0] if items else None)
    if item is None:
        return "not judged"
    return "no evidence" if item.verdict in _FOUND else verdict_word(item)
