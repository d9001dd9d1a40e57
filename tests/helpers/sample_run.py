"""A made-up run: a boat with quadratic drag and a weak thruster, a nominal model without; one name is only likely."""

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from undertow.comparison.failing.failures import Structure, structure_of
from undertow.comparison.failing.places import LIMIT, segments, worst_places
from undertow.comparison.failing.rows import scene
from undertow.discovery.findings import FailingPlace, Removal
from undertow.residuals.series import SeriesTable

RATE = 10
LIKELY = "sway_quadratic_damping"
"""The effect of the sample that is only likely."""
ODDS = (0.999, 0.985, 0.971, 0.87)
"""How sure the effects of the sample are, in their order."""
NOMINAL = {"X_u": -15.0, "X_uu": 0.0, "N_r": -6.0, "N_rr": 0.0, "Y_v": -40.0, "Y_vv": 0.0, "stbd": 1.0}
TRUTH = {**NOMINAL, "X_uu": -8.0, "N_rr": -8.0, "Y_vv": -80.0, "stbd": 0.8}
EFFECTS = {
    "surge_quadratic_damping": ("X_uu", "surge", "u|u|", "N s^2/m^2", "X += X_uu u_r |u_r|", "hull"),
    "thruster_asymmetry": ("stbd_scale", "surge", "T_stbd", "1", "T_stbd *= stbd_scale", "thruster"),
    "yaw_quadratic_damping": ("N_rr", "yaw", "r|r|", "N m s^2/rad^2", "N += N_rr r |r|", "hull"),
    "sway_quadratic_damping": ("Y_vv", "sway", "v|v|", "N s^2/m^2", "Y += Y_vv v_r |v_r|", "hull"),
}


def failures(series: SeriesTable, model: str = "before", *, limit: int = LIMIT) -> list[FailingPlace]:
    """The few regimes that hold far more of the squared acceleration error than of the time, worst first."""
    stage = scene(series, model)
    return [found.place(stage, model) for found in worst_places(stage, limit)]


def structure(series: pd.DataFrame, name: str, which: str) -> Structure:
    """What the error of a model is like."""
    stage = scene(SeriesTable.of(series), which)
    push = series[["newton_port", "newton_stbd"]].to_numpy()
    thrust = np.column_stack([push.sum(axis=1), 0.0 * push[:, 0], 0.3 * (push[:, 0] - push[:, 1])]) / 30.0
    removed = (Removal(effect="surge_quadratic_damping", share_removed=0.8, sentence="it removes 80 % of it"),)
    worst = [one.seconds(stage).but(removed_by=removed if which == "before" else ()) for one in segments(stage)]
    return structure_of(stage, thrust, name, "all").but(segments=tuple(worst))


def acceleration(state, command, p):
    """Diagonal 3-DOF model; state (u, v, r), command newtons on (port, starboard)."""
    u, v, r = state
    port, stbd = command[0], p["stbd"] * command[1]
    x = port + stbd + p["X_u"] * u + p["X_uu"] * u * abs(u) + 48.5 * v * r
    y = p["Y_v"] * v + p["Y_vv"] * v * abs(v) - 33.5 * u * r
    n = 0.295 * (port - stbd) + p["N_r"] * r + p["N_rr"] * r * abs(r) - 15.0 * u * v
    return np.array([x / 33.5, y / 48.5, n / 8.5])


def simulate(start, commands, p):
    """Rows of (u, v, r, psi, north, east); states and commands may be those of many pieces, side by side."""
    rows, state = [], np.array(start, float)
    for command in commands:
        rows.append(state.copy())
        for _ in range(4):
            u, v, _r, psi = state[:4]
            rates = acceleration(state[:3], command, p)
            way = (u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi))
            state = state + 0.25 / RATE * np.array([*rates, state[2], *way])
    return np.array(rows)


def predicted(truth, commands, p):
    """The same, put back on the truth every 10 s: all pieces at once, (row of a piece, state, piece)."""
    length = 10 * RATE
    starts, pieces = truth[::length].T, commands.reshape(-1, length, 2).transpose(1, 2, 0)
    return simulate(starts, pieces, p).transpose(2, 0, 1).reshape(-1, 6)


