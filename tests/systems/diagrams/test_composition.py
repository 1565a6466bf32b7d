"""Robots and servos are added to anybody's builder, and a whole servo is only their composition."""

import re
from pathlib import Path

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import Adder, ConstantVectorSource, MatrixGain

from cdpr_drake.control.task_space import TaskGains
from cdpr_drake.models.robot_copies import moved_robot
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.tension_control import TensionControlSettings, add_tension_control
from cdpr_drake.systems.robots.assembly import add_cable_robot
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from tests.messages import printed

ROOT = Path(__file__).parents[3]

REACHED = 1e-3, 0.01
"""Distance [m] and angle [rad] after eight seconds at a gain of 2 / s; measured 3e-6, 2e-4."""

SAME = 1e-12
"""Of accelerations of order ten [m/s^2]; the sum of two forces is taken in another order."""


def test_the_script_of_the_documentation_runs(capsys):
    text = (ROOT / "ARCHITECTURE.md").read_text()
    (script,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert len(script.strip().splitlines()) <= 40
    exec(compile(script, "ARCHITECTURE.md", "exec"), {})
    distance, angle = eval(printed(capsys).out)
    assert distance < REACHED[0]
    assert angle < REACHED[1]


class Two:
    """Two robots in one plant, the second one beside the first, which hang at home."""

    def __init__(self, name, settings=None, add=None):
        builder = DiagramBuilder()
        plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
        robots = [load_robot(name), moved_robot(load_robot(name), [9.0, 0.0, 0.0], "beside")]
        in_plant = [add_robot(plant, robot) for robot in robots]
        plant.Finalize()
        if add is not None:
            add(builder, plant)
        self.blocks = [
            add_cable_robot(builder, each, settings, name=each.robot.name) for each in in_plant
        ]
        for block in self.blocks:
            m = len(block.robot.cables)
            still = builder.AddSystem(ConstantVectorSource(np.zeros(m)))
            builder.Connect(still.get_output_port(), block.GetInputPort("cable_velocities"))
        self.plant, self.diagram = plant, builder.Build()
        self.context = self.diagram.CreateDefaultContext()
        for block in self.blocks:
            block.set_at_equilibrium(self.context, block.robot.home.transform())

    def accelerations(self):
        plant_context = self.plant.GetMyContextFromRoot(self.context)
        port = self.plant.get_generalized_acceleration_output_port
        return [port(b.in_plant.model_instance).Eval(plant_context) for b in self.blocks]


@pytest.mark.parametrize("name", ["acrobot_small", "planar"])
def test_two_robots_in_one_plant_move_as_each_alone(name):
    settings = CableRobotSettings(cables=CableSettings(model="elastic"))
    settings.damping.translation = 2.0
    two = Two(name, settings)
    robot = load_robot(name)
    alone = CableRobot(robot, settings)
    context = alone.CreateDefaultContext()
    alone.set_at_equilibrium(context, robot.home.transform())
    alone.GetInputPort("cable_velocities").FixValue(context, np.zeros(len(robot.cables)))
    off = RigidTransform([0.002, -0.001, 0.0])
    for block, shift in zip(two.blocks, ([0.0, 0.0, 0.0], [9.0, 0.0, 0.0]), strict=True):
        X_WP = RigidTransform(shift) @ off @ robot.home.transform()
        block.in_plant.set_pose(two.plant.GetMyMutableContextFromRoot(two.context), X_WP)
    own = alone.GetMutableSubsystemContext(alone.plant, context)
    alone.in_plant.set_pose(own, off @ robot.home.transform())
    port = alone.plant.get_generalized_acceleration_output_port(alone.in_plant.model_instance)
    expected = port.Eval(own)
    assert np.max(np.abs(expected)) > 1.0
    for found in two.accelerations():
        np.testing.assert_allclose(found, expected, rtol=1e-7, atol=SAME)


def test_a_force_of_somebody_else_stays():
    force = np.zeros(12)
    force[3] = 3.0  # along x of the first platform

    def add(builder, plant):
        source = builder.AddSystem(ConstantVectorSource(force))
        builder.Connect(source.get_output_port(), plant.get_applied_generalized_force_input_port())

    free, pushed = Two("acrobot_small"), Two("acrobot_small", add=add)
    change = np.concatenate(pushed.accelerations()) - np.concatenate(free.accelerations())
    M = pushed.plant.CalcMassMatrix(pushed.plant.GetMyContextFromRoot(pushed.context))
    np.testing.assert_allclose(M @ change, force, atol=1e-9)


def test_lengths_of_straight_cables_ask_for_the_pose_alone():
    """So that lengths can be fed back to the winches without an algebraic loop."""
    block = CableRobot(load_robot("acrobot_small"))
    forces = block.forces
    rates = forces.GetInputPort("unstrained_length_rates").get_index()
    l0 = forces.GetInputPort("unstrained_lengths").get_index()

    def needs(port, name):
        return forces.HasDirectFeedthrough(port, forces.GetOutputPort(name).get_index())

    assert not needs(rates, "lengths")
    assert not needs(l0, "lengths")
    assert needs(rates, "tensions")
    assert not needs(rates, "surplus_lengths")
    elastic = CableRobot(
        load_robot("acrobot_small"), CableRobotSettings(cables=CableSettings(model="elastic"))
    ).forces
    assert not elastic.HasDirectFeedthrough(rates, 0)
    sagging = CableRobot(
        load_robot("caroca"), CableRobotSettings(cables=CableSettings(model="catenary"))
    ).forces
    lengths = sagging.GetOutputPort("lengths").get_index()
    assert sagging.HasDirectFeedthrough(l0, lengths)
    assert not sagging.HasDirectFeedthrough(rates, lengths)
    assert sagging.HasDirectFeedthrough(rates, sagging.GetOutputPort("tensions").get_index())


@pytest.mark.parametrize("model", ["kelvin_voigt", "catenary"])
@pytest.mark.parametrize("output", ["generalized_force", "force_and_drums", "tensions"])
def test_damped_cables_pull_back_as_they_are_wound(model, output):
    robot = load_robot("caroca")
    block = CableRobot(robot, CableRobotSettings(cables=CableSettings(model=model)))
    context = block.CreateDefaultContext()
    block.set_at_equilibrium(context, robot.home.transform())
    values = []
    for speed in (0.0, -0.2):
        block.GetInputPort("cable_velocities").FixValue(context, np.full(8, speed))
        own = block.GetSubsystemContext(block.forces, context)
        values.append(block.forces.GetOutputPort(output).Eval(own))
    assert np.max(np.abs(values[1] - values[0])) > 1.0


def test_lengths_feed_back_to_the_winches():
    """A proportional winch controller on measured lengths closes a loop that Drake accepts."""
    robot = load_robot("acrobot_small")
    builder = DiagramBuilder()
    block = builder.AddNamedSystem("robot", CableRobot(robot))
    gain = builder.AddSystem(MatrixGain(-2.0 * np.eye(8)))
    wanted = builder.AddSystem(ConstantVectorSource(np.ones(8)))
    error = builder.AddSystem(Adder(2, 8))
    builder.Connect(block.GetOutputPort("lengths"), gain.get_input_port())
    builder.Connect(gain.get_output_port(), error.get_input_port(0))
    builder.Connect(wanted.get_output_port(), error.get_input_port(1))
    builder.Connect(error.get_output_port(), block.GetInputPort("cable_velocities"))
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    assert np.all(np.isfinite(diagram.EvalTimeDerivatives(context).CopyToVector()))


def test_tension_control_of_one_robot_beside_another():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    robot = load_robot("acrobot_large")
    controlled = add_robot(plant, robot)
    hanging = add_robot(plant, moved_robot(robot, [9.0, 0.0, 0.0], "beside"))
    plant.Finalize()
    home = robot.home.transform()
    settings = TensionControlSettings(
        trajectory=PoseTrajectory((home, home), (1.0,)), gains=TaskGains(100.0, 20.0)
    )
    blocks = add_tension_control(builder, controlled, settings, name="dynamic")
    block = add_cable_robot(builder, hanging, name="beside")
    still = builder.AddSystem(ConstantVectorSource(np.zeros(8)))
    builder.Connect(still.get_output_port(), block.GetInputPort("cable_velocities"))
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    block.set_at_equilibrium(context, block.robot.home.transform())
    controlled.set_pose(plant.GetMyMutableContextFromRoot(context), home)
    distributor = blocks.distributor
    own = distributor.GetMyMutableContextFromRoot(context)
    own.SetDiscreteState(distributor.EvalUniquePeriodicDiscreteUpdate(own))
    port = plant.get_generalized_acceleration_output_port(controlled.model_instance)
    np.testing.assert_allclose(port.Eval(plant.GetMyContextFromRoot(context)), 0.0, atol=1e-9)
