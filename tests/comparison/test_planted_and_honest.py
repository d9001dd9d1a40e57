"""The auditor on trial: planted violations found, honest networks let go, and bounds that enclose what they bound."""

import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from judging import BOX, HULL, judged
from places import ROOT

from undertow.comparison.audit import witness_of
from undertow.physics.laws.audit.dissipation import Dissipation
from undertow.physics.momentum_balance import mass_matrix

BENCHMARKS = ROOT / "benchmarks"


@pytest.fixture(scope="module")
def study() -> Iterator[ModuleType]:
    pytest.importorskip("torch")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCHMARKS))
        patch.delitem(sys.modules, "boats", raising=False)  # a page of the docs has a package of that name
        import audit as found  # type: ignore[import-not-found]

        yield found
        del sys.modules["audit"]


def test_planted_violations_are_found(study: ModuleType):
    models = [make() for make in study.planted(0.02, 7)]
    missed = [model.name for model in models if judged(Dissipation(), model).verdict != "fail"]
    assert len(missed) <= 1, missed


def test_the_counterexample_breaks_the_law(study: ModuleType):
    model = study.bumped("lstm", 0.02, 3)
    ruling = judged(Dissipation(), model)
    at, centre = ruling.at, study.bump(0.02, 3)[0]
    assert at is not None
    state = np.array([at["u"], at["v"], at["r"]])
    power = state @ mass_matrix(HULL) @ model.settled(state[None], np.zeros(1), np.zeros((1, 2)))[0]
    assert power == pytest.approx(ruling.value, rel=1e-3)
    assert np.abs(state - centre).max() < 0.4


def test_honest_models_are_not_accused(study: ModuleType, tmp_path: Path):
    shorter = study.honest(tmp_path, 7, epochs=5)[:-1]  # the benchmark trains to the end, and a TCN, the longest
    for make, log in shorter:
        model = make()
        found, _ = study.judged(model, 0, log)
        assert found.verdict == "pass", (model.name, [r.sentence for r in found.violations])


@pytest.mark.parametrize("name", ["dissipative", "port_hamiltonian"])
def test_what_cannot_create_energy_is_proved(study: ModuleType, name: str):
    beside = study.NetworkModel(HULL, study.quiet(name, 1, spread=0.5), 0.1)
    assert judged(Dissipation(), beside).proof == "by construction"
    broken = study.NetworkModel(HULL.with_values({"X_u": 5.0}), study.quiet(name, 1), 0.1)
    assert judged(Dissipation(), broken).proof == "search"


@pytest.mark.parametrize("pure", [False, True])
@pytest.mark.parametrize("layers", [1, 2])
@pytest.mark.parametrize("activation", [1, 2], ids=["relu", "tanh"])
def test_bounds_enclose_the_power_in_every_cell(study: ModuleType, activation: int, layers: int, pure: bool):
    from undertow.residuals.models import bounds
    from undertow.residuals.models.network_model import NetworkModel
    from undertow.residuals.networks.registry import build

    boat = HULL.with_values({"N_v": 3.0, "yaw:|u|r": -4.0, "sway:ur": 2.0, "surge:|v|u": -3.0})
    network = build("mlp", study.scaling(boat), {"layers": layers, "units": 24, "activation": activation})
    generator = study.torch.Generator().manual_seed(layers)
    for parameter in network.parameters():
        parameter.data.uniform_(-0.4, 0.4, generator=generator)
    model = NetworkModel(boat, network.double(), 0.1, pure=pure)
    cells = bounds._orthants(BOX)
    for _ in range(5):
        cells = bounds._halved(cells, np.array([3.2, 1.2, 2.2]))
    middle, half = cells
    perceptron = bounds._perceptron(model)
    assert perceptron is not None
    terms = [] if pure else bounds._monomials(boat)
    least, upper = bounds._power(mass_matrix(boat), terms, middle, half, *bounds._affine(perceptron, middle, half))
    rng = np.random.default_rng(0)
    idle = np.zeros((len(middle), 2))
    witness = witness_of(model, BOX)
    highest = np.full(len(middle), -np.inf)
    for k in range(60):
        nu = middle + half * (rng.uniform(-1.0, 1.0, middle.shape) if k else 0.0)
        power = witness.power(np.column_stack([nu, 0.0 * idle[:, 0]]))
        assert (power <= upper + 1e-5).all(), "constants are in single precision"
        if k == 0:
            assert (power >= least - 1e-5).all()
        highest = np.maximum(highest, power)
    gap = (upper - highest) / np.abs(highest).max()
    assert np.median(gap) < 0.25, "bounds that tell something"


def test_a_quiet_perceptron_is_proved_and_a_pyramid_is_not(study: ModuleType):
    from undertow.residuals.models.bounds import bound_power
    from undertow.residuals.models.network_model import NetworkModel

    for name in ("mlp", "symmetric"):
        quiet = NetworkModel(HULL, study.quiet(name, 1), 0.1)
        assert judged(Dissipation(), quiet).proof == "interval bounds"
    for share in (0.02, 1e-5):
        hidden = study.hinged(share, 3)
        assert not bound_power(hidden, BOX, 0.3).proved, share
        ruling = judged(Dissipation(), hidden)
        assert ruling.verdict == "fail", f"the needle of {share} is met where sampling would miss it"
    assert not bound_power(study.bumped("lstm", 0.02, 3), BOX, 0.3).proved


def test_a_perceptron_that_fades_is_proved_with_all_of_it_and_with_none(study: ModuleType):
    """A hull that drives itself is held back by its network alone, and runs away where that fades."""
    import torch

    from undertow.residuals.models.bounds import bound_power
    from undertow.residuals.models.network_model import NetworkModel
    from undertow.residuals.networks.trust import Trust

    driven = HULL.with_values({"X_u": 1.0, "X_uu": 0.0})
    proved = []
    for boat in (HULL, driven):
        network = study.quiet("mlp", 1, boat, spread=0.0)
        layers = dict(network.named_parameters())
        with torch.no_grad():  # a drag of 0.3 1/s beside either boat: relu(u) - relu(-u) is u
            for row, sign in enumerate((1.0, -1.0)):
                layers["body.0.weight"][row] = 0.0
                layers["body.0.weight"][row, 0] = sign
                layers["body.0.bias"][row] = 0.0
                scale = network.scaling.inputs.scale[0] / network.scaling.output[0]
                layers["head.weight"][0, row] = -0.3 * sign * scale
        whole = NetworkModel(boat, network, 0.1)
        proved.append(bound_power(whole, BOX, 0.3).proved)
        network.trust(Trust.within(np.zeros((1, 5)), 0.5))
        proved.append(bound_power(NetworkModel(boat, network, 0.1), BOX, 0.3).proved)
    assert proved == [True, True, True, False]
