"""Least time along paths, with own terms, with wrenches to resist: by programs and passes."""

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from pydrake.multibody.optimization import CalcGridPointsOptions, Toppra
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import PrismaticJoint, SpatialInertia
from pydrake.trajectories import PiecewisePolynomial
from scipy.linalg import null_space
from scipy.optimize import linprog, minimize

from cdpr_drake.analyses.planning.plan_tracking import track_plan
from cdpr_drake.analyses.planning.robot_path_task import make_path, robot_limits
from cdpr_drake.geometry.cable_paths import cable_jacobian, cable_paths
from cdpr_drake.geometry.poses import pose_from_row, pose_row
from cdpr_drake.models.platform_schema import PlatformDamping
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.failures import check_held, not_held, stuck
from cdpr_drake.planning.limits import MotionLimits
from cdpr_drake.planning.path_task import ACTIVE, MotionSamples, PathTask, sample_motion, samples_at
from cdpr_drake.planning.path_timing import plan_along_path
from cdpr_drake.planning.path_timing_program import PathTimingProgram, task_asks
from cdpr_drake.planning.resistance import resistance_bounds, resisted, resisted_along, row_count
from cdpr_drake.trajectories.pose_path import POINT_SIZE
from tests.benchmarks.highs import station_programs
from tests.planning.convex_timing import convex_time, difference_asks
from tests.planning.planning_cases import BETWEEN, PATHS, case, planned, pose, task_of, wrench_of

AGREEMENT = 0.01  # of the time, as the planner promises against a fine program
TOPPRA = 2e-3  # of the time: its constraints hold at stations, ours at both ends of each interval

# Least time.


@pytest.mark.parametrize("name", PATHS)
def test_limits_are_kept_and_one_is_always_reached(name):
    uses = np.max(planned(name).samples().uses, axis=1)
    assert np.max(uses) <= 1.0 + BETWEEN
    # Instants within the interval of two stations in which it switches are the others.
    assert np.mean(uses >= 0.99) >= 0.97
    assert np.min(uses) > 0.9


@pytest.mark.parametrize(("name", "count"), [("planar", 150), ("caroca", 200)])
def test_the_time_is_that_of_a_convex_program(name, count):
    plan = planned(name)
    reference = convex_time(load_robot(name), plan.task, plan.path, count)
    np.testing.assert_allclose(plan.duration, reference, rtol=AGREEMENT)


def test_without_limits_of_speed_the_largest_speed_of_a_station_is_that_of_highs():
    robot = load_robot("acrobot_large")
    task = task_of(robot, cable_speed=1e3)
    path = make_path(
        robot, [pose(0.0, 0.0, 0.2), pose(0.15, -0.1, 0.4), pose(-0.1, 0.1, 0.3)], "smooth"
    )
    plan, some = plan_along_path(task, path, 20), slice(4, -4, 4)
    programs = station_programs(task, path, plan.trajectory.stations[some])
    largest = [linprog(**program).x[1] for program in programs]
    np.testing.assert_allclose(np.minimum(plan.largest[some], 100.0), largest, rtol=1e-6)


@pytest.mark.parametrize("name", PATHS)
def test_its_tensions_move_the_platform(name):
    """Along the motion itself: wrench by computed torque, lengths by differences."""
    plan, h = planned(name), 1e-5
    motion, task, samples = plan.trajectory, plan.task, plan.samples()
    rows = list(task.dynamics.motions)
    for k in np.linspace(20, len(samples.times) - 20, 5).astype(int):
        t = samples.times[k]
        X = motion.pose(t)
        needed = wrench_of(task.dynamics, X, motion.velocity(t), motion.acceleration(t))
        given = -cable_jacobian(X, task.cables).T @ samples.tensions[k]
        np.testing.assert_allclose(given[rows], needed[rows], atol=1e-7 * np.max(samples.tensions))
        before, here, after = (
            cable_paths(motion.pose(t + d), task.cables).lengths for d in (-h, 0.0, h)
        )
        np.testing.assert_allclose(samples.cable_speeds[k], (after - before) / (2.0 * h), atol=1e-4)
        around = motion.acceleration(t - h), motion.acceleration(t + h)
        if np.allclose(*around, rtol=1e-2, atol=1e-12):
            second = (after - 2.0 * here + before) / h**2
            np.testing.assert_allclose(samples.cable_accelerations[k], second, atol=0.02)


