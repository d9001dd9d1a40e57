"""The report page of a made-up run: a boat with quadratic drag and a weak thruster, a nominal model without."""

import copy
import json
import re
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from undertow.physics.errors import RequestError
from undertow.physics.vehicle import load_vehicle
from undertow.reports.page import write_page
from undertow.reports.plotted import coefficient_rows, rollouts
from undertow.reports.regimes import failures
from undertow.reports.wording import typeset

RATE = 10
NOMINAL = {"X_u": -15.0, "X_uu": 0.0, "N_r": -6.0, "N_rr": 0.0, "Y_v": -40.0, "Y_vv": 0.0, "stbd": 1.0}
TRUTH = {**NOMINAL, "X_uu": -8.0, "N_rr": -8.0, "Y_vv": -80.0, "stbd": 0.8}
EFFECTS = {
    "surge_quadratic_damping": ("X_uu", "surge", "u|u|", "N s^2/m^2", "X += X_uu u_r |u_r|", "hull"),
    "thruster_asymmetry": ("stbd_scale", "surge", "T_stbd", "1", "T_stbd *= stbd_scale", "thruster"),
    "yaw_quadratic_damping": ("N_rr", "yaw", "r|r|", "N m s^2/rad^2", "N += N_rr r |r|", "hull"),
    "sway_quadratic_damping": ("Y_vv", "sway", "v|v|", "N s^2/m^2", "Y += Y_vv v_r |v_r|", "hull"),
}


def acceleration(state, command, p):
    """Diagonal 3-DOF model; state (u, v, r), command newtons on (port, starboard)."""
    u, v, r = state
    port, stbd = command[0], p["stbd"] * command[1]
    x = port + stbd + p["X_u"] * u + p["X_uu"] * u * abs(u) + 48.5 * v * r
    y = p["Y_v"] * v + p["Y_vv"] * v * abs(v) - 33.5 * u * r
    n = 0.295 * (port - stbd) + p["N_r"] * r + p["N_rr"] * r * abs(r) - 15.0 * u * v
    return np.array([x / 33.5, y / 48.5, n / 8.5])


