"""A robot that moves as others meet it: what it sweeps, against samples and Drake's distances."""

import numpy as np
import pytest
from pydrake.geometry import (
    Box,
    Capsule,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
)
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from cdpr_drake.analyses.workspaces.workspace_question import interference_bodies
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.convex_shapes import ConvexShape
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from cdpr_drake.trajectories.sampled_motion import sampled_motion
from cdpr_drake.workspaces.moving_clearances import moving_clearances
from cdpr_drake.workspaces.moving_robots import MovingRobot, PlannedMotion

ROUNDING = 1e-9
DRAKE = 1e-4  # by which Drake's iterations stop above a distance that two points attain [m]
X_FW = RigidTransform(RollPitchYaw(0.0, 0.0, 0.4), [0.1, -0.2, -0.5])


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
    around = interference_bodies(robot, pulleys=True)
    return MovingRobot(around, PlannedMotion(motion, X_FW), "it", beams=False)


def test_what_a_robot_sweeps_holds_its_platform_and_cables(other):
    random = np.random.default_rng(0)
    for width in (0.0, 0.1, 0.6, 5.0):
        for first in random.uniform(-0.2, 3.6, 3):
            swept = other.swept(first, first + width)
            for time in np.linspace(first, first + width, 40):
                for part, whole in zip(other.at(float(time)), swept, strict=True):
                    hull = ConvexShape(whole.points)
                    for point in part.points:
                        gap, *_ = ConvexShape(point[np.newaxis]).distance(hull)
                        assert gap + part.radius <= whole.radius + ROUNDING


def test_a_span_without_what_it_is_off_is_too_small(other):
    points = other.around.platform_shapes()[0].points
    span, off = other.motion.span(0.5, 3.0, points)
    worst = 0.0
    hull = ConvexShape(np.concatenate([(X @ points.T).T for X in span.poses]))
    for time in np.linspace(0.5, 3.0, 60):
        for point in (other.motion.at(time) @ points.T).T:
            worst = max(worst, ConvexShape(point[np.newaxis]).distance(hull)[0])
    assert 1e-4 < worst <= off


def test_its_beams_stand_where_its_frame_is(other):
    there = MovingRobot(other.around, other.motion, "it")
    assert len(there.at(0.0)) == len(other.at(0.0)) + len(other.around.fixtures)
    first, last = there.at(0.0)[-1], there.swept(0.0, 9.0)[-1]
    np.testing.assert_allclose(first.points, last.points)
    assert other.settled() == pytest.approx(3.5)


def test_distances_of_two_robots_are_those_of_drake(other):
    robot = load_robot("acrobot_large")
    around = interference_bodies(robot, pulleys=True)
    random = np.random.default_rng(1)
    gaps, drakes = [], []
    for _ in range(12):
        time = float(random.uniform(0.0, 3.5))
        X = RigidTransform([*random.uniform(-0.2, 0.2, 2), random.uniform(0.1, 0.5)])
        found = moving_clearances(
            around, [other], np.array([time]), X.translation()[np.newaxis],
            X.rotation().matrix()[np.newaxis],
        )  # fmt: skip
        gaps.append(found[0, 0])
        drakes.append(drake_distances(around, X, other.at(time)))
    apart = np.array(drakes) > 0.0
    np.testing.assert_allclose(np.array(gaps)[apart], np.array(drakes)[apart], atol=DRAKE)
    assert np.all(np.array(gaps)[apart] <= np.array(drakes)[apart] + ROUNDING)
    assert np.all(np.array(gaps)[~apart] <= DRAKE)
    assert np.any(apart)


def drake_distances(around, X, shapes):
    """Least distance of cables, and of the platform, from shapes by Drake's query [m]."""
    scene = SceneGraph()
    source = scene.RegisterSource("robot")
    frame = scene.RegisterFrame(source, GeometryFrame("robot"))
    row = around.bodies[0]
    body = scene.RegisterGeometry(source, frame, GeometryInstance(
        X @ RigidTransform(row[9:12]), Box(*(2.0 * row[12:])), "platform"
    ))  # fmt: skip
    run = cable_paths(X, around.cables)
    cables = [
        scene.RegisterGeometry(source, frame, capsule(
            run.p_WT[:, k], run.p_WT[:, k] + run.free[k] * run.u_W[:, k], around.radius[k], f"c{k}"
        ))
        for k in range(len(around.radius))
    ]  # fmt: skip
    others = []
    for k, shape in enumerate(shapes):
        if len(shape.points) == 2:
            solid = capsule(*shape.points, shape.radius, f"o{k}")
        else:  # a box: its corners go through the signs of its axes in order
            P = shape.points
            edges = [P[4] - P[0], P[2] - P[0], P[1] - P[0]]
            sizes = [float(np.linalg.norm(edge)) for edge in edges]
            R = RotationMatrix(np.column_stack([e / s for e, s in zip(edges, sizes, strict=True)]))
            solid = GeometryInstance(RigidTransform(R, P.mean(axis=0)), Box(*sizes), f"o{k}")
        others.append(scene.RegisterAnchoredGeometry(source, solid))
    for one in (body, *cables, *others):
        scene.AssignRole(source, one, ProximityProperties())
    context, poses = scene.CreateDefaultContext(), FramePoseVector()
    poses.set_value(frame, RigidTransform())
    scene.get_source_pose_port(source).FixValue(context, poses)
    query = scene.get_query_output_port().Eval(context)

    def least(mine):
        return min(
            query.ComputeSignedDistancePairClosestPoints(a, b).distance
            for a in mine
            for b in others
        )

    return least(cables), least([body])


def capsule(start, end, radius, name):
    R = RotationMatrix.MakeFromOneVector(end - start, 2)
    shape = Capsule(float(radius), float(np.linalg.norm(end - start)))
    return GeometryInstance(RigidTransform(R, 0.5 * (start + end)), shape, name)