def toppra_time(plan, speed, acceleration):
    """Drake's Toppra on a plant whose joints are the cable lengths, on the same path."""
    stations, m = plan.trajectory.stations, plan.task.cables.count
    lengths = [cable_paths(plan.path.pose(s), plan.task.cables).lengths for s in stations]
    path = PiecewisePolynomial.CubicWithContinuousSecondDerivatives(
        stations, np.transpose(lengths), False
    )
    plant = MultibodyPlant(0.0)
    for k in range(m):
        body = plant.AddRigidBody(f"b{k}", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
        joint = PrismaticJoint(f"j{k}", plant.world_frame(), body.body_frame(), [1.0, 0.0, 0.0])
        plant.AddJoint(joint)
    plant.Finalize()
    points = Toppra.CalcGridPoints(path, CalcGridPointsOptions(max_err=1e-5))
    toppra = Toppra(path, plant, points)
    toppra.AddJointVelocityLimit(np.full(m, -speed), np.full(m, speed))
    toppra.AddJointAccelerationLimit(np.full(m, -acceleration), np.full(m, acceleration))
    return toppra.SolvePathParameterization().end_time()


def test_with_limits_of_winches_alone_it_agrees_with_drakes_toppra():
    """Tensions without end: any wrench can be given by cables that pull from all sides."""
    loose, (_, task, _) = load_robot("acrobot_fully_constrained"), case("acrobot_large")
    winches = MotionLimits(lower=0.0, upper=1e6, cable_speed=0.8, cable_acceleration=3.0)
    task = PathTask(loose.cable_set(), task.dynamics, winches)
    poses = [pose(0, 0, 0.4), pose(0.15, -0.1, 0.5, 4, -3, 6), pose(-0.1, 0.1, 0.45)]
    plan = plan_along_path(task, make_path(loose, poses, "smooth"), 1000)
    np.testing.assert_allclose(plan.duration, toppra_time(plan, 0.8, 3.0), rtol=TOPPRA)


def test_it_rests_in_corners_and_is_the_sum_of_its_legs():
    robot, task, _ = case("planar")
    plan = planned("planar", "rest")
    legs = [
        plan_along_path(task, make_path(robot, list(pair), "smooth")).duration
        for pair in pairwise(PATHS["planar"][1])
    ]
    np.testing.assert_allclose(plan.duration, sum(legs), rtol=1e-3)
    corner = plan.path.breaks[list(plan.path.rests)]
    x = plan.trajectory.squared_speeds[np.searchsorted(plan.trajectory.stations, corner)]
    np.testing.assert_array_equal(x, 0.0)


def test_where_it_cannot_rest_the_motion_carries_it_through():
    """A turning point outside of where the platform can be held: not with a rest, nor slowly."""
    robot, task, _ = case("acrobot_large")
    path = make_path(robot, [pose(0, 0, 0.2), pose(0.5, 0.4, 0.6), pose(0, 0.1, 0.2)], "blend")
    plan = plan_along_path(task, path)
    assert np.max(plan.reachable[:, 0]) > 0.1
    assert np.any(np.isnan(plan.largest))
    assert np.max(plan.samples().uses) <= 1.0 + BETWEEN
    assert track_plan(robot, plan, robot_limits(robot, (1.0, 60.0))).keeps_limits()


@pytest.mark.parametrize(("name", "count", "damping"), [
    ("planar", 600, (6.0, 0.2)), ("acrobot_large", 300, (20.0, 0.5)), ("caroca", 200, (2e3, 40.0)),
])  # fmt: skip
def test_the_damping_of_a_platform_is_planned_with(name, count, damping):
    """Against the convex program, which has it at the roots, and the simulated damped robot."""
    robot, free = load_robot(name), planned(name)
    robot.damping = PlatformDamping(translation=damping[0], rotation=damping[1])
    task = task_of(robot, PATHS[name][0])
    plan = plan_along_path(task, free.path)
    assert plan.duration > (1.0005 if name == "planar" else 1.05) * free.duration
    assert np.max(plan.samples().uses) <= 1.0 + BETWEEN
    reference = convex_time(robot, task, plan.path, count)
    np.testing.assert_allclose(plan.duration, reference, rtol=AGREEMENT)
    tracked = track_plan(robot, plan, robot_limits(robot, PATHS[name][0]))
    assert tracked.keeps_limits()
    assert tracked.errors()[0] < 2e-3
    unplanned = replace(plan, task=task, trajectory=free.trajectory)
    assert np.max(unplanned.samples().uses) > 1.0 + BETWEEN


# What is reached, and what fails.


def test_a_limit_is_reached_within_a_share_of_its_range():
    """Tensions by half their range of 100 N, all else by the limit; just inside, just outside."""
    most = MotionLimits(lower=10.0, upper=210.0, cable_speed=4.0, cable_acceleration=5.0,
                        torque=2.0, speed=3.0)  # fmt: skip
    near = np.array([[1.0 - 0.9 * ACTIVE, 1.0 - 1.1 * ACTIVE, 0.0]])
    tensions = 10.0 + 100.0 * np.array([[0.9 * ACTIVE, 1.1 * ACTIVE, 2.0 - 0.9 * ACTIVE]])
    uses = np.array([[0.0, 0.0, 0.0, 1.0 - 0.9 * ACTIVE]])
    zero = np.zeros(1)
    winches = (-4.0 * near, 5.0 * near, -2.0 * near)
    samples = MotionSamples(zero, zero, zero, uses, tensions, *winches, most)
    active = samples.active()
    assert active["tension, lower"].tolist() == [[True, False, False]]
    assert active["tension, upper"].tolist() == [[False, False, True]]
    for name in ("torque", "cable speed", "cable acceleration"):
        assert active[name].tolist() == [[True, False, False]], name
    assert active["speed of Po"].tolist() == [[True]]
    assert not replace(samples, uses=uses - 0.2 * ACTIVE).active()["speed of Po"].any()


@pytest.mark.parametrize("torque", [np.inf, 0.3, 0.15])
def test_cables_that_miss_most_are_named(torque):
    """C1 pulls too much and C3 too little, by as much: also where torques keep their limit."""
    _, task, _ = case("planar")
    task = replace(task, limits=replace(task.limits, torque=torque))
    point = np.concatenate([pose_row(pose(-0.2, -0.42, 0.3)), np.zeros(POINT_SIZE - 7)])
    nearest = not_held(task, point).split("the nearest they come: ")[1].split("; accepted")[0]
    assert tuple(cable.split()[0] for cable in nearest.split(", ")) == ("C1", "C3")


def test_what_stops_a_motion_between_two_points_is_named():
    plan = planned("planar")
    places = np.array([0.1, 0.11])
    points = plan.path.points(places)
    stations, _ = plan.task.stations(points)
    words = stuck(plan.task, points, stations, places, 0.5, 1e-3, np.array([2.0, 3.0]))
    assert re.search(r"s = 0.1 m of 0.5 m.*C\d needs (more|less) than its", words), words


# Own terms of a law of time.

STATIONS = 40
CONE = 1e-6  # of the time; Clarabel stops at 1e-8, scaled
GREEDY = 1e-4  # of the time; passes choose station by station, so a program may be faster by a hair
NEAR = 1e-4  # of squared speeds; the time is flat about its least
LOCAL = 1e-3  # of squared speeds; SNOPT stops at 1e-6 of the slopes, and the cost is flat
SLOW = 0.05  # of the squared speeds of the fastest motion: no limit binds there


def line():
    robot, task, _ = case("acrobot_large")
    return task, make_path(robot, [pose(-0.1, 0, 0.3), pose(0.1, 0.05, 0.35)], "smooth")


def fastest(corners="smooth", task=None):
    _, default, path = case("acrobot_large", corners)
    return plan_along_path(task or default, path, STATIONS)


def program(corners="smooth"):
    _, task, path = case("acrobot_large", corners)
    return PathTimingProgram(task, path, STATIONS)


def time_of(x, places):
    root = np.sqrt(x)
    return np.sum(2.0 * np.diff(places) / (root[1:] + root[:-1]))


def least_by_scipy(places, extra, start):
    """The least of time and a cost over squared speeds alone, where no limit binds."""

    def whole(y):
        x = np.concatenate([[0.0], np.exp(y), [0.0]])
        return time_of(x, places) + extra(x)

    best = minimize(whole, np.log(start[1:-1]), method="L-BFGS-B",
                    options={"ftol": 1e-15, "gtol": 1e-10, "maxfun": 10**6})  # fmt: skip
    return np.concatenate([[0.0], np.exp(best.x), [0.0]])


@pytest.mark.parametrize("corners", ["smooth", "rest"])
def test_with_nothing_added_the_passes_answer_and_a_cost_of_nothing_changes_no_time(corners):
    """They share what points ask, not how the best speeds are found; also with rests at corners."""
    law, plan = program(corners), fastest(corners)
    alone = law.Solve()
    assert alone.program is None
    assert alone.trajectory.squared_speeds.tobytes() == plan.trajectory.squared_speeds.tobytes()
    law.AddQuadraticCost(0.0, 0.0, name="nothing")
    solution = law.Solve()
    assert (1.0 - GREEDY) * plan.duration <= solution.duration <= (1.0 + CONE) * plan.duration
    assert solution.program.cost == pytest.approx(solution.duration, rel=1e-4)
    assert solution.program.solver == "Clarabel"
    assert solution.program.own_costs == {"nothing": 0.0}


def test_a_quadratic_preference_is_what_scipy_finds():
    law, aim, weight = program(), SLOW * fastest().trajectory.squared_speeds, 1e3
    law.AddQuadraticCost(aim, weight, name="slow")
    x = law.Solve().trajectory.squared_speeds
    other = least_by_scipy(law.places, lambda x: weight * np.sum((x - aim) ** 2), aim)
    np.testing.assert_allclose(x, other, rtol=0.0, atol=NEAR * np.max(other))


def test_a_linear_bound_of_accelerations_is_the_closed_form():
    """From rest to rest over L with |d2s/dt2| <= a: T = 2 sqrt(L / a)."""
    task, path = line()
    law = PathTimingProgram(task, path, even=STATIONS)
    law.AddLinearConstraint(np.eye(STATIONS), -0.2, 0.2, of="accelerations", name="gentle")
    solution = law.Solve()
    assert solution.duration == pytest.approx(2.0 * np.sqrt(path.length / 0.2), rel=CONE)
    assert np.max(solution.samples().uses) < 1.0
    assert solution.program.own_constraints == ("gentle",)


def test_a_linear_bound_of_tensions_is_a_task_with_lower_limits():
    """Against the passes, to which the same bound is a limit."""
    law, (_, task, _) = program(), case("acrobot_large")
    law.AddLinearConstraint(
        np.eye(len(law.values("tensions").offset)), -np.inf, 12.0, of="tensions"
    )
    other = fastest(task=replace(task, limits=replace(task.limits, upper=12.0)))
    assert other.duration > 1.01 * fastest().duration
    assert law.Solve().duration == pytest.approx(other.duration, rel=GREEDY)


def test_one_cable_by_its_name():
    law, (_, task, _) = program(), case("acrobot_large")
    rows = len(law.values(task.name(2)).offset)
    assert rows == 2 * (len(law.places) - 1)
    law.AddLinearConstraint(np.eye(rows), 4.0, 7.0, of=task.name(2))
    assert law.Solve().duration > fastest().duration
    assert law.tensions().shape == (len(law.places) - 1, 2, 8)


def test_a_nonlinear_cost_is_what_scipy_finds():
    task, path = line()
    law, plan = PathTimingProgram(task, path, even=16), plan_along_path(task, path, STATIONS)
    motion = plan.trajectory
    start = SLOW * np.interp(law.places, motion.stations, motion.squared_speeds)
    size = np.max(start)

    def steep(x):
        return 2.0 * np.sum(np.exp(x / size) - 1.0)

    law.AddCost(steep, name="steep")
    solution = law.Solve()
    x, other = solution.trajectory.squared_speeds, least_by_scipy(law.places, steep, start)
    np.testing.assert_allclose(x, other, rtol=0.0, atol=LOCAL * np.max(other))
    whole = [time_of(one, law.places) + steep(one) for one in (x, other)]
    assert whole[0] == pytest.approx(whole[1], rel=CONE)
    assert solution.program.own_costs["steep"] == pytest.approx(steep(x), rel=1e-3)


def test_what_points_ask_is_what_differences_of_poses_say():
    """Tensions of least norm that a speed and an acceleration need, by both; statics apart."""
    robot, task, path = case("acrobot_large")
    task = replace(task, dynamics=replace(task.dynamics, damping=(7.0, 0.9)))
    places = np.linspace(0.1, 0.9, 7) * path.length
    both = task_asks(task)(path, places), difference_asks(robot, task)(path, places)
    for u, x in ((0.0, 0.0), (0.7, 0.0), (0.0, 0.4), (-0.5, 0.3)):
        ours, theirs = (
            np.array([
                np.linalg.pinv(E) @ (b + u * a + x * c + np.sqrt(x) * d) for E, a, c, d, b in zip(
                    asks.balance, asks.by_u, asks.by_x, asks.by_root, asks.rest, strict=True)
            ])
            for asks in both
        )  # fmt: skip
        np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=1e-4 * np.max(np.abs(ours)))
    for E in both[0].balance:
        np.testing.assert_allclose(E @ E.T, np.eye(6), atol=1e-12)
        assert null_space(E).shape == (8, 2)
    np.testing.assert_allclose(both[0].rates, both[1].rates, atol=1e-6)
    np.testing.assert_allclose(both[0].bends, both[1].bends, atol=1e-3)