def simulate(start, commands, p, restart=None):
    """Rows of (u, v, r, psi, north, east), put back on `restart` every 10 s where one is given."""
    rows, state = [], np.array(start, float)
    for index, command in enumerate(commands):
        if restart is not None and index % (10 * RATE) == 0:
            state = restart[index].copy()
        rows.append(state.copy())
        for _ in range(4):
            u, v, _r, psi = state[:4]
            rates = acceleration(state[:3], command, p)
            way = (u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi))
            state = state + 0.25 / RATE * np.array([*rates, state[2], *way])
    return np.array(rows)


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
    measured = np.array(
        [acceleration(state[:3], command, TRUTH) for state, command in zip(truth, commands, strict=True)]
    )
    measured = measured + rng.normal(0.0, 0.01, measured.shape)
    series = pd.DataFrame(truth, columns=["u", "v", "r", "psi", "north", "east"])
    series = pd.concat([pd.DataFrame({"time": np.arange(count) / RATE, "log": 0, "part": part}), series], axis=1)
    series["newton_port"], series["newton_stbd"] = commands.T
    series[["u_dot", "v_dot", "r_dot"]] = measured
    steps = []
    accelerations = ("u_dot", "v_dot", "r_dot")
    for index, p in enumerate(stages):
        motion = simulate(truth[0], commands, p, restart=truth)
        along = np.array([acceleration(state[:3], command, p) for state, command in zip(truth, commands, strict=True)])
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
    places = {"nominal": failures(series, "before"), "corrected": failures(series, "after")}
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
        }
        sentence = f"The boat shows {effect.replace('_', ' ')} that the nominal model does not have."
        candidates.append(
            {
                "effect": effect,
                "sentence": sentence,
                "family": family,
                "verdict": "missing",
                "confidence": 0.999 - 0.02 * rank,
                "error_drop": 0.55 / (rank + 1) ** 1.3,
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
        "schema": "undertow.findings/1",
        "verdict": "missing",
        "headline": "The model lacks quadratic drag in surge, sway and yaw, and the starboard thruster is weak (81 %).",
        "criterion": {
            "materiality": 0.02,
            "text": "a held-out gain in every block, and 2 % of the force scale of its axis",
        },
        "notes": ["commands lead the velocities by 0.02 s"],
        "missing": list(EFFECTS),
        "candidates": candidates,
        "unnamed": [{"axis": "yaw", "form": "u|r|", "value": -1.2, "ci95": [-1.5, -0.9]}],
        "steps": steps,
        "failures": places["nominal"],
        "advice": [{"manoeuvre": "20/20 zigzag astern", "why": "would tell u|r| from ur"}],
        "data": {
            "rows": count,
            "seconds": seconds,
            "split": "chronological 70/15/15",
            "notes": ["frame ENU, converted"],
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
        "failures": [{**place, "model": name} for name, found in places.items() for place in found],
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
    channel = {"name": "u", "unit": "m/s", "rate": 20.0, "gaps": 0, "longest_gap": None, "noise": 0.0152}
    offsets = [{"offset": 0.002, "sentence": "in step"}, {"offset": -0.11, "sentence": "late"}, {"offset": None}]
    plan = {"rate": 10.0, "segments": [{"start": 0.0, "end": 300.0, "rows": 3000}], "notes": [], "missing": []}
    one = {"schema": "undertow.inspection/1", "path": "lake/one.csv", "channels": [channel], "plan": plan}
    one |= {"alignment": offsets, "excitation": {"seconds": 300.0}}
    two = one | {"path": "lake/two.csv", "excitation": None, "alignment": []}
    two |= {"channels": [channel | {"gaps": 3, "longest_gap": 1.25}, {"name": "pwm_port", "gaps": 9}]}
    inspection = {"schema": "undertow.inspections/1", "logs": [one, two]}
    for name, content in {"findings": findings, "comparison": comparison, "inspection": inspection}.items():
        (folder / f"{name}.json").write_text(json.dumps(content))
    (folder / "nominal.yaml").write_text(yaml.safe_dump(nominal))
    (folder / "model.yaml").write_text(yaml.safe_dump(model))
    return folder


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    return write_sample(tmp_path_factory.mktemp("reports") / "run", seconds=120.0)


@pytest.fixture
def run(sample, tmp_path):
    """A copy of the sample that a test may spoil."""
    return Path(shutil.copytree(sample, tmp_path / "run", ignore=shutil.ignore_patterns("report.html")))


def edit(path, change):
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))


@pytest.fixture(scope="module")
def text(sample):
    return write_page(sample).read_text()


def test_page_tells_the_whole_story(text):
    for title in (
        "The model lacks quadratic drag",
        "The error, step by step",
        "Measured against predicted",
        "Where it fails",
        "What is missing",
        "Terms without a name",
        "Corrected parameters",
        "The log",
        "What to record next",
        "How this was made",
    ):
        assert title in text
    assert "X += X_uu u_r |u_r|" in text
    assert "This log cannot tell it from input delay." in text
    assert text.count("<svg") == 1 + 7 + 2 + 4 + 2


def test_page_shows_the_quality_of_every_log(text):
    rows = re.findall(r'<tr><td class="text">(lake/\w+\.csv)</td>(.*?)</tr>', text)
    cells = {path: re.findall("<td>(.*?)</td>", rest) for path, rest in rows}
    assert cells == {
        "lake/one.csv": ["1", "0", "300", "20.0", "", "0.110", "0.0152", "", ""],
        "lake/two.csv": ["1", "3", "", "20.0", "1.25", "", "0.0152", "", ""],
    }
    assert text.count("<summary>inspection of lake/") == 2


def test_page_leads_with_the_rollout_error_before_and_after(sample, text):
    steps = json.loads((sample / "findings.json").read_text())["steps"]
    for step in (steps[0], steps[-1]):
        assert f"<b>{typeset(step['rollout_rmse']['10']['position'], 2)} m</b>" in text


def test_page_is_self_contained(text):
    assert "<script" not in text
    assert "http" not in text
    assert "@import" not in text
    assert all(target.startswith("#") for target in re.findall(r'(?:href|src)="([^"]*)"', text))
    assert all(target.startswith("#") for target in re.findall(r"url\(([^)]*)\)", text))


def test_page_takes_its_colours_from_the_style_sheet(text):
    assert not re.search(r"#0([1-8])0\1", text.split("</style>")[1])
    assert "prefers-color-scheme: dark" in text


def test_page_is_the_same_for_the_same_files_wherever_they_lie(run, text):
    path = write_page(run)
    assert path == run / "report.html"
    assert path.read_text() == text
    assert list(run.glob(".*")) == []


def test_page_escapes_what_the_files_say(run):
    def spoil(findings):
        findings["headline"] = "<script>alert(1)</script> & more"
        findings["notes"] = ["<img src=x>"]
        findings["steps"][1]["added"] = "<b>bold</b> $x_1$"
        findings["candidates"][0]["sentence"] = "<i>sly</i>"
        findings["candidates"][0]["effect"] = "<u>odd</u>"

    edit(run / "findings.json", spoil)
    text = write_page(run).read_text()
    for sly in ("<script", "<img", "<b>bold", "<i>sly", "<u>odd"):
        assert sly not in text
    assert "&lt;script&gt;alert(1)&lt;/script&gt; &amp; more" in text


def test_page_of_a_sound_model(run):
    def clear(findings):
        findings |= {
            "verdict": "nothing missing",
            "missing": [],
            "steps": findings["steps"][:1],
            "failures": [],
            "advice": [],
        }
        findings |= {"candidates": [], "unnamed": [], "headline": ""}

    edit(run / "findings.json", clear)
    shutil.copy(run / "nominal.yaml", run / "model.yaml")
    (run / "inspection.json").unlink()
    text = write_page(run).read_text()
    assert "Nothing is missing that this log can show" in text
    assert "the same parameters as the nominal one" in text


def test_page_shows_a_diverged_rollout(run):
    def diverge(findings):
        for errors in findings["steps"][0]["rollout_rmse"].values():
            errors.update(position=None, yaw=None)

    edit(run / "findings.json", diverge)
    series = pd.read_csv(run / "series.csv")
    series.loc[series.index % 100 > 50, ["u_before", "north_before", "east_before"]] = np.nan
    series.to_csv(run / "series.csv", index=False)
    assert "diverged" in write_page(run).read_text()


def test_intervals_of_added_amounts_stand_on_the_nominal_value(run):
    findings = json.loads((run / "findings.json").read_text())
    nominal = load_vehicle(run / "nominal.yaml").with_values({"X_uu": -2.0})
    corrected = load_vehicle(run / "model.yaml").with_values({"X_uu": -9.8})
    rows = {
        row.symbol: row for row in coefficient_rows(findings["candidates"], findings["missing"], nominal, corrected)
    }
    assert rows["X_uu"].interval == pytest.approx((-2.0 - 7.8 * 1.04, -2.0 - 7.8 * 0.96))
    assert rows["stbd_scale"].interval == pytest.approx((0.806 * 0.96, 0.806 * 1.04))
    assert (rows["stbd_scale"].before, rows["stbd_scale"].after) == (1.0, 0.806)


def test_lines_break_where_a_prediction_starts_again(run):
    series = pd.read_csv(run / "series.csv").query("log == 0")
    drawn = rollouts(series)
    assert drawn["restart"].sum() == 12
    breaks = drawn[drawn["u_before"].isna()]
    assert sorted(breaks["time"]) == sorted(drawn.loc[drawn["restart"], "time"])
    assert len(drawn) < 700 + 12


@pytest.mark.parametrize("name", ["findings.json", "comparison.json", "nominal.yaml", "model.yaml", "series.csv"])
def test_missing_file_is_named(run, name):
    (run / name).unlink()
    with pytest.raises(RequestError, match=f"has no {name}; run 'undertow discover"):
        write_page(run)
    assert not (run / "report.html").exists()


def test_missing_folder_is_named(tmp_path):
    with pytest.raises(RequestError, match=r"expected a run folder at .*nowhere"):
        write_page(tmp_path / "nowhere")


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        (
            "findings.json",
            '{"schema": "undertow.audit/1"}',
            "expected schema 'undertow.findings/1', got 'undertow.audit/1'",
        ),
        ("findings.json", "{", "is not valid JSON"),
        ("findings.json", '{"schema": NaN}', "NaN is not JSON"),
        ("findings.json", "[]", "expected a JSON object, got a list"),
        ("findings.json", '{"schema": "undertow.findings/1"}', "expected a list of objects under 'candidates'"),
        (
            "findings.json",
            '{"schema": "undertow.findings/1", "candidates": [{"effect": "x"}]}',
            r"candidates\[0\] lacks 'verdict'",
        ),
        (
            "findings.json",
            '{"schema": "undertow.findings/1", "candidates": [], "steps": []}',
            "expected at least one entry in 'steps'",
        ),
        ("comparison.json", '{"schema": "undertow.comparison/1"}', "expected a list of objects under 'models'"),
        ("inspection.json", '{"schema": "undertow.inspection/1"}', "expected schema 'undertow.inspections/1'"),
        ("audit.json", '{"schema": "undertow.audit/1"}', "expected a list of objects under 'laws'"),
        *(
            ("inspection.json", f'{{"schema": "undertow.inspections/1", "logs": {logs}}}', message)
            for logs, message in (
                ("3", "expected a list of objects under 'logs'"),
                ("[{}]", r"logs\[0\] lacks 'path'"),
                ('[{"path": "a", "channels": 3}]', "expected a list of objects under 'channels'"),
                ('[{"path": "a", "alignment": [3]}]', "expected a list of objects under 'alignment'"),
                ('[{"path": "a", "plan": [3]}]', r"expected an object or null under 'plan', got \[3\]"),
                ('[{"path": "a", "plan": {"segments": 3}}]', "expected a list of objects under 'segments'"),
            )
        ),
        ("model.yaml", "mass: -1", "model.yaml"),
        ("model.yaml", "a: [", "model.yaml is not valid YAML"),
        ("nominal.yaml", "just text", "nominal.yaml"),
        ("series.csv", "time,log\n1,2\n", "lacks the column part, psi, u_dot"),
        ("series.csv", "", "is not a readable CSV"),
    ],
)
def test_file_that_cannot_be_shown_is_explained(run, name, content, message):
    (run / name).write_text(content)
    with pytest.raises(RequestError, match=message):
        write_page(run)


