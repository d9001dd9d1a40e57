"""A run folder that cannot be shown is refused, and what is wrong with it is said."""

import shutil
from pathlib import Path

import pandas as pd
import pytest
from sample_run import write_sample

from undertow.physics.errors import RequestError
from undertow.workflows.run_folder.write import write_page


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    return write_sample(tmp_path_factory.mktemp("reports") / "run", seconds=120.0)


@pytest.fixture
def run(sample, tmp_path):
    """A copy of the sample that a test may spoil."""
    return Path(shutil.copytree(sample, tmp_path / "run", ignore=shutil.ignore_patterns("report.html")))


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
            "expected schema 'undertow.findings/2', got 'undertow.audit/1'",
        ),
        ("findings.json", "{", "is not valid JSON"),
        ("findings.json", '{"schema": NaN}', "NaN is not JSON"),
        ("findings.json", "[]", "expected a JSON object, got a list"),
        ("findings.json", '{"schema": "undertow.findings/1"}', "the file lacks 'verdict', 'missing', 'candidates'"),
        (
            "findings.json",
            '{"schema": "undertow.findings/1", "candidates": [{"effect": "x"}], "verdict": "missing", "missing": []}',
            r"candidates\[0\] lacks 'verdict', 'confidence', 'error_drop'",
        ),
        (
            "findings.json",
            '{"schema": "undertow.findings/1", "candidates": [], "steps": [], "verdict": "missing", "missing": []}',
            "expected at least one entry in 'steps'",
        ),
        ("comparison.json", '{"schema": "undertow.comparison/1"}', "the file lacks 'models'"),
        ("inspection.json", '{"schema": "undertow.inspection/1"}', "expected schema 'undertow.inspections/1'"),
        ("audit.json", '{"schema": "undertow.audit/1"}', "the file lacks 'laws'"),
        *(
            ("inspection.json", f'{{"schema": "undertow.inspections/1", "logs": {logs}}}', message)
            for logs, message in (
                ("3", "expected a list under 'logs', got 3"),
                ("[{}]", r"logs\[0\] lacks 'path', 'plan'"),
                ('[{"path": "a", "channels": 3}]', r"expected a list under 'logs\[0\].channels', got 3"),
                ('[{"path": "a", "alignment": [3]}]', r"expected an object under 'logs\[0\].alignment\[0\]', got 3"),
                ('[{"path": "a", "plan": [3]}]', r"expected an object under 'logs\[0\].plan', got \[3\]"),
                (
                    '[{"path": "a", "plan": {"recipe": {}, "rate": 10.0, "segments": 3}}]',
                    r"expected a list under 'logs\[0\].plan.segments', got 3",
                ),
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
