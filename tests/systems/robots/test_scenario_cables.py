"""The section `cables` of a scenario: what it chooses, and what it refuses."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from cdpr_drake.errors import CableGeometryError, CableModelError, ScenarioError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.robots.cable_forces import CableForces
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings

PROJECTED = ("camera.kind=projected", "duration=0.2")


def test_default_is_straight_without_pulleys():
    scenario = load_scenario("acrobot_pbvs")
    robot = load_robot("acrobot_small")
    assert (scenario.cables.model_of(robot), scenario.cables.pulleys) == ("kelvin_voigt", False)
    assert not scenario.cables.cable_set(robot).has_pulleys()


def test_the_simulated_robot_has_the_cables_that_were_asked_for():
    overrides = [*PROJECTED, "cables.model=catenary", "cables.pulleys=true"]
    servo = build_visual_servo(load_scenario("caroca_pbvs", overrides))
    cables = servo.cable_robot.GetSubsystemByName("cables")
    assert cables.model() == "catenary"
    np.testing.assert_array_equal(cables.cable_set().pulley_radius, 0.075)
    context = servo.make_context()
    simulator = Simulator(servo.diagram, context)
    simulator.get_mutable_integrator().request_initial_step_size_target(1e-4)
    simulator.AdvanceTo(0.05)
    block = servo.cable_robot
    sags = block.GetOutputPort("sags").Eval(block.GetMyContextFromRoot(context))
    assert np.all(sags > 1e-3)


def test_elastic_cables_are_not_damped():
    robot = load_robot("acrobot_small")
    block = CableRobot(robot, CableRobotSettings(cables=CableSettings(model="elastic")))
    assert np.all(block.forces.cable_set().retardation == 0.0)


def test_unknown_and_undetermined_models_are_refused():
    with pytest.raises(ScenarioError, match=r"cables\.model: .*inextensible"):
        load_scenario("acrobot_pbvs", ["cables.model=inextensible"])
    block = CableRobot(load_robot("acrobot_small"))
    with pytest.raises(CableModelError, match="tensions do not follow from its length"):
        CableForces(block.in_plant, None, "inextensible")


def test_a_pulley_in_the_platform_is_refused(tmp_path):
    from cdpr_drake.models.robot_loader import robot_file

    text = robot_file("acrobot_small").read_text().replace("radius: 0.0045", "radius: 0.9")
    (tmp_path / "acrobot_small.yaml").write_text(text)
    override = f"robot={tmp_path / 'acrobot_small.yaml'}"
    with pytest.raises(ScenarioError, match="cables: cable 1"):
        load_scenario("acrobot_pbvs", [override, "cables.pulleys=true"])
    load_scenario("acrobot_pbvs", [override])


def test_an_anchor_point_that_comes_into_the_groove_ends_a_simulation():
    robot = load_robot("acrobot_small")
    block = CableRobot(robot, CableRobotSettings(cables=CableSettings(pulleys=True)))
    context = block.CreateDefaultContext()
    block.set_at_equilibrium(context, robot.home.transform())
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(8))
    cable = robot.cables[1]
    X_WP = robot.home.transform()
    X_WP.set_translation(cable.exit_point - cable.anchor_point + [0.0045, 0.0, 0.0])
    block.in_plant.set_pose(block.GetMutableSubsystemContext(block.plant, context), X_WP)
    with pytest.raises(CableGeometryError, match=r"at 0 s: cable 2: its anchor point"):
        block.EvalTimeDerivatives(context)
