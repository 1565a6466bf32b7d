"""Runs that are steered: pace, messages, what is done by hand; whole ones are in tests/studio."""

import math
import os
from multiprocessing import Pipe

import cv2
import numpy as np
import pytest

from cdpr_drake.analyses.frame.folder import Folder
from cdpr_drake.analyses.frame.follow import NOBODY, Follow
from cdpr_drake.analyses.runs.samples import MarksPicture
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.runs.simulate import simulate
from cdpr_drake.analyses.runs.steering import (
    BREAK,
    FASTEST_SPEED,
    PUSH,
    UNTOUCHED,
    ByHand,
    Message,
    Pace,
    Steering,
    check_steered,
    receive,
    send,
    steered,
)
from cdpr_drake.errors import CdprError, OutputFolderError, ScenarioError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.servo_models import servo_model


def test_pace_waits_for_real_time_and_lets_what_is_late_go_on_from_there():
    now = [100.0]
    pace = Pace(2.0, lambda: now[0])
    assert pace.wait(0.0) == 0.0
    assert pace.wait(1.0) == pytest.approx(0.5)  # a second at twice real time
    now[0] += 0.5
    assert pace.wait(1.0) == 0.0
    now[0] += 10.0  # nothing happened for long
    assert pace.wait(1.1) == 0.0
    assert pace.wait(2.1) == pytest.approx(0.5)  # and it does not catch up
    pace.go_at(None)
    assert pace.wait(50.0) == 0.0


def test_a_step_goes_so_far_and_stands():
    pace = Pace(clock=lambda: 100.0)
    pace.pause()
    assert pace.wait(1.0) == math.inf
    pace.step(1.0, 0.02)
    assert [pace.wait(t) for t in (1.0, 1.01, 1.02)] == [0.0, 0.0, math.inf]
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


@pytest.mark.parametrize("name", ["acrobot_pbvs", "acrobot_circles"])
def test_marks_are_drawn_where_they_are(name):
    loaded = load_scenario(name)
    model = servo_model(loaded, load_robot(loaded.robot))
    X_CO = model.X_CO(loaded.initial_pose.transform(), 0.0)
    marks = model.target.project(X_CO, model.pinhole, 0.0, np.random.default_rng())
    jpeg = MarksPicture(model).jpeg(marks, None)
    image = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR).astype(int)
    assert image.shape[1] <= 640
    v, u = np.nonzero(image[:, :, 2] - image[:, :, 0] > 80)  # orange: much red, little blue
    scale = image.shape[1] / model.pinhole.width
    points = marks.reshape(-1, 2 if model.target.mark == "corners" else 5)[:, :2] * scale
    assert np.abs(np.median(u) - np.mean(points[:, 0])) < 15.0
    assert np.abs(np.median(v) - np.mean(points[:, 1])) < 15.0


# By hand: it happens, is kept, and the run is repeated.

SETTINGS = ("camera.kind=projected", "duration=0.6", "stop.target_lost=10.0")
OPEN = tuple(f"{section}={least}" for section, least in UNTOUCHED.values())

SPLIT = 1e-5
"""Largest difference of poses [m] where the integrator's steps end every millisecond too."""

BROKEN = {"what": BREAK, "cable": 2}
PUSHED = {"what": PUSH, "force": [0.0, 8.0, 0.0], "seconds": 0.1}


def scenario(*settings):
    return load_scenario("acrobot_pbvs", (*SETTINGS, *settings))


def by_hand(loaded, *acts, enough=lambda messages: False):
    """A run with acts at their times, and its messages by kind, of which some are enough."""
    (ours, theirs), messages = Pipe(), {}

    def read():
        while ours.poll(0.0):
            message = receive(ours)
            messages.setdefault(message.kind, []).append(message.data)
        return enough(messages)

    with ours, theirs:
        steering, todo = Steering(loaded, theirs, read), list(acts)

        def prepare(run, simulator, diagram):
            steering.prepare(run, simulator, diagram)
            look = steering._look

            def monitor(context):
                while todo and context.get_time() >= todo[0][0]:
                    send(ours, Message("do", todo.pop(0)[1]))
                    steering._listen_due = 0.0
                return look(diagram, context)

            simulator.set_monitor(monitor)

        run = ServoRun(loaded).simulate(follow=Follow(prepare=prepare, stop=steering.stop))
        read()
    return run, messages