def write_sample(folder: Path, seconds: float = 300.0) -> Path:
    """A run folder as `discover` writes it, from a simulated boat."""
    rng = np.random.default_rng(1)
    count = int(seconds * RATE)
    levels = rng.uniform(-0.4, 1.0, (count // 80 + 1, 1)) * 30.0 + rng.uniform(-12.0, 12.0, (count // 80 + 1, 2))
    commands = np.repeat(levels, 80, axis=0)[:count]
    truth = simulate(np.zeros(6), commands, TRUTH)
    truth[:, :3] += rng.normal(0.0, 0.008, (count, 3))
    fitted = {**TRUTH, "X_uu": -7.8, "N_rr": -8.3, "Y_vv": -74.0, "stbd": 0.806}
    stages = [NOMINAL]
    for symbol in ("X_uu", "stbd", "N_rr", "Y_vv"):
        stages.append({**stages[-1], symbol: fitted[symbol]})
    part = np.where(
        np.arange(count) < 0.7 * count, "train", np.where(np.arange(count) < 0.85 * count, "validation", "test")
    )
    measured = acceleration(truth[:, :3].T, commands.T, TRUTH).T
    measured = measured + rng.normal(0.0, 0.01, measured.shape)
    series = pd.DataFrame(truth, columns=["u", "v", "r", "psi", "north", "east"])
    series = pd.concat([pd.DataFrame({"time": np.arange(count) / RATE, "log": 0, "part": part}), series], axis=1)
    series["newton_port"], series["newton_stbd"] = commands.T
    series[["u_dot", "v_dot", "r_dot"]] = measured
    steps = []
    accelerations = ("u_dot", "v_dot", "r_dot")
    for index, p in enumerate(stages):
        motion = predicted(truth, commands, p)
        along = acceleration(truth[:, :3].T, commands.T, p).T
        name = {0: "before", len(stages) - 1: "after"}.get(index)
        if name:
            series[[f"{key}_{name}" for key in accelerations]] = along
            series[[f"{key}_{name}" for key in ("u", "v", "r")]] = motion[:, :3]
            series[[f"north_{name}", f"east_{name}"]] = motion[:, 4:]
        off, wrong = (motion - truth)[part == "test"], (along - measured)[part == "test"]
        rollout: dict[str, float] = dict(
            zip(("surge", "sway", "yaw"), np.sqrt((off[:, :3] ** 2).mean(0)).round(5), strict=True)
        )
        rollout["position"] = round(float(np.sqrt((off[:, 4:] ** 2).sum(1).mean())), 5)
        pointwise = dict(zip(("surge", "sway", "yaw"), np.sqrt((wrong**2).mean(0)).round(5), strict=True))
        steps.append(
            {
                "added": None if index == 0 else list(EFFECTS)[index - 1],
                "acceleration_rmse": pointwise,
                "rollout_rmse": {"2": rollout, "10": rollout, "30": rollout},
            }
        )
    series[["X_residual", "Y_residual", "N_residual"]] = (
        measured - series[["u_dot_before", "v_dot_before", "r_dot_before"]].to_numpy()
    ) * [33.5, 48.5, 8.5]
    folder.mkdir(parents=True, exist_ok=True)
    series.round(5).to_csv(folder / "series.csv", index=False)
    table = SeriesTable.of(series)
    places = {"nominal": failures(table, "before"), "corrected": failures(table, "after")}
    values = {"X_uu": -7.8, "N_rr": -8.3, "Y_vv": -74.0, "stbd_scale": 0.806}
    candidates = []
    for rank, (effect, (symbol, axis, form, unit, equation, family)) in enumerate(EFFECTS.items()):
        value = values[symbol]
        term = {
            "symbol": symbol,
            "axis": axis,
            "form": form,
            "value": value,
            "unit": unit,
            "ci95": [value - 0.04 * abs(value), value + 0.04 * abs(value)],
            "in_model": value,
        }
        sentence = f"The boat shows {effect.replace('_', ' ')} that the nominal model does not have."
        candidates.append(
            {
                "effect": effect,
                "sentence": sentence,
                "family": family,
                "verdict": "likely" if effect == LIKELY else "missing",
                "confidence": ODDS[rank],
                "error_drop": 0.55 / (rank + 1) ** 1.3,
                "claim": {
                    "gain": 60.0 / (rank + 1),
                    "identity": 8.0 - 2.0 * rank,
                    "rival": "sway_linear_damping" if effect == LIKELY else "",
                    "worth": {"force": 0.5 / (rank + 1) ** 1.3, "rollout": 0.8 / (rank + 1)},
                    "null_excluded": True,
                },
                "indistinguishable_from": ["input_delay"] if rank == 1 else [],
                "equation": equation,
                "terms": [term],
            }
        )
    for rank, effect in enumerate(
        (
            "munk_moment",
            "steady_current",
            "wake_memory",
            "surge_turn_drag",
            "thrust_dead_zone",
            "cg_offset",
            "yaw_trim",
            "input_delay",
            "advance_loss",
            "mean_wind",
        )
    ):
        terms = [{"symbol": "N_uv", "axis": "yaw", "form": "uv", "value": -1.2, "unit": "N s^2/m", "ci95": [-2.6, 0.3]}]
        candidates.append(
            {
                "effect": effect,
                "sentence": "",
                "family": "coupling",
                "verdict": "possible" if rank < 2 else "no evidence",
                "confidence": 0.7 / (rank + 1),
                "error_drop": 0.03 / (rank + 1) - 0.005,
                "indistinguishable_from": [],
                "equation": "N += ...",
                "terms": terms,
            }
        )
    findings = {
        "schema": "undertow.findings/2",
        "verdict": "missing",
        "headline": "The model lacks quadratic drag in surge, sway and yaw, and the starboard thruster is weak (81 %).",
        "criterion": {
            "materiality": 0.02,
            "material": "a held-out gain in every block, and 2 % of the force scale of its axis",
        },
        "missing": [effect for effect in EFFECTS if effect != LIKELY],
        "likely": [LIKELY],
        "candidates": candidates,
        "unnamed": [{"axis": "yaw", "form": "u|r|", "value": -1.2, "ci95": [-1.5, -0.9]}],
        "steps": steps,
        "failures": [place.to_dict() for place in places["nominal"]],
        "advice": [{"manoeuvre": "20/20 zigzag astern", "why": "would tell u|r| from ur"}],
        "data": {
            "rows": count,
            "seconds": seconds,
            "split": "chronological 70/15/15",
            "notes": ["frame ENU, converted", "commands lead the velocities by 0.02 s"],
        },
    }
    comparison = {
        "schema": "undertow.comparison/1",
        "split": "test",
        "logs": ["B_2.csv.gz"],
        "models": [
            {
                "name": name,
                "kind": "physics",
                "acceleration": {"rmse": step["acceleration_rmse"], "mae": {}, "r2": {}},
                "rollout": step["rollout_rmse"],
                "audit": "pass",
                "parameters": 12,
                "seconds_to_fit": 1.3,
            }
            for name, step in (("nominal", steps[0]), ("corrected", steps[-1]))
        ],
        "failures": [place.but(model=name).to_dict() for name, found in places.items() for place in found],
        "structure": [structure(series, *pair).to_dict() for pair in (("nominal", "before"), ("corrected", "after"))],
    }
    thruster = {
        "x": -0.488,
        "angle": 0.0,
        "command": "newton",
        "curve": {"kind": "table", "command": [-35.0, 0.0, 35.0], "force": [-35.0, 0.0, 35.0]},
    }
    nominal = {
        "name": "Gazebo BlueBoat",
        "mass": 30.5,
        "inertia_z": 6.0,
        "added_mass": {"X_udot": -3.0, "Y_vdot": -18.0, "N_rdot": -2.5},
        "damping": {"X_u": -15.0, "Y_v": -40.0, "N_r": -6.0},
        "thrusters": [{"name": "port", "y": -0.295, **thruster}, {"name": "stbd", "y": 0.295, **thruster}],
    }
    model = copy.deepcopy(nominal)
    model["damping"] |= {"X_uu": -7.8, "N_rr": -8.3, "Y_vv": -74.0}
    model["thrusters"][1]["scale"] = 0.806
    channel = {"name": "u", "unit": "m/s", "origin": "u", "count": 6000, "start": 0.0, "end": 300.0, "rate": 20.0}
    channel |= {"gaps": 0, "longest_gap": None, "minimum": -1.5, "maximum": 1.7, "noise": 0.0152}
    pair = {"first": "the turning of the heading", "second": "the yaw rate r", "sentence": "late"}
    offsets = [pair | {"offset": 0.002}, pair | {"offset": -0.11}, pair | {"offset": None}]
    plan = {"recipe": {}, "rate": 10.0, "segments": [{"start": 0.0, "end": 300.0, "rows": 3000}]}
    still = [0.0, 0.0]
    activity = {"seconds": 300.0, "u": still, "v": still, "r": still, "sentences": []}
    activity |= dict.fromkeys(("astern", "turning_to_starboard", "turning_to_port"), 0.0)
    one = {"schema": "undertow.inspection/1", "path": "lake/one.csv", "channels": [channel], "plan": plan}
    one |= {"alignment": offsets, "excitation": activity}
    two = one | {"path": "lake/two.csv", "excitation": None, "alignment": []}
    two |= {"channels": [channel | {"gaps": 3, "longest_gap": 1.25}, channel | {"name": "pwm_port", "gaps": 9}]}
    inspection = {"schema": "undertow.inspections/1", "logs": [one, two]}
    for name, content in {"findings": findings, "comparison": comparison, "inspection": inspection}.items():
        (folder / f"{name}.json").write_text(json.dumps(content))
    (folder / "nominal.yaml").write_text(yaml.safe_dump(nominal))
    (folder / "model.yaml").write_text(yaml.safe_dump(model))
    return folder


def edit(path: Path, change: Any) -> None:
    """Change the content of a JSON file in place."""
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))


