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
from cdpr_drake.workspaces import moving_shapes
from cdpr_drake.workspaces.moving_clearances import moving_clearances
from cdpr_drake.workspaces.moving_shapes import MovingShape, PoseSpan, swept_shape
from cdpr_drake.workspaces.timed_cells import PoseRaster, clear_cells
from cdpr_drake.workspaces.timed_ways import earliest_way

ROUNDING = 1e-9
SHAPE = ConvexShape.box_at(np.array([0.1, 0.0, 0.05]), [0.2, 0.1, 0.3])


def random_pose(random, far=0.5):
    return RigidTransform(RollPitchYaw(random.uniform(-1.5, 1.5, 3)), random.uniform(-far, far, 3))


def motions(seed):
    random = np.random.default_rng(seed)
    poses = [random_pose(random) for _ in range(4)]
    times = tuple(random.uniform(0.5, 3.0, 3))
    path = PoseTrajectory(tuple(poses), times)
    back = PoseTrajectory((*poses, poses[0]), (*times, 1.0))
    return {
        "steady": SteadyBody(poses[0], random.normal(size=3), random.normal(size=3)),
        "line": SteadyBody(poses[0], random.normal(size=3), np.zeros(3)),
        "path": PathBody(path),
        "round": PathBody(back, repeat=True),
        "swings": JointedBody(poses[0], random.normal(size=3), random.normal(size=3),
                              rate=0.3, amplitude=1.0, period=2.0),
        "turns": JointedBody(poses[0], random.normal(size=3), random.normal(size=3),
                             rate=2.0, amplitude=0.1, period=2.0),
    }  # fmt: skip


def outside(swept, shape, motion, first, last, count=200):
    """How far what it sweeps sticks out of what is said of it [m]."""
    worst = -np.inf
    for t in np.linspace(first, last, count):
        for point in shape.moved(motion.at(t)).points:
            gap, *_ = ConvexShape(point[np.newaxis], shape.radius).distance(
                ConvexShape(swept.points)
            )
            worst = max(worst, gap + 2.0 * shape.radius - swept.radius)
    return worst


@pytest.mark.parametrize("kind", ["steady", "line", "path", "round", "swings", "turns"])
@pytest.mark.parametrize("seed", [0, 1])
def test_what_is_swept_holds_the_shape_at_all_times(kind, seed):
    motion = motions(seed)[kind]
    random = np.random.default_rng(seed)
    for first in random.uniform(0.0, 7.0, 4):
        for width in (0.0, 0.05, 0.4, 3.0):
            swept = MovingShape(SHAPE, motion, "it").swept(first, first + width)[0]
            assert outside(swept, SHAPE, motion, first, first + width) <= ROUNDING


def test_a_hull_without_its_bend_is_too_small():
    motion = motions(0)["turns"]
    span = motion.span(0.0, 0.4)
    assert span.bend > 0.0
    swept = swept_shape(SHAPE, PoseSpan((span.poses[0], span.poses[-1])))
    assert outside(swept, SHAPE, motion, 0.0, 0.4) > 1e-3


def test_a_line_sweeps_a_hull_that_is_exact():
    motion = SteadyBody(RigidTransform(), np.array([1.0, 0.0, 0.0]), np.zeros(3))
    swept = MovingShape(SHAPE, motion).swept(0.0, 0.5)[0]
    assert swept.radius == 0.0
    np.testing.assert_allclose(np.ptp(swept.points, axis=0), [0.7, 0.1, 0.3])


def test_when_something_rests():
    found = {name: motion.settled() for name, motion in motions(0).items()}
    before, after = (motions(0)["path"].at(found["path"] + by) for by in (0.0, 5.0))
    np.testing.assert_allclose(before.GetAsMatrix4(), after.GetAsMatrix4(), atol=1e-12)
    assert np.isinf(found["steady"])
    assert np.isinf(found["round"])
    assert SteadyBody(RigidTransform(), np.zeros(3), np.zeros(3)).settled() == 0.0