def test_series_without_numbers_is_explained(run):
    series = pd.read_csv(run / "series.csv").astype({"u": object})
    series.loc[0, "u"] = "fast"
    series.to_csv(run / "series.csv", index=False)
    with pytest.raises(RequestError, match="expected numbers in the column u;"):
        write_page(run)
    series.assign(u=0.0).iloc[:0].to_csv(run / "series.csv", index=False)
    with pytest.raises(RequestError, match=r"series\.csv has no rows"):
        write_page(run)


def test_the_laws_stand_on_the_page_what_is_broken_first(run):
    law = {
        "verdict": "pass",
        "margin": {"value": 0.5, "unit": "W"},
        "proof": "search",
        "sentence": "It loses <energy>.",
    }
    broken = {**law, "law": "bounded speed", "verdict": "fail", "margin": {"value": -2.0, "unit": "times the envelope"}}
    noted = {**law, "law": "mirror symmetry", "verdict": "fail", "counts": False, "proof": "none", "margin": None}
    audit = {
        "schema": "undertow.audit/1",
        "model": "corrected",
        "verdict": "fail",
        "envelope": {"u": [-1.0, 2.0]},
        "units": {"u": "m/s"},
        "envelope_from": "the speeds of the log",
        "laws": [{**law, "law": "dissipation"}, broken, noted],
    }
    (run / "audit.json").write_text(json.dumps(audit))
    page = write_page(run).read_text()
    assert "Laws of a hull: fail" in page
    assert "<loses>" not in page
    assert "u from -1.00 to 2.00 m/s: the speeds of the log" in page
    assert page.index(">bounded speed<") < page.index(">mirror symmetry<") < page.index(">dissipation<")
    assert ">noted<" in page
    (run / "audit.json").unlink()
    assert "Laws of a hull" not in write_page(run).read_text()
