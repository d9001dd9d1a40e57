"""Each law on its knife edge: a hair on one side passes, a hair on the other fails."""

from dataclasses import replace

import numpy as np
import pytest
from judging import BOX, HULL, formula, half_a_minute, judged, pushed

from undertow.comparison.audit import audit, witness_of
from undertow.physics.laws.audit.bounded import BoundedSpeed
from undertow.physics.laws.audit.coriolis import CoriolisWork
from undertow.physics.laws.audit.damping import PositiveDamping
from undertow.physics.laws.audit.dissipation import Dissipation, Outside
from undertow.physics.laws.audit.energy_balance import EnergyBalance
from undertow.physics.laws.audit.mass import PositiveMass
from undertow.physics.laws.audit.rest import Rest
from undertow.physics.laws.audit.symmetry import SHARE, MirrorSymmetry
from undertow.physics.laws.audit.thrust import PowerUnderThrust
from undertow.physics.momentum_balance import coriolis_matrix, mass_matrix, thruster_matrix
from undertow.physics.motion import Array
from undertow.residuals.models.base import VehicleModel
from undertow.residuals.models.foreign import FunctionModel

EDGE = pytest.mark.parametrize(("sign", "verdict"), [(-1.0, "pass"), (1.0, "fail")], ids=["kept", "broken"])


@EDGE
def test_mass(sign: float, verdict: str):
    upright = HULL.with_values({"x_g": 0.0, "Y_vdot": HULL.mass * (1.0 + 1e-6 * sign)})
    ruling = judged(PositiveMass(), VehicleModel(upright, "light"))
    assert ruling.verdict == verdict
    assert ruling.margin == pytest.approx(-1e-6 * sign, rel=1e-2)


@EDGE
def test_dissipation(sign: float, verdict: str):
    ruling = judged(Dissipation(), formula(X_u=1e-6 * sign, X_uu=0.0))
    assert ruling.verdict == verdict
    assert ruling.proof == ("search" if sign > 0 else "vertex LMI")
    if sign > 0:
        assert ruling.value == pytest.approx(1e-6 * 2.2**2, rel=1e-6), "the far end of the surge axis is the worst"
        assert ruling.at == pytest.approx({"u": 2.2, "v": 0.0, "r": 0.0}, abs=1e-9)


@EDGE
def test_positive_damping(sign: float, verdict: str):
    ruling = judged(PositiveDamping(), formula(X_u=1e-6 * sign))
    assert ruling.verdict == verdict
    assert ruling.at == {"u": 0.0, "v": 0.0, "r": 0.0}
    assert ruling.value == pytest.approx(1e-6 * sign * 2.2**2, rel=1e-2)


@EDGE
def test_energy_balance(sign: float, verdict: str):
    none = dict.fromkeys(HULL.damping, 0.0)
    ruling = judged(EnergyBalance(), formula(**{**none, "X_u": 1e-6 * sign}), motions=[half_a_minute()])
    assert (ruling.verdict, ruling.proof) == (verdict, "data only")


@EDGE
def test_power_under_thrust(sign: float, verdict: str):
    inverse, reach = np.linalg.inv(mass_matrix(HULL)), thruster_matrix(HULL)

    def answer(velocity: Array, heading: Array, commands: Array) -> Array:
        most = 0.5 * (1.0 + 1e-6 * sign) * np.array([1.0, 0.1, np.abs(reach[2]).max()])
        extra = most * np.sign(velocity) * np.abs(commands).sum(axis=1, keepdims=True)
        return (commands @ reach.T + extra) @ inverse.T

    ruling = judged(PowerUnderThrust(), FunctionModel(answer, HULL, "strong"))
    assert ruling.verdict == verdict
    none = dict.fromkeys(HULL.damping, 0.0)
    assert judged(PowerUnderThrust(), formula(**{**none, "X_u": 1e-6 * sign})).verdict == verdict