# Wrenches to resist.

EXACT = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
SAME = 1e-9  # of half the range, of margins by two solvers; HiGHS's tolerances over limits


def without(plan):
    return plan_along_path(replace(plan.task, resist=np.empty((0, 6))), plan.path)


def least_miss(task, point, u, x, corner):
    """Largest d with tensions d half ranges within all limits, by HiGHS on W t + w = 0 itself."""
    X, V = pose_from_row(point[:7]), point[7:13] * np.sqrt(x)
    needed = wrench_of(task.dynamics, X, V, point[7:13] * u + point[13:19] * x)
    rows, lim, m = list(task.dynamics.motions), task.limits, task.cables.count
    W, half = -cable_jacobian(X, task.cables).T[rows], 0.5 * (lim.upper - lim.lower)
    stations, _ = task.stations(point[np.newaxis])
    growth = stations[0, 3] * u + stations[0, 4] * x
    mass, span = lim.inertia / lim.ratio**2, lim.torque / lim.ratio
    eye, one = np.eye(m), np.ones((m, 1))
    A_ub = [np.hstack([eye, half * one]), np.hstack([-eye, half * one])]
    b_ub = [np.full(m, lim.upper), np.full(m, -lim.lower)]
    if np.isfinite(span):
        A_ub += [np.hstack([eye, span * one]), np.hstack([-eye, span * one])]
        b_ub += [span + mass * growth, span - mass * growth]
    best = linprog(
        np.append(np.zeros(m), -1.0), np.vstack(A_ub), np.concatenate(b_ub),
        np.hstack([W, np.zeros((len(rows), 1))]), needed[rows] - corner[rows],
        bounds=[(None, None)] * m + [(None, 1.0)], options=EXACT,
    )  # fmt: skip
    assert best.status == 0
    return -best.fun


