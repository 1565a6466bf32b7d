"""The state of a loop as arrays."""

import numpy as np
import pytest

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


def test_a_loop_refuses_the_state_of_another():
    def loop(*changes):
        options = ("camera.kind=projected", "integration.loop=compiled", *changes)
        return ServoLoop(check_loop(load_scenario("acrobot_pbvs", options)))

    with pytest.raises(ValueError, match="another loop"):
        loop().restore_state(loop("camera.latency_frames=1").state_arrays())
