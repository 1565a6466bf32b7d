"""Constraints of any program, and of Drake's: by differences, linear programs, and shapes."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff
from pydrake.math import RigidTransform
from pydrake.multibody.inverse_kinematics import InverseKinematics
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import SpatialInertia, UnitInertia
from pydrake.planning import DirectCollocation, KinematicTrajectoryOptimization
from pydrake.solvers import MathematicalProgram, SnoptSolver
from pydrake.symbolic import Expression
from pydrake.systems.primitives import LinearSystem

from cdpr_drake.analyses.planning.robot_path_task import path_task, robot_limits
from cdpr_drake.control.task_space import PlatformDynamics
from cdpr_drake.geometry.cable_paths import cable_jacobian, cable_paths
from cdpr_drake.geometry.convex_shapes import ConvexShape
from cdpr_drake.geometry.poses import angles_from_rotation, pose_from_row, pose_row
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.planning.place_constraints import (
    CableClearance,
    ObstacleClearance,
    PlaceWithin,
    PlatformSpeed,
    SeparatingPlane,
    StiffnessAbove,
    TargetInView,
)
from cdpr_drake.planning.pose_coordinates import BodyState, PlaceAndAngles, RelativePose
from cdpr_drake.planning.servo_constraint import StableServo
from cdpr_drake.planning.tension_constraints import (
    LengthAccelerations,
    LengthRates,
    MotorTorques,
    TensionBalance,
    TensionFeasible,
)
from cdpr_drake.stability.desired_view import FixedObject
from cdpr_drake.stability.perturbation_bounds import BASELINE
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import judge_stability
from tests.benchmarks import autodiff
from tests.planning.planning_cases import (
    MARK,
    damped_acrobot,
    largest_margin,
    pose,
    slopes,
    wrench_of,
)

EXACT = 1e-8  # of the largest slope: what is asked for; differences themselves are good to 1e-10
ROUNDING = 1e-10
SOLVED = 1e-6  # what SNOPT may miss of a constraint
VIEW = ((0.65, 0.5), MARK)
START = pose(0.05, 0.0, 0.3, 5.0, -4.0, 10.0)
PILLAR = ConvexShape.box_at(np.array([0.25, 0.05, 0.2]), np.array([0.06, 0.06, 0.4]))
BALL = ConvexShape.sphere(np.array([-0.3, 0.1, 0.5]), 0.05)
COORDINATES = {"relative": RelativePose(START), "angles": PlaceAndAngles(), "body": BodyState()}


def camera():
    return damped_acrobot()[0].camera_mount("onboard").pose.transform()


def platform():
    robot, _ = damped_acrobot()
    return ConvexShape.box_at(robot.box_center(), robot.platform.size)


def servo(coordinates, least=0.0):
    _, task = damped_acrobot()
    X_WO = RigidTransform(MARK[:, 0])
    target = FixedObject(X_WO, (RigidTransform([0.02, 0.01, 0.35]) @ camera()).inverse() @ X_WO)
    case = StabilityCase(task.cables, "pbvs", X_PC=camera(), target=target)
    worst = StableServo.worst_at(case, BASELINE, pose_row(START)[np.newaxis])
    return case, StableServo(case, BASELINE, coordinates, worst, least)


def constraints(coordinates, pulleys):
    """Of each kind one, with the derivatives of the pose that it is given."""
    _, task = damped_acrobot(pulleys)
    cables, limits = task.cables, replace(task.limits, torque=2.0, inertia=1e-3, ratio=0.03)
    motors = PathTask(cables, task.dynamics, limits)
    return [
        (TensionFeasible(task, coordinates), 2),
        (TensionFeasible(task, coordinates), 0),
        (TensionBalance(task, coordinates), 2),
        (MotorTorques(motors, coordinates), 2),
        (LengthRates(cables, coordinates, 1.0), 1),
        (LengthAccelerations(cables, coordinates, 1.0), 2),
        (CableClearance(cables, coordinates, 0.01), 0),
        (ObstacleClearance(cables, coordinates, [PILLAR, BALL], [platform()], 0.01, 0.02), 0),
        (SeparatingPlane(coordinates, platform(), PILLAR, 0.02), 0),
        (TargetInView(coordinates, camera(), *VIEW, 0.1), 0),
        (StiffnessAbove(cables, coordinates, 1.0, 0.2), 0),
        (PlatformSpeed(coordinates, 1.0), 1),
        (PlaceWithin(coordinates, -np.ones(3), np.ones(3)), 0),
    ]


def numbers(constraint, order, seed):
    """Coordinates near the start, and tensions."""
    random, coordinates = np.random.default_rng(seed), constraint.coordinates
    x = 0.5 * random.normal(size=coordinates.sizes[order])
    if isinstance(coordinates, RelativePose):
        x[:6] *= 0.2
    elif isinstance(coordinates, PlaceAndAngles):
        x[:3] = START.translation() + 0.05 * random.normal(size=3)
        x[3:6] = 0.1 * random.normal(size=3)
    else:
        x[:7] = pose_row(START) + 0.04 * random.normal(size=7)
        x[:4] *= 1.3  # a quaternion of any length
    return np.concatenate([x, random.uniform(0.1, 0.5, constraint.extra)])


def check_slopes(constraint, x):
    _, jacobian = constraint.evaluate(x[np.newaxis])
    expected = slopes(lambda z: constraint.evaluate(z[np.newaxis])[0][0], x)
    worst = np.max(np.abs(jacobian[0] - expected))
    assert worst < EXACT * np.max(np.abs(expected)), constraint.description


# Values and slopes.


@pytest.mark.parametrize("kind", COORDINATES)
@pytest.mark.parametrize("pulleys", [False, True])
def test_jacobians_are_those_of_differences(kind, pulleys):
    for constraint, order in constraints(COORDINATES[kind], pulleys):
        for seed in range(2):
            check_slopes(constraint, numbers(constraint, order, seed))


@pytest.mark.parametrize("name", autodiff.pairs())
def test_kernels_are_the_automatic_derivatives_of_the_same_source(name):
    constraint, automatic = autodiff.pairs()[name]
    x = InitializeAutoDiff(autodiff.numbers(constraint)).ravel()
    ours, theirs = constraint.as_drake().Eval(x), automatic(x)
    np.testing.assert_allclose(ExtractValue(ours), ExtractValue(theirs), atol=ROUNDING)
    expected = ExtractGradient(theirs)
    scale = np.max(np.abs(expected))
    np.testing.assert_allclose(ExtractGradient(ours), expected, atol=ROUNDING * scale)


@pytest.mark.parametrize("pulleys", [False, True])
def test_balance_and_rates_are_those_of_the_robot(pulleys):
    _, task = damped_acrobot(pulleys)
    here = RelativePose(START)
    balance, rates = TensionBalance(task, here), LengthRates(task.cables, here, 1.0)
    x = numbers(balance, 2, 0)
    point = here.points(x[np.newaxis, :18])[0][0]
    X = pose_from_row(point[:7])
    J = cable_jacobian(X, task.cables)
    left = -J.T @ (task.limits.upper * x[18:]) - wrench_of(
        task.dynamics, X, point[7:13], point[13:]
    )
    np.testing.assert_allclose(
        balance.evaluate(x[np.newaxis])[0][0] * balance.unit, left, atol=1e-9
    )
    found = rates.evaluate(x[np.newaxis, :12])[0][0]
    np.testing.assert_allclose(found, J @ point[7:13], atol=1e-12)
    # Accelerations: rates a little before and after along the motion.
    q, v, a, e = x[:6], x[6:12], x[12:18], 1e-4
    both = [np.concatenate([q + s * v + 0.5 * s * s * a, v + s * a]) for s in (e, -e)]
    moved = rates.evaluate(np.array(both))[0]
    found = LengthAccelerations(task.cables, here, 1.0).evaluate(x[np.newaxis, :18])[0][0]
    np.testing.assert_allclose(found, (moved[0] - moved[1]) / (2.0 * e), atol=1e-6)


@pytest.mark.parametrize(
    ("motions", "point_mass"), [((2, 3, 4), False), (tuple(range(6)), True)], ids=["planar", "mass"]
)
def test_a_point_mass_and_a_planar_platform_have_their_own_balance(motions, point_mass):
    _, task = damped_acrobot()
    unit = UnitInertia(0.02, 0.03, 0.04, 0.001, 0.002, -0.003)
    dynamics = PlatformDynamics(
        SpatialInertia(2.0, [0.01, -0.02, 0.03], unit), motions=motions, point_mass=point_mass,
        damping=(7.0, 0.9),
    )  # fmt: skip
    changed, here = PathTask(task.cables, dynamics, task.limits), RelativePose(START, motions)
    balance, n = TensionBalance(changed, here), 3 * len(motions)
    x = np.concatenate([0.3 * np.random.default_rng(1).normal(size=n), np.full(8, 0.2)])
    check_slopes(balance, x)
    point = here.points(x[np.newaxis, :n])[0][0]
    X = pose_from_row(point[:7])
    t = changed.limits.upper * x[n:]
    left = -cable_jacobian(X, task.cables).T @ t - wrench_of(dynamics, X, point[7:13], point[13:])
    values = balance.evaluate(x[np.newaxis])[0][0]
    np.testing.assert_allclose(values * balance.unit, left[list(motions)], atol=1e-9)


def test_the_margin_is_that_of_a_linear_program_and_its_tensions_have_it():
    _, task = damped_acrobot()
    feasible = TensionFeasible(task, PlaceAndAngles())
    x = np.array([numbers(feasible, 0, seed) for seed in range(20)])
    values, tensions = feasible.evaluate(x)[0][:, 0], feasible.tensions(x)
    low, high = task.limits.lower, task.limits.upper
    for row, value, t in zip(x, values, tensions, strict=True):
        X = pose_from_row(feasible.coordinates.points(row[np.newaxis])[0][0, :7])
        J, weight = cable_jacobian(X, task.cables), wrench_of(task.dynamics, X)
        assert value == pytest.approx(largest_margin(-J.T, weight, low, high), abs=1e-7)
        np.testing.assert_allclose(-J.T @ t, weight, atol=1e-8)
        assert min(np.min(t - low), np.min(high - t)) == pytest.approx(value, abs=1e-8)


@pytest.mark.parametrize("margin", [0.0, 3.0])
def test_a_margin_of_tensions_is_the_one_that_is_asked_for(margin):
    """From the given limits, by the linear program; no reserve beside it that nobody stated."""
    robot, low_high = load_robot("acrobot_large"), (1.0, 60.0)
    limits = robot_limits(robot, low_high)
    task = path_task(robot, limits)
    assert (task.limits.lower, task.limits.upper) == low_high
    kept = path_task(robot, limits, reserve=0.05)
    assert kept.limits.lower == pytest.approx(1.0 + 0.05 * robot.platform.mass * robot.gravity)
    feasible, inside = TensionFeasible(task, PlaceAndAngles(), margin=margin), []
    places = [[x, y, z] for x, y in ((0.3, 0.2), (0.45, 0.4)) for z in np.linspace(0.2, 0.8, 6)]
    for place in places:
        X = RigidTransform(START.rotation(), place)
        problem = tension_problem(robot, X)
        room = largest_margin(problem.W, -problem.wrench, *low_high)
        x = np.concatenate([X.translation(), angles_from_rotation(X.rotation())])[np.newaxis]
        values = feasible.evaluate(x)[0]
        assert values[0, 0] == pytest.approx(room, abs=1e-7)
        assert (feasible.missed(values)[0, 0] <= 0.0) == (room >= margin)
        inside.append(room >= margin)
    assert 0 < sum(inside) < len(places)


def test_at_a_kink_the_margin_has_the_slope_of_one_side():
    """In the middle of a symmetric robot several bounds are touched at once."""
    feasible = TensionFeasible(damped_acrobot()[1], PlaceAndAngles())
    x = np.array([0.0, 0.0, 0.3, 0.0, 0.0, 0.0])
    steps = np.concatenate([np.zeros((1, 6)), 1e-6 * np.eye(6), -1e-6 * np.eye(6)])
    values = feasible.evaluate(x + steps)[0][:, 0]
    slope = feasible.evaluate(x[np.newaxis])[1][0, 0]
    ahead, behind = (values[1:7] - values[0]) / 1e-6, (values[0] - values[7:]) / 1e-6
    near = 1e-3 * np.max(np.abs(slope))
    assert np.all(np.isfinite(slope))
    assert np.all(slope <= np.maximum(ahead, behind) + near)
    assert np.all(slope >= np.minimum(ahead, behind) - near)


def test_where_no_cable_runs_there_is_no_margin():
    _, task = damped_acrobot()
    feasible = TensionFeasible(task, BodyState())
    far = pose_row(RigidTransform(task.cables.p_WA[:, 0] - task.cables.p_PB[:, 0]))
    values, _ = feasible.evaluate(far[np.newaxis])
    assert np.isnan(values[0, 0])
    assert feasible.missed(values)[0, 0] == np.inf


def test_distances_from_obstacles_are_those_of_the_shapes():
    _, task = damped_acrobot()
    obstacles = [PILLAR, BALL]
    around = ObstacleClearance(task.cables, BodyState(), obstacles, [platform()], 0.01, 0.02)
    for place in ([0.05, 0.0, 0.3], [0.2, 0.05, 0.3]):  # beside the pillar, and in it
        X = RigidTransform(START.rotation(), place)
        distances = around.evaluate(pose_row(X)[np.newaxis])[0][0]
        cables = np.stack([task.cables.p_WA.T, (X @ task.cables.p_PB).T], axis=1)
        expected = [
            ConvexShape(np.array(shape)).distance(obstacle)[0]
            for obstacle in obstacles
            for shape in (*cables, platform().moved(X).points)
        ]
        np.testing.assert_allclose(distances, expected, atol=1e-12)
    assert distances[8] < 0.0  # how deep it is
    assert around.rows[8] == "the platform and obstacle 1"
    np.testing.assert_allclose(around.lower, 2 * [*np.full(8, 0.01), 0.02])


def test_the_least_stiffness_is_an_eigenvalue():
    cables, length = damped_acrobot()[1].cables, 0.2
    constraint = StiffnessAbove(cables, BodyState(), 1.0, length)
    J = cable_paths(START, cables).J / np.array([length] * 3 + [1.0] * 3)
    stiff = cables.packed()[:, 6] / np.linalg.norm(START @ cables.p_PB - cables.p_WA, axis=0)
    least = np.linalg.eigvalsh(J.T @ np.diag(stiff) @ J)[0]
    values = constraint.evaluate(pose_row(START)[np.newaxis])[0]
    assert values[0, 0] == pytest.approx(least, rel=1e-9)


def test_a_servos_margin_is_that_of_the_stability_room():
    case, constraint = servo(PlaceAndAngles())
    check_slopes(constraint, numbers(constraint, 0, 4))
    row = pose_row(START)[np.newaxis]
    searched = judge_stability(case, BASELINE, row, "searched").margin[0]
    assert servo(BodyState())[1].evaluate(row)[0][0, 0] == pytest.approx(searched, abs=1e-9)


def test_variables_may_be_affine_expressions():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(3, "x")
    view = TargetInView(PlaceAndAngles(), camera(), *VIEW, 0.1)
    binding = view.AddTo(prog, np.array([x[0] + 2.0 * x[1], x[1], 0.3, 0.1 * x[2], 0.0, x[2]]))
    at = np.array([0.02, 0.01, 0.2])
    prog.SetInitialGuess(x, at)
    values, jacobian = view.evaluate(np.array([[0.04, 0.01, 0.3, 0.02, 0.0, 0.2]]))
    np.testing.assert_allclose(prog.EvalBinding(binding, at), values[0], atol=1e-14)
    gradient = ExtractGradient(prog.EvalBinding(binding, InitializeAutoDiff(at).ravel()))
    M = np.array([[1, 2, 0], [0, 1, 0], [0, 0, 0], [0, 0, 0.1], [0, 0, 0], [0, 0, 1.0]])
    assert {str(one) for one in binding.variables()} == {"x(0)", "x(1)", "x(2)"}
    np.testing.assert_allclose(gradient, jacobian[0] @ M, atol=1e-12)


# In Drake's programs.


def wishes(coordinates):
    """Tensions with a margin of 3 N, cables apart, off a post, and a view of 0.3 m or more."""
    _, task = damped_acrobot()
    post = ConvexShape.capsule(np.zeros(3), np.array([0.0, 0.0, 0.4]), 0.03)
    return [
        TensionFeasible(task, coordinates, 3.0),
        CableClearance(task.cables, coordinates, 0.005),
        ObstacleClearance(task.cables, coordinates, [post], [platform()], 0.005, 0.02),
        TargetInView(coordinates, camera(), *VIEW, 0.3),
    ]


def keeps(constraints, x):
    x = np.atleast_2d(x)
    return all(np.max(one.missed(one.evaluate(x)[0])) < SOLVED for one in constraints)


def solve(prog, *start):
    result = SnoptSolver().Solve(prog, *start)
    assert result.is_success()
    return result


def test_a_pose_is_found_with_a_view_off_an_obstacle_that_tensions_hold():
    here = PlaceAndAngles()
    constraints = [*wishes(here), servo(here, 0.5)[1]]
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(6, "x")
    for constraint in constraints:
        constraint.AddTo(prog, x)
    aim = np.array([0.05, 0.0, 0.2, 0.0, 0.0, 0.0])
    prog.AddQuadraticErrorCost(np.eye(6), aim, x)
    start = np.array([0.2, 0.1, 0.5, 0.0, 0.0, 0.0])
    assert not keeps(constraints, aim)  # it stands in the post, too near the mark
    pose = solve(prog, start).GetSolution(x)
    assert keeps(constraints, pose)
    assert np.linalg.norm(pose[:3] - aim[:3]) < np.linalg.norm(start[:3] - aim[:3])


def test_inverse_kinematics_of_a_plant_takes_them_on_the_state_of_its_platform():
    plant = MultibodyPlant(0.0)
    placed = add_robot(plant, damped_acrobot()[0])
    plant.Finalize()
    ik, constraints = InverseKinematics(plant), wishes(BodyState())
    first = plant.get_body(placed.body_index).floating_positions_start()
    q = ik.q()[first : first + 7]
    start = np.array([1.0, 0.0, 0.0, 0.0, 0.06, 0.0, 0.25])
    assert not keeps(constraints, start)
    for part in (part for constraint in constraints for part in constraint.smooth_parts()):
        own = ik.prog().NewContinuousVariables(part.extra, "n")
        part.AddTo(ik.prog(), np.concatenate([q, own]))
        ik.prog().SetInitialGuess(own, part.guess(start))
    ik.prog().SetInitialGuess(q, start)
    assert keeps(constraints, solve(ik.prog()).GetSolution(q))


def test_a_spline_keeps_them_at_its_samples():
    _, task = damped_acrobot()
    here = RelativePose(RigidTransform([-0.25, 0.05, 0.4]))
    _, apart, around, _ = wishes(here)
    feasible, end = TensionFeasible(task, here), here.coordinates(RigidTransform([0.25, 0.0, 0.4]))
    rates = LengthRates(task.cables, here, 0.4)
    spline = KinematicTrajectoryOptimization(6, 8)
    for k, place in ((0, np.zeros(6)), (1, end)):
        spline.AddPathPositionConstraint(place, place, k)
        spline.AddPathVelocityConstraint(np.zeros(6), np.zeros(6), k)
    spline.AddDurationConstraint(0.1, 10.0)
    spline.AddDurationCost(1.0)
    spline.AddPathLengthCost(1.0)
    samples = np.linspace(0.0, 1.0, 9)
    for s in samples:
        for constraint in (feasible, apart, around):
            spline.AddPathPositionConstraint(constraint.as_drake(), s)
        spline.AddVelocityConstraintAtNormalizedTime(rates.as_drake(), s)
    # The same on the control points themselves, with tensions as variables of one sample.
    middle = np.array([spline.basis().EvaluateBasisFunctionI(i, 0.5) for i in range(8)])
    pose = [
        sum((float(w) * point for w, point in zip(middle, row, strict=True) if w), Expression(0.0))
        for row in spline.control_points()
    ]
    tensions, _ = feasible.AddWithTensions(spline.get_mutable_prog(), pose)
    result = solve(spline.prog())
    motion = spline.ReconstructTrajectory(result)
    times = samples * motion.end_time()
    q = np.array([motion.value(t).ravel() for t in times])
    states = np.hstack([q, [motion.EvalDerivative(t).ravel() for t in times]])
    assert keeps([feasible, apart, around], q)
    assert keeps([rates], states)
    assert np.max(np.abs(rates.evaluate(states)[0])) > 0.9  # what the time rests on
    t = result.GetSolution(tensions)
    half = np.concatenate([motion.value(0.5 * motion.end_time()).ravel(), t])
    assert keeps([TensionBalance(task, here)], half)
    assert np.min(t) * task.limits.upper >= task.limits.lower - SOLVED
    assert not keeps([around], samples[:, np.newaxis] * end)  # the line runs into the post


def test_a_collocation_keeps_tensions_of_the_whole_motion():
    """A double integrator whose input is the acceleration of the coordinates."""
    _, task = damped_acrobot()
    goal = RigidTransform([0.2, 0.0, 0.35])
    here = RelativePose(RigidTransform([-0.2, 0.0, 0.35]))
    end = here.coordinates(goal)
    system = LinearSystem(np.eye(12, k=6), np.eye(12, 6, k=-6), np.eye(12), np.zeros((12, 6)))
    collocation = DirectCollocation(system, system.CreateDefaultContext(), 11, 0.02, 0.3)
    collocation.AddEqualTimeIntervalsConstraints()
    prog, ends = collocation.prog(), (np.zeros(12), np.append(end, np.zeros(6)))
    prog.AddBoundingBoxConstraint(ends[0], ends[0], collocation.initial_state())
    prog.AddBoundingBoxConstraint(ends[1], ends[1], collocation.final_state())
    feasible, rates = TensionFeasible(task, here), LengthRates(task.cables, here, 1.0)
    inside = PlaceWithin(here, np.array([-0.3, -0.1, 0.2]), np.array([0.3, 0.1, 0.5]))
    for k in range(11):  # tensions as variables: their margin has kinks where a least time ends
        feasible.AddWithTensions(prog, np.concatenate([collocation.state(k), collocation.input(k)]))
        s = k / 10.0
        prog.SetInitialGuess(collocation.state(k)[:6], s * s * (3.0 - 2.0 * s) * end)
    collocation.AddConstraintToAllKnotPoints(rates.as_drake(), collocation.state())
    collocation.AddConstraintToAllKnotPoints(inside.as_drake(), collocation.state()[:6])
    collocation.AddFinalCost(collocation.time())
    result = solve(prog)
    states, inputs = collocation.GetStateSamples(result).T, collocation.GetInputSamples(result).T
    x = np.hstack([states, inputs])
    assert keeps([feasible], x)
    assert keeps([rates], states)
    assert np.min(feasible.evaluate(x)[0]) < 0.05  # the time rests on the tensions
    X = pose_from_row(here.points(x[-1:])[0][0, :7])
    np.testing.assert_allclose(X.translation(), goal.translation(), atol=1e-6)
