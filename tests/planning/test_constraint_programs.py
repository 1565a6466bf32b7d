"""Constraints in programs of Drake: a pose, a spline, a collocation, and a plant's own state."""

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.inverse_kinematics import InverseKinematics
from pydrake.multibody.plant import MultibodyPlant
from pydrake.planning import DirectCollocation, KinematicTrajectoryOptimization
from pydrake.solvers import MathematicalProgram, SnoptSolver
from pydrake.symbolic import Expression
from pydrake.systems.primitives import LinearSystem

from cdpr_drake.geometry.convex_shapes import ConvexShape
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.planning.place_constraints import (
    CableClearance,
    ObstacleClearance,
    PlaceWithin,
    TargetInView,
)
from cdpr_drake.planning.pose_coordinates import BodyState, PlaceAndAngles, RelativePose
from cdpr_drake.planning.tension_constraints import LengthRates, TensionBalance, TensionFeasible
from tests.planning.test_constraints import MARK, robot_task, servo

SOLVED = 1e-6  # what SNOPT may miss of a constraint
MARGIN = 3.0  # of tensions [N]
NEAREST = 0.3  # depth of the mark in the camera [m]
SPEED = 0.4  # of the cables [m/s]


def asked(coordinates):
    robot, task = robot_task()
    camera = robot.camera_mount("onboard").pose.transform()
    body = ConvexShape.box_at(robot.box_center(), robot.platform.size)
    post = ConvexShape.capsule(np.zeros(3), np.array([0.0, 0.0, 0.4]), 0.03)
    return [
        TensionFeasible(task, coordinates, MARGIN),
        CableClearance(task.cables, coordinates, 0.005),
        ObstacleClearance(task.cables, coordinates, [post], [body], 0.005, 0.02),
        TargetInView(coordinates, camera, (0.65, 0.5), MARK, NEAREST),
    ]


def keeps(constraints, x):
    return all(np.max(one.missed(one.evaluate(x)[0])) < SOLVED for one in constraints)


def test_a_pose_is_found_with_a_view_off_an_obstacle_that_tensions_hold():
    here = PlaceAndAngles()
    constraints = [*asked(here), servo(here, 0.5)[1]]
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(6, "x")
    for constraint in constraints:
        constraint.AddTo(prog, x)
    wanted = np.array([0.05, 0.0, 0.2, 0.0, 0.0, 0.0])
    prog.AddQuadraticErrorCost(np.eye(6), wanted, x)
    start = np.array([0.2, 0.1, 0.5, 0.0, 0.0, 0.0])
    assert not keeps(constraints, wanted[np.newaxis])  # it stands in the post, too near the mark
    result = SnoptSolver().Solve(prog, start)
    assert result.is_success()
    found = result.GetSolution(x)
    assert keeps(constraints, found[np.newaxis])
    assert np.linalg.norm(found[:3] - wanted[:3]) < np.linalg.norm(start[:3] - wanted[:3])


def test_inverse_kinematics_of_a_plant_takes_them_on_the_state_of_its_platform():
    robot, _ = robot_task()
    plant = MultibodyPlant(0.0)
    placed = add_robot(plant, robot)
    plant.Finalize()
    ik = InverseKinematics(plant)
    here = BodyState()
    constraints = asked(here)
    first = plant.get_body(placed.body_index).floating_positions_start()
    q = ik.q()[first : first + 7]
    start = np.array([1.0, 0.0, 0.0, 0.0, 0.06, 0.0, 0.25])
    assert not keeps(constraints, start[np.newaxis])
    for constraint in constraints:
        for part in constraint.smooth_parts():
            own = ik.prog().NewContinuousVariables(part.extra, "n")
            part.AddTo(ik.prog(), np.concatenate([q, own]))
            ik.prog().SetInitialGuess(own, part.guess(start))
    ik.prog().SetInitialGuess(q, start)
    result = SnoptSolver().Solve(ik.prog())
    assert result.is_success()
    assert keeps(constraints, result.GetSolution(q)[np.newaxis])


