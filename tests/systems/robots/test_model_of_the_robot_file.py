"""Cable model and damping of a robot's file: every engine takes them, a scenario overrides them."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from cdpr_drake.analyses.front.statics import solve_static
from cdpr_drake.analyses.simulation.run_summary import summarize
from cdpr_drake.analyses.simulation.tension_control_run import run_tension_scenario
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.control.task_space import TaskGains
from cdpr_drake.dynamics.robot_arrays import DAMPING
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import PlatformDamping
from cdpr_drake.systems.batches.batch_robots import BatchRobots
from cdpr_drake.systems.controllers.computed_torque import platform_dynamics
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.tension_control import (
    TensionControlSettings,
    build_tension_control,
)
from cdpr_drake.systems.loops.loop_choice import choose_compiled_loop
from cdpr_drake.systems.loops.robot_motion import RobotMotion
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import (
    CableRobotSettings,
    CableSettings,
    DampingSettings,
    model_words,
    simulated_model,
)
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

BRAKES = PlatformDamping(translation=30.0, rotation=0.4)
DECAY = 1e-6
"""Relative, of an exponential by steps of a millisecond and third order."""


def braked(name="acrobot_small", model=None):
    robot = load_robot(name)
    robot.damping, robot.cable_model = BRAKES, model
    return robot


def test_every_engine_takes_damping_and_model_of_the_file():
    robot = braked(model="catenary")
    plant, compiled = CableRobot(robot), CompiledCableRobot(robot)
    gain = plant.GetSubsystemByName("damping").D()
    np.testing.assert_array_equal(np.diag(-gain[:, -6:]), [0.4] * 3 + [30.0] * 3)
    assert plant.forces.model() == "catenary"
    motion = RobotMotion(robot, CableRobotSettings(), StepRule())
    batch = BatchRobots(robot, 1)
    for arrays in (compiled.motion.arrays(), motion._arrays, batch._members[0].arrays):
        np.testing.assert_array_equal(arrays.body[DAMPING : DAMPING + 2], [30.0, 0.4])
    assert motion._model == batch._members[0].model == "catenary"


def test_a_scenario_overrides_one_number_and_leaves_the_other():
    robot = braked(model="catenary")
    assert DampingSettings(translation=0.0).of(robot) == (0.0, 0.4)
    assert DampingSettings(rotation=2.0).of(robot) == (30.0, 2.0)
    assert CableSettings(model="elastic").model_of(robot) == "elastic"
    off = CableRobotSettings(damping=DampingSettings(translation=0.0, rotation=0.0))
    assert "damping" not in {block.get_name() for block in CableRobot(robot, off).GetSystems()}


@pytest.mark.parametrize("known", [False, True])
def test_commanded_tensions_do_not_hide_the_damping(known):
    """A platform without gains slows down as the exponential, by plant and compiled steps.

    Where the controller knows the damping, it goes on as fast as it was.
    """
    robot = load_robot("planar")
    robot.damping = PlatformDamping(translation=2.0)
    still = PoseTrajectory((robot.home.transform(),) * 2, (1.0,))
    gains = TaskGains(stiffness=0.0, damping=0.0)
    expected = 1.0 if known else np.exp(-2.0 * 0.3 / robot.platform.mass)
    believed = None if known else platform_dynamics(robot, damping=(0.0, 0.0))
    for rule in (None, StepRule(max_step=1e-3)):
        settings = TensionControlSettings(
            trajectory=still, gains=gains, limits=(0.0, 60.0), rule=rule, dynamics=believed
        )
        control = build_tension_control(robot, settings)
        context = control.make_context()
        if rule is None:
            inner = control.in_plant.plant.GetMyMutableContextFromRoot(context)
            control.in_plant.plant.SetVelocities(inner, [0.2, 0.1, 0.0])
        else:
            own = control.motion.GetMyMutableContextFromRoot(context)
            state = control.motion.state(own)
            state[3:6] = [0.2, 0.1, 0.0]
            control.motion.set_state(own, state)
        Simulator(control.diagram, context).AdvanceTo(0.3)
        if rule is None:
            speed = control.in_plant.plant.GetVelocities(inner)
        else:
            speed = control.motion.state(own)[3:6]
        # What is known is countered as of a step of control ago.
        tolerance = 1e-3 if known else DECAY
        np.testing.assert_allclose(speed[:2], np.array([0.2, 0.1]) * expected, rtol=tolerance)


@pytest.mark.parametrize("engine", ["plant", "compiled"])
@pytest.mark.parametrize("damping", [DampingSettings(), DampingSettings(translation=900.0)])
def test_computed_torque_knows_the_damping_of_file_and_scenario(engine, damping):
    changes = ["duration=3.5", f"integration.engine={engine}"]
    scenario = replace(load_scenario("caroca_computed_torque", changes), damping=damping)
    log = run_tension_scenario(scenario).log
    away = np.linalg.norm(log["X_WP"][:, 4:] - log["X_WP_desired"][:, 4:], axis=1)
    assert np.ptp(log["X_WP"][:, 5]) > 0.5
    # 225 N s/m at 0.4 m/s by 150 kg and a gain of 100 1/s^2 would be 6 mm.
    assert np.max(away) < 5e-5


@pytest.mark.parametrize("name", ["acrobot_small", "planar"])
def test_a_robot_without_the_keys_is_what_it_was(name):
    robot = load_robot(name)
    assert (robot.cable_model, robot.damping) == (None, PlatformDamping())
    assert CableSettings().model_of(robot) == "kelvin_voigt"
    assert DampingSettings().of(robot) == (0.0, 0.0)
    assert solve_static(robot).model == "elastic"


def test_statics_take_the_model_of_the_file_and_an_option_overrides_it():
    at_rest = solve_static("caroca")
    assert at_rest.model == "catenary"
    assert np.all(at_rest.sags > 1e-3)
    assert solve_static("caroca", model="elastic").model == "elastic"


def test_what_overrides_the_file_is_said():
    robot = load_robot("caroca")
    own = simulated_model(robot, CableSettings(), DampingSettings())
    assert own["overrides"] == []
    assert model_words(own) == (
        "catenary cables from fixed exit points, damping 225 N s/m, 4.2 N m s/rad"
    )
    cables = CableSettings(model="kelvin_voigt", pulleys=True, stiffness_ratio=0.5)
    told = model_words(simulated_model(robot, cables, DampingSettings(translation=240.0)))
    assert told == (
        "kelvin_voigt cables over pulleys, damping 240 N s/m, 4.2 N m s/rad, overrides the robot "
        "file: cables.model kelvin_voigt, not catenary; damping.translation 240, not 225; "
        "cables.stiffness_ratio 0.5, not 1"
    )


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("pulleys", ["false", "true"])
def test_caroca_as_it_ships_converges_on_taut_cables(seed, pulleys):
    """With straight undamped cables: 45 cable seconds of slack, and a limit cycle over pulleys."""
    items = ["camera.kind=projected", f"seed={seed}", f"cables.pulleys={pulleys}"]
    run = run_scenario(choose_compiled_loop(load_scenario("caroca_pbvs", items)))
    summary = summarize(run)
    assert summary["outcome"] == "converged"
    assert summary["slack_cable_seconds"] < 1.0
    assert summary["simulated"]["cable_model"] == "catenary"


def test_caroca_without_its_damping_swings_on():
    items = ["camera.kind=projected", "cables.pulleys=true"]
    scenario = load_scenario("caroca_pbvs", items)
    scenario = replace(scenario, damping=DampingSettings(translation=0.0, rotation=0.0))
    assert summarize(run_scenario(choose_compiled_loop(scenario)))["outcome"] == "timeout"