def as_first_version(folder: Path) -> Path:
    """Rewrite the findings of a run as an earlier version wrote them: nothing likely, and shares of resamples."""

    def strip(findings: dict[str, Any]) -> None:
        findings["schema"] = "undertow.findings/1"
        findings["missing"] += findings.pop("likely")
        for item in findings["candidates"]:
            item.pop("claim", None)
            item["confidence"] = 0.999
            if item["verdict"] == "likely":
                item["verdict"] = "missing"

    edit(folder / "findings.json", strip)
    return folder


LAWS = ("positive mass", "dissipation", "rest stays at rest", "bounded speed", "mirror symmetry")
RIVALS = {  # kind, laws broken, times the corrected model's error, fitted values
    "zero acceleration": ("baseline", None, 9.0, 0),
    "hold velocity": ("baseline", None, 7.0, 0),
    "lstm": ("hybrid", (), 1.02, 5123),
    "tcn": ("network", ("dissipation", "bounded speed"), 0.8, 9870),
    "boats.mine:drag": ("physics", ("rest stays at rest",), None, 3),
}


def law(name: str, verdict: str = "pass", **more: Any) -> dict[str, Any]:
    """One law as `audit.json` has it."""
    worst = {"value": 13.1 if verdict == "fail" else -0.5, "unit": "W", "at": {"u": 1.9, "v": 0.2, "r": -0.8}}
    margin = {"value": -worst["value"], "unit": "W"}
    told = f"The <{name}> is {'broken' if verdict == 'fail' else 'kept'}."
    return {
        "law": name,
        "verdict": verdict,
        "worst": worst,
        "margin": margin,
        "proof": "search",
        "sentence": told,
    } | more


