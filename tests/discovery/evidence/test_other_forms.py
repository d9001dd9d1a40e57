"""What was named keeps its size beside forms without a name where it is the cause, and gives way where it is not."""

import numpy as np
import pytest
from dragged_world import Drag, Dragged, beyond

from undertow.discovery import discover
from undertow.discovery.balance.base import WeakSettings
from undertow.discovery.balance.weak_form import WeakForm
from undertow.discovery.candidates.candidate import candidates
from undertow.discovery.candidates.free_forms import free_forms
from undertow.discovery.discover import find_missing
from undertow.discovery.evidence.other_forms import OtherForms, other_forms
from undertow.discovery.findings import OtherForm
from undertow.discovery.reason import Reason
from undertow.discovery.search.floating import Search
from undertow.discovery.search.scoring import SearchSettings
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


def judged(motion: Motion, names: tuple[str, ...], **changes: float) -> OtherForms:
    """What is said of effects that are fitted on the force balance."""
    pool = [c for c in candidates(HULL) if c.key in names]
    search = Search(WeakForm([motion], WeakSettings()), HULL, pool, SearchSettings())
    state = search.evaluate(HULL.with_values(changes), names)
    return other_forms(search, state, names, 0, search.balance)


@pytest.mark.parametrize("noise", ["clean", "field", "rough"])
@pytest.mark.parametrize(
    "hidden",
    [{"surge_quadratic_damping": -20.0}, {"surge_linear_damping": -8.0, "surge_quadratic_damping": -15.0}],
    ids=["one", "two"],
)
def test_what_is_hidden_keeps_its_size(hidden: dict[str, float], noise: str):
    motion = simulate_world(HULL, hidden, duration=200.0, noise=noise, seed=5).motion()
    assert judged(motion, tuple(hidden)) == OtherForms((), {})


@pytest.mark.parametrize("noise", ["clean", "field"])
@pytest.mark.parametrize(("drag", "told"), [(KINK, "u beyond "), (cube, "u^3"), (net, "u from minute 1.")])
def test_a_stand_in_gives_way(drag: Drag, told: str, noise: str):
    said = judged(log_of(drag, noise), DRAG)
    assert said.found[0].axis == "surge"
    assert said.found[0].follows.startswith(told)
    assert set(said.doubts) == set(DRAG)
    for why in said.doubts.values():
        assert why.startswith(f"beside {said.found[0].in_words}, X_u")
        assert " instead of " in why


def test_two_names_for_one_law_are_doubted_where_the_log_cannot_tell():
    said = judged(log_of(cube, "rough", "gentle", 9), DRAG)
    assert set(said.doubts) == set(DRAG)
    assert "does as well" in said.doubts[DRAG[0]] or said.found


def test_an_effect_that_has_nothing_to_do_with_the_form_stays():
    said = judged(log_of(KINK), ("surge_linear_damping", "yaw_trim"))
    assert "yaw_trim" not in said.doubts
    assert "surge_linear_damping" in said.doubts


def test_a_model_without_effects_is_asked_nothing():
    motion = log_of(KINK)
    search = Search(WeakForm([motion], WeakSettings()), HULL, (), SearchSettings())
    assert other_forms(search, search.evaluate(HULL, ()), (), 0, search.balance) == OtherForms((), {})


def test_forms_have_names_of_their_own_and_no_noise_in_a_log_without():
    weak = WeakForm([log_of(KINK)], WeakSettings())
    forms = free_forms(weak, HULL)
    assert len(set(forms.names)) == len(forms.names) == forms.columns.shape[1]
    assert forms.noise.shape == (0, *forms.columns.shape)
    place = forms.names.index("u|u|")
    u = weak.motions[0].velocity[:, :1]
    np.testing.assert_allclose(forms.columns[:, place], weak.average([u * np.abs(u)])[:, 0], rtol=1e-12, atol=1e-12)


def test_a_stand_in_is_not_called_missing():
    findings = find_missing([log_of(KINK)], HULL).findings
    assert (findings.verdict, findings.missing) == ("undecided", ())
    assert findings.headline.startswith("Undecided: the log asks for a force in surge that follows u beyond ")
    doubted = [c for c in findings.candidates if c.reason is Reason.OTHER_FORM]
    assert {c.verdict for c in doubted} == {"possible"}
    assert {c.effect for c in doubted} <= set(DRAG)
    assert doubted
    assert findings.other_forms[0].share > 0.005


def test_what_holds_beside_a_form_is_named_and_the_form_is_told(monkeypatch: pytest.MonkeyPatch):
    motion = simulate_world(HULL, {"yaw_trim": 3.0}, duration=150.0, seed=4).motion()
    form = OtherForm(axis="surge", follows="u^3", force=1.5, share=0.03, unit="N")

    monkeypatch.setattr(discover, "other_forms", lambda *_: OtherForms((form,), {}))
    findings = find_missing([motion], HULL).findings
    assert (findings.missing, findings.other_forms) == (("yaw_trim",), (form,))