def test_energy_from_thrust_that_brakes_is_found():
    inverse, honest = np.linalg.inv(mass_matrix(HULL)), VehicleModel(HULL, "hull")

    def answer(velocity: Array, heading: Array, commands: Array) -> Array:
        force = np.where((commands.sum(axis=1) < -20.0) & (velocity[:, 0] > 1.5), 200.0, 0.0)
        return honest.settled(velocity, heading, commands) + force[:, None] * inverse[0]

    found = audit(FunctionModel(answer, HULL, "wrong way round"), BOX)
    assert [r.law for r in found.violations][:1] == ["power under thrust"]
    assert found.ruling("dissipation").verdict == "pass"
    at = found.ruling("power under thrust").at
    assert at is not None
    assert (at["u"] > 1.5, at["newton_port"] + at["newton_stbd"] < -20.0) == (True, True)


@EDGE
def test_rest(sign: float, verdict: str):
    limit = judged(Rest(), formula()).limit
    assert limit is not None
    push = limit * (1.0 + 1e-6 * sign) * mass_matrix(HULL)[0, 0]
    ruling = judged(Rest(), pushed(lambda nu: np.tile([push, 0.0, 0.0], (len(nu), 1))))
    assert ruling.verdict == verdict
    assert ruling.margin == pytest.approx(-1e-6 * sign * limit, rel=1e-3)


@EDGE
def test_bounded_speed(sign: float, verdict: str):
    last = 3.0 * np.hypot(2.2, 0.6) * (1.0 + 1e-6 * sign)

    def answer(velocity: Array, heading: Array, commands: Array) -> Array:
        return (np.array([last, 0.0, 0.0]) - velocity) / 2.0

    ruling = judged(BoundedSpeed(), FunctionModel(answer, HULL, "fast"))
    assert ruling.verdict == verdict
    assert ruling.margin == pytest.approx(-3e-6 * sign, rel=1e-3)


@EDGE
def test_coriolis(sign: float, verdict: str):
    honest = witness_of(formula(), BOX)
    limit = CoriolisWork().judge(honest).limit
    assert limit is not None
    work = limit * (1.0 + 1e-6 * sign) / (honest.states[:, 0] ** 2).max()
    wrong = replace(honest, coriolis=lambda nu: coriolis_matrix(HULL, nu) + np.diag([work, 0.0, 0.0]))
    ruling = CoriolisWork().judge(wrong)
    assert (ruling.verdict, ruling.proof) == (verdict, "search")


@EDGE
def test_mirror_symmetry(sign: float, verdict: str):
    full = witness_of(formula(), BOX).full_force
    force = np.array([0.0, 0.5 * SHARE * full[1] * (1.0 + 1e-6 * sign), 0.0])
    ruling = judged(MirrorSymmetry(), pushed(lambda nu: np.tile(force, (len(nu), 1))))
    assert ruling.verdict == verdict
    assert not ruling.counts
    assert ruling.margin == pytest.approx(-1e-6 * sign * SHARE, rel=1e-3)


@EDGE
def test_outside_the_envelope(sign: float, verdict: str):
    model = formula(X_uu=15.0 / (1.5 * 2.2) * (1.0 + 1e-6 * sign))
    assert judged(Outside(), model).verdict == verdict
    assert judged(Dissipation(), model).verdict == "pass"


def hump(depth: float) -> FunctionModel:
    """A hull whose surge drag falls beyond 1 m/s by this share of itself."""

    def weaker(nu: Array) -> Array:
        drag = (15.0 * nu + 8.0 * nu * np.abs(nu)) * [1.0, 0.0, 0.0]
        return depth * drag / (1.0 + np.exp(20.0 - 20.0 * np.abs(nu[:, :1])))

    return pushed(weaker)


@EDGE
def test_drag_may_fall_with_speed_but_not_drive(sign: float, verdict: str):
    assert audit(hump(0.5), BOX).verdict == "pass"
    slope = np.gradient(pushed_force(hump(0.5)))
    assert slope.max() > 0.0 > slope.min(), "the drag falls somewhere"
    exact = formula(X_u=-10.0, X_uu=20.0 * (1.0 + 1e-6 * sign), **{"surge:u^3": -10.0})  # 10 u (1 - u)^2 at the edge
    assert judged(Dissipation(), exact).verdict == verdict


def pushed_force(model: FunctionModel) -> Array:
    """Surge drag [N] from 0.1 to 2 m/s."""
    nu = np.linspace(0.1, 2.0, 60)[:, None] * [1.0, 0.0, 0.0]
    return -model.settled(nu, np.zeros(60), np.zeros((60, 2)))[:, 0]
