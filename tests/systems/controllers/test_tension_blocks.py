"""Blocks of dynamic control: the law at each pose and time, distributed tensions, held failures.

Oracles: the laws and methods by themselves, closed forms of error dynamics, an ODE integrator.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy.integrate
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import MatrixGain

from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.control.force_balance import FORCE, force_problem
from cdpr_drake.control.task_space import TaskGains, computed_torque
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.geometry.poses import (
    pose_error,
    pose_from_angles,
    pose_from_row,
    rotation_from_vector,
    rotation_vector,
)
from cdpr_drake.models.platform_schema import PlatformDamping
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.systems.controllers.computed_torque import PoseTracking, platform_dynamics
from cdpr_drake.systems.controllers.tension_distributor import TensionDistributor
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.robots.assembly import apply_force
from cdpr_drake.systems.robots.settings import DampingSettings
from cdpr_drake.tensions.methods import METHODS, TensionMethod, distribute
from cdpr_drake.tensions.problem import TensionProblem
from cdpr_drake.tensions.program import TensionProgram
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from tests.systems.controllers.controller_cases import in_plant, ports

GAINS = TaskGains((120.0, 80.0), (20.0, 15.0))

LAW = 1e-12
"""Of the wrench, relative: the same kernels, compiled together or apart."""

ROUNDING = 1e-9
"""Of the tensions of the largest robot, relative."""

V_WP = np.array([0.0, 0.0, 0.1, 0.3, -0.2, 0.0])
"""Velocity of the platform, which a planar one can have, too [rad/s, m/s]."""

TIMES = (0.0, 0.7, 1.6, 5.0)
"""Before, in two stretches of and after the trajectory [s]."""


class Tracking:
    """`PoseTracking` at one state of the platform."""

    def __init__(self, name, dynamics=None):
        handles = in_plant(name)
        robot, plant = handles.robot, handles.plant
        planar, home = robot.is_planar(), robot.home.transform()
        turn = [0.0, 0.0, 0.3] if planar else [0.1, -0.2, 0.3]
        way = [0.1, -0.05, 0.0 if planar else 0.1]
        away = home @ pose_from_angles(np.array(way), np.array(turn))
        self.trajectory = PoseTrajectory((home, away, home), (1.0, 2.0), 0.2)
        self.here = away @ pose_from_angles(np.array([0.02, 0.03, 0]), np.array([0, 0, 0.1]))
        context = plant.CreateDefaultContext()
        handles.set_pose(context, self.here)
        state = plant.get_state_output_port(handles.model_instance).Eval(context).copy()
        state[-3 if planar else -6 :] = V_WP[[3, 4, 2]] if planar else V_WP
        self.dynamics = dynamics or platform_dynamics(robot)
        self.block = PoseTracking(handles, self.trajectory, GAINS, dynamics)
        self.context = self.block.CreateDefaultContext()
        self.block.GetInputPort("platform_state").FixValue(self.context, state)

    def at(self, time, name):
        self.context.SetTime(time)
        return self.block.GetOutputPort(name).Eval(self.context)

    def expected(self, time):
        wanted = self.trajectory
        return computed_torque(
            self.here, V_WP, wanted.pose(time), wanted.velocity(time), wanted.acceleration(time),
            dynamics=self.dynamics, gains=GAINS,
        )  # fmt: skip


@cache
def tracking(name):
    return Tracking(name)


def test_ports_of_tracking_are_public():
    assert ports(tracking("caroca").block) == (
        {"platform_state": 13},
        {"desired_wrench": 6, "X_WP": 0, "X_WP_desired": 0},
    )


@pytest.mark.parametrize("name", ["caroca", "planar"])
def test_tracking_gives_the_wrench_of_the_law_and_both_poses(name):
    block, wrenches = tracking(name), []
    for time in TIMES:
        wrench = block.at(time, "desired_wrench").copy()
        size = np.max(np.abs(wrench))
        assert size > 0.0
        np.testing.assert_allclose(wrench, block.expected(time), rtol=0.0, atol=LAW * size)
        wrenches.append(wrench)
        assert max(pose_error(block.here, block.at(time, "X_WP"))) < 1e-7  # sqrt of round-off
        assert block.at(time, "X_WP_desired").IsExactlyEqualTo(block.trajectory.pose(time))
    assert np.ptp(wrenches, axis=0).max() > 1.0  # a wrench of an earlier time did not stay


def test_a_believed_model_of_half_the_mass_counts():
    lighter = load_robot("caroca")
    lighter.platform.mass *= 0.5
    block = Tracking("caroca", platform_dynamics(lighter))
    wrench = block.at(0.7, "desired_wrench")
    size = np.max(np.abs(wrench))
    np.testing.assert_allclose(wrench, block.expected(0.7), rtol=0.0, atol=LAW * size)
    assert np.max(np.abs(wrench - tracking("caroca").at(0.7, "desired_wrench"))) > 100.0
    resting = PoseTracking(in_plant("caroca"), at_rest(GOAL), DESIGN, platform_dynamics(lighter))
    context = resting.CreateDefaultContext()
    state = np.concatenate([[1.0, 0.0, 0.0, 0.0], GOAL.translation(), np.zeros(6)])
    resting.GetInputPort("platform_state").FixValue(context, state)
    found = resting.GetOutputPort("desired_wrench").Eval(context)
    np.testing.assert_allclose(found, [0.0, 0.0, 0.0, 0.0, 0.0, 75.0 * 9.81], atol=1e-9)


INTEGRATION = 1e-7
"""Runge-Kutta 3 with 1 ms on motions with rates of 10/s: (1e-2)^3 times the motion's 0.1, over
the length of the transient, and what the reference integration is allowed."""

DESIGN = TaskGains(100.0, 20.0)
"""Critically damped at 10 rad/s."""

GOAL = RigidTransform([0.0, 0.0, 1.0])


def at_rest(X_WP):
    return PoseTrajectory((X_WP, X_WP), (1.0,))


class Loop:
    """A robot whose damped platform gets the desired wrench itself, without cables."""

    def __init__(self, name, trajectory, start):
        self.robot = load_robot(name)
        self.robot.damping = PlatformDamping(translation=225.0, rotation=4.2)
        builder = DiagramBuilder()
        plant = builder.AddSystem(MultibodyPlant(0.0))
        self.in_plant = add_robot(plant, self.robot)
        plant.Finalize()
        control = builder.AddSystem(PoseTracking(self.in_plant, trajectory, DESIGN))
        rows = [3, 4, 2] if self.robot.is_planar() else range(6)
        pick = builder.AddSystem(MatrixGain(np.eye(6)[list(rows)]))
        state = plant.get_state_output_port(self.in_plant.model_instance)
        builder.Connect(state, control.GetInputPort("platform_state"))
        builder.Connect(control.GetOutputPort("desired_wrench"), pick.get_input_port())
        brake = builder.AddSystem(DampingSettings().block(self.in_plant))
        builder.Connect(state, brake.get_input_port())
        apply_force(builder, plant, pick.get_output_port(), name="wrench")
        apply_force(builder, plant, brake.get_output_port(), name="brake")
        self.simulator = Simulator(builder.Build())
        ResetIntegratorFromFlags(self.simulator, "runge_kutta3", 1e-3)
        self.simulator.get_mutable_integrator().set_fixed_step_mode(True)
        root = self.simulator.get_mutable_context()
        self.plant_context = plant.GetMyMutableContextFromRoot(root)
        self.in_plant.set_pose(self.plant_context, start)

    def pose(self, time):
        self.simulator.AdvanceTo(time)
        return self.in_plant.pose(self.plant_context)


def test_a_position_error_dies_out_as_the_gains_say():
    """e(t) = e(0) (1 + 10 t) exp(-10 t), although the centre of mass lies off Po."""
    offset = np.array([0.1, -0.2, 0.15])
    loop = Loop("caroca", at_rest(GOAL), RigidTransform(GOAL.translation() + offset))
    for time in (0.05, 0.1, 0.3, 0.6):
        left = loop.pose(time).translation() - GOAL.translation()
        expected = offset * (1.0 + 10.0 * time) * np.exp(-10.0 * time)
        np.testing.assert_allclose(left, expected, rtol=0.0, atol=INTEGRATION)


def test_an_attitude_error_about_one_axis_dies_out_as_the_gains_say():
    """theta'' = -Kp 2 sin(theta / 2) - Kd theta', from far away, Po staying where it is."""
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    start = RigidTransform(rotation_from_vector(2.5 * axis), GOAL.translation())
    loop, times = Loop("caroca", at_rest(GOAL), start), (0.05, 0.1, 0.3, 0.6)
    expected = scipy.integrate.solve_ivp(
        lambda _, y: [y[1], -200.0 * np.sin(y[0] / 2.0) - 20.0 * y[1]],
        (0.0, 0.6), [2.5, 0.0], t_eval=times, rtol=1e-10, atol=1e-12,
    ).y[0]  # fmt: skip
    for time, theta in zip(times, expected, strict=True):
        X_WP = loop.pose(time)
        found = rotation_vector(X_WP.rotation())
        np.testing.assert_allclose(found, theta * axis, rtol=0.0, atol=10.0 * INTEGRATION)
        np.testing.assert_allclose(X_WP.translation(), GOAL.translation(), atol=INTEGRATION)