@pytest.mark.parametrize("engine", ["plant", "compiled"])
def test_a_run_by_hand_is_a_run_of_the_scenario_that_is_kept(engine):
    loaded = scenario(*OPEN, f"integration.engine={engine}")
    run, messages = by_hand(loaded, (0.1, PUSHED), (0.3, BROKEN))
    assert [data["words"] for data in messages["event"]] == ["push of 8 N for 0.1 s", "C3 breaks"]
    assert messages["begin"][0]["takes"] == [BREAK, PUSH]
    assert {"sample", "pace"} <= set(messages)
    (event,), (_, push) = loaded.failures.events, loaded.disturbances.pushes
    assert event.cable == 2
    assert event.time == pytest.approx(0.3, abs=0.02)
    assert push.end - push.start == pytest.approx(0.1)
    time, tensions = run.log["time"], run.log["tensions"]
    assert np.all(tensions[time > event.time, 2] == 0.0)
    assert np.all(tensions[time < push.start, 2] > 0.0)
    assert messages["event"][0]["t"] < push.start < 0.12  # a period under way is not changed
    again = ServoRun(loaded).simulate()
    for name in ("time", "X_WP", "tensions"):
        np.testing.assert_array_equal(again.log[name], run.log[name])


def test_a_run_that_nobody_touches_is_as_without_and_a_stop_ends_it():
    plain = ServoRun(scenario("integration.loop=diagram")).simulate()
    untouched, messages = by_hand(scenario(*OPEN))
    assert "event" not in messages
    np.testing.assert_array_equal(untouched.log["time"], plain.log["time"])
    np.testing.assert_allclose(untouched.log["X_WP"], plain.log["X_WP"], atol=SPLIT)
    fast = {"what": "speed", "factor": 1e9}
    stopped, messages = by_hand(scenario(*OPEN), (0.1, fast), (0.2, {"what": "stop"}))
    assert [pace["speed"] for pace in messages["pace"]][:2] == [None, FASTEST_SPEED]
    assert stopped.stopped
    assert 0.2 <= stopped.sim_time < 0.6


def test_a_run_that_stands_shows_once_how_it_stands():
    calls, looks = [], []

    def enough(messages):
        """It stands and has waited for some looks; one that shows nothing ends at last, too."""
        calls.append(0)
        looks.extend(pace for pace in messages.get("pace", [])[-1:] if pace["paused"])
        return len(looks) > 3 or len(calls) > 300

    run, messages = by_hand(scenario(*OPEN), (0.1, {"what": "pause"}), enough=enough)
    assert run.stopped
    assert run.sim_time == looks[0]["t"] == pytest.approx(0.1, abs=0.02)
    assert sum(pace["paused"] for pace in messages["pace"]) == 1
    # On a busy machine one was due just before it stood; it has looked more often than that.
    assert [image["t"] for image in messages["image"]].count(run.sim_time) in (1, 2)


def test_acts_loops_and_sockets_that_are_not_accepted_are_refused_in_a_line():
    with pytest.raises(CdprError, match="steered_by: found -5; accepted: the number of an open"):
        steered(NOBODY, scenario(), -5)
    with pytest.raises(ScenarioError, match=r"integration\.loop: found compiled, but"):
        check_steered(scenario("integration.loop=compiled"))
    assert ByHand(scenario()).takes == ()
    # With failures of its own the times of events are fixed.
    failing = "failures={events: [{kind: cable_breaks, time: 0.2, cable: 1}]}"
    assert ByHand(scenario(failing, OPEN[1])).takes == (PUSH,)
    with pytest.raises(ScenarioError, match="break: found it with a scenario without failures"):
        ByHand(scenario()).do(BROKEN, 0.0)
    _, messages = by_hand(
        scenario(*OPEN), (0.05, BROKEN), (0.07, BROKEN), (0.1, {"what": BREAK, "cable": 8}),
        (0.2, {"what": PUSH, "force": [0.0, 0.0, 0.0], "seconds": 0.1}),
        (0.3, {"what": PUSH, "force": [1.0, 0.0, 0.0], "seconds": 1e9}),
    )  # fmt: skip
    words = [data["refused"] for data in messages["event"][1:]]
    for number in (2, 8):
        assert words.pop(0) == f"cable: found {number}; accepted: 0, 1, 3, 4, 5, 6, 7"
    assert words[0].startswith("force: found [0.0, 0.0, 0.0]; accepted: three numbers")
    assert words[1].startswith("seconds: found 1000000000.0; accepted: above 0 to 60 s")


def test_a_run_that_was_acted_on_never_goes_on_from_the_middle(tmp_path):
    acts = Follow(prepare=lambda *_: None, acts=True)
    with Folder(tmp_path / "out", {}) as folder:
        run = ServoRun(scenario("duration=0.05"))
        run.simulate(folder.path, acts)
        assert not list(folder.path.glob("log.parts/*.npz"))
        with pytest.raises(OutputFolderError, match="which cannot go on; accepted: cdpr finish"):
            run.simulate(folder.path, acts)


def test_a_run_that_is_long_enough_for_the_compiled_loop_is_steered(tmp_path):
    ours, theirs = Pipe()
    with ours, theirs:
        send(ours, Message("do", {"what": "stop"}))
        run = simulate(
            "acrobot_pbvs", SETTINGS, folder=tmp_path / "out", duration=700.0,
            steered_by=os.dup(theirs.fileno()),
        )  # fmt: skip
        assert receive(ours).data["takes"] == []
    assert (run.stopped, run.scenario.integration.loop) == (True, "automatic")
