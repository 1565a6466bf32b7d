"""Visual servos on robots with a doubled cable, and with pulleys at the platform."""

from __future__ import annotations

import copy

import numpy as np
import pytest
import yaml

from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import diagram_reason
from tests.models.robots import content_of
from tests.models.test_platform_pulleys import robot_content
from tests.systems.robots.test_bundles import parallelograms

SOFT = "cables={stiffness_ratio: 0.01, retardation_time: 0.002}"
"""A doubled cable shares its load by the stretch of both: stiff ones would not, when turned."""


def doubled(name="acrobot_small"):
    """A robot whose first cable is two, 2 mm from each other, on one winch."""
    content = content_of(name)
    twin = copy.deepcopy(content["cables"][0])
    twin["name"] = "twin"
    for key in ("exit_point", "anchor_point"):
        twin[key] = [twin[key][0] + 0.002, *twin[key][1:]]
    for cable in (content["cables"][0], twin):
        cable["winch"] = "both"
    content["cables"].append(twin)
    content["slack_readings"] = None
    return content


def written(folder, content):
    path = folder / "robot.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return f"robot={path}"


def test_a_doubled_cable_goes_with_its_twin(tmp_path):
    options = ["camera.kind=projected", "duration=1.5", SOFT, written(tmp_path, doubled())]
    scenario = load_scenario("acrobot_pbvs", options)
    assert "several cables on one winch" in diagram_reason(scenario)
    log = run_scenario(scenario).log
    lengths = log["unstrained_lengths"]
    assert np.ptp(lengths[:, 0]) > 0.01
    np.testing.assert_allclose(np.diff(lengths[:, 0] - lengths[:, 8]), 0.0, atol=1e-12)
    error = np.linalg.norm(log["error"][:, :3], axis=1)
    assert error[-1] < 0.75 * error[1]  # 0.69, as of the robot as it is


@pytest.mark.parametrize("mode", ["velocity", "torque"])
def test_motors_of_a_doubled_cable_hold_both(mode, tmp_path):
    options = ["camera.kind=projected", "duration=0.4", f"winches.mode={mode}",
               "torque_control.method=quadratic_program", "perturbations.slack=null",
               written(tmp_path, doubled("acrobot_large"))]  # fmt: skip
    if mode == "velocity":
        options.append("torque_control=null")
    run = run_scenario(load_scenario("acrobot_torque_servo", options))
    log, radius = run.log, run.servo.robot.drum().radii(9)[0]
    torques = log["applied_torques"]
    np.testing.assert_array_equal(torques[:, 0], torques[:, 8])
    single, both = (
        np.mean(torques[-20:, k] + radius * np.mean(log["tensions"][-20:, of].sum(axis=1)))
        for k, of in ((1, [1]), (0, [0, 8]))
    )
    # What is left is friction, and what accelerates the drum.
    assert abs(both) < 0.03
    assert abs(single) < 0.03
    if mode == "torque":
        wanted = log["wanted_tensions"][-1]
        assert np.all((wanted >= 1.0) & (wanted <= 60.0))
        assert np.max(np.abs(log["tensions"][-1] - wanted)[1:8]) < 3.0


def test_pulleys_at_the_platform_are_known_to_servo_and_simulation(tmp_path):
    options = ["cables.pulleys=true", "controller.pulleys=true", "duration=1.5",
               written(tmp_path, robot_content())]  # fmt: skip
    run = run_scenario(load_scenario("acrobot_pulleys", options))
    log, cables = run.log, run.servo.robot.cable_set()
    for row in (0, -1):
        paths = cable_paths(pose_from_row(log["X_WP"][row]), cables)
        np.testing.assert_allclose(log["lengths"][row], paths.lengths, atol=1e-12)
    error = np.linalg.norm(log["error"][:, :3], axis=1)
    assert error[-1] < 0.75 * error[1]  # 0.69, as of the robot as it is


def test_fewer_winches_than_motions_are_refused_for_a_servo(tmp_path):
    options = [
        "camera.kind=projected",
        "tension_management={}",
        written(tmp_path, parallelograms()),
    ]
    with pytest.raises(ScenarioError) as caught:
        load_scenario("acrobot_pbvs", options)
    message = str(caught.value)
    assert "with 3 winches for 6 cables; accepted for a visual servo: at least 6" in message
    assert "tension_management: found a section, which takes up slack cable by cable" in message


def test_tensions_of_one_winch_cannot_be_commanded_one_by_one(tmp_path):
    with pytest.raises(ScenarioError, match=r"which cannot be given tensions one by one"):
        load_scenario("acrobot_computed_torque", [written(tmp_path, doubled())])
