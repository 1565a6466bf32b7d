"""Laws that answer forces, and predictive tensions: formulas, least squares, measured energy."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from scipy.optimize import curve_fit

from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.control.force_laws import port_energy
from cdpr_drake.control.task_space import TaskGains, computed_torque
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.poses import pose_from_row, pose_rows_distance, rotation_from_vector
from cdpr_drake.models.plant_rest import rows_of_motors
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.horizon import EFFORT, TIME_CONSTANT, Horizon, View
from cdpr_drake.planning.limits import MotionLimits
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.sections.disturbances.section import DisturbanceSettings, Push
from cdpr_drake.sections.predictive.section import PredictiveDistributor
from cdpr_drake.systems.controllers.computed_torque import platform_dynamics
from cdpr_drake.systems.controllers.plant_following import MotorFollower
from cdpr_drake.systems.controllers.tension_distributor import TensionDistributor
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.tension_control import (
    TensionControlSettings,
    build_tension_control,
)
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.scenarios.run_settings import engine_of, set_engine
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from tests.mechanisms.mechanism_cases import cables_of
from tests.systems.controllers.controller_cases import tension_run

HELD, LED, WIND = "acrobot_table_edge", "acrobot_led_by_hand", "acrobot_against_wind"
MASS = 3.5


def impedance(K, D):
    return (
        "force_control={kind: impedance, "
        f"stiffness: [20, 20, 20, {K}, {K}, {K}], damping: [1, 1, 1, {D}, {D}, {D}]}}"
    )


def pushed(kind, start, force, end=None):
    until = "" if end is None else f"end: {end}, "
    push = f"{{kind: {kind}, start: {start}, {until}force: {force}}}"
    return f"disturbances={{pushes: [{push}]}}"


@pytest.mark.parametrize(("frequency", "ratio"), [(1.0, 0.3), (2.0, 0.2)])
def test_an_impedance_swings_as_its_formula_says(frequency, ratio):
    """omega = sqrt(K / m) and D / (2 sqrt(K m)), within 2 % while cables stay taut."""
    omega = 2.0 * np.pi * frequency
    law = impedance(MASS * omega**2, 2.0 * ratio * MASS * omega)
    push = pushed("push", 0.0, [8.0, 0.0, 0.0], end=0.2)
    log = tension_run(WIND, law, push, "duration=2.5", "log_rate=500").log
    assert np.min(log["tensions"][1:]) > 1.0 - 1e-9
    assert np.all(log["feasible"][1:] == 1.0)
    later = log["time"] > 0.25
    t, x = log["time"][later] - 0.25, log["X_WP"][later, 4]

    def swing(t, a, b, w, z):
        free = w * np.sqrt(1.0 - z**2)
        return np.exp(-z * w * t) * (a * np.cos(free * t) + b * np.sin(free * t))

    fit = curve_fit(swing, t, x, p0=(x[0], 0.0, 0.9 * omega, 0.1))[0]
    assert fit[2:] == pytest.approx([omega, ratio], rel=0.02)


def test_an_impedance_gives_way_by_force_over_stiffness():
    push = pushed("step", 0.0, [3.0, -2.0, 1.0])
    log = tension_run(WIND, impedance(400.0, 60.0), push, "duration=1.5").log
    moved = log["X_WP"][-1, 4:] - log["X_WP_desired"][-1, 4:]
    np.testing.assert_allclose(moved, np.array([3.0, -2.0, 1.0]) / 400.0, rtol=1e-3)


@pytest.mark.parametrize("wrong", [0.7, 1.3])
def test_a_force_of_5_n_is_held_on_a_table_of_another_stiffness(wrong):
    """Contact on two corners is half of m g / penetration, 17 kN/m."""
    true = 0.5 * MASS * 9.81 / 0.001
    result = tension_run(
        HELD, f"force_control.contact_stiffness={wrong * true}", "trajectory.pause=1",
        "trajectory.stretches=[{pose: {position: [0.0955, 0.0, 0.2]}, duration: 2}]", "duration=3",
    )  # fmt: skip
    forces, log = result.as_dict()["forces"], result.log
    assert forces["held_from_s"] < 1.0
    assert forces["held_rms_n"] < 0.3
    assert np.all(log["contact_force"][-100:, 0] > 4.0)
    assert log["X_WP"][-1, 5] == pytest.approx(0.0, abs=2e-3)  # along the edge it follows
    assert np.max(np.abs(log["X_WP"][:, 1:4])) < 0.01  # and turns by less than a degree
    assert np.min(log["cable_clearance"]) > 0.0  # the table is below the lower anchor points
    if wrong < 1.0:
        assert "forces" in result.figures()


def test_a_platform_that_is_led_by_hand_goes_where_it_is_led_and_stays():
    """Of a push F for a time T: F T / D, when it has come to rest."""
    run = tension_run(LED, "duration=2.4")
    log = run.log
    np.testing.assert_allclose(log["X_WP"][-1, 4], 6.0 * 1.5 / 60.0, rtol=0.02)
    np.testing.assert_allclose(log["displacement"][-1, 3], log["X_WP"][-1, 4], atol=1e-3)
    assert {"displacement.x_m", "wrench_estimated.fx_n"} <= set(run.columns())


def test_an_observer_holds_against_wind():
    errors = {}
    for reject in ("true", "false"):
        log = tension_run(WIND, f"force_control.reject={reject}", "duration=2").log
        away = np.linalg.norm(log["X_WP"][:, 4:] - log["X_WP_desired"][:, 4:], axis=1)
        errors[reject] = np.mean(away[100:])
    assert errors["true"] < 0.2 * errors["false"]


def test_an_observer_does_not_take_the_platform_s_damping_for_a_push():
    """Along 0.1 m in half a second 20 N s/m brake with 7.5 N."""
    way = (
        "trajectory={pause: 0.1, start: {position: [0, 0, 0.3]}, "
        "stretches: [{pose: {position: [0.1, 0, 0.3]}, duration: 0.5}]}"
    )
    changes = ("disturbances=null", "duration=0.7", "damping.translation=20", "log_rate=500")
    log = tension_run(WIND, way, *changes).log
    assert np.all(log["feasible"][1:] == 1.0)
    assert np.max(np.abs(log["wrench_estimated"][:, 3:])) < 1.0


def test_the_port_of_an_impedance_takes_in_energy_at_each_random_push():
    """Between rests, so that nothing is stored: what went in less what came out."""
    omega, count, spacing, rate = 2.0 * np.pi * 2.0, 25, 0.6, 250.0
    law = impedance(MASS * omega**2, 2.0 * 0.7 * MASS * omega)
    random, pushes = np.random.default_rng(7), []
    for start in spacing * np.arange(count):
        way = random.normal(size=6) * [0.05, 0.05, 0.05, 3.0, 3.0, 2.0]
        end = float(start + random.uniform(0.05, 0.3))
        pushes.append(Push(kind="push", start=float(start), end=end, moment=way[:3], force=way[3:]))
    scenario = load_scenario(WIND, [
        law, f"controller.rate={rate}", f"integration.max_step={1 / rate}",
        f"log_rate={rate}", f"duration={spacing * count}", "disturbances=null",
    ])  # fmt: skip
    pushed_scenario = replace(scenario, disturbances=DisturbanceSettings(pushes=pushes, rate=rate))
    log = TensionRun(pushed_scenario).simulate().log
    assert np.all(log["feasible"][1:] == 1.0)
    energy = port_energy(log["X_WP"], log["applied_wrench"])
    rows = np.append(np.round(spacing * rate * np.arange(count)).astype(int), len(energy) - 1)
    taken = np.diff(energy[rows])
    STORED = 1e-3  # of all: what one push leaves to the next when it has not quite come to rest
    assert np.all(taken > -STORED * np.ptp(energy))
    assert np.sum(taken > 0.0) >= count - 1


def test_a_sampled_spring_without_a_damper_gives_energy():
    """K T / 2 without D: the measurement sees a port that is not passive."""
    log = tension_run(
        WIND, impedance(600.0, 0.0), "controller.rate=50", "integration.max_step=0.005",
        pushed("push", 0.0, [1.0, 0.0, 0.0], end=0.1), "duration=2",
    ).log  # fmt: skip
    away = np.abs(log["X_WP"][:, 4] - log["X_WP_desired"][:, 4])
    assert np.max(away[-70:]) > 1.5 * np.max(away[:70])


def test_repeated_runs_of_a_law_of_forces_keep_the_plant():
    scenario, words = set_engine(load_scenario(LED, ()), repeated=True)
    assert engine_of(scenario) == "plant"
    assert words == ""


STEP = 0.01
START, GOAL = RigidTransform([0.0, 0.0, 0.3]), RigidTransform([0.1, 0.0, 0.3])
ROBOT = load_robot("acrobot_large")
TASK = PathTask(
    ROBOT.cable_set().without_pulleys(),
    platform_dynamics(ROBOT),
    MotionLimits(lower=1.0, upper=60.0, cable_speed=ROBOT.winch.rated_cable_speed()),
)


def wrench_of(X, V, acceleration):
    """The wrench of a motion that is where it should be."""
    return computed_torque(
        X, V, X, V, acceleration, dynamics=TASK.dynamics, gains=TaskGains(0.0, 0.0)
    )


def test_on_the_reference_a_horizon_gives_the_wrench_of_the_motion():
    motion, t = PoseTrajectory((START, GOAL), (1.5,)), 0.4
    X, V = motion.pose(t), motion.velocity(t)
    tensions = Horizon(TASK, motion, 10, STEP, None).tensions(t, X, V)
    assert np.all(tensions >= 1.0)
    middle = 0.5 * (motion.acceleration(t) + motion.acceleration(t + STEP))
    found = -cable_jacobian(X, TASK.cables).T @ tensions
    # Of the weight: what a step of the reference bends away from a constant acceleration.
    close = 2e-3 * ROBOT.platform.mass * ROBOT.gravity
    np.testing.assert_allclose(found, wrench_of(X, V, middle), rtol=0.0, atol=close)


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
    program = Horizon(TASK, PoseTrajectory((START, START), (1.0,)), 8, STEP, None)
    direction = np.array([0.02, 0.01, -0.03, 1.0, -0.8, 0.5])
    offset, V = 2e-4 * direction, rate * direction
    X = RigidTransform(rotation_from_vector(offset[:3]), START.translation() + offset[3:])
    tensions = program.tensions(0.0, X, V)
    assert np.all((tensions > 1.001) & (tensions < 59.9))  # else limits count too
    wanted = wrench_of(X, V, first_acceleration(offset, V, 8))
    rest = wrench_of(X, V, np.zeros(6))
    found = -cable_jacobian(X, TASK.cables).T @ tensions
    # Of the largest component: what small tensions are worth beside that.
    close = 1e-5 * np.max(np.abs(wanted - rest))
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=close)


def test_the_view_is_linear_in_small_offsets():
    view = View(RigidTransform([-0.06, 0.0, 0.01]), (0.5, 0.4), np.array([[0.1], [0.05], [1.0]]))
    A, c = view.rows(START)
    step = 1e-6
    for k, e in enumerate(np.eye(6)):
        R = rotation_from_vector(step * e[:3]) @ START.rotation()
        moved = RigidTransform(R, START.translation() + step * e[3:])
        np.testing.assert_allclose((view.rows(moved)[1] - c) / step, A[:, k], atol=1e-5)


def test_a_predictive_platform_stays_where_the_target_is_seen():
    """The reference leads the camera away from the target; the platform turns and lags instead."""
    motion = PoseTrajectory((START, RigidTransform([0.2, 0.0, 0.3])), (0.8,))
    mark, slopes = np.array([0.0, 0.0, 0.9]), (0.2, 0.2)
    view = View(RigidTransform(), slopes, mark[:, np.newaxis])  # looks up, along z of P
    widest = {}
    for name, seen in (("blind", None), ("seeing", view)):
        settings = TensionControlSettings(
            trajectory=motion, gains=TaskGains(stiffness=100.0, damping=20.0),
            limits=(1.0, 60.0), rate=50.0,
            distributor=partial(PredictiveDistributor, trajectory=motion, steps=5, view=seen),
            rule=StepRule(method="runge_kutta3", max_step=1e-3),
        )  # fmt: skip
        control = build_tension_control(ROBOT, settings, log_rate=50.0)
        simulator = Simulator(control.diagram, control.make_context())
        simulator.AdvanceTo(1.0)
        log = control.read_log(simulator.get_context())
        places = np.array([pose_from_row(row).inverse() @ mark for row in log["X_WP"]])
        widest[name] = np.max(np.abs(places[:, 0] / places[:, 2]))
        assert log["failures"][-1, 0] == 0.0
    assert widest["blind"] > 0.3
    assert widest["seeing"] < 1.03 * slopes[0]  # linearised at the reference


def test_foresight_stays_nearer_to_a_motion_that_the_cables_cannot_give():
    motion = PoseTrajectory(
        (RigidTransform([0.0, 0.0, 0.2]), RigidTransform([0.15, -0.1, 0.4])), (0.45,), 0.1
    )
    errors, failures = {}, {}
    ahead = partial(PredictiveDistributor, trajectory=motion, steps=5)
    for rate, distributor in ((1000.0, TensionDistributor), (100.0, ahead)):
        settings = TensionControlSettings(
            trajectory=motion, gains=TaskGains(stiffness=100.0, damping=20.0), limits=(1.0, 60.0),
            rate=rate, distributor=distributor, rule=StepRule(method="runge_kutta3", max_step=1e-3),
        )  # fmt: skip
        control = build_tension_control(ROBOT, settings, log_rate=200.0)
        simulator = Simulator(control.diagram, control.make_context())
        simulator.AdvanceTo(1.05)
        log = control.read_log(simulator.get_context())
        apart, _ = pose_rows_distance(log["X_WP"], log["X_WP_desired"])
        errors[rate], failures[rate] = np.sqrt(np.mean(apart**2)), log["failures"][-1, 0]
    assert errors[100.0] < errors[1000.0]
    assert failures[100.0] == 0.0 < failures[1000.0]


def test_a_scenario_runs_with_prediction():
    changes = ("predictive.steps=5", "controller.rate=100", "duration=1.0", "trajectory.pause=0.1")
    run = tension_run("planar_computed_torque", *changes)
    log = run.log
    assert run.as_dict()["controller"] == "predictive"
    apart, _ = pose_rows_distance(log["X_WP"], log["X_WP_desired"])
    assert np.max(apart) < 1e-3
    assert log["failures"][-1, 0] == 0.0
    assert np.min(log["tensions"][1:]) >= 2.0
    assert np.max(log["tensions"]) <= 60.0


def test_motors_of_joints_hold_against_what_the_cables_pull():
    """Their force beside the desired one is the slope of the cables' lengths times the tensions."""
    cables = cables_of("mobile_masts")
    plant, random = cables.plant, np.random.default_rng(4)
    context, nv = plant.CreateDefaultContext(), plant.num_velocities()
    q, force = plant.GetPositions(context), random.normal(size=nv)
    tensions = np.linspace(5.0, 20.0, cables.routes.count)
    block = MotorFollower(cables, tensions)
    inputs = block.CreateDefaultContext()
    block.GetInputPort("desired_state").FixValue(inputs, np.concatenate([q, np.zeros(nv)]))
    block.GetInputPort("desired_force").FixValue(inputs, force)

    def pull(step):
        plant.SetPositions(context, q + plant.MapVelocityToQDot(context, step))
        return tensions @ cables.lengths_and_jacobian(context)[0]

    slopes = [(pull(step) - pull(-step)) / 2e-6 for step in 1e-6 * np.eye(nv)]
    expected = np.where(rows_of_motors(plant), force + slopes, 0.0)
    found = block.GetOutputPort("motor_force").Eval(inputs)
    assert found == pytest.approx(expected, abs=1e-6)  # of differences of 1e-6 of sums of 100 N m
    assert np.count_nonzero(found) == 8