@pytest.mark.parametrize(
    ("name", "faster", "harder"),
    [("planar", 8.0, 6.0), ("acrobot_large", 0.3, 2.0), ("caroca", 0.15, 8.0)],
)
def test_bounds_give_the_verdicts_of_linear_programs(name, faster, harder):
    """Random poses, accelerations, speeds and corners, near the limits and beyond them."""
    rng, count, zero = np.random.default_rng(5), 120, np.zeros(1)
    _, task, path = case(name, resist=True)
    points = path.points(rng.uniform(0.0, path.length, count))
    u, x = 6.0 * faster * rng.standard_normal(count), 2.0 * faster * rng.uniform(size=count) ** 3
    inside = outside = 0
    for k in range(count):
        point, at = points[k : k + 1], slice(k, k + 1)
        corner = task.resist[rng.integers(len(task.resist))] * rng.uniform(0.0, harder)
        one = replace(task, resist=corner[np.newaxis])
        uses = samples_at(one, point, zero, zero, u[at], np.sqrt(x[at]))
        d = least_miss(task, point[0], u[k], x[k], corner)
        alone = least_miss(task, point[0], u[k], x[k], np.zeros(6))
        margins = resisted(one, point, zero, u[at], x[at]).margins
        np.testing.assert_allclose(margins[0], d, atol=SAME)
        if abs(d) > SAME and (alone > SAME or np.isinf(task.limits.torque)):
            assert (uses.resisted[0] <= 1.0) == (d >= 0.0)
            inside, outside = inside + (d >= 0.0), outside + (d < 0.0)
    assert min(inside, outside) > 0.08 * count