def test_a_spline_keeps_them_at_its_samples():
    _, task = robot_task()
    start, goal = RigidTransform([-0.25, 0.05, 0.4]), RigidTransform([0.25, 0.0, 0.4])
    here = RelativePose(start)
    _, apart, around, _ = asked(here)
    feasible, end = TensionFeasible(task, here), here.coordinates(goal)
    rates = LengthRates(task.cables, here, SPEED)
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
    result = SnoptSolver().Solve(spline.prog())
    assert result.is_success()
    found = spline.ReconstructTrajectory(result)
    times = samples * found.end_time()
    q = np.array([found.value(t).ravel() for t in times])
    v = np.array([found.EvalDerivative(t).ravel() for t in times])
    assert keeps([feasible, apart, around], q)
    assert keeps([rates], np.hstack([q, v]))
    assert np.max(np.abs(rates.evaluate(np.hstack([q, v]))[0])) > 0.9  # what the time rests on
    t = result.GetSolution(tensions)
    balance = TensionBalance(task, here)
    half = np.concatenate([found.value(0.5 * found.end_time()).ravel(), t])
    assert keeps([balance], half[np.newaxis])
    assert np.min(t) * task.limits.upper >= task.limits.lower - SOLVED
    line = np.linspace(0.0, 1.0, 9)[:, np.newaxis] * end
    assert not keeps([around], line)  # the straight line runs into the post


def test_a_collocation_keeps_tensions_of_the_whole_motion():
    """A double integrator whose input is the acceleration of the coordinates."""
    _, task = robot_task()
    start, goal = RigidTransform([-0.2, 0.0, 0.35]), RigidTransform([0.2, 0.0, 0.35])
    here = RelativePose(start)
    end = here.coordinates(goal)
    A, B = np.zeros((12, 12)), np.zeros((12, 6))
    A[:6, 6:], B[6:] = np.eye(6), np.eye(6)
    system = LinearSystem(A, B, np.eye(12), np.zeros((12, 6)))
    collocation = DirectCollocation(system, system.CreateDefaultContext(), 11, 0.02, 0.3)
    collocation.AddEqualTimeIntervalsConstraints()
    prog = collocation.prog()
    for state, place in (
        (collocation.initial_state(), np.zeros(6)),
        (collocation.final_state(), end),
    ):
        prog.AddBoundingBoxConstraint(
            np.append(place, np.zeros(6)), np.append(place, np.zeros(6)), state
        )
    feasible = TensionFeasible(task, here)
    inside = PlaceWithin(here, np.array([-0.3, -0.1, 0.2]), np.array([0.3, 0.1, 0.5]))
    for k in range(11):  # tensions as variables: their margin has kinks where a least time ends
        motion = np.concatenate([collocation.state(k), collocation.input(k)])
        feasible.AddWithTensions(prog, motion)
    rates = LengthRates(task.cables, here, 1.0)
    collocation.AddConstraintToAllKnotPoints(rates.as_drake(), collocation.state())
    collocation.AddConstraintToAllKnotPoints(inside.as_drake(), collocation.state()[:6])
    collocation.AddFinalCost(collocation.time())
    share = np.linspace(0.0, 1.0, 11)
    q = share[:, np.newaxis] ** 2 * (3.0 - 2.0 * share[:, np.newaxis]) * end
    for k in range(11):
        prog.SetInitialGuess(collocation.state(k)[:6], q[k])
    result = SnoptSolver().Solve(prog)
    assert result.is_success()
    states, inputs = collocation.GetStateSamples(result).T, collocation.GetInputSamples(result).T
    x = np.hstack([states, inputs])
    assert keeps([feasible], x)
    assert keeps([rates], states)
    assert np.min(feasible.evaluate(x)[0]) < 0.05  # the time rests on the tensions
    X = pose_from_row(here.points(x[-1:])[0][0, :7])
    np.testing.assert_allclose(X.translation(), goal.translation(), atol=1e-6)
