"""The page of the study of rivals: one table of all models over all cases, then case by case, and what that says."""

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from undertow.physics.motion import AXES
from undertow.physics.presentation import MINUS, listing

from .records import in_a_table
from .rivals.bare import EPOCHS
from .rivals.cases import SHARES, Case
from .rivals.contenders import CONTENDERS

Records = Sequence[Mapping[str, Any]]
Results = Mapping[str, tuple[Case, Records]]
NOMINAL, BASE, SYMBOLIC = "Fossen as it is", "Fossen calibrated", "symbolic"
WHOLE, BEST = "the whole answer", "undertow best"
MEASURES = (("acceleration", AXES), ("2", (*AXES, "position")), ("10", (*AXES, "position")))
"""What is judged: one step, and rollouts of 2 s and 10 s."""
_CLEARLY = 0.95
"""Share of another's error below which one is said to err less: what is nearer is not told apart by few seeds."""


def page(results: Results) -> str:
    """The page in Markdown."""
    every = [record for _, records in results.values() for record in records]
    seeds, made = len({record["seed"] for record in every}), names_in(every)
    few = [n for n in made if CONTENDERS[n].random and len({r["seed"] for r in every if r["name"] == n}) < seeds]
    fewer = [f"Of the first seed alone, against the calibrated vehicle of that one: {listing(few)}."] if few else []
    left = [] if len(made) == len(CONTENDERS) else [f"Of {len(CONTENDERS)} models, these {len(made)} were made here."]
    parts = [
        "# Rivals",
        "Every kind of hybrid that the literature names, and other ways to model a boat, beside undertow's own.",
        f"All are fitted to one run. Its first {SHARES[0]:.0%} train; the rest chooses epochs and settings. All are "
        "judged on another whole run, by undertow's own scores: root mean square errors of the filtered acceleration, "
        "and of open-loop rollouts. A model is told velocities and the thrust of each thruster by the vehicle's curve; "
        f"only what stands beside a vehicle knows more. Figures are means over {seeds} seed{'s' * (seeds > 1)}; what "
        "no seed changes is made once.",
        *fewer,
        *left,
        "## What it says",
        "\n".join(f"- {sentence}" for sentence in sentences(results)),
        *(["## What must hold", limits(results)] if {BASE, NOMINAL, SYMBOLIC, WHOLE, BEST} <= set(made) else []),
        "## All cases",
        "By case, the error of position in rollouts of 10 s [m]. Then, over all cases, the error against that of the "
        "calibrated vehicle: geometric mean over cases, axes and position; minus is less error. *Diverged* counts "
        "rollouts of 10 s that reached 50 m/s; they count with their clipped speeds.",
        summary(results),
        "## What they are",
        "\n".join(f"- **{name}** ({CONTENDERS[name].kind}): {CONTENDERS[name].what}." for name in made),
        _SETTINGS,
    ]
    for name, (case, records) in results.items():
        parts += [f"## {name[0].upper()}{name[1:]}", f"{case.title}.", table(records)]
    command = f"python benchmarks/rivals.py --gazebo FOLDER --seeds {seeds} --table docs/rivals.md"
    parts += [f"Written by `{command}`; do not edit."]
    return "\n\n".join(parts) + "\n"


_SETTINGS = f"""Sources, and what was chosen:

- Skulstad et al. (2021, doi:10.1109/TIM.2020.3018568) and Miao et al. (2025, arXiv:2502.11800, of cars) learn what a
  model of the vehicle leaves. Wang et al. (2024, arXiv:2411.13908) give the net sine and cosine of the heading. Xu et
  al. (2022, doi:10.3390/jmse10020148) train a network together with the coefficients of an equation of motion. The
  papers of Lim and Oh and of Fang et al. were not at hand. All these rows are our reading.
- Networks of undertow have {EPOCHS} epochs here, not 150. Those called undertow count by their gain, and
  keep the laws, as `train` makes them.
- Perceptrons of others have two layers of 64 tanh, and 800 steps of AdamW over all rows at once (learning rate 0.02,
  falling by a cosine). The weights of the least validation error are kept.
- The neural ODE and the port-Hamiltonian network have 800 such steps, then 150 through rollouts of 1 s and 100 through
  rollouts of 2 s, 32 rollouts a step.
- Validation chooses the dictionary of Koopman (monomials of degree 2 or 3, 20 or 100 thin-plate splines), the order of
  the subspace (3, 4, 5, 6 or 8; ten block rows) and the threshold of pysindy, scaled (0.003 to 0.3), by rollouts of
  10 s. What is chosen is then fitted to the whole run.
- A Gaussian process has 400 random rows of the run, a length for each input, and noise.
- `fit` and networks that are trained know {SHARES[0]:.0%} of the run; `discover`, and what is fitted at once, all of
  it."""


