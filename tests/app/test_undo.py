"""Steps back and forth: what is forgotten, what stays, and what is no step."""

from undertow.app.steps import _KEPT, History, Step
from undertow.workflows.workbench_facts import Source

FIRST, SECOND = "surge_quadratic_damping", "yaw_quadratic_damping"
START = Step(Source())


def test_a_step_after_one_that_was_taken_back_forgets_it():
    history = History((START,)).then(START.adding(FIRST)).back().then(START.adding(SECOND))
    assert [step.stand.names for step in history.steps] == [(), (SECOND,)]
    assert not history.can_redo


def test_the_ends_hold():
    history = History((START,)).then(START.adding(FIRST))
    assert history.forth() == history
    assert history.back().back() == history.back()
    assert (history.can_undo, history.can_redo) == (True, False)
    assert (history.back().can_undo, history.back().can_redo) == (False, True)


def test_the_eldest_steps_are_forgotten_and_the_present_one_is_the_last():
    history = History((START,))
    for k in range(_KEPT + 5):
        history = history.then(START.adding(f"effect {k}"))
    assert len(history.steps) == _KEPT
    assert history.now.stand.names == (f"effect {_KEPT + 4}",)
    assert history.steps[0].stand.names == ("effect 5",)


def test_one_way_of_a_slider_stays_one_step():
    step = START.adding(FIRST).moving({"X_uu": -3.0})
    history = History((START,)).then(step)
    along = history.moving({"X_uu": -4.0})
    assert len(along.steps) == len(history.steps)
    assert along.now.stand.moved == (("X_uu", -4.0),)
    assert along.back().now == START


def test_what_changes_nothing_is_the_same_step():
    step = START.adding(FIRST, SECOND)
    assert step.adding(SECOND) == step
    assert step.removing("sway_lift") == step
    assert step.fitting() == step


def test_another_model_is_fitted_again():
    moved = START.adding(FIRST).moving({"X_uu": -3.0})
    assert moved.adding(SECOND).stand.moved == ()
    assert moved.removing(FIRST).stand == START.stand


def test_a_correction_is_left_out_and_made_again():
    step = START.adding(FIRST).leaving("gyro_scale").leaving("compass_sine")
    assert step.stand.left == ("compass_sine", "gyro_scale")
    assert step.stand.names == (FIRST,)
    assert step.leaving("gyro_scale") == step
    assert step.correcting("gyro_scale").correcting("compass_sine") == START.adding(FIRST)
