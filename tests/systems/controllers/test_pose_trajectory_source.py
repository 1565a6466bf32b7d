"""A trajectory's ports give what the trajectory says at the time of the context."""

import numpy as np
import pytest

from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.systems.controllers.computed_torque import PoseTrajectorySource
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

TRAJECTORY = PoseTrajectory(
    (
        pose_from_angles(np.array([0.0, 0.1, 0.3]), np.array([0.1, 0.0, 0.0])),
        pose_from_angles(np.array([0.2, 0.0, 0.5]), np.array([0.0, 0.3, -0.4])),
    ),
    (2.0,),
    start_time=1.0,
)


def test_ports_are_these():
    source = PoseTrajectorySource(TRAJECTORY)
    assert source.num_input_ports() == 0
    names = [source.get_output_port(i).get_name() for i in range(source.num_output_ports())]
    assert names == ["X_WP", "V_WP", "A_WP", "motion"]
    assert [source.GetOutputPort(name).size() for name in names[1:]] == [6, 6, 19]


@pytest.mark.parametrize("time", [0.0, 1.3, 2.2, 9.0])
def test_ports_follow_the_trajectory(time):
    source = PoseTrajectorySource(TRAJECTORY)
    context = source.CreateDefaultContext()
    source.GetOutputPort("motion").Eval(context)  # a value of an earlier time must not stay
    context.SetTime(time)
    X_WP, V_WP, A_WP, motion = (
        source.GetOutputPort(name).Eval(context) for name in ("X_WP", "V_WP", "A_WP", "motion")
    )
    assert X_WP.IsExactlyEqualTo(TRAJECTORY.pose(time))
    np.testing.assert_array_equal(V_WP, TRAJECTORY.velocity(time))
    np.testing.assert_array_equal(A_WP, TRAJECTORY.acceleration(time))
    np.testing.assert_array_equal(motion, TRAJECTORY.motion(time))
