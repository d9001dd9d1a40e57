"""Field logs: coloured noise, held fixes, a compass that deviates, channels out of step; and what is said of each."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.discovery import basis as basis_of_logs
from undertow.discovery import discover, selection
from undertow.discovery.add_effects import Bench, add_effects
from undertow.discovery.balance.weak_form import WeakForm, WeakSettings
from undertow.discovery.basis import UNKNOWN, DiscoverySettings, choose_balance, correct_compass
from undertow.discovery.candidates.candidate import candidates
from undertow.discovery.discover import find_missing
from undertow.discovery.effect_findings import Reason
from undertow.discovery.evidence.record_errors import clocks, out_of_step
from undertow.discovery.evidence.unexplained import fit_all_forces
from undertow.discovery.findings import Step
from undertow.discovery.identifiability.rehearsal import Rehearsal
from undertow.discovery.run_models import values_of_step
from undertow.discovery.search.floating import Search, SearchSettings, State
from undertow.measurements.compass import Compass, compass_of, corrected
from undertow.physics.forces import apparent_wind
from undertow.physics.integration import simulate_motion
from undertow.physics.motion import Motion, body_to_earth
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.residuals.scores import ByAxis

HIDDEN = {"X_uu": -20.0, "N_ur": -6.0, "reverse_scale": 0.6}
NAMES = {"surge_quadratic_damping", "yaw_speed_damping", "reverse_thrust_loss"}


@pytest.fixture(scope="module")
def nominal() -> Vehicle:
    return load_vehicle("blueboat")


def driven(vehicle: Vehicle, hold: float, seed: int, both: bool = False, rows: int = 2000) -> Motion:
    """200 s under random steps of both thrusters, ahead and astern; with `both` mostly straight, turning in between."""
    rng = np.random.default_rng(seed)
    each = round(hold / 0.1)
    steps = rng.uniform(-20.0, 25.0, size=(rows // each + 1, 2))
    if both:
        steps[::2, 1] = steps[::2, 0] = 0.8 * np.abs(steps[::2, 0]) + 5.0
    held = np.repeat(steps, each, axis=0)[:rows]
    still = Motion(
        0.1 * np.arange(rows, dtype=float),
        np.zeros((rows, 2)),
        np.zeros(rows),
        np.zeros((rows, 3)),
        held,
        ("port", "stbd"),
    )
    return simulate_motion(vehicle, still)


def coloured(motion: Motion, sizes: tuple[float, float, float], memory: float, seed: int, hold: int = 1) -> Motion:
    """Velocities with first-order coloured noise of a memory [s], and u and v held for some rows as GPS fixes are."""
    rng = np.random.default_rng(seed)
    keep = np.exp(-motion.time_step / memory)
    noise = np.zeros_like(motion.velocity)
    for k in range(1, motion.time.size):
        noise[k] = keep * noise[k - 1] + np.sqrt(1.0 - keep**2) * rng.standard_normal(3)
    velocity = motion.velocity + noise * np.array(sizes)
    velocity[:, :2] = velocity[np.arange(motion.time.size) // hold * hold, :2]
    return replace(motion, velocity=velocity)


def white(motion: Motion, seed: int) -> Motion:
    rng = np.random.default_rng(seed)
    return replace(
        motion, velocity=motion.velocity + rng.standard_normal(motion.velocity.shape) * [0.015, 0.015, 0.006]
    )


def deviated(motion: Motion, a: float, b: float, c: float) -> Motion:
    """What a compass that deviates by a + b sin(psi) + c cos(psi) degrees makes of headings and body velocities."""
    delta = np.radians(a + b * np.sin(motion.heading) + c * np.cos(motion.heading))
    surge, sway = body_to_earth(delta, motion.velocity[:, 0], motion.velocity[:, 1])
    velocity = np.column_stack([surge, sway, motion.velocity[:, 2]])
    return replace(motion, heading=motion.heading - delta, velocity=velocity)


def test_hidden_effects_stand_in_the_model_under_coloured_noise_and_held_fixes(nominal: Vehicle) -> None:
    log = coloured(driven(nominal.with_values(HIDDEN), 4.0, 0), (0.06, 0.04, 0.03), 1.0, seed=2, hold=4)
    found = find_missing([log], nominal)
    assert "open-loop rollouts" in found.notes[0]
    assert {c.effect for c in found.findings.added} == NAMES
    surest = found.findings.added[0]
    assert surest.effect in NAMES
    assert surest.confidence > 0.5, "noise takes of what is sure, and makes nothing less likely than its absence"
    weak = Search(WeakForm([log], WeakSettings()), nominal, candidates(nominal), SearchSettings())
    assert set(weak.run().active) - NAMES, "the force balance alone takes coloured noise for effects"


def test_beside_a_number_at_a_limit_the_search_goes_on_without_it(nominal: Vehicle, monkeypatch: pytest.MonkeyPatch):
    """What is only found without it is its look-alike: it explains the log because the other was left out."""
    log = coloured(driven(nominal.with_values(HIDDEN), 4.0, 0), (0.06, 0.04, 0.03), 1.0, seed=2, hold=4)
    monkeypatch.setattr(selection, "at_limit", lambda c, before, found: c.key == "reverse_thrust_loss")
    found = find_missing([log], nominal)
    effects = {c.effect: c for c in found.findings.candidates}
    left_out = effects.pop("reverse_thrust_loss")
    assert (left_out.reason, left_out.in_model) == (Reason.AT_LIMIT, False)
    assert found.corrected.value("reverse_scale") == nominal.value("reverse_scale")
    stand_ins = {name: c for name, c in effects.items() if c.claim is not None and name not in NAMES}
    assert stand_ins
    for one in stand_ins.values():
        assert "reverse_thrust_loss" in one.indistinguishable_from
        assert one.confidence <= 0.5
    assert set(found.findings.missing) <= NAMES


def test_advice_is_asked_of_what_stands_at_a_limit_too(nominal: Vehicle, monkeypatch: pytest.MonkeyPatch):
    """Where nothing is left in the model, the trials that were driven serve: they have the same candidates."""
    log = coloured(driven(nominal.with_values(HIDDEN), 4.0, 0, rows=1200), (0.06, 0.04, 0.03), 1.0, seed=2, hold=4)
    monkeypatch.setattr(selection, "at_limit", lambda candidate, before, found: True)
    asked = []

    def advised(search: Search, state: State, questions: object, plausible: dict[str, object], driven: Rehearsal):
        _, scores = search.linearise(state.vehicle, state.active, state.fit.in_sample)
        asked.append({c.key for c in search.pool} - set(plausible))
        driven.moments(scores.scale)
        return ()

    monkeypatch.setattr(discover, "advise", advised)
    found = find_missing([log], nominal)
    assert [c.effect for c in found.findings.candidates if c.reason is Reason.AT_LIMIT]
    assert not [c for c in found.findings.candidates if c.in_model]
    assert asked == [set()]


def test_effects_are_added_by_rollouts_under_coloured_noise(nominal: Vehicle) -> None:
    log = coloured(driven(nominal.with_values(HIDDEN), 4.0, 0), (0.06, 0.04, 0.03), 1.0, seed=2, hold=4)
    found = add_effects([log], nominal, sorted(NAMES), DiscoverySettings())
    assert "open-loop rollouts" in found.notes[0]
    assert any("none is calibrated" in note for note in found.notes)
    assert "yaw speed damping, fitted to open-loop rollouts" in found.findings.headline
    assert found.findings.criterion.unit["surge"] == "m/s"
    assert [found.corrected.value(s) for s in HIDDEN] == pytest.approx(list(HIDDEN.values()), rel=0.08)


def test_what_a_run_on_rollouts_found_is_added_with_its_numbers(nominal: Vehicle) -> None:
    log = coloured(driven(nominal.with_values(HIDDEN), 4.0, 0), (0.06, 0.04, 0.03), 1.0, seed=2, hold=4)
    wrong = nominal.with_values({symbol: 0.8 * nominal.value(symbol) for symbol in ("X_u", "N_r")})
    settings = DiscoverySettings(refit=True)
    run = find_missing([log], wrong, settings)
    assert run.basis.uses_rollouts
    told = tuple(
        Step(added=label, acceleration_rmse=ByAxis(), rollout_rmse={}, values=values_of_step(vehicle, wrong))
        for label, vehicle in run.steps
    )
    findings = run.findings.but(steps=told)
    names = [str(label) for label, _ in run.steps[2:]]
    assert len(names) >= 2
    added = add_effects([log], wrong, names[::-1], settings, searched=findings)
    assert added.corrected.values == run.corrected.values
    assert added.findings.candidates == run.findings.added
    bench = Bench(run.basis, own=True, searched=findings)
    for count, (_, vehicle) in enumerate(run.steps[1:]):
        assert bench.with_effects(names[:count]).vehicle.values == vehicle.values
    apart, _ = (Bench(run.basis, own=True, searched=found).with_effects(names) for found in (None, findings))
    assert apart.vehicle.values == pytest.approx(run.corrected.values, rel=0.2), "fitted from the file on"
    assert apart.vehicle.values != run.corrected.values


def test_coloured_noise_alone_is_no_effect(nominal: Vehicle) -> None:
    log = coloured(driven(nominal, 4.0, 0), (0.08, 0.05, 0.04), 1.5, seed=3)
    assert find_missing([log], nominal).findings.missing == ()


def test_white_noise_is_not_coloured(nominal: Vehicle) -> None:
    log = white(driven(nominal.with_values(HIDDEN), 4.0, 0), 1)
    weak = WeakForm([log], WeakSettings())
    search = Search(weak, nominal, candidates(nominal), SearchSettings())
    assert not fit_all_forces(weak, search).coloured.any()


def test_a_compass_deviation_is_measured_and_taken_away(nominal: Vehicle) -> None:
    runs = [white(driven(nominal, 10.0, seed, both=True), 5) for seed in (5, 6, 7, 8)]
    logs = [deviated(run, 1.0, 3.0, 7.0) for run in runs]
    compass = compass_of(logs)
    assert compass.deviates
    assert np.degrees([compass.constant, compass.sine, compass.cosine]) == pytest.approx([1.0, 3.0, 7.0], abs=1.5)
    before, after = (np.abs(m.heading - runs[0].heading).max() for m in (logs[0], corrected(logs[0], compass)))
    assert after < 0.4 * before


def test_a_deviation_on_few_headings_is_taken_away_there_and_estimated_elsewhere() -> None:
    """Out and back ten times, so that ten of twelve sectors are seen in turns alone."""
    rng, left = np.random.default_rng(0), []
    for _ in range(24):
        time = 0.1 * np.arange(2000, dtype=float)
        turned = np.cumsum(np.where(time % 20.0 > 20.0 - np.pi / 0.3, 0.3 * 0.1, 0.0))
        heading, speed = rng.uniform(0.0, 6.0) + turned, 1.5 + 0.5 * np.sin(0.2 * time)
        rate = np.gradient(heading, time)
        sway = 0.1 * speed * rate + 0.015 * rng.standard_normal(time.size)
        zeros = np.zeros((time.size, 2))
        true = Motion(time, zeros, heading, np.column_stack([speed, sway, rate]), zeros, ("port", "stbd"))
        measured = deviated(true, rng.normal(0.0, 2.0), rng.normal(0.0, 6.0), rng.normal(0.0, 6.0))
        compass = compass_of([measured])
        if compass.plain and not compass.curve_known:
            straight = np.abs(rate) < 0.1
            before, after = (np.abs(m.heading - heading) for m in (measured, corrected(measured, compass)))
            left.append([np.median(after[rows]) / np.median(before[rows]) for rows in (straight, ~straight)])
    assert len(left) > 12
    known, elsewhere = np.median(left, axis=0)
    assert known < 0.1
    assert elsewhere < 0.5


def test_false_fixes_do_not_hide_a_compass_deviation(nominal: Vehicle) -> None:
    logs = [deviated(white(driven(nominal, 10.0, seed, both=True), 5), 1.0, 3.0, 7.0) for seed in (5, 6, 7, 8)]
    velocity = logs[0].velocity.copy()
    velocity[1000, 0] = 10.0
    compass = compass_of([replace(logs[0], velocity=velocity), *logs[1:]])
    assert compass.deviates
    assert np.degrees([compass.constant, compass.sine, compass.cosine]) == pytest.approx([1.0, 3.0, 7.0], abs=1.5)


def test_a_corrected_compass_leaves_the_apparent_wind_as_measured(nominal: Vehicle) -> None:
    true = driven(nominal, 10.0, 5).slice(0, 300)
    air = np.tile((3.0, -4.0), (300, 1))
    seen = apparent_wind(true.heading, tuple(true.velocity.T[:2]), tuple(air.T))
    logged = deviated(true, 8.0, 0.0, 0.0)
    made = (apparent + speed for apparent, speed in zip(seen, logged.velocity.T[:2], strict=True))
    logged = replace(logged, air=np.column_stack(body_to_earth(logged.heading, *made)))
    right = corrected(logged, Compass(np.radians(8.0), 0.0, 0.0, np.radians(8.0), 0.01, 1.0, 1.0))
    assert right.air is not None
    np.testing.assert_allclose(right.air, air, atol=1e-9)
    again = apparent_wind(right.heading, tuple(right.velocity.T[:2]), tuple(right.air.T))
    np.testing.assert_allclose(again, seen, atol=1e-9)


def test_a_compass_deviation_is_not_called_a_current_or_a_sway_effect(nominal: Vehicle) -> None:
    log = coloured(driven(nominal.with_values(HIDDEN), 10.0, 6, both=True), (0.06, 0.02, 0.03), 1.0, seed=5)
    found = find_missing([deviated(log, 1.0, 3.0, 7.0)], nominal)
    assert not [name for name in found.findings.missing if "sway" in name or name == "steady_current"]
    assert any("forces are judged beside a deviation of 5.0 degrees" in note for note in found.notes)


def test_a_short_field_log_is_undecided(nominal: Vehicle) -> None:
    log = coloured(driven(nominal.with_values(HIDDEN), 4.0, 0).slice(0, 350), (0.08, 0.05, 0.04), 1.5, seed=3)
    findings = find_missing([log], nominal).findings
    assert findings.missing == ()
    assert findings.verdict == "undecided"


def test_too_few_straight_runs_leave_a_deviation_beside_which_is_judged(nominal: Vehicle) -> None:
    motion = driven(nominal, 4.0, 0).slice(0, 250)
    clear = correct_compass([motion])
    assert 0.0 < clear.turned <= UNKNOWN
    assert "right to within 2 degrees" in clear.notes[0]


def test_a_law_of_sway_is_found_beside_what_a_compass_may_lack(nominal: Vehicle) -> None:
    """Its size is that of the law, whatever constant the compass lacks."""
    log = coloured(driven(nominal.with_values({"Y_vv": -150.0}), 4.0, 0), (0.04, 0.03, 0.01), 1.0, seed=2)
    for turned in (log, deviated(log, 1.0, 0.0, 0.0)):
        found = find_missing([turned], nominal)
        assert found.basis.uses_rollouts
        (drag,) = (c for c in found.findings.added if c.effect == "sway_quadratic_damping")
        assert drag.terms[0].value == pytest.approx(-150.0 - nominal.value("Y_vv"), rel=0.15)


def test_a_misalignment_is_not_called_a_delay(nominal: Vehicle) -> None:
    motion = white(driven(nominal.with_values(HIDDEN), 4.0, 6), 5)
    late = replace(motion, velocity=np.concatenate([np.repeat(motion.velocity[:1], 2, axis=0), motion.velocity[:-2]]))
    assert clocks([motion]) == ()
    assert out_of_step([late], clocks([late])).seconds == pytest.approx(0.2, abs=0.03)
    found = find_missing([late], nominal).findings
    assert not {"input_delay", "thruster_lag"} & set(found.missing)
    claimed = {c.effect: c.claim for c in found.candidates if c.claim is not None}
    late = [claimed[name] for name in ("input_delay", "thruster_lag") if name in claimed]
    assert late, "what looks like it is in play"
    assert all(claim.tests["out_of_step"] > 0.5 for claim in late), "the time that it stands for is the log's own"


def test_a_plain_deviation_under_white_noise_is_judged_on_rollouts_too(nominal: Vehicle) -> None:
    log = deviated(white(driven(nominal.with_values(HIDDEN), 10.0, 6, both=True, rows=3000), 5), 1.0, 3.0, 7.0)
    assert compass_of([log]).plain
    found = find_missing([log], nominal)
    assert "the compass of this log deviates" in found.notes[0]
    assert set(found.findings.missing) == NAMES


def test_sway_and_mass_are_judged_by_rollouts_wherever_no_compass_deviates(nominal: Vehicle) -> None:
    basis = choose_balance([driven(nominal, 4.0, 0, rows=600)], nominal, DiscoverySettings())
    by_key = {c.key: c for c in candidates(nominal)}
    for key, by_sway in (("sway_lift", True), ("mass_offset", True), ("thruster_arm", False), ("surge_trim", False)):
        judged = [
            replace(basis, why=why, deviates=deviates).judges(by_key[key])
            for why, deviates in (("", True), ("rollouts", False), ("rollouts", True))
        ]
        assert judged == [True, True, not by_sway], key


def test_a_compass_that_deviates_in_one_log_of_several_deviates(
    nominal: Vehicle, monkeypatch: pytest.MonkeyPatch
) -> None:
    unsure = Compass(0.0, 0.0, 0.0, 0.0, np.inf, 0.0, 0.0)
    off = replace(unsure, size=0.1, error=0.01, explained=0.8, agree=0.9)
    motion = driven(nominal, 4.0, 0, rows=200)
    logs = [replace(motion, source=name) for name in ("one", "other", "one")]
    monkeypatch.setattr(
        basis_of_logs, "compass_shown", lambda motions: off if {m.source for m in motions} == {"other"} else unsure
    )
    assert correct_compass(logs).deviates
    assert "in one of the logs it does deviate, no law of sway is judged, nor mass" in correct_compass(logs).notes[0]
    assert not correct_compass(logs[::2]).deviates
    off = replace(off, explained=0.6)
    assert not correct_compass(logs).deviates, "by chance short logs deviate"


def test_nothing_is_missing_is_not_said_of_sway_beside_a_compass_that_deviates(nominal: Vehicle) -> None:
    log = deviated(white(driven(nominal, 10.0, 6, both=True, rows=3000), 5), 1.0, 3.0, 7.0)
    findings = find_missing([log], nominal).findings
    told = "Nothing material is missing that this log can show; laws of sway could not be judged."
    assert (findings.verdict, findings.headline) == ("nothing missing", told)