def names_in(records: Records) -> list[str]:
    """The models of some records, in the order of the contenders."""
    there = {record["name"] for record in records}
    return [name for name in CONTENDERS if name in there]


def of_all_logs(records: Records) -> list[str]:
    """Models that were made from every log of a case, so that their mean errors may be compared."""
    seeds = {name: {r["seed"] for r in records if r["name"] == name} for name in names_in(records)}
    return [name for name in seeds if seeds[name] >= seeds.get(NOMINAL, set())]


def values(records: Records, name: str, measure: str, axes: Sequence[str]) -> np.ndarray:
    """Errors of one model, (seeds, axes); those of failed seeds are left out."""
    found = [[r[measure][a] for a in axes] for r in records if r["name"] == name and "failed" not in r]
    return np.array(found).reshape(-1, len(axes))


def beside(records: Records, name: str) -> Records:
    """The records whose logs a model was made from: where a seed changes them, those of its own seeds."""
    own, all_of = ({r["seed"] for r in records if r["name"] == one} for one in (name, NOMINAL))
    return [r for r in records if len(all_of) < 2 or r["seed"] in own]  # what no seed changes is made once


def position(records: Records, name: str) -> float:
    """Mean error of position in rollouts of 10 s [m]; NaN where nothing was made."""
    found = values(records, name, "10", ("position",))
    return float(found.mean()) if found.size else float("nan")


def summary(results: Results) -> str:
    """One row a model: position by case, what becomes of its errors over all cases, diverged rollouts, and time."""
    every = [record for _, records in results.values() for record in records]
    rows = []
    for name in names_in(every):
        cells = [_number(position(records, name)) for _, records in results.values()]
        cells += [_percent(ratio(results, name, measure, axes)) for measure, axes in MEASURES]
        mine = [r for r in every if r["name"] == name]
        done = [r for r in mine if "failed" not in r]
        lost, starts = (sum(r["10"][key] for r in done) for key in ("diverged", "starts"))
        failed = len(mine) - len(done)
        seconds = np.median([r["seconds"] for r in done]) if done else np.nan
        cells += [f"{lost} of {starts}" + f", {failed} failed" * (failed > 0), _seconds(seconds)]
        rows.append((name, *cells))
    head = ("model", *results, "one step", "2 s", "10 s", "diverged", "to fit [s]")
    return in_a_table(head, rows)


_ROLLED = MEASURES[-1]
_NEAR, _HARM = 1.03, 0.03
"""Error of a model in that of the best row within which it is as good, and share of the nominal error by which it may
be worse than what it stands on."""
_KIND_IN, _WHOLE_IN = 120.0, 180.0
"""Time that a kind, and the whole answer, may take [s]."""


