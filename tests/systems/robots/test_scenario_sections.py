"""Cables, damping and winches of robot files and scenarios: what is simulated, and what is said."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.analyses.statics.static import solve_static
from cdpr_drake.control.task_space import TaskGains
from cdpr_drake.models.platform_schema import PlatformDamping
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.controllers.computed_torque import platform_dynamics
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.tension_control import (
    TensionControlSettings,
    build_tension_control,
)
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.loops.loop_choice import choose_compiled_loop
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.motor_winch import MotorWinch
from cdpr_drake.systems.robots.settings import (
    CableRobotSettings,
    CableSettings,
    DampingSettings,
    model_words,
    simulated_model,
)
from cdpr_drake.systems.robots.winches import VelocityWinch
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from tests.systems.robots.engines import settings_of

QUICK = "camera.kind=projected"

DECAY = 1e-6
"""Relative, of an exponential: by steps of a millisecond and third order, or by an accuracy of
1e-9."""


def braked():
    robot = load_robot("acrobot_small")
    robot.damping = PlatformDamping(translation=30.0, rotation=0.4)
    robot.cable_model = "catenary"
    return robot


@pytest.mark.parametrize(("model", "damped"), [("elastic", False), ("kelvin_voigt", True)])
def test_only_damped_cables_wait_for_rates(model, damped):
    forces = CableRobot("acrobot_small", settings_of(model=model)).forces
    assert np.all((forces.cable_set().retardation > 0.0) == damped)
    rates = forces.GetInputPort("unstrained_length_rates").get_index()
    force = forces.GetOutputPort("generalized_force").get_index()
    assert forces.HasDirectFeedthrough(rates, force) == damped


def test_rotation_is_braked_by_its_own_number_and_power_is_never_positive():
    how = CableRobotSettings(damping=DampingSettings(translation=2.0, rotation=0.5))
    robot = CableRobot("acrobot_small", how)
    names = {system.get_name() for system in robot.GetSystems()}
    assert names >= {"damping", "applied_force"}
    block = robot.GetSubsystemByName("damping")
    context = block.CreateDefaultContext()
    block.get_input_port().FixValue(context, [1, 0, 0, 0, 5, 6, 7, 1, 2, 3, -1, -2, -3])
    force = block.get_output_port().Eval(context)
    np.testing.assert_allclose(force, [-0.5, -1.0, -1.5, 2.0, 4.0, 6.0])
    gain = block.D()
    assert np.all(np.linalg.eigvalsh(gain[:, -6:] + gain[:, -6:].T) < 0.0)
    assert np.all(gain[:, :-6] == 0.0)


def test_a_scenario_overrides_one_number_and_leaves_the_other():
    robot = braked()
    assert DampingSettings(translation=0.0).of(robot) == (0.0, 0.4)
    assert DampingSettings(rotation=2.0).of(robot) == (30.0, 2.0)
    assert CableSettings(model="elastic").model_of(robot) == "elastic"
    off = settings_of(damping=0.0)
    assert "damping" not in {block.get_name() for block in CableRobot(robot, off).GetSystems()}


@pytest.mark.parametrize("rule", [None, StepRule(max_step=1e-3)], ids=["plant", "compiled"])
def test_commanded_tensions_do_not_hide_a_damping_that_nobody_knows(rule):
    """A platform without gains slows down as the exponential."""
    robot = load_robot("planar")
    robot.damping = PlatformDamping(translation=2.0)
    settings = TensionControlSettings(
        trajectory=PoseTrajectory((robot.home.transform(),) * 2, (1.0,)),
        gains=TaskGains(stiffness=0.0, damping=0.0),
        limits=(0.0, 60.0),
        rule=rule,
        dynamics=platform_dynamics(robot, damping=(0.0, 0.0)),
    )
    control = build_tension_control(robot, settings)
    context = control.make_context()
    if rule is None:
        plant = control.in_plant.plant
        inner = plant.GetMyMutableContextFromRoot(context)
        plant.SetVelocities(inner, [0.2, 0.1, 0.0])
    else:
        own = control.motion.GetMyMutableContextFromRoot(context)
        state = control.motion.state(own)
        state[3:6] = [0.2, 0.1, 0.0]
        control.motion.set_state(own, state)
    Simulator(control.diagram, context).AdvanceTo(0.3)
    speed = plant.GetVelocities(inner) if rule is None else control.motion.state(own)[3:6]
    expected = np.array([0.2, 0.1]) * np.exp(-2.0 * 0.3 / robot.platform.mass)
    np.testing.assert_allclose(speed[:2], expected, rtol=DECAY)


@pytest.mark.parametrize(
    ("engine", "damping"),
    [("plant", DampingSettings()), ("compiled", DampingSettings(translation=900.0))],
)
def test_computed_torque_knows_the_damping_of_file_and_scenario(engine, damping):
    changes = ["duration=3.5", f"integration.engine={engine}"]
    scenario = replace(load_scenario("caroca_computed_torque", changes), damping=damping)
    log = TensionRun(scenario).simulate().log
    away = np.linalg.norm(log["X_WP"][:, 4:] - log["X_WP_desired"][:, 4:], axis=1)
    assert np.ptp(log["X_WP"][:, 5]) > 0.5
    # 225 N s/m at 0.4 m/s by 150 kg and a gain of 100 1/s^2 would be 6 mm.
    assert np.max(away) < 5e-5


@pytest.mark.parametrize("name", ["acrobot_small", "planar"])
def test_a_robot_without_the_keys_is_what_it_was(name):
    robot = load_robot(name)
    assert (robot.cable_model, robot.damping) == (None, PlatformDamping())
    assert CableSettings().model_of(robot) == "kelvin_voigt"
    assert not CableSettings().cable_set(robot).has_pulleys()
    assert DampingSettings().of(robot) == (0.0, 0.0)
    assert solve_static(robot).model == "elastic"
    assert "damping" not in {block.get_name() for block in CableRobot(robot).GetSystems()}


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


@pytest.mark.parametrize(("seed", "pulleys"), [(0, "true"), (1, "false"), (1, "true")])
def test_caroca_as_it_ships_converges_on_taut_cables(seed, pulleys):
    """With straight undamped cables: 45 cable seconds of slack, and a limit cycle over pulleys."""
    items = [QUICK, f"seed={seed}", f"cables.pulleys={pulleys}", "duration=45.0"]
    summary = (
        ServoRun(choose_compiled_loop(load_scenario("caroca_pbvs", items))).simulate().as_dict()
    )
    assert summary["outcome"] == "converged"
    assert summary["slack_cable_seconds"] < 1.0
    assert summary["simulated"]["cable_model"] == "catenary"


def test_caroca_without_its_damping_swings_on():
    scenario = load_scenario("caroca_pbvs", [QUICK, "cables.pulleys=true", "duration=45.0"])
    scenario = replace(scenario, damping=DampingSettings(translation=0.0, rotation=0.0))
    assert ServoRun(choose_compiled_loop(scenario)).simulate().as_dict()["outcome"] == "timeout"


def test_winches_are_ideal_unless_a_scenario_says_otherwise():
    plain = build_visual_servo(load_scenario("acrobot_pbvs", [QUICK]))
    assert isinstance(plain.cable_robot.winches, VelocityWinch)
    motors = build_visual_servo(load_scenario("acrobot_pbvs", [QUICK, "winches.kind=motor"]))
    assert isinstance(motors.cable_robot.winches, MotorWinch)
    assert motors.max_step < plain.max_step


@pytest.fixture(scope="module")
def friction_run():
    return ServoRun(load_scenario("acrobot_friction", [QUICK])).simulate()


def test_with_friction_motors_follow_with_the_delay_of_their_loops_and_arrive(friction_run):
    """Cables move as commanded but for lags: far from exactly, near enough to arrive."""
    assert friction_run.outcome.name == "CONVERGED"
    log, dt = friction_run.log, np.diff(friction_run.log["time"])[:, np.newaxis]
    moved = np.diff(log["unstrained_lengths"], axis=0) / dt
    wanted = log["cable_velocities"][:-1]
    late = np.abs(moved - wanted)
    assert np.max(late) > 1e-4
    settled = log["time"][:-1] > 1.0
    assert np.max(late[settled]) < 0.1 * np.max(np.abs(wanted))


def test_torques_are_logged_with_their_units(friction_run):
    assert {"applied_torques.C1_nm", "friction_torques.C8_nm"} <= set(friction_run.columns())
    friction = friction_run.built.robot.winch_law().friction
    taken = np.abs(friction_run.log["friction_torques"])
    fastest = friction_run.built.robot.winch.rated_motor_speed()
    assert np.max(taken) <= friction.static + friction.viscous * fastest
    assert np.max(taken) > friction.coulomb


def test_by_position_lengths_follow_the_integral_of_the_velocities():
    """The position loop lags behind by the speed over its bandwidth, and does not drift."""
    overrides = [
        QUICK, "winches.mode=position", "perturbations.slack=[0.01, 0, 0, 0, 0, 0, 0, 0]",
        "integration.engine=compiled",
    ]  # fmt: skip
    run = ServoRun(load_scenario("acrobot_friction", overrides)).simulate()
    assert run.outcome.name == "CONVERGED"
    log, law = run.log, run.built.robot.winch_law()
    # Velocities are held between control steps, of which the log has every row.
    step = np.diff(log["time"])[:, np.newaxis]
    moved = np.vstack([np.zeros(8), np.cumsum(log["cable_velocities"][:-1] * step, axis=0)])
    behind = log["unstrained_lengths"] - log["unstrained_lengths"][0] - moved
    lag = np.max(np.abs(log["cable_velocities"])) / law.position_bandwidth
    assert np.max(np.abs(behind)) < lag
    assert np.max(np.abs(behind[-1])) < 1e-3 * np.max(np.abs(moved[-1]))  # measured 3e-5
