"""What acts keeps its size beside forms without a name, and nothing does in its place; a stand-in gives way."""

from dataclasses import replace

import numpy as np
import pytest
from dragged_world import Drag, Dragged, beyond

from undertow.discovery import discover
from undertow.discovery.balance.base import WeakSettings
from undertow.discovery.balance.weak_form import WeakForm
from undertow.discovery.candidates.candidate import candidates
from undertow.discovery.candidates.unnamed_terms import finer_forms, free_forms
from undertow.discovery.discover import find_missing
from undertow.discovery.evidence.unmodelled_forces import UnmodelledForces, fit_unmodelled_forces
from undertow.discovery.findings import OtherForm
from undertow.discovery.search.floating import Search
from undertow.discovery.search.scoring import TELL_APART, SearchSettings
from undertow.physics.motion import Motion
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import NOISE, simulate_world

HULL = load_vehicle("blueboat")
DRAG = ("surge_linear_damping", "surge_quadratic_damping")


def log_of(drag: Drag, noise: str = "clean", programme: str = "rich", seed: int = 4) -> Motion:
    return Dragged(HULL, programme, 200.0, seed, drag=drag).run(NOISE[noise]).motion()


KINK = beyond(0.8, 25.0)


def cube(t: float, u: float) -> float:
    return -8.0 * u**3


def net(t: float, u: float) -> float:
    return -12.0 * u * (t > 90.0)


GIVES_WAY = 0.3
"""Share of its force by which a stand-in becomes another beside what acts: a cause changes by a tenth of that."""


def judged(motions: Motion | list[Motion], names: tuple[str, ...]) -> UnmodelledForces:
    """What is said of effects that are fitted on the force balance."""
    pool = [c for c in candidates(HULL) if c.key in names]
    logs = motions if isinstance(motions, list) else [motions]
    search = Search(WeakForm(logs, WeakSettings()), HULL, pool, SearchSettings())
    return fit_unmodelled_forces(search, search.evaluate(HULL, names), names, 0)


def stand_ins(said: UnmodelledForces) -> set[str]:
    """The effects in whose place a form explains more, and those that become others beside what is found."""
    return {key for key, b in said.refits.items() if (b.margin or 0.0) > TELL_APART or b.change > GIVES_WAY}


@pytest.mark.parametrize("noise", ["clean", "field", "rough"])
@pytest.mark.parametrize(
    "hidden",
    [
        {"surge_quadratic_damping": -20.0},
        {"surge_linear_damping": -8.0, "surge_quadratic_damping": -15.0},
        {"hull_fouling": 0.1},
        {"battery_sag": -0.05},
    ],
    ids=lambda hidden: " and ".join(hidden),
)
def test_what_is_hidden_keeps_its_size(hidden: dict[str, float], noise: str):
    motion = simulate_world(HULL, hidden, duration=200.0, noise=noise, seed=5).motion()
    said = judged(motion, tuple(hidden))
    assert said.selected == ()
    assert set(said.refits) == set(hidden)
    assert stand_ins(said) == set()
    assert all((beside.change, beside.by) == (0.0, {}) for beside in said.refits.values())


@pytest.mark.parametrize("noise", ["clean", "field"])
@pytest.mark.parametrize(("drag", "told"), [(KINK, "u beyond "), (cube, "u^3"), (net, "u from minute 1.")])
def test_a_stand_in_gives_way(drag: Drag, told: str, noise: str):
    said = judged(log_of(drag, noise), DRAG)
    assert said.selected[0].axis == "surge"
    assert said.selected[0].follows.startswith(told)
    assert stand_ins(said) == set(DRAG)
    for key, symbol in zip(DRAG, ("X_u", "X_uu"), strict=True):
        beside = said.refits[key]
        assert beside.change > GIVES_WAY
        assert abs(beside.by[symbol]) > 0.0
        assert beside.form is not None
        assert beside.form.in_words in beside.sentence


def test_what_explains_more_than_a_doubtful_name_is_told_beside_it():
    said = find_missing([log_of(KINK, "field")], HULL).findings
    last = said.other_forms[-1]
    assert said.verdict == "undecided"
    assert last.axis == "surge"
    assert last.follows.startswith("u beyond 0.8")
    assert said.reasons[-1].startswith(f"A force in surge that follows {last.follows} explains more than surge ")


def test_what_sets_in_at_once_does_as_well_as_what_grows():
    beside = judged(log_of(net, "field"), ("hull_fouling",)).refits["hull_fouling"]
    assert beside.margin is not None
    assert beside.margin > TELL_APART
    assert beside.sentence.startswith("in its place ")


