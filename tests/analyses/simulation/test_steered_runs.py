"""Runs that are steered: pace, messages, what is done by hand; whole ones are in tests/studio."""

import math
from multiprocessing import Pipe

import cv2
import numpy as np
import pytest

from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.runs.steering import (
    BREAK,
    PUSH,
    UNTOUCHED,
    ByHand,
    MarksPicture,
    Message,
    RealtimeRate,
    Steering,
    check_steered,
    open_connection,
    receive,
    send,
)
from cdpr_drake.analyses.simulation.session import RunSession
from cdpr_drake.errors import CdprError, ScenarioError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.servo_models import servo_model


class Clock:
    """Time that passes when it is told to."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


def test_pace_waits_for_real_time_and_lets_what_is_late_go_on_from_there():
    clock = Clock()
    pace = RealtimeRate(2.0, clock)
    assert pace.wait(0.0) == 0.0
    assert pace.wait(1.0) == pytest.approx(0.5)  # a second at twice real time
    clock.now += 0.5
    assert pace.wait(1.0) == 0.0
    clock.now += 10.0  # nothing happened for long
    assert pace.wait(1.1) == 0.0
    assert pace.wait(2.1) == pytest.approx(0.5)  # and is not caught up on
    pace.go_at(None)
    assert pace.wait(50.0) == 0.0


def test_a_step_goes_so_far_and_stands():
    pace = RealtimeRate(None, Clock())
    pace.pause()
    assert pace.wait(1.0) == math.inf
    pace.step(1.0, 0.02)
    assert [pace.wait(t) for t in (1.0, 1.01)] == [0.0, 0.0]
    assert pace.wait(1.02) == math.inf
    assert pace.paused
    pace.go()
    assert pace.wait(1.02) == 0.0


def test_messages_arrive_as_they_were_with_numbers_that_browsers_know():
    here, there = Pipe()
    with here, there:
        send(here, Message("image", {"t": 0.5, "x": [1.0, math.nan]}, b"\x00jpeg"))
        assert receive(there) == Message("image", {"t": 0.5, "x": [1.0, None]}, b"\x00jpeg")
        here.send_bytes(b"[1, 2]")
        with pytest.raises(ValueError, match="no kind"):
            receive(there)


def test_what_is_no_socket_is_refused():
    with pytest.raises(CdprError, match="descriptor: found -5; accepted: the number of an open"):
        open_connection(-5)


def test_a_loop_that_cannot_be_looked_into_is_refused():
    settings = ["camera.kind=projected", "integration.loop=compiled"]
    with pytest.raises(ScenarioError, match=r"integration\.loop: found compiled, but"):
        check_steered(load_scenario("acrobot_pbvs", settings))


@pytest.mark.parametrize("scenario", ["acrobot_pbvs", "acrobot_circles"])
def test_marks_are_drawn_where_they_are(scenario):
    loaded = load_scenario(scenario)
    model = servo_model(loaded, load_robot(loaded.robot))
    X_CO = model.X_CO(loaded.initial_pose.transform(), 0.0)
    marks = model.target.project(X_CO, model.pinhole, 0.0, np.random.default_rng())
    jpeg = MarksPicture(model).jpeg(marks, None)
    image = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR).astype(int)
    assert image.shape[1] <= 640
    drawn = image[:, :, 2] - image[:, :, 0] > 80  # orange: much red, little blue
    v, u = np.nonzero(drawn)
    scale = image.shape[1] / model.pinhole.width
    points = marks.reshape(-1, 2 if model.target.mark == "corners" else 5)[:, :2] * scale
    assert np.abs(np.median(u) - np.mean(points[:, 0])) < 15.0
    assert np.abs(np.median(v) - np.mean(points[:, 1])) < 15.0


# By hand: it happens, is kept, and the run is repeated.

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

        result = ServoRun(loaded).simulate(RunSession(prepare=prepare))
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
    again = ServoRun(loaded).simulate()
    for name in ("time", "X_WP", "tensions"):
        np.testing.assert_array_equal(again.log[name], result.log[name])


def test_a_run_that_nobody_touches_is_as_without():
    plain = ServoRun(scenario("integration.loop=diagram")).simulate()
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
