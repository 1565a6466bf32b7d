"""Pace and messages of a run that is steered; a steered run itself is tested in tests/studio."""

import math
from multiprocessing import Pipe

import cv2
import numpy as np
import pytest

from cdpr_drake.analyses.simulation.live_control import check_steered
from cdpr_drake.analyses.simulation.live_messages import Message, open_connection, receive, send
from cdpr_drake.analyses.simulation.mark_images import MarksPicture
from cdpr_drake.analyses.simulation.realtime_rate import RealtimeRate
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
