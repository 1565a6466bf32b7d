"""Time-optimal motions along paths: Drake's Toppra, a convex program, first principles."""

import re
from dataclasses import fields, replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.optimization import CalcGridPointsOptions, Toppra
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import PrismaticJoint, SpatialInertia
from pydrake.trajectories import PiecewisePolynomial

from cdpr_drake.analyses.planning.plan_tracking import track_plan
from cdpr_drake.analyses.planning.robot_path_task import (
    RESERVE,
    LimitSettings,
    make_path,
    path_task,
    robot_limits,
)
from cdpr_drake.analyses.studies.planning.convex_timing import convex_time
from cdpr_drake.control.task_space import TaskGains, computed_torque
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.cable_paths import cable_jacobian, cable_paths
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import PlatformDamping
from cdpr_drake.planning.failures import stuck
from cdpr_drake.planning.limits import MotionLimits
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.planning.path_timing import plan_along_path

BETWEEN = 2e-3  # of a limit, by which a plan may miss it between two of 500 stations
AGREEMENT = 0.01  # of the time, as the planner promises against a fine program
TOPPRA = 2e-3  # of the time: its constraints hold at stations, ours at both ends of each interval


def pose(*numbers):
    return pose_from_angles(np.array(numbers[:3]), np.radians(numbers[3:] or (0.0, 0.0, 0.0)))


PATHS = {
    "planar": (
        (1.0, 60.0),
        [pose(-0.1, 0.1, 0.3), pose(0.15, -0.1, 0.3, 0, 0, 10), pose(0.2, 0.1, 0.3)],
    ),
    "acrobot_large": (
        (1.0, 60.0),
        [pose(0, 0, 0.2), pose(0.15, -0.1, 0.4, 4, -3, 6), pose(-0.1, 0.1, 0.3)],
    ),
    "caroca": (
        (30.0, 1e4),
        [pose(0, 0, 1.0), pose(0.5, 0.8, 1.4, 4, -3, 6), pose(-0.3, 0.5, 1.2)],
    ),
}


@cache
def planned(name, corners="smooth"):
    robot = load_robot(name)
    limits, poses = PATHS[name]
    task = path_task(robot, LimitSettings(tensions=limits, reserve=RESERVE))
    return robot, plan_along_path(task, make_path(robot, poses, corners))


@pytest.mark.parametrize("name", PATHS)
def test_limits_are_kept_and_one_is_always_reached(name):
    _, plan = planned(name)
    uses = np.max(plan.samples().uses, axis=1)
    assert np.max(uses) <= 1.0 + BETWEEN
    # Instants within the interval of two stations in which it switches are the others.
    assert np.mean(uses >= 0.99) >= 0.97
    assert np.min(uses) > 0.9


@pytest.mark.parametrize(("name", "count"), [("planar", 150), ("caroca", 200)])
def test_the_time_is_that_of_a_convex_program(name, count):
    robot, plan = planned(name)
    reference = convex_time(robot, plan.task, plan.path, count)
    np.testing.assert_allclose(plan.duration, reference, rtol=AGREEMENT)


@pytest.mark.parametrize("name", PATHS)
def test_its_tensions_move_the_platform(name):
    """Along the motion itself: wrench by computed torque, lengths by differences."""
    _, plan = planned(name)
    motion, task = plan.trajectory, plan.task
    samples = plan.samples()
    h = 1e-5
    for k in np.linspace(20, len(samples.times) - 20, 5).astype(int):
        t = samples.times[k]
        X, V, A = motion.pose(t), motion.velocity(t), motion.acceleration(t)
        wanted = computed_torque(
            X, V, X, V, A, dynamics=task.dynamics, gains=TaskGains(stiffness=0.0, damping=0.0)
        )
        given = -cable_jacobian(X, task.cables).T @ samples.tensions[k]
        rows = list(task.dynamics.motions)
        np.testing.assert_allclose(given[rows], wanted[rows], atol=1e-7 * np.max(samples.tensions))
        before, here, after = (
            cable_paths(motion.pose(t + d), task.cables).lengths for d in (-h, 0.0, h)
        )
        np.testing.assert_allclose(samples.cable_speeds[k], (after - before) / (2.0 * h), atol=1e-4)
        if np.all(
            motion.acceleration(t - h) == pytest.approx(motion.acceleration(t + h), rel=1e-2)
        ):
            second = (after - 2.0 * here + before) / h**2
            np.testing.assert_allclose(samples.cable_accelerations[k], second, atol=0.02)


