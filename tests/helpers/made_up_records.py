"""Records of studies as their answers would leave them, made up: claims are true more often where they are strong."""

from typing import Any

import numpy as np

NAMES = ("surge_quadratic_damping", "sway_lift", "munk_moment", "yaw_trim", "thruster_lag", "cg_offset")


def claim(key: str, label: str = "true", **facts: Any) -> dict[str, Any]:
    """A claim that nothing speaks against; facts are its gain, identity, force, rollout, null_excluded and tests."""
    term = {"symbol": "Y_ur", "value": 1.0, "ci95": [0.9, 1.1], "truth": 1.05}
    worth = {"force": facts.pop("force", 0.8), "rollout": facts.pop("rollout", None)}
    content = {"gain": 400.0, "identity": 40.0, "rival": "", "worth": worth, "null_excluded": True, "tests": {}}
    given = {"verdict": "missing", "kept": True, "reason": "", "odds": 0.99, "alike": [], "terms": [term]}
    return {"key": key, "label": label, **given, "claim": {**content, **facts}}


def record(study: str = "plain", kind: str = "singles", seed: int = 0, **changes: Any) -> dict[str, Any]:
    """A log with sway lift in it that was answered exactly, with changes."""
    truth = {"note": "rich, field", "true": ["sway_lift"], "part": [], "sensors_true": [], "nameless": False}
    truth |= {"dominant": "sway_lift", "matters": 0.3, "forces": [], "tellable": None, "seconds": 2.0}
    said = {"verdict": "missing", "missing": ["sway_lift"], "likely": [], "first": "sway_lift", "unnamed": []}
    said |= {"sensors": [], "sensors_possible": [], "sensors_clear": ["gyro_bias"], "rests": [], "forms": []}
    facts = {"claims": [claim("sway_lift")], "unclaimed": 36, "nearly": [], "reasons": {}}
    return {"study": study, "kind": kind, "seed": seed, **truth, **said, **facts, **changes}


def drawn(logs: int, seed: int = 0) -> list[dict[str, Any]]:
    """Logs of plain and nameless worlds whose claims are the stronger the likelier they are true."""
    rng = np.random.default_rng(seed)
    return [_drawn(number, rng) for number in range(logs)]


def _drawn(number: int, rng: np.random.Generator) -> dict[str, Any]:
    hidden = str(rng.choice(NAMES))
    nameless = number % 3 == 2
    key = str(rng.choice(NAMES)) if nameless or rng.random() < 0.2 else hidden
    true = key == hidden and not nameless
    facts = {
        "gain": float(np.exp(rng.normal(5.0 if true else 3.5))),
        "identity": float(rng.normal(20.0 if true else 4.0, 8.0)),
        "force": float(rng.beta(5, 2) if true else rng.beta(2, 3)),
        "tests": {
            "file_value": 0.1,
            "unexplained": float(rng.exponential(0.2 if true else 0.8)),
            "accused": float(number % 2),
        },
    }
    made = claim(key, "true" if true else "false", **facts)
    study, kind = ("nameless", ("a net", "gusts", "a tether")[number % 9 // 3]) if nameless else ("plain", "singles")
    reasons = {} if true else {key: "lasting_rest"}
    truth = {"true": [] if nameless else [hidden], "nameless": nameless, "claims": [made], "reasons": reasons}
    return record(study, kind, number, **truth)
