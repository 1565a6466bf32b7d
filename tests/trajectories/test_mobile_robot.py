"""A mobile robot on its track, against its wheels integrated, and as the target of a scenario."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import LeafSystem

from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.trajectories.mobile_robot import MobileRobotMotion, RoundedTrack

ROUND_OFF = 1e-12
INTEGRATED = 1e-5
"""What error-controlled steps over eight jumps of the turning rate leave [m, rad]."""

START = pose_from_angles(np.array([0.1, -0.2, 0.05]), np.array([0.3, -0.2, 0.5]))
TRACK = RoundedTrack(0.4, 0.3, 0.1)
LAP = 16.0


def motion(start=START, track=TRACK, base=0.08):
    return MobileRobotMotion(start, track, wheel_base=base, lap_time=LAP)


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
        derivatives.get_mutable_vector().SetFromVector(
            [v * np.cos(heading), v * np.sin(heading), w]
        )


@pytest.mark.parametrize(("radius", "base"), [(0.1, 0.08), (0.15, 0.3), (0.05, 0.02)])
def test_it_moves_as_its_wheels_make_it(radius, base):
    robot = motion(RigidTransform(), RoundedTrack(0.4, 0.3, radius), base)
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
    robot = motion()
    assert robot.is_moving()
    assert max(pose_error(robot.at(0.0), START)) < ROUND_OFF
    for time in (0.3, 5.0, 15.99):
        assert max(pose_error(robot.at(time), robot.at(time + 700 * LAP))) < 1e-9
        assert abs((START.inverse() @ robot.at(time)).translation()[2]) < ROUND_OFF
    assert max(pose_error(robot.at(LAP - 1e-9), START)) < 1e-8  # nearly round
    assert TRACK.perimeter() == pytest.approx(2 * 0.2 + 2 * 0.1 + 2 * np.pi * 0.1)
    places = np.array(
        [(START.inverse() @ robot.at(t)).translation() for t in np.arange(0, 16, 0.01)]
    )
    np.testing.assert_allclose(np.ptp(places[:, :2], axis=0), [0.4, 0.3], atol=1e-4)
    assert np.min(places[:, 1]) > -ROUND_OFF  # it turns to the left


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("target.motion.mobile_robot.corner_radius=0.3", "corner_radius: found 0.3; accepted: at"),
        ("target.motion.velocity=[0.1, 0, 0]", "found a velocity and a mobile_robot"),
        ("target.motion.mobile_robot.lap_time=0", "lap_time"),
        ("estimator.kind=first_image", "the target moves"),
        ("perturbations.winch_offset_spread=-1", "winch_offset_spread"),
    ],
)
def test_what_cannot_be_is_refused(change, words):
    with pytest.raises(ScenarioError, match=words):
        load_scenario("acrobot_mobile_robot", [change])
