"""Constraints for any program: gradients, values against other ways to them, what is refused."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pydrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff
from pydrake.math import RigidTransform
from pydrake.multibody.tree import SpatialInertia, UnitInertia
from pydrake.solvers import MathematicalProgram
from scipy.optimize import linprog

from cdpr_drake.analyses.benchmarks import constraints as benchmark
from cdpr_drake.analyses.planning.robot_path_task import LimitSettings, path_task
from cdpr_drake.control.task_space import (
    PlatformDynamics,
    TaskGains,
    computed_torque,
)
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.cable_paths import cable_jacobian, cable_paths
from cdpr_drake.geometry.convex_shapes import ConvexShape
from cdpr_drake.geometry.poses import (
    angles_from_rotation,
    pose_from_angles,
    pose_from_row,
    pose_row,
)
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import PlatformDamping
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

EXACT = 1e-8  # of the largest slope: what is asked for; differences themselves are good to 1e-10
STEP = 2e-5  # of the differences, so small that no other bounds hold [rad, m, ...]
ROUNDING = 1e-10
START = pose_from_angles(np.array([0.05, 0.0, 0.3]), np.radians([5.0, -4.0, 10.0]))
MARK = np.array([[-0.063], [0.0], [0.02]])
PILLAR = ConvexShape.box_at(np.array([0.25, 0.05, 0.2]), np.array([0.06, 0.06, 0.4]))
BALL = ConvexShape.sphere(np.array([-0.3, 0.1, 0.5]), 0.05)
COORDINATES = {"relative": RelativePose(START), "angles": PlaceAndAngles(), "body": BodyState()}


@cache
def robot_task(pulleys=False):
    robot = load_robot("acrobot_large")
    robot.damping = PlatformDamping(translation=7.0, rotation=0.9)
    cables = robot.cable_set() if pulleys else robot.cable_set().without_pulleys()
    return robot, path_task(robot, LimitSettings(tensions=(1.0, 60.0)), cables)


def servo(coordinates, least=0.0):
    robot, task = robot_task()
    mount = robot.camera_mount("onboard").pose.transform()
    X_WO = RigidTransform(MARK[:, 0])
    target = FixedObject(X_WO, (RigidTransform([0.02, 0.01, 0.35]) @ mount).inverse() @ X_WO)
    case = StabilityCase(task.cables, "pbvs", X_PC=mount, target=target)
    worst = StableServo.worst_at(case, BASELINE, pose_row(START)[np.newaxis])
    return case, StableServo(case, BASELINE, coordinates, worst, least)


def constraints(coordinates, pulleys):
    """Of each kind one, with the derivatives of the pose that it is given."""
    robot, task = robot_task(pulleys)
    cables, camera = task.cables, robot.camera_mount("onboard").pose.transform()
    body = ConvexShape.box_at(robot.box_center(), robot.platform.size)
    limits = replace(task.limits, torque=2.0, inertia=1e-3, ratio=0.03)
    motors = PathTask(cables, task.dynamics, limits)
    return [
        (TensionFeasible(task, coordinates), 2),
        (TensionFeasible(task, coordinates), 0),
        (TensionBalance(task, coordinates), 2),
        (MotorTorques(motors, coordinates), 2),
        (LengthRates(cables, coordinates, 1.0), 1),
        (LengthAccelerations(cables, coordinates, 1.0), 2),
        (CableClearance(cables, coordinates, 0.01), 0),
        (ObstacleClearance(cables, coordinates, [PILLAR, BALL], [body], 0.01, 0.02), 0),
        (SeparatingPlane(coordinates, body, PILLAR, 0.02), 0),
        (TargetInView(coordinates, camera, (0.65, 0.5), MARK, 0.1), 0),
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


def slopes(function, x):
    """Central differences of sixth order."""

    def rate(k, e):
        return (function(x + k * STEP * e) - function(x - k * STEP * e)) / (2.0 * k * STEP)

    return np.array([
        1.5 * rate(1, e) - 0.6 * rate(2, e) + 0.1 * rate(3, e) for e in np.eye(len(x))
    ]).T  # fmt: skip


@pytest.mark.parametrize("kind", COORDINATES)
@pytest.mark.parametrize("pulleys", [False, True])
def test_jacobians_are_those_of_differences(kind, pulleys):
    for constraint, order in constraints(COORDINATES[kind], pulleys):
        for seed in range(3):
            x = numbers(constraint, order, seed)
            _, found = constraint.evaluate(x[np.newaxis])
            wanted = slopes(lambda z, c=constraint: c.evaluate(z[np.newaxis])[0][0], x)
            name = f"{constraint.description}, {order}, {seed}"
            worst = np.max(np.abs(found[0] - wanted))
            assert worst < EXACT * np.max(np.abs(wanted)), name


@pytest.mark.parametrize("name", benchmark.pairs())
def test_kernels_are_the_automatic_derivatives_of_the_same_source(name):
    constraint, automatic = benchmark.pairs()[name]
    given = InitializeAutoDiff(benchmark.numbers(constraint)).ravel()
    found, wanted = constraint.as_drake().Eval(given), automatic(given)
    np.testing.assert_allclose(ExtractValue(found), ExtractValue(wanted), atol=ROUNDING)
    scale = np.max(np.abs(ExtractGradient(wanted)))
    np.testing.assert_allclose(
        ExtractGradient(found), ExtractGradient(wanted), atol=ROUNDING * scale
    )


@pytest.mark.parametrize("pulleys", [False, True])
def test_balance_and_rates_are_those_of_the_robot(pulleys):
    _, task = robot_task(pulleys)
    here = RelativePose(START)
    balance = TensionBalance(task, here)
    x = numbers(balance, 2, 0)
    points, _ = here.points(x[np.newaxis, :18])
    point, X = points[0], pose_from_row(points[0, :7])
    wanted = computed_torque(
        X, point[7:13], X, point[7:13], point[13:], dynamics=task.dynamics,
        gains=TaskGains(stiffness=0.0, damping=0.0),
    )  # fmt: skip
    J = cable_jacobian(X, task.cables)
    t = task.limits.upper * x[18:]
    values, _ = balance.evaluate(x[np.newaxis])
    np.testing.assert_allclose(values[0] * balance.unit, -J.T @ t - wanted, atol=1e-9)
    rates = LengthRates(task.cables, here, 1.0).evaluate(x[np.newaxis, :12])[0][0]
    np.testing.assert_allclose(rates, J @ point[7:13], atol=1e-12)
    # Accelerations: rates a little before and after along the motion.
    q, v, a, e = x[:6], x[6:12], x[12:18], 1e-4
    both = [np.concatenate([q + s * v + 0.5 * s * s * a, v + s * a]) for s in (e, -e)]
    moved = LengthRates(task.cables, here, 1.0).evaluate(np.array(both))[0]
    found = LengthAccelerations(task.cables, here, 1.0).evaluate(x[np.newaxis, :18])[0][0]
    np.testing.assert_allclose(found, (moved[0] - moved[1]) / (2.0 * e), atol=1e-6)


def test_a_point_mass_and_a_planar_platform_have_their_own_balance():
    _, task = robot_task()
    inertia = SpatialInertia(
        2.0, [0.01, -0.02, 0.03], UnitInertia(0.02, 0.03, 0.04, 0.001, 0.002, -0.003)
    )
    for motions, point_mass in (((2, 3, 4), False), (tuple(range(6)), True)):
        dynamics = PlatformDynamics(
            inertia, motions=motions, point_mass=point_mass, damping=(7.0, 0.9)
        )
        changed = PathTask(task.cables, dynamics, task.limits)
        here = RelativePose(START, motions)
        balance = TensionBalance(changed, here)
        n = len(motions)
        x = np.concatenate([
            0.3 * np.random.default_rng(1).normal(size=3 * n), np.full(8, 0.2)
        ])  # fmt: skip
        values, found = balance.evaluate(x[np.newaxis])
        wanted = slopes(lambda z, b=balance: b.evaluate(z[np.newaxis])[0][0], x)
        np.testing.assert_allclose(found[0], wanted, atol=EXACT * np.max(np.abs(wanted)))
        point = here.points(x[np.newaxis, : 3 * n])[0][0]
        X = pose_from_row(point[:7])
        F = computed_torque(
            X, point[7:13], X, point[7:13], point[13:], dynamics=dynamics,
            gains=TaskGains(stiffness=0.0, damping=0.0),
        )  # fmt: skip
        t = changed.limits.upper * x[3 * n :]
        left = -cable_jacobian(X, task.cables).T @ t - F
        np.testing.assert_allclose(values[0] * balance.unit, left[list(motions)], atol=1e-9)


def test_the_margin_is_that_of_a_linear_program_and_its_tensions_have_it():
    _, task = robot_task()
    coordinates = PlaceAndAngles()
    feasible = TensionFeasible(task, coordinates)
    x = np.array([numbers(feasible, 0, seed) for seed in range(20)])
    values, tensions = feasible.evaluate(x)[0][:, 0], feasible.tensions(x)
    low, high = task.limits.lower, task.limits.upper
    for row, value, t in zip(x, values, tensions, strict=True):
        X = pose_from_row(coordinates.points(row[np.newaxis])[0][0, :7])
        J = cable_jacobian(X, task.cables)
        zero = np.zeros(6)
        weight = computed_torque(
            X, zero, X, zero, zero, dynamics=task.dynamics, gains=TaskGains(0.0, 0.0)
        )
        one = np.ones((8, 1))
        found = linprog(
            [*np.zeros(8), -1.0], A_eq=np.hstack([-J.T, np.zeros((6, 1))]), b_eq=weight,
            A_ub=np.vstack([np.hstack([-np.eye(8), one]), np.hstack([np.eye(8), one])]),
            b_ub=[*np.full(8, -low), *np.full(8, high)], bounds=(None, None),
        )  # fmt: skip
        assert value == pytest.approx(found.x[8], abs=1e-7)
        np.testing.assert_allclose(-J.T @ t, weight, atol=1e-8)
        assert min(np.min(t - low), np.min(high - t)) == pytest.approx(value, abs=1e-8)


@pytest.mark.parametrize("margin", [0.0, 3.0])
def test_a_margin_of_tensions_is_the_one_that_is_asked_for(margin):
    """From the given limits, by the linear program; no reserve beside it that nobody stated."""
    robot = load_robot("acrobot_large")
    given = (1.0, 60.0)
    task = path_task(robot, LimitSettings(tensions=given))
    assert (task.limits.lower, task.limits.upper) == given
    kept = path_task(robot, LimitSettings(tensions=given, reserve=0.05))
    assert kept.limits.lower == pytest.approx(1.0 + 0.05 * robot.platform.mass * robot.gravity)
    feasible = TensionFeasible(task, PlaceAndAngles(), margin=margin)
    inside = 0
    places = [[x, y, z] for x, y in ((0.3, 0.2), (0.45, 0.4)) for z in np.linspace(0.2, 0.8, 6)]
    for place in places:
        X = RigidTransform(START.rotation(), place)
        room = margin_of(robot, X, *given)
        x = np.concatenate([X.translation(), angles_from_rotation(X.rotation())])[np.newaxis]
        values = feasible.evaluate(x)[0]
        assert values[0, 0] == pytest.approx(room, abs=1e-7)
        assert (feasible.missed(values)[0, 0] <= 0.0) == (room >= margin)
        inside += room >= margin
    assert 0 < inside < len(places)


def margin_of(robot, X_WP, low, high):
    """The largest s with low + s <= t <= high - s for tensions t that hold the platform [N]."""
    problem = tension_problem(robot, X_WP)
    one, m = np.ones((8, 1)), 8
    found = linprog(
        [*np.zeros(m), -1.0], A_eq=np.hstack([problem.W, np.zeros((6, 1))]), b_eq=-problem.wrench,
        A_ub=np.vstack([np.hstack([-np.eye(m), one]), np.hstack([np.eye(m), one])]),
        b_ub=[*np.full(m, -low), *np.full(m, high)], bounds=(None, None),
    )  # fmt: skip
    return found.x[m]


def test_at_a_kink_the_margin_has_the_slope_of_one_side():
    """In the middle of a symmetric robot several bounds are touched at once."""
    _, task = robot_task()
    feasible = TensionFeasible(task, PlaceAndAngles())
    x = np.array([0.0, 0.0, 0.3, 0.0, 0.0, 0.0])

    def value(z):
        return feasible.evaluate(z[np.newaxis])[0][0, 0]

    slope = feasible.evaluate(x[np.newaxis])[1][0, 0]
    e = 1e-6
    ahead = np.array([(value(x + e * d) - value(x)) / e for d in np.eye(6)])
    behind = np.array([(value(x) - value(x - e * d)) / e for d in np.eye(6)])
    near = 1e-3 * np.max(np.abs(slope))
    assert np.all(np.isfinite(slope))
    assert np.all(slope <= np.maximum(ahead, behind) + near)
    assert np.all(slope >= np.minimum(ahead, behind) - near)


def test_where_no_cable_runs_there_is_no_margin():
    _, task = robot_task()
    feasible = TensionFeasible(task, BodyState())
    far = pose_row(RigidTransform(task.cables.p_WA[:, 0] - task.cables.p_PB[:, 0]))
    values, _ = feasible.evaluate(far[np.newaxis])
    assert np.isnan(values[0, 0])
    assert feasible.missed(values)[0, 0] == np.inf


def test_distances_from_obstacles_are_those_of_the_shapes():
    robot, task = robot_task()
    body = ConvexShape.box_at(robot.box_center(), robot.platform.size)
    around = ObstacleClearance(task.cables, BodyState(), [PILLAR, BALL], [body], 0.01, 0.02)
    for place in ([0.05, 0.0, 0.3], [0.2, 0.05, 0.3]):  # beside the pillar, and in it
        X = RigidTransform(START.rotation(), place)
        found = around.evaluate(pose_row(X)[np.newaxis])[0][0]
        A, B = task.cables.p_WA.T, (X @ task.cables.p_PB).T
        wanted = [
            ConvexShape(np.array(shape)).distance(obstacle)[0]
            for obstacle in (PILLAR, BALL)
            for shape in (*np.stack([A, B], axis=1), body.moved(X).points)
        ]
        np.testing.assert_allclose(found, wanted, atol=1e-12)
    assert found[8] < 0.0  # how deep it is
    assert around.rows[8] == "the platform and obstacle 1"
    np.testing.assert_allclose(around.lower, 2 * [*np.full(8, 0.01), 0.02])


def test_the_least_stiffness_is_an_eigenvalue():
    _, task = robot_task()
    X, length = START, 0.2
    constraint = StiffnessAbove(task.cables, BodyState(), 1.0, length)
    found = constraint.evaluate(pose_row(X)[np.newaxis])[0][0, 0]
    paths = cable_paths(X, task.cables)
    J = paths.J / np.array([length] * 3 + [1.0] * 3)
    stiff = task.cables.packed()[:, 6] / np.linalg.norm(
        (X @ task.cables.p_PB) - task.cables.p_WA, axis=0
    )
    wanted = np.linalg.eigvalsh(J.T @ np.diag(stiff) @ J)[0]
    assert found == pytest.approx(wanted, rel=1e-9)


def test_a_servos_margin_is_that_of_the_stability_room():
    case, constraint = servo(PlaceAndAngles())
    x = numbers(constraint, 0, 4)
    _, found = constraint.evaluate(x[np.newaxis])
    wanted = slopes(lambda z: constraint.evaluate(z[np.newaxis])[0][0], x)
    assert np.max(np.abs(found[0] - wanted)) < EXACT * np.max(np.abs(wanted))
    pose = pose_row(START)[np.newaxis]
    _, at_start = servo(BodyState())
    searched = judge_stability(case, BASELINE, pose, "searched").margin[0]
    assert at_start.evaluate(pose)[0][0, 0] == pytest.approx(searched, abs=1e-9)
    with pytest.raises(PlanningError, match="perturbations: found shape"):
        StableServo(case, BASELINE, BodyState(), np.zeros((1, 5)))


def test_variables_may_be_affine_expressions():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(3, "x")
    here = PlaceAndAngles()
    expressions = np.array([x[0] + 2.0 * x[1], x[1], 0.3, 0.1 * x[2], 0.0, x[2]])
    speed = TargetInView(
        here, robot_task()[0].camera_mount("onboard").pose.transform(), (0.65, 0.5), MARK, 0.1
    )
    binding = speed.AddTo(prog, expressions)
    at = np.array([0.02, 0.01, 0.2])
    prog.SetInitialGuess(x, at)
    given = np.array([0.04, 0.01, 0.3, 0.02, 0.0, 0.2])
    values = prog.EvalBinding(binding, at)
    np.testing.assert_allclose(values, speed.evaluate(given[np.newaxis])[0][0], atol=1e-14)
    gradient = ExtractGradient(prog.EvalBinding(binding, InitializeAutoDiff(at).ravel()))
    _, jacobian = speed.evaluate(given[np.newaxis])
    M = np.array([[1, 2, 0], [0, 1, 0], [0, 0, 0], [0, 0, 0.1], [0, 0, 0], [0, 0, 1.0]])
    assert {str(one) for one in binding.variables()} == {"x(0)", "x(1)", "x(2)"}
    np.testing.assert_allclose(gradient, jacobian[0] @ M, atol=1e-12)
    with pytest.raises(PlanningError, match="not affine"):
        speed.AddTo(prog, np.array([x[0] * x[1], *x[:1], 0.0, 0.0, 0.0, 0.0]))


def test_what_is_not_accepted_is_said():
    _, task = robot_task()
    prog, here = MathematicalProgram(), PlaceAndAngles()
    x = prog.NewContinuousVariables(7, "x")
    with pytest.raises(PlanningError, match=r"cable speeds: found 7 variables .* 12 or 18"):
        LengthRates(task.cables, here, 1.0).AddTo(prog, x)
    with pytest.raises(PlanningError, match="rate: found 0 m/s"):
        LengthRates(task.cables, here, 0.0)
    with pytest.raises(PlanningError, match="obstacles: found none"):
        ObstacleClearance(task.cables, here, [], [], 0.0, 0.0)
    with pytest.raises(PlanningError, match="distance: found -1 m"):
        CableClearance(task.cables, here, -1.0)
    with pytest.raises(PlanningError, match="points: found shape"):
        TargetInView(here, RigidTransform(), (0.6, 0.5), np.zeros((2, 2)), 0.1)
    with pytest.raises(PlanningError, match="stiffness: found"):
        StiffnessAbove(task.cables, here, 1.0, 0.0)
    with pytest.raises(PlanningError, match="box: found"):
        PlaceWithin(here, np.ones(3), np.zeros(3))