@pytest.mark.parametrize("name", ["caroca", "planar"])
def test_a_platform_follows_a_trajectory(name):
    robot = load_robot(name)
    start, planar = robot.home.transform(), robot.is_planar()
    angles = np.array([0.0, 0.0, 0.2] if planar else [0.1, -0.1, 0.2])
    way = np.array([0.05, -0.04, 0.0 if planar else 0.06])
    trajectory = PoseTrajectory((start, start @ pose_from_angles(way, angles)), (2.0,), 0.1)
    loop = Loop(name, trajectory, start)
    for time in np.linspace(0.0, 2.4, 25)[1:]:
        assert max(pose_error(trajectory.pose(time), loop.pose(time))) < INTEGRATION


class Distribution:
    """The distributor at home, asked step by step, with the problem that it solves."""

    def __init__(self, name, method="quadratic_program", needs=True, **more):
        handles = in_plant(name)
        robot, home = handles.robot, handles.robot.home.transform()
        reference = np.full(len(robot.cables), 6.0) if needs else None
        self.problem = tension_problem(robot, home, reference=reference)
        self.rows = [2, 3, 4] if robot.is_planar() else list(range(6))
        self.weight = np.zeros(6)
        self.weight[self.rows] = -self.problem.wrench
        if needs:
            more["reference"] = reference
        self.block = TensionDistributor(handles, method, **more)
        self.context = self.block.CreateDefaultContext()
        context = handles.plant.CreateDefaultContext()
        handles.set_pose(context, home)
        state = handles.plant.get_state_output_port(handles.model_instance).Eval(context)
        self.block.GetInputPort("platform_state").FixValue(self.context, state)

    def outputs(self):
        names = ("tensions", "feasible", "failures")
        return [self.block.GetOutputPort(name).Eval(self.context).copy() for name in names]

    def step(self, wrench):
        self.block.GetInputPort("desired_wrench").FixValue(self.context, wrench)
        state = self.context.Clone().get_mutable_discrete_state()
        self.block.CalcForcedDiscreteVariableUpdate(self.context, state)
        self.context.SetDiscreteState(state)
        return self.outputs()