def limits(results: Results) -> str:
    """What the models of undertow must hold, each with its figure."""
    every = [record for _, records in results.values() for record in records]
    made = names_in(every)
    literature = [n for n in made if CONTENDERS[n].kind == "literature"]
    ratios = {name: ratio(results, name, *_ROLLED) for name in (*literature, WHOLE, BEST)}
    rival = min((n for n in literature if np.isfinite(ratios[n])), key=ratios.__getitem__, default=BASE)
    first = [min(x for n in of_all_logs(r) if np.isfinite(x := position(r, n))) for _, r in results.values()]
    near = sum(position(r, WHOLE) <= _NEAR * x for x, (_, r) in zip(first, results.values(), strict=True))
    beaten = sum(position(r, BEST) < position(r, rival) for _, r in results.values())
    harmed = [_most_harmed(results, [n for n in made if (n in (WHOLE, BEST)) is chosen]) for chosen in (True, False)]
    seconds = {n: [r["seconds"] for r in every if r["name"] == n and "seconds" in r] for n in made}
    times = {n: float(np.median(some)) for n, some in seconds.items() if some}
    slow = max((n for n in times if CONTENDERS[n].kind == "undertow" and n != WHOLE), key=times.__getitem__)
    cases = len(results)
    rows = [
        (f"{WHOLE}, over 10 s", "−90 %", _tenths(ratios[WHOLE]), ratios[WHOLE] <= 0.10),
        ("best row of a case, or within 3 % of it", "7 of 8", f"{near} of {cases}", near >= cases - 1),
        (f"{BEST}, over 10 s", "−55 %", _tenths(ratios[BEST]), ratios[BEST] <= 0.45),
        (
            f"better than {rival}, the least of the literature",
            "6 of 8",
            f"{beaten} of {cases}",
            4 * beaten >= 3 * cases,
        ),
        *(
            (
                f"{who}: worse than what it stands on by, in the nominal error",
                "3 %",
                f"{100.0 * harm:.1f} % ({where})",
                harm <= _HARM,
            )
            for who, (harm, where) in zip((f"{WHOLE}, {BEST}", "a kind that is named"), harmed, strict=True)
        ),
        (f"time of {WHOLE}, median", f"{_WHOLE_IN:.0f} s", f"{times[WHOLE]:.0f} s", times[WHOLE] <= _WHOLE_IN),
        (f"time of any kind, median: {slow}", f"{_KIND_IN:.0f} s", f"{times[slow]:.0f} s", times[slow] <= _KIND_IN),
    ]
    head = ("", "limit", "figure", "holds")
    return in_a_table(head, [(*row[:-1], "yes" if row[-1] else "**no**") for row in rows])


def _most_harmed(results: Results, names: Sequence[str]) -> tuple[float, str]:
    """By how much the worst of some networks is worse than what it stands on, and in which case."""
    return max(
        ((worst, f"{name}, {case}") for name in names for case, worst in harms(results, name).items()),
        default=(0.0, "none"),
    )


def harms(results: Results, name: str) -> dict[str, float]:
    """By how much a network is worse than what it stands on, by case: the worst axis and horizon, in nominal errors."""
    found = {}
    for case, (_, records) in results.items() if CONTENDERS[name].kind == "undertow" else ():
        base = SYMBOLIC if name == WHOLE else BASE
        over = []
        for measure in MEASURES:
            each = [values(beside(records, name), one, *measure) for one in (name, base, NOMINAL)]
            mine, its, nominal = (one.mean(axis=0) if one.size else np.full(one.shape[1], np.inf) for one in each)
            over.append((mine - its) / np.maximum(nominal, 1e-12) if np.isfinite([*its, *nominal]).all() else mine)
        found[case] = float(np.concatenate(over).max())  # no end of it where it could not be made
    return found


def ratio(results: Results, name: str, measure: str, axes: Sequence[str]) -> float:
    """Error of a model in that of the calibrated vehicle, geometric mean over cases and axes; NaN where one failed."""
    logs = []
    for _, records in results.values():
        own, base = (values(beside(records, name), each, measure, axes) for each in (name, BASE))
        if not own.size or not base.size:
            return float("nan")
        logs.append(np.log(own.mean(axis=0) / base.mean(axis=0)))
    return float(np.exp(np.mean(logs)))


def table(records: Records) -> str:
    """One row a model of one case: errors by axis, one step ahead and in rollouts."""
    rows = []
    for name in names_in(records):
        mine = [r for r in records if r["name"] == name]
        done = [r for r in mine if "failed" not in r]
        cells = [
            ", ".join(map(_spread, values(records, name, *measure).T)) if done else "failed" for measure in MEASURES
        ]
        rows.append((name, *cells, sum(r["10"]["diverged"] for r in done), len(mine)))
    head = (
        "model",
        "acceleration: surge, sway [m/s²], yaw [rad/s²]",
        "2 s: surge, sway [m/s], yaw [rad/s], position [m]",
        "10 s",
        "diverged",
        "seeds",
    )
    return in_a_table(head, rows)


