"""Robots and servos are added to anybody's builder; robots with shared winches and pulleys."""

import re
from pathlib import Path

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import Adder, ConstantVectorSource, MatrixGain

from cdpr_drake.control.task_space import TaskGains
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_copies import moved_robot
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.tension_control import TensionControlSettings, add_tension_control
from cdpr_drake.systems.loops.loop_choice import diagram_reason
from cdpr_drake.systems.robots.assembly import add_cable_robot
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from tests.messages import printed
from tests.models.test_platform_pulleys import robot_content
from tests.systems.diagrams.diagram_cases import PROJECTED, doubled, servo_run, written

ROOT = Path(__file__).parents[3]

REACHED = 1e-3, 0.01
"""Distance [m] and angle [rad] after eight seconds at a gain of 2 / s; measured 3e-6, 2e-4."""

SAME = 1e-12
"""Of accelerations of order ten [m/s^2]; the sum of two forces is taken in another order."""


def test_the_script_of_the_documentation_runs(capsys):
    text = (ROOT / "docs" / "guides" / "own_diagram.md").read_text()
    scripts = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    (script,) = [one for one in scripts if "add_visual_servo" in one]
    assert len(script.strip().splitlines()) <= 40
    exec(compile(script, "own_diagram.md", "exec"), {})
    distance, angle = eval(printed(capsys).out)
    assert distance < REACHED[0]
    assert angle < REACHED[1]


def cable_settings(model):
    return CableRobotSettings(cables=CableSettings(model=model))


def hold(builder, block):
    """Commands drums that stand still."""
    still = builder.AddSystem(ConstantVectorSource(np.zeros(len(block.robot.cables))))
    builder.Connect(still.get_output_port(), block.GetInputPort("cable_velocities"))


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
            hold(builder, block)
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
    settings = cable_settings("elastic")
    settings.damping.translation = 2.0
    two, robot = Two(name, settings), load_robot(name)
    alone, home = CableRobot(robot, settings), robot.home.transform()
    context = alone.CreateDefaultContext()
    alone.set_at_equilibrium(context, home)
    alone.GetInputPort("cable_velocities").FixValue(context, np.zeros(len(robot.cables)))
    off = RigidTransform([0.002, -0.001, 0.0])
    for block, shift in zip(two.blocks, ([0.0, 0.0, 0.0], [9.0, 0.0, 0.0]), strict=True):
        root = two.plant.GetMyMutableContextFromRoot(two.context)
        block.in_plant.set_pose(root, RigidTransform(shift) @ off @ home)
    own = alone.GetMutableSubsystemContext(alone.plant, context)
    alone.in_plant.set_pose(own, off @ home)
    port = alone.plant.get_generalized_acceleration_output_port(alone.in_plant.model_instance)
    expected = port.Eval(own)
    assert np.max(np.abs(expected)) > 1.0
    for found in two.accelerations():
        np.testing.assert_allclose(found, expected, rtol=1e-7, atol=SAME)


def test_a_force_of_another_system_stays():
    force = np.zeros(12)
    force[3] = 3.0  # along x of the first platform

    def add(builder, plant):
        source = builder.AddSystem(ConstantVectorSource(force))
        builder.Connect(source.get_output_port(), plant.get_applied_generalized_force_input_port())

    free, pushed = Two("acrobot_small"), Two("acrobot_small", add=add)
    change = np.concatenate(pushed.accelerations()) - np.concatenate(free.accelerations())
    M = pushed.plant.CalcMassMatrix(pushed.plant.GetMyContextFromRoot(pushed.context))
    np.testing.assert_allclose(M @ change, force, atol=1e-9)


RATES, L0 = "unstrained_length_rates", "unstrained_lengths"


@pytest.mark.parametrize(
    ("name", "model", "source", "output", "needs"),
    [
        ("acrobot_small", "kelvin_voigt", RATES, "lengths", False),
        ("acrobot_small", "kelvin_voigt", L0, "lengths", False),
        ("acrobot_small", "kelvin_voigt", RATES, "tensions", True),
        ("acrobot_small", "kelvin_voigt", RATES, "surplus_lengths", False),
        ("acrobot_small", "elastic", RATES, "generalized_force", False),
        ("caroca", "catenary", L0, "lengths", True),
        ("caroca", "catenary", RATES, "lengths", False),
        ("caroca", "catenary", RATES, "tensions", True),
    ],
)
def test_an_output_asks_for_the_drums_only_where_cables_do(name, model, source, output, needs):
    """So that lengths can be fed back to the winches without an algebraic loop."""
    forces = CableRobot(load_robot(name), cable_settings(model)).forces
    ports = forces.GetInputPort(source).get_index(), forces.GetOutputPort(output).get_index()
    assert forces.HasDirectFeedthrough(*ports) == needs


