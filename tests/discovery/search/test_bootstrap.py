"""Intervals hold what the step of a record leaves where commands jump, which is in all blocks alike."""

import numpy as np
import pytest

from undertow.discovery.balance.weak_form import WeakForm, WeakSettings
from undertow.discovery.candidates.candidate import Kind
from undertow.discovery.candidates.linearisation import Option
from undertow.discovery.discover import find_missing
from undertow.discovery.search.estimation import Interval, block_bootstrap
from undertow.discovery.search.gram import GramScores
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")
TRUE = HULL.values["N_rdot"] + 2.0


def interval(step: float, noise: str) -> Interval:
    """That of an inertia in yaw in a zigzag, whose commands switch all the time."""
    world = simulate_world(HULL, {"N_rdot": TRUE}, programme="zigzag", duration=200.0, noise=noise, seed=3)
    findings = find_missing([world.motion(step)], HULL).findings
    (found,) = [effect for effect in findings.candidates if effect.verdict in ("missing", "likely")]
    (term,) = found.terms
    assert term.symbol == "N_rdot"
    assert term.ci95 is not None
    return term.ci95


def test_a_coarse_step_is_in_the_interval(monkeypatch: pytest.MonkeyPatch):
    fine, coarse = (interval(step, "clean") for step in (0.05, 0.1))
    assert fine.lower <= TRUE <= fine.upper
    assert coarse.lower <= TRUE <= coarse.upper
    assert 2.0 < (coarse.upper - coarse.lower) / (fine.upper - fine.lower) < 6.0
    noisy = interval(0.1, "field")
    assert noisy.lower <= TRUE <= noisy.upper
    monkeypatch.setattr(WeakForm, "of_switches", lambda weak, vehicle: np.zeros((weak.time.size, 3)))
    blocks_alone = interval(0.1, "field")
    assert not blocks_alone.lower <= TRUE <= blocks_alone.upper
    clean = interval(0.1, "clean")
    assert clean.upper - clean.lower < 0.8 * (coarse.upper - coarse.lower), "what is left is wide, too, and not enough"


def test_sums_err_where_thrust_jumps():
    """A sum over rows less the same one over ten times as many is what jumps of the commands leave."""
    fine, coarse = (
        WeakForm(
            [simulate_world(HULL, {}, programme="zigzag", duration=60.0, noise="clean", seed=3).motion(step)],
            WeakSettings(),
        )
        for step in (0.02, 0.1)
    )
    found, less = (np.asarray(weak.of_switches(HULL))[:, 2] for weak in (coarse, fine))
    left = coarse.residual(HULL)[:, 2]
    assert np.abs(found).max() > 20.0 * np.abs(less).max()
    assert 0.2 < np.abs(left).max() / np.abs(found).max() < 5.0
    assert np.abs(np.corrcoef(found, left)[0, 1]) > 0.5


@pytest.mark.parametrize("carriers", [1, 2, 16], ids=["one block", "two blocks", "all blocks"])
def test_intervals_hold_the_truth_however_few_blocks_tell_of_a_number(carriers: int):
    """Drawn with replacement, what one block alone tells is unknown in a third of all draws: 95 % held nearly all."""
    blocks, rows, held, wide = 16, 20, 0, []
    block = np.repeat(np.arange(blocks), rows)
    rng = np.random.default_rng(carriers)
    for seed in range(200):
        design = np.column_stack([rng.standard_normal(block.size) * (block < carriers), np.ones(block.size)])
        errors = 0.5 * rng.standard_normal(block.size)
        off = np.linalg.lstsq(design, errors, rcond=None)[0]
        columns = np.column_stack([design, errors - design @ off])[:, None] * np.array([1.0, 0.0, 0.0])[:, None]
        scores = GramScores(columns, np.empty((0, *columns.shape)), block, np.ones(3))
        options = [
            Option(name, Kind.EFFECT, True, (name,), (0.0,), (k,), -1, (-100.0,), (100.0,))
            for k, name in enumerate("ab")
        ]
        found = block_bootstrap(scores, options, seed, independent=float(block.size))["a"]
        held += abs(off[0]) <= found.upper
        wide.append(found.upper)
    assert 0.9 <= held / 200 < 1.0
    assert float(np.median(wide)) < 2.5 * 0.5 / np.sqrt(rows * carriers)
