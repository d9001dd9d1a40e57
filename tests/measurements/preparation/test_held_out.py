"""Folds share no row, hold all but idle ones, and know what lies in them."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.measurements.preparation import split as held_out
from undertow.measurements.preparation.prepare import PAPER, DataSet
from undertow.measurements.preparation.split import IDLE, Split, cut, folds_of
from undertow.measurements.prepared_logs import FOLDS, Inputs, Parts
from undertow.physics.motion import Motion
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")
RAW = replace(PAPER, cutoff=None)


@pytest.fixture(scope="module")
def motion() -> Motion:
    return simulate_world(HULL, {}, duration=100.0, seed=2).motion()


def data(*motions: Motion) -> DataSet:
    return DataSet(motions, (), RAW)


@pytest.mark.parametrize(("seconds", "count"), [(20.0, 2), (36.5, 3), (99.0, 4)])
def test_a_short_log_has_fewer_folds_of_one_length(motion: Motion, seconds: float, count: int):
    folds = folds_of([motion.slice(0, round(seconds / motion.time_step))])
    lengths = [stop - start for fold in folds for _, start, stop in fold.stretches]
    assert len(folds) == count
    assert lengths == pytest.approx([seconds / count] * count, abs=0.1)


def test_every_row_lies_in_one_fold_and_every_piece_in_a_whole_one(motion: Motion):
    folds = folds_of([motion])
    pieces = cut(data(motion), folds, HULL).motions
    assert [[fold.holds(piece) for fold in folds].count(True) for piece in pieces] == [1] * len(pieces)
    rows = np.concatenate([piece.time for piece in pieces])
    assert np.unique(rows).size == rows.size
    assert not any(fold.holds(motion) for fold in folds)


def test_of_many_logs_whole_ones_are_held_out(motion: Motion):
    logs = [replace(motion, source=f"{k}.csv") for k in range(8)]
    assert [[source for source, *_ in fold.stretches] for fold in folds_of(logs)] == [
        [f"{2 * k}.csv", f"{2 * k + 1}.csv"] for k in range(4)
    ]


def test_idle_rows_are_told_where_they_are_left_out(motion: Motion):
    later = motion.time >= motion.time[0] + 40.0
    none = data()
    for rows, told in ((later, "53 s in which nothing is commanded are not judged"), (np.full(later.size, True), "")):
        idle = replace(motion, commands=np.where(rows[:, None], 0.0, motion.commands), run_up=None)
        whole = Parts(Split(none, none, data(idle)), FOLDS)
        inputs = Inputs((), {}, HULL, Split(data(idle), none, none), whole, ())
        assert "".join(inputs.in_folds(folds_of([idle])).notes) == told


def test_many_hours_are_judged_on_pieces_spread_evenly_over_them(motion: Motion, monkeypatch: pytest.MonkeyPatch):
    folds, whole = folds_of([motion]), data(motion)
    for name, seconds in (("JUDGED", 24.0), ("_PIECE", 3.0)):
        monkeypatch.setattr(held_out, name, seconds)
    judged = cut(whole, folds, HULL)
    assert judged.seconds == pytest.approx(24.0, rel=0.1)
    assert [sum(fold.holds(piece) for piece in judged.motions) for fold in folds] == [2, 2, 2, 2]
    begun = np.array([piece.time[0] for piece in judged.motions])
    assert np.diff(begun).min() > 0.7 * np.diff(begun).max()
    assert judged.notes[-1].startswith("models are judged on 8 pieces spread evenly over this long log")
    monkeypatch.setattr(held_out, "JUDGED", 2.0 * motion.duration)
    assert cut(whole, folds, HULL).notes == whole.notes


def test_idle_rows_are_not_judged_unless_there_are_no_others(motion: Motion):
    still = motion.commands.copy()
    off = (motion.time >= motion.time[0] + 40.0) & (motion.time < motion.time[0] + 70.0)
    neutral = [0.0 for _ in HULL.thrusters]
    still[off] = neutral
    judged = cut(data(replace(motion, commands=still)), folds_of([motion]), HULL)
    assert motion.duration - judged.seconds == pytest.approx(30.0 - IDLE, abs=1.5)
    drifting = replace(motion, commands=np.tile(neutral, (motion.time.size, 1)), run_up=None)
    assert cut(data(drifting), folds_of([drifting]), HULL).seconds > 0.9 * motion.duration
