"""How blocks are asked for: robots by name, ports by name, contexts of any kind, own forces."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

import cdpr_drake as cdpr
from cdpr_drake.errors import CdprError, RobotFileError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.ups_robot import rod_masses
from cdpr_drake.systems.batches.batch_robots import BatchRobots
from cdpr_drake.systems.robots.assembly import RobotBlock, add_cable_robot, apply_force
from cdpr_drake.systems.robots.cable_robot import CableRobot, automatic_step, default_rule
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot, motion_by_tensions
from cdpr_drake.systems.robots.ups_robot import UpsRobot

NAME = "acrobot_small"
ROBOT = load_robot(NAME)
X_WP = RigidTransform([0.02, 0.01, 0.2])


def in_own_plant(robot=NAME):
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    in_plant = cdpr.add_robot(plant, robot)
    plant.Finalize()
    return builder, in_plant


BLOCKS = {
    "CableRobot": lambda robot: CableRobot(robot),
    "CompiledCableRobot": lambda robot: CompiledCableRobot(robot),
    "UpsRobot": lambda robot: UpsRobot(robot, rod_masses(ROBOT), 1e-4),
    "add_robot": lambda robot: in_own_plant(robot),
    "motion_by_tensions": lambda robot: motion_by_tensions(robot, ROBOT.cable_set()),
    "BatchRobots": lambda robot: BatchRobots(robot, 1),
    "automatic_step": lambda robot: automatic_step(robot, X_WP, "runge_kutta3"),
    "default_rule": lambda robot: default_rule(robot),
}


@pytest.mark.parametrize("what", BLOCKS)
def test_blocks_take_a_name_in_place_of_a_robot(what):
    BLOCKS[what](NAME)
    with pytest.raises(RobotFileError, match="did you mean acrobot_small"):
        BLOCKS[what]("acrobot_smal")
    with pytest.raises(RobotFileError, match="found a float; accepted: a name, a path or a Robot"):
        BLOCKS[what](0.5)


def test_a_wrong_port_is_answered_with_the_right_ones():
    block = add_cable_robot(*in_own_plant())
    with pytest.raises(CdprError, match=r"did you mean cable_velocities.*: applied_wr"):
        block.GetInputPort("cable_velocity")
    with pytest.raises(CdprError, match="did you mean tensions"):
        block.GetOutputPort("tension")


def test_arguments_in_the_wrong_order_are_named():
    builder, in_plant = in_own_plant()
    with pytest.raises(CdprError, match="builder: found a RobotInPlant; accepted: a Diagram"):
        add_cable_robot(in_plant, builder)
    with pytest.raises(CdprError, match="in_plant: found a MultibodyPlant; accepted: a RobotInP"):
        add_cable_robot(builder, in_plant.plant)


@pytest.mark.parametrize("kind", [CableRobot, CompiledCableRobot])
def test_an_equilibrium_is_set_from_the_root_or_from_the_blocks_own_context(kind):
    tensions = []
    for own in (False, True):
        builder = DiagramBuilder()
        block = builder.AddSystem(kind(NAME))
        builder.ExportInput(block.GetInputPort("cable_velocities"), "v")
        diagram = builder.Build()
        root = diagram.CreateDefaultContext()
        diagram.GetInputPort("v").FixValue(root, np.zeros(8))
        mine = block.GetMyMutableContextFromRoot(root)
        block.set_at_equilibrium(mine if own else root, X_WP)
        tensions.append(block.GetOutputPort("tensions").Eval(mine).copy())
        assert block.GetOutputPort("X_WP").Eval(mine).IsNearlyEqualTo(X_WP, 1e-12)
    np.testing.assert_array_equal(tensions[0], tensions[1])
    assert np.min(tensions[0]) > 0.0


def test_robot_blocks_are_told_by_their_protocol():
    ports = add_cable_robot(*in_own_plant())
    for block in (CableRobot(NAME), CompiledCableRobot(NAME), ports):
        assert isinstance(block, RobotBlock)
    assert not isinstance(MultibodyPlant(0.0), RobotBlock)


@pytest.mark.parametrize("after", [False, True])
def test_own_generalized_forces_add_up_before_and_after(after):
    """Half of the weight is carried, so that the platform rises with the tensions of all of it."""
    builder, in_plant = in_own_plant()
    plant = in_plant.plant
    lift = np.zeros(6)
    lift[5] = 0.5 * ROBOT.platform.mass * ROBOT.gravity
    force = builder.AddSystem(ConstantVectorSource(lift))
    if not after:
        port = plant.get_applied_generalized_force_input_port()
        builder.Connect(force.get_output_port(), port)
    block = add_cable_robot(builder, in_plant)
    if after:
        apply_force(builder, plant, force.get_output_port(), name="lift")
    still = builder.AddSystem(ConstantVectorSource(np.zeros(8)))
    builder.Connect(still.get_output_port(), block.GetInputPort("cable_velocities"))
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    own = plant.GetMyContextFromRoot(context)
    acceleration = plant.get_generalized_acceleration_output_port().Eval(own)
    assert acceleration[5] == pytest.approx(0.5 * ROBOT.gravity, rel=1e-6)
    Simulator(diagram, context).AdvanceTo(0.01)


def test_public_names_of_what_signatures_name():
    for name in ("TaskGains", "ServoLaw", "BelievedRobot", "Read", "InertialSensor", "RobotBlock"):
        assert name in cdpr.__all__
        assert getattr(cdpr, name) is not None
