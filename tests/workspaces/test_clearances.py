"""Distances of cables, platforms and what moves: Drake's queries, fine samples, closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.geometry import Box, Capsule
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from scipy.optimize import lsq_linear
from scipy.spatial import KDTree

from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.analyses.workspaces.robot_conditions import interference_bodies
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.convex_shapes import ConvexShape
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.proofs.moving_clearances import moving_clearances
from cdpr_drake.proofs.timed_cells import PoseRaster, clear_cells
from cdpr_drake.proofs.timed_ways import earliest_way
from cdpr_drake.systems.worlds.motions import JointedBody, PathBody, SteadyBody
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from cdpr_drake.trajectories.sampled_motion import sampled_motion
from cdpr_drake.workspaces.cable_distance_kernel import (
    boxes_distance,
    segment_box_distance,
    segments_distance,
)
from cdpr_drake.workspaces.cable_interference import (
    Obstacles,
    Surroundings,
    beams,
    box_row,
    clearances,
)
from cdpr_drake.workspaces.moving_robots import MovingRobot, PlannedMotion
from cdpr_drake.workspaces.moving_shapes import MovingShape
from tests.workspaces.workspace_cases import (
    DrakeScene,
    box,
    capsule,
    instance,
    random_poses,
    random_rotation,
    robot_case,
    upright,
)

ROUNDING = 1e-12
DRAKE = 1e-6  # Drake's distances of boxes (FCL's iterations) are good to this [m]
CAPSULE = 1e-4  # those of capsules are too large by up to this: FCL stops at two points [m]
THIN = 1e-3  # radius of Drake's capsules, which may not be 0 [m]

# Pairs.


@pytest.mark.parametrize("kinds", ["segments", "segment and box", "boxes"])
def test_distances_of_pairs_are_those_of_drake(kinds):
    random = np.random.default_rng(len(kinds))
    lengths, sizes = (1.3, 0.8), np.array([[0.5, 0.3, 0.8], [0.2, 0.9, 0.4]])
    rods = kinds.count("segment") if kinds != "segments" else 2
    shapes = [
        Capsule(THIN, length) if k < rods else Box(*size)
        for k, (length, size) in enumerate(zip(lengths, sizes, strict=True))
    ]
    first, second = (instance(shape, RigidTransform(), "it") for shape in shapes)
    scene, apart, work = DrakeScene([first], [second]), 0, np.empty((2, 3))
    for _ in range(200):
        R = [random_rotation(random) for _ in range(2)]
        p = random.uniform(-0.6, 0.6, (2, 3))
        X_one, X_other = (RigidTransform(RotationMatrix(R[k]), p[k]) for k in range(2))
        theirs = scene.distances(X_other.inverse() @ X_one)[0, 0] + rods * THIN
        axes = [0.5 * length * turn[:, 2] for length, turn in zip(lengths, R, strict=True)]
        ends = [(at - axis, at + axis) for at, axis in zip(p, axes, strict=True)]
        rows = [box_row(*parts) for parts in zip(p, sizes, R, strict=True)]
        if rods == 2:
            ours = segments_distance(*ends[0], *ends[1])
        elif rods == 1:
            ours = segment_box_distance(*ends[0], rows[1])
        else:
            ours = boxes_distance(*rows, work)
        if theirs > rods * THIN:  # below it the capsules overlap, and FCL gives a depth
            assert theirs - (CAPSULE if rods else DRAKE) < ours < theirs + DRAKE
            apart += 1
        elif rods < 2:
            assert ours <= rods * (THIN + DRAKE)
    assert 30 < apart < (200 if rods < 2 else 201)


@pytest.mark.parametrize(
    ("segments", "distance"),
    [
        ([[0, 0, 0], [1, 0, 0], [0.5, 1, 1], [0.5, -1, 1]], 1.0),  # crossing
        ([[0, 0, 0], [1, 0, 0], [0, 0, 2], [1, 0, 2]], 2.0),  # parallel
        ([[0, 0, 0], [1, 0, 0], [3, 0, 0], [2, 0, 0]], 1.0),  # in one line
        ([[0, 0, 0], [0, 0, 0], [3, 4, 0], [3, 4, 0]], 5.0),  # points
        ([[0, 0, 0], [2, 0, 0], [1, 0, 0], [1, 0, 0]], 0.0),
    ],
)
def test_segments_of_every_kind(segments, distance):
    p, q, r, s = np.array(segments, float)
    assert segments_distance(p, q, r, s) == pytest.approx(distance, abs=ROUNDING)
    assert segments_distance(s, r, q, p) == pytest.approx(distance, abs=ROUNDING)


@pytest.mark.parametrize(
    ("ends", "distance"),
    [
        ([[2, 0, 0], [3, 0, 0]], 1.0),
        ([[-5, 2, 0], [5, 2, 0]], 1.0),  # along a face
        ([[-5, 0.5, 0], [5, 0.5, 0]], 0.0),  # through
        ([[0.1, 0, 0], [0.2, 0, 0]], 0.0),  # within
        ([[2, 2, -5], [2, 2, 5]], np.sqrt(2)),  # past an edge
        ([[3, 0, 0], [0, 3, 0]], np.sqrt(0.5)),  # past an edge, slanting
        ([[2, 2, 2], [2, 2, 2]], np.sqrt(3)),
    ],
)
def test_segments_and_a_box_of_every_kind(ends, distance):
    cube = box_row(np.zeros(3), np.full(3, 2.0))
    p, q = np.array(ends, float)
    assert segment_box_distance(p, q, cube) == pytest.approx(distance, abs=ROUNDING)
    assert segment_box_distance(q, p, cube) == pytest.approx(distance, abs=ROUNDING)


# Cables and platform of a robot.


def acrobot(pulleys=False):
    robot, _ = robot_case("acrobot_large")
    size = robot.platform.size
    return robot, Surroundings(
        robot.cable_set(pulleys), np.full(8, 0.001), box_row([0, 0, size[2] / 2], size)[None],
        beams(robot.frame.lower, robot.frame.upper, robot.frame.beam),
        box_row([0.2, 0.1, 0.5], [0.1, 0.1, 0.1])[None], exit_free=0.02, anchor_free=0.05,
    )  # fmt: skip


@pytest.mark.parametrize("pulleys", [False, True])
def test_clearances_are_the_least_of_their_parts(pulleys):
    """Against points along the cables, which are never nearer than the truth."""
    robot, around = acrobot(pulleys)
    positions, rotations = random_poses(robot, 8, seed=1, turn=0.2)
    gaps = clearances(around, positions, rotations)
    shares = np.linspace(0, 1, 801)
    fine = 1.3 / 800  # between neighbours
    for k, (position, R) in enumerate(zip(positions, rotations, strict=True)):
        paths = cable_paths(RigidTransform(RotationMatrix(R), position), around.cables)
        B = (position[:, None] + R @ around.cables.p_PB).T
        A = B - (paths.u_W * paths.free).T if pulleys else around.cables.p_WA.T
        points = A[:, None] + shares[:, None] * (B - A)[:, None]  # (8, n, 3)
        trees = [KDTree(cable) for cable in points]
        near = min(trees[i].query(points[j])[0].min() for i in range(8) for j in range(i))
        assert near - 0.002 - fine <= gaps[k, 0] <= near - 0.002 + ROUNDING
        body = np.abs((points - position) @ R - [0, 0, 0.035])
        gap = np.linalg.norm(np.maximum(body - robot.platform.size / 2, 0.0), axis=2)
        gap[np.linalg.norm(points - B[:, None], axis=2) < 0.05] = np.inf
        assert abs(gaps[k, 1] - (gap.min() - 0.001)) < fine
        gap = np.min([
            np.linalg.norm(np.maximum(np.abs(points - row[9:12]) - row[12:], 0.0), axis=2)
            for row in around.fixtures
        ], axis=0)  # fmt: skip
        gap[np.linalg.norm(points - A[:, None], axis=2) < 0.02] = np.inf
        assert abs(gaps[k, 2] - (gap.min() - 0.001)) < fine


def test_cables_that_share_a_point_are_not_compared():
    _, around = acrobot()
    assert len(around.pairs()) == 28
    p_WA = around.cables.p_WA.copy()
    p_WA[:, 1] = p_WA[:, 0]
    joined = type(around.cables).make(p_WA, around.cables.p_PB, 1.0)
    assert len(Surroundings(joined, np.zeros(8)).pairs()) == 27


def test_nothing_to_meet_is_infinitely_far_and_what_overlaps_has_no_clearance():
    robot, around = acrobot()
    alone = clearances(Surroundings(around.cables, around.radius), *random_poses(robot, 3))
    assert np.all(np.isfinite(alone[:, 0]))
    assert np.all(np.isinf(alone[:, 1:]))
    in_frame = clearances(around, [[0.0, 0.0, 0.6], robot.frame.upper], upright(2))
    assert in_frame[0, 4] > 0.0
    assert in_frame[1, 4] == 0.0


@pytest.mark.parametrize("pulleys", [False, True])
def test_boxes_as_convex_shapes_have_the_clearances_of_boxes(pulleys):
    robot, _ = robot_case("acrobot_large")
    turn = random_rotation(np.random.default_rng(1))
    rows = np.array(
        [box_row([0.2, 0.1, 0.4], [0.3, 0.2, 0.2], turn), box_row([0, 0, 0], [1, 1, 0.1])]
    )
    boxes = interference_bodies(robot, rows, pulleys=pulleys)
    solids = tuple(ConvexShape.box(row) for row in rows)
    shapes = interference_bodies(robot, Obstacles(solids=solids), pulleys=pulleys)
    assert "solids" not in plain(boxes)
    assert [solid["radius"] for solid in plain(shapes)["solids"]] == [0.0, 0.0]
    poses = random_poses(robot, 500)
    one, other = clearances(boxes, *poses), clearances(shapes, *poses)
    assert other[:, :3] == pytest.approx(one[:, :3], abs=0.0, nan_ok=True)
    radius = boxes.radius[0]
    assert np.maximum(other[:, 3], -radius) == pytest.approx(one[:, 3], abs=ROUNDING, nan_ok=True)
    assert np.maximum(other[:, 4], 0.0) == pytest.approx(one[:, 4], abs=ROUNDING, nan_ok=True)
    assert np.any(other[:, 3] < -radius)  # signed: deeper than the cable is thick
    assert np.any(other[:, 4] < 0.0)


# Another robot that moves.


@pytest.fixture(scope="module")
def other():
    """A robot that moves and turns, 0.5 m below."""
    robot = load_robot("acrobot_large")
    poses = (
        RigidTransform([0.2, 0.0, 0.2]),
        RigidTransform(RollPitchYaw(0.1, -0.1, 0.2), [0.0, 0.15, 0.35]),
        RigidTransform([-0.2, 0.0, 0.2]),
    )
    path = PoseTrajectory(poses, (2.0, 1.5))
    times = np.linspace(0.0, path.end_time, 351)
    motion = sampled_motion(times, np.array([path.motion(t) for t in times]))
    X_FW = RigidTransform(RollPitchYaw(0.0, 0.0, 0.4), [0.1, -0.2, -0.5])
    around = interference_bodies(robot, pulleys=True)
    return MovingRobot(around, PlannedMotion(motion, X_FW), "it", beams=False)


@pytest.mark.parametrize("width", [0.0, 0.1, 0.6, 5.0])
def test_what_a_robot_sweeps_holds_its_platform_and_cables(other, width):
    for first in np.random.default_rng(0).uniform(-0.2, 3.6, 2):
        swept = other.swept(first, first + width)
        for time in np.linspace(first, first + width, 15):
            for part, whole in zip(other.at(float(time)), swept, strict=True):
                hull = ConvexShape(whole.points)
                for point in part.points:
                    gap, *_ = ConvexShape(point[np.newaxis]).distance(hull)
                    assert gap + part.radius <= whole.radius + 1e-9


def test_its_beams_stand_where_its_frame_is(other):
    there = MovingRobot(other.around, other.motion, "it")
    assert len(there.at(0.0)) == len(other.at(0.0)) + len(other.around.fixtures)
    first, last = there.at(0.0)[-1], there.swept(0.0, 9.0)[-1]
    np.testing.assert_allclose(first.points, last.points)
    assert other.settled() == pytest.approx(3.5)


def as_drake(shape, name):
    """A capsule, or a box whose corners go through the signs of its axes in order."""
    if len(shape.points) == 2:
        return capsule(*shape.points, shape.radius, name)
    P = shape.points
    edges = np.array([P[4] - P[0], P[2] - P[0], P[1] - P[0]])
    sizes = np.linalg.norm(edges, axis=1)
    return box(box_row(P.mean(axis=0), sizes, (edges / sizes[:, None]).T), name)


def test_distances_of_two_robots_are_those_of_drake(other):
    around = interference_bodies(load_robot("acrobot_large"), pulleys=True)
    random = np.random.default_rng(1)
    gaps, drakes = [], []
    for _ in range(12):
        time = float(random.uniform(0.0, 3.5))
        X = RigidTransform([*random.uniform(-0.2, 0.2, 2), random.uniform(0.1, 0.5)])
        place = X.translation()[np.newaxis], X.rotation().matrix()[np.newaxis]
        gaps.append(moving_clearances(around, [other], np.array([time]), *place)[0, 0])
        run = cable_paths(X, around.cables)
        ends = zip(run.p_WT.T, (run.p_WT + run.free * run.u_W).T, around.radius, strict=True)
        body = box(around.bodies[0])
        body.set_pose(X @ body.pose())
        mine = [*(capsule(*parts, f"c{k}") for k, parts in enumerate(ends)), body]
        shapes = [as_drake(shape, f"o{k}") for k, shape in enumerate(other.at(time))]
        theirs = DrakeScene(mine, shapes).distances(RigidTransform()).min(axis=1)
        drakes.append([theirs[:-1].min(), theirs[-1]])
    gaps, drakes = np.array(gaps), np.array(drakes)
    apart = drakes > 0.0
    np.testing.assert_allclose(gaps[apart], drakes[apart], atol=CAPSULE)
    assert np.all(gaps[apart] <= drakes[apart] + 1e-9)
    assert np.all(gaps[~apart] <= CAPSULE)
    assert np.any(apart)


# What moves and what it sweeps; cells of poses and time.

SWEPT = 1e-9
SHAPE = ConvexShape.box_at(np.array([0.1, 0.0, 0.05]), [0.2, 0.1, 0.3])


def random_pose(random):
    return RigidTransform(RollPitchYaw(random.uniform(-1.5, 1.5, 3)), random.uniform(-0.5, 0.5, 3))


def motions(seed):
    random = np.random.default_rng(seed)
    poses = [random_pose(random) for _ in range(4)]
    times = tuple(random.uniform(0.5, 3.0, 3))

    def joint(**more):
        return JointedBody(poses[0], *random.normal(size=(2, 3)), period=2.0, **more)

    return {
        "steady": SteadyBody(poses[0], *random.normal(size=(2, 3))),
        "line": SteadyBody(poses[0], random.normal(size=3), np.zeros(3)),
        "path": PathBody(PoseTrajectory(tuple(poses), times)),
        "round": PathBody(PoseTrajectory((*poses, poses[0]), (*times, 1.0)), repeat=True),
        "swings": joint(rate=0.3, amplitude=1.0),
        "turns": joint(rate=2.0, amplitude=0.1),
    }


def outside(swept, motion, first, last, count=60):
    """How far the shape sticks out of what is said that it sweeps [m]."""
    hull = ConvexShape(swept.points)
    gaps = [
        ConvexShape(point[np.newaxis], SHAPE.radius).distance(hull)[0]
        for t in np.linspace(first, last, count)
        for point in SHAPE.moved(motion.at(t)).points
    ]
    return max(gaps) + 2.0 * SHAPE.radius - swept.radius


@pytest.mark.parametrize("kind", ["steady", "line", "path", "round", "swings", "turns"])
@pytest.mark.parametrize("seed", [0, 1])
def test_what_is_swept_holds_the_shape_at_all_times(kind, seed):
    motion = motions(seed)[kind]
    for first in np.random.default_rng(seed).uniform(0.0, 7.0, 2):
        for width in (0.0, 0.05, 0.4, 3.0):
            swept = MovingShape(SHAPE, motion, "it").swept(first, first + width)[0]
            assert outside(swept, motion, first, first + width) <= SWEPT


def test_a_line_sweeps_a_hull_that_is_exact():
    motion = SteadyBody(RigidTransform(), np.array([1.0, 0.0, 0.0]), np.zeros(3))
    swept = MovingShape(SHAPE, motion).swept(0.0, 0.5)[0]
    assert swept.radius == 0.0
    np.testing.assert_allclose(np.ptp(swept.points, axis=0), [0.7, 0.1, 0.3])


def test_when_a_motion_rests():
    path = motions(0)["path"]
    before, after = (path.at(path.settled() + by) for by in (0.0, 5.0))
    np.testing.assert_allclose(before.GetAsMatrix4(), after.GetAsMatrix4(), atol=1e-12)
    assert np.isinf(motions(0)["steady"].settled())
    assert np.isinf(motions(0)["round"].settled())
    assert SteadyBody(RigidTransform(), np.zeros(3), np.zeros(3)).settled() == 0.0


@pytest.fixture(scope="module")
def timed():
    """Cells of a robot among a ball that comes by and a box that turns."""
    around = interference_bodies(load_robot("acrobot_large"), pulleys=True)
    size, shape = np.array([0.8, 0.8, 0.4]), (8, 8, 4)
    middle = np.array([0.0, 0.0, 0.4])
    raster = PoseRaster(
        middle - 0.5 * size, size / shape, np.arange(3), np.zeros(6), np.ones(shape, bool)
    )
    ends = (RigidTransform(middle - 0.6 * size), RigidTransform(middle + 0.6 * size))
    ball = PathBody(PoseTrajectory(ends, (4.0,)))
    spun = JointedBody(
        RigidTransform(middle + np.array([0.3 * size[0], 0, 0])), middle, [0, 0, 1.0], rate=0.8,
        amplitude=0.0, period=1.0,
    )  # fmt: skip
    things = (
        MovingShape(ConvexShape.sphere(np.zeros(3), 0.05), ball, "ball"),
        MovingShape(ConvexShape.box_at(np.zeros(3), 0.1 * size), spun, "box"),
    )
    return raster, around, things, clear_cells(raster, around, things, 0.01, 6.0, 16)


def gaps_in(timed, cells, which, count=800):
    """Exact clearances of the timed poses in some of the cells [m]."""
    raster, around, things, _ = timed
    random, chosen = np.random.default_rng(0), np.argwhere(which)
    picked = chosen[random.integers(len(chosen), size=count)]
    place = raster.lower + raster.width * (picked[:, :3] + random.uniform(0, 1, (count, 3)))
    times = cells.step * (picked[:, 3] + random.uniform(0, 1, count))
    R = np.tile(np.eye(3), (count, 1, 1, 1))
    return np.min(moving_clearances(around, things, times, place[:, np.newaxis], R), axis=(1, 2))


def test_clear_cells_are_clear_by_the_exact_checks(timed):
    cells = timed[-1]
    assert 0.05 < np.mean(cells.clear) < 0.95
    assert np.all(gaps_in(timed, cells, cells.clear) > 0.01)
    assert np.mean(gaps_in(timed, cells, ~cells.clear) <= 0.01) > 0.2  # most are near something


def test_only_cells_of_the_raster_are_clear(timed):
    raster, around, things, cells = timed
    inside = np.zeros_like(raster.inside)
    inside[2:5, 1:3, 2] = True
    some = clear_cells(replace(raster, inside=inside), around, things, 0.01, 6.0, 16)
    np.testing.assert_array_equal(some.clear, cells.clear & inside[..., np.newaxis])


def flooded(clear, start, goal):
    """First interval in which moves that take no time get from start to goal."""
    reached = np.zeros(clear.shape[:3], bool)
    reached[start] = True
    for k in range(clear.shape[3]):
        reached &= clear[..., k]
        before = None
        while not np.array_equal(before, reached):
            before = reached.copy()
            for axis in range(3):
                one, back = [slice(None)] * 3, [slice(None)] * 3
                one[axis], back[axis] = slice(1, None), slice(None, -1)
                reached[tuple(one)] |= before[tuple(back)]
                reached[tuple(back)] |= before[tuple(one)]
            reached &= clear[..., k]
        if reached[goal]:
            return float(k)
    return None


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_earliest_way_is_that_of_a_flood(timed, seed):
    start, goal = (0, 0, 0), (4, 3, 2)
    clear = np.random.default_rng(seed).uniform(size=(5, 4, 3, 12)) < 0.7
    clear[start] = clear[goal] = True
    way = earliest_way(replace(timed[-1], clear=clear, step=1.0), start, goal, np.zeros(3))
    assert way is not None
    assert way.times[-1] == flooded(clear, start, goal)
    for low, high in way.seeds():
        assert np.all(clear[tuple(slice(a, b) for a, b in zip(low, high, strict=True))])


def least_squares_clearances(around, position, rotation):
    """Clearances where nothing overlaps: bounded least squares of the nearest points (BVLS)."""
    starts = around.cables.p_WA.T
    ends = position + (rotation @ around.cables.p_PB).T
    units = (ends - starts) / np.linalg.norm(ends - starts, axis=1, keepdims=True)

    def distance(p, q, origin, edges, box):
        """Of a segment from the points origin + edges s, |s| <= box."""
        A, bounds = np.column_stack([q - p, -edges]), (np.append(0.0, -box), np.append(1.0, box))
        nearest = lsq_linear(A, origin - p, bounds, method="bvls", tol=1e-15)
        return np.linalg.norm(nearest.fun)

    def from_boxes(p, q, rows, R, origin):
        """Of segments from boxes, as far as they are compared at all."""
        return min(
            (
                distance(a, b, origin + R @ row[9:12], R @ row[:9].reshape(3, 3), row[12:]) - radius
                for a, b, unit, radius in zip(p, q, units, around.radius, strict=True)
                if (b - a) @ unit > 0.0
                for row in rows
            ),
            default=np.inf,
        )

    middles, halves = 0.5 * (starts + ends), 0.5 * (ends - starts)[:, :, np.newaxis]
    cables = min(
        distance(starts[i], ends[i], middles[j], halves[j], np.ones(1))
        - around.radius[i] - around.radius[j]
        for i, j in around.pairs()
    )  # fmt: skip
    to_platform = starts, ends - around.anchor_free * units, around.bodies, rotation, position
    to_frame = starts + around.exit_free * units, ends, around.fixtures, np.eye(3), np.zeros(3)
    return np.array([cables, from_boxes(*to_platform), from_boxes(*to_frame)])


@pytest.mark.parametrize("name", ["acrobot_large", "caroca"])
def test_clearances_in_the_frame_are_those_of_least_squares(name):
    """At pose 1992 a cable of CAROCA is shorter than a beam is thick: it is not compared."""
    robot = load_robot(name)
    around = interference_bodies(robot, pulleys=False)
    compared = 0
    for number in (*range(12), 1992):
        random = np.random.default_rng([20, number])
        position = random.uniform(robot.frame.lower, robot.frame.upper)
        rotation = rotation_from_angles(random.uniform(-0.3, 0.3, 3)).matrix()
        ours = clearances(around, position[None], rotation[None])[0, :3]
        theirs = least_squares_clearances(around, position, rotation)
        apart = theirs > 0.0
        np.testing.assert_allclose(ours[apart], theirs[apart], atol=1e-6)
        assert np.all(ours[~apart] <= 1e-6)
        compared += np.sum(apart)
    assert compared > 20
