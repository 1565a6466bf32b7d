"""What moves and what it sweeps, against samples; cells of poses and time against exact checks."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from cdpr_drake.analyses.workspaces.workspace_question import interference_bodies
from cdpr_drake.geometry.convex_shapes import ConvexShape
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.worlds.motions import JointedBody, PathBody, SteadyBody
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from cdpr_drake.workspaces.moving_clearances import moving_clearances
from cdpr_drake.workspaces.moving_shapes import MovingShape, PoseSpan, swept_shape
from cdpr_drake.workspaces.timed_cells import PoseRaster, clear_cells
from cdpr_drake.workspaces.timed_ways import earliest_way

ROUNDING = 1e-9
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
            assert outside(swept, motion, first, first + width) <= ROUNDING


def test_a_hull_without_its_bend_is_too_small():
    motion = motions(0)["turns"]
    span = motion.span(0.0, 0.4)
    assert span.bend > 0.0
    swept = swept_shape(SHAPE, PoseSpan((span.poses[0], span.poses[-1])))
    assert outside(swept, motion, 0.0, 0.4) > 1e-3


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


def gaps_in(timed, cells, which, count=2000):
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


def test_cells_that_forget_the_motion_are_not_clear(timed, monkeypatch):
    """The same check is red where obstacles are taken as they are in the middle of an interval."""
    monkeypatch.setattr(MovingShape, "swept", lambda self, a, b: self.at(0.5 * (a + b)))
    wrong = clear_cells(*timed[:3], 0.01, 6.0, 16)
    monkeypatch.undo()
    assert np.any(gaps_in(timed, wrong, wrong.clear) <= 0.01)


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