def sentences(results: Results) -> Iterator[str]:
    """What the figures say, case by case and over all, also where it goes against undertow."""
    ours = [n for n, c in CONTENDERS.items() if c.kind == "undertow"]
    for case, (_, records) in results.items():
        errors = {name: position(records, name) for name in of_all_logs(records)}
        errors = {name: x for name, x in errors.items() if np.isfinite(x)}
        own = {name: errors[name] for name in ours if name in errors}
        if not own or BASE not in errors:
            continue
        best, mine = min(errors, key=errors.__getitem__), min(own, key=own.__getitem__)
        limit = _CLEARLY * own[mine]
        beaten = sorted((n for n in errors if n not in ours and errors[n] < limit), key=errors.__getitem__)
        told = (
            f"**{case}**: over 10 s {best} errs least ({_number(errors[best])} m; calibrated {_number(errors[BASE])})."
        )
        told += f" The best network of ours is {mine.removeprefix('undertow ')} ({_number(own[mine])})."
        told += f" Better than it: {listing([f'{n} ({_number(errors[n])})' for n in beaten])}." if beaten else ""
        yield told
    for measure, axes in MEASURES[::2]:
        what = "one step ahead" if measure == "acceleration" else "in rollouts of 10 s"
        ratios = {n: ratio(results, n, measure, axes) for n in CONTENDERS}
        order = sorted((n for n in ratios if np.isfinite(ratios[n])), key=ratios.__getitem__)
        if order:
            first = listing([f"{n} ({_percent(ratios[n])})" for n in order[:5]])
            worse = [n for n in order if ratios[n] > 1.0]
            tail = f" Worse than the calibrated vehicle: {listing(worse)}." if worse else ""
            yield f"**Over all cases**, {what}, least first: {first}.{tail}"
    every = [record for _, records in results.values() for record in records]
    lost = [n for n in names_in(every) if any(r["10"]["diverged"] for r in every if r["name"] == n and "10" in r)]
    yield f"Rollouts ran away of {listing(lost)}." if lost else "No rollout of any model ran away."


def as_csv(records: Mapping[str, Records]) -> str:
    """A line for each case, model, seed, measure and axis."""
    out = io.StringIO()
    write = csv.writer(out, lineterminator="\n")
    write.writerow(("case", "model", "kind", "seed", "measure", "axis", "rmse", "diverged", "starts"))
    for case, found in records.items():
        for record in found:
            head = (case, record["name"], CONTENDERS[record["name"]].kind, record["seed"])
            if "failed" in record:
                write.writerow((*head, "failed", "", "", "", ""))
                continue
            for measure, axes in MEASURES:
                counts = [record[measure].get(key, "") for key in ("diverged", "starts")]
                name = measure if measure == "acceleration" else f"rollout {measure} s"
                for axis in axes:
                    write.writerow((*head, name, axis, record[measure][axis], *counts))
    return out.getvalue()


def _tenths(value: float) -> str:
    return f"{100.0 * (value - 1.0):+.1f} %".replace("-", MINUS) if np.isfinite(value) else "-"


def _number(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "-"


def _seconds(value: float) -> str:
    return "-" if not np.isfinite(value) else f"{value:.0f}" if value >= 1.0 else "< 1"


def _percent(value: float) -> str:
    return f"{100.0 * (value - 1.0):+.0f} %".replace("-", MINUS) if np.isfinite(value) else "-"


def _spread(column: np.ndarray) -> str:
    """Mean over the seeds, and its deviation where there are several that differ."""
    spread = column.std(ddof=1) if column.size > 1 else 0.0
    return f"{column.mean():.3g}" + f" ± {spread:.2g}" * bool(spread > 0.005 * column.mean())