def toppra_time(plan, speed, acceleration):
    """Drake's Toppra on a plant whose joints are the cable lengths, on the same path."""
    task, stations = plan.task, plan.trajectory.stations
    lengths = np.array([cable_paths(plan.path.pose(s), task.cables).lengths for s in stations]).T
    path = PiecewisePolynomial.CubicWithContinuousSecondDerivatives(stations, lengths, False)
    plant = MultibodyPlant(0.0)
    for k in range(task.cables.count):
        body = plant.AddRigidBody(f"b{k}", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
        joint = PrismaticJoint(f"j{k}", plant.world_frame(), body.body_frame(), [1.0, 0.0, 0.0])
        plant.AddJoint(joint)
    plant.Finalize()
    points = Toppra.CalcGridPoints(path, CalcGridPointsOptions(max_err=1e-5))
    toppra = Toppra(path, plant, points)
    most = np.full(task.cables.count, 1.0)
    toppra.AddJointVelocityLimit(-speed * most, speed * most)
    toppra.AddJointAccelerationLimit(-acceleration * most, acceleration * most)
    return toppra.SolvePathParameterization().end_time()


def test_with_limits_of_winches_alone_it_agrees_with_drakes_toppra():
    robot = load_robot("acrobot_large")
    task = path_task(robot, LimitSettings(reserve=RESERVE))
    limits = MotionLimits(lower=0.0, upper=1e6, cable_speed=0.8, cable_acceleration=3.0)
    # Tensions without end: any wrench can be given by cables that pull from all sides.
    loose = load_robot("acrobot_fully_constrained")
    task = PathTask(loose.cable_set(), task.dynamics, limits)
    poses = [pose(0, 0, 0.4), pose(0.15, -0.1, 0.5, 4, -3, 6), pose(-0.1, 0.1, 0.45)]
    plan = plan_along_path(task, make_path(loose, poses, "smooth"), 1000)
    np.testing.assert_allclose(plan.duration, toppra_time(plan, 0.8, 3.0), rtol=TOPPRA)


def test_it_rests_in_corners_and_is_the_sum_of_its_legs():
    robot, plan = planned("planar", "rest")
    _, poses = PATHS["planar"]
    legs = [
        plan_along_path(plan.task, make_path(robot, list(pair), "smooth"))
        for pair in pairwise(poses)
    ]
    np.testing.assert_allclose(plan.duration, sum(leg.duration for leg in legs), rtol=1e-3)
    corner = plan.path.breaks[list(plan.path.rests)]
    x = plan.trajectory.squared_speeds[np.searchsorted(plan.trajectory.stations, corner)]
    np.testing.assert_array_equal(x, 0.0)


def test_faster_winches_never_make_it_slower():
    robot = load_robot("planar")
    _, poses = PATHS["planar"]
    path = make_path(robot, poses, "smooth")
    times = [
        plan_along_path(
            path_task(robot, LimitSettings(cable_speed=v, reserve=RESERVE)), path, 200
        ).duration
        for v in (0.3, 0.6, 1.2)
    ]
    assert times[0] > times[1] > times[2]


def test_a_pose_that_cannot_be_held_is_named_with_its_cables():
    robot = load_robot("acrobot_large")
    task = path_task(robot, LimitSettings(tensions=(5.0, 20.0), reserve=0.0))
    path = make_path(robot, [pose(0, 0, 0.2), pose(0.4, 0.4, 1.0)], "smooth")
    with pytest.raises(
        PlanningError, match=r"s = 0.9798 m of 0.9798 m, pose \(0.4, 0.4, 1\).*C2.*C3.*C6"
    ):
        plan_along_path(task, path)


def test_where_it_cannot_rest_the_motion_carries_it_through():
    """A turning point outside of where the platform can be held: not with a rest, nor slowly."""
    robot = load_robot("acrobot_large")
    poses = [pose(0, 0, 0.2), pose(0.5, 0.4, 0.6), pose(0, 0.1, 0.2)]
    given = LimitSettings(tensions=(1.0, 60.0), reserve=RESERVE)
    task = path_task(robot, given)
    plan = plan_along_path(task, make_path(robot, poses, "blend"))
    assert np.max(plan.reachable[:, 0]) > 0.1
    assert np.any(np.isnan(plan.largest))
    assert np.max(plan.samples().uses) <= 1.0 + BETWEEN
    assert track_plan(robot, plan, robot_limits(robot, given)).keeps_limits()
    with pytest.raises(PlanningError, match=r"pose \(0.5, 0.4, 0.6\).*cannot hold.*C1"):
        plan_along_path(task, make_path(robot, poses, "rest"))
    slow = path_task(robot, LimitSettings(tensions=(1.0, 60.0), speed=0.2, reserve=RESERVE))
    with pytest.raises(PlanningError, match=r"pose .*cannot hold.*C1"):
        plan_along_path(slow, make_path(robot, poses, "blend"))


@pytest.mark.parametrize(
    ("name", "count", "damping"),
    [
        ("planar", 600, (6.0, 0.2)),
        ("acrobot_large", 300, (20.0, 0.5)),
        ("caroca", 200, (2e3, 40.0)),
    ],
)
def test_the_damping_of_a_platform_is_planned_with(name, count, damping):
    """Against the convex program, which has it at the roots, and the simulated damped robot."""
    limits, poses = PATHS[name]
    given = LimitSettings(tensions=limits, reserve=RESERVE)
    robot, free = load_robot(name), planned(name)[1]
    robot.damping = PlatformDamping(translation=damping[0], rotation=damping[1])
    task = path_task(robot, given)
    plan = plan_along_path(task, make_path(robot, poses, "smooth"))
    assert plan.duration > (1.0005 if name == "planar" else 1.05) * free.duration
    assert np.max(plan.samples().uses) <= 1.0 + BETWEEN
    reference = convex_time(robot, task, plan.path, count)
    np.testing.assert_allclose(plan.duration, reference, rtol=AGREEMENT)
    tracked = track_plan(robot, plan, robot_limits(robot, given))
    assert tracked.keeps_limits()
    assert tracked.errors()[0] < 2e-3
    unplanned = replace(plan, task=task, trajectory=free.trajectory)
    assert np.max(unplanned.samples().uses) > 1.0 + BETWEEN


def test_what_stops_a_motion_between_two_points_is_named():
    _, plan = planned("planar")
    points = plan.path.points(np.array([0.1, 0.11]))
    stations, _ = plan.task.stations(points)
    places, goal = np.array([0.1, 0.11]), np.array([2.0, 3.0])
    words = stuck(plan.task, points, stations, places, 0.5, 1e-3, goal)
    assert re.search(r"s = 0.1 m of 0.5 m.*C\d needs (more|less) than its", words), words


def test_too_few_cables_and_wrong_limits_are_refused():
    robot = load_robot("acrobot_large")
    task = path_task(robot, LimitSettings(reserve=RESERVE))
    few = robot.cable_set()
    few = type(few)(**{f.name: np.asarray(getattr(few, f.name))[..., :5] for f in fields(few)})
    with pytest.raises(PlanningError, match="found 5 cables"):
        PathTask(few, task.dynamics, task.limits)
    for wrong in ({"lower": 5.0, "upper": 2.0}, {"lower": 0.0, "upper": np.inf},
                  {"lower": 0.0, "upper": 9.0, "cable_speed": 0.0},
                  {"lower": -1.0, "upper": 9.0}, {"lower": 0.0, "upper": np.nan}):  # fmt: skip
        with pytest.raises(PlanningError, match="limits: "):
            MotionLimits(**wrong)
    with pytest.raises(PlanningError, match="reserve"):
        task.limits.within(0.7, 0.0)
    path = make_path(robot, [pose(0, 0, 0.2), pose(0.1, 0, 0.2)], "smooth")
    with pytest.raises(PlanningError, match="stations: found 3"):
        plan_along_path(task, path, 3)
    X = RigidTransform([0.0, 0.0, 0.2])
    with pytest.raises(PlanningError, match="corners: found 'sharp'"):
        make_path(robot, [X, X], "sharp")