@pytest.mark.parametrize("name", PATHS)
def test_a_plan_resists_between_its_stations_and_is_not_faster(name):
    plan = planned(name, resist=True)
    free = without(plan)
    assert plan.duration >= free.duration * (1.0 - SAME)
    times = np.random.default_rng(1).uniform(0.0, plan.duration, 2000)
    assert np.max(sample_motion(plan.task, plan.trajectory, times).resisted) <= 1.0 + BETWEEN
    missed = sample_motion(plan.task, free.trajectory, times)
    assert np.max(missed.resisted) > 1.0 + 3 * BETWEEN  # what a plan without it would do
    assert np.all(plan.largest <= free.largest * (1.0 + 1e-9))
    if name == "acrobot_large":
        assert np.any(plan.largest < 0.9 * free.largest)


def test_the_margins_of_corners_are_told_and_the_least_is_zero():
    plan = planned("acrobot_large", resist=True)
    corners = resisted_along(plan.task, plan.trajectory)
    assert len(corners.margins) == 64
    np.testing.assert_allclose(np.min(corners.margins), 0.0, atol=1e-6)
    assert np.mean(plan.samples().active()["wrench to resist"]) > 0.9
    # A convex combination of corners is resisted, too.
    inner = np.random.default_rng(2).dirichlet(np.ones(64), 20) @ plan.task.resist
    more = resisted_along(replace(plan.task, resist=inner), plan.trajectory)
    assert np.min(more.margins) >= -1e-9


def test_wrenches_that_a_pose_resists_hold_and_there_are_so_many_bounds():
    _, task, _ = case("acrobot_large", resist=True)
    check_held(task, PATHS["acrobot_large"][1][0], "start")
    _, task, path = case("caroca", resist=True)
    assert row_count(task) == 896
    point = path.points(np.zeros(1))
    assert resistance_bounds(task, point, task.stations(point)[0]).shape == (1, 896, 4)
    assert row_count(case("planar", resist=True)[1]) == 12


def test_of_stations_that_no_speed_joins_the_cables_are_named():
    _, task, _ = case("acrobot_large", resist=True)
    points = np.zeros((2, POINT_SIZE))
    points[:, :7] = pose_row(pose(0.1, 0.0, 0.3))
    points[:, 10] = 1.0
    places, goal = np.array([0.0, 1e-3]), np.array([0.5, 0.6])
    words = stuck(task, points, task.stations(points)[0], places, 1.0, 0.01, goal)
    assert "cannot resist the wrenches together" in words
