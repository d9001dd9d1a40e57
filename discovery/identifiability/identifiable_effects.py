"""Identifiability: what a log can show and tell apart, whatever may be missing, from the columns of its candidates.

Three questions of every candidate. Would a plausible amount of it make a material force in this log (excitation)? Is
its column more than what sensor noise makes of it? And does it move just as another does (alias groups)? Two effects of
several parameters move alike when some amount of one moves as some amount of the other: their largest canonical
correlation (Hotelling 1936, doi:10.1093/biomet/28.3-4.321) is then near one.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from ...physics.motion import AXES, Array
from ...physics.vehicle import Vehicle
from ..search.floating import Search
from ..search.gram import RIDGE, GramScores
from .rehearsal import amplitude_columns
from .visible import Excitation, Identifiability

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
    signal, noise = _beside(freed, metric, signal), _beside(freed, metric, noise)
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


def _beside(columns: Sequence[int], metric: Array, moments: Array) -> Array:
    """Moments (3, p, p) of all columns less their projection on some, by the metric (p, p)."""
    if not columns:
        return moments
    inside = metric[np.ix_(columns, columns)]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(inside), 1e-300))
    inside = inside * np.outer(scale, scale) + RIDGE * np.eye(len(columns))
    left = np.eye(metric.shape[0])
    left[columns] -= scale[:, None] * np.linalg.solve(inside, scale[:, None] * metric[columns])
    return left.T @ moments @ left


def column_moments(scores: GramScores) -> tuple[Array, Array]:
    """Mean products of columns and balance, cleared of sensor noise, and what noise adds to them, (3, p, p) each."""
    scale = scores.scale[:, None] * scores.scale[None, :] / scores.tests
    noise = np.zeros_like(scores.gram[0]) if scores.noise is None else scores.noise.sum(axis=0) * scale
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
    scale = 1.0 / np.sqrt(np.diag(gram))
    size, vectors = np.linalg.eigh(gram * (scale[:, None] * scale[None, :]))
    keep = size > 1e-6 * size.max()
    return scale[:, None] * vectors[:, keep] / np.sqrt(size[keep])


def _condition(gram: Array, used: Sequence[int]) -> float | None:
    if not used:
        return None
    inside = gram[np.ix_(used, used)]
    scale = 1.0 / np.sqrt(np.diag(inside))
    size = np.linalg.eigvalsh(inside * (scale[:, None] * scale[None, :]))
    return float(np.sqrt(size.max() / max(float(size.min()), 1e-12 * size.max())))
