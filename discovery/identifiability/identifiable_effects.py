"""Identifiability: which effects and parameters a log shows and tells apart, from the columns of the candidates.

Excitation: a plausible amount of a candidate makes a material force, above what sensor noise makes of its column.
Collinearity: two candidates are aliases when the largest canonical correlation of their columns is near one (Hotelling
1936, doi:10.1093/biomet/28.3-4.321). A parameter is identified when both hold with all the others free at once.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...physics.motion import AXES, Array
from ...physics.vehicle import Vehicle
from ..balance.base import Balance
from ..candidates.candidate import Candidate, Kind, nuisance_candidates
from ..candidates.linearisation import Option
from ..search.estimation import block_bootstrap
from ..search.floating import Search, SearchSettings
from ..search.gram import RIDGE, GramScores
from .rehearsal import Excitation, Identifiability, amplitude_columns, plausible_amounts, rehearse

ALIAS = 0.98
"""Canonical correlation above which two candidates move alike."""
LEAST_SIGNAL = 2.0
"""Signal to noise of a column below which sensor noise decides its coefficient."""
_ADDED = ("surge_added_mass", "sway_added_mass")
"""What another mass is the sum of."""
_ROUNDING = 1e-20
"""Noise on a column that is a smaller share of its square is none: its signal to noise is infinite."""


def identify(
    search: Search, vehicle: Vehicle, active: Sequence[str], plausible: Mapping[str, tuple[float, ...]]
) -> Identifiability:
    """Judge every candidate of a search about a model, numerically, on the log as the weak form sees it.

    Columns are first cleared of what the search's nuisances explain of them.

    Parameters
    ----------
    vehicle : the model, with the `active` candidates in it, nuisances among them
    plausible : an amount for each amplitude column of every candidate (`rehearsal.plausible_amounts`)
    """
    linear, scores = search.linearise(vehicle, active)
    signal, noise = column_moments(scores)
    weight = 1.0 / (search.noise_error**2 + search.floor)
    whole = np.sqrt(np.maximum(signal.diagonal(axis1=1, axis2=2), 0.0)) / search.share_scale[:, None]
    freed = [i for key in search.nuisances for i in linear.options[key][0].free if i >= 0]
    metric = np.tensordot(weight, signal, axes=1)
    signal, noise = _partial_moments(freed, metric, signal), _partial_moments(freed, metric, noise)
    clear = np.maximum(signal.diagonal(axis1=1, axis2=2), 0.0)
    blur = np.maximum(noise.diagonal(axis1=1, axis2=2), 0.0)
    axis_share = np.sqrt(clear) / search.share_scale[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        square = (weight @ clear) / (weight @ blur)
    ratio = np.nan_to_num(np.sqrt(np.where(square < 1.0 / _ROUNDING, square, np.inf)), nan=0.0, posinf=np.inf)
    excitation: dict[str, Excitation] = {}
    absorbed: list[str] = []
    alive: dict[str, list[int]] = {}
    pool = [c for c in search.pool if not c.nuisance]
    for candidate in pool:
        columns = list(amplitude_columns(candidate, linear.options[candidate.key]))
        shares = axis_share[:, columns].max(axis=0) * plausible[candidate.key]
        excitation[candidate.key] = Excitation(share=float(shares.max()), signal_to_noise=float(ratio[columns].max()))
        if (
            shares.max()
            < search.settings.materiality
            <= (whole[:, columns].max(axis=0) * plausible[candidate.key]).max()
        ):
            absorbed.append(candidate.key)
        shown = (shares >= search.settings.materiality) & (ratio[columns] >= LEAST_SIGNAL)
        if shown.any():
            alive[candidate.key] = [index for index, shows in zip(columns, shown, strict=True) if shows]
    trace = [key for key, e in excitation.items() if e.share < search.settings.materiality]
    dormant = tuple(key for key in trace if key not in absorbed)
    limited = tuple(key for key in excitation if key not in alive and key not in trace)
    together = np.tensordot(weight, signal, axes=1)
    special = {c.key: alive[c.key] for c in pool if c.key in alive and not c.effect.general}
    sums = {"thrust_scale": any("thruster_asym" in k for k in alive), "mass_offset": set(_ADDED) <= set(alive)}
    names = [key for key in special if not sums.get(key, False)]  # what others add up to
    used = [index for key in names for index in special[key]]
    groups, condition = alias_groups(together, special), _condition(together, used)
    quiet = tuple(name for name, is_quiet in zip(AXES, search.quiet, strict=True) if is_quiet)
    return Identifiability(
        groups=groups,
        dormant=dormant,
        absorbed=tuple(absorbed),
        noise_limited=limited,
        quiet_axes=quiet,
        condition=condition,
        excitation=excitation,
    )


def _partial_moments(columns: Sequence[int], metric: Array, moments: Array) -> Array:
    """Moments (3, p, p) of all columns less their projection on some, by the metric (p, p)."""
    if not columns:
        return moments
    inside, scale = _of_length_one(metric, columns)
    inside += RIDGE * np.eye(len(columns))
    left = np.eye(metric.shape[0])
    left[columns] -= scale[:, None] * np.linalg.solve(inside, scale[:, None] * metric[columns])
    return left.T @ moments @ left


def column_moments(scores: GramScores) -> tuple[Array, Array]:
    """Mean products of columns and balance, cleared of sensor noise, and what noise adds to them, (3, p, p) each."""
    scale = scores.scale[:, None] * scores.scale[None, :] / scores.tests
    noise = scores.noise.sum(axis=0) * scale
    return scores.gram.sum(axis=0) * scale - noise, noise


def alias_groups(gram: Array, columns: Mapping[str, Sequence[int]]) -> tuple[tuple[str, ...], ...]:
    """Connected components of candidates whose largest canonical correlation exceeds 0.98, singles left out.

    Parameters
    ----------
    gram : (p, p) weighted products of columns, all axes together
    columns : the columns of each candidate
    """
    whitened = {key: _whitener(gram[np.ix_(index, index)]) for key, index in columns.items()}
    groups = [{key} for key in columns]
    keys = list(columns)
    for n, a in enumerate(keys):
        for b in keys[n + 1 :]:
            across = whitened[a].T @ gram[np.ix_(columns[a], columns[b])] @ whitened[b]
            if np.linalg.norm(across, 2) > ALIAS:
                joined = set().union(*(g for g in groups if a in g or b in g))
                groups = [g for g in groups if not g & joined] + [joined]
    found = [tuple(key for key in keys if key in group) for group in groups if len(group) > 1]
    return tuple(sorted(found, key=lambda group: keys.index(group[0])))


def _whitener(gram: Array) -> Array:
    """W with W^T gram W = 1 in the directions that carry more than a millionth of the largest."""
    inside, scale = _of_length_one(gram)
    size, vectors = np.linalg.eigh(inside)
    keep = size > 1e-6 * size.max()
    return scale[:, None] * vectors[:, keep] / np.sqrt(size[keep])


def _of_length_one(gram: Array, columns: Sequence[int] | None = None) -> tuple[Array, Array]:
    """The Gram matrix of all or some columns, divided by their lengths, and what each was divided by."""
    inside = gram if columns is None else gram[np.ix_(columns, columns)]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(inside), 1e-300))
    return inside * np.outer(scale, scale), scale


def _condition(gram: Array, used: Sequence[int]) -> float | None:
    if not used:
        return None
    size = np.linalg.eigvalsh(_of_length_one(gram, used)[0])
    return float(np.sqrt(size.max() / max(float(size.min()), 1e-12 * size.max())))


_ALIKE = 1e-7
"""Share of a normal matrix (columns of length one) below which an eigenvalue is none: some columns are one."""
_LARGE_PART = 0.3
"""Share of the largest part in a combination of columns from which a column has a large one."""
_PARTNER = 0.8
"""Correlation of two estimates from which one is said to hide the other."""
_DORMANT = "no manoeuvre in this log shows it: a plausible amount of it makes no material force"
_NOISE = "what shows it in this log is hardly more than sensor noise"
_SCALE = (
    "thrust, damping and mass are known up to a common factor only; hold one of the others, for example an added mass"
)
_WIDE = "its 95 % interval would be wider than a plausible amount of it"


@dataclass(frozen=True, slots=True)
class Identified:
    """Parameters that a log can calibrate.

    Attributes
    ----------
    symbols : parameters that it identifies, all of them free at once
    reasons : why not, by symbol, for the others
    """

    symbols: tuple[str, ...]
    reasons: dict[str, str]


def identified(
    balance: Balance,
    nominal: Vehicle,
    symbols: Sequence[str],
    settings: SearchSettings,
    vague: bool = False,
) -> Identified:
    """Find out which parameters a log identifies; nothing is moved.

    A parameter is left out when a plausible amount of it makes no material force, or its column is hardly more than
    noise; when it scales all thrust and the other columns together make up the thrust's; or when, beside the others,
    its 95 % interval is wider than a plausible amount of it, which is its own value or what would make a quarter of the
    force at work in the trial in which it shows most.

    Parameters
    ----------
    symbols : parameters that are to be free, see `candidate.calibratable`
    vague : True to keep those with wide intervals, and those that hardly more than noise tells from others
    """
    pool = nuisance_candidates(nominal, symbols)
    amounts, reasons = _unseen(balance, nominal, pool, settings)
    left = [s for s in symbols if s not in reasons]
    while left:
        search = Search(balance, nominal, nuisance_candidates(nominal, left), replace(settings, refinements=3))
        state = search.evaluate(nominal, ())
        _, scores, now = search.about(state)
        chosen = list(now.values())
        gone = _same(scores, chosen) or _common_factor(search, scores, chosen, state.vehicle)
        if not vague:
            gone = gone or _noisy(scores, chosen) or _vague(scores, chosen, amounts)
        if not gone:
            break
        reasons |= gone
        left = [s for s in left if s not in gone]
    return Identified(tuple(left), {s: reasons[s] for s in symbols if s in reasons})


def _unseen(
    balance: Balance, nominal: Vehicle, pool: Sequence[Candidate], settings: SearchSettings
) -> tuple[dict[str, float], dict[str, str]]:
    """A plausible amount by symbol, and the reasons for those that do not show at all."""
    search = Search(balance, nominal, [replace(c, kind=Kind.EFFECT) for c in pool], settings)
    plausible = plausible_amounts(search, rehearse(search, nominal, ()))
    amounts: dict[str, float] = {}
    for candidate in pool:
        free = candidate.effect.amplitudes or candidate.parameters
        sizes = [abs(nominal.value(p.symbol) - p.null) for p in free]
        if not candidate.effect.fixed_amplitude:
            sizes = [max(s, p) for s, p in zip(sizes, plausible[candidate.key], strict=True)]
            plausible[candidate.key] = tuple(sizes)
        for parameter in candidate.parameters:
            at = free.index(parameter) if parameter in free else None
            amounts[parameter.symbol] = np.inf if at is None else sizes[at]
            if parameter.grid:
                amounts[parameter.symbol] = max(parameter.grid)
    known = identify(search, nominal, (), plausible)
    reasons = {
        s: _DORMANT if c.key in known.dormant else _NOISE
        for c in pool
        for s in c.symbols
        if c.key in (*known.dormant, *known.noise_limited)
    }
    return amounts, reasons


def _columns(chosen: Sequence[Option]) -> dict[str, int]:
    """Free columns by symbol."""
    return {number.symbol: number.column for option in chosen for number in option.numbers}


def _same(scores: GramScores, chosen: Sequence[Option]) -> dict[str, str]:
    """Parameters of which some combination makes no force at all, as of x_g and Y_rdot."""
    symbols = list(_columns(chosen))
    _, left, _ = scores.block_normal(chosen)
    size, vectors = np.linalg.eigh(_of_length_one(left.sum(axis=0))[0]) if symbols else (np.ones(1), np.ones((1, 1)))
    return {} if size[0] >= _ALIKE else _mixed(symbols, vectors[:, 0])


def _mixed(symbols: Iterable[str], parts: Array) -> dict[str, str]:
    """The symbols with a large part in a combination of columns, each with the others that the log confuses it with."""
    names = [s for s, p in zip(symbols, np.abs(parts), strict=True) if p > _LARGE_PART * np.abs(parts).max()]
    return {s: _cannot_tell(n for n in names if n != s) for s in names}


def _common_factor(search: Search, scores: GramScores, chosen: Sequence[Option], vehicle: Vehicle) -> dict[str, str]:
    """All scales of thrust, when every thruster has one and the other columns together make up the thrust's."""
    at = _columns(chosen)
    each = [f"{t.name}_scale" for t in vehicle.thrusters]
    scales = [s for s in ("thrust_scale", *each) if s in at]
    if "thrust_scale" in at:
        whole = {at["thrust_scale"]: vehicle.value("thrust_scale")}
    elif all(s in at for s in each):
        whole = {at[s]: vehicle.value(s) for s in each}
    else:
        return {}
    others = [k for s, k in at.items() if s not in scales]
    signal, _ = column_moments(scores)
    gram = np.tensordot(1.0 / (search.noise_error**2 + search.floor), signal, axes=1)
    thrust = np.zeros(gram.shape[0])
    thrust[list(whole)] = list(whole.values())
    across, total = gram[others] @ thrust, float(thrust @ gram @ thrust)
    inside, scale = _of_length_one(gram, others)
    inside += 1e-9 * np.eye(len(others))
    explained = float((across * scale) @ np.linalg.solve(inside, across * scale)) if others else 0.0
    return dict.fromkeys(scales, _SCALE) if explained > ALIAS**2 * total else {}


