"""The first sections of the report page: the verdict, and the error falling step by step."""

from collections.abc import Sequence

from ....physics.motion import AXES
from ....physics.presentation import percent, unit_text
from ....residuals.scores import ACCELERATION_UNITS, ROLLOUT_UNITS
from ...run_contents import RunFolder
from ...wording import cut, risen, step_words, typeset
from .. import outcome
from ..figures.model_figures import step_bars
from ..markup import Html, element, lines, paragraphs, render
from .base import Chapter, Section

ARROW = "\N{RIGHTWARDS ARROW}"
LEGEND = (
    ("measured", "measured"),
    ("before", "before: the nominal model"),
    ("after", "after: the corrected model"),
    ("yours", "with your values"),
    ("band", "band of the corrected model"),
)
LONGEST_NAME = 30  # letters of an effect's name that fit beside the bars


def headline(run: RunFolder, *, title: str = "h1") -> Html:
    """The verdict, below it why and what became of the error, in words and as big figures; then how sure that is."""
    findings, steps = run.findings, run.findings.steps
    led = outcome.hero(steps, run.comparison.best.horizon)
    answered = outcome.answer(findings, run.comparison, run.nominal)
    worse = outcome.gets_worse(steps, run.comparison.best.horizon)
    did = outcome.outcome(findings, run.comparison) if worse or not answered else ""
    grown, probably = outcome.also_worse(findings, run.comparison), outcome.also_likely(findings)
    became = " ".join(filter(None, (did, grown, probably) if worse else (probably, did, grown)))
    weak = outcome.cannot(run.comparison, outcome.quiet_axes(findings))
    sentences = list(filter(None, [outcome.repeated(findings)]))
    best = outcome.recommendation(findings, run.comparison)
    if best and not answered:
        sentences.append(unit_text(best))
    for place in findings.failures[: 0 if best else 1]:
        share = f"{percent(place.share_of_error)} of the {place.axis} error"
        sentences.append(f"The nominal model fails most here: {place.where} ({share}).")
    changed = len(steps) > 1
    figures = [_big(led.before, led.unit, "before", "before" if changed else "the nominal model")]
    if changed:
        figures += [element("span", ARROW, cls="arrow"), _big(led.after, led.unit, "after", "after")]
    ends = (steps[0], steps[-1])[: 1 + changed]
    by_axis = []
    for axis in AXES:
        errors = (typeset(step.rollout(led.horizon).of(axis), 2) for step in ends)
        by_axis.append(f"{axis} {f' {ARROW} '.join(errors)} {ROLLOUT_UNITS[axis]}")
    what = element(
        "div",
        element("strong", led.in_words),
        lines(["root mean square, open loop, on held-out data"]),
        element("div", *(element("span", text) for text in by_axis), cls="axes"),
        cls="what",
    )
    return render(
        *paragraphs(map(unit_text, findings.warnings), "card warning"),
        element(title, outcome.headline(findings, run.comparison)),
        *paragraphs([weak], "warn"),
        *[element("dl", *(_line(line) for line in answered), cls="answer")] * bool(answered),
        *paragraphs([unit_text(" ".join(findings.reasons)), became], "lead"),
        element("div", *figures, what, cls="card numbers"),
        *paragraphs([" ".join(sentences)], "lead"),
    )


def falling_error(run: RunFolder) -> Section:
    """Rollout and acceleration errors after each added effect."""
    steps = run.findings.steps
    horizon = outcome.hero(steps, run.comparison.best.horizon).horizon
    names = ["nominal model", *(cut(step_words(step), LONGEST_NAME) for step in steps[1:])]

    def rollout(axis: str) -> list[float]:
        return [step.rollout(horizon).of(axis) for step in steps]

    def pointwise(axis: str) -> list[float]:
        return [step.acceleration_rmse.of(axis) for step in steps]

    top = [step_bars("position", "m", rollout("position"), names)]
    top += [step_bars(axis, ROLLOUT_UNITS[axis], rollout(axis)) for axis in AXES]
    bottom = [step_bars(axis, ACCELERATION_UNITS[axis], pointwise(axis)) for axis in AXES]
    side = element(
        "div",
        element("b", "Acceleration error"),
        lines(["along the measured motion,", "after the same steps"]),
        cls="side",
    )
    drawing = element(
        "figure",
        element("h3", f"Error of {horizon} s predictions"),
        element("div", *top, cls="plots steps"),
        element("div", side, *bottom, cls="plots steps"),
        element(
            "figcaption",
            "Read downwards: each row adds one effect, and shorter is better. Every column has its own scale. "
            "Predictions run open loop from measured states; all errors are root mean squares on held-out data.",
        ),
        *paragraphs(risen(steps, horizon), "warn"),
        cls="card",
    )
    return Section("The error, step by step" if len(steps) > 1 else "The error of the nominal model", drawing)


def legend(roles: Sequence[str] = ("measured", "before", "after"), after: str = "corrected") -> Html:
    """What the colours mean; `after` is the name of the second model."""
    texts = ((role, text.replace("corrected", after)) for role, text in LEGEND if role in roles)
    return element("div", *(element("span", element("i"), text, cls=role) for role, text in texts), cls="key")


def _line(line: outcome.Line) -> Html:
    return render(element("dt", line.label), element("dd", unit_text(f"{line.text[:1].upper()}{line.text[1:]}")))


def _big(value: float, unit: str, cls: str, label: str) -> Html:
    return element("div", element("b", f"{typeset(value, 2)} {unit}"), element("small", label), cls=f"big {cls}")


HEADLINE = Chapter(10, lambda run: Section("", headline(run)))
FALLING_ERROR = Chapter(20, falling_error)
