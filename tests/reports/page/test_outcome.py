"""What adding effects did to the predictions is told as the numbers have it, bad news first."""

from dataclasses import replace
from pathlib import Path

import pytest
from sample_run import write_sample
from verbs import done

from undertow.comparison.facts import Best, Comparison
from undertow.discovery.findings import Findings, Step
from undertow.physics.in_words import NARROW
from undertow.reports.page.outcome import gets_worse, opening, outcome
from undertow.reports.page.page import page
from undertow.workflows.run_folder.read import read_run

NOTHING = Comparison(models=())
BEST = NOTHING.but(best=Best(model="nominal", sentence="Trust nominal: it keeps the laws of a hull."))


def story(before: float | None, after: float | None, *missing: str) -> Findings:
    steps = [
        Step.model_validate(
            {"added": name, "acceleration_rmse": {}, "rollout_rmse": {"10": {"surge": 0.1, "position": error}}}
        )
        for name, error in ((None, before), ("munk_moment", after))
    ]
    return Findings(
        verdict="missing",
        headline="The model is missing munk moment.",
        missing=missing or ("munk_moment",),
        candidates=(),
        steps=tuple(steps),
    )


def paired(verdict: str) -> Comparison:
    keys = {"model": "corrected", "against": "nominal", "quantity": "rollout", "horizon": "10", "axis": "position"}
    return NOTHING.but(differences=[{**keys, "verdict": verdict}])


@pytest.mark.parametrize(
    ("before", "after", "verdict", "said"),
    [
        (2.0, 0.5, "better", "Adding it removes 75 % of the position error of 10 s predictions on motion"),
        (2.0, 1.9, "no difference", "removes 5 % of the position error"),
        (2.0, 1.9, "no difference", "that the fit never saw, which may be chance."),
        (2.0, 0.5, "too short to tell", "never saw, on too few rows to exclude chance."),
        (2.0, 2.6, "worse", "makes the position error of 10 s predictions worse on motion"),
        (2.0, 2.6, "worse", "never saw, from 2.0 to 2.6 m."),
        (2.0, 2.01, "no difference", "as it was on motion that the fit never saw, 2.0 m."),
        (2.0, None, "worse", "Adding it makes predictions over 10 s run away"),
    ],
)
def test_the_sentence_is_what_the_numbers_say(before: float, after: float | None, verdict: str, said: str):
    told = outcome(story(before, after), paired(verdict)).replace(NARROW, " ")
    assert said in told
    assert ("removes" in told) == (after is not None and after < 0.99 * before)


def test_bad_news_come_first_and_the_model_to_trust_last():
    worse, better = story(2.0, 2.6), story(2.0, 0.5)
    assert [text.split()[0] for text in opening(worse, BEST)] == ["Adding", "The", "Trust"]
    assert [text.split()[0] for text in opening(better, BEST)] == ["The", "Adding", "Trust"]
    assert gets_worse(story(2.0, None).steps)
    alone = better.but(steps=better.steps[:1])
    assert not gets_worse(alone.steps)
    assert opening(alone, NOTHING) == [better.headline]


def test_the_page_leads_with_an_error_that_grew(tmp_path: Path):
    run = read_run(write_sample(tmp_path / "run", seconds=30.0))
    steps = run.findings.steps
    first = steps[0].rollout("10")
    worse = steps[-1].but(rollout_rmse={"10": first.but(position=1.5 * first.position)})
    text = page(replace(run, findings=run.findings.but(steps=(*steps[:-1], worse))))
    assert '<p class="lead">Adding them makes the position error of 10 s predictions' in text
    assert "removes" not in text.split('class="card numbers"')[0]


def test_discover_prints_which_model_to_trust(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "120")
    done(
        "simulate", "-v", "blueboat", "--effect", "surge_quadratic_damping=-12", "--duration", "100", "--out", "log.csv"
    )
    said = " ".join(done("discover", "log.csv", "-v", "blueboat", "--out", "run", "--no-report").split())
    sentence = read_run(tmp_path / "run").comparison.best.sentence
    assert sentence.replace(NARROW, " ") in said.replace(NARROW, " ")
    assert said.index("Trust ") < said.index("Effects, best first")
    assert "Adding it removes" in said.split("Trust ")[0]