def test_an_effect_is_no_rival_of_itself():
    """The time times the drag is what fouling is, and all thrust times the time what a battery does."""
    for hidden in ({"hull_fouling": 0.1}, {"battery_sag": -0.05}):
        motion = simulate_world(HULL, hidden, duration=200.0, seed=5).motion()
        assert stand_ins(judged(motion, tuple(hidden))) == set()


def test_an_effect_that_has_nothing_to_do_with_the_form_stays():
    said = judged(log_of(KINK), ("surge_linear_damping", "yaw_trim"))
    assert stand_ins(said) == {"surge_linear_damping"}
    assert said.refits["yaw_trim"].change < 0.1


def test_what_a_model_without_effects_leaves_follows_a_form():
    said = judged(log_of(KINK), ())
    assert (said.selected[0].axis, said.selected[0].follows) == ("surge", "u beyond 0.89 m/s either way")
    assert said.refits == {}


def test_forms_have_names_of_their_own_and_no_noise_in_a_log_without():
    weak = WeakForm([log_of(KINK)], WeakSettings())
    forms = free_forms(weak, HULL)
    assert len(set(forms.names)) == len(forms.names) == forms.columns.shape[1]
    assert forms.noise.shape == (0, *forms.columns.shape)
    place = forms.names.index("u|u|")
    u = weak.motions[0].velocity[:, :1]
    np.testing.assert_allclose(forms.columns[:, place], weak.average([u * np.abs(u)])[:, 0], rtol=1e-12, atol=1e-12)


def test_forms_of_noisy_logs_know_what_noise_adds():
    forms = free_forms(WeakForm([log_of(KINK, "rough")], WeakSettings()), HULL)
    added = np.sqrt((forms.noise**2).mean(axis=(0, 1)))
    assert added[forms.names.index("the thrust of port")] == 0.0
    assert 0.0 < added[forms.names.index("u")] < added[forms.names.index("u^3")]


def test_several_logs_and_late_ones_have_names_of_their_own_too():
    motion = log_of(KINK)
    for logs in ([motion, motion], [replace(motion, time=motion.time + 36000.0)]):
        forms = free_forms(WeakForm(logs, WeakSettings()), HULL)
        assert len(set(forms.names)) == len(forms.names)


def test_a_stand_in_is_not_called_missing():
    findings = find_missing([log_of(KINK)], HULL).findings
    assert findings.missing == ()
    assert findings.verdict != "nothing missing"
    assert any(form.axis == "surge" and form.share > 0.005 for form in findings.other_forms)
    claimed = {c.effect: c.claim.tests for c in findings.candidates if c.claim is not None}
    drag = {name: sizes for name, sizes in claimed.items() if name in DRAG}
    assert drag, "what stands in for it is in play, with the sizes of its doubts"
    for name, sizes in drag.items():
        assert sizes["substitute"] > 0.0, name


def test_what_holds_beside_a_form_is_named_and_the_form_is_told(monkeypatch: pytest.MonkeyPatch):
    motion = simulate_world(HULL, {"yaw_trim": 3.0}, duration=150.0, seed=4).motion()
    form = OtherForm(axis="surge", follows="u^3", force=1.5, share=0.03, unit="N")

    monkeypatch.setattr(discover, "fit_unmodelled_forces", lambda *_: UnmodelledForces((form,)))
    findings = find_missing([motion], HULL).findings
    assert (findings.missing, findings.other_forms) == (("yaw_trim",), (form,))
    assert findings.headline == "The model is missing yaw trim."
    assert findings.reasons == ("A force in surge that follows u^3 stays unexplained, 3 % of the force at work.",)


def test_a_law_that_one_knot_meets_is_no_drag_and_trim():
    names = ("surge_quadratic_damping", "surge_trim")
    slow = Dragged(HULL, "gentle", 200.0, 4, drag=beyond(0.65, 20.0)).run(NOISE["field"]).motion()
    assert stand_ins(judged(slow, names)) == set(names)
    true = simulate_world(HULL, {"surge_quadratic_damping": -20.0, "surge_trim": 5.0}, duration=200.0, noise="field")
    assert stand_ins(judged(true.motion(), names)) == set()


def test_a_power_between_two_laws_is_neither():
    between = Dragged(HULL, "rich", 200.0, 4, drag=lambda t, u: -25.0 * u * float(np.sqrt(abs(u)))).run(NOISE["field"])
    assert stand_ins(judged(between.motion(), DRAG)) == set(DRAG)
    assert "u|u|^0.5" in finer_forms(WeakForm([between.motion()], WeakSettings()), HULL, "u").names
