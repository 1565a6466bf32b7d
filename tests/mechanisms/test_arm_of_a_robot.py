"""An arm on a robot's platform: what the robot alone knows does not hold it, `hang` does."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, RevoluteJoint, SpatialInertia
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.errors import CableModelError
from cdpr_drake.geometry.cable_routes import CableRoutes
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import hang
from cdpr_drake.models.robot_in_plant import add_robot, carried_bodies
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.assembly import add_cable_robot

STILL = 1e-9
"""By how much a machine at rest moves in a second [m, rad], by rounding of lengths and steps."""


def robot_with_arm():
    """A robot whose platform carries a hanging arm of 1 kg, wired, and its parts."""
    robot = load_robot("acrobot_fully_constrained")
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    in_plant = add_robot(plant, robot)
    arm = plant.AddRigidBody(
        "arm",
        plant.AddModelInstance("arm"),
        SpatialInertia.SolidBoxWithMass(1.0, 0.02, 0.03, 0.3).Shift([0.0, 0.0, 0.15]),
    )
    F = plant.AddFrame(
        FixedOffsetFrame("shoulder", in_plant.body, RigidTransform([0.02, 0.0, -0.05]))
    )
    plant.AddJoint(RevoluteJoint("shoulder", F, arm.body_frame(), [1.0, 0.0, 0.0]))
    plant.Finalize()
    blocks = add_cable_robot(builder, in_plant)
    return robot, plant, in_plant, blocks, builder.Build()


def test_tensions_of_the_platform_alone_are_refused():
    robot, _, in_plant, blocks, diagram = robot_with_arm()
    assert carried_bodies(in_plant) == ("arm::arm",)
    with pytest.raises(CableModelError, match=r"found arm::arm on the platform of acrobot_fully"):
        blocks.set_at_equilibrium(diagram.CreateDefaultContext(), robot.home.transform())


def test_hang_holds_both_and_the_robot_stays():
    _, plant, in_plant, blocks, diagram = robot_with_arm()
    context = diagram.CreateDefaultContext()
    own = plant.GetMyMutableContextFromRoot(context)
    plant.GetJointByName("shoulder").set_angle(own, 0.6)
    routes = CableRoutes.of_cable_set(blocks.forces.cable_set(), int(in_plant.body_index))
    rest = hang(PlantCables(plant, routes), own)
    assert rest.stability == "stable"
    plant.SetPositions(own, rest.positions)
    winches = blocks.winches.GetMyMutableContextFromRoot(context)
    blocks.winches.hold(winches, rest.unstrained_lengths, rest.tensions)
    blocks.GetInputPort("cable_velocities").FixValue(winches, np.zeros(8))
    simulator = Simulator(diagram, context)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 1e-3)
    simulator.get_mutable_integrator().set_fixed_step_mode(True)
    simulator.AdvanceTo(1.0)
    np.testing.assert_allclose(plant.GetPositions(own), rest.positions, rtol=0, atol=STILL)