@pytest.fixture(scope="module")
def timed():
    """Cells of a robot among a ball that comes by and a box that turns."""
    robot = load_robot("acrobot_large")
    around = interference_bodies(robot, pulleys=True)
    size, shape = np.array([0.8, 0.8, 0.4]), (8, 8, 4)
    middle = np.array([0.0, 0.0, 0.4])
    raster = PoseRaster(
        middle - 0.5 * size, size / shape, np.arange(3), np.zeros(6), np.ones(shape, bool)
    )
    far = 0.6 * size
    ball = PathBody(PoseTrajectory(
        (RigidTransform(middle - far), RigidTransform(middle + far)), (4.0,)
    ))  # fmt: skip
    spun = JointedBody(
        RigidTransform(middle + np.array([0.3 * size[0], 0, 0])), middle, [0, 0, 1.0], rate=0.8,
        amplitude=0.0, period=1.0,
    )  # fmt: skip
    things = (
        MovingShape(ConvexShape.sphere(np.zeros(3), 0.05), ball, "ball"),
        MovingShape(ConvexShape.box_at(np.zeros(3), 0.1 * size), spun, "box"),
    )
    return raster, around, things, clear_cells(raster, around, things, 0.01, 6.0, 16)


def clearances_in_cells(raster, around, things, cells, which, seed=0, count=3000):
    random = np.random.default_rng(seed)
    chosen = np.argwhere(which)
    assert len(chosen)
    picked = chosen[random.integers(len(chosen), size=count)]
    place = raster.lower + raster.width * (picked[:, :3] + random.uniform(0, 1, (count, 3)))
    times = cells.step * (picked[:, 3] + random.uniform(0, 1, count))
    R = np.repeat(np.eye(3)[np.newaxis, np.newaxis], count, axis=0)
    return np.min(moving_clearances(around, things, times, place[:, np.newaxis], R), axis=(1, 2))


def test_clear_cells_are_clear_by_the_exact_checks(timed):
    raster, around, things, cells = timed
    assert 0.05 < np.mean(cells.clear) < 0.95  # something is clear, and something is not
    gaps = clearances_in_cells(raster, around, things, cells, cells.clear)
    assert np.all(gaps > 0.01)
    others = clearances_in_cells(raster, around, things, cells, ~cells.clear)
    assert np.mean(others <= 0.01) > 0.2  # most of what is not clear is near something


def test_cells_that_forget_the_motion_are_not_clear(timed, monkeypatch):
    """The same check is red where obstacles are taken as they are in the middle of an interval."""
    raster, around, things, _ = timed
    monkeypatch.setattr(
        moving_shapes.MovingShape, "swept",
        lambda self, first, last: self.at(0.5 * (first + last)),
    )  # fmt: skip
    wrong = clear_cells(raster, around, things, 0.01, 6.0, 16)
    monkeypatch.undo()
    gaps = clearances_in_cells(raster, around, things, wrong, wrong.clear)
    assert np.any(gaps <= 0.01)


def test_only_proven_cells_are_clear_and_rasters_are_joined(timed):
    raster, around, things, cells = timed
    inside = np.zeros_like(raster.inside)
    inside[2:5, 1:3, 2] = True
    some = clear_cells(replace(raster, inside=inside), around, things, 0.01, 6.0, 16)
    np.testing.assert_array_equal(some.clear, cells.clear & inside[..., np.newaxis])


def test_the_earliest_way_is_that_of_a_search_step_by_step(timed):
    _, _, _, cells = timed
    random = np.random.default_rng(1)
    clear = random.uniform(size=(5, 4, 3, 12)) < 0.7
    clear[0, 0, 0], clear[4, 3, 2] = True, True
    toy = replace(cells, clear=clear, step=1.0)
    way = earliest_way(toy, (0, 0, 0), (4, 3, 2), np.zeros(3))
    # with moves that take no time: what is reached in each interval, flooded
    reached = np.zeros(clear.shape[:3], bool)
    reached[0, 0, 0] = True
    arrival = None
    for k in range(clear.shape[3]):
        reached &= clear[..., k]
        for _ in range(60):
            grown = reached.copy()
            for axis in range(3):
                for side in (-1, 1):
                    moved = np.roll(reached, side, axis)
                    edge = [slice(None)] * 3
                    edge[axis] = 0 if side == 1 else -1
                    moved[tuple(edge)] = False
                    grown |= moved
            reached = grown & clear[..., k]
        if reached[4, 3, 2] and arrival is None:
            arrival = float(k)
    assert (way is None) == (arrival is None)
    assert way is not None
    assert way.times[-1] == arrival
    for low, high in way.seeds():
        assert np.all(clear[tuple(slice(a, b) for a, b in zip(low, high, strict=True))])
