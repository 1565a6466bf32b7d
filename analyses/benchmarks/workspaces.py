"""Benchmarks of workspaces: poses against scipy's linear programs, Qhull and Drake's distances."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numba
import numpy as np
from pydrake.geometry import Box, Capsule
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.framework import DiagramBuilder
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from cdpr_drake.analyses.reporting.timing import (
    TimingRow,
    interleaved,
    seconds_each,
    seconds_per_call,
)
from cdpr_drake.analyses.workspaces.robot_conditions import static_case
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.convex_distance_kernel import convex_distance, convex_work
from cdpr_drake.geometry.convex_shapes import ConvexShape
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.workspaces.box_judges import CertifiedKind, CertifyTask, judge_all
from cdpr_drake.workspaces.cable_interference import Surroundings, box_row, clearances
from cdpr_drake.workspaces.certified_boxes import PoseBox, certify
from cdpr_drake.workspaces.demanded_wrenches import weight_wrenches
from cdpr_drake.workspaces.hull import workspace_hull
from cdpr_drake.workspaces.pose_grid import grid_by_count
from cdpr_drake.workspaces.static_feasibility import StaticCase, statically_feasible
from cdpr_drake.workspaces.wrench_capacity import capacity_margins, scaled_matrices

ROBOT = "acrobot_large"

RADIUS = 1e-3
"""Of Drake's capsules [m]."""


def workspace_rows(quick: bool) -> list[TimingRow]:
    """All rows of this file; `quick` times fewer poses."""
    repeats = 3 if quick else 7
    return [
        static_row(50 if quick else 300, repeats),
        margin_row(5 if quick else 30, repeats),
        clearance_row(50 if quick else 300, repeats),
        convex_row(50 if quick else 300, repeats),
        collision_row(2000 if quick else 20_000, repeats),
        hull_row(300 if quick else 10_000, 3),
    ]


def _poses(count: int) -> tuple[StaticCase, Array, Array]:
    robot = load_robot(ROBOT)
    random = np.random.default_rng(0)
    positions = random.uniform(robot.frame.lower, robot.frame.upper, (count, 3))
    return static_case(robot, pulleys=False), positions, np.tile(np.eye(3), (count, 1, 1))


def _each(call: Callable[[], object], count: int) -> float:
    """Time of a call on one core for each of `count` poses [us]."""
    before = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        return 1e6 * seconds_per_call(call, 3) / count
    finally:
        numba.set_num_threads(before)


def static_row(count: int, repeats: int) -> TimingRow:
    """Static feasibility of a sweep against scipy's linear program (HiGHS) at each pose."""
    case, positions, rotations = _poses(count)
    W = scaled_matrices(case, positions, rotations)
    loads = -weight_wrenches(case, rotations)[:, list(case.rows)] / case.row_scale()
    bounds = list(zip(case.lower, case.upper, strict=True))
    zero = np.zeros(case.cables.count)
    many = np.tile(positions, (50, 1)), np.tile(rotations, (50, 1, 1))
    ours, other = interleaved(
        [
            lambda: _each(lambda: statically_feasible(case, *many), len(many[0])),
            lambda: (
                1e6
                * seconds_each(
                    range(count),
                    lambda k: linprog(zero, A_eq=W[k], b_eq=loads[k], bounds=bounds),
                )
            ),
        ],
        repeats,
    )
    return _row("static feasibility, a pose of a sweep", ours, "scipy linprog, HiGHS", other)


def margin_row(count: int, repeats: int) -> TimingRow:
    """The capacity margin against the hull of all corners by Qhull."""
    case, positions, rotations = _poses(count)
    W = scaled_matrices(case, positions, rotations)
    corners = np.array(list(product(*zip(case.lower, case.upper, strict=True))))
    many = np.tile(positions, (20, 1)), np.tile(rotations, (20, 1, 1))
    ours, other = interleaved(
        [
            lambda: _each(lambda: capacity_margins(case, *many), len(many[0])),
            lambda: 1e6 * seconds_each(range(count), lambda k: ConvexHull(corners @ W[k].T)),
        ],
        repeats,
    )
    return _row("capacity margin, a pose of a sweep", ours, "Qhull on the zonotope", other)


def clearance_row(count: int, repeats: int) -> TimingRow:
    """Cables and platform against Drake's queries of capsules and a box; 28 and 8 pairs."""
    robot = load_robot(ROBOT)
    case, positions, rotations = _poses(count)
    body = box_row(np.array([0.0, 0.0, robot.platform.size[2] / 2.0]), robot.platform.size)
    m = case.cables.count
    around = Surroundings(case.cables, np.full(m, RADIUS), body[np.newaxis])
    scenes = [_scene(case, p, robot.platform.size) for p in positions]
    many = np.tile(positions, (20, 1)), np.tile(rotations, (20, 1, 1))
    ours, other = interleaved(
        [
            lambda: _each(lambda: clearances(around, *many), len(many[0])),
            lambda: 1e6 * seconds_each(scenes, lambda scene: scene()),
        ],
        repeats,
    )
    return _row("clearances of 8 cables and a box", ours, "Drake's distance queries", other)


