"""Tensions that are applied unchecked, by rods and by cables."""

import numpy as np
import pytest

from cdpr_drake.analyses.studies.tension_methods.trial import UncheckedDistributor
from cdpr_drake.control.task_space import TaskGains
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.geometry.straight_cables import wrench_matrix
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.tension_control import (
    TensionControlSettings,
    build_tension_control,
)
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

ROUND_OFF = 1e-9
"""Of forces of some hundred newtons [N, N m]."""


@pytest.mark.parametrize(
    "method", ["pseudo_inverse", "closed_form", "linear_program", "quadratic_program"]
)
def test_tensions_out_of_bounds_come_out_balanced(method):
    """Where nothing holds within bounds the pseudo-inverse and the closed form still balance."""
    robot = load_robot("caroca_gazebo")
    start = pose_from_angles(np.array([0.0, -2.0, 1.8]), np.zeros(3))
    settings = TensionControlSettings(
        trajectory=PoseTrajectory((start, start), (1.0,)),
        gains=TaskGains(100.0, 100.0),
        method=method,
        push=True,
        distributor=UncheckedDistributor,
    )
    control = build_tension_control(robot, settings)
    context = control.make_context()
    distributor = control.diagram.GetSubsystemByName("distributor")
    own = distributor.GetMyMutableContextFromRoot(context)
    updated = distributor.EvalUniquePeriodicDiscreteUpdate(own)
    own.SetDiscreteState(updated)
    tensions = control.diagram.GetOutputPort("tensions").Eval(context)
    assert control.diagram.GetOutputPort("failures").Eval(context) == 1.0
    if method.endswith("program"):  # a search has no answer; the lower limits stay
        np.testing.assert_array_equal(tensions, np.ones(8))
        return
    wanted = control.diagram.GetSubsystemByName("controller").GetOutputPort("desired_wrench")
    W = wrench_matrix(start, robot.exit_points(), robot.anchor_points())
    asked = wanted.Eval(wanted.get_system().GetMyContextFromRoot(context))
    np.testing.assert_allclose(W @ tensions, asked, atol=ROUND_OFF)
    assert tensions.min() < 0.0