@pytest.mark.parametrize("model", ["kelvin_voigt", "catenary"])
def test_damped_cables_pull_back_as_they_are_wound(model):
    robot = load_robot("caroca")
    block = CableRobot(robot, cable_settings(model))
    context = block.CreateDefaultContext()
    block.set_at_equilibrium(context, robot.home.transform())
    names, values = ("generalized_force", "force_and_drums", "tensions"), []
    for speed in (0.0, -0.2):
        block.GetInputPort("cable_velocities").FixValue(context, np.full(8, speed))
        own = block.GetSubsystemContext(block.forces, context)
        values.append([block.forces.GetOutputPort(name).Eval(own).copy() for name in names])
    for name, rests, winds in zip(names, *values, strict=True):
        assert np.max(np.abs(winds - rests)) > 1.0, name


def test_lengths_feed_back_to_the_winches():
    """A proportional winch controller on measured lengths closes a loop that Drake accepts."""
    builder = DiagramBuilder()
    block = builder.AddNamedSystem("robot", CableRobot(load_robot("acrobot_small")))
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
    distributor = add_tension_control(builder, controlled, settings, name="dynamic").distributor
    block = add_cable_robot(builder, hanging, name="beside")
    hold(builder, block)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    block.set_at_equilibrium(context, block.robot.home.transform())
    controlled.set_pose(plant.GetMyMutableContextFromRoot(context), home)
    own = distributor.GetMyMutableContextFromRoot(context)
    own.SetDiscreteState(distributor.EvalUniquePeriodicDiscreteUpdate(own))
    port = plant.get_generalized_acceleration_output_port(controlled.model_instance)
    np.testing.assert_allclose(port.Eval(plant.GetMyContextFromRoot(context)), 0.0, atol=1e-9)


SOFT = "cables={stiffness_ratio: 0.01, retardation_time: 0.002}"
"""A doubled cable shares its load by the stretch of both: stiff ones would not, when turned."""


def comes_nearer(log):
    error = np.linalg.norm(log["error"][:, :3], axis=1)
    assert error[-1] < 0.75 * error[1]  # 0.69, as of the robot as it is


def test_a_doubled_cable_goes_with_its_twin(tmp_path):
    changes = ["duration=1.5", SOFT, written(tmp_path, doubled())]
    scenario = load_scenario("acrobot_pbvs", [PROJECTED, *changes])
    assert "several cables on one winch" in diagram_reason(scenario)
    log = servo_run("acrobot_pbvs", *changes).log
    lengths = log["unstrained_lengths"]
    assert np.ptp(lengths[:, 0]) > 0.01
    np.testing.assert_allclose(np.diff(lengths[:, 0] - lengths[:, 8]), 0.0, atol=1e-12)
    comes_nearer(log)


@pytest.mark.parametrize("mode", ["velocity", "torque"])
def test_motors_of_a_doubled_cable_hold_both(mode, tmp_path):
    changes = ["duration=0.4", f"winches.mode={mode}", "perturbations.slack=null",
               "torque_control.method=quadratic_program",
               written(tmp_path, doubled("acrobot_large"))]  # fmt: skip
    if mode == "velocity":
        changes.append("torque_control=null")
    run = servo_run("acrobot_torque_servo", *changes)
    log, radius = run.log, run.built.robot.drum().radii(9)[0]
    torques = log["applied_torques"]
    np.testing.assert_array_equal(torques[:, 0], torques[:, 8])
    for k, of in ((1, [1]), (0, [0, 8])):
        left = torques[-20:, k] + radius * np.mean(log["tensions"][-20:, of].sum(axis=1))
        assert abs(np.mean(left)) < 0.03, k  # friction, and what accelerates the drum
    if mode == "torque":
        wanted = log["wanted_tensions"][-1]
        assert np.all((wanted >= 1.0) & (wanted <= 60.0))
        assert np.max(np.abs(log["tensions"][-1] - wanted)[1:8]) < 3.0


def test_pulleys_at_the_platform_are_known_to_servo_and_simulation(tmp_path):
    robot = written(tmp_path, robot_content())
    changes = ["cables.pulleys=true", "controller.pulleys=true", "duration=1.5", robot]
    run = servo_run("acrobot_pulleys", *changes)
    log, cables = run.log, run.built.robot.cable_set()
    for row in (0, -1):
        paths = cable_paths(pose_from_row(log["X_WP"][row]), cables)
        np.testing.assert_allclose(log["lengths"][row], paths.lengths, atol=1e-12)
    comes_nearer(log)
