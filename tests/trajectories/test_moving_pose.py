"""Targets that move: poses over time, and the block that shows them."""

import numpy as np
import pytest
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform

from cdpr_drake.geometry.poses import exponential, pose_error, pose_from_angles
from cdpr_drake.systems.cameras.scene_target import SceneTarget
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.trajectories.pose_trajectory import SteadyMotion, WaypointMotion
from cdpr_drake.vision.apriltags import TagTarget

ROUND_OFF = 1e-12

START = pose_from_angles(np.array([0.1, -0.2, 0.05]), np.array([0.3, -0.2, 0.5]))
V, W = np.array([0.1, -0.3, 0.2]), np.array([0.4, 0.1, -0.5])


def test_steady_motion_has_constant_velocities_in_the_world():
    motion = SteadyMotion(START, V, W)
    step = 0.7
    turn = exponential(np.concatenate([W * step, np.zeros(3)])).rotation()
    for time in (0.0, 1.3):
        here, there = motion.at(time), motion.at(time + step)
        np.testing.assert_allclose(there.translation() - here.translation(), V * step, atol=1e-12)
        expected = RigidTransform(turn @ here.rotation(), there.translation())
        assert max(pose_error(expected, there)) < ROUND_OFF
    assert motion.is_moving()


def test_a_target_at_rest_stays():
    motion = SteadyMotion(START, np.zeros(3), np.zeros(3))
    assert not motion.is_moving()
    assert motion.at(0.0).IsExactlyEqualTo(motion.at(17.0))


@pytest.mark.parametrize("repeat", [False, True])
def test_waypoints_are_passed_at_their_times(repeat):
    poses = [START, RigidTransform([0.3, 0.0, 0.0]), RigidTransform([0.3, 0.4, 0.0])]
    motion = WaypointMotion([0.0, 2.0, 3.0], poses, repeat)
    for time, pose in zip((0.0, 2.0), poses, strict=False):
        assert max(pose_error(pose, motion.at(time))) < 1e-9
    np.testing.assert_allclose(motion.at(2.25).translation(), [0.3, 0.1, 0.0], atol=1e-12)
    later = motion.at(5.25).translation()
    np.testing.assert_allclose(later, [0.3, 0.1, 0.0] if repeat else [0.3, 0.4, 0.0], atol=1e-12)


def test_ports_of_the_target_s_block_and_what_they_show():
    scene_graph = SceneGraph()
    target = SceneTarget(scene_graph, TagTarget(0, 0.1).plates(), SteadyMotion(START, V, W))
    names = [target.get_output_port(i).get_name() for i in range(target.num_output_ports())]
    assert names == ["X_WO", "geometry_pose"]
    context = target.CreateDefaultContext()
    context.SetTime(2.0)
    X_WO = target.GetOutputPort("X_WO").Eval(context)
    assert max(pose_error(SteadyMotion(START, V, W).at(2.0), X_WO)) < ROUND_OFF
    poses = target.GetOutputPort("geometry_pose").Eval(context)
    assert max(pose_error(poses.value(poses.ids()[0]), X_WO)) < ROUND_OFF


def test_a_moving_target_moves_in_the_rendered_scene():
    """The scene graph sees the tag where the motion puts it."""
    servo = build_visual_servo(load_scenario("acrobot_moving_tag"))
    context = servo.make_context()
    found = []
    detector = servo.diagram.GetSubsystemByName("detector")
    for time in (0.0, 1.0):
        context.SetTime(time)
        marks = detector.find_marks(detector.GetMyContextFromRoot(context))
        X_CO = servo.X_CO(servo.scenario.initial_pose.transform(), time)
        expected = servo.pinhole.project(X_CO @ servo.target.points).T.ravel()
        assert np.max(np.abs(marks - expected)) < 0.6
        found.append(expected)
    assert np.max(np.abs(found[1] - found[0])) > 20.0
