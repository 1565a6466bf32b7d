"""The platform on rods goes where massless cables take it, as the rods get lighter."""

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.ups_robot import rod_masses
from cdpr_drake.systems.robots.cable_robot import holding_tensions
from cdpr_drake.systems.robots.tension_driven_cables import TensionDrivenCables
from cdpr_drake.systems.robots.ups_robot import UpsRobot

ROBOT, TIME, STEP = load_robot("acrobot_small"), 0.1, 5e-5
HOME = ROBOT.home.transform()
HOLDING = holding_tensions(ROBOT, HOME, ROBOT.cable_set(pulleys=False))

LINEAR = 0.03
"""How far the deviation is from proportional to the mass, relative."""


def on_massless_cables(tensions):
    """Pose after `TIME` from rest at home under constant tensions."""
    builder = DiagramBuilder()
    plant = builder.AddNamedSystem("plant", MultibodyPlant(0.0))
    in_plant = add_robot(plant, ROBOT)
    plant.Finalize()
    cables = builder.AddSystem(TensionDrivenCables(in_plant))
    source = builder.AddSystem(ConstantVectorSource(tensions))
    state = plant.get_state_output_port(in_plant.model_instance)
    builder.Connect(state, cables.GetInputPort("platform_state"))
    builder.Connect(source.get_output_port(), cables.GetInputPort("tensions"))
    force = cables.GetOutputPort("generalized_force")
    builder.Connect(force, plant.get_applied_generalized_force_input_port())
    simulator = Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    in_plant.set_pose(context, HOME)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 1e-3).set_fixed_step_mode(True)
    simulator.AdvanceTo(TIME)
    return in_plant.pose(context)


def on_rods(tensions, masses):
    """The same pose on rods, and the largest distance of a rod's end from its anchor point."""
    block = UpsRobot(ROBOT, masses, STEP)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.set_pose(context, HOME)
    block.GetInputPort("tensions").FixValue(context, tensions)
    simulator.AdvanceTo(TIME)
    gaps = block.ups.gaps(block.plant.GetMyContextFromRoot(context))
    return block.GetOutputPort("X_WP").Eval(context), np.max(gaps)


def test_the_deviation_vanishes_with_the_mass():
    """From rest under 1.1 times the tensions that hold it."""
    reference = on_massless_cables(1.1 * HOLDING)
    moved = np.linalg.norm(reference.translation() - HOME.translation())
    masses = [share * rod_masses(ROBOT) for share in (1.0, 0.1, 0.01)]
    ends = [on_rods(1.1 * HOLDING, each) for each in masses]
    assert max(gap for _, gap in ends) < 1e-6  # loops stay closed
    (real, _), (tenth, _), (hundredth, angle) = (pose_error(reference, X_WP) for X_WP, _ in ends)
    assert real == pytest.approx(10.0 * tenth, rel=LINEAR)
    assert tenth - hundredth == pytest.approx(0.9 * tenth, rel=LINEAR)
    # What is left without mass is the first order error of the discrete plant.
    assert abs(hundredth - 0.1 * tenth) < 2e-3 * moved
    assert angle < 1e-5
    # The weight of the heaviest is two per cent of the platform's, and nobody carries it.
    assert 0.1 < real / moved < 0.3


def test_massless_cables_that_balance_leave_the_platform_at_rest():
    end = on_massless_cables(HOLDING)
    assert np.max(np.abs(end.translation() - HOME.translation())) < 1e-12
