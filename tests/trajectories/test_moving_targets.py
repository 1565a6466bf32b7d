"""Targets that move: poses over time, a mobile robot against its wheels, and what a camera sees."""

import numpy as np
import pytest
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import LeafSystem

from cdpr_drake.geometry.poses import exponential, pose_error, pose_from_angles
from cdpr_drake.systems.cameras.scene_target import SceneTarget
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.trajectories.mobile_robot import MobileRobotMotion, RoundedTrack
from cdpr_drake.trajectories.pose_trajectory import SteadyMotion, WaypointMotion
from cdpr_drake.vision.apriltags import TagTarget

ROUND_OFF = 1e-12
START = pose_from_angles(np.array([0.1, -0.2, 0.05]), np.array([0.3, -0.2, 0.5]))
V, W = np.array([0.1, -0.3, 0.2]), np.array([0.4, 0.1, -0.5])
STEADY = SteadyMotion(START, V, W)

# A mobile robot.

INTEGRATED = 1e-5
"""What error-controlled steps over eight jumps of the turning rate leave [m, rad]."""
LAP = 16.0


class Wheels(LeafSystem):
    """Differential drive: x, y and heading from the speeds of two wheels."""

    def __init__(self, robot, base):
        super().__init__()
        self._robot, self._base = robot, base
        self.DeclareContinuousState(3)

    def DoCalcTimeDerivatives(self, context, derivatives):
        left, right = self._robot.wheel_speeds(context.get_time())
        heading = context.get_continuous_state_vector()[2]
        v, w = 0.5 * (left + right), (right - left) / self._base
        rates = [v * np.cos(heading), v * np.sin(heading), w]
        derivatives.get_mutable_vector().SetFromVector(rates)


@pytest.mark.parametrize(("radius", "base"), [(0.1, 0.08), (0.15, 0.3), (0.05, 0.02)])
def test_it_moves_as_its_wheels_make_it(radius, base):
    track = RoundedTrack(0.4, 0.3, radius)
    robot = MobileRobotMotion(RigidTransform(), track, wheel_base=base, lap_time=LAP)
    simulator = Simulator(Wheels(robot, base))
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 0.05)
    simulator.get_mutable_integrator().set_target_accuracy(1e-7)
    for time in (3.0, 7.7, 12.1, LAP):
        simulator.AdvanceTo(time)
        x, y, heading = simulator.get_context().get_continuous_state_vector().CopyToVector()
        expected = RigidTransform(RotationMatrix.MakeZRotation(heading), [x, y, 0.0])
        assert max(pose_error(expected, robot.at(time))) < INTEGRATED
    faster = [max(robot.wheel_speeds(time)) for time in np.linspace(0.0, LAP, 50)]
    np.testing.assert_allclose(faster, faster[0], rtol=ROUND_OFF)


def test_laps_are_closed_and_alike_and_the_robot_stays_in_its_plane():
    track = RoundedTrack(0.4, 0.3, 0.1)
    robot = MobileRobotMotion(START, track, wheel_base=0.08, lap_time=LAP)
    assert robot.is_moving()
    assert max(pose_error(robot.at(0.0), START)) < ROUND_OFF
    for time in (0.3, 5.0, 15.99):
        assert max(pose_error(robot.at(time), robot.at(time + 700 * LAP))) < 1e-9
    assert max(pose_error(robot.at(LAP - 1e-9), START)) < 1e-8  # nearly round
    assert track.perimeter() == pytest.approx(2 * 0.2 + 2 * 0.1 + 2 * np.pi * 0.1)
    times = np.arange(0, 16, 0.01)
    places = np.array([(START.inverse() @ robot.at(t)).translation() for t in times])
    np.testing.assert_allclose(np.ptp(places[:, :2], axis=0), [0.4, 0.3], atol=1e-4)
    assert np.max(np.abs(places[:, 2])) < ROUND_OFF
    assert np.min(places[:, 1]) > -ROUND_OFF  # it turns to the left


# Steady motions and waypoints.


def test_steady_motion_has_constant_velocities_in_the_world_and_rests_without():
    step = 0.7
    turn = exponential(np.concatenate([W * step, np.zeros(3)])).rotation()
    for time in (0.0, 1.3):
        here, there = STEADY.at(time), STEADY.at(time + step)
        moved = RigidTransform(turn @ here.rotation(), here.translation() + V * step)
        assert max(pose_error(moved, there)) < ROUND_OFF
    assert STEADY.is_moving()
    still = SteadyMotion(START, np.zeros(3), np.zeros(3))
    assert not still.is_moving()
    assert still.at(0.0).IsExactlyEqualTo(still.at(17.0))


@pytest.mark.parametrize("repeat", [False, True])
def test_waypoints_are_passed_at_their_times(repeat):
    poses = [START, RigidTransform([0.3, 0.0, 0.0]), RigidTransform([0.3, 0.4, 0.0])]
    motion = WaypointMotion([0.0, 2.0, 3.0], poses, repeat)
    for time, pose in ((0.0, poses[0]), (2.0, poses[1])):
        assert max(pose_error(pose, motion.at(time))) < 1e-9
    for time, y in ((2.25, 0.1), (5.25, 0.1 if repeat else 0.4)):
        np.testing.assert_allclose(motion.at(time).translation(), [0.3, y, 0.0], atol=1e-12)


# What they show.


def test_ports_of_the_target_s_block_and_what_they_show():
    target = SceneTarget(SceneGraph(), TagTarget(0, 0.1).plates(), STEADY)
    names = [target.get_output_port(i).get_name() for i in range(target.num_output_ports())]
    assert names == ["X_WO", "geometry_pose"]
    context = target.CreateDefaultContext()
    context.SetTime(2.0)
    X_WO = target.GetOutputPort("X_WO").Eval(context)
    assert max(pose_error(STEADY.at(2.0), X_WO)) < ROUND_OFF
    poses = target.GetOutputPort("geometry_pose").Eval(context)
    assert max(pose_error(poses.value(poses.ids()[0]), X_WO)) < ROUND_OFF


def test_a_moving_target_moves_in_the_rendered_scene():
    """The scene graph sees the tag where the motion puts it."""
    servo = build_visual_servo(load_scenario("acrobot_moving_tag"))
    context, marks = servo.make_context(), []
    detector = servo.diagram.GetSubsystemByName("detector")
    for time in (0.0, 1.0):
        context.SetTime(time)
        found = detector.find_marks(detector.GetMyContextFromRoot(context))
        X_CO = servo.X_CO(servo.scenario.initial_pose.transform(), time)
        marks.append(servo.pinhole.project(X_CO @ servo.target.points).T.ravel())
        assert np.max(np.abs(found - marks[-1])) < 0.6
    assert np.max(np.abs(marks[1] - marks[0])) > 20.0
