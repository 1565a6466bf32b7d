"""The state of a loop as arrays."""

import numpy as np
import pytest

from cdpr_drake.errors import DivergedError
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import check_loop
from cdpr_drake.systems.loops.loop_state import arrays_of, entry, held, restore_arrays
from cdpr_drake.systems.loops.servo_loop import ServoLoop


def test_parts_are_copied_and_put_back():
    where, kept = {"a": np.arange(2.0)}, np.zeros(3)
    parts = [entry("a", where), held("b", kept)]
    arrays = arrays_of(parts)
    where["a"], kept[:] = np.ones(2), 7.0
    assert arrays["b"].tolist() == [0.0, 0.0, 0.0]
    restore_arrays(parts, arrays)
    assert where["a"].tolist() == [0.0, 1.0]
    assert kept.tolist() == [0.0, 0.0, 0.0]
    with pytest.raises(ValueError, match="another loop"):
        restore_arrays(parts, {"a": arrays["a"]})


def loop_of(name, *changes):
    options = ("camera.kind=projected", "integration.loop=compiled", *changes)
    return ServoLoop(check_loop(load_scenario(name, options)))


def test_a_loop_refuses_the_state_of_another():
    state = loop_of("acrobot_pbvs", "camera.latency_frames=1").state_arrays()
    loop = loop_of("acrobot_pbvs")
    with pytest.raises(ValueError, match="another loop"):
        loop.restore_state(state)


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("acrobot_switching", ["estimator.compare=[first_image]"]),
        ("acrobot_slack_start_tca", ["sensors.log=[tension]"]),
    ],
)
def test_another_loop_goes_on_from_a_state_to_the_same_bits(name, changes):
    """From the middle of a period, as from a checkpoint; that loop had been elsewhere."""
    first, second = loop_of(name, *changes), loop_of(name, *changes)
    for loop, until in ((first, 0.25), (second, 0.1)):
        loop.start()
        loop.advance_to(until)
    second.restore_state(first.state_arrays())
    for loop in (first, second):
        loop.log.clear()
        loop.advance_to(0.5)
    for ours, theirs in (
        (first.log.read(), second.log.read()),
        (first.state_arrays(), second.state_arrays()),
    ):
        assert list(ours) == list(theirs)
        for key, values in ours.items():
            assert values.tobytes() == theirs[key].tobytes(), key


def test_speeds_that_no_step_can_follow_diverge():
    loop = loop_of("acrobot_pbvs")
    loop.start()
    loop.advance_to(0.2)
    state = loop.state_arrays()
    state["motion"][10] = 1e200
    loop.restore_state(state)
    with pytest.raises(DivergedError), np.errstate(all="ignore"):
        loop.advance_to(1.0)
