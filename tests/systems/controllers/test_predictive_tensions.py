"""Predictive control of tensions: tracking, limits, view, and its section of a scenario."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from cdpr_drake.analyses.simulation.tension_control_run import run_tension_scenario
from cdpr_drake.control.task_space import TaskGains, computed_torque
from cdpr_drake.errors import PlanningError, ScenarioError
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.poses import pose_from_row, pose_rows_distance, rotation_from_vector
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.horizon import EFFORT, TIME_CONSTANT, Horizon, View
from cdpr_drake.planning.limits import MotionLimits
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.systems.controllers.computed_torque import platform_dynamics
from cdpr_drake.systems.controllers.predictive_tensions import PredictiveTensions
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.tension_control import (
    TensionControlSettings,
    build_tension_control,
)
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

STEP = 0.01
START, GOAL = RigidTransform([0.0, 0.0, 0.3]), RigidTransform([0.1, 0.0, 0.3])


def horizon(robot, trajectory, view=None, steps=10, limits=(1.0, 60.0)):
    speed = robot.winch.rated_cable_speed()
    lim = MotionLimits(lower=limits[0], upper=limits[1], cable_speed=speed)
    task = PathTask(robot.cable_set().without_pulleys(), platform_dynamics(robot), lim)
    return Horizon(task, trajectory, steps, STEP, view), task


def test_on_the_reference_it_asks_for_the_wrench_of_the_motion():
    robot = load_robot("acrobot_large")
    motion = PoseTrajectory((START, GOAL), (1.5,))
    program, task = horizon(robot, motion)
    t = 0.4
    X, V = motion.pose(t), motion.velocity(t)
    tensions = program.tensions(t, X, V)
    assert np.all(tensions >= 1.0)
    middle = 0.5 * (motion.acceleration(t) + motion.acceleration(t + STEP))
    wanted = computed_torque(
        X, V, X, V, middle, dynamics=task.dynamics,
        gains=TaskGains(stiffness=0.0, damping=0.0),
    )  # fmt: skip
    given = -cable_jacobian(X, task.cables).T @ tensions
    # Of the weight: what a step of the reference bends away from a constant acceleration.
    np.testing.assert_allclose(given, wanted, atol=2e-3 * robot.platform.mass * robot.gravity)


def first_acceleration(offset, rate, steps):
    """Of the accelerations, one a step, that lead offsets back at the least cost, by least squares.

    For offsets far from all limits: each component by itself, all three terms by the same scale.
    """
    ones = np.tri(steps)
    rates = STEP * ones  # of the velocity at the ends of steps, by the accelerations
    ways = STEP**2 * (ones @ ones - 0.5 * ones)
    cost = np.vstack([ways, TIME_CONSTANT * rates, TIME_CONSTANT**2 * EFFORT**0.5 * np.eye(steps)])
    time = STEP * np.arange(1, steps + 1)
    free = np.concatenate([
        offset + time[:, np.newaxis] * rate, TIME_CONSTANT * np.tile(rate, (steps, 1)),
        np.zeros((steps, 6)),
    ])  # fmt: skip
    return np.linalg.lstsq(cost, -free)[0][0]


@pytest.mark.parametrize("rate", [0.0, 0.02])
def test_offsets_go_by_the_least_sum_of_squares(rate):
    """Offsets count as they are, velocities by the time constant, accelerations by its square."""
    robot = load_robot("acrobot_large")
    program, task = horizon(robot, PoseTrajectory((START, START), (1.0,)), steps=8)
    direction = np.array([0.02, 0.01, -0.03, 1.0, -0.8, 0.5])
    offset, V = 2e-4 * direction, rate * direction
    X = RigidTransform(rotation_from_vector(offset[:3]), START.translation() + offset[3:])
    tensions = program.tensions(0.0, X, V)
    assert np.all((tensions > 1.001) & (tensions < 59.9))  # else limits count too
    wanted = computed_torque(
        X, V, X, V, first_acceleration(offset, V, 8), dynamics=task.dynamics,
        gains=TaskGains(stiffness=0.0, damping=0.0),
    )  # fmt: skip
    rest = computed_torque(
        X, V, X, V, np.zeros(6), dynamics=task.dynamics,
        gains=TaskGains(stiffness=0.0, damping=0.0),
    )  # fmt: skip
    given = -cable_jacobian(X, task.cables).T @ tensions
    # Of the largest component: what small tensions are worth beside that.
    np.testing.assert_allclose(given, wanted, atol=1e-5 * np.max(np.abs(wanted - rest)))


def test_the_view_is_linear_in_small_offsets():
    view = View(RigidTransform([-0.06, 0.0, 0.01]), (0.5, 0.4), np.array([[0.1], [0.05], [1.0]]))
    A, c = view.rows(START)
    step = 1e-6
    for k, e in enumerate(np.eye(6)):
        moved = RigidTransform(
            rotation_from_vector(step * e[:3]) @ START.rotation(),
            START.translation() + step * e[3:],
        )
        np.testing.assert_allclose((view.rows(moved)[1] - c) / step, A[:, k], atol=1e-5)


def test_it_stays_where_the_target_is_seen():
    """The reference leads the camera away from the target; the platform turns and lags instead."""
    robot = load_robot("acrobot_large")
    motion = PoseTrajectory((START, RigidTransform([0.2, 0.0, 0.3])), (0.8,))
    mark, slopes = np.array([0.0, 0.0, 0.9]), (0.2, 0.2)
    view = View(RigidTransform(), slopes, mark[:, np.newaxis])  # looks up, along z of P
    widest = {}
    for name, seen in (("blind", None), ("seeing", view)):
        control = build_tension_control(
            robot,
            TensionControlSettings(
                trajectory=motion, gains=TaskGains(stiffness=100.0, damping=20.0),
                limits=(1.0, 60.0), rate=50.0, distributor=PredictiveTensions(motion, 5, seen),
                rule=StepRule(method="runge_kutta3", max_step=1e-3),
            ),
            log_rate=50.0,
        )  # fmt: skip
        simulator = Simulator(control.diagram, control.make_context())
        simulator.AdvanceTo(1.0)
        log = control.read_log(simulator.get_context())
        places = np.array([pose_from_row(row).inverse() @ mark for row in log["X_WP"]])
        widest[name] = np.max(np.abs(places[:, 0] / places[:, 2]))
        assert log["failures"][-1, 0] == 0.0
    assert widest["blind"] > 0.3
    assert widest["seeing"] < 1.03 * slopes[0]  # linearised at the reference


@pytest.fixture(scope="module")
def scenario():
    return load_scenario(
        "planar_computed_torque",
        ["predictive.steps=5", "controller.rate=100", "duration=1.0", "trajectory.pause=0.1"],
    )


def test_a_scenario_runs_with_it(scenario):
    run = run_tension_scenario(scenario)
    log = run.log
    apart, _ = pose_rows_distance(log["X_WP"], log["X_WP_desired"])
    assert np.max(apart) < 1e-3
    assert log["failures"][-1, 0] == 0.0
    assert np.min(log["tensions"][1:]) >= 2.0
    assert np.max(log["tensions"]) <= 60.0


def test_what_makes_no_sense_is_refused():
    robot = load_robot("acrobot_large")
    motion = PoseTrajectory((START, GOAL), (1.5,))
    with pytest.raises(PlanningError, match="horizon: found 1 steps"):
        horizon(robot, motion, steps=1)
    for words, said in (
        (["predictive.mount=onboard"], "predictive.points: found null"),
        (
            ["predictive.mount=nose", "predictive.points=[[0, 0, 0]]"],
            "predictive.mount: found 'nose'; accepted for planar: onboard",
        ),
    ):
        wrong = load_scenario("planar_computed_torque", words)
        with pytest.raises(ScenarioError, match=said):
            run_tension_scenario(wrong)
    with pytest.raises(ScenarioError, match="steps"):
        load_scenario("planar_computed_torque", ["predictive.steps=1"])
