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
from cdpr_drake.analyses.workspaces.static_feasible import static_case
from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.workspaces.cable_interference import Surroundings, box_row, clearances
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
        hull_row(300 if quick else 10_000, 3),
    ]


def _poses(count: int) -> tuple[StaticCase, Array, Array]:
    robot = load_robot(ROBOT)
    random = np.random.default_rng(0)
    positions = random.uniform(robot.frame.lower, robot.frame.upper, (count, 3))
    return static_case(robot), positions, np.tile(np.eye(3), (count, 1, 1))


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