def takes(balance):
    sizes = {(None, "acrobot_large"): 2, (None, "planar"): 1,
             (FORCE, "acrobot_large"): 5, (FORCE, "planar"): 2}  # fmt: skip
    names = ("acrobot_large", "planar")
    return [(n, m) for n in names for m in METHODS if METHODS[m].takes(sizes[balance, n])]


@pytest.mark.parametrize(("name", "method"), takes(None))
def test_a_step_of_the_distributor_is_the_method(name, method):
    found = Distribution(name, method, METHODS[method].needs_reference)
    tensions, feasible, _ = found.step(found.weight)
    expected = distribute(found.problem, method)
    assert feasible == (expected.status == "feasible")
    if feasible:
        np.testing.assert_allclose(tensions, expected.tensions, rtol=ROUNDING, atol=1e-9)


@pytest.mark.parametrize(("name", "method"), takes(FORCE))
def test_forces_alone_are_balanced_by_every_method_that_takes_the_redundancy(name, method):
    """The moments of the wrench count for nothing."""
    found = Distribution(name, method, balance=FORCE)
    problem = force_problem(found.problem, 1 if name == "planar" else 3)
    found.weight[:3] = 1e3
    tensions, feasible, _ = found.step(found.weight)
    expected = distribute(problem, method)
    assert feasible == (expected.status == "feasible")
    if feasible:
        np.testing.assert_allclose(tensions, expected.tensions, rtol=ROUNDING, atol=1e-9)
        assert problem.residual(tensions) < ROUNDING


def test_a_wrench_that_cannot_be_met_holds_the_last_tensions_and_is_counted():
    found = Distribution("acrobot_large", needs=False, limits=(0.5, 60.0))
    np.testing.assert_array_equal(found.outputs()[0], 0.5)
    good, feasible, _ = found.step(found.weight)
    assert feasible == 1.0
    for count in (1.0, 2.0):
        bad, feasible, failures = found.step(-found.weight)  # it hangs: cables cannot push down
        assert (feasible, failures) == (0.0, count)
        np.testing.assert_array_equal(bad, good)
    _, feasible, failures = found.step(found.weight)
    assert (feasible, failures) == (1.0, 2.0)


@pytest.mark.parametrize("name", ["acrobot_large", "planar"])
def test_slack_relaxed_answers_a_wrench_that_cannot_be_met(name):
    """With the tensions that `distribute` gives, within limits; it counts as not met."""
    found, far = Distribution(name, "slack_relaxed", needs=False), 1000.0 * np.ones(6)
    tensions, feasible, failures = found.step(far)
    assert (feasible, failures) == (0.0, 1.0)
    problem = replace(found.problem, wrench=-far[found.rows])
    expected = distribute(problem, "slack_relaxed").tensions
    assert np.max(expected) == np.max(found.problem.upper)
    np.testing.assert_allclose(tensions, expected, rtol=ROUNDING, atol=1e-9)
    assert found.step(found.weight)[1] == 1.0