def _vague(scores: GramScores, chosen: Sequence[Option], amounts: Mapping[str, float]) -> dict[str, str]:
    """Parameters whose 95 % interval, before limits cut it, is wider than a plausible amount."""
    endless = [replace(o, lower=(-np.inf,) * len(o.lower), upper=(np.inf,) * len(o.upper)) for o in chosen if o.free]
    intervals = block_bootstrap(scores, endless, 0)
    wide = [s for s, i in intervals.items() if 0.5 * (i.upper - i.lower) >= amounts[s]]
    if not wide:
        return {}
    _, left, _ = scores.block_normal(endless)
    symbols, correlation = list(_columns(endless)), _correlation(left.sum(axis=0))
    reasons = {}
    for symbol in wide:
        row = np.abs(correlation[symbols.index(symbol)])
        near = (s for s, c in zip(symbols, row, strict=True) if c > _PARTNER and s != symbol)
        reasons[symbol] = _cannot_tell(near) or _WIDE
    return reasons


def _noisy(scores: GramScores, chosen: Sequence[Option]) -> dict[str, str]:
    """Parameters with a large part in a combination of columns that is hardly more than sensor noise."""
    if not scores.noise.any():
        return {}
    at = _columns(chosen)
    index = np.ix_(list(at.values()), list(at.values()))
    both, noise = (np.tensordot(scores.weight, g.sum(axis=0), axes=1)[index] for g in (scores.gram, scores.noise))
    size, vectors = np.linalg.eigh(both)
    root = vectors / np.sqrt(np.maximum(size, 1e-12 * size.max()))
    share, directions = np.linalg.eigh(root.T @ noise @ root)
    if share[-1] * (1.0 + LEAST_SIGNAL**2) < 1.0:
        return {}
    mixed = _mixed(at, root @ directions[:, -1] * np.sqrt(np.diag(both)))
    return {symbol: why or _NOISE for symbol, why in mixed.items()}


def _cannot_tell(others: Iterable[str]) -> str:
    """That a log cannot tell a parameter from others; empty when there are none."""
    names = ", ".join(others)
    return f"this log cannot tell it from {names}" if names else ""


def _correlation(normal: Array) -> Array:
    """Correlation of estimates from their normal matrix."""
    inside, scale = _of_length_one(normal)
    inverse = np.asarray(np.linalg.inv(inside + 1e-9 * np.eye(scale.size)), dtype=float)
    return _of_length_one(inverse)[0]
