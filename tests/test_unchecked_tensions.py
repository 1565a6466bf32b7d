"""Tensions that are applied unchecked, by rods and by cables."""

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant

from cdpr_drake.analyses.unchecked_tensions import RodCables, build_unchecked_control
from cdpr_drake.cable_geometry import wrench_matrix
from cdpr_drake.computed_torque import TaskGains
from cdpr_drake.errors import CdprError
from cdpr_drake.models import add_robot, load_robot
from cdpr_drake.pose_trajectory import PoseTrajectory
from cdpr_drake.poses import pose_from_angles
from cdpr_drake.systems import TensionDrivenCables

ROUND_OFF = 1e-9
"""Of forces of some hundred newtons [N, N m]."""


def in_a_plant(name):
    plant = MultibodyPlant(0.0)
    in_plant = add_robot(plant, load_robot(name))
    plant.Finalize()
    return in_plant


def force(block, in_plant, X_WP, tensions):
    plant = in_plant.plant
    plant_context = plant.CreateDefaultContext()
    in_plant.set_pose(plant_context, X_WP)
    state = plant.get_state_output_port(in_plant.model_instance).Eval(plant_context)
    context = block.CreateDefaultContext()
    block.GetInputPort("platform_state").FixValue(context, state)
    block.GetInputPort("tensions").FixValue(context, tensions)
    return block.GetOutputPort("generalized_force").Eval(context)


def test_rods_push_and_cables_do_not():
    in_plant = in_a_plant("caroca_gazebo")
    robot = in_plant.robot
    X_WP = pose_from_angles(np.array([0.4, -0.3, 1.2]), np.radians([5.0, -8.0, 12.0]))
    W = wrench_matrix(X_WP, robot.exit_points(), robot.anchor_points())
    pulling = np.arange(1.0, 9.0)
    mixed = pulling * [1, -1, 1, 1, -1, 1, 1, -1]
    rods, cables = RodCables(in_plant), TensionDrivenCables(in_plant)
    np.testing.assert_allclose(force(rods, in_plant, X_WP, mixed), W @ mixed, atol=ROUND_OFF)
    for block, tensions in ((rods, pulling), (cables, pulling), (cables, mixed)):
        expected = W @ np.maximum(tensions, 0.0)
        np.testing.assert_allclose(force(block, in_plant, X_WP, tensions), expected, atol=ROUND_OFF)


def test_rods_are_spatial():
    with pytest.raises(CdprError, match="planar"):
        RodCables(in_a_plant("planar"))


@pytest.mark.parametrize(
    "method", ["pseudo_inverse", "closed_form", "linear_program", "quadratic_program"]
)
def test_tensions_out_of_bounds_come_out_balanced(method):
    """Where nothing holds within bounds the pseudo-inverse and the closed form still balance."""
    robot = load_robot("caroca_gazebo")
    start = pose_from_angles(np.array([0.0, -2.0, 1.8]), np.zeros(3))
    control = build_unchecked_control(
        robot, PoseTrajectory((start, start), (1.0,)), TaskGains(100.0, 100.0), method
    )
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