SOLVER = 1e-4  # [N]; of solvers that stop at 1e-8 of the weight, or SNOPT at 1e-6
LOCAL = 1e-2  # [N]; SNOPT from another start, where the cost is flat
BOUND = 0.35  # [N]


def own_program(add):
    def program(problem):
        made = TensionProgram(problem)
        add(made)
        return made

    return program


PAIRS = np.kron(np.eye(4), [1.0, -1.0])
TERMS = {
    "preference": own_program(lambda p: p.AddQuadraticCost(8.0, 2.0, name="near 8 N")),
    "bound": own_program(lambda p: p.AddLinearConstraint(PAIRS, -BOUND, BOUND, name="pairs")),
    "nonlinear": own_program(
        lambda p: p.AddCost(lambda t: 20.0 * float(np.sum(1.0 / t)), name="not slack")
    ),
    "impossible": own_program(lambda p: p.AddLinearConstraint(np.ones(8), 0.0, 1.0, name="no")),
    "wrong": own_program(lambda p: p.AddLinearConstraint(np.ones(4), 0.0, 1.0)),
}


@pytest.fixture
def own_method():
    before = set(METHODS)
    yield lambda name: TensionMethod.from_program(name, TERMS[name])
    for name in set(METHODS) - before:
        del METHODS[name]


def run(method, seconds, engine="plant"):
    loaded = load_scenario("acrobot_computed_torque")
    return TensionRun(replace(
        loaded, duration=seconds, expected=None,
        distribution=replace(loaded.distribution, method=method),
        integration=replace(loaded.integration, engine=engine),
    )).simulate()  # fmt: skip


@pytest.mark.parametrize(
    ("terms", "seconds"), [("preference", 0.6), ("bound", 1), ("nonlinear", 0.4)]
)
def test_a_loop_of_1_khz_misses_no_step_of_an_own_program(terms, seconds, own_method):
    """Tensions of the middle and the end are those of the program there by itself."""
    method = own_method(terms)
    done = run(terms, seconds)
    summary, log = done.as_dict(), done.log
    counts = summary["program_steps"]
    assert summary["infeasible_steps"] == 0
    assert counts["missed_steps"] == 0
    assert counts["steps"] >= 1000 * seconds
    assert counts == method.step_times.as_dict()
    assert 0.0 < counts["mean_s"] <= counts["worst_s"]
    assert summary["position_error_m"]["max"] < 1e-3
    assert np.all(log["feasible"][1:] == 1.0)
    t = log["tensions"][1:]
    if terms == "bound":
        assert np.max(np.abs(t @ PAIRS.T)) <= BOUND + SOLVER
        plain = run("quadratic_program", seconds)
        assert np.max(np.abs(plain.log["tensions"][1:] @ PAIRS.T)) > BOUND
        assert "program_steps" not in plain.as_dict()  # kernels tell no time
    robot = done.built.robot
    cables = done.scenario.believed_cables(robot)
    for k in (len(t) // 3, len(t) - 1):
        X = pose_from_row(log["X_WP"][k + 1])
        held = tension_problem(robot, X, limits=(1.0, 60.0), cables=cables)
        problem = TensionProblem(held.W, -held.W @ t[k], held.lower, held.upper)
        again = TERMS[terms](problem).Solve().tensions
        close = LOCAL if terms == "nonlinear" else 10.0 * SOLVER
        np.testing.assert_allclose(t[k], again, rtol=0.0, atol=close)


def test_the_compiled_loop_takes_an_own_program_too(own_method):
    own_method("preference")
    plant, compiled = (run("preference", 0.2, engine) for engine in ("plant", "compiled"))
    assert compiled.loop != plant.loop
    for done in (plant, compiled):
        assert done.as_dict()["infeasible_steps"] == 0
    np.testing.assert_allclose(plant.log["tensions"][-1], compiled.log["tensions"][-1], atol=0.05)


def test_a_program_that_excludes_all_tensions_is_held_and_counted(own_method):
    method = own_method("impossible")
    summary = run("impossible", 0.01).as_dict()
    assert summary["infeasible_steps"] == summary["program_steps"]["missed_steps"] >= 10
    assert method.step_times.missed >= 10


def test_terms_that_do_not_fit_are_refused_before_the_loop(own_method):
    own_method("wrong")
    handles = in_plant("acrobot_large")
    problem = tension_problem(handles.robot, handles.robot.home.transform())
    for call in (
        lambda: TensionDistributor(handles, "wrong"),
        lambda: distribute(problem, "wrong"),
    ):
        with pytest.raises(TensionProblemError, match=r"A: found shape \(1, 4\)"):
            call()
