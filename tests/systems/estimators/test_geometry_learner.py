"""The section `adaptation` in a run: what it learns, logs, tells and refuses."""

import numpy as np
import pytest

from cdpr_drake.analyses.simulation.run_figures import run_figures
from cdpr_drake.analyses.simulation.run_summary import summarize
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.errors import ScenarioError
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.loops.loop_choice import diagram_reason

RUN = ("integration.engine=compiled", "duration=3")

FIVE_SIGMA = 5.0
"""What one of 56 numbers of a run is beyond once in thirty thousand runs."""


@pytest.fixture(scope="module")
def result():
    return run_scenario(load_scenario("acrobot_adaptation", RUN))


def test_it_is_told_with_the_truth_beside_it(result):
    told = summarize(result)["adaptation"]
    assert told["largest_error_in_sigmas"] < FIVE_SIGMA
    assert told["doubts"] == []
    assert told["models_believed"] >= 3
    assert told["points_rms_after_m"] < told["points_rms_before_m"] == pytest.approx(0.0115, 0.01)
    assert len(told["learnt"]) == told["directions"] == 56
    assert any("world frame" in word for word in told["open_frames"])
    assert "adaptation" in {name.split(".")[0] for name in run_figures(result, ("png",))}


def test_the_servo_goes_by_what_is_believed(result):
    believed = result.log["believed_points"]
    assert np.any(believed[-1] != believed[0])
    servo = result.servo.servo
    rows = servo.controller._cable_rows
    # The last rows of the log: the servo's last step may be older than the last model.
    points = np.concatenate([rows[:, :3].ravel(), rows[:, 3:6].ravel()])
    assert np.min(np.max(np.abs(believed[-6:] - points), axis=1)) < 1e-9
    assert np.max(np.abs(believed[0] - points)) > 1e-4
    assert rows is servo.controller._steps[0][1][6]  # compiled steps read the same numbers


def test_a_model_that_the_criterion_rejects_is_counted_and_told():
    result = run_scenario(load_scenario("acrobot_adaptation", (*RUN, "adaptation.margin=5")))
    told = summarize(result)["adaptation"]
    assert told["models_believed"] == 0 < told["models_rejected"]
    assert any("rejected by the stability criterion" in words for words in told["doubts"])
    assert np.ptp(result.log["believed_points"], axis=0).max() == 0.0


def test_what_is_only_logged_changes_nothing():
    changes = (*RUN, "duration=1", "adaptation.believe=false")
    watched = run_scenario(load_scenario("acrobot_adaptation", changes))
    alone = run_scenario(
        load_scenario("acrobot_adaptation", (*RUN, "duration=1", "adaptation=null"))
    )
    np.testing.assert_array_equal(watched.log["X_WP"], alone.log["X_WP"])
    assert watched.log["adaptation"][-1, 0] > 1.0


def test_late_images_are_put_beside_the_lengths_of_their_instant():
    changes = (*RUN, "camera.latency_frames=3")
    told = summarize(run_scenario(load_scenario("acrobot_adaptation", changes)))["adaptation"]
    assert told["largest_error_in_sigmas"] < FIVE_SIGMA
    assert told["scatter"] < 2.0


def test_a_frozen_encoder_is_named():
    changes = (
        *RUN, "duration=7", "sensors.log=[encoder]",
        "failures.events=[{kind: sensor_freezes, sensor: encoder, cable: 3, time: 1.0}]",
    )  # fmt: skip
    told = summarize(run_scenario(load_scenario("acrobot_adaptation", changes)))["adaptation"]
    assert any("the length of C4 contradicts" in words for words in told["doubts"])


def test_the_block_has_its_ports_and_loops_leave_it_to_a_diagram():
    scenario = load_scenario("acrobot_adaptation", RUN)
    assert "learns its points" in diagram_reason(scenario)
    learner = build_visual_servo(scenario).learner
    ports = {learner.get_output_port(k).get_name() for k in range(learner.num_output_ports())}
    assert ports == {
        "believed_points", "learnt", "learnt_sigma", "adaptation", "doubted_measurements",
        "open_frames",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("name", "changes", "words"),
    [
        ("planar_pbvs", (), "found a section with planar, 2T1R"),
        ("acrobot_pbvs", ("cables.model=catenary",), "accepted: cables that do not sag"),
        ("acrobot_pbvs", ("estimator.kind=cable_lengths",), "estimators cable_lengths"),
        ("acrobot_pbvs", ("controller.free_rotation=true",), "does not judge"),
        ("acrobot_pbvs", ("tension_management={kind: polygon}",), "tension_management.kind"),
        ("acrobot_pbvs", ("stability={}",), "section stability"),
        ("acrobot_sensors", ("sensors.encoder_rate=30",), "encoders at 30 Hz and images at 25"),
        ("acrobot_pbvs", ("adaptation.exit_points=0",), "exit_points: found 0"),
    ],
)
def test_what_is_refused(name, changes, words):
    with pytest.raises(ScenarioError, match=words):
        load_scenario(name, ("adaptation={}", *changes))
