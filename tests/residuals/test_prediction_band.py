"""Bands about predictions: they hold on a second run, widen with what a model lacks, and stand aside on short logs."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError
from training_parts import parts_of

from undertow.measurements.preparation.prepare import WEAK, DataSet
from undertow.measurements.preparation.resampling import smooth
from undertow.measurements.preparation.split import Fold
from undertow.physics.motion import Array, Motion
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.reports.model_words import held_words
from undertow.residuals.models.band_record import QUANTITIES, PredictionBand
from undertow.residuals.models.base import VehicleModel
from undertow.residuals.series import (
    LEAST_LEVEL,
    ROOM,
    half_widths,
    held_predictions,
    prediction_band,
    restarted,
    spread_of,
)
from undertow.residuals.series import _independent as independent

HULL = load_vehicle("blueboat")
LACKING = HULL.with_values({"X_u": 0.5 * HULL.value("X_u")})
MODEL = VehicleModel(HULL, "true")


def driven(seed: int, seconds: float) -> Motion:
    return simulate_world(HULL, {}, duration=seconds, noise="field", seed=seed).motion(0.1)


def data_of(*motions: Motion) -> DataSet:
    return DataSet(motions, (), WEAK)


@pytest.fixture(scope="module")
def first() -> Motion:
    return driven(1, 300.0)


@pytest.fixture(scope="module")
def second() -> Motion:
    return driven(2, 300.0)


@pytest.fixture(scope="module")
def band(first: Motion) -> PredictionBand:
    found = prediction_band([(MODEL, data_of(first))])
    assert found is not None
    return found


def test_a_band_holds_its_share_of_a_second_run_and_half_of_it_does_not(band: PredictionBand, second: Motion):
    held = held_predictions(MODEL, band, data_of(second))
    assert held.predictions == 290
    assert all(0.9 <= held.of(quantity) <= 0.99 for quantity in QUANTITIES), held
    halved = band.but(factor={name: tuple(0.5 * x for x in row) for name, row in band.factor.items()})
    assert held_predictions(MODEL, halved, data_of(second)).position < 0.85


def test_what_a_model_lacks_widens_its_band(band: PredictionBand, first: Motion, second: Motion):
    lacking = prediction_band([(VehicleModel(LACKING, "lacking"), data_of(first))])
    assert lacking is not None
    assert lacking.half_width["position"][-1] > 3.0 * band.half_width["position"][-1]
    held = held_predictions(VehicleModel(LACKING, "lacking"), lacking, data_of(second))
    assert 0.85 <= held.position <= 1.0


def test_each_fold_is_predicted_by_the_fit_that_did_not_see_it(band: PredictionBand, first: Motion):
    fold = Fold(((first.source, float(first.time[0]), float(first.time[-1])),))
    blind = prediction_band([(VehicleModel(HULL, "fitted", unseen=[(fold, LACKING)]), data_of(first))])
    assert blind is not None
    assert blind.half_width["position"][-1] > 3.0 * band.half_width["position"][-1]


def test_a_band_grows_with_the_horizon(band: PredictionBand):
    wide = band.half_width["position"]
    assert wide[-1] > wide[2] > 0.0


def test_a_log_that_is_too_short_has_no_band():
    assert prediction_band([(MODEL, data_of(driven(3, 9.0)))]) is None
    short = prediction_band([(MODEL, data_of(driven(3, 16.0)))])
    assert short is None


def test_few_independent_predictions_promise_less():
    few = prediction_band([(MODEL, data_of(driven(3, 60.0).slice(0, 320)))])
    assert few is not None
    assert LEAST_LEVEL <= few.level == pytest.approx(few.independent / (few.independent + 1.0))


def test_repeated_scores_count_once():
    white = np.random.default_rng(0).normal(size=400)
    assert independent(white) == pytest.approx(400, rel=0.3)
    assert independent(np.repeat(white[:40], 10)) == pytest.approx(40, rel=0.4)


def test_the_band_along_a_log_begins_anew_with_each_prediction(band: PredictionBand, second: Motion):
    [states], [widths] = restarted([MODEL], [second])[0], half_widths(MODEL, band, [second])
    error: Array = np.abs(states[:, 3:] - second.velocity)
    after = np.arange(second.time.size) % 100
    assert ((error <= widths[:, 1:]).mean(axis=0) > 0.9).all()
    assert widths[after == 99, 0].mean() > 1.5 * widths[after == 10, 0].mean()
    moved = [replace(second, heading=second.heading + band.shift[0])]
    assert band.moved(second)[0].heading == pytest.approx(moved[0].heading)


def test_a_band_says_nothing_far_beyond_the_speeds_of_its_run(band: PredictionBand, first: Motion, second: Motion):
    """Half the range of each speed is as far as it is told: a boat that drags more there, or less, is another."""
    assert band.highest is not None
    low, high = first.velocity.min(axis=0), first.velocity.max(axis=0)
    assert band.highest[0] == pytest.approx(high[0] + ROOM * (high[0] - low[0]), abs=0.1)
    assert band.highest[1:] == pytest.approx((1.0 + 2.0 * ROOM) * np.abs(first.velocity[:, 1:]).max(axis=0), rel=0.1)
    held = held_predictions(MODEL, band, data_of(second))
    assert held.beyond == 0
    half = 0.5 * float(second.velocity[:, 0].max())
    slow = band.but(highest=(half, *band.highest[1:]))
    part = held_predictions(MODEL, slow, data_of(second))
    assert part.predictions + part.beyond == held.predictions
    assert min(part.predictions, part.beyond) > 20
    [widths] = half_widths(MODEL, slow, [second])
    [states] = restarted([MODEL], [second])[0]
    row = np.arange(len(states))
    fast = np.flatnonzero(states[:, 3] > half)
    for k in fast[:50]:
        assert np.isnan(widths[k : k + 100 - k % 100]).all(), "and not again until the next prediction begins"
    assert np.isfinite(widths[(row % 100 == 0) & (states[:, 3] <= half)]).all()
    none = band.but(highest=(-1.0, 0.0, 0.0))
    assert held_predictions(MODEL, none, data_of(second)).position != 0.0
    assert "All 290 go far beyond" in held_words(held_predictions(MODEL, none, data_of(second)), "it")
    assert f"{part.beyond} go far beyond the speeds" in held_words(part, "it")


def test_a_band_of_an_earlier_file_is_told_everywhere(band: PredictionBand, second: Motion):
    earlier = PredictionBand.model_validate({k: v for k, v in band.to_dict().items() if k not in ("lowest", "highest")})
    assert held_predictions(MODEL, earlier, data_of(second)).beyond == 0
    assert earlier.knows(np.full((2, 3), 99.0)).all()


def test_a_band_is_read_back_and_one_that_lacks_horizons_is_refused(band: PredictionBand):
    assert PredictionBand.model_validate(band.to_dict()) == band
    with pytest.raises(ValidationError, match="a number for each of 11 horizons of position"):
        band.but(factor={**band.factor, "yaw": (1.0,)})


def test_a_network_has_the_band_of_its_probes_and_keeps_it_in_its_file(tmp_path: Path):
    from undertow.residuals.models.model_files import load_network, save_network
    from undertow.residuals.training.epochs import train
    from undertow.residuals.training.training_settings import Choice, TrainingSettings

    hidden = {"surge_quadratic_damping": -10.0, "sway_lift": 20.0}
    parts = parts_of(hidden, seconds=240.0)
    found = train(parts, HULL, Choice("ridge"), settings=TrainingSettings(device="cpu")).model
    assert found.band is not None
    assert load_network(save_network(found, tmp_path / "ridge", {})).band == found.band
    assert train(parts, HULL, Choice("ridge"), settings=TrainingSettings(trust=False, device="cpu")).model.band is None
    world = simulate_world(HULL, hidden, duration=240.0, noise="field", seed=5)
    data = replace(parts.test, motions=(smooth(world.motion(0.1), 1.2),), unfiltered=None)
    held = held_predictions(found, found.band, data)
    assert held.predictions > 100
    assert all(held.of(quantity) >= 0.85 for quantity in QUANTITIES), held
    alone = held_predictions(VehicleModel(HULL, "alone"), found.band, data)
    assert alone.position < 0.7, "the band is that of the network, not of what it corrects"


def test_predictions_that_run_away_have_a_width_without_end_and_no_warning():
    assert np.isinf(spread_of(np.zeros((1, 1, 6)), [np.full((1, 1, 6), 1e200)])).all()
