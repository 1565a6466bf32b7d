"""What is done by hand to a run that is steered: it happens, is kept, and the run is repeated."""

from multiprocessing import Pipe

import numpy as np
import pytest

from cdpr_drake.analyses.simulation.by_hand import BREAK, PUSH, UNTOUCHED, ByHand
from cdpr_drake.analyses.simulation.live_control import Steering
from cdpr_drake.analyses.simulation.live_messages import Message, receive, send
from cdpr_drake.analyses.simulation.session import RunSession
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.errors import ScenarioError
from cdpr_drake.systems.diagrams.load import load_scenario

SETTINGS = ("camera.kind=projected", "duration=0.6", "stop.target_lost=10.0")
OPEN = tuple(f"{section}={least}" for section, least in UNTOUCHED.values())


def scenario(*settings):
    return load_scenario("acrobot_pbvs", (*SETTINGS, *settings))


def steered(loaded, *acts):
    """A run to which something is done at its times, and what it said about that."""
    ours, theirs = Pipe()
    with ours, theirs:
        steering = Steering(loaded, theirs, should_stop=lambda: False, ask_stop=lambda: None)
        todo = list(acts)

        def prepare(simulator, diagram):
            steering.prepare(simulator, diagram)
            look = steering._look

            def monitor(context):
                while todo and context.get_time() >= todo[0][0]:
                    send(ours, Message("do", todo.pop(0)[1]))
                    steering._listen_due = 0.0
                return look(diagram, context)

            simulator.set_monitor(monitor)

        result = run_scenario(loaded, RunSession(prepare=prepare))
        said = []
        while ours.poll(0.0):
            message = receive(ours)
            if message.kind == "event":
                said.append(message.data)
    return result, said


SPLIT = 1e-5
"""Largest difference of poses [m] where the integrator's steps end every millisecond too."""

BROKEN = {"what": BREAK, "cable": 2}
PUSHED = {"what": PUSH, "force": [0.0, 8.0, 0.0], "seconds": 0.1}


@pytest.mark.parametrize("engine", ["plant", "compiled"])
def test_a_run_with_hands_on_it_is_that_of_the_scenario_that_is_kept(engine):
    loaded = scenario(*OPEN, f"integration.engine={engine}")
    result, said = steered(loaded, (0.1, PUSHED), (0.3, BROKEN))
    assert [one["words"] for one in said] == ["push of 8 N for 0.1 s", "C3 breaks"]
    (event,), (_, push) = loaded.failures.events, loaded.disturbances.pushes
    assert event.cable == 2
    assert event.time == pytest.approx(0.3, abs=0.02)
    assert push.end - push.start == pytest.approx(0.1)
    time, tensions = result.log["time"], result.log["tensions"]
    assert np.all(tensions[time > event.time, 2] == 0.0)
    assert np.all(tensions[time < push.start, 2] > 0.0)
    assert push.start < 0.12
    again = run_scenario(loaded)
    for name in ("time", "X_WP", "tensions"):
        np.testing.assert_array_equal(again.log[name], result.log[name])


def test_a_run_that_nobody_touches_is_as_without():
    plain = run_scenario(scenario("integration.loop=diagram"))
    open_, said = steered(scenario(*OPEN))
    assert said == []
    np.testing.assert_array_equal(open_.log["time"], plain.log["time"])
    np.testing.assert_allclose(open_.log["X_WP"], plain.log["X_WP"], atol=SPLIT)


def test_what_cannot_be_done_is_refused_in_a_line():
    hand = ByHand(scenario())
    assert hand.takes == ()
    with pytest.raises(ScenarioError, match="break: found it with a scenario without failures"):
        hand.do(BROKEN, 0.0)
    _, said = steered(
        scenario(*OPEN),
        (0.1, {"what": BREAK, "cable": 8}),
        (0.2, {"what": PUSH, "force": [0.0, 0.0, 0.0], "seconds": 0.1}),
        (0.3, {"what": PUSH, "force": [1.0, 0.0, 0.0], "seconds": 1e9}),
    )
    words = [one["refused"] for one in said]
    assert words[0] == "cable: found 8; accepted: 0, 1, 2, 3, 4, 5, 6, 7"
    assert words[1].startswith("force: found [0.0, 0.0, 0.0]; accepted: three numbers")
    assert words[2].startswith("seconds: found 1000000000.0; accepted: above 0 to 60 s")


def test_a_scenario_with_failures_of_its_own_is_not_broken_by_hand():
    own = "failures={events: [{kind: cable_breaks, time: 0.2, cable: 1}]}"
    assert ByHand(scenario(own, OPEN[1])).takes == (PUSH,)