def _scene(case: StaticCase, position: Array, size: Array) -> Callable[[], object]:
    """Drake's distances of all pairs at one position; a query each, poses set before."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    box = _floating(plant, "box", Box(*size))
    anchors = position[:, np.newaxis] + case.cables.p_PB
    bodies = []
    for i, (A, B) in enumerate(zip(case.cables.p_WA.T, anchors.T, strict=True)):
        body = _floating(plant, f"cable{i}", Capsule(RADIUS, float(np.linalg.norm(B - A))))
        bodies.append((body, A, B))
    plant.Finalize()
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    context = plant.GetMyMutableContextFromRoot(root)
    plant.SetFreeBodyPose(
        context, box, RigidTransform(position + np.array([0.0, 0.0, size[2] / 2.0]))
    )
    for body, A, B in bodies:
        turn = RotationMatrix.MakeFromOneVector(B - A, 2)
        plant.SetFreeBodyPose(context, body, RigidTransform(turn, 0.5 * (A + B)))
    query = plant.get_geometry_query_input_port().Eval(context)

    def distances(owner: object = (diagram, root)) -> object:
        """A query lives no longer than its diagram and context, which are kept here."""
        return query.ComputeSignedDistancePairwiseClosestPoints()

    return distances


def _floating(plant: MultibodyPlant, name: str, shape: object) -> object:
    body = plant.AddRigidBody(name, SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    friction = CoulombFriction(0.5, 0.5)
    plant.RegisterCollisionGeometry(body, RigidTransform(), shape, name, friction)
    return body


def convex_row(count: int, repeats: int) -> TimingRow:
    """Signed distance of two turned boxes, as hulls of points, against Drake's query."""
    random = np.random.default_rng(0)
    size = np.array([0.4, 0.3, 0.2])
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    bodies = [_floating(plant, name, Box(*size)) for name in ("one", "other")]
    plant.Finalize()
    root = (diagram := builder.Build()).CreateDefaultContext()
    context = plant.GetMyMutableContextFromRoot(root)
    turn = RotationMatrix.MakeFromOneVector(random.normal(size=3), 2)
    X = RigidTransform(turn, [0.5, 0.1, 0.1])
    plant.SetFreeBodyPose(context, bodies[1], X)
    query = plant.get_geometry_query_input_port().Eval(context)
    one = ConvexShape.box_at(np.zeros(3), size)
    other, work = one.moved(X), convex_work(8, 8)
    p, q, n = np.empty((3, 3))

    def distances(owner: object = diagram) -> object:
        """A query lives no longer than its diagram, which is kept here."""
        return query.ComputeSignedDistancePairwiseClosestPoints()

    ours, theirs = interleaved(
        [
            lambda: 1e6 * seconds_each(
                range(count), lambda k: convex_distance(one.points, other.points, p, q, n, work)
            ),
            lambda: 1e6 * seconds_each(range(count), lambda k: distances()),
        ],
        repeats,
    )  # fmt: skip
    return _row("signed distance of two boxes", ours, "Drake's distance query", theirs)


def collision_row(count: int, repeats: int) -> TimingRow:
    """A box of poses judged for collisions, against the exact check of its 16 corners."""
    robot = load_robot(ROBOT)
    case, _, _ = _poses(1)
    body = box_row(np.array([0.0, 0.0, robot.platform.size[2] / 2.0]), robot.platform.size)
    solids = (ConvexShape.sphere(np.array([0.2, 0.2, 0.5]), 0.08),)
    around = Surroundings(
        case.cables, np.full(case.cables.count, RADIUS), body[np.newaxis], solids=solids,
        obstacles=box_row(np.array([0.0, 0.0, 0.2]), np.array([0.1, 0.1, 0.4]))[np.newaxis],
    )  # fmt: skip
    task = CertifyTask(CertifiedKind.COLLISION_FREE, case, around=around)
    turn = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.17])
    lower, upper = robot.reach()
    box = PoseBox(np.concatenate([lower, -turn[3:]]), np.concatenate([upper, turn[3:]]))
    found = certify(task, box, count)
    poses, halves = found.poses[:count], found.halves[:count]
    random = np.random.default_rng(0)
    corners = np.repeat(poses, 16, axis=0)
    corners = corners + random.choice([-1.0, 1.0], corners.shape) * np.repeat(halves, 16, axis=0)
    turns = np.array([RotationMatrix.MakeZRotation(angle).matrix() for angle in corners[:, 5]])
    kept = np.zeros(len(poses), np.int8)
    ours, other = interleaved(
        [
            lambda: _each(lambda: judge_all([task], poses, halves, kept), len(poses)),
            lambda: _each(lambda: clearances(around, corners[:, :3], turns), len(poses)),
        ],
        repeats,
    )
    return _row("a box of poses, free of collisions", ours, "exact at 16 of its corners", other)


def hull_row(rays: int, repeats: int) -> TimingRow:
    """A hull against a grid whose volume is as wrong, by its own error estimate."""
    robot = load_robot(ROBOT)
    case, _, _ = _poses(1)
    lower, upper, center = robot.frame.lower, robot.frame.upper, robot.home.position

    def holds(points: Array) -> np.ndarray:
        return statically_feasible(case, points, np.tile(np.eye(3), (len(points), 1, 1)))

    def hull(count: int) -> float:
        return workspace_hull(holds, center, lower, upper, rays=count, tolerance=1e-4).volume

    def grid(count: int) -> float:
        """The volume by cells' middles, whose error is that of counting."""
        edge = (upper - lower) / count
        axes = grid_by_count(lower + edge / 2.0, upper - edge / 2.0, (count,) * 3)
        return float(np.mean(holds(axes.positions()))) * float(np.prod(upper - lower))

    truth = hull(4 * rays)
    error = abs(hull(rays) - truth)
    count = 10
    while abs(grid(count) - truth) > error and count < 160:
        count = int(1.3 * count)
    ours, other = interleaved(
        [
            lambda: 1e6 * seconds_per_call(lambda: hull(rays), 1),
            lambda: 1e6 * seconds_per_call(lambda: grid(count), 1),
        ],
        repeats,
    )
    return _row(f"hull of {rays} rays", ours, f"grid of {count}^3 points, as wrong", other)


def _row(name: str, ours: float, baseline: str, other: float) -> TimingRow:
    return TimingRow(name, ours, "us", baseline, other, other / ours, ratio_means="times faster")
