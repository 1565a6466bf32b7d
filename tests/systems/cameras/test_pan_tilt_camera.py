"""The section camera.pan_tilt in runs: a steady view of a target that a fixed camera misses."""

import numpy as np
import pytest

from cdpr_drake.analyses.runs.checks import check_start
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.loops.loop_choice import diagram_reason
from cdpr_drake.systems.monitoring.run_monitor import Outcome

COMPILED = "integration.engine=compiled"


def test_loops_leave_it_to_a_diagram():
    reason = diagram_reason(load_scenario("acrobot_pan_tilt", []))
    assert reason == "its section camera.pan_tilt adds blocks to a diagram"


@pytest.fixture(scope="module")
def run():
    return ServoRun(load_scenario("acrobot_pan_tilt", [COMPILED])).simulate()


def test_it_finds_the_tag_and_keeps_it(run):
    """From a start where the fixed camera sees nothing."""
    assert run.outcome == Outcome.CONVERGED
    told = run.as_dict()["pan_tilt"]
    assert told["first_seen_s"] > 0.1
    assert told["unseen_after_s"] == 0.0
    assert told["off_center_px"]["end"] < 5.0
    assert max(told["largest_angles_deg"]) > 20.0
    assert told["at_limits_s"] == 0.0
    # A zero of 0.1 deg and noise of 0.02 deg, a count of 0.09 deg.
    assert 0.0 < max(told["encoder_error_deg"]) < 0.4


def test_the_steady_view_is_that_of_the_mounting(run):
    """Marks and pose as if the camera were fixed, to what pixels and encoders leave."""
    log, servo = run.log, run.built
    row = len(log["time"]) - 40
    assert log["found"][row] == 1.0
    seen = pose_from_row(log["X_CO_measured"][row])
    time = np.floor(log["time"][row] * 25.0 - 1e-6) / 25.0
    k = int(np.argmin(np.abs(log["time"] - time)))
    true = servo.X_CO(pose_from_row(log["X_WP"][k]), time)
    assert np.linalg.norm(seen.translation() - true.translation()) < 5e-3
    uv = servo.pinhole.project(true @ servo.target.points).T.ravel()
    assert np.max(np.abs(uv - log["corners_px"][row])) < 12.0


def test_the_fixed_camera_sees_nothing():
    fixed = ServoRun(
        load_scenario("acrobot_pan_tilt", [COMPILED, "camera.pan_tilt=null", "duration=1.0"])
    ).simulate()
    assert not np.any(fixed.log["found"])


def test_a_start_that_no_angles_show_is_refused():
    shown = build_visual_servo(load_scenario("acrobot_pan_tilt", [COMPILED]))
    check_start(shown)
    few = [COMPILED, "camera.pan_tilt.upper_deg=[75, 5]"]
    with pytest.raises(ScenarioError, match=r"aimed by camera\.pan_tilt, does not see"):
        check_start(build_visual_servo(load_scenario("acrobot_pan_tilt", few)))


def test_a_rendered_camera_turns_too():
    """Few images: it sees the tag turned, at angles it starts from."""
    seen = ServoRun(
        load_scenario(
            "acrobot_pan_tilt",
            [
                COMPILED, "camera.kind=rendered",
                "camera.pan_tilt.start_deg=[-34, 36]", "duration=0.3", "camera.rate=10",
                "controller.rate=10",
            ],
        )
    ).simulate()  # fmt: skip
    assert seen.log["turned_found"][-1] == 1.0
    assert seen.log["found"][-1] == 1.0