def compare_many(folder: Path) -> None:
    """Put two baselines and three more models into the comparison of a run, with laws and paired differences."""

    def change(comparison: dict[str, Any]) -> None:
        base = comparison["models"][-1]
        inside = {"rows": 100, "rmse": {"surge": 0.01, "sway": 0.02, "yaw": 0.03}}
        for model in comparison["models"]:
            model["laws"] = [law(name) for name in LAWS]
        for name, (kind, broken, factor, size) in RIVALS.items():
            model = copy.deepcopy(base) | {"name": name, "kind": kind, "parameters": size, "seconds_to_evaluate": 0.2}
            model["audit"] = "not run" if broken is None else "fail" if broken else "pass"
            model["laws"] = (
                [law(each, "fail" if each in broken else "pass") for each in LAWS] if broken is not None else []
            )
            model["domain"] = {"inside": inside, "outside": inside if kind == "hybrid" else {"rows": 0, "rmse": None}}
            for errors in model["rollout"].values():
                errors |= {axis: None if factor is None else value * factor for axis, value in errors.items()}
                errors |= {"diverged": 4 if factor is None else 0, "starts": 9}
            comparison["models"].append(model)
        position = base["rollout"]["10"]["position"]
        verdicts = {"lstm": ("no difference", -0.03, 0.06), "tcn": ("better", -0.3, -0.1)}
        comparison["differences"] = [
            {
                "model": name,
                "against": "corrected",
                "quantity": "rollout",
                "horizon": "10",
                "axis": "position",
                "difference": 0.5 * (low + high) * position,
                "relative": 0.5 * (low + high),
                "ci95": [low * position, high * position],
                "unit": "m",
                "verdict": verdict,
                "blocks": 23,
            }
            for name, (verdict, low, high) in verdicts.items()
        ]
        comparison["best"] = {"model": "corrected", "sentence": "Trust the corrected model: the tcn breaks two laws."}
        comparison["notes"] = ["Nothing was calibrated: the log tells none of the nominal model's numbers."]

    edit(folder / "comparison.json", change)
