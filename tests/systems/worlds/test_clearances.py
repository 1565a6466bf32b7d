"""Distances of platform and cables from bodies, against closed forms and many points."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_in_plant import platform_box
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.worlds.clearances import WorldClearances
from cdpr_drake.systems.worlds.settings import ObstacleMotion
from cdpr_drake.systems.worlds.world import make_world
from cdpr_drake.workspaces.cable_distance_kernel import boxes_distance
from cdpr_drake.workspaces.cable_interference import box_row
from tests.systems.worlds.world_bench import obstacle, world_of

CLOSEST = 2e-6
"""Of distances of boxes by Drake, whose iterations end there [m]."""

SAMPLED = 2e-5
"""Of the nearest of many points on a cable [m], which are 0.1 mm apart."""

X_WP = RigidTransform(RollPitchYaw(0.2, -0.3, 0.5), [0.05, -0.02, 0.5])


@pytest.fixture(scope="module")
def robot():
    return load_robot("acrobot_large")


def measured(robot, *obstacles, ground=None, time=0.0, X_WP=X_WP):
    world = make_world(world_of(*obstacles, ground=ground), robot)
    clearances = WorldClearances(robot, world, robot.cable_set())
    return clearances.platform(X_WP, time), clearances.cables(X_WP, time)


def platform_row(robot, X_WP):
    X_PBox, box = platform_box(robot)
    X = X_WP @ X_PBox
    return box_row(X.translation(), box.size(), X.rotation().matrix())


def test_boxes_are_as_far_as_the_exact_kernel_says(robot):
    draws = np.random.default_rng(1)
    for _ in range(5):
        size, angles = draws.uniform(0.05, 0.3, 3), draws.uniform(-180.0, 180.0, 3)
        place = X_WP.translation() + draws.uniform(0.2, 0.4, 3) * draws.choice([-1, 1], 3)
        box = obstacle("box", "box", place, angles, size=size)
        (gap,), _ = measured(robot, box)
        X_WB = box.pose.transform()
        row = box_row(X_WB.translation(), size, X_WB.rotation().matrix())
        exact = boxes_distance(platform_row(robot, X_WP), row, np.empty((2, 3)))
        assert gap == pytest.approx(exact, abs=CLOSEST)


def test_a_sphere_is_as_far_as_its_centre_from_the_box_less_its_radius(robot):
    ball = obstacle("ball", "sphere", (0.3, 0.2, 0.6), radius=0.07)
    (gap,), _ = measured(robot, ball)
    X_PBox, box = platform_box(robot)
    p = (X_WP @ X_PBox).inverse() @ np.array([0.3, 0.2, 0.6])
    over = np.maximum(np.abs(p) - 0.5 * box.size(), 0.0)
    assert gap == pytest.approx(np.linalg.norm(over) - 0.07, abs=CLOSEST)


def test_the_ground_is_as_far_as_the_lowest_corner(robot):
    (gap,), (cables,) = measured(robot, ground=-0.1)
    row = platform_row(robot, X_WP)
    R = row[:9].reshape(3, 3)
    lowest = row[11] - np.sum(np.abs(R[2]) * row[12:])
    assert gap == pytest.approx(lowest + 0.1, abs=1e-12)
    ends = (X_WP @ robot.cable_set().p_PB)[2]
    assert cables == pytest.approx(np.min(ends) + 0.1 - 0.001, abs=1e-12)


def test_overlap_is_negative_and_a_body_that_moves_is_where_it_is_then(robot):
    motion = ObstacleMotion(velocity=np.array([0.0, 0.0, -0.1]))
    ball = obstacle("ball", "sphere", (0.05, -0.02, 1.0), radius=0.1, motion=motion)
    (early,), _ = measured(robot, ball, time=0.0)
    (late,), _ = measured(robot, ball, time=4.0)
    assert early > 0.0 > late


@pytest.mark.parametrize(
    ("kind", "rest"),
    [
        ("box", {"size": np.array([0.1, 0.2, 0.05])}),
        ("sphere", {"radius": 0.06}),
        ("cylinder", {"radius": 0.04, "length": 0.3}),
    ],
)
def test_cables_are_as_far_as_the_nearest_of_many_points_on_them(robot, kind, rest):
    body = obstacle("body", kind, (0.35, -0.3, 0.8), (20.0, 30.0, -50.0), **rest)
    _, (gap,) = measured(robot, body)
    X_WB = body.pose.transform()
    starts = cable_paths(X_WP, robot.cable_set()).p_WT
    ends = X_WP @ robot.cable_set().p_PB
    share = np.linspace(0.0, 1.0, 10_001)
    points = starts[:, :, None] + (ends - starts)[:, :, None] * share
    x, y, z = np.abs(X_WB.inverse() @ points.reshape(3, -1))
    if kind == "box":
        over = np.maximum(np.array([x, y, z]) - 0.5 * rest["size"][:, None], 0.0)
        least = np.min(np.linalg.norm(over, axis=0))
    elif kind == "sphere":
        least = max(np.min(np.sqrt(x * x + y * y + z * z)) - rest["radius"], 0.0)
    else:
        side = np.maximum(np.hypot(x, y) - rest["radius"], 0.0)
        least = np.min(np.hypot(side, np.maximum(z - 0.5 * rest["length"], 0.0)))
    assert gap == pytest.approx(least - 0.5 * robot.cable.diameter, abs=SAMPLED)


def test_a_cable_passes_through_an_obstacle_and_the_clearance_tells(robot):
    anchor = X_WP @ robot.cable_set().p_PB[:, 0]
    middle = 0.5 * (robot.cable_set().p_WA[:, 0] + anchor)
    for kind, rest in (("sphere", {"radius": 0.05}), ("cylinder", {"radius": 0.05, "length": 0.1})):
        _, (gap,) = measured(robot, obstacle("body", kind, middle, **rest))
        assert gap == pytest.approx(-0.5 * robot.cable.diameter)
