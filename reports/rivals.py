"""Models side by side, as the page shows them: error with its paired interval, laws kept and broken, size."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from .wording import finite, pick_horizon

MARKS = {"better": "\N{DOWNWARDS ARROW}", "worse": "\N{UPWARDS ARROW}", "no difference": "=", "too short to tell": "?"}
"""Signs of a paired difference; one is never told by its colour alone."""


@dataclass(frozen=True, slots=True)
class Rival:
    """A model in the picture.

    Attributes
    ----------
    name, kind : as the comparison has them
    error : held-out position error of the predictions [m], NaN where they diverged
    interval : of the error, from the paired 95 % interval of its difference to the reference; None without one
    laws : verdict by law: pass, fail, noted, not applicable; empty when no law was asked
    audit : pass, fail or not run
    parameters : fitted numbers; None where the comparison does not say
    diverged, starts : predictions that ran away, of how many
    """

    name: str
    kind: str
    error: float
    interval: tuple[float, float] | None
    laws: dict[str, str]
    audit: str
    parameters: int | None
    diverged: int
    starts: int

    @property
    def broken(self) -> int:
        """How many laws that count it breaks."""
        return sum(verdict == "fail" for verdict in self.laws.values())


def rivals(comparison: Mapping[str, Any], audits: Mapping[str, Mapping[str, Any]]) -> list[Rival]:
    """Every compared model, the smallest prediction error first, those that ran away last."""
    horizon, reference = hero_horizon(comparison), reference_of(comparison)
    models = comparison["models"]
    base = next((_error(model, horizon) for model in models if model["name"] == reference), float("nan"))
    found = []
    for model in models:
        name = str(model["name"])
        score = (model.get("rollout") or {}).get(horizon) or {}
        told = difference(comparison, name, reference, "rollout", "position", horizon)
        low, high = (finite(end) for end in ((told or {}).get("ci95") or (None, None)))
        interval = (max(base + low, 0.0), max(base + high, 0.0)) if low <= high and base == base else None
        found.append(
            Rival(
                name,
                str(model.get("kind", "")),
                _error(model, horizon),
                interval,
                {str(law["law"]): verdict_of(law) for law in laws_of(model, audits)},
                str(model.get("audit", "not run")),
                model.get("parameters") if isinstance(model.get("parameters"), int) else None,
                int(finite(score.get("diverged")) if score.get("diverged") else 0),
                int(finite(score.get("starts")) if score.get("starts") else 0),
            )
        )
    return sorted(found, key=lambda rival: (rival.error != rival.error, rival.error))


def laws_of(model: Mapping[str, Any], audits: Mapping[str, Mapping[str, Any]]) -> Sequence[Mapping[str, Any]]:
    """The laws of a compared model, from the comparison, or from an audit of that model beside it."""
    return model.get("laws") or (audits.get(str(model["name"])) or {}).get("laws") or []


def verdict_of(law: Mapping[str, Any]) -> str:
    """A law's verdict in one word; a broken law that does not count is noted."""
    if law.get("verdict") == "fail" and not law.get("counts", True):
        return "noted"
    return str(law.get("verdict"))


def hero_horizon(comparison: Mapping[str, Any]) -> str:
    """The horizon [s] by which the models are drawn: 10 s where it is there."""
    return pick_horizon(
        list(dict.fromkeys(key for model in comparison["models"] for key in model.get("rollout") or {}))
    )


def reference_of(comparison: Mapping[str, Any]) -> str:
    """The model against which the others are told: the corrected one where there is one, else the first."""
    names = [str(model["name"]) for model in comparison["models"]]
    against = [str(item.get("against")) for item in comparison.get("differences") or []]
    return next((name for name in ("corrected", "calibrated", "nominal") if name in against), names[0] if names else "")


def difference(
    comparison: Mapping[str, Any], model: str, against: str, quantity: str, axis: str, horizon: str | None = None
) -> Mapping[str, Any] | None:
    """The paired difference of a model to another in one error; None where it was not told."""
    wanted = (model, against, quantity, axis, horizon)
    for item in comparison.get("differences") or []:
        given = item.get("horizon")
        key = (item.get("model"), item.get("against"), item.get("quantity"), item.get("axis"), given and str(given))
        if key == wanted:
            return item
    return None


def mark(told: Mapping[str, Any] | None) -> str:
    """The sign of a paired difference; nothing where there is none."""
    return MARKS.get(str(told.get("verdict")), "") if told else ""


def _error(model: Mapping[str, Any], horizon: str) -> float:
    return finite(((model.get("rollout") or {}).get(horizon) or {}).get("position"))
